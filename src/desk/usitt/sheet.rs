//! Writes the text of a show as a designer would: groups and looks where they fit, one timing for
//! moves that belong together.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::model::{Curve, Desk, FULL, Tenths};
use super::settle::{FIVE, Move, Settled, Step, Timing, timing_of};
use crate::names::Names;
use crate::{ImportError, Loss};
use footlight_host::work::Work;
use footlight_show::lang::{self, quoted};
use footlight_show::units::Time;

/// Columns of a line.
const WIDTH: usize = 92;

/// Names in the show's text.
struct Sheet<'a> {
    desk: &'a Desk,
    /// Names of the channels in use.
    banks: BTreeMap<u32, String>,
    /// Names of the lights of channels with heads.
    heads: BTreeMap<u32, String>,
    groups: Vec<(String, BTreeSet<u32>)>,
    looks: Vec<(String, BTreeMap<u32, Tenths>)>,
    curves: BTreeMap<u32, String>,
    time: (Time, Time),
}

/// The text for a desk's show, in its canonical layout.
///
/// # Errors
/// When the text is too large, and on cancel.
pub fn text(
    name: &str,
    desk: &Desk,
    cues: &[Settled<'_>],
    losses: &mut Vec<Loss>,
    work: Work<'_>,
) -> Result<String, ImportError> {
    let mut names = Names::default();
    let mut sheet = Sheet {
        desk,
        banks: banks(desk, cues, &mut names, losses),
        heads: BTreeMap::new(),
        groups: Vec::new(),
        looks: Vec::new(),
        curves: BTreeMap::new(),
        time: desk.time.unwrap_or((FIVE, FIVE)),
    };
    sheet.find_heads(&mut names, losses);
    sheet.selections(&mut names, losses);
    let mut out = sheet.head(name);
    sheet.curves(cues, &mut names, &mut out, losses);
    out.push('\n');
    for settled in cues {
        work.check()?;
        sheet.cue(settled, cues.last(), &mut out);
    }
    lang::format(&out).map_err(|mut errors| Box::new(errors.remove(0)).into())
}

/// Declares a bank for each channel used by a cue, a group or a look.
fn banks(
    desk: &Desk,
    cues: &[Settled<'_>],
    names: &mut Names,
    losses: &mut Vec<Loss>,
) -> BTreeMap<u32, String> {
    let steps = cues.iter().flat_map(|cue| &cue.steps);
    let mut used: BTreeSet<u32> = steps.flat_map(|step| step.moves.keys().copied()).collect();
    used.extend(desk.groups.iter().flat_map(|group| &group.channels));
    used.extend(desk.looks.iter().flat_map(|look| look.levels.keys()));
    let idle = desk
        .channels
        .keys()
        .filter(|channel| !used.contains(channel));
    let idle: Vec<String> = idle.map(u32::to_string).collect();
    if !idle.is_empty() {
        let what = format!(
            "channels {} have no bank: nothing lights them, and no group or look has them",
            idle.join(" ")
        );
        losses.push(Loss::new(what));
    }
    let name = |channel: u32| {
        let label = desk.channels.get(&channel).map_or("", |c| c.label.as_str());
        (channel, names.give(label, &format!("ch{channel}")))
    };
    used.into_iter().map(name).collect()
}

impl Sheet<'_> {
    fn find_heads(&mut self, names: &mut Names, losses: &mut Vec<Loss>) {
        for (channel, bank) in &self.banks {
            let turns = self.desk.channels.get(channel).and_then(|c| c.head);
            if turns.is_some() {
                let name = names.give(&format!("{bank}_head"), "head");
                self.heads.insert(*channel, name);
            }
        }
        if !self.heads.is_empty() {
            let heads: Vec<&str> = self.heads.values().map(String::as_str).collect();
            let what = format!(
                "where heads hang: {} at 0, 0, 5 here; their angles are the desk's",
                heads.join(" ")
            );
            losses.push(Loss::new(what));
        }
    }

    /// Names groups and looks.
    fn selections(&mut self, names: &mut Names, losses: &mut Vec<Loss>) {
        for group in &self.desk.groups {
            if !group.channels.is_empty() {
                let name = names.give(&group.label, &format!("group{}", whole(&group.number)));
                self.groups
                    .push((name, group.channels.iter().copied().collect()));
            }
        }
        for look in &self.desk.looks {
            if look.levels.is_empty() {
                let what = format!("{} {} has no levels", look.word, look.number);
                losses.push(Loss::new(what).line(look.line));
                continue;
            }
            let fallback = format!("{}{}", look.word, whole(&look.number));
            let name = names.give(&look.label, &fallback);
            self.looks.push((name, look.levels.clone()));
        }
    }

    fn bank(&self, channel: u32) -> &str {
        self.banks.get(&channel).map_or("", String::as_str)
    }

    fn head(&self, name: &str) -> String {
        let console = match self.desk.console.as_str() {
            "" => String::new(),
            console => format!(", {console}"),
        };
        let title = match self.desk.title.as_str() {
            "" => name.strip_suffix(".asc").unwrap_or(name),
            title => title,
        };
        let from: String = format!("{name}{console}")
            .chars()
            .filter(|c| !c.is_control())
            .collect();
        let title: String = title.chars().filter(|c| !c.is_control()).collect();
        let mut out = format!(
            "// From {from}. A bank without lights is a channel of the desk.\n\nshow {}\n",
            quoted(&title)
        );
        if self.time != (FIVE, FIVE) {
            let (up, down) = self.time;
            let down = if up == down {
                String::new()
            } else {
                format!("/{}", short(down))
            };
            let _ = writeln!(out, "default time {}{down}", short(up));
        }
        out.push('\n');
        for (channel, head) in &self.heads {
            let ranges = self.desk.channels.get(channel).and_then(|c| c.head);
            let [[pan_low, pan_high], [tilt_low, tilt_high]] = ranges.unwrap_or_default();
            let _ = writeln!(
                out,
                "light {head} spot  at 0, 0, 5  aim 0, 0, 0  beam 12  field 18  10000 lm  moves  \
                 pan {pan_low} to {pan_high}  tilt {tilt_low} to {tilt_high}"
            );
        }
        if !self.heads.is_empty() {
            out.push('\n');
        }
        for (channel, bank) in &self.banks {
            let rgb = self.desk.channels.get(channel).is_some_and(|c| c.rgb);
            let rgb = if rgb { "  rgb" } else { "" };
            let head = self.heads.get(channel);
            let head = head.map_or(String::new(), |head| format!(" = {head}"));
            let _ = writeln!(out, "bank {bank}{head}  channel {channel}{rgb}");
        }
        out.push('\n');
        for (name, channels) in &self.groups {
            let banks: Vec<&str> = channels.iter().map(|channel| self.bank(*channel)).collect();
            out.push_str(&rows(&format!("group {name} ="), &banks, " ", "    "));
        }
        for (name, levels) in &self.looks {
            let levels = levels
                .iter()
                .map(|(c, l)| format!("{} {}", self.bank(*c), level(*l)));
            let levels: Vec<String> = levels.collect();
            let line = format!("look {name} {{ {} }}", levels.join("  "));
            if line.len() <= WIDTH {
                out.push_str(&(line + "\n"))
            } else {
                let body = rows("", &words(&levels), "  ", "  ");
                let _ = write!(out, "look {name} {{\n{body}}}\n");
            }
        }
        out
    }

    /// Declares the curves that cues follow.
    fn curves(
        &mut self,
        cues: &[Settled<'_>],
        names: &mut Names,
        out: &mut String,
        losses: &mut Vec<Loss>,
    ) {
        for settled in cues {
            for step in &settled.steps {
                let Some(number) = step.timing.curve else {
                    continue;
                };
                if self.curves.contains_key(&number) {
                    continue;
                }
                let curve = self.desk.curves.get(&number);
                match curve.and_then(knots) {
                    Some(knots) => {
                        let label = curve.map_or("", |curve| curve.label.as_str());
                        let name = names.give(label, &format!("curve{number}"));
                        let _ = writeln!(out, "curve {name} = linear {knots}");
                        self.curves.insert(number, name);
                    }
                    None => {
                        let what =
                            format!("curve {number} is no fade from 0 to 100: straight here");
                        let loss = Loss::new(what).line(settled.cue.line);
                        losses.push(loss.cue(settled.cue.number));
                    }
                }
            }
        }
    }

    fn cue(&self, settled: &Settled<'_>, last: Option<&Settled<'_>>, out: &mut String) {
        let cue = settled.cue;
        let own = cue.parts.first();
        let label = own.map_or("", |part| part.label.as_str());
        let mut items = Vec::new();
        let mut parts = Vec::new();
        let mut steps = settled.steps.iter().peekable();
        let first =
            steps.next_if(|step| step.is_part && (step.label == label || step.label.is_empty()));
        let base = own.map(|part| timing_of(self.desk, part));
        // A cue without moves still takes its time.
        let timing = match (first, settled.steps.is_empty()) {
            (Some(step), _) => Some(step.timing),
            (None, true) => base,
            (None, false) => None,
        };
        let mut said = timing.map_or(Vec::new(), |timing| self.timing(timing, self.default()));
        let around = timing.unwrap_or(self.default());
        for (flag, word) in [(cue.block, "block"), (cue.assert, "assert")] {
            if flag {
                said.push(word.to_owned());
            }
        }
        if let Some(step) = first {
            items = self.moves(step, settled.dark && settled.steps.len() == 1);
        }
        let mut number = 2;
        for step in steps {
            parts.push(self.part(step, (label, around), &mut number));
        }
        let mut after = Vec::new();
        if last.is_some_and(|last| last.cue.number != cue.number) {
            match (cue.hang, cue.follow) {
                // The next cue starts no earlier than this one.
                (Some(hang), _) => {
                    let hang = hang.max(Time::ZERO - settled.length);
                    after.push(format!("hang {}", short(hang)));
                }
                (None, Some(follow)) => after.push(format!("follow {}", short(follow))),
                (None, None) => {}
            }
        }
        if !cue.note.is_empty() {
            after.push(format!("note {}", quoted(&cue.note)));
        }
        let label = match label {
            "" => String::new(),
            label => format!(" {}", quoted(label)),
        };
        let head = format!("cue {}{label} {{", cue.number);
        out.push_str(&block(&head, &said, &items, &parts, &after));
    }

    /// A part, or a move with its own time.
    fn part(&self, step: &Step<'_>, (cue, around): (&str, Timing), number: &mut u32) -> String {
        let moves = self.moves(step, false);
        let timing = self.timing(step.timing, around).join("  ");
        if let ([one], false) = (moves.as_slice(), step.is_part)
            && !timing.is_empty()
        {
            return format!("{one}  {timing}");
        }
        let label = match step.label {
            "" => String::new(),
            label if label == cue => String::new(),
            label => format!(" {}", quoted(label)),
        };
        let head = format!("part {number}{label} {{");
        *number += 1;
        let space = if timing.is_empty() { "" } else { "  " };
        let line = format!("{head} {timing}{space}{} }}", moves.join("  "));
        if line.len() + 2 <= WIDTH {
            line
        } else {
            let body = rows("", &words(&moves), "  ", "    ");
            format!("{head}\n    {timing}\n{body}  }}")
        }
    }

    /// The timing of a cue without one.
    fn default(&self) -> Timing {
        Timing {
            delay: Time::ZERO,
            up: self.time.0,
            down: self.time.1,
            curve: None,
        }
    }

    /// Timing words of a cue or part, as far as they differ from `around`.
    fn timing(&self, timing: Timing, around: Timing) -> Vec<String> {
        let mut out = Vec::new();
        if (timing.up, timing.down) != (around.up, around.down) {
            out.push(time(timing.up, timing.down));
        }
        if timing.delay != around.delay {
            out.push(format!("delay {}", short(timing.delay)));
        }
        let curve = |timing: Timing| timing.curve.and_then(|number| self.curves.get(&number));
        if curve(timing) != curve(around) {
            let name = curve(timing).map_or("linear", String::as_str);
            out.push(format!("curve {name}"));
        }
        out
    }

    /// The moves, with looks and groups where all their levels match.
    fn moves(&self, step: &Step<'_>, dark: bool) -> Vec<String> {
        let mut left = step.moves.clone();
        if dark && left.len() > 1 && left.values().all(Move::is_plain) {
            return vec!["blackout".to_owned()];
        }
        let mut out = Vec::new();
        for (name, levels) in &self.looks {
            let has = |(channel, level): (&u32, &Tenths)| {
                left.get(channel)
                    .is_some_and(|one| one.level == Some(*level) && one.is_plain())
            };
            if levels.len() > 1 && levels.iter().all(has) {
                left.retain(|channel, _| !levels.contains_key(channel));
                out.push(name.clone());
            }
        }
        for (name, channels) in &self.groups {
            let first = channels
                .first()
                .and_then(|channel| left.get(channel))
                .copied();
            let has = |channel| {
                left.get(channel).copied() == first && first.is_some_and(|f| f.is_plain())
            };
            if channels.len() > 1 && channels.iter().all(has) {
                left.retain(|channel, _| !channels.contains(channel));
                let to = first.and_then(|first| first.level).unwrap_or(0);
                out.push(format!("{name} {}", level(to)));
            }
        }
        for (channel, one) in left {
            if let (Some(head), true) = (self.heads.get(&channel), one.pose != [None; 2]) {
                let axes = ["pan", "tilt"].into_iter().zip(one.pose);
                let axes = axes.filter_map(|(axis, angle)| Some(format!(" {axis} {}", angle?)));
                out.push(format!("{head}{}", axes.collect::<String>()));
            }
            if one.level.is_none() && one.colour.is_none() {
                continue;
            }
            let level = one
                .level
                .map(|l| format!(" {}", level(l)))
                .unwrap_or_default();
            let colour = one
                .colour
                .map(|[r, g, b]| format!(" #{r:02x}{g:02x}{b:02x}"));
            out.push(format!(
                "{}{level}{}",
                self.bank(channel),
                colour.unwrap_or_default()
            ));
        }
        out
    }
}

/// A statement on one line if short, else timing, moves and parts on separate lines.
fn block(
    head: &str,
    said: &[String],
    moves: &[String],
    parts: &[String],
    after: &[String],
) -> String {
    let all: Vec<&str> = said
        .iter()
        .chain(moves)
        .chain(after)
        .map(String::as_str)
        .collect();
    let line = format!("{head} {} }}\n", all.join("  "));
    if parts.is_empty() && line.len() <= WIDTH {
        return line;
    }
    let mut out = format!("{head}\n");
    if !said.is_empty() {
        let _ = writeln!(out, "  {}", said.join("  "));
    }
    if !moves.is_empty() {
        out.push_str(&rows("", &words(moves), "  ", "  "));
    }
    for part in parts {
        let _ = writeln!(out, "  {part}");
    }
    if !after.is_empty() {
        let _ = writeln!(out, "  {}", after.join("  "));
    }
    out.push_str("}\n");
    out
}

/// Words after `head`, in indented rows.
fn rows(head: &str, words: &[&str], between: &str, indent: &str) -> String {
    let mut out = String::new();
    let mut row = head.to_owned();
    for word in words {
        if row.len() + between.len() + word.len() > WIDTH && !row.trim().is_empty() {
            let _ = writeln!(out, "{}", row.trim_end());
            row = String::new();
        }
        let space = match row.is_empty() {
            true => indent,
            false if row == head => " ",
            false => between,
        };
        row.push_str(space);
        row.push_str(word);
    }
    let _ = writeln!(out, "{row}");
    out
}

fn words(list: &[String]) -> Vec<&str> {
    list.iter().map(String::as_str).collect()
}

fn knots(curve: &Curve) -> Option<String> {
    let points = if curve.points.is_empty() {
        &curve.steps
    } else {
        &curve.points
    };
    let rises = points.is_sorted_by(|a, b| a.0 < b.0);
    let ends = (points.first()?, points.last()?);
    if !rises || *ends.0 != (0.0, 0.0) || *ends.1 != (1.0, 1.0) {
        return None;
    }
    let knots = points.iter().map(|(at, value)| {
        let level = (value * 1000.0).round() / 10.0;
        format!("{} {level}", (at * 1e4).round() / 1e4)
    });
    let knots: Vec<String> = knots.collect();
    Some(knots.join(", "))
}

/// The digits of a number such as `12`; for `2.5` joined by `_`.
fn whole(number: &str) -> String {
    number
        .chars()
        .map(|c| if c.is_ascii_digit() { c } else { '_' })
        .collect()
}

fn level(tenths: Tenths) -> String {
    match tenths {
        0 => "out".to_owned(),
        FULL.. => "full".to_owned(),
        tenths if tenths % 10 == 0 => (tenths / 10).to_string(),
        tenths => format!("{}.{}", tenths / 10, tenths % 10),
    }
}

fn time(up: Time, down: Time) -> String {
    match up == down {
        true if up == Time::ZERO => "snap".to_owned(),
        true => format!("time {}", short(up)),
        false => format!("time {}/{}", short(up), short(down)),
    }
}

/// A time without its unit, where seconds are the default.
fn short(time: Time) -> String {
    let text = time.to_string();
    text.strip_suffix('s').unwrap_or(&text).to_owned()
}
