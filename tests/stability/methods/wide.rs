//! Singular values in double-double arithmetic (106 bits), as reference for doubles.
//!
//! Error-free sums and products as in Knuth (1969) and Dekker (1971), products by a fused
//! multiplication; the operations are the accurate ones of Hida, Li and Bailey (2001). One-sided
//! Jacobi needs only sums, products, quotients and roots, and keeps small singular values to
//! relative accuracy for graded columns; otherwise they are accurate to 1e-31 of the largest.

#![allow(
    clippy::indexing_slicing,
    reason = "columns are split where there are columns"
)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The unevaluated sum of two doubles, the second below half an ulp of the first.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Wide {
    high: f64,
    low: f64,
}

const ZERO: Wide = Wide {
    high: 0.0,
    low: 0.0,
};

/// a + b and its error, for |a| >= |b|.
fn fast_sum(a: f64, b: f64) -> Wide {
    let high = a + b;
    let low = b - (high - a);
    Wide { high, low }
}

/// a + b and its error.
fn sum(a: f64, b: f64) -> Wide {
    let high = a + b;
    let part = high - a;
    let low = (a - (high - part)) + (b - part);
    Wide { high, low }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Wide {
        Wide { high, low: 0.0 }
    }
}

impl From<Wide> for f64 {
    fn from(x: Wide) -> f64 {
        x.high + x.low
    }
}

impl Add for Wide {
    type Output = Wide;
    fn add(self, other: Wide) -> Wide {
        let s = sum(self.high, other.high);
        let t = sum(self.low, other.low);
        let s = fast_sum(s.high, s.low + t.high);
        fast_sum(s.high, s.low + t.low)
    }
}

impl Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Wide {
    type Output = Wide;
    fn sub(self, other: Wide) -> Wide {
        self + -other
    }
}

impl Mul for Wide {
    type Output = Wide;
    fn mul(self, other: Wide) -> Wide {
        let high = self.high * other.high;
        let error = self.high.mul_add(other.high, -high);
        fast_sum(
            high,
            error + (self.high * other.low + self.low * other.high),
        )
    }
}

impl Div for Wide {
    type Output = Wide;
    fn div(self, other: Wide) -> Wide {
        let first = self.high / other.high;
        let rest = self - other * first.into();
        let second = rest.high / other.high;
        let rest = rest - other * second.into();
        fast_sum(first, second) + Wide::from(rest.high / other.high)
    }
}

impl Wide {
    /// The square root, by one Newton step from the double's.
    pub fn sqrt(self) -> Wide {
        if self.high <= 0.0 {
            return ZERO;
        }
        let root = Wide::from(self.high.sqrt());
        let rest = self - root * root;
        root + rest / (root + root)
    }

    fn abs(self) -> Wide {
        if self.high < 0.0 { -self } else { self }
    }
}

fn dot(a: &[Wide], b: &[Wide]) -> Wide {
    a.iter().zip(b).fold(ZERO, |total, (x, y)| total + *x * *y)
}

/// Columns below this share of the largest are rounding, and so are deviations from orthogonality
/// below it.
const ROUNDING: f64 = 1e-31;

/// All singular values of a matrix of doubles, descending, as many as the smaller of its sides.
/// Entries must have squares that neither overflow nor vanish, about 1e-140 to 1e150.
pub(super) fn singular_values(
    rows: usize,
    columns: usize,
    entry: impl Fn(usize, usize) -> f64,
) -> Vec<Wide> {
    let (long, short) = (rows.max(columns), rows.min(columns));
    let at = |i, j| {
        if rows < columns {
            entry(j, i)
        } else {
            entry(i, j)
        }
    };
    let mut w: Vec<Vec<Wide>> = (0..short)
        .map(|j| (0..long).map(|i| at(i, j).into()).collect())
        .collect();
    for _ in 0..100 {
        if !sweep(&mut w) {
            break;
        }
    }
    let mut out: Vec<Wide> = w.iter().map(|c| dot(c, c).sqrt()).collect();
    out.sort_by(|a, b| b.high.total_cmp(&a.high));
    out
}

/// Rotates every pair of columns that is not orthogonal; false when there was none.
fn sweep(w: &mut [Vec<Wide>]) -> bool {
    let mut rotated = false;
    let largest = w.iter().map(|c| dot(c, c).sqrt().high).fold(0.0, f64::max);
    for q in 1..w.len() {
        let (before, from_q) = w.split_at_mut(q);
        for p in before {
            let q = &mut from_q[0];
            let (a, b, c) = (dot(p, p), dot(q, q), dot(p, q));
            let (na, nb) = (a.sqrt(), b.sqrt());
            let noise = ROUNDING * ROUNDING * largest;
            if na.high <= noise || nb.high <= noise || c.abs().high <= ROUNDING * na.high * nb.high
            {
                continue;
            }
            rotated = true;
            rotate(p, q, (b - a) / (c + c));
        }
    }
    rotated
}

/// The rotation whose tangent t solves t² + 2 ζ t = 1, the smaller of the two.
fn rotate(p: &mut [Wide], q: &mut [Wide], zeta: Wide) {
    let one = Wide::from(1.0);
    let size = one / (zeta.abs() + (one + zeta * zeta).sqrt());
    let t = if zeta.high < 0.0 { -size } else { size };
    let c = one / (one + t * t).sqrt();
    let s = c * t;
    for (x, y) in p.iter_mut().zip(q) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}
