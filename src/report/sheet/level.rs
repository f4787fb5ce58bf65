//! Levels of banks in a designer's words.

use std::collections::BTreeMap;

use footlight_show::model::{Bank, Link, Motion, Move, NodeId, Part, Show};
use footlight_show::printable::trimmed;
use footlight_show::units::{Rgb, Time, percent};

/// A number with at most two decimals, none that are zero.
pub fn number(value: f64) -> String {
    trimmed(&format!("{value:.2}"))
}

/// A time in the form of a cue sheet: seconds below a minute, a clock above.
pub fn time(time: Time) -> String {
    if time.micros().abs() < 60_000_000 {
        number(time.seconds())
    } else {
        clock(time)
    }
}

/// The times of a part's fades: `6`, or up and down, `6/9`.
pub fn up_down(part: &Part) -> String {
    match (time(part.up), time(part.down)) {
        (up, down) if up == down => up,
        (up, down) => format!("{up}/{down}"),
    }
}

/// The link to the next cue: `follow 4`.
pub fn link(link: Link) -> String {
    match link {
        Link::Follow(after) => format!("follow {}", time(after)),
        Link::Hang(after) => format!("hang {}", time(after)),
    }
}

/// A time of the sequence as a clock: `0:04`, `1:02:03.5`.
pub fn clock(time: Time) -> String {
    let text = time.to_string();
    let Some(seconds) = text.strip_suffix('s') else {
        return text;
    };
    let (sign, digits) = match seconds.strip_prefix('-') {
        Some(digits) => ("-", digits),
        None => ("", seconds),
    };
    let one_digit = digits
        .split('.')
        .next()
        .is_some_and(|whole| whole.len() == 1);
    let zero = if one_digit { "0" } else { "" };
    format!("{sign}0:{zero}{digits}")
}

/// Light of three emitters as an sRGB-coded colour.
pub fn hex(emitters: &[f64]) -> String {
    let mut light = [0.0; 3];
    for (slot, emitter) in light.iter_mut().zip(emitters) {
        *slot = *emitter;
    }
    let [r, g, b] = Rgb(light).to_srgb8();
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A bank's level in percent, with its colour for an rgb bank: white is left out, and so is full
/// before another colour.
pub fn level(levels: &[f64]) -> String {
    let Some((level, colour)) = levels.split_first() else {
        return String::new();
    };
    let percent = number(percent(*level));
    if *level == 0.0 || colour.iter().all(|emitter| *emitter == 1.0) {
        return percent;
    }
    if *level == 1.0 {
        hex(colour)
    } else {
        format!("{percent} {}", hex(colour))
    }
}

/// The moves of a part, grouped by bank.
pub fn by_bank<'s>(show: &'s Show, moves: &'s [Move]) -> Vec<(usize, Vec<&'s Move>)> {
    let first = show.first_parameters();
    let mut out: Vec<(usize, Vec<&Move>)> = Vec::new();
    for one in moves {
        let after = first.partition_point(|first| *first <= one.parameter);
        let bank = after.checked_sub(1).filter(|b| *b < show.banks.len());
        let Some(bank) = bank else {
            continue;
        };
        match out.last_mut() {
            Some((last, moves)) if *last == bank => moves.push(one),
            _ => out.push((bank, vec![one])),
        }
    }
    out
}

/// Action of a part on one bank.
pub struct Done {
    /// The bank.
    pub bank: usize,
    /// The move that states it; `None` groups banks whatever move states it.
    pub statement: Option<NodeId>,
    /// The words behind the bank's name, when they are of the whole bank.
    pub words: Option<String>,
    /// The whole text.
    pub text: String,
}

