//! Merges neighbouring coplanar triangles of one material back to the polygons from which they were
//! cut.
//!
//! Exporters cut every polygon into triangles. Each polygon costs the operator at least an element
//! and a place in every visibility test, and light is interpolated only within polygons. So
//! triangles are merged when the result is the same surface to rounding: the union has a simple
//! outline, and no vertex is farther from its plane than the precision of single floats. Polygons
//! of more than three corners stay as their author made them. Invariants: the area and the side of
//! every part of the surface stay; the order is that of each polygon's first triangle. Time and
//! memory are linear in the triangles. This module does not depend on files.

#![allow(
    clippy::indexing_slicing,
    reason = "vertices and triangles are numbered by this module alone"
)]

mod convex;
mod outline;

use std::collections::HashMap;

use super::{Polygon, Shading};
use footlight_show::geometry::Vec3;
use footlight_show::geometry::polygon;

/// Most corners of a merged polygon.
const CORNERS: usize = 64;

/// Largest distance of vertices from a plane or a line, relative to the largest coordinate: single
/// precision stores positions to 6e-8, rotations and sums take a few times that.
const ROUNDING: f64 = 4e-7;

/// Polygons after merging.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The polygons.
    pub polygons: Vec<Polygon>,
    /// Number of triangles that lost an edge.
    pub before: usize,
}

/// Merges triangles where possible.
pub fn triangles(mut polygons: Vec<Polygon>) -> Merged {
    let (mut mesh, numbers) = Mesh::of(&mut polygons);
    let mut out = Merged::default();
    for (mut polygon, number) in polygons.into_iter().zip(numbers) {
        let Some(triangle) = number else {
            out.polygons.push(polygon);
            continue;
        };
        let (region, flat) = mesh.region(triangle);
        if let [_] = region.as_slice() {
            polygon.shading = mesh.shadings[triangle as usize].take();
            out.polygons.push(polygon);
            continue;
        }
        let material = polygon.material;
        let parts: Vec<Polygon> = if flat {
            let shading = mesh.shadings[triangle as usize].take();
            let part = |vertices| Polygon {
                shading: shading.clone(),
                ..Polygon::new(vertices, material)
            };
            mesh.polygons(triangle, &region)
                .into_iter()
                .map(part)
                .collect()
        } else {
            let part = |t: &u32| Polygon {
                shading: mesh.shadings[*t as usize].take(),
                ..Polygon::new(mesh.corners(*t), material)
            };
            region.iter().map(part).collect()
        };
        let uncut = parts.iter().filter(|p| p.vertices.len() == 3).count();
        out.before += region.len().saturating_sub(uncut);
        out.polygons.extend(parts);
    }
    out
}

/// Vertex numbers of a triangle.
type Triangle = [u32; 3];

/// The triangles of a scene, with adjacency.
struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<Triangle>,
    materials: Vec<usize>,
    /// Shading of each triangle, taken when the triangle is output.
    shadings: Vec<Option<Box<Shading>>>,
    /// The triangle on the left of each directed edge; `None` when there are several.
    edges: HashMap<[u32; 2], Option<u32>>,
    /// The first triangle of each triangle's region.
    owners: Vec<Option<u32>>,
    /// Distances below this are rounding.
    tolerance: f64,
}

impl Mesh {
    /// The mesh of all triangles among `polygons`, and the triangle of each polygon.
    fn of(polygons: &mut [Polygon]) -> (Mesh, Vec<Option<u32>>) {
        let mut numbers = Vec::with_capacity(polygons.len());
        let mut mesh = Mesh {
            vertices: Vec::new(),
            triangles: Vec::new(),
            materials: Vec::new(),
            shadings: Vec::new(),
            edges: HashMap::new(),
            owners: Vec::new(),
            tolerance: 0.0,
        };
        let mut welded = HashMap::new();
        let mut largest = 0.0_f64;
        for polygon in polygons {
            let [a, b, c] = *polygon.vertices else {
                numbers.push(None);
                continue;
            };
            let triangle = [a, b, c].map(|v| {
                largest = largest.max(v.x.abs()).max(v.y.abs()).max(v.z.abs());
                // Adding zero turns -0 into 0.
                let key = [v.x + 0.0, v.y + 0.0, v.z + 0.0].map(f64::to_bits);
                *welded.entry(key).or_insert_with(|| {
                    mesh.vertices.push(v);
                    mesh.vertices.len() as u32 - 1
                })
            });
            let number = mesh.triangles.len() as u32;
            for edge in sides(triangle) {
                let left = mesh.edges.entry(edge).or_insert(Some(number));
                if *left != Some(number) {
                    *left = None;
                }
            }
            numbers.push(Some(number));
            mesh.triangles.push(triangle);
            mesh.materials.push(polygon.material);
            mesh.shadings.push(polygon.shading.take());
            mesh.owners.push(None);
        }
        mesh.tolerance = largest * ROUNDING;
        (mesh, numbers)
    }

    fn vertex(&self, number: u32) -> Vec3 {
        self.vertices[number as usize]
    }

