//! The memory budget of an operator, shared among its parts.

use crate::TransportError;
use crate::contract::check_memory;
use footlight_host::work::Work;

/// A memory budget and the bytes held of it.
pub struct MemoryBudget {
    budget: usize,
    /// Bytes held.
    pub held: usize,
}

impl MemoryBudget {
    /// The whole budget of a task, with nothing held yet.
    pub fn new(work: Work<'_>) -> MemoryBudget {
        MemoryBudget {
            budget: work.memory,
            held: 0,
        }
    }

    /// The task with one of `parts` equal parts of the remaining budget.
    pub fn share<'a>(&self, parts: usize, work: Work<'a>) -> Work<'a> {
        let free = self.budget.saturating_sub(self.held);
        Work {
            memory: free / parts.max(1),
            ..work
        }
    }

    /// Checks that `bytes` are left.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if not.
    pub fn check(&self, what: &'static str, bytes: usize) -> Result<(), TransportError> {
        check_memory(what, self.held.saturating_add(bytes), self.budget)
    }

    /// Holds `bytes` more.
    ///
    /// # Errors
    /// [`TransportError::Memory`] if they are not left; nothing is held then.
    pub fn take(&mut self, what: &'static str, bytes: usize) -> Result<(), TransportError> {
        self.check(what, bytes)?;
        self.held += bytes;
        Ok(())
    }
}
