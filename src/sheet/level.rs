//! Levels of banks in a designer's words.

use crate::show::{Bank, Motion, Move, Show};
use crate::units::{Rgb, Time};

/// A number with at most two decimals, none that are zero.
pub fn number(value: f64) -> String {
    let rounded = format!("{value:.2}");
    let short = rounded.trim_end_matches('0').trim_end_matches('.');
    if short == "-0" {
        "0".to_owned()
    } else {
        short.to_owned()
    }
}

/// A time as a cue sheet has it: seconds below a minute, a clock above.
pub fn time(time: Time) -> String {
    if time.micros().abs() < 60_000_000 {
        number(time.seconds())
    } else {
        clock(time)
    }
}

/// A time of day of the sequence: `0:04`, `1:02:03.5`.
pub fn clock(time: Time) -> String {
    let sign = if time.micros() < 0 { "-" } else { "" };
    let micros = time.micros().unsigned_abs();
    let (seconds, fraction) = (micros / 1_000_000, micros % 1_000_000);
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    let mut out = if hours > 0 {
        format!("{sign}{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{sign}{minutes}:{seconds:02}")
    };
    if fraction > 0 {
        let digits = format!("{fraction:06}");
        out.push('.');
        out.push_str(digits.trim_end_matches('0'));
    }
    out
}

/// A bank's level: a number, or the colour of an rgb bank.
pub fn level(bank: &Bank, levels: &[f64]) -> String {
    match levels {
        [r, g, b] if bank.rgb => {
            let coded = Rgb([r / 100.0, g / 100.0, b / 100.0]).to_srgb8();
            let [r, g, b] = coded;
            format!("#{r:02x}{g:02x}{b:02x}")
        }
        [level, ..] => number(*level),
        [] => String::new(),
    }
}

/// The level a motion arrives at.
pub fn target(motion: &Motion) -> f64 {
    match motion {
        Motion::To(level) => *level,
        Motion::Path(path) => path.knots.last().map_or(0.0, |k| k.level),
    }
}

/// Where each bank's coordinates begin, and after the last bank their number without the fixed.
pub fn first_coordinates(show: &Show) -> Vec<usize> {
    let mut next = 0;
    let mut out = Vec::with_capacity(show.banks.len() + 1);
    for bank in &show.banks {
        out.push(next);
        next += if bank.rgb { 3 } else { 1 };
    }
    out.push(next);
    out
}

/// The moves of a part, those of one bank together: the bank and its moves.
pub fn by_bank<'s>(show: &'s Show, moves: &'s [Move]) -> Vec<(usize, Vec<&'s Move>)> {
    let coordinates = show.coordinates();
    let mut out: Vec<(usize, Vec<&Move>)> = Vec::new();
    for one in moves {
        let Some(bank) = coordinates.get(one.coordinate).and_then(|c| c.bank) else {
            continue;
        };
        match out.last_mut() {
            Some((last, moves)) if *last == bank => moves.push(one),
            _ => out.push((bank, vec![one])),
        }
    }
    out
}

/// What the moves of one bank do, in words: `lamps 85`, `sky #203060`, `fire along 4 knots in 8 s
/// to 14`.
pub fn motion(bank: &Bank, first: usize, moves: &[&Move]) -> String {
    let whole = !bank.rgb || moves.len() == 3;
    if !whole {
        let each = moves.iter().map(|m| {
            let channel = ["r", "g", "b"].get(m.coordinate.wrapping_sub(first));
            let name = format!("{}.{}", bank.name, channel.unwrap_or(&"?"));
            one(&name, &number(target(&m.motion)), m)
        });
        return each.collect::<Vec<_>>().join(", ");
    }
    let levels: Vec<f64> = moves.iter().map(|m| target(&m.motion)).collect();
    let to = level(bank, &levels);
    moves
        .first()
        .map_or_else(String::new, |m| one(&bank.name, &to, m))
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
