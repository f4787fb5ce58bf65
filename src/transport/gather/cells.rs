//! The radiosity cache: cells in a hash table, found by rays and evaluated where rays fell.
//!
//! A ray's hit falls into the cell of its place, normal and material; the cell's size grows with
//! the ray's length, as what is far away is averaged over more (spatial hashing: Binder, Fricke and
//! Keller 2019). A cell is evaluated at some of the very hits that asked for it, so never at a
//! point inside a solid, and not at all where nothing is seen. From those points further rays ask
//! for further cells, never for those of the camera's rays; each weighs as many of the camera's rays
//! as it stands for, so that points go where light of the picture comes by. All of it depends on
//! geometry alone.

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

/// Weight of a camera's ray; rays of cells weigh less.
pub const CAMERA_RAY: u32 = 16;
/// Points of a cell that only rays of cells end in, as a share.
const LATER_POINTS: f64 = 0.5;
/// Side of a cell that rays over the hemisphere end in, as a share of their length.
pub const HEMISPHERE: f64 = 0.5;
/// Rays of a lobe may end in cells of this share of the least side.
const FINER: f64 = 0.25;
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
    /// A cell is evaluated at this times the power 2/3 of the camera's rays that its light reaches.
    pub points: f64,
    /// Rays of each point.
    pub rays: usize,
    /// Bounds of the kernel of lamps' patches.
    pub bounds: KernelBounds,
}

/// Where a ray ends.
#[derive(Clone, Copy, Debug)]
pub struct Landing {
    key: Option<Key>,
    point: CellPoint,
    /// Metres; infinite where nothing is hit.
    distance: f32,
    /// As [`KernelBounds::passed`].
    passed: u32,
}

impl Landing {
    /// Of a ray that starts nowhere.
    pub const NOWHERE: Landing = Landing {
        key: None,
        point: CellPoint {
            facet: DARK,
            near: [0.0; 2],
        },
        distance: f32::INFINITY,
        passed: 0,
    };

    /// Counts all light of lamps' patches.
    pub fn past_all_bounds(self) -> Landing {
        Landing {
            passed: KernelBounds::MOST,
            ..self
        }
    }

    /// One over the ray's length, at least a millimetre.
    pub fn nearness(&self) -> f64 {
        1.0 / f64::from(self.distance).max(1e-3)
    }
}

/// A hash of a cell's place, direction, size and material that stands for them: among ten million
/// cells two share one with a probability of 3e-6, and are then one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Key(u64);

impl Key {
    /// `kind` is the direction of the normal and the size.
    fn new(place: [i32; 3], material: u32, kind: u32) -> Key {
        let [x, y, z] = place.map(|v| u64::from(v as u32));
        let words = [x | y << 32, z | u64::from(material) << 32, u64::from(kind)];
        Key(words.into_iter().fold(0, |hash, word| mix(hash ^ word)))
    }
}

/// Of keys, which are hashes already.
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

    /// Which points cells of a generation keep. The power is between a half, at which cells that
    /// many rays end in would be the noise of the picture's mean, and one, at which those that few
    /// do would be the noise of pixels.
    fn sample(&self, generation: usize) -> SystematicSample {
        let share = match generation {
            0 => self.points,
            _ => LATER_POINTS * self.points,
        };
        let camera_ray = f64::from(CAMERA_RAY);
        SystematicSample::new(|asked| share * (asked / camera_ray).cbrt().powi(2))
    }

    /// Where a ray from `from` ends. `cosine` is the ray's density times pi. The first two of `random`
    /// move the end by up to half a cell, so that borders between cells are not seen; the third decides
    /// how many bounds the ray passes, the last whether haze stops the light.
    pub fn land(
        &self,
        scene: RayScene<'_>,
        from: SurfacePoint,
        way: Vec3,
        (cosine, width): (f64, f64),
        random: [f64; 4],
    ) -> Landing {
        let (place, distance) = scene.shoot(from, way);
        // Haze keeps light back from some rays.
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
        // Off the planes on which walls like to stand.
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

/// Where a cell is evaluated, by its place on its facet in single precision: there are millions.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellPoint {
    facet: u32,
    /// Metres from the facet's first vertex along [`frame`].
    near: [f32; 2],
}

