//! Continuations of an unfinished statement, found by asking the grammar.

use std::collections::BTreeSet;

use super::scan;
use super::syntax::{self, Rule};

/// A name that no show has.
const STRANGER: &str = "a_name_of_no_show";

/// An unfinished statement.
#[derive(Debug)]
pub struct Beginning<'t> {
    rule: Rule,
    text: &'t str,
    /// Rules that may follow a name; `None` where no name may stand.
    behind_names: Option<BTreeSet<Rule>>,
}

impl<'t> Beginning<'t> {
    /// Parses the beginning of a statement; `None` when its first word opens no statement.
    pub fn of(text: &'t str) -> Option<Beginning<'t>> {
        let text = text.trim_start();
        let (word, _) = scan::split_word(text);
        let mut out = Beginning {
            rule: syntax::rule_of(word)?,
            text,
            behind_names: None,
        };
        out.behind_names = out.behind(STRANGER);
        Some(out)
    }

    /// True when `word`, a name or a quantity, may come next.
    pub fn takes(&self, word: &str) -> bool {
        self.behind(word).is_some()
    }

    /// True when `word` may come next as a keyword.
    pub fn takes_keyword(&self, word: &str) -> bool {
        let behind = self.behind(word);
        behind.is_some() && behind != self.behind_names
    }

    /// Rules that may follow `word`; `None` when `word` itself may not come next.
    fn behind(&self, word: &str) -> Option<BTreeSet<Rule>> {
        // No rule takes this character, so that parsing stops right after the word at the latest.
        let text = format!("{}{word} \u{1}", self.text);
        let (at, expected) = syntax::stop(self.rule, &text)?;
        (at >= self.text.len() + word.len()).then_some(expected)
    }
}
