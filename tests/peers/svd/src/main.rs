//! The hard matrices given to three singular value decompositions: this project's, nalgebra's and
//! faer's. `cargo run --release --manifest-path tests/peers/svd/Cargo.toml -- [FOLDER]` prints what
//! fails and writes `svd_peers` (.json, .csv) into the folder.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../reference/results.rs"]
mod results;

use footlight::linalg::Matrix;
use footlight::report;
use footlight::study::stability::decomposition::{Solver, failures, nalgebra, ours};
use footlight::study::stability::hard::Found;
use std::path::Path;

fn main() {
    let solvers = [
        ("footlight", ours as Solver),
        ("nalgebra", nalgebra),
        ("faer", faer),
    ];
    let record = report::stability::failures(&solvers.map(|(name, solve)| (name, failures(solve))));
    println!("{}", record.csv());
    if let Some(folder) = std::env::args().nth(1) {
        results::write(Path::new(&folder), "svd_peers", &record, None);
    }
}

/// Without scaling, as it comes.
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
