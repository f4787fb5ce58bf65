//! Answers that take long, worked out on a thread of their own, one after the other, of the text as it
//! was when they were asked for, so that no keystroke waits for them. One that the client takes back, or
//! whose text is typed on in the meantime, is given up and refused as the protocol says.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use lsp_server::{ErrorCode, RequestId, Response};
use serde_json::Value;

use super::picture::Outgoing;

/// What a client is sent where a request fails.
pub type Failure = (ErrorCode, String);

/// What works an answer out.
pub type Work = Box<dyn FnOnce(&Stop) -> Result<Value, Failure> + Send>;

/// Whether an answer is wanted no more.
#[derive(Debug, Default)]
pub struct Stop(AtomicBool);

impl Stop {
    /// The answer is wanted no more.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Sets it; false where it was set before. The thread that sets it answers, so that one answer is sent.
    fn set(&self) -> bool {
        !self.0.swap(true, Ordering::Relaxed)
    }
}

struct Job {
    id: RequestId,
    stop: Arc<Stop>,
    work: Work,
}

/// Where what takes long is worked out.
pub struct Background {
    jobs: Sender<Job>,
    client: Outgoing,
    /// What is asked for and not answered, with its show.
    running: Vec<(RequestId, PathBuf, Arc<Stop>)>,
}

impl Background {
    /// A thread that answers; it ends with this.
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

    /// Has a request about a show answered.
    pub fn begin(&mut self, id: RequestId, show: PathBuf, work: Work) {
        self.running
            .retain(|(.., stop)| Arc::strong_count(stop) > 1);
        let stop = Arc::new(Stop::default());
        self.running.push((id.clone(), show, Arc::clone(&stop)));
        // The thread ends only with this.
        let _ = self.jobs.send(Job { id, stop, work });
    }

    /// Gives a request up that the client takes back.
    pub fn cancel(&self, id: &RequestId) {
        let why = (ErrorCode::RequestCanceled, "cancelled");
        self.refuse(why, |own, _| own == id);
    }

    /// Gives up what was asked of a show before its text was changed.
    pub fn outdate(&self, show: &Path) {
        let why = (ErrorCode::ContentModified, "the text was changed");
        self.refuse(why, |_, own| own == show);
    }

    /// Gives all up.
    pub fn cancel_all(&self) {
        self.refuse((ErrorCode::RequestCanceled, "cancelled"), |_, _| true);
    }

    /// Refuses at once what is not answered yet.
    fn refuse(&self, (code, why): (ErrorCode, &str), is_it: impl Fn(&RequestId, &Path) -> bool) {
        let running = self.running.iter();
        for (id, _, stop) in running.filter(|(id, show, _)| is_it(id, show)) {
            if stop.set() {
                let refusal = Response::new_err(id.clone(), code as i32, why.to_owned());
                // A client that is gone is noticed when it is listened to.
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
