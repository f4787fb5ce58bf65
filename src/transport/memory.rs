//! The memory budget of an operator, of which each part of it takes its share.

use crate::TransportError;
use crate::contract::check_memory;
use footlight_host::work::Work;

/// A memory budget and what is held of it.
pub struct MemoryBudget {
    budget: usize,
    /// Bytes so far.
    pub held: usize,
}

impl MemoryBudget {
    /// The whole budget of a task, nothing held yet.
    pub fn new(work: Work<'_>) -> MemoryBudget {
        MemoryBudget {
            budget: work.memory,
            held: 0,
        }
    }

    /// The task with one of `parts` equal parts of what is left.
    pub fn share<'a>(&self, parts: usize, work: Work<'a>) -> Work<'a> {
        let free = self.budget.saturating_sub(self.held);
        Work {
            memory: free / parts.max(1),
            ..work
        }
    }

    /// Checks that so many bytes are left.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if not.
    pub fn check(&self, what: &'static str, bytes: usize) -> Result<(), TransportError> {
        check_memory(what, self.held.saturating_add(bytes), self.budget)
    }

    /// Holds so much more.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if that is not left; nothing is held then.
    pub fn take(&mut self, what: &'static str, bytes: usize) -> Result<(), TransportError> {
        self.check(what, bytes)?;
        self.held += bytes;
        Ok(())
    }
}
