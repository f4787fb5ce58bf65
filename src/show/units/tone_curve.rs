//! Tone curves, from light to displayed brightness.

/// A tone curve. Both map 0 to 0, and exposed light 1 means "white".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// A shoulder for each channel separately, so that bright coloured light pales as on film: y
    /// (1 + y / w^2) / (1 + y) with y = 2 x and w = 5 (Reinhard, Stark, Shirley and Ferwerda,
    /// "Photographic Tone Reproduction for Digital Images", 2002, equation 4). Darks are up to
    /// twice as bright as with `Plain`, light 1 shows at 0.72, light 2.5 and more as full white.
    #[default]
    Filmic,
    /// Linear, clipped at white.
    Plain,
}

/// The ratio y / x in [`ToneCurve::Filmic`].
const GAIN: f64 = 2.0;
/// The y that shows as full white.
const WHITE: f64 = 5.0;

impl ToneCurve {
    /// The displayed brightness, 0 to 1, of exposed light.
    pub fn apply(self, light: f64) -> f64 {
        let x = light.max(0.0);
        match self {
            // Otherwise the quotient would be of infinities.
            ToneCurve::Filmic if GAIN * x >= WHITE => 1.0,
            ToneCurve::Filmic => {
                let y = GAIN * x;
                y * (1.0 + y / (WHITE * WHITE)) / (1.0 + y)
            }
            ToneCurve::Plain => x.min(1.0),
        }
    }

    /// Slope at black.
    pub fn slope(self) -> f64 {
        match self {
            ToneCurve::Filmic => GAIN,
            ToneCurve::Plain => 1.0,
        }
    }

    /// The exposed light that shows as `brightness`, 0 to 1: the positive root of y^2 / w^2 + (1 -
    /// b) y - b = 0.
    pub fn invert(self, brightness: f64) -> f64 {
        let b = brightness.clamp(0.0, 1.0);
        match self {
            ToneCurve::Filmic => {
                let root = (1.0 - b).hypot(2.0 * b.sqrt() / WHITE);
                // Rationalised: the plain form cancels for small b.
                2.0 * b / (root + (1.0 - b)) / GAIN
            }
            ToneCurve::Plain => b,
        }
    }
}
