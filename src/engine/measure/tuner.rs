//! What a show needs: which steps of quality, and how many refined pictures, bring the error of its
//! sequence's worst moment within a tolerance in the least time.
//!
//! With pictures of every source at every step of the scale the error of all choices is known
//! without another picture: G is linear, so whatever the pool would show is a sum of these, and its
//! error a quadratic form in their scalar products ([`super::trial`]). The finest step is taken for
//! the truth T and is no candidate itself; with Δ_q = P_q - T a preview of coarse steps c and f and
//! refined step r is off by
//!
//! ```text
//! ((1+a)·Δ_f - a·Δ_c)·H·L + Δ_r·(1 - H)·L
//! ```
//!
//! for light L, with H = 1 - S·C what the refined settings S leave to the coarse pictures and a
//! their extrapolation, both by the pool's own rules. T itself drops out, so that no error is the
//! small difference of large numbers. What T itself is wrong by is not known here.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by the steps and sources they were made of"
)]

use std::borrow::Borrow;

use serde::Serialize;

use super::playback::KeyFormat;
use super::trial::{form, worst};
use super::{Machine, Trial};
use crate::engine::Error;
use crate::linalg::Matrix;
use crate::picture::Image;
use crate::picture::combine::{combine, dot};
use crate::plan::{Metric, Moment, PlanError};
use crate::timeline::KeySequence;
use crate::work::{Cancelled, Work};

/// What a step of quality takes on this show and machine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepCost {
    /// The step.
    pub quality: u8,
    /// Seconds before and beside the pictures: preparation, and every source lit once.
    pub fixed: f64,
    /// Seconds of one picture more.
    pub picture: f64,
    /// False where pictures were found and the seconds are the operator's own prediction.
    pub measured: bool,
    /// The worst moment's error when every source is shown at this step; 0 for the finest, against
    /// which it is.
    pub error: f64,
}

/// A choice, and what comes of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// The cheaper step of coarse pictures.
    pub coarse: u8,
    /// The step of refined pictures; `None` where there are none.
    pub refined: Option<u8>,
    /// How many of them.
    pub pictures: usize,
    /// What all pictures take.
    pub seconds: f64,
    /// The worst moment's error against the finest step, relative.
    pub error: f64,
    /// The error as the interpreter would predict it.
    pub predicted: f64,
}

/// What was found to be the cheapest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tuned {
    /// The show's title.
    pub show: String,
    /// Where it was measured.
    pub machine: Machine,
    /// The error that is allowed, relative.
    pub until: f64,
    /// The step of quality that errors are against.
    pub reference: u8,
    /// How many sources a step renders alone.
    pub sources: usize,
    /// What each step takes and leaves.
    pub steps: Vec<StepCost>,
    /// What is worth considering: nothing quicker is better. The quickest first.
    pub choices: Vec<Candidate>,
    /// The one that is taken.
    pub choice: Candidate,
    /// How key images can be kept.
    pub keys: Vec<KeyFormat>,
    /// The `preview` statement that has the choice in it, as it stands in a show.
    pub preview: String,
}

/// All that was measured.
#[derive(Clone, Debug)]
pub struct Tuner {
    keys: KeySequence,
    /// Relative to the light of T.
    moments: Vec<Moment>,
    /// Scalar products of all Δ, cheapest step first, and of T in the last place.
    gram: Matrix,
    steps: Vec<StepCost>,
}

/// A coarse pair and a refined step, and the settings to refine in their order.
struct Way {
    steps: [usize; 3],
    trial: Trial,
    order: Vec<Vec<f64>>,
}

impl Tuner {
    /// From the settings of the moments whose errors count, and pictures of every source alone at
    /// unit setting, a list for each step of quality from 1 on, with what the steps take (their errors are filled in). `None` unless there are three
    /// steps at least, each with a picture for every coordinate, all of one size and not all black.
    pub fn new<I: Borrow<Image>>(
        (keys, moments): (KeySequence, Vec<Vec<f64>>),
        pictures: &[Vec<I>],
        steps: Vec<StepCost>,
        work: Work<'_>,
    ) -> Result<Option<Tuner>, Cancelled> {
        let sources = keys.coordinates();
        let first = pictures.first().and_then(|list| list.first());
        let measures = |i: &Image| (i.width(), i.height());
        let Some(size) = first.map(|i| measures(i.borrow())) else {
            return Ok(None);
        };
        let fits = |list: &Vec<I>| {
            list.len() == sources && list.iter().all(|i| measures(i.borrow()) == size)
        };
        let (Some((truth, coarser)), true) = (pictures.split_last(), pictures.iter().all(fits))
        else {
            return Ok(None);
        };
        if coarser.len() < 2 || steps.len() != pictures.len() {
            return Ok(None);
        }
        let minus = |(a, b): (&I, &I)| {
            work.check()?;
            let terms = [(1.0, a.borrow()), (-1.0, b.borrow())];
            Ok(combine(size, &terms, work.threads))
        };
        let off = coarser
            .iter()
            .flat_map(|list| list.iter().zip(truth).map(minus));
        let off: Vec<Image> = off.collect::<Result<_, Cancelled>>()?;
        let all: Vec<&Image> = off.iter().chain(truth.iter().map(Borrow::borrow)).collect();
        let gram = products(&all, work)?;
        let last = block(&gram, sources, [coarser.len(); 2]);
        let light = |setting: &[f64]| form(&last, setting, setting).max(0.0).sqrt();
        let moments = Moment::relative(moments, light);
        let is_lit = moments.iter().any(|m| m.scale > 0.0);
        let mut out = Tuner {
            keys,
            moments,
            gram,
            steps,
        };
        for step in 0..out.steps.len() {
            out.steps[step].error = out.step_error(step);
        }
        Ok(is_lit.then_some(out))
    }

