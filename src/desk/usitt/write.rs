//! Writes a show as a desk's file: the standard's records, which every desk reads, and those of
//! ETC's Eos for what the standard cannot express (colours, `hang`, moves).

mod losses;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::model::{FULL, Tenths, step, tenths};
use crate::{Carried, ExportError, Loss};
use footlight_host::work::Work;
use footlight_show::model::{Bank, Cue, Fade, Head, Link, Motion, Show};
use footlight_show::timeline::{Moved, Timeline, Timing, cue_moves};
use footlight_show::units::{Time, percent};

/// Columns of a line, by the standard.
const WIDTH: usize = 80;
/// The number of the first fixture type.
const FIRST_KIND: u32 = 90_001;
/// Parameter numbers of red, green and blue.
const EMITTERS: [u32; 3] = [12, 13, 14];

/// The file for a show, with the losses.
///
/// # Errors
/// When the cues make no timeline, or on cancel.
pub fn write(show: &Show, timeline: &Timeline, work: Work<'_>) -> Result<Carried, ExportError> {
    let mut moves = cue_moves(show)?;
    let first_pose = show.first_pose();
    let turns = |parameter: usize| parameter < first_pose || (parameter - first_pose) % 4 < 2;
    let zooms = moves.iter().flatten().any(|one| !turns(one.parameter));
    for all in &mut moves {
        all.retain(|one| turns(one.parameter));
    }
    let mut writer = Writer {
        show,
        timeline,
        channels: Vec::new(),
        heads: show.heads(),
        first: show.first_parameters(),
        held: show.dark_levels(),
        text: String::new(),
        losses: Vec::new(),
    };
    writer.channels();
    if zooms {
        writer.losses.push(Loss::new("zoom of moving heads"));
    }
    writer.head();
    writer.selections();
    for (index, (cue, moves)) in show.cues.iter().zip(&moves).enumerate() {
        work.check()?;
        writer.cue(index, cue, moves);
    }
    writer.text.push_str("EndData\n");
    writer.rest();
    Ok(Carried {
        text: writer.text,
        losses: writer.losses,
    })
}

struct Writer<'a> {
    show: &'a Show,
    timeline: &'a Timeline,
    /// Channels of each bank, one for each of its heads.
    channels: Vec<Vec<u32>>,
    heads: Vec<(usize, &'a Head, usize)>,
    /// First parameter of each bank.
    first: Vec<usize>,
    /// Value of each parameter between cues.
    held: Vec<f64>,
    text: String,
    losses: Vec<Loss>,
}

/// Moves of a cue with one timing.
#[derive(Debug, Default)]
struct Part {
    label: String,
    up: Time,
    down: Time,
    delay: Time,
    levels: BTreeSet<usize>,
    colours: BTreeSet<usize>,
    heads: BTreeSet<usize>,
    /// The longest time of an emitter.
    colour: Time,
}

impl<'a> Writer<'a> {
    /// Gives every bank a channel: its own, or a free one. Each head of a bank beyond the first
    /// gets the next free channel.
    fn channels(&mut self) {
        let mut taken = BTreeSet::new();
        let own = |bank: &Bank, taken: &mut BTreeSet<u32>| {
            bank.channel.filter(|channel| taken.insert(*channel))
        };
        let banks = self.show.banks.iter();
        let given: Vec<Option<u32>> = banks.map(|bank| own(bank, &mut taken)).collect();
        let mut next = taken.last().map_or(1, |last| last.saturating_add(1));
        for (index, (bank, channel)) in self.show.banks.iter().zip(given).enumerate() {
            let mut free = || {
                next = next.saturating_add(1);
                next - 1
            };
            let first = channel.unwrap_or_else(&mut free);
            if channel.is_none() {
                let why = match bank.channel {
                    Some(channel) => format!("shares channel {channel}"),
                    None => "has no channel".to_owned(),
                };
                let what = format!("bank `{}` {why}: it is {first} in the file", bank.name);
                self.losses.push(Loss::new(what));
            }
            let heads = self.heads.iter().filter(|(.., bank)| *bank == index);
            let more = heads.skip(1).map(|_| free());
            self.channels
                .push(std::iter::once(first).chain(more).collect());
        }
    }

