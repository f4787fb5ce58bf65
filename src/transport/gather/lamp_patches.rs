//! Patches: places lit by a point source, found by rays from the lamp.
//!
//! Few of a pixel's rays hit the small area that a narrow beam lights. Rays from the lamp find it
//! at once: they carry equal flux, and their hits are resampled to patches of equal reflected flux.
//! A receiver takes the lamp's first bounce from patches by shadow rays, with the kernel `G = cos
//! cos' / r^2` bounded by `b`. The remainder of `G` is left to the receiver's own rays, which count
//! the lamp's light at their ends with the weight `(1 - b / G)+`. The sum is unbiased (Kollig and
//! Keller, *Illumination in the presence of weak singularities*, 2004).
//!
//! Patches depend on the lamp and the scene alone, not on levels or other lights.

use crate::direct::beam::Beam;
use crate::direct::projector::Projector;
use crate::gather::ray_scene::{DARK, RayScene, Receiver};
use crate::gather::sampling::{cosine_direction, morton, point};
use footlight_show::geometry::{Vec3, frame};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Rings of the lamp's cone, and sectors per ring, at which its intensity is evaluated.
const RINGS: usize = 256;
/// Rings and rays for the test whether a lamp needs patches.
const FEW: [usize; 2] = [64, 1 << 10];
/// Rays of a lamp, and patches; few enough for the processor's cache.
const RAYS: usize = 1 << 14;
const PATCHES: usize = 1 << 12;
/// Length below which rays carry the light of a patch, in radii of the beam there.
const NEAR: f64 = 2.0;
/// Greatest factor by which a shading normal changes the flux that a surface receives.
const MOST_SHADING: f64 = 4.0;
/// Most bounces of a lamp that have patches.
pub const MOST_BOUNCES: usize = 2;
/// Rows and columns of the strata of directions in which a group of patches sends rays.
const STRATA: usize = 32;
/// Seeds of the point sequences.
const SEED: u32 = 0x1a3;
const SEED_PATCH: u32 = 0x2b4;

/// Bounds `b` of the kernel `cos cos' / r^2`: bound `i` is the kernel at the length `longest /
/// 2^i`.
///
/// Rays are traced before lights are known. A ray therefore stores the number of bounds that its
/// kernel passes; each patch has the bound that suits the size of the beam there.
#[derive(Clone, Copy, Debug)]
pub struct KernelBounds {
    /// Metres.
    pub longest: f64,
}

impl KernelBounds {
    /// Bits of the number of passed bounds.
    const BITS: u32 = 4;
    pub const MOST: u32 = (1 << KernelBounds::BITS) - 1;

    /// Number of bounds that a ray with this kernel passes; it passes bound `b` with the
    /// probability `(1 - b / G)+`.
    pub fn passed(self, kernel: f64, random: f64) -> u32 {
        let passed = kernel * (1.0 - random) * self.longest * self.longest;
        if passed > 1.0 {
            ((0.5 * passed.log2()) as u32 + 1).min(KernelBounds::MOST)
        } else {
            0
        }
    }

    /// Index of the bound for a beam of this radius, metres.
    fn index(self, radius: f64) -> u32 {
        let halvings = (self.longest / (NEAR * radius)).log2().round();
        halvings.clamp(0.0, f64::from(KernelBounds::MOST - 1)) as u32
    }

    /// The bound with this index, 1/m².
    fn bound(self, index: u32) -> f64 {
        f64::from(1 << index).powi(2) / (self.longest * self.longest)
    }
}

/// The cell in which a ray ends and the number of bounds that it passes, packed in one number.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Index of the cell.
    pub cell: usize,
    /// See [`KernelBounds::passed`].
    pub passed: u32,
}

impl Met {
    /// Packs the index of a cell, below 2^28.
    pub fn pack(cell: u32, passed: u32) -> u32 {
        cell << KernelBounds::BITS | passed
    }

    /// Unpacks; `None` when the ray meets no light ([`DARK`]).
    pub fn unpack(met: u32) -> Option<Met> {
        (met != DARK).then_some(Met {
            cell: (met >> KernelBounds::BITS) as usize,
            passed: met & KernelBounds::MOST,
        })
    }

    /// True when two packed rays end in the same cell.
    pub fn is_same_cell(a: &u32, b: &u32) -> bool {
        a >> KernelBounds::BITS == b >> KernelBounds::BITS
    }
}

