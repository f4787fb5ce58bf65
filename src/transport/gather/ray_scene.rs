//! Ends of rays in a scene, and the sheets that they pass.
//!
//! This module does not depend on lights.

use crate::gather::bvh::{Bvh, Hit};
use crate::surfaces::facet::Facet;
use crate::surfaces::lobe::Lobe;
use crate::surfaces::surface::Surfaces;
use arrayvec::ArrayVec;
use footlight_show::geometry::Vec3;

/// A lit point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Metres.
    pub point: Vec3,
    /// Unit shading normal.
    pub normal: Vec3,
    /// Unit normal of the facet: no light arrives from below its plane.
    pub facet: Vec3,
}

impl Receiver {
    /// A point of a facet; on a facet with varying shading normals it is raised by `offset`,
    /// metres.
    pub fn new(facet: &Facet, point: Vec3, offset: f64) -> Receiver {
        let lift = if facet.is_smooth() { offset } else { 0.0 };
        Receiver {
            point: point + facet.normal * lift,
            normal: facet.normal_at(point),
            facet: facet.normal,
        }
    }
}

/// Marks a ray end without light: no hit, or a back.
pub const DARK: u32 = u32::MAX;

/// Most layers that a ray shows; those behind are sampled at random.
pub const MOST_LAYERS: usize = 8;
/// Each layer may add one reflection.
const MOST_VIEWS: usize = 2 * MOST_LAYERS;

/// A point of a facet.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    pub facet: u32,
    /// Metres.
    pub point: Vec3,
}

/// A part of what a ray from the eye shows.
#[derive(Clone, Copy, Debug)]
pub struct RayView {
    /// Final end of the ray.
    pub place: SurfacePoint,
    /// The glossy facet in which it is seen; [`DARK`] when seen directly.
    pub mirror: u32,
    /// Share of the ray.
    pub share: f64,
    /// Path length from the eye, metres.
    pub length: f64,
}

/// The scene as rays use it.
#[derive(Clone, Copy)]
pub struct RayScene<'a> {
    pub surfaces: &'a Surfaces,
    /// Hierarchy over their triangles.
    pub bvh: &'a Bvh,
    /// Distance that rays keep from the surface that they leave, metres.
    pub offset: f64,
}

impl<'a> RayScene<'a> {
    /// A scene with its hierarchy.
    pub fn new(surfaces: &'a Surfaces, bvh: &'a Bvh) -> RayScene<'a> {
        RayScene {
            surfaces,
            bvh,
            offset: 3.0 * surfaces.touching(),
        }
    }
}

