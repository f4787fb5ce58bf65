//! Blocking refinement: the calls that render until a goal is met.

use super::goal::{Ended, Goal, Refinement, RefinementSummary};
use super::refiner::{Next, Refiner};
use super::ways::Extent;
use super::ways::WayForecast;
use super::{Engine, Error};
use footlight_transport::TransportError;

impl Engine {
    /// Renders missing coarse images, and adds refined ones left by this session and earlier ones.
    /// It records the first of [`Estimate::steps`](super::Estimate::steps), and one for each
    /// refined image.
    ///
    /// # Errors
    /// [`Error::NoSetup`], or an error of rendering.
    pub fn coarse(&mut self) -> Result<(), Error> {
        self.coarse_for(Goal::count(0)).map(|_| ())
    }

    /// Like [`Engine::coarse`], for images that serve a refinement: they follow the method for its
    /// goal with the least predicted cost. Returns the methods compared
    /// ([`Estimate::ways`](super::Estimate::ways)).
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn coarse_for(&mut self, wanted: impl Into<Refinement>) -> Result<Vec<WayForecast>, Error> {
        let wanted = self.seen(wanted.into())?;
        // Wait for images of this view that the background is rendering.
        if self.is_refining(&wanted.view) {
            let is_there = |engine: &Engine| engine.estimate_of(&wanted).pool().is_some();
            if !is_there(self) && self.host.impatient {
                return Err(Error::NotYet);
            }
            self.wait_until(is_there)?;
            if is_there(self) {
                return Ok(Vec::new());
            }
        }
        let mut refiner = self.refiner(wanted, Extent::Coarse)?;
        self.drive(&mut refiner)?;
        Ok(refiner.ways.unwrap_or_default())
    }

    /// Creates a refiner that knows this machine's speed for its choice of method; a measured goal
    /// starts without a choice.
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

    /// Adds images that others have stored meanwhile, and those of earlier sessions if every source
    /// has one; renders nothing.
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

    /// Renders refined images in the order of the plan until the goal is met; an empty goal means
    /// one image. The coarse images' own error estimate is trusted alone only with a safety margin;
    /// otherwise an error counts as reached after comparison with two refined images.
    ///
    /// Predicted seconds decide if another image fits into a time; at least one is rendered.
    ///
    /// A cancel ends it at once. Finished images are kept, unfinished ones are lost. Before the
    /// first refined image of this call the result is [`Error::Cancelled`], after it
    /// [`Ended::Stopped`]. The host's progress receives "refined pictures" after each image.
    ///
    /// # Errors
    /// [`Error::Busy`] while a refinement runs in the background, [`Error::NoSetup`], or an error
    /// of rendering; images finished before it are kept.
    pub fn refine(&mut self, wanted: impl Into<Refinement>) -> Result<RefinementSummary, Error> {
        self.idle()?;
        let wanted = self.seen(wanted.into())?;
        let mut refiner = self.refiner(wanted, Extent::Goal)?;
        let ended = self.drive(&mut refiner)?;
        let mut done = refiner.done;
        done.ended = Some(ended);
        Ok(done)
    }

    /// Runs a refiner's jobs one after the other.
    fn drive(&mut self, refiner: &mut Refiner) -> Result<Ended, Error> {
        loop {
            let has_pool = self.estimate_of(&refiner.wanted).pool().is_some();
            let has_done = refiner.done.images > 0 && has_pool;
            match self.work().check() {
                Err(_) if has_done => return Ok(Ended::Stopped),
                not_cancelled => not_cancelled?,
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
