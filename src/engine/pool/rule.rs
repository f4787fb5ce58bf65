//! What known corrections say of the coarse images' errors: as numbers, without images.
//!
//! With C_i and X_i the images of source i at the two coarse qualities, D_i = C_i - X_i is the
//! estimate of the coarse error, and K_j = R_j - C·s_j the correction that refined image j made
//! known. A [`Fit`] says how well D predicted K.

/// What one refined picture shows: scalar products of its correction K with itself and with
/// E = D·s, the difference of the two coarse qualities at its setting, and ‖W s‖².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// K·K
    pub kk: f64,
    /// K·E
    pub ke: f64,
    /// E·E
    pub ee: f64,
    /// The sum of (w_i s_i)²: what E·E would be if the sources' errors had nothing in common.
    pub expected: f64,
}

/// What a prediction is multiplied by before it is believed, with no refined picture and with one:
/// two steps of quality share errors that their difference does not show, up to three times as
/// much (`examples/studies`).
const ROOM: [f64; 2] = [3.0, 4.0];

/// An error that is beyond what is wanted by less than this part of it differs by rounding alone.
const ROUNDING: f64 = 1e-9;

/// Whether an error that was `predicted` with so many refined pictures counts as within `wanted`:
/// without two that it was held against it must leave room, threefold and fourfold. An error that
/// rests on what was measured or is usual ([`footlight_transport::Transport::usual_error`]) counts as it is.
pub fn is_within(wanted: f64, predicted: f64, refined: usize, is_stated: bool) -> bool {
    let room = ROOM.get(refined).filter(|_| !is_stated);
    room.unwrap_or(&1.0) * predicted <= wanted * (1.0 + ROUNDING)
}

/// What known corrections make of the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Coarse pictures become C + a·D with this a; 0 before the first correction.
    pub extrapolation: f64,
    /// Estimated errors are multiplied by this.
    pub calibration: f64,
}

impl Fit {
    /// Fits the extrapolation factor and the calibration to all known corrections.
    ///
    /// The calibration is the root mean square of each correction's ratio to what was expected of
    /// it, with one further ratio, `prior`, for the estimate itself: sources err by different factors,
    /// so a few corrections must not speak for all. Ratios rather than sums, because the first
    /// corrections are the largest and would outweigh the rest.
    pub fn of(prior: f64, known: &[Evidence]) -> Fit {
        let sum = |of: fn(&Evidence) -> f64| -> f64 { known.iter().map(of).sum() };
        let (ke, ee) = (sum(|c| c.ke), sum(|c| c.ee));
        let extrapolation = if ee > 0.0 { ke / ee } else { 0.0 };

        // What the extrapolation leaves of the corrections it was fitted to is too little by one
        // degree of freedom; a single correction says nothing of what extrapolation will leave.
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
            // Where errors of several sources add up, as in the first pictures, they do so in the
            // estimate too: that is no sign that each source errs more than estimated.
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
