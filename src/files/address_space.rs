//! How many addresses the process may have, and what it does with those that are free.

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
    #[cfg(all(feature = "cli", target_os = "linux", target_env = "gnu"))]
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
    #[cfg(all(feature = "cli", target_os = "linux", target_env = "gnu"))]
    #[allow(unsafe_code, reason = "the C library has no other door to this")]
    // SAFETY: only looks after free memory, and takes the allocator's own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}
