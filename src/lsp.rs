//! The language server: a client's texts in, what the engine knows of them out.
//!
//! It has no idea of the language of its own: text is read by [`crate::lang`], shows by the engine,
//! completion and help are the prompt's. Open texts are the truth, not the disk; broken text keeps
//! the last good show. One thread answers, another makes pictures. Changes that came in together are
//! read once.

mod action;
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

use std::path::Path;

use lsp_server::Connection;
use lsp_types::InitializeParams;
use serde_json::json;

use self::picture::Client;
use self::server::Server;
use self::text::Encoding;
use crate::engine::Host;
use crate::files::Files;

pub use self::open_show::Limits;

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
        "capabilities": capabilities::of_server(encoding),
        "serverInfo": { "name": "footlight", "version": env!("CARGO_PKG_VERSION") },
    });
    connection
        .initialize_finish(id, answer)
        .map_err(|e| e.to_string())?;
    let mut server = Server::new(connection, means, encoding, client);
    server.run();
    Ok(())
}

#[cfg(test)]
mod tests;
