//! Direct light of moving heads, exact at every moment, without rays when they move.
//!
//! A head turns about a fixed point, so what that point sees does not depend on where the head points.
//! Each pixel is split by facet into places; each place keeps, for each head, the irradiance of one
//! candela from there, shadows included. A frame multiplies that by the intensity that the head throws
//! towards the place. Squares of pixels that a beam misses are left out as a whole. Light in the haze
//! is integrated anew for each frame. The distance between a real head's axes and its lens is left out.

#![allow(
    clippy::indexing_slicing,
    reason = "places belong to facets, pixels and heads of one scene"
)]

use crate::direct::beam::Beam;
use crate::direct::projector::{Projector, pixel as footprint, projector};
use crate::direct::{PreparedLight, prepared};
use crate::gather::airlight::Airlight;
use crate::gather::bvh::Bvh;
use crate::gather::emitter::{Emitter, Receiver};
use crate::gather::ray_scene::RayScene;
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
use footlight_stage::Light;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Samples of a pixel, where it and its neighbours show one facet and all heads light it alike, and else.
const FEW: u32 = 4;
const MANY: u32 = 32;
/// Side of the squares of pixels that are left out together.
const TILE: usize = 8;
/// Nodes along a ray of sight in haze, as at step 2.
const NODES: usize = 16;
const SEED: u32 = 0x4ead;

/// A head at a moment: its number among the positions, its light in its pose, and the strength of each
/// channel.
#[derive(Clone, Debug)]
pub struct HeadLight {
    /// Number of its position.
    pub head: usize,
    /// The light as a fixed one.
    pub light: Light,
    /// What its light is multiplied by.
    pub strength: [f64; 3],
}

/// A part of a pixel on one facet.
#[derive(Clone, Copy, Debug)]
struct Place {
    pixel: u32,
    facet: u32,
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

/// A square of pixels.
#[derive(Clone, Debug, Default)]
struct Tile {
    places: Vec<Place>,
    /// For each head the radiance of each place at one candela and full reflectance.
    lit: Vec<Vec<f32>>,
    centre: Vec3,
    radius: f64,
}

/// What some points of a view's scene light and see of it.
pub struct MovingLights {
    camera: Camera,
    size: [usize; 2],
    surfaces: Surfaces,
    bvh: Bvh,
    offset: f64,
    /// Row by row.
    tiles: Vec<Tile>,
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
    /// Finds what is lit from each of `positions`, metres.
    ///
    /// # Errors
    /// [`TransportError`] for a view or scene that cannot be used, a budget too small, or on cancel.
    pub fn new(
        setup: &Setup,
        positions: &[Vec3],
        work: Work<'_>,
    ) -> Result<MovingLights, TransportError> {
        let Setup { scene, view, .. } = setup;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        let camera = camera(view)?;
        let each = size_of::<Place>() + 4 * positions.len();
        let pixels = view.width * view.height;
        budget.take("what moving lights light", 2 * each * pixels)?;
        Threads::new(work)?.install(|| {
            let bvh = Bvh::new(&surfaces, work)?;
            budget.take("the hierarchy of triangles", bvh.bytes())?;
            let mut out = MovingLights {
                camera,
                size: [view.width, view.height],
                offset: 3.0 * surfaces.touching(),
                surfaces,
                bvh,
                tiles: Vec::new(),
            };
            let [across, down] = out.size.map(|side| side.div_ceil(TILE));
            let middles = out.middles();
            let rows = (0..down).into_par_iter().map(|row| {
                work.check()?;
                let tile = |column| out.tile([column, row], &middles, positions);
                Ok::<Vec<Tile>, Cancelled>((0..across).map(tile).collect())
            });
            let rows: Vec<Vec<Tile>> = rows.collect::<Result<_, _>>()?;
            out.tiles = rows.into_iter().flatten().collect();
            Ok(out)
        })
    }

    /// Bytes, about.
    pub fn bytes(&self) -> usize {
        let of = |tile: &Tile| {
            size_of::<Tile>()
                + tile.places.len() * (size_of::<Place>() + size_of::<f32>() * tile.lit.len())
        };
        self.bvh.bytes() + self.tiles.iter().map(of).sum::<usize>()
    }

    fn scene(&self) -> RayScene<'_> {
        RayScene {
            surfaces: &self.surfaces,
            bvh: &self.bvh,
            offset: self.offset,
        }
    }

    /// The facet in the middle of each pixel.
    fn middles(&self) -> Vec<u32> {
        let [width, height] = self.size;
        let middle = |pixel: usize| {
            let [x, y] = [pixel % width, pixel / width].map(|at| at as f64 + 0.5);
            let way = self.camera.ray(x, y);
            self.scene().look(self.camera.origin, way).0.facet
        };
        (0..width * height).into_par_iter().map(middle).collect()
    }

