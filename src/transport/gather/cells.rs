//! The radiosity cache: cells in a hash table, created by ray hits and evaluated at some of them.
//!
//! A hit falls into the cell of its place, normal and material. The cell's size grows with the
//! ray's length, since distant surfaces are averaged over larger areas (spatial hashing: Binder,
//! Fricke and Keller 2019). A cell is evaluated at some of the hits that requested it, so never
//! inside a solid, and invisible surfaces have no cells. From those points further rays request
//! further cells, which are kept apart from those of the camera's rays. Each ray is weighted by the
//! number of camera rays that it represents, so that points are placed where they contribute to the
//! image. Cells depend on geometry alone.

use crate::TransportError;
use crate::gather::lamp_patches::{KernelBounds, Met};
use crate::gather::ray_scene::{DARK, RayScene, SurfacePoint};
use crate::gather::sampling::{cosine_direction, hash, point};
use crate::gather::systematic::SystematicSample;
use crate::memory::MemoryBudget;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, frame};
use footlight_show::hash::mix;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::ops::Range;

/// Weight of a camera ray; rays of cells weigh less.
pub const CAMERA_RAY: u32 = 16;
/// Relative number of points of a cell in which only rays of cells end.
const LATER_POINTS: f64 = 0.5;
/// Side of the cells hit by rays over the hemisphere, relative to the length of the rays.
pub const HEMISPHERE: f64 = 0.5;
/// Least side of cells hit by rays of a lobe, relative to that of other cells.
const FINER: f64 = 0.25;
/// Bounces after which new cells are no longer evaluated.
const GENERATIONS: usize = 6;
/// Points in one task.
const RUN: usize = 256;
/// Points whose rays are held together.
const BATCH: usize = 1 << 14;

/// Parameters of the cells at a step.
#[derive(Clone, Copy, Debug)]
pub struct CellSettings {
    /// Least and greatest side of a cell, metres; cell sides are the least times powers of two.
    pub sides: [f64; 2],
    /// The number of evaluated points of a cell is this times the power 2/3 of the number of camera
    /// rays that its light reaches.
    pub points: f64,
    /// Rays of each point.
    pub rays: usize,
    /// Bounds of the kernel of lamp patches.
    pub bounds: KernelBounds,
}

/// End of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    key: Option<Key>,
    point: CellPoint,
    /// Metres; infinite when nothing is hit.
    distance: f32,
    /// As [`KernelBounds::passed`].
    passed: u32,
}

impl Landing {
    /// End of a ray that was not traced.
    pub const NOWHERE: Landing = Landing {
        key: None,
        point: CellPoint {
            facet: DARK,
            near: [0.0; 2],
        },
        distance: f32::INFINITY,
        passed: 0,
    };

    /// The landing of a ray that counts all light of lamps' patches.
    pub fn past_all_bounds(self) -> Landing {
        Landing {
            passed: KernelBounds::MOST,
            ..self
        }
    }

    /// Inverse length of the ray, which counts as at least a millimetre; 1/m.
    pub fn nearness(&self) -> f64 {
        1.0 / f64::from(self.distance).max(1e-3)
    }
}

/// Hash of a cell's place, direction, size and material, used as its identity. Among ten million
/// cells, two collide with a probability of 3e-6 and are then merged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key(u64);

impl Key {
    /// `kind` encodes the direction of the normal and the size.
    fn new(place: [i32; 3], material: u32, kind: u32) -> Key {
        let [x, y, z] = place.map(|v| u64::from(v as u32));
        let words = [x | y << 32, z | u64::from(material) << 32, u64::from(kind)];
        Key(words.into_iter().fold(0, |hash, word| mix(hash ^ word)))
    }
}

/// Hasher of keys, which are already hashes.
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
        self.0 ^= word;
    }
}

