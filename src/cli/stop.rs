//! The signals that came.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};

/// Ctrl-C pressed so often leaves the prompt itself.
const INSISTED: usize = 3;

/// The exit code of a program that Ctrl-C stopped, and of one that its limit of time did.
pub const INTERRUPTED: u8 = 130;

const ORDER: Ordering = Ordering::SeqCst;

/// The signals that came.
#[derive(Debug, Default)]
pub struct Stop {
    presses: AtomicUsize,
    /// The exit code of a signal that ends the program; 0 while none came.
    ended_by: AtomicU8,
    /// Ctrl-C ends what is at work and not the program.
    is_prompt: AtomicBool,
}

impl Stop {
    /// True once a signal came.
    pub fn is_asked(&self) -> bool {
        self.presses.load(ORDER) > 0 || self.ended_by.load(ORDER) > 0
    }

    /// Forgets Ctrl-C, before new work begins at a prompt, which it is from now on not to end.
    pub fn rearm(&self) {
        self.is_prompt.store(true, ORDER);
        self.presses.store(0, ORDER);
    }

    /// True once Ctrl-C was pressed so often that it leaves the prompt itself.
    pub fn is_insisted(&self) -> bool {
        self.presses.load(ORDER) >= INSISTED
    }

    /// The exit code of what was stopped.
    pub fn code(&self) -> u8 {
        match self.ended_by.load(ORDER) {
            0 => INTERRUPTED,
            code => code,
        }
    }

    /// Takes a signal in; true where it is to end the process.
    pub fn take(&self, code: u8) -> bool {
        if code != INTERRUPTED {
            self.ended_by.store(code, ORDER);
            return true;
        }
        let presses = self.presses.fetch_add(1, ORDER) + 1;
        !self.is_prompt.load(ORDER) || presses >= INSISTED
    }
}
