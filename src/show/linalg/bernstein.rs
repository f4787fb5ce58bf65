//! Polynomials of degree 0 to 3 on [0, 1] in Bernstein form, and their mass matrices.
//!
//! The degree is fixed by construction: a straight line written as a cubic stays a cubic. Blossoms
//! (polar forms) follow Ramshaw, "Blossoming: a connect-the-dots approach to splines" (1987): b is
//! symmetric, affine in each argument, and b(t, .., t) is the value at t; the coefficients on [s,
//! e] are b(s, .., s, e, .., e).

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over arrays of four whose length is the type's"
)]

use super::Matrix;

/// Rows of Pascal's triangle, up to the mass matrices of cubics.
const BINOMIAL: [[f64; 7]; 7] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0, 0.0, 0.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, 1.0, 0.0],
    [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0],
];

/// The binomial coefficient of `n` and `k`; `n` is at most 6.
pub fn binomial(n: usize, k: usize) -> f64 {
    BINOMIAL[n][k]
}

/// A polynomial of degree at most 3 on [0, 1] by its Bernstein coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bernstein {
    degree: usize,
    /// The first `degree + 1` are used, the others are zero.
    coefficients: [f64; 4],
}

/// Interpolates from `a` to `b`; exact at both ends and where they are equal.
fn lerp(a: f64, b: f64, t: f64) -> f64 {
    if t < 0.5 {
        a + t * (b - a)
    } else {
        b - (1.0 - t) * (b - a)
    }
}

impl Bernstein {
    /// A constant; degree 0.
    pub fn constant(value: f64) -> Bernstein {
        Bernstein {
            degree: 0,
            coefficients: [value, 0.0, 0.0, 0.0],
        }
    }

    /// A straight line; degree 1.
    pub fn linear(from: f64, to: f64) -> Bernstein {
        Bernstein {
            degree: 1,
            coefficients: [from, to, 0.0, 0.0],
        }
    }

    /// Creates a polynomial from one to four coefficients; `None` for any other number.
    pub fn new(coefficients: &[f64]) -> Option<Bernstein> {
        if coefficients.is_empty() || coefficients.len() > 4 {
            return None;
        }
        let mut own = [0.0; 4];
        own[..coefficients.len()].copy_from_slice(coefficients);
        Some(Bernstein {
            degree: coefficients.len() - 1,
            coefficients: own,
        })
    }

    /// A quadratic by its coefficients.
    pub fn quadratic([a, b, c]: [f64; 3]) -> Bernstein {
        Bernstein {
            degree: 2,
            coefficients: [a, b, c, 0.0],
        }
    }

    /// A cubic by its coefficients.
    pub fn cubic(coefficients: [f64; 4]) -> Bernstein {
        Bernstein {
            degree: 3,
            coefficients,
        }
    }

    /// The cubic with these end values and slopes (with respect to the parameter).
    pub fn hermite(from: f64, to: f64, slope_from: f64, slope_to: f64) -> Bernstein {
        Bernstein::cubic([from, from + slope_from / 3.0, to - slope_to / 3.0, to])
    }

