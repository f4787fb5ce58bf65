//! The language server: receives a client's texts and answers with what the engine knows about
//! them.
//!
//! ```text
//! transport --Message--> server --> workspace: open shows and their buffers
//!                          |--> request: hover, complete, name, outline, action   (answers at once)
//!                          |--> background                                        (slow answers)
//!                          `--> picture                                           (images of cues)
//! ```
//!
//! [`serve`] runs a server until its client leaves.
//!
//! Invariants:
//!
//! - Open texts take precedence over the disk; a broken text keeps the last good show.
//! - Changes that arrive together are read once.
//! - One thread reads messages and answers, another computes slow answers, a third makes images.
//!   No keystroke waits for the latter two.
//!
//! This crate does not know the language: [`footlight_show::lang`] reads text, the engine shows,
//! and the prompt provides completion and help. It does not know the terminal either.

mod action;
mod background;
mod buffers;
mod capabilities;
mod complete;
mod diagnostic;
mod hover;
mod name;
mod open_show;
mod outline;
mod picture;
mod request;
mod server;
mod text;
mod transport;
mod workspace;

use std::io::ErrorKind::{BrokenPipe, UnexpectedEof};
use std::path::Path;

use lsp_server::{Connection, ErrorCode, Message, RequestId, Response};
use lsp_types::InitializeParams;
use lsp_types::notification::{Exit, Notification as _};
use lsp_types::request::{Initialize, Request as _};
use serde_json::{Value, json};

use self::picture::Client;
use self::server::Server;
use self::text::Encoding;
use footlight_engine::Host;
use footlight_host::files::Files;

pub use self::open_show::Limits;

/// Creates the host of the show at a path, with these files.
pub type MeansOf = dyn Fn(&Path, Box<dyn Files>) -> Host;

/// Limits, and the host of each show, from the embedding program.
pub struct Means {
    /// Limits of shows.
    pub limits: Limits,
    /// Creates the host of a show.
    pub host: Box<MeansOf>,
}

/// Serves the client at standard input and output until it leaves.
///
/// # Errors
/// As [`serve`].
pub fn serve_standard(means: Means) -> Result<End, String> {
    let (connection, threads) = transport::standard().map_err(|error| error.to_string())?;
    let served = serve(&connection, means);
    drop(connection);
    let end = served?;
    match threads.join() {
        // The client disconnected, perhaps in the middle of a message.
        Err(error) if matches!(error.kind(), BrokenPipe | UnexpectedEof) => Ok(End::Abrupt),
        Err(error) => Err(error.to_string()),
        Ok(()) => Ok(end),
    }
}

/// How a client left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The client requested a shutdown first.
    Orderly,
    /// The client did not, or was lost.
    Abrupt,
}

/// Serves a client until it leaves.
///
/// # Errors
/// A description of messages that break the protocol.
pub fn serve(connection: &Connection, means: Means) -> Result<End, String> {
    let Some((id, params)) = begun(connection) else {
        return Ok(End::Abrupt);
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
        "capabilities": capabilities::of_server(encoding),
        "serverInfo": { "name": "footlight", "version": env!("CARGO_PKG_VERSION") },
    });
    let answer = Response::new_ok(id, answer);
    if connection.sender.send(answer.into()).is_err() {
        return Ok(End::Abrupt);
    }
    let mut server = Server::new(connection, means, encoding, client);
    Ok(server.run())
}

/// The initialize request; `None` when the client leaves first. Earlier requests are refused.
/// (`Connection::initialize_start` panics when a client sends one and disconnects.)
fn begun(connection: &Connection) -> Option<(RequestId, Value)> {
    for message in &connection.receiver {
        match message {
            Message::Request(first) if first.method == Initialize::METHOD => {
                return Some((first.id, first.params));
            }
            Message::Request(early) => {
                let why = format!("`{}` came before `initialize`", early.method);
                let code = ErrorCode::ServerNotInitialized as i32;
                let refusal = Response::new_err(early.id, code, why);
                connection.sender.send(refusal.into()).ok()?;
            }
            Message::Notification(early) if early.method == Exit::METHOD => return None,
            Message::Notification(_) | Message::Response(_) => {}
        }
    }
    None
}

#[cfg(test)]
mod tests;
