//! Splits a text into tokens for syntax highlighting; the tokens are the grammar's own.
//!
//! Invariants: pieces are in order, disjoint and on character boundaries; time is linear in the
//! text. Unfinished texts work too: a character that fits no token is punctuation.

use std::ops::Range;

use super::scan::{STATEMENTS, comment_length, split_word};
use super::syntax::{self, Rule};

/// Kind of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Token {
    /// A word that begins statements.
    Statement,
    /// Another word of the language.
    Word,
    /// A name of the show.
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

/// The pieces of a text, without blanks.
pub fn tokens(text: &str) -> Vec<(Range<usize>, Token)> {
    pieces(text).collect()
}

/// The pieces of a text, without blanks, found lazily.
pub fn pieces(text: &str) -> impl Iterator<Item = (Range<usize>, Token)> {
    let mut rest = text;
    let mut statement = "";
    std::iter::from_fn(move || {
        let written = rest.trim_start();
        let blank = rest.get(..rest.len() - written.len()).unwrap_or("");
        let first_of_line = rest.len() == text.len() || blank.contains('\n');
        rest = written;
        if rest.is_empty() {
            return None;
        }
        let start = text.len() - rest.len();
        let (length, token) = token(rest, statement);
        let token = match token {
            // In the middle of a line it is a name or a clause.
            Token::Statement if !first_of_line => Token::Word,
            token => token,
        };
        let (piece, after) = rest.split_at(length);
        if token == Token::Statement {
            statement = piece;
        }
        rest = after;
        Some((start..start + length, token))
    })
}

/// The first piece of `rest`, in a statement that begins with this word.
fn token(rest: &str, statement: &str) -> (usize, Token) {
    if let Some(length) = comment_length(rest) {
        return (length, Token::Comment);
    }
    // Elsewhere `5/m` is a quotient.
    let is_haze = statement == "haze";
    let forms = [
        (
            Rule::extinction,
            Token::Quantity,
            if is_haze { measure_at(rest) } else { "" },
        ),
        (Rule::text, Token::Text, text_at(rest)),
        (Rule::colour, Token::Colour, colour_at(rest)),
        (Rule::measure, Token::Quantity, measure_at(rest)),
        (Rule::name, Token::Name, split_word(rest).0),
    ];
    let found = forms.into_iter().find_map(|(rule, token, piece)| {
        // The parser counts the lines of its whole input, so it gets only the piece.
        let piece = Some(piece).filter(|piece| !piece.is_empty())?;
        let length = syntax::prefix(rule, piece).filter(|length| *length > 0)?;
        Some((length, token))
    });
    match found {
        Some((length, Token::Name)) => {
            let (word, _) = rest.split_at(length);
            let token = match word {
                word if STATEMENTS.contains(&word) => Token::Statement,
                word if syntax::is_inner_word(word) => Token::Word,
                _ => Token::Name,
            };
            (length, token)
        }
        Some(found) => found,
        // An unclosed quote extends to the end of its line.
        None if rest.starts_with('"') => (rest.find('\n').unwrap_or(rest.len()), Token::Text),
        None => (rest.chars().next().map_or(1, char::len_utf8), Token::Mark),
    }
}

/// Most characters of a number or of a colour in words; longer text becomes several pieces.
const LONG: usize = 200;

/// The beginning of a text, at most [`LONG`] characters.
fn short(rest: &str) -> &str {
    let end = rest
        .char_indices()
        .nth(LONG)
        .map_or(rest.len(), |(at, _)| at);
    rest.get(..end).unwrap_or(rest)
}

/// The quoted text at the start of `rest`; empty without a closing quote on the line.
fn text_at(rest: &str) -> &str {
    let Some(inner) = rest.strip_prefix('"') else {
        return "";
    };
    let mut is_escaped = false;
    for (at, c) in inner.char_indices() {
        match c {
            '"' if !is_escaped => return rest.get(..at + 2).unwrap_or(""),
            '\n' if !is_escaped => return "",
            _ => is_escaped = c == '\\' && !is_escaped,
        }
    }
    ""
}

/// The longest prefix that may be a colour.
fn colour_at(rest: &str) -> &str {
    if let Some(code) = rest.strip_prefix('#') {
        let end = code.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-'));
        return rest.get(..1 + end.unwrap_or(code.len())).unwrap_or("");
    }
    if rest.starts_with("gel") || rest.starts_with("hsb(") {
        short(rest)
    } else {
        ""
    }
}

/// The longest prefix that may be a number with its unit.
fn measure_at(rest: &str) -> &str {
    if rest.starts_with(|c: char| c.is_ascii_digit()) {
        short(rest)
    } else {
        ""
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
        let text = "haze 0.05/m albedo 0.9\nlet a = 5/m";
        let found = tokens(text).into_iter().map(|(range, _)| &text[range]);
        let wanted = [
            "haze", "0.05/m", "albedo", "0.9", "let", "a", "=", "5", "/", "m",
        ];
        assert_eq!(found.collect::<Vec<_>>(), wanted);
        assert_eq!(tokens("bank x = \"open"), tokens("bank x = \"open"));
        assert_eq!(tokens("show \"open").last().map(|t| t.1), Some(Text));
    }

    proptest! {
        /// The gaps between pieces are blanks only.
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

        /// Each piece is what the grammar takes from the whole rest.
        #[test]
        fn pieces_are_the_grammars(
            text in "([a-zü_]{1,4}-?|gel [RL]?[0-9]{0,4}|hsb\\([0-9, ]{0,9}\\)?|#[0-9a-z]{0,7}|[0-9.:]{1,4}( ?(cd/m2|K|lm|%|ms))?                    |\"[a\\\\\"
]{0,6}\"?|[ 
{}().-]){0,12}"
        ) {
            for (range, token) in tokens(&text) {
                let rest = &text[range.start..];
                let rules = [Rule::text, Rule::colour, Rule::measure, Rule::name];
                let found = rules.into_iter().find_map(|rule| {
                    syntax::prefix(rule, rest).filter(|length| *length > 0)
                });
                if let Some(length) = found.filter(|_| token != Token::Comment) {
                    prop_assert_eq!(length, range.len(), "{:?}", rest);
                }
            }
        }
    }
}
