//! Shows and rigs of other programs, in and out: lighting desks, plans, the lighting network.
//!
//! ```text
//! bytes of a foreign file --import--> text of a show, losses
//! Show, Timeline --write--> foreign file, losses        levels --patch--> wire --> packets
//! ```
//!
//! - [`usitt`] reads and writes USITT ASCII 3.0, the exchange format of desks. [`qlc`] writes
//!   workspaces of QLC+.
//! - [`mvr`] reads the rig of a plan (MVR with GDTF).
//! - [`performance`] runs a [`Show`] like an operator: cues start on GO.
//! - [`patch`] gives banks and heads their addresses. [`wire`] makes packets of E1.31 and Art-Net;
//!   [`osc`] reads and writes messages of Open Sound Control.
//! - [`Loss`] describes something that the other format cannot hold, or only approximately.
//!
//! Invariants:
//!
//! - Nothing is dropped without a [`Loss`] in the list returned with the result.
//! - No count in a file is trusted for memory. Bad input becomes a [`Diagnostic`] with its line.
//! - Nothing here opens a file or a socket: readers take bytes, writers return bytes.
//!
//! This crate does not know images, light transport or the engine. It imports only crates above it in the
//! table of `footlight`.
//!
//! [`Show`]: footlight_show::model::Show
//! [`Diagnostic`]: footlight_show::diagnostic::Diagnostic

pub mod mvr;
mod names;
pub mod osc;
pub mod patch;
pub mod performance;
pub mod qlc;
pub mod usitt;
pub mod wire;

#[cfg(test)]
mod tests;

use std::fmt;

use serde::Serialize;

use footlight_host::work::Cancelled;
use footlight_show::diagnostic::Diagnostic;
use footlight_show::model::{Show, Trigger};
use footlight_show::timeline::TimelineError;

/// Something that the other format cannot hold, or only approximately.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loss {
    /// Line in the file read, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// The cue's number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cue: Option<String>,
    /// A description.
    pub what: String,
}

impl Loss {
    /// A loss without a place.
    pub fn new(what: impl Into<String>) -> Loss {
        Loss {
            line: None,
            cue: None,
            what: what.into(),
        }
    }

    /// Clock times of cues, which wait for GO at a desk.
    fn of_clock_times(show: &Show) -> Option<Loss> {
        let clocked = show.cues.iter();
        let clocked = clocked.filter(|cue| matches!(cue.trigger, Trigger::At(_)));
        let numbers: Vec<String> = clocked.map(|cue| cue.number.to_string()).collect();
        let what = || {
            let numbers = numbers.join(" ");
            format!("clock times (`at`) of cues {numbers}: they wait for GO")
        };
        (!numbers.is_empty()).then(|| Loss::new(what()))
    }

    /// Sets the line.
    #[must_use]
    pub fn line(mut self, line: usize) -> Loss {
        self.line = Some(line);
        self
    }

    /// Sets the cue.
    #[must_use]
    pub fn cue(mut self, cue: impl fmt::Display) -> Loss {
        self.cue = Some(cue.to_string());
        self
    }
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, &self.cue) {
            (Some(line), Some(cue)) => write!(f, "line {line}, cue {cue}: ")?,
            (Some(line), None) => write!(f, "line {line}: ")?,
            (None, Some(cue)) => write!(f, "cue {cue}: ")?,
            (None, None) => {}
        }
        f.write_str(&self.what)
    }
}

/// Reason why a foreign file is not imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// It cannot be read.
    #[error("the file cannot be read")]
    Refused(Box<Diagnostic>),
    /// The user cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<Box<Diagnostic>> for ImportError {
    fn from(diagnostic: Box<Diagnostic>) -> ImportError {
        ImportError::Refused(diagnostic)
    }
}

/// Reason why a show is not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The cues make no timeline.
    #[error("the cues make no timeline")]
    Timeline(Vec<TimelineError>),
    /// The user cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<Vec<TimelineError>> for ExportError {
    fn from(errors: Vec<TimelineError>) -> ExportError {
        ExportError::Timeline(errors)
    }
}

/// Text of a foreign file, with the parts of the show that it does not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// The text.
    pub text: String,
    /// The losses.
    pub losses: Vec<Loss>,
}
