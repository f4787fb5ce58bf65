//! Completion: the words of the verbs, of the language and of the show, for the prompt and for
//! editors.
//!
//! A [`Vocabulary`] is a copy of the show's names, so that a line editor can hold it while the
//! interpreter works.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use clap::{Arg, Command, ValueHint};

use super::repl::Repl;
use super::usage;
use super::verb::verbs;
use footlight_engine::Document;
use footlight_show::lang::{self, codes};
use footlight_show::model::{FADES, HeadAxis, Show};

/// The names of a show.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary {
    /// Names by the word that declares them; values by `let`.
    declared: Vec<(&'static str, Vec<String>)>,
    cues: Vec<String>,
    /// The number for a cue after the last one.
    next_cue: Option<String>,
    materials: Vec<String>,
    gels: Vec<String>,
}

/// Completions of a line.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completion {
    /// Start of the current word, in bytes.
    pub start: usize,
    /// Whole words, in order, that begin with the current one.
    pub words: Vec<String>,
    /// True when a file name is expected.
    pub files: bool,
}

impl Repl {
    /// The names of the current show.
    pub fn vocabulary(&self) -> Vocabulary {
        Vocabulary::of(self.engine.document())
    }
}

impl Vocabulary {
    /// The names of a document's show.
    pub fn of(document: &Document) -> Vocabulary {
        let texts = || document.diagnostics().sources.texts();
        let scene = document.setup().map(|setup| &setup.scene);
        let materials = scene.map_or(&[][..], |scene| &scene.materials);
        Vocabulary {
            gels: texts().flat_map(lang::gels_of_table).collect(),
            ..Vocabulary::named(
                document.show(),
                texts().flat_map(lang::values).collect(),
                names(materials, |material| &material.name),
            )
        }
    }

    fn named(show: &Show, values: Vec<String>, materials: Vec<String>) -> Vocabulary {
        let heads = show.heads().into_iter();
        let heads = heads.filter_map(|(light, ..)| Some(show.lights.get(light)?.name.clone()));
        let last = show.cues.last();
        let next = last.map_or(1, |cue| cue.number.thousandths() / 1000 + 1);
        let points = show.points.iter().filter(|point| point.is_named());
        Vocabulary {
            declared: vec![
                ("bank", names(&show.banks, |bank| &bank.name)),
                ("group", names(&show.groups, |group| &group.name)),
                ("look", names(&show.looks, |look| &look.name)),
                ("light", names(&show.lights, |light| &light.name)),
                ("point", points.map(|point| point.name.clone()).collect()),
                ("head", heads.collect()),
                ("curve", names(&show.curves, |curve| &curve.name)),
                ("effect", names(&show.effects, |effect| &effect.name)),
                ("view", names(&show.views, |view| &view.name)),
                ("let", values),
            ],
            cues: show.cues.iter().map(|c| c.number.to_string()).collect(),
            next_cue: (next < 10_000).then(|| next.to_string()),
            materials,
            gels: Vec::new(),
        }
    }
}

fn names<T>(declared: &[T], name: impl Fn(&T) -> &String) -> Vec<String> {
    declared.iter().map(|one| name(one).clone()).collect()
}

/// Bytes before the cursor that are considered.
const LINE: usize = 4096;

/// Longest statement that gets completions, bytes: it is parsed for each word.
const STATEMENT: usize = 4 * LINE;

/// Completions; `None` when a file name is expected.
type Offer = Option<Vec<String>>;

fn offer<'w>(words: impl IntoIterator<Item = &'w str>) -> Offer {
    Some(words.into_iter().map(str::to_owned).collect())
}

impl Completion {
    fn of(start: usize, offer: Offer, word: &str) -> Completion {
        let files = offer.is_none();
        let offered = offer.into_iter().flatten();
        let words: BTreeSet<String> = offered
            .filter(|w| w.starts_with(word) && w != word)
            .collect();
        Completion {
            start,
            words: words.into_iter().collect(),
            files,
        }
    }
}

/// Start of the last word of a text.
fn word_start(typed: &str) -> usize {
    let ends_word = |c: char| c.is_whitespace() || "(){},=+".contains(c);
    let mut letters = typed.char_indices().rev();
    let end = letters.find(|(_, letter)| ends_word(*letter));
    end.map_or(0, |(at, letter)| at + letter.len_utf8())
}

