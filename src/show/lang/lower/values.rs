//! Single values: quantities of a wanted kind, levels, colours, positions.

use std::borrow::Cow;

use super::Lower;
use super::calculation::result;
use super::colour::is_colour;
use crate::diagnostic::Diagnostic;
use crate::geometry::Vec3;
use crate::lang::ast::{Span, Word};
use crate::lang::names::nearest;
use crate::lang::quantity::{self, Fault, UNITS, Unit, Wanted};
use crate::lang::report::Place;
use crate::lang::{codes, limits};
use crate::units::{Rgb, Time, fraction};

/// The setting of a bank: a level, a colour, or both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// 0 to 1.
    pub level: Option<f64>,
    /// Linear, each channel 0 to 1, with its span.
    pub colour: Option<(Rgb, Span)>,
}

/// Named sizes of images.
const SIZES: [(&str, (&str, &str)); 4] = [
    ("360p", ("640", "360")),
    ("720p", ("1280", "720")),
    ("1080p", ("1920", "1080")),
    ("4k", ("3840", "2160")),
];

/// Rewrites a time with an English unit, `5 seconds`, in the unit of the language.
fn timed(digits: &str, unit: &str) -> Option<String> {
    let seconds = match unit {
        "sec" | "secs" | "second" | "seconds" => return Some(format!("{digits}s")),
        "min" | "mins" | "minute" | "minutes" => 60.0 * digits.parse::<f64>().ok()?,
        _ => return None,
    };
    Some(format!(
        "{}:{:02}",
        (seconds / 60.0).floor(),
        seconds % 60.0
    ))
}

impl Lower<'_, '_> {
    pub fn fault<T>(&mut self, word: Word<'_>, wanted: Wanted, fault: &Fault) -> Option<T> {
        let diagnostic = match fault {
            Fault::Kind(kind) => Diagnostic::error(
                codes::WRONG_QUANTITY,
                format!(
                    "expected {}, but `{}` is {kind}",
                    wanted.phrase(),
                    word.text
                ),
            )
            .place(word.span, format!("this is {kind}"))
            .help(wanted.example()),
            Fault::Unit(unit) => {
                let base =
                    Diagnostic::error(codes::BAD_NUMBER, format!("there is no unit `{unit}`"))
                        .place(word.span, "unknown unit")
                        .help(wanted.example());
                let digits = word.text.trim_end_matches(unit.as_str()).trim_end();
                let near = || Some(format!("{digits}{}", nearest(unit, UNITS.into_iter())?));
                match timed(digits, unit).or_else(near) {
                    Some(meant) => base.help(format!("did you mean `{meant}`?")),
                    None => base,
                }
            }
            Fault::Digits(why) => Diagnostic::error(
                codes::BAD_NUMBER,
                format!("`{}` is not {}: {why}", word.text, wanted.phrase()),
            )
            .place(word.span, "")
            .help(wanted.example()),
        };
        self.report.add(diagnostic);
        None
    }

