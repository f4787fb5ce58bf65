//! What the next refined pictures cost and what they bring: `plan --next`, and how many `refine`
//! renders in one call.
//!
//! Seconds are the operator's own prediction, scaled by how long the last rendering took against
//! its prediction. A call has a fixed part (the operator's preparation, sources lit for the first
//! time) and a part for each picture. Rendering several pictures at once spares the planning
//! between them, but the first may show that the others were not needed; so the others together
//! are given no more than the fixed part, which is spent in any case: at the worst a call costs
//! twice what was needed.

use std::fmt::Write as _;

use serde::Serialize;

use super::answer::{count, percent, whole};
use super::refine::{Goal, no_stage};
use super::{Call, Error, Interpreter, Reply};
use crate::pool::is_within;
use crate::report::words::seconds;
use crate::renderer::layered::Layered;
use crate::renderer::{Cost, Quality, Transport};

/// Most pictures of one call: what is known after them is better than what is predicted before.
const MOST: usize = 16;
/// Steps that `plan --next` tells of unless it is told how many.
const TOLD: usize = 5;
/// Coordinates named for a step.
const NAMED: usize = 4;

/// A picture that could be refined.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ahead {
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
pub struct Outlook {
    /// The step of quality that refined pictures are rendered at.
    pub quality: u8,
    /// Predicted error of the sequence as the pool stands, relative.
    pub error: f64,
    /// Predicted seconds that the first picture to be rendered costs beyond what each further one
    /// does: preparation, and sources that are lit for the first time.
    pub fixed: f64,
    /// The most useful first; none when nothing is left to improve.
    pub steps: Vec<Ahead>,
}

/// Measured against predicted seconds, once something was measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace(Option<f64>);

impl Pace {
    /// Seconds of what is predicted to take one; one while nothing is known.
    pub fn seconds(self) -> f64 {
        self.0.unwrap_or(1.0)
    }

    /// Takes what was predicted, this pace in it, against what it took. Only the last counts: the
    /// machine may have other work now than it had before.
    pub fn learn(&mut self, predicted: f64, measured: f64) {
        let ratio = measured / predicted;
        if ratio.is_finite() && ratio > 0.0 {
            self.0 = Some(self.seconds() * ratio);
        }
    }
}

/// What to render in the next call.
#[derive(Debug, PartialEq)]
pub(super) struct NextCall {
    /// How many pictures; 0 when nothing is left.
    pub pictures: usize,
    /// How many the goal is predicted to need.
    pub needed: usize,
    /// Whether the first of them is predicted to end in time.
    pub fits: bool,
    /// Why they are several.
    pub remark: Option<String>,
}

/// How many pictures of `outlook` one call should render for `goal`, when `refined` pictures are
/// there and `left` seconds remain, if those are limited.
pub(super) fn call(outlook: &Outlook, goal: &Goal, refined: usize, left: Option<f64>) -> NextCall {
    let steps = &outlook.steps;
    let needed = match goal.until {
        None => steps.len(),
        Some(until) => {
            let ahead = steps.iter().zip(refined + 1..);
            let over = ahead.take_while(|(s, refined)| !is_within(until, s.error, *refined));
            (over.count() + 1).min(steps.len())
        }
    };
    let first = steps.first().map_or(0.0, |s| s.seconds);
    let fits = left.is_none_or(|left| first <= left);
    let mut rendered = steps.iter().filter(|s| !s.stored).skip(1);
    let marginal = rendered.next().map_or(0.0, |s| s.seconds);
    // What is stored costs nothing by itself, and what it shows is known before the next.
    let stored = steps.first().is_some_and(|s| s.stored);
    let one_by_one = goal.count.is_some() || marginal <= 0.0 || stored;
    let paying = match one_by_one {
        true => 1,
        false => 1 + (outlook.fixed / marginal) as usize,
    };
    // A prediction that is wrong by a factor of two may still not break the time.
    let inside = |left: f64| match fits && marginal > 0.0 {
        true => 1 + ((0.5 * left - first).max(0.0) / marginal) as usize,
        false => 1,
    };
    let pictures = needed
        .min(paying)
        .min(left.map_or(MOST, inside))
        .min(MOST)
        .min(steps.len());
    let remark = (pictures > 1).then(|| {
        format!(
            "{} in one call: what it takes before the first costs {}, each picture {} (predicted)",
            count(pictures, "picture"),
            seconds(outlook.fixed),
            seconds(marginal)
        )
    });
    NextCall {
        pictures,
        needed,
        fits,
        remark,
    }
}

/// What to say where another picture does not fit into the time.
pub(super) fn too_long(predicted: f64) -> Option<String> {
    let words = seconds(predicted);
    (predicted > 0.0).then(|| format!("the next picture would take {words}, which does not fit"))
}

