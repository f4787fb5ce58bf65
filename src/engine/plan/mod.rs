//! Chooses what to render well, and in which order: a pure function of keys, durations, a metric
//! and the settings in the pool.
//!
//! With K a segment's control points, B its Bernstein mass matrix and h its length, the integral of
//! L·Lᵀ over the sequence is M = A·Aᵀ for A = [K · chol(h·B)] over all segments; the singular value
//! decomposition of W·A (W diagonal, one weight for each coordinate) orders directions of light by
//! the weighted error that they remove. M itself is never decomposed, because squaring costs half
//! the digits. Weights of zero (a bank that no pixel sees) are replaced by a millionth of the
//! largest, so that every key can still be expressed and such banks come last. When single moments
//! count ([`Weighting::at`]), their weighted settings are the columns of A.

mod express;
mod moment;
mod next;
mod projection;
mod report;
mod worst;

#[cfg(test)]
mod tests;

pub use next::next;
pub use projection::projection;
pub use report::{BankReport, LeftOut, PlanReport, Predicted, SegmentReport};
pub use worst::{Moment, worst_left};

use footlight_show::linalg::{Matrix, Orthonormal, SvdError, svd};
use footlight_show::timeline::KeySequence;

/// Reason why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A weight is negative or not finite.
    #[error("the weight of coordinate {coordinate} is {weight}")]
    Weight {
        /// Index of the coordinate.
        coordinate: usize,
        /// Its weight.
        weight: f64,
    },
    /// All weights are zero: no coarse image has an error, so that nothing is worth refining.
    #[error("all weights are zero: nothing is left to improve")]
    NoWeight,
    /// Weights, settings and keys must have the same number of coordinates.
    #[error("{found} numbers were given for {wanted} coordinates")]
    Shape {
        /// The number found.
        found: usize,
        /// The number in the keys.
        wanted: usize,
    },
    /// The decomposition failed its check.
    #[error(transparent)]
    Svd(#[from] SvdError),
    /// Keys are not the product of weights and basis.
    #[error("the basis misses a key by {off:e} of the largest")]
    Unverified {
        /// The difference.
        off: f64,
    },
}

/// Zero weights are replaced by this share of the largest.
const FLOOR: f64 = 1e-6;
/// Singular values below this many eps·max(rows, columns) of the largest are rounding.
const RANK: f64 = 8.0 * f64::EPSILON;

/// The diagonal metric W, and the moments that count.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighting {
    weights: Vec<f64>,
    moments: Vec<Moment>,
}

impl Weighting {
    /// Weights, one for each coordinate.
    ///
    /// # Errors
    /// A negative or not finite weight; all weights zero.
    pub fn new(weights: Vec<f64>) -> Result<Weighting, PlanError> {
        for (coordinate, &weight) in weights.iter().enumerate() {
            if !weight.is_finite() || weight < 0.0 {
                return Err(PlanError::Weight { coordinate, weight });
            }
        }
        if !weights.is_empty() && weights.iter().all(|w| *w == 0.0) {
            return Err(PlanError::NoWeight);
        }
        Ok(Weighting {
            weights,
            moments: Vec::new(),
        })
    }

    /// Equal weights for this many coordinates: light as set at the desk.
    pub fn settings(coordinates: usize) -> Weighting {
        Weighting {
            weights: vec![1.0; coordinates],
            moments: Vec::new(),
        }
    }

    /// Counts these moments, each by its scale, instead of the whole time by length. Directions in
    /// the order of their singular values then reduce the worst moment's error with few images; an
    /// average over time hides dark or short cues.
    #[must_use]
    pub fn at(self, moments: Vec<Moment>) -> Weighting {
        Weighting { moments, ..self }
    }

    /// The weights as given.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The weights with zeros replaced.
    fn lifted(&self) -> Vec<f64> {
        let largest = self.weights.iter().fold(0.0f64, |m, w| m.max(*w));
        let lift = |w: &f64| w.max(FLOOR * largest);
        self.weights.iter().map(lift).collect()
    }
}

