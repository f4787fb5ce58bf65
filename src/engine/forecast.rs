//! What the next refined images cost, and what they bring.
//!
//! Seconds are the operator's own prediction, scaled by how long the last rendering took against its
//! prediction.

use serde::Serialize;

use super::refine::Goal;
use super::{Engine, Error};
use crate::pool::is_within;
use crate::renderer::Transport as _;
use crate::renderer::{Cost, Quality};
use crate::units::ErrorUnit;

/// An image that could be refined next.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextImage {
    /// What is to be rendered: one number for each coordinate.
    pub setting: Vec<f64>,
    /// Predicted seconds, once those before it are rendered; none where it is `stored`.
    pub seconds: f64,
    /// Whether it is at hand, in memory or in the store, or a sum of what is.
    pub stored: bool,
    /// Predicted error of the sequence after it and those before it, relative.
    pub error: f64,
}

/// What refinement has before it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// The step of quality that refined images are rendered at.
    pub quality: u8,
    /// Predicted error of the sequence as the pool stands, relative.
    pub error: f64,
    /// The most useful first; none when nothing is left to improve.
    pub steps: Vec<NextImage>,
    /// Whether errors rest on what the operator states.
    #[serde(skip)]
    pub is_stated: bool,
}

/// Measured against predicted seconds, once something was measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CostScale(Option<f64>);

impl CostScale {
    /// Seconds of what is predicted to take one; one while nothing is known.
    pub fn seconds(self) -> f64 {
        self.0.unwrap_or(1.0)
    }

    /// True once something was measured.
    pub fn is_known(self) -> bool {
        self.0.is_some()
    }

    /// Takes what was predicted, this scale in it, against what it took. Only the last counts: the
    /// machine may have other work now than it had before.
    pub fn learn(&mut self, predicted: f64, measured: f64) {
        let ratio = measured / predicted;
        if ratio.is_finite() && ratio > 0.0 {
            self.0 = Some(self.seconds() * ratio);
        }
    }
}

/// Images that a goal still asks for.
#[derive(Debug, PartialEq)]
pub(super) struct Needed {
    /// How many images it is predicted to need; 0 when nothing is left.
    pub images: usize,
    /// Whether the first of them is predicted to end in time.
    pub fits: bool,
}

/// Counts the images that `goal` still needs of a forecast, with `refined` images there and `left`
/// seconds, if those are limited.
pub(super) fn needed(
    forecast: &Forecast,
    goal: &Goal,
    refined: usize,
    left: Option<f64>,
) -> Needed {
    let steps = &forecast.steps;
    let images = match goal.until {
        None => steps.len(),
        Some(until) => {
            let ahead = steps.iter().zip(refined + 1..);
            let over = ahead.take_while(|(s, refined)| {
                !is_within(until.error, s.error, *refined, forecast.is_stated)
            });
            (over.count() + 1).min(steps.len())
        }
    };
    let first = steps.first().map_or(0.0, |s| s.seconds);
    let fits = left.is_none_or(|left| first <= left);
    Needed { images, fits }
}

impl Engine {
    /// What refinement has before it: for each next image its setting, the seconds that it is
    /// predicted to take and the error that it is predicted to leave.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered ([`Engine::coarse`]).
    pub fn forecast(&self) -> Result<Forecast, Error> {
        self.forecast_by(ErrorUnit::Light)
    }

