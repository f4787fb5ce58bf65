//! Errors in a designer's words, with the way out that can be typed.

use std::path::PathBuf;

use crate::chart::ChartError;
use crate::engine::{self, ManyKeys};
use crate::files::FileError;
use crate::lang::nearest;
use crate::picture::PictureError;
use crate::playback::page::PageError;
use crate::renderer::TransportError;
use crate::work::Cancelled;

/// Why results could not be written out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The engine could not make them.
    #[error(transparent)]
    Engine(#[from] engine::Error),
    /// A chart could not be drawn.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// The file's ending names no format that this can be written in.
    #[error("`{}` has an ending that cannot be written here; use {known}", path.display())]
    Ending {
        /// The file.
        path: PathBuf,
        /// The endings that can be written.
        known: &'static str,
    },
    /// Data could not be written as JSON.
    #[error("no JSON can be made of it: {0}")]
    Json(#[from] serde_json::Error),
    /// The data of a page could not be written.
    #[error("the page's data: {0}")]
    PageData(serde_json::Error),
    /// Nothing takes files down a pipe here.
    #[error("`-` needs a reader at standard output")]
    NoPipe,
    /// Nothing encodes films here.
    #[error(
        "`{}` is encoded by ffmpeg, which is not installed here: `apt install ffmpeg`, `brew install \
         ffmpeg` or `winget install ffmpeg`; a .html plays in any browser without it",
        .0.display()
    )]
    NoEncoder(PathBuf),
    /// A result would replace a file that the show is read from.
    #[error(
        "`{}` belongs to the show and was not written; choose another name or folder",
        .0.display()
    )]
    ShowsFile(PathBuf),
    /// A result of a run would replace something that no run wrote, or that was changed since.
    #[error(
        "`{}` is not what an earlier run wrote and listed in `files.sha256`; nothing was written: move \
         it away, or choose another folder with -o",
        .0.display()
    )]
    Foreign(PathBuf),
    /// There is no message of this code.
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

/// What to say where there is nothing to render.
const NO_SETUP: &str = "the show has no stage (or surfaces of its own) or no view to render; add \
    them, such as\n  stage \"set.obj\"\n  view house from 0, -12, 1.7 to 0, 0, 2 fov 28 size 640x360";

/// Key images that memory does not hold.
pub fn many_keys(many: &ManyKeys) -> String {
    format!(
        "to play, the show needs {} key images ({} MB), and {} MB are allowed",
        many.keys,
        many.needed.div_ceil(1 << 20),
        many.budget >> 20
    )
}

/// What makes them fewer or smaller.
pub fn fewer_keys(many: &ManyKeys) -> String {
    const NAMED: usize = 4;
    let memory = "a view of a smaller `size` needs less, `--memory MB` allows more";
    let Some((_, bank)) = many.effects.first() else {
        return memory.to_owned();
    };
    let mut names: Vec<String> = Vec::new();
    for (effect, _) in &many.effects {
        let name = format!("`{effect}`");
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let more = names.len().saturating_sub(NAMED);
    names.truncate(NAMED);
    let more = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    let effects = match names.as_slice() {
        [one] => format!("the effect {one} makes"),
        names => format!("the effects {}{more} make", names.join(", ")),
    };
    format!(
        "{effects} most of them, one for every turn: end each where it is no longer seen, with \
         `{bank} effect none` in a cue; {memory}"
    )
}

/// An error of the engine, with the way out.
pub fn engine_error(error: &engine::Error) -> String {
    use engine::Error as E;
    match error {
        E::NoSetup | E::NotRendered => NO_SETUP.to_owned(),
        E::KeyImages(many) => format!("{}; {}", many_keys(many), fewer_keys(many)),
        E::NotYet => {
            "the first pictures are still being rendered: `status` shows how far they are, \
                      `wait` waits for them, `stop now` gives them up"
                .to_owned()
        }
        E::NoSuchView { name, known } => no_view(name, known),
        E::NoSuchBank { name, fixed, known } => no_bank(name, *fixed, known),
        E::CueExists(number) => format!(
            "there is a cue {number} already; take a free number, or type the cue again \
             (`show cue {number}` prints it)"
        ),
        E::LastCue => "the last cue has run: `back`, or `goto` a cue".to_owned(),
        E::NoLevels => "that sets no level: `set lamps 40`".to_owned(),
        E::NothingTried => {
            "nothing is being tried; `set lamps 40` first, then `record 2.5 \"Label\"`".to_owned()
        }
        E::BlindEdits => "there are blind edits and nothing was written: `record` keeps them, \
                          `blind off` drops them; then save"
            .to_owned(),
        E::NoFile => "the show has no file yet; say `save NAME.lxq`".to_owned(),
        E::ChangedOnDisk(path) => format!(
            "{} changed on disk since it was read; nothing was written. `save OTHER.lxq` keeps \
             your edits beside it",
            path.display()
        ),
        E::FileExists(path) => format!(
            "{} exists already and was not written; choose another name",
            path.display()
        ),
        E::NoBackground => "nothing can run in the background here; say it without `&`".to_owned(),
        E::Render(TransportError::Memory {
            what,
            needed,
            budget,
        }) => memory(what, *needed, *budget),
        E::TooManyKeys(error) => format!("{error}: make fewer cues of fewer banks"),
        E::File(FileError::Linked { path, .. }) => format!(
            "{error}, of which the others would keep the old text, and was not written; `cp {path} \
             {path}.own && mv {path}.own {path}` gives it a text of its own"
        ),
        E::File(FileError::NotAFile { kind: "a pipe", .. }) => format!(
            "{error}; only a show itself can come from a pipe, as `-`: `cat show.lxq | footlight \
             check -`"
        ),
        E::NoVersion => {
            "the renderer's pictures have no version, so that no two machines can tell whether \
                         theirs are alike: name one with `--renderer-version`"
                .to_owned()
        }
        E::NoPool => "pictures are stored nowhere: `--pool DIR` names a folder that all machines \
                      share"
            .to_owned(),
        E::PoolLimit { needed, limit } => format!(
            "the pictures of this show take {} MB and the folder may hold {} MB: allow more with \
             `--pool-limit MB`",
            needed.div_ceil(1_000_000),
            limit / 1_000_000
        ),
        E::OtherTasks { what, listed, here } => format!(
            "the tasks are for another {what} ({listed}) than there is here ({here}): nothing was \
             rendered; write them again with `plan --tasks`, with the program and the files that \
             the workers have"
        ),
        E::OutOfTime { seconds } => format!(
            "stopped after {seconds} s, the limit of time; every picture that was finished is \
             kept, and the same again goes on from there (or give it more time: `--time-limit`)"
        ),
        other if other.is_cancel() => {
            "stopped; every picture that was finished for the pool is kept".to_owned()
        }
        other => other.to_string(),
    }
}

/// What does not fit, and how much more would.
fn memory(what: &str, needed: usize, budget: usize) -> String {
    let mega = |bytes: usize| bytes.div_ceil(1 << 20);
    format!(
        "{what}: {} MB are needed and {} MB are left of the memory allowed; allow at least {} MB \
         more with `--memory MB`, or make less of it: a smaller `size` of the view, a simpler \
         stage, fewer lights, banks and cues",
        mega(needed),
        budget >> 20,
        mega(needed.saturating_sub(budget))
    )
}

fn no_view(name: &str, known: &[String]) -> String {
    let names = known.iter().map(String::as_str);
    let hint = match (nearest(name, names.clone()), known.is_empty()) {
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
