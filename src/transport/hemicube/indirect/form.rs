//! Rows of form factors, and the interreflections between their elements.
//!
//! Invariant: each product is summed in row order, column by column, so that a column's result does
//! not depend on its neighbours or on the number of threads. This module does not depend on
//! surfaces or lights.

#![allow(
    clippy::indexing_slicing,
    reason = "offsets and columns are made together; columns are elements of the block"
)]

use crate::surfaces::lists::Lists;
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;

/// Rows in each block except the last.
pub const BLOCK: usize = 32;

/// Rows of a sparse matrix: columns in ascending order, with their values.
pub type Block = Lists<(u32, f32)>;

/// Sets `out` to the product of each row with `block`, `width` values for each row.
pub fn times(rows: &Block, block: &[f32], width: usize, out: &mut [f32]) {
    for (row, sums) in out.chunks_exact_mut(width).enumerate() {
        sums.fill(0.0);
        for (column, value) in rows.get(row) {
            let from = &block[*column as usize * width..][..width];
            for k in 0..width {
                sums[k] += value * from[k];
            }
        }
    }
}

/// A sparse matrix without negative values, row by row.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    blocks: Vec<Block>,
    count: usize,
}

impl Rows {
    /// Joins blocks of [`BLOCK`] rows, the last of which may be shorter.
    pub fn of(blocks: Vec<Block>) -> Rows {
        let count = blocks.iter().map(Lists::count).sum();
        Rows { blocks, count }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.blocks.iter().map(Lists::bytes).sum()
    }

    /// The entries of a row.
    pub fn row(&self, i: usize) -> &[(u32, f32)] {
        self.blocks[i / BLOCK].get(i % BLOCK)
    }

    /// The product with a block of `width` columns, row-major: one block row for each row.
    pub fn times(&self, block: &[f32], width: usize) -> Vec<f32> {
        let mut out = vec![0.0; self.count * width];
        if width > 0 {
            out.par_chunks_mut(width * BLOCK)
                .zip(&self.blocks)
                .for_each(|(out, rows)| times(rows, block, width, out));
        }
        out
    }
}

/// Relative error of the iteration.
const REST: f64 = 2e-4;

/// Greatest bound on the share that survives a bounce: above it light is trapped between white
/// walls, and the sum of all bounces has no useful limit.
const TRAPPED: f64 = 0.999_95;

/// Products that improve the bound.
const TRIALS: usize = 8;

/// Number and coefficients of the bounces: Chebyshev's semi-iteration for eigenvalues of
/// reflectance times form factors within plus or minus a bound. Bound and length depend on the rows
/// and reflectances alone; the solution is therefore a fixed polynomial in them and exactly linear
/// in the light.
#[derive(Clone, Copy, Debug)]
pub struct Bounces {
    bound: f64,
    steps: usize,
}

impl Bounces {
    /// For rows between elements of given reflectances. The bound is that of Collatz and Wielandt:
    /// for any positive x and a matrix without negative entries no eigenvalue exceeds the largest
    /// (A x)_i / x_i; a fixed number of products improves x. A white wall in an open scene is thus
    /// cheap, although its reflectance alone would give no bound.
    pub fn new(rows: &Rows, reflectance: &[[f32; 3]]) -> Bounces {
        let most: Vec<f32> = reflectance
            .iter()
            .map(|r| r.iter().copied().fold(0.0, f32::max))
            .collect();
        let mut x = vec![1.0_f32; most.len()];
        let mut bound = f64::INFINITY;
        for _ in 0..TRIALS {
            let mut next = rows.times(&x, 1);
            let mut largest = 0.0_f32;
            for ((y, r), x) in next.iter_mut().zip(&most).zip(&x) {
                *y *= r;
                largest = largest.max(*y / *x);
            }
            bound = bound.min(f64::from(largest));
            // Half of the old vector damps oscillation between two halves of the scene.
            for (y, x) in next.iter_mut().zip(&x) {
                *y = 0.5 * (*y / largest.max(1e-6) + x);
            }
            x = next;
        }
        let bound = (bound * (1.0 + 1e-5)).clamp(0.0, TRAPPED);
        let rate = bound / (1.0 + (1.0 - bound * bound).sqrt());
        let steps = if rate > 1e-6 {
            ((0.5 * REST).ln() / rate.ln()).ceil() as usize
        } else {
            0
        };
        Bounces {
            bound,
            steps: steps.max(1) + 1,
        }
    }