    /// The text of a word that must not be a colour.
    fn uncoloured<'w>(&mut self, word: Word<'w>, wanted: Wanted) -> Option<Cow<'w, str>> {
        let text = self.text(word)?;
        if is_colour(&text) {
            return self.fault(word, wanted, &Fault::Kind("a colour"));
        }
        Some(text)
    }

    /// A quantity of the wanted kind, and its text as [`Lower::text`] has it.
    fn quantity<'w>(&mut self, word: Word<'w>, wanted: Wanted) -> Option<(f64, Cow<'w, str>)> {
        let text = self.uncoloured(word, wanted)?;
        match quantity::read(&text, wanted) {
            Ok(value) => Some((value, text)),
            Err(fault) => self.fault(word, wanted, &fault),
        }
    }

    /// A quantity within bounds; `range` names them in messages.
    pub fn within(
        &mut self,
        word: Word<'_>,
        wanted: Wanted,
        (least, most): (f64, f64),
        range: &str,
    ) -> Option<f64> {
        let (value, text) = self.quantity(word, wanted)?;
        if (least..=most).contains(&value) {
            return Some(value);
        }
        let which = result(word, &text);
        let message = format!("`{}`{which} is out of range: {range}", word.text);
        self.report
            .error(codes::RANGE, message, (word.span, "out of range"), "")
    }

    /// A time, of either sign.
    pub fn time(&mut self, word: Word<'_>) -> Option<Time> {
        let text = self.uncoloured(word, Wanted::Time)?;
        match quantity::time(&text) {
            Ok(time) => Some(time),
            Err(fault) => self.fault(word, Wanted::Time, &fault),
        }
    }

    /// A time that is not negative.
    pub fn duration(&mut self, word: Word<'_>) -> Option<Time> {
        let time = self.time(word)?;
        if time >= Time::ZERO {
            return Some(time);
        }
        let message = format!("`{}` is negative: only `hang` may be", word.text);
        let help = Wanted::Time.example();
        self.report
            .error(codes::RANGE, message, (word.span, "negative"), help)
    }

    /// A whole number from 1.
    pub fn count(&mut self, word: Word<'_>, most: u32, what: &str) -> Option<u32> {
        match word.text.parse::<u32>() {
            Ok(n) if (1..=most).contains(&n) => Some(n),
            _ => {
                let message = format!("`{}` is out of range: {what} is 1 to {most}", word.text);
                self.report
                    .error(codes::RANGE, message, (word.span, "out of range"), "")
            }
        }
    }

    /// A level as a fraction of full.
    pub fn level(&mut self, word: Word<'_>) -> Option<f64> {
        match word.text {
            "full" => return Some(1.0),
            "out" => return Some(0.0),
            _ => {}
        }
        let (percent, text) = self.quantity(word, Wanted::Level)?;
        if (0.0..=100.0).contains(&percent) {
            return Some(fraction(percent));
        }
        let which = result(word, &text);
        let message = format!("the level `{}`{which} is outside 0 to 100", word.text);
        let help = if percent > 100.0 {
            "the brightest is `full`"
        } else {
            "the darkest is `out`"
        };
        self.report.error(
            codes::LEVEL_RANGE,
            message,
            (word.span, "not a level"),
            help,
        )
    }

    /// A level, a colour, or a colour temperature as a colour (its brightest channel full).
    pub fn setting(&mut self, word: Word<'_>) -> Option<Setting> {
        let text = self.text(word)?;
        let colour = if is_colour(&text) {
            self.colour(word)?
        } else if quantity::unit(&text) == Ok(Unit::Kelvin) {
            let colour = self.kelvin(word)?;
            let brightest = colour.0.into_iter().fold(0.0, f64::max);
            colour.scaled(1.0 / brightest)
        } else {
            let level = Some(self.level(word)?);
            let colour = None;
            return Some(Setting { level, colour });
        };
        Some(Setting {
            level: None,
            colour: Some((colour, word.span)),
        })
    }

    /// A level and a colour in either order, or one of the two.
    pub fn settings(&mut self, word: Word<'_>, second: Option<Word<'_>>) -> Option<Setting> {
        let first = self.setting(word)?;
        let Some(second) = second else {
            return Some(first);
        };
        let other = self.setting(second)?;
        let what = match (first.level.is_some(), other.level.is_some()) {
            (true, true) => "levels",
            (false, false) => "colours",
            _ => {
                return Some(Setting {
                    level: first.level.or(other.level),
                    colour: first.colour.or(other.colour),
                });
            }
        };
        let message = format!("`{}` and `{}` are two {what}", word.text, second.text);
        let help = "a bank goes to one level and, if it is rgb, to one colour: `sky 60 #203060`";
        self.report.error(
            codes::DOES_NOT_FIT,
            message,
            (second.span, "one too many"),
            help,
        )
    }

    /// A colour temperature as a colour of luminance 1.
    pub fn kelvin(&mut self, word: Word<'_>) -> Option<Rgb> {
        let text = self.text(word)?;
        let kelvin = quantity::number(&text).ok();
        if let Some(colour) = kelvin.and_then(Rgb::from_kelvin) {
            return Some(colour);
        }
        let message = format!(
            "`{}`{} is out of range: colour temperatures are 1000 K to 25000 K",
            word.text,
            result(word, &text)
        );
        let help = "a tungsten lamp has `3200 K`, a candle `1900 K`";
        self.report
            .error(codes::RANGE, message, (word.span, "out of range"), help)
    }

    /// Three lengths.
    pub fn position(&mut self, words: &[Word<'_>]) -> Option<Vec3> {
        let lengths: Vec<Option<f64>> = words
            .iter()
            .map(|w| {
                self.within(
                    *w,
                    Wanted::Length,
                    (-1e5, 1e5),
                    "positions are within 100 km",
                )
            })
            .collect();
        match lengths.as_slice() {
            [Some(x), Some(y), Some(z)] => Some(crate::geometry::vec3(*x, *y, *z)),
            _ => None,
        }
    }

    /// Pixels, `640x360` or one of [`SIZES`].
    pub fn size(&mut self, word: Word<'_>) -> Option<(usize, usize)> {
        let (width, height) = match SIZES.iter().find(|(name, _)| *name == word.text) {
            Some((_, size)) => *size,
            None => word.text.split_once('x').unwrap_or_default(),
        };
        let pixels = |t: &str| t.parse().ok().filter(|n| (1..=limits::PIXELS).contains(n));
        match (pixels(width), pixels(height)) {
            (Some(width), Some(height)) => Some((width, height)),
            _ => {
                let most = limits::PIXELS;
                let message = format!(
                    "`{}` is out of range: pictures are 1 to {most} pixels a side",
                    word.text
                );
                let help = "write a size as `640x360`, `720p`, `1080p` or `4k`";
                self.report
                    .error(codes::RANGE, message, (word.span, "out of range"), help)
            }
        }
    }
}
