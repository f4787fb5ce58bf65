//! What may be typed next: the words of the verbs, of the language and of the show, for whoever
//! edits a line.
//!
//! A [`Vocabulary`] is a copy of the show's names, so that a line editor can hold it while the
//! interpreter goes on.

use std::collections::BTreeSet;

use super::Repl;
use super::verb::{self, Complete, VERBS, VerbSpec};
use crate::engine::Way;
use crate::lang::{self, codes};
use crate::plan::Metric;
use crate::show::FADES;

/// The names of a show.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary {
    banks: Vec<String>,
    groups: Vec<String>,
    looks: Vec<String>,
    lights: Vec<String>,
    curves: Vec<String>,
    views: Vec<String>,
    values: Vec<String>,
    cues: Vec<String>,
    materials: Vec<String>,
}

/// What a line may go on with.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    /// Where the word begins that is being typed, in bytes.
    pub start: usize,
    /// Whole words, in order; each begins with what is there.
    pub words: Vec<String>,
    /// The name of a file is wanted.
    pub files: bool,
}

impl Repl {
    /// The names of the show as it stands.
    pub fn vocabulary(&self) -> Vocabulary {
        let document = self.engine.document();
        let show = document.show();
        let texts = document.diagnostics().sources.texts();
        let values = texts.flat_map(lang::values).collect();
        let scene = document.setup().map(|setup| &setup.scene);
        let materials = scene.into_iter().flat_map(|scene| &scene.materials);
        Vocabulary {
            banks: show.banks.iter().map(|b| b.name.clone()).collect(),
            groups: show.groups.iter().map(|g| g.name.clone()).collect(),
            looks: show.looks.iter().map(|l| l.name.clone()).collect(),
            lights: show.lights.iter().map(|l| l.name.clone()).collect(),
            curves: show.curves.iter().map(|c| c.name.clone()).collect(),
            views: show.views.iter().map(|v| v.name.clone()).collect(),
            values,
            cues: show.cues.iter().map(|c| c.number.to_string()).collect(),
            materials: materials.map(|m| m.name.clone()).collect(),
        }
    }
}

/// Bytes of a line, before the cursor, that are looked at.
const LINE: usize = 4096;

/// What a line can go on with, before it is cut down to what begins as the word does; `None` where
/// the name of a file is wanted.
type Offer = Option<Vec<String>>;

fn offer<'w>(words: impl IntoIterator<Item = &'w str>) -> Offer {
    Some(words.into_iter().map(str::to_owned).collect())
}

impl Vocabulary {
    /// The materials of a stage and nothing else.
    #[cfg(test)]
    pub fn of_materials(materials: Vec<String>) -> Vocabulary {
        Vocabulary {
            materials,
            ..Vocabulary::default()
        }
    }

    /// What `line` may go on with at byte `at`.
    pub fn complete(&self, line: &str, at: usize) -> Completion {
        let typed = line.get(..at).unwrap_or(line);
        let typed = typed
            .get(typed.len().saturating_sub(LINE)..)
            .unwrap_or(typed);
        let offset = at.min(line.len()) - typed.len();
        let start = typed
            .rfind(|c: char| c.is_whitespace() || "(){},=+".contains(c))
            .map_or(0, |i| {
                i + typed
                    .get(i..)
                    .and_then(|t| t.chars().next())
                    .map_or(1, char::len_utf8)
            });
        let (before, word) = typed.split_at(start);
        let offer = self.offer(before, word);
        let units = match lang::is_declaration(typed) {
            true => units(word),
            false => Vec::new(),
        };
        let files = offer.is_none();
        let words: BTreeSet<String> = offer
            .into_iter()
            .flatten()
            .chain(units)
            .filter(|w| w.starts_with(word) && w != word)
            .collect();
        Completion {
            start: offset + start,
            words: words.into_iter().collect(),
            files,
        }
    }

    /// The usage of the verb that a line begins with, for what is not typed yet.
    pub fn hint(&self, line: &str) -> Option<String> {
        let name = line.strip_suffix(' ')?;
        let spec = VERBS.iter().find(|spec| spec.name == name)?;
        let usage = spec.usage();
        let rest = usage.strip_prefix(name)?.trim_start();
        (!rest.is_empty()).then(|| rest.to_owned())
    }

    fn offer(&self, before: &str, word: &str) -> Offer {
        let first = before.split_whitespace().next();
        match first {
            None => {
                let verbs = VERBS.iter().map(|spec| spec.name);
                offer(verbs.chain(lang::keywords().iter().copied()))
            }
            Some(first) => match verb::find(first) {
                Ok(spec) if !lang::is_declaration(&format!("{before}{word}")) => {
                    self.of_verb(spec, before, word)
                }
                _ => self.of_declaration(first, before),
            },
        }
    }

