//! What a refinement works with: the document that it serves, the host's means, and the images,
//! which it alone changes.

use super::Error;
use super::document::Document;
use super::estimate::Estimate;
use super::goal::{Refinement, Step};
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
    /// What is known for a refinement.
    pub fn estimate(&self, refinement: &Refinement) -> Estimate<'_> {
        Estimate::new(self.document, self.host, self.images, refinement)
    }

    /// Seconds of the host's clock.
    pub fn now(&self) -> f64 {
        self.host.clock.seconds()
    }

    /// Measures how fast the operator is here by its own small task, where nothing was rendered yet
    /// that would show it, as the coarse images were stored.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn calibrate(&mut self, refinement: &Refinement) -> Result<(), Error> {
        if !self.images.pace.is_known() {
            let seconds = self.estimate(refinement).measure_pace()?;
            let pace = &mut self.images.pace;
            pace.learn(pace.seconds(), seconds);
        }
        Ok(())
    }

    /// Adds the refined images that earlier edits and sessions left.
    pub fn reuse_refined(&mut self, refinement: &Refinement) -> Result<(), Error> {
        let begin = self.now();
        let least = self.estimate(refinement).least_refined();
        let store = self.host.store.as_ref();
        let (cache, of_view) = self.images.split(&refinement.view)?;
        let reused = of_view.rendering.reusable(cache, least, store);
        self.add_refined(refinement, reused, begin)
    }

    /// Adds images to the pool and records where the sequence stands after each.
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

    /// Records where the sequence stands after an image that was begun at `begin`.
    pub fn record(&mut self, refinement: &Refinement, begin: f64) -> Result<(), Error> {
        let now = self.now();
        let estimate = self.estimate(refinement);
        let [error, forecast] = estimate.error_and_forecast()?;
        let refined = estimate.refined();
        let (_, of_view) = self.images.split(&refinement.view)?;
        let spent = of_view.steps.last().map_or(0.0, |s| s.seconds);
        of_view.steps.push(Step {
            refined,
            seconds: spent + now - begin,
            error,
            forecast,
        });
        Ok(())
    }
}
