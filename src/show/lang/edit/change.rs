//! What an edit came to: the new text, what changed, and where.
//!
//! Invariants: splices are in order, do not touch each other, lie on character boundaries of the
//! old text, and begin and end with a character that differs, as far as both sides have one. Several
//! declarations or moves in one edit are one splice.

use std::fmt;
use std::ops::Range;

use crate::diagnostic::Diagnostic;
use crate::lang::report::slice;

/// A text after an edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditedText {
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

impl EditedText {
    /// The old text, and what several steps made of it, as one splice.
    pub(super) fn whole(
        source: &str,
        now: String,
        changes: Vec<Change>,
    ) -> Result<EditedText, Vec<Diagnostic>> {
        let range = 0..source.len();
        EditedText::new(source, vec![Splice { range, text: now }], changes)
    }

    /// The text with these splices, which are in order and do not overlap.
    ///
    /// # Errors
    /// An internal error where they are not, or lie outside the text.
    pub(super) fn new(
        source: &str,
        splices: Vec<Splice>,
        changes: Vec<Change>,
    ) -> Result<EditedText, Vec<Diagnostic>> {
        let (mut out, mut at, mut differing) = (String::new(), 0, Vec::new());
        for Splice { range, text } in splices {
            let (inner, text) = difference(slice(source, range.clone())?, &text);
            let inner = range.start + inner.start..range.start + inner.end;
            out.push_str(slice(source, at..inner.start)?);
            out.push_str(text);
            at = inner.end;
            if !inner.is_empty() || !text.is_empty() {
                differing.push(Splice {
                    range: inner,
                    text: text.to_owned(),
                });
            }
        }
        out.push_str(slice(source, at..source.len())?);
        Ok(EditedText {
            source: out,
            changes,
            splices: differing,
        })
    }
}

/// Makes one step of an edit, in places of the text as the last step left it.
///
/// # Errors
/// An internal error where the splice begins or ends inside a character.
pub(super) fn step(now: &mut String, splice: Splice) -> Result<(), Vec<Diagnostic>> {
    slice(now, splice.range.clone())?;
    now.replace_range(splice.range, &splice.text);
    Ok(())
}

/// The smallest replacement that turns one text into another: bytes of `old`, and the text that
/// takes their place.
pub fn difference<'n>(old: &str, new: &'n str) -> (Range<usize>, &'n str) {
    let start = common(old.chars(), new.chars());
    let (left, right) = (old.get(start..), new.get(start..));
    let (left, right) = (left.unwrap_or(""), right.unwrap_or(""));
    let tail = common(left.chars().rev(), right.chars().rev());
    let text = right.get(..right.len() - tail).unwrap_or("");
    (start..old.len() - tail, text)
}

/// Bytes of the characters that two texts begin with.
fn common(a: impl Iterator<Item = char>, b: impl Iterator<Item = char>) -> usize {
    let same = a.zip(b).take_while(|(a, b)| a == b);
    same.map(|(a, _)| a.len_utf8()).sum()
}
