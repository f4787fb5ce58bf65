//! Key settings: the control points of all segments, each distinct one once.
//!
//! The knots of all coordinates are merged; between two of them the whole setting is one Bezier
//! curve of the largest degree among its coordinates. Two control points are one key when all their
//! numbers are equal, anywhere in the sequence: because a knot's value is computed once, equal
//! looks are equal to the bit. A jump is two keys at one time.

#![allow(
    clippy::indexing_slicing,
    reason = "a segment's indices are those of its sequence's keys"
)]

use super::Timeline;
use super::blend::blend;
use super::segment::{Segment, TooManyKeys};
use super::sweep::Sweep;
use crate::units::Time;

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
    /// A jump at the very end adds a last segment of zero length, so that the last look has its
    /// key; a timeline of zero length has that segment alone.
    ///
    /// # Errors
    /// [`TooManyKeys`] when they would take more than 256 MB.
    pub fn new(timeline: &Timeline) -> Result<KeySequence, TooManyKeys> {
        let mut sweep = Sweep::new(timeline);
        sweep.run()?;
        Ok(KeySequence {
            coordinates: timeline.coordinates(),
            keys: sweep.keys,
            segments: sweep.segments,
            inserted: sweep.inserted,
            control_points: sweep.control_points,
            joined: timeline.joined,
        })
    }

    /// Replaces keys and segments of a show: each segment has its start and end in seconds and the
    /// indices of its keys, one more than its degree. Segments are in time, without gaps.
    #[must_use]
    pub fn replaced(
        &self,
        keys: Vec<Vec<f64>>,
        segments: impl Iterator<Item = (f64, f64, Vec<usize>)>,
    ) -> KeySequence {
        let segments = segments.map(|(start, end, keys)| Segment {
            start: 1e6 * start,
            end: 1e6 * end,
            degree: keys.len().saturating_sub(1),
            keys,
        });
        KeySequence {
            coordinates: keys.first().map_or(0, Vec::len),
            control_points: keys.len(),
            keys,
            segments: segments.collect(),
            inserted: 0,
            joined: self.joined,
        }
    }

    /// Number of coordinates of a key.
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

    /// Number of knots that positivity inserted.
    pub fn inserted(&self) -> usize {
        self.inserted
    }

    /// Number of control points that equal another's key.
    pub fn merged(&self) -> usize {
        self.control_points - self.keys.len()
    }

    /// Number of knots of the cues that no curve needs and that were dropped.
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

    /// The segment at a time and the position in it (0 to 1): the later segment at a knot, the
    /// first before the start, the last after the end.
    pub fn segment_at(&self, time: Time) -> (usize, f64) {
        let micros = time.micros() as f64;
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
