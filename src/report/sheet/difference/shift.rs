//! Cues whose times moved alike, in one line.

use super::ShowChange;
use crate::sheet::level::{clock, number};
use footlight_show::units::Time;

/// Cues in a row whose clock time, or whose GO, moved by the same time, which one line says.
#[derive(Default)]
pub(super) struct Shifts {
    /// What moved: `at` or `GO`.
    word: &'static str,
    /// One line says cues that moved in the same direction, though by different times.
    is_loose: bool,
    moved: Time,
    /// The least and the largest move of the line, in seconds.
    range: [f64; 2],
    first: String,
    /// Where the line stands.
    line: usize,
}

impl Shifts {
    /// No cue yet. `word` says what moves, and a loose line takes moves by different times.
    pub fn of(word: &'static str, is_loose: bool) -> Shifts {
        Shifts {
            word,
            is_loose,
            ..Shifts::default()
        }
    }

    /// Adds the line of a cue that moved, or lets the line before say it too.
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

/// Seconds of a move in time, and its direction.
fn shift(moved: Time) -> (f64, &'static str) {
    let way = if moved.micros() > 0 {
        "later"
    } else {
        "earlier"
    };
    (moved.seconds().abs(), way)
}
