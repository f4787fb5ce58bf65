//! Counts of what fails where singular value decompositions are given the hard list of matrices.

#![allow(
    dead_code,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "each program that includes this uses a part of it, and some report to a reader"
)]

use footlight::linalg::{Matrix, svd};
use footlight::study::{Kind, Machine, Quantity, Record};

use crate::hard::{Found, Hard, Verdict, judge, list};

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

/// Prints and returns the failures of every solver by family.
pub fn failures(solvers: &[(&str, Solver)]) -> Record {
    let mut quantities = vec![Quantity::new("matrices", "")];
    quantities.extend(FAILURES.map(|name| Quantity::new(name, "failures")));
    quantities.push(Quantity::new("worst residual", ""));
    quantities.push(Quantity::new("worst value", "of the largest"));
    let method = "failure: beyond 16 eps sqrt(mn); truth planted or in double-double arithmetic";
    let machine = Machine::here(1, None);
    let mut record = Record::new(
        Kind::Stability,
        "Hard matrices",
        machine,
        method,
        quantities,
    );
    let all = list(400);
    for (solver, solve) in solvers {
        println!(
            "\n{solver:<27} matrices  {}  worst residual  worst value",
            FAILURES.join("  ")
        );
        for same in all.chunk_by(|a, b| a.family == b.family) {
            let row = count(same, *solve);
            print(same[0].family, &row);
            record.add(solver, same[0].family, &[], &row.map(Some));
        }
    }
    record
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

fn print(family: &str, row: &[f64; 9]) {
    let mut line = format!("{family:<27} {:>8}", row[0]);
    for (count, name) in row[1..7].iter().zip(FAILURES) {
        line += &format!("  {:>width$}", count, width = name.len());
    }
    println!("{line}  {:>14.1e}  {:>11.1e}", row[7], row[8]);
}
