//! From light to displayed brightness.

/// How light becomes a displayed brightness. Both map 0 to 0 and mean "white" by exposed light 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneCurve {
    /// A shoulder, each channel by itself, so that bright coloured light pales as it does on film:
    /// y (1 + y / w^2) / (1 + y) with y = 2 x and w = 5 (Reinhard, Stark, Shirley and Ferwerda,
    /// "Photographic Tone Reproduction for Digital Images", 2002, equation 4). Darks are up to
    /// twice as bright as in truth, light 1 shows at 0.72, light 2.5 and more as full white.
    #[default]
    Filmic,
    /// As it is, cut at white.
    Plain,
}

/// y for x in [`ToneCurve::Filmic`].
const GAIN: f64 = 2.0;
/// The y that shows as full white.
const WHITE: f64 = 5.0;

impl ToneCurve {
    /// The displayed brightness, 0 to 1, of exposed light.
    pub fn apply(self, light: f64) -> f64 {
        let x = light.max(0.0);
        match self {
            // A quotient of infinities otherwise.
            ToneCurve::Filmic if GAIN * x >= WHITE => 1.0,
            ToneCurve::Filmic => {
                let y = GAIN * x;
                y * (1.0 + y / (WHITE * WHITE)) / (1.0 + y)
            }
            ToneCurve::Plain => x.min(1.0),
        }
    }

    /// Brightness per light at black.
    pub fn slope(self) -> f64 {
        match self {
            ToneCurve::Filmic => GAIN,
            ToneCurve::Plain => 1.0,
        }
    }

    /// The exposed light that shows as `brightness`, 0 to 1: the positive root of
    /// y^2 / w^2 + (1 - b) y - b = 0.
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