    fn tile(&self, [column, row]: [usize; 2], middles: &[u32], positions: &[Vec3]) -> Tile {
        let [width, height] = self.size;
        let mut tile = Tile {
            lit: vec![Vec::new(); positions.len()],
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
                self.add_pixel([x, y], count, positions, &mut tile);
            }
        }
        let points = || tile.places.iter().map(Place::point);
        let sum = points().fold(Vec3::ZERO, |sum, p| sum + p);
        tile.centre = sum / points().count().max(1) as f64;
        let from_centre = points().map(|p| (p - tile.centre).length());
        tile.radius = from_centre.fold(0.0, f64::max);
        tile
    }

    /// Adds the places of a pixel.
    fn add_pixel(&self, [x, y]: [usize; 2], mut count: u32, positions: &[Vec3], tile: &mut Tile) {
        struct Seen {
            facet: u32,
            point: Vec3,
            share: f64,
            /// For each head.
            lit: Vec<f64>,
            /// Bit by bit, which heads light it.
            by: u64,
        }
        let pixel = y * self.size[0] + x;
        let seed = hash(pixel as u32) ^ SEED;
        let scene = self.scene();
        let mut seen: Vec<Seen> = Vec::new();
        let mut k = 0;
        while k < count {
            let [u, v] = point(k, seed);
            let way = self.camera.ray(x as f64 + u, y as f64 + v);
            for (place, share) in scene.layers(self.camera.origin, way) {
                let facet = &self.surfaces.facets[place.facet as usize];
                let at = Receiver::new(facet, place.point, self.offset);
                let lit: Vec<f64> = positions
                    .iter()
                    .map(|position| share * self.from_point(at, *position))
                    .collect();
                let lights = lit.iter().take(64).enumerate();
                let by = lights.fold(0, |by, (i, lit)| by | u64::from(*lit > 0.0) << i);
                seen.push(Seen {
                    facet: place.facet,
                    point: place.point,
                    share,
                    lit,
                    by,
                });
            }
            k += 1;
            let is_plain = || {
                let first = seen.first().map(|seen| (seen.facet, seen.by));
                let alike = |seen: &Seen| Some((seen.facet, seen.by)) == first && seen.share == 1.0;
                seen.len() == k as usize && seen.iter().all(alike) || seen.is_empty()
            };
            if k == FEW && count == FEW && !is_plain() {
                count = MANY;
            }
        }
        seen.sort_by_key(|seen| seen.facet);
        for seen in seen.chunk_by(|a, b| a.facet == b.facet) {
            let share: f64 = seen.iter().map(|seen| seen.share).sum();
            let point = seen
                .iter()
                .fold(Vec3::ZERO, |sum, s| sum + s.point * s.share)
                / share;
            let share = share / f64::from(count);
            let facet = &self.surfaces.facets[seen[0].facet as usize];
            let sides = || footprint(&self.camera, point, facet.normal, share);
            let reflectance = self.surfaces.reflectance_at(facet, point, sides);
            let clear = scene.clearness((point - self.camera.origin).length());
            tile.places.push(Place {
                pixel: pixel as u32,
                facet: seen[0].facet,
                share: share as f32,
                point: [point.x, point.y, point.z].map(|x| x as f32),
                reflectance: reflectance.map(|r| (r * clear / PI) as f32),
            });
            for (head, lit) in tile.lit.iter_mut().enumerate() {
                let sum: f64 = seen.iter().map(|seen| seen.lit[head]).sum();
                lit.push((sum / f64::from(count)) as f32);
            }
        }
    }

    /// Irradiance of one candela from a point.
    fn from_point(&self, at: Receiver, position: Vec3) -> f64 {
        let d = position - at.point;
        let square = d.dot(d);
        let cosine = at.normal.dot(d);
        if cosine <= 0.0 || square == 0.0 || at.facet.dot(d) <= 0.0 {
            return 0.0;
        }
        let from = at.point + at.normal * self.offset;
        let passed = self.scene().transmittance(from, position - from);
        passed * cosine / (square * square.sqrt())
    }

    /// Adds the direct light of heads to an image, and their light in the haze.
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
        let beams: Vec<(usize, Beam, Option<Projector>, [f64; 3])> = lights
            .iter()
            .filter(is_lit)
            .filter_map(|light| {
                let strength = light.light.strength().0;
                let strength = [0, 1, 2].map(|c| strength[c] * light.strength[c]);
                let beam = match prepared(&light.light)? {
                    PreparedLight::Spot(beam) => beam,
                    PreparedLight::Panel(_) => return None,
                };
                Some((light.head, beam, projector(&light.light), strength))
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
                for (head, beam, projector, strength) in &beams {
                    if beam.misses(tile.centre, tile.radius) {
                        continue;
                    }
                    let Some(lit) = tile.lit.get(*head) else {
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
        let airlight = Airlight {
            scene: self.scene(),
            haze,
            nodes: NODES,
        };
        let ends = |pixel: usize| {
            let tile = pixel / width / TILE * across + pixel % width / TILE;
            let places = &self.tiles[tile].places;
            let own = places.iter().filter(move |p| p.pixel as usize == pixel);
            own.map(|place| (place.share, place.point()))
        };
        let emitters: Vec<Emitter<'_>> = beams
            .iter()
            .map(|(_, beam, projector, _)| Emitter::Point(beam, projector.as_ref()))
            .collect();
        let scattered = airlight.picture(&emitters, (&self.camera, self.size), ends, work)?;
        let pixels = image.data_mut().chunks_exact_mut(3);
        for (pixel, scattered) in pixels.zip(scattered.chunks_exact(emitters.len())) {
            for ((.., strength), scattered) in beams.iter().zip(scattered) {
                for (value, strength) in pixel.iter_mut().zip(strength) {
                    *value += (strength * f64::from(*scattered)) as f32;
                }
            }
        }
        Ok(())
    }
}
