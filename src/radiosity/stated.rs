//! What the operator states of its errors, step by step.
//!
//! The worst moment's relative error against the finest step, which 19 of 20 shows are within; of
//! the finest step what it is off by against path-traced references. `cargo run --release --example
//! promise` measures the shows that the numbers are of. Steps have numbers of elements, so that
//! these are coarser where polygons are many.

use crate::renderer::Quality;

/// Of up to [`FEW`] polygons, with hemicubes.
const OF_FEW: [f64; 5] = [0.033, 0.0199, 0.0155, 0.0095, 0.003];
/// Of [`MANY`] polygons and more.
const OF_MANY: [f64; 5] = [0.042, 0.039, 0.0199, 0.0095, 0.003];
/// Between these two the error grows with the logarithm of the polygons.
const FEW: f64 = 100.0;
const MANY: f64 = 900.0;

/// By final gathering.
const GATHERED: [f64; 5] = [0.05, 0.034, 0.016, 0.01, 0.006];

/// The relative error of a step; `None` where there is no such step.
pub(super) fn error(quality: Quality, polygons: usize, is_final_gather: bool) -> Option<f64> {
    let at = usize::from(quality.0).checked_sub(1)?;
    if is_final_gather {
        return GATHERED.get(at).copied();
    }
    let (few, many) = (OF_FEW.get(at)?, OF_MANY.get(at)?);
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
        for polygons in [1, 100, 300, 900, 2000] {
            let steps = (1..=4).map(|q| error(Quality(q), polygons, false).unwrap());
            assert!(steps.collect::<Vec<_>>().is_sorted_by(|a, b| a > b));
        }
        let of = |polygons| error(Quality(2), polygons, false).unwrap();
        assert!(of(100) < of(300) && of(300) < of(900) && of(900) == of(2000));
        assert_eq!(error(Quality(0), 1, false), None);
        assert_eq!(error(Quality(6), 1, true), None);
    }
}
