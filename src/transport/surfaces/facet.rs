//! Facets, planar polygons with a front, and their convex pieces.

#![allow(
    clippy::indexing_slicing,
    reason = "indices of vertices come from the polygon's own length"
)]

use footlight_show::geometry::Vec3;
use footlight_stage::Shading;
use std::sync::Arc;

/// A planar polygon with a front.
#[derive(Clone, Debug)]
pub struct Facet {
    /// Anticlockwise seen from the front.
    pub vertices: Arc<[Vec3]>,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Square metres.
    pub area: f64,
    /// Area divided by the longest edge, metres: a measure of narrowness.
    pub width: f64,
    /// Index into [`Scene::materials`](footlight_stage::Scene::materials).
    pub material: usize,
    /// Diffuse reflectance of each channel; the mean of a texture.
    pub reflectance: [f64; 3],
    /// Range of its pieces in [`Surfaces::pieces`](crate::surfaces::surface::Surfaces::pieces).
    pub pieces: std::ops::Range<usize>,
    /// Texture and shading normals, if any.
    pub shading: Option<Box<Shading>>,
}

impl Facet {
    /// Edges in the order of the vertices.
    pub fn rim(&self) -> impl Iterator<Item = Edge> + '_ {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().zip(next).map(|(start, end)| {
            let way = *end - *start;
            let along = way.normalized();
            Edge {
                start: *start,
                along,
                inward: self.normal.cross(along),
                length: way.length(),
            }
        })
    }
}

/// An edge of a facet.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Start point.
    pub start: Vec3,
    /// Unit vector along the edge.
    pub along: Vec3,
    /// Unit vector in the facet's plane towards its inside.
    pub inward: Vec3,
    /// Metres.
    pub length: f64,
}

impl Facet {
    /// True when it has varying shading normals.
    pub fn is_smooth(&self) -> bool {
        self.shading.as_ref().is_some_and(|s| s.normal.is_some())
    }

    /// Unit shading normal at a point of the facet.
    pub fn normal_at(&self, point: Vec3) -> Vec3 {
        match &self.shading {
            Some(shading) => shading.normal(point, self.normal),
            None => self.normal,
        }
    }

    /// True when it reflects nothing in any channel.
    pub fn is_black(&self) -> bool {
        self.reflectance.iter().all(|r| *r == 0.0)
    }

    /// Reflectance of the highest channel.
    pub fn highest_reflectance(&self) -> f64 {
        self.reflectance.iter().copied().fold(0.0, f64::max)
    }

    /// Signed distance of `p` from the facet's plane, positive in front.
    pub fn height(&self, p: Vec3) -> f64 {
        self.normal.dot(p - self.vertices[0])
    }
}

/// A convex part of a facet.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Anticlockwise seen from the front.
    pub vertices: Arc<[Vec3]>,
    /// The facet's unit normal.
    pub normal: Vec3,
    /// Index into [`Surfaces::facets`](crate::surfaces::surface::Surfaces::facets).
    pub facet: usize,
}

impl Piece {
    /// True when a point of the piece's plane lies within its outline.
    pub fn holds(&self, p: Vec3) -> bool {
        let n = self.vertices.len();
        (0..n).all(|i| {
            let (a, b) = (self.vertices[i], self.vertices[(i + 1) % n]);
            (b - a).cross(p - a).dot(self.normal) >= 0.0
        })
    }
}
