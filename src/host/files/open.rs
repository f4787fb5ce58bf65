//! Opens files for reading: only regular files, and for a show only files beneath its folder.
//!
//! Invariants: checks are made on the open handle, never on the name alone, which another process
//! may reuse meanwhile; no open waits for another process.

use std::fs::{self, File, Metadata};
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::FileError;

/// A regular file, open for reading.
#[derive(Debug)]
pub(super) struct Opened {
    pub file: File,
    /// Size and modification time at opening.
    pub about: Metadata,
}

/// A file of a show's folder, open for reading.
#[derive(Debug)]
pub(super) struct Found {
    pub opened: Opened,
    /// Its path with links resolved.
    pub path: PathBuf,
}

/// Reason why a file was not opened.
#[derive(Debug)]
pub(super) enum Refusal {
    /// It lies outside the folder.
    Outside,
    /// Not a regular file, but this kind.
    Special(&'static str),
    /// The operating system's reason.
    Io(io::Error),
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Refusal {
        Refusal::Io(error)
    }
}

#[cfg(unix)]
impl From<nix::Error> for Refusal {
    fn from(error: nix::Error) -> Refusal {
        Refusal::Io(error.into())
    }
}

impl Refusal {
    /// The error for a file that a message calls `path`.
    pub(super) fn of(self, path: impl std::fmt::Display) -> FileError {
        let path = path.to_string();
        match self {
            Refusal::Outside => FileError::Outside(path),
            Refusal::Special(kind) => FileError::NotAFile { path, kind },
            Refusal::Io(error) if error.kind() == io::ErrorKind::NotFound => {
                FileError::Missing(path)
            }
            Refusal::Io(source) => FileError::Io { path, source },
        }
    }
}

impl Opened {
    /// Size and modification time.
    pub(super) fn stamp(&self) -> super::Stamp {
        stamp(&self.about)
    }
}

/// Size and modification time.
pub(super) fn stamp(about: &Metadata) -> Option<(u64, SystemTime)> {
    Some((about.len(), about.modified().ok()?))
}

/// Kind of anything but a regular file.
pub(super) fn special(about: &Metadata) -> Option<&'static str> {
    let kind = about.file_type();
    if kind.is_file() {
        return None;
    }
    if kind.is_dir() {
        return Some("a folder");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if kind.is_fifo() {
            return Some("a pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
    }
    Some("a device")
}

/// Opens a regular file anywhere; links are followed.
pub(super) fn regular(path: &Path) -> Result<Opened, Refusal> {
    // Opening a device may act on it, and opening a pipe disturbs its writer. The handle is checked
    // again below.
    if let Some(kind) = special(&fs::metadata(path)?) {
        return Err(Refusal::Special(kind));
    }
    opened(without_waiting(File::options().read(true)).open(path)?)
}

/// Options for an open that does not wait for another process.
pub(super) fn without_waiting(options: &mut fs::OpenOptions) -> &mut fs::OpenOptions {
    #[cfg(unix)]
    {
        use nix::fcntl::OFlag;
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags((OFlag::O_NONBLOCK | OFlag::O_NOCTTY).bits());
    }
    options
}

/// Checks that a handle is a regular file.
fn opened(file: File) -> Result<Opened, Refusal> {
    let about = file.metadata()?;
    match special(&about) {
        Some(kind) => Err(Refusal::Special(kind)),
        None => Ok(Opened { file, about }),
    }
}

/// Opens a regular file beneath the folder `root`; `relative` has neither `..` nor a root. Links
/// are followed only if they stay beneath it. The path is walked folder by folder, each opened from
/// the one before and no link followed by the system itself, so that a link swapped in meanwhile
/// leads nowhere else.
#[cfg(unix)]
pub(super) fn beneath(root: &Path, relative: &Path) -> Result<Found, Refusal> {
    let root = root.canonicalize()?;
    let mut walk = walk::Walk::new(&root)?;
    walk.add(relative)?;
    while let Some(step) = walk.next() {
        if let Some(file) = walk.step(&root, step)? {
            let path = walk.path(&root);
            return Ok(Found {
                opened: opened(file)?,
                path,
            });
        }
    }
    Err(Refusal::Special("a folder"))
}

/// Opens a regular file beneath the folder `root`; the path is checked before it is opened.
#[cfg(not(unix))]
pub(super) fn beneath(root: &Path, relative: &Path) -> Result<Found, Refusal> {
    let root = root.canonicalize()?;
    let path = root.join(relative).canonicalize()?;
    match path.starts_with(&root) {
        true => Ok(Found {
            opened: regular(&path)?,
            path,
        }),
        false => Err(Refusal::Outside),
    }
}

#[cfg(unix)]
mod walk {
    //! Walks to a file beneath a folder, one name at a time.

    use std::collections::VecDeque;
    use std::ffi::{OsStr, OsString};
    use std::fs::File;
    use std::os::fd::OwnedFd;
    use std::path::{Component, Path, PathBuf};

    use nix::errno::Errno;
    use nix::fcntl::{AtFlags, OFlag, openat, readlinkat};
    use nix::sys::stat::{Mode, SFlag, fstatat};

    use super::Refusal;

    /// Most links on one path, as in Linux.
    const LINKS: usize = 40;

    pub enum Step {
        Up,
        Into(OsString),
    }

    /// State of a walk.
    pub struct Walk {
        root: OwnedFd,
        /// The folders from the root to here, and finally the file.
        behind: Vec<(OsString, Option<OwnedFd>)>,
        ahead: VecDeque<Step>,
        links: usize,
    }

    impl Walk {
        pub fn new(root: &Path) -> Result<Walk, Refusal> {
            Ok(Walk {
                root: nix::fcntl::open(root, folder(), Mode::empty())?,
                behind: Vec::new(),
                ahead: VecDeque::new(),
                links: 0,
            })
        }

        pub fn next(&mut self) -> Option<Step> {
            self.ahead.pop_front()
        }

        /// Prepends a relative path to the remaining names.
        pub fn add(&mut self, path: &Path) -> Result<(), Refusal> {
            for part in path.components().rev() {
                match part {
                    Component::CurDir => {}
                    Component::ParentDir => self.ahead.push_front(Step::Up),
                    Component::Normal(name) => {
                        self.ahead.push_front(Step::Into(name.to_owned()));
                    }
                    Component::RootDir | Component::Prefix(_) => return Err(Refusal::Outside),
                }
            }
            Ok(())
        }

        /// Takes a step; returns the file once the last name is reached.
        pub fn step(&mut self, root: &Path, step: Step) -> Result<Option<File>, Refusal> {
            let name = match step {
                Step::Up => {
                    self.behind.pop().ok_or(Refusal::Outside)?;
                    return Ok(None);
                }
                Step::Into(name) => name,
            };
            let here = self.here();
            let about = fstatat(here, name.as_os_str(), AtFlags::AT_SYMLINK_NOFOLLOW)?;
            let kind = SFlag::from_bits_truncate(about.st_mode & SFlag::S_IFMT.bits());
            let last = self.ahead.is_empty();
            let opening = match kind {
                SFlag::S_IFLNK => return self.follow(root, &name).map(|()| None),
                SFlag::S_IFDIR => openat(here, name.as_os_str(), folder(), Mode::empty()),
                SFlag::S_IFREG if last => openat(here, name.as_os_str(), file(), Mode::empty()),
                SFlag::S_IFREG => return Err(Errno::ENOTDIR.into()),
                SFlag::S_IFIFO => return Err(Refusal::Special("a pipe")),
                SFlag::S_IFSOCK => return Err(Refusal::Special("a socket")),
                _ => return Err(Refusal::Special("a device")),
            };
            match opening {
                Ok(open) if kind == SFlag::S_IFDIR => {
                    self.behind.push((name, Some(open)));
                    Ok(None)
                }
                Ok(open) => {
                    self.behind.push((name, None));
                    Ok(Some(File::from(open)))
                }
                // It has changed since it was examined.
                Err(Errno::ELOOP | Errno::EMLINK | Errno::ENOTDIR | Errno::ENXIO) => {
                    self.again()?;
                    self.ahead.push_front(Step::Into(name));
                    Ok(None)
                }
                Err(error) => Err(error.into()),
            }
        }

        /// Prepends a link's target to the remaining names.
        fn follow(&mut self, root: &Path, name: &OsStr) -> Result<(), Refusal> {
            self.again()?;
            let target = match readlinkat(self.here(), name) {
                Ok(target) => PathBuf::from(target),
                Err(Errno::EINVAL) => PathBuf::from(name),
                Err(error) => return Err(error.into()),
            };
            if !target.is_absolute() {
                return self.add(&target);
            }
            let inside = target.strip_prefix(root).map_err(|_| Refusal::Outside)?;
            self.behind.clear();
            self.add(inside)
        }

        /// Counts a link or a retry.
        fn again(&mut self) -> Result<(), Refusal> {
            self.links += 1;
            if self.links > LINKS {
                Err(Errno::ELOOP.into())
            } else {
                Ok(())
            }
        }

        fn here(&self) -> &OwnedFd {
            let folders = self.behind.iter().rev();
            folders
                .filter_map(|(_, fd)| fd.as_ref())
                .next()
                .unwrap_or(&self.root)
        }

        /// Current path of the walk.
        pub fn path(&self, root: &Path) -> PathBuf {
            let names = self.behind.iter().map(|(name, _)| name);
            root.iter().chain(names.map(OsString::as_os_str)).collect()
        }
    }

    fn folder() -> OFlag {
        // Permission to search a folder is enough; listing is not needed.
        #[cfg(target_os = "linux")]
        let search = OFlag::O_PATH;
        #[cfg(not(target_os = "linux"))]
        let search = OFlag::O_RDONLY;
        search | OFlag::O_DIRECTORY | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC
    }

    fn file() -> OFlag {
        OFlag::O_RDONLY | OFlag::O_NONBLOCK | OFlag::O_NOCTTY | OFlag::O_NOFOLLOW | OFlag::O_CLOEXEC
    }
}
