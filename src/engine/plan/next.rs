//! The next settings to refine, given those refined already.

use super::express::as_setting;
use super::{PlanError, RANK, Weighting, moment, predicted, same_shape};
use footlight_show::linalg::{Dependent, Matrix, Orthonormal, SvdError, svd};
use footlight_show::timeline::KeySequence;

/// A setting worth rendering well.
#[derive(Clone, Debug, PartialEq)]
pub struct Direction {
    /// The setting, scaled to a largest absolute number of 1; orthogonal in the metric to the pool
    /// and to the directions before it.
    pub setting: Vec<f64>,
    /// Its weighted light times the square root of seconds.
    pub singular_value: f64,
    /// Predicted error of the sequence after refining it and those before it.
    pub error: f64,
}

/// The remaining directions, the most useful first.
#[derive(Clone, Debug, PartialEq)]
pub struct NextSteps {
    /// Predicted error with the current pool.
    pub error: f64,
    /// The directions; none when the pool spans the sequence.
    pub directions: Vec<Direction>,
    /// Settings of the pool in the span of those before them (`index` counts the pool): they add
    /// nothing.
    pub refused: Vec<Dependent>,
}

/// Orders the part of the sequence outside `pool` (settings of refined images): its span is removed
/// from W·A, and the rest decomposed. Directions that are rounding or near the span are refused,
/// not normalised. `norm` as in [`super::Plan::new`].
///
/// # Errors
/// For a wrong number of weights or settings; for a decomposition that fails its check.
pub fn next(
    keys: &KeySequence,
    pool: &[Vec<f64>],
    weighting: &Weighting,
    norm: Option<f64>,
) -> Result<NextSteps, PlanError> {
    same_shape(weighting.weights.len(), keys)?;
    let w = weighting.lifted();
    let a = moment::factor(keys, &weighting.moments, &w).lower;
    let total = a.norm();
    let (mut span, refused) = span(keys, pool, &w)?;
    let known = span.vectors().len();
    let mut sigma = leading(a, &mut span)?;
    if !weighting.moments.is_empty() {
        // Light outside the counted moments comes last, weighted by time.
        let others = leading(moment::factor(keys, &[], &w).lower, &mut span)?;
        sigma.extend(others.iter().map(|_| 0.0));
    }
    let directions = span.vectors().iter().skip(known);
    let settings: Vec<Vec<f64>> = directions.map(|q| as_setting(q, &w).0).collect();
    let (error, after) = predicted(&sigma, norm.unwrap_or(total));
    let directions = settings.into_iter().zip(sigma).zip(after);
    Ok(NextSteps {
        error,
        directions: directions
            .map(|((setting, singular_value), error)| Direction {
                setting,
                singular_value,
                error,
            })
            .collect(),
        refused,
    })
}

/// Adds the part of the columns of `a` outside a span to the span, the largest first; returns its
/// singular values.
fn leading(a: Matrix, span: &mut Orthonormal) -> Result<Vec<f64>, SvdError> {
    let noise = RANK * a.nrows().max(a.ncols()) as f64 * a.norm();
    let mut rest = a;
    for mut column in rest.column_iter_mut() {
        let mut x: Vec<f64> = column.iter().copied().collect();
        span.remove_from(&mut x);
        column.iter_mut().zip(x).for_each(|(to, x)| *to = x);
    }
    let found = svd(&rest)?;
    let mut sigma = Vec::new();
    for (k, s) in found.sigma.iter().enumerate().filter(|(_, s)| **s > noise) {
        let u: Vec<f64> = found.u.column(k).iter().copied().collect();
        if span.push(&u).is_ok() {
            sigma.push(*s);
        }
    }
    Ok(sigma)
}

/// An orthonormal basis of the weighted pool, and the refused settings.
pub(super) fn span(
    keys: &KeySequence,
    pool: &[Vec<f64>],
    w: &[f64],
) -> Result<(Orthonormal, Vec<Dependent>), PlanError> {
    let mut span = Orthonormal::new();
    let mut refused = Vec::new();
    for setting in pool {
        same_shape(setting.len(), keys)?;
        let weighted: Vec<f64> = setting.iter().zip(w).map(|(x, w)| x * w).collect();
        if let Err(dependent) = span.push(&weighted) {
            refused.push(dependent);
        }
    }
    Ok((span, refused))
}
