//! Files that are written piece by piece: a film is larger than the memory it is made in.
//!
//! Invariant: as with whole files, what stands at the path is the old file until the new one is
//! finished, and a file that is given up leaves nothing behind.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{FileError, Store, beside, io_error};

/// A file that grows until it is finished; dropped before, it was never there.
pub trait AtomicWriter: Write {
    /// Puts the file in its place.
    ///
    /// # Errors
    /// [`FileError`] with the path; the old file is then untouched.
    fn finish(self: Box<Self>) -> Result<(), FileError>;
}

/// For stores that only take whole files: grows in memory.
pub(super) struct Gathered<'s, S: ?Sized> {
    store: &'s S,
    path: PathBuf,
    bytes: Vec<u8>,
}

impl<'s, S: Store + ?Sized> Gathered<'s, S> {
    pub(super) fn new(store: &'s S, path: &Path) -> Gathered<'s, S> {
        Gathered {
            store,
            path: path.to_owned(),
            bytes: Vec::new(),
        }
    }
}

impl<S: ?Sized> Write for Gathered<'_, S> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<S: Store + ?Sized> AtomicWriter for Gathered<'_, S> {
    fn finish(self: Box<Self>) -> Result<(), FileError> {
        self.store.write(&self.path, &self.bytes)
    }
}

/// A file on disk, beside its place until it is finished.
pub(super) struct Beside {
    /// `None` once it is finished or failed.
    file: Option<BufWriter<fs::File>>,
    beside: PathBuf,
    path: PathBuf,
}

impl Beside {
    pub(super) fn new(path: &Path) -> Result<Beside, FileError> {
        let beside = beside(path)?;
        let file = fs::File::create(&beside).map_err(io_error(path.display()))?;
        Ok(Beside {
            file: Some(BufWriter::new(file)),
            beside,
            path: path.to_owned(),
        })
    }

    fn open(&mut self) -> io::Result<&mut BufWriter<fs::File>> {
        let closed = || io::Error::other("the file is finished");
        self.file.as_mut().ok_or_else(closed)
    }
}

impl Write for Beside {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.open()?.flush()
    }
}

impl AtomicWriter for Beside {
    fn finish(mut self: Box<Self>) -> Result<(), FileError> {
        let place = |this: &mut Beside| {
            this.flush()?;
            this.open()?.get_ref().sync_all()?;
            fs::rename(&this.beside, &this.path)
        };
        place(&mut self).map_err(io_error(self.path.display()))?;
        self.file = None;
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            // Leaving the part behind would only litter; that it may be gone already is fine.
            let _ = fs::remove_file(&self.beside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::{Disk, MemoryStore};

    #[test]
    fn a_growing_file_takes_its_place_when_it_is_finished_and_not_before() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep/film");
        let count = || fs::read_dir(path.parent().unwrap()).unwrap().count();
        let mut file = Disk.begin(&path).unwrap();
        file.write_all(b"one").unwrap();
        assert!(!path.exists());
        file.write_all(b" two").unwrap();
        file.finish().unwrap();
        assert_eq!(
            (fs::read(&path).unwrap().as_slice(), count()),
            (&b"one two"[..], 1)
        );
        let mut given_up = Disk.begin(&path).unwrap();
        given_up.write_all(b"three").unwrap();
        given_up.flush().unwrap();
        assert_eq!(count(), 2);
        drop(given_up);
        assert_eq!(
            (fs::read(&path).unwrap().as_slice(), count()),
            (&b"one two"[..], 1)
        );
    }

    #[test]
    fn a_store_of_whole_files_takes_one_when_it_is_finished() {
        let store = MemoryStore::default();
        let mut file = store.begin(Path::new("film")).unwrap();
        file.write_all(b"one").unwrap();
        assert!(store.paths().is_empty());
        file.finish().unwrap();
        assert_eq!(store.read(Path::new("film"), 9).unwrap(), b"one");
    }
}
