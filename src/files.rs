//! The one door to the outside: reading a show's files, writing results, other programs, the clock.
//!
//! Invariants: a show reads only from its own folder downwards, whatever links or `..` a path
//! holds and whatever is put in their place meanwhile; only regular files are read; a file is never
//! left half written (it is written beside its place, then renamed). No other module of the library
//! touches `std::fs`, a process or a clock.

pub mod process;

mod address_space;
mod atomic_writer;
mod disk;
mod open;
mod part;
mod standard;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs;
use std::hash::{BuildHasher as _, Hasher as _, RandomState};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime};

use self::atomic_writer::Gathered;
use self::open::{Opened, Refusal, stamp};

pub use self::address_space::{address_space, is_limited, return_large_blocks};
pub use self::atomic_writer::AtomicWriter;
pub use self::disk::Disk;
pub use self::standard::output_goes_nowhere;

/// Why a file could not be read or written.
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
        /// The largest size that is read.
        limit: u64,
    },
    /// It is no regular file: reading it could wait, or go on, without end.
    #[error("`{path}` is {kind}, not a file")]
    NotAFile {
        /// The path as given.
        path: String,
        /// `a folder`, `a pipe`, `a socket` or `a device`.
        kind: &'static str,
    },
    /// The file to be edited has other names too, which would keep the old content.
    #[error("`{path}` has {names} names (hard links)")]
    Linked {
        /// The path as given.
        path: String,
        /// How many names it has.
        names: u64,
    },
    /// Anything else the operating system says.
    #[error("`{path}`: {source}")]
    Io {
        /// The path as given.
        path: String,
        /// What the system said.
        source: io::Error,
    },
}

/// Reads the files a show refers to, by paths relative to the show's folder.
pub trait Files: Send + Sync {
    /// The whole content of `path`.
    ///
    /// # Errors
    /// [`FileError`] when it is outside the folder, missing, over the limit or unreadable.
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError>;

    /// Was the file at this path, as results are named, read through this?
    fn has_read(&self, path: &Path) -> bool {
        let _ = path;
        false
    }

    /// The files that were read, as they were then; nothing where files do not change.
    fn as_read(&self) -> Vec<Stamp> {
        Vec::new()
    }

    /// Was one of them edited since?
    fn have_changed(&self) -> bool {
        self.as_read() != self.as_is()
    }

    /// The same files as they are now.
    fn as_is(&self) -> Vec<Stamp> {
        Vec::new()
    }
}

/// Size of a file and when it was changed; `None` when it is gone.
pub type Stamp = Option<(u64, SystemTime)>;

fn stamp_of(path: &Path) -> Stamp {
    stamp(&fs::metadata(path).ok()?)
}

/// Do two paths name one file that exists?
pub fn is_same(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// True for a symbolic link, wherever it leads.
pub fn is_link(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|about| about.is_symlink())
}

