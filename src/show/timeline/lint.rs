//! Warnings about legal moves that are probably mistakes, found while the moves are played and in
//! the resulting curves.
//!
//! The rules are narrow, so that a warning is rarely wrong; each rule states its exceptions.

#![allow(
    clippy::indexing_slicing,
    reason = "the model's indices are valid (show's invariant) and tables are made to its shape"
)]

use std::collections::{BTreeMap, BTreeSet};

use super::clock::CueTime;
use super::error::TimelineWarning;
use super::motion::Moved;
use super::stretch::{Stretch, Track};
use crate::model::{Cue, Motion, NodeId, Role, Show, Trigger};
use crate::units::Time;

/// The run of a move.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    /// When it takes over.
    pub start: Time,
    /// When it arrives, if not interrupted.
    pub end: Time,
    /// The level at its start.
    pub from: f64,
    /// The level at its end.
    pub to: f64,
}

/// The latest move of a parameter.
#[derive(Clone, Copy, Debug)]
struct Latest {
    id: NodeId,
    cue: usize,
    run: Run,
    /// True for a fade, but not for a path or a repeated fade.
    fades: bool,
}

/// Watches the moves as they are played.
pub(super) struct Watch {
    /// By cue: the cue on whose GO its times depend.
    clocks: Vec<usize>,
    /// By parameter.
    latest: Vec<Option<Latest>>,
    /// By cue: true when it changes any light.
    changed: Vec<bool>,
    first: Time,
    warnings: Vec<TimelineWarning>,
}

impl Watch {
    pub fn new(show: &Show, cues: &[CueTime], parameters: usize) -> Watch {
        Watch {
            clocks: clocks(show, cues),
            latest: vec![None; parameters],
            changed: vec![false; cues.len()],
            first: cues.first().map_or(Time::ZERO, |c| c.go),
            warnings: Vec::new(),
        }
    }

    /// Records a move of the cue at index `cue`.
    pub fn played(&mut self, cue: usize, m: &Moved<'_>, run: Run) {
        let fades = matches!(*m.motion, Motion::To(_));
        let before = self.latest[m.parameter].replace(Latest {
            id: m.id,
            cue,
            run,
            fades: fades && m.repeat == 1,
        });
        let runs = before.is_some_and(|b| b.run.end > run.start);
        self.changed[cue] |= runs || !fades || run.from != run.to;
        if let Some(before) = before {
            self.interrupted(&before, cue, m, run);
        }
        if let Some(to) = first_level(&m.motion).filter(|to| *to != run.from)
            && run.start > self.first
        {
            self.warnings.push(TimelineWarning::Jump {
                id: m.id,
                parameter: m.parameter,
                time: run.start,
                from: run.from,
                to,
            });
        }
    }

    /// Reports a move that another interrupts. Fades are exempt when the time between the two
    /// depends on the operator's GO, or when both go to the same level; paths and repeats may be
    /// left at any time.
    fn interrupted(&mut self, before: &Latest, cue: usize, m: &Moved<'_>, run: Run) {
        if before.run.start > run.start {
            self.warnings.push(TimelineWarning::Overtaken {
                id: before.id,
                by: m.id,
                parameter: m.parameter,
                time: before.run.start,
            });
            return;
        }
        let known = self.clocks[before.cue] == self.clocks[cue];
        let cut = before.fades && before.run.end > run.start && before.run.to != run.to;
        if known && cut {
            self.warnings.push(TimelineWarning::CutOff {
                id: before.id,
                by: m.id,
                parameter: m.parameter,
                time: run.start,
                level: run.from,
                to: before.run.to,
            });
        }
    }

    /// All warnings, with the cues that move banks only to their current levels. Exempt are the
    /// first cue, which sets up, `block` and `assert`, which restate on purpose, and moves to out.
    pub fn finish(mut self, show: &Show) -> Vec<TimelineWarning> {
        let cues = show.cues.iter().zip(&self.changed).skip(1);
        let still = cues.filter(|(cue, changed)| {
            let mut moves = moves(cue);
            !**changed
                && !cue.block
                && !cue.assert
                && cue.parts.iter().all(|part| part.effects.is_empty())
                && moves.any(|m| !matches!(m.motion, Motion::To(to) if to == 0.0))
        });
        let found = still.map(|(cue, _)| TimelineWarning::Still { cue: cue.id });
        self.warnings.extend(found);
        self.warnings
    }
}

/// By cue: 0 when the text alone gives its start, else the cue (from 1) on whose assumed GO its
/// time depends.
fn clocks(show: &Show, cues: &[CueTime]) -> Vec<usize> {
    let mut out: Vec<usize> = Vec::with_capacity(cues.len());
    for (i, (cue, time)) in show.cues.iter().zip(cues).enumerate() {
        let of = match (cue.trigger, out.last()) {
            (Trigger::At(_), _) | (_, None) => 0,
            _ if time.assumed => i + 1,
            (_, Some(before)) => *before,
        };
        out.push(of);
    }
    out
}

fn first_level(motion: &Motion) -> Option<f64> {
    match motion {
        Motion::To(_) => None,
        Motion::Path(path) => path.knots.first().map(|k| k.level),
    }
}

