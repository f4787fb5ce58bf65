//! The singular value decomposition, with verification.
//!
//! nalgebra's own SVD is silently wrong on many matrices with equal or proportional columns, which
//! shows produce: U and V are orthonormal, but the residual is not zero (`tests/peers/svd`
//! compares). Here its V is only a starting point: one-sided Jacobi on A·V (Hestenes 1958;
//! convergence and accuracy as in Demmel and Veselić 1992) makes the columns orthogonal and keeps
//! small singular values to relative accuracy. The result is checked against the definition. If the
//! check fails, a second attempt starts from A itself; if that fails too, the function returns an
//! error.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over the matrices' own shapes"
)]

use super::Matrix;

/// A = U · diag(sigma) · Vᵀ with k = min(rows, columns).
#[derive(Clone, Debug, PartialEq)]
pub struct Svd {
    /// rows x k, orthonormal columns; the first of the largest entries of each is positive.
    pub u: Matrix,
    /// k singular values, descending, finite, not negative.
    pub sigma: Vec<f64>,
    /// columns x k, orthonormal columns.
    pub v: Matrix,
}

/// Reasons for a failed decomposition.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SvdError {
    /// An entry is not a number or infinite.
    #[error("entry ({row}, {column}) of the matrix is {value}")]
    NotFinite {
        /// Row, from 0.
        row: usize,
        /// Column, from 0.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The largest singular value is beyond the largest double.
    #[error("the largest singular value is beyond the range of a double")]
    Overflow,
    /// The sweeps did not converge.
    #[error("Jacobi's sweeps did not converge on the {rows} x {columns} matrix")]
    NoConvergence {
        /// Rows of the matrix.
        rows: usize,
        /// Columns of the matrix.
        columns: usize,
    },
    /// The result is not a decomposition of the input.
    #[error("the decomposition fails its check: {what} is off by {off:e}, allowed {allowed:e}")]
    Unverified {
        /// The property that fails.
        what: &'static str,
        /// Its deviation.
        off: f64,
        /// The deviation that rounding may explain.
        allowed: f64,
    },
}

/// Unit roundoff.
const U: f64 = f64::EPSILON / 2.0;
/// Tolerance of the checks, in eps·sqrt(mn).
const SLACK: f64 = 16.0;
/// Exponent at which Jacobi works: squares of columns from 1e-295 of the largest then neither
/// overflow nor vanish.
const LIFT: i32 = 480;
/// Columns below this norm, at that exponent, count as zero.
const NOTHING: f64 = 1e-147;
/// A column below this share of the largest makes the matrix graded.
const GRADED: f64 = 1e-3;
/// Sweeps before giving up; prepared matrices take two or three, others about ten.
const SWEEPS: usize = 60;

impl Svd {
    /// Number of singular values above `tolerance` times the largest; the tolerance is at least eps
    /// · max(rows, columns).
    pub fn rank(&self, tolerance: f64) -> usize {
        let floor = f64::EPSILON * self.u.nrows().max(self.v.nrows()) as f64;
        let largest = self.sigma.first().copied().unwrap_or(0.0);
        let limit = tolerance.max(floor) * largest;
        self.sigma.iter().take_while(|s| **s > limit).count()
    }
}

/// Returns the verified singular value decomposition of `a`.
///
/// Guarantees, with t = 16·eps·sqrt(mn): ‖UᵀU − 1‖ and ‖VᵀV − 1‖ at most t, ‖A − UΣVᵀ‖ at most
/// t·‖A‖, |Σσ² − ‖A‖²| at most t·‖A‖² (all in the Frobenius norm), σ sorted and finite.
///
/// # Errors
/// See [`SvdError`].
pub fn svd(a: &Matrix) -> Result<Svd, SvdError> {
    let (m, n) = a.shape();
    for column in 0..n {
        for row in 0..m {
            let value = a[(row, column)];
            if !value.is_finite() {
                return Err(SvdError::NotFinite { row, column, value });
            }
        }
    }
    let k = m.min(n);
    let largest = a.iter().fold(0.0f64, |s, x| s.max(x.abs()));
    if k == 0 || largest == 0.0 {
        return Ok(Svd {
            u: Matrix::identity(m, k),
            sigma: vec![0.0; k],
            v: Matrix::identity(n, k),
        });
    }
    let exponent = exponent_of(largest);
    let mut tall = scaled(a, -exponent);
    if m < n {
        tall = tall.transpose();
    }
    let mut found = decompose_and_verify(&tall, prepared(&tall))
        .or_else(|_| decompose_and_verify(&tall, None))?;
    if m < n {
        std::mem::swap(&mut found.u, &mut found.v);
    }
    fix_signs(&mut found);
    for s in &mut found.sigma {
        *s = times_power(*s, exponent);
    }
    if found.sigma.iter().any(|s| !s.is_finite()) {
        return Err(SvdError::Overflow);
    }
    Ok(found)
}

