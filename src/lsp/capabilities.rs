//! Capabilities of the server.

use lsp_types::TextDocumentSyncKind;
use serde_json::{Value, json};

use super::outline::{PICTURE, legend};
use super::text::Encoding;

/// The server's capabilities for a client with this encoding of columns.
pub fn of_server(encoding: Encoding) -> Value {
    json!({
        "positionEncoding": encoding.kind(),
        "textDocumentSync": {
            "openClose": true,
            "change": TextDocumentSyncKind::INCREMENTAL,
            "save": { "includeText": false },
        },
        "completionProvider": { "triggerCharacters": ["\"", "/", "(", "="] },
        "hoverProvider": true,
        "definitionProvider": true,
        "referencesProvider": true,
        "documentHighlightProvider": true,
        "renameProvider": { "prepareProvider": true },
        "documentSymbolProvider": true,
        "foldingRangeProvider": true,
        "documentFormattingProvider": true,
        "semanticTokensProvider": {
            "legend": { "tokenTypes": legend(), "tokenModifiers": [] },
            "full": true,
        },
        "inlayHintProvider": true,
        "documentLinkProvider": { "resolveProvider": false },
        "codeActionProvider": true,
        "codeLensProvider": { "resolveProvider": false },
        "executeCommandProvider": { "commands": [PICTURE] },
    })
}
