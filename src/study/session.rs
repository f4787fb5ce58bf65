//! A design session: how good the sequence was, and what it had cost, at every moment of it.
//!
//! The measure is the paper's (its Figure 7): 1 - error / (error of coarse pictures alone), 0 while
//! nothing is refined, 1 where the sequence is as if all of it were.

use std::borrow::Borrow;

use super::Origin;
use crate::linalg::Matrix;
use crate::picture::Image;
use crate::picture::combine::{combine, dot};
use crate::plan::Metric;

/// Every moment of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The show and the machine.
    pub origin: Origin,
    /// The quality of the pictures that stand for the truth; `None` where there were none.
    pub truth: Option<u8>,
    /// What chose the pictures, where it was not the best that they allow.
    pub metric: Option<Metric>,
    /// In the order of time.
    pub moments: Vec<Moment>,
}

/// What happened before a moment was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The coarse pictures were rendered.
    Coarse,
    /// Refined pictures were added.
    Refined,
    /// The show was edited.
    Edit,
}

/// Errors of the sequence, relative, beside those of its coarse pictures alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// With the pool as it is.
    pub now: f64,
    /// With coarse pictures alone.
    pub coarse: f64,
}

impl Errors {
    /// 1 - error / (error of coarse alone); `None` where coarse pictures have no error.
    pub fn quality(self) -> Option<f64> {
        (self.coarse > 0.0).then(|| 1.0 - self.now / self.coarse)
    }
}

/// A command of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Command {
    /// The line where it begins, from 1.
    pub line: usize,
    /// Its first line, without spaces around it.
    pub text: String,
}

/// A moment of the session.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// What happened before it.
    pub event: Event,
    /// The command that brought it; `None` for the first coarse pictures.
    pub command: Option<Command>,
    /// Seconds of computing so far.
    pub seconds: f64,
    /// Refined pictures in the pool.
    pub refined: usize,
    /// As the plan knows them.
    pub predicted: Errors,
    /// Against pictures of the refined quality throughout, if they were rendered.
    pub truth: Option<Errors>,
}

/// The error of a sequence shown with `shown` in place of `reference` (a picture for each
/// coordinate at unit setting): sqrt of ∫‖I - I_ref‖² dt / ∫‖I_ref‖² dt, exactly, as the quadratic
/// form of the differences' and the references' Gram matrices with the second moment of the
/// settings, ∫ L·Lᵀ dt. 0 for a sequence without light.
pub fn sequence_error<I: Borrow<Image>>(
    shown: &[I],
    reference: &[Image],
    moment: &Matrix,
    threads: usize,
) -> f64 {
    let off = |(a, b): (&I, &Image)| {
        let terms = [(1.0, a.borrow()), (-1.0, b)];
        combine((b.width(), b.height()), &terms, threads)
    };
    let differences: Vec<Image> = shown.iter().zip(reference).map(off).collect();
    let (error, all) = (energy(&differences, moment), energy(reference, moment));
    if all > 0.0 { (error / all).sqrt() } else { 0.0 }
}

/// Σ_ij M_ij <P_i, P_j>; the moment is symmetric.
fn energy(pictures: &[Image], moment: &Matrix) -> f64 {
    let mut sum = 0.0;
    for (i, a) in pictures.iter().enumerate() {
        for (j, b) in pictures.iter().enumerate().take(i + 1) {
            let weight = moment.get((i, j)).copied().unwrap_or(0.0);
            if weight != 0.0 {
                sum += if i == j { 1.0 } else { 2.0 } * weight * dot(a, b);
            }
        }
    }
    sum.max(0.0)
}
