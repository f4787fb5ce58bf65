//! The patch: addresses of banks and of heads' axes on the lighting network.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::Loss;
use footlight_show::model::{HeadAxis, Show};
use footlight_show::timeline::Timeline;
use footlight_show::units::Time;

/// Number of values in a universe (DMX512).
pub const UNIVERSE: usize = 512;
/// Number of universes of E1.31.
pub const MOST_UNIVERSES: u16 = 63_999;

/// Values of universes, by number from 1.
pub type Frames = BTreeMap<u16, Vec<u8>>;

/// A value of the show at an address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// Index into [`values`].
    pub coordinate: usize,
    /// Universe, from 1.
    pub universe: u16,
    /// Offset, from 0.
    pub offset: usize,
    /// True for two bytes, the higher first.
    pub fine: bool,
    /// Values sent for 0 and for 1, as fractions of full.
    pub ends: [f64; 2],
}

/// The values sent at a time, each 0 to 1: the light of each of [`Show::coordinates`], then pan,
/// tilt, beam and field of each of [`Show::heads`] over their ranges.
pub fn values(show: &Show, timeline: &Timeline, time: Time) -> Vec<f64> {
    let mut out = timeline.evaluate(time);
    out.truncate(show.coordinates().len());
    for ((_, head, _), pose) in show.heads().into_iter().zip(timeline.poses(time)) {
        out.extend(HeadAxis::ALL.map(|axis| head.parameter(axis, pose.angle(axis))));
    }
    out
}

/// A value that a line of a patch places at consecutive addresses.
struct Placed<'t> {
    values: Range<usize>,
    address: &'t str,
    fine: bool,
    ends: [f64; 2],
}

/// The ends of an unscaled value.
const AS_IT_IS: [f64; 2] = [0.0, 1.0];

/// Addresses of all values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Patch {
    slots: Vec<Slot>,
}

impl Patch {
    /// Patches each bank at the address of its channel, an rgb bank there and at the next two:
    /// channel 513 is the first address of universe 2. A bank without a channel, or whose addresses
    /// are in use, comes after the last; such banks are listed.
    pub fn of_channels(show: &Show) -> (Patch, Vec<Loss>) {
        let (mut taken, mut losses) = (BTreeMap::new(), Vec::new());
        let mut starts = Vec::new();
        for bank in &show.banks {
            let width = if bank.rgb { 3 } else { 1 };
            let own = bank.channel.map(|channel| channel as usize - 1);
            let free = |start: &usize| {
                fits(*start, width) && (0..width).all(|i| !taken.contains_key(&(start + i)))
            };
            let start = own.filter(free);
            if let Some(start) = start {
                taken.extend((start..start + width).map(|at| (at, ())));
            }
            starts.push((start, width));
        }
        let mut next = taken.last_key_value().map_or(0, |(last, ())| last + 1);
        let mut patch = Patch::default();
        let mut coordinate = 0;
        for (bank, (start, width)) in show.banks.iter().zip(starts) {
            let at = start.unwrap_or_else(|| {
                if !fits(next, width) {
                    next = (next / UNIVERSE + 1) * UNIVERSE;
                }
                next += width;
                let at = next - width;
                let (universe, offset) = (at / UNIVERSE + 1, at % UNIVERSE + 1);
                let what = format!("bank `{}` is at address {universe}/{offset}", bank.name);
                losses.push(Loss::new(what));
                at
            });
            for emitter in 0..width {
                patch.add(coordinate, at + emitter, (false, AS_IT_IS));
                coordinate += 1;
            }
        }
        (patch, losses)
    }

