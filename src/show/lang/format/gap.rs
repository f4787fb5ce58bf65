//! What stands between two words: blanks, line ends and comments.

use crate::lang::scan::comment_length;

/// A comment, and how it stands to what is before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Comment<'a> {
    /// As written, without blanks behind it.
    pub text: &'a str,
    /// A line end is before it.
    pub own_line: bool,
    /// An empty line is before it.
    pub apart: bool,
}

/// A gap, taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gap<'a> {
    pub comments: Vec<Comment<'a>>,
    /// A line end stands anywhere in it, inside a comment too.
    pub broken: bool,
    /// A line end is between the last comment (or the word before) and the word after.
    pub ends_line: bool,
    /// An empty line is there.
    pub apart: bool,
}

impl<'a> Gap<'a> {
    /// Takes a gap apart; it must hold nothing but blanks and whole comments.
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
