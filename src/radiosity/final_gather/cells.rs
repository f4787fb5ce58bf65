//! The radiosity cache: cells in a hash table, found by rays and evaluated where rays fell.
//!
//! A ray's hit falls into the cell of its place, normal and material; the cell's size grows with
//! the ray's length, as what is far away is averaged over more (spatial hashing: Binder, Fricke and
//! Keller 2019). A cell is evaluated at some of the very hits that asked for it, so never at a
//! point inside a solid, and not at all where nothing is seen. From those points further rays ask
//! for further cells. All of it depends on geometry alone.

use crate::geometry::{Vec3, frame, vec3};
use crate::radiosity::final_gather::bvh::{Bvh, Hit};
use crate::radiosity::final_gather::sampling::{cosine_direction, hash, point};
use crate::radiosity::geometry::surface::Surfaces;
use crate::radiosity::memory::MemoryBudget;
use crate::renderer::TransportError;
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::Range;

/// No light comes from there: nothing is hit, or a back.
pub const DARK: u32 = u32::MAX;

/// A cell of the last generation that got no points: its rays do not count.
const ABSENT: u32 = DARK - 1;

/// Points at which a cell is evaluated, at most: of the cells that the camera's rays ask for, and
/// of those that only other cells ask for.
const MOST_POINTS: [usize; 2] = [16, 2];
/// Bounces after which new cells are no longer evaluated.
const GENERATIONS: usize = 6;
/// Points that one task works on.
const RUN: usize = 256;
/// Points whose rays are held at once.
const BATCH: usize = 1 << 14;

/// How cells are made at a step.
#[derive(Clone, Copy, Debug)]
pub struct CellSettings {
    /// Least and greatest side of a cell, metres; cells between are powers of two times the least.
    pub sides: [f64; 2],
    /// A cell is evaluated at this times the square root of the rays that asked for it.
    pub points: f64,
    /// Rays of each point.
    pub rays: usize,
}

/// Where a ray ends.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    key: Option<Key>,
    /// Where.
    pub place: SurfacePoint,
    /// Metres; infinite where nothing is hit.
    pub distance: f64,
}

impl Landing {
    /// Of a ray that starts nowhere.
    pub const NOWHERE: Landing = Landing {
        key: None,
        place: SurfacePoint {
            facet: DARK,
            point: Vec3::ZERO,
        },
        distance: f64::INFINITY,
    };
}

/// A point of a facet.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Index of the facet.
    pub facet: u32,
    /// Where.
    pub point: Vec3,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Key {
    place: [i32; 3],
    material: u32,
    /// Direction of the normal and size of the cell.
    kind: u32,
}

impl std::hash::Hash for Key {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let [x, y, z] = self.place.map(|v| u64::from(v as u32));
        state.write_u64(x | y << 32);
        state.write_u64(z | u64::from(self.material) << 32);
        state.write_u64(u64::from(self.kind));
    }
}

/// A multiplicative hash, the same in every run.
#[derive(Clone, Copy, Debug, Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|b| self.write_u64(u64::from(*b)));
    }
    fn write_u64(&mut self, word: u64) {
        let mixed = (self.0.rotate_left(29) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 32);
    }
}

/// What rays need of a scene.
#[derive(Clone, Copy)]
pub struct RayScene<'a> {
    /// The facets.
    pub surfaces: &'a Surfaces,
    /// Over their triangles.
    pub bvh: &'a Bvh,
    /// How far rays keep from the surface that they leave, metres.
    pub offset: f64,
}

