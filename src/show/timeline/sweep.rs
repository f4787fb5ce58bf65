//! One pass over all knots in time that builds segments and keys.
//!
//! In a large show few coordinates move at a time. So the sweep keeps one current setting, in which
//! only moving coordinates are rewritten for each control point. Equal keys are found by a hash
//! that is a sum over the coordinates, so that it too changes only with the setting.

#![allow(
    clippy::indexing_slicing,
    reason = "tables over coordinates are made here to one shape; indices of keys are made here"
)]

use std::collections::HashMap;

use super::segment::{MOST_BYTES, Segment, TooManyKeys};
use super::{CurvePiece, Timeline, positivity};
use crate::hash::{GOLDEN, mix};
use crate::linalg::Bernstein;
use crate::units::Time;

/// Approximate overhead of a key beyond its numbers, bytes.
const KEY_BYTES: usize = 64;
/// Approximate size of a segment with its list of keys, bytes.
const SEGMENT_BYTES: usize = 112;
/// Rounding: numbers of a key between minus this and 0 become 0.
const ROUNDING: f64 = 1e-11;

/// The result so far, and the setting at the current knot.
pub(super) struct Sweep<'a> {
    timeline: &'a Timeline,
    /// The distinct control points, in the order of their first use.
    pub keys: Vec<Vec<f64>>,
    /// The segments in time.
    pub segments: Vec<Segment>,
    /// Knots that positivity inserted.
    pub inserted: usize,
    /// Number of control points of all segments.
    pub control_points: usize,
    /// Keys by hash; a key whose hash is taken uses the next free number. Only looked up, never
    /// iterated.
    known: HashMap<u64, usize>,
    /// The setting, valid for coordinates that hold.
    current: Vec<f64>,
    /// The share of the holding coordinates in the hash.
    hash: u64,
    /// Moving coordinates, with their pieces.
    moving: Vec<(usize, &'a CurvePiece)>,
    /// Index of each coordinate in `moving`.
    places: Vec<Option<usize>>,
}

