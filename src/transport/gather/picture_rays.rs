//! The camera's rays: what each sample of a pixel shows, and the rays that gather its reflected
//! light.
//!
//! This module does not depend on lights.

use crate::TransportError;
use crate::direct::projector::pixel as footprint;
use crate::gather::cells::{CAMERA_RAY, CellFinder, CellSettings, Landing};
use crate::gather::irradiance_filter::{SmoothPixel, differ};
use crate::gather::lamp_patches::{KernelBounds, receiver_way};
use crate::gather::ray_scene::{DARK, RayScene, SurfacePoint};
use crate::gather::sampling::{cosine_direction, morton, point};
use crate::gather::step::GatherStep;
use crate::memory::MemoryBudget;
use crate::surfaces::camera::Camera;
use crate::surfaces::lists::Lists;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;

/// Rays of a point at which a cell is evaluated.
const CELL_RAYS: usize = 4;
/// Samples of one pixel may be numbered up to this.
const PIXEL_SAMPLES: u32 = 2048;
/// Rays whose ends are held at once, for each thread.
const BAND: usize = 1 << 17;
/// Pixels that one task works on.
const RUN: usize = 16;
/// Seeds of the sequences of points.
const SEED_CAMERA: u32 = 101;
const SEED_WAY: u32 = 202;
const SEED_CELL: u32 = 303;
const SEED_BOUND: u32 = 404;

/// What the pixels' rays found.
#[derive(Default)]
pub struct Gathered {
    /// For each pixel the cells that its rays end in, packed ([`crate::gather::lamp_patches::Met`]), or [`DARK`], sorted within each
    /// run.
    pub cells: Lists<u32>,
    /// Of each pixel its rays by the material that they leave.
    pub runs: Lists<Run>,
    /// Mean reflectance of the textures that pixels show.
    pub paints: Vec<[f32; 3]>,
    /// Pixels that show one smooth surface.
    pub smooth: Vec<Option<SmoothPixel>>,
}

impl Gathered {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.cells.bytes()
            + self.runs.bytes()
            + size_of_val(self.paints.as_slice())
            + self.smooth.len() * size_of::<Option<SmoothPixel>>()
    }
}

/// Rays of a pixel that leave surfaces of one material.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// One of the facets that they leave, or [`DARK`].
    pub facet: u32,
    pub rays: u32,
    /// Index of the reflectance of a texture there; [`DARK`] without one.
    pub paint: u32,
}

/// The camera's rays.
#[derive(Clone, Copy)]
pub struct PictureRays<'a> {
    pub scene: RayScene<'a>,
    pub camera: &'a Camera,
    /// Pixels across and down.
    pub size: [usize; 2],
    pub step: GatherStep,
}

