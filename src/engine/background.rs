//! Refinement in the background, driven by the same [`Refiner`] as the blocking call.
//!
//! The engine stays the only owner of document and pool. What is rendered in the background is one
//! job at a time, with all that it needs; [`Engine::poll`] takes its images in and starts the next
//! one, planned from the show as it is then. So edits and previews are served at once in between,
//! every finished image improves the next preview, and an edit changes what is still to come.
//! Images are rendered one at a time: a job of several would keep the first waiting for the last.
//! A refinement owns its goal, its way and its view: the engine may look from another meanwhile.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::goal::{Ended, Refinement, RefinementSummary, Way};
use super::images::ViewName;
use super::refiner::{Extent, Next, Refiner, Ticket};
use super::rendering::Rendered;
use super::ways::Mixtures;
use super::{Engine, Error};
use crate::measure::MeasuredMoment;
use crate::measure::independent::MeasureJob;
use footlight_host::work::{Progress, Work};
use footlight_show::units::ErrorUnit;
use footlight_transport::{Quality, Setup, Transport, TransportError};

/// How long a wait goes on before it looks at progress and cancel again.
const GLANCE: Duration = Duration::from_millis(40);

/// How far a job is, and the way to stop it.
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

/// A job that is at work elsewhere. Dropped, it is given up.
struct PendingJob {
    task: PendingTask,
    progress: StopOnDrop,
    from: Receiver<Outcome>,
    /// What came back before it was asked for.
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
    /// Waits at most `patience` for it; true once it is there.
    fn wait(&mut self, patience: Duration) -> Result<bool, Error> {
        if self.outcome.is_some() {
            return Ok(true);
        }
        // A look reads no clock: some platforms have none.
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
    /// The view that it refines.
    pub fn view(&self) -> &ViewName {
        &self.refiner.wanted.view
    }
}

/// How far a refinement in the background is.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Images that it has added.
    pub rendered: usize,
    /// Seconds that they took.
    pub seconds: f64,
    /// Predicted error of the sequence, relative; `None` before the coarse images are there.
    pub error: Option<f64>,
    /// The call of the operator that is at work.
    pub job: Option<JobStatus>,
    /// What is predicted to follow.
    pub ahead: Option<Ahead>,
}

/// A call of the operator that is at work in the background.
#[derive(Clone, Debug, PartialEq)]
pub struct JobStatus {
    /// Images that it renders; 0 where it measures those that are there.
    pub images: usize,
    /// Whether these are refined images, or coarse ones.
    pub refined: bool,
    /// Their step of quality.
    pub quality: Quality,
    /// Seconds since it began.
    pub spent: f64,
    /// Seconds that it is predicted to take; 0 where that is not known.
    pub predicted: f64,
    /// The loop that it is in: its name, steps done and steps in all.
    pub task: (String, usize, usize),
}

/// What a refinement in the background is predicted to do yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    /// Images that follow.
    pub images: usize,
    /// Seconds until the last of them is there.
    pub seconds: f64,
    /// The error that they leave, relative.
    pub error: f64,
}

/// What happened without a call that returned it.
#[derive(Debug)]
pub enum Event {
    /// A refinement in the background ended, or failed; with the predicted error of the sequence
    /// then, where it is known.
    RefinementEnded {
        /// What it did.
        done: RefinementSummary,
        /// Why it failed, if it did.
        failed: Option<Error>,
        /// Predicted error of the sequence, relative.
        error: Option<f64>,
        /// Refined images in the pool.
        refined: usize,
    },
    /// Files that the show names had changed on disk, and were read again.
    FilesReread,
}

impl Engine {
    /// True while a refinement goes on in the background.
    pub fn is_busy(&self) -> bool {
        self.background.is_some()
    }

    /// True while a refinement of this view goes on in the background.
    pub(super) fn is_refining(&self, view: &ViewName) -> bool {
        self.background.as_ref().is_some_and(|b| b.view() == view)
    }

