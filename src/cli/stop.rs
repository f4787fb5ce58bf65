//! Received signals.

use std::sync::atomic::{AtomicBool, AtomicU8, AtomicUsize, Ordering};

/// Number of Ctrl-C presses that leave the prompt itself.
const INSISTED: usize = 3;

/// Exit code after Ctrl-C.
pub const INTERRUPTED: u8 = 130;

const ORDER: Ordering = Ordering::SeqCst;

/// Received signals.
#[derive(Debug, Default)]
pub struct Stop {
    presses: AtomicUsize,
    /// Exit code of a signal that ends the program; 0 before one.
    ended_by: AtomicU8,
    /// True when Ctrl-C ends the current work and not the program.
    is_prompt: AtomicBool,
}

impl Stop {
    /// True after a signal.
    pub fn is_asked(&self) -> bool {
        self.presses.load(ORDER) > 0 || self.ended_by.load(ORDER) > 0
    }

    /// Forgets Ctrl-C before new work at a prompt, and from now on keeps it from ending the
    /// program.
    pub fn rearm(&self) {
        self.is_prompt.store(true, ORDER);
        self.presses.store(0, ORDER);
    }

    /// True after enough Ctrl-C presses to leave the prompt itself.
    pub fn is_insisted(&self) -> bool {
        self.presses.load(ORDER) >= INSISTED
    }

    /// Exit code of the stopped work.
    pub fn code(&self) -> u8 {
        match self.ended_by.load(ORDER) {
            0 => INTERRUPTED,
            code => code,
        }
    }

    /// Records a signal; true when it must end the process.
    pub fn take(&self, code: u8) -> bool {
        if code != INTERRUPTED {
            self.ended_by.store(code, ORDER);
            return true;
        }
        let presses = self.presses.fetch_add(1, ORDER) + 1;
        !self.is_prompt.load(ORDER) || presses >= INSISTED
    }
}
