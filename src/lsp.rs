//! The language server: a client's texts in, what the engine knows of them out.
//!
//! It has no idea of the language of its own: text is read by [`crate::lang`], shows by the engine,
//! completion and help are the prompt's. Open texts are the truth, not the disk; broken text keeps
//! the last good show. One thread answers, another makes pictures. Changes that came in together are
//! read once.

mod action;
mod buffers;
mod complete;
mod hover;
mod name;
mod outline;
mod picture;
mod sheet;
mod text;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::{
    CodeActionParams, CodeActionProviderCapability, CodeLensOptions, CodeLensParams,
    CompletionOptions, CompletionParams, DiagnosticRelatedInformation, DiagnosticSeverity,
    DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    DidSaveTextDocumentParams, DocumentLinkOptions, ExecuteCommandOptions, ExecuteCommandParams,
    FoldingRangeProviderCapability, GotoDefinitionParams, Hover, HoverContents, HoverParams,
    HoverProviderCapability, InitializeParams, Location, MarkupContent, MarkupKind, NumberOrString,
    OneOf, PublishDiagnosticsParams, ReferenceParams, RenameOptions, RenameParams, SaveOptions,
    SemanticTokens, SemanticTokensFullOptions, SemanticTokensLegend, SemanticTokensOptions,
    ServerCapabilities, TextDocumentIdentifier, TextDocumentPositionParams,
    TextDocumentSyncCapability, TextDocumentSyncKind, TextDocumentSyncOptions,
    TextDocumentSyncSaveOptions, TextEdit, Uri,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use self::buffers::{Buffer, Buffers, path_of, uri_of};
use self::outline::PICTURE;
use self::picture::{Client, Job, Pictures};
use self::sheet::{Sheet, root_of};
use self::text::{Encoding, Lines, difference};
use crate::diagnostic::{Diagnostic, Severity};
use crate::engine::{self, Host};
use crate::files::Files;
use crate::units::CueNumber;

pub use self::sheet::Limits;

/// The means to read and render the show at a path, whose files these are.
pub type MeansOf = dyn Fn(&Path, Box<dyn Files>) -> Host;

/// What the embedding program gives: limits, and the means to render the show at a path.
pub struct Means {
    pub limits: Limits,
    pub host: Box<MeansOf>,
}

/// Serves the client at standard input and output until it leaves.
///
/// # Errors
/// As [`serve`]; where these break off.
pub fn serve_standard(means: Means) -> Result<(), String> {
    let (connection, threads) = Connection::stdio();
    let served = serve(&connection, means);
    drop(connection);
    served.and(threads.join().map_err(|error| error.to_string()))
}

/// Serves a client until it leaves.
///
/// # Errors
/// What is wrong with the messages, where these are not the protocol's.
pub fn serve(connection: &Connection, means: Means) -> Result<(), String> {
    let (id, params) = match connection.initialize_start() {
        Err(error) if error.channel_is_disconnected() => return Ok(()),
        begun => begun.map_err(|e| e.to_string())?,
    };
    let params: InitializeParams = serde_json::from_value(params).map_err(|e| e.to_string())?;
    let general = params.capabilities.general.as_ref();
    let offered = general.and_then(|general| general.position_encodings.as_deref());
    let encoding = Encoding::negotiated(offered);
    let window = params.capabilities.window.as_ref();
    let client = Client {
        takes_progress: window.and_then(|w| w.work_done_progress).unwrap_or(false),
        shows_documents: window
            .and_then(|w| w.show_document.as_ref())
            .is_some_and(|s| s.support),
    };
    let answer = json!({
        "capabilities": capabilities(encoding),
        "serverInfo": { "name": "footlight", "version": env!("CARGO_PKG_VERSION") },
    });
    connection
        .initialize_finish(id, answer)
        .map_err(|e| e.to_string())?;
    let mut server = Server {
        pictures: Pictures::new(connection.sender.clone()),
        connection,
        means,
        encoding,
        client,
        buffers: Buffers::default(),
        sheets: BTreeMap::new(),
        roots: BTreeMap::new(),
        changed: BTreeSet::new(),
        queue: VecDeque::new(),
        left: false,
    };
    server.run();
    server.pictures.cancel_all();
    Ok(())
}

fn capabilities(encoding: Encoding) -> ServerCapabilities {
    ServerCapabilities {
        position_encoding: Some(encoding.kind()),
        text_document_sync: Some(TextDocumentSyncCapability::Options(
            TextDocumentSyncOptions {
                open_close: Some(true),
                change: Some(TextDocumentSyncKind::INCREMENTAL),
                save: Some(TextDocumentSyncSaveOptions::SaveOptions(SaveOptions {
                    include_text: Some(false),
                })),
                ..TextDocumentSyncOptions::default()
            },
        )),
        completion_provider: Some(CompletionOptions {
            trigger_characters: Some(["\"", "/", "(", "="].map(str::to_owned).to_vec()),
            ..CompletionOptions::default()
        }),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: Default::default(),
        })),
        document_symbol_provider: Some(OneOf::Left(true)),
        folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        semantic_tokens_provider: Some(
            SemanticTokensOptions {
                legend: SemanticTokensLegend {
                    token_types: outline::legend(),
                    token_modifiers: Vec::new(),
                },
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..SemanticTokensOptions::default()
            }
            .into(),
        ),
        inlay_hint_provider: Some(OneOf::Left(true)),
        document_link_provider: Some(DocumentLinkOptions {
            resolve_provider: Some(false),
            work_done_progress_options: Default::default(),
        }),
        code_action_provider: Some(CodeActionProviderCapability::Simple(true)),
        code_lens_provider: Some(CodeLensOptions {
            resolve_provider: Some(false),
        }),
        execute_command_provider: Some(ExecuteCommandOptions {
            commands: vec![PICTURE.to_owned()],
            ..ExecuteCommandOptions::default()
        }),
        ..ServerCapabilities::default()
    }
}

