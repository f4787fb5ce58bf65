//! What `play` writes, by the ending of the file's name and the options beside it.

use std::path::{Path, PathBuf};

use super::{ending, unknown_ending};
use crate::interpreter::{Call, Error};
use crate::picture::exr::Precision;
use crate::picture::y4m::Chroma;

/// What `play` can write, as its errors say it.
const KNOWN: &str = "a .png or .apng (animated), a .y4m or `-` (video), a .html (a \
    page that plays), an .exr (layers), or numbered pictures such as frames/####.png or frame%04d.exr";

/// What `play` writes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Target {
    /// An animated picture of limited size.
    Animation(PathBuf),
    /// Video; `None` goes down the host's pipe.
    Video(Option<PathBuf>, Chroma),
    /// A page that plays the show.
    Page(PathBuf),
    /// A picture for each frame.
    Numbered(Numbered, Kind),
    /// One OpenEXR file with many pictures.
    Layers(PathBuf, Layers, Precision),
}

/// What a numbered picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// As displayed.
    Png,
    /// Linear.
    Exr(Precision),
}

/// Which pictures are layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layers {
    /// Every key image.
    Keys,
    /// Every coordinate alone at full, as previews have it.
    Banks,
    /// The refined pictures; where there are none the coarse ones.
    Basis,
}

impl Target {
    pub(super) fn of(path: &str, call: &Call) -> Result<Target, Error> {
        let place = PathBuf::from(path);
        let precision = precision(call);
        let numbered = Numbered::of(&place);
        let target = match (ending(&place).as_str(), numbered) {
            ("png", Some(numbered)) => Target::Numbered(numbered, Kind::Png),
            ("exr", Some(numbered)) => Target::Numbered(numbered, Kind::Exr(precision)),
            ("png" | "apng", _) => Target::Animation(place),
            ("y4m", _) => Target::Video(Some(place), chroma(call)?),
            ("html" | "htm", _) => Target::Page(place),
            ("exr", _) => Target::Layers(place, layers(call)?, precision),
            _ if path == "-" => Target::Video(None, chroma(call)?),
            _ => return Err(unknown_ending(&place, KNOWN)),
        };
        target.check(call)?;
        Ok(target)
    }

    /// Refuses options that this kind of file would silently ignore.
    fn check(&self, call: &Call) -> Result<(), Error> {
        let takes = |option: &str| match option {
            "layers" => matches!(self, Target::Layers(..)),
            "chroma" => matches!(self, Target::Video(..)),
            _ => matches!(self, Target::Layers(..) | Target::Numbered(_, Kind::Exr(_))),
        };
        let wants = [
            ("layers", "an .exr without numbers"),
            ("chroma", "a .y4m or `-`"),
            ("float", "an .exr"),
        ];
        let idle = |(option, _): &&(&str, _)| call.option(option).is_some() && !takes(option);
        match wants.iter().find(idle) {
            Some((option, file)) => Err(Error::Usage(format!("`--{option}` is for {file}"))),
            None => Ok(()),
        }
    }
}

/// Half precision unless the call says otherwise.
pub(super) fn precision(call: &Call) -> Precision {
    match call.option("float") {
        Some(_) => Precision::Float,
        None => Precision::Half,
    }
}

fn chroma(call: &Call) -> Result<Chroma, Error> {
    match call.option("chroma") {
        None | Some("420") => Ok(Chroma::Quarter),
        Some("444") => Ok(Chroma::Full),
        Some(other) => Err(Error::Usage(format!(
            "`{other}` is no chroma that is written here; use 420 or 444"
        ))),
    }
}

fn layers(call: &Call) -> Result<Layers, Error> {
    match call.option("layers") {
        None | Some("keys") => Ok(Layers::Keys),
        Some("banks") => Ok(Layers::Banks),
        Some("basis") => Ok(Layers::Basis),
        Some(other) => Err(Error::Usage(format!(
            "there are no layers `{other}`; use keys, banks or basis"
        ))),
    }
}

/// A file name with a place for a number: `####`, `%d` or `%04d`, the last in the name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Numbered {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Numbered {
    fn of(path: &Path) -> Option<Numbered> {
        let name = path.file_name()?.to_str()?;
        let (before, digits, after) = hashes(name).or_else(|| percent(name))?;
        Some(Numbered {
            folder: path.parent().unwrap_or(Path::new("")).to_owned(),
            before: before.to_owned(),
            digits,
            after: after.to_owned(),
        })
    }

    /// The name of picture `number`, with more digits when it needs them.
    pub(super) fn path(&self, number: usize) -> PathBuf {
        let digits = self.digits;
        let name = format!("{}{number:0digits$}{}", self.before, self.after);
        self.folder.join(name)
    }
}

/// The last run of `#` and what is around it.
fn hashes(name: &str) -> Option<(&str, usize, &str)> {
    let last = name.rfind('#')?;
    let (head, after) = name.split_at_checked(last + 1)?;
    let before = head.trim_end_matches('#');
    Some((before, head.len() - before.len(), after))
}

/// The last `%d`, `%4d` or `%04d` and what is around it.
fn percent(name: &str) -> Option<(&str, usize, &str)> {
    let (before, rest) = name.rsplit_once('%')?;
    let (digits, after) = rest.split_once('d')?;
    let width = match digits {
        "" => 1,
        digits => digits.parse().ok().filter(|n| (1..=9).contains(n))?,
    };
    Some((before, width, after))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::interpreter::Verb;

    fn of(words: &str) -> Result<Target, Error> {
        let call = Call::parse(&format!("play {words}"))?;
        assert_eq!(call.verb, Verb::Play);
        Target::of(call.option("output").unwrap(), &call)
    }

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

    #[test]
    fn endings_and_options_choose() {
        assert!(matches!(of("-o a.PNG"), Ok(Target::Animation(_))));
        assert!(matches!(
            of("-o -"),
            Ok(Target::Video(None, Chroma::Quarter))
        ));
        assert!(matches!(
            of("-o a.y4m --chroma 444"),
            Ok(Target::Video(Some(_), Chroma::Full))
        ));
        assert!(matches!(
            of("-o a##.exr --float"),
            Ok(Target::Numbered(_, Kind::Exr(Precision::Float)))
        ));
        assert!(matches!(
            of("-o a.exr --layers banks"),
            Ok(Target::Layers(_, Layers::Banks, Precision::Half))
        ));
        for (words, said) in [
            ("-o a.mp4", "use a .png or .apng (animated), a .y4m"),
            ("-o a", "numbered pictures"),
            ("-o a.png --layers keys", "`--layers` is for an .exr"),
            ("-o a.exr --chroma 444", "`--chroma` is for a .y4m"),
            ("-o a.y4m --float", "`--float` is for an .exr"),
            ("-o a.exr --layers lamps", "keys, banks or basis"),
            ("-o a.y4m --chroma 422", "420 or 444"),
        ] {
            let error = of(words).unwrap_err().to_string();
            assert!(error.contains(said), "{words}: {error}");
        }
    }
}
