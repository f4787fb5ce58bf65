//! Patch stitching: light is interpolated across the shared edges of coplanar facets.
//!
//! Each facet has a grid of its own, so that a wall made of several polygons would show each by a
//! shade of its own. Within half a cell of a shared edge the facet beyond takes part in the
//! interpolation, not where something stands on the edge and stops the light. This module does not
//! depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count, facets by the surfaces"
)]

use crate::geometry::Vec3;
use crate::radiosity::geometry::surface::{Facet, Surfaces};
use crate::radiosity::mesh::Mesh;
use crate::radiosity::mesh::contact::{ContactEdge, Contacts};
use crate::radiosity::mesh::grid::Grid;
use rayon::prelude::*;

/// Normals of facets in one plane differ by less than this (their product from 1).
const LEAST_BEND: f64 = 1e-9;

/// Directions in which a shared edge may be crossed one after the other: two, as the plane has.
const MOST_CROSSED: usize = 2;

/// A straight part of the rim of two facets.
#[derive(Clone, Copy, Debug)]
struct SharedEdge {
    /// The facet beyond.
    other: usize,
    from: Vec3,
    /// Unit vectors along it, and across it into the facet.
    along: Vec3,
    inward: Vec3,
    length: f64,
}

/// The shared edges of all facets.
#[derive(Clone, Debug)]
pub struct Stitching {
    of: Vec<Vec<SharedEdge>>,
}

impl Stitching {
    /// Finds the shared edges of a scene.
    pub fn new(surfaces: &Surfaces) -> Stitching {
        let contacts = Contacts::new(surfaces);
        let facets = || (0..surfaces.facets.len()).into_par_iter();
        let mut of: Vec<Vec<SharedEdge>> =
            facets().map(|f| beside(surfaces, &contacts, f)).collect();
        let contact_edges = |f: usize| {
            if of[f].is_empty() {
                Vec::new()
            } else {
                contacts.of(f, 0.0)
            }
        };
        let contact_edges: Vec<Vec<ContactEdge>> = facets().map(contact_edges).collect();
        for (facet, edges) in of.iter_mut().enumerate() {
            edges.retain(|edge| {
                let own = &contact_edges[facet];
                let mut both = own.iter().chain(&contact_edges[edge.other]);
                !both.any(|contact| edge.runs_along(contact.ends, surfaces.touching()))
            });
        }
        Stitching { of }
    }

    /// Elements around a point of a facet and their weights, which sum to 1, as [`Mesh::stencil`],
    /// but going on across shared edges: added to `out`. None are if there is none.
    pub fn stencil(&self, mesh: &Mesh, facet: usize, p: Vec3, out: &mut Vec<(u32, f32)>) {
        self.add(mesh, facet, p, 1.0, [Vec3::ZERO; MOST_CROSSED], out);
    }

    /// Adds a share of the light, which has `crossed` shared edges in these directions; zero is
    /// none.
    fn add(
        &self,
        mesh: &Mesh,
        facet: usize,
        p: Vec3,
        weight: f64,
        mut crossed: [Vec3; MOST_CROSSED],
        out: &mut Vec<(u32, f32)>,
    ) {
        let mut own = weight;
        for edge in &self.of[facet] {
            let is_new = |way: &Vec3| way.dot(edge.inward).abs() < 0.5;
            let free = crossed.iter().position(|way| *way == Vec3::ZERO);
            let Some(free) = free.filter(|_| crossed.iter().all(is_new)) else {
                continue;
            };
            let Some((foot, share)) = edge.beyond(mesh, facet, p) else {
                continue;
            };
            crossed[free] = edge.inward;
            self.add(mesh, edge.other, foot, own * share, crossed, out);
            own *= 1.0 - share;
        }
        let stencil = mesh.stencil(facet, p).into_iter();
        let shares = stencil.map(|(element, w)| (element, w * own as f32));
        out.extend(shares.filter(|(_, w)| *w > 0.0));
    }
}

