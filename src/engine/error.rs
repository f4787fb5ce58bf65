//! Errors of the engine, as values for callers; their messages name the line to type at the prompt.

use std::path::PathBuf;

use crate::plan::PlanError;
use crate::playback::PlaybackError;
use footlight_host::files::FileError;
use footlight_host::work::Cancelled;
use footlight_picture::PictureError;
use footlight_show::diagnostic::{Diagnostics, Style};
use footlight_show::lang::nearest;
use footlight_show::timeline::TooManyKeys;
use footlight_show::units::{CueNumber, Time};
use footlight_stage::stage_file::SceneError;
use footlight_transport::TransportError;

/// Error of an engine call. State is unchanged, except that finished images are kept.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The show, its stage files or an edit has errors; [`Diagnostics::render`] writes them.
    #[error("{}", .0.render(Style::Plain).trim_end())]
    Show(Diagnostics),
    /// A stage's file cannot be read.
    #[error("{0}")]
    Stage(#[from] SceneError),
    /// The show has more key settings than the limit.
    #[error("{0}: make fewer cues of fewer banks")]
    TooManyKeys(#[from] TooManyKeys),
    /// The show has no stage or no view.
    #[error("{NO_SETUP}")]
    NoSetup,
    /// No coarse image is rendered yet; see [`Engine::coarse`](super::Engine::coarse).
    #[error("{NO_SETUP}")]
    NotRendered,
    /// The background is still rendering the images needed; see
    /// [`Host::impatient`](super::Host::impatient).
    #[error(
        "the first pictures are still being rendered: `status` shows how far they are, `wait` waits \
         for them, `stop now` gives them up"
    )]
    NotYet,
    /// The show has no bank.
    #[error("the show has no bank to render")]
    NoBanks,
    /// There is no bank of this name.
    #[error("{}", no_bank(name, *fixed, known))]
    NoSuchBank {
        /// The name requested.
        name: String,
        /// True when it names one of the fixed lights, which are lit all together.
        fixed: bool,
        /// The existing names.
        known: Vec<String>,
    },
    /// There is no view of this name.
    #[error("{}", no_view(name, known))]
    NoSuchView {
        /// The name requested.
        name: String,
        /// The existing names.
        known: Vec<String>,
    },
    /// There is no cue of this number.
    #[error("there is no cue {0}")]
    NoSuchCue(CueNumber),
    /// There is a cue of this number already.
    #[error(
        "there is a cue {0} already; take a free number, or type the cue again (`show cue {0}` prints \
         it)"
    )]
    CueExists(CueNumber),
    /// The show has no cue.
    #[error("the show has no cue")]
    NoCues,
    /// The last cue has run.
    #[error("the last cue has run: `back`, or `goto` a cue")]
    LastCue,
    /// The current cue is the first.
    #[error("there is no cue before this")]
    FirstCue,
    /// A time outside the show.
    #[error("{time} is outside the show, which runs from {start} to {end}")]
    OutsideShow {
        /// The time requested.
        time: Time,
        /// Start of the show.
        start: Time,
        /// End of the show.
        end: Time,
    },
    /// Moves that set no level.
    #[error("that sets no level: `set lamps 40`")]
    NoLevels,
    /// Levels to try were read before an edit and may now belong to other banks.
    #[error("the levels were read before an edit")]
    StaleMoves,
    /// No level is being tried that could be recorded.
    #[error("nothing is being tried; `set lamps 40` first, then `record 2.5 \"Label\"`")]
    NothingTried,
    /// There are no blind edits to keep or to drop.
    #[error("there are no blind edits")]
    NoBlindEdits,
    /// Blind edits have to be kept or dropped first.
    #[error(
        "there are blind edits and nothing was written: `record` keeps them, `blind off` drops them; \
         then save"
    )]
    BlindEdits,
    /// There is no edit to revert.
    #[error("there is nothing to undo")]
    NothingToUndo,
    /// There is no reverted edit.
    #[error("there is nothing to redo")]
    NothingToRedo,
    /// The document has no file yet.
    #[error("the show has no file yet; say `save NAME.lxq`")]
    NoFile,
    /// The show's file changed since it was last read or saved.
    #[error(
        "{} changed on disk since it was read; nothing was written. `save OTHER.lxq` keeps your edits \
         beside it",
        .0.display()
    )]
    ChangedOnDisk(PathBuf),
    /// Another file exists.
    #[error("{} exists already and was not written; choose another name", .0.display())]
    FileExists(PathBuf),
    /// A refinement runs in the background already.
    #[error("a refinement is running in the background")]
    Busy,
    /// The host runs nothing in the background.
    #[error("nothing can run in the background here; say it without `&`")]
    NoBackground,
    /// A background task ended without a result.
    #[error("the rendering broke off")]
    TaskLost,
    /// A file could not be read or written.
    #[error("{}", file(.0))]
    File(#[from] FileError),
    /// The operator could not prepare or render; cancellation is [`Error::Cancelled`].
    #[error(transparent)]
    Render(TransportError),
    /// An image could not be made or read.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A sketch is not an image.
    #[error("`{}`: {source}", path.display())]
    Sketch {
        /// The file.
        path: PathBuf,
        /// The reader's error.
        source: PictureError,
    },
    /// No levels come near the target.
    #[error(transparent)]
    Solve(#[from] crate::solve::SolveError),
    /// A decomposition failed its own verification.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The operator gives no version of its images, so that they could not be told apart.
    #[error(
        "the renderer's pictures have no version, so that no two machines can tell whether theirs are \
         alike: name one with `--renderer-version`"
    )]
    NoVersion,
    /// Images are kept only in memory.
    #[error("pictures are stored nowhere: `--pool DIR` names a folder that all machines share")]
    NoPool,
    /// The images of a list do not fit into the pool's folder.
    #[error(
        "the pictures of this show take {} MB and the folder may hold {} MB: allow more with \
         `--pool-limit MB`",
        needed.div_ceil(1_000_000),
        limit / 1_000_000
    )]
    PoolLimit {
        /// Bytes of this show's images and of those listed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// A list of tasks is unreadable, or has another format.
    #[error("`{}` is no list of tasks: {fault}", path.display())]
    NotTasks {
        /// Its file.
        path: PathBuf,
        /// The fault.
        fault: TaskFault,
    },
    /// A list of tasks was made for another operator or scene.
    #[error(
        "the tasks are for another {what} ({listed}) than there is here ({here}): nothing was \
         rendered; write them again with `plan --tasks`, with the program and the files that the \
         workers have"
    )]
    OtherTasks {
        /// The kind of difference.
        what: &'static str,
        /// The list's value.
        listed: String,
        /// The value here.
        here: String,
    },
    /// A rendered image could not be stored.
    #[error("the image was not stored: {0}")]
    NotStored(String),
    /// A farm failed.
    #[error("{0}")]
    Farm(String),
    /// The embedding program cancelled.
    #[error("stopped; every picture that was finished for the pool is kept")]
    Cancelled(#[from] Cancelled),
}

