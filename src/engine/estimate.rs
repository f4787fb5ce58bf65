//! What is known of the images from one view, without rendering: the ground of plan, forecast and
//! the choice of a way.

use super::Error;
use super::displayed::OF_ALL_LIGHT;
use super::document::Document;
use super::goal::{Goal, Refinement, Step, TooLarge, Way};
use super::host::Host;
use super::images::{Images, ViewImages};
use super::rendering::{MeasuredShow, SetupImages};
use crate::pool::Pool;
use footlight_show::units::ErrorUnit;
use footlight_transport::{Cost, Quality, Transport as _};

/// Times the usual effort of a measurement, at most.
const MOST_EFFORT: usize = 256;

/// A document and its images as they stand, looked at from one view. Its answers are functions of
/// these and change nothing.
#[derive(Clone, Copy)]
pub struct Estimate<'e> {
    pub(super) document: &'e Document,
    pub(super) host: &'e Host,
    pub(super) images: &'e Images,
    /// `None` where the view cannot be looked from.
    pub(super) of_view: Option<&'e ViewImages>,
    /// How images are chosen.
    pub(super) way: Way,
}

impl<'e> Estimate<'e> {
    /// For a refinement, from its own view and by its own way.
    pub(super) fn new(
        document: &'e Document,
        host: &'e Host,
        images: &'e Images,
        refinement: &Refinement,
    ) -> Estimate<'e> {
        Estimate {
            document,
            host,
            images,
            of_view: images.of(&refinement.view),
            way: refinement.way,
        }
    }

    /// Operators and pool.
    ///
    /// # Errors
    /// [`Error::NoSetup`].
    pub(super) fn rendering(&self) -> Result<&'e SetupImages, Error> {
        self.known_rendering().ok_or(Error::NoSetup)
    }

    fn known_rendering(&self) -> Option<&'e SetupImages> {
        self.of_view.map(|of_view| &of_view.rendering)
    }

    /// Coarse and refined images, once there are any.
    pub fn pool(&self) -> Option<&'e Pool> {
        self.known_rendering().and_then(|r| r.pool.as_ref())
    }

    /// The pool, which must have been rendered.
    pub(super) fn rendered(&self) -> Result<&'e Pool, Error> {
        self.rendering()?.pool.as_ref().ok_or(Error::NotRendered)
    }

    /// True where the pool is yet to be made, of other images than it has.
    pub(super) fn is_pool_due(&self) -> bool {
        let base = self.coarse_steps();
        let rendering = self.known_rendering();
        rendering.is_some_and(|r| r.pool.is_none() || r.pool_base != Some(base))
    }

    /// Number of refined images that serve the show.
    pub fn refined(&self) -> usize {
        let least = self.least_refined();
        self.known_rendering()
            .map_or(0, |r| r.refined(&self.images.cache, least))
    }

    /// The sequence after each refined image, coarse images alone first.
    pub fn steps(&self) -> &'e [Step] {
        self.of_view.map_or(&[], |of_view| &of_view.steps)
    }

    /// The two steps of quality at which sources are rendered alone, ascending; equal where one step
    /// is enough. Images of the second serve as coarse ones; their difference from the first
    /// estimates the error. What the show asks for unless another step was the cheaper way.
    pub fn coarse_steps(&self) -> [Quality; 2] {
        let chosen = self.known_rendering().and_then(|r| r.base);
        chosen.unwrap_or_else(|| self.coarse_pair())
    }

    /// The two steps of quality that the show asks for.
    pub(super) fn coarse_pair(&self) -> [Quality; 2] {
        self.coarse_pair_at(self.document.show().preview.coarse)
    }

    /// The step `coarse`, clamped to the scale, and the next finer one where only the difference of two
    /// shows their error: the operator states none, or its images have noise.
    pub(super) fn coarse_pair_at(&self, coarse: u8) -> [Quality; 2] {
        let finest = self.finest().0;
        let cheap = coarse.clamp(1, finest);
        let is_stated = self.step_error(Quality(cheap), ErrorUnit::Light).is_some();
        let is_pair = !is_stated || self.samples(Quality(cheap)).is_some();
        [cheap, cheap.saturating_add(u8::from(is_pair)).min(finest)].map(Quality)
    }

    /// The finest step of the scale that the show's lights are rendered on.
    pub fn finest(&self) -> Quality {
        let renderer = self.host.renderer.as_ref();
        self.known_rendering()
            .map_or_else(|| renderer.finest(), |r| r.finest(renderer))
    }

    /// The coarsest step known not to fit into the memory, if there is one.
    pub(super) fn too_large(&self) -> Option<TooLarge> {
        self.known_rendering()?.too_large
    }

    /// The finest step that is not known to need more memory than there is.
    pub(super) fn finest_that_fits(&self) -> Quality {
        let below = |large: TooLarge| Quality(large.quality.0 - 1);
        self.too_large()
            .map_or(self.finest(), |large| below(large).min(self.finest()))
    }

    /// The step of quality of refined images: what the show asks for, or a finer one where the
    /// difference of two coarse steps estimates errors. An image at one of these two would say nothing
    /// of their error.
    pub fn refined_step(&self) -> Quality {
        let preview = &self.document.show().preview;
        self.refined_step_at(preview.coarse, preview.refined)
    }

    pub(super) fn refined_step_at(&self, coarse: u8, refined: u8) -> Quality {
        let [cheap, fine] = self.coarse_pair_at(coarse);
        let least = fine.0.saturating_add(u8::from(cheap < fine));
        Quality(refined.max(least).min(self.finest().0))
    }

    /// The least step of quality of refined images that serve.
    pub(super) fn least_refined(&self) -> Quality {
        self.refined_step().max(self.coarse_steps()[1])
    }

    /// True when the first images are as good as any: the scale has one step, so that nothing is
    /// left to refine. So it is where every bank is an image.
    pub fn is_final(&self) -> bool {
        self.of_view.is_some() && self.finest() == Quality(1)
    }

    /// The error of images of a step, as measured or as they usually are; `None` where the operator
    /// knows nothing of it.
    pub(super) fn step_error(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let renderer = self.host.renderer.as_ref();
        let of_light = self.known_rendering()?.step_error(renderer, quality)?;
        Some(match unit {
            ErrorUnit::Light => of_light,
            ErrorUnit::Steps => of_light * OF_ALL_LIGHT,
        })
    }

    /// True where more may be rendered for a goal than the images of sources alone that are there.
    pub fn may_refine(&self, goal: &Goal) -> bool {
        !self.is_final() && (self.is_measuring_due(goal) || !goal.asks_for_a_way())
    }

    /// True where images are measured on the way to a goal, the coarse ones first.
    pub fn measures(&self, goal: &Goal) -> bool {
        let renderer = self.host.renderer.as_ref();
        let known = self.known_rendering();
        goal.asks_for_a_way()
            && goal.until.is_some()
            && known.is_some_and(|r| renderer.is_measurable(&r.setup))
    }

    /// True where the images of sources alone are there, and what they are off by is yet to be measured, or
    /// so uncertain that another measurement is worth its time.
    pub(super) fn is_measuring_due(&self, goal: &Goal) -> bool {
        let (known, step) = (self.known_rendering(), self.coarse_steps()[1]);
        let is_due = |rendering: &SetupImages| {
            let measured = rendering.measured_at(step, self.document);
            measured.is_none_or(|m| self.is_worth_more(rendering, m, goal))
        };
        self.measures(goal) && !self.is_pool_due() && known.is_some_and(is_due)
    }

    /// True where four times the effort may decide if an error is within a goal, in a quarter of the time
    /// that the way takes that is taken otherwise, or a fifth of what these images took.
    fn is_worth_more(&self, rendering: &SetupImages, of: &MeasuredShow, goal: &Goal) -> bool {
        let until = goal.until.filter(|until| until.unit == ErrorUnit::Light);
        let (Some(until), Some(doubtful)) = (until, of.doubtful()) else {
            return false;
        };
        let [least, most] = doubtful.measured.interval;
        let next = self
            .ways(goal)
            .ok()
            .and_then(|ways| ways.first().map(|w| w.seconds));
        let taken = rendering.taken.get(&of.quality.0).copied().unwrap_or(0.0);
        let worth = (0.25 * next.unwrap_or(0.0)).max(0.2 * taken);
        let is_in_doubt = least < until.error && until.error < most;
        is_in_doubt && of.effort < MOST_EFFORT && 2.0 * of.seconds < worth
    }

    /// Samples a pixel at a step of an operator with noise.
    pub(super) fn samples(&self, quality: Quality) -> Option<f64> {
        let renderer = self.host.renderer.as_ref();
        self.known_rendering()?.layered(renderer).samples(quality)
    }

    /// Predicted cost at a step of quality, in the operator's units.
    pub(super) fn cost(&self, quality: Quality) -> Result<Cost, Error> {
        Ok(self.rendering()?.cost(self.host.renderer.as_ref(), quality))
    }
}
