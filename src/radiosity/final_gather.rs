//! G for scenes of many polygons: final gathering by ray tracing over a radiosity cache.
//!
//! Its cost follows what the camera sees, not how many polygons there are: nothing is meshed. Each
//! pixel sends rays, cosine-weighted, whose ends are cells of a cache ([`cells`]); the cells
//! exchange light by Jacobi steps; direct light is the closed form times the visible share of
//! sampled shadow rays ([`emitter`]), with more samples where the first ones differ, until the
//! predicted noise is what the step allows. Cells, rays and filters depend on the geometry alone and
//! samples of a light on that light alone, so that a picture is exactly linear, and the same in any
//! company and on any number of threads.

pub mod bvh;
pub mod cells;
pub mod emitter;
mod irradiance_filter;
pub mod sampling;

use crate::geometry::{Vec3, frame};
use crate::picture::Image;
use crate::radiosity::camera::fragment::camera;
use crate::radiosity::direct::projector::{Projector, pixel as pixel_footprint};
use crate::radiosity::direct::{Luminaire, check_rig, luminaires};
use crate::radiosity::final_gather::bvh::Bvh;
use crate::radiosity::final_gather::cells::{
    CellFinder, CellSettings, Cells, DARK, Landing, RayScene, SurfacePoint,
};
use crate::radiosity::final_gather::emitter::{Emitter, Sample};
use crate::radiosity::final_gather::irradiance_filter::{SmoothPixel, filter};
use crate::radiosity::final_gather::sampling::{cosine_direction, hash, morton, point};
use crate::radiosity::geometry::surface::Surfaces;
use crate::radiosity::lists::Lists;
use crate::radiosity::memory::MemoryBudget;
use crate::radiosity::visibility::raster::Camera;
use crate::radiosity::{FACET_BYTES, Threads, first_equal, projector};
use crate::renderer::contract::{check_memory, check_settings};
use crate::renderer::{Cost, Prepared, Quality, QualityParameter, Setup, TransportError};
use crate::scene::{Light, Rig};
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// What a step of quality spends.
#[derive(Clone, Copy, Debug)]
pub struct GatherStep {
    /// Samples of a pixel at first.
    pub first: u32,
    /// And at most.
    pub most: u32,
    /// Noise of direct light aimed at, as a share of the root mean square of a light's picture.
    pub noise: f64,
    /// Rays of a pixel that shows one smooth surface; twice as many of another.
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
        filter: 0.10,
    },
    GatherStep {
        first: 8,
        most: 256,
        noise: 0.015,
        rays: 64,
        cells: [0.032, 0.128],
        points: 0.4,
        filter: 0.08,
    },
    GatherStep {
        first: 8,
        most: 512,
        noise: 0.008,
        rays: 128,
        cells: [0.026, 0.105],
        points: 0.7,
        filter: 0.07,
    },
    GatherStep {
        first: 16,
        most: 512,
        noise: 0.005,
        rays: 256,
        cells: [0.018, 0.074],
        points: 0.7,
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

/// Rays of a point at which a cell is evaluated.
const CELL_RAYS: usize = 4;
/// Lights that are solved at once.
const BLOCK: usize = 8;
/// What is left of light after the last bounce, as a share.
const LEFT: f64 = 5e-4;
/// Bounces at most.
const MOST_BOUNCES: usize = 400;
/// Of the spread of a pixel's samples, what its neighbours are taken to have at least: the first
/// samples may all miss an edge.
const SPREAD: f64 = 0.5;
/// Samples of one pixel may be numbered up to this.
const PIXEL_SAMPLES: u32 = 1024;
/// Rows of the picture whose rays are held at once.
const BAND: usize = 8;
/// Seeds of the sequences of points.
const SEED_CAMERA: u32 = 101;
const SEED_WAY: u32 = 202;
const SEED_CELL: u32 = 303;
const SEED_LIGHT: u32 = 1000;
const SEED_CELL_LIGHT: u32 = 0x777;

/// What the pixels' rays found.
#[derive(Default)]
struct Gathered {
    /// Of each pixel the cells that its rays end in.
    cells: Lists<u32>,
    /// Of each ray the facet that it left from.
    facets: Vec<u32>,
    /// Pixels that show one smooth surface.
    smooth: Vec<Option<SmoothPixel>>,
}

impl Gathered {
    /// Bytes held.
    fn bytes(&self) -> usize {
        4 * (self.cells.items().len() + self.facets.len())
            + self.smooth.len() * size_of::<Option<SmoothPixel>>()
    }
}

/// G for one setup and step.
pub struct FinalGather {
    rig: Arc<Rig>,
    step: GatherStep,
    width: usize,
    height: usize,
    camera: Camera,
    surfaces: Surfaces,
    bvh: Bvh,
    /// How far rays keep from surfaces, metres.
    offset: f64,
    lights: Vec<Luminaire>,
    first_equal: Vec<usize>,
    projectors: Vec<Option<Projector>>,
    /// Facets of the first samples of each pixel.
    seen: Vec<u32>,
    gathered: Gathered,
    cells: Cells,
    bounces: usize,
    held: usize,
    /// For each light its picture at unit strength, three channels interleaved.
    pictures: Vec<Option<Vec<f32>>>,
}

impl FinalGather {
    /// Finds what the camera sees and where its light comes from.
    ///
    /// # Errors
    /// [`TransportError`] for a setup that cannot be used, a budget too small, or on cancel.
    pub fn new(
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<FinalGather, TransportError> {
        let step = GatherStep::of(quality)?;
        Threads::new(work)?.install(|| FinalGather::prepare(setup, step, work))
    }

    fn prepare(
        setup: &Setup,
        step: GatherStep,
        work: Work<'_>,
    ) -> Result<FinalGather, TransportError> {
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let camera = camera(view)?;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        let lights = luminaires(&surfaces, rig)?;
        let pixels = view.width * view.height;
        let each = 4 * step.first as usize + 8 * step.rays as usize;
        budget.check("the rays of the picture", pixels.saturating_mul(each))?;
        let bvh = Bvh::new(&surfaces, work)?;
        budget.take("the hierarchy of triangles", bvh.bytes())?;
        let offset = 3.0 * surfaces.touching();
        let picture = PictureRays {
            scene: RayScene {
                surfaces: &surfaces,
                bvh: &bvh,
                offset,
            },
            camera: &camera,
            size: [view.width, view.height],
            step,
        };
        let seen = picture.seen(work)?;
        let settings = picture.cell_settings(&seen, work)?;
        let mut finder = CellFinder::new(picture.scene, settings);
        let gathered = picture.gather(&seen, settings, &mut finder, &budget, work)?;
        budget.take("the rays of the picture", gathered.bytes())?;
        let cells = finder.find(work)?;
        budget.take("the radiosity cache", cells.bytes())?;
        let bounces = bounces(&cells, work)?;
        Ok(FinalGather {
            rig: Arc::clone(rig),
            step,
            width: view.width,
            height: view.height,
            camera,
            offset,
            lights,
            first_equal: first_equal(&rig.lights),
            projectors: rig.lights.iter().map(projector).collect(),
            seen,
            gathered,
            cells,
            bounces,
            held: budget.held,
            pictures: rig.lights.iter().map(|_| None).collect(),
            surfaces,
            bvh,
        })
    }

    fn scene(&self) -> RayScene<'_> {
        RayScene {
            surfaces: &self.surfaces,
            bvh: &self.bvh,
            offset: self.offset,
        }
    }

    fn rays(&self) -> PictureRays<'_> {
        PictureRays {
            scene: self.scene(),
            camera: &self.camera,
            size: [self.width, self.height],
            step: self.step,
        }
    }

    /// Makes the pictures of these lights, those that are not made yet.
    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError> {
        let is_new = |l: &usize| self.pictures[*l].is_none();
        let new: Vec<usize> = wanted.iter().copied().filter(is_new).collect();
        let pixels = self.width * self.height;
        let each = 12 * pixels;
        check_memory("the lights", new.len() * each, work.memory)?;
        let mut done = 0;
        for block in new.chunks(BLOCK) {
            let held = self.cells.count() * block.len() * 28 + 2 * block.len() * each;
            check_memory("light in the cache", held, work.memory)?;
            let mut found = self.indirect(block, work)?;
            for (light, picture) in block.iter().zip(&mut found) {
                work.progress.report("direct light", done, new.len());
                self.add_direct(*light, picture, work)?;
                done += 1;
            }
            for (light, picture) in block.iter().zip(found) {
                self.pictures[*light] = Some(picture);
                self.held += each;
            }
        }
        work.progress.report("direct light", done, new.len());
        Ok(())
    }

    fn emitter(&self, light: usize) -> Emitter<'_> {
        let projector = self.projectors[light].as_ref();
        Emitter::new(&self.surfaces, &self.lights[light], projector)
    }

    /// Reflected light of each of the lights in every pixel, as radiance.
    fn indirect(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<Vec<f32>>, Cancelled> {
        let direct = self.direct_at_cells(lights, work)?;
        let radiosity = self
            .cells
            .radiosity(&direct, lights.len(), self.bounces, work)?;
        drop(direct);
        let width = 3 * lights.len();
        let pixels = self.width * self.height;
        let mut gathered = vec![0.0_f32; pixels * width];
        let rows = gathered.par_chunks_mut(width * self.width).enumerate();
        rows.try_for_each(|(y, row)| {
            work.check()?;
            for (x, out) in row.chunks_exact_mut(width).enumerate() {
                let rays = self.gathered.cells.range(y * self.width + x);
                let share = 1.0 / rays.len().max(1) as f32;
                for ray in rays {
                    let cell = self.gathered.cells.items()[ray];
                    if cell == DARK {
                        continue;
                    }
                    let own = &self.surfaces.facets[self.gathered.facets[ray] as usize];
                    let scale = own.reflectance.map(|r| (r / PI) as f32 * share);
                    let cell = cell as usize * width;
                    let light = radiosity[cell..cell + width].chunks_exact(3);
                    for (sum, b) in out.chunks_exact_mut(3).zip(light) {
                        for c in 0..3 {
                            sum[c] += scale[c] * b[c];
                        }
                    }
                }
            }
            Ok(())
        })?;
        let smooth = &self.gathered.smooth;
        let filtered = filter(smooth, [self.width, self.height], &gathered, width, work)?;
        let pixel = |l: usize| move |p: &[f32]| [p[3 * l], p[3 * l + 1], p[3 * l + 2]];
        let picture = |l: usize| filtered.chunks_exact(width).flat_map(pixel(l)).collect();
        Ok((0..lights.len()).map(picture).collect())
    }

    /// Irradiance that comes to each cell from each of the lights directly.
    fn direct_at_cells(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<f32>, Cancelled> {
        let emitters: Vec<Emitter<'_>> = lights.iter().map(|&l| self.emitter(l)).collect();
        let mut out = vec![0.0_f32; self.cells.count() * lights.len()];
        const RUN: usize = 256;
        let runs = out.par_chunks_mut(RUN * lights.len()).enumerate();
        runs.try_for_each(|(at, run)| {
            work.check()?;
            for (i, out) in run.chunks_exact_mut(lights.len()).enumerate() {
                let cell = at * RUN + i;
                let points = self.cells.points(cell);
                let seed = hash(cell as u32) ^ SEED_CELL_LIGHT;
                for (out, emitter) in out.iter_mut().zip(&emitters) {
                    let mut sum = Ratio::default();
                    for (k, p) in points.iter().enumerate() {
                        let random = point(k as u32, seed);
                        sum.add(self.sample(
                            emitter,
                            p.place,
                            self.cell_footprint(p.place),
                            random,
                        ));
                    }
                    *out = (sum.irradiance() / points.len().max(1) as f64) as f32;
                }
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// What a projected image is averaged over at a cell: about a pixel there.
    fn cell_footprint(&self, place: SurfacePoint) -> [Vec3; 2] {
        let distance = (place.point - self.camera.origin).length();
        let normal = self.surfaces.facets[place.facet as usize].normal;
        let side = distance * self.camera.step_x * 4.0;
        frame(normal).map(|way| way * side)
    }

    fn sample(
        &self,
        emitter: &Emitter<'_>,
        place: SurfacePoint,
        footprint: [Vec3; 2],
        random: [f64; 2],
    ) -> Sample {
        let normal = self.surfaces.facets[place.facet as usize].normal;
        emitter.sample(self.scene(), (place.point, normal), footprint, random)
    }

    /// Adds a light's direct light, and the panel itself where it is seen, to its picture.
    fn add_direct(
        &self,
        light: usize,
        picture: &mut [f32],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let emitter = self.emitter(light);
        let shines = match self.rig.lights[light] {
            Light::Panel { material, .. } => Some(material),
            _ => None,
        };
        let rays = self.rays();
        let direct = Direct {
            operator: self,
            rays: &rays,
            emitter: &emitter,
            shines,
        };
        let first = self.step.first;
        let mut sums = self.each_pixel(work, |pixel, _| {
            let mut sums = PixelSums::default();
            direct.add(pixel, 0..first, &mut sums);
            sums
        })?;
        let samples = self.allot(&sums, picture, first);
        let more = self.each_pixel(work, |pixel, _| {
            let mut all = sums[pixel];
            direct.add(pixel, first..samples[pixel], &mut all);
            all
        })?;
        sums = more;
        for (pixel, sums) in picture.chunks_exact_mut(3).zip(&sums) {
            for (p, radiance) in pixel.iter_mut().zip(sums.radiance()) {
                *p += radiance as f32;
            }
        }
        Ok(())
    }

    /// One value for each pixel.
    fn each_pixel<T: Send>(
        &self,
        work: Work<'_>,
        of: impl Fn(usize, usize) -> T + Sync,
    ) -> Result<Vec<T>, Cancelled> {
        each_pixel([self.width, self.height], work, of)
    }

    /// How many samples each pixel takes, so that the noise of the whole picture is what the step
    /// allows: more where the first samples differ.
    fn allot(&self, sums: &[PixelSums], indirect: &[f32], first: u32) -> Vec<u32> {
        let n = f64::from(first);
        let mut square = 0.0;
        for (sums, indirect) in sums.iter().zip(indirect.chunks_exact(3)) {
            let mean = sums.level / n + f64::from(indirect[1]);
            square += mean * mean;
        }
        let pixels = sums.len() as f64;
        let level = (square / pixels).sqrt();
        let spread = |s: &PixelSums| {
            let mean = s.level / n;
            (s.square / n - mean * mean).max(0.0).sqrt()
        };
        let own: Vec<f64> = sums.iter().map(spread).collect();
        let spreads = self.with_neighbours(&own);
        let most = self.step.most;
        let allotted = |scale: f64| {
            let of = |s: &f64| {
                let times = (scale * s / n).max(1.0).log2().round().exp2();
                ((n * times) as u32).min(most)
            };
            spreads.iter().map(of).collect::<Vec<u32>>()
        };
        // Stratified samples do better than their number's root.
        let noise = |samples: &[u32]| {
            let square = spreads.iter().zip(samples);
            let square: f64 = square.map(|(s, n)| s * s / f64::from(*n).powf(1.25)).sum();
            (square / pixels).sqrt()
        };
        let allowed = self.step.noise * level;
        if level == 0.0 || noise(&allotted(0.0)) <= allowed {
            return vec![first; sums.len()];
        }
        // Samples are fewest for a given noise where they go with the spread.
        let (mut low, mut high) = (1e-3 / level, 1e9 / level);
        for _ in 0..40 {
            let scale = (low * high).sqrt();
            if noise(&allotted(scale)) > allowed {
                low = scale;
            } else {
                high = scale;
            }
        }
        allotted(high)
    }

    fn with_neighbours(&self, own: &[f64]) -> Vec<f64> {
        let (width, height) = (self.width, self.height);
        let of = |at: usize| {
            let (x, y) = (at % width, at / width);
            let mut most = 0.0_f64;
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    most = most.max(own[y * width + x]);
                }
            }
            own[at].max(SPREAD * most)
        };
        (0..own.len()).map(of).collect()
    }

    /// Strength of each light in each channel under a setting; that of equal lights is added to the
    /// first of them.
    fn strengths(&self, setting: &[f64]) -> Vec<[f64; 3]> {
        crate::radiosity::strengths(&self.rig, &self.first_equal, setting)
    }
}

impl Prepared for FinalGather {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        check_settings(settings, self.rig.sources.len())?;
        let strengths: Vec<Vec<[f64; 3]>> = settings.iter().map(|s| self.strengths(s)).collect();
        let is_lit = |l: &usize| strengths.iter().any(|s| s[*l].iter().any(|x| *x != 0.0));
        let wanted: Vec<usize> = (0..self.lights.len()).filter(is_lit).collect();
        let pixels = self.width * self.height;
        let work = Work {
            memory: work.memory.saturating_sub(self.held),
            ..work
        };
        check_memory("the pictures", settings.len() * pixels * 12, work.memory)?;
        Threads::new(work)?.install(|| {
            self.solve(&wanted, work)?;
            let mut images = Vec::with_capacity(settings.len());
            for (done, strengths) in strengths.iter().enumerate() {
                work.check()?;
                work.progress.report("pictures", done, settings.len());
                images.push(self.compose(strengths));
            }
            work.progress
                .report("pictures", settings.len(), settings.len());
            Ok(images)
        })
    }
}

impl FinalGather {
    /// The picture of lights of given strengths, all of which are solved.
    fn compose(&self, strengths: &[[f64; 3]]) -> Image {
        let lit: Vec<(&Vec<f32>, [f64; 3])> = self
            .pictures
            .iter()
            .zip(strengths)
            .filter(|(_, s)| s.iter().any(|x| *x != 0.0))
            .filter_map(|(picture, s)| picture.as_ref().map(|p| (p, *s)))
            .collect();
        let mut image = Image::new(self.width, self.height);
        let rows = image.data_mut().par_chunks_mut(3 * self.width).enumerate();
        rows.for_each(|(y, row)| {
            let start = 3 * y * self.width;
            for (i, value) in row.iter_mut().enumerate() {
                let of =
                    |(picture, s): &(&Vec<f32>, [f64; 3])| s[i % 3] * f64::from(picture[start + i]);
                *value = lit.iter().map(of).sum::<f64>() as f32;
            }
        });
        image
    }
}

/// Sums over samples of one light at several points.
#[derive(Clone, Copy, Debug, Default)]
struct Ratio {
    unoccluded: f64,
    sampled: f64,
    visible: f64,
}

impl Ratio {
    fn add(&mut self, sample: Sample) {
        self.unoccluded += sample.unoccluded;
        self.sampled += sample.sampled;
        self.visible += sample.visible;
    }

    /// The sum of irradiance: the closed form times the visible share of what was sampled.
    fn irradiance(&self) -> f64 {
        if self.sampled > 0.0 {
            self.unoccluded * self.visible / self.sampled
        } else {
            0.0
        }
    }
}

/// Sums over the samples of one light in a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    /// Of each channel, weighted by the reflectance of what the sample shows.
    channels: [Ratio; 3],
    /// Samples that show the light itself.
    shining: f64,
    /// Radiance of the samples and its square, for their spread.
    level: f64,
    square: f64,
    samples: f64,
}

impl PixelSums {
    fn radiance(&self) -> [f64; 3] {
        let all = self.samples.max(1.0);
        self.channels
            .map(|c| (c.irradiance() / PI + self.shining) / all)
    }
}

/// Direct light of one light in pixels.
struct Direct<'a> {
    operator: &'a FinalGather,
    rays: &'a PictureRays<'a>,
    emitter: &'a Emitter<'a>,
    /// The material of a panel.
    shines: Option<usize>,
}

