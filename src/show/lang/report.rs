//! Collects diagnostics, and stops when there are too many to read.

use std::ops::Range;

use crate::diagnostic::{self, Diagnostic, Severity, WARNINGS};

use super::ast::Span;
use super::spans::SpanMap;
use super::{codes, limits};
use crate::model::NodeId;

/// The diagnostics of one run: errors up to a limit, the first warnings by place, and the number
/// left out.
#[derive(Debug, Default)]
pub struct Report {
    found: Vec<Diagnostic>,
    errors: usize,
    left_out: usize,
}

impl Report {
    /// Adds a diagnostic; beyond the limit it is dropped.
    pub fn add(&mut self, diagnostic: Diagnostic) {
        if self.full() {
            return;
        }
        self.errors += usize::from(diagnostic.severity == Severity::Error);
        self.found.push(diagnostic);
        if self.found.len() > 2 * WARNINGS {
            self.leave_out();
        }
    }

    /// Sorts by place, and drops the warnings beyond the limit.
    fn leave_out(&mut self) {
        let place = |d: &Diagnostic| d.labels.first().map(|l| (l.file, l.span.start));
        self.found.sort_by_key(place);
        self.left_out += diagnostic::leave_out(&mut self.found);
    }

    /// Adds an error with its place, and returns `None` for the missing value.
    pub fn error<T>(
        &mut self,
        code: &'static str,
        message: impl Into<String>,
        at: (Span, &str),
        help: impl Into<String>,
    ) -> Option<T> {
        let mut diagnostic = Diagnostic::error(code, message).place(at.0, at.1);
        let help = help.into();
        if !help.is_empty() {
            diagnostic = diagnostic.help(help);
        }
        self.add(diagnostic);
        None
    }

    /// True once there are too many errors to go on.
    pub fn full(&self) -> bool {
        self.errors >= limits::ERRORS
    }

    /// True after an error.
    pub fn failed(&self) -> bool {
        self.errors > 0
    }

    /// The diagnostics kept, sorted by place, and the number of warnings left out.
    pub fn finish(mut self) -> (Vec<Diagnostic>, usize) {
        self.leave_out();
        if self.full() {
            self.found.push(too_many());
        }
        (self.found, self.left_out)
    }
}

/// The diagnostic for errors beyond the limit.
pub fn too_many() -> Diagnostic {
    let message = format!("stopped after {} errors", limits::ERRORS);
    Diagnostic::error(codes::TOO_MANY, message)
}

/// The part of a text in a range of bytes.
///
/// # Errors
/// An internal error when the range is outside the text or splits a character: then the range is
/// wrong, and the text must not be written.
pub fn slice(text: &str, range: Range<usize>) -> Result<&str, Vec<Diagnostic>> {
    let (start, end) = (range.start, range.end);
    text.get(range).ok_or_else(|| {
        let message = format!("internal error: no text at bytes {start} to {end}");
        let help = "nothing was changed; please report this with the show";
        vec![Diagnostic::error(codes::DOES_NOT_FIT, message).help(help)]
    })
}

/// Adds labels by spans of the tree and by nodes of the model.
pub trait Place: Sized {
    /// Adds a labelled place.
    #[must_use]
    fn place(self, span: Span, text: impl Into<String>) -> Self;

    /// Adds the labelled place of a node.
    #[must_use]
    fn place_of(self, id: NodeId, spans: &SpanMap, text: impl Into<String>) -> Self {
        match spans.get(id) {
            Some(span) => self.place(span, text),
            None => self,
        }
    }
}

impl Place for Diagnostic {
    fn place(self, span: Span, text: impl Into<String>) -> Diagnostic {
        self.at(span.file as usize, span.range(), text)
    }
}
