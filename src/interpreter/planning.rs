//! `plan`: key settings, basis and predicted error, from the show alone.

use std::fmt::Write as _;

use super::answer::fraction;
use super::{Call, Error, Interpreter, Reply};
use crate::plan::{LeftOut, Metric, Plan, PlanReport, Predicted, Weighting};
use crate::report;
use crate::timeline::{KeyOptions, KeySequence};

impl Interpreter {
    pub(super) fn answer_plan(&mut self, call: &Call) -> Result<Reply, Error> {
        if call.option("next").is_some() {
            return self.answer_next(call);
        }
        if let Some(word) = call.words.first() {
            return Err(Error::Usage(format!(
                "`{word}` is left over; a number of steps stands behind --next"
            )));
        }
        let tolerance = match call.option("tolerance") {
            Some(text) => fraction(text)?,
            None => self.show().preview.tolerance,
        };
        let metric = self.method().metric.unwrap_or(Metric::Settings);
        let plan = match call.option("signed-keys") {
            None => self.plan(metric, tolerance)?,
            Some(_) => {
                self.images_for(metric)?;
                let options = KeyOptions { signed_keys: true };
                let keys = KeySequence::new(self.timeline(), options);
                let keys = keys.map_err(|e| Error::Usage(e.to_string()))?;
                self.plan_of(&keys, metric, tolerance)?
            }
        };
        if call.option("json").is_some() {
            return Reply::json(&report::plan::form(&plan));
        }
        let mut text = report::plan::describe(&plan);
        if let Some(unshared) = self.unshared() {
            let _ = writeln!(text, "{unshared}");
        }
        if metric != Metric::Settings && !self.is_final() {
            let [cheap, fine] = self.coarse_steps();
            let _ = writeln!(
                text,
                "measured by coarse pictures at quality {cheap} and {fine}, rendered first"
            );
        }
        Ok(Reply::text(text))
    }

    /// The plan of the show alone: key settings, basis, predicted error; no pool in it. The metrics
    /// `influence` and `error` render coarse pictures first.
    ///
    /// # Errors
    /// [`Error`] when pictures are wanted and cannot be rendered, or a decomposition fails.
    pub fn plan(&mut self, metric: Metric, tolerance: f64) -> Result<PlanReport, Error> {
        self.images_for(metric)?;
        self.plan_of(&self.compiled.keys, metric, tolerance)
    }

    /// Renders what a metric measures by, unless it is there.
    fn images_for(&mut self, metric: Metric) -> Result<(), Error> {
        match metric {
            Metric::Settings => Ok(()),
            Metric::Influence | Metric::Error => self.coarse(),
        }
    }

    fn plan_of(
        &self,
        keys: &KeySequence,
        metric: Metric,
        tolerance: f64,
    ) -> Result<PlanReport, Error> {
        let pool = self.pool();
        let (weighting, norm) = match (metric, pool) {
            (Metric::Settings, _) => (Weighting::settings(keys.coordinates()), None),
            (_, None) => return Err(super::refine::no_stage()),
            (Metric::Error, Some(pool)) => (pool.weighting(), Some(self.sequence_norm(pool))),
            (Metric::Influence, Some(pool)) => (
                Weighting::influence(&pool.norms(), keys)?,
                Some(self.sequence_norm(pool)),
            ),
        };
        let report = Plan::new(keys, &weighting, tolerance, norm)?.report(self.show(), keys);
        Ok(if self.is_final() {
            nothing_to_refine(report)
        } else {
            report
        })
    }
}

/// The plan where the first pictures are final: the basis still tells how the sequence varies, but
/// no picture of it is worth rendering.
fn nothing_to_refine(mut plan: PlanReport) -> PlanReport {
    plan.used = 0;
    plan.predicted = vec![Predicted {
        refined: 0,
        error: 0.0,
    }];
    plan.left_out.push(LeftOut::OneQuality);
    plan
}