/// Index of the direction of a normal, out of 54: nine for each side of a cube, the middle one
/// about the axis.
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
    /// Rays of a point, fewer after the first bounce.
    fn rays_of(&self, generation: usize) -> usize {
        match generation {
            0 => self.rays,
            _ => (self.rays / 2).max(2),
        }
    }

    /// Sampling of the points that cells of a generation keep. The exponent lies between 1/2, at
    /// which cells hit by many rays would dominate the noise of the image's mean, and 1, at which
    /// cells hit by few would dominate the noise of pixels.
    fn sample(&self, generation: usize) -> SystematicSample {
        let share = match generation {
            0 => self.points,
            _ => LATER_POINTS * self.points,
        };
        let camera_ray = f64::from(CAMERA_RAY);
        SystematicSample::new(|asked| share * (asked / camera_ray).cbrt().powi(2))
    }

    /// End of a ray from `from`; `cosine` is the ray's density times pi, `width` the cell's side
    /// relative to the ray's length. The first two of `random` shift the end by up to half a cell,
    /// which hides the borders of cells. The third selects the number of bounds that the ray passes,
    /// the last whether haze absorbs it.
    pub fn land(
        &self,
        scene: RayScene<'_>,
        from: SurfacePoint,
        way: Vec3,
        (cosine, width): (f64, f64),
        random: [f64; 4],
    ) -> Landing {
        let (place, distance) = scene.shoot(from, way);
        // Haze stops some rays.
        if place.facet == DARK || random[3] >= scene.clearness(distance) {
            return Landing {
                distance: distance as f32,
                ..Landing::NOWHERE
            };
        }
        let facet = &scene.surfaces.facets[place.facet as usize];
        let kernel = cosine * -way.dot(facet.normal) / (distance * distance);
        let [least, most] = self.sides;
        let finest = if width < HEMISPHERE { FINER } else { 1.0 };
        let level = (width * distance / least)
            .clamp(finest, most / least)
            .log2()
            .floor();
        let side = least * level.exp2();
        let axes = frame(facet.normal);
        let [u, v] = axes;
        let moved = place.point + u * ((random[0] - 0.5) * side) + v * ((random[1] - 0.5) * side);
        // Shifted off the planes in which walls usually stand.
        let index = |v: f64| (v / side + 0.371).floor() as i32;
        let key = Key::new(
            [index(moved.x), index(moved.y), index(moved.z)],
            facet.material as u32,
            direction(facet.normal) | (level as i32 as u32) << 8,
        );
        let way = place.point - facet.vertices[0];
        Landing {
            key: Some(key),
            point: CellPoint {
                facet: place.facet,
                near: axes.map(|axis| way.dot(axis) as f32),
            },
            distance: distance as f32,
            passed: self.bounds.passed(kernel, random[2]),
        }
    }
}

/// A point at which a cell is evaluated, relative to its facet in single precision to save memory.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellPoint {
    facet: u32,
    /// Metres from the facet's first vertex along [`frame`].
    near: [f32; 2],
}

impl CellPoint {
    /// The point on its facet's plane.
    pub fn place(&self, scene: RayScene<'_>) -> SurfacePoint {
        let facet = &scene.surfaces.facets[self.facet as usize];
        let ([u, v], [along, across]) = (self.near.map(f64::from), frame(facet.normal));
        SurfacePoint {
            facet: self.facet,
            point: facet.vertices[0] + along * u + across * v,
        }
    }
}

/// Cells of a scene for one camera.
#[derive(Debug, Default)]
pub struct Cells {
    /// Sorted by cell.
    points: Vec<CellPoint>,
    /// Start of each cell's points, and the end of the last cell's.
    starts: Vec<u32>,
    /// Cells hit by the rays of the points, in order, packed ([`Met`]), or [`DARK`]. Cells from
    /// [`Cells::count`] on belong to the last generation and have no points.
    rays: Vec<u32>,
    /// Number of the cells in which camera rays end, which come first, and of their points.
    seen: usize,
    first: usize,
    /// Rays of a point of the first generation and of later ones.
    counts: [usize; 2],
    /// Reflectance of each cell.
    pub reflectances: Vec<[f32; 3]>,
}

/// Finds cells.
pub struct CellFinder<'a> {
    scene: RayScene<'a>,
    settings: CellSettings,
    table: HashMap<Key, u32, BuildHasherDefault<KeyHasher>>,
    /// Bounces since the camera rays.
    generation: usize,
    /// Number of cells of earlier generations.
    known: usize,
    /// Selects the points that cells of this generation keep.
    sample: SystematicSample,
    /// For each cell of this generation the weight of the rays that requested it.
    asked: Vec<u32>,
    /// Points of earlier generations, sorted by cell.
    points: Vec<CellPoint>,
    /// Points of this generation in order of arrival.
    waiting: Vec<WaitingPoint>,
}