    fn of_verb(&self, spec: &'static VerbSpec, before: &str, word: &str) -> Offer {
        let mut tokens = before.split_whitespace();
        let last = tokens.next_back().filter(|token| token.starts_with('-'));
        let option = last.and_then(|last| spec.options.iter().find(|o| o.is_named_by(last)));
        if let Some((name, value)) = option.and_then(|o| Some((o.name, o.value?))) {
            return self.of_option(name, value);
        }
        if word.starts_with('-') {
            let options = spec.options.iter().map(|o| format!("--{}", o.name));
            return Some(options.collect());
        }
        match spec.complete {
            Complete::Nothing => Some(Vec::new()),
            Complete::Words(words) => offer(words.iter().copied()),
            Complete::Names => offer(self.names().chain(strings(&self.cues))),
            Complete::Views => offer(strings(&self.views)),
            Complete::Cues(words) => offer(strings(&self.cues).chain(words.iter().copied())),
            Complete::Verbs => offer(VERBS.iter().map(|spec| spec.name)),
            Complete::Codes => offer(codes::TABLE.iter().map(|row| row.code)),
            Complete::Movable(words) => offer(self.movable().chain(words.iter().copied())),
            Complete::Banks(words) => {
                let banks = strings(&self.banks).chain(strings(&self.groups));
                offer(banks.chain(words.iter().copied()))
            }
            Complete::Files => None,
        }
    }

    fn of_option(&self, name: &str, value: &str) -> Offer {
        match (name, value) {
            ("bank", _) => offer(strings(&self.banks)),
            ("view", _) => offer(strings(&self.views)),
            ("metric", _) => offer(Metric::ALL.map(Metric::name)),
            ("way", _) => offer(Way::ALL.map(Way::name)),
            (_, "FILE" | "DIR") => None,
            _ => Some(Vec::new()),
        }
    }

    fn of_declaration(&self, first: &str, before: &str) -> Offer {
        let last = before.split_whitespace().next_back().unwrap_or_default();
        let open =
            |opening, closing| before.matches(opening).count() > before.matches(closing).count();
        if open('(', ')') {
            return offer(strings(&self.values).chain(["full", "out"]));
        }
        match (first, last) {
            (_, "dimmer") => offer(strings(&self.curves).chain(["linear", "square"])),
            ("cue", "curve") => {
                offer(strings(&self.curves).chain(FADES.iter().map(|fade| fade.name)))
            }
            ("light", "like") => offer(strings(&self.lights)),
            ("light", "panel") | ("surface", "surface") => offer(strings(&self.materials)),
            ("bank" | "fixed", _) if before.contains('=') => {
                offer(strings(&self.lights).chain(["channel", "dimmer", "rgb", "level"]))
            }
            ("group", _) if before.contains('=') => offer(strings(&self.banks)),
            ("cue" | "look", _) if open('{', '}') || before.contains('=') => {
                offer(self.movable().chain(lang::words()))
            }
            (_, last) if last == first => offer(self.names()),
            _ => offer(lang::words()),
        }
    }

    /// What a cue can move.
    fn movable(&self) -> impl Iterator<Item = &str> {
        strings(&self.banks)
            .chain(strings(&self.groups))
            .chain(strings(&self.looks))
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.movable()
            .chain(strings(&self.lights))
            .chain(strings(&self.curves))
            .chain(strings(&self.views))
            .chain(strings(&self.values))
    }
}

fn strings(names: &[String]) -> impl Iterator<Item = &str> {
    names.iter().map(String::as_str)
}

/// A number that goes on with a unit.
fn units(word: &str) -> Vec<String> {
    let end = word.find(|c: char| !(c.is_ascii_digit() || c == '.'));
    let digits = word.get(..end.unwrap_or(word.len())).unwrap_or_default();
    if digits.is_empty() {
        return Vec::new();
    }
    let units = ["s", "ms", "m", "cm", "ft", "in", "deg", "%"];
    units.map(|unit| format!("{digits}{unit}")).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vocabulary() -> Vocabulary {
        let own = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        Vocabulary {
            banks: own(&["lamps", "late"]),
            groups: own(&["warm"]),
            looks: own(&["night"]),
            lights: own(&["lamp1", "moon"]),
            curves: own(&["dawn"]),
            views: own(&["stalls"]),
            values: own(&["slow"]),
            cues: own(&["1", "12"]),
            materials: own(&["boards"]),
        }
    }

    #[track_caller]
    fn offers(line: &str, words: &[&str]) {
        let found = vocabulary().complete(line, line.len());
        assert_eq!(found.words, words, "{line}");
    }

    #[test]
    fn words_are_offered_where_they_may_stand() {
        offers("pla", &["plan", "play"]);
        offers("pict", &["picture"]);
        offers("vi", &["view"]);
        offers("view s", &["stalls"]);
        offers("goto 1", &["12"]);
        offers("cue 3 { time 5m", &["5ms"]);
        offers("help pi", &["picture"]);
        offers(
            "explain E01",
            &["E010", "E011", "E012", "E013", "E014", "E015", "E016"],
        );
        offers("picture --ba", &["--bank"]);
        offers("picture --bank la", &["lamps", "late"]);
        offers("cue 3 { la", &["lamps", "late", "layer"]);
        offers("cue 3 { lamps 5 curve d", &["dawn"]);
        offers("cue 3 { time (sl", &["slow"]);
        offers("bank x = m", &["moon"]);
        offers("light k like la", &["lamp1"]);
        offers("light k panel bo", &["boards"]);
        offers("set wa", &["warm"]);
        offers("plot la", &["lamps", "late"]);
        offers("plot sp", &["spectrum"]);
        assert!(vocabulary().complete("picture -o ", 11).files);
        assert!(vocabulary().complete("save ", 5).files);
        assert_eq!(vocabulary().complete("bank é = m", 11).start, 10);
    }

    #[test]
    fn a_verb_hints_at_its_usage() {
        let found = vocabulary();
        assert_eq!(found.hint("goto ").as_deref(), Some("CUE [at PART%]"));
        assert_eq!(found.hint("goto"), None);
        assert_eq!(found.hint("go "), None);
    }
}
