//! Errors of reports.

use std::path::PathBuf;

use crate::chart::ChartError;
use footlight_engine as engine;
use footlight_engine::playback::page::PageError;
use footlight_host::files::FileError;
use footlight_host::work::Cancelled;
use footlight_picture::PictureError;

/// Reason why results could not be written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The engine failed.
    #[error(transparent)]
    Engine(#[from] engine::Error),
    /// A chart could not be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// The file's extension names no format for this result.
    #[error("`{}` has an ending that cannot be written here; use {known}", path.display())]
    Ending {
        /// The file.
        path: PathBuf,
        /// The valid extensions.
        known: &'static str,
    },
    /// Data could not be written as JSON.
    #[error("no JSON can be made of it: {0}")]
    Json(#[from] serde_json::Error),
    /// The data of a page could not be written.
    #[error("the page's data: {0}")]
    PageData(serde_json::Error),
    /// The host has no pipe for output.
    #[error(
        "`-` needs a reader at standard output: footlight film show.lxq -o - | ffmpeg -i - show.mp4"
    )]
    NoPipe,
    /// The host has no film encoder.
    #[error(
        "`{}` is encoded by ffmpeg, which is not installed here: `apt install ffmpeg`, `brew install \
         ffmpeg` or `winget install ffmpeg`; a .html plays in any browser without it",
        .0.display()
    )]
    NoEncoder(PathBuf),
    /// A result would replace a file of the show.
    #[error(
        "`{}` belongs to the show and was not written; choose another name or folder",
        .0.display()
    )]
    ShowsFile(PathBuf),
    /// A result would replace a file that no run wrote, or that was changed since.
    #[error(
        "`{}` is not what an earlier run wrote and listed in `files.sha256`; nothing was written: move \
         it away, or choose another folder with -o",
        .0.display()
    )]
    Foreign(PathBuf),
    /// There is no message with this code.
    #[error("{0}")]
    NoSuchCode(String),
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Error {
        engine::Error::from(error).into()
    }
}

impl From<PictureError> for Error {
    fn from(error: PictureError) -> Error {
        engine::Error::from(error).into()
    }
}

impl From<Cancelled> for Error {
    fn from(error: Cancelled) -> Error {
        engine::Error::from(error).into()
    }
}

impl From<PageError> for Error {
    fn from(error: PageError) -> Error {
        match error {
            PageError::Cancelled(c) => c.into(),
            PageError::Picture(p) => p.into(),
            PageError::Data(e) => Error::PageData(e),
        }
    }
}
