//! Slow answers, computed on another thread, one after the other, for the text at the time of the
//! request, so that no keystroke waits for them. Requests that are cancelled, or made stale by an
//! edit, are answered with an error at once.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use lsp_server::{ErrorCode, RequestId, Response};
use serde_json::Value;

use super::picture::Outgoing;

/// Error response of a failed request.
pub type Failure = (ErrorCode, String);

/// Computes an answer.
pub type Work = Box<dyn FnOnce(&Stop) -> Result<Value, Failure> + Send>;

/// Cancellation flag of a request.
#[derive(Debug, Default)]
pub struct Stop(AtomicBool);

impl Stop {
    /// True once the answer is no longer wanted.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Sets the flag; false if it was set. The thread that sets it sends the one answer.
    fn set(&self) -> bool {
        !self.0.swap(true, Ordering::Relaxed)
    }
}

struct Job {
    id: RequestId,
    stop: Arc<Stop>,
    work: Work,
}

/// The thread for slow answers.
pub struct Background {
    jobs: Sender<Job>,
    client: Outgoing,
    /// Unanswered requests, with their show.
    running: Vec<(RequestId, PathBuf, Arc<Stop>)>,
}

impl Background {
    /// Starts the thread, which ends with this value.
    pub fn new(client: Outgoing) -> Background {
        let (jobs, taken) = channel();
        let to_client = client.clone();
        std::thread::spawn(move || answer(&taken, &to_client));
        Background {
            jobs,
            client,
            running: Vec::new(),
        }
    }

    /// Queues a request about a show.
    pub fn begin(&mut self, id: RequestId, show: PathBuf, work: Work) {
        self.running
            .retain(|(.., stop)| Arc::strong_count(stop) > 1);
        let stop = Arc::new(Stop::default());
        self.running.push((id.clone(), show, Arc::clone(&stop)));
        // The thread ends only with this value.
        let _ = self.jobs.send(Job { id, stop, work });
    }

    /// Cancels a request of the client.
    pub fn cancel(&self, id: &RequestId) {
        let why = (ErrorCode::RequestCanceled, "cancelled");
        self.refuse(why, |own, _| own == id);
    }

    /// Cancels the requests about a show made before its text was changed.
    pub fn outdate(&self, show: &Path) {
        let why = (ErrorCode::ContentModified, "the text was changed");
        self.refuse(why, |_, own| own == show);
    }

    /// Cancels all requests.
    pub fn cancel_all(&self) {
        self.refuse((ErrorCode::RequestCanceled, "cancelled"), |_, _| true);
    }

    /// Answers unanswered requests with an error.
    fn refuse(&self, (code, why): (ErrorCode, &str), is_it: impl Fn(&RequestId, &Path) -> bool) {
        let running = self.running.iter();
        for (id, _, stop) in running.filter(|(id, show, _)| is_it(id, show)) {
            if stop.set() {
                let refusal = Response::new_err(id.clone(), code as i32, why.to_owned());
                // A lost client is noticed when reading.
                let _ = self.client.send(refusal.into());
            }
        }
    }
}

fn answer(jobs: &Receiver<Job>, client: &Outgoing) {
    for Job { id, stop, work } in jobs.iter().filter(|job| !job.stop.is_set()) {
        let answer = match work(&stop) {
            Ok(value) => Response::new_ok(id, value),
            Err((code, why)) => Response::new_err(id, code as i32, why),
        };
        if stop.set() {
            let _ = client.send(answer.into());
        }
    }
}