/// The facets in the plane of one that share a part of its rim, and reflect.
fn beside(surfaces: &Surfaces, contacts: &Contacts<'_>, facet: usize) -> Vec<SharedEdge> {
    let own = &surfaces.facets[facet];
    let touching = surfaces.touching();
    let mut out = Vec::new();
    if own.is_black() {
        return out;
    }
    for piece in contacts.around(facet) {
        let other = &surfaces.facets[piece.facet];
        let is_level = |v: &Vec3| own.height(*v).abs() <= touching;
        if other.is_black()
            || own.normal.dot(other.normal) < 1.0 - LEAST_BEND
            || !piece.vertices.iter().all(is_level)
        {
            continue;
        }
        for [a, b] in edges(&own.vertices) {
            for [c, d] in edges(&piece.vertices) {
                out.extend(SharedEdge::between(
                    own,
                    [a, b],
                    [c, d],
                    piece.facet,
                    touching,
                ));
            }
        }
    }
    out
}

fn edges(vertices: &[Vec3]) -> impl Iterator<Item = [Vec3; 2]> {
    let n = vertices.len();
    (0..n).map(move |i| [vertices[i], vertices[(i + 1) % n]])
}

impl SharedEdge {
    /// Where an edge of a facet runs along one of another, which goes the other way.
    fn between(
        own: &Facet,
        [a, b]: [Vec3; 2],
        [c, d]: [Vec3; 2],
        other: usize,
        touching: f64,
    ) -> Option<SharedEdge> {
        let along = (b - a).normalized();
        let inward = own.normal.cross(along);
        let off = |p: Vec3| (p - a).dot(inward).abs();
        if off(c) > touching || off(d) > touching {
            return None;
        }
        let at = |p: Vec3| (p - a).dot(along);
        let (low, high) = (at(d).max(0.0), at(c).min(at(b)));
        (high - low > touching).then(|| SharedEdge {
            other,
            from: a + along * low,
            along,
            inward,
            length: high - low,
        })
    }

    fn runs_along(&self, ends: [Vec3; 2], touching: f64) -> bool {
        let [a, b] = ends.map(|p| (p - self.from).dot(self.along));
        let near = |p: &Vec3| (*p - self.from).dot(self.inward).abs() <= touching;
        ends.iter().all(near) && a.max(b).min(self.length) - a.min(b).max(0.0) > touching
    }

