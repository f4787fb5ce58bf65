//! Haze in the air of the whole stage.

/// A homogeneous medium that scatters and absorbs light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Haze {
    /// Extinction coefficient, 1/m, above 0: `exp(-extinction)` of a beam is left after a metre.
    pub extinction: f64,
    /// Mean cosine of the scattering angle, the `g` of Henyey and Greenstein (1941), between -1
    /// and 1. Above 0, light scatters mostly forwards; at 0, evenly.
    pub forward: f64,
    /// Share of the extinction that scatters, 0 to 1; the rest absorbs.
    pub albedo: f64,
}

impl Haze {
    /// Extinction times visibility: the contrast of an object falls to 5 % at the distance of the
    /// visibility (Koschmieder 1924), and `exp(-3)` is 0.05.
    pub const KOSCHMIEDER: f64 = 3.0;

    /// Distance at which the contrast of an object falls to 5 %, metres.
    pub fn visibility(&self) -> f64 {
        Haze::KOSCHMIEDER / self.extinction
    }
}