    fn channels_of(&self, bank: usize) -> &[u32] {
        self.channels.get(bank).map_or(&[], Vec::as_slice)
    }

    /// Channels of banks with their current levels.
    fn held(&self, banks: impl Iterator<Item = usize>) -> BTreeMap<u32, Tenths> {
        let each = |bank| {
            let level = of(self.level(bank));
            self.channels_of(bank)
                .iter()
                .map(move |channel| (*channel, level))
        };
        banks.flat_map(each).collect()
    }

    /// The head of a bank at its `position`-th channel.
    fn head_of(&self, bank: usize, position: usize) -> Option<(usize, &'a Head)> {
        let heads = self.heads.iter().enumerate();
        let mut own = heads.filter(|(_, (.., of))| *of == bank);
        own.nth(position)
            .map(|(index, (_, head, _))| (index, *head))
    }

    fn head(&mut self) {
        let most = self.channels.iter().flatten().max().copied().unwrap_or(0);
        let title = ascii(&self.show.title, WIDTH - 8);
        let _ = write!(
            self.text,
            "Ident 3:0\nManufacturer ETC\nConsole Eos\n$$Format 3.20\n! Written by Footlight\n\
             $$Title {title}\nClear All\nSet Channels {most}\n\n"
        );
        if !self.heads.is_empty() || self.show.banks.iter().any(|bank| bank.rgb) {
            self.text.push_str(
                "$ParamType 1 1 Intens\n$ParamType 2 2 Pan\n$ParamType 3 2 Tilt\n\
                 $ParamType 12 3 Red\n$ParamType 13 3 Green\n$ParamType 14 3 Blue\n\n",
            );
        }
        let mut kinds: Vec<(bool, Option<[[f64; 2]; 2]>)> = Vec::new();
        let mut patch = String::new();
        for (index, bank) in self.show.banks.iter().enumerate() {
            for (position, channel) in self.channels_of(index).iter().enumerate() {
                let head = self.head_of(index, position);
                let kind = (bank.rgb, head.map(|(_, head)| [head.pan, head.tilt]));
                let known = kinds.iter().position(|other| *other == kind);
                let number = FIRST_KIND + known.unwrap_or(kinds.len()) as u32;
                if known.is_none() {
                    kinds.push(kind);
                }
                let _ = writeln!(patch, "$Patch {channel} {number} 0 0 1");
                let light = head.filter(|_| self.channels_of(index).len() > 1);
                let light = light.and_then(|(head, _)| self.heads.get(head));
                let light = light.and_then(|(light, ..)| self.show.lights.get(*light));
                let name = light.map_or(&bank.name, |light| &light.name);
                patch.push_str(&labelled("Text", name));
            }
        }
        for ((rgb, head), number) in kinds.iter().zip(FIRST_KIND..) {
            self.kind(number, *rgb, *head);
        }
        let _ = writeln!(self.text, "{patch}");
    }

    /// Writes a fixture type: a dimmer, optionally with three emitters, or with pan and tilt of
    /// these ranges.
    fn kind(&mut self, number: u32, rgb: bool, head: Option<[[f64; 2]; 2]>) {
        // Parameters with their homes and ranges.
        let mut rows = vec![(1, 0, None)];
        for (axis, range) in [2, 3].into_iter().zip(head.into_iter().flatten()) {
            rows.push((axis, 32768, Some(range)));
        }
        if rgb {
            rows.extend(EMITTERS.map(|emitter| (emitter, 65535, None)));
        }
        let (mut at, mut channels) = (1, String::new());
        for (parameter, home, range) in rows {
            let (size, low) = if parameter > 1 || rgb {
                (2, at + 1)
            } else {
                (1, 0)
            };
            let _ = writeln!(
                channels,
                "   $$PersChan {parameter} {size} {at} {low} {home}"
            );
            if let Some([from, to]) = range {
                let _ = writeln!(channels, "   $$PersSlot 0 65535 {home} {from} {to}");
            }
            at += size;
        }
        let model = match (rgb, head.is_some()) {
            (false, false) => "Dimmer",
            (true, false) => "RGB_16bit",
            (false, true) => "Head",
            (true, true) => "Head_RGB",
        };
        let footprint = at - 1;
        let _ = writeln!(
            self.text,
            "$Personality {number}\n   $$Manuf Generic\n   $$Model {model}\n   $$Footprint \
             {footprint}\n{channels}"
        );
    }

