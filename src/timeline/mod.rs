//! Cues to curves, and curves to key settings.
//!
//! A [`Timeline`] is the whole show as exact piecewise polynomials, one list of pieces for each
//! coordinate, in settings (light after the dimmer, 1 = full). [`KeySequence`] cuts it into
//! segments on which the setting is one Bezier curve of at most four keys. Invariants: the knots
//! are whole microseconds; a piece's degree comes from the kind of part, never from its coefficients
//! (but for constants); a knot's value is computed once and shared by the pieces that meet there;
//! pieces cover the sequence without gaps. At a jump the later value holds.

mod blend;
mod clock;
mod curve;
mod dimmer;
mod error;
mod key;
mod lint;
mod positivity;
mod spline;
mod sweep;
mod track;

#[cfg(test)]
pub(crate) mod tests;

pub use blend::{Blend, blend};
pub use clock::CueTime;
pub use curve::Piece;
pub use dimmer::settings;
pub use error::{TimelineError, Warning};
pub use key::{KeyOptions, KeySequence, Segment, TooManyKeys};
pub use positivity::knots as fewest_knots;

use std::collections::BTreeMap;

use self::track::MemoryBudget;
use crate::show::{Dimmer, Show};
use crate::units::Time;

/// A show as curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    start: Time,
    end: Time,
    cues: Vec<CueTime>,
    curves: Vec<Vec<Piece>>,
    moves: Vec<Vec<(Time, Time)>>,
    last: Vec<f64>,
    /// Levels before the dimmer, of the coordinates that one bends; the others' are their settings.
    bent: BTreeMap<usize, Levels>,
    warnings: Vec<Warning>,
    joined: usize,
}

/// A coordinate's level before its dimmer, as a fraction of full.
#[derive(Clone, Debug, PartialEq)]
struct Levels {
    pieces: Vec<Piece>,
    /// At the end, after whatever jumps there.
    last: f64,
}

impl Timeline {
    /// Compiles a show.
    ///
    /// The sequence runs from the first cue's GO to the last completion. The rules of timing are
    /// `CueTime`'s; those of motion: at any time the latest cue (in order of the list) whose move
    /// of a coordinate has started rules it, from the level it had at that start; so a move
    /// interrupts earlier ones, running or still waiting. `assert` restates every tracked target
    /// with part 1's timing, and the cue after a `cueonly` one restores with part 1's timing what
    /// that one moved and this one leaves.
    ///
    /// # Errors
    /// Every error that only the times and the curves show.
    pub fn new(show: &Show) -> Result<Timeline, Vec<TimelineError>> {
        Timeline::within(show, usize::MAX)
    }

    /// The same in about so many bytes of memory at most.
    ///
    /// # Errors
    /// As [`Timeline::new`]; also where the memory is too small, with the cue at which it ended.
    pub fn within(show: &Show, memory: usize) -> Result<Timeline, Vec<TimelineError>> {
        let mut budget = MemoryBudget::new(memory);
        let motions = track::motions(show, &mut budget)?;
        let cues = clock::cue_times(show, &motions)?;
        let start = cues.first().map_or(Time::ZERO, |c| c.go);
        let end = cues.iter().map(|c| c.completion).max().unwrap_or(start);
        let (tracks, mut warnings) = track::tracks(show, &cues, motions, &mut budget)?;
        let mut errors = dimmer::check(show);
        errors.extend(track::out_of_range(&tracks, start, end));
        if !errors.is_empty() {
            return Err(errors);
        }
        warnings.extend(lint::dark(show, &tracks, start, end));
        let mut curves = Vec::new();
        let mut last = Vec::new();
        let mut dropped = 0;
        let mut bent = BTreeMap::new();
        for (i, (coordinate, track)) in show.coordinates().iter().zip(&tracks).enumerate() {
            let Some(bank) = coordinate.bank else {
                curves.push(curve::hold(start, end, 1.0));
                last.push(1.0);
                continue;
            };
            let dimmer = show.banks.get(bank).map_or(Dimmer::Linear, |b| b.dimmer);
            let law = dimmer::Law::new(dimmer, &show.curves);
            let levels = track::trimmed(track, start, end);
            let pieces = law.applied(&levels);
            let curve = curve::joined(&pieces);
            dropped += pieces.len() - curve.len();
            curves.push(curve);
            let level = track::level_at(track, end);
            last.push(law.value(level));
            if dimmer != Dimmer::Linear {
                let last = level;
                let pieces = levels;
                bent.insert(i, Levels { pieces, last });
            }
        }
        Ok(Timeline {
            start,
            end,
            cues,
            curves,
            moves: tracks.iter().map(track::moves).collect(),
            last,
            bent,
            warnings,
            joined: dropped,
        })
    }

    /// Bytes that it holds, about.
    pub fn bytes(&self) -> usize {
        let levels = self.bent.values().map(|levels| &levels.pieces);
        let pieces: usize = self.curves.iter().chain(levels).map(Vec::len).sum();
        let moves: usize = self.moves.iter().map(Vec::len).sum();
        pieces * size_of::<Piece>()
            + moves * size_of::<(Time, Time)>()
            + self.cues.len() * size_of::<CueTime>()
            + self.warnings.len() * size_of::<Warning>()
    }

    /// The first cue's GO (0 without cues).
    pub fn start(&self) -> Time {
        self.start
    }

    /// The last completion; may equal the start.
    pub fn end(&self) -> Time {
        self.end
    }

    /// When each cue starts and is complete.
    pub fn cues(&self) -> &[CueTime] {
        &self.cues
    }

    /// What is legal but surely not meant.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// How many coordinates a setting has.
    pub fn coordinates(&self) -> usize {
        self.curves.len()
    }

    /// A coordinate's pieces over the sequence, in settings; none when the sequence has no length
    /// (or there is no such coordinate).
    pub fn curve(&self, coordinate: usize) -> &[Piece] {
        self.curves.get(coordinate).map_or(&[], Vec::as_slice)
    }

    /// When each move of a coordinate begins and ends, in time; one that another overtakes ends
    /// there.
    pub fn moves(&self, coordinate: usize) -> &[(Time, Time)] {
        self.moves.get(coordinate).map_or(&[], Vec::as_slice)
    }

    /// The settings at the end, after whatever jumps there.
    pub fn last(&self) -> &[f64] {
        &self.last
    }

    /// The settings at a time; before the start those of the start, after the end the last. At a
    /// jump the later value holds.
    pub fn evaluate(&self, time: Time) -> Vec<f64> {
        let curves = self.curves.iter().zip(&self.last);
        curves.map(|(c, last)| self.value(c, *last, time)).collect()
    }

    /// The levels at a time, before the dimmers, as fractions of full; times as in
    /// [`Timeline::evaluate`].
    pub fn levels(&self, time: Time) -> Vec<f64> {
        let mut levels = self.evaluate(time);
        for (coordinate, bent) in &self.bent {
            if let Some(slot) = levels.get_mut(*coordinate) {
                *slot = self.value(&bent.pieces, bent.last, time);
            }
        }
        levels
    }

    fn value(&self, pieces: &[Piece], last: f64, time: Time) -> f64 {
        if time >= self.end {
            return last;
        }
        let time = time.max(self.start);
        let after = pieces.partition_point(|p| p.start <= time);
        let piece = after.checked_sub(1).and_then(|i| pieces.get(i));
        piece.map_or(last, |p| p.value(time))
    }
}
