//! What the machine says of itself: its processor and the time that passes.

use std::fs;
use std::sync::Arc;
use std::time::Instant;

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
