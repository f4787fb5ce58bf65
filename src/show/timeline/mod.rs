//! Compiles cues to curves, and curves to key settings.
//!
//! A [`Timeline`] is the whole show as exact piecewise polynomials, one list of pieces for each
//! coordinate, in settings (light after the dimmer, 1 = full). [`KeySequence`] cuts it into
//! segments on which the setting is one Bezier curve of at most four keys. Invariants: the knots
//! are whole microseconds; a piece's degree comes from the kind of part, never from its
//! coefficients (except for constants); a knot's value is computed once and shared by the pieces
//! that meet there; pieces cover the sequence without gaps. At a jump the later value holds.

mod blend;
mod bounced;
mod clock;
mod curve;
mod dimmer;
mod effect;
mod error;
mod key;
mod lint;
mod motion;
mod pose;
mod positivity;
mod product;
mod segment;
mod spline;
mod stretch;
mod sweep;
mod track;

#[cfg(test)]
mod tests;

pub use blend::{Blend, blend};
pub use bounced::Bounced;
pub use clock::CueTime;
pub use curve::CurvePiece;
pub use dimmer::{level, lights, range, settings};
pub use error::{TimelineError, TimelineWarning};
pub use key::KeySequence;
pub use motion::{Moved, Timing};
pub use pose::Pose;
pub use positivity::knots as fewest_knots;
pub use segment::{Segment, TooManyKeys};

use std::collections::BTreeMap;

use self::dimmer::Law;
use self::stretch::Track;
use crate::model::{Head, Show};
use crate::units::Time;

/// The moves of each cue, with those implied by `assert`, an earlier `cueonly` and a plain colour.
///
/// # Errors
/// When there are more moves than a show may have.
pub fn cue_moves(show: &Show) -> Result<Vec<Vec<Moved<'_>>>, Vec<TimelineError>> {
    motion::motions(show)
}

/// Every parameter at the completion of each cue; paths are at their ends.
///
/// # Errors
/// As [`cue_moves`].
pub fn tracked(show: &Show) -> Result<impl Iterator<Item = Vec<f64>>, Vec<TimelineError>> {
    let mut levels = show.dark_levels();
    Ok(cue_moves(show)?.into_iter().map(move |moves| {
        for one in moves {
            if let Some(level) = levels.get_mut(one.parameter) {
                *level = one.motion.target();
            }
        }
        levels.clone()
    }))
}

/// A show as curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    start: Time,
    end: Time,
    cues: Vec<CueTime>,
    curves: Vec<Vec<CurvePiece>>,
    moves: Vec<Vec<(Time, Time)>>,
    last: Vec<f64>,
    /// Parameters that are not settings.
    parameters: BTreeMap<usize, Levels>,
    /// By parameter, the coordinate that it sets directly.
    own: Vec<Option<usize>>,
    /// By bank, the factor of its effects; no pieces without effects.
    factors: Vec<Vec<CurvePiece>>,
    heads: Vec<Head>,
    bases: Vec<bounced::Basis>,
    bounced: Vec<Bounced>,
    warnings: Vec<TimelineWarning>,
    joined: usize,
}

/// A parameter over the sequence, 0 to 1.
#[derive(Clone, Debug, PartialEq)]
struct Levels {
    pieces: Vec<CurvePiece>,
    /// Value at the end, after any jump.
    last: f64,
}

impl Timeline {
    /// Compiles a show.
    ///
    /// The sequence runs from the first cue's GO to the last completion. `CueTime` has the rules of
    /// timing. Motion follows one rule: at any time a coordinate follows the latest cue (in order
    /// of the list) whose move of it has started, from its level at that start; so a move
    /// interrupts earlier ones, running or waiting. `assert` restates every tracked target with
    /// part 1's timing. The cue after a `cueonly` one restores, with part 1's timing, what that one
    /// moved and this one does not.
    ///
    /// # Errors
    /// Every error that depends on times and curves.
    pub fn new(show: &Show) -> Result<Timeline, Vec<TimelineError>> {
        let mut out = Timeline::of_desk(show)?;
        if !out.heads.is_empty() {
            out.add_bounced(show);
        }
        Ok(out)
    }

