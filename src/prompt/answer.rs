//! The verbs' functions: each reads its words, calls the engine, and formats the result by the
//! report.

pub(super) mod edit;
pub(super) mod export;
pub(super) mod help;
pub(super) mod live;
pub(super) mod measure;
pub(super) mod picture;
pub(super) mod play;
pub(super) mod plot;
pub(super) mod render;
pub(super) mod solve;
pub(super) mod text;

use std::path::Path;

use super::Error;
use super::error::usage;
use super::repl::{Repl, Reply};
use footlight_report::chart::Drawing;
use footlight_report::{self as report, format};

impl Repl {
    /// Writes a file; the reply is `text` and a line that names the file.
    fn written(&self, path: &Path, bytes: &[u8], text: &str) -> Result<Reply, Error> {
        self.engine.host().store.output(path, bytes)?;
        let mut reply = Reply::text(text);
        reply.text.push(&format!("wrote {}\n", path.display()));
        Ok(reply)
    }

    /// Shows a drawing with words, or writes it to a file.
    fn drawing(
        &self,
        drawing: &Drawing,
        path: Option<&Path>,
        text: String,
    ) -> Result<Reply, Error> {
        match path {
            None => Reply::drawn(drawing, text),
            Some(path) => self.written(path, &format::drawing(drawing, 2.0, path)?, &text),
        }
    }

    fn headline(&self) -> String {
        report::document::headline(self.engine.document())
    }
}
