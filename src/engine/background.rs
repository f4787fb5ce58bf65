//! Refinement in the background, driven by the [`Refiner`] that the blocking call uses.
//!
//! The engine stays the only owner of document and pool. One job at a time is rendered in the
//! background, with everything that it needs; [`Engine::poll`] takes its images and starts the next
//! job, planned from the current show. So edits and previews are served in between, every finished
//! image improves the next preview, and an edit changes the remaining plan. Images are rendered one
//! at a time: in a larger job the first would wait for the last. A refinement owns its goal, its
//! method and its view: the engine may look from another view meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::goal::{Ended, Refinement, RefinementSummary};
use super::images::ViewName;
use super::refiner::{Next, Refiner, Ticket};
use super::rendering::Rendered;
use super::ways::Extent;
use super::{Engine, Error};
use crate::measure::MeasuredMoment;
use crate::measure::independent::MeasureJob;
use footlight_host::work::{Progress, Work};
use footlight_transport::{Quality, Setup, Transport, TransportError};

/// Time between two checks of progress and cancellation while waiting.
const GLANCE: Duration = Duration::from_millis(40);

/// Progress of a job, and its cancellation.
#[derive(Debug, Default)]
struct JobProgress {
    stop: AtomicBool,
    at: Mutex<(String, usize, usize)>,
}

impl JobProgress {
    fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
    }

    fn at(&self) -> (String, usize, usize) {
        let held = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        held.clone()
    }
}

impl Progress for JobProgress {
    fn report(&self, task: &str, done: usize, total: usize) {
        let mut held = self.at.lock().unwrap_or_else(PoisonError::into_inner);
        *held = (task.to_owned(), done, total);
    }

    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }
}

/// A running background job. Dropping it cancels it.
struct PendingJob {
    task: PendingTask,
    progress: StopOnDrop,
    from: Receiver<Outcome>,
    /// An outcome received early.
    outcome: Option<Outcome>,
}

/// The purpose of a job.
enum PendingTask {
    Render(Box<Ticket>),
    Measure {
        setup: Setup,
        quality: Quality,
        started: f64,
    },
}

/// The result of a job.
enum Outcome {
    Rendered(Rendered),
    Measured(Box<MeasureJob>, Result<Vec<MeasuredMoment>, TransportError>),
}

impl PendingTask {
    fn setup(&self) -> &Setup {
        match self {
            PendingTask::Render(ticket) => &ticket.setup,
            PendingTask::Measure { setup, .. } => setup,
        }
    }
}

impl PendingJob {
    /// Waits at most `patience` for the outcome; true once it has arrived.
    fn wait(&mut self, patience: Duration) -> Result<bool, Error> {
        if self.outcome.is_some() {
            return Ok(true);
        }
        // Without patience no clock is read: some platforms have none.
        let received = if patience.is_zero() {
            self.from.try_recv().map_err(|e| e == TryRecvError::Empty)
        } else {
            self.from
                .recv_timeout(patience)
                .map_err(|e| e == RecvTimeoutError::Timeout)
        };
        match received {
            Ok(outcome) => self.outcome = Some(outcome),
            Err(true) => {}
            Err(false) => return Err(Error::TaskLost),
        }
        Ok(self.outcome.is_some())
    }
}

struct StopOnDrop(Arc<JobProgress>);

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// A refinement in the background.
pub(super) struct BackgroundRefinement {
    refiner: Refiner,
    job: Option<PendingJob>,
}

impl BackgroundRefinement {
    /// The view being refined.
    pub fn view(&self) -> &ViewName {
        &self.refiner.wanted.view
    }
}

/// Status of a refinement in the background.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Number of images added.
    pub rendered: usize,
    /// Their rendering time, seconds.
    pub seconds: f64,
    /// Predicted error of the sequence, relative; `None` before the coarse images exist.
    pub error: Option<f64>,
    /// The current call of the operator.
    pub job: Option<JobStatus>,
}

/// A call of the operator in the background.
#[derive(Clone, Debug, PartialEq)]
pub struct JobStatus {
    /// Number of images being rendered; 0 when it measures existing ones.
    pub images: usize,
    /// True for refined images, false for coarse ones.
    pub refined: bool,
    /// Their step of quality.
    pub quality: Quality,
    /// Seconds since it began.
    pub spent: f64,
    /// Predicted duration, seconds; 0 if unknown.
    pub predicted: f64,
    /// The current loop: its name, steps done and steps in all.
    pub task: (String, usize, usize),
}

/// An event that no call returned.
#[derive(Debug)]
pub enum Event {
    /// A refinement in the background ended, or failed.
    RefinementEnded {
        /// Its summary.
        done: RefinementSummary,
        /// The reason of a failure.
        failed: Option<Error>,
        /// Predicted error of the sequence, relative, if known.
        error: Option<f64>,
        /// Refined images in the pool.
        refined: usize,
    },
    /// Files of the show changed on disk and were read again.
    FilesReread,
}

