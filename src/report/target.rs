//! What a sequence is written as, by the ending of the file's name.
//!
//! A new format is its encoder and its row here: a variant, its ending, and its arm in
//! [`Target::write`].

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::film::{Encoder, Outlets, Piped, Span};
use super::format::{ending, unknown};
use super::{Error, film, layers, page};
use footlight_engine::Engine;
use footlight_engine::playback::{Playback, Player};
use footlight_picture::exr::Precision;
use footlight_picture::tone::Tone;
use footlight_picture::y4m::Chroma;

/// What `play` can write, as its errors say it.
const KNOWN: &str = "a .mp4 or .webm (film), a .y4m or `-` (raw video), \
    a .html (a page that plays), an .exr (layers), or numbered pictures such as frames/####.png or frame%04d.exr";

/// What `play` writes.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Video; `None` goes down the host's pipe.
    Video(Option<PathBuf>, Chroma),
    /// A film that players take, made by an encoder.
    Film(PathBuf),
    /// A page that plays the show.
    Page(PathBuf),
    /// A picture for each frame.
    Numbered(Numbered, Kind),
    /// One OpenEXR file with many pictures.
    Layers(PathBuf, Layers, Precision),
}

/// What a numbered picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// As displayed.
    Png,
    /// Linear.
    Exr(Precision),
}

/// Which pictures are layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// Every key image.
    Keys,
    /// Every coordinate alone at full, as previews have it.
    Banks,
    /// The refined pictures; where there are none the coarse ones.
    Basis,
}

/// What a file's name alone does not say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TargetOptions {
    /// Of an .exr without numbers.
    pub layers: Option<Layers>,
    /// Of a video.
    pub chroma: Option<Chroma>,
    /// Of an .exr; half precision without it.
    pub precision: Option<Precision>,
}

/// An option that a kind of file would silently ignore, and the kind that it is for.
pub type Idle = (&'static str, &'static str);

impl Target {
    /// What to write to `path`; `-` is the host's pipe.
    pub fn of(path: &Path, options: TargetOptions) -> Result<Target, Error> {
        let place = path.to_owned();
        let precision = options.precision.unwrap_or(Precision::Half);
        let chroma = options.chroma.unwrap_or(Chroma::Quarter);
        let numbered = Numbered::of(&place);
        Ok(match (ending(&place).as_str(), numbered) {
            ("png", Some(numbered)) => Target::Numbered(numbered, Kind::Png),
            ("exr", Some(numbered)) => Target::Numbered(numbered, Kind::Exr(precision)),
            ("y4m", _) => Target::Video(Some(place), chroma),
            ("mp4" | "webm", _) => Target::Film(place),
            ("html" | "htm", _) => Target::Page(place),
            ("exr", _) => Target::Layers(place, options.layers.unwrap_or(Layers::Keys), precision),
            _ if path == Path::new("-") => Target::Video(None, chroma),
            _ => return Err(unknown(&place, KNOWN)),
        })
    }

    /// Whether the file has light as it is displayed, which an exposure changes.
    pub fn is_exposed(&self) -> bool {
        !matches!(self, Target::Layers(..) | Target::Numbered(_, Kind::Exr(_)))
    }

    /// Whether it has frames, of which some may be asked for; a page and layers have keys.
    pub fn has_frames(&self) -> bool {
        !matches!(self, Target::Page(_) | Target::Layers(..))
    }

    /// The first option that this kind of file would silently ignore.
    pub fn idle(&self, options: TargetOptions) -> Option<Idle> {
        let layers = matches!(self, Target::Layers(..));
        let video = matches!(self, Target::Video(..));
        let float = layers || matches!(self, Target::Numbered(_, Kind::Exr(_)));
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
    /// Whose it is.
    pub engine: &'e Engine,
    /// Its key images.
    pub playback: Arc<Playback>,
    /// How light becomes bytes.
    pub tone: Tone,
    /// What of it is written.
    pub span: Span,
}

impl Sequence<'_> {
    /// Its frames.
    pub fn player(&self) -> Result<Player, Error> {
        let Sequence {
            engine, playback, ..
        } = self;
        Ok(Player::fitting(playback, self.tone, engine.host().work())?)
    }
}

