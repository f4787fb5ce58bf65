//! File formats by extension: the formats of each kind of result.
//!
//! A new format needs its encoder and its row here.

use std::path::Path;

use super::Error;
use super::table::Table;
use crate::chart::Drawing;
use footlight_host::work::Cancelled;
use footlight_picture::exr::{self, Precision};
use footlight_picture::tone::Tone;
use footlight_picture::{Image, png};

/// Width of a table in words, characters.
pub const WIDTH: usize = 100;

/// Formats of one kind of result: the extensions, and their description in messages.
pub struct Formats {
    endings: &'static [&'static str],
    known: &'static str,
}

/// Drawings.
pub const DRAWING: Formats = Formats {
    endings: &["png", "svg"],
    known: ".png or .svg",
};

/// Tables of words.
pub const TABLE: Formats = Formats {
    endings: &["md", "csv", "txt"],
    known: ".md, .csv or .txt",
};

/// Shows for other programs.
pub const EXCHANGE: Formats = Formats {
    endings: &["asc", "qxw"],
    known: ".asc (a desk: USITT ASCII) or .qxw (QLC+)",
};

/// Shows.
pub const SHOW: Formats = Formats {
    endings: &["lxq"],
    known: ".lxq",
};

/// One image.
pub const PICTURE: Formats = Formats {
    endings: &["png", "exr"],
    known: ".png (as displayed) or .exr (linear)",
};

/// An image already display-coded.
const DISPLAYED: Formats = Formats {
    endings: &["png"],
    known: ".png: it is a picture",
};

impl Formats {
    /// Refuses a file whose extension is not among them.
    pub fn check(&self, path: &Path) -> Result<(), Error> {
        if self.endings.contains(&ending(path).as_str()) {
            Ok(())
        } else {
            Err(unknown(path, self.known))
        }
    }
}

/// Extension of a file name, in small letters and without its dot.
pub fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

/// The error for an unknown extension.
pub fn unknown(path: &Path, known: &'static str) -> Error {
    Error::Ending {
        path: path.to_owned(),
        known,
    }
}

/// Encodes a drawing, magnified for pixel formats.
pub fn drawing(drawing: &Drawing, magnified: f32, path: &Path) -> Result<Vec<u8>, Error> {
    DRAWING.check(path)?;
    match ending(path).as_str() {
        "svg" => Ok(drawing.svg().into_bytes()),
        _ => Ok(drawing.clone().magnified(magnified).png()?),
    }
}

/// Encodes a table; for CSV, `plain`.
pub fn table(
    table: &dyn Fn() -> Result<Table, Cancelled>,
    plain: &dyn Fn() -> Result<Table, Cancelled>,
    path: &Path,
) -> Result<String, Error> {
    TABLE.check(path)?;
    Ok(match ending(path).as_str() {
        "md" => table()?.markdown(),
        "csv" => plain()?.csv(),
        _ => table()?.text(2, WIDTH).into(),
    })
}

/// Encodes an image, as displayed, or linear with `about` in its header.
pub fn picture(
    image: &Image,
    tone: impl FnOnce() -> Result<Tone, Error>,
    (precision, about): (Precision, &str),
    path: &Path,
) -> Result<Vec<u8>, Error> {
    PICTURE.check(path)?;
    match ending(path).as_str() {
        "exr" => Ok(exr::encode(image, precision, &[header("picture", about)])?),
        _ => displayed(
            (image.width(), image.height()),
            &tone()?.encode(image),
            path,
        ),
    }
}

/// Encodes a display-coded image: width and height, and RGB bytes row by row from the top.
pub fn displayed(size: (usize, usize), rgb: &[u8], path: &Path) -> Result<Vec<u8>, Error> {
    DISPLAYED.check(path)?;
    Ok(png::encode(size.0, size.1, rgb)?)
}

/// A header attribute of printable ASCII lines; other characters become `?`.
pub fn header(name: &str, text: &str) -> (String, String) {
    let plain = |c| match c {
        ' '..='~' | '\n' => c,
        _ => '?',
    };
    (name.to_owned(), text.chars().map(plain).collect())
}