impl Interpreter {
    /// What refinement has before it: for each next picture its setting, the seconds that it is
    /// predicted to take and the error that it is predicted to leave.
    ///
    /// # Errors
    /// [`Error::Usage`] before the coarse pictures are rendered ([`Interpreter::coarse`]).
    pub fn outlook(&self) -> Result<Outlook, Error> {
        let quality = self.refined_step();
        let mut out = Outlook {
            quality: quality.0,
            error: self.predicted_error()?,
            fixed: 0.0,
            steps: Vec::new(),
        };
        if self.is_final() {
            return Ok(out);
        }
        let pool = self.rendered()?;
        if pool.flawless() {
            return Ok(out);
        }
        let next = self.directions(pool)?;
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        let cost = stage.cost(self.host.transport.as_ref(), quality);
        let ready = stage.is_prepared(quality);
        let mut lit = vec![false; stage.rig.sources.len()];
        for refined in pool
            .refined()
            .iter()
            .filter(|r| ready && r.quality == quality)
        {
            newly_lit(&mut lit, &refined.setting);
        }
        let settings: Vec<Vec<f64>> = next.iter().map(|d| d.setting.clone()).collect();
        let stored = stage.at_hand(quality, &settings, self.host.store.as_ref());
        let mut first = true;
        for (direction, stored) in next.into_iter().zip(stored) {
            let mut seconds = 0.0;
            if !stored {
                let fresh = newly_lit(&mut lit, &direction.setting) as f64;
                let prepare = if first && !ready { cost.prepare } else { 0.0 };
                let fixed = (prepare + fresh * cost.per_source) * self.pace.seconds();
                if first {
                    out.fixed = fixed;
                }
                first = false;
                seconds = fixed + cost.per_image * self.pace.seconds();
            }
            out.steps.push(Ahead {
                setting: direction.setting,
                seconds,
                stored,
                error: direction.error * self.calibration(),
            });
        }
        Ok(out)
    }

    /// Learns from the coarse pictures, begun at this time, how fast the operator is here.
    pub(super) fn time_coarse(&mut self, begin: f64) {
        let measured = self.host.clock.seconds() - begin;
        let Some(stage) = &self.stage else { return };
        let sources = stage.rig.sources.len() as f64;
        let [cheap, fine] = self.coarse_steps();
        let transport = self.host.transport.as_ref();
        let all = |step: u8| stage.cost(transport, Quality(step)).alone(sources);
        let other = if fine > cheap { all(cheap) } else { 0.0 };
        self.pace
            .learn((all(fine) + other) * self.pace.seconds(), measured);
    }

    /// Lays on the operator's yardstick where nothing was rendered yet that would tell the pace, as
    /// the coarse pictures were stored.
    pub(super) fn know_pace(&mut self) -> Result<(), Error> {
        if self.pace.0.is_some() {
            return Ok(());
        }
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        let clock = || self.host.clock.seconds();
        let operator = Layered::new(&stage.rig, self.host.transport.as_ref());
        let seconds = operator.pace(&clock, self.host.work())?;
        self.pace.learn(self.pace.seconds(), seconds);
        Ok(())
    }

    pub(super) fn answer_next(&mut self, call: &Call) -> Result<Reply, Error> {
        let told = match call.words.as_slice() {
            [] => TOLD,
            [number] => whole(number)?,
            [_, word, ..] => {
                return Err(Error::Usage(format!(
                    "`{word}` is left over: plan --next [N]"
                )));
            }
        };
        for other in ["tolerance", "signed-keys"] {
            if call.option(other).is_some() {
                return Err(Error::Usage(format!(
                    "--{other} belongs to the plan of the whole show, not to --next: the next \
                     steps follow from the pictures that are there"
                )));
            }
        }
        self.coarse()?;
        self.know_pace()?;
        let mut outlook = self.outlook()?;
        let all = outlook.steps.len();
        let cost = self.refined_cost()?;
        outlook.steps.truncate(told);
        if call.option("json").is_some() {
            return Reply::json(&outlook);
        }
        Ok(Reply::text(self.describe_next(&outlook, all, cost)))
    }

    /// Predicted seconds of refined pictures, as fast as this machine was last.
    fn refined_cost(&self) -> Result<Cost, Error> {
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        Ok(stage.cost(self.host.transport.as_ref(), self.refined_step()))
    }

