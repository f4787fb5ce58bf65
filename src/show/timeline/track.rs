//! A parameter's levels through the show: moves in the order of the cue list, each taking over from
//! a running or waiting one.

#![allow(
    clippy::indexing_slicing,
    reason = "the model's indices are valid (show's invariant) and tables are made to its shape"
)]

use std::borrow::Cow;

use super::clock::{CueTime, length};
use super::curve::CurvePiece;
use super::error::{TimelineError, TimelineWarning};
use super::lint::{Run, Watch};
use super::motion::{MOST_PIECES, Moved};
use super::spline::{Splined, path_spans};
use super::stretch::{Stretch, Track};
use crate::linalg::Bernstein;
use crate::model::{Fade, Interpolation, Motion, Path, Role, Show};
use crate::units::Time;

/// Levels outside 0 to 1 by less than this are rounding.
const ROUNDING: f64 = 1e-11;
/// A level below this is out, up to rounding.
const DARK: f64 = 1e-9;
/// A time outside every show.
const NEVER: Time = Time::from_micros(i64::MAX / 4);

/// Plays all moves in the order of the list.
pub(super) fn tracks(
    show: &Show,
    cues: &[CueTime],
    motions: Vec<Vec<Moved<'_>>>,
) -> Result<(Vec<Track>, Vec<TimelineWarning>), Vec<TimelineError>> {
    let parameters = show.parameters();
    let levels = show.first_parameters();
    let first = |value: f64| {
        vec![Stretch {
            piece: CurvePiece {
                start: -NEVER,
                end: NEVER,
                polynomial: Bernstein::constant(value),
            },
            by: None,
            holds: true,
        }]
    };
    let mut tracks: Vec<Track> = show.dark_levels().into_iter().map(first).collect();
    let fades = Fades::new(show);
    let mut watch = Watch::new(show, cues, tracks.len());
    let mut count = 0usize;
    for (cue, (time, moved)) in cues.iter().zip(&motions).enumerate() {
        for m in moved {
            let start = time.go + m.timing.delay;
            let parameter = &parameters[m.parameter];
            let level = match parameter.role {
                Role::Emitter(_) | Role::Pose(..) => parameter.bank.map(|bank| levels[bank]),
                Role::Level | Role::Fixed => None,
            };
            let unseen = level.is_some_and(|level| {
                let level = &tracks[level];
                level_before(level, start) < DARK || level_at(level, start) < DARK
            });
            let mut m = Cow::Borrowed(m);
            if unseen {
                // In the dark a colour changes and a head turns at once.
                let timing = &mut m.to_mut().timing;
                (timing.up, timing.down) = (Time::ZERO, Time::ZERO);
            }
            let m = m.as_ref();
            let track = &mut tracks[m.parameter];
            let from = cut(track, start);
            let passes = fades.pieces(m, from, start, MOST_PIECES - count);
            let Some((pieces, level)) = passes else {
                let limit = MOST_PIECES;
                return Err(vec![TimelineError::TooManyPieces { id: m.id, limit }]);
            };
            count += pieces.len();
            let end = pieces.last().map_or(start, |p| p.end);
            let run = Run {
                start,
                end,
                from,
                to: level,
            };
            watch.played(cue, m, run);
            let by = Some((m.id, m.parameter));
            track.extend(pieces.into_iter().map(|piece| Stretch {
                piece,
                by,
                holds: false,
            }));
            track.push(Stretch {
                piece: CurvePiece {
                    start: end,
                    end: NEVER,
                    polynomial: Bernstein::constant(level),
                },
                by,
                holds: true,
            });
        }
    }
    Ok((tracks, watch.finish(show)))
}

/// Ends a track at `time` and returns its level there (after a jump, the later one).
fn cut(track: &mut Track, time: Time) -> f64 {
    let level = level_at(track, time);
    while track.last().is_some_and(|s| s.piece.start >= time) {
        track.pop();
    }
    if let Some(last) = track.last_mut() {
        let kept = last
            .piece
            .between(last.piece.start, time.min(last.piece.end));
        last.piece.polynomial = kept;
        last.piece.end = time.min(last.piece.end);
    }
    level
}

/// Start of each move of a track, and its end or interruption. A move without time and change does
/// not count.
pub(super) fn moves(track: &Track) -> Vec<(Time, Time)> {
    let mut level = track.first().map_or(0.0, |s| s.piece.polynomial.first());
    let of = |stretches: &[Stretch]| {
        let (first, last) = (stretches.first()?, stretches.last()?);
        let end = if last.holds {
            last.piece.start
        } else {
            last.piece.end
        };
        let still = first.holds && first.piece.polynomial.first() == level;
        level = last.piece.polynomial.last();
        let moves = first.by.is_some() && !still;
        moves.then_some((first.piece.start, end))
    };
    track.chunk_by(|a, b| a.by == b.by).filter_map(of).collect()
}

/// The level at a time; at a jump the earlier one.
pub(super) fn level_before(track: &Track, time: Time) -> f64 {
    let after = track.partition_point(|s| s.piece.start < time);
    let at = after.checked_sub(1).and_then(|i| track.get(i));
    at.map_or(0.0, |s| s.piece.value(time))
}

