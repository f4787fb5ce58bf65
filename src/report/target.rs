//! Output formats of a sequence, by the file's extension.
//!
//! A new format needs its encoder, and here a variant, its extension, and an arm in
//! [`Target::write`].

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::film::{Encoder, Outlets, Piped, PlayedSpan};
use super::format::{ending, unknown};
use super::layers::Layers;
use super::numbered::{FrameFormat, Numbered};
use super::{Error, film, layers, page};
use footlight_engine::Engine;
use footlight_engine::playback::{Playback, Player};
use footlight_picture::exr::Precision;
use footlight_picture::tone::Tone;
use footlight_picture::y4m::Chroma;

/// Formats of `play`, as listed in errors.
const KNOWN: &str = "a .mp4 or .webm (film), a .y4m or `-` (raw video), \
    a .html (a page that plays), an .exr (layers), or numbered pictures such as frames/####.png or frame%04d.exr";

/// Output format of `play`.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Video; `None` for the host's pipe.
    Video(Option<PathBuf>, Chroma),
    /// A film in a common format, made by an encoder.
    Film(PathBuf),
    /// A page that plays the show.
    Page(PathBuf),
    /// An image for each frame.
    Numbered(Numbered, FrameFormat),
    /// One OpenEXR file with many images.
    Layers(PathBuf, Layers, Precision),
}

/// Options beyond the file's name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetOptions {
    /// Layers of an .exr without numbers.
    pub layers: Option<Layers>,
    /// Chroma of a video.
    pub chroma: Option<Chroma>,
    /// Precision of an .exr; default half.
    pub precision: Option<Precision>,
}

/// An option without effect on a kind of file, and the kind to which it applies.
pub type Idle = (&'static str, &'static str);

impl Target {
    /// The target for `path`; `-` is the host's pipe.
    pub fn of(path: &Path, options: TargetOptions) -> Result<Target, Error> {
        let place = path.to_owned();
        let precision = options.precision.unwrap_or(Precision::Half);
        let chroma = options.chroma.unwrap_or(Chroma::Quarter);
        let numbered = Numbered::of(&place);
        Ok(match (ending(&place).as_str(), numbered) {
            ("png", Some(numbered)) => Target::Numbered(numbered, FrameFormat::Png),
            ("exr", Some(numbered)) => Target::Numbered(numbered, FrameFormat::Exr(precision)),
            ("y4m", _) => Target::Video(Some(place), chroma),
            ("mp4" | "webm", _) => Target::Film(place),
            ("html" | "htm", _) => Target::Page(place),
            ("exr", _) => Target::Layers(place, options.layers.unwrap_or(Layers::Keys), precision),
            _ if path == Path::new("-") => Target::Video(None, chroma),
            _ => return Err(unknown(&place, KNOWN)),
        })
    }

    /// True when the file is displayed light, so that exposure applies.
    pub fn is_exposed(&self) -> bool {
        !matches!(
            self,
            Target::Layers(..) | Target::Numbered(_, FrameFormat::Exr(_))
        )
    }

    /// True when it has frames, of which a span may be chosen; a page and layers have keys.
    pub fn has_frames(&self) -> bool {
        !matches!(self, Target::Page(_) | Target::Layers(..))
    }

    /// The first option without effect on this kind of file.
    pub fn idle(&self, options: TargetOptions) -> Option<Idle> {
        let layers = matches!(self, Target::Layers(..));
        let video = matches!(self, Target::Video(..));
        let float = layers || matches!(self, Target::Numbered(_, FrameFormat::Exr(_)));
        let given = [
            (
                options.layers.is_some() && !layers,
                ("layers", "an .exr without numbers"),
            ),
            (
                options.chroma.is_some() && !video,
                ("chroma", "a .y4m or `-`"),
            ),
            (options.precision.is_some() && !float, ("float", "an .exr")),
        ];
        given.iter().find(|(idle, _)| *idle).map(|(_, idle)| *idle)
    }
}

/// A sequence to be written.
pub struct Sequence<'e> {
    /// The engine.
    pub engine: &'e Engine,
    /// Its key images.
    pub playback: Arc<Playback>,
    /// The tone mapping.
    pub tone: Tone,
    /// The span to write.
    pub span: PlayedSpan,
}

impl Sequence<'_> {
    /// A player of its frames.
    pub fn player(&self) -> Player {
        Player::new(&self.playback, self.tone, self.engine.host().work())
    }
}

impl Target {
    /// Checks before rendering: numbered images that would replace files of the show, a missing
    /// pipe, and a missing film encoder.
    pub fn check(&self, engine: &Engine, span: PlayedSpan, outlets: &Outlets) -> Result<(), Error> {
        match self {
            Target::Numbered(names, _) => {
                let (document, files) = (engine.document(), engine.host().files.as_ref());
                let mut paths = (1..=film::length(engine, span)).map(|number| names.path(number));
                let own = paths.find(|path| document.reads(path, files));
                own.map_or(Ok(()), |path| Err(Error::ShowsFile(path)))
            }
            Target::Video(None, _) if outlets.pipe.is_none() => Err(Error::NoPipe),
            Target::Film(path) => encoder(path, outlets).map(drop),
            _ => Ok(()),
        }
    }

    /// Writes a sequence; returns a description, and true if it went down the pipe.
    pub fn write(
        &self,
        sequence: &Sequence<'_>,
        outlets: &Outlets,
    ) -> Result<(String, bool), Error> {
        let Sequence {
            engine,
            playback,
            tone,
            span,
            ..
        } = sequence;
        let store = &engine.host().store;
        let whole = |path: &Path, bytes: &[u8], text: String| -> Result<String, Error> {
            store.output(path, bytes)?;
            Ok(format!("{text}\nwrote {}", path.display()))
        };
        let text = match self {
            Target::Video(Some(path), chroma) => {
                let file = store.begin(path)?;
                film::video(engine, (&sequence.player(), *span), *chroma, file, path)?
            }
            Target::Film(path) => {
                let player = sequence.player();
                let file = encoder(path, outlets)?.begin(path)?;
                film::video(engine, (&player, *span), Chroma::Quarter, file, path)?
            }
            Target::Video(None, chroma) => {
                let pipe = outlets.pipe.as_ref().ok_or(Error::NoPipe)?;
                let place = Path::new("standard output");
                let player = sequence.player();
                let file = Box::new(Piped(pipe()));
                let text = film::video(engine, (&player, *span), *chroma, file, place)?;
                return Ok((text, true));
            }
            Target::Numbered(names, kind) => {
                film::numbered(engine, (&sequence.player(), *span), names, *kind)?
            }
            Target::Page(path) => {
                let made = page::page(engine, playback, *tone, page::HEAD_FRAMES)?;
                whole(path, made.html.as_bytes(), made.description())?
            }
            Target::Layers(path, which, precision) => {
                let (bytes, text) = layers::layers(engine, playback, *which, *precision)?;
                whole(path, &bytes, text)?
            }
        };
        Ok((text, false))
    }
}

/// The encoder for a film.
fn encoder<'o>(path: &Path, outlets: &'o Outlets) -> Result<&'o dyn Encoder, Error> {
    let found = outlets.encoder.as_deref().filter(|e| e.is_there());
    found.ok_or_else(|| Error::NoEncoder(path.to_owned()))
}
