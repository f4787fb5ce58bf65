//! What an operator holds of a budget of memory, step by step: each takes what the others leave.

use crate::renderer::TransportError;
use crate::renderer::contract::check_memory;
use crate::work::Work;

/// What one step after the other holds of a budget of memory.
pub struct MemoryBudget {
    budget: usize,
    /// Bytes so far.
    pub held: usize,
}

impl MemoryBudget {
    /// Nothing yet of what a task may hold.
    pub fn new(work: Work<'_>) -> MemoryBudget {
        MemoryBudget {
            budget: work.memory,
            held: 0,
        }
    }

    /// The same task with one of so many parts of what is left to hold.
    pub fn share<'a>(&self, parts: usize, work: Work<'a>) -> Work<'a> {
        let free = self.budget.saturating_sub(self.held);
        Work {
            memory: free / parts.max(1),
            ..work
        }
    }

    /// Is there so much left?
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