    /// What each step takes and leaves.
    pub fn steps(&self) -> &[StepCost] {
        &self.steps
    }

    fn sources(&self) -> usize {
        self.keys.coordinates()
    }

    fn block(&self, row: usize, column: usize) -> Matrix {
        block(&self.gram, self.sources(), [row, column])
    }

    fn step_error(&self, step: usize) -> f64 {
        match step + 1 == self.steps.len() {
            true => 0.0,
            false => self.worst(&self.block(step, step)),
        }
    }

    /// The worst moment's error where pictures are off by what has these scalar products.
    fn worst(&self, gram: &Matrix) -> f64 {
        worst(&self.moments, |s| form(gram, s, s).max(0.0).sqrt())
    }

    /// Every way to spend time that meets `until` with as few refined pictures as it can, and those
    /// with fewer; where none meets it, with as many as the plan has.
    ///
    /// # Errors
    /// A decomposition that fails; cancel.
    pub fn candidates(&self, until: f64, work: Work<'_>) -> Result<Vec<Candidate>, Error> {
        let finest = self.steps.len();
        let mut out = Vec::new();
        for coarse in 0..finest.saturating_sub(2) {
            work.check()?;
            let fine = coarse + 1;
            let alone = self.way([coarse, fine, fine])?;
            let none = self.candidate(&alone, 0)?;
            out.push(none);
            if none.error <= until {
                continue;
            }
            for refined in fine + 1..finest - 1 {
                let way = self.way([coarse, fine, refined])?;
                for pictures in 1..=way.order.len() {
                    work.check()?;
                    let found = self.candidate(&way, pictures)?;
                    out.push(found);
                    if found.error <= until {
                        break;
                    }
                }
            }
        }
        Ok(out)
    }

    /// A coarse pair and none, one, two ... mixtures at a refined step in the order of the plan; empty
    /// where one of the steps was not measured, or is the truth.
    ///
    /// # Errors
    /// A decomposition that fails.
    pub fn mixtures(&self, coarse: u8, refined: u8) -> Result<Vec<Candidate>, PlanError> {
        let finest = self.steps.len();
        let (Some(cheap), Some(refined)) = (
            usize::from(coarse).checked_sub(1),
            usize::from(refined).checked_sub(1),
        ) else {
            return Ok(Vec::new());
        };
        if cheap + 1 >= finest || refined + 1 >= finest {
            return Ok(Vec::new());
        }
        let way = self.way([cheap, (cheap + 1).min(finest - 2), refined])?;
        (0..=way.order.len())
            .map(|n| self.candidate(&way, n))
            .collect()
    }

    /// The pictures of a coarse pair and a refined step, put on trial.
    fn way(&self, steps: [usize; 3]) -> Result<Way, PlanError> {
        let [cheap, fine, refined] = steps;
        // As the finest step's own difference is nothing it has no block.
        let last = self.steps.len() - 1;
        let off = |a: usize, b: usize| match a == last || b == last {
            true => Matrix::zeros(self.sources(), self.sources()),
            false => self.block(a, b),
        };
        let difference =
            |[a, b]: [usize; 2], [c, d]: [usize; 2]| off(a, c) - off(a, d) - off(b, c) + off(b, d);
        let (d, k) = ([fine, cheap], [refined, fine]);
        let mut coarse = self.block(last, last);
        if fine != last {
            let mixed = self.block(fine, last);
            coarse += &mixed + mixed.transpose() + self.block(fine, fine);
        }
        let products = [difference(d, d), difference(k, d), difference(k, k)];
        let moments = self.moments.iter().map(|m| m.setting.clone()).collect();
        let trial = Trial::of_products(self.keys.clone(), moments, &coarse, products);
        let order = match trial.weighting(Metric::Error) {
            Ok(weighting) => trial.order(&weighting)?,
            // Both coarse steps are alike: nothing is known to be wrong, nothing is refined.
            Err(PlanError::NoWeight) => Vec::new(),
            Err(other) => return Err(other),
        };
        Ok(Way {
            steps,
            trial,
            order,
        })
    }

