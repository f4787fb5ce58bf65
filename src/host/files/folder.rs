//! Sources of a show's files: a folder that no path can leave, or memory.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use super::open::{self, stamp};
use super::{FileError, read_limited};

/// Reads the files a show refers to, by paths relative to the show's folder.
pub trait Files: Send + Sync {
    /// Reads the whole content of `path`.
    ///
    /// # Errors
    /// [`FileError`] when it is outside the folder, missing, over the limit or unreadable.
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError>;

    /// True when the file at this path, named like a result, was read through this source.
    fn has_read(&self, path: &Path) -> bool {
        let _ = path;
        false
    }

    /// State of the files when they were read; empty when files cannot change.
    fn as_read(&self) -> Vec<Stamp> {
        Vec::new()
    }

    /// True when one of them was changed since.
    fn have_changed(&self) -> bool {
        self.as_read() != self.as_is()
    }

    /// Current state of the files read.
    fn as_is(&self) -> Vec<Stamp> {
        Vec::new()
    }
}

/// Size and modification time of a file; `None` when it is gone.
pub type Stamp = Option<(u64, SystemTime)>;

fn stamp_of(path: &Path) -> Stamp {
    stamp(&fs::metadata(path).ok()?)
}

/// `path` with `.` and `..` resolved; `None` when it is absolute or climbs above its start.
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
    /// Files read so far, with links resolved.
    read: Arc<Mutex<BTreeMap<PathBuf, Stamp>>>,
}

impl Folder {
    /// Reads files of at most `limit` bytes below `root` (the empty path is the current folder).
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
        // Each change is one call, so a panic elsewhere leaves the map consistent.
        self.read.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Files for Folder {
    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        let relative = inside(path).ok_or_else(|| FileError::Outside(path.to_owned()))?;
        let found = open::beneath(&self.root, &relative).map_err(|refusal| refusal.of(path))?;
        // Take the stamp before reading, so that a change meanwhile is noticed.
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

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::files::{Disk, Store};

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

    /// Another thread swaps a link between a file of the show and one outside, and a folder with a
    /// link to one outside; reading gives the show's file or an error.
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
        symlink("own/a", at("show/link")).unwrap();
        symlink("own", at("show/folder")).unwrap();
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
        // A file named several ways counts once.
        assert_eq!(files.as_read().len(), 1);
        for name in ["up/secret", "up", "out", "absolute_out", "around_out"] {
            let found = files.read(name);
            assert!(matches!(found, Err(FileError::Outside(_))), "{name}");
        }
        assert!(matches!(files.read("loop"), Err(FileError::Io { .. })));
        assert!(matches!(files.read("own/a/b"), Err(FileError::Io { .. })));
        assert!(matches!(files.read("own/b"), Err(FileError::Missing(_))));
    }

    /// Anything but a regular file is refused at once, whether a show or a person names it.
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
