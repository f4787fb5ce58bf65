//! Dimmers: level to light.
//!
//! The composition is exact when the product of the degrees of level and law is at most 3. (A law
//! with knots inside a fade is exact up to the rounding of the knots' instants to a microsecond: at
//! most 1e-7 in a fade of 5 s.) Otherwise it is fitted by cubics: ends exact, values between the
//! ends' values (so within 0 to 1), within [`TOLERANCE`] of the light at full.

use std::cmp::Ordering;

use super::curve::CurvePiece;
use super::error::TimelineError;
use super::spline::{Splined, curve_spans};
use crate::linalg::Bernstein;
use crate::model::{Dimmer, Interpolation, NamedCurve, Show};
use crate::units::Time;

/// Largest error of the light, in settings. Fits in sequence (a law, an effect, a colour) share it.
pub(super) const TOLERANCE: f64 = 1e-4;
/// Rounding by which a law may leave 0 to 1.
const ROUNDING: f64 = 1e-12;
/// Interior points at which a fit is compared. A little less than half the tolerance is required
/// there, so that the error between them stays below half.
const SAMPLES: usize = 15;

/// A dimmer ready to be applied.
pub(super) enum Law {
    Linear,
    Square,
    Curve { curve: Splined, jumps: bool },
}

/// The settings (0 to 1) of levels (0 to 1) by a dimmer; `curves` are the show's.
pub fn settings(dimmer: Dimmer, curves: &[NamedCurve], levels: &[f64]) -> Vec<f64> {
    let law = Law::new(dimmer, curves);
    levels.iter().map(|level| law.value(*level)).collect()
}

/// The level (0 to 1) at which a dimmer gives a setting, the nearest to `near` if there are
/// several. An unreachable setting is replaced by the nearest one.
pub fn level(dimmer: Dimmer, curves: &[NamedCurve], setting: f64, near: f64) -> f64 {
    let law = Law::new(dimmer, curves);
    let off = |level: f64| Some((law.value(level) - setting).abs()).filter(|off| *off > 1e-9);
    let away = |level: &f64| (off(*level).unwrap_or(0.0), (level - near).abs());
    let closer = |a: &f64, b: &f64| away(a).partial_cmp(&away(b)).unwrap_or(Ordering::Equal);
    let levels = law.levels(setting).into_iter().chain([near]);
    levels.min_by(closer).unwrap_or(near)
}

/// The least and the largest setting of a dimmer.
pub fn range(dimmer: Dimmer, curves: &[NamedCurve]) -> (f64, f64) {
    let law = Law::new(dimmer, curves);
    let ends = law
        .levels(f64::NAN)
        .into_iter()
        .map(|level| law.value(level));
    ends.fold((1.0, 0.0), |(least, most), value| {
        (value.min(least), value.max(most))
    })
}

/// The light of each coordinate of a show, relative to full, when its parameters
/// ([`Show::parameters`]) are at `levels`.
pub fn lights(show: &Show, levels: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(levels.len());
    for (bank, first) in show.banks.iter().zip(show.first_parameters()) {
        let at = |parameter: usize| levels.get(parameter).copied().unwrap_or(0.0);
        let light = Law::new(bank.dimmer, &show.curves).value(at(first));
        if bank.rgb {
            out.extend((first + 1..first + 4).map(|emitter| light * at(emitter)))
        } else {
            out.push(light)
        }
    }
    out.extend((!show.fixed.is_empty()).then_some(1.0));
    out
}

/// Reports laws that leave 0 to 1 at some level.
pub(super) fn check(show: &Show) -> Vec<TimelineError> {
    let mut used: Vec<usize> = Vec::new();
    for bank in &show.banks {
        if let Dimmer::Curve(i) = bank.dimmer
            && !used.contains(&i)
        {
            used.push(i);
        }
    }
    used.iter()
        .filter_map(|i| leaves(show.curves.get(*i)?))
        .collect()
}

fn leaves(curve: &NamedCurve) -> Option<TimelineError> {
    let mut worst: Option<(f64, f64, f64)> = None;
    let ends = curve.knots.iter().map(|k| (k.at, k.value));
    let inner = curve
        .knots
        .windows(2)
        .zip(curve_spans(curve))
        .flat_map(|(k, s)| {
            let (low, high) = s.range();
            let (from, to) = match k {
                [a, b] => (a.at, b.at),
                _ => (0.0, 1.0),
            };
            [low, high].map(|(t, v)| (from + t * (to - from), v))
        });
    for (at, value) in ends.chain(inner) {
        let off = (-value).max(value - 1.0);
        if off > ROUNDING && worst.is_none_or(|w| off > w.2) {
            worst = Some((at, value, off));
        }
    }
    let id = curve.id;
    worst.map(|(at, value, _)| TimelineError::Dimmer { id, at, value })
}

