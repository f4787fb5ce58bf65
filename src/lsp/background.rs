//! Answers that take long, worked out on a thread of their own, one after the other, of the text as it
//! was when they were asked for, so that no keystroke waits for them. One that the client takes back, or
//! whose text is typed on in the meantime, is given up and refused as the protocol says.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use lsp_server::{ErrorCode, RequestId, Response};
use serde_json::Value;

use super::picture::Outgoing;

/// What a client is sent where a request fails.
pub type Failure = (ErrorCode, String);

/// What works an answer out.
pub type Work = Box<dyn FnOnce(&Stop) -> Result<Value, Failure> + Send>;

/// Whether, and why, an answer is not wanted any more.
#[derive(Debug, Default)]
pub struct Stop(AtomicU8);

const CANCELLED: u8 = 1;
const OUTDATED: u8 = 2;

impl Stop {
    /// The answer is not wanted any more.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    fn set(&self, why: u8) {
        self.0.store(why, Ordering::Relaxed);
    }

    fn refusal(&self) -> Option<Failure> {
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            OUTDATED => {
                let why = "the text was changed".to_owned();
                Some((ErrorCode::ContentModified, why))
            }
            _ => Some((ErrorCode::RequestCanceled, "cancelled".to_owned())),
        }
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
    /// What is asked for and not answered, with its show.
    running: Vec<(RequestId, PathBuf, Arc<Stop>)>,
}

impl Background {
    /// A thread that answers; it ends with this.
    pub fn new(client: Outgoing) -> Background {
        let (jobs, taken) = channel();
        std::thread::spawn(move || answer(&taken, &client));
        Background {
            jobs,
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
        self.stop(CANCELLED, |own, _| own == id);
    }

    /// Gives up what was asked of a show before its text was changed.
    pub fn outdate(&self, show: &Path) {
        self.stop(OUTDATED, |_, own| own == show);
    }

    /// Gives all up.
    pub fn cancel_all(&self) {
        self.stop(CANCELLED, |_, _| true);
    }

    fn stop(&self, why: u8, is_it: impl Fn(&RequestId, &Path) -> bool) {
        let running = self.running.iter();
        for (.., stop) in running.filter(|(id, show, _)| is_it(id, show)) {
            stop.set(why);
        }
    }
}

fn answer(jobs: &Receiver<Job>, client: &Outgoing) {
    for Job { id, stop, work } in jobs {
        let answer = match stop.refusal() {
            Some(refusal) => Err(refusal),
            // What was given up in the middle is not whole.
            None => work(&stop).and_then(|value| stop.refusal().map_or(Ok(value), Err)),
        };
        let answer = match answer {
            Ok(value) => Response::new_ok(id, value),
            Err((code, why)) => Response::new_err(id, code as i32, why),
        };
        // A client that is gone is noticed when it is listened to.
        let _ = client.send(answer.into());
    }
}
