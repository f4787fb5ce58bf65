//! Key settings: the control points of all segments, each distinct one once.
//!
//! All coordinates' knots are merged; between two of them the whole setting is one Bezier curve of
//! the largest degree among its coordinates. Two control points are one key when all their numbers
//! are equal, wherever in the sequence they stand: since a knot's value is computed once, equal
//! looks are equal to the bit. A jump is two keys at one time.

#![allow(
    clippy::indexing_slicing,
    reason = "tables over coordinates and segments are made here to one shape"
)]

use std::collections::HashMap;

use super::blend::blend;
use super::{Piece, Timeline, positivity};
use crate::linalg::Bernstein;
use crate::units::Time;

/// Keys times coordinates beyond this many numbers are refused (256 MB).
const MOST_NUMBERS: usize = 1 << 25;
/// Negative numbers above this, left by rounding, are zero in a key.
const ROUNDING: f64 = 1e-11;

/// How keys are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KeyOptions {
    /// Insert no knots for positivity: keys may then need negative light, which blending in floats
    /// does not mind.
    pub signed_keys: bool,
}

/// The show is too large for its keys to be held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the show needs more than {limit} numbers for its key settings")]
pub struct TooManyKeys {
    /// The limit.
    pub limit: usize,
}

/// A stretch on which the setting is one Bezier curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// First instant, microseconds; whole, but for knots inserted for positivity.
    start: f64,
    /// Last instant, microseconds; equal to the first only in a last look without length.
    end: f64,
    /// Its degree, 0 to 3.
    pub degree: usize,
    /// Its `degree + 1` control points, as indices of keys.
    pub keys: Vec<usize>,
}

impl Segment {
    /// First instant, seconds.
    pub fn start(&self) -> f64 {
        self.start / 1e6
    }

    /// Last instant, seconds.
    pub fn end(&self) -> f64 {
        self.end / 1e6
    }

    /// Length, seconds.
    pub fn duration(&self) -> f64 {
        (self.end - self.start) / 1e6
    }
}

/// A show as key settings and the segments between them.
#[derive(Clone, Debug, PartialEq)]
pub struct KeySequence {
    coordinates: usize,
    keys: Vec<Vec<f64>>,
    segments: Vec<Segment>,
    inserted: usize,
    control_points: usize,
    joined: usize,
}

impl KeySequence {
    /// The keys of a timeline.
    ///
    /// A jump at the very end adds a last segment without length, so that the last look has its key;
    /// a timeline without length has that segment alone.
    ///
    /// # Errors
    /// [`TooManyKeys`] when they would not fit in the memory meant for them.
    pub fn new(timeline: &Timeline, options: KeyOptions) -> Result<KeySequence, TooManyKeys> {
        let mut out = KeySequence {
            coordinates: timeline.coordinates(),
            keys: Vec::new(),
            segments: Vec::new(),
            inserted: 0,
            control_points: 0,
            joined: timeline.joined,
        };
        let mut known = Known::new();
        let knots = knots(timeline);
        let mut next = vec![0; timeline.coordinates()];
        for w in knots.windows(2) {
            let &[start, end] = w else { continue };
            let curves = between(timeline, &mut next, start, end);
            out.add(start, end, &curves, options, &mut known)?;
        }
        let reached = out.segments.last().and_then(|s| s.keys.last());
        let reached = reached.and_then(|k| out.keys.get(*k));
        if reached.is_none_or(|k| k != timeline.last()) {
            let at = timeline.end().micros() as f64;
            let look: Vec<Bernstein> = timeline
                .last()
                .iter()
                .map(|v| Bernstein::constant(*v))
                .collect();
            out.push(at, at, 0, &look, &mut known)?;
        }
        Ok(out)
    }

    fn add(
        &mut self,
        start: Time,
        end: Time,
        curves: &[Bernstein],
        options: KeyOptions,
        known: &mut Known,
    ) -> Result<(), TooManyKeys> {
        let degree = curves.iter().map(Bernstein::degree).max().unwrap_or(0);
        let curves: Vec<Bernstein> = curves.iter().map(|c| c.elevated(degree)).collect();
        let (from, to) = (start.micros() as f64, end.micros() as f64);
        if options.signed_keys || degree < 2 {
            return self.push(from, to, degree, &curves, known);
        }
        let inner = positivity::knots(&curves);
        self.inserted += inner.len();
        let mut parameters = vec![0.0];
        parameters.extend(inner);
        parameters.push(1.0);
        let instant = |t: f64| if t == 1.0 { to } else { from + t * (to - from) };
        for w in parameters.windows(2) {
            let &[s, e] = w else { continue };
            let clean = |c: f64| if c < 0.0 && c > -ROUNDING { 0.0 } else { c };
            let parts: Vec<Bernstein> = curves.iter().map(|c| c.part(s, e).mapped(clean)).collect();
            self.push(instant(s), instant(e), degree, &parts, known)?;
        }
        Ok(())
    }

