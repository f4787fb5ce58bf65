//! Images of cues, rendered on another thread one after the other into files that the client shows,
//! and again when the show is saved.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use serde_json::json;

use super::buffers::uri_of;
use footlight_engine::{Engine, Host};
use footlight_host::files::process::Private;
use footlight_host::files::{Disk, Store};
use footlight_host::work::Progress;
use footlight_picture::png;
use footlight_show::units::CueNumber;

/// Messages to the client.
pub type Outgoing = crossbeam_channel::Sender<Message>;

/// An image to render.
pub struct Job {
    /// The request; `None` for a new rendering after a save.
    pub id: Option<RequestId>,
    /// The show.
    pub root: PathBuf,
    pub text: Arc<String>,
    pub cue: CueNumber,
    /// Host of the show.
    pub host: Host,
    /// Set to cancel it.
    pub stop: Arc<AtomicBool>,
    /// Capabilities of the client.
    pub client: Client,
}

/// Capabilities of a client: progress, and showing documents.
#[derive(Clone, Copy, Debug, Default)]
pub struct Client {
    pub takes_progress: bool,
    pub shows_documents: bool,
}

/// The rendering thread.
pub struct Pictures {
    jobs: Sender<Job>,
    /// The cue last requested, for each show.
    shown: BTreeMap<PathBuf, CueNumber>,
    /// Unanswered requests.
    running: BTreeMap<String, Arc<AtomicBool>>,
}

impl Pictures {
    /// Starts the thread, which ends with this value.
    pub fn new(client: Outgoing) -> Pictures {
        let (jobs, taken) = channel();
        std::thread::spawn(move || work(&taken, &client));
        Pictures {
            jobs,
            shown: BTreeMap::new(),
            running: BTreeMap::new(),
        }
    }

    /// Queues an image.
    pub fn make(&mut self, job: Job) {
        self.running.retain(|_, stop| Arc::strong_count(stop) > 1);
        if let Some(id) = &job.id {
            self.running.insert(id.to_string(), Arc::clone(&job.stop));
        }
        self.shown.insert(job.root.clone(), job.cue);
        // The thread ends only with this value.
        let _ = self.jobs.send(job);
    }

    /// The cue of a show whose image is visible.
    pub fn shown(&self, root: &Path) -> Option<CueNumber> {
        self.shown.get(root).copied()
    }

    /// Cancels a request; false when it is not for an image.
    pub fn cancel(&self, id: &RequestId) -> bool {
        let found = self.running.get(&id.to_string());
        if let Some(stop) = found {
            stop.store(true, Ordering::Relaxed);
        }
        found.is_some()
    }

    /// Cancels all images.
    pub fn cancel_all(&self) {
        for stop in self.running.values() {
            stop.store(true, Ordering::Relaxed);
        }
    }
}

fn work(jobs: &Receiver<Job>, client: &Outgoing) {
    // The folder of the images is removed with the server.
    let folder = Private::new().map_err(|error| error.to_string());
    // The engine of the last show, so that its stage and images need not be read again.
    let mut kept: Option<(PathBuf, Engine)> = None;
    let mut number = 0;
    let progress = Arc::new(PictureProgress {
        client: client.clone(),
        now: Mutex::default(),
    });
    for mut job in jobs {
        number += 1;
        let token = format!("footlight-picture-{number}");
        let (id, client_can) = (job.id.take(), job.client);
        let asks = client_can.takes_progress && id.is_some();
        let title = format!("picture of cue {}", job.cue);
        progress.begin(asks.then(|| token.clone()), &title, &job.stop);
        let shows = client_can.shows_documents && id.is_some();
        let stop = Arc::clone(&job.stop);
        job.host.progress = Box::new(Arc::clone(&progress));
        let made = match &folder {
            Ok(folder) => picture(&mut kept, job, folder.path()),
            Err(why) => Err(why.clone()),
        };
        progress.end();
        let uri = made
            .as_deref()
            .ok()
            .and_then(uri_of)
            .map(|uri| uri.to_string());
        if let Some(uri) = &uri {
            notify(client, "footlight/picture", json!({ "uri": uri }));
            if shows {
                let id = RequestId::from(format!("{token}-show"));
                // `external`: a text editor would show the bytes.
                let params = json!({ "uri": uri, "external": true, "takeFocus": false });
                let _ = client.send(Request::new(id, "window/showDocument".into(), params).into());
            }
        }
        let Some(id) = id else {
            continue;
        };
        let answer = match made {
            Ok(_) => Response::new_ok(id, json!({ "uri": uri })),
            Err(_) if stop.load(Ordering::Relaxed) => Response::new_err(
                id,
                ErrorCode::RequestCanceled as i32,
                "cancelled".to_owned(),
            ),
            Err(why) => Response::new_err(id, ErrorCode::RequestFailed as i32, why),
        };
        let _ = client.send(answer.into());
    }
}

