//! Counts of what fails where singular value decompositions are given the hard list of matrices.

#![allow(
    clippy::indexing_slicing,
    reason = "rows are arrays of the length of what is counted"
)]

use super::hard::{Found, Hard, Verdict, judge, list};
use crate::linalg::{Matrix, svd};
use crate::study::{Kind, Machine, Quantity, Record};

/// A decomposition on trial; `None` where it has no answer.
pub type Solver = fn(&Matrix) -> Option<Found>;

/// What is counted, in the order of the columns.
const FAILURES: [&str; 6] = [
    "no answer",
    "residual",
    "sum of squares",
    "orthogonality",
    "values",
    "small values",
];

/// This project's.
pub fn ours(a: &Matrix) -> Option<Found> {
    let found = svd(a).ok()?;
    Some(Found {
        u: found.u,
        sigma: found.sigma,
        v: found.v,
    })
}

/// With its own tolerance and more sweeps than it ever needs. An empty matrix it takes for a fault.
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

/// The failures of every solver by family.
pub fn failures(solvers: &[(&str, Solver)]) -> Record {
    let mut quantities = vec![Quantity::new("matrices", "")];
    quantities.extend(FAILURES.map(|name| Quantity::new(name, "failures")));
    quantities.push(Quantity::new("worst residual", ""));
    quantities.push(Quantity::new("worst value", "of the largest"));
    let method = "failure: beyond 16 eps sqrt(mn); truth planted or in double-double arithmetic";
    let machine = Machine::here(1, None);
    let subject = "Hard matrices";
    let mut record = Record::new(Kind::Stability, subject, machine, method, quantities);
    let all = list(400);
    for (solver, solve) in solvers {
        for same in all.chunk_by(|a, b| a.family == b.family) {
            let row = count(same, *solve);
            record.add(solver, same[0].family, &[], &row.map(Some));
        }
    }
    record
}

/// Residuals of every matrix, ‖A − UΣVᵀ‖ / ‖A‖ as a multiple of what rounding may explain, the
/// largest first; infinite where there is no answer.
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

/// How many, each failure, worst residual and worst value (both finite ones).
fn count(matrices: &[Hard], solve: Solver) -> [f64; 9] {
    let mut out = [0.0; 9];
    for hard in matrices {
        out[0] += 1.0;
        let Some(found) = solve(&hard.matrix) else {
            out[1] += 1.0;
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
        for (count, off) in out[2..7].iter_mut().zip(all) {
            // Not-a-number fails too.
            *count += f64::from(u8::from(
                !matches!(off.partial_cmp(&1.0), Some(o) if o.is_le()),
            ));
        }
        let (m, n) = hard.matrix.shape();
        let allowed = 16.0 * f64::EPSILON * ((m * n) as f64).sqrt();
        for (worst, off) in out[7..].iter_mut().zip([residual, values]) {
            *worst = f64::max(*worst, off * allowed);
        }
    }
    out
}
