//! Poses of heads over time, and warnings about them.

#![allow(
    clippy::indexing_slicing,
    reason = "the model's indices are valid (show's invariant) and tables are made to its shape"
)]

use std::collections::BTreeMap;

pub use crate::model::Pose;

use super::error::{TimelineError, TimelineWarning};
use super::lint::{Out, outs};
use super::stretch::{Stretch, Track};
use super::track::{level_at, level_before};
use super::{CurvePiece, Timeline};
use crate::linalg::Bernstein;
use crate::model::{Head, HeadAxis, LightKind, NodeId, Show};
use crate::units::Time;

impl Timeline {
    /// The pose of a head of [`Show::heads`] at a time; times as in [`Timeline::evaluate`].
    pub fn pose(&self, head: usize, time: Time) -> Pose {
        let Some(ranges) = self.heads.get(head) else {
            return Pose::default();
        };
        let value = |axis| {
            let (pieces, last) = self.pose_curve(head, axis);
            self.value(pieces, last, time)
        };
        ranges.pose(HeadAxis::ALL.map(value))
    }

    /// The poses of all heads at a time.
    pub fn poses(&self, time: Time) -> Vec<Pose> {
        (0..self.heads.len())
            .map(|head| self.pose(head, time))
            .collect()
    }

    /// Knots of a head's pose, in order, each once: between them pan, tilt, beam and field are
    /// polynomials in time of degree 3 at most.
    pub fn pose_knots(&self, head: usize) -> Vec<Time> {
        let pieces = HeadAxis::ALL
            .into_iter()
            .flat_map(|axis| self.pose_curve(head, axis).0);
        let mut knots: Vec<Time> = pieces.flat_map(|p| [p.start, p.end]).collect();
        knots.sort_unstable();
        knots.dedup();
        knots
    }

    /// The pieces of one axis of a head, from 0 to 1 over its range, and its value at the end.
    pub fn pose_curve(&self, head: usize, axis: HeadAxis) -> (&[CurvePiece], f64) {
        let first = self.own.len() - 4 * self.heads.len();
        let levels = self.parameters.get(&(first + 4 * head + axis as usize));
        levels.map_or((&[], 0.0), |l| (l.pieces.as_slice(), l.last))
    }
}

/// Reports spots whose beam gets as wide as their field, one error for each head.
pub(super) fn beams(show: &Show, tracks: &[Track], start: Time, end: Time) -> Vec<TimelineError> {
    let mut errors = Vec::new();
    for (head, (light, ..)) in show.heads().into_iter().enumerate() {
        let first = show.first_pose_of(head);
        let (beam, field) = (&tracks[first + 2], &tracks[first + 3]);
        let spot = matches!(show.lights[light].kind, LightKind::Spot(_));
        if let Some((id, time)) = meeting(beam, field, start, end).filter(|_| spot) {
            errors.push(TimelineError::Beam { id, head, time });
        }
    }
    errors
}

/// The first time between `start` and `end` when the first track is not below the second, with the
/// later of the moves that cause it.
fn meeting(low: &Track, high: &Track, start: Time, end: Time) -> Option<(NodeId, Time)> {
    let (mut i, mut j) = (0, 0);
    while let (Some(a), Some(b)) = (low.get(i), high.get(j)) {
        let from = a.piece.start.max(b.piece.start).max(start);
        let to = a.piece.end.min(b.piece.end).min(end);
        // Without length, only the last moment counts.
        if from < to || (from == to && to == end && a.piece.end > end && b.piece.end > end) {
            let [over, under] = [b, a].map(|s| s.piece.between(from, to).elevated(3));
            let mut between = [0.0; 4];
            let coefficients = over.coefficients().iter().zip(under.coefficients());
            for (slot, (over, under)) in between.iter_mut().zip(coefficients) {
                *slot = over - under;
            }
            let ((t, least), _) = Bernstein::cubic(between).range();
            let later = if a.piece.start > b.piece.start { a } else { b };
            let by = later.by.or(a.by).or(b.by);
            if let (true, Some((id, _))) = (least <= 0.0, by) {
                return Some((id, from + (to - from).scaled(t)));
            }
        }
        if a.piece.end <= b.piece.end {
            i += 1;
        } else {
            j += 1;
        }
    }
    None
}

/// One turn of a head, both axes together.
#[derive(Clone, Copy, Debug)]
struct Turn {
    degrees: f64,
    end: Time,
}

/// Reports heads that cannot be in place in time, and heads that turn while their light fades out.
/// A head in the dark has the whole dark time to turn; a lit one has the time of its move.
pub(super) fn turns(show: &Show, tracks: &[Track], start: Time, end: Time) -> Vec<TimelineWarning> {
    let mut warnings = Vec::new();
    let levels = show.first_parameters();
    for (index, (_, head, bank)) in show.heads().into_iter().enumerate() {
        let level = &tracks[levels[bank]];
        let first = show.first_pose_of(index);
        let moves = turned(head, &tracks[first..first + 2]);
        let moves = moves
            .into_iter()
            .filter(|((at, _), _)| *at <= end && *at > start);
        let dark = outs(levels[bank], level);
        for ((at, id), turn) in moves {
            let needs = Time::nearest(turn.degrees / head.speed);
            let after = dark.partition_point(|out| out.start <= at);
            let around = |out: &&Out| out.end >= at;
            let out = after.checked_sub(1).map(|i| &dark[i]).filter(around);
            let has = match out {
                Some(out) if turn.end == at => out.end - out.start,
                _ => turn.end - at,
            };
            if needs > has {
                warnings.push(TimelineWarning::Late {
                    id,
                    head: index,
                    time: at,
                    needs,
                    has,
                    dark: out.is_some(),
                });
            } else if out.is_none() && level_at(level, turn.end) == 0.0 {
                warnings.push(TimelineWarning::Seen {
                    id,
                    head: index,
                    time: at,
                    until: turn.end,
                });
            }
        }
    }
    warnings
}

/// The moves of pan and tilt that turn a head, by start and move.
fn turned(head: &Head, axes: &[Track]) -> BTreeMap<(Time, NodeId), Turn> {
    let mut out: BTreeMap<(Time, NodeId), Turn> = BTreeMap::new();
    for (track, [low, high]) in axes.iter().zip([head.pan, head.tilt]) {
        for run in track.chunk_by(|a: &Stretch, b| a.by == b.by) {
            let (Some(first), Some(last)) = (run.first(), run.last()) else {
                continue;
            };
            let Some((id, _)) = first.by else { continue };
            let start = first.piece.start;
            let by = (last.piece.polynomial.last() - level_before(track, start)).abs();
            let degrees = by * (high - low);
            if degrees < 1e-6 {
                continue;
            }
            let end = if last.holds {
                last.piece.start
            } else {
                last.piece.end
            };
            let turn = out.entry((start, id)).or_insert(Turn { degrees, end });
            turn.degrees = turn.degrees.max(degrees);
            turn.end = turn.end.max(end);
        }
    }
    out
}
