//! Exact direct light of moving heads at every moment, without tracing rays as they move.
//!
//! A head turns about a fixed point, whose visibility does not depend on the head's direction. Each
//! pixel is split by facet into places; each place stores, for each head, the irradiance of one
//! candela from there, shadows included. A frame multiplies that by the head's intensity towards
//! the place. Tiles of pixels that a beam misses are skipped. Light in haze is integrated for each
//! pose; while a head rests and fades, the last result serves. Surfaces seen in wide gloss belong to
//! the images of reflected light, not to these places. The distance between a real head's axes and
//! its lens is ignored.

#![allow(
    clippy::indexing_slicing,
    reason = "places belong to facets, pixels and heads of one scene"
)]

use crate::direct::beam::Beam;
use crate::direct::projector::{Projector, pixel as footprint, projector};
use crate::gather::airlight::Airlight;
use crate::gather::bvh::Bvh;
use crate::gather::emitter::Emitter;
use crate::gather::ray_scene::{DARK, RayScene, RayView, Receiver, SurfacePoint};
use crate::gather::sampling::{hash, point};
use crate::memory::MemoryBudget;
use crate::surfaces::FACET_BYTES;
use crate::surfaces::camera::{Camera, camera};
use crate::surfaces::surface::Surfaces;
use crate::threads::Threads;
use crate::{Setup, TransportError};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::{Vec3, vec3};
use footlight_show::model::Haze;
use footlight_stage::Light;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Samples of a pixel for which it and its neighbours show one facet that all heads light alike,
/// and of any other pixel. The few samples lie near the corners, so they miss no edge, and the mean
/// of their places is the centre.
const FEW: usize = 4;
const MANY: usize = 64;
/// Greatest width of a place seen from a head, relative to the head's narrowest field, within which
/// its light is nearly constant. Wider pixels are split.
const EVEN: f64 = 0.12;
/// Most parts of a pixel on one facet.
const MOST_PARTS: usize = 8;
/// Side of the tiles of pixels that are skipped together.
const TILE: usize = 8;
/// Nodes along a ray of sight in haze, as at quality step 1: a frame must be fast.
const NODES: usize = 8;
const SEED: u32 = 0x4ead;

/// A head at a moment: its position's index, its light in its pose, and its strength.
#[derive(Clone, Debug)]
pub struct HeadLight {
    /// Index of its position.
    pub head: usize,
    /// The light as a fixed one.
    pub light: Light,
    /// Factor on its light in each channel.
    pub strength: [f64; 3],
}

/// Position of a head, with its narrowest field angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hung {
    /// Metres.
    pub position: Vec3,
    /// Narrowest field angle, radians.
    pub field: f64,
}

/// The part of a facet's reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Look {
    /// The matt part, or everything.
    Matt,
    /// The highlights of lights.
    Gloss,
    /// Seen in this glossy facet.
    Mirrored(u32),
}

/// A part of a pixel on one facet.
#[derive(Clone, Copy, Debug)]
struct Place {
    pixel: u32,
    facet: u32,
    look: Look,
    /// Share of the pixel.
    share: f32,
    point: [f32; 3],
    reflectance: [f32; 3],
}

impl Place {
    fn point(&self) -> Vec3 {
        let [x, y, z] = self.point.map(f64::from);
        vec3(x, y, z)
    }
}

/// A sample of a pixel.
struct Seen {
    facet: u32,
    look: Look,
    point: Vec3,
    /// Path length from the eye, metres.
    length: f64,
    /// Opacity, less than 1 for translucent surfaces.
    share: f64,
    /// Irradiance of one candela from each head.
    lit: Vec<f64>,
    /// The heads that light it, one bit each.
    by: u64,
}

/// Extent of the samples of a facet.
fn extent(seen: &[Seen]) -> Vec3 {
    let Some(first) = seen.first() else {
        return Vec3::ZERO;
    };
    let ways = seen.iter().map(|seen| seen.point - first.point);
    ways.max_by(|a, b| a.dot(*a).total_cmp(&b.dot(*b)))
        .unwrap_or(Vec3::ZERO)
}

