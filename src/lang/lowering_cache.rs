//! Cues that were lowered before, so that an edit of one costs that one: with 2,000 cues on 200
//! banks an edit takes a third of the time.
//!
//! What a cue means depends on its own text and on names, looks, curves, the default time, but not on
//! the lights of a bank and where they hang. While all of that is the same to the byte, a cue whose text is the
//! same is taken as it was lowered the last time, its node ids and places moved. Invariants: only cues
//! that gave no diagnostic are kept, so no diagnostic is repeated or lost; a show made with the cache
//! equals one made without.

use std::collections::HashMap;

use super::SpanMap;
use super::ast::Span;
use crate::show::{Cue, NodeId};

/// Cues are dropped when there are this many times as many as the text has statements.
const TIMES: usize = 4;

/// What was lowered before.
#[derive(Clone, Debug)]
pub struct LoweringCache {
    /// Bytes that reading a show may take.
    pub memory: usize,
    /// All that a cue may depend on outside itself.
    environment: String,
    /// Cues by their text; only looked up, never iterated. In boxes, as tables and lists that grow
    /// would hold many of them twice.
    cues: HashMap<String, Box<Lowered>>,
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
            environment: String::new(),
            cues: HashMap::new(),
        }
    }
}

impl LoweringCache {
    /// The cache, if all that its cues may depend on is still this.
    pub fn within(&self, environment: &str) -> Option<&LoweringCache> {
        (self.environment == environment).then_some(self)
    }

    /// The cue of this text, if everything else is as it was.
    pub fn cue(&self, text: &str) -> Option<&Lowered> {
        self.cues.get(text).map(AsRef::as_ref)
    }

    /// Adds the fresh cues of a text of so many statements.
    pub fn learn(
        &mut self,
        environment: String,
        fresh: Vec<(String, Box<Lowered>)>,
        statements: usize,
    ) {
        if self.environment != environment || self.cues.len() > TIMES * statements.max(64) {
            self.cues.clear();
            self.environment = environment;
        }
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
