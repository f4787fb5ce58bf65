//! The only access to the outside: reading a show's files, writing results, other programs, the
//! clock.
//!
//! Invariants: a show reads only from its own folder downwards, whatever links or `..` a path holds
//! and even if they change meanwhile; only regular files are read; a file is never left half
//! written (it is written to a temporary file, then renamed). No other module of the library
//! touches `std::fs`, a process or a clock.

pub mod claim;
pub mod process;

mod atomic_writer;
mod disk;
mod folder;
mod machine;
mod open;
mod part;
mod store;

use std::fmt::Display;
use std::fs;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use self::open::{Opened, Refusal};

pub use self::atomic_writer::AtomicWriter;
pub use self::disk::Disk;
pub use self::folder::{Files, Folder, Memory, Stamp};
pub use self::machine::{
    Clock, Monotonic, address_space, is_limited, processor, return_freed_memory,
    return_large_blocks,
};
pub use self::store::{Entry, MemoryStore, Store};

/// Error of reading or writing a file.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The path leaves the show's folder.
    #[error("`{0}` is outside the show's folder")]
    Outside(String),
    /// There is no such file.
    #[error("`{0}` does not exist")]
    Missing(String),
    /// The file is larger than the reader's limit.
    #[error("`{path}` has {size} bytes; the limit is {limit}")]
    TooLarge {
        /// The path as given.
        path: String,
        /// Its size in bytes.
        size: u64,
        /// The limit in bytes.
        limit: u64,
    },
    /// Not a regular file: reading it could wait, or continue, without end.
    #[error("`{path}` is {kind}, not a file")]
    NotAFile {
        /// The path as given.
        path: String,
        /// `a folder`, `a pipe`, `a socket` or `a device`.
        kind: &'static str,
    },
    /// The file to be edited has other names, which would keep the old content.
    #[error("`{path}` has {names} names (hard links)")]
    Linked {
        /// The path as given.
        path: String,
        /// Its number of names.
        names: u64,
    },
    /// Any other error of the operating system.
    #[error("`{path}`: {source}")]
    Io {
        /// The path as given.
        path: String,
        /// The system's error.
        source: io::Error,
    },
}

/// True when two paths name one existing file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// A path without `.` and `..`, whether or not it exists.
pub fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => drop(out.pop()),
            part => out.push(part),
        }
    }
    out
}

/// True for a symbolic link, wherever it leads.
pub fn is_link(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|about| about.is_symlink())
}

/// Reads a file up to `limit` bytes, even if it grows meanwhile.
fn read_limited(
    opened: Result<Opened, Refusal>,
    shown: &str,
    limit: u64,
) -> Result<Vec<u8>, FileError> {
    let Opened { file, about } = opened.map_err(|refusal| refusal.of(shown))?;
    let too_large = |size| FileError::TooLarge {
        path: shown.to_owned(),
        size,
        limit,
    };
    if about.len() > limit {
        return Err(too_large(about.len()));
    }
    let mut bytes = Vec::new();
    let read = file.take(limit.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(io_error(shown))?;
    match bytes.len() as u64 {
        size if size > limit => Err(too_large(size)),
        _ => Ok(bytes),
    }
}

fn io_error(path: impl Display) -> impl Fn(io::Error) -> FileError {
    move |source| FileError::Io {
        path: path.to_string(),
        source,
    }
}

/// Turns the system's error into [`FileError::Missing`] or another [`FileError`].
fn read_error(path: impl Display) -> impl Fn(io::Error) -> FileError {
    move |source| match source.kind() {
        io::ErrorKind::NotFound => FileError::Missing(path.to_string()),
        _ => io_error(&path)(source),
    }
}

/// A number unique within the process, for the names of temporary files.
fn unique() -> u64 {
    RandomState::new().build_hasher().finish()
}
