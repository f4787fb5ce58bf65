//! Quantities with units, and the faults in them.
//!
//! Times are read digit by digit into whole microseconds, never through a float. This module
//! handles texts and units, and does not know where they stand or what they are for.

use crate::units::Time;

/// Kind of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// No unit: the context decides.
    Bare,
    /// `s`, `ms` or with a colon.
    Time,
    /// `%`
    Percent,
    /// A length, with the number of metres in one unit.
    Length(f64),
    /// `deg`
    Degree,
    /// `cd`
    Candela,
    /// `lm`
    Lumen,
    /// `cd/m2`
    Luminance,
    /// `K`
    Kelvin,
}

impl Unit {
    /// The kind's phrase, with an article.
    pub fn kind(self) -> &'static str {
        match self {
            Unit::Bare => "a number",
            Unit::Time => "a time",
            Unit::Percent => "a level",
            Unit::Length(_) => "a length",
            Unit::Degree => "an angle",
            Unit::Candela => "an intensity",
            Unit::Lumen => "a luminous flux",
            Unit::Luminance => "a luminance",
            Unit::Kelvin => "a colour temperature",
        }
    }
}

/// The kind of quantity that the context requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// A duration or an instant.
    Time,
    /// 0 to 100 percent.
    Level,
    /// Metres.
    Length,
    /// Degrees.
    Angle,
    /// A plain number.
    Number,
    /// A share of the whole in percent.
    Share,
}

impl Wanted {
    /// The phrase, with an article.
    pub fn phrase(self) -> &'static str {
        match self {
            Wanted::Time => "a time",
            Wanted::Level => "a level",
            Wanted::Length => "a length",
            Wanted::Angle => "an angle",
            Wanted::Number => "a plain number",
            Wanted::Share => "a percentage",
        }
    }

    /// An example of such a quantity.
    pub fn example(self) -> &'static str {
        match self {
            Wanted::Time => "write a time as `5`, `5s`, `1.5`, `1:30` or `250ms`",
            Wanted::Level => "write a level as `85`, `85%`, `full` or `out`",
            Wanted::Length => "write a length as `2.1`, `2.1m` or `7ft`",
            Wanted::Angle => "write an angle as `24` or `24deg`",
            Wanted::Number => "write a plain number as `0.5` or `25`",
            Wanted::Share => "write a percentage as `2%`",
        }
    }

    fn accepts(self, unit: Unit) -> bool {
        match self {
            Wanted::Time => unit == Unit::Time,
            Wanted::Level | Wanted::Share => unit == Unit::Percent,
            Wanted::Length => matches!(unit, Unit::Length(_)),
            Wanted::Angle => unit == Unit::Degree,
            Wanted::Number => false,
        }
    }
}

/// Reasons why a quantity cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The unit is of another kind.
    Kind(&'static str),
    /// The unit is unknown.
    Unit(String),
    /// The digits make no number, or one beyond every limit; the text gives the reason.
    Digits(&'static str),
}

/// Known units, for suggestions.
pub const UNITS: [&str; 13] = [
    "s", "ms", "m", "cm", "mm", "ft", "in", "deg", "cd", "lm", "cd/m2", "K", "%",
];

/// Splits a quantity into digits and unit.
fn split(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '-' | '.' | ':')));
    let (digits, unit) = text.split_at(end.unwrap_or(text.len()));
    (digits, unit.trim())
}

/// Reads the unit of a quantity.
///
/// # Errors
/// [`Fault::Unit`] for an unknown unit.
pub fn unit(text: &str) -> Result<Unit, Fault> {
    let (digits, unit) = split(text);
    Ok(match unit {
        "" if digits.contains(':') => Unit::Time,
        "" => Unit::Bare,
        "s" | "ms" => Unit::Time,
        "%" => Unit::Percent,
        "m" => Unit::Length(1.0),
        "cm" => Unit::Length(0.01),
        "mm" => Unit::Length(0.001),
        "ft" => Unit::Length(0.3048),
        "in" => Unit::Length(0.0254),
        "deg" => Unit::Degree,
        "cd" => Unit::Candela,
        "lm" => Unit::Lumen,
        "cd/m2" => Unit::Luminance,
        "K" => Unit::Kelvin,
        other => return Err(Fault::Unit(other.to_owned())),
    })
}

