//! Standard output, where it matters whether it keeps what is written.

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
