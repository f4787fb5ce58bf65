//! Whole cues: writing them from values, copying them.

use super::change::{Action, EditedText, Splice};
use super::place::{self, Key};
use super::sound;
use crate::diagnostic::Diagnostic;
use crate::lang::ast::Declaration;
use crate::lang::format::format;
use crate::lang::quote::quoted;
use crate::lang::{codes, read};
use crate::units::{CueNumber, Time};

/// A cue to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct CueText {
    /// Its number.
    pub number: CueNumber,
    /// Its label; empty for none.
    pub label: String,
    /// Fade-up time; `None` for the show's default.
    pub up: Option<Time>,
    /// Fade-down time; `None` for the show's default.
    pub down: Option<Time>,
    /// Moves as the language writes them, in order: `sky #203060`, `night + { lamps 20 }`.
    pub moves: Vec<String>,
}

impl CueText {
    /// The cue as the language writes it, in its canonical layout.
    ///
    /// # Errors
    /// Diagnostics without places for values that the language does not have, and for a written
    /// move that does not parse.
    pub fn statement(&self) -> Result<String, Vec<Diagnostic>> {
        let time = |time: Time| time.to_string().trim_end_matches('s').to_owned();
        let times = match (self.up, self.down) {
            (Some(up), Some(down)) if up == down => format!("time {}", time(up)),
            (Some(up), Some(down)) => format!("time {}/{}", time(up), time(down)),
            (Some(up), None) => format!("up {}", time(up)),
            (None, Some(down)) => format!("down {}", time(down)),
            (None, None) => String::new(),
        };
        let mut items = vec![times];
        items.extend(self.moves.iter().cloned());
        items.retain(|item| !item.is_empty());
        let label = match self.label.as_str() {
            "" => String::new(),
            label => format!("{} ", quoted(label)),
        };
        let text = format!("cue {} {label}{{ {} }}", self.number, items.join("  "));
        let formatted = only_a_cue(&text).and_then(|()| format(&text));
        formatted
            .map(|text| text.trim_end().to_owned())
            .map_err(without_places)
    }
}

/// Removes the places of diagnostics whose text is not shown.
fn without_places(mut diagnostics: Vec<Diagnostic>) -> Vec<Diagnostic> {
    for diagnostic in &mut diagnostics {
        diagnostic.labels.clear();
    }
    diagnostics
}

/// Checks that a text is a single cue that parses.
fn only_a_cue(text: &str) -> Result<(), Vec<Diagnostic>> {
    let (_, read, _) = read::typed(text)?;
    match read.statements.as_slice() {
        [one] if matches!(one.item, Declaration::Cue(_)) => Ok(()),
        _ => {
            let message = "a cue is one declaration: its moves stand between its braces";
            Err(vec![Diagnostic::error(codes::MISPLACED, message)])
        }
    }
}

/// Copies the cue `from` to the number `to`, without its clock time.
pub fn copy(source: &str, from: CueNumber, to: CueNumber) -> Result<EditedText, Vec<Diagnostic>> {
    let scan = sound(source)?;
    let (cut, _) = place::resolve(&scan.cuts, &format!("cue {from}"))?;
    let key = Key::cue(to);
    if place::find(&scan.cuts, &key).is_some() {
        let message = format!("there is a cue {to} already");
        let help = "copy to a number that no cue has";
        return Err(vec![
            Diagnostic::error(codes::CUE_TWICE, message).help(help),
        ]);
    }
    let mut text = cut.text.to_owned();
    if let Some((_, number)) = place::heading(cut.text) {
        text.replace_range(number, &to.to_string());
    }
    let text = without_clock(&text).unwrap_or(text);
    let indent = place::indent(source, cut.span.start).unwrap_or("");
    let splice = place::added(source, &scan.cuts, &text, &key).indented(indent);
    let changes = vec![key.change(Action::Added)];
    EditedText::new(source, vec![splice], changes)
}

/// The text of a cue without its `at`: a copy has its own place in the order.
fn without_clock(text: &str) -> Option<String> {
    let (_, read, _) = read::typed(text).ok()?;
    let [statement] = read.statements.as_slice() else {
        return None;
    };
    let Declaration::Cue(cue) = &statement.item else {
        return None;
    };
    let before = cue.label.unwrap_or(cue.number).span.end as usize;
    let mut out = text.to_owned();
    out.replace_range(before..cue.at?.span.end as usize, "");
    Some(out)
}

impl Splice {
    /// Indents the new statement after the line end that it may begin with.
    fn indented(mut self, indent: &str) -> Splice {
        let statement = self.text.trim_start().len();
        self.text.insert_str(self.text.len() - statement, indent);
        self
    }
}
