//! Cues that were lowered before, so that an edit costs the cues that it touches.
//!
//! What a cue means depends on its own text, on the names in it, and on what these rest on: a cue whose
//! text is the same, and none of whose names means something else, is taken as it was lowered the last
//! time; otherwise at least its text is not parsed again. What may have changed around a cue is put right
//! when it is taken: its places and node ids, where banks, curves and effects stand in the show, and the
//! default time. Where declarations have errors, what is lowered may miss one of them: it is kept for a
//! text with the same declarations alone. Invariants: only cues that gave no diagnostic are kept as they
//! were lowered, so no diagnostic is repeated or lost; a show made with the cache equals one made without.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::SpanMap;
use super::ast::Span;
use super::edit::heading;
use super::packed::PackedCue;
use super::scan::Cut;
use super::token::tokens;
use crate::show::{Cue, Fade, NodeId};
use crate::units::Time;

/// Cues of earlier texts are dropped when there are this many times as many as the text has statements.
const TIMES: usize = 4;

/// What was lowered before.
#[derive(Clone, Debug)]
pub struct LoweringCache {
    /// Bytes that reading a show may take.
    pub memory: usize,
    environment: Environment,
    /// The text that they were lowered in had no error.
    is_sound: bool,
    /// Cues by their text; only looked up, never iterated in an order that shows.
    cues: HashMap<String, Entry>,
}

/// A cue of which its text is known.
#[derive(Clone, Debug)]
struct Entry {
    /// As it was parsed, which depends on its text alone.
    parsed: PackedCue,
    /// As it was lowered. In a box, as tables that grow would hold many of them twice.
    lowered: Option<Box<Lowered>>,
}

/// What was made of the cues of a text, by their texts.
#[derive(Debug, Default)]
pub struct Fresh {
    /// Those that were parsed for the first time.
    pub parsed: Vec<(String, PackedCue)>,
    /// Those that were lowered.
    pub lowered: Vec<(String, Box<Lowered>)>,
}

/// All that cues may depend on outside themselves.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// The statements that are no cues, one after the other.
    all: String,
    /// The statements that name files with more of the show, and the colours of gels.
    files: String,
    /// What each name means to a cue: its kind, and the statement where that matters.
    named: BTreeMap<String, String>,
    /// In the order of the show, with their numbers of parameters.
    banks: Vec<(String, usize)>,
    curves: Vec<String>,
    effects: Vec<String>,
}

/// The cues that may be taken as they were parsed, or lowered.
#[derive(Debug)]
pub struct Known<'a> {
    cache: &'a LoweringCache,
    /// `None` where all cues have to be lowered again.
    change: Option<Change>,
}

/// What is different for the cues that were lowered.
#[derive(Debug, Default)]
struct Change {
    /// Names that mean something else now, or rest on such.
    names: BTreeSet<String>,
    indices: Option<Indices>,
}

/// A cue that was lowered before.
#[derive(Clone, Copy, Debug)]
pub struct KnownCue<'a> {
    lowered: &'a Lowered,
    indices: Option<&'a Indices>,
}

/// Where what a cue names by its index stands now, by where it stood.
#[derive(Debug, PartialEq)]
struct Indices {
    banks: Vec<usize>,
    parameters: Vec<usize>,
    curves: Vec<usize>,
    effects: Vec<usize>,
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
    levels: usize,
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
    /// Adds a statement, in the order of the show.
    pub fn add(&mut self, cut: &Cut<'_>) {
        if cut.is_cue() {
            return;
        }
        self.all.push_str(cut.text);
        self.all.push_str(if cut.broken { "!\n" } else { "\n" });
        let Some((word, range)) = heading(cut.text) else {
            return;
        };
        let name = cut.text.get(range).unwrap_or_default();
        let named = || name.to_owned();
        let meaning = match word {
            "bank" => {
                let is_rgb = cut.text.contains("rgb") && is_rgb(cut.text);
                self.banks.push((named(), if is_rgb { 4 } else { 1 }));
                if is_rgb { "rgb bank" } else { word }
            }
            "effect" => {
                self.effects.push(named());
                word
            }
            "view" | "light" | "fixed" => word,
            "curve" => {
                self.curves.push(named());
                cut.text
            }
            "group" | "look" | "let" => cut.text,
            "include" | "gels" => {
                self.files.push_str(cut.text);
                self.files.push('\n');
                return;
            }
            _ => return,
        };
        let known = self.named.entry(named()).or_default();
        known.push_str(meaning);
        known.push_str(if cut.broken { "!\n" } else { "\n" });
    }

