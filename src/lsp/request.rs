//! Answers to requests about the client's current text.

use std::path::PathBuf;
use std::sync::Arc;

use lsp_server::ErrorCode;
use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentHighlightRequest, DocumentLinkRequest,
    DocumentSymbolRequest, FoldingRangeRequest, Formatting, GotoDefinition, HoverRequest,
    Initialize, InlayHintRequest, PrepareRenameRequest, References, Rename, Request,
    SemanticTokensFullRequest,
};
use lsp_types::{
    CodeActionParams, CodeActionResponse, CompletionResponse, DocumentSymbolResponse,
    GotoDefinitionResponse, Hover, HoverContents, MarkupContent, MarkupKind, Position,
    PrepareRenameResponse, SemanticTokens, SemanticTokensResult, TextDocumentIdentifier,
    TextDocumentPositionParams, TextEdit, Uri,
};
use serde::Deserialize;
use serde_json::Value;

use super::background::{Failure, Stop, Work};
use super::diagnostic::diagnostic_of;
use super::open_show::{OpenShow, name_at};
use super::text::{Encoding, Lines};
use super::workspace::{Workspace, key};
use super::{action, complete, hover, name, outline};
use footlight_engine as engine;
use footlight_show::diagnostic::Diagnostic;
use footlight_show::lang::edit::difference;

/// The answer to a request.
pub enum Answer {
    /// An immediate answer.
    Now(Value),
    /// A slow answer about a show: in a large text it takes longer than a keystroke may wait.
    Later(PathBuf, Work),
}

/// True for methods that need only the text, so that the show need not be read again.
pub fn needs_only_text(method: &str) -> bool {
    [
        SemanticTokensFullRequest::METHOD,
        FoldingRangeRequest::METHOD,
        DocumentSymbolRequest::METHOD,
        DocumentHighlightRequest::METHOD,
        Formatting::METHOD,
    ]
    .contains(&method)
}

/// Answers a request.
///
/// # Errors
/// For an unknown method, invalid parameters, and requests that cannot be done.
pub fn answer(workspace: &Workspace, method: &str, params: Value) -> Result<Answer, Failure> {
    let encoding = workspace.encoding;
    match method {
        Completion::METHOD => now::<Completion>(params, |asked| {
            let found = place(workspace, &asked.text_document_position);
            let offer = |(show, text, at): Place<'_>| complete::complete(show, &text, at, encoding);
            found.map(offer).map(CompletionResponse::Array)
        }),
        HoverRequest::METHOD => now::<HoverRequest>(params, |asked| {
            hover(workspace, &asked.text_document_position_params)
        }),
        PrepareRenameRequest::METHOD => now::<PrepareRenameRequest>(params, |asked| {
            let found = place(workspace, &asked).and_then(|(_, text, at)| {
                let range = name_at(&text, at)?;
                Some(Lines::new(&text, encoding).range(&range))
            });
            found.map(PrepareRenameResponse::Range)
        }),
        InlayHintRequest::METHOD => now::<InlayHintRequest>(params, |asked| {
            let found = workspace.at(&asked.text_document.uri);
            found.map(|(show, text)| outline::hints(show, &text, encoding))
        }),
        CodeLensRequest::METHOD => now::<CodeLensRequest>(params, |asked| {
            let uri = asked.text_document.uri;
            let found = workspace.at(&uri);
            found.map(|(show, text)| outline::lenses(show, (&text, &uri), encoding))
        }),
        GotoDefinition::METHOD => later::<GotoDefinition>(workspace, params, |_, texts, _| {
            let declares = |declares: bool| declares;
            let found = name::locations(&texts.show, texts.here(), declares, texts.encoding);
            Ok(Some(GotoDefinitionResponse::Array(found)))
        }),
        References::METHOD => later::<References>(workspace, params, |asked, texts, _| {
            let with_declarations = asked.context.include_declaration;
            let wanted = |declares: bool| with_declarations || !declares;
            let found = name::locations(&texts.show, texts.here(), wanted, texts.encoding);
            Ok(Some(found))
        }),
        DocumentHighlightRequest::METHOD => {
            later::<DocumentHighlightRequest>(workspace, params, |_, texts, _| {
                Ok(Some(name::highlights(texts.here(), texts.encoding)))
            })
        }
        Rename::METHOD => later::<Rename>(workspace, params, |asked, texts, _| {
            let edit = name::rename(&texts.show, texts.here(), &asked.new_name, texts.encoding);
            edit.map(Some)
                .map_err(|why| (ErrorCode::RequestFailed, why))
        }),
        CodeActionRequest::METHOD => {
            later::<CodeActionRequest>(workspace, params, |asked, texts, stop| {
                Ok(Some(actions(&asked, texts, stop)))
            })
        }
        Formatting::METHOD => {
            later::<Formatting>(workspace, params, |_, texts, _| Ok(Some(formatted(texts))))
        }
        DocumentSymbolRequest::METHOD => {
            later::<DocumentSymbolRequest>(workspace, params, |_, texts, stop| {
                let symbols = outline::symbols(&texts.text, texts.encoding, stop);
                Ok(Some(DocumentSymbolResponse::Nested(symbols)))
            })
        }
        FoldingRangeRequest::METHOD => {
            later::<FoldingRangeRequest>(workspace, params, |_, texts, stop| {
                Ok(Some(outline::folds(&texts.text, texts.encoding, stop)))
            })
        }
        SemanticTokensFullRequest::METHOD => {
            later::<SemanticTokensFullRequest>(workspace, params, |_, texts, stop| {
                let data = outline::pieces(&texts.text, texts.encoding, stop);
                let result_id = None;
                let tokens = SemanticTokens { result_id, data };
                Ok(Some(SemanticTokensResult::Tokens(tokens)))
            })
        }
        DocumentLinkRequest::METHOD => {
            later::<DocumentLinkRequest>(workspace, params, |_, texts, stop| {
                let links = outline::links(&texts.show, &texts.text, texts.encoding, stop);
                Ok(Some(links))
            })
        }
        Initialize::METHOD => Err((
            ErrorCode::InvalidRequest,
            "the server is initialized already".to_owned(),
        )),
        other => Err((
            ErrorCode::MethodNotFound,
            format!("`{other}` is nothing that this server does"),
        )),
    }
}

