//! The limit of time: what a call may take, as the embedding program says.
//!
//! A deadline speaks through the host's own [`Progress`], so that it reaches every loop that can be
//! cancelled, and only those. What is finished by then is kept, as with any cancel.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::{Error, Host, Interpreter};
use crate::files::Clock;
use crate::renderer::TransportError;
use crate::work::Progress;

/// Until when the call in hand may go on.
#[derive(Debug)]
pub(super) struct Deadline {
    /// Seconds that a call may take.
    limit: f64,
    /// The bits of the time at which the call in hand ends; infinite between calls.
    end: AtomicU64,
    /// The call was, or the last one had been, still at work then.
    passed: AtomicBool,
}

impl Deadline {
    /// Sets the end of a call that begins now; false within another call, whose end holds.
    fn begin(&self, now: f64) -> bool {
        let (none, end) = (f64::INFINITY.to_bits(), (now + self.limit).to_bits());
        let order = Ordering::SeqCst;
        let outermost = self.end.compare_exchange(none, end, order, order).is_ok();
        if outermost {
            self.passed.store(false, order);
        }
        outermost
    }

    fn end(&self) {
        self.end.store(f64::INFINITY.to_bits(), Ordering::SeqCst);
    }

    /// True, and remembered, once the call in hand has used its time up.
    fn is_over(&self, now: f64) -> bool {
        let over = now >= f64::from_bits(self.end.load(Ordering::SeqCst));
        if over {
            self.passed.store(true, Ordering::SeqCst);
        }
        over
    }
}

/// The host's progress, which also asks to stop once the time is used up.
struct Timed {
    progress: Box<dyn Progress + Send + Sync>,
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

    fn insisted(&self) -> bool {
        self.progress.insisted() || self.deadline.is_over(self.clock.seconds())
    }
}

/// The host with its limit of time at work in its progress.
pub(super) fn limited(host: Host) -> (Host, Option<Arc<Deadline>>) {
    let Some(time) = host.time else {
        return (host, None);
    };
    let deadline = Arc::new(Deadline {
        limit: time.as_secs_f64(),
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

impl Interpreter {
    /// Does something within the limit of time, if there is one.
    ///
    /// # Errors
    /// [`Error::OutOfTime`] where it was stopped for that, else its own.
    pub(super) fn in_time<T>(
        &mut self,
        something: impl FnOnce(&mut Interpreter) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let now = self.host.clock.seconds();
        let deadline = self.deadline.clone().filter(|d| d.begin(now));
        let done = something(self);
        let Some(deadline) = deadline else {
            return done;
        };
        deadline.end();
        done.map_err(|error| match self.out_of_time() {
            Some(seconds) => late(error, seconds),
            None => error,
        })
    }

    /// The seconds that a call may take, where the last one had used them up.
    pub(super) fn out_of_time(&self) -> Option<f64> {
        let deadline = self.deadline.as_ref()?;
        let passed = deadline.passed.load(Ordering::SeqCst);
        passed.then_some(deadline.limit)
    }
}

/// What a cancel that the deadline asked for is to the user.
fn late(error: Error, seconds: f64) -> Error {
    match error {
        Error::Cancelled(_) | Error::Render(TransportError::Cancelled(_)) => {
            Error::OutOfTime { seconds }
        }
        Error::Session {
            path,
            line,
            cause,
            before,
        } => Error::Session {
            path,
            line,
            cause: Box::new(late(*cause, seconds)),
            before,
        },
        other => other,
    }
}
