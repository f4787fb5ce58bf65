//! Where rays end in a scene, and what they pass.
//!
//! This module does not depend on lights.

use crate::gather::bvh::{Bvh, Hit};
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::Vec3;

/// No light comes from there: nothing is hit, or a back.
pub const DARK: u32 = u32::MAX;

/// A point of a facet.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Index of the facet.
    pub facet: u32,
    /// Where.
    pub point: Vec3,
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
        if self.surfaces.is_cut {
            self.bvh
                .is_blocked_past(origin, way, |hit| self.passes(hit, origin, way))
        } else {
            self.bvh.is_blocked(origin, way)
        }
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
