//! Refinement: renders the settings that the plan puts first until a goal is met, here and now.

use super::refiner::{Extent, Next, Refiner};
use super::rendering::Reused;
use super::{Engine, Error, WayForecast};
use crate::plan::worst_left;
use crate::pool::{Pool, is_within};
use footlight_show::units::{ErrorUnit, Time, Tolerance};

/// When to stop refining; the first of these that is met ends it, and so does the end of the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Predicted error of the worst moment.
    pub until: Option<Tolerance>,
    /// Number of images to render now.
    pub count: Option<usize>,
    /// Seconds to spend now; an image that is begun is finished, one that is not predicted to fit
    /// is not begun, but for the first.
    pub budget: Option<f64>,
}

impl Goal {
    /// A number of images.
    pub fn count(count: usize) -> Goal {
        Goal {
            count: Some(count),
            ..Goal::default()
        }
    }

    /// An error of the worst moment, as a plain number relative (0.02 = 2 %); 0 refines to the end
    /// of the plan.
    pub fn until(error: impl Into<Tolerance>) -> Goal {
        Goal {
            until: Some(error.into()),
            ..Goal::default()
        }
    }

    /// What its error is measured in.
    pub fn unit(&self) -> ErrorUnit {
        self.until.map_or(ErrorUnit::Light, |until| until.unit)
    }

    /// Whether it leaves open which images are rendered: for a number of them the plan's next are.
    pub fn asks_for_a_way(&self) -> bool {
        let error = self.until.is_some_and(|until| until.error > 0.0);
        self.count.is_none() && (error || self.until.is_none() && self.budget.is_some())
    }

    /// One image where nothing is said.
    pub fn or_one(self) -> Goal {
        if self == Goal::default() {
            Goal::count(1)
        } else {
            self
        }
    }
}

/// Where the sequence stood after an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Refined images in the pool.
    pub refined: usize,
    /// Seconds of computing since the show was opened.
    pub seconds: f64,
    /// Predicted error of the sequence, relative, as it was known then.
    pub error: f64,
    /// The same before it was calibrated by known corrections; it never rises.
    pub forecast: f64,
}

/// The moment that is predicted to be furthest off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstMoment {
    /// Which cue runs or is complete then.
    pub cue: usize,
    /// When.
    pub time: Time,
    /// Predicted error.
    pub error: f64,
}

/// Why refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The predicted error is within what was asked for.
    Reached,
    /// As many images as asked for were rendered.
    Counted,
    /// The time is used up, or too short for another image.
    Spent,
    /// Nothing is left that another image would improve.
    Complete,
    /// The finest step is there; the error asked for is below what it is itself off by.
    Finest,
    /// The user stopped it; what is finished is kept.
    Stopped,
}

/// Why refinement ended before its time did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Warning {
    /// The next image is predicted to take longer than what is left.
    DoesNotFit {
        /// Its predicted seconds.
        seconds: f64,
    },
}

/// What a refinement did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RefinementSummary {
    /// Images that it rendered or took up; those of every bank alone count where the goal is an error
    /// or a time.
    pub images: usize,
    /// Seconds of computing them.
    pub seconds: f64,
    /// Why it ended early.
    pub warnings: Vec<Warning>,
    /// Why it ended; `None` while it goes on.
    pub ended: Option<Ended>,
}