impl RayScene<'_> {
    /// First front hit by a ray from a point of a facet, and its distance; a facet of [`DARK`] if
    /// there is none.
    pub fn shoot(&self, from: SurfacePoint, way: Vec3) -> (SurfacePoint, f64) {
        let normal = self.surfaces.facets[from.facet as usize].normal;
        self.look(from.point + normal * self.offset, way)
    }

    /// Unoccluded share of the light between a point of a surface and one of an emitter, each with
    /// its unit normal.
    pub fn visibility(&self, (point, normal): (Vec3, Vec3), (end, facing): (Vec3, Vec3)) -> f64 {
        let from = point + normal * self.offset;
        let to = end + facing * (2.0 * self.offset);
        self.transmittance(from, to - from)
    }

    /// Transmittance of haze over a distance, metres.
    pub fn clearness(&self, distance: f64) -> f64 {
        self.surfaces.clearness(distance)
    }

    /// Transmittance of surfaces and haze on the segment from `origin` to `origin + way`.
    pub fn transmittance(&self, origin: Vec3, way: Vec3) -> f64 {
        match self.past_surfaces(origin, way) {
            0.0 => 0.0,
            passed => passed * self.clearness(way.length()),
        }
    }

    /// Transmittance of surfaces on the segment from `origin` to `origin + way`.
    pub fn past_surfaces(&self, origin: Vec3, way: Vec3) -> f64 {
        if !self.surfaces.is_cut {
            return f64::from(u8::from(!self.bvh.is_blocked(origin, way)));
        }
        let mut passed = 1.0;
        let mut crossed = ArrayVec::<u32, MOST_LAYERS>::new();
        let is_blocked = self.bvh.is_blocked_past(origin, way, |hit| {
            let point = origin + way * f64::from(hit.distance);
            let Some((sheet, opacity)) = self.surfaces.sheet(hit.facet, point) else {
                return false;
            };
            // A sheet counts once, by its front or its back.
            if hit.distance < 1.0 && !crossed.contains(&sheet) {
                passed *= 1.0 - opacity;
                // When the list of sheets is full a back may count again: little light passes that
                // many.
                let _ = crossed.try_push(sheet);
            }
            true
        });
        if is_blocked { 0.0 } else { passed }
    }

    /// Layers seen from `origin`, the nearest first: translucent fronts and the surfaces behind
    /// them, each with its share. Backs and the void are omitted.
    pub fn layers(&self, origin: Vec3, way: Vec3) -> ArrayVec<(SurfacePoint, f64), MOST_LAYERS> {
        let mut layers = ArrayVec::new();
        if !self.surfaces.is_cut {
            let (place, _) = self.look(origin, way);
            layers.extend((place.facet != DARK).then_some((place, 1.0)));
            return layers;
        }
        let mut sheets = ArrayVec::<(Hit, u32, f64), { MOST_LAYERS - 1 }>::new();
        let end = self.bvh.first_hit_past(origin, way, |hit| {
            let point = origin + way * f64::from(hit.distance);
            let Some((sheet, opacity)) = self.surfaces.sheet(hit.facet, point) else {
                return false;
            };
            let found = (*hit, sheet, opacity);
            if let Some(known) = sheets.iter_mut().find(|known| known.1 == sheet) {
                // The visible side determines the opacity.
                if hit.front {
                    *known = found;
                }
                return true;
            }
            sheets.try_push(found).is_ok() || self.passes(hit, origin, way)
        });
        let reach = end.map_or(f32::INFINITY, |end| end.distance);
        sheets.retain(|(hit, ..)| hit.distance < reach);
        sheets.sort_by(|(a, ..), (b, ..)| a.distance.total_cmp(&b.distance));
        let mut passed = 1.0;
        let hits = sheets.iter().map(|(hit, _, opacity)| (*hit, *opacity));
        for (hit, opacity) in hits.chain(end.map(|end| (end, 1.0))) {
            let share = passed * opacity;
            passed -= share;
            let (place, _) = self.place(&hit, origin, way);
            if place.facet != DARK && share > 0.0 {
                layers.push((place, share));
            }
        }
        layers
    }

    /// Views from `origin`: the layers, and for lobes that `shows` accepts a reflection selected by
    /// random numbers.
    pub fn views(
        &self,
        (origin, way): (Vec3, Vec3),
        random: [f64; 2],
        shows: impl Fn(&Lobe) -> bool,
    ) -> ArrayVec<RayView, MOST_VIEWS> {
        let mut views = ArrayVec::new();
        for (place, share) in self.layers(origin, way) {
            let length = (place.point - origin).length();
            let mirror = DARK;
            views.push(RayView {
                place,
                mirror,
                share,
                length,
            });
            if !self.surfaces.lobe(place.facet).is_some_and(&shows) {
                continue;
            }
            let Some((way, weight)) = self.reflected(place, origin, random) else {
                continue;
            };
            let (end, further) = self.shoot(place, way);
            if end.facet != DARK {
                views.push(RayView {
                    place: end,
                    mirror: place.facet,
                    share: share * weight,
                    length: length + further,
                });
            }
        }
        views
    }

    /// Direction from which a glossy place reflects light to `eye`, selected by random numbers, and
    /// its weight.
    pub fn reflected(
        &self,
        place: SurfacePoint,
        eye: Vec3,
        random: [f64; 2],
    ) -> Option<(Vec3, f64)> {
        let lobe = self.surfaces.lobe(place.facet)?;
        let facet = self.surfaces.facets.get(place.facet as usize)?;
        let normal = facet.normal_at(place.point);
        let (way, weight) = lobe.reflect(normal, (eye - place.point).normalized(), random)?;
        (way.dot(facet.normal) > 0.0).then_some((way, weight))
    }

    fn first_hit(&self, origin: Vec3, way: Vec3) -> Option<Hit> {
        if self.surfaces.is_cut {
            self.bvh
                .first_hit_past(origin, way, |hit| self.passes(hit, origin, way))
        } else {
            self.bvh.first_hit(origin, way)
        }
    }

    fn passes(&self, hit: &Hit, origin: Vec3, way: Vec3) -> bool {
        let point = origin + way * f64::from(hit.distance);
        self.surfaces.lets_through(hit.facet, point, way)
    }

    /// The front seen from `origin`.
    pub fn look(&self, origin: Vec3, way: Vec3) -> (SurfacePoint, f64) {
        let nowhere = SurfacePoint {
            facet: DARK,
            point: origin,
        };
        let Some(hit) = self.first_hit(origin, way) else {
            return (nowhere, f64::INFINITY);
        };
        self.place(&hit, origin, way)
    }

    /// Intersection of a ray with a front, and its distance; a facet of [`DARK`] for a back.
    fn place(&self, hit: &Hit, origin: Vec3, way: Vec3) -> (SurfacePoint, f64) {
        // Recomputed on the facet's plane in double precision.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::rectangle;
    use footlight_host::work::Work;
    use footlight_show::geometry::vec3;
    use footlight_show::units::Rgb;
    use footlight_stage::texture::{Alpha, Texture};
    use footlight_stage::{Material, Polygon, Scene};

    /// Two gauzes with backs over a floor, seen from above: 40 % of the first, 40 % of the second
    /// through it, and the floor through both.
    #[test]
    fn layers_share_what_is_seen_and_light_is_held_back_by_each_sheet_once() {
        let polygon = |z: f64, material| {
            Polygon::new(rectangle((-1.0, 1.0), (-1.0, 1.0), z).to_vec(), material)
        };
        let mut scene = Scene {
            materials: vec![
                Material::diffuse("floor", Rgb([0.5; 3])),
                Material {
                    texture: Some(Texture::plain([0.5, 0.5, 0.5, 0.4], Alpha::Blend)),
                    ..Material::diffuse("gauze", Rgb([0.5; 3]))
                },
            ],
            polygons: vec![polygon(0.0, 0), polygon(1.0, 1), polygon(2.0, 1)],
            ..Scene::default()
        };
        scene.number_sheets();
        scene.add_backs(&[1, 2]);
        let surfaces = Surfaces::new(&scene).unwrap();
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        let scene = RayScene {
            surfaces: &surfaces,
            bvh: &bvh,
            offset: 1e-5,
        };
        let from = vec3(0.2, 0.3, 5.0);
        let layers = scene.layers(from, vec3(0.0, 0.0, -1.0));
        let found: Vec<(f64, f64)> = layers
            .iter()
            .map(|(p, share)| (p.point.z, *share))
            .collect();
        let expected = [(2.0, 0.4), (1.0, 0.24), (0.0, 0.36)];
        assert_eq!(found.len(), 3);
        for ((z, share), expected) in found.iter().zip(expected) {
            assert!(
                (z - expected.0).abs() < 1e-3 && (share - expected.1).abs() < 1e-3,
                "{found:?}"
            );
        }
        let passed = |down: f64| scene.transmittance(from, vec3(0.0, 0.0, -down));
        for (down, expected) in [(2.0, 1.0), (3.5, 0.6), (4.5, 0.36), (5.5, 0.0)] {
            assert!(
                (passed(down) - expected).abs() < 2e-3,
                "{down}: {}",
                passed(down)
            );
        }
    }
}
