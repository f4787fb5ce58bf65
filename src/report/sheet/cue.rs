//! The cue sheet: the actions of each cue, in the order of the show.

use super::level::{self, Done, by_bank, by_group, clock, group_of, motion, time};
use super::pose::aims;
use crate::table::Table;
use footlight_show::model::{Cue, EffectChange, Fade, Link, Part, Show, Trigger};
use footlight_show::timeline::{CueTime, Timeline};

/// The cue sheet of a show: a row for each cue, and one for each further part.
pub fn cue_sheet(show: &Show, timeline: &Timeline) -> Table {
    let columns = [
        "cue", "label", "starts", "up/down", "delay", "curve", "does", "then", "complete", "note",
    ];
    // Most shows have no notes.
    let noted = show.cues.iter().any(|cue| !cue.note.is_empty());
    let columns = columns.iter().take(if noted { 10 } else { 9 });
    let legend = "Times before GO in brackets are assumed: the cue waits for the operator.";
    let mut table = Table::new(columns.map(|c| (*c).to_owned()).collect(), legend);
    let mut before = None;
    for (cue, at) in show.cues.iter().zip(timeline.cues()) {
        for (i, mut row) in cue_rows(show, cue, at, before).into_iter().enumerate() {
            if noted {
                row.push(if i == 0 {
                    cue.note.clone()
                } else {
                    String::new()
                });
            }
            table.push(row);
        }
        before = Some(cue);
    }
    table
}

fn cue_rows(show: &Show, cue: &Cue, at: &CueTime, before: Option<&Cue>) -> Vec<Vec<String>> {
    let blank = Part {
        id: cue.id,
        number: 1,
        written: true,
        label: String::new(),
        delay: footlight_show::units::Time::ZERO,
        up: footlight_show::units::Time::ZERO,
        down: footlight_show::units::Time::ZERO,
        by_default: [false; 2],
        curve: Fade::LINEAR,
        moves: Vec::new(),
        effects: Vec::new(),
    };
    let parts = || {
        cue.parts
            .iter()
            .filter(|p| !(p.moves.is_empty() && p.effects.is_empty()))
    };
    let first = parts().next().or(cue.parts.first()).unwrap_or(&blank);
    let mut rows = Vec::new();
    for (i, part) in std::iter::once(first).chain(parts().skip(1)).enumerate() {
        let head = i == 0;
        let only = |text: String| if head { text } else { String::new() };
        let number = if !part.written && !head {
            // A move with its own timing, not written as a part.
            String::new()
        } else if part.written && part.number > 1 {
            format!("{} part {}", cue.number, part.number)
        } else {
            cue.number.to_string()
        };
        let label = match (head, part.label.is_empty()) {
            (true, true) => cue.label.clone(),
            (true, false) => format!("{}: {}", cue.label, part.label),
            (false, _) => part.label.clone(),
        };
        rows.push(vec![
            number,
            label,
            only(starts(cue, at, before)),
            up_down(part),
            if part.delay.micros() == 0 {
                String::new()
            } else {
                time(part.delay)
            },
            fade(show, part),
            does(show, cue, part, head),
            only(
                cue.link
                    .map_or_else(String::new, |(_, link)| level::link(link)),
            ),
            only(clock(at.completion)),
        ]);
    }
    rows
}

fn starts(cue: &Cue, at: &CueTime, before: Option<&Cue>) -> String {
    let go = clock(at.go);
    match (cue.trigger, before.and_then(|b| b.link)) {
        (Trigger::At(_), _) => go,
        (Trigger::Go, Some((_, Link::Follow(_) | Link::Hang(_)))) => format!("by itself {go}"),
        (Trigger::Go, None) if at.assumed => format!("GO ({go})"),
        (Trigger::Go, None) => format!("GO {go}"),
    }
}

/// True when a part fades something; paths have their own times.
pub fn fades(part: &Part) -> bool {
    let fade =
        |m: &footlight_show::model::Move| matches!(m.motion, footlight_show::model::Motion::To(_));
    part.moves.is_empty() || part.moves.iter().any(fade)
}

fn up_down(part: &Part) -> String {
    if !fades(part) {
        return String::new();
    }
    level::up_down(part)
}

/// Name of the fade curve, if anything fades along another than a straight line.
fn fade(show: &Show, part: &Part) -> String {
    match part.curve {
        curve if curve != Fade::LINEAR && fades(part) => curve.name(show).to_owned(),
        _ => String::new(),
    }
}

fn does(show: &Show, cue: &Cue, part: &Part, head: bool) -> String {
    let first = show.first_parameters();
    let mut words: Vec<String> = Vec::new();
    if head {
        let flags = [
            (cue.block, "block"),
            (cue.assert, "assert"),
            (cue.cueonly, "cueonly"),
        ];
        words.extend(flags.iter().filter(|f| f.0).map(|f| f.1.to_owned()));
    }
    let moves = by_bank(show, &part.moves).into_iter();
    let moved = moves.filter_map(|(bank, moves)| {
        let of = show.banks.get(bank)?;
        let text = motion(of, *first.get(bank)?, &moves);
        let words = text.strip_prefix(&format!("{} ", of.name));
        Some(Done {
            bank,
            statement: moves.first().map(|one| one.id),
            words: words.map(str::to_owned),
            text,
        })
    });
    words.extend(by_group(show, moved.collect()));
    words.extend(aims(show, &part.moves));
    // One entry for all banks of a group that get an effect by one move.
    for alike in part.effects.chunk_by(|a, b| a.id == b.id) {
        let effect = alike
            .first()
            .map_or_else(String::new, |change| effect(show, change));
        let banks: Vec<usize> = alike.iter().map(|change| change.bank).collect();
        let names = match group_of(show, &banks) {
            Some(group) => group.to_owned(),
            None => {
                let banks = banks.iter().filter_map(|bank| show.banks.get(*bank));
                let names: Vec<&str> = banks.map(|bank| bank.name.as_str()).collect();
                names.join(" ")
            }
        };
        words.push(format!("{names} effect {effect}"));
    }
    words.join(", ")
}

/// Name of a bank's new effect, `none` for an end: `wave spread`.
pub fn effect(show: &Show, change: &EffectChange) -> String {
    let effect = change.effect.and_then(|e| show.effects.get(e));
    let name = effect.map_or("none", |e| e.name.as_str());
    let spread = if change.spread.is_some() {
        " spread"
    } else {
        ""
    };
    format!("{name}{spread}")
}