fn moves(cue: &Cue) -> impl Iterator<Item = &crate::model::Move> {
    cue.parts.iter().flat_map(|p| &p.moves)
}

// ---- dark stretches -----------------------------------------------------------------------------

/// A time in which a bank is out, with the moves that begin and end it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Out {
    parameter: usize,
    pub start: Time,
    pub end: Time,
    by: Option<NodeId>,
    ended_by: Option<NodeId>,
}

/// Stretches between two lit moments in which every bank is out without a statement of it: a cue
/// that takes every bank out, as `blackout` does, or a path that ends at 0, which its author has
/// drawn. Levels that `cueonly` or `assert` restores count as stated before.
pub(super) fn dark(show: &Show, tracks: &[Track], start: Time, end: Time) -> Vec<TimelineWarning> {
    let banks: Vec<usize> = show
        .parameters()
        .iter()
        .enumerate()
        .filter_map(|(i, c)| (c.role == Role::Level).then_some(i))
        .collect();
    let outs = banks.iter().flat_map(|c| outs(*c, &tracks[*c]));
    let outs: Vec<Out> = outs.filter(|o| o.start < end && o.end > start).collect();
    let between = common(&outs, banks.len());
    let between = between.filter(|(a, b)| *a > start && *b < end);
    let stretches: Vec<(Time, Time)> = between.collect();
    if stretches.is_empty() {
        return Vec::new();
    }
    let ends = Ends::new(show, &outs, &banks);
    let warn = |(a, b)| ends.warning(a, b);
    stretches.into_iter().filter_map(warn).collect()
}

/// The times at which a track is at 0.
pub(super) fn outs(parameter: usize, track: &Track) -> Vec<Out> {
    let dark = |s: &Stretch| s.piece.polynomial.is_constant() && s.piece.polynomial.first() == 0.0;
    let id = |s: &Stretch| s.by.map(|(id, _)| id);
    let runs = track.chunk_by(|a, b| dark(a) == dark(b));
    let runs: Vec<&[Stretch]> = runs.collect();
    let mut found = Vec::new();
    for (i, run) in runs.iter().enumerate() {
        if let [first, ..] = run
            && let Some(last) = run.last()
            && dark(first)
        {
            let next = runs.get(i + 1).and_then(|r| r.first());
            found.push(Out {
                parameter,
                start: first.piece.start,
                end: last.piece.end,
                by: id(first),
                ended_by: next.and_then(id),
            });
        }
    }
    found
}

/// The times at which `all` of the banks are out.
fn common(outs: &[Out], all: usize) -> impl Iterator<Item = (Time, Time)> {
    let mut events: Vec<(Time, bool)> = Vec::with_capacity(2 * outs.len());
    for out in outs.iter().filter(|o| o.end > o.start) {
        events.extend([(out.start, true), (out.end, false)]);
    }
    // Ends come before starts, so that touching times make no stretch.
    events.sort_unstable();
    let (mut count, mut since) = (0_usize, Time::ZERO);
    let stretches = events.into_iter().filter_map(move |(time, begins)| {
        let stretch = (count == all && !begins).then_some((since, time));
        if begins {
            (count, since) = (count + 1, time);
        } else {
            count -= 1;
        }
        stretch
    });
    stretches.filter(|(a, b)| a < b)
}

/// The moves that begin and end darkness, by time.
struct Ends<'a> {
    begun: BTreeMap<Time, Vec<&'a Out>>,
    ended: BTreeMap<Time, NodeId>,
    /// Fades to 0 of cues that leave some bank lit.
    fades: BTreeSet<(NodeId, usize)>,
}

impl<'a> Ends<'a> {
    fn new(show: &Show, outs: &'a [Out], levels: &[usize]) -> Ends<'a> {
        let mut ends = Ends {
            begun: BTreeMap::new(),
            ended: BTreeMap::new(),
            fades: BTreeSet::new(),
        };
        for out in outs {
            ends.begun.entry(out.start).or_default().push(out);
            if let Some(by) = out.ended_by {
                ends.ended.entry(out.end).or_insert(by);
            }
        }
        for cue in &show.cues {
            let goes = |m: &&crate::model::Move| {
                levels.contains(&m.parameter) && matches!(m.motion, Motion::To(to) if to == 0.0)
            };
            let out: Vec<_> = moves(cue).filter(goes).collect();
            if out.len() < levels.len() {
                ends.fades
                    .extend(out.into_iter().map(|m| (m.id, m.parameter)));
            }
        }
        ends
    }

    fn warning(&self, a: Time, b: Time) -> Option<TimelineWarning> {
        let begun = self.begun.get(&a)?;
        let last = begun.first()?.by?;
        let faded = |o: &Out| {
            let key = o.by.map(|id| (id, o.parameter));
            key.is_some_and(|k| self.fades.contains(&k))
        };
        begun
            .iter()
            .all(|o| faded(o))
            .then_some(TimelineWarning::Dark {
                id: last,
                by: *self.ended.get(&b)?,
                time: a,
                until: b,
            })
    }
}
