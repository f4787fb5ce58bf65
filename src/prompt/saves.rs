//! Watches the files of a show that is edited elsewhere.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{Error, Repl};
use footlight_engine::TEXT_LIMIT;
use footlight_host::files::{Disk, Stamp, Store};

/// Polling interval.
pub const PAUSE: Duration = Duration::from_millis(40);

/// Number of polls after which a missing file is reported.
const LONG: usize = 25;

/// Result of a poll.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Poll {
    /// No change.
    Same,
    /// The show's file has been missing or empty for a while.
    Away,
    /// A file was saved; the show's text.
    Saved {
        /// The text.
        text: Vec<u8>,
        /// False for a retry, because a missing file that the show names may exist now.
        is_new: bool,
    },
}

/// The files of a show, as last seen.
#[derive(Debug)]
pub struct Saves {
    path: PathBuf,
    /// Texts of the show's file and its includes.
    texts: Vec<Vec<u8>>,
    /// Stamps of the other files that the show names.
    stamps: Vec<Stamp>,
    /// Polls since the show's file was last present.
    away: usize,
    looks: usize,
}

impl Saves {
    /// Starts with the current file of the show.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn new(path: &Path) -> Result<Saves, Error> {
        Ok(Saves {
            path: path.to_owned(),
            texts: vec![Disk.read(path, TEXT_LIMIT)?],
            stamps: Vec::new(),
            away: 0,
            looks: 0,
        })
    }

    /// Polls the files of the show as last read, if it was.
    pub fn look(&mut self, show: Option<&Repl>) -> Poll {
        let texts = texts(&self.path, show);
        // An editor that writes in two steps leaves the file missing, or empty, for a moment.
        let Some(text) = texts.first().filter(|text| !text.is_empty()).cloned() else {
            self.away += 1;
            return if self.away == LONG {
                Poll::Away
            } else {
                Poll::Same
            };
        };
        self.away = 0;
        self.looks += 1;
        let stamps = show.map_or_else(Vec::new, |repl| repl.engine().host().files.as_is());
        let same = texts == self.texts;
        // Without a show, the missing file is not known.
        let again = show.is_none() && self.looks.is_multiple_of(LONG);
        if same && stamps == self.stamps && !again {
            return Poll::Same;
        }
        let is_new = !same || show.is_some();
        (self.texts, self.stamps) = (texts, stamps);
        Poll::Saved { text, is_new }
    }

    /// The message for [`Poll::Away`], without its full stop.
    pub fn away(&self) -> String {
        format!("{} is gone or empty", self.path.display())
    }

    /// Watches the files that the show names, once it was read: they may have changed.
    pub fn follow(&mut self, show: &Repl) {
        let included = texts(&self.path, Some(show));
        self.texts.truncate(1);
        self.texts.extend(included.into_iter().skip(1));
        let named = show.engine().host().files.as_is();
        if named.len() != self.stamps.len() {
            self.stamps = named;
        }
    }
}

/// Current texts of the show's file and its includes.
fn texts(path: &Path, show: Option<&Repl>) -> Vec<Vec<u8>> {
    let sources = show.map(|repl| &repl.engine().document().diagnostics().sources);
    let included = (1..).map_while(|i| sources?.get(i));
    let paths = std::iter::once(path).chain(included.map(|(name, _)| Path::new(name)));
    paths
        .map(|p| Disk.read(p, TEXT_LIMIT).unwrap_or_default())
        .collect()
}