impl RayScene<'_> {
    /// The front that a ray from a point of a facet meets first, and how far away; a facet of
    /// [`DARK`] where there is none.
    pub fn shoot(&self, from: SurfacePoint, way: Vec3) -> (SurfacePoint, f64) {
        let normal = self.surfaces.facets[from.facet as usize].normal;
        self.look(from.point + normal * self.offset, way)
    }

    /// Does anything stand between a point of a surface and one of an emitter, each with its unit
    /// normal?
    pub fn is_hidden(&self, (point, normal): (Vec3, Vec3), (end, facing): (Vec3, Vec3)) -> bool {
        let from = point + normal * self.offset;
        let to = end + facing * (2.0 * self.offset);
        self.is_blocked(from, to - from)
    }

    /// Does anything stop light on the segment from `origin` by `way`?
    pub fn is_blocked(&self, origin: Vec3, way: Vec3) -> bool {
        match self.surfaces.is_cut {
            true => self
                .bvh
                .is_blocked_past(origin, way, |hit| self.passes(hit, origin, way)),
            false => self.bvh.is_blocked(origin, way),
        }
    }

    fn first_hit(&self, origin: Vec3, way: Vec3) -> Option<Hit> {
        match self.surfaces.is_cut {
            true => self
                .bvh
                .first_hit_past(origin, way, |hit| self.passes(hit, origin, way)),
            false => self.bvh.first_hit(origin, way),
        }
    }

    fn passes(&self, hit: &Hit, origin: Vec3, way: Vec3) -> bool {
        let point = origin + way * f64::from(hit.distance);
        self.surfaces.lets_through(hit.facet, point, way)
    }

    /// The front that is seen from `origin`.
    pub fn look(&self, origin: Vec3, way: Vec3) -> (SurfacePoint, f64) {
        let nowhere = SurfacePoint {
            facet: DARK,
            point: origin,
        };
        let Some(hit) = self.first_hit(origin, way) else {
            return (nowhere, f64::INFINITY);
        };
        // On the facet's plane, more exactly than single precision has it.
        let facet = &self.surfaces.facets[hit.facet as usize];
        let slope = facet.normal.dot(way);
        let distance = if slope < -1e-6 {
            -facet.height(origin) / slope
        } else {
            f64::from(hit.distance)
        };
        let place = SurfacePoint {
            facet: if hit.front { hit.facet } else { DARK },
            point: origin + way * distance,
        };
        (place, distance)
    }
}

/// Which of 54 directions a normal points to: nine on each side of a cube, the middle one about the
/// axis.
fn direction(normal: Vec3) -> u32 {
    let sizes = [normal.x.abs(), normal.y.abs(), normal.z.abs()];
    let axis = if sizes[0] >= sizes[1] && sizes[0] >= sizes[2] {
        0
    } else if sizes[1] >= sizes[2] {
        1
    } else {
        2
    };
    let third = |v: f64| u32::from(v >= -0.35) + u32::from(v >= 0.35);
    let side = 2 * axis as u32 + u32::from(normal[axis] < 0.0);
    9 * side + 3 * third(normal[(axis + 1) % 3]) + third(normal[(axis + 2) % 3])
}

impl CellSettings {
    /// Rays of a point, fewer behind the first bounce.
    fn rays_of(&self, generation: usize) -> usize {
        match generation {
            0 => self.rays,
            _ => (self.rays / 2).max(2),
        }
    }

    /// Where a ray from `from` ends; `random` moves it by up to half a cell, so that borders
    /// between cells are not seen.
    pub fn land(
        &self,
        scene: RayScene<'_>,
        from: SurfacePoint,
        way: Vec3,
        random: [f64; 2],
    ) -> Landing {
        let (place, distance) = scene.shoot(from, way);
        if place.facet == DARK {
            return Landing {
                key: None,
                place,
                distance,
            };
        }
        let facet = &scene.surfaces.facets[place.facet as usize];
        let [least, most] = self.sides;
        // Half the ray's length, within the limits.
        let level = (0.5 * distance / least)
            .clamp(1.0, most / least)
            .log2()
            .floor();
        let side = least * level.exp2();
        let [u, v] = frame(facet.normal);
        let moved = place.point + u * ((random[0] - 0.5) * side) + v * ((random[1] - 0.5) * side);
        // Off the planes on which walls like to stand.
        let index = |v: f64| (v / side + 0.371).floor() as i32;
        let key = Key {
            place: [index(moved.x), index(moved.y), index(moved.z)],
            material: facet.material as u32,
            kind: direction(facet.normal) | (level as u32) << 8,
        };
        Landing {
            key: Some(key),
            place,
            distance,
        }
    }
}

