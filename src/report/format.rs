//! File formats by the ending of a file's name: what each kind of result can be written as.
//!
//! A new format is its encoder and its row here.

use std::path::Path;

use super::Error;
use super::record::Record;
use super::table::Table;
use crate::chart::{Drawing, Theme};
use footlight_host::work::Cancelled;
use footlight_picture::exr::{self, Precision};
use footlight_picture::tone::Tone;
use footlight_picture::{Image, png};

/// Characters of a line of a table in words.
pub const WIDTH: usize = 100;

/// Results of one kind: the endings that they can be written with, and how a message says these.
pub struct Formats {
    endings: &'static [&'static str],
    known: &'static str,
}

/// Drawings.
pub const DRAWING: Formats = Formats {
    endings: &["png", "svg"],
    known: ".png or .svg",
};

/// Measurements: their drawing, or their figures.
pub const RECORD: Formats = Formats {
    endings: &["png", "svg", "csv", "json"],
    known: ".png, .svg, .csv or .json",
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

/// One image that is display-coded already.
const DISPLAYED: Formats = Formats {
    endings: &["png"],
    known: ".png: it is a picture",
};

impl Formats {
    /// Refuses a file whose ending names none of them.
    pub fn check(&self, path: &Path) -> Result<(), Error> {
        if self.endings.contains(&ending(path).as_str()) {
            Ok(())
        } else {
            Err(unknown(path, self.known))
        }
    }
}

/// The ending of a file's name, in small letters and without its dot.
pub fn ending(path: &Path) -> String {
    path.extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase()
}

/// A file whose ending cannot be written here.
pub fn unknown(path: &Path, known: &'static str) -> Error {
    Error::Ending {
        path: path.to_owned(),
        known,
    }
}

/// A drawing, magnified where it becomes pixels.
pub fn drawing(drawing: &Drawing, magnified: f32, path: &Path) -> Result<Vec<u8>, Error> {
    DRAWING.check(path)?;
    match ending(path).as_str() {
        "svg" => Ok(drawing.svg().into_bytes()),
        _ => Ok(drawing.clone().magnified(magnified).png()?),
    }
}

/// A measurement: its drawing or its figures.
pub fn record(
    record: &Record,
    drawn: &dyn Fn(Theme) -> Drawing,
    theme: Theme,
    path: &Path,
) -> Result<Vec<u8>, Error> {
    RECORD.check(path)?;
    match ending(path).as_str() {
        "csv" => Ok(record.csv().into_bytes()),
        "json" => Ok(record.json()?.into_bytes()),
        _ => drawing(&drawn(theme), 2.0, path),
    }
}

/// A table; as CSV it is `plain`.
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

/// An image: as displayed, or linear with `about` in its header.
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

/// A display-coded image: width and height, and RGB bytes row by row from the top.
pub fn displayed(size: (usize, usize), rgb: &[u8], path: &Path) -> Result<Vec<u8>, Error> {
    DISPLAYED.check(path)?;
    Ok(png::encode(size.0, size.1, rgb)?)
}

/// A header's attribute, lines of printable ASCII: each other character of the show's names is `?`.
pub fn header(name: &str, text: &str) -> (String, String) {
    let plain = |c| match c {
        ' '..='~' | '\n' => c,
        _ => '?',
    };
    (name.to_owned(), text.chars().map(plain).collect())
}
