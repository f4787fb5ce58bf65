//! What can go wrong, and the exit code that belongs to it.

use std::collections::BTreeMap;

use crate::chart::ChartError;
use crate::diagnostic::{self, Diagnostic, Label, Sources, Style};
use crate::files::FileError;
use crate::picture::PictureError;
use crate::plan::PlanError;
use crate::playback::PlaybackError;
use crate::playback::page::PageError;
use crate::renderer::TransportError;
use crate::study::ReferenceError;
use crate::work::Cancelled;

/// Mistakes or warnings, with the texts they point into.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// What there is to say.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts.
    pub sources: Sources,
}

impl Report {
    /// The whole report as text; empty when there is nothing to say.
    pub fn render(&self, style: Style) -> String {
        diagnostic::render(&self.diagnostics, &self.sources, style)
    }

    /// What `before` does not say already: of the same kind, of the same words at the same places.
    /// Where they stand in the file plays no part, nor do the times and levels in the message, so
    /// that an edit elsewhere makes nothing new.
    pub(super) fn news(&self, before: &Report) -> Report {
        let mut told: BTreeMap<_, usize> = BTreeMap::new();
        for diagnostic in &before.diagnostics {
            *told.entry(before.about(diagnostic)).or_default() += 1;
        }
        let mut news = self.clone();
        news.diagnostics
            .retain(|d| match told.get_mut(&self.about(d)) {
                Some(left) if *left > 0 => {
                    *left -= 1;
                    false
                }
                _ => true,
            });
        news
    }

    /// The code, and the text at each place.
    fn about(&self, diagnostic: &Diagnostic) -> (&'static str, Vec<&str>) {
        let text = |label: &Label| self.sources.get(label.file)?.1.get(label.span.clone());
        let places = diagnostic.labels.iter().filter_map(text).collect();
        (diagnostic.code, places)
    }
}

/// Why a verb could not be done. Nothing has changed then.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The show has errors.
    #[error("the show has errors")]
    Mistakes(Report),
    /// The request itself is wrong, or does not fit the show.
    #[error("{0}")]
    Usage(String),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A device failed: standard input, the terminal.
    #[error("{0}")]
    Device(String),
    /// The operator could not prepare or render.
    #[error(transparent)]
    Render(#[from] TransportError),
    /// A picture could not be made or read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A chart could not be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A reference picture is missing or does not fit.
    #[error(transparent)]
    Study(#[from] ReferenceError),
    /// A decomposition failed its own verification.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A line of a session could not be done; what was done before it is kept.
    #[error("{path}:{line}: {cause}")]
    Session {
        /// The file of commands.
        path: String,
        /// Where the command begins, from 1.
        line: usize,
        /// What is wrong with it.
        cause: Box<Error>,
        /// What the session tells of the lines before.
        before: String,
    },
    /// The embedding program asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// It took as long as the embedding program allows.
    #[error(
        "stopped after {seconds} s, the limit of time; every picture that was finished is kept, and \
         the same again goes on from there (or give it more time: `--time-limit`)"
    )]
    OutOfTime {
        /// The limit.
        seconds: f64,
    },
}

impl From<PlaybackError> for Error {
    fn from(error: PlaybackError) -> Error {
        match error {
            PlaybackError::Cancelled(c) => c.into(),
            PlaybackError::Plan(p) => p.into(),
        }
    }
}

impl From<PageError> for Error {
    fn from(error: PageError) -> Error {
        match error {
            PageError::Cancelled(c) => c.into(),
            PageError::Picture(p) => p.into(),
            PageError::Data(e) => Error::Device(format!("the page's data: {e}")),
        }
    }
}

impl Error {
    /// 1 the show has errors, 2 usage, 3 files or devices, 70 our own fault, 130 stopped.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Mistakes(_) => 1,
            Error::Usage(_) => 2,
            Error::File(_)
            | Error::Device(_)
            | Error::Picture(_)
            | Error::Chart(_)
            | Error::Study(_) => 3,
            Error::Cancelled(_)
            | Error::OutOfTime { .. }
            | Error::Render(TransportError::Cancelled(_)) => 130,
            Error::Render(TransportError::Outside(_)) => 3,
            Error::Render(_) => 1,
            Error::Plan(_) => 70,
            Error::Session { cause, .. } => cause.exit_code(),
        }
    }

    /// The whole message, ready to print. As JSON it is one array whatever went wrong; what a
    /// session measured before the line that ended it is no part of that.
    pub fn report(&self, style: Style) -> String {
        match self {
            Error::Mistakes(report) => report.render(style),
            _ if style == Style::Json => self.diagnosed().render(style),
            Error::Session { cause, before, .. } => {
                format!(
                    "{before}error: {}\n{}",
                    self.sentence(),
                    cause.report(style)
                )
            }
            other if other.exit_code() == 130 => format!("{}\n", other.sentence()),
            other => format!("error: {}\n", other.sentence()),
        }
    }

    /// What happened, without what caused it.
    fn sentence(&self) -> String {
        match self {
            Error::Session { path, line, .. } => {
                format!("{path}:{line}: the session ends here; what is above it is done")
            }
            Error::OutOfTime { .. } => self.to_string(),
            other if other.exit_code() == 130 => {
                "stopped; every picture that was finished for the pool is kept".to_owned()
            }
            other => other.to_string(),
        }
    }

    /// The error as diagnostics; one without code and place where the show's text has no part.
    fn diagnosed(&self) -> Report {
        if let Error::Mistakes(report) = self {
            return report.clone();
        }
        let mut report = match self {
            Error::Session { cause, .. } => cause.diagnosed(),
            _ => Report::default(),
        };
        let said = Diagnostic::error("", self.sentence());
        report.diagnostics.insert(0, said);
        report
    }
}