    /// Compiles like [`Timeline::new`] but without [`Bounced`] light, which takes longest and which
    /// only images need.
    ///
    /// # Errors
    /// As [`Timeline::new`].
    pub fn of_desk(show: &Show) -> Result<Timeline, Vec<TimelineError>> {
        let motions = motion::motions(show)?;
        let cues = clock::cue_times(show, &motions)?;
        let start = cues.first().map_or(Time::ZERO, |c| c.go);
        let end = cues.iter().map(|c| c.completion).max().unwrap_or(start);
        let (tracks, mut warnings) = track::tracks(show, &cues, motions)?;
        let mut errors = dimmer::check(show);
        errors.extend(track::out_of_range(&tracks, start, end));
        errors.extend(pose::beams(show, &tracks, start, end));
        if !errors.is_empty() {
            return Err(errors);
        }
        warnings.extend(lint::dark(show, &tracks, start, end));
        warnings.extend(pose::turns(show, &tracks, start, end));
        let factors = effect::factors(show, &cues, (start, end)).map_err(|error| vec![error])?;
        let mut out = Timeline {
            start,
            end,
            cues,
            curves: Vec::new(),
            moves: Vec::new(),
            last: Vec::new(),
            parameters: BTreeMap::new(),
            own: Vec::new(),
            factors: Vec::new(),
            heads: show.heads().into_iter().map(|(_, head, _)| *head).collect(),
            bases: Vec::new(),
            bounced: Vec::new(),
            warnings,
            joined: 0,
        };
        let mut first = 0;
        for (bank, factor) in show.banks.iter().zip(factors) {
            let law = Law::new(bank.dimmer, &show.curves);
            let count = if bank.rgb { 4 } else { 1 };
            let tracks = tracks.get(first..first + count).unwrap_or_default();
            out.add_bank(&law, first, tracks, &factor);
            out.factors.push(factor);
            first += count;
        }
        if !show.fixed.is_empty() {
            out.own.push(Some(out.curves.len()));
            out.curves.push(curve::hold(start, end, 1.0));
            out.last.push(1.0);
            out.moves.push(Vec::new());
        }
        let first_pose = out.own.len();
        for (parameter, track) in tracks.iter().enumerate().skip(first_pose) {
            out.own.push(None);
            let pieces = track::trimmed(track, start, end);
            out.keep(parameter, track, curve::joined(&pieces));
        }
        Ok(out)
    }

    /// Adds the coordinates of a bank by the tracks of its level and, if it has one, its colour.
    fn add_bank(&mut self, law: &Law, first: usize, tracks: &[Track], factor: &[CurvePiece]) {
        let Some((level, colour)) = tracks.split_first() else {
            return;
        };
        let levels = track::trimmed(level, self.start, self.end);
        let fits = [
            !matches!(law, Law::Linear),
            !factor.is_empty(),
            !colour.is_empty(),
        ];
        let fits = fits.into_iter().filter(|fit| *fit).count();
        let tolerance = dimmer::TOLERANCE / fits.max(1) as f64;
        let mut light = law.applied(&levels, tolerance);
        let mut last = law.value(track::level_at(level, self.end));
        if let Some(end) = factor.last() {
            light = product::product(&light, factor, tolerance);
            last *= end.polynomial.last();
        }
        let own = colour.is_empty() && matches!(law, Law::Linear) && factor.is_empty();
        self.own.push(own.then_some(self.curves.len()));
        if !own {
            self.keep(first, level, levels);
        }
        if colour.is_empty() {
            self.add_coordinate(&light, last, track::moves(level));
        }
        for (emitter, track) in colour.iter().enumerate() {
            let shares = track::trimmed(track, self.start, self.end);
            let pieces = product::product(&light, &shares, tolerance);
            let last = last * track::level_at(track, self.end);
            let mut moves = track::moves(level);
            moves.extend(track::moves(track));
            moves.sort_unstable();
            moves.dedup();
            self.add_coordinate(&pieces, last, moves);
            self.own.push(None);
            self.keep(first + 1 + emitter, track, shares);
        }
    }

