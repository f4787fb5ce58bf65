//! The time limit of a call.
//!
//! A deadline acts through the host's [`Progress`], so that it reaches exactly the loops that can
//! be cancelled. Finished work is kept, as after any cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::{Error, Host};
use footlight_host::files::Clock;
use footlight_host::work::Progress;

const ORDER: Ordering = Ordering::SeqCst;

/// Deadline of the current call.
#[derive(Debug)]
pub(super) struct Deadline {
    /// Most seconds of a call.
    limit: f64,
    /// Bits of the seconds used for opening the show, which count towards the first call.
    used: AtomicU64,
    /// Bits of the time at which the current call ends; infinite between calls.
    end: AtomicU64,
    /// True when the current or last call was cancelled at its deadline.
    passed: AtomicBool,
}

impl Deadline {
    fn is_over(&self, now: f64) -> bool {
        let over = now >= f64::from_bits(self.end.load(ORDER));
        if over {
            self.passed.store(true, ORDER);
        }
        over
    }
}

/// A call within its time limit. Dropping it ends the call.
#[derive(Debug)]
pub struct TimedCall {
    /// `None` without a limit, and within another call, whose deadline applies.
    deadline: Option<Arc<Deadline>>,
}

/// Counts the seconds from `begin` to `now`, used for opening the show, towards the first call.
///
/// # Errors
/// [`Error::OutOfTime`] when none are left.
pub(super) fn opened(deadline: &Deadline, begin: f64, now: f64) -> Result<(), Error> {
    let (used, seconds) = (now - begin, deadline.limit);
    deadline.used.store(used.to_bits(), ORDER);
    if used < seconds {
        Ok(())
    } else {
        Err(Error::OutOfTime { seconds })
    }
}

impl TimedCall {
    pub(super) fn begin(deadline: Option<&Arc<Deadline>>, now: f64) -> TimedCall {
        let outermost = |d: &&Arc<Deadline>| {
            let none = f64::INFINITY.to_bits();
            let end = now + d.limit - f64::from_bits(d.used.load(ORDER));
            let first = d.end.compare_exchange(none, end.to_bits(), ORDER, ORDER);
            if first.is_ok() {
                d.used.store(0, ORDER);
                d.passed.store(false, ORDER);
            }
            first.is_ok()
        };
        TimedCall {
            deadline: deadline.filter(outermost).cloned(),
        }
    }

    /// The time limit, if the call was cancelled for reaching it.
    pub fn exceeded(&self) -> Option<f64> {
        let deadline = self.deadline.as_ref()?;
        deadline.passed.load(ORDER).then_some(deadline.limit)
    }

    /// The time limit, if it is reached by `now`, whether or not the call was cancelled.
    pub fn exceeded_by(&self, now: f64) -> Option<f64> {
        let deadline = self.deadline.as_ref()?;
        deadline.is_over(now).then_some(deadline.limit)
    }

    /// The result of the call: a cancel by its deadline becomes [`Error::OutOfTime`].
    pub(super) fn outcome<T>(&self, done: Result<T, Error>) -> Result<T, Error> {
        done.map_err(|error| match self.exceeded() {
            Some(seconds) if error.is_cancel() => Error::OutOfTime { seconds },
            _ => error,
        })
    }
}

impl Drop for TimedCall {
    fn drop(&mut self) {
        if let Some(deadline) = &self.deadline {
            deadline.end.store(f64::INFINITY.to_bits(), ORDER);
        }
    }
}

impl Error {
    /// True when the embedding program cancelled the call.
    pub fn is_cancel(&self) -> bool {
        matches!(self, Error::Cancelled(_))
    }
}

/// The host's progress, which also cancels at the deadline.
struct Timed {
    progress: Box<dyn Progress>,
    clock: Arc<dyn Clock>,
    deadline: Arc<Deadline>,
}

impl Progress for Timed {
    fn report(&self, task: &str, done: usize, total: usize) {
        self.progress.report(task, done, total);
    }

    fn cancelled(&self) -> bool {
        self.progress.cancelled() || self.deadline.is_over(self.clock.seconds())
    }
}

/// Adds the time limit to the host's progress.
pub(super) fn limited(host: Host) -> (Host, Option<Arc<Deadline>>) {
    let Some(time) = host.time else {
        return (host, None);
    };
    let deadline = Arc::new(Deadline {
        limit: time.as_secs_f64(),
        used: AtomicU64::new(0),
        end: AtomicU64::new(f64::INFINITY.to_bits()),
        passed: AtomicBool::new(false),
    });
    let clock: Arc<dyn Clock> = Arc::from(host.clock);
    let timed = Timed {
        progress: host.progress,
        clock: Arc::clone(&clock),
        deadline: Arc::clone(&deadline),
    };
    let host = Host {
        clock: Box::new(clock),
        progress: Box::new(timed),
        ..host
    };
    (host, Some(deadline))
}
