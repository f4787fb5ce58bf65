//! What the operator states of its errors, step by step.
//!
//! The worst moment's relative error against the finest step, which 19 of 20 shows are within; of
//! the finest step what it is off by against path-traced references. `cargo run --release --example
//! promise` measures the shows that the numbers are of. Steps have numbers of elements, so that
//! these are coarser where polygons are many.

use crate::renderer::Quality;
use crate::units::ErrorUnit;

/// Of up to [`FEW`] polygons, with hemicubes.
const OF_FEW: [f64; 5] = [0.033, 0.0199, 0.0155, 0.0095, 0.003];
/// Of [`MANY`] polygons and more.
const OF_MANY: [f64; 5] = [0.042, 0.039, 0.0199, 0.0095, 0.003];
/// Between these two the error grows with the logarithm of the polygons.
const FEW: f64 = 100.0;
const MANY: f64 = 900.0;

/// By final gathering.
const GATHERED: [f64; 5] = [0.05, 0.034, 0.016, 0.01, 0.006];

/// The same as displayed, in steps of 255.
const OF_FEW_SHOWN: [f64; 5] = [13.0, 7.0, 4.2, 1.7, 1.2];
const OF_MANY_SHOWN: [f64; 5] = [24.6, 23.8, 9.3, 8.5, 3.0];
const GATHERED_SHOWN: [f64; 5] = [25.0, 17.0, 8.0, 5.0, 3.0];

/// The error of a step; `None` where there is no such step.
pub(super) fn error(
    quality: Quality,
    polygons: usize,
    is_final_gather: bool,
    unit: ErrorUnit,
) -> Option<f64> {
    let at = usize::from(quality.0).checked_sub(1)?;
    let [few, many, gathered] = match unit {
        ErrorUnit::Light => [OF_FEW, OF_MANY, GATHERED],
        ErrorUnit::Steps => [OF_FEW_SHOWN, OF_MANY_SHOWN, GATHERED_SHOWN],
    };
    if is_final_gather {
        return gathered.get(at).copied();
    }
    let (few, many) = (few.get(at)?, many.get(at)?);
    let along = ((polygons as f64).max(1.0) / FEW).ln() / (MANY / FEW).ln();
    let along = along.clamp(0.0, 1.0);
    Some(few.powf(1.0 - along) * many.powf(along))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test's own data")]
mod tests {
    use super::*;

    #[test]
    fn a_finer_step_is_stated_to_err_less_and_more_polygons_more() {
        for unit in [ErrorUnit::Light, ErrorUnit::Steps] {
            for polygons in [1, 100, 300, 900, 2000] {
                let steps = (1..=5).map(|q| error(Quality(q), polygons, false, unit).unwrap());
                assert!(steps.collect::<Vec<_>>().is_sorted_by(|a, b| a > b));
            }
            let of = |polygons| error(Quality(2), polygons, false, unit).unwrap();
            assert!(of(100) < of(300) && of(300) < of(900) && of(900) == of(2000));
            assert_eq!(error(Quality(0), 1, false, unit), None);
            assert_eq!(error(Quality(6), 1, true, unit), None);
        }
    }
}