    /// Parses a patch. A line has a bank's name, an address as universe and number (`2/101`), and
    /// `16bit` for a value of two bytes; or a head's name and the addresses of its axes, each of
    /// two bytes unless it is `8bit`. A bank or an axis may have several addresses.
    ///
    /// # Errors
    /// A message about the first unusable line, with a correction.
    pub fn parse(show: &Show, text: &str) -> Result<Patch, String> {
        let mut patch = Patch::default();
        let mut taken: BTreeMap<usize, usize> = BTreeMap::new();
        for (index, line) in text.lines().enumerate() {
            let line = line.split("//").next().unwrap_or_default();
            let words: Vec<&str> = line.split_whitespace().collect();
            let refuse = |what: String| format!("line {}: {what}", index + 1);
            let Some((name, rest)) = words.split_first() else {
                continue;
            };
            for placed in placed(show, name, rest).map_err(refuse)? {
                let address = placed.address;
                let Some(start) = start_of(address) else {
                    let what =
                        format!("`{address}` is no address: universe and number, such as `2/101`");
                    return Err(refuse(what));
                };
                let step = if placed.fine { 2 } else { 1 };
                let width = placed.values.len() * step;
                if !fits(start, width) {
                    let what = format!("`{name}` takes {width} addresses and goes beyond 512");
                    return Err(refuse(what));
                }
                for at in start..start + width {
                    if let Some(earlier) = taken.insert(at, index + 1) {
                        let at = at % UNIVERSE + 1;
                        let what = format!("`{name}` takes address {at}, which line {earlier} has");
                        return Err(refuse(what));
                    }
                }
                for (position, value) in placed.values.enumerate() {
                    let bytes = (placed.fine, placed.ends);
                    patch.add(value, start + position * step, bytes);
                }
            }
        }
        Ok(patch)
    }

    fn add(&mut self, coordinate: usize, at: usize, (fine, ends): (bool, [f64; 2])) {
        self.slots.push(Slot {
            coordinate,
            universe: (at / UNIVERSE + 1) as u16,
            offset: at % UNIVERSE,
            fine,
            ends,
        });
    }

    /// Heads whose axes are not all patched, so that they do not move as in the show, with a line
    /// for the patch.
    pub fn heads_without_address(&self, show: &Show) -> Vec<Loss> {
        let parts = show.cues.iter().flat_map(|cue| &cue.parts);
        let moves = parts.flat_map(|part| &part.moves);
        let moved: BTreeSet<usize> = moves.map(|one| one.parameter).collect();
        let (first, first_pose) = (show.coordinates().len(), show.first_pose());
        let is_sent = |pose: usize| self.slots.iter().any(|s| s.coordinate == first + pose);
        let is_moved = |pose: usize| moved.contains(&(first_pose + pose));
        // On most heads beam and field share one channel.
        let turns = |pan: usize| !is_sent(pan) || !is_sent(pan + 1);
        let zooms = |pan: usize| {
            let mut both = pan + 2..pan + 4;
            both.clone().any(is_moved) && !both.any(is_sent)
        };
        let mut out = Vec::new();
        for (is_lost, what, line) in [
            (
                &turns as &dyn Fn(usize) -> bool,
                "pan and tilt",
                "pan 1/101 tilt 1/103",
            ),
            (&zooms, "zoom", "field 1/105"),
        ] {
            let heads = show.heads().into_iter().enumerate();
            let lost = heads.filter(|(head, _)| is_lost(HeadAxis::ALL.len() * head));
            let lost = lost.filter_map(|(_, (light, ..))| show.lights.get(light));
            let lost: Vec<&str> = lost.map(|light| light.name.as_str()).collect();
            if let Some(one) = lost.first() {
                let all = lost.join(" ");
                out.push(Loss::new(format!(
                    "no address for {what} of {all}: write it into the patch, `{one} {line}`"
                )));
            }
        }
        out
    }

    /// The addresses.
    pub fn slots(&self) -> &[Slot] {
        &self.slots
    }

    /// A zeroed universe for each that has an address.
    pub fn dark(&self) -> Frames {
        let universes = self.slots.iter().map(|slot| slot.universe);
        universes
            .map(|universe| (universe, vec![0; UNIVERSE]))
            .collect()
    }

