//! External stops: Ctrl-C, SIGTERM, SIGHUP.
//!
//! A signal cancels: the running loop sees it and the command ends as after an error. If no loop
//! has seen it within [`GRACE`], or nothing is running, the process is ended here. That loses only
//! unfinished work: files are replaced whole, and started programs are ended, with their folders
//! removed, first.

use std::process::exit;
use std::thread;
use std::time::Duration;
#[cfg(unix)]
use std::{
    io::{self, IsTerminal as _},
    sync::{Mutex, PoisonError},
};

#[cfg(unix)]
use nix::sys::termios::{self, SetArg, Termios};

use super::screen::Screen;
use super::slurm;
use super::stop::INTERRUPTED;
use footlight_engine as engine;
use footlight_host::files::process;
use footlight_host::work::Cancelled;

/// Time for a command to end after a signal.
const GRACE: Duration = Duration::from_millis(500);

/// Makes signals cancel the work that `screen` shows.
pub fn install(screen: &Screen) {
    let screen = screen.clone();
    // Without a handler a signal ends the process at once, which only skips the grace time.
    listen(move |code| {
        let stop = screen.stop();
        if stop.take(code) {
            let grace = if stop.is_insisted() {
                Duration::ZERO
            } else {
                GRACE
            };
            end_after(grace, &screen);
        }
    });
}

/// Ends the process after a time.
fn end_after(time: Duration, screen: &Screen) {
    let screen = screen.clone();
    // A system without free threads has no running work either.
    let _ = thread::Builder::new().spawn(move || {
        thread::sleep(time);
        slurm::cancel_all();
        process::end_all();
        restore_terminal();
        screen.fail(&engine::Error::Cancelled(Cancelled).into());
        exit(i32::from(screen.stop().code()));
    });
}

/// The terminal's state before the line editor changed it, to be restored when the process ends.
#[cfg(unix)]
static TERMINAL: Mutex<Option<Termios>> = Mutex::new(None);

/// Saves the terminal's state, in case the process ends while a line is being typed.
#[cfg(unix)]
pub fn keep_terminal() {
    let mut kept = TERMINAL.lock().unwrap_or_else(PoisonError::into_inner);
    *kept = termios::tcgetattr(io::stdin()).ok();
}

#[cfg(not(unix))]
pub fn keep_terminal() {}

/// Restores the terminal's state, and ends the current input line.
#[cfg(unix)]
fn restore_terminal() {
    let mut kept = TERMINAL.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(before) = kept.take() else { return };
    // If this fails, the terminal is gone.
    let _ = termios::tcsetattr(io::stdin(), SetArg::TCSANOW, &before);
    if io::stdout().is_terminal() {
        // Turn off bracketed paste, which the line editor has turned on.
        super::draw("\u{1b}[?2004l\n");
    }
}

#[cfg(not(unix))]
fn restore_terminal() {}

/// Calls `take` with the exit code of each signal.
#[cfg(unix)]
fn listen(take: impl Fn(u8) + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

    let all = [SIGINT, SIGTERM, SIGHUP];
    // `nohup` starts a program with SIGHUP ignored, which must stay so.
    let wanted = all.iter().filter(|s| **s != SIGHUP || !is_ignored(SIGHUP));
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else {
        return;
    };
    let _ = thread::Builder::new().spawn(move || {
        for signal in signals.forever() {
            take(u8::try_from(128 + signal).unwrap_or(INTERRUPTED));
        }
    });
}

/// True when the process was started with a signal ignored, as far as the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(not(unix))]
fn listen(take: impl Fn(u8) + Send + 'static) {
    let _ = ctrlc::set_handler(move || take(INTERRUPTED));
}
