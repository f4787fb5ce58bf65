//! Photometric files: measured intensity of a luminaire in each direction (IES LM-63 of 1986, 1991,
//! 1995, 2002 and 2019, and EULUMDAT).
//!
//! Invariants of a [`Distribution`]: vertical and horizontal angles increase strictly, every
//! intensity is finite and not negative, its flux is positive. Only type C (vertical angle 0
//! straight down, horizontal angles around the vertical axis) is read; types A and B are refused.
//! The source is treated as a point; the size of its opening, keywords and watts are not used. A
//! `TILT` block is checked but not applied: intensities are those of the lamp as measured. This
//! module depends on neither mounts nor file names.

mod eulumdat;
mod read;

use std::f64::consts::{PI, TAU};

pub use read::PhotometricError;

/// Extensions of the files that [`Distribution::noted`] reads.
pub const ENDINGS: &[&str] = &["ies", "ldt"];

/// Symmetry of a file's intensities around the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// One plane for all angles.
    Round,
    /// 0 to 90 degrees, mirrored at both planes.
    Quadrant,
    /// 0 to 180 degrees, mirrored at the plane of 0.
    Half,
    /// 90 to 270 degrees, mirrored at the plane of 90.
    Across,
    /// A whole turn, from the first angle to the same one again.
    None,
}

/// Intensity by direction, as in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    /// Degrees from straight down, increasing.
    vertical: Vec<f64>,
    /// Degrees around the axis, increasing.
    horizontal: Vec<f64>,
    symmetry: Symmetry,
    /// Candela, for one horizontal angle after the other.
    candela: Vec<f64>,
    /// Lumens of the lamps given in the file; `None` for absolute photometry.
    lamp_lumens: Option<f64>,
}

/// All fields of a [`Distribution`], which decide its identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts<'a> {
    /// Vertical angles, degrees from straight down, increasing.
    pub vertical: &'a [f64],
    /// Horizontal angles, degrees around the axis, increasing.
    pub horizontal: &'a [f64],
    /// Symmetry around the axis.
    pub symmetry: Symmetry,
    /// Candela, one number for each vertical angle, for one horizontal angle after the other.
    pub candela: &'a [f64],
    /// Lumens of the lamps given in the file; `None` for absolute photometry.
    pub lamp_lumens: Option<f64>,
}

impl Distribution {
    /// Its fields, for content addresses. A new field does not compile until it is listed here.
    pub fn parts(&self) -> Parts<'_> {
        let Distribution {
            vertical,
            horizontal,
            symmetry,
            candela,
            lamp_lumens,
        } = self;
        Parts {
            vertical,
            horizontal,
            symmetry: *symmetry,
            candela,
            lamp_lumens: *lamp_lumens,
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`PhotometricError`] with the line.
    pub fn parse(bytes: &[u8]) -> Result<Distribution, PhotometricError> {
        Distribution::noted(bytes).map(|(read, _)| read)
    }

    /// Reads a file; the second value is a note on parts that are not used, if any.
    ///
    /// # Errors
    /// [`PhotometricError`] with the line.
    pub fn noted(bytes: &[u8]) -> Result<(Distribution, Option<String>), PhotometricError> {
        if bytes.len() > read::MOST_BYTES {
            let (bytes, most) = (bytes.len(), read::MOST_BYTES);
            let wrong = format!("the file has {bytes} bytes; {most} are read");
            return Err(PhotometricError { line: 1, wrong });
        }
        // Keywords may be in any code page; numbers are ASCII in all of them.
        let mut text = String::from_utf8_lossy(bytes);
        if !text.contains('\n') {
            // Old files end their lines with a carriage return alone.
            text = text.replace('\r', "\n").into();
        }
        if eulumdat::is(&text) {
            eulumdat::distribution(&text)
        } else {
            read::distribution(&text)
        }
    }

    /// Intensity in candela at `vertical` radians from the axis (0 to pi) and `horizontal` radians
    /// around it: bilinear in the two angles; zero beyond the file's vertical angles.
    pub fn intensity(&self, vertical: f64, horizontal: f64) -> f64 {
        let down = vertical.to_degrees();
        let (Some(least), Some(most)) = (self.vertical.first(), self.vertical.last()) else {
            return 0.0;
        };
        // A rounding error beyond the last angle is accepted.
        if down < least - 1e-9 || down > most + 1e-9 {
            return 0.0;
        }
        let (row, along) = between(&self.vertical, down);
        let (column, across) = between(&self.horizontal, self.folded(horizontal));
        let at = |c: usize| {
            let (a, b) = (self.at(c, row), self.at(c, row + 1));
            a + (b - a) * along
        };
        let (a, b) = (at(column), at(column + 1));
        a + (b - a) * across
    }

