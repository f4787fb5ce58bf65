//! Temporary files next to their targets: their names, and how to tell leftovers of killed
//! processes from files being written.
//!
//! Invariant: a part is locked while it is written, so that an unlocked one whose process is gone
//! is litter. The lock alone is not enough on file systems without locks, nor is the process number
//! when two machines or containers share a folder.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use super::{FileError, io_error, open, unique};

/// Longest name of a target: a part's suffix must fit in the 255 bytes of file systems.
const LONGEST: usize = 200;

/// Creates a locked part for the file at `path`, and its folder if missing.
pub(super) fn create(path: &Path) -> Result<(File, PathBuf), FileError> {
    let io = io_error(path.display());
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(io_error(folder.display()))?;
    }
    let name = path.file_name().unwrap_or_default();
    let short = if name.len() > LONGEST {
        OsStr::new("long")
    } else {
        name
    };
    let mut name = short.to_owned();
    name.push(format!(".{}-{:016x}.part", std::process::id(), unique()));
    let part = path.with_file_name(name);
    let file = File::options().write(true).create_new(true).open(&part);
    let file = file.map_err(io)?;
    // Without locks, the process number has to do.
    let _ = file.try_lock();
    Ok((file, part))
}

/// Removes the parts in `folder` that no process writes any more. Errors are ignored: a part is
/// only litter.
pub(super) fn sweep(folder: &Path) {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let writer = entry.file_name().to_str().and_then(writer);
        let path = entry.path();
        if writer.is_some_and(|id| !is_running(id)) && is_given_up(&path).unwrap_or(false) {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Process number in the name of a part.
fn writer(name: &str) -> Option<u32> {
    let (stem, mark) = name.strip_suffix(".part")?.rsplit_once('.')?;
    let (id, random) = mark.split_once('-')?;
    let hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
    let ours = !stem.is_empty() && random.len() == 16 && random.chars().all(hex);
    id.parse().ok().filter(|_| ours)
}

#[cfg(unix)]
fn is_running(id: u32) -> bool {
    use nix::errno::Errno;
    use nix::sys::signal::kill;
    let id = i32::try_from(id).map(nix::unistd::Pid::from_raw);
    // No signal is sent; a process of another user also exists.
    id.is_ok_and(|id| kill(id, None) != Err(Errno::ESRCH))
}

#[cfg(not(unix))]
fn is_running(id: u32) -> bool {
    id == std::process::id()
}

/// True when a file's lock is free.
fn is_given_up(path: &Path) -> io::Result<bool> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Ok(false);
    }
    let file = open::without_waiting(File::options().append(true)).open(path)?;
    Ok(file.try_lock().is_ok())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test's own data")]
mod tests {
    use super::*;

    #[test]
    fn only_parts_of_processes_that_are_gone_are_removed() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let gone = at("a.png.4194305-0123456789abcdef.part");
        let kept = [
            at("mine.part"),
            at("a.part"),
            at("a.png.4194305-0123456789abcde.part"),
            at("a.png.4194305-0123456789ABCDEF.part"),
            at(".4194305-0123456789abcdef.part"),
            at("a.png.x-0123456789abcdef.part"),
            at(&format!(
                "a.png.{}-0123456789abcdef.part",
                std::process::id()
            )),
            at("locked.4194305-0123456789abcdef.part"),
        ];
        for path in kept.iter().chain([&gone]) {
            fs::write(path, "half").unwrap();
        }
        let folder = at("folder.4194305-0123456789abcdef.part");
        fs::create_dir(&folder).unwrap();
        let held = File::options().append(true).open(&kept[7]).unwrap();
        held.lock().unwrap();
        sweep(dir.path());
        assert!(!gone.exists());
        for path in kept.iter().chain([&folder]) {
            assert!(path.exists(), "{}", path.display());
        }
        drop(held);
        sweep(dir.path());
        assert!(!kept[7].exists(), "its writer is gone now");
        sweep(&at("none"));
    }
}
