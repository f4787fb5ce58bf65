//! The plan of a show, and the order of refinement.

use super::Error;
use super::estimate::{Estimate, OF_ALL_LIGHT};
use crate::plan::{self, LeftOut, Moment, Plan, PlanReport, Predicted, Weighting};
use crate::pool::{Pool, is_within};
use footlight_show::units::{ErrorUnit, Time, Tolerance};

impl Estimate<'_> {
    /// The plan of the show: key settings, basis, predicted error. Errors are based on the existing
    /// images; without images the basis follows from the levels alone.
    ///
    /// # Errors
    /// [`Error::Plan`] when a decomposition fails.
    pub fn plan(&self, tolerance: Tolerance) -> Result<PlanReport, Error> {
        let keys = self.document.keys();
        let Tolerance { error, unit } = tolerance;
        let weighting = match self.pool() {
            Some(pool) => self.weighting(pool, unit)?,
            None => Weighting::settings(keys.coordinates()),
        };
        let work = self.host.work();
        work.check()?;
        let of_all_light = match unit {
            ErrorUnit::Light => 1.0,
            ErrorUnit::Steps => OF_ALL_LIGHT,
        };
        let mut plan = Plan::new(keys, &weighting, error / of_all_light)?;
        plan.tolerance = error;
        plan.predicted.iter_mut().for_each(|e| *e *= of_all_light);
        work.check()?;
        if let Some(pool) = self.pool() {
            self.predict_errors(&mut plan, pool, unit)?;
        }
        let report = PlanReport {
            unit,
            ..plan.report(self.document.show(), keys)
        };
        Ok(if self.is_final() {
            nothing_to_refine(report)
        } else {
            report
        })
    }

    /// Weights for the order of refinement.
    fn weighting(&self, pool: &Pool, unit: ErrorUnit) -> Result<Weighting, Error> {
        Ok(pool.weighting().clone().at(self.moments(pool, unit)?))
    }

    /// Remaining settings to refine, the most useful first.
    pub(super) fn directions(&self, pool: &Pool, unit: ErrorUnit) -> Result<Vec<Vec<f64>>, Error> {
        let keys = self.document.keys();
        let weighting = self.weighting(pool, unit)?;
        Ok(plan::next(keys, &pool.settings(), &weighting)?)
    }

    /// Estimated errors of the worst moment before calibration: with coarse images alone, with the
    /// current pool, and with each of `directions` added.
    pub(super) fn errors_left(
        &self,
        pool: &Pool,
        directions: &[Vec<f64>],
        unit: ErrorUnit,
    ) -> Result<Vec<f64>, Error> {
        let (moments, known) = (self.moments(pool, unit)?, pool.settings());
        let weighting = pool.weighting();
        Ok(plan::worst_left(&moments, &known, directions, weighting))
    }

    /// The moments whose errors count.
    pub(super) fn moments(&self, pool: &Pool, unit: ErrorUnit) -> Result<Vec<Moment>, Error> {
        let light = |setting: &[f64]| pool.light(setting);
        let mut moments = Moment::relative(self.settings_of_cues(), light);
        if unit == ErrorUnit::Steps {
            self.displayed(pool, &mut moments)?;
        }
        Ok(moments)
    }

    /// Settings of the moments whose errors count.
    pub fn settings_of_cues(&self) -> Vec<Vec<f64>> {
        let timeline = self.document.timeline();
        let times = self.moments_of_cues().into_iter();
        times.map(|(_, time)| timeline.evaluate(time)).collect()
    }

    /// Moments of every cue's fade, with the cue; with very many cues only the ends.
    pub(super) fn moments_of_cues(&self) -> Vec<(usize, Time)> {
        let cues = self.document.timeline().cues();
        let mut out = Vec::with_capacity(PARTS.len() * cues.len());
        for (cue, fade) in cues.iter().enumerate() {
            let parts = PARTS
                .iter()
                .filter(|p| **p == 1.0 || cues.len() <= MANY_CUES);
            out.extend(
                parts.map(|part| (cue, fade.go + (fade.completion - fade.go).scaled(*part))),
            );
        }
        out
    }

    /// Replaces a plan's estimates by the errors predicted from coarse images, without refined
    /// ones, and recomputes the number of settings for the tolerance.
    fn predict_errors(&self, plan: &mut Plan, pool: &Pool, unit: ErrorUnit) -> Result<(), Error> {
        let moments = self.moments(pool, unit)?;
        let left = plan::worst_left(&moments, &[], &plan.basis, pool.weighting());
        let alone = left.first().copied().unwrap_or(0.0);
        let errors = left
            .iter()
            .skip(1)
            .map(|left| pool.planned_error(*left, alone));
        plan.predicted = errors.collect();
        let within = |(count, error): (usize, &f64)| {
            plan.tolerance > 0.0 && is_within(plan.tolerance, *error, count, pool.is_known())
        };
        let mut counted = plan.predicted.iter().enumerate();
        plan.used = counted.position(within).unwrap_or(plan.basis.len());
        Ok(())
    }
}

/// Counted moments of each fade, as shares of its time.
const PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Number of cues from which only their ends count: the cost of a moment is quadratic in banks.
const MANY_CUES: usize = 500;

/// The plan when coarse images are final: the basis still describes the sequence, but no image of
/// it is worth rendering.
fn nothing_to_refine(mut plan: PlanReport) -> PlanReport {
    plan.used = 0;
    plan.predicted = vec![Predicted {
        refined: 0,
        error: 0.0,
    }];
    plan.left_out.push(LeftOut::OneQuality);
    plan
}