/// Where a cell is evaluated, in single precision from the middle of the scene: there are millions.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellPoint {
    /// The cell.
    pub cell: u32,
    facet: u32,
    near: [f32; 3],
}

impl CellPoint {
    fn new(scene: RayScene<'_>, cell: u32, place: SurfacePoint) -> CellPoint {
        let near = place.point - scene.bvh.middle;
        CellPoint {
            cell,
            facet: place.facet,
            near: [near.x as f32, near.y as f32, near.z as f32],
        }
    }

    /// The point, on its facet's plane as exactly as before.
    pub fn place(&self, scene: RayScene<'_>) -> SurfacePoint {
        let facet = &scene.surfaces.facets[self.facet as usize];
        let [x, y, z] = self.near.map(f64::from);
        let rounded = scene.bvh.middle + vec3(x, y, z);
        SurfacePoint {
            facet: self.facet,
            point: rounded - facet.normal * facet.height(rounded),
        }
    }
}

/// The cells of a scene as a camera sees it.
#[derive(Debug, Default)]
pub struct Cells {
    /// Sorted by cell.
    pub points: Vec<CellPoint>,
    /// Of each cell its range of points.
    starts: Vec<u32>,
    /// The cells that the rays of points meet, in the order in which these were found: [`DARK`] for
    /// none, [`ABSENT`] for one without points.
    rays: Vec<u32>,
    /// Number of points of the first generation.
    first: usize,
    /// Rays of a point of the first and of later generations.
    counts: [usize; 2],
    /// Of each point when it was found.
    found: Vec<u32>,
    /// Of each cell.
    pub reflectance: Vec<[f32; 3]>,
}

/// Finds cells.
pub struct CellFinder<'a> {
    scene: RayScene<'a>,
    settings: CellSettings,
    table: HashMap<Key, u32, BuildHasherDefault<KeyHasher>>,
    /// Rays that asked for each cell while it was new.
    asked: Vec<u32>,
    /// Bounces since the camera's rays.
    generation: usize,
    /// Cells of earlier generations.
    known: usize,
    /// Of the cells of this generation.
    points: Vec<CellPoint>,
}