    fn triangle(&self, number: u32) -> Triangle {
        self.triangles[number as usize]
    }

    /// Twice the vector area.
    fn area(&self, number: u32) -> Vec3 {
        let [a, b, c] = self.triangle(number).map(|v| self.vertex(v));
        (b - a).cross(c - a)
    }

    /// The triangle on the other side of an edge.
    fn across(&self, [a, b]: [u32; 2]) -> Option<u32> {
        self.edges.get(&[b, a]).copied().flatten()
    }

    /// The triangles connected to `first` in one plane, marked as its region, and true when they
    /// are flat to rounding (a slightly bent surface is not). Empty when `first` has an owner.
    fn region(&mut self, first: u32) -> (Vec<u32>, bool) {
        if !self.take(first, first) {
            return (Vec::new(), true);
        }
        let material = self.materials[first as usize];
        let [origin, b, c] = self.triangle(first).map(|v| self.vertex(v));
        // The plane is fitted to all triangles so far, so its direction improves with each.
        let mut area = self.area(first);
        let mut reach = (b - origin).length().max((c - origin).length());
        let mut region = vec![first];
        let mut next = 0;
        while let Some(triangle) = region.get(next).copied() {
            next += 1;
            for edge in sides(self.triangle(triangle)) {
                let other = self.across(edge);
                let Some(other) = other.filter(|t| self.materials[*t as usize] == material) else {
                    continue;
                };
                let (own, normal) = (self.area(other), area.normalized());
                // Rounding tilts the plane of a narrow shape by the tolerance over its width.
                let turn = self.tolerance * 2.0 * reach / area.length();
                let near = |v: Vec3| {
                    let d = v - origin;
                    d.dot(normal).abs() <= 2.0 * self.tolerance + turn * d.length()
                };
                let corners = self.triangle(other).map(|v| self.vertex(v));
                let level = own.dot(normal) > 0.99 * own.length();
                let continues = self.continue_into_each_other(first, other, &corners);
                if level && continues && corners.into_iter().all(near) && self.take(other, first) {
                    area += own;
                    reach = corners
                        .iter()
                        .fold(reach, |r, v| r.max((*v - origin).length()));
                    region.push(other);
                }
            }
        }
        let flat = self.is_flat(&region, area.normalized(), origin);
        (region, flat)
    }

    /// True when two triangles are shaded alike where they meet and their textures continue.
    fn continue_into_each_other(&self, a: u32, b: u32, at: &[Vec3]) -> bool {
        match [a, b].map(|t| self.shadings[t as usize].as_deref()) {
            [None, None] => true,
            [Some(a), Some(b)] => a.continues(b, at),
            _ => false,
        }
    }

    fn take(&mut self, triangle: u32, owner: u32) -> bool {
        let slot = &mut self.owners[triangle as usize];
        let is_free = slot.is_none();
        slot.get_or_insert(owner);
        is_free
    }

    /// The triangle of the same region across an edge.
    fn within(&self, edge: [u32; 2], owner: u32) -> Option<u32> {
        let other = self.across(edge)?;
        (self.owners[other as usize] == Some(owner)).then_some(other)
    }

    fn is_flat(&self, region: &[u32], normal: Vec3, origin: Vec3) -> bool {
        let corners = region.iter().flat_map(|t| self.triangle(*t));
        let heights = corners.map(|v| (self.vertex(v) - origin).dot(normal));
        let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        high - low <= 4.0 * self.tolerance
    }

    fn corners(&self, triangle: u32) -> Vec<Vec3> {
        self.triangle(triangle).map(|v| self.vertex(v)).to_vec()
    }

    /// The polygons of a flat region: its outline if that is simple, else convex parts.
    fn polygons(&self, owner: u32, region: &[u32]) -> Vec<Vec<Vec3>> {
        match outline::of(self, owner, region) {
            Some(outline) => vec![outline],
            None => convex::parts(self, owner, region),
        }
    }

    /// An outline without collinear corners, as the polygon that covers `triangles`; `None` when it
    /// is not valid, or too large.
    fn straightened(&self, outline: &[u32], triangles: &[u32]) -> Option<Vec<Vec3>> {
        let corners: Vec<Vec3> = outline.iter().map(|v| self.vertex(*v)).collect();
        let kept = outline::without_straight(&corners, self.tolerance);
        if kept.len() > CORNERS {
            return None;
        }
        let mut whole = polygon::planar(kept).ok()?;
        let only = whole.pop().filter(|_| whole.is_empty())?;
        let covered = triangles
            .iter()
            .fold(Vec3::ZERO, |sum, t| sum + self.area(*t));
        // A corner off its line by the tolerance changes the area by half its neighbours' distance
        // times that.
        let lost = (covered - polygon::doubled_area(&only)).length();
        let most = 1e-9 * covered.length() + 2.0 * self.tolerance * outline::length(&corners);
        (lost <= most).then_some(only)
    }
}

fn sides([a, b, c]: Triangle) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

#[cfg(test)]
mod tests;
