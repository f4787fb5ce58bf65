//! What the operator states of its errors, step by step.
//!
//! The worst moment's relative error against the finest step, which 19 of 20 shows are within; of
//! the finest step what it is off by against path-traced references. `cargo run --release --example
//! promise` measures the shows that the numbers are of. Steps have numbers of elements, so that
//! these are coarser where polygons are many.

use crate::{Quality, Setup};
use footlight_show::units::ErrorUnit;
use footlight_stage::Light;

/// Of up to [`FEW`] polygons, with hemicubes.
const OF_FEW: [f64; 3] = [0.0155, 0.0095, 0.003];
/// Of [`MANY`] polygons and more.
const OF_MANY: [f64; 3] = [0.0199, 0.0095, 0.003];
/// Between these two the error grows with the logarithm of the polygons.
const FEW: f64 = 100.0;
const MANY: f64 = 900.0;

/// At least, where images are thrown: these may be as fine as a pixel, and all steps but the finest
/// average them over a pixel alike.
const THROWN: [f64; 3] = [0.024, 0.0135, 0.003];
const THROWN_SHOWN: [f64; 3] = [9.5, 7.0, 1.2];

/// By final gathering.
const GATHERED: [f64; 3] = [0.05, 0.016, 0.006];

/// The same as displayed, in steps of 255.
const OF_FEW_SHOWN: [f64; 3] = [4.2, 1.7, 1.2];
const OF_MANY_SHOWN: [f64; 3] = [9.3, 8.5, 3.0];
const GATHERED_SHOWN: [f64; 3] = [25.0, 8.0, 3.0];

/// What the stated errors of a scene depend on.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    pub polygons: usize,
    pub is_final_gather: bool,
    /// Whether a light throws an image.
    pub has_projection: bool,
}

impl Kind {
    pub fn of(setup: &Setup, is_final_gather: bool) -> Kind {
        let mut lights = setup.rig.lights.iter();
        Kind {
            polygons: setup.scene.polygons.len(),
            is_final_gather,
            has_projection: lights.any(|light| matches!(light, Light::Projection(_))),
        }
    }

    /// The error of a step; `None` where there is no such step.
    pub fn error(self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let at = usize::from(quality.0).checked_sub(1)?;
        let [few, many, thrown, gathered] = match unit {
            ErrorUnit::Light => [OF_FEW, OF_MANY, THROWN, GATHERED],
            ErrorUnit::Steps => [OF_FEW_SHOWN, OF_MANY_SHOWN, THROWN_SHOWN, GATHERED_SHOWN],
        };
        if self.is_final_gather {
            return gathered.get(at).copied();
        }
        let (few, many, thrown) = (few.get(at)?, many.get(at)?, thrown.get(at)?);
        let along = ((self.polygons as f64).max(1.0) / FEW).ln() / (MANY / FEW).ln();
        let along = along.clamp(0.0, 1.0);
        let least = if self.has_projection { *thrown } else { 0.0 };
        Some((few.powf(1.0 - along) * many.powf(along)).max(least))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test's own data")]
mod tests {
    use super::*;

    #[test]
    fn a_finer_step_is_stated_to_err_less_and_more_polygons_and_projections_more() {
        let of = |polygons, has_projection| Kind {
            polygons,
            is_final_gather: false,
            has_projection,
        };
        for unit in [ErrorUnit::Light, ErrorUnit::Steps] {
            let error = |kind: Kind, q| kind.error(Quality(q), unit).unwrap();
            for polygons in [1, 100, 300, 900, 2000] {
                for thrown in [false, true] {
                    let steps = (1..=3).map(|q| error(of(polygons, thrown), q));
                    assert!(steps.collect::<Vec<_>>().is_sorted_by(|a, b| a > b));
                }
                assert!(error(of(polygons, true), 2) >= error(of(polygons, false), 2));
            }
            let first = |polygons| error(of(polygons, false), 1);
            assert!(first(100) < first(300) && first(300) < first(900));
            assert_eq!(first(900), first(2000));
            assert_eq!(of(1, false).error(Quality(0), unit), None);
            assert_eq!(of(1, true).error(Quality(4), unit), None);
        }
    }
}
