//! Second moments of a sequence, as factors.

#![allow(
    clippy::indexing_slicing,
    reason = "a segment's indices are those of its sequence's keys (timeline's invariant)"
)]

use super::Moment;
use footlight_show::linalg::{Matrix, Triangle, mass_factor};
use footlight_show::timeline::KeySequence;

/// Length of each segment in seconds; all equal when the sequence has none.
fn lengths(keys: &KeySequence) -> Vec<f64> {
    let timeless = keys.duration() <= 0.0;
    let of = |s: &footlight_show::timeline::Segment| if timeless { 1.0 } else { s.duration() };
    keys.segments().iter().map(of).collect()
}

/// Passes the columns of W · [K · chol(h·B)] over all segments to `take`, one for each control
/// point.
fn weighted(keys: &KeySequence, w: &[f64], mut take: impl FnMut(&[f64])) {
    let factors: Vec<Matrix> = (0..=3).map(mass_factor).collect();
    let mut column = vec![0.0; keys.coordinates()];
    for (segment, length) in keys.segments().iter().zip(lengths(keys)) {
        let factor = &factors[segment.degree.min(3)];
        let root = length.sqrt();
        for j in 0..segment.keys.len() {
            column.fill(0.0);
            // Lower triangular: column j has the rows from j on.
            for (i, key) in segment.keys.iter().enumerate().skip(j) {
                let share = root * factor[(i, j)];
                let weighted = keys.keys()[*key].iter().zip(w).map(|(x, w)| w * x * share);
                column.iter_mut().zip(weighted).for_each(|(to, x)| *to += x);
            }
            take(&column);
        }
    }
}

/// The sequence's weighted light as a factor A of its second moment in the metric.
pub(super) struct Factor {
    /// A triangular factor of A·Aᵀ, coordinates x coordinates at most.
    pub lower: Matrix,
    /// Number of columns of A.
    pub columns: usize,
}

/// The factor to decompose: the moments, or without any, the weighted control points by time.
pub(super) fn factor(keys: &KeySequence, moments: &[Moment], w: &[f64]) -> Factor {
    let mut triangle = Triangle::new(keys.coordinates());
    let mut columns = 0;
    let mut push = |column: &[f64]| {
        columns += 1;
        triangle.push(column);
    };
    match moments {
        [] => weighted(keys, w, push),
        some => some.iter().for_each(|moment| push(&moment.weighted(w))),
    }
    Factor {
        lower: triangle.lower(),
        columns,
    }
}
