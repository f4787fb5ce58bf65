//! Breaks words into lines: line ends, indentation, comments.

use super::column::{Cell, Line};
use super::gap::{Comment, Gap};
use super::piece::{Join, Piece};

/// Indentation per brace, blanks.
const STEP: usize = 2;
/// Indentation of a continued line, blanks.
const ONWARD: usize = 4;
/// Longest block kept on one line, characters.
const WIDTH: usize = 100;

/// The lines so far.
#[derive(Debug, Default)]
pub struct Layout<'a> {
    lines: Vec<Line>,
    current: Line,
    /// Open blocks; true for a block on one line.
    blocks: Vec<bool>,
    /// True when the next word cannot stand on the current line.
    full: bool,
    /// True when the line before this place opened a block.
    opened: bool,
    /// The last item begun on the current line.
    last: Option<&'a str>,
}

impl<'a> Layout<'a> {
    /// Adds a word after the gap before it. For an opening brace, `block` gives the pieces to the
    /// closing one, and true when they stand on one line.
    pub fn piece<'p>(
        &mut self,
        piece: &Piece<'a>,
        gap: &str,
        block: impl FnOnce() -> (&'p [Piece<'a>], bool),
    ) where
        'a: 'p,
    {
        let gap = Gap::of(gap);
        self.comments(&gap.comments, piece.join == Join::Close);
        let text = normal(piece.text);
        match piece.join {
            Join::Start => {
                self.line(0, gap.apart, Some(kind_of(piece.text)));
                self.cell("statement", 0, text);
            }
            Join::Item | Join::Timing | Join::Entry => self.item(piece, &gap, text),
            Join::Open { clause } => {
                let (pieces, together) = block();
                self.open(clause, pieces, together, text);
            }
            Join::Close => self.close(text),
            Join::Tight => self.word(&gap, 0, text),
            Join::Word => self.word(&gap, 1, text),
            Join::Clause { gap: blanks } => self.clause(piece.role, &gap, blanks, text),
        }
    }

    /// Adds the comments at the end of the text and returns the lines.
    pub fn finish(mut self, gap: &str) -> Vec<Line> {
        let gap = Gap::of(gap);
        self.comments(&gap.comments, false);
        self.flush();
        self.lines
    }

    fn together(&self) -> bool {
        self.blocks.iter().any(|one_line| *one_line)
    }

    fn indent(&self) -> usize {
        STEP * self.blocks.len()
    }

    fn flush(&mut self) {
        let line = std::mem::take(&mut self.current);
        if !line.cells.is_empty() || !line.comment.is_empty() {
            self.lines.push(line);
        }
        self.full = false;
    }

    fn line(&mut self, indent: usize, apart: bool, kind: Option<&'static str>) {
        self.flush();
        let first = self.lines.is_empty() || std::mem::take(&mut self.opened);
        self.current = Line {
            indent,
            apart: apart && !first,
            kind,
            ..Line::default()
        };
    }

    fn cell(&mut self, role: &'static str, gap: usize, text: String) {
        self.current.cells.push(Cell { role, gap, text });
    }

    /// Adds to the last cell.
    fn append(&mut self, blanks: usize, text: &str) {
        match self.current.cells.last_mut() {
            Some(cell) => {
                cell.text.push_str(&" ".repeat(blanks));
                cell.text.push_str(text);
            }
            None => self.cell("onward", 0, text.to_owned()),
        }
    }

    fn comments(&mut self, comments: &[Comment<'_>], closing: bool) {
        for comment in comments {
            let empty = self.current.cells.is_empty() && self.current.comment.is_empty();
            if comment.own_line || empty {
                self.line(self.indent(), comment.apart, None);
                self.current.comment = comment.text.to_owned();
                self.full = true;
            } else if comment.text.starts_with("//") || self.full || closing {
                if !self.current.comment.is_empty() {
                    self.current.comment.push(' ');
                }
                self.current.comment.push_str(comment.text);
                self.full = true;
            } else {
                self.append(1, comment.text);
            }
        }
    }

    /// Begins a continued line, when the writer or a comment ended the one before.
    fn go_on(&mut self, gap: &Gap<'_>) -> bool {
        let breaks = self.full || gap.ends_line;
        if breaks {
            let indent = self.indent() + ONWARD;
            self.current.kind = None;
            self.line(indent, false, None);
        }
        breaks
    }

    fn word(&mut self, gap: &Gap<'_>, blanks: usize, text: String) {
        let tight = blanks == 0 && !self.full;
        if !tight && self.go_on(gap) {
            self.cell("onward", 0, text);
        } else {
            self.append(blanks, &text);
        }
    }

    fn clause(&mut self, role: &'static str, gap: &Gap<'_>, blanks: usize, text: String) {
        if self.go_on(gap) {
            self.cell(role, 0, text);
        } else if self.together() {
            self.append(blanks, &text);
        } else {
            self.cell(role, blanks, text);
        }
    }

    fn item(&mut self, piece: &Piece<'a>, gap: &Gap<'_>, text: String) {
        let alone = match piece.join {
            // Timing belongs to the move before it on its line; other timing words share a line.
            Join::Timing => gap.broken || !matches!(self.last, Some("move" | "timing")),
            Join::Entry => gap.ends_line,
            _ => true,
        };
        let first = self.opened;
        let behind_opening = self.together() && first;
        self.last = Some(match piece.join {
            Join::Timing if self.last == Some("move") && !alone => "move",
            Join::Timing => "timing",
            _ if piece.moves => "move",
            _ => "item",
        });
        if self.together() && !self.full {
            self.opened = false;
            self.append(if behind_opening { 1 } else { 2 }, &text);
        } else if self.full || first || alone {
            let kind = if piece.text == "part" {
                "part"
            } else {
                piece.role
            };
            self.line(self.indent(), gap.apart, Some(kind));
            self.cell(piece.role, 0, text);
        } else {
            self.cell(piece.role, 2, text);
        }
    }

    fn open(&mut self, clause: Option<usize>, pieces: &[Piece<'a>], together: bool, text: String) {
        let together = self.together() || together && self.fits(pieces);
        match clause {
            Some(gap) if !self.together() && !self.full => {
                // A block of several lines has no neighbouring clause to keep apart from.
                let gap = if together { gap } else { 1 };
                self.cell("{", gap, text);
            }
            _ if self.full => {
                self.go_on(&Gap::default());
                self.cell("{", 0, text);
            }
            _ => self.append(1, &text),
        }
        self.blocks.push(together);
        self.opened = true;
        self.last = None;
        if !together {
            self.full = true;
            self.current.kind = None;
        }
    }

    /// True when a block fits on the current line.
    fn fits(&self, pieces: &[Piece<'a>]) -> bool {
        let cells = self.current.cells.iter();
        let before: usize = cells.map(|c| c.gap + c.text.chars().count()).sum();
        let blanks = |p: &Piece<'_>| match p.join {
            Join::Tight => 0,
            Join::Item | Join::Timing | Join::Entry => 2,
            _ => 1,
        };
        let block = pieces.iter().map(|p| blanks(p) + p.text.chars().count());
        self.indent() + before + block.sum::<usize>() <= WIDTH
    }

    fn close(&mut self, text: String) {
        let together = self.blocks.pop().unwrap_or(true);
        self.last = Some("item");
        if together && !self.full {
            self.append(1, &text);
        } else {
            let indent = self.indent();
            self.line(indent, false, None);
            self.cell("}", 0, text);
        }
        self.opened = false;
    }
}

/// The kind of line of a statement.
fn kind_of(word: &str) -> &'static str {
    let words = crate::lang::scan::STATEMENTS;
    words
        .into_iter()
        .find(|w| *w == word)
        .unwrap_or("statement")
}

/// The canonical spelling of a word.
fn normal(text: &str) -> String {
    if text.starts_with('#') {
        return text.to_lowercase();
    }
    match text.find([' ', '\t']) {
        // One blank separates a quantity from its unit, however many were written.
        Some(_) if !text.starts_with('"') => text.split_whitespace().collect::<Vec<_>>().join(" "),
        _ => text.to_owned(),
    }
}
