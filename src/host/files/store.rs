//! Stores for results, and a store in memory.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::FileError;
use super::atomic_writer::{AtomicWriter, Gathered};

/// An entry of a folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name within the folder.
    pub name: String,
    /// True for a folder.
    pub folder: bool,
    /// Size in bytes.
    pub bytes: u64,
    /// Time of the last write or touch; increases with time, microseconds on disk.
    pub used: u64,
}

/// Destination of results.
pub trait Store: Send + Sync {
    /// Replaces the whole file at `path`, for files owned by the program; missing folders are
    /// created. A link is replaced, not followed.
    ///
    /// # Errors
    /// [`FileError`] with the path; the old file is then unchanged.
    fn write(&self, path: &Path, content: &[u8]) -> Result<(), FileError>;

    /// Writes a whole file unless it exists already: of several processes that compute one result,
    /// the first writes it. A store that cannot check replaces it.
    ///
    /// # Errors
    /// As [`Store::write`].
    fn add(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        self.write(path, content)
    }

    /// Writes a result to a path given by a person: like [`Store::write`], but it may be a link, a
    /// pipe or a device.
    ///
    /// # Errors
    /// As [`Store::write`].
    fn output(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        self.write(path, content)
    }

    /// Replaces the text of a file that a person edits: like [`Store::output`], but a file with
    /// other names is refused.
    ///
    /// # Errors
    /// As [`Store::write`], and [`FileError::Linked`].
    fn edit(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        self.output(path, content)
    }

    /// Begins a file to be written piece by piece, at a path as for [`Store::output`]; missing
    /// folders are created. By default the content is collected in memory.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be begun.
    fn begin<'s>(&'s self, path: &Path) -> Result<Box<dyn AtomicWriter + 's>, FileError> {
        Ok(Box::new(Gathered::new(self, path)))
    }

    /// Removes files in `folder` that killed processes left half written, if the store has such
    /// files.
    fn sweep(&self, folder: &Path) {
        let _ = folder;
    }

    /// Names of the files in `folder` that end in `ending`, in order.
    ///
    /// # Errors
    /// [`FileError`] when the folder is missing or cannot be listed.
    fn list(&self, folder: &Path, ending: &str) -> Result<Vec<String>, FileError>;

    /// Reads the current file at `path`, up to `limit` bytes.
    ///
    /// # Errors
    /// [`FileError`] when missing, too large or unreadable.
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, FileError>;

    /// Reads at most the first `bytes` bytes of the file at `path`.
    ///
    /// # Errors
    /// [`FileError`] when missing or unreadable.
    fn read_start(&self, path: &Path, bytes: u64) -> Result<Vec<u8>, FileError>;

    /// Lists `folder`, sorted by name; a missing folder is empty.
    ///
    /// # Errors
    /// [`FileError`] when the folder cannot be listed.
    fn entries(&self, folder: &Path) -> Result<Vec<Entry>, FileError>;

    /// True for a symbolic link, wherever it leads; false in a store without links.
    fn is_link(&self, path: &Path) -> bool {
        let _ = path;
        false
    }

    /// Records that the file at `path` was used now, without rewriting it.
    ///
    /// # Errors
    /// [`FileError`] when it is missing or not ours.
    fn touch(&self, path: &Path) -> Result<(), FileError>;

    /// Removes a file or an empty folder; a missing one is no error.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be removed.
    fn remove(&self, path: &Path) -> Result<(), FileError>;
}

/// Results kept in memory, for tests and embedding programs. Clones share their content.
#[derive(Clone, Debug, Default)]
pub struct MemoryStore {
    files: Arc<Mutex<BTreeMap<PathBuf, Shelved>>>,
}

#[derive(Debug)]
struct Shelved {
    content: Vec<u8>,
    /// Time of the last write or touch, in changes of the store.
    used: u64,
}

impl MemoryStore {
    /// Paths of everything written, in order.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.locked().keys().cloned().collect()
    }

    fn locked(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Shelved>> {
        // Each change is one call, so a panic elsewhere leaves the map consistent.
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Store for MemoryStore {
    fn write(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        let mut files = self.locked();
        let used = files.values().map(|file| file.used + 1).max();
        let file = Shelved {
            content: content.to_owned(),
            used: used.unwrap_or(1),
        };
        files.insert(path.to_owned(), file);
        Ok(())
    }

    fn list(&self, folder: &Path, ending: &str) -> Result<Vec<String>, FileError> {
        let files = self.locked();
        let inside = files.keys().filter(|p| p.parent() == Some(folder));
        let names = inside.filter_map(|p| p.file_name());
        let names = names.map(|n| n.to_string_lossy().into_owned());
        Ok(names.filter(|n| n.ends_with(ending)).collect())
    }

    fn read(&self, path: &Path, _limit: u64) -> Result<Vec<u8>, FileError> {
        let missing = || FileError::Missing(path.display().to_string());
        let files = self.locked();
        let content = files.get(path).map(|file| file.content.clone());
        content.ok_or_else(missing)
    }

    fn read_start(&self, path: &Path, bytes: u64) -> Result<Vec<u8>, FileError> {
        let mut content = self.read(path, bytes)?;
        content.truncate(usize::try_from(bytes).unwrap_or(usize::MAX));
        Ok(content)
    }

    fn entries(&self, folder: &Path) -> Result<Vec<Entry>, FileError> {
        let mut out: Vec<Entry> = Vec::new();
        for (path, file) in self.locked().iter() {
            let Some(mut inside) = path.strip_prefix(folder).ok().map(Path::components) else {
                continue;
            };
            let Some(first) = inside.next() else { continue };
            let name = first.as_os_str().to_string_lossy().into_owned();
            let deeper = inside.next().is_some();
            if out.last().is_none_or(|last| last.name != name) {
                out.push(Entry {
                    name,
                    folder: deeper,
                    bytes: if deeper { 0 } else { file.content.len() as u64 },
                    used: file.used,
                });
            }
        }
        Ok(out)
    }

    fn touch(&self, path: &Path) -> Result<(), FileError> {
        let content = self.read(path, u64::MAX)?;
        self.write(path, &content)
    }

    fn remove(&self, path: &Path) -> Result<(), FileError> {
        self.locked().remove(path);
        Ok(())
    }
}
