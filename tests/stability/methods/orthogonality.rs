//! Four methods to orthogonalise columns, and families of matrices with condition numbers from 1 to
//! the limit of doubles.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed within the shapes that they are made with"
)]

use super::hard::{hilbert, lauchli};
use super::wide::singular_values;
use crate::dice::Dice;
use footlight_show::linalg::{Matrix, Orthonormal};

/// A method to make the columns of a matrix orthonormal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Classical Gram-Schmidt.
    Classical,
    /// Modified Gram-Schmidt.
    Modified,
    /// This project's: modified Gram-Schmidt twice.
    Shipped,
    /// Householder reflections.
    Householder,
}

impl Way {
    /// Every method.
    pub const ALL: [Way; 4] = [
        Way::Classical,
        Way::Modified,
        Way::Shipped,
        Way::Householder,
    ];

    /// The columns of a matrix, made orthonormal.
    pub fn orthonormalize(self, a: &Matrix) -> Matrix {
        match self {
            Way::Classical => classical(a),
            Way::Modified => modified(a),
            Way::Shipped => shipped(a),
            Way::Householder => householder(a),
        }
    }
}

/// A family of matrices with condition numbers from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// A row of ones over a small multiple of the identity.
    Lauchli,
    /// 1 / (i + j + 1).
    Hilbert,
    /// A look, and looks that differ little from it, as in shows.
    NearCopies,
}

/// Classical: every coefficient from the original column.
pub fn classical(a: &Matrix) -> Matrix {
    let mut q = a.clone();
    for j in 0..a.ncols() {
        let mut x = a.column(j).into_owned();
        for k in 0..j {
            x.axpy(-q.column(k).dot(&a.column(j)), &q.column(k), 1.0);
        }
        q.set_column(j, &x.normalize());
    }
    q
}

/// Modified: every coefficient from the remainder.
pub fn modified(a: &Matrix) -> Matrix {
    let mut q = a.clone();
    for j in 0..a.ncols() {
        let mut x = a.column(j).into_owned();
        for k in 0..j {
            x.axpy(-q.column(k).dot(&x), &q.column(k), 1.0);
        }
        q.set_column(j, &x.normalize());
    }
    q
}

/// This project's method; a column in the span is left out.
pub fn shipped(a: &Matrix) -> Matrix {
    let mut set = Orthonormal::new();
    for column in a.column_iter() {
        let _ = set.push(column.as_slice());
    }
    set.matrix(a.nrows())
}

/// nalgebra's QR.
pub fn householder(a: &Matrix) -> Matrix {
    a.clone().qr().q()
}

/// ‖QᵀQ − 1‖ in the Frobenius norm.
pub fn loss(q: &Matrix) -> f64 {
    (q.transpose() * q - Matrix::identity(q.ncols(), q.ncols())).norm()
}

/// The ratio of the extreme singular values, from double-double arithmetic.
pub fn condition(a: &Matrix) -> f64 {
    let (m, n) = a.shape();
    let sigma = singular_values(m, n, |i, j| a[(i, j)]);
    match (sigma.first(), sigma.last()) {
        (Some(first), Some(last)) => f64::from(*first) / f64::from(*last),
        _ => 1.0,
    }
}

/// The families, each from well to badly conditioned.
pub fn families() -> Vec<(Family, Vec<Matrix>)> {
    let tenths = |from: i32, to: i32| (from..=to).map(|e| 10f64.powf(-0.5 * f64::from(e)));
    vec![
        (Family::Lauchli, tenths(0, 28).map(lauchli).collect()),
        (Family::Hilbert, (2..=11).map(hilbert).collect()),
        (Family::NearCopies, tenths(0, 28).map(near_copies).collect()),
    ]
}

/// Settings of 24 banks: a look, and seven that differ from it by `apart`.
pub fn near_copies(apart: f64) -> Matrix {
    let mut dice = Dice::new(5);
    let look: Vec<f64> = (0..24).map(|_| dice.between(0.0, 1.0)).collect();
    Matrix::from_fn(24, 8, |i, j| match j {
        0 => look[i],
        _ => look[i] + apart * dice.between(-1.0, 1.0),
    })
}
