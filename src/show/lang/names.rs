//! The table of names: one kind each, looked up with a suggestion of the nearest.
//!
//! Invariants: names are case sensitive; order of declaration does not matter. Material names
//! belong to the stage and are not in this table.

use std::collections::{BTreeMap, BTreeSet};

use super::ast::{Span, Word};
use super::codes;
use crate::diagnostic::Diagnostic;
use crate::model::Fade;

/// Kind of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A camera.
    View,
    /// A luminaire.
    Light,
    /// A point where heads can aim.
    Point,
    /// Lights that vary in unison.
    Bank,
    /// Lights that never vary.
    Fixed,
    /// A selection of banks.
    Group,
    /// A set of levels.
    Look,
    /// A fade or dimmer curve.
    Curve,
    /// A variation on top of a level.
    Effect,
    /// A quantity or a colour.
    Value,
}

impl Kind {
    /// All kinds: the statement word that declares each, and its phrase with an article.
    const TABLE: [(Kind, &'static str, &'static str); 10] = [
        (Kind::View, "view", "a view"),
        (Kind::Light, "light", "a light"),
        (Kind::Point, "point", "a point"),
        (Kind::Bank, "bank", "a bank"),
        (Kind::Fixed, "fixed", "a `fixed`"),
        (Kind::Group, "group", "a group"),
        (Kind::Look, "look", "a look"),
        (Kind::Curve, "curve", "a curve"),
        (Kind::Effect, "effect", "an effect"),
        (Kind::Value, "let", "a value"),
    ];

    /// The kind's phrase, with an article.
    pub fn phrase(self) -> &'static str {
        let mut rows = Kind::TABLE.into_iter();
        rows.find(|row| row.0 == self).map_or("", |row| row.2)
    }

    /// The kind that a statement word declares.
    pub fn of_statement(word: &str) -> Option<Kind> {
        let mut rows = Kind::TABLE.into_iter();
        rows.find(|row| row.1 == word).map(|row| row.0)
    }
}

/// A declared name.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Its kind.
    pub kind: Kind,
    /// Its index; `None` when its declaration is broken, so that uses are not reported.
    pub index: Option<usize>,
    /// The declaration.
    pub span: Span,
}

/// All names of a show.
#[derive(Debug, Default)]
pub struct Names<'a> {
    table: BTreeMap<&'a str, Entry>,
    /// Kinds declared under a name already in use.
    refused: BTreeSet<(&'a str, Kind)>,
}

impl<'a> Names<'a> {
    /// Declares a name. If the name is in use, the earlier entry stays and is returned.
    pub fn declare(&mut self, name: Word<'a>, kind: Kind, index: Option<usize>) -> Option<Entry> {
        if let Some(earlier) = self.get(name.text) {
            self.refused.insert((name.text, kind));
            return Some(earlier);
        }
        let span = name.span;
        let entry = Entry { kind, index, span };
        self.table.insert(name.text, entry);
        None
    }

    /// Looks a name up.
    pub fn get(&self, name: &str) -> Option<Entry> {
        self.table.get(name).copied()
    }

    /// True when one of these kinds was declared under a name already in use: uses are then not
    /// reported.
    pub fn is_refused(&self, name: &str, kinds: &[Kind]) -> bool {
        kinds
            .iter()
            .any(|kind| self.refused.contains(&(name, *kind)))
    }

    /// The declared names of some kinds, in order.
    pub fn of<'s>(&'s self, kinds: &'s [Kind]) -> impl Iterator<Item = &'a str> + 's {
        let wanted = self.table.iter().filter(|(_, e)| kinds.contains(&e.kind));
        wanted.map(|(name, _)| *name)
    }
}

/// Units that may follow their number after a blank. A name spelt like them would be read as a
/// unit: `key 40 K 30`.
pub const STANDING_OFF: [&str; 3] = ["K", "cd", "lm"];

/// True for a letter or two and a number: `L201`, `R80`.
pub fn is_gel(word: &str) -> bool {
    let digits = word.trim_start_matches(|c: char| c.is_ascii_alphabetic());
    (1..=2).contains(&(word.len() - digits.len()))
        && !digits.is_empty()
        && digits.chars().all(|c| c.is_ascii_digit())
}

