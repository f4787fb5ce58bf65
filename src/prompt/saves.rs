//! A show that is edited elsewhere: its files, looked at again and again.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{Error, Repl};
use footlight_engine::TEXT_LIMIT;
use footlight_host::files::{Disk, Stamp, Store};

/// How often to look.
pub const PAUSE: Duration = Duration::from_millis(40);

/// Looks after which a file that is away is said to be.
const LONG: usize = 25;

/// What a look finds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Look {
    /// Nothing to do.
    Same,
    /// The show's file is gone or empty, and has been for a while.
    Away,
    /// The show's text, where something was saved.
    Saved {
        /// The text.
        text: Vec<u8>,
        /// False where the same is only tried again, as a file that the show names may be there now.
        is_new: bool,
    },
}

/// The files of a show as they were seen last.
#[derive(Debug)]
pub struct Saves {
    path: PathBuf,
    /// The show's file and those it includes.
    texts: Vec<Vec<u8>>,
    /// The stage's files, images and all else that the show names.
    stamps: Vec<Stamp>,
    /// Looks since the show's file was there.
    away: usize,
    looks: usize,
}

impl Saves {
    /// Begins with the show's file as it is.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn new(path: &Path) -> Result<Saves, Error> {
        Ok(Saves {
            path: path.to_owned(),
            texts: vec![Disk.read(path, TEXT_LIMIT)?],
            stamps: Vec::new(),
            away: 0,
            looks: 0,
        })
    }

    /// Looks at the files of the show as it was read last, if it was.
    pub fn look(&mut self, show: Option<&Repl>) -> Look {
        let texts = texts(&self.path, show);
        // An editor that writes in two steps leaves the file away, or empty, for a moment.
        let Some(text) = texts.first().filter(|text| !text.is_empty()).cloned() else {
            self.away += 1;
            return if self.away == LONG {
                Look::Away
            } else {
                Look::Same
            };
        };
        self.away = 0;
        self.looks += 1;
        let stamps = show.map_or_else(Vec::new, |repl| repl.engine().host().files.as_is());
        let same = texts == self.texts;
        // Without a show it is not known which of its files was missing.
        let again = show.is_none() && self.looks.is_multiple_of(LONG);
        if same && stamps == self.stamps && !again {
            return Look::Same;
        }
        let is_new = !same || show.is_some();
        (self.texts, self.stamps) = (texts, stamps);
        Look::Saved { text, is_new }
    }

    /// The sentence for [`Look::Away`], without its full stop.
    pub fn away(&self) -> String {
        format!("{} is gone or empty", self.path.display())
    }

    /// Takes note of the files that the show names once it was read: they may be others than before.
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

/// The show's file and those it includes, as they are on disk.
fn texts(path: &Path, show: Option<&Repl>) -> Vec<Vec<u8>> {
    let sources = show.map(|repl| &repl.engine().document().diagnostics().sources);
    let included = (1..).map_while(|i| sources?.get(i));
    let paths = std::iter::once(path).chain(included.map(|(name, _)| Path::new(name)));
    paths
        .map(|p| Disk.read(p, TEXT_LIMIT).unwrap_or_default())
        .collect()
}
