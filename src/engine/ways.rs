//! Chooses the images for a goal: every bank alone at one quality step, or coarse images with the
//! plan's mixtures. A refinement chooses once. Plan and run use one function.
//!
//! Seconds are the operator's prediction at this machine's speed, for missing images. Errors are
//! stated by the operator or follow from noise, and for mixtures from the plan's remainder. If
//! neither is known, only mixtures can be judged, by the difference of two coarse steps.

use std::cmp::Ordering;

use serde::Serialize;

use super::Error;
use super::estimate::Estimate;
use super::forecast::Forecast;
use super::goal::{Goal, Way};
use super::rendering::each_step;
use crate::pool::{Stated, is_within};
use footlight_show::units::ErrorUnit;
use footlight_transport::Quality;

/// Extent of a refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extent {
    /// Only images of single sources.
    Coarse,
    /// To the goal, one mixture at a time, because knowledge after each is better than prediction.
    Goal,
    /// To the goal, with all mixtures predicted to be needed in one job, for a farm.
    AtOnce,
}

/// A method with its predicted cost and error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WayForecast {
    /// [`Way::Alone`] or [`Way::Paper`].
    pub way: Way,
    /// Quality step of the images that it renders last.
    pub quality: u8,
    /// Number of images of single sources still to render.
    pub alone: usize,
    /// Number of mixtures still to render.
    pub mixed: usize,
    /// Predicted seconds to render them.
    pub seconds: f64,
    /// Predicted error of the worst moment afterwards, in the goal's unit.
    pub error: f64,
    /// True when that is within the goal.
    pub reaches: bool,
}

/// The first images to render for a goal.
pub(super) struct Choice {
    /// Steps of the images of single sources, if they differ from those shown.
    pub base: Option<[Quality; 2]>,
    /// The methods compared; `None` when only the first images can tell errors, or the speed for a
    /// budget.
    pub ways: Option<Vec<WayForecast>>,
}

/// The mixtures of a forecast needed for a goal.
pub(super) struct Mixtures {
    /// Their number, including existing ones.
    pub images: usize,
    /// Number of existing ones.
    pub stored: usize,
    /// Predicted seconds to render the others.
    pub seconds: f64,
    /// Predicted error of the worst moment afterwards.
    pub error: f64,
    /// True when that is within the goal.
    pub reaches: bool,
}

impl Mixtures {
    /// The fewest mixtures that reach the goal, or as many as its time and number allow, given
    /// `refined` existing images.
    pub fn of(forecast: &Forecast, goal: &Goal, refined: usize) -> Mixtures {
        let within = |error, images: usize| {
            goal.until.is_some_and(|until| {
                is_within(until.error, error, refined + images, forecast.is_stated)
            })
        };
        let mut out = Mixtures {
            images: 0,
            stored: 0,
            seconds: 0.0,
            error: forecast.error,
            reaches: within(forecast.error, 0),
        };
        for step in &forecast.steps {
            let seconds = out.seconds + step.seconds;
            let is_over = goal.budget.is_some_and(|budget| seconds > budget);
            let is_counted = goal.count.is_some_and(|count| out.images >= count);
            if out.reaches || is_over || is_counted {
                break;
            }
            out.images += 1;
            out.stored += usize::from(step.stored);
            (out.seconds, out.error) = (seconds, step.error);
            out.reaches = within(step.error, out.images);
        }
        out
    }
}

