//! What stands in a folder on disk, and when it was last used.

use std::fs;
use std::io;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use super::FileError;

/// A file or folder as it is listed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Its name within the folder.
    pub name: String,
    /// Whether it is a folder itself.
    pub folder: bool,
    /// Size in bytes.
    pub bytes: u64,
    /// When it was last written or touched: rises with time, microseconds on disk.
    pub used: u64,
}

fn io_error(path: &Path) -> impl Fn(io::Error) -> FileError + '_ {
    |source| match source.kind() {
        io::ErrorKind::NotFound => FileError::Missing(path.display().to_string()),
        _ => FileError::Io {
            path: path.display().to_string(),
            source,
        },
    }
}

/// Entries of `folder` in order of names; a missing folder is empty, what vanishes meanwhile and
/// names that are no text are left out.
pub(super) fn list(folder: &Path) -> Result<Vec<Entry>, FileError> {
    let entries = match fs::read_dir(folder) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(io_error(folder))?,
    };
    let mut out = Vec::new();
    for entry in entries {
        let entry = entry.map_err(io_error(folder))?;
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

/// At most the first `bytes` bytes of a file.
pub(super) fn read_start(path: &Path, bytes: u64) -> Result<Vec<u8>, FileError> {
    use std::io::Read;
    let file = fs::File::open(path).map_err(io_error(path))?;
    let mut start = Vec::new();
    let read = file.take(bytes).read_to_end(&mut start);
    read.map_err(io_error(path))?;
    Ok(start)
}

/// Sets a file's time of change to now; its content is not touched.
pub(super) fn touch(path: &Path) -> Result<(), FileError> {
    let file = fs::File::options().append(true).open(path);
    let touched = file.and_then(|f| f.set_modified(SystemTime::now()));
    touched.map_err(io_error(path))
}

/// Removes a file, or a folder that is empty; what is missing is removed already.
pub(super) fn remove(path: &Path) -> Result<(), FileError> {
    let removed = match fs::symlink_metadata(path) {
        Ok(about) if about.is_dir() => fs::remove_dir(path),
        _ => fs::remove_file(path),
    };
    match removed {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other.map_err(io_error(path)),
    }
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
    fn a_touch_is_seen_and_changes_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        fs::write(&path, "whole").unwrap();
        let long_ago = UNIX_EPOCH + std::time::Duration::from_secs(1_000_000);
        let file = fs::File::options().append(true).open(&path).unwrap();
        file.set_modified(long_ago).unwrap();
        fs::create_dir(dir.path().join("b")).unwrap();
        let before = list(dir.path()).unwrap();
        assert_eq!(before[0].used, 1_000_000_000_000);
        assert_eq!((before[0].bytes, before[1].folder), (5, true));
        touch(&path).unwrap();
        assert!(list(dir.path()).unwrap()[0].used > before[0].used);
        assert_eq!(read_start(&path, 3).unwrap(), b"who");
        assert_eq!(read_start(&path, 99).unwrap(), b"whole");
        remove(&path).unwrap();
        remove(&path).unwrap();
        remove(&dir.path().join("b")).unwrap();
        assert!(list(dir.path()).unwrap().is_empty());
        assert!(list(&dir.path().join("none")).unwrap().is_empty());
        assert!(matches!(touch(&path), Err(FileError::Missing(_))));
    }
}
