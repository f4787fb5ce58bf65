//! The quality scale of final gathering: parameters and predicted cost of each step.

use crate::gather::BLOCK;
use crate::gather::parts::{Part, differ};
use crate::surfaces::camera::camera;
use crate::surfaces::raster::ItemBuffer;
use crate::surfaces::surface::Surfaces;
use crate::{Cost, Quality, Setup, TransportError};
use footlight_show::geometry::View;

/// Parameters of a quality step.
#[derive(Clone, Copy, Debug)]
pub struct GatherStep {
    /// Initial samples of a pixel.
    pub first: u32,
    /// Geometry samples of a pixel on an edge or with a sheet.
    pub edge: u32,
    /// Most samples of a light in a part of a pixel.
    pub most: u32,
    /// Target noise of direct light, relative to the root mean square of a light's image of at most
    /// 57,600 pixels.
    pub noise: f64,
    /// Rays of a pixel that shows one surface.
    pub rays: u32,
    /// Least and greatest side of a cell, relative to the mean length of camera rays after their
    /// first hit.
    pub cells: [f64; 2],
    /// See `CellSettings::points`.
    pub points: f64,
    /// Radius of the irradiance filter, relative to the harmonic mean distance of the surfaces
    /// around the place.
    pub filter: f64,
    /// Most samples of a lamp's patches in a pixel.
    pub most_patches: u32,
    /// Nodes along a ray of sight in haze.
    pub nodes: usize,
}

/// The three steps.
pub const STEPS: [GatherStep; 3] = [
    GatherStep {
        first: 8,
        edge: 16,
        most: 64,
        noise: 0.046,
        rays: 16,
        cells: [0.08, 0.16],
        points: 0.085,
        filter: 0.2,
        most_patches: 16,
        nodes: 8,
    },
    GatherStep {
        first: 16,
        edge: 64,
        most: 1024,
        noise: 0.011,
        rays: 64,
        cells: [0.024, 0.096],
        points: 0.34,
        filter: 0.12,
        most_patches: 256,
        nodes: 16,
    },
    GatherStep {
        first: 32,
        edge: 128,
        most: 1024,
        noise: 0.005,
        rays: 256,
        cells: [0.012, 0.05],
        points: 0.34,
        filter: 0.08,
        most_patches: 1024,
        nodes: 32,
    },
];

/// Pixels for which a step's noise is specified, and the greatest factor above that.
const PIXELS: f64 = 57_600.0;
const MOST_PIXELS: f64 = 4.0;

/// Ratio of an image's pixels to those for which a step's noise is specified, up to a limit: finer
/// pixels may be noisier, as the eye averages them.
pub fn more_pixels([width, height]: [usize; 2]) -> f64 {
    ((width * height) as f64 / PIXELS).clamp(1.0, MOST_PIXELS)
}

/// Share of its pixel from which a part seen in a glossy surface has all rays.
const MIRRORED: f32 = 0.25;

/// Noise of a lamp's patches, relative to that of direct light.
const PATCH_NOISE: f64 = 2.0;

impl GatherStep {
    /// Parameters of a quality step.
    ///
    /// # Errors
    /// [`TransportError::Quality`] for an unknown step.
    pub fn of(quality: Quality) -> Result<GatherStep, TransportError> {
        let at = usize::from(quality.0).wrapping_sub(1);
        let step = STEPS.get(at).copied();
        step.ok_or(TransportError::Quality(quality.0, STEPS.len() as u8))
    }

    /// Rays of a part of a pixel: a power of two, so that they are evenly distributed. A pixel
    /// shows many surfaces in its gloss, each of them dimly.
    pub fn rays_of_part(&self, share: f32, is_mirrored: bool) -> u32 {
        if is_mirrored && share < MIRRORED {
            let rays = share / MIRRORED * self.rays as f32;
            (rays as u32).next_power_of_two().clamp(2, self.rays)
        } else if share > 0.25 {
            self.rays
        } else {
            self.rays / 2
        }
    }

    /// Approximate bytes of a pixel that shows one surface, without its lights.
    pub fn pixel_bytes(&self) -> usize {
        let rays = size_of::<u32>() * (self.first + self.rays) as usize;
        rays + 2 * size_of::<Part>()
    }

    /// Parameters for the first bounce of lamps that have patches.
    pub fn of_patches(self) -> GatherStep {
        GatherStep {
            most: self.most_patches,
            noise: PATCH_NOISE * self.noise,
            ..self
        }
    }
}