/// Settings as the columns of a matrix, with each coordinate multiplied by its weight.
fn weighted_columns(settings: &[impl AsRef<[f64]>], w: &[f64]) -> Matrix {
    let mut out = Matrix::zeros(w.len(), settings.len());
    for (mut column, setting) in out.column_iter_mut().zip(settings) {
        for ((to, x), w) in column.iter_mut().zip(setting.as_ref()).zip(w) {
            *to = x * w;
        }
    }
    out
}

fn same_shape(found: usize, keys: &KeySequence) -> Result<(), PlanError> {
    let wanted = keys.coordinates();
    if found == wanted {
        Ok(())
    } else {
        Err(PlanError::Shape { found, wanted })
    }
}

/// A basis of all key settings, in the order of its benefit.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The tolerance of the sequence.
    pub tolerance: f64,
    /// False for a sequence without length, whose looks all count equally.
    pub time_weighted: bool,
    /// One for each basis setting, descending: weighted light times the square root of seconds.
    pub singular_values: Vec<f64>,
    /// Settings, each scaled to a largest absolute number of 1. Many have negative numbers, which G
    /// accepts.
    pub basis: Vec<Vec<f64>>,
    /// For each key, a weight for each basis setting: key = sum of weight · basis setting.
    pub weights: Vec<Vec<f64>>,
    /// Predicted error of the sequence after each number of refined images, 0 to the rank.
    pub predicted: Vec<f64>,
    /// Number of basis settings needed for the tolerance.
    pub used: usize,
    /// Coordinates whose weight is zero.
    pub unseen: Vec<usize>,
}

impl Plan {
    /// Plans a sequence.
    ///
    /// `tolerance` is the permitted error of the sequence (0: none). Errors are relative to the
    /// weighted norm of the settings.
    ///
    /// The basis has full numerical rank. When a key is so short that its time weight is lost in
    /// rounding (a last look without length, a zero weight), a direction for it comes last.
    ///
    /// # Errors
    /// For a wrong number of weights; for a decomposition that fails its check.
    pub fn new(
        keys: &KeySequence,
        weighting: &Weighting,
        tolerance: f64,
    ) -> Result<Plan, PlanError> {
        same_shape(weighting.weights.len(), keys)?;
        let w = weighting.lifted();
        let a = moment::factor(keys, &weighting.moments, &w);
        let total = a.lower.norm();
        let found = svd(&a.lower)?;
        let count = found.rank(RANK * w.len().max(a.columns) as f64);
        let mut directions = Orthonormal::new();
        let mut sigma: Vec<f64> = Vec::new();
        for (k, s) in found.sigma.iter().take(count).enumerate() {
            let u: Vec<f64> = found.u.column(k).iter().copied().collect();
            if directions.push(&u).is_ok() {
                sigma.push(*s);
            }
        }
        express::complete(keys, &w, &a.lower, &mut directions, &mut sigma)?;
        let (basis, weights) = express::express(keys, &w, &directions);
        let (before, after) = predicted(&sigma, total);
        let mut predicted = vec![before];
        predicted.extend(after);
        let enough = |e: &f64| tolerance > 0.0 && *e <= tolerance;
        let used = predicted.iter().position(enough).unwrap_or(basis.len());
        let zero = |(i, w): (usize, &f64)| (*w == 0.0).then_some(i);
        Ok(Plan {
            tolerance,
            time_weighted: keys.duration() > 0.0,
            singular_values: sigma,
            basis,
            weights,
            predicted,
            used,
            unseen: weighting
                .weights
                .iter()
                .enumerate()
                .filter_map(zero)
                .collect(),
        })
    }

    /// The numerical rank of the key settings.
    pub fn rank(&self) -> usize {
        self.basis.len()
    }
}

/// The error before any direction is refined, and after each of them: square roots of the sums of
/// squares of the remaining singular values, over `norm`; 0 where that is 0.
fn predicted(sigma: &[f64], norm: f64) -> (f64, Vec<f64>) {
    let mut sum = 0.0;
    let mut error = 0.0;
    let mut after = Vec::with_capacity(sigma.len());
    for s in sigma.iter().rev() {
        after.push(error);
        sum += s * s;
        error = if norm > 0.0 { sum.sqrt() / norm } else { 0.0 };
    }
    after.reverse();
    (error, after)
}