impl PictureRays<'_> {
    /// Where the samples of a pixel begin in their sequence.
    pub fn index(&self, pixel: usize) -> u32 {
        let width = self.size[0];
        morton(pixel % width, pixel / width).wrapping_mul(PIXEL_SAMPLES)
    }

    fn pixels(&self) -> usize {
        self.size[0] * self.size[1]
    }

    fn way(&self, pixel: usize, k: u32) -> Vec3 {
        let width = self.size[0];
        let [u, v] = point(self.index(pixel).wrapping_add(k), SEED_CAMERA);
        let (x, y) = ((pixel % width) as f64, (pixel / width) as f64);
        self.camera.ray(x + u, y + v)
    }

    /// What sample `k` of a pixel shows, if it is a front; `seen` are the facets of the first ones.
    pub fn sample(&self, seen: &[u32], pixel: usize, k: u32) -> Option<SurfacePoint> {
        let first = self.step.first;
        if k >= first {
            return self.place(pixel, k);
        }
        self.on_facet(pixel, k, seen[pixel * first as usize + k as usize])
    }

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
    pub fn seen(&self, work: Work<'_>) -> Result<Vec<u32>, Cancelled> {
        let first = self.step.first;
        let of = |pixel: usize| {
            let facet = |k| self.place(pixel, k).map_or(DARK, |place| place.facet);
            (0..first).map(facet).collect::<Vec<u32>>()
        };
        Ok(each(self.pixels(), work, of)?.concat())
    }

    /// Sides of cells, from the mean length of a ray of each pixel.
    pub fn cell_settings(&self, seen: &[u32], work: Work<'_>) -> Result<CellSettings, Cancelled> {
        let of = |pixel: usize| {
            let place = self.on_facet(pixel, 0, seen[pixel * self.step.first as usize])?;
            let normal = self.scene.surfaces.facets[place.facet as usize].normal;
            let way = cosine_direction(normal, point(self.index(pixel), SEED_WAY));
            let (_, distance) = self.scene.shoot(place, way);
            distance.is_finite().then_some(distance)
        };
        let lengths: Vec<f64> = each(self.pixels(), work, of)?
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
            bounds: KernelBounds { longest: mean },
        })
    }

    /// The rays of every pixel, some pixels at a time.
    pub fn gather(
        &self,
        (seen, mixed): (&[u32], f64),
        settings: CellSettings,
        finder: &mut CellFinder<'_>,
        budget: &MemoryBudget,
        work: Work<'_>,
    ) -> Result<Gathered, TransportError> {
        let [width, height] = self.size;
        let mut out = Gathered {
            smooth: vec![None; width * height],
            ..Gathered::default()
        };
        let mixed = self.step.rays_of_mixed(mixed, self.size);
        let band = (BAND * rayon::current_num_threads() / mixed as usize).max(1);
        for start in (0..width * height).step_by(band) {
            work.progress.report("rays", start, width * height);
            let of = |at: usize| self.rays_of(start + at, seen, mixed, settings);
            let found = each(band.min(width * height - start), work, of)?;
            for (at, (mut landings, smooth)) in found.into_iter().enumerate() {
                let pixel = start + at;
                let material = |facet: u32| {
                    let own = self.scene.surfaces.facets.get(facet as usize);
                    own.map(|own| own.material)
                };
                landings.sort_by_key(|(_, facet)| material(*facet));
                let weighted = landings.iter().map(|(landing, _)| (*landing, CAMERA_RAY));
                let mut cells = finder.ask(weighted);
                let alike = landings.chunk_by(|a, b| material(a.1) == material(b.1));
                let mut rest = cells.as_mut_slice();
                for some in alike {
                    let (own, later) = rest.split_at_mut(some.len());
                    own.sort_unstable();
                    rest = later;
                    let paint = self.paint(seen, pixel, some[0].1).map_or(DARK, |paint| {
                        out.paints.push(paint);
                        out.paints.len() as u32 - 1
                    });
                    out.runs.add(Run {
                        facet: some[0].1,
                        rays: some.len() as u32,
                        paint,
                    });
                }
                out.runs.end();
                out.cells.push(cells);
                out.smooth[pixel] = smooth;
            }
            budget.check("the rays of the picture", out.bytes() + finder.bytes())?;
        }
        out.cells.shrink();
        out.runs.shrink();
        work.progress.report("rays", width * height, width * height);
        Ok(out)
    }

    /// Which share of the pixels shows more than one smooth surface.
    pub fn mixed_share(&self, seen: &[u32]) -> f64 {
        let surfaces = self.scene.surfaces;
        let is_mixed = |own: &&[u32]| own.iter().any(|f| differ(surfaces, [own[0], *f]));
        let pixels = seen.chunks_exact(self.step.first as usize);
        pixels.clone().filter(is_mixed).count() as f64 / pixels.len().max(1) as f64
    }

    /// Mean reflectance of a texture in a pixel, where a facet of its material is one of those that the
    /// pixel shows.
    fn paint(&self, seen: &[u32], pixel: usize, facet: u32) -> Option<[f32; 3]> {
        let surfaces = self.scene.surfaces;
        let shown = surfaces.facets.get(facet as usize)?;
        surfaces.texture(shown.material)?;
        let first = self.step.first as usize;
        let own = &seen[pixel * first..(pixel + 1) * first];
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for (k, facet) in (0..).zip(own) {
            let Some(place) = self.on_facet(pixel, k, *facet) else {
                continue;
            };
            let facet = &surfaces.facets[place.facet as usize];
            if facet.material == shown.material {
                let sides =
                    || footprint(self.camera, place.point, facet.normal, 1.0 / first as f64);
                let found = surfaces.reflectance_at(facet, place.point, sides);
                sum.iter_mut().zip(found).for_each(|(s, r)| *s += r);
                count += 1.0;
            }
        }
        let mean = if count > 0.0 {
            sum.map(|s| s / count)
        } else {
            shown.reflectance
        };
        Some(mean.map(|r| r as f32))
    }

    /// The rays of a pixel with the facets that they leave, and what is smooth there.
    fn rays_of(
        &self,
        pixel: usize,
        seen: &[u32],
        mixed: u32,
        settings: CellSettings,
    ) -> (Vec<(Landing, u32)>, Option<SmoothPixel>) {
        let first = self.step.first as usize;
        let own = &seen[pixel * first..(pixel + 1) * first];
        let is_one = own.iter().all(|f| *f == own[0]);
        let ray = |ray: u32| {
            let place = if is_one {
                self.on_facet(pixel, ray, own[0])
            } else {
                self.sample(seen, pixel, ray)
            };
            let Some(place) = place else {
                return (Landing::NOWHERE, DARK);
            };
            let index = self.index(pixel).wrapping_add(ray);
            let facet = &self.scene.surfaces.facets[place.facet as usize];
            let normal = facet.normal_at(place.point);
            let (way, cosine) = receiver_way(normal, facet.normal, point(index, SEED_WAY));
            let ([u, v], [w, _]) = (point(index, SEED_CELL), point(index, SEED_BOUND));
            let landing = settings.land(self.scene, place, way, cosine, [u, v, w]);
            (landing, place.facet)
        };
        let mut out: Vec<(Landing, u32)> = (0..self.step.rays).map(ray).collect();
        let places = (0..).zip(own).map(|(k, f)| self.on_facet(pixel, k, *f));
        let places: Option<Vec<SurfacePoint>> = places.collect();
        let smooth = places.and_then(|places| {
            let distances = out.iter().map(|(landing, _)| f64::from(landing.distance));
            SmoothPixel::new(self.scene.surfaces, &places, distances, self.step.filter)
        });
        if smooth.is_none() {
            out.extend((self.step.rays..mixed).map(ray));
        }
        (out, smooth)
    }
}

/// One value for each of so many pixels, by its number.
fn each<T: Send>(
    count: usize,
    work: Work<'_>,
    of: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, Cancelled> {
    let run = |run: usize| {
        work.check()?;
        let end = count.min((run + 1) * RUN);
        Ok((run * RUN..end).map(&of).collect())
    };
    let runs = (0..count.div_ceil(RUN)).into_par_iter();
    let runs: Result<Vec<Vec<T>>, Cancelled> = runs.map(run).collect();
    Ok(runs?.into_iter().flatten().collect())
}
