//! EULUMDAT files (`.ldt`): one value per line, in a fixed order.
//!
//! Intensities are in candela per 1000 lumens of the lamps, in planes around the axis.

use super::read::{DARK, PhotometricError, Words, ends};
use super::{Distribution, Symmetry};

/// Line numbers of values, counted from 0.
const SYMMETRY: usize = 2;
const ANGLES: usize = 5;
const CONVERSION: usize = 23;
const LAMP_SETS: usize = 25;
const LAMPS: usize = 26;
/// Lines per set of lamps, and of the ratios after them.
const OF_LAMPS: usize = 6;
const RATIOS: usize = 10;

/// True for a EULUMDAT file: its second and third lines are small whole numbers.
pub(super) fn is(text: &str) -> bool {
    let small = |at: usize| {
        let line = text.lines().nth(at);
        line.is_some_and(|l| l.trim().parse::<u8>().is_ok_and(|n| n <= 4))
    };
    small(1) && small(SYMMETRY)
}

impl Words<'_> {
    /// Skips to a line, counted from 0.
    fn skip_to(&mut self, at: usize) {
        while self.line < at
            && let Some((line, _)) = self.all.next()
        {
            self.line = line;
        }
    }
}

/// Reads a file; the second value is a note on unused sets of lamps.
pub(super) fn distribution(text: &str) -> Result<(Distribution, Option<String>), PhotometricError> {
    let lines = (1..).zip(text.lines().map(str::trim));
    let mut words = Words {
        all: Box::new(lines),
        line: 0,
    };
    words.skip_to(SYMMETRY);
    let symmetry = words.within("the symmetry", 0.0..=4.0, "0 to 4")? as u8;
    let count = words.count("the number of planes")?;
    words.skip_to(ANGLES);
    let angles = words.count("the number of angles in a plane")?;
    words.skip_to(CONVERSION);
    let conversion = words.number("the conversion factor of intensities")?;
    words.skip_to(LAMP_SETS);
    let sets = words.within("the number of sets of lamps", 1.0..=20.0, "1 to 20")? as usize;
    // Sets are alternatives: lamps or currents with which the luminaire is sold.
    words.skip_to(LAMPS + 2);
    let lumens = words.positive("the lumens of the lamps")?;
    let note = (sets > 1).then(|| {
        format!("the first of {sets} sets of lamps, {lumens} lm: write `lm` behind it for another")
    });
    words.skip_to(LAMPS + OF_LAMPS * sets + RATIOS);
    let all = words.angles(count, "the planes")?;
    let planes = Planes::of(all, symmetry).or_else(|wrong| words.fail(wrong))?;
    let what = "the angles in a plane";
    let vertical = words.angles(angles, what)?;
    let (first, last) = ends(&vertical);
    if first < 0.0 || last > 180.0 {
        return words.fail(format!(
            "{what} run from {first} to {last}; they must be within 0 to 180"
        ));
    }
    let mut candela = Vec::new();
    let scale = lumens / 1000.0 * if conversion > 0.0 { conversion } else { 1.0 };
    for _ in 0..planes.given.saturating_mul(angles) {
        candela.push(scale * words.within("an intensity", 0.0..=1e12, "0 or more")?);
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
    words.fail(DARK)
}

/// The planes around the axis.
struct Planes {
    horizontal: Vec<f64>,
    symmetry: Symmetry,
    /// Number of planes with intensities; the others mirror them.
    given: usize,
    /// True when they are given from the last to the first.
    is_reversed: bool,
    /// True when the first plane is repeated at the end of the turn.
    is_closed_here: bool,
}

impl Planes {
    /// From the angles of all planes and the format's symmetry number.
    fn of(all: Vec<f64>, symmetry: u8) -> Result<Planes, String> {
        let within = |most: f64| {
            all.iter()
                .copied()
                .filter(|c| *c <= most)
                .collect::<Vec<f64>>()
        };
        let (horizontal, symmetry, expected) = match symmetry {
            1 => (vec![0.0], Symmetry::Round, 1),
            2 => (within(180.0), Symmetry::Half, all.len() / 2 + 1),
            // Given from 270 through 0 to 90: seen from the other side of the mirror, from 270 back
            // to 90.
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
        let (first, last) = ends(&horizontal);
        let is_whole = match symmetry {
            Symmetry::Round => true,
            Symmetry::None => first >= 0.0 && last <= 360.0,
            Symmetry::Across => given == expected && (first, last) == (90.0, 270.0),
            Symmetry::Half => given == expected && (first, last) == (0.0, 180.0),
            Symmetry::Quadrant => given == expected && (first, last) == (0.0, 90.0),
        };
        if !is_whole {
            return Err(format!(
                "the planes run from {first} to {last}; they do not fit the symmetry that the file \
                 states"
            ));
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
