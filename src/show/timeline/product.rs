//! Light as the product of two curves: a level's and a colour's.
//!
//! When the degrees of two pieces sum to 3 or less the product is exact; otherwise it is fitted by
//! cubics like dimmers (ends exact, half of `dimmer::TOLERANCE`).

use super::curve::CurvePiece;
use super::dimmer::{Fitted, Stretch, fit};
use crate::linalg::{Bernstein, binomial};
use crate::units::Time;

/// Number of intervals searched for turns of a product.
const SCANNED: usize = 32;

/// The product of two curves over one stretch of time. A fit is within half of `tolerance`.
pub(super) fn product(a: &[CurvePiece], b: &[CurvePiece], tolerance: f64) -> Vec<CurvePiece> {
    let mut out = Vec::with_capacity(a.len().max(b.len()));
    let (mut rest, mut others) = (a.iter().peekable(), b.iter().peekable());
    while let (Some(x), Some(y)) = (rest.peek(), others.peek()) {
        let (start, end) = (x.start.max(y.start), x.end.min(y.end));
        if start < end {
            multiply(x, y, (start, end), tolerance, &mut out);
        }
        let (past, other_past) = (x.end <= end, y.end <= end);
        if past {
            rest.next();
        }
        if other_past {
            others.next();
        }
    }
    out
}

fn multiply(
    a: &CurvePiece,
    b: &CurvePiece,
    (start, end): (Time, Time),
    tolerance: f64,
    out: &mut Vec<CurvePiece>,
) {
    let (p, q) = (a.between(start, end), b.between(start, end));
    if let Some(polynomial) = exact(&p, &q) {
        out.push(CurvePiece {
            start,
            end,
            polynomial,
        });
        return;
    }
    let both = Both { p, q };
    let length = end - start;
    let turns = both.turns().into_iter().map(|t| start + length.scaled(t));
    let mut times: Vec<Time> = turns.filter(|t| *t > start && *t < end).collect();
    times.sort_unstable();
    times.dedup();
    times.insert(0, start);
    times.push(end);
    let share = |time: Time| (time - start).micros() as f64 / length.micros() as f64;
    for w in times.windows(2) {
        let &[from, to] = w else { continue };
        let share = (share(from), share(to));
        let stretch = Stretch {
            share,
            times: (from, to),
            ends: both.ends(share),
        };
        fit(&both, stretch, tolerance, out);
    }
}

/// The product by the coefficients of its factors (Farin, "Curves and surfaces for CAGD", 5.5):
/// c_k = sum over i + j = k of C(m,i) C(n,j) / C(m+n,k) a_i b_j.
fn exact(p: &Bernstein, q: &Bernstein) -> Option<Bernstein> {
    let p = if p.is_constant() {
        Bernstein::constant(p.first())
    } else {
        *p
    };
    let q = if q.is_constant() {
        Bernstein::constant(q.first())
    } else {
        *q
    };
    let (m, n) = (p.degree(), q.degree());
    if m + n > 3 {
        return None;
    }
    let mut coefficients = [0.0; 4];
    for (i, a) in p.coefficients().iter().enumerate() {
        for (j, b) in q.coefficients().iter().enumerate() {
            let weight = binomial(m, i) * binomial(n, j) / binomial(m + n, i + j);
            if let Some(c) = coefficients.get_mut(i + j) {
                *c += weight * a * b;
            }
        }
    }
    Bernstein::new(coefficients.get(..=m + n)?)
}

/// Two polynomials on [0, 1] and their product.
struct Both {
    p: Bernstein,
    q: Bernstein,
}

impl Both {
    fn ends(&self, (from, to): (f64, f64)) -> (f64, f64) {
        (self.value(from), self.value(to))
    }

    /// Turns of the product, bracketed by sign changes of its slope.
    fn turns(&self) -> Vec<f64> {
        let at = |i: usize| i as f64 / SCANNED as f64;
        let mut out = Vec::new();
        for i in 0..SCANNED {
            let (mut low, mut high) = (at(i), at(i + 1));
            let rises = self.slope(low) > 0.0;
            if rises == (self.slope(high) > 0.0) {
                continue;
            }
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if (self.slope(middle) > 0.0) == rises {
                    low = middle
                } else {
                    high = middle
                }
            }
            out.push(high);
        }
        out
    }
}

impl Fitted for Both {
    fn value(&self, t: f64) -> f64 {
        self.p.value(t) * self.q.value(t)
    }

    fn slope(&self, t: f64) -> f64 {
        self.p.slope(t) * self.q.value(t) + self.p.value(t) * self.q.slope(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeline::dimmer::TOLERANCE;
    use proptest::prelude::*;

    fn curve(coefficients: Vec<Vec<f64>>, length: i64) -> Vec<CurvePiece> {
        let pieces = coefficients.iter().zip(0..);
        let piece = |(c, i): (&Vec<f64>, i64)| CurvePiece {
            start: Time::from_micros(i * length),
            end: Time::from_micros((i + 1) * length),
            polynomial: Bernstein::new(c).unwrap(),
        };
        pieces.map(piece).collect()
    }

    fn value(curve: &[CurvePiece], time: Time) -> f64 {
        let piece = curve.iter().rfind(|p| p.start <= time).unwrap();
        piece.value(time)
    }

    proptest! {
        #[test]
        fn products_are_exact_or_within_the_tolerance(
            a in prop::collection::vec(prop::collection::vec(0.0..1.0f64, 1..5), 6),
            b in prop::collection::vec(prop::collection::vec(0.0..1.0f64, 1..5), 4),
            at in prop::collection::vec(0i64..24_000_000, 40),
        ) {
            let degrees = |c: &[Vec<f64>]| c.iter().map(Vec::len).max().unwrap() - 1;
            let limit = if degrees(&a) + degrees(&b) <= 3 { 1e-14 } else { 0.5 * TOLERANCE };
            let (a, b) = (curve(a, 4_000_000), curve(b, 6_000_000));
            let found = product(&a, &b, TOLERANCE);
            for time in at.into_iter().map(Time::from_micros) {
                let want = value(&a, time) * value(&b, time);
                let light = value(&found, time);
                prop_assert!((light - want).abs() <= limit, "{light} for {want} at {time}");
                prop_assert!((0.0..=1.0).contains(&light));
            }
            for w in found.windows(2) {
                prop_assert_eq!(w[0].end, w[1].start);
            }
            for piece in &found {
                // Both ends, the later one as the limit from the left.
                let last = |c: &[CurvePiece]| {
                    let before = c.iter().rfind(|p| p.start < piece.end).unwrap();
                    before.value(piece.end)
                };
                let (first, last) = (value(&a, piece.start) * value(&b, piece.start), last(&a) * last(&b));
                prop_assert!((piece.polynomial.first() - first).abs() < 1e-14);
                prop_assert!((piece.polynomial.last() - last).abs() < 1e-14);
            }
        }
    }
}
