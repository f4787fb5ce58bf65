//! The quality scale of hemicubes: parameters of each step.
//!
//! This module does not depend on a scene.

use crate::surfaces::fragment::{Sampling, Split};
use crate::{Quality, TransportError};

/// The three steps, each slower and more accurate than the one before on the reference scenes.
///
/// A facet has a gather point for each 5 x 5 of its pixels; more of them improve accuracy less than
/// more elements and finer hemicubes. The first two steps interpolate between gather points
/// (`indirect::interpolation`); the second also splits pixels that are stretched on a surface. The
/// finest interpolates no direct light and draws a hemicube for each gather point, so that its
/// errors are those of the mesh and the hemicubes.
pub const STEPS: [HemicubeStep; 3] = [
    HemicubeStep {
        elements: 2000,
        resolution: 16,
        gather_points: 5000,
        gather_resolution: 20,
        reach: 0.07,
        tolerance: 0.015,
        near: 0.5,
        nodes: 8,
        lobe_rays: 8,
        sampling: Sampling::new(Split::Whole, Split::Whole, Split::Halves),
    },
    HemicubeStep {
        elements: 6000,
        resolution: 16,
        gather_points: 12000,
        gather_resolution: 40,
        reach: 0.07,
        tolerance: 0.003,
        near: 1.0,
        nodes: 16,
        lobe_rays: 16,
        sampling: Sampling::new(Split::Whole, Split::Halves, Split::Halves),
    },
    HemicubeStep {
        elements: 8000,
        resolution: 24,
        gather_points: 32000,
        gather_resolution: 40,
        reach: 0.0,
        tolerance: 0.0,
        near: 1.0,
        nodes: 32,
        lobe_rays: 32,
        sampling: Sampling::new(Split::Halves, Split::Halves, Split::Quarters),
    },
];

/// Parameters of a quality step.
#[derive(Clone, Copy, Debug)]
pub struct HemicubeStep {
    /// Target number of elements.
    pub elements: usize,
    /// Pixels along the edge of the elements' hemicubes.
    pub resolution: usize,
    /// Cells of the finer grid of the final gather.
    pub gather_points: usize,
    /// Pixels along the edge of the final gather's hemicubes.
    pub gather_resolution: usize,
    /// A gather point is interpolated when it is nearer to others than this share of the distance
    /// over which their light changes; 0 disables interpolation.
    pub reach: f64,
    /// Allowed error of direct light interpolated between fragments, relative to its root mean
    /// square in the image; 0 disables interpolation.
    pub tolerance: f64,
    /// Distance within which a panel's light is averaged over a pixel, relative to the distance
    /// within which this has an effect.
    pub near: f64,
    /// Nodes along a ray of sight in haze.
    pub nodes: usize,
    /// Rays of a pixel that shows a glossy surface.
    pub lobe_rays: usize,
    /// Fragments of a pixel.
    pub sampling: Sampling,
}

impl HemicubeStep {
    /// Parameters of a quality step.
    ///
    /// # Errors
    /// [`TransportError::Quality`] for an unknown step.
    pub fn of(quality: Quality) -> Result<HemicubeStep, TransportError> {
        let at = usize::from(quality.0).wrapping_sub(1);
        STEPS
            .get(at)
            .copied()
            .ok_or(TransportError::Quality(quality.0, STEPS.len() as u8))
    }
}