impl Law {
    pub(super) fn new(dimmer: Dimmer, curves: &[NamedCurve]) -> Law {
        let curve = match dimmer {
            Dimmer::Linear => return Law::Linear,
            Dimmer::Square => return Law::Square,
            Dimmer::Curve(i) => curves.get(i),
        };
        curve.map_or(Law::Linear, |c| Law::Curve {
            curve: Splined::new(c),
            jumps: c.interpolation == Interpolation::Steps,
        })
    }

    /// The setting of a level.
    pub(super) fn value(&self, level: f64) -> f64 {
        match self {
            Law::Linear => level,
            Law::Square => level * level,
            Law::Curve {
                curve: Splined { at, last, .. },
                ..
            } => {
                if at.last().is_none_or(|end| level >= *end) {
                    return *last;
                }
                let after = at.partition_point(|a| *a <= level);
                self.local(after.saturating_sub(1))
                    .map_or(*last, |l| l.value(level))
            }
        }
    }

    /// The law's polynomial in a span, as (from, length, polynomial).
    fn local(&self, span: usize) -> Option<Local> {
        let Law::Curve {
            curve: Splined { at, spans, .. },
            ..
        } = self
        else {
            return None;
        };
        let (from, to) = (*at.get(span)?, *at.get(span + 1)?);
        Some(Local {
            from,
            length: to - from,
            polynomial: *spans.get(span)?,
        })
    }

    /// The law's polynomial around a level.
    fn around(&self, level: f64) -> Local {
        let whole = |p: Bernstein| Local {
            from: 0.0,
            length: 1.0,
            polynomial: p,
        };
        match self {
            Law::Linear => whole(Bernstein::linear(0.0, 1.0)),
            Law::Square => whole(Bernstein::quadratic([0.0, 0.0, 1.0])),
            Law::Curve {
                curve: Splined { at, last, .. },
                ..
            } => {
                let after = at.partition_point(|a| *a <= level);
                let span = after.saturating_sub(1).min(at.len().saturating_sub(2));
                self.local(span)
                    .unwrap_or(whole(Bernstein::constant(*last)))
            }
        }
    }

    /// The levels that give a setting, and those where the law begins, turns and ends.
    fn levels(&self, setting: f64) -> Vec<f64> {
        let mut knots = [&[0.0], self.knots(), &[1.0]].concat();
        knots.dedup();
        let mut levels = knots.clone();
        for (from, to) in knots.iter().zip(knots.iter().skip(1)) {
            let law = self.around(0.5 * (from + to));
            let parts = [vec![0.0], law.polynomial.turns(), vec![1.0]].concat();
            let pairs = parts.iter().zip(parts.iter().skip(1));
            let found = pairs.filter_map(|(s, e)| crossing(&law.polynomial, *s, *e, setting));
            let inside = found.chain(parts.iter().copied());
            levels.extend(inside.map(|t| law.from + t * law.length));
        }
        levels
    }

    fn knots(&self) -> &[f64] {
        match self {
            Law::Curve { curve, .. } => &curve.at,
            _ => &[],
        }
    }

    /// Applies the law to a curve of levels. A fit is within half of `tolerance`.
    pub(super) fn applied(&self, levels: &[CurvePiece], tolerance: f64) -> Vec<CurvePiece> {
        let mut out = Vec::with_capacity(levels.len());
        for piece in levels {
            match self {
                Law::Linear => out.push(*piece),
                Law::Square if piece.polynomial.degree() <= 1 => out.push(squared(piece)),
                _ => self.compose(piece, tolerance, &mut out),
            }
        }
        out
    }

    fn compose(&self, piece: &CurvePiece, tolerance: f64, out: &mut Vec<CurvePiece>) {
        let p = &piece.polynomial;
        if p.is_constant() {
            let polynomial = Bernstein::constant(self.value(p.first()));
            out.push(CurvePiece {
                polynomial,
                ..*piece
            });
            return;
        }
        let mut times = vec![piece.start];
        times.extend(self.splits(piece));
        times.push(piece.end);
        for w in times.windows(2) {
            let &[start, end] = w else { continue };
            let level = CurvePiece {
                start,
                end,
                polynomial: piece.between(start, end),
            };
            self.compose_monotone(&level, tolerance, out);
        }
    }

    /// Times at which a piece turns or crosses a knot of the law, to the microsecond.
    fn splits(&self, piece: &CurvePiece) -> Vec<Time> {
        let p = &piece.polynomial;
        let mut parts = vec![0.0];
        parts.extend(p.turns());
        parts.push(1.0);
        let mut at: Vec<f64> = p.turns();
        for w in parts.windows(2) {
            let &[s, e] = w else { continue };
            for knot in self.knots() {
                at.extend(crossing(p, s, e, *knot));
            }
        }
        let span = piece.end - piece.start;
        let mut times: Vec<Time> = at.iter().map(|t| piece.start + span.scaled(*t)).collect();
        times.retain(|t| *t > piece.start && *t < piece.end);
        times.sort();
        times.dedup();
        times
    }