    /// Like [`Engine::forecast`], with errors in a unit.
    pub(super) fn forecast_by(&self, unit: ErrorUnit) -> Result<Forecast, Error> {
        let quality = self.refined_step();
        let mut out = Forecast {
            quality: quality.0,
            error: self.predicted_in(unit)?,
            steps: Vec::new(),
            is_stated: self.rendered()?.is_known(),
        };
        let pool = self.rendered()?;
        if self.is_final() {
            return Ok(out);
        }
        let is_as_fine = pool.is_stated() && self.coarse_steps()[1] >= quality;
        if pool.has_no_estimated_error() || is_as_fine {
            return Ok(out);
        }
        let next = self.directions(pool, unit)?;
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let cost = self.refined_cost()?;
        let ready = rendering.is_prepared(quality);
        let mut lit = vec![false; rendering.sources()];
        for refined in pool
            .refined()
            .iter()
            .filter(|r| ready && r.quality == quality)
        {
            newly_lit(&mut lit, &refined.setting);
        }
        let settings: Vec<Vec<f64>> = next.iter().map(|d| d.setting.clone()).collect();
        let left = self.errors_left(pool, &settings, unit)?;
        let alone = left.first().copied().unwrap_or(0.0);
        let mut left = left.into_iter().skip(2);
        let store = self.host.store.as_ref();
        let stored = rendering.at_hand(&self.image_cache, quality, &settings, store);
        let mut first = true;
        for (direction, stored) in next.into_iter().zip(stored) {
            let mut seconds = 0.0;
            if !stored {
                let fresh = newly_lit(&mut lit, &direction.setting) as f64;
                let prepare = if first && !ready { cost.prepare } else { 0.0 };
                let fixed = (prepare + fresh * cost.per_source) * self.pace.seconds();
                first = false;
                seconds = fixed + cost.per_image * self.pace.seconds();
            }
            out.steps.push(NextImage {
                setting: direction.setting,
                seconds,
                stored,
                error: pool.error(left.next().unwrap_or(0.0), alone),
            });
        }
        Ok(out)
    }

    /// Measures how fast the operator is here by its own small task, where nothing was rendered yet
    /// that would show it, as the coarse images were stored.
    ///
    /// # Errors
    /// [`Error::NoSetup`], else what rendering says.
    pub fn calibrate_cost(&mut self) -> Result<(), Error> {
        if self.pace.is_known() {
            return Ok(());
        }
        let seconds = self.measure_pace()?;
        self.pace.learn(self.pace.seconds(), seconds);
        Ok(())
    }

    /// Seconds that a unit of the operator's cost takes here now, by the operator's own small task.
    pub(super) fn measure_pace(&self) -> Result<f64, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let operator = rendering.layered(self.host.renderer.as_ref());
        Ok(operator.cost_scale(&|| self.now(), self.host.work())?)
    }

    /// Predicted cost of refined images, in the operator's units.
    pub(crate) fn refined_cost(&self) -> Result<Cost, Error> {
        self.cost(self.refined_step())
    }

    /// Predicted cost at a step of quality, in the operator's units.
    pub(super) fn cost(&self, quality: Quality) -> Result<Cost, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        Ok(rendering.cost(self.host.renderer.as_ref(), quality))
    }
}

/// Marks the sources that a setting lights and counts those that were dark before.
fn newly_lit(lit: &mut [bool], setting: &[f64]) -> usize {
    let pairs = lit.iter_mut().zip(setting);
    let fresh = pairs.filter(|(lit, s)| !**lit && **s != 0.0);
    fresh.map(|(lit, _)| *lit = true).count()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let needed = |until_error, refined| {
            needed(&forecast(0.1), &until(until_error), refined, None).images
        };
        assert_eq!(needed(0.04, 2), 5);
        // An error that is not confirmed takes the images that confirm it.
        assert_eq!(needed(0.9, 0), 2);
        let nothing = Forecast {
            steps: Vec::new(),
            ..forecast(0.0)
        };
        assert_eq!(super::needed(&nothing, &until(0.1), 2, None).images, 0);
    }

    #[test]
    fn a_time_is_kept_by_prediction() {
        let fits = |each, left| needed(&forecast(each), &within(left), 0, Some(left)).fits;
        assert!(!fits(2.0, 1.0));
        assert!(fits(2.0, 2.0));
    }

    #[test]
    fn the_cost_scale_is_that_of_the_last_rendering() {
        let mut scale = CostScale::default();
        scale.learn(1.0, 3.0);
        assert_eq!(scale.seconds(), 3.0);
        scale.learn(3.0, 1.5);
        assert_eq!(scale.seconds(), 1.5);
        // A clock that stands still, a cost that is not known.
        scale.learn(3.0, 0.0);
        scale.learn(0.0, 1.0);
        assert_eq!(scale.seconds(), 1.5);
    }
}