/// A candidate point of a cell.
struct WaitingPoint {
    cell: u32,
    /// See [`SystematicSample::rank`].
    rank: u8,
    point: CellPoint,
}

impl<'a> CellFinder<'a> {
    /// A finder without cells.
    pub fn new(scene: RayScene<'a>, settings: CellSettings) -> CellFinder<'a> {
        CellFinder {
            scene,
            settings,
            table: HashMap::default(),
            generation: 0,
            known: 0,
            sample: settings.sample(0),
            asked: Vec::new(),
            points: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Approximate bytes held.
    pub fn bytes(&self) -> usize {
        self.table.capacity() * (size_of::<(Key, u32)>() + 1)
            + self.points.len() * size_of::<CellPoint>()
            + self.waiting.len() * size_of::<WaitingPoint>()
            + 4 * self.asked.len()
    }

    /// Number of cells so far.
    fn count(&self) -> usize {
        self.known + self.asked.len()
    }

    /// Cells of the ends of weighted rays, packed ([`Met`]), or [`DARK`]. The rays that request a
    /// new cell of this generation supply its candidate points.
    pub fn ask(&mut self, landings: impl Iterator<Item = (Landing, u32)>) -> Vec<u32> {
        let mut cells = Vec::new();
        for (landing, weight) in landings {
            let Some(key) = landing.key else {
                cells.push(DARK);
                continue;
            };
            let new = self.count() as u32;
            let cell = *self.table.entry(key).or_insert(new);
            cells.push(Met::pack(cell, landing.passed));
            if cell == new {
                self.asked.push(0);
            }
            let Some(own) = (cell as usize).checked_sub(self.known) else {
                continue;
            };
            let before = self.asked[own];
            let after = before.saturating_add(weight);
            self.asked[own] = after;
            let rank = SystematicSample::rank(hash(cell), [before, after]);
            if let Some(rank) = rank.filter(|rank| self.sample.keeps(*rank, after)) {
                let point = landing.point;
                self.waiting.push(WaitingPoint { cell, rank, point });
            }
        }
        cells
    }

    /// Finds all cells whose light reaches the requested ones.
    ///
    /// # Errors
    /// On cancel, and when the cells exceed the budget.
    pub fn find(mut self, budget: &MemoryBudget, work: Work<'_>) -> Result<Cells, TransportError> {
        let mut cells = Cells {
            counts: [0, 1].map(|generation| self.settings.rays_of(generation)),
            starts: vec![0],
            ..Cells::default()
        };
        while self.generation < GENERATIONS && !self.waiting.is_empty() {
            work.progress.report("cells", self.generation, GENERATIONS);
            let count = self.settings.rays_of(self.generation);
            let more = 8 * self.asked.len();
            budget.check("the radiosity cache", self.bytes() + cells.bytes() + more)?;
            let earlier = self.known;
            let (new, asked) = self.sort_points(&mut cells.starts);
            self.generation += 1;
            self.sample = self.settings.sample(self.generation);
            if self.generation == 1 {
                (cells.seen, cells.first) = (self.known, new.len());
                // Hits of camera rays lie in more open places than hits of rays of cells, and are
                // brighter: the latter have separate cells.
                self.table = HashMap::default();
            }
            let weights = asked.iter().zip(cells.starts[earlier..].windows(2));
            let mut weights = weights.flat_map(|(asked, points)| {
                let rays = (points[1] - points[0]) * count as u32;
                let weight = (f64::from(*asked) / f64::from(rays)).round().max(1.0);
                std::iter::repeat_n(weight as u32, rays as usize)
            });
            for start in new.clone().step_by(BATCH) {
                let some = start..new.end.min(start + BATCH);
                let landings = self.rays(start - new.start, &self.points[some], count, work)?;
                let met = self.ask(landings.into_iter().zip(weights.by_ref()));
                cells.rays.extend(met);
                budget.check("the radiosity cache", self.bytes() + cells.bytes())?;
            }
        }
        work.progress.report("cells", GENERATIONS, GENERATIONS);
        cells.rays.shrink_to_fit();
        self.points.shrink_to_fit();
        cells.points = self.points;
        drop((self.table, self.waiting));
        cells.set_reflectance(self.scene, self.settings);
        Ok(cells)
    }

    /// Sorts the points that this generation's cells keep by cell, in order of arrival, appends the
    /// cells' starts, and begins the next generation. Returns the indices of the sorted points, and
    /// the request weight of each of their cells.
    fn sort_points(&mut self, starts: &mut Vec<u32>) -> (Range<usize>, Vec<u32>) {
        let asked = std::mem::take(&mut self.asked);
        let mut waiting = std::mem::take(&mut self.waiting);
        let own = |w: &WaitingPoint| w.cell as usize - self.known;
        waiting.retain(|w| self.sample.keeps(w.rank, asked[own(w)]));
        waiting.par_sort_by_key(|w| w.cell);
        let mut counts = vec![0; asked.len()];
        waiting.iter().for_each(|w| counts[own(w)] += 1);
        let first = self.points.len();
        let mut end = first as u32;
        starts.extend(counts.into_iter().map(|count: u32| {
            end += count;
            end
        }));
        self.points.extend(waiting.iter().map(|w| w.point));
        self.known += asked.len();
        (first..self.points.len(), asked)
    }

    /// Ends of the rays of points; the first point has this index in its generation.
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
                    let ([u, v], [w, x]) = (point(ray, seed ^ 0x99), point(ray, seed ^ 0x77));
                    out.push(settings.land(
                        scene,
                        place,
                        way,
                        (way.dot(normal), HEMISPHERE),
                        [u, v, w, x],
                    ));
                }
            }
            Ok(out)
        };
        let parts: Result<Vec<Vec<Landing>>, Cancelled> =
            points.par_chunks(RUN).enumerate().map(run).collect();
        Ok(parts?.concat())
    }
}

