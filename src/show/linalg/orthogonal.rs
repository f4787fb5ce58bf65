//! Orthogonal bases by modified Gram-Schmidt with reorthogonalisation, least squares by Householder
//! QR.
//!
//! Classical Gram-Schmidt loses orthogonality with the square of the condition number, modified
//! Gram-Schmidt with its first power; two passes are enough (Giraud, Langou and Rozloznik 2005). A
//! vector whose norm falls below 10u of its former norm in the second pass lies in the span to
//! rounding, and is refused. `examples/stability` compares the methods.

#![allow(
    clippy::indexing_slicing,
    reason = "matrix indices run over the matrix's own shape"
)]

use super::Matrix;

/// A vector that keeps less than this share of its norm is in the span.
const IN_SPAN: f64 = 10.0 * (f64::EPSILON / 2.0);

/// A vector in the span of those before it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "vector {index} lies in the span of those before it (norm {before:e}, outside it {after:e})"
)]
pub struct Dependent {
    /// Index of the vector, in the order given.
    pub index: usize,
    /// Its norm.
    pub before: f64,
    /// The norm of its part outside the span.
    pub after: f64,
}

/// An orthonormal set of vectors of one length, grown one by one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Orthonormal {
    vectors: Vec<Vec<f64>>,
    offered: usize,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Euclidean norm, scaled so that no square overflows or vanishes.
fn norm(a: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    let sum: f64 = a.iter().map(|x| (x / largest) * (x / largest)).sum();
    largest * sum.sqrt()
}

impl Orthonormal {
    /// The empty set.
    pub fn new() -> Orthonormal {
        Orthonormal::default()
    }

    /// Its vectors as columns of a matrix with this many rows.
    pub fn matrix(&self, rows: usize) -> Matrix {
        let mut out = Matrix::zeros(rows, self.vectors.len());
        for (mut column, vector) in out.column_iter_mut().zip(&self.vectors) {
            column.iter_mut().zip(vector).for_each(|(to, x)| *to = *x);
        }
        out
    }

    /// Its vectors.
    pub fn vectors(&self) -> &[Vec<f64>] {
        &self.vectors
    }

    /// Removes the component in the span from `vector`, in two passes.
    pub fn remove_from(&self, vector: &mut [f64]) {
        for _ in 0..2 {
            for q in &self.vectors {
                let c = dot(q, vector);
                vector.iter_mut().zip(q).for_each(|(x, y)| *x -= c * y);
            }
        }
    }

    /// Adds the normalised part of `vector` outside the span.
    ///
    /// # Errors
    /// [`Dependent`] when only rounding is outside (or for a zero vector); the set is unchanged.
    pub fn push(&mut self, vector: &[f64]) -> Result<(), Dependent> {
        let index = self.offered;
        self.offered += 1;
        let before = norm(vector);
        let refused = |after| Dependent {
            index,
            before,
            after,
        };
        if before == 0.0 || !before.is_finite() {
            return Err(refused(0.0));
        }
        // Scale first, so that the products neither overflow nor vanish.
        let mut rest: Vec<f64> = vector.iter().map(|x| x / before).collect();
        self.remove_from(&mut rest);
        let after = norm(&rest);
        if after < IN_SPAN {
            return Err(refused(after * before));
        }
        rest.iter_mut().for_each(|x| *x /= after);
        // Normalising magnifies the remainder of the passes; one more pass on the unit vector
        // removes it.
        self.remove_from(&mut rest);
        let unit = norm(&rest);
        rest.iter_mut().for_each(|x| *x /= unit);
        self.vectors.push(rest);
        Ok(())
    }
}

