//! Sessions at the prompt, without a terminal: verbs, edits, refinement, the pool, studies.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

#[path = "../../examples/studies/src/dice.rs"]
mod dice;
#[path = "../../examples/studies/src/random_show.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
mod random_show;

mod beside;
mod design;
mod files;
mod image_banks;
mod noise;
mod operator;
mod session;
mod solve;
mod stains;
mod store;
mod study;
mod told;
mod transcripts;
mod ways;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use footlight_engine::{self as engine, Engine, Host};
use footlight_prompt::{Console, Repl};

/// A prompt on a show's text.
fn prompt(name: &str, text: &[u8], host: Host) -> Result<Repl, engine::Error> {
    let engine = Engine::from_text(name, text, host)?;
    Ok(Repl::new(engine, Console::default()))
}

/// A prompt on a show without stage, lights or cues.
fn empty(host: Host) -> Repl {
    prompt("untitled.lxq", b"show \"Untitled\"\n", host).unwrap()
}

/// A prompt on a show in a file.
fn open(path: &Path, host: Host) -> Repl {
    Repl::new(Engine::open(path, host).unwrap(), Console::default())
}

/// A clock that stands still: predicted seconds are then the operator's own, and transcripts do not
/// depend on the machine.
struct Stopped;

impl footlight_host::files::Clock for Stopped {
    fn seconds(&self) -> f64 {
        0.0
    }
}

/// A clock that advances by a fixed time at each reading.
struct Ticking {
    reads: AtomicUsize,
    seconds: f64,
}

impl Ticking {
    fn by(seconds: f64) -> Ticking {
        let reads = AtomicUsize::new(0);
        Ticking { reads, seconds }
    }
}

impl footlight_host::files::Clock for Ticking {
    fn seconds(&self) -> f64 {
        self.reads.fetch_add(1, Ordering::Relaxed) as f64 * self.seconds
    }
}
