//! Converts knots to Bernstein spans: every [`Interpolation`] is piecewise polynomial of degree at
//! most 3.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over slices of one length, made together"
)]

use crate::linalg::Bernstein;
use crate::model::{CurveKnot, Interpolation, Knot, NamedCurve, Path};

/// The spans between a path's knots, over seconds, in levels.
pub(super) fn path_spans(path: &Path) -> Vec<Bernstein> {
    let knot = |k: &Knot| CurveKnot {
        at: k.time.seconds(),
        value: k.level,
        slope: k.slope,
        handles: k.handles,
    };
    let knots: Vec<CurveKnot> = path.knots.iter().map(knot).collect();
    spans(path.interpolation, &knots)
}

/// A named curve ready to be evaluated.
pub(super) struct Splined {
    /// Positions of the knots, as fractions.
    pub at: Vec<f64>,
    /// The polynomials between them.
    pub spans: Vec<Bernstein>,
    /// The final value.
    pub last: f64,
}

impl Splined {
    pub fn new(curve: &NamedCurve) -> Splined {
        Splined {
            at: curve.knots.iter().map(|k| k.at).collect(),
            spans: curve_spans(curve),
            last: curve.knots.last().map_or(1.0, |k| k.value),
        }
    }
}

/// The spans between a named curve's knots, over fractions.
pub(super) fn curve_spans(curve: &NamedCurve) -> Vec<Bernstein> {
    spans(curve.interpolation, &curve.knots)
}

/// One polynomial between neighbouring knots, each on [0, 1]. Two knots without given slopes are
/// joined by a straight line in every kind of spline except `Clamped`.
fn spans(interpolation: Interpolation, knots: &[CurveKnot]) -> Vec<Bernstein> {
    use Interpolation as I;
    let each = |f: &dyn Fn(&CurveKnot, &CurveKnot) -> Bernstein| -> Vec<Bernstein> {
        knots.windows(2).map(|w| f(&w[0], &w[1])).collect()
    };
    match interpolation {
        I::Steps => each(&|a, _| Bernstein::constant(a.value)),
        I::Linear => each(&|a, b| Bernstein::linear(a.value, b.value)),
        I::Natural | I::CatmullRom | I::Monotone if knots.len() == 2 => {
            each(&|a, b| Bernstein::linear(a.value, b.value))
        }
        I::Bezier => each(&|a, b| Bernstein::cubic([a.value, a.handles[0], a.handles[1], b.value])),
        I::Hermite => {
            let slopes: Vec<f64> = knots.iter().map(|k| k.slope).collect();
            hermite(knots, &slopes)
        }
        I::Natural => hermite(knots, &continuous_curvature(knots, false)),
        I::Clamped => hermite(knots, &continuous_curvature(knots, true)),
        I::CatmullRom => hermite(knots, &neighbour_chords(knots)),
        I::Monotone => hermite(knots, &monotone_slopes(knots)),
    }
}

fn hermite(knots: &[CurveKnot], slopes: &[f64]) -> Vec<Bernstein> {
    knots
        .windows(2)
        .zip(slopes.windows(2))
        .map(|(k, s)| {
            let h = k[1].at - k[0].at;
            Bernstein::hermite(k[0].value, k[1].value, s[0] * h, s[1] * h)
        })
        .collect()
}

/// Lengths of the spans and slopes of their chords.
fn chords(knots: &[CurveKnot]) -> (Vec<f64>, Vec<f64>) {
    knots
        .windows(2)
        .map(|k| {
            let h = k[1].at - k[0].at;
            (h, (k[1].value - k[0].value) / h)
        })
        .unzip()
}

fn neighbour_chords(knots: &[CurveKnot]) -> Vec<f64> {
    let last = knots.len().saturating_sub(1);
    (0..knots.len())
        .map(|i| {
            let (a, b) = (&knots[i.saturating_sub(1)], &knots[(i + 1).min(last)]);
            if last == 0 {
                return 0.0;
            }
            (b.value - a.value) / (b.at - a.at)
        })
        .collect()
}

/// Slopes that make the spline C2, from the tridiagonal system of the cubic spline (de Boor, "A
/// practical guide to splines", ch. IV). It is diagonally dominant, so elimination needs no
/// pivoting. At the ends the slope (clamped) or the second derivative (natural) is 0.
fn continuous_curvature(knots: &[CurveKnot], clamped: bool) -> Vec<f64> {
    let n = knots.len();
    if n < 2 {
        return vec![0.0; n];
    }
    let (h, d) = chords(knots);
    let (mut diagonal, mut upper, mut right) = (vec![1.0; n], vec![0.0; n], vec![0.0; n]);
    if !clamped {
        (diagonal[0], upper[0], right[0]) = (2.0, 1.0, 3.0 * d[0]);
    }
    for i in 1..n {
        let (lower, own, next, want) = if i + 1 < n {
            let (a, b) = (h[i], h[i - 1]);
            (a, 2.0 * (a + b), b, 3.0 * (a * d[i - 1] + b * d[i]))
        } else if clamped {
            (0.0, 1.0, 0.0, 0.0)
        } else {
            (1.0, 2.0, 0.0, 3.0 * d[i - 1])
        };
        let factor = lower / diagonal[i - 1];
        diagonal[i] = own - factor * upper[i - 1];
        upper[i] = next;
        right[i] = want - factor * right[i - 1];
    }
    let mut slopes = vec![0.0; n];
    slopes[n - 1] = right[n - 1] / diagonal[n - 1];
    for i in (0..n - 1).rev() {
        slopes[i] = (right[i] - upper[i] * slopes[i + 1]) / diagonal[i];
    }
    slopes
}