impl Direct<'_> {
    fn add(&self, pixel: usize, samples: std::ops::Range<u32>, sums: &mut PixelSums) {
        for k in samples {
            sums.samples += 1.0;
            let Some(place) = self.place(pixel, k) else {
                continue;
            };
            let facet = &self.operator.surfaces.facets[place.facet as usize];
            let mut level = 0.0;
            if Some(facet.material) == self.shines {
                sums.shining += 1.0;
                level += 1.0;
            }
            if !facet.is_black() {
                let weight = 1.0 / f64::from(self.operator.step.first);
                let camera = &self.operator.camera;
                let footprint = pixel_footprint(camera, place.point, facet.normal, weight);
                let random = point(self.rays.index(pixel) + k, SEED_LIGHT);
                let sample = self.operator.sample(self.emitter, place, footprint, random);
                for (sum, r) in sums.channels.iter_mut().zip(facet.reflectance) {
                    sum.add(Sample {
                        unoccluded: r * sample.unoccluded,
                        sampled: r * sample.sampled,
                        visible: r * sample.visible,
                    });
                }
                if sample.visible > 0.0 {
                    level += facet.highest_reflectance() * sample.unoccluded / PI;
                }
            }
            sums.level += level;
            sums.square += level * level;
        }
    }

    fn place(&self, pixel: usize, k: u32) -> Option<SurfacePoint> {
        let first = self.operator.step.first;
        if k >= first {
            return self.rays.place(pixel, k);
        }
        let facet = self.operator.seen[pixel * first as usize + k as usize];
        self.rays.on_facet(pixel, k, facet)
    }
}

