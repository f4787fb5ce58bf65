//! Start and completion of each cue.

use super::error::TimelineError;
use super::motion::Moved;
use crate::model::{Link, Motion, NodeId, Part, Path, Show, Trigger};
use crate::units::{CueNumber, Time};

/// GO and completion of a cue.
///
/// GO is the cue's clock time, if it has one; else the previous cue's link gives it (`follow`
/// counts from that cue's GO, `hang` from its completion); else it is that cue's completion plus
/// the preview's gap, and `assumed` is true. The first cue without a clock time starts at 0.
/// Completion is GO plus the longest delay + time of the parts that move something. A part's time
/// is the longer of its `up` and `down` if it fades anything (in either direction: the text alone
/// decides), or the length of its paths with repeats, whichever is longer. The end of an effect is
/// a move of its part's up time. A cue that moves nothing also takes its parts' times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CueTime {
    /// The statement.
    pub id: NodeId,
    /// Its number.
    pub number: CueNumber,
    /// Its start.
    pub go: Time,
    /// The end of its last move.
    pub completion: Time,
    /// True when GO is assumed.
    pub assumed: bool,
}

/// GO and completion of every cue.
pub(super) fn cue_times(
    show: &Show,
    motions: &[Vec<Moved<'_>>],
) -> Result<Vec<CueTime>, Vec<TimelineError>> {
    let mut errors = Vec::new();
    let mut times: Vec<CueTime> = Vec::with_capacity(show.cues.len());
    for (i, (cue, moved)) in show.cues.iter().zip(motions).enumerate() {
        let before = i.checked_sub(1).and_then(|p| show.cues.get(p));
        let link = before.and_then(|b| b.link);
        let (go, assumed) = match (cue.trigger, link, times.last()) {
            (Trigger::At(_), Some((link, _)), Some(previous)) => {
                errors.push(TimelineError::AtAndLink { cue: cue.id, link });
                (previous.completion, false)
            }
            (Trigger::At(at), _, _) => (at, false),
            (Trigger::Go, _, None) => (Time::ZERO, false),
            (Trigger::Go, Some((_, Link::Follow(t))), Some(previous)) => (previous.go + t, false),
            (Trigger::Go, Some((_, Link::Hang(t))), Some(previous)) => {
                (previous.completion + t, false)
            }
            (Trigger::Go, None, Some(previous)) => (previous.completion + show.preview.gap, true),
        };
        if let Some(previous) = times.last().filter(|p| go < p.go) {
            errors.push(TimelineError::Backwards {
                cue: cue.id,
                go,
                link: link.map(|l| l.0),
                previous: previous.id,
                previous_go: previous.go,
            });
        }
        let completion = go + duration(&cue.parts, moved);
        if completion > Time::MAX || go < -Time::MAX {
            // Every later cue would give the same error.
            errors.push(TimelineError::TooLong { cue: cue.id });
            return Err(errors);
        }
        times.push(CueTime {
            id: cue.id,
            number: cue.number,
            go,
            completion,
            assumed,
        });
    }
    if let Some((cue, link)) = show.cues.last().and_then(|c| Some((c.id, c.link?.0))) {
        errors.push(TimelineError::LinkOnLast { link, cue });
    }
    if errors.is_empty() {
        Ok(times)
    } else {
        Err(errors)
    }
}

fn duration(parts: &[Part], moved: &[Moved<'_>]) -> Time {
    if moved.is_empty() {
        let stated = |p: &Part| p.delay + p.up.max(p.down);
        return parts.iter().map(stated).max().unwrap_or(Time::ZERO);
    }
    let of = |m: &Moved<'_>| {
        let once = match m.motion.as_ref() {
            Motion::To(_) => m.timing.up.max(m.timing.down),
            Motion::Path(path) => length(path),
        };
        m.timing.delay + repeated(once, m.repeat)
    };
    let ends = |part: &&Part| part.effects.iter().any(|change| change.effect.is_none());
    let ended = parts.iter().filter(ends).map(|part| part.delay + part.up);
    moved
        .iter()
        .map(of)
        .chain(ended)
        .max()
        .unwrap_or(Time::ZERO)
}

/// Time from a path's first knot to its last.
pub(super) fn length(path: &Path) -> Time {
    path.knots.last().map_or(Time::ZERO, |k| k.time)
}

fn repeated(once: Time, repeat: u32) -> Time {
    Time::from_micros(once.micros().saturating_mul(i64::from(repeat.max(1))))
}