    fn candidate(&self, way: &Way, pictures: usize) -> Result<Candidate, PlanError> {
        let known = &way.order[..pictures];
        let (error, predicted) = match way.order.is_empty() {
            true => (self.steps[way.steps[1]].error, 0.0),
            false => (
                self.error(way, known)?,
                way.trial.predicted(known)?.predicted,
            ),
        };
        let number = |step: usize| self.steps[step].quality;
        let [cheap, _, refined] = way.steps;
        Ok(Candidate {
            coarse: number(cheap),
            refined: (pictures > 0).then(|| number(refined)),
            pictures,
            seconds: self.seconds(way.steps, pictures),
            error,
            predicted,
        })
    }

    /// Coarse pictures at both steps; for refined ones what they share and what each takes.
    fn seconds(&self, [cheap, fine, refined]: [usize; 3], pictures: usize) -> f64 {
        let some = |step: usize, count: usize| {
            let StepCost { fixed, picture, .. } = self.steps[step];
            fixed + picture * count as f64
        };
        let coarse = some(cheap, self.sources());
        let finer = if fine > cheap {
            some(fine, self.sources())
        } else {
            0.0
        };
        let refining = match pictures {
            0 => 0.0,
            // The operator is there, and every source was lit.
            n if refined == fine => n as f64 * self.steps[fine].picture,
            n => some(refined, n),
        };
        coarse + finer + refining
    }

    fn error(&self, way: &Way, settings: &[Vec<f64>]) -> Result<f64, PlanError> {
        let [cheap, fine, refined] = way.steps;
        let shown = way.trial.shown(settings)?;
        let (rest, a) = (&shown.rest, shown.extrapolation);
        let n = self.sources();
        let taken = Matrix::identity(n, n) - rest;
        let last = self.steps.len() - 1;
        let terms = [
            (fine, rest * (1.0 + a)),
            (cheap, rest * -a),
            (refined, taken),
        ];
        let terms: Vec<&(usize, Matrix)> = terms.iter().filter(|(step, _)| *step != last).collect();
        let mut gram = Matrix::zeros(n, n);
        for (p, left) in &terms {
            for (q, right) in &terms {
                gram += left.transpose() * self.block(*p, *q) * right;
            }
        }
        Ok(self.worst(&gram))
    }
}

/// The quickest of those within `until`; of equally quick ones the most exact.
pub fn choice(candidates: &[Candidate], until: f64) -> Option<Candidate> {
    let within = candidates.iter().filter(|c| c.error <= until);
    within.min_by(|a, b| by_seconds(a, b)).copied()
}

/// Those that nothing quicker beats, the quickest first.
pub fn front(candidates: &[Candidate]) -> Vec<Candidate> {
    let mut sorted = candidates.to_vec();
    sorted.sort_by(by_seconds);
    let mut best = f64::INFINITY;
    sorted.retain(|c| {
        let better = c.error < best;
        best = best.min(c.error);
        better
    });
    sorted
}

fn by_seconds(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    let order = a.seconds.total_cmp(&b.seconds);
    order.then(a.error.total_cmp(&b.error))
}

/// All scalar products, each pair once.
fn products(images: &[&Image], work: Work<'_>) -> Result<Matrix, Cancelled> {
    let mut out = Matrix::zeros(images.len(), images.len());
    for (i, a) in images.iter().enumerate() {
        work.check()?;
        work.progress.report("comparing pictures", i, images.len());
        for (j, b) in images.iter().enumerate().take(i + 1) {
            let product = dot(a, b);
            out[(i, j)] = product;
            out[(j, i)] = product;
        }
    }
    Ok(out)
}

/// The scalar products of one step's sources with another's.
fn block(gram: &Matrix, sources: usize, [row, column]: [usize; 2]) -> Matrix {
    let corner = (row * sources, column * sources);
    gram.view(corner, (sources, sources)).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(seconds: f64, error: f64) -> Candidate {
        Candidate {
            coarse: 1,
            refined: None,
            pictures: 0,
            seconds,
            error,
            predicted: error,
        }
    }

    #[test]
    fn the_quickest_within_is_chosen_and_nothing_quicker_beats_the_front() {
        let all = [
            (3.0, 0.02),
            (1.0, 0.1),
            (2.0, 0.2),
            (3.0, 0.01),
            (9.0, 0.001),
        ];
        let all = all.map(|(s, e)| candidate(s, e));
        assert_eq!(choice(&all, 0.05), Some(candidate(3.0, 0.01)));
        assert_eq!(choice(&all, 0.1), Some(candidate(1.0, 0.1)));
        assert_eq!(choice(&all, 0.0005), None);
        let left: Vec<f64> = front(&all).iter().map(|c| c.error).collect();
        assert_eq!(left, [0.1, 0.01, 0.001]);
    }
}
