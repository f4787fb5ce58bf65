//! Refinement here and now: the calls that render until a goal is met.

use super::goal::{Ended, Goal, Refinement, RefinementSummary};
use super::refiner::{Extent, Next, Refiner};
use super::ways::WayForecast;
use super::{Engine, Error};
use footlight_transport::TransportError;

impl Engine {
    /// Renders the coarse images unless they are there, and takes up the refined ones that this
    /// session and earlier ones left. The first of [`Estimate::steps`](super::Estimate::steps) is made here, and one for each
    /// of those.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn coarse(&mut self) -> Result<(), Error> {
        self.coarse_for(Goal::count(0)).map(|_| ())
    }

    /// The same where the images are to serve a refinement: they are then those of the way to its goal
    /// that is predicted to be the cheapest. The ways that it chose from are returned
    /// ([`Estimate::ways`](super::Estimate::ways)).
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn coarse_for(&mut self, wanted: impl Into<Refinement>) -> Result<Vec<WayForecast>, Error> {
        let wanted = wanted.into();
        self.timed(|engine| {
            let wanted = engine.seen(wanted)?;
            // What the background renders of this view is not rendered twice.
            if engine.is_refining(&wanted.view) {
                let is_there = |engine: &Engine| engine.estimate_of(&wanted).pool().is_some();
                if !is_there(engine) && engine.host.impatient {
                    return Err(Error::NotYet);
                }
                engine.wait_until(is_there)?;
                if is_there(engine) {
                    return Ok(Vec::new());
                }
            }
            let mut refiner = engine.refiner(wanted, Extent::Coarse)?;
            engine.drive(&mut refiner)?;
            Ok(refiner.ways.unwrap_or_default())
        })
    }

    /// A refiner whose choice of a way knows how fast this machine is; the first images of a goal that is
    /// measured are no choice.
    fn refiner(&mut self, wanted: Refinement, extent: Extent) -> Result<Refiner, Error> {
        self.images.find_heads(&self.document, self.host.work())?;
        let estimate = self.estimate_of(&wanted);
        estimate.rendering()?;
        let has_choice = !(extent == Extent::Coarse
            && estimate.pool().is_none()
            && estimate.measures(&wanted.goal));
        if wanted.goal.asks_for_a_way() && !estimate.is_final() && has_choice {
            self.means().calibrate(&wanted)?;
        }
        Ok(Refiner::new(wanted, extent, self.now()))
    }

    /// Takes up the images that others have stored since, and those that earlier sessions stored where
    /// every source has one; renders nothing.
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn take_up(&mut self) -> Result<(), Error> {
        let wanted = self.looked_from();
        let estimate = self.estimate();
        if estimate.of_view.is_none() || self.is_busy() {
            return Ok(());
        }
        if estimate.pool().is_some() {
            self.means().reuse_refined(&wanted)
        } else if estimate.stored_base()?.is_some() {
            self.coarse()
        } else {
            Ok(())
        }
    }

    /// Renders refined images in the order of the plan until the goal is met; a goal with nothing in
    /// it is one image. The coarse images' own estimate of their error is trusted alone only where
    /// it leaves room; else an error counts as reached once two refined images were held against
    /// it.
    ///
    /// The predicted seconds decide whether another image still fits into a time; one is always
    /// rendered.
    ///
    /// A cancel ends it at once. Images that are finished are kept, those in hand are lost. Before the
    /// first refined image it is [`Error::Cancelled`], after it [`Ended::Stopped`]. The host's
    /// progress hears "refined pictures" after each.
    ///
    /// # Errors
    /// [`Error::Busy`] while a refinement runs in the background, [`Error::NoSetup`], else what
    /// rendering says; images finished before it are kept.
    pub fn refine(&mut self, wanted: impl Into<Refinement>) -> Result<RefinementSummary, Error> {
        let wanted = wanted.into();
        self.timed(|engine| {
            engine.idle()?;
            let wanted = engine.seen(wanted)?;
            let mut refiner = engine.refiner(wanted, Extent::Goal)?;
            let ended = engine.drive(&mut refiner)?;
            let mut done = refiner.done;
            done.ended = Some(ended);
            Ok(done)
        })
    }

    /// Runs a refiner's jobs here, one after the other.
    fn drive(&mut self, refiner: &mut Refiner) -> Result<Ended, Error> {
        loop {
            let has_pool = self.estimate_of(&refiner.wanted).pool().is_some();
            let has_done = refiner.done.images > 0 && has_pool;
            if has_done && self.host.progress.cancelled() {
                return Ok(Ended::Stopped);
            }
            match refiner.advance(&mut self.means())? {
                Next::Ended(ended) => return Ok(ended),
                Next::Added => {}
                Next::Measure(job) => {
                    let begin = self.now();
                    let moments = match job.run(self.host.renderer.as_ref(), self.work()) {
                        Err(TransportError::Cancelled(_)) if has_done => {
                            return Ok(Ended::Stopped);
                        }
                        moments => moments?,
                    };
                    let measured = (moments, self.now() - begin);
                    refiner.collect_measured(&mut self.means(), &job, measured)?;
                    continue;
                }
                Next::Render(job, ticket) => {
                    let refined = ticket.refined;
                    let rendered = job.run(self.host.renderer.as_ref(), self.work());
                    match refiner.collect(&mut self.means(), *ticket, rendered) {
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
            self.host.progress.report("refined pictures", done, total);
        }
    }
}
