//! The predicted error of a sequence, and the end of refinement.

use super::Error;
use super::estimate::Estimate;
use super::goal::{Ended, Goal, RefinementSummary, WorstMoment};
use crate::plan::worst_left;
use crate::pool::{Pool, is_within};
use footlight_show::units::{ErrorUnit, Tolerance};

/// Relative difference of two errors that are equal except for rounding.
const ROUNDING: f64 = 1e-9;

impl Estimate<'_> {
    /// Reason why refinement ends; `None` if another image is to be rendered.
    pub(super) fn ended(
        &self,
        goal: &Goal,
        done: &RefinementSummary,
    ) -> Result<Option<Ended>, Error> {
        // The current error: an edit changes it without an image.
        let error = self.predicted_in(goal.unit())?;
        // With no known error there is nothing to refine, which is then the reason.
        let known = error > 0.0 || self.refined() > 0;
        let reached = |wanted: Tolerance| known && self.is_reached(wanted, error);
        if goal.until.is_some_and(reached) {
            return Ok(Some(Ended::Reached));
        }
        if goal.count.is_some_and(|count| done.images >= count) {
            return Ok(Some(Ended::Counted));
        }
        let spent = goal.budget.is_some_and(|s| done.seconds >= s);
        Ok((spent && done.images > 0).then_some(Ended::Spent))
    }

    /// True when a predicted error counts as within `wanted`.
    pub(super) fn is_reached(&self, wanted: Tolerance, error: f64) -> bool {
        let is_stated = self.pool().is_some_and(Pool::is_known);
        is_within(wanted.error, error, self.refined(), is_stated)
    }

    /// Predicted error of the sequence with the current pool: that of its worst moment, relative to
    /// its light. If the operator states no errors, the error of refined images themselves is not
    /// included.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered.
    pub fn predicted_error(&self) -> Result<f64, Error> {
        self.predicted_in(ErrorUnit::Light)
    }

    /// Predicted error of the sequence in a unit.
    ///
    /// # Errors
    /// As [`Estimate::predicted_error`].
    pub fn predicted_in(&self, unit: ErrorUnit) -> Result<f64, Error> {
        let left = self.left(unit)?;
        Ok(left.map_or(0.0, |(pool, [alone, now])| pool.error(now, alone)))
    }

    /// The pool, with the errors before calibration of coarse images alone and after refinement;
    /// `None` without an estimate.
    fn left(&self, unit: ErrorUnit) -> Result<Option<(&Pool, [f64; 2])>, Error> {
        let pool = self.rendered()?;
        if self.is_final() || pool.has_no_estimated_error() {
            return Ok(None);
        }
        Ok(match self.errors_left(pool, &[], unit)?[..] {
            [alone, now] => Some((pool, [alone, now])),
            _ => None,
        })
    }

    /// The predicted error, relative, and its value before calibration ([`SequenceState`](super::SequenceState)).
    pub(super) fn error_and_forecast(&self) -> Result<[f64; 2], Error> {
        let left = self.left(ErrorUnit::Light)?;
        Ok(left.map_or([0.0; 2], |(pool, [alone, now])| {
            [pool.error(now, alone), now]
        }))
    }

    /// The moment with the largest predicted error, among the middle and the end of every cue's
    /// fade; `None` without a known error. Dark cues count as much as bright ones, unless nearly
    /// out.
    ///
    /// # Errors
    /// [`Error::NotRendered`] before the coarse images are rendered.
    pub fn worst_moment(&self, unit: ErrorUnit) -> Result<Option<WorstMoment>, Error> {
        let pool = self.rendered()?;
        let is_unknown = pool.coarser().is_empty() && !pool.is_stated();
        if self.is_final() || is_unknown || pool.has_no_estimated_error() {
            return Ok(None);
        }
        let mut worst: Option<WorstMoment> = None;
        let moments = self.moments(pool, unit)?;
        for ((cue, time), moment) in self.moments_of_cues().into_iter().zip(moments) {
            let left = worst_left(&[moment], &pool.settings(), &[], pool.weighting());
            let [alone, now] = left[..] else { continue };
            let error = pool.error(now, alone);
            // The first of equal ones.
            let is_worse = |w: WorstMoment| error > w.error * (1.0 + ROUNDING);
            if alone > 0.0 && worst.is_none_or(is_worse) {
                worst = Some(WorstMoment { cue, time, error });
            }
        }
        Ok(worst)
    }
}
