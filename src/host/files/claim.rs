//! Claims on work shared by processes of several machines: one file each, created exclusively,
//! renewed while its holder works, stolen when stale.
//!
//! Invariant: no process removes or overwrites a claim of another that may still work. A stale
//! claim stays; a thief creates the one with the next number, `NAME.1` after `NAME.0`, exclusively
//! as well, so that only one of two thieves gets it. The age of a claim is the difference of two
//! times of the file system, so that the machines' own clocks do not matter.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime};

use super::disk::folder_or_empty;
use super::{FileError, io_error, open, process, unique};

/// Most bytes read of a claim's file.
const LONGEST: u64 = 1024;

/// A claim is renewed after this fraction (1/4) of its lease.
const RENEWALS: u32 = 4;

/// Attempts to create a claim before its folder is given up: each fails only when another process
/// has created or removed one meanwhile.
const ATTEMPTS: usize = 16;

/// Holder of a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// The machine's name.
    pub host: String,
    /// The process's number there.
    pub process: u32,
    /// Time since the claim was created or renewed.
    pub age: Duration,
    /// Time that it holds without renewal.
    pub lease: Duration,
}

impl Holder {
    /// True once the claim may be stolen.
    pub fn is_stale(&self) -> bool {
        self.age > self.lease
    }
}

/// Result of an attempt to claim something.
#[derive(Debug)]
pub enum Claimed {
    /// The claim is ours until it is dropped.
    Ours(Claim),
    /// Another process works on it.
    By(Holder),
}

/// A claim of this process, released when dropped.
#[derive(Debug)]
pub struct Claim {
    folder: PathBuf,
    name: String,
    number: u64,
    content: String,
    interval: Duration,
    renewed: Mutex<Instant>,
}

/// Claims `name` in `folder`, which is created if missing; the claim holds for `lease` without
/// renewal.
///
/// # Errors
/// [`FileError`] when the folder is unusable.
pub fn claim(folder: &Path, name: &str, lease: Duration) -> Result<Claimed, FileError> {
    fs::create_dir_all(folder).map_err(io_error(folder.display()))?;
    for _ in 0..ATTEMPTS {
        let number = match newest(folder, name)? {
            None => 0,
            Some(number) => match holder(folder, name, number, lease)? {
                // The claim was released after the listing.
                None => continue,
                Some(holder) if holder.is_stale() => number + 1,
                Some(holder) => return Ok(Claimed::By(holder)),
            },
        };
        if let Some(claim) = make(folder, name, number, lease)? {
            return Ok(Claimed::Ours(claim));
        }
    }
    let busy = io::Error::other("its claims change too fast");
    Err(io_error(folder.display())(busy))
}

/// All claims in `folder`, stale ones included, by name.
///
/// # Errors
/// [`FileError`] when the folder cannot be read.
pub fn holders(folder: &Path, lease: Duration) -> Result<BTreeMap<String, Holder>, FileError> {
    let mut newest: BTreeMap<String, u64> = BTreeMap::new();
    for (name, number) in listed(folder)? {
        let known = newest.entry(name).or_default();
        *known = number.max(*known);
    }
    let mut out = BTreeMap::new();
    for (name, number) in newest {
        if let Some(holder) = holder(folder, &name, number, lease)? {
            out.insert(name, holder);
        }
    }
    Ok(out)
}

impl Claim {
    /// Renews the claim when part of its lease is over. Any thread may call it as often as it
    /// likes. A claim that cannot be renewed may be stolen, which costs a second rendering and does
    /// no harm.
    pub fn renew(&self) {
        let Ok(mut renewed) = self.renewed.try_lock() else {
            return;
        };
        if renewed.elapsed() >= self.interval {
            *renewed = Instant::now();
            let _ = self.write_again();
        }
    }

    /// Rewrites the file: unlike setting a time, writing uses the time of the file system.
    fn write_again(&self) -> io::Result<()> {
        let path = self.folder.join(file_name(&self.name, self.number));
        let options = &mut File::options();
        let mut file = open::without_waiting(options.write(true)).open(path)?;
        file.write_all(self.content.as_bytes())
    }
}

