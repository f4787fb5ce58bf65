//! A show as a desk's file: the standard's own records, which every desk reads, and beside them those
//! of ETC's Eos for what the standard has no word for (colours, `hang`, what moves).

mod losses;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::model::{FULL, Tenths, step, tenths};
use crate::{Carried, ExportError, Loss};
use footlight_host::work::Work;
use footlight_show::model::{Bank, Cue, Fade, Link, Motion, Show};
use footlight_show::timeline::{Moved, Timeline, Timing, cue_moves};
use footlight_show::units::{Time, percent};

/// Columns of a line, as the standard allows.
const WIDTH: usize = 80;
/// Type of the fixtures that mix colours, and that of the others.
const KINDS: [u32; 2] = [90_002, 90_001];

/// The file for a show, with what of the show is not in it.
///
/// # Errors
/// Where the cues make no timeline, or on cancel.
pub fn write(show: &Show, timeline: &Timeline, work: Work<'_>) -> Result<Carried, ExportError> {
    let mut moves = cue_moves(show)?;
    let positions = Loss::of_positions(show, &moves);
    let first_pose = show.first_pose();
    for all in &mut moves {
        all.retain(|one| one.parameter < first_pose);
    }
    let mut writer = Writer {
        show,
        timeline,
        channels: Vec::new(),
        first: show.first_parameters(),
        held: show.dark_levels(),
        text: String::new(),
        losses: Vec::new(),
    };
    writer.channels();
    writer.losses.extend(positions);
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
    /// By bank.
    channels: Vec<u32>,
    /// Where each bank's parameters begin.
    first: Vec<usize>,
    /// What each parameter holds between cues.
    held: Vec<f64>,
    text: String,
    losses: Vec<Loss>,
}

/// What a part of a cue moves, in one time.
#[derive(Debug, Default)]
struct Part {
    label: String,
    up: Time,
    down: Time,
    delay: Time,
    levels: BTreeSet<usize>,
    colours: BTreeSet<usize>,
    /// The longest time of an emitter.
    colour: Time,
}

