//! The state of a server, and the messages that change it.

use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::RecvTimeoutError;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::notification::{
    Cancel, DidChangeTextDocument, DidChangeWatchedFiles, DidCloseTextDocument,
    DidOpenTextDocument, DidSaveTextDocument, Exit, Notification as _, PublishDiagnostics,
    WorkDoneProgressCancel,
};
use lsp_types::request::{ExecuteCommand, Request as _, Shutdown};
use lsp_types::{
    DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    DidSaveTextDocumentParams, ExecuteCommandParams, PublishDiagnosticsParams, Uri,
};
use serde_json::Value;

use super::background::Background;
use super::buffers::Buffer;
use super::diagnostic::diagnostic_of;
use super::open_show::{OpenShow, root_of};
use super::outline::PICTURE;
use super::picture::{Client, Job, Pictures};
use super::request::{self, Answer};
use super::text::Encoding;
use super::workspace::{Workspace, key};
use super::{End, Means};
use footlight_show::units::CueNumber;

/// Pause after the last keystroke before the show is read again.
const AFTER_KEYSTROKE: Duration = Duration::from_millis(100);

/// A server with its client.
pub struct Server<'c> {
    connection: &'c Connection,
    means: Means,
    client: Client,
    workspace: Workspace,
    /// Shows to be read again.
    changed: BTreeSet<PathBuf>,
    /// Received messages not yet handled.
    queue: VecDeque<Message>,
    background: Background,
    pictures: Pictures,
    /// True after the client's shutdown request.
    left: bool,
}

