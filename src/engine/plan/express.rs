//! Expresses keys in a basis.

use super::{PlanError, weighted_columns};
use footlight_show::linalg::{Matrix, Orthonormal};
use footlight_show::timeline::KeySequence;

/// Tolerance of expressed keys, relative to the largest: a tenth of the promised one.
const EXPRESSED: f64 = 1e-10;
/// The remainder of a weighted key in the span is rounding below this many norms of the key times
/// the square root of its length. A bank without weight counts a millionth: there, rounding of the
/// others' light would look like light of this bank.
const ROUNDING: f64 = 16.0 * f64::EPSILON;
/// Keys processed together as columns of a matrix: 5 times faster than one by one.
const BLOCK: usize = 512;

/// The weighted keys in order, as matrices of at most [`BLOCK`] columns.
fn blocks<'a>(keys: &'a KeySequence, w: &'a [f64]) -> impl Iterator<Item = Matrix> + 'a {
    let chunks = keys.keys().chunks(BLOCK);
    chunks.map(move |chunk| weighted_columns(chunk, w))
}

/// Adds directions, worst key first, until every key is expressed; `lower` is the sequence's factor
/// in the metric.
pub(super) fn complete(
    keys: &KeySequence,
    w: &[f64],
    lower: &Matrix,
    directions: &mut Orthonormal,
    sigma: &mut Vec<f64>,
) -> Result<(), PlanError> {
    let all = keys.keys().iter().flatten();
    let largest = all.fold(0.0f64, |m, x| m.max(x.abs()));
    while directions.vectors().len() < w.len() {
        let (off, key) = worst(keys, w, directions);
        if off <= EXPRESSED * largest {
            return Ok(());
        }
        if directions.push(&key).is_err() {
            let off = off / largest;
            return Err(PlanError::Unverified { off });
        }
        let energy = directions.vectors().last().map_or(0.0, |q| {
            let squares = lower.column_iter().map(|c| {
                let across: f64 = c.iter().zip(q).map(|(x, y)| x * y).sum();
                across * across
            });
            squares.sum::<f64>().sqrt()
        });
        sigma.push(sigma.last().map_or(energy, |s| s.min(energy)));
    }
    Ok(())
}

/// The weighted key with the largest remainder, and that remainder in settings.
fn worst(keys: &KeySequence, w: &[f64], directions: &Orthonormal) -> (f64, Vec<f64>) {
    let basis = directions.matrix(w.len());
    let transposed = basis.transpose();
    let mut out = (0.0, Vec::new());
    for block in blocks(keys, w) {
        let rest = &block - &basis * (&transposed * &block);
        for (rest, key) in rest.column_iter().zip(block.column_iter()) {
            let noise = ROUNDING * (w.len() as f64).sqrt() * key.norm();
            let pairs = rest.iter().zip(w);
            let off = pairs.fold(0.0f64, |m, (x, w)| m.max((x.abs() - noise) / w));
            if off > out.0 {
                out = (off, key.iter().copied().collect());
            }
        }
    }
    out
}

/// Basis settings scaled to a largest number of 1, and each key's weights.
pub(super) fn express(
    keys: &KeySequence,
    w: &[f64],
    directions: &Orthonormal,
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let settings = directions.vectors().iter().map(|q| as_setting(q, w));
    let (basis, scales): (Vec<Vec<f64>>, Vec<f64>) = settings.unzip();
    let transposed = directions.matrix(w.len()).transpose();
    let mut weights = Vec::with_capacity(keys.keys().len());
    for block in blocks(keys, w) {
        let across = &transposed * block;
        // Adding zero turns -0 into 0.
        let scaled = |c: &[f64]| c.iter().zip(&scales).map(|(x, s)| x * s + 0.0).collect();
        weights.extend(across.column_iter().map(|c| scaled(c.as_slice())));
    }
    (basis, weights)
}

/// Converts a direction of weighted light to a setting with a largest number of 1, and its scale.
pub(super) fn as_setting(q: &[f64], w: &[f64]) -> (Vec<f64>, f64) {
    let raw: Vec<f64> = q.iter().zip(w).map(|(x, w)| x / w).collect();
    let scale = raw.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (raw.iter().map(|x| x / scale + 0.0).collect(), scale)
}
