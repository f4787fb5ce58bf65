//! Finds the moves and times of each cue by comparing its levels with those that track into it.

use std::collections::BTreeMap;

use super::model::{Cue, Desk, Fade, Part, Tenths};
use crate::Loss;
use footlight_host::work::{Cancelled, Work};
use footlight_show::units::{CueNumber, Rgb, Time};

/// A cue with its moves.
#[derive(Debug)]
pub struct Settled<'a> {
    pub cue: &'a Cue,
    /// The moves by timing; the first has the cue's own.
    pub steps: Vec<Step<'a>>,
    /// True when the cue takes everything out, and something was lit.
    pub dark: bool,
    /// Time until its levels are reached.
    pub length: Time,
}

/// Moves with one timing.
#[derive(Debug)]
pub struct Step<'a> {
    pub label: &'a str,
    pub timing: Timing,
    pub moves: BTreeMap<u32, Move>,
    /// True for a part of the desk, false for a move with its own time.
    pub is_part: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    pub delay: Time,
    pub up: Time,
    pub down: Time,
    pub curve: Option<u32>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Move {
    pub level: Option<Tenths>,
    /// sRGB.
    pub colour: Option<[u8; 3]>,
    /// Pan and tilt, degrees.
    pub pose: [Option<f64>; 2],
}

impl Move {
    /// True when it moves only the level.
    pub fn is_plain(&self) -> bool {
        self.colour.is_none() && self.pose == [None; 2]
    }
}

/// Values of channels between cues.
#[derive(Default)]
struct Tracked {
    levels: BTreeMap<u32, Tenths>,
    colours: BTreeMap<u32, [f64; 3]>,
    poses: BTreeMap<u32, [Option<f64>; 2]>,
}

/// The cues with their moves.
///
/// # Errors
/// A cancel.
pub fn settle<'a>(
    desk: &'a Desk,
    losses: &mut Vec<Loss>,
    work: Work<'_>,
) -> Result<Vec<Settled<'a>>, Cancelled> {
    let mut tracked = Tracked::default();
    let mut out = Vec::new();
    for cue in &desk.cues {
        work.check()?;
        out.push(tracked.cue(desk, cue, losses));
    }
    for settled in &out {
        check_link(settled.cue, desk.cues.last().map(|cue| cue.number), losses);
        let cue = settled.cue;
        if cue
            .hang
            .is_some_and(|hang| hang + settled.length < Time::ZERO)
        {
            let what = "its hang time reaches to before it starts: the next cue starts with it";
            losses.push(Loss::new(what).line(cue.line).cue(cue.number));
        }
    }
    Ok(out)
}

fn check_link(cue: &Cue, last: Option<CueNumber>, losses: &mut Vec<Loss>) {
    let linked = cue.follow.is_some() || cue.hang.is_some();
    if linked && last == Some(cue.number) {
        let what = "the last cue starts no other: its follow time is left out";
        losses.push(Loss::new(what).line(cue.line).cue(cue.number));
    }
}

/// The last part that names each channel of a cue: a bank moves in one part. Values of earlier
/// parts are lost.
fn last_parts(cue: &Cue, losses: &mut Vec<Loss>) -> BTreeMap<u32, usize> {
    let mut named: BTreeMap<u32, usize> = BTreeMap::new();
    for (index, part) in cue.parts.iter().enumerate() {
        for (channel, _) in part.lit.iter().flatten().chain(&part.moves) {
            let earlier = named.insert(*channel, index);
            if earlier.is_some_and(|part| part != index) {
                let what = format!("channel {channel} stands in two parts: the later one counts");
                losses.push(Loss::new(what).line(part.line).cue(cue.number));
            }
        }
    }
    named
}

