//! Rows of form factors in compressed storage, and their products with blocks of columns.
//!
//! Invariant: each product is summed in the order of the row, column by column, so that a
//! column's result does not depend on its neighbours or on the number of threads. This room knows
//! nothing of surfaces or lights.

#![allow(
    clippy::indexing_slicing,
    reason = "offsets and columns are checked when rows are appended"
)]

use crate::transport::hemicube::Row;
use rayon::prelude::*;

/// A sparse matrix, row by row.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    offsets: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f32>,
}

impl Rows {
    /// From rows whose columns rise.
    pub fn new(rows: &[Row]) -> Rows {
        let mut out = Rows {
            offsets: vec![0],
            ..Rows::default()
        };
        for row in rows {
            out.columns.extend(row.iter().map(|e| e.0));
            out.values.extend(row.iter().map(|e| e.1));
            out.offsets.push(out.columns.len());
        }
        out
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.offsets.len() * 8 + self.columns.len() * 8
    }

    /// The product with a block of `width` columns, row-major: one block row for each row.
    pub fn times(&self, block: &[f32], width: usize) -> Vec<f32> {
        let rows = self.offsets.len().saturating_sub(1);
        let mut out = vec![0.0; rows * width];
        if width == 0 {
            return out;
        }
        out.par_chunks_mut(width)
            .with_min_len(16)
            .enumerate()
            .for_each(|(i, sums)| {
                let range = self.offsets[i]..self.offsets[i + 1];
                for (&c, &value) in self.columns[range.clone()].iter().zip(&self.values[range]) {
                    let from = c as usize * width;
                    for (sum, x) in sums.iter_mut().zip(&block[from..from + width]) {
                        *sum += value * x;
                    }
                }
            });
        out
    }
}

/// How many steps of [`interreflect`] bring the rest below 1e-4 of the whole, for reflectances up
/// to `bound`; between 8 and 300.
pub fn steps(bound: f64) -> usize {
    let root = (1.0 - bound * bound).sqrt();
    // The error of the iteration falls by this factor a step.
    let rate = bound / (1.0 + root);
    let needed = if rate > 0.0 {
        (0.5e-4_f64).ln() / rate.ln()
    } else {
        0.0
    };
    (needed.ceil() as usize).clamp(8, 300)
}

/// Solves `B = E + R F B`: radiosities of elements (a block of `width` columns) from the light
/// `first` that they reflect at first, form factors `F` and reflectances `R` (one for each entry
/// of the block), by Chebyshev's semi-iteration. Its bounds and length depend on `bound`, the
/// largest reflectance, alone: a fixed polynomial in `R F`, hence exactly linear in `first`.
pub fn interreflect(
    rows: &Rows,
    first: &[f32],
    reflectance: &[f32],
    width: usize,
    bound: f64,
) -> Vec<f32> {
    let bound = bound.min(0.9999);
    let mut before = vec![0.0_f32; first.len()];
    let mut now = first.to_vec();
    let mut omega = 1.0_f64;
    for step in 1..steps(bound) {
        omega = if step == 1 {
            1.0 / (1.0 - bound * bound * 0.5)
        } else {
            1.0 / (1.0 - bound * bound * omega * 0.25)
        };
        let mut next = rows.times(&now, width);
        let relax = omega as f32;
        next.par_iter_mut()
            .with_min_len(4096)
            .zip(first)
            .zip(reflectance)
            .zip(&before)
            .for_each(|(((x, e), r), b)| *x = relax * (e + r * *x - b) + b);
        before = now;
        now = next;
    }
    now
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n elements that see each other alike: B = E / (1 - rho) for equal E.
    fn closed(n: usize) -> Rows {
        let row: Row = (0..n as u32).map(|e| (e, 1.0 / n as f32)).collect();
        Rows::new(&vec![row; n])
    }

    #[test]
    fn closed_room_reaches_its_limit_at_any_reflectance() {
        for rho in [0.0_f32, 0.2, 0.5, 0.8, 0.95, 0.99] {
            let n = 40;
            let b = interreflect(&closed(n), &vec![1.0; n], &vec![rho; n], 1, f64::from(rho));
            let exact = 1.0 / (1.0 - rho);
            for x in b {
                assert!((x / exact - 1.0).abs() < 2e-4, "{rho}: {x}");
            }
        }
    }

    #[test]
    fn two_facing_plates_bounce_back_and_forth() {
        // Eigenvalues of both signs: F = [[0, f], [f, 0]].
        let rows = Rows::new(&[vec![(1, 0.6)], vec![(0, 0.6)]]);
        let b = interreflect(&rows, &[1.0, 0.0], &[0.9, 0.9], 1, 0.9);
        let k = 0.9 * 0.6;
        assert!((b[0] - 1.0 / (1.0 - k * k)).abs() < 1e-4);
        assert!((b[1] - k / (1.0 - k * k)).abs() < 1e-4);
    }

    #[test]
    fn a_column_does_not_know_its_neighbours() {
        let rows = closed(9);
        let one: Vec<f32> = (0..9).map(|i| i as f32 * 0.37).collect();
        let three: Vec<f32> = one.iter().flat_map(|x| [*x, 7.0, -*x]).collect();
        let alone = interreflect(&rows, &one, &[0.7; 9], 1, 0.7);
        let among = interreflect(&rows, &three, &[0.7; 27], 3, 0.7);
        for (i, x) in alone.iter().enumerate() {
            assert_eq!(among[3 * i].to_bits(), x.to_bits());
            assert_eq!(among[3 * i + 2].to_bits(), (-x).to_bits());
        }
    }
}
