//! Forecast of cost and benefit of the next refined images.
//!
//! Seconds are the operator's prediction, scaled by the ratio of time to prediction in the last
//! rendering.

use super::Error;
use super::estimate::Estimate;
use crate::plan::{self, Moment, Weighting};
use crate::pool::{Pool, Stated};
use footlight_show::units::ErrorUnit;
use footlight_transport::{Cost, Transport as _};

/// A candidate for refinement.
pub(super) struct NextImage {
    /// Its setting: one number for each coordinate.
    pub setting: Vec<f64>,
    /// Predicted seconds, once those before it are rendered; none if it is `stored`.
    pub seconds: f64,
    /// True when it exists in memory or in the store, or is a sum of existing images.
    pub stored: bool,
    /// Predicted error of the sequence after it and those before it, relative.
    pub error: f64,
}

/// Forecast of a refinement.
pub(super) struct Forecast {
    /// Quality step of refined images.
    pub quality: u8,
    /// Predicted error of the sequence with the current pool, relative.
    pub error: f64,
    /// The next images, the most useful first; empty when nothing is left to improve.
    pub steps: Vec<NextImage>,
    /// True when errors rest on the operator's statement.
    pub is_stated: bool,
}

/// Remaining settings to refine, each with the error after it.
pub(super) type Ahead = Vec<(Vec<f64>, f64)>;

impl Estimate<'_> {
    /// Forecast of refinement: setting, predicted seconds and predicted remaining error of each
    /// next image, in a unit. Before there are images it follows from the levels and the operator's
    /// stated error; `None` without one.
    pub(super) fn forecast(&self, unit: ErrorUnit) -> Result<Option<Forecast>, Error> {
        let rendering = self.rendering()?;
        let quality = self.refined_step();
        let (error, next) = match self.pool() {
            Some(pool) => (self.predicted_in(unit)?, self.next_images(pool, unit)?),
            None => match self.next_unseen(unit)? {
                Some(next) => next,
                None => return Ok(None),
            },
        };
        let (settings, errors): (Vec<Vec<f64>>, Vec<f64>) = next.into_iter().unzip();
        let is_ready = rendering.is_prepared(quality);
        let mut price = Price::new(self.cost(quality)?, rendering.sources());
        if is_ready {
            price.cost.prepare = 0.0;
        }
        let refined = self.pool().map_or(&[][..], Pool::refined).iter();
        for refined in refined.filter(|r| is_ready && r.quality == quality) {
            price.light(&refined.setting);
        }
        let stored = rendering.at_hand(
            &self.images.cache,
            quality,
            &settings,
            self.host.store.as_ref(),
        );
        let mut steps = Vec::new();
        for ((setting, error), stored) in settings.into_iter().zip(errors).zip(stored) {
            let mut seconds = 0.0;
            if !stored {
                seconds = price.next(&setting) * self.images.pace.seconds();
            }
            steps.push(NextImage {
                setting,
                seconds,
                stored,
                error,
            });
        }
        Ok(Some(Forecast {
            quality: quality.0,
            error,
            steps,
            is_stated: self.pool().is_none_or(Pool::is_known),
        }))
    }

    /// Remaining settings to refine, based on the existing images.
    fn next_images(&self, pool: &Pool, unit: ErrorUnit) -> Result<Ahead, Error> {
        let is_as_fine = pool.is_stated() && self.coarse_steps()[1] >= self.refined_step();
        let fits = self.refined_step() <= self.finest_that_fits();
        if self.is_final() || pool.has_no_estimated_error() || is_as_fine || !fits {
            return Ok(Vec::new());
        }
        let settings = self.directions(pool, unit)?;
        let left = self.errors_left(pool, &settings, unit)?;
        let alone = left.first().copied().unwrap_or(0.0);
        let errors = left.into_iter().skip(2).map(|left| pool.error(left, alone));
        Ok(settings.into_iter().zip(errors).collect())
    }

    /// Settings to refine before there is any image, ordered by levels alone, and the stated error
    /// of the coarse images.
    pub(super) fn next_unseen(&self, unit: ErrorUnit) -> Result<Option<(f64, Ahead)>, Error> {
        let ([_, fine], step) = (self.coarse_pair(), self.refined_step());
        let (Some(coarse), Some(refined)) =
            (self.step_error(fine, unit), self.step_error(step, unit))
        else {
            return Ok(None);
        };
        if fine >= step || step > self.finest_that_fits() {
            return Ok(Some((coarse, Vec::new())));
        }
        let keys = self.document.keys();
        let light = |levels: &[f64]| levels.iter().map(|x| x * x).sum::<f64>().sqrt();
        let moments = Moment::relative(self.settings_of_cues(), light);
        let weighting = Weighting::settings(keys.coordinates()).at(moments.clone());
        let settings = plan::next(keys, &[], &weighting)?;
        let left = plan::worst_left(&moments, &[], &settings, &weighting);
        let stated = Stated::of(coarse, coarse, refined);
        let error = |left: f64| coarse * left.hypot(stated.error_of_refined(left, 1.0));
        let errors = left.into_iter().skip(2).map(error);
        Ok(Some((coarse, settings.into_iter().zip(errors).collect())))
    }

    /// Seconds per unit of the operator's cost on this machine now, from the operator's own small
    /// task.
    pub(super) fn measure_pace(&self) -> Result<f64, Error> {
        let rendering = self.rendering()?;
        let operator = rendering.layered(self.host.renderer.as_ref());
        Ok(operator.cost_scale(&|| self.host.clock.seconds(), self.host.work())?)
    }
}