impl<'a> CellFinder<'a> {
    /// No cells yet.
    pub fn new(scene: RayScene<'a>, settings: CellSettings) -> CellFinder<'a> {
        CellFinder {
            scene,
            settings,
            table: HashMap::default(),
            asked: Vec::new(),
            generation: 0,
            known: 0,
            points: Vec::new(),
        }
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        self.table.capacity() * (size_of::<(Key, u32)>() + 1)
            + 4 * self.asked.len()
            + self.points.len() * size_of::<CellPoint>()
    }

    /// The cells of rays' ends, [`DARK`] for none. A cell that is new in this generation gets its
    /// points from the rays that ask for it, the sooner the denser, as their number grows with the
    /// root of the rays'.
    pub fn ask(&mut self, landings: impl Iterator<Item = Landing>, rows: &mut Vec<u32>) {
        let most = MOST_POINTS[self.generation.min(1)];
        for landing in landings {
            let Some(key) = landing.key else {
                rows.push(DARK);
                continue;
            };
            let new = self.asked.len() as u32;
            let cell = *self.table.entry(key).or_insert(new);
            rows.push(cell);
            if cell == new {
                self.asked.push(0);
            }
            if (cell as usize) < self.known {
                continue;
            }
            let asked = &mut self.asked[cell as usize];
            let wanted = |asked: u32| {
                let points = self.settings.points * f64::from(asked).sqrt();
                (points as usize).clamp(usize::from(asked > 0), most)
            };
            let before = wanted(*asked);
            *asked += 1;
            if wanted(*asked) > before {
                let point = CellPoint::new(self.scene, cell, landing.place);
                self.points.push(point);
            }
        }
    }

    /// All cells whose light reaches those that were asked for.
    ///
    /// # Errors
    /// On cancel, and where the cells do not fit into the budget.
    pub fn find(mut self, budget: &MemoryBudget, work: Work<'_>) -> Result<Cells, TransportError> {
        // Of each generation.
        let mut all: Vec<Vec<CellPoint>> = Vec::new();
        let mut rays: Vec<u32> = Vec::new();
        while self.generation < GENERATIONS && !self.points.is_empty() {
            work.progress.report("cells", self.generation, GENERATIONS);
            let count = self.settings.rays_of(self.generation);
            let points = std::mem::take(&mut self.points);
            // The points are copied when they are sorted.
            let found = all.iter().map(Vec::len).sum::<usize>() + points.len();
            let more = points.len() * count;
            let held = found * (2 * size_of::<CellPoint>() + 4) + 4 * (rays.len() + more);
            budget.check("the radiosity cache", self.bytes() + held)?;
            rays.reserve_exact(more);
            self.known = self.asked.len();
            self.generation += 1;
            for (at, some) in points.chunks(BATCH).enumerate() {
                let landings = self.rays(at * BATCH, some, count, work)?;
                self.ask(landings.into_iter(), &mut rays);
                budget.check("the radiosity cache", self.bytes() + held)?;
            }
            all.push(points);
        }
        work.progress.report("cells", GENERATIONS, GENERATIONS);
        let count = self.asked.len();
        drop(self.table);
        Ok(sorted(self.scene, self.settings, count, all, rays))
    }

    /// The ends of the rays of points, of which the first has this number in its generation.
    fn rays(
        &self,
        first: usize,
        points: &[CellPoint],
        count: usize,
        work: Work<'_>,
    ) -> Result<Vec<Landing>, Cancelled> {
        let (scene, settings) = (self.scene, self.settings);
        let generation = self.generation as u32;
        let run = |(at, run): (usize, &[CellPoint])| {
            work.check()?;
            let mut out = Vec::with_capacity(run.len() * count);
            for (i, p) in run.iter().enumerate() {
                let seed = hash((first + at * RUN + i) as u32 ^ generation << 28);
                let place = p.place(scene);
                let normal = scene.surfaces.facets[place.facet as usize].normal;
                for ray in 0..count as u32 {
                    let way = cosine_direction(normal, point(ray, seed));
                    out.push(settings.land(scene, place, way, point(ray, seed ^ 0x99)));
                }
            }
            Ok(out)
        };
        let parts: Result<Vec<Vec<Landing>>, Cancelled> =
            points.par_chunks(RUN).enumerate().map(run).collect();
        Ok(parts?.concat())
    }
}

/// Points by cell, with their rays; textures are averaged over a cell's side at each point.
fn sorted(
    scene: RayScene<'_>,
    settings: CellSettings,
    count: usize,
    all: Vec<Vec<CellPoint>>,
    mut rays: Vec<u32>,
) -> Cells {
    let mut starts = vec![0_u32; count + 1];
    for p in all.iter().flatten() {
        starts[p.cell as usize + 1] += 1;
    }
    for cell in 0..count {
        starts[cell + 1] += starts[cell];
    }
    for met in rays.iter_mut().filter(|met| **met != DARK) {
        if starts[*met as usize] == starts[*met as usize + 1] {
            *met = ABSENT;
        }
    }
    let mut next = starts.clone();
    let first = all.first().map_or(0, Vec::len);
    let number = starts.last().map_or(0, |end| *end as usize);
    let mut points = vec![CellPoint::default(); number];
    let mut found = vec![0_u32; number];
    for (i, p) in (0..).zip(all.into_iter().flatten()) {
        let place = &mut next[p.cell as usize];
        points[*place as usize] = p;
        found[*place as usize] = i;
        *place += 1;
    }
    let mut reflectance = vec![[0.0; 3]; count];
    for p in &points {
        let facet = &scene.surfaces.facets[p.facet as usize];
        let to = &mut reflectance[p.cell as usize];
        if scene.surfaces.texture(facet.material).is_none() {
            *to = facet.reflectance.map(|r| r as f32);
            continue;
        }
        let sides = || frame(facet.normal).map(|way| way * settings.sides[0]);
        let own = scene
            .surfaces
            .reflectance_at(facet, p.place(scene).point, sides);
        let share = 1.0 / (starts[p.cell as usize + 1] - starts[p.cell as usize]).max(1) as f32;
        to.iter_mut()
            .zip(own)
            .for_each(|(to, own)| *to += share * own as f32);
    }
    Cells {
        points,
        starts,
        rays,
        first,
        counts: [0, 1].map(|generation| settings.rays_of(generation)),
        found,
        reflectance,
    }
}

impl Cells {
    /// How many.
    pub fn count(&self) -> usize {
        self.reflectance.len()
    }