/// Cosine by which a receiver weights light from direction `way`, that is the density of its rays
/// times pi. Rays are distributed about the shading normal; those below the facet are mirrored.
fn receiver_cosine(normal: Vec3, facet: Vec3, way: Vec3) -> f64 {
    let height = way.dot(facet);
    if height <= 0.0 {
        return 0.0;
    }
    let mirrored = way - facet * (2.0 * height);
    way.dot(normal).max(0.0) + mirrored.dot(normal).max(0.0)
}

/// A direction in which a receiver sends a ray, and its [`receiver_cosine`].
pub fn receiver_way(normal: Vec3, facet: Vec3, random: [f64; 2]) -> (Vec3, f64) {
    let mut way = cosine_direction(normal, random);
    let height = way.dot(facet);
    if height < 0.0 {
        // A ray below the facet is replaced by its mirror image.
        way = way - facet * (2.0 * height);
    }
    (way, receiver_cosine(normal, facet, way))
}

/// One lit place.
#[derive(Clone, Copy, Debug)]
struct Patch {
    point: Vec3,
    normal: Vec3,
    /// Reflected flux in each channel, relative to the highest channel.
    colour: [f32; 3],
    /// Index of the patch's bound.
    bound: u32,
}

impl Patch {
    /// The place that a lamp's ray hits and the share of its flux reflected there, in the highest
    /// channel. `side` is the width of the ray at a distance of 1 m.
    fn lit(
        scene: RayScene<'_>,
        (start, way): (Vec3, Vec3),
        side: f64,
        colour: [f32; 3],
    ) -> Option<(Patch, f64)> {
        let (place, distance) = scene.look(start, way);
        let facet = scene.surfaces.facets.get(place.facet as usize)?;
        // The ray covers this part of a texture.
        let sides = || frame(facet.normal).map(|axis| axis * (side * distance));
        let reflectance = scene.surfaces.reflectance_at(facet, place.point, sides);
        let lobe = scene.surfaces.lobe(place.facet);
        let bounced = lobe.map_or(1.0, |lobe| lobe.bounced(-facet.normal.dot(way)));
        let channel = |k: usize| f64::from(colour[k]) * bounced * reflectance[k];
        let most = channel(0).max(channel(1)).max(channel(2));
        // Irradiance depends on the shading normal, the ray's flux on the facet.
        let flat = -facet.normal.dot(way);
        let shaded = -facet.normal_at(place.point).dot(way);
        let shading = (shaded.max(0.0) / flat.max(1e-6)).min(MOST_SHADING);
        let patch = Patch {
            point: place.point,
            normal: facet.normal,
            colour: [0, 1, 2].map(|k| (channel(k) / most) as f32),
            bound: 0,
        };
        (most > 0.0).then_some((patch, shading * most * scene.clearness(distance)))
    }
}

/// Patches of one bounce of a lamp of unit intensity, all of equal reflected flux, in an order that
/// keeps neighbours together.
#[derive(Clone, Debug)]
pub struct LampPatches {
    patches: Vec<Patch>,
    /// Reflected flux of all patches, each in its highest channel, divided by pi.
    radiance_area: f64,
    /// Origin of the light: the lamp, or the centre of the patches of the preceding bounce.
    position: Vec3,
    /// Radius of the beam at a distance of 1 m.
    spread: f64,
    bounds: KernelBounds,
}

impl LampPatches {
    /// Patches of a lamp that needs them, by bounce: the first, and later ones where these need
    /// patches too, for example when a lamp lights an object close to a wall.
    pub fn of_bounces(
        scene: RayScene<'_>,
        beam: &Beam,
        projector: Option<&Projector>,
        bounds: KernelBounds,
    ) -> Vec<LampPatches> {
        // A few rays identify most lamps that need no patches.
        if !LampPatches::first(scene, beam, projector, bounds, FEW).are_needed() {
            return Vec::new();
        }
        let first = LampPatches::first(scene, beam, projector, bounds, [RINGS, RAYS]);
        let mut bounces = vec![first];
        while bounces.len() < MOST_BOUNCES
            && let Some(last) = bounces.last()
            && let later = last.reflected(scene)
            && later.are_needed()
        {
            bounces.push(later);
        }
        bounces
    }

    /// Traces rays of the lamp, whose intensity is evaluated on rings.
    fn first(
        scene: RayScene<'_>,
        beam: &Beam,
        projector: Option<&Projector>,
        bounds: KernelBounds,
        [rings, rays]: [usize; 2],
    ) -> LampPatches {
        let Directions { ways, flux, spread } = Directions::new(beam, projector, rings, rays);
        let lit = |way: &Vec3| {
            let side = spread / (rays as f64).sqrt();
            let (patch, reflected) = Patch::lit(scene, (beam.position, *way), side, [1.0; 3])?;
            Some((patch, flux / rays as f64 * reflected))
        };
        let lit = ways.par_iter().map(lit).collect();
        LampPatches::new(lit, beam.position, spread, bounds)
    }