/// Cost (see [`crate::hemicube::cost`]) of one ray for each doubling of the polygons, filter
/// included.
const RAY_COST: f64 = 1.39e-7;
/// Cost of the cells: for the square root of rays times pixels that show several surfaces, for each
/// point's share and relative to the least side of a cell, and for each doubling of the polygons.
/// Smaller cells are more numerous.
const CELL_COST: f64 = 1.34e-7;
/// Cost of one sample of one light, for each doubling of the polygons. The lookup of the visible
/// surface costs twice as much and is shared by the lights solved together.
const SAMPLE_COST: f64 = 5.2e-8;
/// Cost of finding and filtering the parts of a pixel, in rays.
const PIXEL_RAYS: f64 = 25.0;
/// Samples of a light in any pixel, as a multiple of the initial ones, bounces included; in a pixel
/// that shows several surfaces, as a multiple of those that its spread requires.
const LIGHT_SAMPLES: f64 = 4.0;
const EDGE_SAMPLES: f64 = 2.0;
/// Cost of one triangle in the hierarchy, for each doubling.
const TRIANGLE_COST: f64 = 9.2e-7;
/// Cost of one pixel of one light in an image.
const PIXEL_COST: f64 = 4.5e-9;
/// Squared spread of one light's samples in a pixel that shows several surfaces, relative to its
/// image's mean square.
const SPREAD: f64 = 0.5;

/// Share of a pixel with one sample that the samples do not span: they do not reach its borders, so
/// fewer pixels show several surfaces than have neighbours that show others.
const MARGIN: f64 = 0.6;

/// Predicted cost of a step on a scene.
///
/// # Errors
/// [`TransportError`] for an unusable setup or an unknown step.
pub fn cost(setup: &Setup, quality: Quality) -> Result<Cost, TransportError> {
    let step = GatherStep::of(quality)?;
    let Setup { scene, rig, view } = setup;
    let size = [view.width, view.height];
    let pixels = (view.width * view.height) as f64;
    let polygons = scene.polygons.len() as f64;
    let depth = (2.0 + polygons).log2();
    let lights = rig.lights.len() as f64;
    let share = lights / rig.sources.len().max(1) as f64;
    let first = f64::from(step.first);
    let mixed = mixed_share(&Surfaces::shapes(scene)?, view)? * (1.0 - MARGIN / first.sqrt());
    let rays = PIXEL_RAYS + first + f64::from(step.rays) + mixed * f64::from(step.edge);
    let cells = pixels * (rays * mixed).sqrt() * step.points / step.cells[0];
    let noise = step.noise * more_pixels(size).sqrt();
    // As direct light allots samples: stratified samples beat the square root law.
    let samples = (SPREAD * mixed / (noise * noise)).powf(0.8);
    let samples = samples.min(f64::from(step.most));
    let shared = 1.0 + 2.0 / lights.clamp(1.0, BLOCK as f64);
    let samples = (LIGHT_SAMPLES * first + EDGE_SAMPLES * mixed * samples) * shared;
    Ok(Cost {
        prepare: depth * (TRIANGLE_COST * polygons + RAY_COST * pixels * rays + CELL_COST * cells),
        per_source: share * SAMPLE_COST * depth * pixels * samples,
        per_image: PIXEL_COST * pixels * lights,
        per_lone: PIXEL_COST * pixels * share,
    })
}

/// Share of the view's pixels that show several surfaces, on edges or in gloss, counted at one
/// sample a pixel; large images are counted at reduced size.
fn mixed_share(surfaces: &Surfaces, view: &View) -> Result<f64, TransportError> {
    let pixels = (view.width * view.height) as f64;
    let times = (pixels / (PIXELS * MOST_PIXELS)).max(1.0).sqrt();
    let side = |n: usize| ((n as f64 / times) as usize).max(1);
    let small = View {
        width: side(view.width),
        height: side(view.height),
        ..view.clone()
    };
    let camera = camera(&small)?;
    let mut buffer = ItemBuffer::new(small.width, small.height);
    for piece in &surfaces.pieces {
        buffer.draw(&camera, &piece.vertices, piece.normal, piece.facet as u32);
    }
    let rows = buffer.items().chunks_exact(small.width);
    let next = rows.clone().skip(1);
    let mut across = rows
        .clone()
        .flat_map(|row| row.iter().zip(row.iter().skip(1)));
    let mut down = rows.zip(next).flat_map(|(row, next)| row.iter().zip(next));
    let share = |pairs: &mut dyn Iterator<Item = (&u32, &u32)>| {
        let (mut all, mut different) = (0.0_f64, 0.0);
        for (a, b) in pairs {
            all += 1.0;
            // A glossy pixel also shows reflections.
            let is_mixed =
                differ(surfaces, [*a, *b]) || surfaces.lobe(*a).is_some_and(|l| !l.is_wide());
            different += f64::from(u8::from(is_mixed));
        }
        different / all.max(1.0)
    };
    // An edge of any direction is crossed horizontally or vertically.
    Ok((share(&mut across) + share(&mut down)).min(1.0))
}
