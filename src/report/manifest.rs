//! The manifest of a run's folder: `files.sha256`, one line for each file with its digest, in the
//! format of `sha256sum`.
//!
//! Invariants: a file is listed before it is written, so that an interrupted run leaves no unlisted
//! file; only files that an earlier run listed and that are unchanged since are replaced or
//! removed, and never files of the show.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use super::Error;
use footlight_engine::Engine;
use footlight_host::files::{Entry, FileError, Store};
use footlight_show::units::CueNumber;

/// Name of the manifest.
const MANIFEST: &str = "files.sha256";

/// Name of the mark for unfinished results.
const UNFINISHED: &str = "unfinished.txt";

/// Text of the mark.
const NOTE: &str = "This run of footlight has not ended: some files here are missing, or from an \
                    earlier run. Run the same command again to make all of them.\n";

/// Name of the page.
pub const PAGE: &str = "show.html";

/// Files that every run writes.
const RESULTS: [&str; 11] = [
    PAGE,
    "cue-sheet.csv",
    "track-sheet.csv",
    "hookup.csv",
    "schedule.csv",
    "rig.svg",
    "plan.json",
    "curves.png",
    "error.png",
    "channels.png",
    "basis.png",
];

/// A file of runs of earlier versions.
const FORMER: &str = "sequence.png";

/// Folder of the key images.
const KEYS: &str = "keys";

/// Folder of the cues' images.
const CUES: &str = "cues";

/// Digits before the point of a cue's number, so that files sort in the order of cues.
const DIGITS: usize = 4;

/// Most bytes of a manifest, and of a file checked against it.
const LIMITS: (u64, u64) = (1 << 22, 1 << 30);

/// A file that a run wrote: its name in the folder and its digest.
type Line = (String, String);

/// The folder of a run's results.
#[derive(Debug)]
pub struct Results<'f> {
    folder: &'f Path,
    /// Files of earlier runs that this one has not replaced.
    earlier: BTreeSet<Line>,
    written: BTreeSet<Line>,
}

/// Name of a key image, from index 0.
pub fn key_name(index: usize) -> String {
    format!("{KEYS}/key{:03}.exr", index + 1)
}

/// Name of a cue's image: `cues/0005.png`, and `cues/0005_5.png`, which sorts after it.
pub fn cue_name(number: CueNumber) -> String {
    let number = number.to_string();
    let whole = number.split('.').next().map_or(0, str::len);
    let zeros = "0".repeat(DIGITS.saturating_sub(whole));
    format!("{CUES}/{zeros}{}.png", number.replace('.', "_"))
}

/// Name of a contact sheet, from index 0.
pub fn sheet_name(index: usize) -> String {
    match index {
        0 => "contact-sheet.png".to_owned(),
        _ => format!("contact-sheet-{}.png", index + 1),
    }
}

/// True for a name that runs use.
fn is_given(name: &str) -> bool {
    let between = |from: &str, to: &str| name.strip_prefix(from)?.strip_suffix(to);
    let index = |from, to| between(from, to)?.parse::<usize>().ok()?.checked_sub(1);
    let key = index("keys/key", ".exr").is_some_and(|i| key_name(i) == name);
    let sheet = index("contact-sheet-", ".png").is_some_and(|i| sheet_name(i) == name);
    let cue = between("cues/", ".png").and_then(|n| CueNumber::parse(&n.replace('_', ".")));
    let cue = cue.is_some_and(|number| cue_name(number) == name);
    let fixed = RESULTS.contains(&name) || name == sheet_name(0) || name == FORMER;
    fixed || key || sheet || cue
}

fn digest(bytes: &[u8]) -> String {
    let mut hex = String::new();
    for byte in Sha256::digest(bytes) {
        let _ = write!(hex, "{byte:02x}");
    }
    hex
}

