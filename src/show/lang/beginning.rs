//! What a statement that is being typed may go on with, asked of the grammar itself.

use std::collections::BTreeSet;

use super::scan;
use super::syntax::{self, Rule};

/// A name that no show has.
const STRANGER: &str = "a_name_of_no_show";

/// The beginning of a statement.
#[derive(Debug)]
pub struct Beginning<'t> {
    rule: Rule,
    text: &'t str,
    /// What stands behind any name; `None` where no name may stand.
    behind_names: Option<BTreeSet<Rule>>,
}

impl<'t> Beginning<'t> {
    /// The beginning of a statement; `None` where its first word is that of none.
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

    /// Whether `word`, a name or a quantity, may stand next.
    pub fn takes(&self, word: &str) -> bool {
        self.behind(word).is_some()
    }

    /// Whether `word` may stand next and is more than a name there.
    pub fn takes_keyword(&self, word: &str) -> bool {
        let behind = self.behind(word);
        behind.is_some() && behind != self.behind_names
    }

    /// What could stand behind `word`; `None` where `word` itself cannot stand.
    fn behind(&self, word: &str) -> Option<BTreeSet<Rule>> {
        // No rule takes this character, so that parsing stops behind the word at the latest.
        let text = format!("{}{word} \u{1}", self.text);
        let (at, expected) = syntax::stop(self.rule, &text)?;
        (at >= self.text.len() + word.len()).then_some(expected)
    }
}
