//! What leaves the interpreter as files: pictures, curves, keys, the sequence.
//!
//! The ending of a file's name says what it becomes. Every picture is exposed alike: one tone for
//! the whole sequence.

mod curve;
mod film;
mod layer;
mod page;
mod plot;
mod result;
mod still;
mod target;

use std::path::Path;

use super::{Error, Interpreter, Reply};
use crate::picture::Image;
use crate::picture::tone::{self, Curve, Tone};
use crate::show::ToneCurve;

pub use self::film::Animation;

pub(super) use self::curve::{hue, points};
pub(super) use self::plot::SUBJECTS;

impl Interpreter {
    /// One exposure for the whole sequence: the show's own, or from all key images.
    pub(super) fn tone(&self, images: &[Image]) -> Tone {
        let exposure = self.show().preview.exposure;
        self.tone_at(exposure.unwrap_or_else(|| tone::auto_exposure(images.iter())))
    }

    /// The show's own curve and dithering at an exposure.
    fn tone_at(&self, exposure: f64) -> Tone {
        let preview = &self.show().preview;
        Tone {
            exposure,
            curve: match preview.tone {
                ToneCurve::Filmic => Curve::Filmic,
                ToneCurve::Plain => Curve::Plain,
            },
            dither: preview.dither,
        }
    }

    fn write_reply(&self, path: Option<&Path>, bytes: &[u8], text: String) -> Result<Reply, Error> {
        let Some(path) = path else {
            return Ok(Reply::text(text));
        };
        self.host.store.write(path, bytes)?;
        Ok(Reply::text(format!("{text}\nwrote {}", path.display())))
    }
}

pub(super) fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

pub(super) fn unknown_ending(path: &Path, known: &str) -> Error {
    Error::Usage(format!(
        "`{}` has an ending that cannot be written here; use {known}",
        path.display()
    ))
}

/// A header's attribute. Headers are ASCII, names in a show need not be: other letters are `?`.
fn described(name: &str, text: &str) -> (String, String) {
    let plain = |c: char| if c.is_ascii() && c != '\0' { c } else { '?' };
    (name.to_owned(), text.chars().map(plain).collect())
}