    fn label(&mut self, label: &str) {
        self.text("Text", label);
    }

    fn text(&mut self, key: &str, text: &str) {
        self.text.push_str(&labelled(key, text));
    }

    fn selections(&mut self) {
        for (index, group) in self.show.groups.iter().enumerate() {
            let _ = writeln!(self.text, "Group {}", index + 1);
            self.label(&group.name);
            let members = group.banks.iter().flat_map(|bank| self.channels_of(*bank));
            let members = members.map(|channel| (*channel, FULL)).collect();
            self.levels("Chan", &members, |_| "100".to_owned());
        }
        for (index, look) in self.show.looks.iter().enumerate() {
            let _ = writeln!(self.text, "Sub {}", index + 1);
            self.label(&look.name);
            let mut levels = BTreeMap::new();
            let mut coloured = BTreeSet::new();
            for (parameter, level) in &look.levels {
                let (bank, which) = self.bank_of(*parameter);
                for channel in self.channels_of(bank) {
                    if which == 0 {
                        levels.insert(*channel, of(*level));
                    } else {
                        coloured.insert(*channel);
                    }
                }
            }
            for channel in coloured {
                let what = format!("look `{}`: the colour of channel {channel}", look.name);
                self.losses.push(Loss::new(what));
            }
            self.levels("Chan", &levels, hex);
        }
        self.text.push('\n');
    }

    /// The bank of a parameter, and its index among the bank's parameters.
    fn bank_of(&self, parameter: usize) -> (usize, usize) {
        let after = self.first.partition_point(|first| *first <= parameter);
        let bank = after.saturating_sub(1);
        (bank, parameter - self.first.get(bank).copied().unwrap_or(0))
    }

    /// Writes channels with their levels, in as many records as needed.
    fn levels(&mut self, key: &str, levels: &BTreeMap<u32, Tenths>, written: fn(Tenths) -> String) {
        let mut row = String::new();
        for (channel, level) in levels {
            let word = format!(" {channel}@{}", written(*level));
            if row.len() + word.len() > WIDTH {
                let _ = writeln!(self.text, "{row}");
                row.clear();
            }
            if row.is_empty() {
                row = format!("   {key} ");
            }
            row.push_str(&word);
        }
        if !row.is_empty() {
            let _ = writeln!(self.text, "{row}");
        }
    }

