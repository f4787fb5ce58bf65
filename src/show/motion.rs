//! What motions and fades come to, in the model's own terms.

use super::{Fade, Motion, Show};

impl Motion {
    /// The level it arrives at, 0 to 1.
    pub fn target(&self) -> f64 {
        match self {
            Motion::To(level) => *level,
            Motion::Path(path) => path.knots.last().map_or(0.0, |k| k.level),
        }
    }
}

impl Fade {
    /// As the text calls it.
    pub fn name(self, show: &Show) -> &str {
        match self {
            Fade::Linear => "linear",
            Fade::Ease => "ease",
            Fade::Square => "square",
            Fade::SlowTop => "slow-top",
            Fade::SlowBottom => "slow-bottom",
            Fade::Curve(i) => show.curves.get(i).map_or("", |c| c.name.as_str()),
        }
    }
}
