//! Claims on work that processes of several machines share: a file for each, made exclusively, renewed
//! while its holder is at work, stolen once it is not.
//!
//! Invariant: nobody removes or overwrites the claim of somebody else who may be at work. A stale claim
//! stays; who steals it makes the one of the next number, `NAME.1` after `NAME.0`, exclusively as well, so
//! that of two thieves one gets it. The age of a claim is the difference of two times that the file system
//! gives, so that the machines' own clocks do not matter.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime};

use super::disk::folder_or_empty;
use super::{FileError, io_error, open, process, unique};

/// Bytes of a claim's file that are read.
const LONGEST: u64 = 1024;

/// A claim is renewed when this part of its lease is over.
const RENEWALS: u32 = 4;

/// Attempts to make a claim before its folder is given up: each fails only where another process has made
/// or removed one in between.
const ATTEMPTS: usize = 16;

/// Who holds a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Holder {
    /// The machine's name.
    pub host: String,
    /// The process's number there.
    pub process: u32,
    /// The time since the claim was made or renewed.
    pub age: Duration,
    /// How long it holds without being renewed.
    pub lease: Duration,
}

impl Holder {
    /// True once the claim may be stolen.
    pub fn is_stale(&self) -> bool {
        self.age > self.lease
    }
}

/// What an attempt to claim something came to.
#[derive(Debug)]
pub enum Claimed {
    /// It is ours until the claim is dropped.
    Ours(Claim),
    /// Somebody else is at work on it.
    By(Holder),
}

/// A claim of our own; dropped, it is given up.
#[derive(Debug)]
pub struct Claim {
    folder: PathBuf,
    name: String,
    number: u64,
    content: String,
    interval: Duration,
    renewed: Mutex<Instant>,
}

/// Claims `name` in `folder`, which is made when it is missing; the claim holds for `lease` without being
/// renewed.
///
/// # Errors
/// [`FileError`] when the folder cannot be used.
pub fn claim(folder: &Path, name: &str, lease: Duration) -> Result<Claimed, FileError> {
    fs::create_dir_all(folder).map_err(io_error(folder.display()))?;
    for _ in 0..ATTEMPTS {
        let number = match newest(folder, name)? {
            None => 0,
            Some(number) => match holder(folder, name, number, lease)? {
                // Given up since it was listed.
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

/// Everything that is claimed in `folder`, stale claims too, by name.
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
    /// Renews the claim where a part of its lease is over. Called as often as one likes, by any thread.
    /// One that cannot be renewed may be stolen, which costs a second rendering and does no harm.
    pub fn renew(&self) {
        let Ok(mut renewed) = self.renewed.try_lock() else {
            return;
        };
        if renewed.elapsed() >= self.interval {
            *renewed = Instant::now();
            let _ = self.write_again();
        }
    }

    /// Writing, unlike setting a time, gives the file the time of the file system.
    fn write_again(&self) -> io::Result<()> {
        let path = self.folder.join(file_name(&self.name, self.number));
        let options = &mut File::options();
        let mut file = open::without_waiting(options.write(true)).open(path)?;
        file.write_all(self.content.as_bytes())
    }
}

impl Drop for Claim {
    /// Removes the claim, and then those that it was stolen from: the other way round a third process
    /// could take one for the newest.
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

/// Makes the claim of a number; `None` where somebody else has.
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

/// Who holds a claim; `None` where it is gone. One that cannot be read, as it is just being written, is held
/// for `lease` by somebody.
fn holder(
    folder: &Path,
    name: &str,
    number: u64,
    lease: Duration,
) -> Result<Option<Holder>, FileError> {
    let path = folder.join(file_name(name, number));
    // An open file has the newest times that a network file system knows.
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

/// The time of the file system.
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
        // The first was slow and not dead: the thief's claim stays.
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

    /// Threads in place of processes: of many that find the same claim stale one gets the next.
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
