//! G for scenes of many polygons: final gathering by ray tracing over a radiosity cache.
//!
//! The cost depends on the visible surfaces, not on the number of polygons: nothing is meshed. Each
//! pixel sends cosine-weighted rays that end in cells of a cache ([`cells`]); the cells exchange
//! light by Jacobi steps. Direct light is the closed form times the visible share of sampled shadow
//! rays ([`emitter`]), with more samples where the first ones differ, until the predicted noise
//! meets the step's target. The first bounce of a narrow beam is sampled from the lamp
//! ([`lamp_patches`]). Cells, rays and filters depend on the geometry alone, and the samples of a
//! light on that light alone. Images are therefore exactly linear and do not depend on other
//! settings or the number of threads.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, cell, ray or pixel, made together"
)]

pub mod airlight;
mod bounces;
pub mod bvh;
mod cells;
mod direct_light;
pub mod emitter;
pub(crate) mod first_bounce;
mod globes;
mod irradiance_filter;
mod lamp_patches;
mod parts;
mod path_estimator;
mod picture_rays;
pub mod ray_scene;
pub mod sampling;
mod step;
mod systematic;
mod triangle;

pub use path_estimator::PathEstimator;
pub use step::{GatherStep, cost};

use crate::contract::check_memory;
use crate::direct::projector::{Projector, projector};
use crate::direct::{PreparedLight, check_rig, luminaires};
use crate::gather::airlight::Airlight;
use crate::gather::bounces::Bounces;
use crate::gather::bvh::Bvh;
use crate::gather::cells::{CellFinder, CellSettings, Cells};
use crate::gather::direct_light::{DirectLight, Unit};
use crate::gather::emitter::{Emitter, SampleSum};
use crate::gather::first_bounce::FirstBounces;
use crate::gather::irradiance_filter::{even_out, filter};
use crate::gather::lamp_patches::{LampPatches, MOST_BOUNCES, Met};
use crate::gather::parts::{Look, Parts};
use crate::gather::picture_rays::PictureRays;
use crate::gather::ray_scene::{RayScene, Receiver, SurfacePoint};
use crate::gather::sampling::{hash, point};
use crate::memory::MemoryBudget;
use crate::surfaces::FACET_BYTES;
use crate::surfaces::camera::Window;
use crate::surfaces::surface::Surfaces;
use crate::unit_lights::{BandedScene, Bands, UnitLights};
use crate::{Quality, Setup, TransportError};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::frame;
use footlight_show::model::Haze;
use footlight_stage::Light;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// Most lights solved together, and the approximate bytes that they may take: one ray traversal
/// serves all of them.
const BLOCK: usize = 8;
const BLOCK_BYTES: usize = 192 << 20;
/// Parts of pixels in one task.
const PARTS: usize = 256;
/// Approximate bytes of a band. Bands do not share cells, so that several take longer than one.
const BAND_BYTES: usize = 3 << 30;
/// Seed of the point sequences.
const SEED_CELL_LIGHT: u32 = 0x777;

/// A scene prepared for a view and a step of quality: everything that the bands of the picture
/// share.
pub struct GatherStage {
    step: GatherStep,
    bands: Bands,
    surfaces: Surfaces,
    bvh: Bvh,
    lights: Vec<PreparedLight>,
    projectors: Vec<Option<Projector>>,
    /// True for each light of which only the reflected light is computed.
    is_bounced: Vec<bool>,
    settings: CellSettings,
    held: usize,
}

/// G for one setup and step, in a band of the picture.
pub struct FinalGather {
    stage: Arc<GatherStage>,
    window: Window,
    parts: Parts,
    cells: Cells,
    bounces: Bounces,
    held: usize,
    /// For each light its image at unit strength, three channels interleaved.
    pictures: Vec<Option<Vec<f32>>>,
}

impl GatherStage {
    /// Prepares a scene.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    pub fn new(
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<GatherStage, TransportError> {
        let step = GatherStep::of(quality)?;
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let window = Window::new(view)?;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        let lights = luminaires(&surfaces, rig)?;
        let bvh = Bvh::new(&surfaces, work)?;
        budget.take("the hierarchy of triangles", bvh.bytes())?;
        let settings = rays((&surfaces, &bvh), &window, step).cell_settings(work)?;
        Ok(GatherStage {
            step,
            bands: Bands::new(window, step.pixel_bytes() + 12 * lights.len(), BAND_BYTES),
            lights,
            projectors: rig.lights.iter().map(projector).collect(),
            is_bounced: rig.lights.iter().map(Light::is_bounced).collect(),
            settings,
            held: budget.held,
            surfaces,
            bvh,
        })
    }
}