/// Prices mixtures one after the other, in the operator's units: the first one includes preparing
/// the step, and each the sources first lit by it.
pub(super) struct Price {
    cost: Cost,
    lit: Vec<bool>,
}

impl Price {
    pub fn new(cost: Cost, sources: usize) -> Price {
        Price {
            cost,
            lit: vec![false; sources],
        }
    }

    /// Marks the sources that a setting lights and counts the new ones.
    fn light(&mut self, setting: &[f64]) -> usize {
        let pairs = self.lit.iter_mut().zip(setting);
        let fresh = pairs.filter(|(lit, s)| !**lit && **s != 0.0);
        fresh.map(|(lit, _)| *lit = true).count()
    }

    pub fn next(&mut self, setting: &[f64]) -> f64 {
        let fresh = self.light(setting) as f64;
        let prepare = std::mem::take(&mut self.cost.prepare);
        prepare + fresh * self.cost.per_source + self.cost.per_image
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Goal;
    use crate::ways::Mixtures;

    fn forecast(each: f64) -> Forecast {
        let step = |i: usize| NextImage {
            setting: vec![1.0],
            seconds: each,
            stored: false,
            error: 0.5_f64.powi(i as i32 + 1),
        };
        Forecast {
            quality: 4,
            error: 1.0,
            steps: (0..10).map(step).collect(),
            is_stated: false,
        }
    }

    fn until(error: f64) -> Goal {
        Goal {
            until: Some(error.into()),
            ..Goal::default()
        }
    }

    fn within(seconds: f64) -> Goal {
        Goal {
            budget: Some(seconds),
            ..Goal::default()
        }
    }

    #[test]
    fn an_error_needs_the_images_until_it_is_confirmed() {
        let images = |error, refined| Mixtures::of(&forecast(0.1), &until(error), refined).images;
        assert_eq!(images(0.04, 2), 5);
        // An unconfirmed error costs the images that confirm it.
        assert_eq!(images(0.9, 0), 2);
        let nothing = Forecast {
            steps: Vec::new(),
            ..forecast(0.0)
        };
        assert_eq!(Mixtures::of(&nothing, &until(0.1), 2).images, 0);
    }

    #[test]
    fn a_time_is_kept_by_prediction() {
        let images = |each, left| Mixtures::of(&forecast(each), &within(left), 0).images;
        assert_eq!(
            [images(2.0, 1.0), images(2.0, 2.0), images(2.0, 9.0)],
            [0, 1, 4]
        );
    }
}
