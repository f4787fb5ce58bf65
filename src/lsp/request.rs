//! Answers to requests about one text, where it stands as the client has it.

use std::sync::Arc;

use lsp_server::ErrorCode;
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest, DocumentLinkRequest,
    DocumentSymbolRequest, FoldingRangeRequest, Formatting, GotoDefinition, HoverRequest,
    InlayHintRequest, PrepareRenameRequest, References, Rename, Request, SemanticTokensFullRequest,
};
use lsp_types::{
    CodeActionParams, CodeActionResponse, CompletionResponse, DocumentSymbolResponse,
    GotoDefinitionResponse, Hover, HoverContents, Location, MarkupContent, MarkupKind,
    PrepareRenameResponse, ReferenceParams, RenameParams, SemanticTokens, SemanticTokensResult,
    TextDocumentIdentifier, TextDocumentPositionParams, TextEdit, WorkspaceEdit,
};
use serde_json::Value;

use super::diagnostic::diagnostic_of;
use super::open_show::OpenShow;
use super::server::{Server, key};
use super::text::{Lines, difference};
use super::{action, complete, hover, name, outline};
use crate::diagnostic::Diagnostic;
use crate::engine;

/// What a client is sent where a request fails.
type Failure = (ErrorCode, String);

/// The answer to a request as the protocol writes it.
///
/// # Errors
/// Of an unknown method, of parameters that are not the method's, and of what cannot be done.
pub fn answer(server: &Server<'_>, method: &str, params: Value) -> Result<Value, Failure> {
    let encoding = server.encoding;
    match method {
        Completion::METHOD => of::<Completion>(params, |asked| {
            let found = place(server, &asked.text_document_position);
            let offer = |(show, text, at): Place<'_>| complete::complete(show, &text, at, encoding);
            Ok(found.map(offer).map(CompletionResponse::Array))
        }),
        HoverRequest::METHOD => of::<HoverRequest>(params, |asked| {
            Ok(hover(server, &asked.text_document_position_params))
        }),
        GotoDefinition::METHOD => of::<GotoDefinition>(params, |asked| {
            let found = place(server, &asked.text_document_position_params);
            let found = found.map(|(show, text, at)| {
                name::locations(show, (&text, at), |declares| declares, encoding)
            });
            Ok(found.map(GotoDefinitionResponse::Array))
        }),
        References::METHOD => of::<References>(params, |asked| Ok(references(server, &asked))),
        DocumentHighlightRequest::METHOD => of::<DocumentHighlightRequest>(params, |asked| {
            let found = place(server, &asked.text_document_position_params);
            Ok(found.map(|(_, text, at)| name::highlights((&text, at), encoding)))
        }),
        PrepareRenameRequest::METHOD => of::<PrepareRenameRequest>(params, |asked| {
            let found = place(server, &asked).and_then(|(_, text, at)| {
                let range = name::name_at(&text, at)?;
                Some(Lines::new(&text, encoding).range(&range))
            });
            Ok(found.map(PrepareRenameResponse::Range))
        }),
        Rename::METHOD => of::<Rename>(params, |asked| rename(server, &asked)),
        CodeActionRequest::METHOD => {
            of::<CodeActionRequest>(params, |asked| Ok(actions(server, &asked)))
        }
        Formatting::METHOD => {
            of::<Formatting>(params, |asked| Ok(formatted(server, &asked.text_document)))
        }
        _ => of_structure(server, method, params),
    }
}

