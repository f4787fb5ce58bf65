//! What an edit came to: the new text, what changed, and where.
//!
//! Invariants: splices are in order, do not touch each other, lie on character boundaries of the
//! old text, and begin and end with a character that differs, as far as both sides have one.

use std::fmt;
use std::ops::Range;

use crate::diagnostic::Diagnostic;
use crate::lang::report::slice;

/// A text after an edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edited {
    /// The whole new text.
    pub source: String,
    /// What was done, in order.
    pub changes: Vec<Change>,
    /// The difference to the old text, in order.
    pub splices: Vec<Splice>,
}

/// A piece of the old text and what stands there now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Splice {
    /// Bytes of the old text.
    pub range: Range<usize>,
    /// What takes their place.
    pub text: String,
}

/// What happened to one declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The word of its statement: `cue`, `bank`, `preview`.
    pub kind: &'static str,
    /// Its name, number or path, as it was before; empty for `show`, `preview`, `default`.
    pub name: String,
    /// What was done to it.
    pub action: Action,
}

/// What can happen to a declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Action {
    /// It is new.
    Added,
    /// It stood there already, and is another as a whole.
    Replaced,
    /// A piece of it is another.
    Updated,
    /// It has this name now.
    Renamed(String),
    /// It is gone.
    Removed,
}

impl Change {
    /// The declaration by kind and name: `cue 2.5`, `bank lamps`, `preview`.
    pub fn what(&self) -> String {
        format!("{} {}", self.kind, self.name).trim_end().to_owned()
    }
}

/// As a line: `cue 2.5: replaced`.
impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = self.what();
        match &self.action {
            Action::Added => write!(f, "{what}: added"),
            Action::Replaced => write!(f, "{what}: replaced"),
            Action::Updated => write!(f, "{what}: updated"),
            Action::Renamed(name) => write!(f, "{what}: renamed to {name}"),
            Action::Removed => write!(f, "{what}: removed"),
        }
    }
}

impl Edited {
    /// The text with these splices, which are in order and do not overlap.
    ///
    /// # Errors
    /// An internal error where they are not, or lie outside the text.
    pub(super) fn new(
        source: &str,
        splices: Vec<Splice>,
        changes: Vec<Change>,
    ) -> Result<Edited, Vec<Diagnostic>> {
        let mut differing = Vec::with_capacity(splices.len());
        let mut out = String::with_capacity(source.len());
        let mut at = 0;
        for splice in splices {
            let old = slice(source, splice.range.clone())?;
            let Some(splice) = shrunk(old, splice) else {
                continue;
            };
            out.push_str(slice(source, at..splice.range.start)?);
            out.push_str(&splice.text);
            at = splice.range.end;
            differing.push(splice);
        }
        out.push_str(slice(source, at..source.len())?);
        Ok(Edited {
            source: out,
            changes,
            splices: differing,
        })
    }
}

/// The splice of the text `old` without what is the same before and after at its ends; `None` when
/// all is.
fn shrunk(old: &str, mut splice: Splice) -> Option<Splice> {
    let head = common(old.chars(), splice.text.chars());
    let (old, new) = (old.get(head..)?, splice.text.get(head..)?);
    let tail = common(old.chars().rev(), new.chars().rev());
    let text = new.get(..new.len() - tail)?.to_owned();
    splice.range = splice.range.start + head..splice.range.end - tail;
    splice.text = text;
    (!(splice.range.is_empty() && splice.text.is_empty())).then_some(splice)
}

/// Bytes of the characters that two texts begin with.
fn common(a: impl Iterator<Item = char>, b: impl Iterator<Item = char>) -> usize {
    let same = a.zip(b).take_while(|(a, b)| a == b);
    same.map(|(a, _)| a.len_utf8()).sum()
}

/// A text that is edited step by step, each step in places of the text as the last one left it.
pub(super) struct Draft<'s> {
    source: &'s str,
    pieces: Vec<Piece<'s>>,
}

enum Piece<'s> {
    /// A part of the old text, and the byte at which it begins there.
    Old(usize, &'s str),
    New(String),
}

impl<'s> Piece<'s> {
    fn text(&self) -> &str {
        match self {
            Piece::Old(_, text) => text,
            Piece::New(text) => text,
        }
    }

    /// A part of the piece, in bytes from its start.
    fn part(&self, range: Range<usize>) -> Result<Piece<'s>, Vec<Diagnostic>> {
        Ok(match self {
            Piece::Old(start, old) => Piece::Old(start + range.start, slice(old, range)?),
            Piece::New(text) => Piece::New(slice(text, range)?.to_owned()),
        })
    }
}

impl<'s> Draft<'s> {
    pub fn new(source: &'s str) -> Draft<'s> {
        let pieces = vec![Piece::Old(0, source)];
        Draft { source, pieces }
    }

    /// The text as it is now.
    pub fn text(&self) -> String {
        self.pieces.iter().map(Piece::text).collect()
    }

    /// Changes the text as it is now.
    ///
    /// # Errors
    /// An internal error where the splice begins or ends inside a character.
    pub fn splice(&mut self, splice: Splice) -> Result<(), Vec<Diagnostic>> {
        let mut pieces = self.parts(0..splice.range.start)?;
        pieces.push(Piece::New(splice.text));
        pieces.extend(self.parts(splice.range.end..usize::MAX)?);
        self.pieces = pieces;
        Ok(())
    }

    /// The pieces of a range of the text as it is now.
    fn parts(&self, range: Range<usize>) -> Result<Vec<Piece<'s>>, Vec<Diagnostic>> {
        let (mut at, mut out) = (0, Vec::new());
        for piece in &self.pieces {
            let end = at + piece.text().len();
            let (from, to) = (range.start.clamp(at, end), range.end.clamp(at, end));
            if from < to {
                out.push(piece.part(from - at..to - at)?);
            }
            at = end;
        }
        Ok(out)
    }

    /// All changes as one step from the old text.
    pub fn splices(&self) -> Vec<Splice> {
        let (mut at, mut text, mut out) = (0, String::new(), Vec::new());
        let end = Piece::Old(self.source.len(), "");
        for piece in self.pieces.iter().chain([&end]) {
            match piece {
                Piece::New(new) => text.push_str(new),
                Piece::Old(start, old) => {
                    if *start > at || !text.is_empty() {
                        out.push(Splice {
                            range: at..*start,
                            text: std::mem::take(&mut text),
                        });
                    }
                    at = start + old.len();
                }
            }
        }
        out
    }
}