    /// Patches of the next bounce, found by cosine-weighted rays from these patches.
    fn reflected(&self, scene: RayScene<'_>) -> LampPatches {
        let strata = along_morton(STRATA);
        let together = self.patches.len() * strata.len() / RAYS;
        let lit = |ray: usize| {
            let (group, [i, j]) = (ray / strata.len(), strata[ray % strata.len()]);
            let ([u, v], [w, _]) = (point(ray as u32, SEED), point(ray as u32, SEED_PATCH));
            let from = self
                .patches
                .get(((group as f64 + w) * together as f64) as usize)?;
            let place = [i as f64 + u, j as f64 + v].map(|x| x / STRATA as f64);
            let way = cosine_direction(from.normal, place);
            let start = from.point + from.normal * scene.offset;
            let side = 1.0 / STRATA as f64;
            let (patch, reflected) = Patch::lit(scene, (start, way), side, from.colour)?;
            Some((patch, PI * self.radiance_area / RAYS as f64 * reflected))
        };
        let lit = (0..RAYS).into_par_iter().map(lit).collect();
        let sum = self.patches.iter().fold(Vec3::ZERO, |sum, p| sum + p.point);
        let middle = sum * (1.0 / self.patches.len().max(1) as f64);
        LampPatches::new(lit, middle, 1.0, self.bounds)
    }

    /// Resamples lit places by their reflected flux.
    fn new(
        lit: Vec<Option<(Patch, f64)>>,
        position: Vec3,
        spread: f64,
        bounds: KernelBounds,
    ) -> LampPatches {
        let (lit, fluxes): (Vec<Patch>, Vec<f64>) = lit.into_iter().flatten().unzip();
        let patch = |at: usize| Patch {
            bound: bounds.index(spread * (lit[at].point - position).length()),
            ..lit[at]
        };
        LampPatches {
            patches: resample(&fluxes, PATCHES).map(patch).collect(),
            radiance_area: fluxes.iter().sum::<f64>() / PI,
            position,
            spread,
            bounds,
        }
    }

    /// True when rays find too little of the light: a tenth or more of it falls on places that are
    /// small relative to the length of rays.
    fn are_needed(&self) -> bool {
        let small = self.patches.iter().filter(|patch| patch.bound > 1);
        10 * small.count() > self.patches.len()
    }

    /// Index of the bound at a place.
    fn index(&self, place: Vec3) -> u32 {
        let distance = (place - self.position).length();
        self.bounds.index(self.spread * distance)
    }

    /// True when a ray to `place` that passes this many bounds counts the lamp's light there.
    pub fn counts(&self, place: Vec3, passed: u32) -> bool {
        passed > 0 && passed > self.index(place)
    }

    /// Share `(1 - b / G)+` of the kernel of a ray to `place` that patches leave to the ray.
    pub fn rest(&self, place: Vec3, kernel: f64) -> f64 {
        let bound = self.bounds.bound(self.index(place));
        (1.0 - bound / kernel).max(0.0)
    }

    /// Approximate irradiance at a place from all patches, without shadows and cosines.
    pub fn expected(&self, place: Vec3) -> f64 {
        let Some(patch) = self.patch(0.5) else {
            return 0.0;
        };
        let square = (place - patch.point).dot(place - patch.point);
        self.radiance_area / (square + 1.0 / self.bounds.bound(patch.bound))
    }

    fn patch(&self, random: f64) -> Option<&Patch> {
        let at = random * self.patches.len() as f64;
        self.patches.get(at as usize)
    }

    /// Colour of the patch that `random`, 0 to 1, selects.
    pub fn colour(&self, random: f64) -> [f32; 3] {
        self.patch(random).map_or([0.0; 3], |patch| patch.colour)
    }

    /// Visible irradiance from the patch that `random` selects, scaled to the flux of all patches
    /// in its highest channel, with the bounded kernel.
    pub fn irradiance(&self, scene: RayScene<'_>, at: Receiver, random: f64) -> f64 {
        let Some(patch) = self.patch(random) else {
            return 0.0;
        };
        let to = patch.point - at.point;
        let square = to.dot(to);
        let away = -to.dot(patch.normal);
        if away <= 0.0 || square == 0.0 {
            return 0.0;
        }
        let cosine = receiver_cosine(at.normal, at.facet, to);
        let end = (patch.point, patch.normal);
        if cosine <= 0.0 {
            return 0.0;
        }
        let kernel = cosine * away / (square * square);
        let visible = scene.visibility((at.point, at.facet), end);
        visible * self.radiance_area * kernel.min(self.bounds.bound(patch.bound))
    }
}