/// Number of parts into which the samples of a facet are split, so that the light of each head is
/// nearly constant in each.
fn parts(seen: &[Seen], heads: &[Hung]) -> usize {
    let width = extent(seen).length();
    let of = |(number, head): (usize, &Hung)| {
        let lit = seen.iter().find(|seen| seen.lit[number] > 0.0);
        let distance = lit.map_or(f64::INFINITY, |lit| (lit.point - head.position).length());
        (width / (distance * EVEN * head.field)).ceil() as usize
    };
    let most = heads.iter().enumerate().map(of).max().unwrap_or(1);
    most.clamp(1, MOST_PARTS.min(seen.len().max(1)))
}

/// Sorts samples along the longer side of their extent.
fn sort_along(seen: &mut [Seen], parts: usize) {
    if parts > 1 {
        let way = extent(seen);
        seen.sort_by(|a, b| a.point.dot(way).total_cmp(&b.point.dot(way)));
    }
}

/// A square of pixels.
#[derive(Clone, Debug, Default)]
struct Tile {
    places: Vec<Place>,
    /// For each head the radiance of each place at one candela and full reflectance.
    lit: Vec<Vec<f32>>,
    centre: Vec3,
    radius: f64,
}

/// A lit head with its beam, picture if it projects one, and strength.
type Lit<'a> = (&'a HeadLight, Beam, Option<Projector>, [f64; 3]);

/// Light of one candela in haze from a head in a pose.
struct Scattered {
    /// Index of its position.
    head: usize,
    /// The light in its pose.
    light: Light,
    /// Radiance of each pixel.
    seen: Vec<f32>,
}

impl Scattered {
    /// True for a head in the same pose.
    fn is_of(&self, light: &HeadLight) -> bool {
        self.head == light.head && self.light == light.light
    }
}

/// Places of a view, with the light of each head on them.
pub struct MovingLights {
    camera: Camera,
    size: [usize; 2],
    surfaces: Surfaces,
    bvh: Bvh,
    /// Row by row.
    tiles: Vec<Tile>,
    /// The last frame's: heads may rest in the next one.
    last: Mutex<Vec<Scattered>>,
}

impl std::fmt::Debug for MovingLights {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let tiles = self.tiles.len();
        f.debug_struct("MovingLights")
            .field("size", &self.size)
            .field("tiles", &tiles)
            .finish_non_exhaustive()
    }
}

impl MovingLights {
    /// Computes the places that each head can light.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable view or scene or too small a budget, and on cancel.
    pub fn new(
        setup: &Setup,
        heads: &[Hung],
        work: Work<'_>,
    ) -> Result<MovingLights, TransportError> {
        let Setup { scene, view, .. } = setup;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        let camera = camera(view)?;
        let each = size_of::<Place>() + 4 * heads.len();
        let pixels = view.width * view.height;
        budget.take("what moving lights light", 2 * each * pixels)?;
        Threads::new(work)?.install(|| {
            let bvh = Bvh::new(&surfaces, work)?;
            budget.take("the hierarchy of triangles", bvh.bytes())?;
            let mut out = MovingLights {
                camera,
                size: [view.width, view.height],
                surfaces,
                bvh,
                tiles: Vec::new(),
                last: Mutex::default(),
            };
            let [across, down] = out.size.map(|side| side.div_ceil(TILE));
            let middles = out.middles();
            let rows = (0..down).into_par_iter().map(|row| {
                work.check()?;
                let tile = |column| out.tile([column, row], &middles, heads);
                Ok::<Vec<Tile>, Cancelled>((0..across).map(tile).collect())
            });
            let rows: Vec<Vec<Tile>> = rows.collect::<Result<_, _>>()?;
            out.tiles = rows.into_iter().flatten().collect();
            Ok(out)
        })
    }

    /// Approximate bytes held.
    pub fn bytes(&self) -> usize {
        let of = |tile: &Tile| {
            size_of::<Tile>()
                + tile.places.len() * (size_of::<Place>() + size_of::<f32>() * tile.lit.len())
        };
        let last = self.last();
        let last = last.iter().map(|one| size_of_val(one.seen.as_slice()));
        self.bvh.bytes() + self.tiles.iter().map(of).sum::<usize>() + last.sum::<usize>()
    }