impl Target {
    /// Refuses what could not be written once the sequence is rendered: numbered pictures that would
    /// replace files of the show, a pipe that is none, and a film that nothing encodes.
    pub fn check(&self, engine: &Engine, span: Span, outlets: &Outlets) -> Result<(), Error> {
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

    /// Writes a sequence; what was written in words, and whether it went down the pipe.
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
                film::video(engine, (&sequence.player()?, *span), *chroma, file, path)?
            }
            Target::Film(path) => {
                let player = sequence.player()?;
                let file = encoder(path, outlets)?.begin(path)?;
                film::video(engine, (&player, *span), Chroma::Quarter, file, path)?
            }
            Target::Video(None, chroma) => {
                let pipe = outlets.pipe.as_ref().ok_or(Error::NoPipe)?;
                let place = Path::new("standard output");
                let player = sequence.player()?;
                let file = Box::new(Piped(pipe()));
                let text = film::video(engine, (&player, *span), *chroma, file, place)?;
                return Ok((text, true));
            }
            Target::Numbered(names, kind) => {
                let player = match kind {
                    Kind::Png => sequence.player()?,
                    Kind::Exr(_) => film::exact(engine, playback, *tone)?,
                };
                film::numbered(engine, (&player, *span), names, *kind)?
            }
            Target::Page(path) => {
                let (html, text) = page::page(engine, playback, *tone)?;
                whole(path, html.as_bytes(), text)?
            }
            Target::Layers(path, which, precision) => {
                let (bytes, text) = layers::layers(engine, playback, *which, *precision)?;
                whole(path, &bytes, text)?
            }
        };
        Ok((text, false))
    }
}

/// What encodes a film.
fn encoder<'o>(path: &Path, outlets: &'o Outlets) -> Result<&'o dyn Encoder, Error> {
    let found = outlets.encoder.as_deref().filter(|e| e.is_there());
    found.ok_or_else(|| Error::NoEncoder(path.to_owned()))
}

/// A file name with a place for a number: `####`, `%d` or `%04d`, the last in the name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Numbered {
    folder: PathBuf,
    before: OsString,
    digits: usize,
    after: OsString,
}

impl Numbered {
    fn of(path: &Path) -> Option<Numbered> {
        let name = path.file_name()?.as_encoded_bytes();
        let (before, digits, after) = hashes(name).or_else(|| percent(name))?;
        Some(Numbered {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            before: part(before)?,
            digits,
            after: part(after)?,
        })
    }

    /// The name of picture `number`, with more digits when it needs them.
    pub fn path(&self, number: usize) -> PathBuf {
        let digits = self.digits;
        let mut name = self.before.clone();
        name.push(format!("{number:0digits$}"));
        name.push(&self.after);
        self.folder.join(name)
    }
}

/// The last run of `#` and what is around it.
fn hashes(name: &[u8]) -> Option<(&[u8], usize, &[u8])> {
    let last = name.iter().rposition(|byte| *byte == b'#')?;
    let (head, after) = name.split_at_checked(last + 1)?;
    let before = head.iter().rposition(|byte| *byte != b'#');
    let (before, run) = head.split_at_checked(before.map_or(0, |i| i + 1))?;
    Some((before, run.len(), after))
}

/// The last `%d`, `%4d` or `%04d` and what is around it.
fn percent(name: &[u8]) -> Option<(&[u8], usize, &[u8])> {
    let (before, rest) = name.split_at_checked(name.iter().rposition(|byte| *byte == b'%')?)?;
    let rest = rest.strip_prefix(b"%")?;
    let (digits, after) = rest.split_at_checked(rest.iter().position(|byte| *byte == b'd')?)?;
    let width = match std::str::from_utf8(digits).ok()? {
        "" => 1,
        digits => digits.parse().ok().filter(|n| (1..=9).contains(n))?,
    };
    Some((before, width, after.strip_prefix(b"d")?))
}

/// A part of a file's name, cut at letters of ASCII.
fn part(bytes: &[u8]) -> Option<OsString> {
    #[cfg(unix)]
    return Some(std::os::unix::ffi::OsStringExt::from_vec(bytes.to_owned()));
    #[cfg(not(unix))]
    return std::str::from_utf8(bytes).ok().map(OsString::from);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn numbers_stand_where_the_name_says() {
        for (name, number, path) in [
            ("frames/####.png", 7, "frames/0007.png"),
            ("a#b##.exr", 123, "a#b123.exr"),
            ("%d.png", 12, "12.png"),
            ("x/s%04d_50%03d.png", 9, "x/s%04d_50009.png"),
            // As everywhere where such patterns are read.
            ("100%deep.png", 12, "10012eep.png"),
        ] {
            let numbered = Numbered::of(Path::new(name)).unwrap();
            assert_eq!(numbered.path(number), Path::new(path), "{name}");
        }
        for name in ["show.png", "50%.png", "a%0xd.png", "####/a.png"] {
            assert_eq!(Numbered::of(Path::new(name)), None, "{name}");
        }
    }
}
