//! Cues that were lowered before, so that an edit of one costs that one: with 2,000 cues on 200
//! banks an edit takes a third of the time.
//!
//! What a cue means depends on its own text, on the names, banks, curves and values of the show, and
//! on the groups and looks that it names, but not on the lights of a bank and where they hang. While all
//! of that is the same to the byte, a cue whose text is the same is taken as it was lowered the last
//! time, its node ids and places moved. Where declarations have errors, what is lowered may miss one of
//! them: it is kept for a text with the same declarations alone. Invariants: only cues that gave no
//! diagnostic are kept, so no diagnostic is repeated or lost; a show made with the cache equals one made
//! without.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::SpanMap;
use super::ast::Span;
use super::edit;
use super::scan::{Scan, first_word};
use super::token::tokens;
use crate::show::{Cue, NodeId};

/// Cues are dropped when there are this many times as many as the text has statements.
const TIMES: usize = 4;

/// What was lowered before.
#[derive(Clone, Debug)]
pub struct LoweringCache {
    /// Bytes that reading a show may take.
    pub memory: usize,
    environment: Environment,
    /// The text that they were lowered in had no error.
    is_sound: bool,
    /// Cues by their text; only looked up, never iterated. In boxes, as tables and lists that grow
    /// would hold many of them twice.
    cues: HashMap<String, Box<Lowered>>,
}

/// All that cues may depend on outside themselves.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// The statements that are no cues, one after the other.
    all: String,
    /// The same without what no cue depends on, or only those that name it.
    shared: String,
    /// Groups and looks by their names.
    named: BTreeMap<String, String>,
}

/// The cues that may be taken as they were lowered.
#[derive(Debug)]
pub struct Known<'a> {
    cache: &'a LoweringCache,
    /// Groups and looks that are others now, or rest on such.
    changed: BTreeSet<String>,
}

/// A lowered cue, its places counted from the start of its statement, its ids from its first.
#[derive(Clone, Debug)]
pub struct Lowered {
    cue: Cue,
    /// Where its number stands.
    number: Span,
    /// The places of its nodes.
    spans: Vec<Span>,
    /// How many levels it took from the budget.
    pub levels: usize,
}

impl Default for LoweringCache {
    /// Empty, with no limit of memory.
    fn default() -> LoweringCache {
        LoweringCache {
            memory: usize::MAX,
            environment: Environment::default(),
            is_sound: false,
            cues: HashMap::new(),
        }
    }
}

impl Environment {
    /// Adds the statements of a file.
    pub fn add(&mut self, scan: &Scan<'_>) {
        for cut in scan.cuts.iter().filter(|cut| !cut.is_cue()) {
            self.all.push_str(cut.text);
            self.all.push('\n');
            let name = edit::name(cut.text).unwrap_or_default();
            let shared = match first_word(cut.text) {
                "show" | "preview" | "stage" | "surface" | "view" | "light" | "fixed" => &name,
                "bank" => {
                    let mut pieces = tokens(cut.text).into_iter();
                    let is_rgb = pieces.any(|(range, _)| cut.text.get(range) == Some("rgb"));
                    self.shared.push_str(if is_rgb { "rgb " } else { "" });
                    &name
                }
                "group" | "look" => {
                    let word = name.split(' ').nth(1).unwrap_or_default();
                    let named = self.named.entry(word.to_owned()).or_default();
                    named.push_str(cut.text);
                    &name
                }
                _ => cut.text,
            };
            self.shared.push_str(shared);
            self.shared.push('\n');
        }
    }

    /// Adds what was read of other files.
    pub fn add_read(&mut self, text: &str) {
        self.all.push_str(text);
        self.shared.push_str(text);
    }

    /// The groups and looks that are others than these, and those that rest on them.
    fn changed(&self, before: &Environment) -> BTreeSet<String> {
        let names = self.named.keys().chain(before.named.keys());
        let is_other = |name: &&String| self.named.get(*name) != before.named.get(*name);
        let mut waiting: Vec<&str> = names.filter(is_other).map(String::as_str).collect();
        let mut changed = BTreeSet::new();
        if waiting.is_empty() {
            return changed;
        }
        let mut resting: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (name, text) in self.named.iter().chain(&before.named) {
            for word in words(text) {
                resting.entry(word).or_default().push(name);
            }
        }
        while let Some(name) = waiting.pop() {
            if changed.insert(name.to_owned()) {
                waiting.extend(resting.get(name).into_iter().flatten());
            }
        }
        changed
    }
}