    fn describe_next(&self, outlook: &Outlook, all: usize, cost: Cost) -> String {
        let mut text = format!(
            "predicted error {} % with {}; {} left to refine, at quality {}\n",
            percent(outlook.error),
            count(self.refined(), "refined picture"),
            count(all, "direction"),
            outlook.quality
        );
        if outlook.steps.is_empty() {
            return text;
        }
        let _ = writeln!(text, "       takes    in all     leaves  mostly");
        let names = self.show().coordinates();
        let mut total = 0.0;
        for (i, step) in outlook.steps.iter().enumerate() {
            total += step.seconds;
            let mut parts: Vec<(f64, &str)> = step
                .setting
                .iter()
                .copied()
                .zip(names.iter().map(|c| c.name.as_str()))
                .collect();
            parts.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
            let large = parts.iter().take(NAMED).filter(|(s, _)| s.abs() >= 0.1);
            let words: Vec<String> = large.map(|(s, name)| format!("{name} {s:+.2}")).collect();
            let takes = match step.stored {
                true => "stored".to_owned(),
                false => seconds(step.seconds),
            };
            let _ = writeln!(
                text,
                "  {:>2} {takes:>8}  {:>8}  {:>7} %  {}",
                i + 1,
                seconds(total),
                percent(step.error),
                words.join("  ")
            );
        }
        text.push_str(
            &match (cost.prepare + cost.per_source > 0.0, outlook.fixed > 0.0) {
                (false, _) => "pictures share no work here: one at a time loses nothing".to_owned(),
                (true, true) => format!(
                    "the first costs {} before any picture, which the others share: several in one \
                 call pay until they cost as much",
                    seconds(outlook.fixed)
                ),
                (true, false) => {
                    "what pictures share is done: one at a time loses nothing".to_owned()
                }
            },
        );
        text
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

    fn outlook(fixed: f64, each: f64) -> Outlook {
        let step = |i: usize| Ahead {
            setting: vec![1.0],
            seconds: if i == 0 { fixed + each } else { each },
            stored: false,
            error: 0.5_f64.powi(i as i32 + 1),
        };
        Outlook {
            quality: 4,
            error: 1.0,
            fixed,
            steps: (0..10).map(step).collect(),
        }
    }

    fn until(error: f64) -> Goal {
        Goal {
            until: Some(error),
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
    fn several_at_once_only_while_they_cost_no_more_than_what_is_spent_anyway() {
        // Five are needed for 1/32; all of them together cost less than the preparation.
        assert_eq!(call(&outlook(2.0, 0.1), &until(0.04), 2, None).pictures, 5);
        // Two beyond the first may be given what the preparation costs.
        assert_eq!(call(&outlook(2.0, 1.0), &until(0.04), 2, None).pictures, 3);
        // No shared work, as with an outside renderer; or all of it done.
        assert_eq!(call(&outlook(0.0, 1.0), &until(0.04), 2, None).pictures, 1);
        // A count is one by one, whatever it costs.
        let three = Goal {
            count: Some(3),
            ..Goal::default()
        };
        assert_eq!(call(&outlook(2.0, 0.1), &three, 0, None).pictures, 1);
        // An error that is not confirmed takes the pictures that confirm it.
        assert_eq!(call(&outlook(2.0, 0.1), &until(0.9), 0, None).pictures, 2);
        // What is stored comes by itself, whatever those after it cost.
        let mut stored = outlook(2.0, 0.1);
        if let Some(first) = stored.steps.first_mut() {
            (first.stored, first.seconds) = (true, 0.0);
        }
        let next = call(&stored, &within(1.0), 2, Some(1.0));
        assert_eq!((next.pictures, next.fits), (1, true));
        let nothing = Outlook {
            steps: Vec::new(),
            ..outlook(0.0, 0.0)
        };
        assert_eq!(call(&nothing, &until(0.1), 2, None).pictures, 0);
    }

    #[test]
    fn a_time_is_kept_by_prediction() {
        let fits = |fixed, each, left| {
            let next = call(&outlook(fixed, each), &within(left), 0, Some(left));
            (next.fits, next.pictures)
        };
        assert_eq!(fits(0.0, 2.0, 1.0), (false, 1));
        assert_eq!(fits(0.0, 2.0, 2.0), (true, 1));
        // Half of the time at most goes to a call of several.
        assert_eq!(fits(2.0, 0.5, 7.0), (true, 3));
        assert_eq!(fits(2.0, 0.5, 100.0), (true, 5));
    }

    #[test]
    fn the_pace_is_that_of_the_last_rendering() {
        let mut pace = Pace::default();
        pace.learn(1.0, 3.0);
        assert_eq!(pace.seconds(), 3.0);
        pace.learn(3.0, 1.5);
        assert_eq!(pace.seconds(), 1.5);
        // A clock that stands still, a cost that is not known.
        pace.learn(3.0, 0.0);
        pace.learn(0.0, 1.0);
        assert_eq!(pace.seconds(), 1.5);
    }
}