struct Server<'c> {
    connection: &'c Connection,
    means: Means,
    encoding: Encoding,
    client: Client,
    buffers: Buffers,
    /// By the file that includes all others.
    sheets: BTreeMap<PathBuf, Sheet>,
    /// Of each open text the show that it belongs to.
    roots: BTreeMap<PathBuf, PathBuf>,
    /// Shows whose text was changed since it was read.
    changed: BTreeSet<PathBuf>,
    /// Messages that came in and are not worked off.
    queue: VecDeque<Message>,
    pictures: Pictures,
    /// The client asked to shut down.
    left: bool,
}

impl Server<'_> {
    fn run(&mut self) {
        loop {
            while let Ok(message) = self.connection.receiver.try_recv() {
                self.take(message);
            }
            let message = match self.queue.pop_front() {
                Some(message) => message,
                None if !self.changed.is_empty() => {
                    self.read_changed();
                    continue;
                }
                None => match self.connection.receiver.recv() {
                    Ok(message) => {
                        self.take(message);
                        continue;
                    }
                    Err(_) => return,
                },
            };
            match message {
                Message::Request(request) => self.answer(request),
                Message::Notification(told) if told.method == "exit" => return,
                Message::Notification(told) => self.hear(told),
                // To what the server asked nothing has to be done.
                Message::Response(_) => {}
            }
        }
    }

    /// Queues a message, or takes one back that is cancelled.
    fn take(&mut self, message: Message) {
        let cancelled = match &message {
            Message::Notification(told) if told.method == "$/cancelRequest" => {
                told.params.get("id").and_then(request_id)
            }
            _ => None,
        };
        let Some(id) = cancelled else {
            self.queue.push_back(message);
            return;
        };
        let waits = |m: &Message| matches!(m, Message::Request(r) if r.id == id);
        if self.queue.iter().any(waits) {
            self.queue.retain(|m| !waits(m));
            self.fail(id, ErrorCode::RequestCanceled, "cancelled".to_owned());
        } else {
            self.pictures.cancel(&id);
        }
    }

    fn send(&self, message: impl Into<Message>) {
        // A client that is gone is noticed when it is listened to.
        let _ = self.connection.sender.send(message.into());
    }

    fn fail(&self, id: RequestId, code: ErrorCode, why: String) {
        self.send(Response::new_err(id, code as i32, why));
    }

    fn hear(&mut self, told: Notification) {
        match told.method.as_str() {
            "textDocument/didOpen" => {
                let Some(params) = read::<DidOpenTextDocumentParams>(told.params) else {
                    return;
                };
                let opened = params.text_document;
                let path = key(&opened.uri);
                let buffer = Buffer {
                    text: Arc::new(opened.text),
                    version: opened.version,
                    uri: opened.uri,
                };
                self.buffers.open(path.clone(), buffer);
                self.find_roots();
                self.changed.extend(self.roots.get(&path).cloned());
            }
            "textDocument/didChange" => {
                let Some(params) = read::<DidChangeTextDocumentParams>(told.params) else {
                    return;
                };
                let (path, version) =
                    (key(&params.text_document.uri), params.text_document.version);
                let changes = params.content_changes;
                self.buffers.change(&path, version, changes, self.encoding);
                self.changed.extend(self.roots.get(&path).cloned());
            }
            "textDocument/didSave" => {
                let Some(params) = read::<DidSaveTextDocumentParams>(told.params) else {
                    return;
                };
                self.find_roots();
                let root = self.roots.get(&key(&params.text_document.uri)).cloned();
                if let Some(root) = root {
                    // Files that the show names may have changed as well.
                    self.changed.insert(root.clone());
                    self.read_changed();
                    if let Some(cue) = self.pictures.shown(&root) {
                        self.make_picture(None, &root, cue);
                    }
                }
            }
            "textDocument/didClose" => {
                let Some(params) = read::<DidCloseTextDocumentParams>(told.params) else {
                    return;
                };
                let path = key(&params.text_document.uri);
                let root = self.roots.remove(&path);
                self.buffers.close(&path);
                self.publish(&params.text_document.uri, Vec::new(), None);
                self.find_roots();
                self.changed
                    .extend(root.filter(|root| self.sheets.contains_key(root)));
            }
            "workspace/didChangeWatchedFiles" => self.changed.extend(self.sheets.keys().cloned()),
            "window/workDoneProgress/cancel" => self.pictures.cancel_all(),
            _ => {}
        }
    }

    /// Finds the show that each open text belongs to, and forgets shows without one.
    fn find_roots(&mut self) {
        for path in self.buffers.paths() {
            let root = root_of(&path, &self.buffers);
            let before = self.roots.insert(path, root.clone());
            if before.as_ref() != Some(&root) {
                self.changed.insert(root);
            }
        }
        let roots: BTreeSet<&PathBuf> = self.roots.values().collect();
        self.sheets.retain(|path, _| roots.contains(path));
        self.changed.retain(|path| roots.contains(path));
    }

    /// Reads the shows again whose texts were changed, and says what is wrong with them.
    fn read_changed(&mut self) {
        for path in std::mem::take(&mut self.changed) {
            let Some(text) = self.buffers.text(&path) else {
                continue;
            };
            let limits = self.means.limits;
            let buffers = &self.buffers;
            let sheet = self.sheets.entry(path.clone());
            let sheet = sheet.or_insert_with(|| Sheet::new(&path, buffers, limits));
            sheet.update(&text);
            self.publish_all(&path);
        }
    }

    /// Tells the client what is wrong in each open file of a show.
    fn publish_all(&self, root: &Path) {
        let Some(sheet) = self.sheets.get(root) else {
            return;
        };
        let lines = self.lines(sheet);
        for path in self.buffers.paths() {
            let is_own = self.roots.get(&path).is_some_and(|own| own == root);
            let Some(buffer) = self.buffers.get(&path).filter(|_| is_own) else {
                continue;
            };
            let list = sheet.diagnostics().list.iter();
            let own = list.filter_map(|diagnostic| {
                let (file, _) = sheet.file(diagnostic.labels.first().map_or(0, |l| l.file))?;
                (file == path).then(|| diagnostic_of(sheet, &lines, diagnostic))
            });
            self.publish(&buffer.uri, own.collect(), Some(buffer.version));
        }
    }

    fn publish(&self, uri: &Uri, diagnostics: Vec<lsp_types::Diagnostic>, version: Option<i32>) {
        let params = PublishDiagnosticsParams {
            uri: uri.clone(),
            diagnostics,
            version,
        };
        let method = "textDocument/publishDiagnostics".to_owned();
        self.send(Notification::new(method, params));
    }

    /// The lines of each file of a show.
    fn lines<'s>(&self, sheet: &'s Sheet) -> Vec<Lines<'s>> {
        let texts = sheet.sources().map(|(_, text)| text);
        texts.map(|text| Lines::new(text, self.encoding)).collect()
    }

    fn answer(&mut self, request: Request) {
        if self.left {
            let why = "the server was shut down".to_owned();
            return self.fail(request.id, ErrorCode::InvalidRequest, why);
        }
        // What is answered is of the text as it stands.
        self.read_changed();
        let Request { id, method, params } = request;
        let answer = match method.as_str() {
            "shutdown" => {
                self.left = true;
                Ok(Value::Null)
            }
            "workspace/executeCommand" => match self.execute(&id, params) {
                Ok(()) => return,
                Err(why) => Err((ErrorCode::InvalidParams, why)),
            },
            _ => self.of_text(&method, params),
        };
        match answer {
            Ok(value) => self.send(Response::new_ok(id, value)),
            Err((code, why)) => self.fail(id, code, why),
        }
    }

    /// The show and the text of an address.
    fn at(&self, uri: &Uri) -> Option<(&Sheet, Arc<String>)> {
        let path = key(uri);
        let sheet = self.sheets.get(self.roots.get(&path)?)?;
        Some((sheet, self.buffers.text(&path)?))
    }

    /// Answers of one text, where it stands as the client has it.
    fn of_text(&self, method: &str, params: Value) -> Result<Value, (ErrorCode, String)> {
        let encoding = self.encoding;
        let place = |place: TextDocumentPositionParams| {
            let (sheet, text) = self.at(&place.text_document.uri)?;
            let at = Lines::new(&text, encoding).byte(place.position);
            Some((sheet, text, at))
        };
        let whole = |document: TextDocumentIdentifier| {
            let (sheet, text) = self.at(&document.uri)?;
            Some((sheet, text, document.uri))
        };
        match method {
            "textDocument/completion" => {
                let own = wanted::<CompletionParams>(params)?.text_document_position;
                value(
                    place(own)
                        .map(|(sheet, text, at)| complete::complete(sheet, &text, at, encoding)),
                )
            }
            "textDocument/hover" => {
                let own = wanted::<HoverParams>(params)?.text_document_position_params;
                value(place(own).and_then(|(sheet, text, at)| {
                    let (words, range) = hover::hover(sheet, &text, at)?;
                    Some(Hover {
                        contents: HoverContents::Markup(MarkupContent {
                            kind: MarkupKind::Markdown,
                            value: words,
                        }),
                        range: Some(Lines::new(&text, encoding).range(&range)),
                    })
                }))
            }
            "textDocument/definition" => {
                let own = wanted::<GotoDefinitionParams>(params)?.text_document_position_params;
                value(place(own).map(|(sheet, text, at)| {
                    name::locations(sheet, (&text, at), |declares| declares, encoding)
                }))
            }
            "textDocument/references" => {
                let asked = wanted::<ReferenceParams>(params)?;
                let all = asked.context.include_declaration;
                value(
                    place(asked.text_document_position).map(|(sheet, text, at)| {
                        name::locations(sheet, (&text, at), |declares| all || !declares, encoding)
                    }),
                )
            }
            "textDocument/documentHighlight" => {
                let own = wanted::<HoverParams>(params)?.text_document_position_params;
                value(place(own).map(|(_, text, at)| name::highlights((&text, at), encoding)))
            }
            "textDocument/prepareRename" => {
                let own = wanted::<TextDocumentPositionParams>(params)?;
                value(place(own).and_then(|(_, text, at)| {
                    let range = name::name_at(&text, at)?;
                    Some(Lines::new(&text, encoding).range(&range))
                }))
            }
            "textDocument/rename" => {
                let asked = wanted::<RenameParams>(params)?;
                let Some((sheet, text, at)) = place(asked.text_document_position) else {
                    return Ok(Value::Null);
                };
                let edit = name::rename(sheet, (&text, at), &asked.new_name, encoding);
                value(edit.map_err(|why| (ErrorCode::RequestFailed, why))?)
            }
            "textDocument/codeAction" => {
                let asked = wanted::<CodeActionParams>(params)?;
                let range = asked.range;
                value(whole(asked.text_document).map(|(sheet, text, uri)| {
                    let own = |file| sheet.file(file).is_some_and(|(path, _)| path == key(&uri));
                    let lines = self.lines(sheet);
                    let shown = |d: &Diagnostic| Some(diagnostic_of(sheet, &lines, d));
                    action::actions(sheet, (&text, &uri), range, encoding, own, shown)
                }))
            }
            "textDocument/codeLens" => {
                let asked = wanted::<CodeLensParams>(params)?;
                value(
                    whole(asked.text_document)
                        .map(|(sheet, text, uri)| outline::lenses(sheet, (&text, &uri), encoding)),
                )
            }
            "textDocument/formatting" => {
                let Some((_, text, _)) = whole(document(&params)?) else {
                    return Ok(Value::Null);
                };
                let memory = self.means.limits.memory;
                // What does not parse stays as it is; what is wrong with it was said.
                let formatted = engine::format("", text.as_bytes(), memory).ok();
                let edit = formatted.filter(|new| *new != *text).map(|new| {
                    let (range, new) = difference(&text, &new);
                    TextEdit::new(Lines::new(&text, encoding).range(&range), new.to_owned())
                });
                value(edit.into_iter().collect::<Vec<_>>())
            }
            "textDocument/documentSymbol" => {
                let found = whole(document(&params)?);
                value(found.map(|(_, text, _)| outline::symbols(&text, encoding)))
            }
            "textDocument/foldingRange" => {
                let found = whole(document(&params)?);
                value(found.map(|(_, text, _)| outline::folds(&text, encoding)))
            }
            "textDocument/semanticTokens/full" => {
                let found = whole(document(&params)?);
                value(found.map(|(_, text, _)| SemanticTokens {
                    result_id: None,
                    data: outline::pieces(&text, encoding),
                }))
            }
            "textDocument/inlayHint" => {
                let found = whole(document(&params)?);
                value(found.map(|(sheet, text, _)| outline::hints(sheet, &text, encoding)))
            }
            "textDocument/documentLink" => {
                let found = whole(document(&params)?);
                value(found.map(|(sheet, text, _)| outline::links(sheet, &text, encoding)))
            }
            other => Err((
                ErrorCode::MethodNotFound,
                format!("`{other}` is nothing that this server does"),
            )),
        }
    }

    /// Begins a command; its answer comes when it is done.
    fn execute(&mut self, id: &RequestId, params: Value) -> Result<(), String> {
        let asked = read::<ExecuteCommandParams>(params).ok_or("no command")?;
        if asked.command != PICTURE {
            return Err(format!("there is no command `{}`", asked.command));
        }
        let [uri, cue] = asked.arguments.as_slice() else {
            return Err(format!("{PICTURE} wants an address and a cue"));
        };
        let uri: Uri = serde_json::from_value(uri.clone()).map_err(|e| e.to_string())?;
        let cue = cue.as_str().and_then(CueNumber::parse);
        let cue = cue.ok_or("a cue is written as \"2.5\"")?;
        let root = self.roots.get(&key(&uri)).cloned();
        let root = root.ok_or("the show is not open")?;
        self.make_picture(Some(id.clone()), &root, cue);
        Ok(())
    }

    fn make_picture(&mut self, id: Option<RequestId>, root: &Path, cue: CueNumber) {
        let Some((sheet, text)) = self.sheets.get(root).zip(self.buffers.text(root)) else {
            return;
        };
        let files = Box::new(sheet.files().clone());
        self.pictures.make(Job {
            id,
            root: root.to_owned(),
            text,
            cue,
            host: (self.means.host)(root, files),
            stop: Arc::default(),
            client: self.client,
        });
    }
}

