//! The plan of a show, and the order in which images are refined.

use super::{Engine, Error};
use crate::plan::{self, Direction, LeftOut, Metric, Plan, PlanReport, Predicted, Weighting};
use crate::pool::{Pool, is_within};
use crate::timeline::{KeyOptions, KeySequence};

/// What a plan is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanOptions {
    /// What is measured; all but settings render coarse images first.
    pub metric: Metric,
    /// The relative error of the sequence that is aimed for.
    pub tolerance: f64,
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
        let (weighting, norm) = match (options.metric, self.pool()) {
            (Metric::Settings, _) => (Weighting::settings(keys.coordinates()), None),
            (_, None) => return Err(Error::NotRendered),
            (Metric::Error, Some(pool)) => (pool.weighting().clone(), self.sequence_norm(pool)),
            (Metric::Norm, Some(pool)) => (
                Weighting::new(Metric::Norm, pool.norms())?,
                self.sequence_norm(pool),
            ),
            (Metric::Influence, Some(pool)) => (
                Weighting::influence(&pool.norms(), keys)?,
                self.sequence_norm(pool),
            ),
        };
        let work = self.host.work();
        work.check()?;
        let mut plan = Plan::new(keys, &weighting, options.tolerance, norm)?;
        work.check()?;
        if let Some(pool) = self.pool().filter(|_| options.metric != Metric::Settings) {
            judge(&mut plan, pool);
        }
        let report = plan.report(self.show(), keys)?;
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
        Ok(self.weighting(self.rendered()?, self.metric)?.metric())
    }

    /// The weights that order what is to be refined.
    fn weighting(&self, pool: &Pool, metric: Option<Metric>) -> Result<Weighting, Error> {
        let keys = self.document.keys();
        Ok(match metric {
            None | Some(Metric::Error) => pool.weighting().clone(),
            Some(Metric::Norm) => Weighting::new(Metric::Norm, pool.norms())?,
            Some(Metric::Settings) => Weighting::settings(keys.coordinates()),
            Some(Metric::Influence) => Weighting::influence(&pool.norms(), keys)?,
        })
    }

    /// What is left to refine in the order of a metric, with the errors, before calibration, that
    /// previews are predicted to have then.
    pub(super) fn directions(
        &self,
        pool: &Pool,
        metric: Option<Metric>,
    ) -> Result<Vec<Direction>, Error> {
        let (keys, norm) = (self.document.keys(), self.sequence_norm(pool));
        let weighting = self.weighting(pool, metric)?;
        let mut known = pool.settings();
        let mut out = plan::next(keys, &known, &weighting, norm)?.directions;
        let own = pool.weighting();
        if weighting != *own {
            // Singular values in another metric say nothing of errors.
            for direction in &mut out {
                self.host.work().check()?;
                known.push(direction.setting.clone());
                direction.error = plan::forecast(keys, &known, own, norm)?;
            }
        }
        Ok(out)
    }

    /// What estimated errors are relative to: sqrt ∫ ||I(t)||² dt of the sequence, from the coarse
    /// images; `None`, the weighted norm of the settings, where the pool says so.
    pub(super) fn sequence_norm(&self, pool: &Pool) -> Option<f64> {
        (!pool.is_relative()).then(|| self.coherent_norm(pool))
    }

    /// sqrt ∫ ||I(t)||² dt of the sequence, from the coarse images.
    pub(super) fn coherent_norm(&self, pool: &Pool) -> f64 {
        plan::sequence_norm(pool.gram(), &plan::second_moment(self.document.keys()))
    }
}

/// Turns a plan's estimates into the errors that the pool predicts, and counts again what the
/// tolerance needs.
fn judge(plan: &mut Plan, pool: &Pool) {
    let alone = plan.predicted.first().copied().unwrap_or(0.0);
    for error in &mut plan.predicted {
        *error = pool.error(*error, alone);
    }
    let within = |(count, error): (usize, &f64)| {
        plan.tolerance > 0.0 && is_within(plan.tolerance, *error, count, pool.is_relative())
    };
    let mut counted = plan.predicted.iter().enumerate();
    plan.used = counted.position(within).unwrap_or(plan.basis.len());
}

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
