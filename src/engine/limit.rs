//! The limit of time of a call, as the embedding program sets it.
//!
//! A deadline acts through the host's own [`Progress`], so that it reaches every loop that can be
//! cancelled, and only those. What is finished by then is kept, as with any cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::{Error, Host};
use footlight_host::files::Clock;
use footlight_host::work::Progress;

const ORDER: Ordering = Ordering::SeqCst;

/// Until when the current call may go on.
#[derive(Debug)]
pub(super) struct Deadline {
    /// Seconds that a call may take.
    limit: f64,
    /// The bits of the seconds of it that opening the show took, which count as the first call's.
    used: AtomicU64,
    /// The bits of the time at which the current call ends; infinite between calls.
    end: AtomicU64,
    /// The current call, or the last one, was still at work then.
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

/// A call within its limit of time. Dropped, the call has ended.
#[derive(Debug)]
pub struct TimedCall {
    /// `None` without a limit, and within another call, whose end holds.
    deadline: Option<Arc<Deadline>>,
}

/// Counts the seconds from `begin` to now, in which the show was opened, as the first call's.
///
/// # Errors
/// [`Error::OutOfTime`] where nothing is left for that.
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

    /// The seconds that the call may take, where it was told to stop because it used them up.
    pub fn exceeded(&self) -> Option<f64> {
        let deadline = self.deadline.as_ref()?;
        deadline.passed.load(ORDER).then_some(deadline.limit)
    }

    /// The same, where it has used them up by now, told or not.
    pub fn exceeded_by(&self, now: f64) -> Option<f64> {
        let deadline = self.deadline.as_ref()?;
        deadline.is_over(now).then_some(deadline.limit)
    }

    /// What the call came to: a cancel that its deadline asked for is [`Error::OutOfTime`].
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
    /// True where the embedding program's cancel ended the call.
    pub fn is_cancel(&self) -> bool {
        matches!(self, Error::Cancelled(_))
    }
}

/// The host's progress, which also asks to stop once the time is used up.
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

/// The host with its limit of time at work in its progress.
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