    /// The place of the shared edge nearest to a point of the facet, and the share that the facet
    /// beyond has in the point's light, if the point is between the shared edge and the samples
    /// nearest to it.
    fn beyond(&self, mesh: &Mesh, facet: usize, p: Vec3) -> Option<(Vec3, f64)> {
        let [own, other] = [facet, self.other].map(|f| mesh.grids[f].as_ref());
        // Of a cell of its grid; as wide as that is across the shared edge.
        let half = |grid: &Grid| {
            let [u, v] = grid.slopes().map(|slope| slope.dot(self.inward));
            0.5 / u.hypot(v)
        };
        let (own, other) = (half(own?), half(other?));
        let away = (p - self.from).dot(self.inward);
        let at = (p - self.from).dot(self.along);
        let is_beside = away < own && (0.0..=self.length).contains(&at);
        let foot = self.from + self.along * at;
        let share = own / (own + other) * (1.0 - away.max(0.0) / own);
        (is_beside && mesh.are_connected(facet, [p, foot])).then_some((foot, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3;
    use crate::radiosity::direct::Setting;
    use crate::radiosity::mesh::Layout;
    use crate::radiosity::visibility::Hierarchy;

    /// A floor of four tiles that meet at (2, 1), and what else stands there.
    fn floor(others: &[Vec<Vec3>]) -> (Surfaces, Mesh) {
        let tile = |x: [f64; 2], y: [f64; 2]| {
            let corner = |i: usize, j: usize| vec3(x[i], y[j], 0.0);
            vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
        };
        let (x, y) = ([0.0, 2.0, 5.0], [0.0, 1.0, 3.0]);
        let tiles = [[0, 0], [1, 0], [0, 1], [1, 1]];
        let mut polygons: Vec<Vec<Vec3>> = tiles
            .map(|[i, j]| tile([x[i], x[i + 1]], [y[j], y[j + 1]]))
            .to_vec();
        polygons.extend_from_slice(others);
        let surfaces = Surfaces::grey(polygons);
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting::new(&surfaces, &hierarchy);
        let layout = Layout::of_elements(&surfaces, 20);
        let mesh = layout.mesh_of_all_cells(setting, &[vec3(1.0, 0.5, 1.0), vec3(4.0, 2.0, 1.0)]);
        (surfaces, mesh)
    }

    /// What is interpolated at a point: at the samples it is the square of the distance from a
    /// corner of the floor.
    fn value(mesh: &Mesh, shares: &[(u32, f32)]) -> f64 {
        let all: f32 = shares.iter().map(|s| s.1).sum();
        assert!((all - 1.0).abs() < 1e-5, "{all}");
        let at = |e: u32| mesh.elements[e as usize].centre.length();
        shares
            .iter()
            .map(|(e, w)| f64::from(*w) * at(*e).powi(2))
            .sum()
    }

    fn tile(surfaces: &Surfaces, p: Vec3) -> usize {
        let is_in = |f: &Facet| {
            let (x, y) = (
                f.vertices.iter().map(|v| v.x),
                f.vertices.iter().map(|v| v.y),
            );
            let (low, high) = (x.clone().fold(f64::MAX, f64::min), x.fold(0.0, f64::max));
            let (near, far) = (y.clone().fold(f64::MAX, f64::min), y.fold(0.0, f64::max));
            (low..high).contains(&p.x) && (near..far).contains(&p.y)
        };
        surfaces.facets.iter().position(is_in).unwrap()
    }

    #[test]
    fn light_goes_on_from_tile_to_tile() {
        let (surfaces, mesh) = floor(&[]);
        let stitching = Stitching::new(&surfaces);
        let jump = |ours: bool, p: Vec3, way: Vec3| {
            let sides = [-1e-6, 1e-6].map(|d| {
                let q = p + way * d;
                let facet = tile(&surfaces, q);
                let mut shares = Vec::new();
                match ours {
                    true => stitching.stencil(&mesh, facet, q, &mut shares),
                    false => shares.extend(mesh.stencil(facet, q)),
                }
                value(&mesh, &shares)
            });
            (sides[1] - sides[0]).abs()
        };
        let across = (0..100).map(|i| {
            (
                vec3(2.0, 0.015 + 0.029 * f64::from(i), 0.0),
                vec3(1.0, 0.0, 0.0),
            )
        });
        let along = (0..100).map(|i| {
            (
                vec3(0.02 + 0.049 * f64::from(i), 1.0, 0.0),
                vec3(0.0, 1.0, 0.0),
            )
        });
        let (mut naive, mut ours) = (0.0, 0.0_f64);
        for (p, way) in across.chain(along) {
            naive += jump(false, p, way) / 200.0;
            ours = ours.max(jump(true, p, way));
        }
        println!("from tile to tile {naive:.3} on average, {ours:.1e} at most across shared edges");
        assert!(naive > 0.1, "{naive}");
        assert!(ours < 1e-4, "{ours}");
    }

    #[test]
    fn light_stops_where_something_stands_on_the_edge() {
        let wall = [
            vec3(2.0, 0.0, 0.0),
            vec3(2.0, 3.0, 0.0),
            vec3(2.0, 3.0, 2.0),
            vec3(2.0, 0.0, 2.0),
        ];
        let reaches = |others: &[Vec<Vec3>]| {
            let (surfaces, mesh) = floor(others);
            let p = vec3(1.99, 0.4, 0.0);
            let mut shares = Vec::new();
            Stitching::new(&surfaces).stencil(&mesh, tile(&surfaces, p), p, &mut shares);
            shares
                .iter()
                .any(|(e, _)| mesh.elements[*e as usize].centre.x > 2.0)
        };
        assert!(reaches(&[]));
        assert!(!reaches(&[wall.to_vec()]));
        assert!(!reaches(&[wall.into_iter().rev().collect()]));
    }
}