impl Vocabulary {
    /// Completions at the end of a statement of a show's text; file names are not offered.
    pub fn complete_statement(&self, typed: &str) -> Completion {
        let start = word_start(typed);
        let (before, word) = typed.split_at(start);
        let offer = if before.trim().is_empty() {
            offer(lang::keywords().iter().copied())
        } else {
            Some(self.of_statement(before, word))
        };
        Completion::of(start, offer, word)
    }

    /// Completions of `line` at byte `at`.
    pub fn complete(&self, line: &str, at: usize) -> Completion {
        let typed = line.get(..at).unwrap_or(line);
        let typed = typed
            .get(typed.len().saturating_sub(LINE)..)
            .unwrap_or(typed);
        let offset = at.min(line.len()) - typed.len();
        let start = word_start(typed);
        let (before, word) = typed.split_at(start);
        let offer = self.offer(before, word);
        Completion::of(offset + start, offer, word)
    }

    /// The remaining usage of the verb that a line begins with.
    pub fn hint(&self, line: &str) -> Option<String> {
        let name = line.strip_suffix(' ')?;
        let usage = usage::of(verbs().find_subcommand(name)?);
        let rest = usage.strip_prefix(name)?.trim_start();
        (!rest.is_empty()).then(|| rest.to_owned())
    }

    fn offer(&self, before: &str, word: &str) -> Offer {
        let Some(first) = before.split_whitespace().next() else {
            let verbs = verbs().get_subcommands().map(Command::get_name);
            return offer(verbs.chain(lang::keywords().iter().copied()));
        };
        match verbs().find_subcommand(first) {
            Some(verb) if !lang::is_declaration(&format!("{before}{word}")) => {
                self.of_verb(verb, before, word)
            }
            _ => Some(self.of_statement(before, word)),
        }
    }

    fn of_verb(&self, verb: &Command, before: &str, word: &str) -> Offer {
        let tokens: Vec<&str> = before.split_whitespace().skip(1).collect();
        let options = || verb.get_arguments().filter(|arg| !arg.is_positional());
        let with_value = |token: &str| {
            options().find(|option| option.get_action().takes_values() && is_named(option, token))
        };
        if let Some(option) = tokens.last().and_then(|last| with_value(last)) {
            return self.of_argument(option, &usage::value(option), "");
        }
        if word.starts_with('-') {
            let names = options().filter_map(Arg::get_long);
            return Some(names.map(|name| format!("--{name}")).collect());
        }
        let mut typed = Vec::new();
        let mut rest = tokens.iter();
        while let Some(token) = rest.next() {
            if with_value(token).is_some() {
                rest.next();
            } else if !token.starts_with("--") {
                typed.push(*token);
            }
        }
        let mut offered = Vec::new();
        let arguments: Vec<&Arg> = verb.get_positionals().collect();
        let words: Vec<String> = arguments.iter().map(|arg| usage::words(arg)).collect();
        for next in usage::next(&words.join(" "), &typed) {
            if next == "LEVEL" {
                let levels = before.split_once(verb.get_name());
                return Some(self.of_levels(levels.map_or("", |(_, rest)| rest), word));
            }
            let last = typed.last().copied().unwrap_or_default();
            let named = |arg: &&&Arg| usage::words(arg).contains(next);
            let argument = arguments.iter().find(named)?;
            offered.extend(self.of_argument(argument, next, last)?);
        }
        Some(offered)
    }

    /// Completions for trial levels after others.
    fn of_levels(&self, levels: &str, word: &str) -> Vec<String> {
        let before = format!("look tried {{{levels}");
        let mut offered = self.of_statement(&before, word);
        // Looks may stand among trial levels.
        if let Some(beginning) = lang::Beginning::of(&before) {
            let looks = self.all(&["look"]).filter(|look| beginning.takes(look));
            offered.extend(looks.map(str::to_owned));
        }
        offered
    }