impl CellPoint {
    /// The point, on its facet's plane.
    pub fn place(&self, scene: RayScene<'_>) -> SurfacePoint {
        let facet = &scene.surfaces.facets[self.facet as usize];
        let ([u, v], [along, across]) = (self.near.map(f64::from), frame(facet.normal));
        SurfacePoint {
            facet: self.facet,
            point: facet.vertices[0] + along * u + across * v,
        }
    }
}

/// The cells of a scene as a camera sees it.
#[derive(Debug, Default)]
pub struct Cells {
    /// Sorted by cell.
    points: Vec<CellPoint>,
    /// Of each cell where its points begin, and the end of the last one's.
    starts: Vec<u32>,
    /// The cells that the rays of points meet, in their order, packed ([`Met`]), or [`DARK`]. Those beyond
    /// [`Cells::count`] are of the last generation and have no points.
    rays: Vec<u32>,
    /// Number of cells that the camera's rays end in, the first ones, and of their points.
    seen: usize,
    first: usize,
    /// Rays of a point of the first and of later generations.
    counts: [usize; 2],
    /// Reflectance of each cell.
    pub reflectances: Vec<[f32; 3]>,
}

/// Finds cells.
pub struct CellFinder<'a> {
    scene: RayScene<'a>,
    settings: CellSettings,
    table: HashMap<Key, u32, BuildHasherDefault<KeyHasher>>,
    /// Bounces since the camera's rays.
    generation: usize,
    /// Cells of earlier generations.
    known: usize,
    /// Which points this generation's cells keep.
    sample: SystematicSample,
    /// Of each cell of this generation the weight of the rays that asked for it.
    asked: Vec<u32>,
    /// Points of earlier generations, sorted by cell.
    points: Vec<CellPoint>,
    /// Points of this generation as they came.
    waiting: Vec<WaitingPoint>,
}

/// A point of a cell that may turn out to have enough of them.
struct WaitingPoint {
    cell: u32,
    /// As [`SystematicSample::rank`].
    rank: u8,
    point: CellPoint,
}

impl<'a> CellFinder<'a> {
    /// No cells yet.
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

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        self.table.capacity() * (size_of::<(Key, u32)>() + 1)
            + self.points.len() * size_of::<CellPoint>()
            + self.waiting.len() * size_of::<WaitingPoint>()
            + 4 * self.asked.len()
    }

    /// Cells so far.
    fn count(&self) -> usize {
        self.known + self.asked.len()
    }

    /// The cells of the ends of weighted rays, packed ([`Met`]), or [`DARK`]. A cell that is new in this generation gets
    /// its points from the rays that ask for it.
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

    /// All cells whose light reaches those that were asked for.
    ///
    /// # Errors
    /// On cancel, and where the cells do not fit into the budget.
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
                // What the camera's rays see of a place lies more in the open than what rays of cells
                // see of it, and is brighter: these have cells of their own.
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

    /// Sorts the points that this generation's cells keep by cell, in the order in which they came,
    /// adds to where those of each cell begin, and begins the next generation. Returns the indices
    /// of the sorted points, and the weight of the rays that asked for each of their cells.
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

    /// How many.
    pub fn count(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// A cell's points.
    pub fn points(&self, cell: usize) -> &[CellPoint] {
        &self.points[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The cells that a cell's rays meet, by their number among those that only rays of cells end in;
    /// `None` where no light comes from.
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

    /// Where the rays of a point begin.
    fn first_ray(&self, point: usize) -> usize {
        let ([first, later], of_first) = (self.counts, point.min(self.first));
        of_first * first + (point - of_first) * later
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        self.points.len() * size_of::<CellPoint>()
            + 4 * (self.rays.len() + self.starts.len())
            + 12 * self.reflectances.len()
    }

    /// Bytes that a bounce of patches takes meanwhile for each light.
    pub fn bounce_bytes(&self) -> usize {
        12 * self.count()
    }

    /// Bytes that light takes meanwhile for each light.
    pub fn light_bytes(&self) -> usize {
        16 * self.count() + 12 * (self.later() + self.later().max(self.seen))
    }

    /// How many cells only rays of cells end in.
    pub fn later(&self) -> usize {
        self.count() - self.seen
    }
}