/// Answers a typed request.
fn now<R: Request>(
    params: Value,
    answered: impl FnOnce(R::Params) -> R::Result,
) -> Result<Answer, Failure> {
    let asked = parameters::<R>(params)?;
    written::<R>(&answered(asked)).map(Answer::Now)
}

/// The text and, if any, the position of a request.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct About {
    text_document: TextDocumentIdentifier,
    #[serde(default)]
    position: Position,
}

/// Answers a typed request about an open text later; null when the text is not open.
fn later<R: Request>(
    workspace: &Workspace,
    params: Value,
    answered: impl FnOnce(R::Params, &Texts, &Stop) -> Result<R::Result, Failure> + Send + 'static,
) -> Result<Answer, Failure>
where
    R::Params: Send + 'static,
{
    let about = About::deserialize(&params);
    let asked = parameters::<R>(params)?;
    let about = about.map_err(invalid)?;
    let uri = about.text_document.uri;
    let Some((show, text)) = workspace.at(&uri) else {
        return Ok(Answer::Now(Value::Null));
    };
    let root = show.path().to_owned();
    let texts = Texts {
        show: show.texts(),
        text,
        position: about.position,
        uri,
        encoding: workspace.encoding,
    };
    let work = move |stop: &Stop| written::<R>(&answered(asked, &texts, stop)?);
    Ok(Answer::Later(root, Box::new(work)))
}

fn parameters<R: Request>(params: Value) -> Result<R::Params, Failure> {
    serde_json::from_value(params).map_err(invalid)
}

fn invalid(error: serde_json::Error) -> Failure {
    (ErrorCode::InvalidParams, error.to_string())
}

fn written<R: Request>(result: &R::Result) -> Result<Value, Failure> {
    serde_json::to_value(result).map_err(|error| (ErrorCode::InternalError, error.to_string()))
}

/// A text and those of its show at the time of a request.
struct Texts {
    show: OpenShow,
    text: Arc<String>,
    /// The position of the request; the start for a whole text.
    position: Position,
    uri: Uri,
    encoding: Encoding,
}

impl Texts {
    fn here(&self) -> (&str, usize) {
        let lines = Lines::new(&self.text, self.encoding);
        (&self.text, lines.byte(self.position))
    }
}

/// A show, one of its texts, and a byte of that.
type Place<'s> = (&'s OpenShow, Arc<String>, usize);

fn place<'s>(workspace: &'s Workspace, position: &TextDocumentPositionParams) -> Option<Place<'s>> {
    let (show, text) = workspace.at(&position.text_document.uri)?;
    let at = Lines::new(&text, workspace.encoding).byte(position.position);
    Some((show, text, at))
}

fn hover(workspace: &Workspace, position: &TextDocumentPositionParams) -> Option<Hover> {
    let (show, text, at) = place(workspace, position)?;
    let (words, range) = hover::hover(show, &text, at)?;
    Some(Hover {
        contents: HoverContents::Markup(MarkupContent {
            kind: MarkupKind::Markdown,
            value: words,
        }),
        range: Some(Lines::new(&text, workspace.encoding).range(&range)),
    })
}

fn actions(asked: &CodeActionParams, texts: &Texts, stop: &Stop) -> CodeActionResponse {
    let Texts {
        show,
        text,
        uri,
        encoding,
        ..
    } = texts;
    let path = key(uri);
    let own = |file| !stop.is_set() && show.file(file).is_some_and(|(own, _)| own == path);
    let lines = show.lines(*encoding);
    let shown = |diagnostic: &Diagnostic| diagnostic_of(show, &lines, diagnostic);
    action::actions(show, (text, uri), asked.range, *encoding, own, shown)
}

/// Edits that format a text; none when it does not parse, because its errors are diagnostics
/// already.
fn formatted(texts: &Texts) -> Vec<TextEdit> {
    let text = texts.text.as_str();
    let new = engine::format("", text.as_bytes()).ok();
    let Some(new) = new.filter(|new| new != text) else {
        return Vec::new();
    };
    let (range, new) = difference(text, &new);
    let range = Lines::new(text, texts.encoding).range(&range);
    vec![TextEdit::new(range, new.to_owned())]
}
