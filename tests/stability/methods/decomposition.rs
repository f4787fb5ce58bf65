//! Counts failures of singular value decompositions on the hard list of matrices.

#![allow(
    clippy::indexing_slicing,
    reason = "rows are arrays of the length of what is counted"
)]

use super::hard::{Found, Hard, Verdict, judge, list};
use footlight_show::linalg::{Matrix, svd};

/// A decomposition under test; `None` if it has no answer.
pub type Solver = fn(&Matrix) -> Option<Found>;

/// Results of a solver on a family of the hard list.
#[derive(Clone, Debug, PartialEq)]
pub struct Failures {
    /// The family.
    pub family: &'static str,
    /// Number of matrices.
    pub matrices: usize,
    /// Number without an answer, and with a residual, a sum of squares, non-orthogonal vectors,
    /// values and small values beyond rounding.
    pub counts: [usize; 6],
    /// The worst finite residual, relative.
    pub residual: f64,
    /// The worst finite error of a value, over the largest value.
    pub value: f64,
}

/// This project's decomposition.
pub fn ours(a: &Matrix) -> Option<Found> {
    let found = svd(a).ok()?;
    Some(Found {
        u: found.u,
        sigma: found.sigma,
        v: found.v,
    })
}

/// nalgebra's, with its own tolerance and more sweeps than it ever needs. It panics on an empty
/// matrix.
pub fn nalgebra(a: &Matrix) -> Option<Found> {
    if a.is_empty() {
        return None;
    }
    let found = a.clone().try_svd(true, true, 5.0 * f64::EPSILON, 100_000)?;
    Some(Found {
        v: found.v_t?.transpose(),
        u: found.u?,
        sigma: found.singular_values.iter().copied().collect(),
    })
}

/// The failures of a solver by family, on a list with 400 matrices of each random kind.
pub fn failures(solve: Solver) -> Vec<Failures> {
    let all = list(400);
    let families = all.chunk_by(|a, b| a.family == b.family);
    families.map(|same| count(same, solve)).collect()
}

/// Residuals of every matrix, ‖A − UΣVᵀ‖ / ‖A‖ as a multiple of the rounding tolerance, the largest
/// first; infinite without an answer.
pub fn residuals(matrices: &[Hard], solve: Solver) -> Vec<f64> {
    let of = |hard: &Hard| {
        let found = solve(&hard.matrix);
        let residual = found.map(|f| judge(hard, &f).residual);
        residual.filter(|r| !r.is_nan()).unwrap_or(f64::INFINITY)
    };
    let mut out: Vec<f64> = matrices.iter().map(of).collect();
    out.sort_by(|a, b| b.total_cmp(a));
    out
}

fn count(matrices: &[Hard], solve: Solver) -> Failures {
    let mut out = Failures {
        family: matrices[0].family,
        matrices: matrices.len(),
        counts: [0; 6],
        residual: 0.0,
        value: 0.0,
    };
    for hard in matrices {
        let Some(found) = solve(&hard.matrix) else {
            out.counts[0] += 1;
            continue;
        };
        let Verdict {
            residual,
            squares,
            orthogonality,
            values,
            relative,
        } = judge(hard, &found);
        let all = [residual, squares, orthogonality, values, relative];
        for (count, off) in out.counts[1..].iter_mut().zip(all) {
            // NaN fails too.
            *count += usize::from(!matches!(off.partial_cmp(&1.0), Some(o) if o.is_le()));
        }
        let (m, n) = hard.matrix.shape();
        let allowed = 16.0 * f64::EPSILON * ((m * n) as f64).sqrt();
        out.residual = out.residual.max(residual * allowed);
        out.value = out.value.max(values * allowed);
    }
    out
}
