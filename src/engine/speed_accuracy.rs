//! Error against seconds: single sources at each quality step, and the mixtures of the plan.

use super::Error;
use super::estimate::Estimate;
use super::forecast::Price;
use crate::measure::MeasuredMoment;
use footlight_show::units::ErrorUnit;
use footlight_transport::Quality;

/// Error against rendering time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpeedAccuracy {
    /// Single sources, one point for every quality step.
    pub alone: Vec<SpeedPoint>,
    /// Coarse images, then the mixtures of the plan, as ordered by levels alone: predicted.
    pub mixtures: Vec<SpeedPoint>,
}

/// An error and its rendering time from scratch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedPoint {
    /// The quality step.
    pub quality: u8,
    /// Measured if it was rendered, else predicted.
    pub seconds: f64,
    /// Likely error of the worst moment, relative.
    pub error: f64,
    /// 95 % confidence interval of a measured error.
    pub measured: Option<[f64; 2]>,
}

impl Estimate<'_> {
    /// The measured errors of the current images of single sources, the worst first, with the
    /// seconds of measuring; `None` if not measured.
    pub fn measured(&self) -> Option<(&[MeasuredMoment], f64)> {
        let step = self.coarse_steps()[1];
        let of_step = self.of_view?.rendering.measured_at(step, self.document)?;
        Some((&of_step.moments, of_step.seconds))
    }

    /// Error against rendering time; empty when the operator states no errors.
    ///
    /// # Errors
    /// [`Error::NoSetup`]; [`Error::Plan`].
    pub fn speed_accuracy(&self) -> Result<SpeedAccuracy, Error> {
        let rendering = self.rendering()?;
        let (renderer, pace) = (self.host.renderer.as_ref(), self.images.pace.seconds());
        let mut out = SpeedAccuracy::default();
        let seconds_of = |step: Quality| {
            let cost = rendering.cost(renderer, step);
            let taken = rendering.taken.get(&step.0).copied();
            taken.unwrap_or_else(|| cost.alone(rendering.sources() as f64) * pace)
        };
        // Scales the finest measured step that is no finer by the ratio of usual errors.
        let expected = |step: Quality| {
            let own = self.step_error(step, ErrorUnit::Light)?;
            let by = |q: u8| {
                let of = rendering.measured_at(Quality(q), self.document)?;
                Some(own * of.error / self.step_error(Quality(q), ErrorUnit::Light)?)
            };
            Some((1..=step.0).rev().find_map(by).unwrap_or(own))
        };
        for step in (1..=self.finest_that_fits().0).map(Quality) {
            let Some(expected) = expected(step) else {
                return Ok(SpeedAccuracy::default());
            };
            let measured = rendering.measured_at(step, self.document);
            let worst = measured.and_then(|m| m.moments.first());
            out.alone.push(SpeedPoint {
                quality: step.0,
                seconds: seconds_of(step),
                error: expected,
                measured: worst.map(|worst| worst.measured.interval),
            });
        }
        if let Some((coarse, ahead)) = self.next_unseen(ErrorUnit::Light)? {
            let (step, [_, coarse_step]) = (self.refined_step(), self.coarse_pair());
            let mut price = Price::new(rendering.cost(renderer, step), rendering.sources());
            let scale = expected(coarse_step).map_or(1.0, |now| now / coarse);
            let mut point = SpeedPoint {
                quality: step.0,
                seconds: seconds_of(coarse_step),
                error: scale * coarse,
                measured: None,
            };
            for (setting, error) in ahead {
                out.mixtures.push(point);
                point = SpeedPoint {
                    seconds: point.seconds + price.next(&setting) * pace,
                    error: scale * error,
                    ..point
                };
            }
            out.mixtures.push(point);
        }
        Ok(out)
    }
}
