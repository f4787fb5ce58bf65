//! The machine: processor, clock, memory of the process.

use std::fs;
use std::time::Instant;

/// The processor's name from the system; `None` except on Linux.
pub fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// A clock of the embedding program.
pub trait Clock: Send + Sync {
    /// Seconds since a fixed moment of the clock's choice; never decreases.
    fn seconds(&self) -> f64;
}

/// The machine's monotonic clock. On a platform without one (WebAssembly) it stands still: an
/// embedding program there supplies its own.
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

/// Bytes of address space that this process may use, of which threads reserve some without using
/// it; `usize::MAX` if unknown.
pub fn address_space() -> usize {
    limit().unwrap_or(usize::MAX)
}

#[cfg(target_os = "linux")]
fn limit() -> Option<usize> {
    use nix::sys::resource::{Resource, getrlimit};
    let (soft, _) = getrlimit(Resource::RLIMIT_AS).ok()?;
    usize::try_from(soft).ok()
}

#[cfg(not(target_os = "linux"))]
fn limit() -> Option<usize> {
    None
}

/// True when the address space is limited.
pub fn is_limited() -> bool {
    address_space() < usize::MAX
}

/// Makes large blocks return to the system as soon as they are freed, at a few percent of time. By
/// default glibc keeps them between others in use, up to half of the memory in use.
pub fn return_large_blocks() {
    #[cfg(all(feature = "program", target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "the C library has no other door to this")]
    {
        /// Most images, and the lists of a large stage, are larger.
        const LARGE: libc::c_int = 1 << 20;
        // SAFETY: the call takes two numbers; `main` calls it before there is a second thread.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
            libc::mallopt(libc::M_TRIM_THRESHOLD, 16 * LARGE);
            // Each further arena reserves 128 MB of addresses without using them.
            if is_limited() {
                libc::mallopt(libc::M_ARENA_MAX, 1);
            }
        }
    }
}

/// Returns freed memory to the system: reading a large stage leaves as much between its polygons as
/// they take.
pub fn return_freed_memory() {
    #[cfg(all(feature = "program", target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "the C library has no other door to this")]
    // SAFETY: the call only looks for free memory, under the allocator's own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}
