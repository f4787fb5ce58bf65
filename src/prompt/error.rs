//! Errors of a prompt, their messages and exit codes.

use footlight_engine as engine;
use footlight_host::files::FileError;
use footlight_report as report;
use footlight_show::diagnostic::{Diagnostic, Diagnostics, Style};
use footlight_show::printable::Printable;
use footlight_transport::TransportError;

/// Error of a line. The state is then unchanged.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The request is wrong, or does not fit the show.
    #[error("{0}")]
    Usage(String),
    /// The engine or the report failed.
    #[error(transparent)]
    Report(#[from] report::Error),
    /// A device failed: standard input, the terminal.
    #[error("{0}")]
    Device(String),
}

/// A wrong request, with advice.
pub(super) fn usage<T>(message: impl Into<String>) -> Result<T, Error> {
    Err(Error::Usage(message.into()))
}

impl From<engine::Error> for Error {
    fn from(error: engine::Error) -> Error {
        Error::Report(error.into())
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Error {
        engine::Error::from(error).into()
    }
}

impl Error {
    /// The engine's error, if it is one.
    pub fn engine(&self) -> Option<&engine::Error> {
        match self {
            Error::Report(report::Error::Engine(error)) => Some(error),
            _ => None,
        }
    }

    /// The errors of the show, if these are the reason.
    pub fn diagnostics(&self) -> Option<&Diagnostics> {
        match self.engine()? {
            engine::Error::Show(diagnostics) => Some(diagnostics),
            _ => None,
        }
    }

    /// Adds that a refinement runs in the background, requested by these words.
    pub(super) fn busy(self, words: &str) -> Error {
        match self.engine() {
            Some(engine::Error::Busy) => {
                Error::Usage(format!("`{words}` is at work: `wait` for it, or `stop` it"))
            }
            _ => self,
        }
    }

    /// Exit codes: 1 the show has errors, 2 usage, 3 files or devices, 65 tasks of another version,
    /// 70 our own fault, 75 try again, 130 stopped.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) => 2,
            Error::Device(_) => 3,
            Error::Report(error) => match error {
                report::Error::Engine(error) => engine_code(error),
                report::Error::Chart(_) | report::Error::PageData(_) => 3,
                _ => 2,
            },
        }
    }

    /// True when the text, the usage or a file is at fault, so that another save may fix it.
    pub fn is_of_input(&self) -> bool {
        matches!(self.exit_code(), 1..=3)
    }

    /// The whole message, ready to print. In JSON it is always one array.
    pub fn report(&self, style: Style) -> Printable {
        if let Some(diagnostics) = self.diagnostics() {
            return diagnostics.render(style);
        }
        match self {
            _ if style == Style::Json => self.diagnosed().render(style),
            other if other.exit_code() == 130 => format!("{other}\n").into(),
            other => format!("error: {other}\n").into(),
        }
    }

    /// The error as diagnostics; without code and place when the show's text is not involved.
    fn diagnosed(&self) -> Diagnostics {
        self.diagnostics().cloned().unwrap_or_else(|| Diagnostics {
            list: vec![Diagnostic::error("", self.to_string())],
            ..Diagnostics::default()
        })
    }
}

fn engine_code(error: &engine::Error) -> u8 {
    use engine::Error as E;
    match error {
        error if error.is_cancel() => 130,
        E::NotTasks { .. } | E::OtherTasks { .. } => 65,
        E::NotStored(_) => 75,
        E::Show(_) => 1,
        E::File(_) | E::Stage(_) | E::Picture(_) | E::Sketch { .. } | E::TaskLost | E::Farm(_) => 3,
        E::Render(TransportError::Outside(_)) => 3,
        E::Render(_) => 1,
        E::Plan(_) => 70,
        _ => 2,
    }
}
