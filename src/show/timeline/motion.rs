//! What each cue moves: what is written, and what `assert`, an earlier `cueonly` and a colour alone
//! imply.

#![allow(
    clippy::indexing_slicing,
    reason = "the model's indices are valid (show's invariant) and tables are made to its shape"
)]

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::error::TimelineError;
use crate::model::{Coordinate, Cue, Fade, Motion, NodeId, Part, Role, Show};
use crate::units::Time;

/// Moves of all cues, and pieces of all curves, that a show may have.
pub(super) const MOST_PIECES: usize = 500_000;
/// A part's times and shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Between GO and the start.
    pub delay: Time,
    /// Of a rise.
    pub up: Time,
    /// Of a fall; of a pose the same as `up`.
    pub down: Time,
    /// The shape of fades.
    pub fade: Fade,
}

/// One parameter's motion in one cue, written or implied.
#[derive(Clone, Debug)]
pub struct Moved<'a> {
    /// The text that says so.
    pub id: NodeId,
    /// Index into [`Show::parameters`].
    pub parameter: usize,
    /// What it does.
    pub motion: Cow<'a, Motion>,
    /// How many times over.
    pub repeat: u32,
    /// When and how fast.
    pub timing: Timing,
}

/// What each cue moves, with what `assert` and an earlier `cueonly` imply. Targets track through
/// the list by what is written, whether or not a move is later interrupted.
pub(super) fn motions(show: &Show) -> Result<Vec<Vec<Moved<'_>>>, Vec<TimelineError>> {
    let parameters = show.parameters();
    let n = parameters.len();
    let moves: Vec<bool> = parameters.iter().map(|c| c.role != Role::Fixed).collect();
    let rgb = parameters.iter().any(|c| c.emitter().is_some());
    let first_pose = show.first_pose();
    // What each parameter goes to, and what it would go to without cueonly cues.
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
        // A colour and a pose ask whether their bank is out, so that levels come first.
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

/// Adds what a colour alone implies on a bank that is out: the level goes to full in the colour's
/// time, at once where the colour follows a path; an emitter that is not said is dark.
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
    // No more than there are: a list that grows begins with four.
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

/// A move to `level` that the cue makes without saying so, in its first part's time.
fn implied<'a>(cue: &Cue, parameter: usize, level: f64) -> Moved<'a> {
    Moved {
        id: cue.id,
        parameter,
        motion: Cow::Owned(Motion::To(level)),
        repeat: 1,
        timing: Timing::of(&cue.parts[0]),
    }
}
