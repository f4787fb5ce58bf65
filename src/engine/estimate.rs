//! Estimates about the images of a view, without rendering: the basis for plan and choice
//! of method.

use super::Error;
use super::document::Document;
use super::goal::{Goal, Refinement, SequenceState, TooLarge, Way};
use super::host::Host;
use super::images::{Images, ViewImages};
use super::rendering::{MeasuredShow, SetupImages};
use crate::pool::Pool;
use footlight_show::units::ErrorUnit;
use footlight_transport::{Cost, Quality, Transport as _};

/// Steps of 255 for an error of all light: the median of the shipped shows.
pub(super) const OF_ALL_LIGHT: f64 = 500.0;

/// Largest multiple of the usual effort of a measurement.
const MOST_EFFORT: usize = 256;

/// Estimates about a document and its images, for one view. All answers are pure functions.
#[derive(Clone, Copy)]
pub struct Estimate<'e> {
    pub(super) document: &'e Document,
    pub(super) host: &'e Host,
    pub(super) images: &'e Images,
    /// `None` when the view is not usable.
    pub(super) of_view: Option<&'e ViewImages>,
    /// The method for choosing images.
    pub(super) way: Way,
}

impl<'e> Estimate<'e> {
    /// Estimates for a refinement, with its own view and method.
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

    /// Coarse and refined images, if there are any.
    pub fn pool(&self) -> Option<&'e Pool> {
        self.known_rendering().and_then(|r| r.pool.as_ref())
    }

    /// The pool, if it was rendered.
    pub(super) fn rendered(&self) -> Result<&'e Pool, Error> {
        self.rendering()?.pool.as_ref().ok_or(Error::NotRendered)
    }

    /// True when the pool must be made, of other images than it has.
    pub(super) fn is_pool_due(&self) -> bool {
        let base = self.coarse_steps();
        let rendering = self.known_rendering();
        rendering.is_some_and(|r| r.pool.is_none() || r.pool_base != Some(base))
    }

    /// Number of refined images that the show can use.
    pub fn refined(&self) -> usize {
        let least = self.least_refined();
        self.known_rendering()
            .map_or(0, |r| r.refined(&self.images.cache, least))
    }

    /// The sequence after each refined image, coarse images alone first.
    pub fn steps(&self) -> &'e [SequenceState] {
        self.of_view.map_or(&[], |of_view| &of_view.steps)
    }

    /// The two quality steps for rendering sources alone, ascending; equal when one step is enough.
    /// The images of the second are the coarse images; their difference from the first estimates
    /// the error. These are the show's steps unless another one was cheaper.
    pub fn coarse_steps(&self) -> [Quality; 2] {
        let chosen = self.known_rendering().and_then(|r| r.base);
        chosen.unwrap_or_else(|| self.coarse_pair())
    }

    /// The coarse step of the show's settings, clamped to the scale, and the next finer one if
    /// errors can only be estimated from the difference of two steps: the operator states none, or
    /// its images have noise.
    pub(super) fn coarse_pair(&self) -> [Quality; 2] {
        let finest = self.finest().0;
        let cheap = self.document.show().preview.coarse.clamp(1, finest);
        let is_stated = self.step_error(Quality(cheap), ErrorUnit::Light).is_some();
        let is_pair = !is_stated || self.samples(Quality(cheap)).is_some();
        [cheap, cheap.saturating_add(u8::from(is_pair)).min(finest)].map(Quality)
    }

    /// The finest step of the operator's scale for these lights.
    pub fn finest(&self) -> Quality {
        let renderer = self.host.renderer.as_ref();
        self.known_rendering()
            .map_or_else(|| renderer.finest(), |r| r.finest(renderer))
    }

    /// The coarsest step known to exceed the memory, if any.
    pub(super) fn too_large(&self) -> Option<TooLarge> {
        self.known_rendering()?.too_large
    }

    /// The finest step not known to exceed the memory.
    pub(super) fn finest_that_fits(&self) -> Quality {
        let below = |large: TooLarge| Quality(large.quality.0 - 1);
        self.too_large()
            .map_or(self.finest(), |large| below(large).min(self.finest()))
    }

    /// The quality step of refined images: the show's, or a finer one when errors are estimated
    /// from the difference of two coarse steps. An image at one of these two would not tell their
    /// error.
    pub fn refined_step(&self) -> Quality {
        let [cheap, fine] = self.coarse_pair();
        let least = fine.0.saturating_add(u8::from(cheap < fine));
        Quality(
            self.document
                .show()
                .preview
                .refined
                .max(least)
                .min(self.finest().0),
        )
    }

    /// The least quality step of a usable refined image.
    pub(super) fn least_refined(&self) -> Quality {
        self.refined_step().max(self.coarse_steps()[1])
    }

    /// True when coarse images are final because the scale has one step, for example when every
    /// bank is an image.
    pub fn is_final(&self) -> bool {
        self.of_view.is_some() && self.finest() == Quality(1)
    }

    /// The error of images of a step, measured or typical; `None` if the operator gives none.
    pub(super) fn step_error(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let renderer = self.host.renderer.as_ref();
        let of_light = self.known_rendering()?.step_error(renderer, quality)?;
        Some(match unit {
            ErrorUnit::Light => of_light,
            ErrorUnit::Steps => of_light * OF_ALL_LIGHT,
        })
    }

    /// True when a goal may need more images than the existing ones of single sources.
    pub fn may_refine(&self, goal: &Goal) -> bool {
        !self.is_final() && (self.is_measuring_due(goal) || !goal.asks_for_a_way())
    }

    /// True when images are measured on the way to a goal, the coarse ones first.
    pub fn measures(&self, goal: &Goal) -> bool {
        let renderer = self.host.renderer.as_ref();
        let known = self.known_rendering();
        goal.asks_for_a_way()
            && goal.until.is_some()
            && known.is_some_and(|r| renderer.is_measurable(&r.setup))
    }

    /// True when images of single sources exist whose error is not measured yet, or so uncertain
    /// that another measurement is worth its time.
    pub(super) fn is_measuring_due(&self, goal: &Goal) -> bool {
        let (known, step) = (self.known_rendering(), self.coarse_steps()[1]);
        let is_due = |rendering: &SetupImages| {
            let measured = rendering.measured_at(step, self.document);
            measured.is_none_or(|m| self.is_worth_more(rendering, m, goal))
        };
        self.measures(goal) && !self.is_pool_due() && known.is_some_and(is_due)
    }

    /// True when four times the effort may decide if the error is within a goal, for less than a
    /// quarter of the time of the alternative, or a fifth of the time of these images.
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

    /// Samples per pixel at a step of an operator with noise.
    pub(super) fn samples(&self, quality: Quality) -> Option<f64> {
        let renderer = self.host.renderer.as_ref();
        self.known_rendering()?.layered(renderer).samples(quality)
    }

    /// Predicted cost at a step of quality, in the operator's units.
    pub(super) fn cost(&self, quality: Quality) -> Result<Cost, Error> {
        Ok(self.rendering()?.cost(self.host.renderer.as_ref(), quality))
    }
}
