//! Independent estimates of single pixels by path tracing, to measure the error of images.
//!
//! Paths share geometry, materials and light profiles with the operators, but none of their meshes,
//! cells, samples or filters. Each vertex of a path samples one light source, chosen by its
//! unoccluded contribution (next-event estimation; Kajiya, *The rendering equation*, 1986). The
//! bounces of narrow beams are sampled from the lamp, as in [`lamp_patches`](super::lamp_patches):
//! their patches are sources too, and a path counts the remainder of the kernel. The two halves of
//! the paths have independent random numbers, which separates noise from error.

use super::emitter::Emitter;
use super::lamp_patches::{KernelBounds, LampPatches, receiver_way};
use super::ray_scene::{DARK, RayScene, Receiver, SurfacePoint};
use super::sampling::{cosine_direction, hash, point};
use crate::direct::projector::{Projector, pixel as footprint, projector};
use crate::direct::{PreparedLight, check_rig, luminaires};
use crate::gather::airlight::{Airlight, Sight};
use crate::gather::bvh::Bvh;
use crate::memory::MemoryBudget;
use crate::surfaces::FACET_BYTES;
use crate::surfaces::camera::{Camera, camera};
use crate::surfaces::surface::Surfaces;
use crate::threads::Threads;
use crate::unit_lights::{first_equal, strengths_of};
use crate::{PixelEstimator, Setup, TransportError};
use footlight_host::work::Work;
use footlight_show::geometry::{Vec3, frame};
use footlight_stage::Rig;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Sources sampled at the first vertex of a path; later vertices sample one.
const FIRST_SOURCES: u32 = 8;
/// Most vertices of a path: later ones contribute less than a thousandth even between white walls.
const VERTICES: usize = 128;
/// Vertices after which paths continue by Russian roulette, with the surface's reflectance as
/// probability.
const CERTAIN: usize = 3;
/// Part of a pixel over which textures and projected images are averaged at the first vertex; the
/// paths themselves cover the pixel.
const POINT: f64 = 1.0 / 256.0;
/// Rays that measure the distances between surfaces.
const LENGTHS: usize = 256;

/// A scene prepared for path tracing.
pub struct PathEstimator {
    rig: Arc<Rig>,
    size: [usize; 2],
    camera: Camera,
    surfaces: Surfaces,
    bvh: Bvh,
    lights: Vec<PreparedLight>,
    projectors: Vec<Option<Projector>>,
    bounds: KernelBounds,
    /// For each light the patches of its bounces, computed on first use.
    patches: Vec<OnceLock<Vec<LampPatches>>>,
}

/// A light source of a vertex: a light (bounce 0) or the patches of one of its bounces.
struct PathSource<'a> {
    emitter: Emitter<'a>,
    light: usize,
    bounce: usize,
    strength: [f64; 3],
}

/// A vertex of a path after the first, for the remainder of the kernel.
struct Leg {
    place: Vec3,
    /// `cos cos' / r^2` of the ray that ends there.
    kernel: f64,
}

