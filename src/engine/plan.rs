//! The plan of a show, and the order in which images are refined.

use super::displayed::OF_ALL_LIGHT;
use super::{Engine, Error};
use crate::plan::{
    self, Direction, LeftOut, Metric, Moment, Plan, PlanReport, Predicted, Weighting,
};
use crate::pool::{Pool, is_within};
use crate::timeline::{KeyOptions, KeySequence};
use crate::units::{ErrorUnit, Time, Tolerance};

/// What a plan is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// What is measured; all but settings render coarse images first.
    pub metric: Metric,
    /// The error of the worst moment that is aimed for.
    pub tolerance: Tolerance,
    /// Allow negative keys, which float playback can show, and spare the knots.
    pub signed_keys: bool,
}

impl Engine {
    /// The plan of the show alone: key settings, basis, predicted error; no pool in it. The metrics
    /// `influence` and `error` render coarse images first.
    ///
    /// # Errors
    /// [`Error::NoSetup`] when images are wanted and there is no stage or view, what rendering
    /// says, or [`Error::Plan`] when a decomposition fails.
    pub fn plan(&mut self, options: PlanOptions) -> Result<PlanReport, Error> {
        if options.metric != Metric::Settings {
            self.coarse()?;
        }
        if !options.signed_keys {
            return self.plan_of(self.document.keys(), options);
        }
        let key_options = KeyOptions { signed_keys: true };
        let keys = KeySequence::new(self.document.timeline(), key_options)?;
        self.plan_of(&keys, options)
    }

    fn plan_of(&self, keys: &KeySequence, options: PlanOptions) -> Result<PlanReport, Error> {
        let Tolerance { error, unit } = options.tolerance;
        let weighting = match (options.metric, self.pool()) {
            (Metric::Settings, _) => Weighting::settings(keys.coordinates()),
            (_, None) => return Err(Error::NotRendered),
            (metric, Some(pool)) => self.weighting(pool, keys, Some(metric), unit)?,
        };
        let work = self.host.work();
        work.check()?;
        let of_all_light = match unit {
            ErrorUnit::Light => 1.0,
            ErrorUnit::Steps => OF_ALL_LIGHT,
        };
        let mut plan = Plan::new(keys, &weighting, error / of_all_light, None)?;
        plan.tolerance = error;
        plan.predicted.iter_mut().for_each(|e| *e *= of_all_light);
        work.check()?;
        if let Some(pool) = self.pool().filter(|_| options.metric != Metric::Settings) {
            self.predict_errors(&mut plan, pool, unit)?;
        }
        let report = PlanReport {
            unit,
            ..plan.report(self.show(), keys)?
        };
        Ok(if self.is_final() {
            nothing_to_refine(report)
        } else {
            report
        })
    }

    /// The metric of plans unless one is chosen: that of the images that are there, else levels
    /// alone.
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn usual_metric(&self) -> Result<Metric, Error> {
        match (self.metric, self.pool()) {
            (Some(chosen), _) => Ok(chosen),
            (None, None) => Ok(Metric::Settings),
            (None, Some(_)) => self.plan_metric(),
        }
    }

    /// The metric chosen to order what is refined; `None` where it is the best that the images
    /// allow.
    pub fn metric(&self) -> Option<Metric> {
        self.metric
    }

    /// Refines in the order of another metric from now on; images that are there are kept.
    pub fn set_metric(&mut self, metric: Option<Metric>) {
        self.metric = metric;
    }

    /// The metric that orders what is to be refined.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered; [`Error::Plan`].
    pub fn plan_metric(&self) -> Result<Metric, Error> {
        let (pool, keys) = (self.rendered()?, self.document.keys());
        let weighting = self.weighting(pool, keys, self.metric, ErrorUnit::Light)?;
        Ok(weighting.metric())
    }

    /// The weights that order what is to be refined of `keys`.
    fn weighting(
        &self,
        pool: &Pool,
        keys: &KeySequence,
        metric: Option<Metric>,
        unit: ErrorUnit,
    ) -> Result<Weighting, Error> {
        let weighting = match metric {
            None | Some(Metric::Error) => pool.weighting().clone(),
            Some(Metric::Norm) => Weighting::new(Metric::Norm, pool.norms())?,
            Some(Metric::Settings) => return Ok(Weighting::settings(keys.coordinates())),
            Some(Metric::Influence) => return Ok(Weighting::influence(&pool.norms(), keys)?),
        };
        Ok(weighting.at(self.moments(pool, unit)?))
    }

    /// What is left to refine in the order of a metric.
    pub(super) fn directions(
        &self,
        pool: &Pool,
        metric: Option<Metric>,
        unit: ErrorUnit,
    ) -> Result<Vec<Direction>, Error> {
        let keys = self.document.keys();
        let weighting = self.weighting(pool, keys, metric, unit)?;
        Ok(plan::next(keys, &pool.settings(), &weighting, None)?.directions)
    }

    /// Estimated errors of the worst moment before calibration: of coarse images alone, with the
    /// pool as it is, and with each of `directions` besides.
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

    /// The moments whose error counts.
    pub(super) fn moments(&self, pool: &Pool, unit: ErrorUnit) -> Result<Vec<Moment>, Error> {
        let light = |setting: &[f64]| pool.light(setting);
        let mut moments = Moment::relative(self.settings_of_cues(), light);
        if unit == ErrorUnit::Steps {
            self.displayed(pool, &mut moments)?;
        }
        Ok(moments)
    }

    /// The settings of the moments whose error counts.
    pub(super) fn settings_of_cues(&self) -> Vec<Vec<f64>> {
        let timeline = self.document.timeline();
        let times = self.moments_of_cues().into_iter();
        times.map(|(_, time)| timeline.evaluate(time)).collect()
    }

    /// Parts of every cue's fade, with the cue; of very many cues the end alone.
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

    /// Turns a plan's estimates into the errors that coarse images predict, refined ones not among
    /// them, and counts again what the tolerance needs.
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

/// Moments of each fade whose error counts, as parts of its time.
const PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// From so many cues on only their ends count: each of their moments costs banks times banks.
const MANY_CUES: usize = 500;

/// The plan where the first images are final: the basis still tells how the sequence varies, but no
/// image of it is worth rendering.
fn nothing_to_refine(mut plan: PlanReport) -> PlanReport {
    plan.used = 0;
    plan.predicted = vec![Predicted {
        refined: 0,
        error: 0.0,
    }];
    plan.left_out.push(LeftOut::OneQuality);
    plan
}