impl Tracked {
    fn cue<'a>(&mut self, desk: &Desk, cue: &'a Cue, losses: &mut Vec<Loss>) -> Settled<'a> {
        let was_lit = self.levels.values().any(|level| *level > 0);
        let mut steps: Vec<Step<'a>> = Vec::new();
        let mut length = Time::ZERO;
        let unsaid = self.unsaid(desk, cue, losses);
        let last = last_parts(cue, losses);
        for (index, part) in cue.parts.iter().enumerate() {
            let base = base(desk, part);
            let mut targets: BTreeMap<u32, Tenths> = part.lit.clone().unwrap_or_default();
            targets.extend(&part.moves);
            if index == 0 {
                targets.extend(&unsaid);
            }
            let from = steps.len();
            for (channel, level) in targets {
                if last.get(&channel).is_some_and(|last| *last != index) {
                    continue;
                }
                let was = self.levels.insert(channel, level).unwrap_or(0);
                if was != level {
                    let timing = timing(&base, part, channel, level > was);
                    let fade = if level > was { timing.up } else { timing.down };
                    length = length.max(timing.delay + fade);
                    step(&mut steps, from, part, timing)
                        .entry(channel)
                        .or_default()
                        .level = Some(level);
                }
            }
            self.colours(part, &base, (&mut steps, from), (cue, losses));
            for (channel, pose) in &part.poses {
                let was = self.poses.entry(*channel).or_default();
                for (axis, (now, was)) in pose.iter().zip(was).enumerate() {
                    if now.is_some() && now != was {
                        *was = *now;
                        // Positions use the up time.
                        let moves = step(&mut steps, from, part, base.of(true));
                        let one = moves.entry(*channel).or_default();
                        if let Some(place) = one.pose.get_mut(axis) {
                            *place = *now;
                        }
                    }
                }
            }
            // The desk's own part comes first, so that its time is the cue's.
            if let Some(own) = steps
                .iter()
                .skip(from)
                .position(|s| s.timing == base.timing())
            {
                steps.swap(from, from + own);
            }
            if let Some(first) = steps.get_mut(from) {
                first.is_part = true;
            }
        }
        let dark = was_lit && self.levels.values().all(|level| *level == 0);
        if let (true, Some(part)) = (steps.is_empty(), cue.parts.first()) {
            let own = base(desk, part).timing();
            length = own.delay + own.up.max(own.down);
        }
        Settled {
            cue,
            steps,
            dark,
            length,
        }
    }

    /// Channels that go out because a cue that lists the lit channels does not name them.
    fn unsaid(&self, desk: &Desk, cue: &Cue, losses: &mut Vec<Loss>) -> BTreeMap<u32, Tenths> {
        if !desk.states {
            return BTreeMap::new();
        }
        let named = |channel: &u32| {
            let in_part = |part: &Part| {
                let lit = part.lit.as_ref();
                lit.is_some_and(|lit| lit.contains_key(channel)) || part.moves.contains_key(channel)
            };
            cue.parts.iter().any(in_part)
        };
        let lit = self.levels.iter().filter(|(_, level)| **level > 0);
        let out: BTreeMap<u32, Tenths> = lit
            .filter(|(c, _)| !named(c))
            .map(|(c, _)| (*c, 0))
            .collect();
        if desk.tracks && !out.is_empty() {
            let names: Vec<String> = out.keys().map(u32::to_string).collect();
            let what = format!(
                "channels {} go out: the cue's `Chan` has them not, and no `$$ChanMove` says so",
                names.join(" ")
            );
            losses.push(Loss::new(what).line(cue.line).cue(cue.number));
        }
        out
    }

    fn colours<'a>(
        &mut self,
        part: &'a Part,
        base: &Base,
        (steps, from): (&mut Vec<Step<'a>>, usize),
        (cue, losses): (&Cue, &mut Vec<Loss>),
    ) {
        let mut is_off = false;
        for (channel, values) in &part.colours {
            let was = self.colours.get(channel).copied().unwrap_or([1.0; 3]);
            let mut now = was;
            for (now, value) in now.iter_mut().zip(values) {
                *now = value.unwrap_or(*now);
            }
            self.colours.insert(*channel, now);
            let coded = Rgb(now).to_srgb8();
            for (exact, read) in now.iter().zip(Rgb::from_srgb8(coded).0) {
                is_off |= (exact - read).abs() > 5e-4;
            }
            if coded == Rgb(was).to_srgb8() {
                continue;
            }
            let level = self.levels.get(channel).copied().unwrap_or(0);
            let timing = base.colour();
            let one = step(steps, from, part, timing).entry(*channel).or_default();
            one.colour = Some(coded);
            // A colour alone would bring a bank that is out to full.
            let moved = steps
                .iter()
                .any(|s| s.moves.get(channel).is_some_and(|one| one.level.is_some()));
            let rises = |part: &Part| {
                let levels = part.lit.iter().flatten().chain(&part.moves);
                levels
                    .into_iter()
                    .any(|(of, level)| of == channel && *level > 0)
            };
            if level == 0 && !moved && !cue.parts.iter().any(rises) {
                step(steps, from, part, timing)
                    .entry(*channel)
                    .or_default()
                    .level = Some(0);
            }
        }
        if is_off {
            let what = "colours are written as sRGB codes";
            losses.push(Loss::new(what).line(part.line).cue(cue.number));
        }
    }
}