/// The e with 2^e <= x < 2^(e+1), subnormal x included.
fn exponent_of(x: f64) -> i32 {
    let mut e = 0;
    let mut x = x;
    if x < f64::MIN_POSITIVE {
        x *= 2f64.powi(100);
        e = -100;
    }
    e + ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// x · 2^e in two multiplications, because 2^e alone may be out of range.
fn times_power(x: f64, e: i32) -> f64 {
    let half = e / 2;
    x * 2f64.powi(half) * 2f64.powi(e - half)
}

fn scaled(a: &Matrix, e: i32) -> Matrix {
    a.map(|x| times_power(x, e))
}

/// nalgebra's V as a starting point, if it converges. Not used for graded columns: its rounding,
/// relative to the largest column, would spoil small singular values.
fn prepared(a: &Matrix) -> Option<Matrix> {
    let norms = column_norms(a);
    let largest = norms.iter().fold(0.0f64, |s, x| s.max(*x));
    if norms.iter().any(|x| *x != 0.0 && *x < GRADED * largest) {
        return None;
    }
    let bound = 100 * a.nrows().max(a.ncols()) + 1000;
    let svd = a.clone().try_svd(false, true, f64::EPSILON, bound)?;
    let v = svd.v_t?.transpose();
    let square = v.shape() == (a.ncols(), a.ncols());
    (square && v.iter().all(|x| x.is_finite())).then_some(v)
}

fn decompose_and_verify(a: &Matrix, start: Option<Matrix>) -> Result<Svd, SvdError> {
    let found = jacobi(a, start)?;
    verify(a, &found)?;
    Ok(found)
}

/// One-sided Jacobi on a tall matrix whose largest entry is between 1 and 2, starting from A·V.
fn jacobi(a: &Matrix, start: Option<Matrix>) -> Result<Svd, SvdError> {
    let (m, n) = a.shape();
    let lift = 2f64.powi(LIFT);
    // A running estimate of each column's rounding error, added in quadrature. Below four times
    // this estimate a column is noise, and rotating noise never ends.
    let (mut w, mut v, mut noise) = match start {
        Some(v) => {
            let magnitude = a.abs() * v.abs();
            let noise = column_norms(&magnitude)
                .iter()
                .map(|x| U * lift * x)
                .collect();
            (a * &v * lift, v, noise)
        }
        None => (a * lift, Matrix::identity(n, n), vec![0.0; n]),
    };
    let mut norms = column_norms(&w);
    let tolerance = 4.0 * (m as f64).sqrt() * U;
    let mut rotated = true;
    let mut sweep = 0;
    while rotated {
        if sweep == SWEEPS {
            return Err(SvdError::NoConvergence {
                rows: m,
                columns: n,
            });
        }
        sweep += 1;
        rotated = false;
        for p in 0..n {
            for q in p + 1..n {
                silence(&mut w, &mut norms, &noise, p);
                silence(&mut w, &mut norms, &noise, q);
                let (a, b) = (norms[p], norms[q]);
                if a == 0.0 || b == 0.0 {
                    continue;
                }
                let cosine = w.column(p).dot(&w.column(q)) / a / b;
                if cosine.abs() <= tolerance {
                    continue;
                }
                rotated = true;
                let (c, s) = rotation(a, b, cosine);
                rotate(&mut w, p, q, c, s);
                rotate(&mut v, p, q, c, s);
                let added = |x: f64, y: f64| U * x.hypot(y);
                let (np, nq) = (noise[p], noise[q]);
                noise[p] = (c * np).hypot(s * nq).hypot(added(c * a, s * b));
                noise[q] = (s * np).hypot(c * nq).hypot(added(s * a, c * b));
                norms[p] = w.column(p).norm();
                norms[q] = w.column(q).norm();
            }
        }
    }
    Ok(assemble(&w, &v, &norms, 2f64.powi(-LIFT)))
}

/// Sets a noise column to zero.
fn silence(w: &mut Matrix, norms: &mut [f64], noise: &[f64], j: usize) {
    if norms[j] != 0.0 && norms[j] <= (4.0 * noise[j]).max(NOTHING) {
        w.column_mut(j).fill(0.0);
        norms[j] = 0.0;
    }
}

/// Cosine and sine of the rotation that makes two columns of norms `a` and `b` orthogonal.
fn rotation(a: f64, b: f64, cosine: f64) -> (f64, f64) {
    let zeta = 0.5 * (b / a - a / b) / cosine;
    let t = 1f64.copysign(zeta) / (zeta.abs() + 1f64.hypot(zeta));
    let c = 1.0 / 1f64.hypot(t);
    (c, c * t)
}

fn rotate(w: &mut Matrix, p: usize, q: usize, c: f64, s: f64) {
    let m = w.nrows();
    let (left, right) = w.as_mut_slice().split_at_mut(q * m);
    let first = &mut left[p * m..(p + 1) * m];
    for (x, y) in first.iter_mut().zip(&mut right[..m]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

fn column_norms(a: &Matrix) -> Vec<f64> {
    a.column_iter().map(|c| c.norm()).collect()
}

/// Sorts, normalises, and completes null columns of U.
fn assemble(w: &Matrix, v: &Matrix, norms: &[f64], drop: f64) -> Svd {
    let (m, n) = w.shape();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|i, j| norms[*j].total_cmp(&norms[*i]).then(i.cmp(j)));
    let mut out = Svd {
        u: Matrix::zeros(m, n),
        sigma: Vec::with_capacity(n),
        v: Matrix::zeros(n, n),
    };
    for (k, j) in order.into_iter().enumerate() {
        out.v.set_column(k, &v.column(j));
        out.sigma.push(norms[j] * drop);
        if norms[j] == 0.0 {
            complete(&mut out.u, k);
        } else {
            out.u.set_column(k, &(w.column(j) / norms[j]));
        }
    }
    out
}

/// Makes column `k` of `u` a unit vector orthogonal to the columns before it: the coordinate axis
/// that they cover least, orthogonalised twice. At least 1/sqrt(m) of its norm is left.
fn complete(u: &mut Matrix, k: usize) {
    let m = u.nrows();
    let covered = |i: usize| (0..k).map(|j| u[(i, j)] * u[(i, j)]).sum::<f64>();
    let cover: Vec<f64> = (0..m).map(covered).collect();
    let axis = (0..m).min_by(|i, j| cover[*i].total_cmp(&cover[*j]));
    let mut x = vec![0.0; m];
    if let Some(axis) = axis {
        x[axis] = 1.0;
    }
    let mut x = nalgebra::DVector::from_vec(x);
    for _ in 0..2 {
        for j in 0..k {
            let c = u.column(j).dot(&x);
            x.axpy(-c, &u.column(j), 1.0);
        }
        let norm = x.norm();
        x /= norm;
    }
    u.set_column(k, &x);
}

/// Makes the first entry that is (nearly) the largest of each column of U positive; "nearly", so
/// that another machine's rounding picks the same entry.
fn fix_signs(svd: &mut Svd) {
    for k in 0..svd.sigma.len() {
        let column = svd.u.column(k);
        let largest = column.amax();
        let first = column.iter().find(|x| x.abs() >= largest * (1.0 - 1e-8));
        if first.is_some_and(|x| *x < 0.0) {
            svd.u.column_mut(k).neg_mut();
            svd.v.column_mut(k).neg_mut();
        }
    }
}

fn verify(a: &Matrix, svd: &Svd) -> Result<(), SvdError> {
    let (m, n) = a.shape();
    let allowed = SLACK * f64::EPSILON * ((m * n) as f64).sqrt();
    let check = |what, off: f64| {
        // NaN fails too.
        if off <= allowed {
            Ok(())
        } else {
            Err(SvdError::Unverified { what, off, allowed })
        }
    };
    let identity = Matrix::identity(n, n);
    check("U", (svd.u.transpose() * &svd.u - &identity).norm())?;
    check("V", (svd.v.transpose() * &svd.v - &identity).norm())?;
    let mut product = svd.u.clone();
    for (k, s) in svd.sigma.iter().enumerate() {
        product.column_mut(k).scale_mut(*s);
    }
    let norm = a.norm();
    check(
        "the residual",
        (product * svd.v.transpose() - a).norm() / norm,
    )?;
    let squares: f64 = svd.sigma.iter().map(|s| s * s).sum();
    check(
        "the sum of squares",
        (squares - norm * norm).abs() / (norm * norm),
    )?;
    let sorted = svd.sigma.windows(2).all(|w| w[0] >= w[1]);
    check("the order", if sorted { 0.0 } else { f64::INFINITY })
}

#[cfg(test)]
#[path = "svd_test.rs"]
mod tests;