/// The level at a time; at a jump the later one.
pub(super) fn level_at(track: &Track, time: Time) -> f64 {
    // Fast path: nearly every move begins after the one before has arrived.
    if let Some(last) = track.last().filter(|s| s.piece.start <= time) {
        return last.piece.value(time);
    }
    let after = track.partition_point(|s| s.piece.start <= time);
    let at = after.checked_sub(1).and_then(|i| track.get(i));
    at.map_or(0.0, |s| s.piece.value(time))
}

/// The pieces within [start, end], cut at both.
pub(super) fn trimmed(track: &Track, start: Time, end: Time) -> Vec<CurvePiece> {
    let within = |s: &Stretch| {
        let (a, b) = (s.piece.start.max(start), s.piece.end.min(end));
        (a < b).then(|| CurvePiece {
            start: a,
            end: b,
            polynomial: s.piece.between(a, b),
        })
    };
    track.iter().filter_map(within).collect()
}

/// One error for each move that visibly leaves 0 to 1, where it is farthest outside.
pub(super) fn out_of_range(tracks: &[Track], start: Time, end: Time) -> Vec<TimelineError> {
    let mut errors = Vec::new();
    for track in tracks {
        let seen = |s: &&Stretch| s.piece.start <= end && s.piece.end >= start;
        let seen: Vec<&Stretch> = track.iter().filter(seen).collect();
        for move_ in seen.chunk_by(|a, b| a.by == b.by) {
            errors.extend(farthest_outside(move_));
        }
    }
    errors
}

/// The point where the stretches of one move are farthest outside 0 to 1, if any.
fn farthest_outside(stretches: &[&Stretch]) -> Option<TimelineError> {
    let (id, parameter) = stretches.first()?.by?;
    let mut worst: Option<(f64, Time, f64)> = None;
    for Stretch { piece, .. } in stretches {
        let (low, high) = piece.polynomial.range();
        for (t, level) in [low, high] {
            let off = (-level).max(level - 1.0);
            if off > ROUNDING && worst.is_none_or(|w| off > w.0) {
                let after_start = (piece.end - piece.start).scaled(t);
                worst = Some((off, piece.start + after_start, level));
            }
        }
    }
    worst.map(|(_, time, level)| TimelineError::Level {
        id,
        parameter,
        time,
        level,
    })
}

/// Shapes of the show's own curves, computed once.
struct Fades {
    named: Vec<Splined>,
}

impl Fades {
    fn new(show: &Show) -> Fades {
        let named = show.curves.iter().map(Splined::new).collect();
        Fades { named }
    }

    /// A move's pieces from `start` on and its final level; `None` when there are more than `most`.
    fn pieces(
        &self,
        m: &Moved,
        from: f64,
        start: Time,
        most: usize,
    ) -> Option<(Vec<CurvePiece>, f64)> {
        let to = match m.motion.as_ref() {
            // Nothing moves, but the time passes; passes of a repeat cannot be told apart.
            Motion::To(to) if *to == from => return Some((Vec::new(), from)),
            Motion::To(to) => *to,
            Motion::Path(path) => {
                let spans = path_pieces(path);
                let times = path.knots.iter().map(|k| k.time);
                let pieces = passes(times, spans.into_iter(), m.repeat, start, most)?;
                return Some((pieces, m.motion.target()));
            }
        };
        let built_in;
        let (at, spans, arrives) = match m.timing.fade {
            Fade::BuiltIn(curve) => {
                built_in = Bernstein::new(curve.coefficients);
                (&[0.0, 1.0][..], built_in.as_slice(), 1.0)
            }
            Fade::Curve(i) => {
                let Splined { at, spans, last } = &self.named[i];
                (at.as_slice(), spans.as_slice(), *last)
            }
        };
        let whole = if to < from {
            m.timing.down
        } else {
            m.timing.up
        };
        // Exact at completion 0 and 1, unlike a scaled difference.
        let level = |completion: f64| (1.0 - completion) * from + completion * to;
        let times = at.iter().map(|a| whole.scaled(*a));
        let spans = spans.iter().map(|s| s.mapped(level));
        let pieces = passes(times, spans, m.repeat, start, most)?;
        Some((pieces, level(arrives)))
    }
}

/// The spans between `times`, which begin at zero, played from `start` on, `repeat` times; `None`
/// when there are more than `most`.
fn passes(
    times: impl Iterator<Item = Time> + Clone,
    spans: impl ExactSizeIterator<Item = Bernstein> + Clone,
    repeat: u32,
    start: Time,
    most: usize,
) -> Option<Vec<CurvePiece>> {
    let whole = times.clone().last().unwrap_or(Time::ZERO);
    let passes = if whole == Time::ZERO { 1 } else { repeat };
    let count = spans.len().saturating_mul(passes as usize);
    if count > most {
        return None;
    }
    let mut pieces = Vec::with_capacity(count);
    for pass in 0..i64::from(passes) {
        let begin = start + Time::from_micros(whole.micros().saturating_mul(pass));
        let ends = times.clone().zip(times.clone().skip(1));
        for ((from, to), polynomial) in ends.zip(spans.clone()) {
            // Knots of a curve may fall on one microsecond in a short fade.
            if from < to {
                pieces.push(CurvePiece {
                    start: begin + from,
                    end: begin + to,
                    polynomial,
                });
            }
        }
    }
    Some(pieces)
}

/// The spans of a path with a duration.
fn path_pieces(path: &Path) -> Vec<Bernstein> {
    if length(path) == Time::ZERO && path.interpolation != Interpolation::Steps {
        Vec::new()
    } else {
        path_spans(path)
    }
}