/// The x that makes ‖A·x − B‖ least, column by column of B, by Householder QR.
///
/// # Errors
/// [`Dependent`] for the first column of A that lies in the span of those before it.
pub fn least_squares(a: &Matrix, b: &Matrix) -> Result<Matrix, Dependent> {
    let (m, n) = a.shape();
    if n == 0 {
        return Ok(Matrix::zeros(0, b.ncols()));
    }
    let refused = |index: usize, after: f64| Dependent {
        index,
        before: a.column(index).norm(),
        after,
    };
    if m < n {
        return Err(refused(m, 0.0));
    }
    let qr = a.clone().qr();
    let r = qr.r();
    for j in 0..n {
        let rest = r[(j, j)].abs();
        if rest <= IN_SPAN * a.column(j).norm() {
            return Err(refused(j, rest));
        }
    }
    let mut x = qr.q().transpose() * b;
    for column in 0..x.ncols() {
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| r[(i, k)] * x[(k, column)]).sum();
            x[(i, column)] = (x[(i, column)] - known) / r[(i, i)];
        }
    }
    Ok(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orthogonality(set: &Orthonormal) -> f64 {
        let v = set.vectors();
        let mut worst = 0.0f64;
        for (i, a) in v.iter().enumerate() {
            for (j, b) in v.iter().enumerate() {
                let want = if i == j { 1.0 } else { 0.0 };
                worst = worst.max((dot(a, b) - want).abs());
            }
        }
        worst
    }

    #[test]
    fn lauchli_stays_orthogonal() {
        let e = 1e-8;
        let mut set = Orthonormal::new();
        for j in 0..6 {
            let mut v = vec![0.0; 7];
            v[0] = 1.0;
            v[j + 1] = e;
            set.push(&v).unwrap();
        }
        assert!(orthogonality(&set) < 1e-15);
    }

    #[test]
    fn hilbert_stays_orthogonal_until_it_is_refused() {
        let mut set = Orthonormal::new();
        for j in 0..14 {
            let column: Vec<f64> = (0..14).map(|i| 1.0 / (i + j + 1) as f64).collect();
            let _ = set.push(&column);
        }
        assert!(set.vectors().len() >= 11);
        assert!(orthogonality(&set) < 1e-15);
    }

    #[test]
    fn a_copy_is_refused_with_its_reason() {
        let mut set = Orthonormal::new();
        set.push(&[1.0, 2.0, 0.1]).unwrap();
        set.push(&[0.3, -1.0, 0.7]).unwrap();
        let copy: Vec<f64> = [1.0, 2.0, 0.1].iter().map(|x| x * 3.7).collect();
        let refused = set.push(&copy).unwrap_err();
        assert_eq!(refused.index, 2);
        assert!(refused.after < 1e-14 && refused.before > 8.0);
        assert!(set.push(&[0.0; 3]).is_err());
        assert!(set.push(&[f64::NAN, 0.0, 0.0]).is_err());
        assert_eq!(set.vectors().len(), 2);
    }

    #[test]
    fn extreme_magnitudes_do_not_matter() {
        let mut set = Orthonormal::new();
        set.push(&[1e200, 2e200]).unwrap();
        set.push(&[3e-200, -1e-200]).unwrap();
        assert!(orthogonality(&set) < 1e-15);
    }

    #[test]
    fn least_squares_meets_the_normal_equations() {
        let a = Matrix::from_fn(7, 3, |i, j| ((i * (j + 3)) as f64).sin());
        let b = Matrix::from_fn(7, 2, |i, j| ((i + 2 * j) as f64).cos());
        let x = least_squares(&a, &b).unwrap();
        assert!((a.transpose() * (&a * x - &b)).amax() < 1e-14);
        let twice = Matrix::from_fn(4, 2, |i, _| i as f64 + 1.0);
        let found = least_squares(&twice, &Matrix::zeros(4, 1)).unwrap_err();
        assert_eq!(found.index, 1);
        assert!(least_squares(&Matrix::zeros(1, 2), &Matrix::zeros(1, 1)).is_err());
        assert_eq!(least_squares(&Matrix::zeros(3, 0), &b).unwrap().nrows(), 0);
    }
}
