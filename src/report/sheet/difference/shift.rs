//! One line for cues whose times moved alike.

use super::ShowChange;
use crate::sheet::level::{clock, number};
use footlight_show::units::Time;

/// Consecutive cues whose clock time, or GO, moved by one amount, reported in one line.
#[derive(Default)]
pub(super) struct Shifts {
    /// The time that moved: `at` or `GO`.
    word: &'static str,
    /// True when one line covers moves in one direction by different times.
    is_loose: bool,
    moved: Time,
    /// The least and the largest move in the line, seconds.
    range: [f64; 2],
    first: String,
    /// Index of the line.
    line: usize,
}

impl Shifts {
    /// Starts without cues. `word` names the time that moves; a loose line covers moves by
    /// different times.
    pub fn of(word: &'static str, is_loose: bool) -> Shifts {
        Shifts {
            word,
            is_loose,
            ..Shifts::default()
        }
    }

    /// Adds the line of a cue that moved, or extends the line before.
    pub fn add(&mut self, what: &str, (was, now): (Time, Time), out: &mut Vec<ShowChange>) {
        let moved = now - was;
        let way_of = |moved: Time| shift(moved).1;
        let is_alike = moved == self.moved || self.is_loose && way_of(moved) == way_of(self.moved);
        let same = !self.first.is_empty() && is_alike;
        self.moved = moved;
        if moved == Time::ZERO {
            self.first.clear();
            return;
        }
        let word = self.word;
        let number_of = |what: &str| what.strip_prefix("cue ").unwrap_or(what).to_owned();
        let (seconds, way) = shift(moved);
        match out.get_mut(self.line).filter(|_| same) {
            Some(line) => {
                let [least, most] = self.range;
                self.range = [least.min(seconds), most.max(seconds)];
                let [least, most] = self.range.map(number);
                let by = if least == most {
                    most
                } else {
                    format!("{least} to {most}")
                };
                line.what = format!("cues {} to {}", self.first, number_of(what));
                line.how = format!("{word} {by} s {way}");
            }
            None => {
                let by = number(seconds);
                self.range = [seconds; 2];
                self.first = number_of(what);
                self.line = out.len();
                out.push(ShowChange {
                    what: what.to_owned(),
                    how: format!("{word} {} -> {} ({by} s {way})", clock(was), clock(now)),
                });
            }
        }
    }
}

/// Seconds and direction of a move in time.
fn shift(moved: Time) -> (f64, &'static str) {
    let way = if moved.micros() > 0 {
        "later"
    } else {
        "earlier"
    };
    (moved.seconds().abs(), way)
}
