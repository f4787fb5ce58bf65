//! Edits of a show's text as values, each turned into the smallest change of the text.
//!
//! Invariants: every byte outside the change stays as it is, comments, layout and line ends
//! included; a text whose statements cannot be separated is never edited. Included files are not
//! known here, so the caller parses the edited text and drops it if it has errors.

mod change;
mod cue;
mod moves;
mod place;
mod rename;

pub use change::{Action, Change, EditedText, difference};
pub use cue::CueText;
pub use place::{locate, name};
pub use rename::{NamePlace, names, refused_name};

use super::scan::{self, Scan};
use super::{codes, read};
use crate::diagnostic::Diagnostic;
use crate::units::CueNumber;
use change::{Splice, step};
use place::Key;

/// Declarations in one edit; each costs a pass over the source.
const MOST: usize = 100;

/// An edit of a show's text. It becomes the smallest change of the text; a document of
/// `footlight-engine` applies it.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Declarations as the language writes them. Each replaces the one of its kind and name (a cue:
    /// of its number; `show`, `preview`, `default`: the only one) in its place. A new declaration
    /// goes after its kind, a new cue into the order of numbers.
    Declare(String),
    /// A whole cue; it replaces the cue of its number if there is one.
    SetCue(CueText),
    /// Moves as the language writes them. Each replaces the cue's move of the same target, or is
    /// added.
    UpdateMoves {
        /// The cue.
        cue: CueNumber,
        /// `lamps 40  sky #203060`.
        moves: String,
    },
    /// Copies a cue to another number, at its place in the order and without its clock time.
    CopyCue {
        /// A cue of the text.
        from: CueNumber,
        /// A number that no cue has.
        to: CueNumber,
    },
    /// Renames a view, light, bank, `fixed`, group, look, curve or value, where it is declared and
    /// wherever the text uses it.
    Rename {
        /// A name that the text declares.
        from: String,
        /// A name not yet in use.
        to: String,
    },
    /// Removes the declaration that these words name: `cue 2.5`, `bank lamps`, `preview`.
    Remove(String),
}

/// Returns `source` after an edit.
///
/// # Errors
/// Diagnostics, with places in the text of an [`Edit::Declare`] (as file 0) when that does not
/// parse; otherwise without places. The source is unchanged.
pub fn apply(source: &str, edit: &Edit) -> Result<EditedText, Vec<Diagnostic>> {
    match edit {
        Edit::Declare(statements) => declare(source, statements),
        Edit::SetCue(cue) => declare(source, &cue.statement()?),
        Edit::UpdateMoves { cue, moves } => moves::update_moves(source, *cue, moves),
        Edit::CopyCue { from, to } => cue::copy(source, *from, *to),
        Edit::Rename { from, to } => rename::rename(source, from, to),
        Edit::Remove(what) => remove(source, what),
    }
}

fn declare(source: &str, statements: &str) -> Result<EditedText, Vec<Diagnostic>> {
    let (scan, typed, _) = read::typed(statements)?;
    if typed.statements.is_empty() {
        let message = "there is no declaration in this";
        return Err(vec![Diagnostic::error(codes::EMPTY, message)]);
    }
    if typed.statements.len() > MOST {
        let message = format!("more than {MOST} declarations at once");
        return Err(vec![Diagnostic::error(codes::TOO_LARGE, message)]);
    }
    let mut now = source.to_owned();
    let mut changes = Vec::new();
    for cut in scan.cuts {
        let Some(key) = Key::of(cut.text) else {
            continue;
        };
        let scan = sound(&now)?;
        let (splice, action) = match place::find(&scan.cuts, &key) {
            Some(old) => (place::replaced(&now, old, cut.text), Action::Replaced),
            None => (
                place::added(&now, &scan.cuts, cut.text, &key),
                Action::Added,
            ),
        };
        step(&mut now, splice)?;
        changes.push(key.change(action));
    }
    Ok(EditedText {
        source: now,
        changes,
    })
}

fn remove(source: &str, what: &str) -> Result<EditedText, Vec<Diagnostic>> {
    let scan = sound(source)?;
    let (cut, key) = place::resolve(&scan.cuts, what)?;
    let splice = Splice {
        range: place::with_line(source, cut.span.clone()),
        text: String::new(),
    };
    EditedText::new(source, vec![splice], vec![key.change(Action::Removed)])
}

/// The statements of a text whose braces, quotes and comments are closed.
fn sound(source: &str) -> Result<Scan<'_>, Vec<Diagnostic>> {
    let scan = scan::scan(source);
    if scan.faults.is_empty() {
        return Ok(scan);
    }
    let message = "the show's own text has open braces, quotes or comments";
    let help = "mend the file first; `check` shows where";
    Err(vec![Diagnostic::error(codes::UNCLOSED, message).help(help)])
}

#[cfg(test)]
mod tests;
