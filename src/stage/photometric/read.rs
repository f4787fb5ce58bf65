//! The text of an LM-63 file: lines up to `TILT=`, then numbers separated by blanks, commas and
//! line ends.

use std::ops::RangeInclusive;

use super::{Distribution, Symmetry};

/// Most bytes of a file.
pub const MOST_BYTES: usize = 8 << 20;
/// Most angles in one direction.
const MOST_ANGLES: f64 = 3601.0;
/// Most intensities.
const MOST_VALUES: usize = 500_000;
pub(super) const DARK: &str = "all intensities are zero";
/// Most lines before `TILT=`.
const MOST_KEYWORDS: usize = 1000;

/// Error of reading a photometric file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {wrong}")]
pub struct PhotometricError {
    /// Counted from 1.
    pub line: usize,
    /// The fault on that line.
    pub wrong: String,
}

/// Words with their lines.
pub(super) struct Words<'a> {
    pub(super) all: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    /// The line of the last word.
    pub(super) line: usize,
}

fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

fn separator(c: char) -> bool {
    c.is_whitespace() || c == ',' || c == '\u{1a}' || c == '\0'
}

impl Words<'_> {
    pub(super) fn fail<T>(&self, wrong: impl Into<String>) -> Result<T, PhotometricError> {
        Err(PhotometricError {
            line: self.line,
            wrong: wrong.into(),
        })
    }

    pub(super) fn number(&mut self, what: &str) -> Result<f64, PhotometricError> {
        let Some((line, text)) = self.all.next() else {
            return self.fail(format!("the file ends where {what} should stand"));
        };
        self.line = line;
        // Some countries write decimals with a comma; in LM-63 it separates words.
        match text.replace(',', ".").parse::<f64>() {
            Ok(value) if value.is_finite() && value.abs() <= 1e12 => Ok(value),
            _ => {
                let text = shown(text);
                self.fail(format!(
                    "`{text}` is not a number; {what} should stand here"
                ))
            }
        }
    }

    /// A number within a range, which `must` describes.
    pub(super) fn within(
        &mut self,
        what: &str,
        range: RangeInclusive<f64>,
        must: &str,
    ) -> Result<f64, PhotometricError> {
        let value = self.number(what)?;
        if range.contains(&value) {
            return Ok(value);
        }
        self.fail(format!("{what} is {value}; it must be {must}"))
    }

    pub(super) fn positive(&mut self, what: &str) -> Result<f64, PhotometricError> {
        self.within(what, f64::MIN_POSITIVE..=1e12, "above 0")
    }

    pub(super) fn count(&mut self, what: &str) -> Result<usize, PhotometricError> {
        let must = "a whole number from 1 to 3601";
        let value = self.within(what, 1.0..=MOST_ANGLES, must)?;
        if value.fract() == 0.0 {
            return Ok(value as usize);
        }
        self.fail(format!("{what} is {value}; it must be {must}"))
    }

    /// Reads `count` numbers; memory grows with the numbers found, not with the count.
    fn row(&mut self, count: usize, what: &str) -> Result<Vec<f64>, PhotometricError> {
        (0..count).map(|_| self.number(what)).collect()
    }

    /// Strictly increasing angles.
    pub(super) fn angles(
        &mut self,
        count: usize,
        what: &str,
    ) -> Result<Vec<f64>, PhotometricError> {
        let mut out: Vec<f64> = Vec::new();
        for _ in 0..count {
            let next = self.number(what)?;
            if let Some(before) = out.last().filter(|before| **before >= next) {
                return self.fail(format!(
                    "{what}: {next} follows {before}; they must increase strictly"
                ));
            }
            out.push(next);
        }
        Ok(out)
    }
}

/// Reads a file; the second value is a note on an unused lamp tilt.
pub(super) fn distribution(text: &str) -> Result<(Distribution, Option<String>), PhotometricError> {
    let (line, tilt) = tilt(text)?;
    let lines = text.lines().enumerate().skip(line);
    let mut words = Words {
        all: Box::new(lines.flat_map(|(i, l)| {
            let words = l.split(separator).filter(|w| !w.is_empty());
            words.map(move |w| (i + 1, w))
        })),
        line,
    };
    let mut note = None;
    match tilt {
        _ if tilt.eq_ignore_ascii_case("NONE") => {}
        _ if tilt.eq_ignore_ascii_case("INCLUDE") => included(&mut words)?,
        other => note = Some(format!("`TILT={}`: read as `TILT=NONE`", shown(other))),
    }
    let is_2019 = text.trim_start().starts_with("IES:LM-63-2019");
    Ok((numbers(&mut words, is_2019)?, note))
}

/// Line number and value of `TILT=`.
fn tilt(text: &str) -> Result<(usize, &str), PhotometricError> {
    let mut last = 1;
    for (i, line) in text.lines().enumerate().take(MOST_KEYWORDS) {
        last = i + 1;
        if let Some((keyword, tilt)) = line.split_once('=')
            && keyword.trim().eq_ignore_ascii_case("TILT")
        {
            return Ok((last, tilt.trim()));
        }
    }
    let wrong = "this is neither IES LM-63 (no line has `TILT=`) nor EULUMDAT (lines 2 and 3 have no \
                 whole numbers from 0 to 4)";
    Err(PhotometricError {
        line: last,
        wrong: wrong.to_owned(),
    })
}

