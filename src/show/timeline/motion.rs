//! The moves of each cue: those written, and those implied by `assert`, an earlier `cueonly` and a
//! plain colour.

#![allow(
    clippy::indexing_slicing,
    reason = "the model's indices are valid (show's invariant) and tables are made to its shape"
)]

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::error::TimelineError;
use crate::model::{Coordinate, Cue, Fade, Motion, NodeId, Part, Role, Show};
use crate::units::Time;

/// Most moves of all cues, and most pieces of all curves, of a show.
pub(super) const MOST_PIECES: usize = 500_000;
/// A part's times and shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Time from GO to the start.
    pub delay: Time,
    /// Time of a rise.
    pub up: Time,
    /// Time of a fall; for a pose equal to `up`.
    pub down: Time,
    /// The shape of fades.
    pub fade: Fade,
}

/// One parameter's motion in one cue, written or implied.
#[derive(Clone, Debug)]
pub struct Moved<'a> {
    /// The statement.
    pub id: NodeId,
    /// Index into [`Show::parameters`].
    pub parameter: usize,
    /// The motion.
    pub motion: Cow<'a, Motion>,
    /// Number of passes.
    pub repeat: u32,
    /// Its times and shape.
    pub timing: Timing,
}

/// The moves of each cue, with those implied by `assert` and an earlier `cueonly`. Targets track
/// through the list as written, even when a move is interrupted later.
pub(super) fn motions(show: &Show) -> Result<Vec<Vec<Moved<'_>>>, Vec<TimelineError>> {
    let parameters = show.parameters();
    let n = parameters.len();
    let moves: Vec<bool> = parameters.iter().map(|c| c.role != Role::Fixed).collect();
    let rgb = parameters.iter().any(|c| c.emitter().is_some());
    let first_pose = show.first_pose();
    // The target of each parameter, and its target without cueonly cues.
    let mut now = show.dark_levels();
    let mut lasting = now.clone();
    let mut to_restore: BTreeSet<usize> = BTreeSet::new();
    let (mut out, mut count) = (Vec::with_capacity(show.cues.len()), 0);
    for cue in &show.cues {
        let mut all = written(cue);
        let is_out = |level: usize| {
            if to_restore.contains(&level) {
                lasting[level] == 0.0
            } else {
                now[level] == 0.0
            }
        };
        if rgb {
            brighten(&mut all, &parameters, is_out);
        }
        let mut moved = vec![false; n];
        let mut here = Vec::new();
        for m in &all {
            moved[m.parameter] = true;
            here.push((m.parameter, m.motion.target()));
        }
        for c in std::mem::take(&mut to_restore) {
            if moved[c] {
                continue;
            }
            now[c] = lasting[c];
            if !cue.assert {
                all.push(implied(cue, c, now[c]));
            }
        }
        if cue.assert {
            let stay = (0..n).filter(|c| !moved[*c] && moves[*c]);
            all.extend(stay.map(|c| implied(cue, c, now[c])));
        }
        // Levels come first, because colours and poses depend on their bank being out.
        if rgb || first_pose < n {
            all.sort_by_key(|m| parameters[m.parameter].role != Role::Level);
        }
        for m in all.iter_mut().filter(|m| m.parameter >= first_pose) {
            m.timing.down = m.timing.up;
        }
        for (c, level) in here {
            now[c] = level;
            if cue.cueonly {
                to_restore.insert(c);
            } else {
                lasting[c] = level;
            }
        }
        count += all.len();
        if count > MOST_PIECES {
            let (id, limit) = (cue.id, MOST_PIECES);
            return Err(vec![TimelineError::TooManyPieces { id, limit }]);
        }
        out.push(all);
    }
    Ok(out)
}

impl Timing {
    fn of(part: &Part) -> Timing {
        Timing {
            delay: part.delay,
            up: part.up,
            down: part.down,
            fade: part.curve,
        }
    }
}

/// Adds what a plain colour implies on a bank that is out: the level goes to full in the colour's
/// time, or at once when the colour follows a path; an emitter without a value is dark.
fn brighten(all: &mut Vec<Moved<'_>>, parameters: &[Coordinate], is_out: impl Fn(usize) -> bool) {
    let moved: BTreeSet<usize> = all.iter().map(|m| m.parameter).collect();
    let mut coloured = BTreeMap::new();
    for m in all.iter() {
        if let Some(emitter) = parameters[m.parameter].emitter() {
            let first = coloured.entry(m.parameter - emitter).or_insert(m);
            if m.parameter < first.parameter {
                *first = m;
            }
        }
    }
    let mut implied = Vec::new();
    for (red, first) in coloured {
        let level = red - 1;
        if moved.contains(&level) || !is_out(level) {
            continue;
        }
        let to = |parameter: usize, level: f64| {
            let mut made = first.clone();
            if matches!(*first.motion, Motion::Path(_)) {
                (made.timing.up, made.timing.down) = (Time::ZERO, Time::ZERO);
            }
            made.motion = Cow::Owned(Motion::To(level));
            Moved { parameter, ..made }
        };
        implied.push(to(level, 1.0));
        let dark = (red..red + 3).filter(|emitter| !moved.contains(emitter));
        implied.extend(dark.map(|emitter| to(emitter, 0.0)));
    }
    all.extend(implied);
}

fn written(cue: &Cue) -> Vec<Moved<'_>> {
    // Exact capacity: a growing list begins with four.
    let mut out = Vec::with_capacity(cue.parts.iter().map(|part| part.moves.len()).sum());
    for part in &cue.parts {
        out.extend(part.moves.iter().map(|m| Moved {
            id: m.id,
            parameter: m.parameter,
            motion: Cow::Borrowed(&m.motion),
            repeat: m.repeat.max(1),
            timing: Timing::of(part),
        }));
    }
    out
}

/// An implied move to `level`, in the time of the cue's first part.
fn implied<'a>(cue: &Cue, parameter: usize, level: f64) -> Moved<'a> {
    Moved {
        id: cue.id,
        parameter,
        motion: Cow::Owned(Motion::To(level)),
        repeat: 1,
        timing: Timing::of(&cue.parts[0]),
    }
}
