//! The text of an LM-63 file: lines up to `TILT=`, then numbers in a row with blanks, commas and
//! line ends between them.

use super::{Distribution, Symmetry};

/// The largest file that is read.
pub const MOST_BYTES: usize = 8 << 20;
/// The most angles in one direction.
pub const MOST_ANGLES: usize = 3601;
/// The most intensities.
const MOST_VALUES: usize = 500_000;
/// The most lines before `TILT=`.
const MOST_KEYWORDS: usize = 1000;

/// Why a photometric file could not be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("line {line}: {wrong}")]
pub struct PhotometricError {
    /// Counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub wrong: Wrong,
}

/// What is wrong with a line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Wrong {
    /// Neither format.
    #[error(
        "this is neither IES LM-63 (no line has `TILT=`) nor EULUMDAT (lines 2 and 3 have no whole \
         numbers from 0 to 4)"
    )]
    Format,
    /// The file ends too early.
    #[error("the file ends where {0} should stand")]
    End(&'static str),
    /// Not a finite number.
    #[error("`{text}` is not a number; {what} should stand here")]
    Number {
        /// As written, cut short.
        text: String,
        /// What was wanted.
        what: &'static str,
    },
    /// A number that this quantity cannot have.
    #[error("{what} is {value}; it must be {must}")]
    Range {
        /// Which quantity.
        what: &'static str,
        /// As written.
        value: f64,
        /// What it may be.
        must: &'static str,
    },
    /// Type A or B photometry.
    #[error(
        "the photometry is of type {0}; only type C is read (convert the file, or ask its maker for type C)"
    )]
    Type(char),
    /// Angles that do not increase.
    #[error("{what}: {next} follows {before}; they must increase strictly")]
    Order {
        /// Which angles.
        what: &'static str,
        /// The one before.
        before: f64,
        /// The one that does not come after it.
        next: f64,
    },
    /// Angles outside 0 to 180, or 0 to 360.
    #[error("{what} run from {first} to {last}; {must}")]
    Span {
        /// Which angles.
        what: &'static str,
        /// The first.
        first: f64,
        /// The last.
        last: f64,
        /// What they may run over.
        must: &'static str,
    },
    /// More numbers than were announced.
    #[error("`{0}` stands after the last of the announced intensities")]
    More(String),
    /// Every intensity is zero.
    #[error("all intensities are zero")]
    Dark,
    /// Too large.
    #[error("the file has {bytes} bytes; {MOST_BYTES} are read")]
    Large {
        /// Its size.
        bytes: usize,
    },
}

/// Words with their lines.
struct Words<'a> {
    all: Box<dyn Iterator<Item = (usize, &'a str)> + 'a>,
    /// The line of the last word.
    line: usize,
}

pub(super) fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

fn separator(c: char) -> bool {
    c.is_whitespace() || c == ',' || c == '\u{1a}' || c == '\0'
}

impl Words<'_> {
    fn fail<T>(&self, wrong: Wrong) -> Result<T, PhotometricError> {
        Err(PhotometricError {
            line: self.line,
            wrong,
        })
    }

    fn number(&mut self, what: &'static str) -> Result<f64, PhotometricError> {
        let Some((line, text)) = self.all.next() else {
            return self.fail(Wrong::End(what));
        };
        self.line = line;
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() && value.abs() <= 1e12 => Ok(value),
            _ => self.fail(Wrong::Number {
                text: shown(text),
                what,
            }),
        }
    }

    fn positive(&mut self, what: &'static str) -> Result<f64, PhotometricError> {
        let value = self.number(what)?;
        if value > 0.0 {
            return Ok(value);
        }
        let must = "above 0";
        self.fail(Wrong::Range { what, value, must })
    }

    fn count(&mut self, what: &'static str) -> Result<usize, PhotometricError> {
        let value = self.number(what)?;
        if value >= 1.0 && value <= MOST_ANGLES as f64 && value.fract() == 0.0 {
            return Ok(value as usize);
        }
        let must = "a whole number from 1 to 3601";
        self.fail(Wrong::Range { what, value, must })
    }

    /// So many numbers; memory grows with what is there, not with what is announced.
    fn row(&mut self, count: usize, what: &'static str) -> Result<Vec<f64>, PhotometricError> {
        (0..count).map(|_| self.number(what)).collect()
    }

    /// Strictly increasing angles.
    fn angles(&mut self, count: usize, what: &'static str) -> Result<Vec<f64>, PhotometricError> {
        let mut out: Vec<f64> = Vec::new();
        for _ in 0..count {
            let next = self.number(what)?;
            if let Err(wrong) = push_increasing(&mut out, next, what) {
                return self.fail(wrong);
            }
        }
        Ok(out)
    }
}

