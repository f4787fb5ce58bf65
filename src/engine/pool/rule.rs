//! Error estimates of coarse images from known corrections: as numbers, without images.
//!
//! With C_i and X_i the images of source i at the two coarse qualities, D_i = C_i - X_i is the
//! estimate of the coarse error, and K_j = R_j - C·s_j the correction known from refined image j. A
//! [`Fit`] describes how well D predicted K.

/// Evidence of one refined image: scalar products of its correction K with itself and with E = D·s,
/// the difference of the two coarse qualities at its setting, and ‖W s‖².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// K·K
    pub kk: f64,
    /// K·E
    pub ke: f64,
    /// E·E
    pub ee: f64,
    /// The sum of (w_i s_i)²: the value of E·E if the sources' errors were uncorrelated.
    pub expected: f64,
}

/// Safety factor on a prediction, with no refined image and with one: two quality steps share
/// errors invisible in their difference, up to three times as large (`examples/studies`).
const ROOM: [f64; 2] = [3.0, 4.0];

/// Relative excess over the wanted error that counts as rounding.
const ROUNDING: f64 = 1e-9;

/// True when an error `predicted` with this many refined images counts as within `wanted`. With
/// fewer than two refined images as evidence it must leave a safety margin, threefold or fourfold.
/// An error that is measured or usual ([`footlight_transport::Transport::usual_error`]) counts
/// without a margin.
pub fn is_within(wanted: f64, predicted: f64, refined: usize, is_stated: bool) -> bool {
    let room = ROOM.get(refined).filter(|_| !is_stated);
    room.unwrap_or(&1.0) * predicted <= wanted * (1.0 + ROUNDING)
}

/// The estimate, fitted to known corrections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Coarse images become C + a·D with this a; 0 before the first correction.
    pub extrapolation: f64,
    /// Factor on estimated errors.
    pub calibration: f64,
}

impl Fit {
    /// Fits the extrapolation factor and the calibration to all known corrections.
    ///
    /// The calibration is the root mean square of each correction's ratio to its expectation, with
    /// one further ratio, `prior`, for the estimate itself: sources err by different factors, so a
    /// few corrections must not stand for all. Ratios rather than sums, because the first
    /// corrections are the largest and would dominate.
    pub fn of(prior: f64, known: &[Evidence]) -> Fit {
        let sum = |of: fn(&Evidence) -> f64| -> f64 { known.iter().map(of).sum() };
        let (ke, ee) = (sum(|c| c.ke), sum(|c| c.ee));
        let extrapolation = if ee > 0.0 { ke / ee } else { 0.0 };

        // The residual of the fitted corrections is too small by one degree of freedom; a single
        // correction tells nothing about the residual of extrapolation.
        let count = known.len() as f64;
        let (a, freedom) = match known.len() {
            0 | 1 => (0.0, 1.0),
            _ => (extrapolation, count / (count - 1.0)),
        };
        let ratio = |known: &Evidence| {
            let Evidence {
                kk,
                ke,
                ee,
                expected,
            } = *known;
            let left = (kk - 2.0 * a * ke + a * a * ee).max(0.0) * freedom;
            // If errors of several sources add up, as in the first images, they do so in the
            // estimate too: that does not mean that each source errs more than estimated.
            let expected = expected.max(ee);
            if expected > 0.0 { left / expected } else { 1.0 }
        };
        let ratios: f64 = known.iter().map(ratio).sum();
        Fit {
            extrapolation,
            calibration: ((prior * prior + ratios) / (1.0 + count)).sqrt(),
        }
    }
}
