//! The verbs' functions: each reads its words, calls the engine, and has the report tell it.

pub(super) mod help;
pub(super) mod live;
pub(super) mod measure;
pub(super) mod picture;
pub(super) mod play;
pub(super) mod plot;
pub(super) mod render;
pub(super) mod session;
pub(super) mod text;

use std::path::Path;

use super::{Error, Repl, Reply};
use crate::chart::{Drawing, Theme};
use crate::report::record::Record;
use crate::report::{self, format};

impl Repl {
    /// Words alone, or bytes into a file and words that say so.
    fn written(&self, path: Option<&Path>, bytes: &[u8], text: String) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Ok(Reply::text(text));
        };
        self.write(path, bytes)?;
        Ok(Reply::text(format!("{text}\nwrote {}", path.display())))
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        Ok(self.engine.host().store.write(path, bytes)?)
    }

    /// A drawing with words, or into a file.
    fn drawing(
        &self,
        drawing: &Drawing,
        path: Option<&Path>,
        text: String,
    ) -> Result<Reply, Error> {
        match path {
            None => Reply::drawn(drawing, text),
            Some(p) => self.written(path, &format::drawing(drawing, 2.0, p)?, text),
        }
    }

    /// A measurement with its words: with its drawing, or into a file, whose ending says whether
    /// the drawing (in `theme`) or the figures are wanted.
    fn deliver(
        &self,
        text: String,
        record: &dyn Fn() -> Record,
        drawn: &dyn Fn(Theme) -> Drawing,
        (path, theme): (Option<&Path>, Theme),
    ) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Reply::drawn(&drawn(Theme::Dark), text);
        };
        let bytes = format::record(&record(), drawn, theme, path)?;
        self.write(path, &bytes)?;
        Ok(Reply::text(format!("{text}wrote {}", path.display())))
    }

    fn headline(&self) -> String {
        report::document::headline(self.engine.document())
    }
}

fn usage<T>(message: &str) -> Result<T, Error> {
    Err(Error::Usage(message.to_owned()))
}