    fn cue(&mut self, index: usize, cue: &Cue, moves: &[Moved<'_>]) {
        let before = self.held.clone();
        let parts = self.parts(index, cue, moves, &before);
        let _ = writeln!(self.text, "Cue {} 1", cue.number);
        self.label(&cue.label);
        self.text("$$CueNotes", &cue.note);
        let several = parts.len() > 1;
        // Channels that the cue does not move are in its first part.
        let moved: BTreeSet<usize> = parts
            .iter()
            .flat_map(|part| part.levels.iter().copied())
            .collect();
        for (number, part) in parts.iter().enumerate() {
            if several {
                let _ = writeln!(self.text, "   Part {}", number + 1);
                if number > 0 {
                    self.label(&part.label);
                }
            }
            self.times(part);
            if number == 0 && cue.block {
                self.text.push_str("   $$Block\n");
            }
            let moves = self.held(part.levels.iter().copied());
            let here = |bank: &usize| {
                if moved.contains(bank) {
                    part.levels.contains(bank)
                } else {
                    number == 0
                }
            };
            let mut lit = self.held((0..self.show.banks.len()).filter(here));
            lit.retain(|_, level| *level > 0);
            self.levels("$$ChanMove", &moves, hex);
            self.levels("Chan", &lit, hex);
            for bank in 0..self.show.banks.len() {
                self.parameters(bank, part);
            }
        }
        self.link(index, cue);
        self.rounding(cue, moves);
    }

    fn times(&mut self, part: &Part) {
        for (key, time) in [("Up", part.up), ("Down", part.down)] {
            let delay = match part.delay {
                Time::ZERO => String::new(),
                delay => format!(" {}", clock(delay)),
            };
            let _ = writeln!(self.text, "   {key} {}{delay}", clock(time));
        }
        if !part.colours.is_empty() && part.up != part.down {
            let (time, delay) = (clock(part.colour), clock(part.delay));
            let _ = writeln!(self.text, "   $$TimeColor {time} {delay}");
        }
    }

    fn level(&self, bank: usize) -> f64 {
        let first = self.first.get(bank).copied().unwrap_or(0);
        self.held.get(first).copied().unwrap_or(0.0)
    }

    /// Writes the moves of a bank's pan, tilt and colour in a part.
    fn parameters(&mut self, bank: usize, part: &Part) {
        let mut text = String::new();
        for (position, channel) in self.channels_of(bank).iter().enumerate() {
            let mut row: Vec<(u32, usize)> = Vec::new();
            let head = self.head_of(bank, position).map(|(head, _)| head);
            if let Some(head) = head.filter(|head| part.heads.contains(head)) {
                let first = self.show.first_pose_of(head);
                row.extend([(2, first), (3, first + 1)]);
            }
            if part.colours.contains(&bank) {
                let first = self.first.get(bank).copied().unwrap_or(0);
                row.extend(EMITTERS.into_iter().zip(first + 1..));
            }
            if !row.is_empty() {
                let _ = write!(text, "   $$Param {channel}");
                for (parameter, from) in row {
                    let value = self.held.get(from).copied().unwrap_or(0.0);
                    let _ = write!(text, " {parameter}@{}", (value * 65535.0).round());
                }
                text.push('\n');
            }
        }
        self.text.push_str(&text);
    }

    /// The moves of a cue, by timing; updates the held levels.
    fn parts(&mut self, index: usize, cue: &Cue, moves: &[Moved<'_>], before: &[f64]) -> Vec<Part> {
        let mut parts: Vec<Part> = Vec::new();
        let written = cue.parts.iter().filter(|part| part.written);
        let labels: Vec<(Timing, &str)> = written
            .map(|part| {
                let timing = Timing {
                    delay: part.delay,
                    up: part.up,
                    down: part.down,
                    fade: part.curve,
                };
                (timing, part.label.as_str())
            })
            .collect();
        let mut curved = BTreeSet::new();
        let mut bent = false;
        for one in moves {
            let (bank, which) = self.bank_of(one.parameter);
            let pose = one.parameter.checked_sub(self.show.first_pose());
            let target = one.motion.target();
            let (up, down) = self.times_of(one);
            let known = parts
                .iter()
                .position(|p| (p.up, p.down, p.delay) == (up, down, one.timing.delay));
            let at = known.unwrap_or(parts.len());
            if known.is_none() {
                let label = labels.iter().find(|(timing, _)| *timing == one.timing);
                parts.push(Part {
                    label: label.map_or(String::new(), |(_, label)| (*label).to_owned()),
                    up,
                    down,
                    delay: one.timing.delay,
                    ..Part::default()
                });
            }
            let was = before.get(one.parameter).copied().unwrap_or(0.0);
            if let Some(part) = parts.get_mut(at) {
                match (pose, which) {
                    (Some(pose), _) => part.heads.insert(pose / 4),
                    (None, 0) => part.levels.insert(bank),
                    (None, _) => part.colours.insert(bank),
                };
                if pose.is_none() && which > 0 && was != target {
                    part.colour = part.colour.max(if target > was { up } else { down });
                }
            }
            if let Some(held) = self.held.get_mut(one.parameter) {
                *held = target;
            }
            let linear = one.timing.fade == Fade::LINEAR && one.repeat == 1;
            let straight = matches!(*one.motion, Motion::To(_)) && (linear || was == target);
            if pose.is_some() {
                bent |= !straight;
            } else if !straight || (which > 0 && up != down && was != target) {
                curved.insert(one.parameter);
            }
        }
        if parts.is_empty() {
            let own = cue.parts.first();
            parts.push(Part {
                up: own.map_or(Time::ZERO, |part| part.up),
                down: own.map_or(Time::ZERO, |part| part.down),
                delay: own.map_or(Time::ZERO, |part| part.delay),
                ..Part::default()
            });
        }
        if let (0, Some(part)) = (index, parts.first_mut()) {
            // Positions of heads that no cue has moved yet.
            part.heads.extend(0..self.heads.len());
        }
        if bent {
            let what = "heads turn straight, not along their curve";
            self.losses.push(Loss::new(what).cue(cue.number));
        }
        for parameter in curved {
            let named = self.show.parameters().into_iter().nth(parameter);
            let name = named.map_or(String::new(), |named| named.name);
            let what = format!("`{name}`: its curve is a straight fade to its last level");
            self.losses.push(Loss::new(what).cue(cue.number));
        }
        parts
    }

    /// Up and down time; a path or a repeated fade takes its length.
    fn times_of(&self, one: &Moved<'_>) -> (Time, Time) {
        let times = |time: Time| {
            let repeats = i64::from(one.repeat.max(1));
            Time::from_micros(time.micros().saturating_mul(repeats)).min(Time::MAX)
        };
        match one.motion.as_ref() {
            Motion::To(_) => (times(one.timing.up), times(one.timing.down)),
            Motion::Path(path) => {
                let end = path.knots.last().map_or(Time::ZERO, |knot| knot.time);
                (times(end), times(end))
            }
        }
    }

    fn link(&mut self, index: usize, cue: &Cue) {
        let times = self.timeline.cues().get(index);
        let length = times.map_or(Time::ZERO, |times| times.completion - times.go);
        match cue.link {
            None => {}
            Some((_, Link::Hang(hang))) if hang >= Time::ZERO => {
                let follow = clock(length + hang);
                let _ = writeln!(self.text, "   FollowOn {follow}\n   $$Hang {}", clock(hang));
            }
            Some((_, link)) => {
                let follow = clock(match link {
                    Link::Follow(follow) => follow,
                    Link::Hang(hang) => length + hang,
                });
                let _ = writeln!(self.text, "   FollowOn {follow}\n   $$Follow {follow}");
            }
        }
        self.text.push('\n');
    }
}

/// A label, also in UTF-16 if it is not ASCII.
fn labelled(key: &str, text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    let plain = ascii(text, WIDTH - 4 - key.len());
    let mut out = format!("   {key} {plain}\n");
    if plain != text {
        let units = text
            .encode_utf16()
            .map(|unit| format!("{:04X}", unit.swap_bytes()));
        let units: Vec<String> = units.collect();
        let _ = writeln!(out, "   $$UText {}", units.join(" "));
    }
    out
}

/// The level that a reader of the file finds for a fraction of full.
fn of(level: f64) -> Tenths {
    tenths(step((percent(level) * 10.0).round() as Tenths))
}

fn hex(level: Tenths) -> String {
    format!("H{:02x}", step(level))
}

/// A time in the notation of desks.
fn clock(time: Time) -> String {
    let text = time.to_string();
    text.strip_suffix('s').unwrap_or(&text).to_owned()
}

/// Printable ASCII, with `?` for other characters, cut to a length.
fn ascii(text: &str, most: usize) -> String {
    let plain = |c| if matches!(c, ' '..='~') { c } else { '?' };
    text.chars().map(plain).take(most).collect()
}