    /// The degree given at construction.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Its `degree + 1` coefficients.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[..=self.degree]
    }

    /// Replaces the end values; a constant takes `first`.
    pub fn with_ends(mut self, first: f64, last: f64) -> Bernstein {
        self.coefficients[self.degree] = last;
        self.coefficients[0] = first;
        self
    }

    /// Value at 0.
    pub fn first(&self) -> f64 {
        self.coefficients[0]
    }

    /// Value at 1.
    pub fn last(&self) -> f64 {
        self.coefficients[self.degree]
    }

    /// The polar form at the first `degree` of these arguments (de Casteljau).
    fn blossom(&self, arguments: [f64; 3]) -> f64 {
        let mut c = self.coefficients;
        for (round, t) in arguments.iter().enumerate().take(self.degree) {
            for i in 0..self.degree - round {
                c[i] = lerp(c[i], c[i + 1], *t);
            }
        }
        c[0]
    }

    /// Value at `t`.
    pub fn value(&self, t: f64) -> f64 {
        self.blossom([t, t, t])
    }

    /// The curve over [s, e], reparametrised to [0, 1]; `s` and `e` may lie outside [0, 1]. Two
    /// parts that share an end share the bits of its value.
    pub fn part(&self, s: f64, e: f64) -> Bernstein {
        let mut coefficients = [0.0; 4];
        for (i, c) in coefficients.iter_mut().enumerate().take(self.degree + 1) {
            let mut arguments = [s; 3];
            for a in arguments.iter_mut().take(self.degree).skip(self.degree - i) {
                *a = e;
            }
            *c = self.blossom(arguments);
        }
        Bernstein {
            degree: self.degree,
            coefficients,
        }
    }

    /// The curve raised to a higher degree (at most 3); a lower `degree` changes nothing.
    pub fn elevated(&self, degree: usize) -> Bernstein {
        let mut out = *self;
        while out.degree < degree.min(3) {
            let d = out.degree + 1;
            let old = out.coefficients;
            for i in 1..d {
                out.coefficients[i] = lerp(old[i], old[i - 1], i as f64 / d as f64);
            }
            out.coefficients[d] = old[out.degree];
            out.degree = d;
        }
        out
    }

    /// Derivative at `t`.
    pub fn slope(&self, t: f64) -> f64 {
        let c = &self.coefficients;
        let d = |i: usize| c[i + 1] - c[i];
        match self.degree {
            0 => 0.0,
            1 => d(0),
            2 => 2.0 * lerp(d(0), d(1), t),
            _ => 3.0 * lerp(lerp(d(0), d(1), t), lerp(d(1), d(2), t), t),
        }
    }

    /// True when all coefficients are equal, so that it is certainly constant.
    pub fn is_constant(&self) -> bool {
        self.coefficients().iter().all(|c| *c == self.first())
    }

    /// Maps each coefficient; an affine `f` maps the polynomial.
    pub fn mapped(&self, f: impl Fn(f64) -> f64) -> Bernstein {
        let mut out = *self;
        for c in out.coefficients.iter_mut().take(self.degree + 1) {
            *c = f(*c);
        }
        out
    }

    /// Zeros of the slope inside (0, 1), ascending, at most two.
    pub fn turns(&self) -> Vec<f64> {
        let c = &self.coefficients;
        let d = |i: usize| c[i + 1] - c[i];
        let roots = match self.degree {
            0 | 1 => Vec::new(),
            2 => quadratic_roots(0.0, d(1) - d(0), d(0)),
            _ => quadratic_roots(d(0) - 2.0 * d(1) + d(2), 2.0 * (d(1) - d(0)), d(0)),
        };
        roots.into_iter().filter(|t| *t > 0.0 && *t < 1.0).collect()
    }

    /// Least and greatest value over [0, 1], each as (parameter, value).
    pub fn range(&self) -> ((f64, f64), (f64, f64)) {
        let mut low = (0.0, self.first());
        let mut high = low;
        for t in self.turns().into_iter().chain([1.0]) {
            let v = self.value(t);
            if v < low.1 {
                low = (t, v);
            }
            if v > high.1 {
                high = (t, v);
            }
        }
        (low, high)
    }
}

/// Real roots of a x² + b x + c, ascending, computed without cancellation. A zero polynomial has
/// none.
pub fn quadratic_roots(a: f64, b: f64, c: f64) -> Vec<f64> {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return Vec::new();
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let mut roots: Vec<f64> = [q / a, c / q]
        .into_iter()
        .filter(|x| x.is_finite())
        .collect();
    if q == 0.0 && a != 0.0 {
        roots = vec![0.0];
    }
    roots.sort_by(f64::total_cmp);
    roots.dedup();
    roots
}

/// The mass matrix of the Bernstein polynomials of `degree` (at most 3) on [0, 1]:
/// B_ij = C(d,i) C(d,j) / ((2d+1) C(2d,i+j)), the integral of their products.
pub fn mass(degree: usize) -> Matrix {
    let d = degree.min(3);
    Matrix::from_fn(d + 1, d + 1, |i, j| {
        BINOMIAL[d][i] * BINOMIAL[d][j] / ((2 * d + 1) as f64 * BINOMIAL[2 * d][i + j])
    })
}

