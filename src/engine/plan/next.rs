//! The next settings to refine, given those refined already.

use super::express::as_setting;
use super::{PlanError, RANK, Weighting, moment, same_shape};
use footlight_show::linalg::{Matrix, Orthonormal, SvdError, svd};
use footlight_show::timeline::KeySequence;

/// The settings worth rendering well, the most useful first; none when the pool spans the sequence.
/// Each is scaled to a largest absolute number of 1, and orthogonal in the metric to `pool` (settings
/// of refined images) and to those before it: the span of the pool is removed from W·A, and the rest
/// decomposed. Directions that are rounding or near the span are refused, not normalised.
///
/// # Errors
/// For a wrong number of weights or settings; for a decomposition that fails its check.
pub fn next(
    keys: &KeySequence,
    pool: &[Vec<f64>],
    weighting: &Weighting,
) -> Result<Vec<Vec<f64>>, PlanError> {
    same_shape(weighting.weights.len(), keys)?;
    let w = weighting.lifted();
    let mut span = Orthonormal::new();
    for setting in pool {
        same_shape(setting.len(), keys)?;
        let weighted: Vec<f64> = setting.iter().zip(&w).map(|(x, w)| x * w).collect();
        // A setting in the span of those before it adds nothing.
        let _ = span.push(&weighted);
    }
    let known = span.vectors().len();
    leading(
        moment::factor(keys, &weighting.moments, &w).lower,
        &mut span,
    )?;
    if !weighting.moments.is_empty() {
        // Light outside the counted moments comes last, weighted by time.
        leading(moment::factor(keys, &[], &w).lower, &mut span)?;
    }
    let directions = span.vectors().iter().skip(known);
    Ok(directions.map(|q| as_setting(q, &w).0).collect())
}

/// Adds the part of the columns of `a` outside a span to the span, the largest first.
fn leading(a: Matrix, span: &mut Orthonormal) -> Result<(), SvdError> {
    let noise = RANK * a.nrows().max(a.ncols()) as f64 * a.norm();
    let mut rest = a;
    for mut column in rest.column_iter_mut() {
        let mut x: Vec<f64> = column.iter().copied().collect();
        span.remove_from(&mut x);
        column.iter_mut().zip(x).for_each(|(to, x)| *to = x);
    }
    let found = svd(&rest)?;
    let large = found.sigma.iter().enumerate().filter(|(_, s)| **s > noise);
    for (k, _) in large {
        let u: Vec<f64> = found.u.column(k).iter().copied().collect();
        // A direction near the span is left out.
        let _ = span.push(&u);
    }
    Ok(())
}