    /// Refuses what would render the same images twice.
    ///
    /// # Errors
    /// [`Error::Busy`] while a refinement goes on in the background.
    pub fn idle(&self) -> Result<(), Error> {
        match self.background {
            None => Ok(()),
            Some(_) => Err(Error::Busy),
        }
    }

    /// Begins a refinement in the background, coarse images included where there are none yet; call
    /// [`Engine::poll`] now and then (some ten times a second), which takes in what is finished and
    /// starts what is next. An edit does not end it: what follows is planned from the show as it is
    /// then. [`Engine::picture`] waits only while coarse images are still to come.
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
    /// [`Error::Busy`] when one is running already, [`Error::NoBackground`] when the host runs
    /// nothing in the background, [`Error::NoSetup`].
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

    /// Takes in what was rendered in the background and starts what comes next; what happened since
    /// it was called last. Cheap while nothing is finished.
    pub fn poll(&mut self) -> Vec<Event> {
        self.go_on();
        std::mem::take(&mut self.events)
    }

    /// Takes in what is finished and starts what is next.
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

    /// Does a step of a refinement; what there is to say where it has ended.
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

    /// Collects and starts jobs as far as that goes without waiting; the reason where the refinement
    /// has ended.
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

    /// Takes in what a job rendered or measured: of one that was cancelled its operator alone, which is
    /// no error.
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
            // It may not be wanted any more.
            let _ = send.send(run(renderer.as_ref(), work));
        }));
        Ok(PendingJob {
            task,
            progress: StopOnDrop(progress),
            from,
            outcome: None,
        })
    }

    /// Gives up a job whose images the show has no use for any more: they would show another scene,
    /// or from another place. In another light they are of use again.
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

    /// Waits while the refinement in the background is at work and `enough` is not true, reporting
    /// its progress as that of the foreground.
    pub(super) fn wait_until(&mut self, enough: impl Fn(&Engine) -> bool) -> Result<(), Error> {
        self.go_on();
        while !enough(self) {
            let Some(job) = self.background.as_mut().and_then(|b| b.job.as_mut()) else {
                break;
            };
            // Where the platform cannot wait, the caller looks again later.
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
    /// looks whether it has.
    ///
    /// # Errors
    /// [`Error::Cancelled`] when the host's progress says so, [`Error::OutOfTime`]; the refinement
    /// then goes on.
    pub fn wait(&mut self) -> Result<(), Error> {
        self.timed(|engine| engine.wait_until(|_| false))
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

    /// The call of the operator that is at work in the background, if any.
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

    /// How far the refinement in the background is, if there is one.
    pub fn status(&self) -> Option<Status> {
        let job = self.job();
        let refiner = &self.background.as_ref()?.refiner;
        Some(Status {
            rendered: refiner.done.images,
            seconds: refiner.done.seconds,
            // Why it cannot be predicted is said where the refinement ends of it.
            error: self.estimate_of(&refiner.wanted).predicted_error().ok(),
            ahead: self.ahead(refiner, job.as_ref()),
            job,
        })
    }

    /// What is predicted to follow.
    fn ahead(&self, refiner: &Refiner, job: Option<&JobStatus>) -> Option<Ahead> {
        let spent = job.map_or(0.0, |job| job.spent);
        let estimate = self.estimate_of(&refiner.wanted);
        if estimate.is_pool_due() {
            let way = refiner.ways.as_ref()?.first()?;
            return (way.way == Way::Alone && way.alone > 0).then(|| Ahead {
                images: way.alone,
                seconds: (way.seconds - spent).max(0.0),
                error: way.error,
            });
        }
        let forecast = estimate.forecast_by(ErrorUnit::Light).ok()??;
        let ahead = Mixtures::of(&forecast, &refiner.left(), estimate.refined());
        // The first is being rendered already.
        (ahead.images > 0).then(|| Ahead {
            images: ahead.images,
            seconds: (ahead.seconds - spent).max(0.0),
            error: ahead.error,
        })
    }
}
