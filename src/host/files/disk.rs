//! Results on disk.

use std::fs;
use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use super::atomic_writer::{self, AtomicWriter, Place};
use super::{Entry, FileError, Store, io_error, open, part, read_error, read_limited};

/// Writes anywhere on disk where the program may.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

fn whole(path: &Path, place: Place, content: &[u8]) -> Result<(), FileError> {
    let mut file = atomic_writer::begin(path, place)?;
    file.write_all(content).map_err(io_error(path.display()))?;
    file.finish()
}

impl Store for Disk {
    /// Writes a temporary file and renames it, so that readers and crashes see the old file or the
    /// new one, never a part.
    fn write(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        whole(path, Place::Name, content)
    }

    /// Writes a temporary file and hard-links it to the path, if the file system supports that;
    /// else like [`Disk::write`].
    fn add(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        whole(path, Place::New, content)
    }

    /// Like [`Disk::write`], but a link is followed and its target keeps its mode; a pipe or a
    /// device is written into.
    fn output(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        whole(path, Place::Target, content)
    }

    fn edit(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        whole(path, Place::Edited, content)
    }

    fn begin<'s>(&'s self, path: &Path) -> Result<Box<dyn AtomicWriter + 's>, FileError> {
        atomic_writer::begin(path, Place::Target)
    }

    fn sweep(&self, folder: &Path) {
        part::sweep(folder);
    }

    fn list(&self, folder: &Path, ending: &str) -> Result<Vec<String>, FileError> {
        let io = read_error(folder.display());
        let mut names = Vec::new();
        for entry in fs::read_dir(folder).map_err(&io)? {
            let name = entry.map_err(&io)?.file_name();
            names.push(name.to_string_lossy().into_owned());
        }
        names.retain(|name| name.ends_with(ending));
        names.sort();
        Ok(names)
    }

    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, FileError> {
        read_limited(open::regular(path), &path.display().to_string(), limit)
    }

    fn read_start(&self, path: &Path, bytes: u64) -> Result<Vec<u8>, FileError> {
        let mut start = Vec::new();
        let opened = open::regular(path).map_err(|refusal| refusal.of(path.display()))?;
        let read = opened.file.take(bytes).read_to_end(&mut start);
        read.map_err(io_error(path.display()))?;
        Ok(start)
    }

    /// Skips entries that vanish meanwhile, and names that are not text.
    fn entries(&self, folder: &Path) -> Result<Vec<Entry>, FileError> {
        let io = read_error(folder.display());
        let mut out = Vec::new();
        for entry in folder_or_empty(folder).map_err(&io)? {
            let entry = entry.map_err(&io)?;
            let (Ok(name), Ok(about)) = (entry.file_name().into_string(), entry.metadata()) else {
                continue;
            };
            let used = about.modified().unwrap_or(UNIX_EPOCH);
            let used = used.duration_since(UNIX_EPOCH).unwrap_or_default();
            out.push(Entry {
                name,
                folder: about.is_dir(),
                bytes: about.len(),
                used: u64::try_from(used.as_micros()).unwrap_or(u64::MAX),
            });
        }
        out.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(out)
    }

    fn is_link(&self, path: &Path) -> bool {
        super::is_link(path)
    }

    /// Sets the file's modification time to now.
    fn touch(&self, path: &Path) -> Result<(), FileError> {
        let options = &mut fs::File::options();
        let file = open::without_waiting(options.append(true)).open(path);
        let touched = file.and_then(|f| f.set_modified(SystemTime::now()));
        touched.map_err(read_error(path.display()))
    }

    fn remove(&self, path: &Path) -> Result<(), FileError> {
        let removed = match fs::symlink_metadata(path) {
            Ok(about) if about.is_dir() => fs::remove_dir(path),
            _ => fs::remove_file(path),
        };
        match removed {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other.map_err(io_error(path.display())),
        }
    }
}

/// The entries of a folder; empty when it is missing.
pub(super) fn folder_or_empty(
    folder: &Path,
) -> io::Result<impl Iterator<Item = io::Result<fs::DirEntry>>> {
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        other => Some(other?),
    };
    Ok(entries.into_iter().flatten())
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]
mod tests {
    use super::*;

    #[test]
    fn writing_replaces_whole_files_and_leaves_no_part() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep/er/file");
        Disk.write(&path, b"one").unwrap();
        Disk.write(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        fs::write(path.with_file_name("a file"), b"x").unwrap();
        let names = Disk.list(path.parent().unwrap(), "ile").unwrap();
        assert_eq!(names, ["a file", "file"]);
    }

    #[test]
    fn what_is_added_first_stays_and_no_part_does() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep/file");
        Disk.add(&path, b"one").unwrap();
        Disk.add(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_touch_is_seen_and_changes_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        fs::write(&path, "whole").unwrap();
        let long_ago = UNIX_EPOCH + std::time::Duration::from_secs(1_000_000);
        let file = fs::File::options().append(true).open(&path).unwrap();
        file.set_modified(long_ago).unwrap();
        fs::create_dir(dir.path().join("b")).unwrap();
        let before = Disk.entries(dir.path()).unwrap();
        assert_eq!(before[0].used, 1_000_000_000_000);
        assert_eq!((before[0].bytes, before[1].folder), (5, true));
        Disk.touch(&path).unwrap();
        assert!(Disk.entries(dir.path()).unwrap()[0].used > before[0].used);
        assert_eq!(Disk.read_start(&path, 3).unwrap(), b"who");
        assert_eq!(Disk.read_start(&path, 99).unwrap(), b"whole");
        Disk.remove(&path).unwrap();
        Disk.remove(&path).unwrap();
        Disk.remove(&dir.path().join("b")).unwrap();
        assert!(Disk.entries(dir.path()).unwrap().is_empty());
        assert!(Disk.entries(&dir.path().join("none")).unwrap().is_empty());
        assert!(matches!(Disk.touch(&path), Err(FileError::Missing(_))));
    }
}