/// `path` with `.` and `..` resolved; `None` when absolute or when it climbs above its start.
fn inside(path: &str) -> Option<PathBuf> {
    let mut out = PathBuf::new();
    for part in Path::new(path).components() {
        match part {
            Component::Normal(name) => out.push(name),
            Component::CurDir => {}
            Component::ParentDir => {
                if !out.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(out)
}

/// A folder on disk; symbolic links are followed only when they stay inside it.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
    limit: u64,
    /// What was read so far, without links.
    read: Arc<Mutex<BTreeMap<PathBuf, Stamp>>>,
}

impl Folder {
    /// Reads below `root` (the empty path is the current folder), files of at most `limit` bytes.
    pub fn new(root: impl Into<PathBuf>, limit: u64) -> Folder {
        let root = root.into();
        let current = root.as_os_str().is_empty();
        Folder {
            root: if current { PathBuf::from(".") } else { root },
            limit,
            read: Arc::default(),
        }
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Stamp>> {
        // Each change is one call: a panic elsewhere leaves nothing half done.
        self.read.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Files for Folder {
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        let relative = inside(path).ok_or_else(|| FileError::Outside(path.to_owned()))?;
        let found = open::beneath(&self.root, &relative).map_err(|refusal| refusal.of(path))?;
        // As it was before it is read: a change meanwhile is a change.
        let stamp = found.opened.stamp();
        let content = read_limited(Ok(found.opened), path, self.limit)?;
        self.known().insert(found.path, stamp);
        Ok(content)
    }

    fn as_read(&self) -> Vec<Stamp> {
        self.known().values().copied().collect()
    }

    fn as_is(&self) -> Vec<Stamp> {
        self.known().keys().map(|path| stamp_of(path)).collect()
    }

    fn has_read(&self, path: &Path) -> bool {
        path.canonicalize()
            .is_ok_and(|full| self.known().contains_key(&full))
    }
}

/// Reads a file up to `limit` bytes, however much it grows meanwhile.
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

/// Files held in memory, for tests and embedding programs.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Memory {
    /// Adds or replaces a file.
    #[must_use]
    pub fn with(mut self, path: &str, content: impl Into<Vec<u8>>) -> Memory {
        self.files.extend(inside(path).map(|p| (p, content.into())));
        self
    }
}

impl Files for Memory {
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        let inside = inside(path).ok_or_else(|| FileError::Outside(path.to_owned()))?;
        self.files
            .get(&inside)
            .cloned()
            .ok_or_else(|| FileError::Missing(path.to_owned()))
    }
}

fn io_error(path: impl Display) -> impl Fn(io::Error) -> FileError {
    move |source| FileError::Io {
        path: path.to_string(),
        source,
    }
}

/// The same, but for a missing file [`FileError::Missing`].
fn read_error(path: impl Display) -> impl Fn(io::Error) -> FileError {
    move |source| match source.kind() {
        io::ErrorKind::NotFound => FileError::Missing(path.to_string()),
        _ => io_error(&path)(source),
    }
}

/// A number that no other call gives: names made of it are unlike those of other threads.
fn unique() -> u64 {
    RandomState::new().build_hasher().finish()
}

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

/// Where results go.
pub trait Store: Send + Sync {
    /// Replaces the file at `path` as a whole, for files that are the program's own; missing folders
    /// are made. A link is replaced, not followed.
    ///
    /// # Errors
    /// [`FileError`] with the path; the old file is then untouched.
    fn write(&self, path: &Path, content: &[u8]) -> Result<(), FileError>;

    /// Writes a result to the place that a person named: as [`Store::write`], but it may be a link,
    /// a pipe or a device.
    ///
    /// # Errors
    /// As [`Store::write`].
    fn output(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        self.write(path, content)
    }

    /// Replaces the text of a file that a person edits: as [`Store::output`], but a file with other
    /// names is refused.
    ///
    /// # Errors
    /// As [`Store::write`], and [`FileError::Linked`].
    fn edit(&self, path: &Path, content: &[u8]) -> Result<(), FileError> {
        self.output(path, content)
    }

    /// A file to be written piece by piece, at a place as for [`Store::output`]; missing folders are
    /// made. Unless a store does better it is gathered in memory.
    ///
    /// # Errors
    /// [`FileError`] when it cannot be begun.
    fn begin<'s>(&'s self, path: &Path) -> Result<Box<dyn AtomicWriter + 's>, FileError> {
        Ok(Box::new(Gathered::new(self, path)))
    }

    /// Removes what killed processes left half written in `folder`; nothing where a store has no
    /// such files.
    fn sweep(&self, folder: &Path) {
        let _ = folder;
    }

    /// Names of the files in `folder` that end in `ending`, in order.
    ///
    /// # Errors
    /// [`FileError`] when the folder is missing or cannot be listed.
    fn list(&self, folder: &Path, ending: &str) -> Result<Vec<String>, FileError>;

    /// The file at `path` as it is now, up to `limit` bytes.
    ///
    /// # Errors
    /// [`FileError`] when missing, too large or unreadable.
    fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, FileError>;

    /// At most the first `bytes` bytes of the file at `path`.
    ///
    /// # Errors
    /// [`FileError`] when missing or unreadable.
    fn read_start(&self, path: &Path, bytes: u64) -> Result<Vec<u8>, FileError>;

    /// What stands in `folder`, in order of names; a missing folder is empty.
    ///
    /// # Errors
    /// [`FileError`] when the folder cannot be listed.
    fn entries(&self, folder: &Path) -> Result<Vec<Entry>, FileError>;

    /// True for a symbolic link, wherever it leads; a store without links has none.
    fn is_link(&self, path: &Path) -> bool {
        let _ = path;
        false
    }

    /// Records that the file at `path` was used now; its content is not rewritten.
    ///
    /// # Errors
    /// [`FileError`] when missing or not ours to touch.
    fn touch(&self, path: &Path) -> Result<(), FileError>;

    /// Removes a file, or a folder that is empty; what is missing is removed already.
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
    /// When it was last written or touched, in changes of the shelf.
    used: u64,
}

