//! Camera rays: the surfaces that each sample of a pixel shows, and the rays that gather their
//! reflected light.
//!
//! This module does not depend on lights.

use crate::TransportError;
use crate::direct::projector::pixel as footprint;
use crate::gather::cells::{CAMERA_RAY, CellFinder, CellSettings, HEMISPHERE, Landing};
use crate::gather::lamp_patches::{KernelBounds, receiver_way};
use crate::gather::parts::{Hit, Look, NO_PAINT, Part, Parts, Sample, by_surface, differ};
use crate::gather::ray_scene::{DARK, RayScene, RayView, SurfacePoint};
use crate::gather::sampling::{cosine_direction, morton, point};
use crate::gather::step::GatherStep;
use crate::memory::MemoryBudget;
use crate::surfaces::camera::Camera;
use crate::surfaces::lobe::Lobe;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, frame};
use rayon::prelude::*;

/// Rays of a point at which a cell is evaluated.
const CELL_RAYS: usize = 4;
/// Upper limit of sample indices in one pixel.
const PIXEL_SAMPLES: u32 = 2048;
/// Rays whose ends are held together, for each thread.
const BAND: usize = 1 << 17;
/// Most pixels from which the sizes of cells are computed.
const MEASURED: usize = 1 << 18;
/// Pixels in one task.
const RUN: usize = 16;
/// Least radius of the irradiance filter, pixels.
const LEAST_RADIUS: f64 = 3.0;
/// Seeds of the point sequences.
const SEED_CAMERA: u32 = 101;
const SEED_WAY: u32 = 202;
const SEED_CELL: u32 = 303;
const SEED_BOUND: u32 = 404;
const SEED_GLOSS: u32 = 505;
const SEED_CHOICE: u32 = 606;

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
    /// Start of a pixel's samples in their sequence.
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

    /// Random numbers for the reflection that sample `k` of a pixel shows in a glossy surface.
    fn random(&self, pixel: usize, k: u32) -> [f64; 2] {
        point(self.index(pixel).wrapping_add(k), SEED_GLOSS)
    }

    /// Intersection of sample `k` of a pixel with a facet's plane.
    fn on_facet(&self, pixel: usize, k: u32, facet: u32) -> SurfacePoint {
        self.on_plane((self.camera.origin, self.way(pixel, k)), facet)
    }

    /// Intersection of a ray with a facet's plane.
    fn on_plane(&self, (origin, way): (Vec3, Vec3), facet: u32) -> SurfacePoint {
        let own = &self.scene.surfaces.facets[facet as usize];
        let distance = -own.height(origin) / own.normal.dot(way);
        SurfacePoint {
            facet,
            point: origin + way * distance,
        }
    }

    /// View of a facet by sample `k` of a pixel, directly or in a mirror.
    fn view(&self, pixel: usize, k: u32, [facet, mirror]: [u32; 2], share: f64) -> RayView {
        let eye = self.camera.origin;
        let (mut place, mut length) = (self.on_facet(pixel, k, facet), 0.0);
        let mut from = eye;
        if mirror != DARK {
            let seen = self.on_facet(pixel, k, mirror);
            let reflected = self.scene.reflected(seen, eye, self.random(pixel, k));
            if let Some((way, _)) = reflected {
                (from, length) = (seen.point, (seen.point - eye).length());
                place = self.on_plane((from, way), facet);
            }
        }
        RayView {
            place,
            mirror,
            share,
            length: length + (place.point - from).length(),
        }
    }

    /// All views of sample `k` of a pixel.
    fn views(&self, pixel: usize, k: u32) -> impl Iterator<Item = RayView> {
        let (eye, way) = (self.camera.origin, self.way(pixel, k));
        let random = self.random(pixel, k);
        let views = self.scene.views((eye, way), random, |l| !l.is_wide());
        views.into_iter()
    }

    /// View of a part of a pixel by its sample `k`; its share is 1 in the mean over the part.
    pub fn on_part(&self, parts: &Parts, part: usize, pixel: usize, k: u32) -> RayView {
        let hits = parts.hits.get(part);
        let own = &parts.all()[part];
        match hits.get(k as usize % hits.len().max(1)) {
            None => self.view(pixel, k, [own.facet, DARK], 1.0),
            Some(hit) => {
                let mean = own.share * self.step.edge as f32 / hits.len() as f32;
                let share = hit.share() / mean;
                self.view(pixel, u32::from(hit.sample), hit.facets(), share.into())
            }
        }
    }

    /// Calls `each` for each view of sample `k` of a pixel.
    pub fn on_pixel(&self, parts: &Parts, pixel: usize, k: u32, mut each: impl FnMut(RayView)) {
        let is_lit = |part: &usize| parts.all()[*part].look != Look::Gloss;
        let own = || parts.pixels.range(pixel).filter(is_lit);
        let is_plain = own().all(|part| parts.hits.get(part).is_empty());
        if !is_plain && k >= self.step.edge {
            self.views(pixel, k).for_each(each);
            return;
        }
        for part in own() {
            let hits = parts.hits.get(part);
            let Part { facet, share, .. } = parts.all()[part];
            if hits.is_empty() {
                each(self.view(pixel, k, [facet, DARK], share.into()));
            }
            let start = hits.partition_point(|hit| u32::from(hit.sample) < k);
            let own = hits[start..]
                .iter()
                .take_while(|hit| u32::from(hit.sample) == k);
            own.for_each(|hit| each(self.view(pixel, k, hit.facets(), hit.share().into())));
        }
    }

    /// The facet that sample `k` of a pixel shows, or [`DARK`]; sheets count as opaque.
    fn first_facet(&self, pixel: usize, k: u32) -> u32 {
        let hit = self
            .scene
            .bvh
            .first_hit(self.camera.origin, self.way(pixel, k));
        let is_sheet = |facet| self.scene.surfaces.is_sheet(facet);
        let hit = hit.filter(|hit| hit.front || is_sheet(hit.facet));
        hit.map_or(DARK, |hit| hit.facet)
    }

    /// Facets of the first samples of all pixels.
    pub fn seen(&self, work: Work<'_>) -> Result<Vec<u32>, Cancelled> {
        let of = |pixel: usize| {
            let samples = 0..self.step.first;
            samples
                .map(|k| self.first_facet(pixel, k))
                .collect::<Vec<u32>>()
        };
        Ok(each(self.pixels(), work, of)?.concat())
    }

    /// The facet that all first samples of a pixel and its neighbours show, if it is one and
    /// opaque; a facet of [`DARK`] when they show the void.
    fn sole_facet(&self, seen: &[u32], pixel: usize) -> Option<u32> {
        let (first, [width, height]) = (self.step.first as usize, self.size);
        let facet = seen[pixel * first];
        let (x, y) = (pixel % width, pixel / width);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let mut rows = y.saturating_sub(1)..(y + 2).min(height);
        let is_same = |seen: &[u32]| seen.iter().all(|other| *other == facet);
        let is_sole = is_same(&seen[pixel * first..][..first])
            && !self.scene.surfaces.is_sheet(facet)
            && self.scene.surfaces.lobe(facet).is_none_or(Lobe::is_wide)
            && rows.all(|y| {
                let row = (y * width + columns.start) * first..(y * width + columns.end) * first;
                let surfaces = self.scene.surfaces;
                let next = seen[row].iter();
                next.copied()
                    .all(|other| other == facet || !differ(surfaces, [facet, other]))
            });
        is_sole.then_some(facet)
    }

    /// Side of a pixel at a distance, metres.
    fn footprint(&self, length: f64) -> f64 {
        length * self.camera.step_x
    }

    /// Number of samples of a pixel, and the samples by surface.
    fn split(&self, seen: &[u32], pixel: usize) -> (u32, Vec<Vec<Sample>>) {
        let sample = |view: RayView, k: u32| Sample {
            view,
            hit: Hit {
                facet: view.place.facet,
                mirror: view.mirror,
                sample: k as u16,
                opacity: (view.share * f64::from(u16::MAX)).round() as u16,
            },
        };
        if let Some(facet) = self.sole_facet(seen, pixel) {
            let place = |k| sample(self.view(pixel, k, [facet, DARK], 1.0), k);
            let samples = || (0..self.step.first).map(place).collect();
            let groups = (facet != DARK).then(samples).into_iter().collect();
            return (self.step.first, groups);
        }
        let views = |k: u32| self.views(pixel, k).map(move |view| sample(view, k));
        let samples = (0..self.step.edge).flat_map(views);
        let surfaces = self.scene.surfaces;
        let groups = by_surface(surfaces, samples, |s| self.footprint(s.view.length));
        (self.step.edge, groups)
    }

    /// Sizes of cells, from the mean length of a ray of some pixels of the whole picture.
    pub fn cell_settings(&self, work: Work<'_>) -> Result<CellSettings, Cancelled> {
        let apart = self.pixels().div_ceil(MEASURED);
        let of = |at: usize| {
            let pixel = at * apart;
            let facet = self.first_facet(pixel, 0);
            let place = (facet != DARK).then(|| self.on_facet(pixel, 0, facet))?;
            let normal = self.scene.surfaces.facets[place.facet as usize].normal;
            let way = cosine_direction(normal, point(self.index(pixel), SEED_WAY));
            let (_, distance) = self.scene.shoot(place, way);
            distance.is_finite().then_some(distance)
        };
        let lengths: Vec<f64> = each(self.pixels().div_ceil(apart), work, of)?
            .into_iter()
            .flatten()
            .collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        // Any size will do for an empty view.
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

    /// Parts of every pixel with their rays, a few pixels at a time.
    pub fn gather(
        &self,
        seen: &[u32],
        settings: CellSettings,
        finder: &mut CellFinder<'_>,
        budget: &MemoryBudget,
        work: Work<'_>,
    ) -> Result<Parts, TransportError> {
        let pixels = self.pixels();
        let mut out = Parts::default();
        let band = (BAND * rayon::current_num_threads() / self.step.rays as usize).max(1);
        for start in (0..pixels).step_by(band) {
            work.progress.report("rays", start, pixels);
            let of = |at: usize| self.parts_of(seen, start + at, settings);
            for found in each(band.min(pixels - start), work, of)? {
                for FoundPart {
                    mut part,
                    hits,
                    paint,
                    landings,
                } in found
                {
                    if let Some(paint) = paint {
                        part.paint = out.paints.len() as u32;
                        out.paints.push(paint);
                    }
                    let weighted = landings.into_iter().map(|landing| (landing, CAMERA_RAY));
                    let mut cells = finder.ask(weighted);
                    cells.sort_unstable();
                    out.pixels.add(part);
                    out.hits.push(hits);
                    out.cells.push(cells);
                }
                out.pixels.end();
            }
            budget.check("the rays of the picture", out.bytes() + finder.bytes())?;
        }
        out.pixels.shrink();
        out.hits.shrink();
        out.cells.shrink();
        work.progress.report("rays", pixels, pixels);
        Ok(out)
    }

    /// Parts of a pixel, the largest first.
    fn parts_of(&self, seen: &[u32], pixel: usize, settings: CellSettings) -> Vec<FoundPart> {
        let (count, mut groups) = self.split(seen, pixel);
        groups.sort_by_key(|group| {
            std::cmp::Reverse(group.iter().map(|s| u32::from(s.hit.opacity)).sum::<u32>())
        });
        let mut sent = 0;
        let parts = |group: Vec<Sample>| {
            let found = self.part(pixel, (&group, count), sent, settings);
            sent += found.part.rays;
            let gloss = self.gloss(pixel, &found.part, &group, settings);
            [Some(found), gloss].into_iter().flatten()
        };
        groups.into_iter().flat_map(parts).collect()
    }

    /// Where a ray from a place ends; `index` chooses its random numbers, the pair is as in
    /// [`CellSettings::land`].
    fn land(
        &self,
        settings: CellSettings,
        index: u32,
        (place, way): (SurfacePoint, Vec3),
        shape: (f64, f64),
    ) -> Landing {
        let ([u, v], [w, x]) = (point(index, SEED_CELL), point(index, SEED_BOUND));
        settings.land(self.scene, place, way, shape, [u, v, w, x])
    }

    /// Radius within which the light of these rays is evened out, metres: a share `reach` of the
    /// harmonic mean of their lengths. In corners too, where light varies within a pixel, neighbours
    /// share their rays.
    fn radius(&self, (landings, rays): (&[Landing], u32), length: f64, reach: f64) -> f32 {
        let near: f64 = landings.iter().map(Landing::nearness).sum();
        let least = LEAST_RADIUS * self.footprint(length);
        let radius = (reach * f64::from(rays) / near).max(least);
        radius.min(1e6) as f32
    }

    /// Light that a part reflects by its wide lobe, gathered from the cells hit by the lobe's rays.
    fn gloss(
        &self,
        pixel: usize,
        part: &Part,
        samples: &[Sample],
        settings: CellSettings,
    ) -> Option<FoundPart> {
        let lobe = self.scene.surfaces.lobe(part.facet);
        let lobe = lobe.filter(|lobe| part.look == Look::Matt && lobe.is_wide())?;
        let eye = self.camera.origin;
        // Rays are resampled by weight from twice as many directions, so that each has an equal share.
        let tried = 2 * part.rays;
        let direction = |k: u32| {
            let place = samples[k as usize % samples.len()].view.place;
            let random = point(self.index(pixel).wrapping_add(k), SEED_GLOSS);
            let found = self.scene.reflected(place, eye, random);
            found.map(|(way, weight)| (place, way, weight))
        };
        let directions: Vec<_> = (0..tried).filter_map(direction).collect();
        let whole: f64 = directions.iter().map(|(.., weight)| weight).sum();
        let [offset, _] = point(self.index(pixel), SEED_CHOICE);
        let each = whole / f64::from(part.rays);
        let width = HEMISPHERE.min(0.5 * lobe.spread());
        let (mut passed, mut landings) = (0.0, Vec::with_capacity(part.rays as usize));
        for (place, way, weight) in directions {
            passed += weight;
            while (landings.len() as f64 + offset) * each < passed
                && landings.len() < part.rays as usize
            {
                let index = self.index(pixel).wrapping_add(landings.len() as u32);
                let landing = self.land(settings, index, (place, way), (1.0, width));
                landings.push(landing.past_all_bounds());
            }
        }
        let mean = whole / f64::from(tried);
        let reach = self.step.filter * lobe.spread().min(1.0);
        let length = f64::from(part.length);
        let radius = self.radius((&landings, part.rays), length, reach);
        Some(FoundPart {
            part: Part {
                look: Look::Gloss,
                radius,
                ..*part
            },
            hits: Vec::new(),
            paint: Some(lobe.tint.map(|t| (t * mean) as f32)),
            landings,
        })
    }

    /// A part of a pixel from the samples that show it and the number of all samples; `sent` rays
    /// have left other parts.
    fn part(
        &self,
        pixel: usize,
        (samples, count): (&[Sample], u32),
        sent: u32,
        settings: CellSettings,
    ) -> FoundPart {
        let surfaces = self.scene.surfaces;
        let facet = |place: SurfacePoint| &surfaces.facets[place.facet as usize];
        let first = samples[0];
        let is_mirrored = first.hit.mirror != DARK;
        let is_like =
            |s: &Sample| s.hit.facet == first.hit.facet && s.hit.opacity == first.hit.opacity;
        let is_plain = !is_mirrored && samples.len() as u32 == count && samples.iter().all(is_like);
        let share = samples.iter().map(|s| s.hit.share()).sum::<f32>() / count as f32;
        let own = facet(first.view.place);
        let rays = self.step.rays_of_part(share, is_mirrored);
        let place = |ray: u32| {
            if is_plain {
                self.on_facet(pixel, ray, first.hit.facet)
            } else {
                samples[ray as usize % samples.len()].view.place
            }
        };
        let ray = |ray: u32| {
            let place = place(ray);
            let index = self.index(pixel).wrapping_add(ray);
            let facet = facet(place);
            let normal = facet.normal_at(place.point);
            let (way, cosine) = receiver_way(normal, facet.normal, point(index, SEED_WAY));
            self.land(settings, index, (place, way), (cosine, HEMISPHERE))
        };
        let landings: Vec<Landing> = (sent..sent + rays).map(ray).collect();
        let (mut middle, mut normal, mut length) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for sample in samples {
            middle += sample.view.place.point;
            length += sample.view.length / samples.len() as f64;
            normal += facet(sample.view.place).normal_at(sample.view.place.point);
        }
        let middle = middle / samples.len() as f64;
        let radius = self.radius((&landings, rays), length, self.step.filter);
        FoundPart {
            part: Part {
                share,
                facet: first.hit.facet,
                rays,
                paint: NO_PAINT,
                point: middle,
                normal: normal.normalized(),
                material: own.material as u32,
                radius,
                length: length as f32,
                look: if is_mirrored {
                    Look::Mirrored
                } else {
                    Look::Matt
                },
            },
            hits: if is_plain {
                Vec::new()
            } else {
                samples.iter().map(|sample| sample.hit).collect()
            },
            paint: self.paint(samples),
            landings,
        }
    }

    /// Approximate parallelogram that a part of a pixel covers there.
    pub fn sides(&self, view: RayView, share: f64) -> [Vec3; 2] {
        let facet = &self.scene.surfaces.facets[view.place.facet as usize];
        if view.mirror == DARK {
            return footprint(self.camera, view.place.point, facet.normal, share);
        }
        frame(facet.normal).map(|way| way * self.footprint(view.length) * share.sqrt())
    }

    /// Reflectance to the eye of a view's matt part, averaged over a part of a pixel.
    pub fn reflectance(&self, view: RayView, share: f64) -> [f64; 3] {
        let surfaces = self.scene.surfaces;
        let SurfacePoint { facet, point } = view.place;
        let facet = &surfaces.facets[facet as usize];
        let sides = || self.sides(view, share);
        if view.mirror == DARK {
            return surfaces.reflectance_to(self.camera.origin, (facet, point), sides);
        }
        let (found, tint) = (
            surfaces.reflectance_at(facet, point, sides),
            surfaces.tint(view.mirror),
        );
        [0, 1, 2].map(|c| found[c] * tint[c])
    }

    /// Mean reflectance to the eye over samples of a pixel; `None` when it is the facet's.
    fn paint(&self, samples: &[Sample]) -> Option<[f32; 3]> {
        let surfaces = self.scene.surfaces;
        let facet = |sample: &Sample| &surfaces.facets[sample.hit.facet as usize];
        let first = samples.first()?;
        let (hit, is_mirrored) = (first.hit, first.hit.mirror != DARK);
        let is_painted = surfaces.texture(facet(first).material).is_some();
        if !is_painted && !is_mirrored && surfaces.lobe(hit.facet).is_none() {
            return None;
        }
        let first = self.step.first as usize;
        let some = samples.iter().step_by(samples.len().div_ceil(first));
        let count = some.len() as f64;
        let mut sum = [0.0; 3];
        for sample in some {
            let found = self.reflectance(sample.view, 1.0 / first as f64);
            sum.iter_mut().zip(found).for_each(|(s, r)| *s += r);
        }
        Some(sum.map(|s| (s / count) as f32))
    }
}

/// A part of a pixel as found.
struct FoundPart {
    part: Part,
    hits: Vec<Hit>,
    /// Mean reflectance of its texture.
    paint: Option<[f32; 3]>,
    landings: Vec<Landing>,
}

/// One value for each of `count` pixels.
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
