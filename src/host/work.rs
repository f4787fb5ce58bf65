//! Resources of a long task: progress, cancellation, threads, memory.
//!
//! The library has no clock, threads or limits itself: every long loop takes a [`Work`], reports to
//! it and checks it for cancellation.

use std::fmt;
use std::sync::Arc;

/// Receives the progress of long tasks and may cancel them. All methods may be called from any
/// thread.
pub trait Progress: Send + Sync {
    /// `done` of `total` units of the task called `task` are finished; each call of the engine
    /// counts from 0. The engine's tasks are "refined pictures", "key images", "moving lights",
    /// "frames with moving heads", "banks" and "measuring". A renderer chooses names for the parts
    /// of its work: while coarse images are rendered nothing else reports.
    fn report(&self, task: &str, done: usize, total: usize) {
        let _ = (task, done, total);
    }

    /// True once the task should stop. Polled every few milliseconds, also by several threads at
    /// once.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Progress that is neither shown nor cancelled.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {}

impl<P: Progress + ?Sized> Progress for Arc<P> {
    fn report(&self, task: &str, done: usize, total: usize) {
        (**self).report(task, done, total);
    }

    fn cancelled(&self) -> bool {
        (**self).cancelled()
    }
}

/// Resources of a task.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// Receiver of progress, and source of cancellation.
    pub progress: &'a dyn Progress,
    /// Number of threads, at least 1. Results do not depend on it.
    pub threads: usize,
    /// Most bytes that the task may hold at once; if it needs more, it uses a leaner method or
    /// fails.
    pub memory: usize,
}

impl Work<'static> {
    /// One thread, four gigabytes, no progress: for tests and small tools.
    pub fn silent() -> Work<'static> {
        Work {
            progress: &Silent,
            threads: 1,
            memory: 4 << 30,
        }
    }
}

impl<'a> Work<'a> {
    /// Resources with `bytes` less memory, which the caller holds.
    #[must_use]
    pub fn holding(self, bytes: usize) -> Work<'a> {
        Work {
            memory: self.memory.saturating_sub(bytes),
            ..self
        }
    }
}

impl Work<'_> {
    /// `Err(Cancelled)` once the embedding program asked to stop.
    ///
    /// # Errors
    /// `Cancelled` in that case.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.progress.cancelled() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }
}

impl fmt::Debug for Work<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Work")
            .field("threads", &self.threads)
            .field("memory", &self.memory)
            .finish_non_exhaustive()
    }
}

/// Applies `task` to each item on up to `threads` threads; results are in the order of the items.
pub fn in_order<T: Sync, R: Send>(
    items: &[T],
    threads: usize,
    task: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let share = items.len().div_ceil(threads.max(1)).max(1);
    if share >= items.len() {
        return items.iter().map(task).collect();
    }
    let mut made: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let work = |items: &[T], made: &mut [Option<R>]| {
        for (item, made) in items.iter().zip(made) {
            *made = Some(task(item));
        }
    };
    let work = &work;
    std::thread::scope(|scope| {
        let mut parts = items.chunks(share).zip(made.chunks_mut(share));
        let own = parts.next();
        for (items, made) in parts {
            scope.spawn(move || work(items, made));
        }
        if let Some((items, made)) = own {
            work(items, made);
        }
    });
    made.into_iter().flatten().collect()
}

/// The embedding program cancelled the task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_stay_in_order_on_any_number_of_threads() {
        let items: Vec<u32> = (0..13).collect();
        let squares: Vec<u32> = items.iter().map(|i| i * i).collect();
        for threads in [0, 1, 2, 5, 13, 40] {
            assert_eq!(in_order(&items, threads, |i| i * i), squares, "{threads}");
        }
        assert!(in_order(&[], 4, |i: &u32| i * i).is_empty());
    }
}