impl PathEstimator {
    /// Prepares a scene.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    pub fn new(setup: &Setup, work: Work<'_>) -> Result<PathEstimator, TransportError> {
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let camera = camera(view)?;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        let lights = luminaires(&surfaces, rig)?;
        let bvh = Threads::new(work)?.install(|| Bvh::new(&surfaces, work))?;
        budget.take("the hierarchy of triangles", bvh.bytes())?;
        let mut estimator = PathEstimator {
            rig: Arc::clone(rig),
            size: [view.width, view.height],
            camera,
            lights,
            projectors: rig.lights.iter().map(projector).collect(),
            bounds: KernelBounds { longest: 1.0 },
            patches: rig.lights.iter().map(|_| OnceLock::new()).collect(),
            surfaces,
            bvh,
        };
        estimator.bounds.longest = estimator.mean_length();
        Ok(estimator)
    }

    fn scene(&self) -> RayScene<'_> {
        RayScene::new(&self.surfaces, &self.bvh)
    }

    /// Mean length of rays that leave the visible surfaces.
    fn mean_length(&self) -> f64 {
        let length = |k: usize| {
            let [u, v] = point(k as u32, 0x91);
            let [x, y] = [u * self.size[0] as f64, v * self.size[1] as f64];
            let (place, _) = self.scene().look(self.camera.origin, self.camera.ray(x, y));
            let facet = self.surfaces.facets.get(place.facet as usize)?;
            let way = cosine_direction(facet.normal, point(k as u32, 0x92));
            let (_, distance) = self.scene().shoot(place, way);
            distance.is_finite().then_some(distance)
        };
        let lengths: Vec<f64> = (0..LENGTHS).filter_map(length).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        if mean > 0.0 {
            mean
        } else {
            self.surfaces.size.max(1.0)
        }
    }

    /// Patches of a light's bounces.
    fn patches(&self, light: usize) -> &[LampPatches] {
        self.patches[light].get_or_init(|| match &self.lights[light] {
            PreparedLight::Panel(_) => Vec::new(),
            PreparedLight::Spot(beam) => {
                let projector = self.projectors[light].as_ref();
                LampPatches::of_bounces(self.scene(), beam, projector, self.bounds)
            }
        })
    }

    /// All sources that emit under a setting.
    fn sources(&self, setting: &[f64]) -> Vec<PathSource<'_>> {
        let strengths = strengths_of(&self.rig, &first_equal(&self.rig.lights), setting);
        let mut sources = Vec::new();
        for (light, strength) in strengths.into_iter().enumerate() {
            if strength == [0.0; 3] {
                continue;
            }
            let projector = self.projectors[light].as_ref();
            let own = Emitter::in_parts(&self.surfaces, &self.lights[light], projector);
            let patches = self.patches(light).iter().map(Emitter::Patches).zip(1..);
            let emitters = own.into_iter().map(|part| (part, 0)).chain(patches);
            sources.extend(emitters.map(|(emitter, bounce)| PathSource {
                emitter,
                light,
                bounce,
                strength,
            }));
        }
        sources
    }

    /// Radiance along one path from a pixel. `seed` belongs to the pixel and half; `k` is the index
    /// of the path.
    fn path(&self, sources: &[PathSource<'_>], pixel: usize, k: u32, seed: u32) -> [f64; 3] {
        let scene = self.scene();
        let mut dimension = 0;
        let mut random = || {
            dimension += 1;
            point(k, hash(seed ^ dimension))
        };
        let [u, v] = random();
        let (x, y) = ((pixel % self.size[0]) as f64, (pixel / self.size[0]) as f64);
        let way = self.camera.ray(x + u, y + v);
        let (place, distance) = scene.look(self.camera.origin, way);
        let mut radiance = [0.0; 3];
        if let Some(facet) = self.surfaces.facets.get(place.facet as usize)
            && sources.iter().any(|s| s.emitter.is_of(facet.material))
        {
            return [f64::NAN; 3];
        }
        let length = distance * way.length();
        let nodes = 1;
        let airlight = self
            .surfaces
            .haze
            .map(|haze| Airlight { scene, haze, nodes });
        if let Some(airlight) = airlight {
            let own = (way, distance);
            for source in sources {
                let scattered =
                    self.scattered(&airlight, &source.emitter, ((x, y), own), &mut random);
                (0..3).for_each(|c| radiance[c] += scattered * source.strength[c]);
            }
        }
        let weight = [scene.clearness(length) / PI; 3];
        if let Some(lobe) = self.surfaces.lobe(place.facet)
            && let Some((way, share)) = scene.reflected(place, self.camera.origin, random())
        {
            let (end, distance) = scene.shoot(place, way);
            let mut weight = [0, 1, 2].map(|c| weight[c] * share * lobe.tint[c]);
            if let Some(airlight) = airlight {
                let sight = Sight {
                    eye: place.point,
                    way,
                    length: distance,
                    spread: POINT * self.camera.step_x,
                };
                for source in sources {
                    let found = airlight.sample(&source.emitter, &sight, [random(), random()]);
                    (0..3).for_each(|c| radiance[c] += PI * weight[c] * found * source.strength[c]);
                }
            }
            let clearness = scene.clearness(distance);
            weight.iter_mut().for_each(|weight| *weight *= clearness);
            if let Some(facet) = self.surfaces.facets.get(end.facet as usize) {
                // Every part of a panel has its material.
                let of_lights = sources.chunk_by(|a, b| a.light == b.light);
                let shines = |s: &&PathSource<'_>| s.emitter.is_of(facet.material);
                for source in of_lights.filter_map(|parts| parts.iter().find(shines)) {
                    (0..3).for_each(|c| radiance[c] += PI * weight[c] * source.strength[c]);
                }
            }
            let side = POINT * self.camera.step_x * (length + distance);
            self.walk(
                sources,
                (end, None),
                (weight, side),
                &mut radiance,
                &mut random,
            );
        }
        let seen = Some(self.camera.origin);
        self.walk(
            sources,
            (place, seen),
            (weight, 0.0),
            &mut radiance,
            &mut random,
        );
        radiance
    }

    /// Adds the light that surfaces reflect along a path from a place, seen directly or in a
    /// mirror.
    fn walk(
        &self,
        sources: &[PathSource<'_>],
        (mut place, mut eye): (SurfacePoint, Option<Vec3>),
        (mut weight, mut side): ([f64; 3], f64),
        radiance: &mut [f64; 3],
        mut random: impl FnMut() -> [f64; 2],
    ) {
        let scene = self.scene();
        let mut legs: Vec<Leg> = Vec::new();
        // Approximate unoccluded light of each source at a vertex.
        let mut expected = vec![0.0; sources.len()];
        for vertex in 0..VERTICES {
            if place.facet == DARK {
                break;
            }
            let facet = &self.surfaces.facets[place.facet as usize];
            let sides = || match eye {
                Some(_) => footprint(&self.camera, place.point, facet.normal, POINT),
                None => frame(facet.normal).map(|axis| axis * side),
            };
            let lobe = self.surfaces.lobe(place.facet);
            let reflectance = match eye {
                Some(eye) => self
                    .surfaces
                    .reflectance_to(eye, (facet, place.point), sides),
                None => self.surfaces.reflectance_at(facet, place.point, sides),
            };
            let at = Receiver::new(facet, place.point, self.scene().offset);
            let reflects =
                |emitter: &Emitter<'_>| emitter.reflectance(lobe, (at, eye), reflectance);
            let highest = reflectance.into_iter().fold(0.0, f64::max);
            let has_highlight = eye.is_some() && lobe.is_some();
            if highest == 0.0 && !has_highlight {
                break;
            }
            for (expected, source) in expected.iter_mut().zip(sources) {
                let strength = source.strength.into_iter().map(f64::abs).sum::<f64>();
                *expected = strength * source.emitter.expected(at);
                // The highlight may be that of one light among many.
                if has_highlight {
                    let reflected = reflects(&source.emitter);
                    *expected *= reflected.into_iter().fold(0.0, f64::max);
                }
            }
            let count = if vertex == 0 { FIRST_SOURCES } else { 1 };
            for _ in 0..count {
                let chances = (sources, expected.as_slice());
                let random = [random(), random()];
                let arrives = self.arrives(chances, (at, &reflects), &legs, sides, random);
                let share = 1.0 / f64::from(count);
                (0..3).for_each(|c| radiance[c] += share * weight[c] * arrives[c]);
            }
            (0..3).for_each(|c| weight[c] *= reflectance[c]);
            if vertex >= CERTAIN {
                let [chance, _] = random();
                if chance >= highest {
                    break;
                }
                (0..3).for_each(|c| weight[c] /= highest);
            }
            let (way, cosine) = receiver_way(at.normal, at.facet, random());
            let (next, distance) = scene.shoot(place, way);
            if let Some(other) = self.surfaces.facets.get(next.facet as usize) {
                legs.push(Leg {
                    place: next.point,
                    kernel: cosine * -way.dot(other.normal) / (distance * distance),
                });
            }
            let clearness = scene.clearness(distance);
            weight.iter_mut().for_each(|weight| *weight *= clearness);
            // Approximate area that a path of this spread represents.
            side = 0.05 * distance;
            (place, eye) = (next, None);
        }
    }

    /// Radiance that haze scatters to the eye along the path's own ray through a pixel, `own` with
    /// its distance; near a lamp, where light changes within the pixel, a mean with further rays.
    /// Their number is equal for all paths of a pixel, so that the mean has no bias.
    fn scattered(
        &self,
        airlight: &Airlight<'_>,
        emitter: &Emitter<'_>,
        ((x, y), own): ((f64, f64), (Vec3, f64)),
        mut random: impl FnMut() -> [f64; 2],
    ) -> f64 {
        let sight = |(way, distance): (Vec3, f64), spread: f64| Sight {
            eye: self.camera.origin,
            way: way.normalized(),
            length: distance * way.length(),
            spread: spread * self.camera.step_x,
        };
        let middle = sight((self.camera.ray(x + 0.5, y + 0.5), f64::INFINITY), 1.0);
        let count = airlight.rays_along_side(emitter, &middle);
        let mut sum = 0.0;
        for k in 0..count {
            let ray = if k == 0 {
                own
            } else {
                let [u, v] = random();
                let way = self.camera.ray(x + u, y + v);
                (way, self.scene().look(self.camera.origin, way).1)
            };
            sum += airlight.sample(emitter, &sight(ray, POINT), [random(), random()]);
        }
        sum / count as f64
    }

    /// Light of one source reflected by the last vertex of a path, times pi, divided by its
    /// probability, which is proportional to the expected light.
    fn arrives(
        &self,
        (sources, expected): (&[PathSource<'_>], &[f64]),
        (at, reflects): (Receiver, &impl Fn(&Emitter<'_>) -> [f64; 3]),
        legs: &[Leg],
        footprint: impl FnOnce() -> [Vec3; 2],
        [[which, _], random]: [[f64; 2]; 2],
    ) -> [f64; 3] {
        let all: f64 = expected.iter().sum();
        let mut left = which * all;
        let mut chosen = None;
        for (source, own) in sources.iter().zip(expected) {
            if *own > 0.0 {
                chosen = Some((source, *own));
                if left < *own {
                    break;
                }
                left -= own;
            }
        }
        let Some((source, own)) = chosen else {
            return [0.0; 3];
        };
        let rest = self.rest_of_kernels(source, legs);
        if rest == 0.0 {
            return [0.0; 3];
        }
        let emitter = &source.emitter;
        let sample = emitter.bounded_sample(self.scene(), at, footprint, random);
        let factor = rest * sample * all / own;
        let colour = source.emitter.colour(random).map(f64::from);
        let reflects = reflects(emitter);
        [0, 1, 2].map(|c| factor * reflects[c] * colour[c] * source.strength[c])
    }

    /// Share of the light carried by the path's last rays; patches carry the rest.
    fn rest_of_kernels(&self, source: &PathSource<'_>, legs: &[Leg]) -> f64 {
        let bounces = self.patches(source.light).iter().skip(source.bounce);
        let rests = bounces.zip(legs.iter().rev());
        rests
            .map(|(lamp, leg)| lamp.rest(leg.place, leg.kernel))
            .product()
    }
}

impl PixelEstimator for PathEstimator {
    fn estimate(
        &self,
        setting: &[f64],
        pixels: &[usize],
        paths: Range<u32>,
        work: Work<'_>,
    ) -> Result<Vec<[[f64; 3]; 2]>, TransportError> {
        let sources = self.sources(setting);
        let of = |pixel: &usize| {
            work.check()?;
            let half = |half: u32| {
                let seed = hash(hash(*pixel as u32) ^ half.wrapping_mul(0x9e37_79b9) ^ 0x5eed);
                let mut sum = [0.0; 3];
                for k in paths.clone() {
                    let radiance = self.path(&sources, *pixel, k, seed);
                    (0..3).for_each(|c| sum[c] += radiance[c]);
                }
                sum.map(|sum| sum / paths.len().max(1) as f64)
            };
            Ok([half(1), half(2)])
        };
        Threads::new(work)?.install(|| pixels.par_iter().map(of).collect())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::super::first_bounce::tests::{setup, wall};
    use super::*;
    use footlight_show::geometry::{View, vec3};
    use footlight_show::units::Rgb;
    use footlight_stage::{Emitter as Lamp, Gloss, Light, Material, Polygon, Scene, Source};

    /// A setup in which each light has its own source.
    fn with_sources(setup: &Setup) -> Setup {
        let source = |light| Source {
            name: format!("{light}"),
            emitters: vec![Lamp {
                light,
                filter: Rgb::WHITE,
            }],
        };
        let rig = Rig {
            sources: (0..setup.rig.lights.len()).map(source).collect(),
            lights: setup.rig.lights.clone(),
        };
        Setup::new(Arc::clone(&setup.scene), rig, setup.view.clone())
    }

    /// For each half, the mean over all pixels of the ratio of estimate to exact value.
    fn ratio(setup: &Setup, setting: &[f64], paths: u32, exact: impl Fn(usize) -> f64) -> [f64; 2] {
        let estimator = PathEstimator::new(setup, Work::silent()).unwrap();
        let pixels: Vec<usize> = (0..setup.view.width * setup.view.height).collect();
        let found = estimator.estimate(setting, &pixels, 0..paths, Work::silent());
        let found = found.unwrap();
        [0, 1].map(|half| {
            let of = |(pixel, halves): (&usize, &[[f64; 3]; 2])| halves[half][0] / exact(*pixel);
            pixels.iter().zip(&found).map(of).sum::<f64>() / pixels.len() as f64
        })
    }

    #[test]
    fn the_first_bounce_of_a_narrow_beam_is_that_of_a_point() {
        let setup = with_sources(&setup());
        let exact = |pixel: usize| wall(pixel % 24, pixel / 24)[0];
        for ratio in ratio(&setup, &[1.0, 0.0], 64, exact) {
            assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
        }
    }

    /// In a closed cube whose walls emit and reflect the share r, light of 1 / (1 - r) arrives from
    /// all sides; a small card inside reflects its share of that.
    fn furnace(card: Material) -> Setup {
        let quad = |material, corners: [[f64; 3]; 4]| {
            let corners = corners.map(|[x, y, z]| vec3(x, y, z));
            Polygon::new(corners.to_vec(), material)
        };
        let scene = Scene {
            materials: vec![Material::diffuse("wall", Rgb([0.6; 3])), card],
            polygons: vec![
                quad(0, [[0., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]]),
                quad(0, [[0., 0., 2.], [0., 2., 2.], [2., 2., 2.], [2., 0., 2.]]),
                quad(0, [[0., 0., 0.], [0., 0., 2.], [2., 0., 2.], [2., 0., 0.]]),
                quad(0, [[0., 2., 0.], [2., 2., 0.], [2., 2., 2.], [0., 2., 2.]]),
                quad(0, [[0., 0., 0.], [0., 2., 0.], [0., 2., 2.], [0., 0., 2.]]),
                quad(0, [[2., 0., 0.], [2., 0., 2.], [2., 2., 2.], [2., 2., 0.]]),
                quad(
                    1,
                    [
                        [0.99, 0.99, 1.],
                        [1.01, 0.99, 1.],
                        [1.01, 1.01, 1.],
                        [0.99, 1.01, 1.],
                    ],
                ),
            ],
            ..Scene::default()
        };
        let rig = Rig {
            lights: vec![Light::Panel {
                material: 0,
                radiance: Rgb::WHITE,
            }],
            sources: Vec::new(),
        };
        let view = View {
            from: vec3(1.0, 0.99, 1.05),
            to: vec3(1.0, 1.0, 1.0),
            fov: 10.0,
            width: 16,
            height: 12,
            roll: 0.0,
        };
        with_sources(&Setup::new(scene, rig, view))
    }

    #[test]
    fn a_furnace_is_even() {
        let matt = Material::diffuse("card", Rgb([0.5; 3]));
        // The walls are one panel of several facets.
        let mirror = Material {
            gloss: Some(Gloss {
                normal: Rgb([0.5; 3]),
                roughness: 0.0,
                is_metal: true,
            }),
            ..Material::diffuse("card", Rgb([0.0; 3]))
        };
        for card in [matt, mirror] {
            for ratio in ratio(&furnace(card), &[1.0], 64, |_| 0.5 / (1.0 - 0.6)) {
                assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
            }
        }
    }

    #[test]
    fn estimates_do_not_depend_on_threads_or_on_other_pixels() {
        let setup = with_sources(&setup());
        let estimate = |pixels: &[usize], threads| {
            let work = Work {
                threads,
                ..Work::silent()
            };
            let estimator = PathEstimator::new(&setup, work).unwrap();
            estimator.estimate(&[1.0, 1.0], pixels, 0..8, work).unwrap()
        };
        let alone = estimate(&[40], 1);
        assert_eq!(alone[0], estimate(&[7, 40], 2)[1]);
        assert_ne!(alone[0][0], alone[0][1]);
    }
}
