//! What motions come to, in the model's own terms.

use super::Motion;

impl Motion {
    /// The level it arrives at, 0 to 1.
    pub fn target(&self) -> f64 {
        match self {
            Motion::To(level) => *level,
            Motion::Path(path) => path.knots.last().map_or(0.0, |k| k.level),
        }
    }
}