impl Drop for Claim {
    /// Removes the claim first, then the stolen ones: otherwise a third process could take a stolen
    /// one for the newest.
    fn drop(&mut self) {
        let own = self.folder.join(file_name(&self.name, self.number));
        process::forget_file(&own);
        let _ = fs::remove_file(own);
        for (name, number) in listed(&self.folder).unwrap_or_default() {
            if name == self.name && number < self.number {
                let _ = fs::remove_file(self.folder.join(file_name(&name, number)));
            }
        }
    }
}

/// Creates the claim with this number; `None` when it exists.
fn make(
    folder: &Path,
    name: &str,
    number: u64,
    lease: Duration,
) -> Result<Option<Claim>, FileError> {
    let path = folder.join(file_name(name, number));
    let mut file = match File::options().write(true).create_new(true).open(&path) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => return Ok(None),
        other => other.map_err(io_error(path.display()))?,
    };
    let claim = Claim {
        folder: folder.to_owned(),
        name: name.to_owned(),
        number,
        content: content(lease),
        interval: lease / RENEWALS,
        renewed: Mutex::new(Instant::now()),
    };
    process::remember_file(&path);
    let written = file.write_all(claim.content.as_bytes());
    written.map_err(io_error(path.display()))?;
    Ok(Some(claim))
}

fn content(lease: Duration) -> String {
    format!(
        "{} {} {}\n",
        host(),
        std::process::id(),
        lease.as_secs_f64()
    )
}

/// This machine's name, as one word.
pub fn host() -> String {
    #[cfg(unix)]
    let name = nix::unistd::gethostname().unwrap_or_default();
    #[cfg(not(unix))]
    let name = std::env::var_os("COMPUTERNAME").unwrap_or_default();
    let name = name.to_string_lossy();
    let is_plain = |c: &char| c.is_ascii_alphanumeric() || "-._".contains(*c);
    let name: String = name.chars().filter(is_plain).take(64).collect();
    if name.is_empty() {
        "unknown".to_owned()
    } else {
        name
    }
}

fn file_name(name: &str, number: u64) -> String {
    format!("{name}.{number}")
}

/// Names and numbers of the claims in a folder.
fn listed(folder: &Path) -> Result<Vec<(String, u64)>, FileError> {
    let io = io_error(folder.display());
    let mut out = Vec::new();
    for entry in folder_or_empty(folder).map_err(&io)? {
        let file = entry.map_err(&io)?.file_name();
        let parts = file.to_str().and_then(|file| file.rsplit_once('.'));
        let claim = parts.and_then(|(name, number)| Some((name.to_owned(), number.parse().ok()?)));
        out.extend(claim);
    }
    Ok(out)
}

fn newest(folder: &Path, name: &str) -> Result<Option<u64>, FileError> {
    let all = listed(folder)?.into_iter();
    Ok(all.filter(|(of, _)| of == name).map(|(_, n)| n).max())
}

/// Holder of a claim; `None` when it is gone. A claim that cannot be read, because it is just being
/// written, counts as held for `lease`.
fn holder(
    folder: &Path,
    name: &str,
    number: u64,
    lease: Duration,
) -> Result<Option<Holder>, FileError> {
    let path = folder.join(file_name(name, number));
    // On a network file system, an open file has the most recent times.
    let opened = open::without_waiting(File::options().read(true)).open(&path);
    let read = opened.and_then(|file| {
        let written = file.metadata()?.modified()?;
        let mut text = String::new();
        file.take(LONGEST).read_to_string(&mut text)?;
        Ok((written, text))
    });
    let (written, text) = match read {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        other => other.map_err(io_error(path.display()))?,
    };
    let age = now(folder)?.duration_since(written).unwrap_or_default();
    let (host, process, lease) = parsed(&text).unwrap_or(("somebody".to_owned(), 0, lease));
    Ok(Some(Holder {
        host,
        process,
        age,
        lease,
    }))
}

fn parsed(text: &str) -> Option<(String, u32, Duration)> {
    let mut words = text.split_whitespace();
    let (host, process) = (words.next()?, words.next()?.parse().ok()?);
    let lease = Duration::try_from_secs_f64(words.next()?.parse().ok()?).ok()?;
    Some((host.to_owned(), process, lease))
}

/// Current time of the file system.
fn now(folder: &Path) -> Result<SystemTime, FileError> {
    let path = folder.join(format!("now-{:016x}", unique()));
    let made = File::options().write(true).create_new(true).open(&path);
    let time = made.and_then(|file| file.metadata()?.modified());
    let _ = fs::remove_file(&path);
    time.map_err(io_error(path.display()))
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]
mod tests {
    use super::*;