/// Reads the number of a quantity, whatever its unit; metres for lengths.
///
/// # Errors
/// [`Fault`] without a finite number.
pub fn number(text: &str) -> Result<f64, Fault> {
    let (digits, _) = split(text);
    let factor = match unit(text)? {
        Unit::Length(metres) => metres,
        _ => 1.0,
    };
    match digits.parse::<f64>() {
        Ok(value) if value.abs() <= 1e12 => Ok(value * factor),
        Ok(_) => Err(Fault::Digits("it is too large")),
        Err(_) => Err(Fault::Digits("only times are written with colons")),
    }
}

/// Reads a quantity of the wanted kind; times in seconds.
///
/// # Errors
/// [`Fault`].
pub fn read(text: &str, wanted: Wanted) -> Result<f64, Fault> {
    let unit = unit(text)?;
    if unit != Unit::Bare && !wanted.accepts(unit) {
        return Err(Fault::Kind(unit.kind()));
    }
    match wanted {
        Wanted::Time => time(text).map(Time::seconds),
        _ => number(text),
    }
}

/// Reads a time, exact to the microsecond.
///
/// # Errors
/// [`Fault`].
pub fn time(text: &str) -> Result<Time, Fault> {
    let found = unit(text)?;
    if !matches!(found, Unit::Bare | Unit::Time) {
        return Err(Fault::Kind(found.kind()));
    }
    let (digits, unit) = split(text);
    let clock = digits.contains(':');
    if clock && !unit.is_empty() {
        return Err(Fault::Digits("a time with colons takes no unit"));
    }
    let (negative, digits) = digits
        .strip_prefix('-')
        .map_or((false, digits), |rest| (true, rest));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let scale: i64 = if unit == "ms" { 1_000 } else { 1_000_000 };
    let micros = whole_seconds(whole, clock)?
        .checked_mul(scale)
        .and_then(|w| w.checked_add(decimals(fraction, scale)?))
        .filter(|us| *us <= Time::MAX.micros())
        .ok_or(Fault::Digits("a show lasts 1000 hours at most"))?;
    Ok(Time::from_micros(if negative { -micros } else { micros }))
}

fn whole_seconds(text: &str, clock: bool) -> Result<i64, Fault> {
    let fields: Vec<&str> = text.split(':').collect();
    if fields.len() > 3 {
        return Err(Fault::Digits(
            "a time is `minutes:seconds` or `hours:minutes:seconds`",
        ));
    }
    let mut total: i64 = 0;
    for (i, field) in fields.iter().enumerate() {
        let value: i64 = match field.parse() {
            Ok(value) if value <= 1_000_000_000 => value,
            _ => return Err(Fault::Digits("a show lasts 1000 hours at most")),
        };
        if clock && i > 0 && (value > 59 || field.len() != 2) {
            return Err(Fault::Digits("after a colon come two digits, 00 to 59"));
        }
        total = total * 60 + value;
    }
    Ok(total)
}

/// The digits after the point, in units of 1/`scale`; digits beyond a microsecond are dropped.
fn decimals(text: &str, scale: i64) -> Option<i64> {
    let mut value = 0;
    let mut place = scale;
    for digit in text.bytes() {
        place /= 10;
        value += i64::from(digit.checked_sub(b'0')?) * place;
    }
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact() {
        for (text, us) in [
            ("5", 5_000_000),
            ("5s", 5_000_000),
            ("1.5", 1_500_000),
            ("0.1", 100_000),
            ("4.35", 4_350_000),
            ("1:30", 90_000_000),
            ("1:02:03.5", 3_723_500_000),
            ("250ms", 250_000),
            ("0.5ms", 500),
            ("-2", -2_000_000),
        ] {
            assert_eq!(time(text), Ok(Time::from_micros(us)), "{text}");
        }
        assert_eq!(time("85%"), Err(Fault::Kind("a level")));
        assert_eq!(time("5sec"), Err(Fault::Unit("sec".into())));
        for bad in [
            "1:75",
            "1:5",
            "1:2:3:4",
            "1001:00:00",
            "99999999999999999999",
            "1:30s",
        ] {
            assert!(matches!(time(bad), Err(Fault::Digits(_))), "{bad}");
        }
    }

    #[test]
    fn units_are_checked() {
        assert_eq!(read("7ft", Wanted::Length), Ok(7.0 * 0.3048));
        assert_eq!(read("24", Wanted::Angle), Ok(24.0));
        assert_eq!(read("24m", Wanted::Angle), Err(Fault::Kind("a length")));
        assert_eq!(read("5s", Wanted::Level), Err(Fault::Kind("a time")));
        assert_eq!(unit("2700 K"), Ok(Unit::Kelvin));
        assert_eq!(unit("12cd/m2"), Ok(Unit::Luminance));
        assert_eq!(number("1200 cd"), Ok(1200.0));
    }
}