    /// A cell's points.
    pub fn points(&self, cell: usize) -> &[CellPoint] {
        &self.points[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The cells that a cell's rays meet, [`DARK`] for none.
    pub fn met(&self, cell: usize) -> impl Iterator<Item = u32> + '_ {
        let found = &self.found[self.starts[cell] as usize..self.starts[cell + 1] as usize];
        let met = found
            .iter()
            .flat_map(|&i| &self.rays[self.range(i as usize)]);
        met.copied().filter(|met| *met != ABSENT)
    }

    /// Where the rays of the point that was found as this one are.
    fn range(&self, point: usize) -> Range<usize> {
        let ([first, later], of_first) = (self.counts, point.min(self.first));
        let start = of_first * first + (point - of_first) * later;
        start..start + if point < self.first { first } else { later }
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        self.points.len() * (size_of::<CellPoint>() + 4)
            + 4 * self.rays.len()
            + 28 * self.reflectance.len()
    }

    /// Radiosity of each cell under several lights at once from the irradiance that arrives there
    /// directly (`direct`, one number for each cell and light): `bounces` Jacobi steps. Returns
    /// three channels for each cell and light.
    ///
    /// # Errors
    /// On cancel.
    pub fn radiosity(
        &self,
        direct: &[f32],
        lights: usize,
        bounces: usize,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let width = 3 * lights;
        let mut now = vec![0.0_f32; self.count() * width];
        let mut next = now.clone();
        for _ in 0..bounces {
            let runs = next.par_chunks_mut(RUN * width).enumerate();
            runs.try_for_each(|(at, run)| {
                work.check()?;
                for (i, out) in run.chunks_exact_mut(width).enumerate() {
                    let cell = at * RUN + i;
                    out.fill(0.0);
                    let mut rays = 0_u32;
                    for other in self.met(cell) {
                        rays += 1;
                        if other == DARK {
                            continue;
                        }
                        let other = other as usize * width;
                        for (sum, b) in out.iter_mut().zip(&now[other..other + width]) {
                            *sum += b;
                        }
                    }
                    let share = 1.0 / rays.max(1) as f32;
                    let arrives = &direct[cell * lights..(cell + 1) * lights];
                    for (channels, direct) in out.chunks_exact_mut(3).zip(arrives) {
                        for (b, r) in channels.iter_mut().zip(self.reflectance[cell]) {
                            *b = r * (direct + share * *b);
                        }
                    }
                }
                Ok(())
            })?;
            std::mem::swap(&mut now, &mut next);
        }
        Ok(now)
    }
}
