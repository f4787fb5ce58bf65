//! What an edit came to: the new text, what changed, and where.
//!
//! Invariants: splices are in order, do not touch each other, lie on character boundaries of the
//! old text, and begin and end with a character that differs, as far as both sides have one.

use std::fmt;
use std::ops::Range;

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
    pub(super) fn new(source: &str, splices: Vec<Splice>, changes: Vec<Change>) -> Edited {
        let splices: Vec<Splice> = splices
            .into_iter()
            .filter_map(|splice| shrunk(source, splice))
            .collect();
        let mut out = String::with_capacity(source.len());
        let mut at = 0;
        for splice in &splices {
            out.push_str(source.get(at..splice.range.start).unwrap_or(""));
            out.push_str(&splice.text);
            at = splice.range.end;
        }
        out.push_str(source.get(at..).unwrap_or(""));
        Edited {
            source: out,
            changes,
            splices,
        }
    }
}

/// The splice without what is the same before and after at its ends; `None` when all is.
fn shrunk(source: &str, mut splice: Splice) -> Option<Splice> {
    let old = source.get(splice.range.clone()).unwrap_or("");
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
    pieces: Vec<Piece>,
}

enum Piece {
    /// Bytes of the old text.
    Old(Range<usize>),
    New(String),
}

impl Piece {
    fn len(&self) -> usize {
        match self {
            Piece::Old(range) => range.len(),
            Piece::New(text) => text.len(),
        }
    }

    /// A part of the piece, in bytes from its start.
    fn part(&self, range: Range<usize>) -> Piece {
        match self {
            Piece::Old(old) => Piece::Old(old.start + range.start..old.start + range.end),
            Piece::New(text) => Piece::New(text.get(range).unwrap_or("").to_owned()),
        }
    }
}

impl<'s> Draft<'s> {
    pub fn new(source: &'s str) -> Draft<'s> {
        let pieces = vec![Piece::Old(0..source.len())];
        Draft { source, pieces }
    }

    /// The text as it is now.
    pub fn text(&self) -> String {
        let text = |piece: &Piece| match piece {
            Piece::Old(range) => self.source.get(range.clone()).unwrap_or("").to_owned(),
            Piece::New(text) => text.clone(),
        };
        self.pieces.iter().map(text).collect()
    }

    /// Changes the text as it is now.
    pub fn splice(&mut self, splice: Splice) {
        let mut pieces = self.parts(0..splice.range.start);
        pieces.push(Piece::New(splice.text));
        pieces.extend(self.parts(splice.range.end..usize::MAX));
        self.pieces = pieces;
    }

    /// The pieces of a range of the text as it is now.
    fn parts(&self, range: Range<usize>) -> Vec<Piece> {
        let (mut at, mut out) = (0, Vec::new());
        for piece in &self.pieces {
            let end = at + piece.len();
            let (from, to) = (range.start.clamp(at, end), range.end.clamp(at, end));
            if from < to {
                out.push(piece.part(from - at..to - at));
            }
            at = end;
        }
        out
    }

    /// All changes as one step from the old text.
    pub fn splices(&self) -> Vec<Splice> {
        let (mut at, mut text, mut out) = (0, String::new(), Vec::new());
        let end = Piece::Old(self.source.len()..self.source.len());
        for piece in self.pieces.iter().chain([&end]) {
            match piece {
                Piece::New(new) => text.push_str(new),
                Piece::Old(old) => {
                    if old.start > at || !text.is_empty() {
                        out.push(Splice {
                            range: at..old.start,
                            text: std::mem::take(&mut text),
                        });
                    }
                    at = old.end;
                }
            }
        }
        out
    }
}