/// The word of this language for a word of other consoles or of plain English.
pub fn foreign(word: &str) -> Option<&'static str> {
    Some(match word {
        "in" | "over" | "during" | "within" | "for" | "fade" => {
            "how long a move takes is its `time`: `lamps 85 time 5`"
        }
        "wait" | "after" => "a wait before a move is its `delay`: `lamps 85 delay 2`",
        "sec" | "secs" | "second" | "seconds" => "a time is written `5` or `5s`",
        "min" | "mins" | "minute" | "minutes" => "minutes are written `2:00`",
        "percent" | "pct" => "a level is written `85` or `85%`",
        "off" | "black" => "a bank goes `out`; everything out is `blackout`",
        "on" => "a bank goes to `full`, or to a level: `lamps 85`",
        "all" | "everything" => "a `group` names several banks; everything out is `blackout`",
        "thru" | "through" => "several banks have one name as a group: `group warm = lamps wash`",
        "link" | "autofollow" | "auto" => {
            "what starts the next cue stands in this one: `follow 5` after its GO, `hang 2` after its end"
        }
        "restore" | "return" => {
            "a blackout with `cueonly` goes back by itself in the next cue: `cue 10 { snap  blackout  cueonly }`"
        }
        "gobo" => {
            "an image in a lamp is a projection, and with `moves` a moving head: \
             `light leaves project \"leaves.png\"  from 0, -3, 6  aim 0, 0, 1  field 25  12000 cd  moves`"
        }
        "chan" | "ch" => "a bank is moved by its name: `lamps 50`; the cue sheet has no channels",
        "then" | "and" => "what a cue does stands side by side, a line each reads best",
        _ => return None,
    })
}

/// True for words that mean something where names stand, so that they cannot be names.
pub fn is_reserved(word: &str) -> bool {
    const WORDS: [&str; 28] = [
        "assert", "at", "blackout", "block", "channel", "cueonly", "curve", "delay", "dimmer",
        "down", "follow", "full", "gel", "hang", "level", "note", "out", "part", "project",
        "repeat", "rgb", "snap", "spline", "spread", "steps", "time", "to", "up",
    ];
    WORDS.contains(&word)
        || STANDING_OFF.contains(&word)
        || Fade::built_in(word).is_some()
        || super::scan::STATEMENTS.contains(&word)
}

/// The error for a name that [`is_reserved`], without its place.
pub fn reserved(name: &str) -> Diagnostic {
    let what = if STANDING_OFF.contains(&name) {
        "a unit, which may stand off from its number,"
    } else {
        "a word of the language"
    };
    let message = format!("`{name}` is {what} and cannot be a name");
    let help = format!("choose another, such as `{name}_1`");
    Diagnostic::error(codes::RESERVED, message).help(help)
}

/// The candidate nearest to `word` by edit distance, if there is at most one error in three
/// characters. The first wins among equals.
pub fn nearest<'c>(word: &str, candidates: impl Iterator<Item = &'c str>) -> Option<&'c str> {
    let length = word.chars().take(LONGEST + 1).count();
    if length > LONGEST {
        return None;
    }
    let limit = (length / 3).max(1);
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates.take(CANDIDATES) {
        if candidate.len() > 4 * LONGEST || candidate == word {
            continue;
        }
        if candidate.chars().count().abs_diff(length) > limit {
            continue;
        }
        // Optimal string alignment: swapping two neighbours is one error.
        let distance = strsim::osa_distance(word, candidate);
        if distance <= limit && distance < length && best.is_none_or(|(d, _)| distance < d) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, name)| name)
}

/// Most names compared: a suggestion is not worth seconds.
const CANDIDATES: usize = 10_000;

/// Longest word that gets a suggestion.
const LONGEST: usize = 40;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_far_ones_are_not() {
        let names = ["lamps", "windows", "sky", "fire"];
        let near = |word| nearest(word, names.into_iter());
        assert_eq!(near("lmaps"), Some("lamps"));
        assert_eq!(near("lamp"), Some("lamps"));
        assert_eq!(near("window"), Some("windows"));
        assert_eq!(near("fier"), Some("fire"));
        assert_eq!(near("moon"), None);
        assert_eq!(near("x"), None);
    }
}
