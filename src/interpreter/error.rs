//! What can go wrong, and the exit code that belongs to it.

use crate::chart::ChartError;
use crate::diagnostic::{self, Diagnostic, Sources, Style};
use crate::files::FileError;
use crate::picture::PictureError;
use crate::plan::PlanError;
use crate::playback::PlaybackError;
use crate::study::ReferenceError;
use crate::transport::TransportError;
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
}

impl From<PlaybackError> for Error {
    fn from(error: PlaybackError) -> Error {
        match error {
            PlaybackError::Cancelled(c) => c.into(),
            PlaybackError::Plan(p) => p.into(),
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
            Error::Cancelled(_) | Error::Render(TransportError::Cancelled(_)) => 130,
            Error::Render(TransportError::Outside(_)) => 3,
            Error::Render(_) => 1,
            Error::Plan(_) => 70,
            Error::Session { cause, .. } => cause.exit_code(),
        }
    }

    /// The whole message, ready to print.
    pub fn report(&self, style: Style) -> String {
        match self {
            Error::Mistakes(report) => report.render(style),
            Error::Session {
                path,
                line,
                cause,
                before,
            } => format!(
                "{before}error: {path}:{line}: the session ends here; what is above it is done\n{}",
                cause.report(style)
            ),
            other if other.exit_code() == 130 => {
                "stopped; every picture that was finished is kept\n".to_owned()
            }
            other => format!("error: {other}\n"),
        }
    }
}