    /// Adds the colours of gels as they were read.
    pub fn add_gels(&mut self, gels: &str) {
        self.all.push_str(gels);
        self.files.push_str(gels);
    }

    /// The names that mean something else than before, and those that rest on them.
    fn changed(&self, before: &Environment) -> BTreeSet<String> {
        let names = self.named.keys().chain(before.named.keys());
        let is_other = |name: &&String| self.named.get(*name) != before.named.get(*name);
        let mut waiting: Vec<&str> = names.filter(is_other).map(String::as_str).collect();
        let mut changed = BTreeSet::new();
        if self.banks != before.banks {
            waiting.push("blackout");
        }
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

    /// Where all stands now that stood elsewhere before; `None` where nothing was moved.
    fn indices(&self, before: &Environment) -> Option<Indices> {
        let bank_names = |banks: &[(String, usize)]| -> Vec<String> {
            banks.iter().map(|(name, _)| name.clone()).collect()
        };
        let banks = moved(&bank_names(&before.banks), &bank_names(&self.banks));
        let first = first_parameters(&self.banks);
        let mut parameters = Vec::new();
        for (bank, (_, count)) in banks.iter().zip(&before.banks) {
            let first = first.get(*bank).copied().unwrap_or(0);
            parameters.extend(first..first + count);
        }
        let indices = Indices {
            curves: moved(&before.curves, &self.curves),
            effects: moved(&before.effects, &self.effects),
            banks,
            parameters,
        };
        (!indices.all_stay()).then_some(indices)
    }
}

/// Where the parameters of each bank begin.
fn first_parameters(banks: &[(String, usize)]) -> Vec<usize> {
    let ends = banks.iter().scan(0, |end, (_, count)| {
        *end += count;
        Some(*end)
    });
    std::iter::once(0).chain(ends).collect()
}

/// Where each name stands among those of now. One that is gone keeps its place: a cue that names it is
/// lowered again.
fn moved(before: &[String], now: &[String]) -> Vec<usize> {
    let mut at: HashMap<&str, usize> = HashMap::new();
    for (index, name) in now.iter().enumerate() {
        at.entry(name).or_insert(index);
    }
    let place = |(index, name): (usize, &String)| at.get(name.as_str()).copied().unwrap_or(index);
    before.iter().enumerate().map(place).collect()
}

/// Whether a bank has emitters of its own. The word may also stand in a comment.
fn is_rgb(bank: &str) -> bool {
    let mut pieces = tokens(bank).into_iter();
    pieces.any(|(range, _)| bank.get(range) == Some("rgb"))
}

/// The words of a text: all names in it, and more. Not its tokens, which take ten times as long.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let pieces = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'));
    // A name may stand behind a number and a minus: `2s-wait`.
    pieces.flat_map(|piece| {
        let is_number = piece.starts_with(|c: char| c.is_ascii_digit());
        let minus = piece.match_indices('-').filter(move |_| is_number);
        let starts = std::iter::once(0).chain(minus.map(|(at, _)| at + 1));
        let word = |at: usize| piece.get(at..).unwrap_or_default();
        starts.map(move |at| word(at).trim_start_matches(|c: char| c.is_ascii_digit() || c == '-'))
    })
}

impl<'a> Known<'a> {
    /// The cue of this text as it was lowered.
    pub fn cue(&'a self, text: &str) -> Option<KnownCue<'a>> {
        let change = self.change.as_ref()?;
        let lowered = self.cache.cues.get(text)?.lowered.as_ref()?;
        let is_changed = rests_on(text, &change.names);
        let indices = change.indices.as_ref();
        (!is_changed).then_some(KnownCue { lowered, indices })
    }

    /// The cue of this text as it was parsed.
    pub fn parsed(&self, text: &str) -> Option<&'a PackedCue> {
        self.cache.cues.get(text).map(|entry| &entry.parsed)
    }
}

fn rests_on(text: &str, names: &BTreeSet<String>) -> bool {
    !names.is_empty() && words(text).any(|word| names.contains(word))
}