    fn scene(&self) -> RayScene<'_> {
        RayScene::new(&self.surfaces, &self.bvh)
    }

    /// Facet at the centre of each pixel.
    fn middles(&self) -> Vec<u32> {
        let [width, height] = self.size;
        let middle = |pixel: usize| {
            let [x, y] = [pixel % width, pixel / width].map(|at| at as f64 + 0.5);
            let way = self.camera.ray(x, y);
            self.scene().look(self.camera.origin, way).0.facet
        };
        (0..width * height).into_par_iter().map(middle).collect()
    }

    fn tile(&self, [column, row]: [usize; 2], middles: &[u32], heads: &[Hung]) -> Tile {
        let [width, height] = self.size;
        let mut tile = Tile {
            lit: vec![Vec::new(); heads.len()],
            ..Tile::default()
        };
        for y in row * TILE..height.min((row + 1) * TILE) {
            for x in column * TILE..width.min((column + 1) * TILE) {
                let around = |at: usize, most: usize| at.saturating_sub(1)..(at + 2).min(most);
                let own = middles[y * width + x];
                let mut near =
                    around(y, height).flat_map(|y| around(x, width).map(move |x| [x, y]));
                let is_plain = near.all(|[x, y]| middles[y * width + x] == own);
                let count = if is_plain { FEW } else { MANY };
                self.add_pixel([x, y], count, heads, &mut tile);
            }
        }
        let points = || tile.places.iter().map(Place::point);
        let sum = points().fold(Vec3::ZERO, |sum, p| sum + p);
        tile.centre = sum / points().count().max(1) as f64;
        let from_centre = points().map(|p| (p - tile.centre).length());
        tile.radius = from_centre.fold(0.0, f64::max);
        tile
    }

    /// Samples of a pixel at `count` places.
    fn samples(&self, [x, y]: [usize; 2], count: usize, heads: &[Hung]) -> Vec<Seen> {
        let scene = self.scene();
        let seed = hash((y * self.size[0] + x) as u32) ^ SEED;
        let mut seen = Vec::new();
        for k in 0..count {
            let [u, v] = match count {
                FEW => [k % 2, k / 2].map(|i| 0.04 + 0.92 * i as f64),
                _ => point(k as u32, seed),
            };
            let way = self.camera.ray(x as f64 + u, y as f64 + v);
            let random = point(k as u32, !seed);
            for view in scene.views((self.camera.origin, way), random, |l| !l.is_wide()) {
                self.add_view(view, heads, &mut seen);
            }
        }
        seen
    }

    /// Adds a facet seen by a ray: its matt part and its highlights separately.
    fn add_view(&self, view: RayView, heads: &[Hung], seen: &mut Vec<Seen>) {
        let RayView {
            place,
            mirror,
            share,
            length,
        } = view;
        let facet = &self.surfaces.facets[place.facet as usize];
        let receiver = Receiver::new(facet, place.point, self.scene().offset);
        let heads = heads.iter().map(|head| head.position);
        let lit = heads.clone().map(|p| share * self.irradiance(receiver, p));
        let lit: Vec<f64> = lit.collect();
        let mut push = |look, lit: Vec<f64>| {
            let lights = lit.iter().take(64).enumerate();
            let by = lights.fold(0, |by, (i, lit)| by | u64::from(*lit > 0.0) << i);
            seen.push(Seen {
                facet: place.facet,
                look,
                point: place.point,
                length,
                share,
                lit,
                by,
            });
        };
        let lobe = self.surfaces.lobe(place.facet);
        if mirror != DARK {
            return push(Look::Mirrored(mirror), lit);
        }
        let Some(lobe) = lobe else {
            return push(Look::Matt, lit);
        };
        let way = |to: Vec3| (to - place.point).normalized();
        let (normal, eye) = (receiver.normal, way(self.camera.origin));
        let times = |of: &dyn Fn(Vec3) -> f64| {
            let pairs = lit.iter().zip(heads.clone());
            pairs.map(|(lit, p)| lit * of(way(p))).collect()
        };
        push(
            Look::Matt,
            times(&|light| lobe.matt_from(normal.dot(light).max(0.0))),
        );
        push(
            Look::Gloss,
            times(&|light| PI * lobe.value(normal, eye, light)),
        );
    }

    /// Reflectance of a place in each channel.
    fn reflectance(&self, look: Look, facet: u32, point: Vec3, share: f64) -> [f64; 3] {
        let own = &self.surfaces.facets[facet as usize];
        let (surfaces, eye) = (&self.surfaces, self.camera.origin);
        match look {
            Look::Gloss => surfaces.tint(facet),
            Look::Mirrored(mirror) => {
                let tint = surfaces.tint(mirror);
                let found = surfaces.reflectance_at(own, point, || [Vec3::ZERO; 2]);
                [0, 1, 2].map(|c| found[c] * tint[c])
            }
            Look::Matt => surfaces.reflectance_to(eye, (own, point), || {
                footprint(&self.camera, point, own.normal, share)
            }),
        }
    }

    /// Adds the places of a pixel, from at least `count` samples.
    fn add_pixel(&self, [x, y]: [usize; 2], count: usize, heads: &[Hung], tile: &mut Tile) {
        let pixel = y * self.size[0] + x;
        let mut seen = self.samples([x, y], count, heads);
        let first = seen.first().map(|seen| (seen.facet, seen.by));
        let alike = |seen: &Seen| Some((seen.facet, seen.by)) == first && seen.share == 1.0;
        let is_plain = seen.is_empty()
            || seen.len() == FEW && seen.iter().all(alike) && parts(&seen, heads) == 1;
        let count = if count == FEW && !is_plain {
            seen = self.samples([x, y], MANY, heads);
            MANY
        } else {
            count
        };
        let count = count as f64;
        seen.sort_by_key(|seen| (seen.facet, seen.look));
        let facets = seen.chunk_by_mut(|a, b| (a.facet, a.look) == (b.facet, b.look));
        let even = facets.flat_map(|seen| {
            let parts = parts(seen, heads);
            sort_along(seen, parts);
            seen.chunks(seen.len().div_ceil(parts))
        });
        for seen in even {
            let share: f64 = seen.iter().map(|seen| seen.share).sum();
            let point = seen
                .iter()
                .fold(Vec3::ZERO, |sum, s| sum + s.point * s.share)
                / share;
            let share = share / count;
            let Seen { facet, look, .. } = seen[0];
            let reflectance = self.reflectance(look, facet, point, share);
            let length = seen.iter().map(|seen| seen.length).sum::<f64>() / seen.len() as f64;
            let clear = self.scene().clearness(length);
            tile.places.push(Place {
                pixel: pixel as u32,
                facet,
                look,
                share: share as f32,
                point: [point.x, point.y, point.z].map(|x| x as f32),
                reflectance: reflectance.map(|r| (r * clear / PI) as f32),
            });
            for (head, lit) in tile.lit.iter_mut().enumerate() {
                let sum: f64 = seen.iter().map(|seen| seen.lit[head]).sum();
                lit.push((sum / count) as f32);
            }
        }
    }

    /// Irradiance of one candela from a point.
    fn irradiance(&self, at: Receiver, position: Vec3) -> f64 {
        let d = position - at.point;
        let square = d.dot(d);
        let cosine = at.normal.dot(d);
        if cosine <= 0.0 || square == 0.0 || at.facet.dot(d) <= 0.0 {
            return 0.0;
        }
        let from = at.point + at.normal * self.scene().offset;
        let passed = self.scene().transmittance(from, position - from);
        passed * cosine / (square * square.sqrt())
    }

    /// Adds the direct light of heads, and their light in haze, to an image.
    ///
    /// # Errors
    /// On cancel.
    pub fn add(
        &self,
        lights: &[HeadLight],
        image: &mut Image,
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let is_lit = |light: &&HeadLight| light.strength.iter().any(|s| *s != 0.0);
        let beams: Vec<Lit<'_>> = lights
            .iter()
            .filter(is_lit)
            .filter_map(|light| {
                let strength = light.light.strength().0;
                let strength = [0, 1, 2].map(|c| strength[c] * light.strength[c]);
                let beam = Beam::of(&light.light)?;
                Some((light, beam, projector(&light.light), strength))
            })
            .collect();
        if beams.is_empty() || image.size() != (self.size[0], self.size[1]) {
            return Ok(());
        }
        let [width, _] = self.size;
        let across = width.div_ceil(TILE);
        let bands = image.data_mut().par_chunks_mut(3 * width * TILE);
        let bands = bands.zip(self.tiles.par_chunks(across)).enumerate();
        bands.try_for_each(|(row, (band, tiles))| {
            work.check()?;
            let start = row * TILE * width;
            for tile in tiles {
                for (light, beam, projector, strength) in &beams {
                    if beam.misses(tile.centre, tile.radius) {
                        continue;
                    }
                    let Some(lit) = tile.lit.get(light.head) else {
                        continue;
                    };
                    for (place, lit) in tile.places.iter().zip(lit) {
                        if *lit == 0.0 {
                            continue;
                        }
                        let point = place.point();
                        let mut light = f64::from(*lit) * beam.share(point - beam.position);
                        if light == 0.0 {
                            continue;
                        }
                        if let Some(projector) = projector {
                            let normal = self.surfaces.facets[place.facet as usize].normal;
                            let share = f64::from(place.share);
                            let sides = footprint(&self.camera, point, normal, share);
                            light *= projector.share(point, sides);
                        }
                        let at = 3 * (place.pixel as usize - start);
                        for c in 0..3 {
                            let reflected = f64::from(place.reflectance[c]);
                            band[at + c] += (light * strength[c] * reflected) as f32;
                        }
                    }
                }
            }
            Ok(())
        })?;
        let Some(haze) = self.surfaces.haze else {
            return Ok(());
        };
        let scattered = self.scattered(&beams, haze, work)?;
        for (light, .., strength) in &beams {
            let Some(one) = scattered.iter().find(|one| one.is_of(light)) else {
                continue;
            };
            let pixels = image.data_mut().chunks_exact_mut(3);
            for (pixel, seen) in pixels.zip(&one.seen) {
                for (value, strength) in pixel.iter_mut().zip(strength) {
                    *value += (strength * f64::from(*seen)) as f32;
                }
            }
        }
        *self.last() = scattered;
        Ok(())
    }

    fn last(&self) -> MutexGuard<'_, Vec<Scattered>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The light in haze of these heads. That of heads in the pose of the last frame is not computed
    /// again.
    fn scattered(
        &self,
        beams: &[Lit<'_>],
        haze: Haze,
        work: Work<'_>,
    ) -> Result<Vec<Scattered>, Cancelled> {
        let mut known = std::mem::take(&mut *self.last());
        known.retain(|one| beams.iter().any(|(light, ..)| one.is_of(light)));
        let is_new = |(light, ..): &&Lit<'_>| !known.iter().any(|one| one.is_of(light));
        let new: Vec<&Lit<'_>> = beams.iter().filter(is_new).collect();
        if new.is_empty() {
            return Ok(known);
        }
        let seen = self.airlight(&new, haze, work)?;
        known.extend(new.iter().enumerate().map(|(k, (light, ..))| Scattered {
            head: light.head,
            light: light.light.clone(),
            seen: seen.iter().skip(k).step_by(new.len()).copied().collect(),
        }));
        Ok(known)
    }

    /// Light of one candela in haze, for each pixel that of each beam.
    fn airlight(
        &self,
        beams: &[&Lit<'_>],
        haze: Haze,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let airlight = Airlight {
            scene: self.scene(),
            haze,
            nodes: NODES,
        };
        let [width, _] = self.size;
        let across = width.div_ceil(TILE);
        let ends = |pixel: usize| {
            let tile = pixel / width / TILE * across + pixel % width / TILE;
            let places = &self.tiles[tile].places;
            // Places of a tile are in the order of their pixels.
            let first = places.partition_point(|p| (p.pixel as usize) < pixel);
            let own = places[first..].iter();
            let own = own.take_while(move |p| p.pixel as usize == pixel);
            let own = own.filter(|p| p.look == Look::Matt);
            own.map(|place| {
                let (facet, point) = (place.facet, place.point());
                (place.share, SurfacePoint { facet, point })
            })
        };
        let emitters: Vec<Emitter<'_>> = beams
            .iter()
            .map(|(_, beam, projector, _)| Emitter::Point(beam, projector.as_ref()))
            .collect();
        airlight.picture(&emitters, (&self.camera, self.size), ends, work)
    }
}
