//! Pieces of one coordinate's curve.

use crate::linalg::Bernstein;
use crate::units::Time;

/// One polynomial of a curve, from knot to knot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePiece {
    /// First knot.
    pub start: Time,
    /// Second knot, later than the first.
    pub end: Time,
    /// The curve between them, on [0, 1].
    pub polynomial: Bernstein,
}

/// Relative difference below which two coefficients are equal up to rounding, measured by the
/// largest of both pieces.
const SAME: f64 = 2e-14;

impl CurvePiece {
    /// Position of `time` between the knots: 0 at the first, 1 at the second.
    pub fn fraction(&self, time: Time) -> f64 {
        (time - self.start).micros() as f64 / (self.end - self.start).micros() as f64
    }

    /// Value at `time`; bit-identical for every caller.
    pub fn value(&self, time: Time) -> f64 {
        self.polynomial.value(self.fraction(time))
    }

    /// The part of the curve between two times, reparametrised to [0, 1].
    pub fn between(&self, start: Time, end: Time) -> Bernstein {
        if start == self.start && end == self.end {
            return self.polynomial;
        }
        self.polynomial
            .part(self.fraction(start), self.fraction(end))
    }

    /// True when the next piece continues this polynomial: the longer piece is extended over the
    /// shorter and compared.
    fn goes_on_in(&self, next: &CurvePiece) -> bool {
        let (a, b) = (&self.polynomial, &next.polynomial);
        if a.is_constant() && b.is_constant() {
            return a.first() == b.first();
        }
        if a.degree() != b.degree() || a.last() != b.first() {
            return false;
        }
        let own_is_longer = self.end - self.start >= next.end - next.start;
        let (long, short) = if own_is_longer {
            (self, next)
        } else {
            (next, self)
        };
        let extended = long.between(short.start, short.end);
        let own = short.polynomial.coefficients();
        let all = a.coefficients().iter().chain(b.coefficients());
        let largest = all.fold(0.0f64, |m, c| m.max(c.abs()));
        let mut pairs = extended.coefficients().iter().zip(own);
        pairs.all(|(x, y)| (x - y).abs() <= SAME * largest)
    }

    /// Joins two pieces of one polynomial, keeping both ends.
    fn with(&self, next: &CurvePiece) -> CurvePiece {
        let own_is_longer = self.end - self.start >= next.end - next.start;
        let long = if own_is_longer { self } else { next };
        let whole = long.between(self.start, next.end);
        CurvePiece {
            start: self.start,
            end: next.end,
            polynomial: whole.with_ends(self.polynomial.first(), next.polynomial.last()),
        }
    }
}

/// A constant curve; empty when it has no length.
pub(super) fn hold(start: Time, end: Time, value: f64) -> Vec<CurvePiece> {
    let polynomial = Bernstein::constant(value);
    let piece = CurvePiece {
        start,
        end,
        polynomial,
    };
    if end > start { vec![piece] } else { Vec::new() }
}

/// Joins neighbours that are one polynomial to rounding: equal holds, a straight line continued, a
/// spline's knot without a bend.
pub(super) fn joined(pieces: &[CurvePiece]) -> Vec<CurvePiece> {
    let mut out: Vec<CurvePiece> = Vec::with_capacity(pieces.len());
    for piece in pieces {
        match out.last_mut() {
            Some(previous) if previous.goes_on_in(piece) => *previous = previous.with(piece),
            _ => out.push(*piece),
        }
    }
    for piece in &mut out {
        if piece.polynomial.is_constant() {
            piece.polynomial = Bernstein::constant(piece.polynomial.first());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(start: i64, end: i64, coefficients: &[f64]) -> CurvePiece {
        CurvePiece {
            start: Time::from_micros(start),
            end: Time::from_micros(end),
            polynomial: Bernstein::new(coefficients).unwrap(),
        }
    }

    #[test]
    fn the_same_polynomial_is_joined_and_another_is_not() {
        let line = [piece(0, 10, &[0.1, 0.2]), piece(10, 40, &[0.2, 0.5])];
        assert_eq!(joined(&line), vec![piece(0, 40, &[0.1, 0.5])]);
        let bent = [piece(0, 10, &[0.1, 0.2]), piece(10, 40, &[0.2, 0.6])];
        assert_eq!(joined(&bent).len(), 2);
        let jump = [piece(0, 10, &[0.3]), piece(10, 40, &[0.4])];
        assert_eq!(joined(&jump).len(), 2);
        let cubic = Bernstein::cubic([0.1, 0.9, 0.3, 0.4]);
        let parts: Vec<CurvePiece> = [(0, 30), (30, 50), (50, 100)]
            .iter()
            .map(|(s, e)| CurvePiece {
                polynomial: cubic.part(*s as f64 / 100.0, *e as f64 / 100.0),
                ..piece(*s, *e, &[0.0])
            })
            .collect();
        let whole = joined(&parts);
        assert_eq!(whole.len(), 1);
        let found = whole[0].polynomial.coefficients();
        assert!(
            found
                .iter()
                .zip(cubic.coefficients())
                .all(|(a, b)| (a - b).abs() < 1e-13)
        );
    }

    #[test]
    fn what_never_changes_has_degree_zero() {
        let flat = joined(&[piece(0, 10, &[0.3; 4]), piece(10, 20, &[0.3, 0.3])]);
        assert_eq!(flat, vec![piece(0, 20, &[0.3])]);
    }
}
