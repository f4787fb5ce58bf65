//! The hard matrices in three singular value decompositions: this project's, nalgebra's and faer's.
//! `cargo run --release --manifest-path tests/peers/svd/Cargo.toml -- [FOLDER]` prints the failures
//! and writes `svd_peers` (.json, .csv) to the folder.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../../examples/studies/src/dice.rs"]
mod dice;
#[path = "../../../reference/results.rs"]
mod results;
#[path = "../../../stability/methods/mod.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod methods;

use footlight_show::linalg::Matrix;
use footlight_engine::measure::Machine;
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};
use methods::decomposition::{Failures, Solver, failures, nalgebra, ours};
use methods::hard::Found;
use std::path::Path;

fn main() {
    let solvers = [
        ("footlight", ours as Solver),
        ("nalgebra", nalgebra),
        ("faer", faer),
    ];
    let record = table(&solvers.map(|(name, solve)| (name, failures(solve))));
    println!("{}", record.csv());
    if let Some(folder) = std::env::args().nth(1) {
        results::write(Path::new(&folder), "svd_peers", &record, None);
    }
}

/// Without scaling.
fn faer(a: &Matrix) -> Option<Found> {
    if a.is_empty() {
        return None;
    }
    let found = faer::Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)]);
    let found = found.thin_svd().ok()?;
    let dense = |m: faer::MatRef<'_, f64>| Matrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)]);
    let sigma = found.S().column_vector();
    Some(Found {
        u: dense(found.U()),
        sigma: (0..sigma.nrows()).map(|i| sigma[i]).collect(),
        v: dense(found.V()),
    })
}

/// Results of the solvers on the hard matrices: a series for each solver, a point for each family.
fn table(solvers: &[(&str, Vec<Failures>)]) -> Record {
    let mut quantities = vec![Quantity::new("matrices", "")];
    let counted = [
        "no answer",
        "residual",
        "sum of squares",
        "orthogonality",
        "values",
        "small values",
    ];
    quantities.extend(counted.map(|name| Quantity::new(name, "failures")));
    quantities.push(Quantity::new("worst residual", ""));
    quantities.push(Quantity::new("worst value", "of the largest"));
    let origin = Origin {
        subject: "Hard matrices".to_owned(),
        machine: Machine::here(1, None),
    };
    let method = "failure: beyond 16 eps sqrt(mn); truth planted or in double-double arithmetic";
    let mut out = Record::new(StudyKind::Stability, &origin, method, quantities);
    for (solver, families) in solvers {
        for row in families {
            let mut values = vec![Some(row.matrices as f64)];
            values.extend(row.counts.map(|n| Some(n as f64)));
            values.extend([Some(row.residual), Some(row.value)]);
            out.add(solver, row.family, &[], &values);
        }
    }
    out
}
