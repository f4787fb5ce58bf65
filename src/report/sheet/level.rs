//! Levels of banks in a designer's words.

use crate::show::{Bank, Motion, Move, Show};
use crate::units::{Rgb, Time, percent};

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

/// A bank's level: a number of percent, or the colour of an rgb bank.
pub fn level(bank: &Bank, levels: &[f64]) -> String {
    match levels {
        [r, g, b] if bank.rgb => {
            let coded = Rgb([*r, *g, *b]).to_srgb8();
            let [r, g, b] = coded;
            format!("#{r:02x}{g:02x}{b:02x}")
        }
        [level, ..] => number(percent(*level)),
        [] => String::new(),
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
    let first = first_coordinates(show);
    let mut out: Vec<(usize, Vec<&Move>)> = Vec::new();
    for one in moves {
        let after = first.partition_point(|first| *first <= one.coordinate);
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

/// What the moves of one bank do, in words: `lamps 85`, `sky #203060`, `fire along 4 knots in 8 s
/// to 14`.
pub fn motion(bank: &Bank, first: usize, moves: &[&Move]) -> String {
    let whole = !bank.rgb || moves.len() == 3;
    if !whole {
        let each = moves.iter().map(|m| {
            let channel = match m.coordinate.saturating_sub(first) {
                0 => "r",
                1 => "g",
                _ => "b",
            };
            let name = format!("{}.{channel}", bank.name);
            one(&name, &number(percent(m.motion.target())), m)
        });
        return each.collect::<Vec<_>>().join(", ");
    }
    let levels: Vec<f64> = moves.iter().map(|m| m.motion.target()).collect();
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