/// Adds an angle that must be above the one before it.
pub(super) fn push_increasing(
    angles: &mut Vec<f64>,
    next: f64,
    what: &'static str,
) -> Result<(), Wrong> {
    if let Some(before) = angles.last().copied().filter(|before| *before >= next) {
        return Err(Wrong::Order { what, before, next });
    }
    angles.push(next);
    Ok(())
}

/// Reads a file, with a note of a lamp tilt that was not taken.
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

/// The number of the `TILT=` line and what it says.
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
    let wrong = Wrong::Format;
    Err(PhotometricError { line: last, wrong })
}

/// The tilt block: the lamp's posture, and factors by angle. Checked, not used.
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
        let what = "the number of intensities";
        let (value, must) = ((vertical * horizontal) as f64, "500,000 at most");
        return words.fail(Wrong::Range { what, value, must });
    }
    match words.number("the type of photometry")? {
        1.0 => {}
        2.0 => return words.fail(Wrong::Type('B')),
        3.0 => return words.fail(Wrong::Type('A')),
        value => {
            let (what, must) = ("the type of photometry", "1 (C), 2 (B) or 3 (A)");
            return words.fail(Wrong::Range { what, value, must });
        }
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
        let what = "an intensity";
        let value = words.number(what)?;
        if value < 0.0 || !(value * scale).is_finite() {
            let must = "0 or more, and finite with its factors";
            return words.fail(Wrong::Range { what, value, must });
        }
        candela.push(value * scale);
    }
    if symmetry == Symmetry::None && horizontal.last().is_some_and(|last| *last < 360.0) {
        horizontal.push(360.0);
        candela.extend_from_within(..vertical.len());
    }
    if let Some((line, text)) = words.all.next() {
        let wrong = Wrong::More(shown(text));
        return Err(PhotometricError { line, wrong });
    }
    let out = Distribution {
        vertical,
        horizontal,
        symmetry,
        candela,
        lamp_lumens: (lumens > 0.0).then_some(lamps * lumens),
    };
    // One angle alone, or light along the axis only, has no flux either.
    if out.flux() > 0.0 {
        return Ok(out);
    }
    words.fail(Wrong::Dark)
}

fn verticals(words: &mut Words<'_>, count: usize) -> Result<Vec<f64>, PhotometricError> {
    let what = "the vertical angles";
    let angles = words.angles(count, what)?;
    let (first, last) = ends(words, &angles, what)?;
    if angles.len() >= 2 && first >= 0.0 && last <= 180.0 {
        return Ok(angles);
    }
    words.fail(Wrong::Span {
        what,
        first,
        last,
        must: "two or more are needed, within 0 to 180",
    })
}

/// The first and the last of the angles; the file ends without any.
fn ends(
    words: &Words<'_>,
    angles: &[f64],
    what: &'static str,
) -> Result<(f64, f64), PhotometricError> {
    match angles {
        [] => words.fail(Wrong::End(what)),
        [first] => Ok((*first, *first)),
        [first, .., last] => Ok((*first, *last)),
    }
}

/// Is the next angle 360, by the last step?
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
    let (first, last) = ends(words, &angles, what)?;
    let symmetry = match (first, last) {
        (0.0, 0.0) => Symmetry::Round,
        (0.0, 90.0) => Symmetry::Quadrant,
        (0.0, 180.0) => Symmetry::Half,
        (90.0, 270.0) => Symmetry::Across,
        (0.0, 360.0) => Symmetry::None,
        // Some stop one step short of where they began.
        (0.0, last) if last > 180.0 && is_one_short(&angles) => Symmetry::None,
        _ => {
            return words.fail(Wrong::Span {
                what,
                first,
                last,
                must: "they must be 0 alone, or run from 0 to 90, 180 or 360, or from 90 to 270",
            });
        }
    };
    Ok((angles, symmetry))
}