impl Writer<'_> {
    /// Gives every bank a channel: its own, or one that no other has.
    fn channels(&mut self) {
        let mut taken = BTreeSet::new();
        let own = |bank: &Bank, taken: &mut BTreeSet<u32>| {
            bank.channel.filter(|channel| taken.insert(*channel))
        };
        let banks = self.show.banks.iter();
        let given: Vec<Option<u32>> = banks.map(|bank| own(bank, &mut taken)).collect();
        let mut next = taken.last().map_or(1, |last| last.saturating_add(1));
        for (bank, channel) in self.show.banks.iter().zip(given) {
            self.channels.push(channel.unwrap_or(next));
            if channel.is_some() {
                continue;
            }
            let why = match bank.channel {
                Some(channel) => format!("shares channel {channel}"),
                None => "has no channel".to_owned(),
            };
            let what = format!("bank `{}` {why}: it is {next} in the file", bank.name);
            self.losses.push(Loss::new(what));
            next = next.saturating_add(1);
        }
    }

    fn channel(&self, bank: usize) -> u32 {
        self.channels.get(bank).copied().unwrap_or(0)
    }

    fn head(&mut self) {
        let most = self.channels.iter().max().copied().unwrap_or(0);
        let title = ascii(&self.show.title, WIDTH - 8);
        let _ = write!(
            self.text,
            "Ident 3:0\nManufacturer ETC\nConsole Eos\n$$Format 3.20\n! Written by Footlight\n\
             $$Title {title}\nClear All\nSet Channels {most}\n\n"
        );
        if self.show.banks.iter().any(|bank| bank.rgb) {
            self.text.push_str(
                "$ParamType 1 1 Intens\n$ParamType 12 3 Red\n$ParamType 13 3 Green\n\
                 $ParamType 14 3 Blue\n\n",
            );
        }
        let kinds = [
            (true, "RGB_16bit", 8, [1, 12, 13, 14].as_slice()),
            (false, "Dimmer", 1, &[1]),
        ];
        for ((rgb, model, footprint, parameters), kind) in kinds.into_iter().zip(KINDS) {
            if !self.show.banks.iter().any(|bank| bank.rgb == rgb) {
                continue;
            }
            let _ = write!(
                self.text,
                "$Personality {kind}\n   $$Manuf Generic\n   $$Model {model}\n   $$Footprint {footprint}\n"
            );
            for (index, parameter) in parameters.iter().enumerate() {
                let (size, at) = if rgb { (2, 2 * index + 1) } else { (1, 1) };
                let low = if rgb { at + 1 } else { 0 };
                let home = if index == 0 { 0 } else { 65535 };
                let _ = writeln!(
                    self.text,
                    "   $$PersChan {parameter} {size} {at} {low} {home}"
                );
            }
            self.text.push('\n');
        }
        for (index, bank) in self.show.banks.iter().enumerate() {
            let [mixing, plain] = KINDS;
            let kind = if bank.rgb { mixing } else { plain };
            let _ = writeln!(self.text, "$Patch {} {kind} 0 0 1", self.channel(index));
            self.label(&bank.name);
        }
        self.text.push('\n');
    }

    fn label(&mut self, label: &str) {
        self.text("Text", label);
    }

    /// A text, and in UTF-16 too where it is not ASCII.
    fn text(&mut self, key: &str, text: &str) {
        if text.is_empty() {
            return;
        }
        let plain = ascii(text, WIDTH - 4 - key.len());
        let _ = writeln!(self.text, "   {key} {plain}");
        if plain != text {
            let units = text
                .encode_utf16()
                .map(|unit| format!("{:04X}", unit.swap_bytes()));
            let units: Vec<String> = units.collect();
            let _ = writeln!(self.text, "   $$UText {}", units.join(" "));
        }
    }

    fn selections(&mut self) {
        for (index, group) in self.show.groups.iter().enumerate() {
            let _ = writeln!(self.text, "Group {}", index + 1);
            self.label(&group.name);
            let members = group
                .banks
                .iter()
                .map(|bank| (self.channel(*bank), FULL))
                .collect();
            self.levels("Chan", &members, |_| "100".to_owned());
        }
        for (index, look) in self.show.looks.iter().enumerate() {
            let _ = writeln!(self.text, "Sub {}", index + 1);
            self.label(&look.name);
            let mut levels = BTreeMap::new();
            let mut coloured = BTreeSet::new();
            for (parameter, level) in &look.levels {
                match self.bank_of(*parameter) {
                    (bank, 0) => drop(levels.insert(self.channel(bank), of(*level))),
                    (bank, _) => drop(coloured.insert(self.channel(bank))),
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

    /// The bank of a parameter, and which of its parameters it is.
    fn bank_of(&self, parameter: usize) -> (usize, usize) {
        let after = self.first.partition_point(|first| *first <= parameter);
        let bank = after.saturating_sub(1);
        (bank, parameter - self.first.get(bank).copied().unwrap_or(0))
    }

    /// Records of channels with their levels, as many as there must be.
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
            let level = |bank: usize| (self.channel(bank), of(self.level(bank)));
            let moves: BTreeMap<u32, Tenths> =
                part.levels.iter().map(|bank| level(*bank)).collect();
            let here = |bank: &usize| {
                if moved.contains(bank) {
                    part.levels.contains(bank)
                } else {
                    number == 0
                }
            };
            let lit: BTreeMap<u32, Tenths> =
                (0..self.show.banks.len()).filter(here).map(level).collect();
            let lit = lit.into_iter().filter(|(_, level)| *level > 0).collect();
            self.levels("$$ChanMove", &moves, hex);
            self.levels("Chan", &lit, hex);
            for bank in &part.colours {
                self.colour(*bank);
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

    fn colour(&mut self, bank: usize) {
        let first = self.first.get(bank).copied().unwrap_or(0);
        let emitters = self.held.get(first + 1..first + 4).unwrap_or_default();
        let values = [12, 13, 14].iter().zip(emitters);
        let values = values.map(|(parameter, value)| {
            let value = (value * 65535.0).round();
            format!(" {parameter}@{value}")
        });
        let values: String = values.collect();
        let _ = writeln!(self.text, "   $$Param {}{values}", self.channel(bank));
    }

    /// What the cue moves, by times; the levels that it comes to are held from here on.
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
        let mut curved: Vec<(usize, Time, Time)> = Vec::new();
        for one in moves {
            let (bank, which) = self.bank_of(one.parameter);
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
                match which {
                    0 => part.levels.insert(bank),
                    _ => part.colours.insert(bank),
                };
                if which > 0 && was != target {
                    part.colour = part.colour.max(if target > was { up } else { down });
                }
            }
            if let Some(held) = self.held.get_mut(one.parameter) {
                *held = target;
            }
            let straight = matches!(*one.motion, Motion::To(_)) && one.repeat == 1;
            let linear = one.timing.fade == Fade::LINEAR || was == target;
            if !(straight && linear) || (which > 0 && up != down && was != target) {
                curved.push((one.parameter, one.timing.delay, up.max(down)));
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
        self.bends(index, cue, &curved);
        parts
    }

    /// Up and down time; a path or a repeated fade takes as long as it is.
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

/// The level that a reader of the file finds for a fraction of full.
fn of(level: f64) -> Tenths {
    tenths(step((percent(level) * 10.0).round() as Tenths))
}

fn hex(level: Tenths) -> String {
    format!("H{:02x}", step(level))
}

/// A time as desks write it.
fn clock(time: Time) -> String {
    let text = time.to_string();
    text.strip_suffix('s').unwrap_or(&text).to_owned()
}

/// Printable ASCII, with `?` for all else, cut to a length.
fn ascii(text: &str, most: usize) -> String {
    let plain = |c| if matches!(c, ' '..='~') { c } else { '?' };
    text.chars().map(plain).take(most).collect()
}
