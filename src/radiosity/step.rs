//! The scale of quality: what each step spends.
//!
//! All steps but the finest have the same fragments on edges, so that they differ by their light
//! alone and the difference between two of them is a hint of the error. This module does not depend
//! on a scene.

use crate::radiosity::camera::fragment::{Sampling, Split};
use crate::renderer::{Quality, TransportError};

/// The five steps of its scale of quality, each slower and better than the one before on the
/// reference scenes.
///
/// The first two have no gather points: light goes on across shared edges instead (`seam`). With a
/// gather point for each 8 x 8 pixels the second would err a third less on the tavern for a fifth
/// more time, but how far it is from the first would no longer show what either lacks: predicted
/// errors (`study::trial`) would be within a factor of 1.5 in 70 % of all steps instead of 87. From
/// the third on a facet has a gather point for each 5 x 5 of its pixels, so that more gather points
/// than those buy little: on the tavern's 22 banks, against the finest, 1000 elements and 8000
/// gather points leave 1.21 % on average and 4.1 % in the worst, 2000 and 5000 in the same time .94
/// and 2.7 %. What a gather point sees of a small bright place decides where all light has been
/// reflected twice: in a room of 1,000 faces, one bank held against 65,536 paths a pixel, 3000
/// elements and 8000 gather points of 32 pixels leave 4.1 %, 4000 elements 3.3, 6000 elements and
/// 12,000 gather points of 40 pixels 2.7 (2.6 evened out, `radiosity::links`). Hence the fourth,
/// where a pixel that is stretched on a floor is looked at in quarters, too. The finest
/// interpolates no direct light and has all gather points look, so that its errors are those of the
/// rest: on the stage .25 %, and .24 with gather points of 64 pixels in half as much time again.
///
/// The third and fourth leave out gather points that stand between others (`indirect::between`).
/// The first three average light over a pixel only where its panel is very near: on the tavern 9 %
/// less time at the first for an error of 2.08 for 2.07 %, 8 % at the third for .915 for .909 %,
/// and nothing at the fourth. No step takes shadows by samples: that saved no time beyond this, and
/// behind small windows it made streaks.
pub const STEPS: [Step; 5] = [
    Step {
        elements: 300,
        resolution: 16,
        gather_points: 0,
        gather_resolution: 0,
        reach: 0.0,
        tolerance: 0.04,
        near: 0.25,
        sampling: Sampling::new(Split::Whole, Split::Whole, Split::Halves),
    },
    Step {
        elements: 1000,
        resolution: 16,
        gather_points: 0,
        gather_resolution: 0,
        reach: 0.0,
        tolerance: 0.02,
        near: 0.25,
        sampling: Sampling::new(Split::Whole, Split::Whole, Split::Halves),
    },
    Step {
        elements: 2000,
        resolution: 16,
        gather_points: 5000,
        gather_resolution: 20,
        reach: 0.07,
        tolerance: 0.015,
        near: 0.5,
        sampling: Sampling::new(Split::Whole, Split::Whole, Split::Halves),
    },
    Step {
        elements: 6000,
        resolution: 16,
        gather_points: 12000,
        gather_resolution: 40,
        reach: 0.07,
        tolerance: 0.003,
        near: 1.0,
        sampling: Sampling::new(Split::Whole, Split::Halves, Split::Halves),
    },
    Step {
        elements: 8000,
        resolution: 24,
        gather_points: 32000,
        gather_resolution: 40,
        reach: 0.0,
        tolerance: 0.0,
        near: 1.0,
        sampling: Sampling::new(Split::Halves, Split::Halves, Split::Quarters),
    },
];

/// What a step of quality spends.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Elements aimed at.
    pub elements: usize,
    /// Pixels along the edge of their hemicubes.
    pub resolution: usize,
    /// Cells of the finer grid of a second gather; 0 for none.
    pub gather_points: usize,
    /// Pixels along the edge of its hemicubes.
    pub gather_resolution: usize,
    /// GatherPoints that stand nearer to others than this share of the distance over which the
    /// light of those changes take their mean; 0 for none.
    pub reach: f64,
    /// How exactly direct light is interpolated between the picture's fragments, as a share of
    /// its root mean square in the picture; 0 for none.
    pub tolerance: f64,
    /// How near a panel must be for its light to be averaged over a pixel, as a share of the
    /// distance within which that changes anything.
    pub near: f64,
    /// Fragments of a pixel.
    pub sampling: Sampling,
}

impl Step {
    /// The step of a quality.
    ///
    /// # Errors
    /// [`TransportError::Quality`] when there is none.
    pub fn of(quality: Quality) -> Result<Step, TransportError> {
        let at = usize::from(quality.0).wrapping_sub(1);
        STEPS
            .get(at)
            .copied()
            .ok_or(TransportError::Quality(quality.0, STEPS.len() as u8))
    }
}