    /// Writes [`values`] into the universes, rounded to 256 steps, or to 65,536.
    pub fn fill(&self, values: &[f64], frames: &mut Frames) {
        for slot in &self.slots {
            let value = values.get(slot.coordinate).copied().unwrap_or(0.0);
            let [low, high] = slot.ends;
            let value = low + (high - low) * value;
            let Some(frame) = frames.get_mut(&slot.universe) else {
                continue;
            };
            let bytes = if slot.fine {
                step(value, 65535.0).to_be_bytes().to_vec()
            } else {
                vec![step(value, 255.0) as u8]
            };
            for (place, byte) in frame.iter_mut().skip(slot.offset).zip(bytes) {
                *place = byte;
            }
        }
    }
}

/// Places the values of a line about `name`.
///
/// # Errors
/// A message about the line, with a correction.
fn placed<'t>(show: &Show, name: &str, rest: &[&'t str]) -> Result<Vec<Placed<'t>>, String> {
    let axis = |word: &str| HeadAxis::ALL.into_iter().find(|axis| axis.word() == word);
    let heads = show.heads();
    let is_named = |light: usize| show.lights.get(light).is_some_and(|l| l.name == name);
    if let Some(index) = heads.iter().position(|(light, ..)| is_named(*light)) {
        let first = show.coordinates().len() + HeadAxis::ALL.len() * index;
        let number = |word: &str| word.parse().ok().filter(|n: &f64| n.is_finite());
        let mut words = rest.iter().copied().peekable();
        let mut axis_of_head = || {
            let (axis, address) = (axis(words.next()?)?, words.next()?);
            let fine = words.next_if_eq(&"8bit").is_none();
            let ends = match words.peek().copied().and_then(number) {
                None => AS_IT_IS,
                Some(from) => {
                    words.next();
                    words.next_if_eq(&"to")?;
                    let to = words.next().and_then(number).filter(|to| *to != from)?;
                    let (_, head, _) = heads.get(index)?;
                    head.range(axis)
                        .map(|degrees| (degrees - from) / (to - from))
                }
            };
            let value = first + axis as usize;
            let placed = Placed {
                values: value..value + 1,
                address,
                fine,
                ends,
            };
            Some((placed, words.peek().is_none()))
        };
        let mut out = Vec::new();
        while let Some((placed, is_last)) = axis_of_head() {
            out.push(placed);
            if is_last {
                return Ok(out);
            }
        }
        return Err(format!(
            "`{name}` is a head: write its axes with their addresses, `{name} pan 1/101 tilt 1/103`; \
             behind an address may stand `8bit`, and the angles of 0 and full, `-270 to 270`"
        ));
    }
    let bank = show.banks.iter().position(|bank| bank.name == name);
    match (bank, rest) {
        (_, [word, ..]) if axis(word).is_some() => Err(format!(
            "there is no head called `{name}`: a head is a light that moves"
        )),
        (Some(bank), [address, width @ ..]) if matches!(width, [] | ["16bit"]) => {
            Ok(vec![Placed {
                values: show.coordinates_of(bank),
                address,
                fine: !width.is_empty(),
                ends: AS_IT_IS,
            }])
        }
        (None, [_] | [_, "16bit"]) => Err(format!("there is no bank called `{name}`")),
        _ => Err(
            "write a bank, its address, and `16bit` where it has two bytes: `lamps 1/101 16bit`"
                .to_owned(),
        ),
    }
}

fn fits(start: usize, width: usize) -> bool {
    start % UNIVERSE + width <= UNIVERSE && start / UNIVERSE < usize::from(MOST_UNIVERSES)
}

fn step(value: f64, full: f64) -> u16 {
    (value.clamp(0.0, 1.0) * full).round() as u16
}

/// The first address of `2/101`, counted from 0 over all universes.
fn start_of(address: &str) -> Option<usize> {
    let (universe, number) = address.split_once('/')?;
    let (universe, number): (u16, usize) = (universe.parse().ok()?, number.parse().ok()?);
    let known = (1..=MOST_UNIVERSES).contains(&universe) && (1..=UNIVERSE).contains(&number);
    known.then(|| (usize::from(universe) - 1) * UNIVERSE + number - 1)
}