/// The camera's rays.
struct PictureRays<'a> {
    scene: RayScene<'a>,
    camera: &'a Camera,
    size: [usize; 2],
    step: GatherStep,
}

impl PictureRays<'_> {
    /// Where the samples of a pixel begin in their sequence.
    fn index(&self, pixel: usize) -> u32 {
        let width = self.size[0];
        morton(pixel % width, pixel / width).wrapping_mul(PIXEL_SAMPLES)
    }

    fn way(&self, pixel: usize, k: u32) -> Vec3 {
        let width = self.size[0];
        let [u, v] = point(self.index(pixel).wrapping_add(k), SEED_CAMERA);
        let (x, y) = ((pixel % width) as f64, (pixel / width) as f64);
        self.camera.ray(x + u, y + v)
    }

    /// What sample `k` of a pixel shows, if it is a front.
    fn place(&self, pixel: usize, k: u32) -> Option<SurfacePoint> {
        let (place, _) = self.scene.look(self.camera.origin, self.way(pixel, k));
        (place.facet != DARK).then_some(place)
    }

    /// The same where the facet is known.
    fn on_facet(&self, pixel: usize, k: u32, facet: u32) -> Option<SurfacePoint> {
        if facet == DARK {
            return None;
        }
        let own = &self.scene.surfaces.facets[facet as usize];
        let way = self.way(pixel, k);
        let distance = -own.height(self.camera.origin) / own.normal.dot(way);
        Some(SurfacePoint {
            facet,
            point: self.camera.origin + way * distance,
        })
    }

    /// Facets of the first samples of all pixels.
    fn seen(&self, work: Work<'_>) -> Result<Vec<u32>, Cancelled> {
        let first = self.step.first;
        let of = |pixel: usize, _: usize| {
            let facet = |k| self.place(pixel, k).map_or(DARK, |place| place.facet);
            (0..first).map(facet).collect::<Vec<u32>>()
        };
        Ok(each_pixel(self.size, work, of)?.concat())
    }

    /// Sides of cells, from the mean length of a ray of each pixel.
    fn cell_settings(&self, seen: &[u32], work: Work<'_>) -> Result<CellSettings, Cancelled> {
        let of = |pixel: usize, _: usize| {
            let place = self.on_facet(pixel, 0, seen[pixel * self.step.first as usize])?;
            let normal = self.scene.surfaces.facets[place.facet as usize].normal;
            let way = cosine_direction(normal, point(self.index(pixel), SEED_WAY));
            let (_, distance) = self.scene.shoot(place, way);
            distance.is_finite().then_some(distance)
        };
        let lengths: Vec<f64> = each_pixel(self.size, work, of)?
            .into_iter()
            .flatten()
            .collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        // Where nothing is seen any size will do.
        let mean = if mean > 0.0 {
            mean
        } else {
            self.scene.surfaces.size.max(1.0)
        };
        Ok(CellSettings {
            sides: self.step.cells.map(|share| share * mean),
            points: self.step.points,
            rays: CELL_RAYS,
        })
    }

    /// The rays of every pixel, some rows at a time.
    fn gather(
        &self,
        seen: &[u32],
        settings: CellSettings,
        finder: &mut CellFinder<'_>,
        budget: &MemoryBudget,
        work: Work<'_>,
    ) -> Result<Gathered, TransportError> {
        let [width, height] = self.size;
        let mut out = Gathered::default();
        let mut cells = Vec::new();
        for start in (0..height).step_by(BAND) {
            work.progress.report("rays", start, height);
            let rows = (start + BAND).min(height) - start;
            let of = |pixel: usize, _: usize| self.rays_of(start * width + pixel, seen, settings);
            let pixels = each_pixel([width, rows], work, of)?;
            for (landings, smooth) in pixels {
                cells.clear();
                finder.ask(landings.iter().map(|(landing, _)| *landing), &mut cells);
                out.cells.push(cells.iter().copied());
                out.facets.extend(landings.iter().map(|(_, facet)| *facet));
                out.smooth.push(smooth);
            }
            budget.check("the rays of the picture", out.bytes() + finder.bytes())?;
        }
        work.progress.report("rays", height, height);
        Ok(out)
    }

    /// The rays of a pixel with the facets that they leave, and what is smooth there.
    fn rays_of(
        &self,
        pixel: usize,
        seen: &[u32],
        settings: CellSettings,
    ) -> (Vec<(Landing, u32)>, Option<SmoothPixel>) {
        let first = self.step.first as usize;
        let own = &seen[pixel * first..(pixel + 1) * first];
        let is_one = own.iter().all(|f| *f == own[0]);
        let rays = if is_one { 1 } else { 2 } * self.step.rays;
        let mut out = Vec::with_capacity(rays as usize);
        for ray in 0..rays {
            let place = if is_one {
                self.on_facet(pixel, ray, own[0])
            } else {
                self.place(pixel, ray)
            };
            let Some(place) = place else {
                out.push((Landing::NOWHERE, DARK));
                continue;
            };
            let index = self.index(pixel).wrapping_add(ray);
            let normal = self.scene.surfaces.facets[place.facet as usize].normal;
            let way = cosine_direction(normal, point(index, SEED_WAY));
            let landing = settings.land(self.scene, place, way, point(index, SEED_CELL));
            out.push((landing, place.facet));
        }
        let places = (0..).zip(own).map(|(k, f)| self.on_facet(pixel, k, *f));
        let places: Option<Vec<SurfacePoint>> = places.collect();
        let smooth = places.and_then(|places| {
            let distances = out.iter().map(|(landing, _)| landing.distance);
            SmoothPixel::new(self.scene.surfaces, &places, distances, self.step.filter)
        });
        (out, smooth)
    }
}

