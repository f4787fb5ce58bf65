//! A text as a row of coloured pieces, for those who show it: the tokens are the grammar's own.
//!
//! Invariants: pieces are in order, disjoint and on character boundaries; linear in the text. It is
//! for unfinished texts too: what is no token is one character of punctuation.

use std::ops::Range;

use super::scan::STATEMENTS;
use super::syntax::{self, Rule};

/// What a piece is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Token {
    /// A word that begins statements.
    Statement,
    /// Another word of the language.
    Word,
    /// Whatever the show calls so.
    Name,
    /// A number with its unit.
    Quantity,
    /// `#ffb36b`
    Colour,
    /// Between quotes.
    Text,
    /// `// …` or `/* … */`.
    Comment,
    /// A brace, a comma …
    Mark,
}

/// The pieces of a text, blanks left out.
pub fn tokens(text: &str) -> Vec<(Range<usize>, Token)> {
    let mut out: Vec<(Range<usize>, Token)> = Vec::new();
    let mut at = 0;
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let blanks = rest.len() - rest.trim_start().len();
        if blanks > 0 {
            at += blanks;
            continue;
        }
        let (length, token) = token(rest);
        // A statement word in the middle of a line is a name like any other, or a clause.
        let fresh = text.get(..at).unwrap_or_default();
        let first = fresh
            .rsplit('\n')
            .next()
            .is_none_or(|line| line.trim().is_empty());
        let token = match token {
            Token::Statement if !first => Token::Word,
            token => token,
        };
        out.push((at..at + length, token));
        at += length;
    }
    out
}

fn token(rest: &str) -> (usize, Token) {
    if rest.starts_with("//") {
        return (rest.find('\n').unwrap_or(rest.len()), Token::Comment);
    }
    if let Some(inner) = rest.strip_prefix("/*") {
        return (
            inner.find("*/").map_or(rest.len(), |i| i + 4),
            Token::Comment,
        );
    }
    let rules = [
        (Rule::text, Token::Text),
        (Rule::colour, Token::Colour),
        (Rule::measure, Token::Quantity),
        (Rule::name, Token::Name),
    ];
    let found = rules.into_iter().find_map(|(rule, token)| {
        let length = syntax::prefix(rule, rest).filter(|length| *length > 0)?;
        Some((length, token))
    });
    match found {
        Some((length, Token::Name)) => {
            let word = rest.get(..length).unwrap_or_default();
            let token = match word {
                word if STATEMENTS.contains(&word) => Token::Statement,
                word if syntax::is_inner_word(word) => Token::Word,
                _ => Token::Name,
            };
            (length, token)
        }
        Some(found) => found,
        // A quote that is not closed yet: the rest of its line.
        None if rest.starts_with('"') => (rest.find('\n').unwrap_or(rest.len()), Token::Text),
        None => (rest.chars().next().map_or(1, char::len_utf8), Token::Mark),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_statement_is_told_apart() {
        let text = "cue 2 \"Él\" { lamps (2 * dim) time 1.5s #fb6 } // so";
        let found: Vec<(&str, Token)> = tokens(text)
            .into_iter()
            .map(|(range, token)| (&text[range], token))
            .collect();
        use Token::*;
        let wanted = [
            ("cue", Statement),
            ("2", Quantity),
            ("\"Él\"", Text),
            ("{", Mark),
            ("lamps", Name),
            ("(", Mark),
            ("2", Quantity),
            ("*", Mark),
            ("dim", Name),
            (")", Mark),
            ("time", Word),
            ("1.5s", Quantity),
            ("#fb6", Colour),
            ("}", Mark),
            ("// so", Comment),
        ];
        assert_eq!(found, wanted);
        assert_eq!(tokens("bank x = \"open"), tokens("bank x = \"open"));
        assert_eq!(tokens("show \"open").last().map(|t| t.1), Some(Text));
    }

    proptest! {
        /// Any text comes apart into pieces that leave only blanks between them.
        #[test]
        fn nothing_is_lost(text in "\\PC{0,60}|[\"/*{}#0-9a-z \n]{0,60}") {
            let mut at = 0;
            for (range, _) in tokens(&text) {
                prop_assert!(range.start >= at && range.end > range.start);
                prop_assert!(text[at..range.start].trim().is_empty());
                at = range.end;
            }
            prop_assert!(text[at..].trim().is_empty());
        }
    }
}