impl Cells {
    /// Sets the reflectance of all cells; textures are averaged over a cell's side at each point.
    fn set_reflectance(&mut self, scene: RayScene<'_>, settings: CellSettings) {
        let of = |cell: usize| {
            let points = self.points(cell);
            let share = 1.0 / points.len().max(1) as f32;
            let mut mean = [0.0; 3];
            for p in points {
                let facet = &scene.surfaces.facets[p.facet as usize];
                if scene.surfaces.texture(facet.material).is_none() {
                    return facet.reflectance.map(|r| r as f32);
                }
                let sides = || frame(facet.normal).map(|way| way * settings.sides[0]);
                let place = p.place(scene).point;
                let own = scene.surfaces.reflectance_at(facet, place, sides);
                mean.iter_mut()
                    .zip(own)
                    .for_each(|(to, own)| *to += share * own as f32);
            }
            mean
        };
        self.reflectances = (0..self.count()).into_par_iter().map(of).collect();
    }

    /// Number of cells that have points.
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// A cell's points.
    pub fn points(&self, cell: usize) -> &[CellPoint] {
        &self.points[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Cells hit by a cell's rays, by their index among those in which only rays of cells end;
    /// `None` for a ray without light.
    pub fn met(&self, cell: usize) -> impl Iterator<Item = Option<Met>> + '_ {
        let [start, end] = [cell, cell + 1].map(|at| self.first_ray(self.starts[at] as usize));
        let met = self.rays[start..end].iter();
        let met = met.map(|met| {
            Met::unpack(*met).map(|met| Met {
                cell: met.cell - self.seen,
                ..met
            })
        });
        met.filter(|met| met.is_none_or(|met| met.cell < self.later()))
    }

    /// Index of a point's first ray.
    fn first_ray(&self, point: usize) -> usize {
        let ([first, later], of_first) = (self.counts, point.min(self.first));
        of_first * first + (point - of_first) * later
    }

    /// Approximate bytes held.
    pub fn bytes(&self) -> usize {
        self.points.len() * size_of::<CellPoint>()
            + 4 * (self.rays.len() + self.starts.len())
            + 12 * self.reflectances.len()
    }

    /// Temporary bytes of a patch bounce for each light.
    pub fn bounce_bytes(&self) -> usize {
        12 * self.count()
    }

    /// Temporary bytes of the exchange for each light.
    pub fn light_bytes(&self) -> usize {
        16 * self.count() + 12 * (self.later() + self.later().max(self.seen))
    }

    /// Number of cells in which only rays of cells end.
    pub fn later(&self) -> usize {
        self.count() - self.seen
    }
}
