//! How many addresses the process may have.

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