impl Error {
    /// True when the embedding program cancelled the call.
    pub fn is_cancel(&self) -> bool {
        matches!(self, Error::Cancelled(_))
    }
}

/// The missing parts of a show that cannot be rendered.
const NO_SETUP: &str = "the show has no stage (or surfaces of its own) or no view to render; add \
    them, such as\n  stage \"set.obj\"\n  view house from 0, -12, 1.7 to 0, 0, 2 fov 28 size 640x360";

fn file(error: &FileError) -> String {
    match error {
        FileError::Linked { path, .. } => format!(
            "{error}, of which the others would keep the old text, and was not written; `cp {path} \
             {path}.own && mv {path}.own {path}` gives it a text of its own"
        ),
        FileError::NotAFile { kind: "a pipe", .. } => format!(
            "{error}; only a show itself can come from a pipe, as `-`: `cat show.lxq | footlight \
             check -`"
        ),
        other => other.to_string(),
    }
}

fn no_view(name: &str, known: &[String]) -> String {
    let names = known.iter().map(String::as_str);
    let hint = match (nearest(name, names), known.is_empty()) {
        (Some(near), _) => format!("did you mean `{near}`?"),
        (None, false) => "`view` lists those there are".to_owned(),
        (None, true) => "the show declares none: view house from … to … fov …".to_owned(),
    };
    format!("there is no view `{name}`; {hint}")
}

fn no_bank(name: &str, fixed: bool, known: &[String]) -> String {
    if fixed {
        return format!(
            "`{name}` is always on, as all that is fixed: `--bank fixed` is that together"
        );
    }
    let near = nearest(name, known.iter().map(String::as_str));
    let hint = near.map_or_else(|| known.join(", "), |n| format!("did you mean `{n}`?"));
    format!("there is no bank `{name}`: {hint}")
}

/// Fault in a list of tasks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TaskFault {
    /// It is not JSON of this format.
    #[error("{0}")]
    Form(String),
    /// It has another version of the format (found, expected).
    #[error("its schema is {0}, this program reads {1}")]
    Schema(u32, u32),
    /// The scene is not an address.
    #[error("its scene is no address")]
    Scene,
    /// Tasks are not numbered from 1.
    #[error("task {0} has another number")]
    Number(usize),
    /// A task's image is not an address.
    #[error("the picture of task {0} is no address")]
    Picture(usize),
    /// A task's setting does not fit the coordinates, or is not finite.
    #[error("the setting of task {0} does not fit the coordinates")]
    Setting(usize),
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
        }
    }
}