    /// Number of products in a solution.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Solves `B = E + R F B`: radiosities of elements (a block of `width` columns, channels
    /// interleaved) from the initially reflected light `first`, form factors `F` and reflectances
    /// `R`.
    ///
    /// # Errors
    /// On cancel.
    pub fn interreflect(
        &self,
        rows: &Rows,
        first: &[f32],
        reflectance: &[[f32; 3]],
        width: usize,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let quarter = self.bound * self.bound * 0.25;
        // The first step starts from zero and returns the initially reflected light.
        let mut before = vec![0.0_f32; first.len()];
        let mut now = first.to_vec();
        let mut omega = 2.0_f64;
        for step in 1..self.steps {
            work.check()?;
            omega = 1.0 / (1.0 - quarter * omega);
            let mut next = rows.times(&now, width);
            let relax = omega as f32;
            let lines = next
                .par_chunks_mut(width.max(1))
                .with_min_len(64)
                .zip(first.par_chunks(width.max(1)))
                .zip(before.par_chunks(width.max(1)))
                .zip(reflectance);
            lines.for_each(|(((line, first), before), r)| {
                let entries = line.iter_mut().zip(first).zip(before).zip(r.iter().cycle());
                for (((x, e), b), r) in entries {
                    *x = relax * (e + r * *x - b) + b;
                }
            });
            before = now;
            now = next;
            work.progress.report("bounces", step + 1, self.steps);
        }
        Ok(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(all: &[Vec<(u32, f32)>]) -> Rows {
        let block = |rows: &[Vec<(u32, f32)>]| {
            let mut block = Block::default();
            rows.iter().for_each(|row| {
                block.push(row.iter().copied());
            });
            block
        };
        Rows::of(all.chunks(BLOCK).map(block).collect())
    }

    /// n elements with equal form factors: B = E / (1 - rho) for equal E.
    fn closed(n: usize) -> Rows {
        let row: Vec<(u32, f32)> = (0..n as u32).map(|e| (e, 1.0 / n as f32)).collect();
        rows(&vec![row; n])
    }

    fn solve(rows: &Rows, first: &[f32], rho: f32, width: usize) -> Vec<f32> {
        let reflectance = vec![[rho; 3]; first.len() / width];
        let bounces = Bounces::new(rows, &reflectance);
        let work = Work::silent();
        bounces
            .interreflect(rows, first, &reflectance, width, work)
            .unwrap()
    }

    #[test]
    fn closed_room_reaches_its_limit_at_any_reflectance() {
        for rho in [0.0_f32, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999] {
            let exact = 1.0 / (1.0 - rho);
            for x in solve(&closed(40), &[1.0; 40], rho, 1) {
                assert!((x / exact - 1.0).abs() < 5e-4, "{rho}: {x}");
            }
        }
    }

    #[test]
    fn two_facing_plates_bounce_back_and_forth() {
        // Eigenvalues of both signs: F = [[0, f], [f, 0]]; white plates lose light at the sides.
        let plates = rows(&[vec![(1, 0.6)], vec![(0, 0.6)]]);
        for rho in [0.9, 1.0] {
            let b = solve(&plates, &[1.0, 0.0], rho, 1);
            let k = rho * 0.6;
            assert!((b[0] - 1.0 / (1.0 - k * k)).abs() < 3e-4);
            assert!((b[1] - k / (1.0 - k * k)).abs() < 3e-4);
        }
    }

    #[test]
    fn the_bound_is_that_of_the_rows_not_of_the_whitest_wall() {
        let plates = rows(&[vec![(1, 0.2)], vec![(0, 0.2)]]);
        assert!(Bounces::new(&plates, &[[1.0; 3]; 2]).steps() < 8);
        assert!(Bounces::new(&closed(9), &[[0.999; 3]; 9]).steps() > 100);
    }

    #[test]
    fn a_column_does_not_know_its_neighbours() {
        let rows = closed(9);
        let one: Vec<f32> = (0..9).map(|i| i as f32 * 0.37).collect();
        let three: Vec<f32> = one.iter().flat_map(|x| [*x, 7.0, -*x]).collect();
        let alone = solve(&rows, &one, 0.7, 1);
        let among = solve(&rows, &three, 0.7, 3);
        for (i, x) in alone.iter().enumerate() {
            assert_eq!(among[3 * i].to_bits(), x.to_bits());
            assert_eq!(among[3 * i + 2].to_bits(), (-x).to_bits());
        }
    }
}