    /// Completions for a word of an argument's usage after `last`: the word itself, unless it is a
    /// placeholder.
    fn of_argument(&self, argument: &Arg, word: &str, last: &str) -> Offer {
        if let ValueHint::FilePath | ValueHint::DirPath | ValueHint::AnyPath =
            argument.get_value_hint()
        {
            return None;
        }
        if !word.contains(char::is_uppercase) {
            return offer([word]);
        }
        let known = argument.get_possible_values();
        match word {
            "FILE" => None,
            _ if !known.is_empty() => offer(known.iter().map(|known| known.get_name())),
            "WORD" => offer(lang::keywords().iter().copied()),
            "CUE" => offer(strings(&self.cues)),
            "N" if last == "cue" => offer(strings(&self.cues)),
            "NAME" => offer(self.names()),
            "BANK" if argument.is_positional() => offer(self.all(&["bank", "group"])),
            "BANK" => offer(self.all(&["bank"])),
            "HEAD" => offer(self.all(&["head"])),
            "VIEW" => offer(self.all(&["view"])),
            "VERB" => offer(verbs().get_subcommands().map(Command::get_name)),
            "CODE" => offer(codes::TABLE.iter().map(|row| row.code)),
            _ => offer([]),
        }
    }

    /// Kind of a name of the show.
    pub fn kind_of(&self, name: &str) -> Option<&'static str> {
        let more = [("material", &self.materials), ("gel", &self.gels)];
        let declared = self.declared.iter().map(|(word, names)| (*word, names));
        let mut kinds = declared.chain(more);
        let (kind, _) = kinds.find(|(_, names)| names.iter().any(|n| n == name))?;
        Some(if kind == "let" { "value" } else { kind })
    }

    /// Completions after the beginning of a statement: keywords, names of the expected kind, and
    /// numbers with the expected unit.
    fn of_statement(&self, before: &str, word: &str) -> Vec<String> {
        let short = (before.len() <= STATEMENT).then_some(before);
        let Some(beginning) = short.and_then(lang::Beginning::of) else {
            return Vec::new();
        };
        let begun = |offered: &&str| offered.starts_with(word);
        let has_level = self.ends_with_level(before);
        let still = before.trim_start().starts_with("cue") && self.declared_by("head").is_empty();
        let is_axis = |word: &str| HeadAxis::ALL.iter().any(|axis| axis.word() == word);
        let keywords = lang::words()
            .into_iter()
            .filter(begun)
            .filter(|k| !(has_level && LEVEL_WORDS.contains(k)))
            .filter(|k| !(still && is_axis(k)))
            .filter(|k| is_meant(before, k));
        let names = self.names_of(before).into_iter().filter(begun);
        let mut out: Vec<String> = keywords
            .filter(|k| beginning.takes_keyword(k))
            .chain(names.filter(|name| beginning.takes(name)))
            .map(str::to_owned)
            .collect();
        out.extend(units(before, word).filter(|number| beginning.takes(number)));
        if out.is_empty() && word.is_empty() && beginning.takes("{") {
            out.push("{".to_owned());
        }
        out
    }

    /// Names of the kind expected after the beginning of a statement.
    fn names_of(&self, before: &str) -> Vec<&str> {
        let mut words = before.split_whitespace();
        let first = words.next().unwrap_or_default();
        let last = words.next_back().unwrap_or(first);
        let is_list = before.contains('=');
        if before.matches('(').count() > before.matches(')').count() {
            return self
                .all(&["let"])
                .chain(LEVEL_WORDS.iter().copied())
                .collect();
        }
        let (own, more): (&[String], &[&str]) = match (first, last) {
            (_, "dimmer") => (self.declared_by("curve"), &["linear", "square"]),
            ("cue", "effect") => (self.declared_by("effect"), &["none"]),
            ("light", "lantern") => return LANTERNS.iter().map(String::as_str).collect(),
            ("light", "like") => (self.declared_by("light"), &[]),
            ("light", "panel") | ("surface", "surface") => (&self.materials, &[]),
            ("bank" | "fixed", _) if is_list => (self.declared_by("light"), &[]),
            ("group", _) if is_list => (self.declared_by("bank"), &[]),
            ("cue", "cue") => {
                return strings(&self.cues)
                    .chain(self.next_cue.as_deref())
                    .collect();
            }
            (_, "gel") => (&self.gels, &[]),
            ("let", "=") => (self.declared_by("let"), &LEVEL_WORDS),
            ("cue", "curve") => {
                let fades = FADES.iter().map(|fade| fade.name);
                return self.all(&["curve"]).chain(fades).collect();
            }
            ("cue", "to") => (self.declared_by("point"), &[]),
            ("cue", _) => return self.movable().chain(self.all(&["head"])).collect(),
            ("look", _) if before.matches('{').count() > before.matches('}').count() => {
                return self.all(&["bank", "group"]).collect();
            }
            ("look", _) if is_list => (self.declared_by("look"), &[]),
            (_, last) if last == first => (self.declared_by(first), &[]),
            _ => (&[], &[]),
        };
        strings(own).chain(more.iter().copied()).collect()
    }

    /// True when the text ends with a bank and its level. The grammar accepts a second value there,
    /// because it may be a colour.
    fn ends_with_level(&self, before: &str) -> bool {
        let mut words = before.split_whitespace();
        let last = words.next_back().unwrap_or_default();
        let named = words.next_back().unwrap_or_default();
        let is_level = last.trim_end_matches('%').parse::<f64>().is_ok();
        (is_level || LEVEL_WORDS.contains(&last)) && self.movable().any(|name| name == named)
    }

    /// Names declared by statements of a word.
    fn declared_by(&self, word: &str) -> &[String] {
        let mut declared = self.declared.iter();
        let found = declared.find(|(own, _)| *own == word);
        found.map_or(&[], |(_, names)| names)
    }

    /// Names declared by statements of these words.
    fn all(&self, words: &'static [&'static str]) -> impl Iterator<Item = &str> {
        words
            .iter()
            .flat_map(|word| strings(self.declared_by(word)))
    }

    /// Names that a cue can move.
    fn movable(&self) -> impl Iterator<Item = &str> {
        self.all(&["bank", "group", "look"])
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.movable()
            .chain(self.all(&["light", "curve", "effect", "view", "let"]))
    }
}