    const LEASE: Duration = Duration::from_secs(60);

    fn ours(folder: &Path, lease: Duration) -> Claim {
        match claim(folder, "a", lease).unwrap() {
            Claimed::Ours(claim) => claim,
            Claimed::By(holder) => panic!("{holder:?}"),
        }
    }

    fn age(folder: &Path, file: &str, seconds: u64) {
        let file = File::options().append(true).open(folder.join(file));
        let then = SystemTime::now() - Duration::from_secs(seconds);
        file.unwrap().set_modified(then).unwrap();
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let names = entries.map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    #[test]
    fn a_claim_holds_until_it_is_dropped() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("claims");
        let first = ours(&folder, LEASE);
        let Claimed::By(holder) = claim(&folder, "a", LEASE).unwrap() else {
            panic!("two have it");
        };
        assert_eq!((holder.host, holder.process), (host(), std::process::id()));
        assert!(holder.lease == LEASE && holder.age < LEASE);
        assert_eq!(holders(&folder, LEASE).unwrap().len(), 1);
        drop(first);
        assert!(names(&folder).is_empty() && holders(&folder, LEASE).unwrap().is_empty());
        drop(ours(&folder, LEASE));
    }

    #[test]
    fn a_stale_claim_is_stolen_once_and_a_renewed_one_is_not() {
        let dir = tempfile::tempdir().unwrap();
        let dead = ours(dir.path(), LEASE);
        age(dir.path(), "a.0", 61);
        let thief = ours(dir.path(), LEASE);
        assert!(matches!(
            claim(dir.path(), "a", LEASE).unwrap(),
            Claimed::By(_)
        ));
        // The first holder was slow, not dead: the thief's claim stays.
        drop(dead);
        assert_eq!(names(dir.path()), ["a.1"]);
        age(dir.path(), "a.1", 61);
        thief.renew();
        assert!(
            holders(dir.path(), LEASE).unwrap()["a"].is_stale(),
            "a quarter is not over"
        );
        *thief.renewed.lock().unwrap() -= LEASE / RENEWALS;
        thief.renew();
        assert!(!holders(dir.path(), LEASE).unwrap()["a"].is_stale());
        drop(thief);
        assert!(names(dir.path()).is_empty());
    }

    /// When many threads find one claim stale, exactly one gets the next.
    #[test]
    fn of_many_thieves_one_gets_it() {
        let dir = tempfile::tempdir().unwrap();
        for _ in 0..20 {
            std::mem::forget(ours(dir.path(), LEASE));
            age(dir.path(), "a.0", 100);
            let steal = || match claim(dir.path(), "a", LEASE).unwrap() {
                Claimed::Ours(stolen) => {
                    std::mem::forget(stolen);
                    true
                }
                Claimed::By(_) => false,
            };
            let stolen: usize = std::thread::scope(|scope| {
                let thieves: Vec<_> = (0..8).map(|_| scope.spawn(steal)).collect();
                thieves
                    .into_iter()
                    .map(|t| usize::from(t.join().unwrap()))
                    .sum()
            });
            assert_eq!(
                (stolen, names(dir.path())),
                (1, vec!["a.0".into(), "a.1".into()])
            );
            for name in names(dir.path()) {
                fs::remove_file(dir.path().join(name)).unwrap();
            }
        }
    }

    #[test]
    fn a_claim_that_is_being_written_counts_and_so_does_nonsense() {
        let dir = tempfile::tempdir().unwrap();
        for text in ["", "n1 x 60\n", "n1 4 -1", "n1 4 1e400"] {
            fs::write(dir.path().join("a.0"), text).unwrap();
            let Claimed::By(holder) = claim(dir.path(), "a", LEASE).unwrap() else {
                panic!("{text}");
            };
            assert_eq!((holder.host.as_str(), holder.lease), ("somebody", LEASE));
        }
        fs::write(dir.path().join("a.0"), "n1 4711 0.5\n").unwrap();
        age(dir.path(), "a.0", 2);
        let all = holders(dir.path(), LEASE).unwrap();
        assert!(all["a"].host == "n1" && all["a"].process == 4711 && all["a"].is_stale());
    }
}