/// Reads the tilt block, the lamp's posture and factors by angle; checked, not used.
fn included(words: &mut Words<'_>) -> Result<(), PhotometricError> {
    words.number("the lamp's posture in its luminaire")?;
    let count = words.count("the number of tilt angles")?;
    words.angles(count, "tilt angles")?;
    words.row(count, "tilt factors")?;
    Ok(())
}

fn numbers(words: &mut Words<'_>, is_2019: bool) -> Result<Distribution, PhotometricError> {
    let lamps = words.positive("the number of lamps")?;
    let lumens = words.number("the lumens of a lamp")?;
    let multiplier = words.positive("the multiplier of the intensities")?;
    let vertical = words.count("the number of vertical angles")?;
    let horizontal = words.count("the number of horizontal angles")?;
    if vertical * horizontal > MOST_VALUES {
        let count = vertical * horizontal;
        return words.fail(format!(
            "the number of intensities is {count}; it must be 500,000 at most"
        ));
    }
    let kind = words.number("the type of photometry")?;
    if kind == 2.0 || kind == 3.0 {
        let letter = if kind == 2.0 { 'B' } else { 'A' };
        return words.fail(format!(
            "the photometry is of type {letter}; only type C is read (convert the file, or ask its \
             maker for type C)"
        ));
    }
    if kind != 1.0 {
        return words.fail(format!(
            "the type of photometry is {kind}; it must be 1 (C), 2 (B) or 3 (A)"
        ));
    }
    words.number("the unit of lengths")?;
    words.row(3, "the size of the opening")?;
    let ballast = words.positive("the ballast factor")?;
    let lamp_factor = words.positive("the ballast-lamp factor")?;
    // LM-63-2019 has the type of the file here: 1.00001 for an unaccredited laboratory and so on.
    let lamp_factor = if is_2019 { 1.0 } else { lamp_factor };
    words.number("the input watts")?;
    let vertical = verticals(words, vertical)?;
    let (mut horizontal, symmetry) = horizontals(words, horizontal)?;
    let scale = multiplier * ballast * lamp_factor;
    let mut candela = Vec::new();
    for _ in 0..vertical.len() * horizontal.len() {
        let value = words.within("an intensity", 0.0..=1e12, "0 or more")?;
        candela.push(value * scale);
    }
    if symmetry == Symmetry::None && horizontal.last().is_some_and(|last| *last < 360.0) {
        horizontal.push(360.0);
        candela.extend_from_within(..vertical.len());
    }
    if let Some((line, text)) = words.all.next() {
        words.line = line;
        let text = shown(text);
        return words.fail(format!(
            "`{text}` stands after the last of the announced intensities"
        ));
    }
    let out = Distribution {
        vertical,
        horizontal,
        symmetry,
        candela,
        lamp_lumens: (lumens > 0.0).then_some(lamps * lumens),
    };
    // A single angle, or light along the axis only, has no flux either.
    if out.flux() > 0.0 {
        return Ok(out);
    }
    words.fail(DARK)
}

fn verticals(words: &mut Words<'_>, count: usize) -> Result<Vec<f64>, PhotometricError> {
    let what = "the vertical angles";
    let angles = words.angles(count, what)?;
    let (first, last) = ends(&angles);
    if angles.len() >= 2 && first >= 0.0 && last <= 180.0 {
        return Ok(angles);
    }
    words.fail(format!(
        "{what} run from {first} to {last}; two or more are needed, within 0 to 180"
    ))
}

/// First and last of the angles, of which there is at least one.
pub(super) fn ends(angles: &[f64]) -> (f64, f64) {
    let end = |angle: Option<&f64>| angle.copied().unwrap_or_default();
    (end(angles.first()), end(angles.last()))
}

/// True when the next angle would be 360, by the last step.
fn is_one_short(angles: &[f64]) -> bool {
    match angles {
        [.., before, last] => (2.0 * last - before - 360.0).abs() < 1e-6,
        _ => false,
    }
}

fn horizontals(
    words: &mut Words<'_>,
    count: usize,
) -> Result<(Vec<f64>, Symmetry), PhotometricError> {
    let what = "the horizontal angles";
    let angles = words.angles(count, what)?;
    let (first, last) = ends(&angles);
    let symmetry = match (first, last) {
        (0.0, 0.0) => Symmetry::Round,
        (0.0, 90.0) => Symmetry::Quadrant,
        (0.0, 180.0) => Symmetry::Half,
        (90.0, 270.0) => Symmetry::Across,
        (0.0, 360.0) => Symmetry::None,
        // Some files stop one step short of a full turn.
        (0.0, last) if last > 180.0 && is_one_short(&angles) => Symmetry::None,
        _ => {
            return words.fail(format!(
                "{what} run from {first} to {last}; they must be 0 alone, or run from 0 to 90, 180 \
                 or 360, or from 90 to 270"
            ));
        }
    };
    Ok((angles, symmetry))
}
