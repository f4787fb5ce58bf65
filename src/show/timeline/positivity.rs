//! The fewest knots that make all control points non-negative.
//!
//! Control points of a non-negative polynomial can be negative, and a key image must not be. If the
//! control points over [s, e] are non-negative, so are those over any part of it; hence it is
//! optimal to reach as far as possible from the left each time. The limit from s is in closed form.
//! With p0, p1, p2 the Taylor coefficients at s and h = e − s, the inner control points are
//! b(s,s,e) = p0 + p1 h/3, linear in h, and b(s,e,e) = p0 + 2 p1 h/3 + p2 h²/3, quadratic; the
//! first of their roots, over all coordinates at once, is the next knot. A curve that touches zero
//! gets its knot on the touching point, where bisection would halve endlessly.

#![allow(
    clippy::indexing_slicing,
    reason = "coefficients of a polynomial whose degree was matched"
)]

use crate::linalg::{Bernstein, quadratic_roots};

/// Control points above minus this, relative to the largest, are rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON / 2.0;

/// Interior knots of [0, 1], ascending, such that between neighbours no control point of `curves`
/// is negative beyond rounding. The curves must be non-negative; where rounding makes one slightly
/// negative, control points may be twice as negative.
pub fn knots(curves: &[Bernstein]) -> Vec<f64> {
    let troubled: Vec<(Bernstein, f64)> = curves
        .iter()
        .filter(|p| p.degree() >= 2 && p.coefficients().iter().any(|c| *c < 0.0))
        .map(|p| (*p, slack(p)))
        .collect();
    let mut out = Vec::new();
    let mut s = 0.0;
    loop {
        let reach = |(p, slack): &(Bernstein, f64)| reach(p, s, *slack);
        let e = troubled.iter().map(reach).fold(1.0, f64::min);
        // No progress means that a curve is truly negative: no knot can help.
        if e >= 1.0 || e <= s {
            return out;
        }
        out.push(e);
        s = e;
    }
}

fn slack(p: &Bernstein) -> f64 {
    let largest = p.coefficients().iter().fold(0.0f64, |m, c| m.max(c.abs()));
    let ((_, low), _) = p.range();
    ROUNDING * largest + 2.0 * (-low).max(0.0)
}

/// The farthest e <= 1 with non-negative control points over [s, e].
fn reach(p: &Bernstein, s: f64, slack: f64) -> f64 {
    let whole = 1.0 - s;
    let p0 = p.value(s).max(0.0);
    let p1 = p.slope(s);
    let degree = p.degree() as f64;
    let mut h = whole;
    if p0 + p1 * whole / degree < -slack {
        h = h.min(-degree * p0 / p1);
    }
    if p.degree() == 3 {
        let (a, b) = (bend(p, s), 2.0 * p1 / 3.0);
        let point = |h: f64| p0 + h * (b + h * a);
        let lowest = if a > 0.0 {
            (-b / (2.0 * a)).clamp(0.0, whole)
        } else {
            whole
        };
        if point(lowest).min(point(whole)) < -slack {
            let first = quadratic_roots(a, b, p0).into_iter().find(|r| *r > 0.0);
            h = h.min(first.unwrap_or(whole));
        }
    }
    if h == whole { 1.0 } else { s + h }
}

/// A third of the second Taylor coefficient of a cubic.
fn bend(p: &Bernstein, s: f64) -> f64 {
    let c = p.coefficients();
    let (left, right) = (c[0] - 2.0 * c[1] + c[2], c[1] - 2.0 * c[2] + c[3]);
    left + s * (right - left)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Number of knots by repeated halving wherever a control point is negative, to a depth.
    fn bisection(curves: &[Bernstein], depth: usize) -> usize {
        let bad = |p: &Bernstein| p.coefficients().iter().any(|c| *c < -1e-15);
        if depth == 0 || !curves.iter().any(bad) {
            return 0;
        }
        let half =
            |s: f64, e: f64| -> Vec<Bernstein> { curves.iter().map(|p| p.part(s, e)).collect() };
        1 + bisection(&half(0.0, 0.5), depth - 1) + bisection(&half(0.5, 1.0), depth - 1)
    }

    /// A cubic that is non-negative on [0, 1]: t·a² + (1−t)·b² with a, b linear. Every non-negative
    /// cubic has this form (Lukács).
    fn lukacs(a: (f64, f64), b: (f64, f64)) -> Bernstein {
        let square = |p: (f64, f64)| [p.0 * p.0, 2.0 * p.0 * p.1, p.1 * p.1];
        let (a, b) = (square(a), square(b));
        let power = [b[0], a[0] + b[1] - b[0], a[1] + b[2] - b[1], a[2] - b[2]];
        Bernstein::from_power(&power).unwrap()
    }

    fn nonnegative() -> impl Strategy<Value = Bernstein> {
        let n = || -2.0..2.0f64;
        (n(), n(), n(), n()).prop_map(|(a, b, c, d)| lukacs((a, b), (c, d)))
    }

    fn least(curves: &[Bernstein], knots: &[f64]) -> f64 {
        let mut all = vec![0.0];
        all.extend(knots);
        all.push(1.0);
        let mut worst = f64::INFINITY;
        for p in curves {
            let scale = p.coefficients().iter().fold(0.0f64, |m, c| m.max(c.abs()));
            for w in all.windows(2) {
                let part = p.part(w[0], w[1]);
                for c in part.coefficients() {
                    worst = worst.min(c / scale);
                }
            }
        }
        worst
    }

    proptest! {
        #[test]
        fn nothing_is_negative_and_bisection_never_needs_fewer(
            curves in prop::collection::vec(nonnegative(), 1..6)
        ) {
            let knots = knots(&curves);
            prop_assert!(least(&curves, &knots) >= -1e-15);
            prop_assert!(knots.len() <= bisection(&curves, 12));
            prop_assert!(knots.windows(2).all(|w| w[0] < w[1]));
        }

        #[test]
        fn a_curve_that_touches_zero_gets_its_knot_there(a in 0.05..0.95f64, k in 0.1..3.0f64) {
            // (t − a)² (1 + k t)
            let power = [a * a, k * a * a - 2.0 * a, 1.0 - 2.0 * k * a, k];
            let p = Bernstein::from_power(&power).unwrap();
            let knots = knots(&[p]);
            prop_assert!(knots.len() <= 2, "{knots:?}");
            let nearest = knots.iter().map(|t| (t - a).abs()).fold(1.0, f64::min);
            prop_assert!(nearest < 2e-15, "{knots:?}");
            prop_assert!(least(&[p], &knots) >= -1e-15);
        }
    }

    #[test]
    fn bisection_does_not_end_where_this_takes_one_knot() {
        let third = 1.0 / 3.0;
        let p = Bernstein::new(&[
            third * third,
            -third * (1.0 - third),
            (1.0 - third) * (1.0 - third),
        ])
        .unwrap();
        assert_eq!(knots(&[p]).len(), 1);
        // Only rounding ends it.
        assert!(bisection(&[p], 60) > 20);
    }

    #[test]
    fn a_curve_that_is_negative_does_not_hang() {
        assert!(knots(&[Bernstein::cubic([0.0, -1.0, -1.0, 0.5])]).len() < 10);
    }
}