/// The times of a part.
struct Base {
    up: Fade,
    down: Fade,
    colour: Option<Fade>,
    curve: Option<u32>,
}

fn base(desk: &Desk, part: &Part) -> Base {
    let (up, down) = desk.time.unwrap_or((FIVE, FIVE));
    let fade = |time| Fade {
        time,
        delay: Time::ZERO,
    };
    let up = part.up.or(part.down).unwrap_or(fade(up));
    Base {
        up,
        down: part.down.or(part.up).unwrap_or(fade(down)),
        colour: part.colour,
        curve: part.curve,
    }
}

/// The timing of a whole part.
pub fn timing_of(desk: &Desk, part: &Part) -> Timing {
    base(desk, part).timing()
}

/// Time of a cue without one.
pub const FIVE: Time = Time::from_micros(5_000_000);

impl Base {
    /// The timing, if up and down have equal delays.
    fn timing(&self) -> Timing {
        Timing {
            delay: self.up.delay,
            up: self.up.time,
            down: self.down.time,
            curve: self.curve,
        }
    }

    fn of(&self, rising: bool) -> Timing {
        match (self.up.delay == self.down.delay, rising) {
            (true, _) => self.timing(),
            (false, true) => self.alone(self.up),
            (false, false) => self.alone(self.down),
        }
    }

    fn alone(&self, fade: Fade) -> Timing {
        Timing {
            delay: fade.delay,
            up: fade.time,
            down: fade.time,
            curve: self.curve,
        }
    }

    fn colour(&self) -> Timing {
        let fade = self.colour.unwrap_or(self.up);
        if fade == self.up && fade == self.down {
            self.timing()
        } else {
            self.alone(fade)
        }
    }
}

fn timing(base: &Base, part: &Part, channel: u32, rising: bool) -> Timing {
    match part.times.get(&channel) {
        Some(own) => base.alone(*own),
        None => base.of(rising),
    }
}

/// Finds or adds the moves of a part with this timing.
fn step<'s, 'a>(
    steps: &'s mut Vec<Step<'a>>,
    from: usize,
    part: &'a Part,
    timing: Timing,
) -> &'s mut BTreeMap<u32, Move> {
    let known = steps
        .iter()
        .skip(from)
        .position(|step| step.timing == timing);
    let index = known.map_or(steps.len(), |at| from + at);
    if known.is_none() {
        steps.push(Step {
            label: &part.label,
            timing,
            moves: BTreeMap::new(),
            is_part: false,
        });
    }
    #[expect(clippy::indexing_slicing, reason = "it was found, or pushed, there")]
    &mut steps[index].moves
}