/// The words of a text: all names in it, and more. Not its tokens, which take ten times as long.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let pieces = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'));
    // A name may stand behind a number and a minus.
    pieces.map(|word| word.trim_start_matches(|c: char| c.is_ascii_digit() || c == '-'))
}

impl Known<'_> {
    /// The cue of this text.
    pub fn cue(&self, text: &str) -> Option<&Lowered> {
        let lowered = self.cache.cues.get(text)?;
        let is_changed =
            !self.changed.is_empty() && words(text).any(|word| self.changed.contains(word));
        (!is_changed).then_some(lowered)
    }
}

impl LoweringCache {
    /// The cues that may be taken in an environment.
    pub fn within(&self, environment: &Environment) -> Option<Known<'_>> {
        let changed = match self.environment.all == environment.all {
            true => BTreeSet::new(),
            false if self.is_sound && self.environment.shared == environment.shared => {
                environment.changed(&self.environment)
            }
            false => return None,
        };
        Some(Known {
            cache: self,
            changed,
        })
    }

    /// Adds the fresh cues of a text of so many statements, which had no error if it `is_sound`.
    pub fn learn(
        &mut self,
        environment: Environment,
        fresh: Vec<(String, Box<Lowered>)>,
        statements: usize,
        is_sound: bool,
    ) {
        let is_same = self.environment.all == environment.all;
        let known = self.within(&environment).map(|known| known.changed);
        if known.is_some() && !is_same && !is_sound {
            // Those that are known are of use when the declarations are mended.
            return;
        }
        match known {
            Some(changed) if self.cues.len() <= TIMES * statements.max(64) => {
                if !changed.is_empty() {
                    let is_kept = |text: &str| !words(text).any(|word| changed.contains(word));
                    self.cues.retain(|text, _| is_kept(text));
                }
            }
            _ => self.cues.clear(),
        }
        self.is_sound = is_sound || is_same && self.is_sound;
        self.environment = environment;
        self.cues.extend(fresh);
    }
}

impl Lowered {
    /// What lowering the statement at `statement` made: a cue whose number stands at `number`, and
    /// the last `nodes` places of `map`; it wrote out so many levels.
    pub fn of(
        cue: &Cue,
        [statement, number]: [Span; 2],
        map: &SpanMap,
        nodes: usize,
        levels: usize,
    ) -> Lowered {
        let first = map.spans.len().saturating_sub(nodes);
        let relative = |span: &Span| Span {
            file: 0,
            start: span.start.saturating_sub(statement.start),
            end: span.end.saturating_sub(statement.start),
        };
        let spans = map.spans.iter().skip(first).map(relative).collect();
        Lowered {
            cue: renumbered(cue.clone(), |id| id.wrapping_sub(first as u32)),
            number: relative(&number),
            spans,
            levels,
        }
    }

    /// The cue as it stands at `statement`, its places added to `map`, and its number's place.
    pub fn again(&self, statement: Span, map: &mut SpanMap) -> (Cue, Span) {
        let first = map.spans.len() as u32;
        let moved = |span: &Span| Span {
            file: statement.file,
            start: span.start + statement.start,
            end: span.end + statement.start,
        };
        map.spans.extend(self.spans.iter().map(moved));
        let cue = renumbered(self.cue.clone(), |id| id.wrapping_add(first));
        (cue, moved(&self.number))
    }
}

/// The cue with each of its node ids changed.
fn renumbered(mut cue: Cue, to: impl Fn(u32) -> u32) -> Cue {
    let change = |id: &mut NodeId| id.0 = to(id.0);
    change(&mut cue.id);
    if let Some((id, _)) = &mut cue.link {
        change(id);
    }
    for part in &mut cue.parts {
        change(&mut part.id);
        part.moves.iter_mut().for_each(|m| change(&mut m.id));
        part.effects.iter_mut().for_each(|e| change(&mut e.id));
    }
    cue
}