/// The lower Cholesky factor F of [`mass`]: F · Fᵀ = B, so that the integral of L Lᵀ over a segment
/// with control points K is (K F)(K F)ᵀ times its length.
pub fn mass_factor(degree: usize) -> Matrix {
    let b = mass(degree);
    let n = b.nrows();
    let mut f = Matrix::zeros(n, n);
    for j in 0..n {
        for i in j..n {
            let known: f64 = (0..j).map(|k| f[(i, k)] * f[(j, k)]).sum();
            let rest: f64 = b[(i, j)] - known;
            f[(i, j)] = if i == j {
                rest.sqrt()
            } else {
                rest / f[(j, j)]
            };
        }
    }
    f
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn power(a: &[f64], t: f64) -> f64 {
        a.iter().rev().fold(0.0, |s, c| s * t + c)
    }

    fn polynomial() -> impl Strategy<Value = Bernstein> {
        prop::collection::vec(-2.0..2.0f64, 1..5).prop_map(|c| Bernstein::new(&c).unwrap())
    }

    impl Bernstein {
        /// Converts from the power basis, lowest power first: c_i = sum over j <= i of C(i,j)/C(d,j)
        /// a_j. `None` unless there are one to four numbers.
        pub(crate) fn from_power(power: &[f64]) -> Option<Bernstein> {
            let degree = power.len().checked_sub(1).filter(|d| *d <= 3)?;
            let mut coefficients = [0.0; 4];
            for (i, c) in coefficients.iter_mut().enumerate().take(degree + 1) {
                for (j, a) in power.iter().enumerate().take(i + 1) {
                    *c += BINOMIAL[i][j] / BINOMIAL[degree][j] * a;
                }
            }
            Some(Bernstein {
                degree,
                coefficients,
            })
        }
    }

    proptest! {
        #[test]
        fn power_basis_and_bernstein_agree(a in prop::collection::vec(-3.0..3.0f64, 1..5), t in 0.0..1.0f64) {
            let b = Bernstein::from_power(&a).unwrap();
            prop_assert!((b.value(t) - power(&a, t)).abs() < 1e-14 * 20.0);
        }

        #[test]
        fn a_part_is_the_same_curve(p in polynomial(), s in 0.0..1.0f64, e in 0.0..1.0f64, t in 0.0..1.0f64) {
            let part = p.part(s, e);
            prop_assert!((part.value(t) - p.value(s + t * (e - s))).abs() < 1e-14);
            prop_assert_eq!(part.first().to_bits(), p.value(s).to_bits());
            prop_assert_eq!(part.last().to_bits(), p.value(e).to_bits());
        }

        #[test]
        fn elevation_keeps_the_curve_and_its_ends(p in polynomial(), t in 0.0..1.0f64) {
            let q = p.elevated(3);
            prop_assert_eq!(q.degree(), 3);
            prop_assert!((q.value(t) - p.value(t)).abs() < 1e-14);
            prop_assert_eq!((q.first(), q.last()), (p.first(), p.last()));
        }

        #[test]
        fn the_range_holds_every_value_and_is_reached(p in polynomial(), t in 0.0..1.0f64) {
            let ((tl, low), (th, high)) = p.range();
            let v = p.value(t);
            prop_assert!(low - 1e-14 <= v && v <= high + 1e-14);
            prop_assert!(p.value(tl) == low && p.value(th) == high);
        }

        #[test]
        fn the_slope_is_the_difference_quotient(p in polynomial(), t in 0.01..0.99f64) {
            let h = 1e-5;
            let difference = (p.value(t + h) - p.value(t - h)) / (2.0 * h);
            prop_assert!((p.slope(t) - difference).abs() < 1e-8);
        }
    }

    #[test]
    fn ends_are_exact() {
        let p = Bernstein::cubic([0.1, 0.7, -0.3, 1.0 / 3.0]);
        assert_eq!((p.value(0.0), p.value(1.0)), (0.1, 1.0 / 3.0));
        let flat = Bernstein::cubic([1.0 / 3.0; 4]);
        assert!(flat.is_constant() && flat.part(0.1, 0.77).is_constant());
    }

    #[test]
    fn mass_is_the_integral_of_products_and_its_factor_is_lower() {
        // Gauss-Legendre with four points is exact to degree 7.
        let nodes = [0.861_136_311_594_052_6, 0.339_981_043_584_856_26];
        let weights = [0.347_854_845_137_453_85, 0.652_145_154_862_546_1];
        for d in 0..=3 {
            let unit = |i: usize| {
                let mut c = vec![0.0; d + 1];
                c[i] = 1.0;
                Bernstein::new(&c).unwrap()
            };
            let (b, f) = (mass(d), mass_factor(d));
            assert!((&f * f.transpose() - &b).amax() < 1e-16);
            for i in 0..=d {
                for j in 0..=d {
                    let mut integral = 0.0;
                    for (x, w) in nodes.iter().zip(weights) {
                        for t in [0.5 - 0.5 * x, 0.5 + 0.5 * x] {
                            integral += 0.5 * w * unit(i).value(t) * unit(j).value(t);
                        }
                    }
                    assert!((b[(i, j)] - integral).abs() < 1e-15, "{d} {i} {j}");
                    assert!(i >= j || f[(i, j)] == 0.0);
                }
            }
        }
    }

    #[test]
    fn quadratic_roots_do_not_cancel() {
        assert_eq!(quadratic_roots(1.0, -3.0, 2.0), vec![1.0, 2.0]);
        assert_eq!(quadratic_roots(0.0, 2.0, -1.0), vec![0.5]);
        assert!(quadratic_roots(1.0, 0.0, 1.0).is_empty());
        assert!(quadratic_roots(0.0, 0.0, 0.0).is_empty());
        let roots = quadratic_roots(1.0, -1e9, 1.0);
        assert!((roots[0] - 1e-9).abs() < 1e-24);
    }
}