impl Engine {
    /// True while a refinement runs in the background.
    pub fn is_busy(&self) -> bool {
        self.background.is_some()
    }

    /// True while a refinement of this view runs in the background.
    pub(super) fn is_refining(&self, view: &ViewName) -> bool {
        self.background.as_ref().is_some_and(|b| b.view() == view)
    }

    /// Refuses a call that could render an image twice.
    ///
    /// # Errors
    /// [`Error::Busy`] while a refinement runs in the background.
    pub fn idle(&self) -> Result<(), Error> {
        match self.background {
            None => Ok(()),
            Some(_) => Err(Error::Busy),
        }
    }

    /// Begins a refinement in the background, including coarse images if there are none yet. Call
    /// [`Engine::poll`] regularly (some ten times a second) to take finished images and start the
    /// next. An edit does not end the refinement: what follows is planned from the current show.
    /// [`Engine::picture`] waits only for coarse images.
    ///
    /// ```
    /// # use footlight_engine::{Engine, Goal, Host};
    /// # fn refine(engine: &mut Engine) -> Result<(), footlight_engine::Error> {
    /// engine.start(Goal::until(0.0))?; // to the end of the plan
    /// while engine.is_busy() {
    ///     std::thread::sleep(std::time::Duration::from_millis(20)); // or whatever the program does
    ///     engine.poll();
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Busy`] when one is running, [`Error::NoBackground`] when the host runs nothing in
    /// the background, [`Error::NoSetup`].
    pub fn start(&mut self, wanted: impl Into<Refinement>) -> Result<(), Error> {
        self.idle()?;
        if self.host.background.is_none() {
            return Err(Error::NoBackground);
        }
        let wanted = self.seen(wanted.into())?;
        self.images.find_heads(&self.document, self.host.work())?;
        self.estimate_of(&wanted).rendering()?;
        self.background = Some(BackgroundRefinement {
            refiner: Refiner::new(wanted, Extent::Goal, self.now()),
            job: None,
        });
        self.go_on();
        Ok(())
    }

    /// Takes finished background images and starts the next job; returns the events since the last
    /// call. Cheap while nothing is finished.
    pub fn poll(&mut self) -> Vec<Event> {
        self.go_on();
        std::mem::take(&mut self.events)
    }

    /// Takes finished images and starts the next job.
    fn go_on(&mut self) {
        let Some(mut background) = self.background.take() else {
            return;
        };
        match self.go_on_with(&mut background) {
            Some(event) => {
                self.renew_images();
                self.tell(event);
            }
            None => self.background = Some(background),
        }
    }

    /// Advances a refinement; returns an event when it has ended.
    fn go_on_with(&mut self, background: &mut BackgroundRefinement) -> Option<Event> {
        let failed = match self.advance(background) {
            Ok(None) => return None,
            Ok(Some(ended)) => {
                background.refiner.done.ended = Some(ended);
                None
            }
            Err(error) => Some(error),
        };
        let estimate = self.estimate_of(&background.refiner.wanted);
        let refined = estimate.refined();
        let (error, unknown) = match estimate.predicted_error() {
            Ok(error) => (Some(error), None),
            Err(Error::NotRendered | Error::NoSetup) => (None, None),
            Err(error) => (None, Some(error)),
        };
        Some(Event::RefinementEnded {
            done: std::mem::take(&mut background.refiner.done),
            failed: failed.or(unknown),
            error,
            refined,
        })
    }

    /// Collects and starts jobs as far as possible without waiting; returns the reason when the
    /// refinement has ended.
    fn advance(&mut self, background: &mut BackgroundRefinement) -> Result<Option<Ended>, Error> {
        loop {
            if let Some(mut job) = background.job.take() {
                match job.wait(Duration::ZERO) {
                    Ok(true) => self.collect(background, job)?,
                    Ok(false) => {
                        background.job = Some(job);
                        return Ok(None);
                    }
                    Err(lost) => {
                        if let PendingTask::Render(ticket) = &job.task {
                            background.refiner.abandon(&mut self.means(), ticket);
                        }
                        return Err(lost);
                    }
                }
            }
            match background.refiner.advance(&mut self.means())? {
                Next::Added => {}
                Next::Ended(ended) => return Ok(Some(ended)),
                Next::Render(job, ticket) => {
                    let task = PendingTask::Render(ticket);
                    let run = |renderer: &dyn Transport, work: Work<'_>| {
                        Outcome::Rendered(job.run(renderer, work))
                    };
                    background.job = Some(self.launch(task, run)?);
                    return Ok(None);
                }
                Next::Measure(job) => {
                    let task = PendingTask::Measure {
                        setup: job.setup.clone(),
                        quality: job.quality,
                        started: self.now(),
                    };
                    let run = |renderer: &dyn Transport, work: Work<'_>| {
                        let measured = job.run(renderer, work);
                        Outcome::Measured(job, measured)
                    };
                    background.job = Some(self.launch(task, run)?);
                    return Ok(None);
                }
            }
        }
    }

    /// Takes the result of a job; of a cancelled job only its operator, which is no error.
    fn collect(
        &mut self,
        background: &mut BackgroundRefinement,
        job: PendingJob,
    ) -> Result<(), Error> {
        let (refiner, now) = (&mut background.refiner, self.now());
        let collected = match (job.task, job.outcome) {
            (PendingTask::Render(ticket), Some(Outcome::Rendered(rendered))) => {
                refiner.collect(&mut self.means(), *ticket, rendered)
            }
            (PendingTask::Measure { started, .. }, Some(Outcome::Measured(job, measured))) => {
                measured.map_err(Error::from).and_then(|moments| {
                    let measured = (moments, now - started);
                    refiner.collect_measured(&mut self.means(), &job, measured)
                })
            }
            _ => Ok(()),
        };
        match collected {
            Err(error) if error.is_cancel() => Ok(()),
            other => other,
        }
    }

    /// Starts a job on the host's threads.
    fn launch(
        &self,
        task: PendingTask,
        run: impl FnOnce(&dyn Transport, Work<'_>) -> Outcome + Send + 'static,
    ) -> Result<PendingJob, Error> {
        let background = self.host.background.as_ref().ok_or(Error::NoBackground)?;
        let progress = Arc::new(JobProgress::default());
        let (send, from) = channel();
        let renderer = Arc::clone(&self.host.renderer);
        let (threads, memory) = (self.host.threads, self.work().memory);
        let watched = Arc::clone(&progress);
        background.start(Box::new(move || {
            let work = Work {
                progress: watched.as_ref(),
                threads,
                memory,
            };
            // The receiver may be gone.
            let _ = send.send(run(renderer.as_ref(), work));
        }));
        Ok(PendingJob {
            task,
            progress: StopOnDrop(progress),
            from,
            outcome: None,
        })
    }

    /// Cancels a job whose images the show can no longer use, because they would show another scene
    /// or view. A change of light alone keeps it.
    pub(super) fn drop_useless_job(&mut self) {
        let Some(background) = &self.background else {
            return;
        };
        let Some(job) = &background.job else {
            return;
        };
        let of_view = self.images.of(background.view());
        if of_view.is_none_or(|v| !v.rendering.setup.has_same_scene(job.task.setup())) {
            job.progress.0.stop();
        }
    }

    /// Waits while the refinement in the background is running and `enough` is false, reporting its
    /// progress as foreground progress.
    pub(super) fn wait_until(&mut self, enough: impl Fn(&Engine) -> bool) -> Result<(), Error> {
        self.go_on();
        while !enough(self) {
            let Some(job) = self.background.as_mut().and_then(|b| b.job.as_mut()) else {
                break;
            };
            // On a platform that cannot wait, the caller polls again later.
            let patience = if cfg!(target_family = "wasm") {
                Duration::ZERO
            } else {
                GLANCE
            };
            if !matches!(job.wait(patience), Ok(false)) {
                self.go_on();
                continue;
            }
            if patience.is_zero() {
                break;
            }
            let (task, done, total) = job.progress.0.at();
            if total > 0 {
                self.host.progress.report(&task, done, total);
            }
            self.host.work().check()?;
        }
        Ok(())
    }

    /// Waits until the refinement in the background has ended. On platforms without threads it only
    /// checks.
    ///
    /// # Errors
    /// [`Error::Cancelled`] when the host's progress cancels; the refinement then continues.
    pub fn wait(&mut self) -> Result<(), Error> {
        self.wait_until(|_| false)
    }

    /// Ends the refinement in the background after the current image, or at once.
    pub fn stop(&mut self, at_once: bool) {
        if let Some(background) = &mut self.background {
            background.refiner.stop();
            if let Some(job) = background.job.as_ref().filter(|_| at_once) {
                job.progress.0.stop();
            }
        }
        self.go_on();
    }

    /// The current call of the operator in the background, if any.
    fn job(&self) -> Option<JobStatus> {
        let job = self.background.as_ref()?.job.as_ref()?;
        let (images, refined, quality, started, predicted) = match &job.task {
            PendingTask::Render(ticket) => (
                ticket.rendering(),
                ticket.refined,
                ticket.quality,
                ticket.started,
                ticket.predicted,
            ),
            PendingTask::Measure {
                quality, started, ..
            } => (0, false, *quality, *started, 0.0),
        };
        Some(JobStatus {
            images,
            refined,
            quality,
            spent: self.now() - started,
            predicted,
            task: job.progress.0.at(),
        })
    }

    /// Status of the refinement in the background, if any.
    pub fn status(&self) -> Option<Status> {
        let refiner = &self.background.as_ref()?.refiner;
        Some(Status {
            rendered: refiner.done.images,
            seconds: refiner.done.seconds,
            // If the prediction fails, the refinement ends with that error.
            error: self.estimate_of(&refiner.wanted).predicted_error().ok(),
            job: self.job(),
        })
    }
}