impl Estimate<'_> {
    /// The methods for a goal from the existing images, the chosen one first; empty when they
    /// cannot be compared before there are coarse images, or nothing is left to render.
    ///
    /// # Errors
    /// [`Error::NoSetup`]; [`Error::Plan`].
    pub fn ways(&self, goal: &Goal) -> Result<Vec<WayForecast>, Error> {
        let mut ways = Vec::new();
        if self.is_final() {
            return Ok(ways);
        }
        if self.way != Way::Paper {
            ways = self.alone_ways(goal)?;
        }
        if self.way != Way::Alone || ways.is_empty() {
            // Without a mixture it may equal one of the others.
            let is_new = |mixed: &WayForecast| {
                let same = |w: &WayForecast| (w.seconds, w.error) == (mixed.seconds, mixed.error);
                !ways.iter().any(same)
            };
            let mixed = self.mixed_way(goal)?.filter(is_new);
            ways.extend(mixed);
        }
        ways.sort_by(|a, b| compare(a, b, goal.budget));
        Ok(ways)
    }

    /// Chooses the steps of the images of single sources for a goal.
    pub(super) fn choose(&self, goal: &Goal, extent: Extent) -> Result<Choice, Error> {
        let mut choice = Choice {
            base: None,
            ways: Some(Vec::new()),
        };
        let is_first = self.pool().is_none();
        if self.is_final() || !is_first && !goal.asks_for_a_way() {
            return Ok(choice);
        }
        let [_, fine] = self.coarse_pair();
        let is_stated = self.step_error(fine, goal.unit()).is_some();
        let is_named = self.way == Way::Alone;
        // The error of the first images will be measured; a farm uses the usual one.
        let is_usual = is_stated && (!self.measures(goal) || extent == Extent::AtOnce);
        let is_told = is_usual || !is_stated && is_named && self.samples(fine).is_none();
        let is_known = is_told && (goal.budget.is_none() || self.images.pace.is_known());
        if !goal.asks_for_a_way() {
            let refined = is_named.then(|| self.base_of(self.refined_step()));
            choice.base = self.stored_base()?.or(refined);
        } else if is_first && !is_known {
            choice.base = self.stored_base()?;
            choice.ways = None;
        } else {
            let found = self.ways(goal)?;
            let now = self.coarse_steps()[1].0;
            match found.first() {
                Some(way) if way.way == Way::Alone && (is_first || way.quality > now) => {
                    choice.base = Some(self.base_of(Quality(way.quality)));
                }
                Some(way) if way.way == Way::Paper && is_first => {
                    choice.base = self.stored_base()?;
                }
                _ => {}
            }
            choice.ways = Some(found);
        }
        Ok(choice)
    }

    /// Single sources, at the step of the existing images and at each finer one.
    fn alone_ways(&self, goal: &Goal) -> Result<Vec<WayForecast>, Error> {
        let now = self.pool().map_or(0, |_| self.coarse_steps()[1].0);
        let mut out = Vec::new();
        for quality in now.max(1)..=self.finest_that_fits().0 {
            let step = Quality(quality);
            let Some(stated) = self.error_alone(step, goal.unit()) else {
                continue;
            };
            let (error, (alone, seconds)) = if quality == now {
                (self.predicted_in(goal.unit())?, (0, 0.0))
            } else {
                (stated, self.missing_of(self.base_of(step))?)
            };
            let reaches = goal.until.is_some_and(|until| {
                if quality == now {
                    self.is_reached(until, error)
                } else {
                    error <= until.error
                }
            });
            out.push(WayForecast {
                way: Way::Alone,
                quality,
                alone,
                mixed: 0,
                seconds,
                error,
                reaches,
            });
        }
        Ok(out)
    }

    /// Mixtures on top of the existing images, or of the coarse ones; `None` when nothing is known
    /// about these.
    fn mixed_way(&self, goal: &Goal) -> Result<Option<WayForecast>, Error> {
        let Some(forecast) = self.forecast(goal.unit())? else {
            return Ok(None);
        };
        let (alone, begin) = match self.pool() {
            Some(_) => (0, 0.0),
            None => self.missing_of(self.coarse_pair())?,
        };
        let left = Goal {
            budget: goal.budget.map(|budget| budget - begin),
            ..*goal
        };
        let mixtures = Mixtures::of(&forecast, &left, self.refined());
        let coarse = self.coarse_pair()[1].0;
        let is_coarse = self.pool().is_none() && mixtures.images == 0;
        Ok(Some(WayForecast {
            way: Way::Paper,
            quality: if is_coarse { coarse } else { forecast.quality },
            alone,
            mixed: mixtures.images - mixtures.stored,
            seconds: begin + mixtures.seconds,
            error: mixtures.error,
            reaches: mixtures.reaches,
        }))
    }

    /// The error of single sources at a step. When the operator states none and has no noise to
    /// estimate it, refined images count as exact if this method is requested or chosen.
    fn error_alone(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let base = self.rendering().ok().and_then(|r| r.base);
        let is_taken = self.way == Way::Alone || base == Some([quality; 2]);
        let is_truth = is_taken && quality == self.refined_step();
        self.step_error(quality, unit)
            .or_else(|| self.noise_alone(quality, unit))
            .or((is_truth && self.samples(quality).is_none()).then_some(0.0))
    }

    /// The error of single sources at a step, from the noise of the existing images.
    fn noise_alone(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let pool = self.pool().filter(|pool| pool.is_known())?;
        let [_, now] = self.coarse_steps();
        let fewer = self.samples(now)? / self.samples(quality)?;
        let alone = *self.errors_left(pool, &[], unit).ok()?.first()?;
        Some(pool.planned_error(alone, alone) * fewer.sqrt())
    }

    /// The steps at which single sources are rendered to show one step. Noise is estimated from a
    /// second image; averaging both repays its cost.
    fn base_of(&self, quality: Quality) -> [Quality; 2] {
        match self.samples(quality) {
            Some(_) => [Quality((quality.0 - 1).max(1)), quality],
            None => [quality; 2],
        }
    }

    /// Number of missing images of single sources at one or two steps, and the predicted seconds to
    /// render them.
    fn missing_of(&self, base: [Quality; 2]) -> Result<(usize, f64), Error> {
        let rendering = self.rendering()?;
        let units = rendering.units();
        let (mut images, mut cost) = (0, 0.0);
        for quality in each_step(base) {
            let at_hand = rendering.at_hand(
                &self.images.cache,
                quality,
                &units,
                self.host.store.as_ref(),
            );
            let missing = at_hand.iter().filter(|there| !**there).count();
            if missing > 0 {
                images += missing;
                cost += rendering.cost_of_units(self.host.renderer.as_ref(), quality, missing);
            }
        }
        Ok((images, cost * self.images.pace.seconds()))
    }

    /// The finest steps at which every source has an image, if they are no coarser than the show's
    /// setting. When only the difference of these two tells errors, no others can serve.
    pub(super) fn stored_base(&self) -> Result<Option<[Quality; 2]>, Error> {
        let pair = self.coarse_pair();
        let [_, fine] = pair;
        let is_known =
            self.samples(fine).is_some() || self.step_error(fine, ErrorUnit::Light).is_some();
        let last = if is_known { self.finest() } else { fine };
        for quality in (fine.0..=last.0).rev().map(Quality) {
            let base = if is_known {
                self.base_of(quality)
            } else {
                pair
            };
            if self.missing_of(base)?.0 == 0 {
                return Ok(Some(base));
            }
        }
        Ok(None)
    }

    /// The operator's statement about a new pool's errors. Two steps of coarse images estimate
    /// their own error by their difference.
    pub(super) fn stated_of_pool(&self) -> Option<Stated> {
        let [cheap, fine] = self.coarse_steps();
        let samples = [cheap, fine, self.refined_step()].map(|step| self.samples(step));
        if let ([Some(less), Some(more), Some(refined)], true) = (samples, cheap < fine) {
            let sources = self.rendering().map_or(0, |r| r.sources());
            return Some(Stated::noise([less, more, refined], sources));
        }
        let coarse = self.error_alone(fine, ErrorUnit::Light)?;
        let refined = self.step_error(self.refined_step(), ErrorUnit::Light);
        let calibration = if cheap < fine { 1.0 } else { coarse };
        Some(Stated::of(calibration, coarse, refined.unwrap_or(0.0)))
    }
}

/// Orders methods, the better one first: by fitting into the time, then reaching the error quickly,
/// then coming nearest to it.
fn compare(a: &WayForecast, b: &WayForecast, budget: Option<f64>) -> Ordering {
    let late = |w: &WayForecast| budget.is_some_and(|budget| w.seconds > budget);
    let first = (late(a), !a.reaches).cmp(&(late(b), !b.reaches));
    let quick = a.seconds.total_cmp(&b.seconds);
    let exact = a.error.total_cmp(&b.error);
    first.then(if late(a) || a.reaches {
        quick.then(exact)
    } else {
        exact.then(quick)
    })
}