impl<'a> Sweep<'a> {
    pub fn new(timeline: &'a Timeline) -> Sweep<'a> {
        let n = timeline.coordinates();
        Sweep {
            timeline,
            keys: Vec::new(),
            segments: Vec::new(),
            inserted: 0,
            control_points: 0,
            known: HashMap::new(),
            current: vec![0.0; n],
            hash: (0..n).fold(0, |sum, c| sum.wrapping_add(hash_share(c, 0.0))),
            moving: Vec::new(),
            places: vec![None; n],
        }
    }

    pub fn run(&mut self) -> Result<(), TooManyKeys> {
        let pieces = in_time(self.timeline);
        let starts = pieces.chunk_by(|a, b| a.0 == b.0);
        let mut knots = starts.peekable();
        while let Some(begun) = knots.next() {
            let Some((start, ..)) = begun.first() else {
                continue;
            };
            for (_, coordinate, piece) in begun {
                self.begin_piece(*coordinate, piece);
            }
            let next = knots.peek().and_then(|n| n.first()).map(|n| n.0);
            self.push_segments_between(*start, next.unwrap_or(self.timeline.end()))?;
        }
        self.push_last_look()
    }

    /// Starts a piece of a coordinate, which then moves or holds.
    fn begin_piece(&mut self, coordinate: usize, piece: &'a CurvePiece) {
        let moves = piece.polynomial.degree() > 0;
        match (self.places[coordinate], moves) {
            (Some(place), true) => self.moving[place].1 = piece,
            (Some(place), false) => self.stop_moving(place),
            (None, true) => {
                self.hash = self.hash.wrapping_sub(self.held_hash(coordinate));
                self.places[coordinate] = Some(self.moving.len());
                self.moving.push((coordinate, piece));
            }
            (None, false) => self.hash = self.hash.wrapping_sub(self.held_hash(coordinate)),
        }
        if !moves {
            self.current[coordinate] = without_rounding(piece.polynomial.first());
            self.hash = self.hash.wrapping_add(self.held_hash(coordinate));
        }
    }

    /// A holding coordinate's share of the hash.
    fn held_hash(&self, coordinate: usize) -> u64 {
        hash_share(coordinate, self.current[coordinate])
    }

    /// Removes an entry of `moving`; the last one takes its index.
    fn stop_moving(&mut self, place: usize) {
        let (coordinate, _) = self.moving.swap_remove(place);
        self.places[coordinate] = None;
        if let Some((other, _)) = self.moving.get(place) {
            self.places[*other] = Some(place);
        }
    }

    /// Adds the segments between two neighbouring knots.
    fn push_segments_between(&mut self, start: Time, end: Time) -> Result<(), TooManyKeys> {
        let degrees = self.moving.iter().map(|(_, p)| p.polynomial.degree());
        let degree = degrees.max().unwrap_or(0);
        let curves: Vec<Bernstein> = self
            .moving
            .iter()
            .map(|(_, p)| p.between(start, end).elevated(degree))
            .collect();
        let (from, to) = (start.micros() as f64, end.micros() as f64);
        if degree < 2 {
            return self.push_segment((from, to), degree, &curves);
        }
        // Reflected light of heads is a sum of both signs.
        let first_bounced = self.timeline.coordinates() - self.timeline.bounced().len();
        let own = self.moving.iter().zip(&curves);
        let own = own.filter(|((coordinate, _), _)| *coordinate < first_bounced);
        let own: Vec<Bernstein> = own.map(|(_, curve)| *curve).collect();
        let inner = positivity::knots(&own);
        self.inserted += inner.len();
        let mut parameters = vec![0.0];
        parameters.extend(inner);
        parameters.push(1.0);
        let instant = |t: f64| if t == 1.0 { to } else { from + t * (to - from) };
        for w in parameters.windows(2) {
            let &[s, e] = w else { continue };
            let parts: Vec<Bernstein> = curves.iter().map(|c| c.part(s, e)).collect();
            self.push_segment((instant(s), instant(e)), degree, &parts)?;
        }
        Ok(())
    }

    /// Adds a segment on which the moving coordinates, in their order, follow `curves`.
    fn push_segment(
        &mut self,
        (start, end): (f64, f64),
        degree: usize,
        curves: &[Bernstein],
    ) -> Result<(), TooManyKeys> {
        let mut keys = Vec::with_capacity(degree + 1);
        for i in 0..=degree {
            let mut hash = self.hash;
            for (m, curve) in curves.iter().enumerate() {
                let coordinate = self.moving[m].0;
                let value = without_rounding(curve.coefficients()[i]);
                self.current[coordinate] = value;
                hash = hash.wrapping_add(hash_share(coordinate, value));
            }
            keys.push(self.intern_key(hash)?);
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

    /// Index of the key for the current setting, added if new.
    fn intern_key(&mut self, mut hash: u64) -> Result<usize, TooManyKeys> {
        while let Some(&index) = self.known.get(&hash) {
            if self.keys[index] == self.current {
                return Ok(index);
            }
            hash = hash.wrapping_add(1);
        }
        let index = self.keys.len();
        let key = KEY_BYTES + size_of_val(self.current.as_slice());
        if (index + 1) * key + self.segments.len() * SEGMENT_BYTES > MOST_BYTES {
            return Err(TooManyKeys);
        }
        self.known.insert(hash, index);
        self.keys.push(self.current.clone());
        Ok(index)
    }

    /// Adds a segment of zero length for the last look when the last segment does not end with it.
    fn push_last_look(&mut self) -> Result<(), TooManyKeys> {
        let last = self.timeline.last().iter();
        let last: Vec<f64> = last.map(|v| without_rounding(*v)).collect();
        let reached = self.segments.last().and_then(|s| s.keys.last());
        if reached.is_some_and(|k| self.keys[*k] == last) {
            return Ok(());
        }
        self.moving.clear();
        let shares = last.iter().enumerate().map(|(c, v)| hash_share(c, *v));
        self.hash = shares.fold(0, u64::wrapping_add);
        self.current = last;
        let at = self.timeline.end().micros() as f64;
        self.push_segment((at, at), 0, &[])
    }
}

/// All pieces with their starts and coordinates, in time.
fn in_time(timeline: &Timeline) -> Vec<(Time, usize, &CurvePiece)> {
    let of = |c: usize| timeline.curve(c).iter().map(move |p| (p.start, c, p));
    let mut pieces: Vec<_> = (0..timeline.coordinates()).flat_map(of).collect();
    pieces.sort_by_key(|(start, ..)| *start);
    pieces
}

/// `x` without rounding below zero (see [`ROUNDING`]); adding zero turns -0 into 0.
fn without_rounding(x: f64) -> f64 {
    if x < 0.0 && x > -ROUNDING {
        0.0
    } else {
        x + 0.0
    }
}

/// A coordinate's share in a key's hash, from the bits of its number and its index.
fn hash_share(coordinate: usize, value: f64) -> u64 {
    let place = (coordinate as u64).wrapping_mul(GOLDEN);
    mix(value.to_bits().wrapping_add(place))
}