/// Systematic resampling: indices of approximately `count` items, each repeated in proportion to
/// its weight.
fn resample(weights: &[f64], count: usize) -> impl Iterator<Item = usize> + '_ {
    let each = weights.iter().sum::<f64>() / count as f64;
    let (mut sum, mut taken) = (0.0, 0);
    weights.iter().enumerate().flat_map(move |(at, weight)| {
        sum += weight;
        let before = taken;
        while taken < count && (taken as f64 + 0.5) * each < sum {
            taken += 1;
        }
        std::iter::repeat_n(at, taken - before)
    })
}

/// Cells of a square of `side` rows and columns along a Morton curve.
fn along_morton(side: usize) -> Vec<[usize; 2]> {
    let cells = 0..side * side;
    let mut cells: Vec<[usize; 2]> = cells.map(|at| [at / side, at % side]).collect();
    cells.sort_unstable_by_key(|[i, j]| morton(*i, *j));
    cells
}

/// Directions of equal flux.
struct Directions {
    ways: Vec<Vec3>,
    /// Lumens of a lamp of unit intensity.
    flux: f64,
    /// Radius of the beam at a distance of 1 m: that of a round uniform beam with the same flux and
    /// the same sum of squares.
    spread: f64,
}

impl Directions {
    /// Evaluates the intensity on rings and sectors along a Morton curve, and distributes rays.
    fn new(beam: &Beam, projector: Option<&Projector>, rings: usize, rays: usize) -> Directions {
        let [right, up] = frame(beam.axis);
        let (ring, sector) = (beam.reach() / rings as f64, TAU / rings as f64);
        let way = |i: f64, j: f64| {
            let ((sin, cos), (y, x)) = ((i * ring).sin_cos(), (j * sector).sin_cos());
            (right * x + up * y) * sin + beam.axis * cos
        };
        let cells = along_morton(rings);
        let solid_angle = |i: usize| {
            let [inner, outer] = [i, i + 1].map(|i| (i as f64 * ring).cos());
            (inner - outer) * sector
        };

        // Flux of each cell.
        let flux = |&[cell_i, cell_j]: &[usize; 2]| {
            let (i, j) = (cell_i as f64 + 0.5, cell_j as f64 + 0.5);
            let to = way(i, j);
            let mut intensity = beam.share(to);
            if let Some(projector) = projector.filter(|_| intensity > 0.0) {
                let outwards = way(i + 0.5, j) - way(i - 0.5, j);
                let around = way(i, j + 0.5) - way(i, j - 0.5);
                intensity *= projector.share(beam.position + to, [outwards, around]);
            }
            intensity * solid_angle(cell_i)
        };
        let fluxes: Vec<f64> = cells.par_iter().map(flux).collect();
        let total: f64 = fluxes.iter().sum();

        // Solid angle of the equivalent uniform beam.
        let square = |([i, _], flux): (&[usize; 2], &f64)| flux * flux / solid_angle(*i);
        let squares: f64 = cells.iter().zip(&fluxes).map(square).sum();
        let even = total * total / squares.max(f64::MIN_POSITIVE);

        let place = |(ray, cell): (usize, usize)| {
            let ([i, j], [u, v]) = (cells[cell], point(ray as u32, SEED));
            way(i as f64 + u, j as f64 + v)
        };
        Directions {
            ways: resample(&fluxes, rays).enumerate().map(place).collect(),
            flux: total,
            spread: (even / PI).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::gather::bvh::Bvh;
    use crate::surfaces::surface::Surfaces;
    use footlight_host::work::Work;
    use footlight_show::geometry::profile::Profile;
    use footlight_show::geometry::vec3;
    use footlight_show::model::Spot;
    use footlight_show::units::Rgb;

    fn spot(beam: f64, field: f64) -> Beam {
        Beam::new(&Spot {
            position: vec3(0.0, 0.0, 4.0),
            aim: Vec3::ZERO,
            beam,
            field,
            intensity: Rgb::WHITE,
        })
        .unwrap()
    }

    /// Mean irradiance at a place that faces `normal`, from patches on these polygons of
    /// reflectance 1/2: by the first bounce of the beam and by the second.
    fn of_bounces(beam: &Beam, polygons: Vec<Vec<Vec3>>, point: Vec3, normal: Vec3) -> [f64; 2] {
        let surfaces = Surfaces::grey(polygons);
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        let scene = RayScene {
            surfaces: &surfaces,
            bvh: &bvh,
            offset: 1e-6,
        };
        let bounds = KernelBounds { longest: 0.01 };
        let first = LampPatches::first(scene, beam, None, bounds, [RINGS, RAYS]);
        let at = Receiver {
            point,
            normal,
            facet: normal,
        };
        let count = 1 << 14;
        let random = |k: u32| (f64::from(k) + 0.5) / f64::from(count);
        let second = first.reflected(scene);
        [first, second].map(|lamp| {
            let irradiance = |k| lamp.irradiance(scene, at, random(k));
            (0..count).map(irradiance).sum::<f64>() / f64::from(count)
        })
    }

    fn square(half: f64, height: f64) -> Vec<Vec3> {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        corners
            .map(|(x, y)| vec3(half * x, half * y, height))
            .to_vec()
    }

    /// Irradiance at `height` on the beam's axis, looking down, from a large floor of reflectance
    /// 1/2: integral over rings of the floor, and mean over the patches.
    fn both(beam: &Beam, height: f64) -> [f64; 2] {
        let down = vec3(0.0, 0.0, -1.0);
        let [found, _] = of_bounces(beam, vec![square(9.0, 0.0)], vec3(0.0, 0.0, height), down);
        let rings = 4000;
        let ring = |i: u32| {
            let width = 4.0 * beam.reach().tan() / f64::from(rings);
            let radius = (f64::from(i) + 0.5) * width;
            let place = vec3(radius, 0.0, 0.0);
            let radiance = 0.5 / PI * beam.irradiance(place, -down);
            radiance * TAU * radius * width * (height / (height * height + radius * radius)).powi(2)
        };
        [(0..rings).map(ring).sum(), found]
    }

    /// A beam falls on one point of a large floor below a large ceiling, and the floor receives the
    /// second bounce from the ceiling. With `s = h^2 + x^2`, the integral of `flux r^2 h^2 / (pi^2
    /// s^2) h^2 / s^2` over the ceiling is `flux r^2 / (3 pi h^2)`.
    #[test]
    fn patches_of_the_second_bounce_meet_the_closed_form() {
        let beam = spot(0.2, 0.4);
        let mut ceiling = square(60.0, 5.0);
        ceiling.reverse();
        let polygons = vec![square(60.0, 0.0), ceiling];
        let [_, found] = of_bounces(&beam, polygons, Vec3::ZERO, vec3(0.0, 0.0, 1.0));
        let flux = Profile::new(0.2, 0.4).unwrap().flux();
        let exact = flux * 0.25 / (3.0 * PI * 5.0 * 5.0);
        assert!((found / exact - 1.0).abs() < 1e-2, "{found} {exact}");
    }

    #[test]
    fn patches_meet_the_integral_over_the_lit_place() {
        for (beam, field) in [(2.0, 4.0), (10.0, 18.0), (30.0, 50.0)] {
            for height in [0.5, 1.0, 4.0] {
                let [exact, found] = both(&spot(beam, field), height);
                let error = (found / exact - 1.0).abs();
                assert!(error < 1e-2, "{beam} {height}: {found} {exact}");
            }
        }
    }

    /// Bound and remainder add up to the kernel for each bound.
    #[test]
    fn rays_count_what_patches_leave() {
        let bounds = KernelBounds { longest: 3.0 };
        for kernel in [0.01, 0.2, 3.0, 70.0] {
            for index in 0..6 {
                let b = bounds.bound(index);
                let passes = |k: &u32| {
                    let random = (f64::from(*k) + 0.5) / 4096.0;
                    bounds.passed(kernel, random) > index
                };
                let share = (0..4096).filter(passes).count() as f64 / 4096.0;
                let whole = kernel.min(b) + share * kernel;
                assert!((whole / kernel - 1.0).abs() < 1e-3, "{kernel} {b}");
            }
        }
    }

    #[test]
    fn rays_to_cells_are_packed() {
        let met = Met::unpack(Met::pack(77, 3)).unwrap();
        assert_eq!((met.cell, met.passed), (77, 3));
        assert!(Met::unpack(DARK).is_none());
    }

    #[test]
    fn items_are_resampled_by_weight() {
        let taken: Vec<usize> = resample(&[1.0, 0.0, 2.0, 1.0], 8).collect();
        assert_eq!(taken, [0, 0, 2, 2, 2, 2, 3, 3]);
        assert_eq!(resample(&[0.0; 3], 8).count(), 0);
    }
}
