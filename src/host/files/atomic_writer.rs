//! Files written piece by piece: a film is larger than memory.
//!
//! Invariant: as with whole files, the path holds the old file until the new one is finished, and
//! an abandoned file leaves nothing behind.

use std::fs::{self, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{FileError, Store, io_error, open, part};

/// Most links to one file, as in Linux.
const LINKS: usize = 40;

/// A file that appears when it is finished; dropped before, it leaves nothing behind.
pub trait AtomicWriter: Write {
    /// Moves the file to its path.
    ///
    /// # Errors
    /// [`FileError`] with the path; the old file is then unchanged.
    fn finish(self: Box<Self>) -> Result<(), FileError>;
}

/// Collects the content in memory, for stores that take only whole files.
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

/// The path that a file on disk replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The name: a link there is replaced, not followed.
    Name,
    /// The name, unless it exists.
    New,
    /// The target of the name: links are followed, its mode is kept, a pipe or a device is written
    /// into.
    Target,
    /// Like `Target`, but only a file without other names, which would keep the old content.
    Edited,
}

/// Begins a file on disk.
pub(super) fn begin(path: &Path, place: Place) -> Result<Box<dyn AtomicWriter>, FileError> {
    Ok(match destination(path, place)? {
        Destination::Special => Box::new(Straight::new(path)?),
        Destination::File(target, old) => Box::new(Beside::new(path, target, old.as_ref(), place)?),
    })
}

enum Destination {
    /// A file, and the metadata of the existing one.
    File(PathBuf, Option<Metadata>),
    /// A pipe or a device.
    Special,
}

fn destination(path: &Path, place: Place) -> Result<Destination, FileError> {
    if matches!(place, Place::Name | Place::New) {
        return Ok(Destination::File(path.to_owned(), None));
    }
    let io = io_error(path.display());
    let about = match fs::metadata(path) {
        Ok(about) => about,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let target = new_target(path).map_err(io)?;
            return Ok(Destination::File(target, None));
        }
        Err(error) => return Err(io(error)),
    };
    match open::special(&about) {
        None => {}
        Some("a pipe" | "a device") if place == Place::Target => return Ok(Destination::Special),
        Some(kind) => {
            let path = path.display().to_string();
            return Err(FileError::NotAFile { path, kind });
        }
    }
    // A file may be protected while its folder, which a rename changes, is not.
    let options = &mut fs::File::options();
    open::without_waiting(options.write(true))
        .open(path)
        .map_err(&io)?;
    let names = names(&about);
    if place == Place::Edited && names > 1 {
        let path = path.display().to_string();
        return Err(FileError::Linked { path, names });
    }
    let target = path.canonicalize().map_err(io)?;
    Ok(Destination::File(target, Some(about)))
}

/// Path of a file not yet created: the end of the links, if it is a link.
fn new_target(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = target.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("too many links"))
}

/// Number of names of a file.
fn names(about: &Metadata) -> u64 {
    #[cfg(unix)]
    return std::os::unix::fs::MetadataExt::nlink(about);
    #[cfg(not(unix))]
    {
        let _ = about;
        1
    }
}

/// Gives a file the mode of another, and its owner where permitted.
fn keep_rights(file: &fs::File, old: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt as _, fchown};
        let new = file.metadata()?;
        if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
            // Only root may change the owner; members of a group may set it.
            let _ = fchown(file, Some(old.uid()), Some(old.gid()))
                .or_else(|_| fchown(file, None, Some(old.gid())));
        }
    }
    file.set_permissions(old.permissions())
}

/// A pipe or a device: bytes written cannot be taken back, so they are not held until the end.
struct Straight {
    file: BufWriter<fs::File>,
    path: PathBuf,
}

impl Straight {
    /// Like every program, this waits for a reader of the pipe.
    fn new(path: &Path) -> Result<Straight, FileError> {
        let io = io_error(path.display());
        let file = fs::File::options().write(true).open(path).map_err(&io)?;
        if file.metadata().map_err(&io)?.is_file() {
            return Err(io(io::Error::other("it has become another file meanwhile")));
        }
        Ok(Straight {
            file: BufWriter::new(file),
            path: path.to_owned(),
        })
    }
}

impl Write for Straight {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl AtomicWriter for Straight {
    fn finish(mut self: Box<Self>) -> Result<(), FileError> {
        let flushed = self.file.flush();
        flushed.map_err(io_error(self.path.display()))
    }
}

/// A file on disk, written to a temporary file until it is finished.
struct Beside {
    /// `None` once it is finished or failed.
    file: Option<BufWriter<fs::File>>,
    beside: PathBuf,
    target: PathBuf,
    /// Its path in messages.
    path: PathBuf,
    place: Place,
}

impl Beside {
    fn new(
        path: &Path,
        target: PathBuf,
        old: Option<&Metadata>,
        place: Place,
    ) -> Result<Beside, FileError> {
        let (file, beside) = part::create(&target)?;
        let new = Beside {
            file: Some(BufWriter::new(file)),
            beside,
            target,
            path: path.to_owned(),
            place,
        };
        if let (Some(file), Some(old)) = (&new.file, old) {
            keep_rights(file.get_ref(), old).map_err(io_error(path.display()))?;
        }
        Ok(new)
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
            if this.place == Place::New && link(&this.beside, &this.target) {
                // Dropping it removes the temporary file.
                return Ok(());
            }
            fs::rename(&this.beside, &this.target)?;
            this.file = None;
            Ok(())
        };
        place(&mut self).map_err(io_error(self.path.display()))
    }
}

/// Links a file to another name unless that exists; false when it fails, for example on file
/// systems without hard links.
fn link(file: &Path, name: &Path) -> bool {
    match fs::hard_link(file, name) {
        Ok(()) => true,
        Err(error) => error.kind() == io::ErrorKind::AlreadyExists,
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            // It may be gone already.
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