impl BandedScene for GatherStage {
    type Band = FinalGather;

    fn bands(&self) -> &Bands {
        &self.bands
    }

    fn bytes(&self) -> usize {
        self.held
    }

    /// Finds the visible surfaces and the cells that light them.
    fn band(
        self: Arc<Self>,
        window: Window,
        work: Work<'_>,
    ) -> Result<FinalGather, TransportError> {
        let mut budget = MemoryBudget::new(work);
        // A lower bound: pixels that show several surfaces have more rays.
        let each = 4 * (self.step.first + self.step.rays) as usize;
        let most = window.pixels().saturating_mul(each);
        budget.check("the rays of the picture", most)?;
        let picture = rays((&self.surfaces, &self.bvh), &window, self.step);
        let seen = picture.seen(work)?;
        let mut finder = CellFinder::new(picture.scene, self.settings);
        let parts = picture.gather(&seen, self.settings, &mut finder, &budget, work)?;
        drop(seen);
        budget.take("the rays of the picture", parts.bytes())?;
        let cells = finder.find(&budget, work)?;
        budget.take("the radiosity cache", cells.bytes())?;
        let bounces = cells.bounces(work)?;
        Ok(FinalGather {
            window,
            parts,
            cells,
            bounces,
            held: budget.held,
            pictures: self.lights.iter().map(|_| None).collect(),
            stage: self,
        })
    }
}

/// The camera's rays through a window.
fn rays<'a>(
    (surfaces, bvh): (&'a Surfaces, &'a Bvh),
    window: &'a Window,
    step: GatherStep,
) -> PictureRays<'a> {
    PictureRays {
        scene: RayScene::new(surfaces, bvh),
        camera: &window.camera,
        size: [window.width, window.height],
        step,
    }
}

