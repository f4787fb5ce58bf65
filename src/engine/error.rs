//! What can go wrong in the engine, as values that a caller can match on. The advice for a person
//! at a prompt is `report`'s.

use std::path::PathBuf;

use super::ManyKeys;

use crate::diagnostic::{Diagnostics, Style};
use crate::files::FileError;
use crate::picture::PictureError;
use crate::plan::PlanError;
use crate::playback::PlaybackError;
use crate::renderer::TransportError;
use crate::scene::import::SceneError;
use crate::timeline::TooManyKeys;
use crate::units::{CueNumber, Time};
use crate::work::Cancelled;

/// Why a call of the engine failed. Nothing has changed then, but that finished images are kept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The show, its stage files or an edit has errors; [`Diagnostics::render`] writes them.
    #[error("{}", .0.render(Style::Plain).trim_end())]
    Show(Diagnostics),
    /// A stage's file cannot be read.
    #[error("{0}")]
    Stage(#[from] SceneError),
    /// The show has more key settings than memory is meant for.
    #[error("the show is too large: {0}")]
    TooManyKeys(#[from] TooManyKeys),
    /// The show has no stage, or no view to look at it from.
    #[error("the show has no stage or no view to render")]
    NoSetup,
    /// No coarse image is rendered yet; see [`Engine::coarse`](super::Engine::coarse).
    #[error("no image is rendered yet")]
    NotRendered,
    /// The background is still rendering the images that are needed; see
    /// [`Engine::be_impatient`](super::Engine::be_impatient).
    #[error("the first pictures are still being rendered")]
    NotYet,
    /// Memory does not hold the key images, without which nothing plays.
    #[error("{} key images need {} bytes, {} are allowed", .0.keys, .0.needed, .0.budget)]
    KeyImages(ManyKeys),
    /// The show has no bank.
    #[error("the show has no bank to render")]
    NoBanks,
    /// There is no bank of this name.
    #[error("there is no bank `{name}`")]
    NoSuchBank {
        /// What was asked for.
        name: String,
        /// Whether it names fixed lights, which are lit all together.
        fixed: bool,
        /// The names there are.
        known: Vec<String>,
    },
    /// There is no view of this name.
    #[error("there is no view `{name}`")]
    NoSuchView {
        /// What was asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// There is no cue of this number.
    #[error("there is no cue {0}")]
    NoSuchCue(CueNumber),
    /// There is a cue of this number already.
    #[error("there is a cue {0} already")]
    CueExists(CueNumber),
    /// The show has no cue.
    #[error("the show has no cue")]
    NoCues,
    /// The last cue has run: nothing follows it.
    #[error("the last cue has run")]
    LastCue,
    /// No cue stands before the current one.
    #[error("there is no cue before this")]
    FirstCue,
    /// A time outside the show.
    #[error("{time} is outside the show, which runs from {start} to {end}")]
    OutsideShow {
        /// What was asked for.
        time: Time,
        /// Where the show begins.
        start: Time,
        /// Where it ends.
        end: Time,
    },
    /// Moves that set no level.
    #[error("that sets no level")]
    NoLevels,
    /// Levels to try were read before an edit, and may belong to other banks now.
    #[error("the levels were read before an edit")]
    StaleMoves,
    /// No level is being tried, so that none can be recorded.
    #[error("no level is being tried")]
    NothingTried,
    /// There are no blind edits to keep or to drop.
    #[error("there are no blind edits")]
    NoBlindEdits,
    /// Blind edits are neither kept nor dropped yet.
    #[error("there are blind edits")]
    BlindEdits,
    /// There is no edit to take back.
    #[error("there is nothing to undo")]
    NothingToUndo,
    /// There is no edit to make again.
    #[error("there is nothing to redo")]
    NothingToRedo,
    /// The document has no file of its own yet.
    #[error("the show has no file yet")]
    NoFile,
    /// The show's file holds something else than what was read or saved last.
    #[error("{} changed on disk since it was read", .0.display())]
    ChangedOnDisk(PathBuf),
    /// Another file is there already.
    #[error("{} exists already", .0.display())]
    FileExists(PathBuf),
    /// A refinement runs in the background already.
    #[error("a refinement is running in the background")]
    Busy,
    /// The host runs nothing in the background.
    #[error("the host runs nothing in the background")]
    NoBackground,
    /// A background task ended without giving its images back.
    #[error("the rendering broke off")]
    TaskLost,
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The operator could not prepare or render; never its cancel, which is
    /// [`Error::Cancelled`].
    #[error(transparent)]
    Render(TransportError),
    /// An image could not be made or read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A reference image is missing or does not fit.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A decomposition failed its own verification.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The operator does not name the version of its images, so that they could not be told apart.
    #[error("the renderer does not name the version of its images")]
    NoVersion,
    /// Images are kept in memory only.
    #[error("images are stored nowhere")]
    NoPool,
    /// The images of a list do not fit into the pool's folder.
    #[error("the images take {needed} bytes, the pool may hold {limit}")]
    PoolLimit {
        /// Bytes of this show's images and of those listed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// A list of tasks cannot be read, or is of another form.
    #[error("`{}` is no list of tasks: {fault}", path.display())]
    NotTasks {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        fault: TaskFault,
    },
    /// A list of tasks was made with another operator or for another scene.
    #[error("the list is of another {what}: {listed}, not {here}")]
    OtherTasks {
        /// What differs.
        what: &'static str,
        /// What the list says.
        listed: String,
        /// What it is here.
        here: String,
    },
    /// An image that was rendered could not be stored.
    #[error("the image was not stored: {0}")]
    NotStored(String),
    /// A farm did not do what it was told.
    #[error("{0}")]
    Farm(String),
    /// The embedding program asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The call took as long as [`Host::time`](super::Host::time) allows.
    #[error("stopped after {seconds} s, the limit of time")]
    OutOfTime {
        /// The limit.
        seconds: f64,
    },
}

/// What is wrong with a list of tasks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TaskFault {
    /// It is not JSON of the form.
    #[error("{0}")]
    Form(String),
    /// It is of another version of the form than that which is read.
    #[error("its schema is {0}, this program reads {1}")]
    Schema(u32, u32),
    /// The scene is no address.
    #[error("its scene is no address")]
    Scene,
    /// Tasks are not numbered from 1.
    #[error("task {0} has another number")]
    Number(usize),
    /// A task's picture is no address.
    #[error("the picture of task {0} is no address")]
    Picture(usize),
    /// A task's setting has another length than the coordinates, or is not finite.
    #[error("the setting of task {0} does not fit the coordinates")]
    Setting(usize),
}

/// Why a reference cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// Neither the picture nor both halves are there.
    #[error(
        "`{}` has no reference for {}: it needs {bank}.exr, or both {bank}_A.exr and \
         {bank}_B.exr; it has {}",
        folder.display(), some(missing, "no bank"), some(files, "no .exr file")
    )]
    Missing {
        /// Where they were looked for.
        folder: PathBuf,
        /// The first bank without one.
        bank: String,
        /// All of them.
        missing: Vec<String>,
        /// The .exr files that are there.
        files: Vec<String>,
    },
    /// It is no picture.
    #[error("`{}`: {source}", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: PictureError,
    },
    /// It has another size than the view.
    #[error(
        "`{}` is {}x{}, the show's view is {}x{}; give the view that size",
        path.display(), found.0, found.1, expected.0, expected.1
    )]
    Size {
        /// The file.
        path: PathBuf,
        /// Its width and height.
        found: (usize, usize),
        /// The view's.
        expected: (usize, usize),
    },
    /// The folder or a file cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The first names of a list, and how many more there are.
fn some(names: &[String], none: &str) -> String {
    const SHOWN: usize = 12;
    let shown = names.get(..SHOWN).unwrap_or(names);
    match names.len() - shown.len() {
        0 if names.is_empty() => none.to_owned(),
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

impl From<TransportError> for Error {
    fn from(error: TransportError) -> Error {
        match error {
            TransportError::Cancelled(c) => c.into(),
            other => Error::Render(other),
        }
    }
}

impl From<PlaybackError> for Error {
    fn from(error: PlaybackError) -> Error {
        match error {
            PlaybackError::Cancelled(c) => c.into(),
            PlaybackError::Plan(p) => p.into(),
            PlaybackError::Memory { needed, budget } => Error::Render(TransportError::Memory {
                what: "the key images",
                needed,
                budget,
            }),
        }
    }
}