/// One value for each pixel, by its number and its column.
fn each_pixel<T: Send>(
    [width, height]: [usize; 2],
    work: Work<'_>,
    of: impl Fn(usize, usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let row = |y: usize| {
        work.check()?;
        Ok((0..width).map(|x| of(y * width + x, x)).collect())
    };
    let rows: Result<Vec<Vec<T>>, Cancelled> = (0..height).into_par_iter().map(row).collect();
    Ok(rows?.into_iter().flatten().collect())
}

/// Bounces until next to nothing is left of light that starts everywhere alike: a bound for any
/// light.
fn bounces(cells: &Cells, work: Work<'_>) -> Result<usize, Cancelled> {
    let mut level = vec![1.0_f32; cells.count()];
    let total = level.len().max(1) as f64;
    for bounce in 1..MOST_BOUNCES {
        work.check()?;
        let next = |(cell, r): (usize, &[f32; 3])| {
            let rays = cells.rays.get(cell);
            let arrives = rays
                .iter()
                .filter(|c| **c != DARK)
                .map(|c| level[*c as usize]);
            let highest = r[0].max(r[1]).max(r[2]);
            highest * arrives.sum::<f32>() / rays.len().max(1) as f32
        };
        level = cells.reflectance.par_iter().enumerate().map(next).collect();
        let left = level.iter().map(|l| f64::from(*l)).sum::<f64>() / total;
        if left < LEFT {
            return Ok(bounce);
        }
    }
    Ok(MOST_BOUNCES)
}
