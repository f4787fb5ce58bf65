//! EULUMDAT files (`.ldt`): one value a line, in an order that the format fixes.
//!
//! Intensities are in candela per 1000 lumens of the lamps, in planes around the axis.

use super::read::{MOST_ANGLES, PhotometricError, Wrong, push_increasing, shown};
use super::{Distribution, Symmetry};

/// Where values stand, counted from 0.
const SYMMETRY: usize = 2;
const PLANES: usize = 3;
const ANGLES: usize = 5;
const CONVERSION: usize = 23;
const LAMP_SETS: usize = 25;
const LAMPS: usize = 26;
/// Lines of a set of lamps, and of the ratios behind them.
const OF_LAMPS: usize = 6;
const RATIOS: usize = 10;

/// Is it a EULUMDAT file? Its second and third lines are small whole numbers.
pub(super) fn is(text: &str) -> bool {
    let small = |at: usize| {
        let line = text.lines().nth(at);
        line.is_some_and(|l| l.trim().parse::<u8>().is_ok_and(|n| n <= 4))
    };
    small(1) && small(SYMMETRY)
}

/// The lines of a file.
struct Lines<'t>(Vec<&'t str>);

impl Lines<'_> {
    fn number(&self, at: usize, what: &'static str) -> Result<f64, PhotometricError> {
        let fail = |wrong| PhotometricError {
            line: at + 1,
            wrong,
        };
        let text = self.0.get(at).ok_or_else(|| fail(Wrong::End(what)))?.trim();
        // Some countries write decimals with a comma.
        let value = text.replace(',', ".").parse::<f64>().ok();
        let value = value.filter(|v| v.is_finite() && v.abs() <= 1e12);
        value.ok_or_else(|| {
            let text = shown(text);
            fail(Wrong::Number { text, what })
        })
    }

    fn within(
        &self,
        at: usize,
        what: &'static str,
        range: std::ops::RangeInclusive<f64>,
        must: &'static str,
    ) -> Result<f64, PhotometricError> {
        let value = self.number(at, what)?;
        if range.contains(&value) {
            return Ok(value);
        }
        let wrong = Wrong::Range { what, value, must };
        Err(PhotometricError {
            line: at + 1,
            wrong,
        })
    }

    fn count(&self, at: usize, what: &'static str) -> Result<usize, PhotometricError> {
        let most = MOST_ANGLES as f64;
        let count = self.within(at, what, 1.0..=most, "a whole number from 1 to 3601")?;
        Ok(count as usize)
    }

    /// Increasing angles within 0 to `most`.
    fn angles(
        &self,
        lines: std::ops::Range<usize>,
        what: &'static str,
        most: f64,
    ) -> Result<Vec<f64>, PhotometricError> {
        let mut out: Vec<f64> = Vec::new();
        for at in lines {
            let next = self.within(at, what, 0.0..=most, "within 0 to 180, or to 360 around")?;
            push_increasing(&mut out, next, what).map_err(|wrong| PhotometricError {
                line: at + 1,
                wrong,
            })?;
        }
        Ok(out)
    }
}

/// Reads a file.
pub(super) fn distribution(text: &str) -> Result<Distribution, PhotometricError> {
    let lines = Lines(text.lines().collect());
    let symmetry = lines.within(SYMMETRY, "the symmetry", 0.0..=4.0, "0 to 4")? as u8;
    let planes = lines.count(PLANES, "the number of planes")?;
    let angles = lines.count(ANGLES, "the number of angles in a plane")?;
    let conversion = lines.number(CONVERSION, "the conversion factor of intensities")?;
    let sets = lines.within(
        LAMP_SETS,
        "the number of sets of lamps",
        1.0..=20.0,
        "1 to 20",
    )? as usize;
    let mut lumens = 0.0;
    for set in 0..sets {
        lumens += lines
            .number(LAMPS + OF_LAMPS * set + 2, "the lumens of the lamps")?
            .max(0.0);
    }
    let first = LAMPS + OF_LAMPS * sets + RATIOS;
    let horizontal = lines.angles(first..first + planes, "the planes", 360.0)?;
    let start = first + planes;
    let vertical = lines.angles(start..start + angles, "the angles in a plane", 180.0)?;
    // Of planes that mirror others only one of each is given.
    let given = match symmetry {
        1 => 1,
        2 | 3 => planes / 2 + 1,
        4 => planes / 4 + 1,
        _ => planes,
    };
    let mut candela = Vec::new();
    let scale = lumens / 1000.0 * if conversion > 0.0 { conversion } else { 1.0 };
    for at in (start + angles..).take(given.saturating_mul(angles)) {
        let value = lines.within(at, "an intensity", 0.0..=1e12, "0 or more")?;
        candela.push(value * scale);
    }
    let last = lines.0.len();
    let (horizontal, symmetry) = around(horizontal, symmetry, given, &mut candela, angles);
    let out = Distribution {
        vertical,
        horizontal,
        symmetry,
        candela,
        lamp_lumens: (lumens > 0.0).then_some(lumens),
    };
    if out.vertical.len() >= 2 && out.flux() > 0.0 {
        return Ok(out);
    }
    let wrong = Wrong::Dark;
    Err(PhotometricError { line: last, wrong })
}

/// The planes as this module keeps them.
fn around(
    planes: Vec<f64>,
    symmetry: u8,
    given: usize,
    candela: &mut Vec<f64>,
    angles: usize,
) -> (Vec<f64>, Symmetry) {
    let some = |planes: &[f64]| planes.iter().copied().take(given).collect::<Vec<f64>>();
    match symmetry {
        1 => (vec![0.0], Symmetry::Round),
        2 => (some(&planes), Symmetry::Half),
        // Given from 270 by 0 to 90: seen from the other side of the mirror, from 270 back to 90.
        3 => {
            let rows: Vec<f64> = candela.chunks(angles).rev().flatten().copied().collect();
            *candela = rows;
            let step = 180.0 / (given.max(2) - 1) as f64;
            let turned = (0..given).map(|i| 90.0 + step * i as f64);
            (turned.collect(), Symmetry::Across)
        }
        4 => (some(&planes), Symmetry::Quadrant),
        _ => {
            let mut planes = planes;
            if planes.len() == 1 {
                return (vec![0.0], Symmetry::Round);
            }
            if planes.last().is_some_and(|last| *last < 360.0) {
                planes.push(360.0);
                candela.extend_from_within(..angles);
            }
            (planes, Symmetry::None)
        }
    }
}
