//! Decompositions and orthogonal bases where methods fail:
//! `cargo run --release --example svd_study -- [FOLDER]`.
//!
//! Gives the hard list of matrices to this project's singular value decomposition and to nalgebra's
//! own (`tests/peers/svd` to faer's too) and counts what fails: no answer, the residual, the sum of
//! squares, orthogonality, the values themselves, small values of graded columns. "Fails" is more
//! than rounding explains, 16·eps·sqrt(mn). Then the loss of orthogonality against the condition number for four ways to
//! orthogonalise. Into the folder go `svd` (.json, .csv) and `orthogonality` (with .png and .svg).

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../tests/reference/extended.rs"]
mod extended;
#[path = "../tests/reference/failures.rs"]
mod failures;
#[path = "../tests/reference/gram_schmidt.rs"]
mod gram_schmidt;
#[path = "../tests/reference/hard.rs"]
mod hard;
#[path = "../tests/reference/results.rs"]
mod results;

use failures::{failures, nalgebra, ours};
use footlight::chart::{self, Axis, Marker, Panel, Scale, Theme};
use footlight::study::{Kind, Machine, Quantity, Record};
use gram_schmidt::{WAYS, condition, families, loss};
use std::path::Path;

fn main() {
    let folder = std::env::args().nth(1);
    let folder = folder.as_deref().map(Path::new);
    let record = failures(&[("footlight", ours), ("nalgebra", nalgebra)]);
    if let Some(folder) = folder {
        results::write(folder, "svd", &record, None);
    }
    let record = orthogonality();
    if let Some(folder) = folder {
        let chart = chart::panels("Loss of orthogonality", &panels(&record), Theme::Light);
        results::write(folder, "orthogonality", &record, Some(&chart));
    }
}

/// Loss of orthogonality of every way on every family.
fn orthogonality() -> Record {
    let mut quantities = vec![Quantity::new("condition", "")];
    quantities.extend(WAYS.map(|(name, _)| Quantity::new(name, "")));
    let method = "Frobenius norm of Q'Q - 1; condition numbers in double-double arithmetic";
    let machine = Machine::here(1, None);
    let subject = "Orthogonalising";
    let mut record = Record::new(Kind::Stability, subject, machine, method, quantities);
    for (family, matrices) in families() {
        for (i, a) in matrices.iter().enumerate() {
            let mut row = vec![Some(condition(a))];
            row.extend(WAYS.map(|(_, way)| Some(loss(&way(a)))));
            record.add(family, &format!("{family} {}", i + 1), &[], &row);
        }
    }
    record
}

fn panels(record: &Record) -> Vec<Panel> {
    let markers = [
        Marker::Circle,
        Marker::Square,
        Marker::Diamond,
        Marker::Triangle,
    ];
    let series = |family: &footlight::study::Series| {
        let curve = |((name, _), marker): (&(&str, _), Marker)| chart::Series {
            name: (*name).to_owned(),
            points: record.curve(family, "condition", name),
            marker,
            labels: Vec::new(),
        };
        WAYS.iter().zip(markers).map(curve).collect()
    };
    let panel = |family: &footlight::study::Series| Panel {
        title: family.name.clone(),
        x: Axis::new("condition number", Scale::Log),
        y: Axis::new("loss of orthogonality", Scale::Log),
        series: series(family),
        reference: None,
    };
    record.series.iter().map(panel).collect()
}