    fn compose_monotone(&self, level: &CurvePiece, tolerance: f64, out: &mut Vec<CurvePiece>) {
        let q = &level.polynomial;
        let law = self.around(q.value(0.5));
        let times = (level.start, level.end);
        let jumps = matches!(self, Law::Curve { jumps: true, .. });
        let one_sided = |x: f64| if jumps { law.value(x) } else { self.value(x) };
        let ends = (one_sided(q.first()), one_sided(q.last()));
        let exact = match (q.degree(), law.polynomial.degree()) {
            (_, 0) => Some(Bernstein::constant(law.polynomial.first())),
            (1, _) => {
                let local = |x: f64| (x - law.from) / law.length;
                Some(law.polynomial.part(local(q.first()), local(q.last())))
            }
            (_, 1) => Some(q.mapped(|x| law.value(x))),
            _ => None,
        };
        match exact {
            Some(polynomial) => out.push(CurvePiece {
                polynomial: polynomial.with_ends(ends.0, ends.1),
                ..*level
            }),
            None => {
                let level = level.polynomial;
                let composed = Composed { law, level };
                let stretch = Stretch {
                    share: (0.0, 1.0),
                    times,
                    ends,
                };
                fit(&composed, stretch, tolerance, out);
            }
        }
    }
}

/// A polynomial of the law with its position.
struct Local {
    from: f64,
    length: f64,
    polynomial: Bernstein,
}

impl Local {
    fn value(&self, level: f64) -> f64 {
        self.polynomial.value((level - self.from) / self.length)
    }

    fn slope(&self, level: f64) -> f64 {
        self.polynomial.slope((level - self.from) / self.length) / self.length
    }
}

fn squared(piece: &CurvePiece) -> CurvePiece {
    let (a, b) = (piece.polynomial.first(), piece.polynomial.last());
    let polynomial = if piece.polynomial.degree() == 0 {
        Bernstein::constant(a * a)
    } else {
        Bernstein::quadratic([a * a, a * b, b * b])
    };
    CurvePiece {
        polynomial,
        ..*piece
    }
}

/// The point strictly inside [s, e] where the monotone `p` crosses `value`, by bisection.
fn crossing(p: &Bernstein, s: f64, e: f64, value: f64) -> Option<f64> {
    let above = |t: f64| p.value(t) > value;
    if above(s) == above(e) {
        return None;
    }
    let (mut low, mut high) = (s, e);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if above(middle) == above(s) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

/// A law composed with a monotone level.
struct Composed {
    law: Local,
    level: Bernstein,
}

impl Fitted for Composed {
    fn value(&self, t: f64) -> f64 {
        self.law.value(self.level.value(t))
    }

    fn slope(&self, t: f64) -> f64 {
        self.law.slope(self.level.value(t)) * self.level.slope(t)
    }
}

/// A function over [0, 1] that [`fit`] approximates.
pub(super) trait Fitted {
    fn value(&self, t: f64) -> f64;
    fn slope(&self, t: f64) -> f64;
}

/// A part of [0, 1] with its times and the values at its ends.
#[derive(Clone, Copy)]
pub(super) struct Stretch {
    pub share: (f64, f64),
    pub times: (Time, Time),
    pub ends: (f64, f64),
}

/// Fits cubics to a function that is monotone over a stretch: Hermite, with slopes limited to keep
/// them between the end values (Fritsch and Carlson), halved in time until within half of
/// `tolerance`.
pub(super) fn fit(of: &impl Fitted, stretch: Stretch, tolerance: f64, out: &mut Vec<CurvePiece>) {
    let Stretch {
        share: (from, to),
        times: (start, end),
        ends,
    } = stretch;
    let (chord, length) = (ends.1 - ends.0, to - from);
    let limited = |slope: f64| {
        if slope * chord <= 0.0 {
            0.0
        } else {
            slope.abs().min(3.0 * chord.abs()).copysign(chord)
        }
    };
    let slope = |t: f64| limited(of.slope(t) * length);
    let cubic = Bernstein::hermite(ends.0, ends.1, slope(from), slope(to));
    let off = (1..=SAMPLES)
        .map(|i| i as f64 / (SAMPLES + 1) as f64)
        .map(|t| (cubic.value(t) - of.value(from + t * length)).abs())
        .fold(0.0f64, f64::max);
    let half = (end - start).scaled(0.5);
    if off <= 0.48 * tolerance || half == Time::ZERO || start + half == end {
        out.push(CurvePiece {
            start,
            end,
            polynomial: cubic,
        });
        return;
    }
    let middle = start + half;
    let share = half.micros() as f64 / (end - start).micros() as f64;
    let inner = from + share * length;
    let value = of.value(inner);
    let first = Stretch {
        share: (from, inner),
        times: (start, middle),
        ends: (ends.0, value),
    };
    let second = Stretch {
        share: (inner, to),
        times: (middle, end),
        ends: (value, ends.1),
    };
    fit(of, first, tolerance, out);
    fit(of, second, tolerance, out);
}
