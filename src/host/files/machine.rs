//! The machine: its processor, the time that passes, the process's memory and its standard output.

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

/// Bytes of addresses that this process may have, of which threads reserve some that they do not
/// use; everything where the platform does not tell.
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

/// Whether that is less than everything.
pub fn is_limited() -> bool {
    address_space() < usize::MAX
}

/// Makes large blocks go back to the system as soon as they are freed, at a few percent of time. By
/// default glibc keeps them for the next block of their size, between others that are still in use:
/// up to half as much again as what is held.
pub fn return_large_blocks() {
    #[cfg(all(feature = "program", target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "the C library has no other door to this")]
    {
        /// Most pictures, and the lists of a large stage, are larger.
        const LARGE: libc::c_int = 1 << 20;
        // SAFETY: takes two numbers; `main` calls it before there is a second thread.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
            libc::mallopt(libc::M_TRIM_THRESHOLD, 16 * LARGE);
            // Each further arena reserves 128 MB of addresses that are never used.
            if is_limited() {
                libc::mallopt(libc::M_ARENA_MAX, 1);
            }
        }
    }
}

/// Gives what was freed back to the system: reading a large stage leaves as much between its
/// polygons as they take.
pub fn return_freed_memory() {
    #[cfg(all(feature = "program", target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "the C library has no other door to this")]
    // SAFETY: only looks after free memory, and takes the allocator's own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// True when standard output was closed before the program began, as `>&-` does it. Rust then opens
/// the null device in its place, for reading too, which no shell's `>/dev/null` does.
#[cfg(unix)]
pub fn output_goes_nowhere() -> bool {
    use std::os::fd::AsFd as _;
    use std::os::unix::fs::MetadataExt as _;

    use nix::fcntl::{FcntlArg, OFlag, fcntl};

    let device = || -> std::io::Result<bool> {
        let output = std::io::stdout().as_fd().try_clone_to_owned()?;
        let output = std::fs::File::from(output).metadata()?;
        let null = std::fs::metadata("/dev/null")?;
        Ok((output.rdev(), output.dev(), output.ino()) == (null.rdev(), null.dev(), null.ino()))
    };
    match fcntl(std::io::stdout(), FcntlArg::F_GETFL) {
        Ok(flags) => {
            let access = OFlag::from_bits_truncate(flags) & OFlag::O_ACCMODE;
            access == OFlag::O_RDWR && device().unwrap_or(false)
        }
        Err(_) => true,
    }
}

/// False: other systems do not say.
#[cfg(not(unix))]
pub fn output_goes_nowhere() -> bool {
    false
}