impl FinalGather {
    fn scene(&self) -> RayScene<'_> {
        RayScene::new(&self.stage.surfaces, &self.stage.bvh)
    }

    fn rays(&self) -> PictureRays<'_> {
        let GatherStage { surfaces, bvh, .. } = self.stage.as_ref();
        rays((surfaces, bvh), &self.window, self.stage.step)
    }

    fn emitter(&self, light: usize) -> Emitter<'_> {
        let projector = self.stage.projectors[light].as_ref();
        Emitter::new(&self.stage.surfaces, &self.stage.lights[light], projector)
    }

    /// Patches of the bounces of a light, if it needs any.
    fn patches(&self, light: usize) -> Vec<LampPatches> {
        let PreparedLight::Spot(beam) = &self.stage.lights[light] else {
            return Vec::new();
        };
        let projector = self.stage.projectors[light].as_ref();
        LampPatches::of_bounces(self.scene(), beam, projector, self.stage.settings.bounds)
    }

    /// Reflected radiance of each of the lights in every pixel, without the light that pixels take
    /// from patches.
    fn indirect(
        &self,
        lights: &[usize],
        lamps: &[Vec<LampPatches>],
        work: Work<'_>,
    ) -> Result<Vec<Vec<f32>>, Cancelled> {
        let direct = self.direct_at_cells(lights, work)?;
        let first_bounces = FirstBounces::new(self.scene(), &self.cells, lamps, direct, work)?;
        let start = first_bounces.last();
        let radiosity = self
            .cells
            .radiosity(start, lights.len(), &self.bounces, work)?;
        let width = 3 * lights.len();
        let mut gathered = vec![0.0_f32; self.parts.all().len() * width];
        let parts = gathered.par_chunks_mut(width).enumerate();
        parts.with_min_len(PARTS).try_for_each(|(part, out)| {
            work.check()?;
            for same in self.parts.cells.get(part).chunk_by(Met::is_same_cell) {
                let Some(Met { cell, .. }) = Met::unpack(same[0]) else {
                    continue;
                };
                let light = &radiosity[cell * width..][..width];
                for (sum, radiosity) in out.iter_mut().zip(light) {
                    *sum += same.len() as f32 * radiosity;
                }
                let passed = same.iter().filter_map(|met| Met::unpack(*met));
                first_bounces.add_rays(cell, passed.map(|met| met.passed), out);
            }
            let share = 1.0 / (PI as f32 * self.parts.all()[part].rays as f32);
            out.iter_mut().for_each(|sum| *sum *= share);
            Ok::<(), Cancelled>(())
        })?;
        let filtered = filter(&self.parts, self.window.width, &gathered, width, work)?;
        drop(gathered);
        let picture = |light| {
            let mut picture = vec![0.0_f32; 3 * self.window.width * self.window.height];
            self.add_light(&filtered, (light, lights.len()), &mut picture);
            picture
        };
        Ok((0..lights.len()).map(picture).collect())
    }

    /// Adds one of `lights` lights to an image: the light that arrives at each part times its
    /// reflectance.
    fn add_light(&self, arrives: &[f32], (light, lights): (usize, usize), picture: &mut [f32]) {
        for (pixel, out) in picture.chunks_exact_mut(3).enumerate() {
            for at in self.parts.pixels.range(pixel) {
                let part = &self.parts.all()[at];
                let arrives = &arrives[3 * (at * lights + light)..];
                let reflected = self.parts.reflectance(part, &self.stage.surfaces);
                let share = part.share * self.scene().clearness(part.length.into()) as f32;
                for ((out, r), arrives) in out.iter_mut().zip(reflected).zip(arrives) {
                    *out += share * r * arrives;
                }
            }
        }
    }

    /// Adds the light that pixels take from patches.
    fn add_patches(
        &self,
        lamps: &[Vec<LampPatches>],
        pictures: &mut [Vec<f32>],
        report: (usize, usize),
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let most = lamps.iter().map(Vec::len).max().unwrap_or(0);
        for bounce in 0..most {
            let has_patches = |(_, lamp): &(&mut Vec<f32>, &Vec<LampPatches>)| lamp.len() > bounce;
            let lit = pictures.iter_mut().zip(lamps).filter(has_patches);
            let (lit, lamps): (Vec<_>, Vec<_>) =
                lit.map(|(picture, lamp)| (picture, &lamp[bounce])).unzip();
            let emitters: Vec<Emitter<'_>> = lamps.into_iter().map(Emitter::Patches).collect();
            let light = DirectLight {
                rays: PictureRays {
                    step: self.stage.step.of_patches(),
                    ..self.rays()
                },
                parts: &self.parts,
                emitters: &emitters,
                unit: Unit::Part,
                report,
            };
            let (mut light, mut variance) = light.with_variance(&lit, work)?;
            let lights = emitters.len();
            // Light is filtered without the texture.
            let parts = self
                .parts
                .all()
                .iter()
                .zip(light.chunks_exact_mut(3 * lights));
            for ((part, light), variance) in parts.zip(variance.chunks_exact_mut(lights)) {
                let reflected = self.parts.reflectance(part, &self.stage.surfaces);
                let inverse = reflected.map(|r| if r > 0.0 { 1.0 / r } else { 0.0 });
                let factors = inverse.iter().cycle();
                light.iter_mut().zip(factors).for_each(|(v, r)| *v *= r);
                let most = reflected.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
                variance.iter_mut().for_each(|v| *v /= most * most);
            }
            even_out(&self.parts, self.window.width, &mut light, &variance, work)?;
            for (at, picture) in lit.into_iter().enumerate() {
                self.add_light(&light, (at, lights), picture);
            }
        }
        Ok(())
    }

    /// Adds the light that haze scatters to the eye.
    fn add_airlight(
        &self,
        haze: Haze,
        emitters: &[Emitter<'_>],
        pictures: &mut [Vec<f32>],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let airlight = Airlight {
            scene: self.scene(),
            haze,
            nodes: self.stage.step.nodes,
        };
        let ends = |pixel: usize| {
            let parts = self.parts.pixels.get(pixel).iter();
            let seen = parts.filter(|part| part.look == Look::Matt);
            seen.map(|part| {
                let (facet, point) = (part.facet, part.point);
                (part.share, SurfacePoint { facet, point })
            })
        };
        let view = (&self.window.camera, [self.window.width, self.window.height]);
        let scattered = airlight.picture(emitters, view, ends, work)?;
        let lights = emitters.len();
        for (light, picture) in pictures.iter_mut().enumerate() {
            let own = scattered.iter().skip(light).step_by(lights);
            for (pixel, scattered) in picture.chunks_exact_mut(3).zip(own) {
                pixel.iter_mut().for_each(|channel| *channel += scattered);
            }
        }
        Ok(())
    }

    /// Direct irradiance of each cell by each of the lights.
    fn direct_at_cells(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<f32>, Cancelled> {
        let emitters: Vec<Emitter<'_>> = lights.iter().map(|&l| self.emitter(l)).collect();
        let mut out = vec![0.0_f32; self.cells.count() * lights.len()];
        const RUN: usize = 256;
        let runs = out.par_chunks_mut(RUN * lights.len()).enumerate();
        runs.try_for_each(|(at, run)| {
            work.check()?;
            let mut sums = vec![SampleSum::default(); lights.len()];
            for (i, out) in run.chunks_exact_mut(lights.len()).enumerate() {
                let cell = at * RUN + i;
                let points = self.cells.points(cell);
                let seed = hash(cell as u32) ^ SEED_CELL_LIGHT;
                sums.fill(SampleSum::default());
                for (k, p) in points.iter().enumerate() {
                    let SurfacePoint {
                        facet,
                        point: place,
                    } = p.place(self.scene());
                    let normal = self.stage.surfaces.facets[facet as usize].normal;
                    let at = Receiver {
                        point: place,
                        normal,
                        facet: normal,
                    };
                    // Approximate footprint of a pixel there.
                    let footprint = || {
                        let distance = (place - self.window.camera.origin).length();
                        let side = distance * self.window.camera.step_x * 4.0;
                        frame(normal).map(|way| way * side)
                    };
                    let random = point(k as u32, seed);
                    let lobe = self.stage.surfaces.lobe(facet);
                    for (sum, emitter) in sums.iter_mut().zip(&emitters) {
                        let sample = emitter.sample(self.scene(), at, footprint, random);
                        let [weight, ..] = emitter.reflectance(lobe, (at, None), [1.0; 3]);
                        sum.add(sample, weight as f32);
                    }
                }
                for (out, sum) in out.iter_mut().zip(&sums) {
                    *out = sum.irradiance() / points.len().max(1) as f32;
                }
            }
            Ok(())
        })?;
        Ok(out)
    }
}

impl UnitLights for FinalGather {
    fn bytes(&self) -> usize {
        self.held
    }

    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError> {
        let is_new = |l: &usize| self.pictures[*l].is_none();
        let new: Vec<usize> = wanted.iter().copied().filter(is_new).collect();
        let pixels = self.window.pixels();
        let each = 12 * pixels;
        check_memory("the lights", new.len() * each, work.memory)?;
        let parts = self.parts.all().len();
        // The light in cells is freed before parts are sampled.
        let bytes = |bounces: usize| {
            let cells = self.cells.light_bytes() + bounces * self.cells.bounce_bytes();
            12 * pixels + 24 * parts + cells.max(DirectLight::UNIT_BYTES * parts)
        };
        let most = BLOCK_BYTES.min(work.memory / 4);
        let together = (most / bytes(MOST_BOUNCES).max(1)).clamp(1, BLOCK);
        let mut done = 0;
        // Direct light of bounced lights is computed elsewhere.
        let (whole, bounced): (Vec<usize>, Vec<usize>) =
            new.iter().partition(|&&l| !self.stage.is_bounced[l]);
        for block in whole.chunks(together).chain(bounced.chunks(together)) {
            work.progress.report("reflected light", done, new.len());
            let lamps: Vec<Vec<LampPatches>> = block.iter().map(|&l| self.patches(l)).collect();
            let bounces = lamps.iter().map(Vec::len).max().unwrap_or(0);
            check_memory(
                "light in the cache",
                block.len() * bytes(bounces),
                work.memory,
            )?;
            let mut found = self.indirect(block, &lamps, work)?;
            let emitters: Vec<Emitter<'_>> = block.iter().map(|&l| self.emitter(l)).collect();
            let report = (done, new.len());
            let is_bounced = self.stage.is_bounced[block[0]];
            if !is_bounced {
                let direct = DirectLight {
                    rays: self.rays(),
                    parts: &self.parts,
                    emitters: &emitters,
                    unit: Unit::Pixel,
                    report,
                };
                direct.add_to(&mut found, work)?;
            }
            self.add_patches(&lamps, &mut found, report, work)?;
            if let Some(haze) = self.stage.surfaces.haze.filter(|_| !is_bounced) {
                self.add_airlight(haze, &emitters, &mut found, work)?;
            }
            done += block.len();
            for (light, picture) in block.iter().zip(found) {
                self.pictures[*light] = Some(picture);
                self.held += each;
            }
        }
        work.progress.report("direct light", done, new.len());
        Ok(())
    }

    fn picture(&self, strengths: &[[f64; 3]]) -> Image {
        let lit: Vec<(&Vec<f32>, [f64; 3])> = self
            .pictures
            .iter()
            .zip(strengths)
            .filter(|(_, s)| s.iter().any(|x| *x != 0.0))
            .filter_map(|(picture, s)| picture.as_ref().map(|p| (p, *s)))
            .collect();
        let mut image = Image::new(self.window.width, self.window.height);
        let rows = image
            .data_mut()
            .par_chunks_mut(3 * self.window.width)
            .enumerate();
        rows.for_each(|(y, row)| {
            let start = 3 * y * self.window.width;
            for (i, value) in row.iter_mut().enumerate() {
                let of =
                    |(picture, s): &(&Vec<f32>, [f64; 3])| s[i % 3] * f64::from(picture[start + i]);
                *value = lit.iter().map(of).sum::<f64>() as f32;
            }
        });
        image
    }
}
