//! The gap between two words: blanks, line ends and comments.

use crate::lang::scan::comment_length;

/// A comment and its position after the text before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Comment<'a> {
    /// The comment without trailing blanks.
    pub text: &'a str,
    /// True when it begins on a new line.
    pub own_line: bool,
    /// True when an empty line precedes.
    pub apart: bool,
}

/// A parsed gap.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gap<'a> {
    pub comments: Vec<Comment<'a>>,
    /// True when it contains a line end, even inside a comment.
    pub broken: bool,
    /// True when a line end follows the last comment, or the word before if there is no comment.
    pub ends_line: bool,
    /// True when it contains an empty line.
    pub apart: bool,
}

impl<'a> Gap<'a> {
    /// Parses a gap, which must hold only blanks and whole comments.
    pub fn of(text: &'a str) -> Gap<'a> {
        let mut gap = Gap {
            broken: text.contains('\n'),
            ..Gap::default()
        };
        let (mut rest, mut ends) = (text, 0);
        while !rest.is_empty() {
            let Some(length) = comment_length(rest) else {
                let mut chars = rest.chars();
                ends += usize::from(chars.next() == Some('\n'));
                rest = chars.as_str();
                continue;
            };
            let (comment, after) = rest.split_at(length);
            gap.comments.push(Comment {
                text: comment.trim_end(),
                own_line: ends > 0,
                apart: ends > 1,
            });
            (rest, ends) = (after, 0);
        }
        gap.ends_line = ends > 0;
        gap.apart = ends > 1;
        gap
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_taken_apart() {
        let gap = Gap::of("  // one\n\n  /* two\n */ ");
        let texts: Vec<_> = gap
            .comments
            .iter()
            .map(|c| (c.text, c.own_line, c.apart))
            .collect();
        assert_eq!(
            texts,
            [("// one", false, false), ("/* two\n */", true, true)]
        );
        assert!(gap.broken && !gap.ends_line && !gap.apart);
        let empty = Gap::of(" \n \n");
        assert!(empty.comments.is_empty() && empty.ends_line && empty.apart);
    }
}