impl MemoryStore {
    /// Paths of everything written, in order.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.locked().keys().cloned().collect()
    }

    fn locked(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Shelved>> {
        // A panic elsewhere cannot leave the map half changed: each change is one call.
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

/// The processor's name as the system gives it; `None` where it does not (only Linux does).
pub fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// Seconds passed, as the embedding program measures them.
pub trait Clock: Send + Sync {
    /// Seconds since a fixed moment of the clock's own choice; never falls.
    fn seconds(&self) -> f64;
}

impl<C: Clock + ?Sized> Clock for Arc<C> {
    fn seconds(&self) -> f64 {
        self.as_ref().seconds()
    }
}

/// The machine's monotonic clock. Where the platform has none (WebAssembly without a host's) it
/// stands still: an embedding program there gives its own.
#[derive(Clone, Copy, Debug)]
pub struct Monotonic(Option<Instant>);

impl Default for Monotonic {
    fn default() -> Self {
        Monotonic((!cfg!(target_family = "wasm")).then(Instant::now))
    }
}

impl Clock for Monotonic {
    fn seconds(&self) -> f64 {
        self.0.map_or(0.0, |start| start.elapsed().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_keeps_its_readers_inside() {
        let dir = tempfile::tempdir().unwrap();
        let show = dir.path().join("show");
        fs::create_dir(&show).unwrap();
        fs::write(dir.path().join("secret"), "s").unwrap();
        fs::write(show.join("a.obj"), "v").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(dir.path().join("secret"), show.join("link")).unwrap();
        let files = Folder::new(&show, 10);
        assert_eq!(files.read("./x/../a.obj").unwrap(), b"v");
        for bad in ["../secret", "/etc/passwd", "x/../../secret"] {
            assert!(
                matches!(files.read(bad), Err(FileError::Outside(_))),
                "{bad}"
            );
        }
        #[cfg(unix)]
        assert!(matches!(files.read("link"), Err(FileError::Outside(_))));
        assert!(matches!(files.read("none"), Err(FileError::Missing(_))));
        fs::write(show.join("big"), "12345678901").unwrap();
        assert!(matches!(
            files.read("big"),
            Err(FileError::TooLarge { size: 11, .. })
        ));
    }

    /// While a link is swapped between a file of the show and one outside, and a folder between one
    /// of the show and a link to one outside, what is read is the show's or refused.
    #[cfg(unix)]
    #[test]
    fn a_link_that_is_swapped_meanwhile_leads_nowhere_else() {
        use std::os::unix::fs::symlink;
        use std::sync::atomic::{AtomicBool, Ordering};

        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in ["show/own", "out"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        fs::write(at("show/own/a"), "show").unwrap();
        fs::write(at("out/a"), "secret").unwrap();
        let done = AtomicBool::new(false);
        let begin = Instant::now();
        let (read, refused) = std::thread::scope(|scope| {
            scope.spawn(|| {
                let links = [
                    ("show/link", ["own/a".into(), at("out/a")]),
                    ("show/folder", ["own".into(), at("out")]),
                ];
                while !done.load(Ordering::Relaxed) {
                    for turn in 0..2 {
                        for (name, targets) in &links {
                            let _ = symlink(&targets[turn], at("show/new"));
                            let _ = fs::rename(at("show/new"), at(name));
                        }
                    }
                }
            });
            let files = Folder::new(at("show"), 100);
            let (mut read, mut refused) = (0, 0);
            while begin.elapsed().as_secs_f64() < 1.0 {
                for name in ["link", "folder/a"] {
                    match files.read(name) {
                        Ok(content) => {
                            assert_eq!(content, b"show", "after {read} reads");
                            read += 1;
                        }
                        Err(FileError::Missing(_)) if read + refused == 0 => {}
                        Err(FileError::Outside(_)) => refused += 1,
                        Err(error) => {
                            done.store(true, Ordering::Relaxed);
                            panic!("{error}");
                        }
                    }
                }
            }
            done.store(true, Ordering::Relaxed);
            (read, refused)
        });
        assert!(read > 0 && refused > 0, "{read} read, {refused} refused");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_within_the_folder_and_no_further() {
        use std::os::unix::fs::symlink;

        let dir = tempfile::tempdir().unwrap();
        let root = dir.path().canonicalize().unwrap();
        let at = |name: &str| root.join(name);
        fs::create_dir_all(at("show/own/deep")).unwrap();
        fs::write(at("show/own/a"), "a").unwrap();
        fs::write(at("secret"), "s").unwrap();
        for (target, name) in [
            ("own/a".into(), "to_file"),
            ("own".into(), "to_folder"),
            ("deep/../../own/a".into(), "own/around"),
            (at("show/own/a"), "absolute"),
            ("to_file".into(), "to_link"),
            ("..".into(), "up"),
            ("../secret".into(), "out"),
            (at("secret"), "absolute_out"),
            (at("show/../secret"), "around_out"),
            ("loop".into(), "loop"),
        ] {
            symlink::<PathBuf, _>(target, at("show").join(name)).unwrap();
        }
        let files = Folder::new(at("show"), 10);
        let own = ["own/a", "to_file", "to_folder/a", "own/around", "absolute"];
        for name in own.into_iter().chain(["to_link", "own/deep/../a"]) {
            assert_eq!(files.read(name).unwrap(), b"a", "{name}");
            assert!(files.has_read(&at("show").join(name)), "{name}");
        }
        // However often one file is named, it is one.
        assert_eq!(files.as_read().len(), 1);
        for name in ["up/secret", "up", "out", "absolute_out", "around_out"] {
            let found = files.read(name);
            assert!(matches!(found, Err(FileError::Outside(_))), "{name}");
        }
        assert!(matches!(files.read("loop"), Err(FileError::Io { .. })));
        assert!(matches!(files.read("own/a/b"), Err(FileError::Io { .. })));
        assert!(matches!(files.read("own/b"), Err(FileError::Missing(_))));
    }

    /// What is no file is refused at once, whether a show or a person names it.
    #[cfg(unix)]
    #[test]
    fn only_files_are_read() {
        use nix::sys::stat::Mode;

        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        nix::unistd::mkfifo(&at("pipe"), Mode::S_IRWXU).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        fs::create_dir(at("folder")).unwrap();
        let files = Folder::new(dir.path(), 10);
        for name in ["pipe", "socket", "folder"] {
            let said = format!("is a {name}, not a file");
            let by_show = files.read(name).unwrap_err().to_string();
            let by_name = Disk.read(&at(name), 10).unwrap_err().to_string();
            let start = Disk.read_start(&at(name), 10).unwrap_err().to_string();
            for error in [by_show, by_name, start] {
                assert!(error.ends_with(&said), "{error}");
            }
        }
        for device in ["/dev/zero", "/dev/null"] {
            let error = Disk.read(Path::new(device), 10).unwrap_err().to_string();
            assert_eq!(error, format!("`{device}` is a device, not a file"));
        }
    }
}
