//! Time until the program ends after a signal, for any verb and at any moment. Shared with the
//! example `attack`.
#![cfg(unix)]

use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// Every verb that works on a show, with arguments for its full work; `SHOW` is the show's file.
pub const VERBS: [&[&str]; 13] = [
    &["check", "SHOW"],
    &["plan", "SHOW"],
    &["picture", "SHOW", "-o", "p.png"],
    &["film", "SHOW", "-o", "film.y4m"],
    &["plot", "SHOW", "spectrum", "-o", "spectrum.svg"],
    &["run", "SHOW", "-o", "results"],
    &["quality", "SHOW"],
    &["pool", "SHOW"],
    &["tracksheet", "SHOW"],
    &["cuesheet", "SHOW"],
    &["export", "SHOW", "-o", "desk.asc"],
    &["diff", "SHOW", "other.lxq"],
    &["fmt", "--check", "SHOW"],
];

/// Result of ending a verb.
pub struct Told {
    /// Seconds from the signal to the end.
    pub delay: f64,
    /// Its exit status.
    pub status: ExitStatus,
}

/// The exit code for a signal.
pub fn code(signal: Signal) -> i32 {
    128 + signal as i32
}

/// Starts `program` and ignores its output.
pub fn start(program: &mut Command) -> std::io::Result<Child> {
    let quiet = program.stdout(Stdio::null()).stderr(Stdio::null());
    quiet.spawn()
}

/// Runs `program` and sends it a signal after a time; `None` if it ended before.
pub fn tell(
    program: &mut Command,
    after: Duration,
    signal: Signal,
) -> std::io::Result<Option<Told>> {
    let mut child = start(program)?;
    let started = Instant::now();
    while started.elapsed() < after {
        if child.try_wait()?.is_some() {
            return Ok(None);
        }
        sleep(Duration::from_millis(1));
    }
    let begin = Instant::now();
    kill(Pid::from_raw(child.id().cast_signed()), signal)?;
    loop {
        if let Some(status) = child.try_wait()? {
            let delay = begin.elapsed().as_secs_f64();
            return Ok(Some(Told { delay, status }));
        }
        sleep(Duration::from_millis(1));
    }
}