/// The texts of actions. Banks of a group that do the same become one text with the group's name,
/// and all banks that go out one `blackout`.
pub fn by_group(show: &Show, done: Vec<Done>) -> Vec<String> {
    let key = |one: &Done| (one.statement, one.words.clone());
    let mut alike: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for one in &done {
        alike.entry(key(one)).or_default().push(one.bank);
    }
    let of_first = |(key, banks): ((_, Option<String>), Vec<usize>)| {
        let words = key.1.as_deref()?;
        let all = banks.len() > 1 && banks.len() == show.banks.len();
        let text = match group_of(show, &banks) {
            Some(group) => format!("{group} {words}"),
            None if all && words == "0" => "blackout".to_owned(),
            None => return None,
        };
        Some((key, (*banks.first()?, text)))
    };
    let joined: BTreeMap<_, _> = alike.into_iter().filter_map(of_first).collect();
    let text = |one: Done| match joined.get(&key(&one)) {
        Some((first, text)) => (*first == one.bank).then(|| text.clone()),
        None => Some(one.text),
    };
    done.into_iter().filter_map(text).collect()
}

/// Name of the group with exactly these banks, at least two.
pub fn group_of<'s>(show: &'s Show, banks: &[usize]) -> Option<&'s str> {
    let sorted = |banks: &[usize]| {
        let mut banks = banks.to_vec();
        banks.sort_unstable();
        banks
    };
    let banks = Some(sorted(banks)).filter(|banks| banks.len() > 1)?;
    let mut alike = show.groups.iter().filter(|g| g.banks.len() == banks.len());
    let found = alike.find(|group| sorted(&group.banks) == banks);
    found.map(|group| group.name.as_str())
}

/// Describes the moves of one bank: `lamps 85`, `sky 60 #203060`, `fire along 4 knots in 8 s to
/// 14`.
pub fn motion(bank: &Bank, first: usize, moves: &[&Move]) -> String {
    let level = moves.iter().find(|m| m.parameter == first);
    let colour: Vec<&Move> = moves
        .iter()
        .filter(|m| m.parameter > first)
        .copied()
        .collect();
    let mut said = Vec::new();
    if let Some(level) = level {
        said.push((
            *level,
            bank.name.clone(),
            number(percent(level.motion.target())),
        ));
    }
    match colour.as_slice() {
        [red, _, _] => {
            let light: Vec<f64> = colour.iter().map(|m| m.motion.target()).collect();
            said.push((red, bank.name.clone(), hex(&light)));
        }
        emitters => said.extend(emitters.iter().map(|m| {
            let channel = ["r", "g", "b"].get(m.parameter - first - 1).unwrap_or(&"b");
            let name = format!("{}.{channel}", bank.name);
            (*m, name, number(percent(m.motion.target())))
        })),
    }
    if let [(level, _, to), (red, _, colour)] = said.as_slice()
        && colour.starts_with('#')
        && let (Motion::To(_), Motion::To(_)) = (&level.motion, &red.motion)
        && level.repeat == red.repeat
    {
        return one(&bank.name, &format!("{to} {colour}"), level);
    }
    let said = said.iter().map(|(moved, name, to)| one(name, to, moved));
    said.collect::<Vec<_>>().join(", ")
}

fn one(name: &str, to: &str, moved: &Move) -> String {
    let times = match moved.repeat {
        0 | 1 => String::new(),
        n => format!(", {n} times"),
    };
    match &moved.motion {
        Motion::To(_) => format!("{name} {to}{times}"),
        Motion::Path(path) => {
            let last = path.knots.last().map_or(Time::ZERO, |k| k.time);
            let knots = path.knots.len();
            format!(
                "{name} along {knots} knots in {} to {to}{times}",
                time(last)
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_have_minutes() {
        for (micros, text) in [
            (0, "0:00"),
            (4_000_000, "0:04"),
            (9_500_000, "0:09.5"),
            (18_250_000, "0:18.25"),
            (-4_000_000, "-0:04"),
            (90_000_000, "1:30"),
            (3_723_500_000, "1:02:03.5"),
        ] {
            assert_eq!(clock(Time::from_micros(micros)), text);
        }
    }
}