/// True when a token names an option.
fn is_named(option: &Arg, token: &str) -> bool {
    let short = token.strip_prefix('-').and_then(|rest| rest.parse().ok());
    token
        .strip_prefix("--")
        .is_some_and(|long| option.get_long() == Some(long))
        || short.is_some() && short == option.get_short()
}

/// The names of the common lanterns, in quotes.
static LANTERNS: LazyLock<Vec<String>> = LazyLock::new(|| {
    lang::lanterns()
        .map(|lantern| format!("\"{}\"", lantern.name))
        .collect()
});

fn strings(names: &[String]) -> impl Iterator<Item = &str> {
    names.iter().map(String::as_str)
}

/// True when a word that the grammar accepts after `before` makes sense there.
fn is_meant(before: &str, word: &str) -> bool {
    let last = before.split_whitespace().next_back();
    match word {
        _ if last == Some("gel") => false,
        "at" => !(before.starts_with("cue") && before.contains('{')),
        "filmic" | "plain" => last == Some("tone"),
        "dither" | "on" | "off" => false,
        "auto" => last == Some("exposure"),
        _ => true,
    }
}

/// The number with each unit of the kind expected after `before`.
fn units(before: &str, word: &str) -> impl Iterator<Item = String> {
    let end = word.find(|c: char| !(c.is_ascii_digit() || c == '.'));
    let digits = word.get(..end.unwrap_or(word.len())).unwrap_or_default();
    let last = before.split_whitespace().next_back().unwrap_or_default();
    let units: &[&str] = match last {
        _ if digits.is_empty() => &[],
        "time" | "up" | "down" | "delay" | "follow" | "hang" | "gap" => &["s", "ms"],
        "at" if before.starts_with("cue") => &["s", "ms"],
        "beam" | "field" | "fov" | "turn" => &["deg"],
        "tolerance" => &["%", " steps"],
        "depth" => &["%"],
        "haze" => &["m", "ft", "/m"],
        "forward" | "albedo" | "gloss" => &[],
        "at" | "aim" | "from" | "to" | "radius" | "scale" => LENGTHS,
        last if last.ends_with(',') && !before.starts_with("cue") => LENGTHS,
        _ => &["%"],
    };
    let digits = digits.to_owned();
    units.iter().map(move |unit| format!("{digits}{unit}"))
}

/// Levels that are words.
const LEVEL_WORDS: [&str; 2] = ["full", "out"];

const LENGTHS: &[&str] = &["m", "cm", "mm", "ft", "in"];

#[cfg(test)]
mod tests;