impl Engine {
    /// Renders the coarse images unless they are there, and takes up the refined ones that this
    /// session and earlier ones left. The first of [`Engine::steps`] is made here, and one for each
    /// of those.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn coarse(&mut self) -> Result<(), Error> {
        self.coarse_for(Goal::count(0)).map(|_| ())
    }

    /// The same where the images are to serve a goal: they are then those of the way to it that is
    /// predicted to be the cheapest. The ways that it chose from are returned ([`Engine::ways`]).
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn coarse_for(&mut self, goal: Goal) -> Result<Vec<WayForecast>, Error> {
        self.timed(|engine| {
            // What the background renders of this view is not rendered twice.
            if engine.refines_this_view() {
                if engine.pool().is_none() && engine.impatient {
                    return Err(Error::NotYet);
                }
                engine.wait_until(|engine| engine.pool().is_some())?;
                if engine.pool().is_some() {
                    return Ok(Vec::new());
                }
            }
            let mut refiner = engine.refiner(goal, Extent::Coarse)?;
            engine.drive(&mut refiner, &mut |_| Ok(()))?;
            Ok(refiner.ways.unwrap_or_default())
        })
    }

    /// A refiner whose choice of a way knows how fast this machine is.
    fn refiner(&mut self, goal: Goal, extent: Extent) -> Result<Refiner, Error> {
        self.rendering.as_ref().ok_or(Error::NoSetup)?;
        if goal.asks_for_a_way() && !self.is_final() {
            self.calibrate_cost()?;
        }
        Ok(Refiner::new(goal, extent, self.now()))
    }

    /// Takes up the images that earlier sessions stored, where every source has one; renders nothing.
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn take_up(&mut self) -> Result<(), Error> {
        let is_new = self.rendering.is_some() && self.pool().is_none() && !self.is_busy();
        if is_new && self.stored_base()?.is_some() {
            self.coarse()
        } else {
            Ok(())
        }
    }

    /// Renders refined images in the order of the plan until `goal` is met; a goal with nothing in
    /// it is one image. The coarse images' own estimate of their error is trusted alone only where
    /// it leaves room; else an error counts as reached once two refined images were held against
    /// it.
    ///
    /// The predicted seconds decide whether another image still fits into a time; one is always
    /// rendered.
    ///
    /// A cancel ends it at once: images that are finished are kept, those in hand are lost.
    ///
    /// # Errors
    /// [`Error::Busy`] while a refinement runs in the background, [`Error::NoSetup`], else what
    /// rendering says; images finished before it are kept.
    pub fn refine(&mut self, goal: Goal) -> Result<RefinementSummary, Error> {
        self.refine_watched(goal, &mut |_| Ok(()))
    }

    /// The same with `watch` called after each call of the operator; the time that this takes does
    /// not count.
    pub fn refine_watched(
        &mut self,
        goal: Goal,
        watch: &mut dyn FnMut(&mut Engine) -> Result<(), Error>,
    ) -> Result<RefinementSummary, Error> {
        self.timed(|engine| {
            engine.idle()?;
            let mut refiner = engine.refiner(goal, Extent::Goal)?;
            let ended = engine.drive(&mut refiner, watch)?;
            let mut done = refiner.done;
            done.ended = Some(ended);
            Ok(done)
        })
    }

    /// Runs a refiner's jobs here, one after the other.
    fn drive(
        &mut self,
        refiner: &mut Refiner,
        watch: &mut dyn FnMut(&mut Engine) -> Result<(), Error>,
    ) -> Result<Ended, Error> {
        loop {
            let has_done = refiner.done.images > 0 && self.pool().is_some();
            if has_done && self.host.progress.cancelled() {
                return Ok(Ended::Stopped);
            }
            match refiner.advance(self)? {
                Next::Ended(ended) => return Ok(ended),
                Next::Added => {}
                Next::Render(job, ticket) => {
                    let refined = ticket.refined;
                    let rendered = job.run(self.host.renderer.as_ref(), self.work());
                    match refiner.collect(self, *ticket, rendered) {
                        Err(error) if error.is_cancel() && has_done => {
                            return Ok(Ended::Stopped);
                        }
                        collected => collected?,
                    }
                    if !refined {
                        continue;
                    }
                }
            }
            let done = refiner.done.images;
            let total = refiner.images_in_all();
            let progress = &self.host.progress;
            progress.report("refined pictures", done, total);
            watch(self)?;
        }
    }

    /// Why no image is to be rendered after what is done; `None` if one is.
    pub(super) fn ended(
        &self,
        goal: &Goal,
        done: &RefinementSummary,
    ) -> Result<Option<Ended>, Error> {
        // As it is now: an edit changes it without an image.
        let error = self.predicted_in(goal.unit())?;
        // Where nothing is known to be wrong nothing is left to refine: that is then the reason.
        let known = error > 0.0 || self.refined() > 0;
        let reached = |wanted: Tolerance| known && self.is_reached(wanted, error);
        if goal.until.is_some_and(reached) {
            return Ok(Some(Ended::Reached));
        }
        if goal.count.is_some_and(|count| done.images >= count) {
            return Ok(Some(Ended::Counted));
        }
        let spent = goal.budget.is_some_and(|s| done.seconds >= s);
        Ok((spent && done.images > 0).then_some(Ended::Spent))
    }

    /// Whether an error that is predicted now counts as within `wanted`.
    pub(super) fn is_reached(&self, wanted: Tolerance, error: f64) -> bool {
        let is_stated = self.pool().is_some_and(Pool::is_known);
        is_within(wanted.error, error, self.refined(), is_stated)
    }

    /// Adds the refined images that earlier edits and sessions left.
    pub(super) fn reuse_refined(&mut self) -> Result<(), Error> {
        let (begin, least) = (self.now(), self.least_refined());
        let store = self.host.store.as_ref();
        let image_cache = &mut self.image_cache;
        let rendering = self.rendering.as_mut().ok_or(Error::NoSetup)?;
        let reused = rendering.reusable(image_cache, least, store);
        self.add_refined(reused, begin)
    }

    /// Adds images to the pool and records where the sequence stands after each.
    pub(super) fn add_refined(&mut self, images: Vec<Reused>, begin: f64) -> Result<(), Error> {
        let mut begin = begin;
        for image in images {
            let work = self.host.work();
            let pool = self.rendering.as_mut().and_then(|r| r.pool.as_mut());
            let pool = pool.ok_or(Error::NotRendered)?;
            pool.add(image.setting, image.image, image.quality, work);
            let now = self.now();
            self.record(begin)?;
            begin = now;
        }
        Ok(())
    }

    pub(super) fn record(&mut self, begin: f64) -> Result<(), Error> {
        let spent = self.steps.last().map_or(0.0, |s| s.seconds);
        let forecast = self.uncalibrated_error()?;
        let step = Step {
            refined: self.refined(),
            seconds: spent + self.now() - begin,
            error: self.error_of(forecast)?,
            forecast,
        };
        self.steps.push(step);
        Ok(())
    }

    /// Predicted error of the sequence as the pool stands, relative.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered.
    pub fn predicted_error(&self) -> Result<f64, Error> {
        self.predicted_in(ErrorUnit::Light)
    }

    /// The same in a unit.
    ///
    /// # Errors
    /// As [`Engine::predicted_error`].
    pub fn predicted_in(&self, unit: ErrorUnit) -> Result<f64, Error> {
        let pool = self.rendered()?;
        if self.is_final() || pool.has_no_estimated_error() {
            return Ok(0.0);
        }
        match self.errors_left(pool, &[], unit)?[..] {
            [alone, now] => Ok(pool.error(now, alone)),
            _ => Ok(0.0),
        }
    }

    /// Predicted error of the sequence, relative, where coarse images are left to show so much, as
    /// estimated before calibration ([`Step::forecast`]).
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered.
    pub fn error_of(&self, left: f64) -> Result<f64, Error> {
        let pool = self.rendered()?;
        if self.is_final() || pool.has_no_estimated_error() {
            return Ok(0.0);
        }
        let alone = self.errors_left(pool, &[], ErrorUnit::Light)?;
        Ok(pool.error(left, alone.first().copied().unwrap_or(0.0)))
    }

    /// Where the sequence is predicted to be worst, among the middle and the end of every cue's
    /// fade; `None` where no error is known. A dark cue counts as much as a bright one, but for what
    /// is nearly out.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered.
    pub fn worst_moment(&self, unit: ErrorUnit) -> Result<Option<WorstMoment>, Error> {
        let pool = self.rendered()?;
        let is_unknown = pool.coarser().is_empty() && !pool.is_stated();
        if self.is_final() || is_unknown || pool.has_no_estimated_error() {
            return Ok(None);
        }
        let mut worst: Option<WorstMoment> = None;
        let moments = self.moments(pool, unit)?;
        for ((cue, time), moment) in self.moments_of_cues().into_iter().zip(moments) {
            let left = worst_left(&[moment], &pool.settings(), &[], pool.weighting());
            let [alone, now] = left[..] else { continue };
            let error = pool.error(now, alone);
            if alone > 0.0 && worst.is_none_or(|w| error > w.error) {
                worst = Some(WorstMoment { cue, time, error });
            }
        }
        Ok(worst)
    }

    pub(super) fn uncalibrated_error(&self) -> Result<f64, Error> {
        let pool = self.rendered()?;
        if self.is_final() || pool.has_no_estimated_error() {
            return Ok(0.0);
        }
        let left = self.errors_left(pool, &[], ErrorUnit::Light)?;
        Ok(left.last().copied().unwrap_or(0.0))
    }
}