    fn push(
        &mut self,
        start: f64,
        end: f64,
        degree: usize,
        curves: &[Bernstein],
        known: &mut Known,
    ) -> Result<(), TooManyKeys> {
        let mut keys = Vec::with_capacity(degree + 1);
        for i in 0..=degree {
            // Adding zero makes -0 the same as 0.
            let key: Vec<f64> = curves.iter().map(|c| c.coefficients()[i] + 0.0).collect();
            let bits: Vec<u64> = key.iter().map(|x| x.to_bits()).collect();
            let fresh = self.keys.len();
            let index = *known.entry(bits).or_insert(fresh);
            if index == fresh {
                if (fresh + 1) * self.coordinates > MOST_NUMBERS {
                    let limit = MOST_NUMBERS;
                    return Err(TooManyKeys { limit });
                }
                self.keys.push(key);
            }
            keys.push(index);
        }
        self.control_points += keys.len();
        self.segments.push(Segment {
            start,
            end,
            degree,
            keys,
        });
        Ok(())
    }

    /// How many coordinates a key has.
    pub fn coordinates(&self) -> usize {
        self.coordinates
    }

    /// The distinct control points, in the order of their first use.
    pub fn keys(&self) -> &[Vec<f64>] {
        &self.keys
    }

    /// The segments in time, without gaps.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// How many knots positivity inserted.
    pub fn inserted(&self) -> usize {
        self.inserted
    }

    /// How many control points are another's key.
    pub fn merged(&self) -> usize {
        self.control_points - self.keys.len()
    }

    /// How many knots of the cues were no knots of the curves and were dropped.
    pub fn joined(&self) -> usize {
        self.joined
    }

    /// Length of the sequence in seconds.
    pub fn duration(&self) -> f64 {
        let ends = (self.segments.first(), self.segments.last());
        match ends {
            (Some(first), Some(last)) => (last.end - first.start) / 1e6,
            _ => 0.0,
        }
    }

    /// The segment at a time and where in it (0 to 1): the later one at a knot, the first before the
    /// start, the last after the end.
    pub fn segment_at(&self, time: Time) -> (usize, f64) {
        self.at(time.micros() as f64)
    }

    /// [`KeySequence::segment_at`] for a time in seconds, not rounded to the microsecond.
    pub fn segment_at_seconds(&self, seconds: f64) -> (usize, f64) {
        self.at(seconds * 1e6)
    }

    fn at(&self, micros: f64) -> (usize, f64) {
        let after = self.segments.partition_point(|s| s.start <= micros);
        let index = after.saturating_sub(1);
        let t = self.segments.get(index).map_or(0.0, |s| {
            let length = s.end - s.start;
            if length > 0.0 {
                ((micros - s.start) / length).clamp(0.0, 1.0)
            } else {
                0.0
            }
        });
        (index, t)
    }

    /// The settings at a time, blended from the keys.
    pub fn evaluate(&self, time: Time) -> Vec<f64> {
        let (index, t) = self.segment_at(time);
        let mut out = vec![0.0; self.coordinates];
        let Some(segment) = self.segments.get(index) else {
            return out;
        };
        let weights = blend(segment.degree, t).weights();
        for (w, k) in weights.iter().zip(&segment.keys) {
            for (x, v) in out.iter_mut().zip(&self.keys[*k]) {
                *x += w * v;
            }
        }
        out
    }
}

/// Keys by the bits of their numbers; only ever asked, never walked.
type Known = HashMap<Vec<u64>, usize>;

/// All coordinates' knots.
fn knots(timeline: &Timeline) -> Vec<Time> {
    let curves = (0..timeline.coordinates()).map(|c| timeline.curve(c));
    let mut knots: Vec<Time> = curves.flatten().map(|p| p.start).collect();
    if timeline.end() > timeline.start() {
        knots.extend([timeline.start(), timeline.end()]);
    }
    knots.sort();
    knots.dedup();
    knots
}

/// Every coordinate's polynomial between two neighbouring knots; `next` keeps each one's place.
fn between(timeline: &Timeline, next: &mut [usize], start: Time, end: Time) -> Vec<Bernstein> {
    let mut out = Vec::with_capacity(next.len());
    for (c, at) in next.iter_mut().enumerate() {
        let pieces: &[Piece] = timeline.curve(c);
        while pieces.get(*at).is_some_and(|p| p.end <= start) {
            *at += 1;
        }
        let piece = pieces.get(*at);
        out.push(piece.map_or(Bernstein::constant(0.0), |p| p.between(start, end)));
    }
    out
}
