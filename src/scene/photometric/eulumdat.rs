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

/// Reads a file, with a note of the sets of lamps that were not taken.
pub(super) fn distribution(text: &str) -> Result<(Distribution, Option<String>), PhotometricError> {
    let lines = Lines(text.lines().collect());
    let symmetry = lines.within(SYMMETRY, "the symmetry", 0.0..=4.0, "0 to 4")? as u8;
    let count = lines.count(PLANES, "the number of planes")?;
    let angles = lines.count(ANGLES, "the number of angles in a plane")?;
    let conversion = lines.number(CONVERSION, "the conversion factor of intensities")?;
    let sets = lines.within(
        LAMP_SETS,
        "the number of sets of lamps",
        1.0..=20.0,
        "1 to 20",
    )? as usize;
    // Sets are alternatives: lamps or currents with which the luminaire is sold.
    let lumens = lines.within(
        LAMPS + 2,
        "the lumens of the lamps",
        f64::MIN_POSITIVE..=1e12,
        "above 0",
    )?;
    let note = (sets > 1).then(|| {
        format!("the first of {sets} sets of lamps, {lumens} lm: write `lm` behind it for another")
    });
    let first = LAMPS + OF_LAMPS * sets + RATIOS;
    let all = lines.angles(first..first + count, "the planes", 360.0)?;
    let start = first + count;
    let vertical = lines.angles(start..start + angles, "the angles in a plane", 180.0)?;
    let planes =
        Planes::of(all, symmetry).map_err(|wrong| PhotometricError { line: start, wrong })?;
    let mut candela = Vec::new();
    let scale = lumens / 1000.0 * if conversion > 0.0 { conversion } else { 1.0 };
    for at in (start + angles..).take(planes.given.saturating_mul(angles)) {
        let value = lines.within(at, "an intensity", 0.0..=1e12, "0 or more")?;
        candela.push(value * scale);
    }
    if planes.is_reversed {
        candela = candela.chunks(angles).rev().flatten().copied().collect();
    }
    if planes.is_closed_here {
        candela.extend_from_within(..angles);
    }
    let out = Distribution {
        vertical,
        horizontal: planes.horizontal,
        symmetry: planes.symmetry,
        candela,
        lamp_lumens: Some(lumens),
    };
    if out.vertical.len() >= 2 && out.flux() > 0.0 {
        return Ok((out, note));
    }
    let wrong = Wrong::Dark;
    let line = lines.0.len();
    Err(PhotometricError { line, wrong })
}

/// The planes around the axis, as a [`Distribution`] has them.
struct Planes {
    horizontal: Vec<f64>,
    symmetry: Symmetry,
    /// Planes whose intensities are given; the others mirror them.
    given: usize,
    /// They are given from the last to the first.
    is_reversed: bool,
    /// The first plane is added again at the end of the turn.
    is_closed_here: bool,
}

impl Planes {
    /// Of the angles of all planes, and how the format numbers symmetries.
    fn of(all: Vec<f64>, symmetry: u8) -> Result<Planes, Wrong> {
        let within = |most: f64| {
            all.iter()
                .copied()
                .filter(|c| *c <= most)
                .collect::<Vec<f64>>()
        };
        let (horizontal, symmetry, expected) = match symmetry {
            1 => (vec![0.0], Symmetry::Round, 1),
            2 => (within(180.0), Symmetry::Half, all.len() / 2 + 1),
            // Given from 270 by 0 to 90: seen from the other side of the mirror, from 270 back to 90.
            3 => {
                let seen = |c: &f64| match *c {
                    c if c < 90.0 + 1e-9 => Some(180.0 - c),
                    c if (270.0 - 1e-9..360.0).contains(&c) => Some(540.0 - c),
                    _ => None,
                };
                let mut seen: Vec<f64> = all.iter().filter_map(seen).collect();
                seen.sort_by(f64::total_cmp);
                (seen, Symmetry::Across, all.len() / 2 + 1)
            }
            4 => (within(90.0), Symmetry::Quadrant, all.len() / 4 + 1),
            _ if all.len() == 1 => (vec![0.0], Symmetry::Round, 1),
            _ => (all, Symmetry::None, 0),
        };
        let given = horizontal.len();
        let (first, last) = match horizontal.as_slice() {
            [first, .., last] => (*first, *last),
            _ => (0.0, 0.0),
        };
        let is_whole = match symmetry {
            Symmetry::Round => true,
            Symmetry::None => last <= first + 360.0,
            Symmetry::Across => given == expected && (first, last) == (90.0, 270.0),
            Symmetry::Half => given == expected && (first, last) == (0.0, 180.0),
            Symmetry::Quadrant => given == expected && (first, last) == (0.0, 90.0),
        };
        if !is_whole {
            return Err(Wrong::Span {
                what: "the planes",
                first,
                last,
                must: "they do not fit the symmetry that the file states",
            });
        }
        let is_closed_here = symmetry == Symmetry::None && last < first + 360.0;
        let mut horizontal = horizontal;
        horizontal.extend(is_closed_here.then_some(first + 360.0));
        Ok(Planes {
            horizontal,
            symmetry,
            given,
            is_reversed: symmetry == Symmetry::Across,
            is_closed_here,
        })
    }
}
