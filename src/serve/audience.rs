//! The pages' data and access rights.

use std::collections::{BTreeMap, VecDeque};
use std::net::TcpStream;
use std::sync::atomic::AtomicUsize;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use footlight_engine::playback::page;
use footlight_prompt::Error;

/// Letters of a token, four bits each.
const LETTERS: usize = 32;

/// A secret in an address.
pub struct Token(String);

impl Token {
    /// Creates a token from 128 random bits of the system.
    pub fn new() -> Result<Token, Error> {
        let mut bits = [0_u8; LETTERS / 2];
        getrandom::fill(&mut bits)
            .map_err(|e| Error::Device(format!("the system's random numbers: {e}")))?;
        Ok(Token(bits.iter().map(|b| format!("{b:02x}")).collect()))
    }

    /// Compares in constant time.
    fn is(&self, other: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), other.as_bytes());
        let off = own.iter().zip(other).fold(0, |off, (a, b)| off | (a ^ b));
        own.len() == other.len() && off == 0
    }
}

/// Rights of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Runs the show.
    Runs,
    /// Watches the show.
    Follows,
}

/// The latest action on the show: the desk's state, by names.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The page that acted.
    by: String,
    /// Number of the last cue run.
    cue: Option<String>,
    /// Time in the sequence, where it stops, and since when older light fades.
    time: f64,
    until: f64,
    ran: f64,
    playing: bool,
    /// True when the whole sequence plays instead of a cue.
    sequence: bool,
    /// Level of the grand master, 0 in a blackout; `None` means full.
    grand: Option<f64>,
    /// Levels held by hand.
    held: BTreeMap<String, f64>,
    /// Older light, and the seconds over which it fades.
    rest: Option<BTreeMap<String, [f64; 2]>>,
}

/// An update for the pages.
#[derive(Serialize)]
struct Message<'a> {
    version: u64,
    wrong: &'a str,
    state: &'a str,
    run: Option<&'a Run>,
    /// Seconds since the action.
    age: f64,
}

/// Image files by number.
pub type Files = BTreeMap<u64, Arc<Vec<u8>>>;

#[derive(Default)]
struct Now {
    /// Number of changes.
    tick: u64,
    version: u64,
    show: Arc<String>,
    /// Files of this version and of the previous one, which a page may still be reading.
    files: [Files; 2],
    wrong: String,
    state: String,
    run: Option<(Run, Instant)>,
}

/// The connected pages and their data.
pub struct Audience {
    port: u16,
    tokens: [Token; 2],
    /// Title of a page before it has the show.
    title: String,
    now: Mutex<Now>,
    changed: Condvar,
    /// Connections whose request has not arrived, the oldest first.
    pub strangers: Mutex<VecDeque<(u64, TcpStream)>>,
    /// Number of connections that run the show, and that follow it.
    pub seats: [AtomicUsize; 2],
}

impl Audience {
    pub fn new(title: &str, port: u16, tokens: [Token; 2]) -> Audience {
        Audience {
            port,
            tokens,
            title: title.to_owned(),
            now: Mutex::default(),
            changed: Condvar::new(),
            strangers: Mutex::default(),
            seats: Default::default(),
        }
    }

    /// Addresses to run the show and to watch it.
    pub fn addresses(&self) -> [String; 2] {
        let port = self.port;
        self.tokens
            .each_ref()
            .map(|token| format!("http://127.0.0.1:{port}/{}/", token.0))
    }

    /// The role of a token, if it is valid.
    pub fn role(&self, token: &str) -> Option<Role> {
        let [run, watch] = &self.tokens;
        match () {
            () if run.is(token) => Some(Role::Runs),
            () if watch.is(token) => Some(Role::Follows),
            () => None,
        }
    }

    /// True when `host` is a local address: an outside name may resolve to this machine too.
    pub fn is_own_host(&self, host: &str) -> bool {
        let name = host.strip_suffix(&format!(":{}", self.port));
        name.is_some_and(|name| name == "127.0.0.1" || name.eq_ignore_ascii_case("localhost"))
    }