    /// Candela at the horizontal angle `column` and the vertical angle `row`, each at most the
    /// last.
    fn at(&self, column: usize, row: usize) -> f64 {
        let height = self.vertical.len();
        let (c, r) = (column.min(self.horizontal.len() - 1), row.min(height - 1));
        self.candela.get(c * height + r).copied().unwrap_or(0.0)
    }

    /// The horizontal angle, degrees, folded into the range of the file.
    fn folded(&self, horizontal: f64) -> f64 {
        let turn = horizontal.to_degrees().rem_euclid(360.0);
        let half = if turn > 180.0 { 360.0 - turn } else { turn };
        match self.symmetry {
            Symmetry::Round => 0.0,
            Symmetry::Quadrant => half.min(180.0 - half),
            Symmetry::Half => half,
            // 90 - x and 90 + x are equivalent.
            Symmetry::Across if turn < 90.0 => 180.0 - turn,
            Symmetry::Across if turn > 270.0 => 540.0 - turn,
            Symmetry::Across => turn,
            Symmetry::None => {
                let first = self.horizontal.first().copied().unwrap_or(0.0);
                if turn < first { turn + 360.0 } else { turn }
            }
        }
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        let numbers = self.vertical.len() + self.horizontal.len() + self.candela.len();
        numbers * size_of::<f64>()
    }

    /// The largest intensity of the file, candela.
    pub fn peak(&self) -> f64 {
        self.candela.iter().copied().fold(0.0, f64::max)
    }

    /// Luminous flux in lumens: the integral of [`Distribution::intensity`] over the sphere, in
    /// closed form between the file's angles.
    pub fn flux(&self) -> f64 {
        let pairs = self.vertical.iter().zip(self.vertical.iter().skip(1));
        let zones = pairs.enumerate().map(|(row, (from, to))| {
            let means = (self.mean(row), self.mean(row + 1));
            zone(from.to_radians(), to.to_radians(), means.0, means.1)
        });
        TAU * zones.sum::<f64>()
    }

    /// Mean around the axis at a vertical angle, by the trapezoidal rule, which is exact for
    /// piecewise linear intensities.
    fn mean(&self, row: usize) -> f64 {
        let (Some(first), Some(last)) = (self.horizontal.first(), self.horizontal.last()) else {
            return 0.0;
        };
        if self.symmetry == Symmetry::Round {
            return self.at(0, row);
        }
        let pairs = self.horizontal.iter().zip(self.horizontal.iter().skip(1));
        let area = pairs.enumerate().map(|(column, (from, to))| {
            0.5 * (to - from) * (self.at(column, row) + self.at(column + 1, row))
        });
        area.sum::<f64>() / (last - first)
    }

    /// Lumens of the bare lamps, if the file gives them; the luminaire emits less.
    pub fn lamp_lumens(&self) -> Option<f64> {
        self.lamp_lumens
    }

    /// Angle from the axis beyond which there is no light, radians.
    pub fn end(&self) -> f64 {
        let columns = 0..self.horizontal.len();
        let lit = |row: &usize| columns.clone().any(|c| self.at(c, *row) > 0.0);
        let last = (0..self.vertical.len()).rev().find(lit);
        // Light falls to zero at the next angle, if there is one.
        let end = last.map_or(0, |row| (row + 1).min(self.vertical.len() - 1));
        self.vertical.get(end).map_or(PI, |a| a.to_radians())
    }
}

/// Integral of a linear function from `a` at `from` to `b` at `to` times the sine.
fn zone(from: f64, to: f64, a: f64, b: f64) -> f64 {
    // The integral of (c + s t) sin t is s sin t - (c + s t) cos t.
    let slope = (b - a) / (to - from);
    let short = to - from < 1e-4;
    if short {
        return 0.5 * (to - from) * (a * from.sin() + b * to.sin());
    }
    slope * (to.sin() - from.sin()) - b * to.cos() + a * from.cos()
}

/// Index of the last of increasing `angles` that is not above `x`, and the fraction of `x` from it
/// to the next.
fn between(angles: &[f64], x: f64) -> (usize, f64) {
    let index = angles.partition_point(|a| *a <= x).saturating_sub(1);
    match (angles.get(index), angles.get(index + 1)) {
        (Some(a), Some(b)) => (index, ((x - a) / (b - a)).clamp(0.0, 1.0)),
        _ => (index, 0.0),
    }
}

#[cfg(test)]
mod tests;