/// Slopes by weighted harmonic means (Fritsch and Butland, "A method for constructing local
/// monotone piecewise cubic interpolants", 1984); zero at local extremes, three-point formula at
/// the ends, limited as in Fritsch and Carlson.
fn monotone_slopes(knots: &[CurveKnot]) -> Vec<f64> {
    let n = knots.len();
    if n < 2 {
        return vec![0.0; n];
    }
    let (h, d) = chords(knots);
    if n == 2 {
        return vec![d[0]; 2];
    }
    let mut slopes = vec![0.0; n];
    for i in 1..n - 1 {
        let (a, b) = (d[i - 1], d[i]);
        if a * b > 0.0 {
            let (wa, wb) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
            slopes[i] = (wa + wb) / (wa / a + wb / b);
        }
    }
    slopes[0] = end_slope(h[0], h[1], d[0], d[1]);
    slopes[n - 1] = end_slope(h[n - 2], h[n - 3], d[n - 2], d[n - 3]);
    slopes
}

fn end_slope(h0: f64, h1: f64, d0: f64, d1: f64) -> f64 {
    let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if slope * d0 <= 0.0 {
        0.0
    } else if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() {
        3.0 * d0
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(points: &[(f64, f64)]) -> Vec<CurveKnot> {
        points
            .iter()
            .map(|(at, value)| CurveKnot {
                at: *at,
                value: *value,
                slope: 0.0,
                handles: [*value; 2],
            })
            .collect()
    }

    const POINTS: [(f64, f64); 5] = [(0., 10.), (1., 40.), (3., 35.), (3.5, 80.), (6., 90.)];

    /// Second derivative at an end of a span of length `h`.
    fn curvature(p: &Bernstein, h: f64, at_end: bool) -> f64 {
        let c = p.coefficients();
        let (a, b, c) = if at_end {
            (c[1], c[2], c[3])
        } else {
            (c[0], c[1], c[2])
        };
        6.0 * (a - 2.0 * b + c) / (h * h)
    }

    #[test]
    fn every_kind_goes_through_its_knots() {
        use Interpolation as I;
        for kind in [
            I::Linear,
            I::Natural,
            I::Clamped,
            I::CatmullRom,
            I::Monotone,
            I::Hermite,
        ] {
            let spans = spans(kind, &knots(&POINTS));
            for (span, w) in spans.iter().zip(POINTS.windows(2)) {
                assert_eq!((span.first(), span.last()), (w[0].1, w[1].1), "{kind:?}");
            }
        }
    }

    #[test]
    fn natural_and_clamped_are_c2_with_their_ends() {
        for clamped in [false, true] {
            let kind = if clamped {
                Interpolation::Clamped
            } else {
                Interpolation::Natural
            };
            let spans = spans(kind, &knots(&POINTS));
            let h: Vec<f64> = POINTS.windows(2).map(|w| w[1].0 - w[0].0).collect();
            for i in 0..3 {
                let slopes = (
                    spans[i].slope(1.0) / h[i],
                    spans[i + 1].slope(0.0) / h[i + 1],
                );
                assert!((slopes.0 - slopes.1).abs() < 1e-11);
                let left = curvature(&spans[i], h[i], true);
                assert!((left - curvature(&spans[i + 1], h[i + 1], false)).abs() < 1e-10);
            }
            if clamped {
                assert!(spans[0].slope(0.0).abs() < 1e-12 && spans[3].slope(1.0).abs() < 1e-12);
            } else {
                assert!(curvature(&spans[0], h[0], false).abs() < 1e-10);
                assert!(curvature(&spans[3], h[3], true).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn monotone_never_leaves_its_knots() {
        for span in spans(Interpolation::Monotone, &knots(&POINTS)) {
            let ((_, low), (_, high)) = span.range();
            let (a, b) = (span.first(), span.last());
            assert!(low >= a.min(b) - 1e-12 && high <= a.max(b) + 1e-12);
        }
    }

    #[test]
    fn two_knots_make_a_straight_line_and_one_knot_nothing() {
        use Interpolation as I;
        for kind in [I::Natural, I::CatmullRom, I::Monotone] {
            let line = spans(kind, &knots(&POINTS[..2]));
            assert_eq!(line, vec![Bernstein::linear(10.0, 40.0)]);
        }
        for kind in [I::Natural, I::Clamped, I::CatmullRom, I::Monotone, I::Steps] {
            assert!(spans(kind, &knots(&POINTS[..1])).is_empty());
        }
    }
}