    /// True when a page is ours.
    pub fn is_own_origin(&self, origin: &str) -> bool {
        origin
            .strip_prefix("http://")
            .is_some_and(|host| self.is_own_host(host))
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        // Each change is complete, so a panic elsewhere leaves the state consistent.
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes a change, and wakes all connections.
    fn change(&self, change: impl FnOnce(&mut Now)) {
        let mut now = self.now();
        change(&mut now);
        now.tick += 1;
        self.changed.notify_all();
    }

    /// Publishes another version.
    pub fn show(&self, data: String, files: Files) {
        self.change(|now| {
            now.version += 1;
            now.show = Arc::new(data);
            let before = std::mem::replace(&mut now.files[0], files);
            now.files[1] = before;
        });
    }

    /// Publishes what is wrong with the show; empty if nothing is.
    pub fn wrong(&self, text: &str) {
        if self.now().wrong != text {
            self.change(|now| text.clone_into(&mut now.wrong));
        }
    }

    /// Publishes the state of the images.
    pub fn state(&self, text: String) {
        if self.now().state != text {
            self.change(|now| now.state = text);
        }
    }

    /// Publishes an action of a page.
    pub fn run(&self, run: Run) {
        self.change(|now| now.run = Some((run, Instant::now())));
    }

    /// The page for a role.
    pub fn page(&self, role: Role) -> String {
        page::served(&self.title, role == Role::Follows)
    }

    /// The show as data; `None` before there are images of it.
    pub fn data(&self) -> Option<Arc<String>> {
        let now = self.now();
        (now.version > 0).then(|| Arc::clone(&now.show))
    }

    /// An image file.
    pub fn file(&self, number: u64) -> Option<Arc<Vec<u8>>> {
        let now = self.now();
        now.files
            .iter()
            .find_map(|files| files.get(&number))
            .cloned()
    }

    /// Waits until something has changed since `tick`, at most `patience`; returns the message and
    /// the next tick.
    pub fn message(&self, tick: Option<u64>, patience: Duration) -> (String, u64) {
        let now = self.now();
        let waits = |now: &mut Now| tick == Some(now.tick);
        let waited = self.changed.wait_timeout_while(now, patience, waits);
        let (now, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let message = Message {
            version: now.version,
            wrong: &now.wrong,
            state: &now.state,
            run: now.run.as_ref().map(|(run, _)| run),
            age: now
                .run
                .as_ref()
                .map_or(0.0, |(_, at)| at.elapsed().as_secs_f64()),
        };
        // The message holds only text and numbers, so JSON cannot fail.
        let text = serde_json::to_string(&message).unwrap_or_default();
        (text, now.tick)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn only_own_tokens_names_and_origins_count() {
        let audience = Audience::new(
            "s.lxq",
            8000,
            [Token::new().unwrap(), Token::new().unwrap()],
        );
        let [run, watch] = audience.addresses();
        let token = |address: &str| address.split('/').nth(3).unwrap().to_owned();
        assert_eq!(audience.role(&token(&run)), Some(Role::Runs));
        assert_eq!(audience.role(&token(&watch)), Some(Role::Follows));
        let mut near = token(&run);
        near.pop();
        assert_eq!(audience.role(&near), None);
        assert_eq!(audience.role(""), None);
        assert_eq!(token(&run).len(), LETTERS);
        for host in ["127.0.0.1:8000", "localhost:8000", "LocalHost:8000"] {
            assert!(
                audience.is_own_host(host) && audience.is_own_origin(&format!("http://{host}"))
            );
        }
        for host in [
            "127.0.0.1",
            "127.0.0.1:80",
            "evil.example:8000",
            "127.0.0.1:8000.evil",
            "",
        ] {
            assert!(!audience.is_own_host(host), "{host}");
        }
        for origin in [
            "null",
            "https://127.0.0.1:8000",
            "http://evil.example:8000",
            "",
        ] {
            assert!(!audience.is_own_origin(origin), "{origin}");
        }
    }
}