    /// Stores a parameter that is not a setting.
    fn keep(&mut self, parameter: usize, track: &Track, pieces: Vec<CurvePiece>) {
        let last = track::level_at(track, self.end);
        self.parameters.insert(parameter, Levels { pieces, last });
    }

    fn add_coordinate(&mut self, pieces: &[CurvePiece], last: f64, moves: Vec<(Time, Time)>) {
        let curve = curve::joined(pieces);
        self.joined += pieces.len() - curve.len();
        self.curves.push(curve);
        self.last.push(last);
        self.moves.push(moves);
    }

    /// The first cue's GO (0 without cues).
    pub fn start(&self) -> Time {
        self.start
    }

    /// The last completion; may equal the start.
    pub fn end(&self) -> Time {
        self.end
    }

    /// Start and completion of each cue.
    pub fn cues(&self) -> &[CueTime] {
        &self.cues
    }

    /// The warnings.
    pub fn warnings(&self) -> &[TimelineWarning] {
        &self.warnings
    }

    /// Number of coordinates of a setting.
    pub fn coordinates(&self) -> usize {
        self.curves.len()
    }

    /// A coordinate's pieces over the sequence, in settings; empty when the sequence has no length
    /// or the coordinate does not exist.
    pub fn curve(&self, coordinate: usize) -> &[CurvePiece] {
        self.curves.get(coordinate).map_or(&[], Vec::as_slice)
    }

    /// Begin and end of each move of a coordinate's level or colour, in time; an interrupted move
    /// ends when the next begins.
    pub fn moves(&self, coordinate: usize) -> &[(Time, Time)] {
        self.moves.get(coordinate).map_or(&[], Vec::as_slice)
    }

    /// The settings at the end, after any jump.
    pub fn last(&self) -> &[f64] {
        &self.last
    }

    /// The settings at a time; before the start, those of the start; after the end, the last. At a
    /// jump the later value holds.
    pub fn evaluate(&self, time: Time) -> Vec<f64> {
        let curves = self.curves.iter().zip(&self.last);
        curves.map(|(c, last)| self.value(c, *last, time)).collect()
    }

    /// The parameters at a time ([`Show::parameters`]): levels before the dimmers, as fractions of
    /// full, and colours; times as in [`Timeline::evaluate`].
    pub fn levels(&self, time: Time) -> Vec<f64> {
        let settings = self.evaluate(time);
        let parameters = self.own.iter().enumerate();
        let level = |(parameter, own): (usize, &Option<usize>)| match own {
            Some(coordinate) => settings.get(*coordinate).copied().unwrap_or(0.0),
            None => {
                let kept = self.parameters.get(&parameter);
                kept.map_or(0.0, |kept| self.value(&kept.pieces, kept.last, time))
            }
        };
        parameters.map(level).collect()
    }

    /// The factor of a bank's effects at a time, 0 to 1.
    pub fn factor(&self, bank: usize, time: Time) -> f64 {
        match self.factors.get(bank).map(|pieces| (pieces, pieces.last())) {
            Some((pieces, Some(last))) => self.value(pieces, last.polynomial.last(), time),
            _ => 1.0,
        }
    }

    fn value(&self, pieces: &[CurvePiece], last: f64, time: Time) -> f64 {
        if time >= self.end {
            return last;
        }
        let time = time.max(self.start);
        let after = pieces.partition_point(|p| p.start <= time);
        let piece = after.checked_sub(1).and_then(|i| pieces.get(i));
        piece.map_or(last, |p| p.value(time))
    }
}