/// Answers about the structure of a whole text.
fn of_structure(server: &Server<'_>, method: &str, params: Value) -> Result<Value, Failure> {
    let encoding = server.encoding;
    match method {
        DocumentSymbolRequest::METHOD => of::<DocumentSymbolRequest>(params, |asked| {
            let found = server.at(&asked.text_document.uri);
            let symbols = found.map(|(_, text)| outline::symbols(&text, encoding));
            Ok(symbols.map(DocumentSymbolResponse::Nested))
        }),
        FoldingRangeRequest::METHOD => of::<FoldingRangeRequest>(params, |asked| {
            let found = server.at(&asked.text_document.uri);
            Ok(found.map(|(_, text)| outline::folds(&text, encoding)))
        }),
        SemanticTokensFullRequest::METHOD => of::<SemanticTokensFullRequest>(params, |asked| {
            let found = server.at(&asked.text_document.uri);
            let tokens = found.map(|(_, text)| SemanticTokens {
                result_id: None,
                data: outline::pieces(&text, encoding),
            });
            Ok(tokens.map(SemanticTokensResult::Tokens))
        }),
        InlayHintRequest::METHOD => of::<InlayHintRequest>(params, |asked| {
            let found = server.at(&asked.text_document.uri);
            Ok(found.map(|(show, text)| outline::hints(show, &text, encoding)))
        }),
        DocumentLinkRequest::METHOD => of::<DocumentLinkRequest>(params, |asked| {
            let found = server.at(&asked.text_document.uri);
            Ok(found.map(|(show, text)| outline::links(show, &text, encoding)))
        }),
        CodeLensRequest::METHOD => of::<CodeLensRequest>(params, |asked| {
            let uri = asked.text_document.uri;
            let found = server.at(&uri);
            Ok(found.map(|(show, text)| outline::lenses(show, (&text, &uri), encoding)))
        }),
        other => Err((
            ErrorCode::MethodNotFound,
            format!("`{other}` is nothing that this server does"),
        )),
    }
}

/// Answers a request of a type.
fn of<R: Request>(
    params: Value,
    answered: impl FnOnce(R::Params) -> Result<R::Result, Failure>,
) -> Result<Value, Failure> {
    let params = serde_json::from_value(params)
        .map_err(|error| (ErrorCode::InvalidParams, error.to_string()))?;
    serde_json::to_value(answered(params)?)
        .map_err(|error| (ErrorCode::InternalError, error.to_string()))
}

/// A show, one of its texts, and a byte of that.
type Place<'s> = (&'s OpenShow, Arc<String>, usize);

/// What stands at a position.
fn place<'s>(server: &'s Server<'_>, position: &TextDocumentPositionParams) -> Option<Place<'s>> {
    let (show, text) = server.at(&position.text_document.uri)?;
    let at = Lines::new(&text, server.encoding).byte(position.position);
    Some((show, text, at))
}

fn hover(server: &Server<'_>, position: &TextDocumentPositionParams) -> Option<Hover> {
    let (show, text, at) = place(server, position)?;
    let (words, range) = hover::hover(show, &text, at)?;
    Some(Hover {
        contents: HoverContents::Markup(MarkupContent {
            kind: MarkupKind::Markdown,
            value: words,
        }),
        range: Some(Lines::new(&text, server.encoding).range(&range)),
    })
}

fn references(server: &Server<'_>, asked: &ReferenceParams) -> Option<Vec<Location>> {
    let (show, text, at) = place(server, &asked.text_document_position)?;
    let with_declarations = asked.context.include_declaration;
    let wanted = |declares: bool| with_declarations || !declares;
    Some(name::locations(show, (&text, at), wanted, server.encoding))
}

fn rename(server: &Server<'_>, asked: &RenameParams) -> Result<Option<WorkspaceEdit>, Failure> {
    let Some((show, text, at)) = place(server, &asked.text_document_position) else {
        return Ok(None);
    };
    let edit = name::rename(show, (&text, at), &asked.new_name, server.encoding);
    edit.map(Some)
        .map_err(|why| (ErrorCode::RequestFailed, why))
}

fn actions(server: &Server<'_>, asked: &CodeActionParams) -> Option<CodeActionResponse> {
    let uri = &asked.text_document.uri;
    let (show, text) = server.at(uri)?;
    let own = |file| show.file(file).is_some_and(|(path, _)| path == key(uri));
    let lines = server.lines(show);
    let shown = |diagnostic: &Diagnostic| diagnostic_of(show, &lines, diagnostic);
    let range = asked.range;
    let text = (text.as_str(), uri);
    Some(action::actions(
        show,
        text,
        range,
        server.encoding,
        own,
        shown,
    ))
}

/// What makes a text as `fmt` would write it; nothing where it does not parse, as its errors are
/// diagnostics already.
fn formatted(server: &Server<'_>, document: &TextDocumentIdentifier) -> Option<Vec<TextEdit>> {
    let (_, text) = server.at(&document.uri)?;
    let new = engine::format("", text.as_bytes(), server.means.limits.memory).ok();
    let Some(new) = new.filter(|new| *new != *text) else {
        return Some(Vec::new());
    };
    let (range, new) = difference(&text, &new);
    let range = Lines::new(&text, server.encoding).range(&range);
    Some(vec![TextEdit::new(range, new.to_owned())])
}