impl<'c> Server<'c> {
    /// A server without open texts.
    pub fn new(
        connection: &'c Connection,
        means: Means,
        encoding: Encoding,
        client: Client,
    ) -> Server<'c> {
        Server {
            background: Background::new(connection.sender.clone()),
            pictures: Pictures::new(connection.sender.clone()),
            connection,
            means,
            client,
            workspace: Workspace::new(encoding),
            changed: BTreeSet::new(),
            queue: VecDeque::new(),
            left: false,
        }
    }

    /// Answers until the client leaves.
    pub fn run(&mut self) -> End {
        self.serve();
        self.background.cancel_all();
        self.pictures.cancel_all();
        if self.left { End::Orderly } else { End::Abrupt }
    }

    fn serve(&mut self) {
        loop {
            while let Ok(message) = self.connection.receiver.try_recv() {
                self.take(message);
            }
            let message = match self.queue.pop_front() {
                Some(message) => message,
                None => {
                    match self.next() {
                        Ok(message) => self.take(message),
                        Err(RecvTimeoutError::Timeout) => self.read_changed(),
                        Err(RecvTimeoutError::Disconnected) => return,
                    }
                    continue;
                }
            };
            match message {
                Message::Request(request) => self.answer(request),
                Message::Notification(n) if n.method == Exit::METHOD => return,
                Message::Notification(notification) => self.take_notification(notification),
                // Responses to the server's own requests need no action.
                Message::Response(_) => {}
            }
        }
    }

    /// Waits for a message; only briefly when a text was changed.
    fn next(&self) -> Result<Message, RecvTimeoutError> {
        if self.changed.is_empty() {
            return Ok(self.connection.receiver.recv()?);
        }
        self.connection.receiver.recv_timeout(AFTER_KEYSTROKE)
    }

    /// Queues a message, or cancels a queued one.
    fn take(&mut self, message: Message) {
        let cancelled = match &message {
            Message::Notification(n) if n.method == Cancel::METHOD => {
                n.params.get("id").and_then(request_id)
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
            self.background.cancel(&id);
            self.pictures.cancel(&id);
        }
    }

    fn send(&self, message: impl Into<Message>) {
        // A lost client is noticed when reading.
        let _ = self.connection.sender.send(message.into());
    }

    fn fail(&self, id: RequestId, code: ErrorCode, why: String) {
        self.send(Response::new_err(id, code as i32, why));
    }

    fn take_notification(&mut self, notification: Notification) {
        let params = notification.params;
        match notification.method.as_str() {
            DidOpenTextDocument::METHOD => {
                read::<DidOpenTextDocument>(params).map(|params| self.open(params))
            }
            DidChangeTextDocument::METHOD => {
                read::<DidChangeTextDocument>(params).map(|params| self.change(params))
            }
            DidSaveTextDocument::METHOD => {
                read::<DidSaveTextDocument>(params).map(|params| self.save(&params))
            }
            DidCloseTextDocument::METHOD => {
                read::<DidCloseTextDocument>(params).map(|params| self.close(&params))
            }
            DidChangeWatchedFiles::METHOD => {
                self.changed.extend(self.workspace.shows.keys().cloned());
                None
            }
            WorkDoneProgressCancel::METHOD => {
                self.pictures.cancel_all();
                None
            }
            _ => None,
        };
    }

    fn open(&mut self, params: DidOpenTextDocumentParams) {
        let opened = params.text_document;
        let path = key(&opened.uri);
        let buffer = Buffer {
            text: Arc::new(opened.text),
            version: opened.version,
            uri: opened.uri,
        };
        self.workspace.buffers.open(path.clone(), buffer);
        self.find_roots();
        self.changed
            .extend(self.workspace.roots.get(&path).cloned());
    }

    fn change(&mut self, params: DidChangeTextDocumentParams) {
        let (path, version) = (key(&params.text_document.uri), params.text_document.version);
        let changes = params.content_changes;
        self.workspace
            .buffers
            .change(&path, version, changes, self.workspace.encoding);
        if let Some(root) = self.workspace.roots.get(&path) {
            self.background.outdate(root);
            self.changed.insert(root.clone());
        }
    }

    fn save(&mut self, params: &DidSaveTextDocumentParams) {
        self.find_roots();
        let Some(root) = self
            .workspace
            .roots
            .get(&key(&params.text_document.uri))
            .cloned()
        else {
            return;
        };
        // Other files that the show names may have changed too.
        self.changed.insert(root.clone());
        self.read_changed();
        if let Some(cue) = self.pictures.shown(&root) {
            self.make_picture(None, &root, cue);
        }
    }

    fn close(&mut self, params: &DidCloseTextDocumentParams) {
        let uri = &params.text_document.uri;
        let path = key(uri);
        let root = self.workspace.roots.remove(&path);
        self.workspace.buffers.close(&path);
        self.publish(uri, Vec::new(), None);
        self.find_roots();
        let root = root.filter(|root| self.workspace.shows.contains_key(root));
        self.changed.extend(root);
    }

    /// Finds the show of each open text, and drops shows without open texts.
    fn find_roots(&mut self) {
        for path in self.workspace.buffers.paths() {
            let root = root_of(&path, &self.workspace.buffers);
            let before = self.workspace.roots.insert(path, root.clone());
            if before.as_ref() != Some(&root) {
                self.changed.insert(root);
            }
        }
        let roots: BTreeSet<&PathBuf> = self.workspace.roots.values().collect();
        self.workspace.shows.retain(|path, _| roots.contains(path));
        self.changed.retain(|path| roots.contains(path));
    }

    /// Reads changed shows again, and publishes their diagnostics.
    fn read_changed(&mut self) {
        for path in std::mem::take(&mut self.changed) {
            let Some(text) = self.workspace.buffers.text(&path) else {
                continue;
            };
            let limits = self.means.limits;
            let buffers = &self.workspace.buffers;
            let show = self.workspace.shows.entry(path.clone());
            let show = show.or_insert_with(|| OpenShow::new(&path, buffers, limits));
            show.update(&text);
            self.publish_all(&path);
        }
    }

    /// Sends the diagnostics of each open file of a show.
    fn publish_all(&self, root: &Path) {
        let Some(show) = self.workspace.shows.get(root) else {
            return;
        };
        let lines = show.lines(self.workspace.encoding);
        for path in self.workspace.buffers.paths() {
            let is_own = self
                .workspace
                .roots
                .get(&path)
                .is_some_and(|own| own == root);
            let Some(buffer) = self.workspace.buffers.get(&path).filter(|_| is_own) else {
                continue;
            };
            let list = show.diagnostics().list.iter();
            let own = list.filter_map(|diagnostic| {
                let (file, _) = show.file(diagnostic.labels.first().map_or(0, |l| l.file))?;
                (file == path).then(|| diagnostic_of(show, &lines, diagnostic))
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
        let method = PublishDiagnostics::METHOD.to_owned();
        self.send(Notification::new(method, params));
    }

    fn answer(&mut self, request: Request) {
        if self.left {
            let why = "the server was shut down".to_owned();
            return self.fail(request.id, ErrorCode::InvalidRequest, why);
        }
        let Request { id, method, params } = request;
        let is_known = self
            .changed
            .iter()
            .all(|path| self.workspace.shows.contains_key(path));
        if !is_known || !request::needs_only_text(&method) {
            self.read_changed();
        }
        let answer = match method.as_str() {
            Shutdown::METHOD => {
                self.left = true;
                Ok(Value::Null)
            }
            ExecuteCommand::METHOD => match self.execute(&id, params) {
                Ok(()) => return,
                Err(why) => Err((ErrorCode::InvalidParams, why)),
            },
            _ => match request::answer(&self.workspace, &method, params) {
                Ok(Answer::Later(show, work)) => return self.background.begin(id, show, work),
                Ok(Answer::Now(value)) => Ok(value),
                Err(failure) => Err(failure),
            },
        };
        match answer {
            Ok(value) => self.send(Response::new_ok(id, value)),
            Err((code, why)) => self.fail(id, code, why),
        }
    }

    /// Begins a command, which answers when it is done.
    fn execute(&mut self, id: &RequestId, params: Value) -> Result<(), String> {
        let asked: ExecuteCommandParams =
            serde_json::from_value(params).map_err(|error| error.to_string())?;
        if asked.command != PICTURE {
            return Err(format!("there is no command `{}`", asked.command));
        }
        let [uri, cue] = asked.arguments.as_slice() else {
            return Err(format!("{PICTURE} wants an address and a cue"));
        };
        let uri: Uri = serde_json::from_value(uri.clone()).map_err(|e| e.to_string())?;
        let cue = cue.as_str().and_then(CueNumber::parse);
        let cue = cue.ok_or("a cue is written as \"2.5\"")?;
        let root = self.workspace.roots.get(&key(&uri)).cloned();
        let root = root.ok_or("the show is not open")?;
        self.make_picture(Some(id.clone()), &root, cue);
        Ok(())
    }

    fn make_picture(&mut self, id: Option<RequestId>, root: &Path, cue: CueNumber) {
        let Some((show, text)) = self
            .workspace
            .shows
            .get(root)
            .zip(self.workspace.buffers.text(root))
        else {
            return;
        };
        let files = Box::new(show.files().clone());
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

fn request_id(id: &Value) -> Option<RequestId> {
    match id {
        Value::Number(number) => Some(RequestId::from(i32::try_from(number.as_i64()?).ok()?)),
        Value::String(text) => Some(RequestId::from(text.clone())),
        _ => None,
    }
}

/// Parameters of a notification; a malformed one is dropped because it has no answer.
fn read<N: lsp_types::notification::Notification>(params: Value) -> Option<N::Params> {
    serde_json::from_value(params).ok()
}