impl<'f> Results<'f> {
    /// Prepares the folder for a run that will write these files besides those of every run, and
    /// marks it as unfinished.
    ///
    /// # Errors
    /// [`Error::ShowsFile`] and [`Error::Foreign`] when a file that will be written exists and is
    /// not from an earlier run; errors of the store. In these cases nothing is written.
    pub fn begin(
        engine: &Engine,
        folder: &'f Path,
        own: impl Iterator<Item = String>,
    ) -> Result<Results<'f>, Error> {
        let store = engine.host().store.as_ref();
        let results = Results {
            folder,
            earlier: earlier(store, folder)?,
            written: BTreeSet::new(),
        };
        let linked = |e: &&Entry| [KEYS, CUES].iter().any(|n| e.name == *n) && !e.folder;
        if let Some(entry) = store.entries(folder)?.iter().find(linked) {
            return Err(Error::Foreign(folder.join(&entry.name)));
        }
        let names = RESULTS.iter().map(|name| (*name).to_owned());
        for name in names.chain(own) {
            let path = folder.join(&name);
            if reads(engine, &path) {
                return Err(Error::ShowsFile(path));
            }
            if !results.is_free(store, &name)? {
                return Err(Error::Foreign(path));
            }
        }
        results.mark(engine)?;
        store.sweep(folder);
        store.sweep(&folder.join(KEYS));
        store.sweep(&folder.join(CUES));
        Ok(results)
    }

    /// Marks the folder as holding results of more than one run.
    fn mark(&self, engine: &Engine) -> Result<(), Error> {
        let store = engine.host().store.as_ref();
        for name in [UNFINISHED, MANIFEST] {
            let path = self.folder.join(name);
            if reads(engine, &path) {
                return Err(Error::ShowsFile(path));
            }
        }
        let path = self.folder.join(UNFINISHED);
        match store.read_start(&path, NOTE.len() as u64 + 1) {
            Ok(found) if found != NOTE.as_bytes() => return Err(Error::Foreign(path)),
            Err(FileError::NotAFile { .. }) => return Err(Error::Foreign(path)),
            // Other problems of the folder show when it is written to.
            _ => {}
        }
        Ok(store.write(&path, NOTE.as_bytes())?)
    }

    /// True when the name is free or holds an earlier run's file.
    fn is_free(&self, store: &dyn Store, name: &str) -> Result<bool, Error> {
        let path = self.folder.join(name);
        match store.read_start(&path, 0) {
            Ok(_) => Ok(self.is_as_written(store, name)),
            Err(FileError::Missing(_)) => Ok(true),
            Err(FileError::NotAFile { .. }) => Ok(false),
            Err(error) => Err(error.into()),
        }
    }

    /// True when the file is unchanged since an earlier run.
    fn is_as_written(&self, store: &dyn Store, name: &str) -> bool {
        let mut of_name = self.earlier.iter().filter(|(n, _)| n == name).peekable();
        if of_name.peek().is_none() {
            return false;
        }
        let found = store.read(&self.folder.join(name), LIMITS.1);
        let found = found.map(|bytes| digest(&bytes));
        found.is_ok_and(|found| of_name.any(|(_, written)| *written == found))
    }

    /// Writes a file of the run.
    ///
    /// # Errors
    /// Errors of the store.
    pub fn write(&mut self, engine: &Engine, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let store = engine.host().store.as_ref();
        self.written.insert((name.to_owned(), digest(bytes)));
        self.list(store)?;
        store.write(&self.folder.join(name), bytes)?;
        self.earlier.retain(|(earlier, _)| earlier != name);
        let own = digest(bytes);
        self.written
            .retain(|(written, digest)| written != name || *digest == own);
        Ok(())
    }

    /// Writes the manifest.
    fn list(&self, store: &dyn Store) -> Result<(), Error> {
        let mut text = String::new();
        for (name, digest) in self.earlier.union(&self.written) {
            let _ = writeln!(text, "{digest}  {name}");
        }
        Ok(store.write(&self.folder.join(MANIFEST), text.as_bytes())?)
    }

    /// Removes files of earlier runs that this one did not write, and the mark.
    ///
    /// # Errors
    /// Errors of the store.
    pub fn finish(mut self, engine: &Engine) -> Result<(), Error> {
        let store = engine.host().store.as_ref();
        let names: BTreeSet<String> = self.earlier.iter().map(|(name, _)| name.clone()).collect();
        for name in names {
            let path = self.folder.join(&name);
            if self.is_as_written(store, &name) && !reads(engine, &path) {
                store.remove(&path)?;
            }
        }
        self.earlier.clear();
        self.list(store)?;
        self.give_up(engine)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder
    }

    /// True when files were written.
    pub fn has_any(&self) -> bool {
        !self.written.is_empty()
    }

    /// True when the file of this name was written.
    pub fn has(&self, name: &str) -> bool {
        self.written.iter().any(|(written, _)| written == name)
    }

    /// Removes the mark.
    ///
    /// # Errors
    /// Errors of the store.
    pub fn give_up(self, engine: &Engine) -> Result<(), Error> {
        Ok(engine.host().store.remove(&self.folder.join(UNFINISHED))?)
    }
}

fn reads(engine: &Engine, path: &Path) -> bool {
    let files = engine.host().files.as_ref();
    engine.document().reads(path, files)
}

/// Files listed in a folder's manifest; a name may have two digests after an interrupted run. A
/// list with other lines is not from a run, and is ignored.
fn earlier(store: &dyn Store, folder: &Path) -> Result<BTreeSet<Line>, Error> {
    let path = folder.join(MANIFEST);
    let bytes = match store.read(&path, LIMITS.0) {
        Ok(bytes) => bytes,
        Err(FileError::Missing(_)) => return Ok(BTreeSet::new()),
        Err(FileError::NotAFile { .. } | FileError::TooLarge { .. }) => {
            return Err(Error::Foreign(path));
        }
        Err(error) => return Err(error.into()),
    };
    let line = |line: &str| {
        let (digest, name) = line.split_once("  ")?;
        let hex = digest.len() == 64 && digest.chars().all(|c| c.is_ascii_hexdigit());
        (hex && is_given(name)).then(|| (name.to_owned(), digest.to_ascii_lowercase()))
    };
    let text = String::from_utf8(bytes).ok();
    let lines = text.and_then(|text| text.lines().map(line).collect::<Option<_>>());
    lines.ok_or(Error::Foreign(path))
}
