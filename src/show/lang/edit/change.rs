//! Result of an edit: the new text and the changes.

use std::fmt;
use std::ops::Range;

use crate::diagnostic::Diagnostic;
use crate::lang::report::slice;

/// A text after an edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditedText {
    /// The whole new text.
    pub source: String,
    /// The changes, in order.
    pub changes: Vec<Change>,
}

/// A piece of the old text and its replacement.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Splice {
    /// Bytes of the old text.
    pub range: Range<usize>,
    /// The replacement.
    pub text: String,
}

/// A change to one declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The word of its statement: `cue`, `bank`, `preview`.
    pub kind: &'static str,
    /// Name, number or path before the edit; empty for `show`, `preview`, `default`.
    pub name: String,
    /// Kind of change.
    pub action: Action,
}

/// Kinds of change to a declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Newly declared.
    Added,
    /// Replaced as a whole.
    Replaced,
    /// Changed in part.
    Updated,
    /// Renamed to this name.
    Renamed(String),
    /// Deleted.
    Removed,
}

impl Change {
    /// The declaration by kind and name: `cue 2.5`, `bank lamps`, `preview`.
    pub fn what(&self) -> String {
        format!("{} {}", self.kind, self.name).trim_end().to_owned()
    }
}

/// One line: `cue 2.5: replaced`.
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
    /// Applies splices that are in order and do not overlap.
    ///
    /// # Errors
    /// An internal error when they overlap, are out of order, or lie outside the text.
    pub(super) fn new(
        source: &str,
        splices: Vec<Splice>,
        changes: Vec<Change>,
    ) -> Result<EditedText, Vec<Diagnostic>> {
        let (mut out, mut at) = (String::new(), 0);
        for Splice { range, text } in splices {
            out.push_str(slice(source, at..range.start)?);
            out.push_str(&text);
            at = range.end;
        }
        out.push_str(slice(source, at..source.len())?);
        Ok(EditedText {
            source: out,
            changes,
        })
    }
}

/// Applies one step of an edit; positions refer to the text after the last step.
///
/// # Errors
/// An internal error when the splice begins or ends inside a character.
pub(super) fn step(now: &mut String, splice: Splice) -> Result<(), Vec<Diagnostic>> {
    slice(now, splice.range.clone())?;
    now.replace_range(splice.range, &splice.text);
    Ok(())
}

/// The smallest replacement that turns one text into another: bytes of `old`, and the new text.
pub fn difference<'n>(old: &str, new: &'n str) -> (Range<usize>, &'n str) {
    let start = common(old.chars(), new.chars());
    let (left, right) = (old.get(start..), new.get(start..));
    let (left, right) = (left.unwrap_or(""), right.unwrap_or(""));
    let tail = common(left.chars().rev(), right.chars().rev());
    let text = right.get(..right.len() - tail).unwrap_or("");
    (start..old.len() - tail, text)
}

/// Bytes of the common prefix of two texts.
fn common(a: impl Iterator<Item = char>, b: impl Iterator<Item = char>) -> usize {
    let same = a.zip(b).take_while(|(a, b)| a == b);
    same.map(|(a, _)| a.len_utf8()).sum()
}