/// Progress notifications about the current image.
struct PictureProgress {
    client: Outgoing,
    now: Mutex<Now>,
}

/// The current image.
#[derive(Default)]
struct Now {
    /// The client's progress token, if it wants progress.
    token: Option<String>,
    /// The task and the percentage last sent.
    sent: (String, usize),
    stop: Arc<AtomicBool>,
}

impl PictureProgress {
    fn now(&self) -> MutexGuard<'_, Now> {
        // Each change is complete, so a panic elsewhere leaves the state consistent.
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn begin(&self, token: Option<String>, title: &str, stop: &Arc<AtomicBool>) {
        if let Some(token) = &token {
            let id = RequestId::from(format!("{token}-create"));
            let params = json!({ "token": token });
            let create = Request::new(id, "window/workDoneProgress/create".to_owned(), params);
            let _ = self.client.send(create.into());
            let value =
                json!({ "kind": "begin", "title": title, "cancellable": true, "percentage": 0 });
            notify(
                &self.client,
                "$/progress",
                json!({ "token": token, "value": value }),
            );
        }
        *self.now() = Now {
            token,
            sent: Default::default(),
            stop: Arc::clone(stop),
        };
    }

    fn end(&self) {
        if let Some(token) = self.now().token.take() {
            let value = json!({ "kind": "end" });
            notify(
                &self.client,
                "$/progress",
                json!({ "token": token, "value": value }),
            );
        }
    }
}

impl Progress for PictureProgress {
    fn report(&self, task: &str, done: usize, total: usize) {
        let mut now = self.now();
        let Some(token) = now.token.clone() else {
            return;
        };
        let percent = 100 * done.min(total) / total.max(1);
        let (last, sent) = &now.sent;
        if last == task && percent < sent + STEP {
            return;
        }
        now.sent = (task.to_owned(), percent);
        let value = json!({ "kind": "report", "message": task, "percentage": percent });
        notify(
            &self.client,
            "$/progress",
            json!({ "token": token, "value": value }),
        );
    }

    fn cancelled(&self) -> bool {
        self.now().stop.load(Ordering::Relaxed)
    }
}

/// Least percentage between two reports.
const STEP: usize = 5;

fn notify(client: &Outgoing, method: &str, params: serde_json::Value) {
    let _ = client.send(Notification::new(method.to_owned(), params).into());
}

/// Renders the completion of a cue into a file of the folder.
fn picture(
    kept: &mut Option<(PathBuf, Engine)>,
    job: Job,
    folder: &Path,
) -> Result<PathBuf, String> {
    if job.stop.load(Ordering::Relaxed) {
        return Err("cancelled".to_owned());
    }
    let mut engine = match kept.take() {
        Some((root, mut engine)) if root == job.root => {
            engine
                .replace(&job.text)
                .map_err(|error| error.to_string())?;
            engine
        }
        _ => {
            let name = job.root.display().to_string();
            let opened = Engine::from_text(&name, job.text.as_bytes(), job.host);
            opened.map_err(|error| error.to_string())?
        }
    };
    let times = engine.document().timeline().cues();
    let time = times.iter().find(|time| time.number == job.cue);
    let moment = time.map(|time| time.completion);
    let drawn = moment.ok_or_else(|| format!("there is no cue {}", job.cue));
    let drawn = drawn.and_then(|moment| {
        let image = engine.picture(moment).map_err(|error| error.to_string())?;
        let tone = engine.tone().map_err(|error| error.to_string())?;
        let encoded = png::encode(image.width(), image.height(), &tone.encode(&image));
        encoded.map_err(|error| error.to_string())
    });
    *kept = Some((job.root.clone(), engine));
    let stem = job.root.file_stem().unwrap_or_default().to_string_lossy();
    let path = folder.join(format!("{stem}-cue-{}.png", job.cue));
    Disk.write(&path, &drawn?)
        .map_err(|error| error.to_string())?;
    Ok(path)
}
