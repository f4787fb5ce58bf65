//! One type for every message about a show's text.
//!
//! A [`Diagnostic`] is data: severity, a stable code, a message, labelled places, help that can be
//! typed. Rendering (plain, coloured, JSON) is separate. This module does not depend on grammars.

mod render;

use std::collections::BTreeMap;
use std::ops::Range;

pub use render::{MOST, Style, render};

use crate::printable::Printable;

/// Number of warnings kept of a text and of its curves; the rest are only counted.
pub const WARNINGS: usize = 1000;

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Legal but probably a mistake.
    Warning,
    /// The show cannot be used.
    Error,
}

/// A place in a source file with a message about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Index of the file in the [`Sources`].
    pub file: usize,
    /// Byte range in that file, on character boundaries.
    pub span: Range<usize>,
    /// A few words shown at the place; may be empty.
    pub text: String,
}

/// One message about the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Stable code, such as `E012` or `W003`; empty when the text is not at fault.
    pub code: &'static str,
    /// The error in one sentence.
    pub message: String,
    /// The places, the main one first.
    pub labels: Vec<Label>,
    /// Advice, in words or in text that can be typed.
    pub help: Vec<String>,
}

/// The texts that labels point into.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<(String, String)>,
}

impl Sources {
    /// Adds a file and returns its index.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> usize {
        self.files.push((name.into(), text.into()));
        self.files.len() - 1
    }

    /// All texts, in the order in which they were added.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|(_, text)| text.as_str())
    }

    /// Name and text of a file.
    pub fn get(&self, file: usize) -> Option<(&str, &str)> {
        self.files.get(file).map(|(n, t)| (n.as_str(), t.as_str()))
    }

    /// Line and column of a byte of a file, such as a [`Label`]'s start, both from 1; the column
    /// counts characters.
    ///
    /// ```
    /// # use footlight_show::diagnostic::Sources;
    /// let mut sources = Sources::default();
    /// let file = sources.add("show.lxq", "show \"X\"\ncue 1 {}\n");
    /// assert_eq!(sources.position(file, 13), (2, 5));
    /// ```
    pub fn position(&self, file: usize, byte: usize) -> (usize, usize) {
        render::Index::of(self).position(file, byte)
    }
}

impl Diagnostic {
    /// An error without places yet.
    pub fn error(code: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Error, code, message.into())
    }

    /// A warning without places yet.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(Severity::Warning, code, message.into())
    }

    fn new(severity: Severity, code: &'static str, message: String) -> Diagnostic {
        Diagnostic {
            severity,
            code,
            message,
            labels: Vec::new(),
            help: Vec::new(),
        }
    }

    /// Adds a place; the first is the main one.
    #[must_use]
    pub fn at(mut self, file: usize, span: Range<usize>, text: impl Into<String>) -> Diagnostic {
        let text = text.into();
        self.labels.push(Label { file, span, text });
        self
    }

    /// Adds a line of help.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Diagnostic {
        self.help.push(help.into());
        self
    }
}

/// Takes the warnings beyond the first [`WARNINGS`] out of a list, and returns how many.
pub(crate) fn leave_out(list: &mut Vec<Diagnostic>) -> usize {
    let (before, mut kept) = (list.len(), 0);
    list.retain(|d| {
        kept += usize::from(d.severity == Severity::Warning);
        d.severity == Severity::Error || kept <= WARNINGS
    });
    before - list.len()
}

/// Diagnostics with the texts that they point into.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    /// Sorted by place.
    pub list: Vec<Diagnostic>,
    /// Number of warnings left out; the list holds the first 1,000.
    pub left_out: usize,
    /// The texts.
    pub sources: Sources,
}

impl Diagnostics {
    /// Diagnostics of one text alone, called `name`.
    pub fn of(list: Vec<Diagnostic>, name: &str, text: &str) -> Diagnostics {
        let mut sources = Sources::default();
        sources.add(name, text);
        Diagnostics {
            list,
            left_out: 0,
            sources,
        }
    }

    /// True when one of them is an error.
    pub fn has_errors(&self) -> bool {
        self.list.iter().any(|d| d.severity == Severity::Error)
    }

    /// Number of warnings, including those left out.
    pub fn warnings(&self) -> usize {
        let listed = self.list.iter();
        let listed = listed.filter(|d| d.severity == Severity::Warning);
        listed.count() + self.left_out
    }

    /// All of them as text; empty when there are none.
    pub fn render(&self, style: Style) -> Printable {
        render::render_some((&self.list, self.left_out), &self.sources, style)
    }

    /// Diagnostics that `before` does not hold: another code, or other words at their places.
    /// Positions in the file are ignored, and so are times and levels in the message, so that an
    /// edit elsewhere makes nothing new.
    #[must_use]
    pub fn new_since(&self, before: &Diagnostics) -> Diagnostics {
        let mut known: BTreeMap<_, usize> = BTreeMap::new();
        for diagnostic in &before.list {
            *known.entry(before.identity(diagnostic)).or_default() += 1;
        }
        let mut new = self.clone();
        new.left_out = 0;
        new.list.retain(|d| match known.get_mut(&self.identity(d)) {
            Some(left) if *left > 0 => {
                *left -= 1;
                false
            }
            _ => true,
        });
        new
    }

    /// The code, and the text at each place.
    fn identity(&self, diagnostic: &Diagnostic) -> (&'static str, Vec<&str>) {
        let text = |label: &Label| self.sources.get(label.file)?.1.get(label.span.clone());
        let places = diagnostic.labels.iter().filter_map(text).collect();
        (diagnostic.code, places)
    }
}
