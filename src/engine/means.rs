//! The parts of an engine used by refinement: the document, the host, and the images, which only
//! refinement changes.

use super::Error;
use super::document::Document;
use super::estimate::Estimate;
use super::goal::{Refinement, SequenceState};
use super::host::Host;
use super::images::Images;
use super::rendering::Reused;

/// The parts of an engine that refinement needs.
pub(super) struct Means<'m> {
    pub document: &'m Document,
    pub host: &'m Host,
    pub images: &'m mut Images,
}

impl Means<'_> {
    /// Estimates for a refinement.
    pub fn estimate(&self, refinement: &Refinement) -> Estimate<'_> {
        Estimate::new(self.document, self.host, self.images, refinement)
    }

    /// Seconds of the host's clock.
    pub fn now(&self) -> f64 {
        self.host.clock.seconds()
    }

    /// Measures the operator's speed by its own small task, unless a rendering has shown it (stored
    /// coarse images do not).
    ///
    /// # Errors
    /// [`Error::NoSetup`], or an error of rendering.
    pub fn calibrate(&mut self, refinement: &Refinement) -> Result<(), Error> {
        if !self.images.pace.is_known() {
            let seconds = self.estimate(refinement).measure_pace()?;
            let pace = &mut self.images.pace;
            pace.learn(pace.seconds(), seconds);
        }
        Ok(())
    }

    /// Adds refined images of earlier edits and sessions.
    pub fn reuse_refined(&mut self, refinement: &Refinement) -> Result<(), Error> {
        let begin = self.now();
        let least = self.estimate(refinement).least_refined();
        let store = self.host.store.as_ref();
        let (cache, of_view) = self.images.split(&refinement.view)?;
        let reused = of_view.rendering.reusable(cache, least, store);
        self.add_refined(refinement, reused, begin)
    }

    /// Adds images to the pool and records the state of the sequence after each.
    pub fn add_refined(
        &mut self,
        refinement: &Refinement,
        images: Vec<Reused>,
        begin: f64,
    ) -> Result<(), Error> {
        let mut begin = begin;
        for image in images {
            let work = self.host.work();
            let rendering = self.images.rendering(&refinement.view)?;
            let pool = rendering.pool.as_mut().ok_or(Error::NotRendered)?;
            pool.add(image.setting, image.image, image.quality, work);
            let now = self.now();
            self.record(refinement, begin)?;
            begin = now;
        }
        Ok(())
    }

    /// Records the state of the sequence after an image begun at `begin`.
    pub fn record(&mut self, refinement: &Refinement, begin: f64) -> Result<(), Error> {
        let now = self.now();
        let estimate = self.estimate(refinement);
        let [error, forecast] = estimate.error_and_forecast()?;
        let refined = estimate.refined();
        let (_, of_view) = self.images.split(&refinement.view)?;
        let spent = of_view.steps.last().map_or(0.0, |s| s.seconds);
        of_view.steps.push(SequenceState {
            refined,
            seconds: spent + now - begin,
            error,
            forecast,
        });
        Ok(())
    }
}
