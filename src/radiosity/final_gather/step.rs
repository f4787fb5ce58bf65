//! The scale of quality of final gathering: the parameters of each step, and what it costs.

use crate::renderer::{Cost, Quality, QualityParameter, Setup, TransportError};

/// What a step of quality spends.
#[derive(Clone, Copy, Debug)]
pub struct GatherStep {
    /// Samples of a pixel at first.
    pub first: u32,
    /// And at most.
    pub most: u32,
    /// Noise of direct light aimed at, as a share of the root mean square of a light's picture of
    /// 57,600 pixels or fewer.
    pub noise: f64,
    /// Rays of a pixel that shows one smooth surface; up to eight times as many of another.
    pub rays: u32,
    /// Least and greatest side of a cell, as shares of the mean length of the camera's rays
    /// after their first hit.
    pub cells: [f64; 2],
    /// As [`CellSettings::points`].
    pub points: f64,
    /// Radius of the irradiance filter, as a share of the mean distance (harmonic) of what the pixel
    /// sees.
    pub filter: f64,
}

/// The five steps.
pub const STEPS: [GatherStep; 5] = [
    GatherStep {
        first: 4,
        most: 64,
        noise: 0.05,
        rays: 16,
        cells: [0.08, 0.16],
        points: 0.25,
        filter: 0.15,
    },
    GatherStep {
        first: 4,
        most: 128,
        noise: 0.03,
        rays: 32,
        cells: [0.053, 0.106],
        points: 0.35,
        filter: 0.1,
    },
    GatherStep {
        first: 8,
        most: 1024,
        noise: 0.011,
        rays: 64,
        cells: [0.024, 0.096],
        points: 0.7,
        filter: 0.08,
    },
    GatherStep {
        first: 8,
        most: 1024,
        noise: 0.007,
        rays: 160,
        cells: [0.017, 0.068],
        points: 1.0,
        filter: 0.07,
    },
    GatherStep {
        first: 16,
        most: 1024,
        noise: 0.005,
        rays: 256,
        cells: [0.012, 0.05],
        points: 1.0,
        filter: 0.05,
    },
];

impl GatherStep {
    /// The step of a quality.
    ///
    /// # Errors
    /// [`TransportError::Quality`] when there is none.
    pub fn of(quality: Quality) -> Result<GatherStep, TransportError> {
        let at = usize::from(quality.0).wrapping_sub(1);
        let step = STEPS.get(at).copied();
        step.ok_or(TransportError::Quality(quality.0, STEPS.len() as u8))
    }

    /// What the step sets on any scene.
    pub fn quality_parameters(&self) -> Vec<QualityParameter> {
        let of = |name, amount: f64| QualityParameter { name, amount };
        vec![
            of("rays", f64::from(self.rays)),
            of("samples at first", f64::from(self.first)),
            of("samples at most", f64::from(self.most)),
            of("noise", self.noise),
        ]
    }
}

/// Units of cost (see [`crate::radiosity::cost`]) of one ray for each doubling of the polygons.
const RAY_COST: f64 = 1.2e-7;
/// Of one triangle in the hierarchy, for each doubling.
const TRIANGLE_COST: f64 = 1e-7;
/// Of one pixel of one light in a picture.
const PIXEL_COST: f64 = 4e-9;
/// Samples of a light in a pixel, in the mean, over the square root of one over the noise.
const SAMPLES: f64 = 2.0;

/// Predicted cost of a step on a scene.
///
/// # Errors
/// [`TransportError::Quality`] when there is no such step.
pub fn cost(setup: &Setup, quality: Quality) -> Result<Cost, TransportError> {
    let step = GatherStep::of(quality)?;
    let pixels = (setup.view.width * setup.view.height) as f64;
    let polygons = setup.scene.polygons.len() as f64;
    let depth = (2.0 + polygons).log2();
    let lights = setup.rig.lights.len() as f64;
    let share = lights / setup.rig.sources.len().max(1) as f64;
    let rays = pixels * (f64::from(step.first) + 1.5 * f64::from(step.rays));
    let samples = pixels * (f64::from(step.first) + SAMPLES / step.noise.sqrt());
    Ok(Cost {
        prepare: depth * (TRIANGLE_COST * polygons + RAY_COST * rays),
        per_source: share * RAY_COST * depth * samples,
        per_image: PIXEL_COST * pixels * lights,
        per_lone: PIXEL_COST * pixels * share,
    })
}