impl LoweringCache {
    /// The cues that may be taken in an environment.
    pub fn within(&self, environment: &Environment) -> Known<'_> {
        Known {
            cache: self,
            change: self.change_to(environment),
        }
    }

    /// What an environment changes for the lowered cues; `None` where it leaves none of them.
    fn change_to(&self, environment: &Environment) -> Option<Change> {
        let before = &self.environment;
        if before.all == environment.all {
            return Some(Change::default());
        }
        let is_comparable = self.is_sound && before.files == environment.files;
        is_comparable.then(|| Change {
            names: environment.changed(before),
            indices: environment.indices(before),
        })
    }

    /// Adds the fresh cues of a text of these statements, which had no error if it `is_sound`.
    pub fn learn(
        &mut self,
        environment: Environment,
        fresh: Fresh,
        statements: &[&Cut<'_>],
        is_sound: bool,
    ) {
        for (text, parsed) in fresh.parsed {
            let lowered = None;
            self.cues.insert(text, Entry { parsed, lowered });
        }
        if self.cues.len() > TIMES * statements.len().max(64) {
            let texts: HashSet<&str> = statements.iter().map(|cut| cut.text).collect();
            self.cues.retain(|text, _| texts.contains(text.as_str()));
        }
        let is_same = self.environment.all == environment.all;
        let change = self.change_to(&environment);
        if change.is_some() && !is_same && !is_sound {
            // Those that are lowered are of use when the declarations are mended.
            return;
        }
        self.apply(change.as_ref());
        self.is_sound = is_sound || is_same && self.is_sound;
        self.environment = environment;
        for (text, lowered) in fresh.lowered {
            if let Some(entry) = self.cues.get_mut(&text) {
                entry.lowered = Some(lowered);
            }
        }
    }

    /// Brings what was lowered in line with a change, or drops it.
    fn apply(&mut self, change: Option<&Change>) {
        let stays = |change: &Change| change.names.is_empty() && change.indices.is_none();
        if change.is_some_and(stays) {
            return;
        }
        // Each for itself, so in any order.
        self.cues.iter_mut().for_each(|(text, entry)| {
            let kept = change.filter(|change| !rests_on(text, &change.names));
            match (kept, &mut entry.lowered) {
                (Some(change), Some(lowered)) => {
                    if let Some(indices) = &change.indices {
                        indices.apply(&mut lowered.cue);
                    }
                }
                (_, lowered) => *lowered = None,
            }
        });
    }
}

impl Indices {
    fn all_stay(&self) -> bool {
        let stays = |list: &[usize]| list.iter().enumerate().all(|(before, now)| before == *now);
        let lists = [&self.banks, &self.parameters, &self.curves, &self.effects];
        lists.into_iter().all(|list| stays(list))
    }

    /// Gives a cue the indices that are right now.
    fn apply(&self, cue: &mut Cue) {
        let change = |index: &mut usize, list: &[usize]| {
            *index = list.get(*index).copied().unwrap_or(*index);
        };
        for part in &mut cue.parts {
            if let Fade::Curve(curve) = &mut part.curve {
                change(curve, &self.curves);
            }
            for one in &mut part.moves {
                change(&mut one.parameter, &self.parameters);
            }
            part.moves.sort_by_key(|one| one.parameter);
            for effect in &mut part.effects {
                change(&mut effect.bank, &self.banks);
                if let Some(effect) = &mut effect.effect {
                    change(effect, &self.effects);
                }
            }
        }
    }
}

impl Lowered {
    /// What lowering the statement at `statement` made: a cue whose number stands at `number`, and
    /// the last `nodes` places of `map`; it wrote out so many levels.
    pub fn of(
        cue: &Cue,
        [statement, number]: [Span; 2],
        map: &SpanMap,
        (nodes, levels): (usize, usize),
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
}

impl KnownCue<'_> {
    /// How many levels it takes from the budget.
    pub fn levels(&self) -> usize {
        self.lowered.levels
    }

    /// The cue as it stands at `statement`, its places added to `map`, and its number's place; `default`
    /// is the default time up and down.
    pub fn again(&self, statement: Span, map: &mut SpanMap, default: [Time; 2]) -> (Cue, Span) {
        let first = map.spans.len() as u32;
        let moved = |span: &Span| Span {
            file: statement.file,
            start: span.start + statement.start,
            end: span.end + statement.start,
        };
        map.spans.extend(self.lowered.spans.iter().map(moved));
        let mut cue = renumbered(self.lowered.cue.clone(), |id| id.wrapping_add(first));
        if let Some(indices) = self.indices {
            indices.apply(&mut cue);
        }
        let [up, down] = default;
        for part in &mut cue.parts {
            let [is_up, is_down] = part.by_default;
            part.up = if is_up { up } else { part.up };
            part.down = if is_down { down } else { part.down };
        }
        (cue, moved(&self.lowered.number))
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

#[cfg(test)]
mod tests;
