//! A triangular factor of a matrix given column by column: Householder QR of the transpose, a block
//! of columns at a time, so that a matrix of any length needs the memory of one block.
//!
//! A block of rows X under a triangle R is reduced by reflections of R's diagonal and X's columns
//! alone, so that everything below R's diagonal stays zero. A panel of reflections is applied
//! together as 1 − V·Tᵀ·Vᵀ (the compact WY form: Schreiber and Van Loan, "A storage-efficient WY
//! representation for products of Householder transformations", 1989), which is several times
//! faster than one at a time.

#![allow(
    clippy::indexing_slicing,
    reason = "matrix indices run over the matrices' own shapes"
)]

use super::Matrix;

/// Reflections applied together.
const PANEL: usize = 32;

/// A lower triangular L with L·Lᵀ = A·Aᵀ, for a matrix A given column by column. It has A's left
/// singular vectors and singular values without its many columns.
#[derive(Clone, Debug)]
pub struct Triangle {
    /// Lᵀ, once there are more columns than rows.
    upper: Option<Matrix>,
    /// Columns of A not yet reduced, as rows.
    block: Matrix,
    waiting: usize,
}

impl Triangle {
    /// Creates the factor of a matrix with this many rows and no columns.
    pub fn new(rows: usize) -> Triangle {
        Triangle {
            upper: None,
            block: Matrix::zeros((2 * rows).max(64), rows),
            waiting: 0,
        }
    }

    /// Adds A's next column; numbers beyond A's rows are ignored, missing ones are zero.
    pub fn push(&mut self, column: &[f64]) {
        let mut row = self.block.row_mut(self.waiting);
        row.fill(0.0);
        row.iter_mut().zip(column).for_each(|(to, x)| *to = *x);
        self.waiting += 1;
        if self.waiting == self.block.nrows() {
            self.take_in();
        }
    }

    /// The factor, with at most as many columns as rows; A itself when A has no more columns than
    /// rows.
    pub fn lower(mut self) -> Matrix {
        let rows = self.block.ncols();
        if self.upper.is_none() && self.waiting <= rows {
            return self.block.rows(0, self.waiting).transpose();
        }
        self.take_in();
        self.upper.map_or(Matrix::zeros(rows, 0), |u| u.transpose())
    }

    fn take_in(&mut self) {
        let n = self.block.ncols();
        let mut x = self.block.rows(0, self.waiting).into_owned();
        let r = self.upper.get_or_insert_with(|| Matrix::zeros(n, n));
        for first in (0..n).step_by(PANEL) {
            let end = (first + PANEL).min(n);
            let tau = reflect_panel(r, &mut x, first, end);
            reflect_rest(r, &mut x, first, &tau);
        }
        self.waiting = 0;
    }
}

/// Zeroes the panel's columns of X by reflections, stores their vectors there, and returns tau of
/// each.
fn reflect_panel(r: &mut Matrix, x: &mut Matrix, first: usize, end: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(end - first);
    for j in first..end {
        let (alpha, size) = (r[(j, j)], x.column(j).norm());
        if size == 0.0 {
            out.push(0.0);
            continue;
        }
        let beta = -alpha.hypot(size).copysign(alpha);
        let tau = (beta - alpha) / beta;
        r[(j, j)] = beta;
        x.column_mut(j).unscale_mut(alpha - beta);
        for l in j + 1..end {
            let (v, mut y) = x.columns_range_pair_mut(j, l);
            let across = tau * (r[(j, l)] + v.dot(&y));
            r[(j, l)] -= across;
            y.axpy(-across, &v, 1.0);
        }
        out.push(tau);
    }
    out
}

/// Applies the panel's reflections to the columns right of it.
fn reflect_rest(r: &mut Matrix, x: &mut Matrix, first: usize, tau: &[f64]) {
    let (n, end) = (r.ncols(), first + tau.len());
    if end == n {
        return;
    }
    let transposed = x.columns(first, tau.len()).transpose();
    let (v, mut right) = x.columns_range_pair_mut(first..end, end..n);
    let mut top = r.view_mut((first, end), (tau.len(), n - end));
    let mut across = top.clone_owned();
    across.gemm(1.0, &transposed, &right, 1.0);
    let across = compact(&(&transposed * &v), tau).transpose() * across;
    top -= &across;
    right.gemm(-1.0, &v, &across, 1.0);
}

/// T of the compact form from the inner products of the vectors.
fn compact(products: &Matrix, tau: &[f64]) -> Matrix {
    let mut t = Matrix::zeros(tau.len(), tau.len());
    for (j, tau) in tau.iter().enumerate() {
        t[(j, j)] = *tau;
        for i in 0..j {
            let sum: f64 = (i..j).map(|k| t[(i, k)] * products[(k, j)]).sum();
            t[(i, j)] = -tau * sum;
        }
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(a: &Matrix) -> Matrix {
        let mut triangle = Triangle::new(a.nrows());
        for column in a.column_iter() {
            triangle.push(column.as_slice());
        }
        triangle.lower()
    }

    #[test]
    fn the_factor_keeps_the_moments_and_is_triangular() {
        // Less than a block, several blocks, more rows than a panel.
        for (m, n) in [(5, 12), (5, 403), (33, 300), (70, 1000), (3, 64)] {
            let a = Matrix::from_fn(m, n, |i, j| ((i * i + j * 3 + i * j) as f64).sin());
            let l = factor(&a);
            assert_eq!(l.shape(), (m, m));
            let moment = &a * a.transpose();
            let off = (&l * l.transpose() - &moment).amax() / moment.amax();
            assert!(off < 4e-15, "{m} x {n}: {off:e}");
            assert!(l.upper_triangle().iter().all(|x| x.is_finite()));
            assert_eq!(l.lower_triangle(), l);
        }
    }

    #[test]
    fn few_columns_are_their_own_factor() {
        for (m, n) in [(0, 0), (4, 0), (4, 3), (4, 4)] {
            let a = Matrix::from_fn(m, n, |i, j| (i + 2 * j) as f64);
            assert_eq!(factor(&a), a);
        }
    }

    #[test]
    fn dark_rows_and_small_singular_values_survive() {
        // Row 2 is dark throughout; direction e1 - e2 has 1e-9 of the light of the other.
        let a = Matrix::from_fn(3, 1000, |i, j| {
            let common = (j as f64).sin();
            let apart = 1e-9 * (3.0 * j as f64).cos();
            [common + apart, common - apart, 0.0][i]
        });
        let (l, exact) = (factor(&a), super::super::svd(&a).unwrap());
        let found = super::super::svd(&l).unwrap();
        assert!((found.sigma[1] / exact.sigma[1] - 1.0).abs() < 1e-6);
        assert_eq!(found.sigma[2], 0.0);
    }
}
