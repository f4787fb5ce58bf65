//! How long rendering takes on this machine against what the operator predicts.

/// Measured against predicted seconds, once something was measured.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace(Option<f64>);

impl Pace {
    /// Seconds of what is predicted to take one; one while nothing is known.
    pub fn seconds(self) -> f64 {
        self.0.unwrap_or(1.0)
    }

    /// True once something was measured.
    pub fn is_known(self) -> bool {
        self.0.is_some()
    }

    /// Takes what was predicted, this scale in it, against what it took. Only the last counts: the
    /// machine may have other work now than it had before.
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
        // A clock that stands still, a cost that is not known.
        scale.learn(3.0, 0.0);
        scale.learn(0.0, 1.0);
        assert_eq!(scale.seconds(), 1.5);
    }
}
