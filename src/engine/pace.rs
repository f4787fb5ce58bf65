//! Speed of rendering on this machine relative to the operator's prediction.

/// Ratio of measured to predicted seconds, once measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace(Option<f64>);

impl Pace {
    /// Actual seconds per predicted second; one while unknown.
    pub fn seconds(self) -> f64 {
        self.0.unwrap_or(1.0)
    }

    /// True after a measurement.
    pub fn is_known(self) -> bool {
        self.0.is_some()
    }

    /// Updates the ratio from a prediction, which includes the current ratio, and a measurement.
    /// Only the last one counts, because the machine's load may change.
    pub fn learn(&mut self, predicted: f64, measured: f64) {
        let ratio = measured / predicted;
        if ratio.is_finite() && ratio > 0.0 {
            self.0 = Some(self.seconds() * ratio);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pace_is_that_of_the_last_rendering() {
        let mut scale = Pace::default();
        scale.learn(1.0, 3.0);
        assert_eq!(scale.seconds(), 3.0);
        scale.learn(3.0, 1.5);
        assert_eq!(scale.seconds(), 1.5);
        // A clock that stands still, an unknown cost.
        scale.learn(3.0, 0.0);
        scale.learn(0.0, 1.0);
        assert_eq!(scale.seconds(), 1.5);
    }
}
