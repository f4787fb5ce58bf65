//! What the operator states of its errors, step by step.
//!
//! The worst moment's relative error against the finest step, which 19 of 20 shows are within; of
//! the finest step what it is off by against path-traced references.

use crate::renderer::Quality;

/// With hemicubes.
const HEMICUBES: [f64; 5] = [0.042, 0.039, 0.0199, 0.009, 0.003];

/// By final gathering.
const GATHERED: [f64; 5] = [0.05, 0.034, 0.016, 0.01, 0.006];

/// The relative error of a step; `None` where there is no such step.
pub(super) fn error(quality: Quality, is_final_gather: bool) -> Option<f64> {
    let steps = match is_final_gather {
        true => GATHERED,
        false => HEMICUBES,
    };
    steps.get(usize::from(quality.0).checked_sub(1)?).copied()
}
