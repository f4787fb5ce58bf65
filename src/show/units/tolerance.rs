//! Error tolerance of images.

use std::fmt;

use serde::Serialize;

/// Measure of an error. The error of a sequence is that of its worst moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ErrorUnit {
    /// Root mean square of the difference, relative to that of the light.
    #[default]
    Light,
    /// The displayed difference, in steps of 255 of the channel that differs most: the 99th
    /// percentile over the pixels.
    Steps,
}

/// A permitted error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The number: 0.02 is 2 % of the light, 1.5 is 1.5 steps.
    pub error: f64,
    /// Its measure.
    pub unit: ErrorUnit,
}

impl Tolerance {
    /// A tolerance in displayed steps of 255.
    pub fn steps(error: f64) -> Tolerance {
        let unit = ErrorUnit::Steps;
        Tolerance { error, unit }
    }

    /// Reads `1.5 steps`, `1.5steps` or `1 step`; `None` for anything else, or more than 255 steps.
    pub fn parse_steps(text: &str) -> Option<Tolerance> {
        let number = text.strip_suffix("steps").or(text.strip_suffix("step"))?;
        let steps = number.trim_end().parse::<f64>().ok()?;
        (0.0..=255.0).contains(&steps).then_some(Self::steps(steps))
    }
}

impl From<f64> for Tolerance {
    /// A tolerance relative to the light.
    fn from(error: f64) -> Tolerance {
        let unit = ErrorUnit::Light;
        Tolerance { error, unit }
    }
}

impl fmt::Display for Tolerance {
    /// Writes it like a cue sheet.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.unit {
            // Remove the rounding of a division by a hundred.
            ErrorUnit::Light => write!(f, "{}%", (self.error * 1e6).round() / 1e4),
            ErrorUnit::Steps => write!(f, "{} steps", self.error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_comes_back() {
        for text in ["0 steps", "1.5 steps", "255 steps"] {
            assert_eq!(
                Tolerance::parse_steps(text).map(|t| t.to_string()),
                Some(text.to_owned())
            );
        }
        assert_eq!(
            Tolerance::parse_steps("1 step"),
            Some(Tolerance::steps(1.0))
        );
        assert_eq!(
            Tolerance::parse_steps("2steps"),
            Some(Tolerance::steps(2.0))
        );
        for wrong in [
            "256 steps",
            "-1 steps",
            "steps",
            "NaN steps",
            "2",
            "1.5 stepss",
        ] {
            assert_eq!(Tolerance::parse_steps(wrong), None, "{wrong}");
        }
        assert_eq!(Tolerance::from(0.07).to_string(), "7%");
    }
}