/// A diagnostic as the protocol writes it; `lines` are those of each file.
fn diagnostic_of(
    sheet: &Sheet,
    lines: &[Lines<'_>],
    diagnostic: &Diagnostic,
) -> lsp_types::Diagnostic {
    let range = |label: &crate::diagnostic::Label| {
        let own = lines.get(label.file);
        own.map_or_else(Default::default, |lines| lines.range(&label.span))
    };
    let mut message = diagnostic.message.clone();
    let main = diagnostic.labels.first();
    if let Some(label) = main.filter(|label| !label.text.is_empty()) {
        message.push_str(&format!("\n{}", label.text));
    }
    for help in &diagnostic.help {
        message.push_str(&format!("\nhelp: {help}"));
    }
    let related = diagnostic.labels.iter().skip(1).filter_map(|label| {
        let (path, _) = sheet.file(label.file)?;
        Some(DiagnosticRelatedInformation {
            location: Location::new(uri_of(&path)?, range(label)),
            message: label.text.clone(),
        })
    });
    let related: Vec<_> = related.collect();
    let code =
        (!diagnostic.code.is_empty()).then(|| NumberOrString::String(diagnostic.code.to_owned()));
    lsp_types::Diagnostic {
        range: main.map_or_else(Default::default, range),
        severity: Some(match diagnostic.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code,
        source: Some("footlight".to_owned()),
        message,
        related_information: (!related.is_empty()).then_some(related),
        ..lsp_types::Diagnostic::default()
    }
}

/// What a text is known by: its path, or its address where it has none.
fn key(uri: &Uri) -> PathBuf {
    path_of(uri).unwrap_or_else(|| PathBuf::from(uri.as_str()))
}

fn request_id(id: &Value) -> Option<RequestId> {
    match id {
        Value::Number(number) => Some(RequestId::from(i32::try_from(number.as_i64()?).ok()?)),
        Value::String(text) => Some(RequestId::from(text.clone())),
        _ => None,
    }
}

fn read<T: DeserializeOwned>(params: Value) -> Option<T> {
    serde_json::from_value(params).ok()
}

fn wanted<T: DeserializeOwned>(params: Value) -> Result<T, (ErrorCode, String)> {
    serde_json::from_value(params).map_err(|e| (ErrorCode::InvalidParams, e.to_string()))
}

/// The document that a request is about.
fn document(params: &Value) -> Result<TextDocumentIdentifier, (ErrorCode, String)> {
    wanted(params.get("textDocument").cloned().unwrap_or_default())
}

fn value(answer: impl Serialize) -> Result<Value, (ErrorCode, String)> {
    serde_json::to_value(answer).map_err(|e| (ErrorCode::InternalError, e.to_string()))
}

#[cfg(test)]
mod tests;
