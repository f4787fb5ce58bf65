//! The cheapest steps of quality, number of refined pictures and format of keys that are good
//! enough.

use std::fmt::Write as _;

use super::words::{self, count, percent};
use crate::engine::measure::tuner::{Candidate, Tuned};

/// Rows of better choices that are listed beyond the chosen one.
const BEYOND: usize = 3;

/// A choice in words: `coarse 1, refined 3, 4 refined pictures`.
pub fn choice(choice: &Candidate) -> String {
    match choice.refined {
        Some(refined) => format!(
            "coarse {}, refined {refined}, {}",
            choice.coarse,
            count(choice.pictures, "refined picture")
        ),
        None => format!("coarse {}, nothing refined", choice.coarse),
    }
}

/// What each step takes, the choices, the formats of keys, and what to type.
pub fn describe(tuned: &Tuned) -> String {
    let mut text = format!(
        "every source at quality 1 to {}, the last for the truth; {}\n",
        tuned.reference,
        words::machine(&tuned.machine)
    );
    describe_steps(&mut text, tuned);
    describe_choices(&mut text, tuned);
    describe_keys(&mut text, tuned);
    let _ = writeln!(
        text,
        "to have the chosen pair, type or put into the show, with --way paper:\n  {}",
        tuned.preview
    );
    match tuned.choice.pictures {
        0 => text.push_str("and refine nothing: run --count 0\n"),
        n => {
            let _ = writeln!(text, "and refine as many: run --count {n}");
        }
    }
    text
}

fn describe_steps(text: &mut String, tuned: &Tuned) {
    let _ = writeln!(
        text,
        "  step  all sources  one more  if all is shown so, the worst moment is off by"
    );
    for step in &tuned.steps {
        let whole = tuned.steps.len() == usize::from(step.quality);
        let error = match whole {
            true => "-".to_owned(),
            false => format!("{} %", percent(step.error)),
        };
        let _ = writeln!(
            text,
            "  {:>4}  {:>9.2} s  {:>6.3} s  {error:>9}{}",
            step.quality,
            step.fixed + step.picture * tuned.sources as f64,
            step.picture,
            if step.measured {
                ""
            } else {
                "  (pictures found, seconds predicted)"
            }
        );
    }
}

fn describe_choices(text: &mut String, tuned: &Tuned) {
    let _ = writeln!(
        text,
        "  choices, the quickest first; coarse 1 shows step 2 and renders 1 too, for the estimate"
    );
    let chosen = tuned.choices.iter().position(|c| *c == tuned.choice);
    let shown = chosen.map_or(tuned.choices.len(), |at| at + 1 + BEYOND);
    for choice in tuned.choices.iter().take(shown) {
        let mark = if *choice == tuned.choice {
            "  <- chosen"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "  {:>9.2} s  off by {:>6} %  {}{mark}",
            choice.seconds,
            percent(choice.error),
            self::choice(choice)
        );
    }
}

fn describe_keys(text: &mut String, tuned: &Tuned) {
    let _ = writeln!(text, "  keys      MB  off at most, steps of 8 bits");
    for format in &tuned.keys {
        let mark = if format.chosen { "  <- chosen" } else { "" };
        let _ = writeln!(
            text,
            "  {:<5} {:>6.1}  {:>6.3}{mark}",
            format.name,
            format.bytes as f64 / 1e6,
            format.error
        );
    }
}
