//! Convex solids and their back faces, which occlude only points that the fronts occlude too.
//!
//! From outside a convex solid only its fronts are visible: a ray that crosses a back has entered
//! by a front. So half of a box's faces can be omitted as occluders. Solids are seldom closed: a
//! box on a floor has no bottom. It is still a solid if other surfaces cover each missing face.
//! Invariant: a solid is convex with its fronts outside, and closed except for such faces; doubtful
//! cases are not solids. This module does not depend on light.

#![allow(
    clippy::indexing_slicing,
    reason = "corners, facets and pieces are numbered by the lists that this module makes or is given"
)]

use crate::surfaces::clipper::{Line, PlanePoint, PolygonClipper, Rectangle, measured};
use crate::surfaces::extent;
use crate::surfaces::facet::{Facet, Piece};
use footlight_show::geometry::{Vec3, frame};
use std::collections::BTreeMap;

/// Most corners of a solid: hulls are found by testing all triples.
const MOST_CORNERS: usize = 40;

/// Least thickness of a solid, as a multiple of the length below which objects touch.
const THICK: f64 = 10.0;

/// Allowed missing share of a face, for rounding.
const GAP: f64 = 1e-6;

/// The solids of a scene.
#[derive(Clone, Debug)]
pub struct Solids {
    /// For each piece its solid.
    of: Vec<Option<u32>>,
    pub(crate) count: usize,
}

impl Solids {
    /// Finds the solids among a scene's facets; lengths below `touching` are ignored.
    pub fn new(facets: &[Facet], pieces: &[Piece], touching: f64) -> Solids {
        let mut out = Solids {
            of: vec![None; pieces.len()],
            count: 0,
        };
        let scene = Faces {
            facets,
            pieces,
            touching,
        };
        for members in joined(facets) {
            if scene.is_solid(&members) {
                for facet in members {
                    out.of[facets[facet].pieces.clone()].fill(Some(out.count as u32));
                }
                out.count += 1;
            }
        }
        out
    }

    /// For each piece, true when it can be omitted as an occluder of points anywhere among
    /// `corners`: all of them are behind it and outside its solid.
    pub fn hidden(&self, pieces: &[Piece], corners: &[Vec3], touching: f64) -> Vec<bool> {
        let mut outside = vec![false; self.count];
        let mut behind = vec![false; pieces.len()];
        for ((piece, solid), behind) in pieces.iter().zip(&self.of).zip(&mut behind) {
            let Some(solid) = solid else { continue };
            let heights = corners
                .iter()
                .map(|c| piece.normal.dot(*c - piece.vertices[0]));
            let (low, high) = extent(heights);
            outside[*solid as usize] |= low > touching;
            *behind = high <= 0.0;
        }
        for (solid, behind) in self.of.iter().zip(&mut behind) {
            *behind &= solid.is_some_and(|s| outside[s as usize]);
        }
        behind
    }
}

/// Groups of facets connected by shared edges with opposite directions.
fn joined(facets: &[Facet]) -> Vec<Vec<usize>> {
    let mut numbers = BTreeMap::new();
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (i, facet) in facets.iter().enumerate() {
        let mut number = |v: &Vec3| {
            // Adding zero makes both signed zeros one corner.
            let key = [v.x, v.y, v.z].map(|x| (x + 0.0).to_bits());
            let next = numbers.len() as u32;
            *numbers.entry(key).or_insert(next)
        };
        let corners: Vec<u32> = facet.vertices.iter().map(&mut number).collect();
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            edges.entry([*a, b]).or_default().push(i);
        }
    }
    let mut first: Vec<usize> = (0..facets.len()).collect();
    for ([a, b], own) in &edges {
        let other = edges.get(&[*b, *a]);
        if let ([i], Some([j])) = (own.as_slice(), other.map(Vec::as_slice)) {
            let (i, j) = (root(&mut first, *i), root(&mut first, *j));
            first[i.max(j)] = i.min(j);
        }
    }
    let mut lists: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for i in 0..facets.len() {
        lists.entry(root(&mut first, i)).or_default().push(i);
    }
    lists.into_values().collect()
}

/// The representative of an index's group; shortens the path for later searches.
fn root(first: &mut [usize], mut i: usize) -> usize {
    while first[i] != i {
        first[i] = first[first[i]];
        i = first[i];
    }
    i
}

#[derive(Clone, Copy)]
struct Faces<'a> {
    facets: &'a [Facet],
    pieces: &'a [Piece],
    touching: f64,
}

/// A face of a hull: its plane, and its corners in no order.
#[derive(Clone, Debug, PartialEq)]
struct Face {
    normal: Vec3,
    corners: Vec<Vec3>,
}

impl Faces<'_> {
    /// True when these facets are the faces of a convex solid, except for faces that other surfaces
    /// cover.
    fn is_solid(self, members: &[usize]) -> bool {
        let Some(corners) = self.corners(members) else {
            return false;
        };
        let mut own: Vec<&Piece> = Vec::new();
        for &m in members {
            own.extend(&self.pieces[self.facets[m].pieces.clone()]);
        }
        let faces = self.hull(&corners);
        let on_another = |face: &Face| {
            self.is_filled(face, own.iter().copied()) || self.is_filled(face, self.pieces.iter())
        };
        faces.iter().all(on_another)
    }

    /// Distinct corners of some facets if they may be those of a solid: few, all behind every
    /// facet, and some well behind it.
    fn corners(self, members: &[usize]) -> Option<Vec<Vec3>> {
        let all = members.iter().map(|&m| self.facets[m].vertices.len());
        if members.len() < 3 || all.sum::<usize>() > 6 * MOST_CORNERS {
            return None;
        }
        let mut corners: Vec<Vec3> = Vec::new();
        for v in members.iter().flat_map(|&m| self.facets[m].vertices.iter()) {
            if !corners.contains(v) {
                corners.push(*v);
            }
        }
        let thick = |m: &usize| {
            let heights = corners.iter().map(|c| self.facets[*m].height(*c));
            let (low, high) = extent(heights);
            high <= self.touching && low < -THICK * self.touching
        };
        (corners.len() <= MOST_CORNERS && members.iter().all(thick)).then_some(corners)
    }

    /// Faces of the convex hull of some corners.
    fn hull(self, corners: &[Vec3]) -> Vec<Face> {
        let mut faces: Vec<Face> = Vec::new();
        let n = corners.len();
        let triples = (0..n).flat_map(|i| {
            (i + 1..n).flat_map(move |j| (j + 1..n).map(move |k| [i, j, k].map(|at| corners[at])))
        });
        for [p, q, r] in triples {
            let across = (q - p).cross(r - p);
            let longest = (q - p).length().max((r - p).length());
            if across.length() <= THICK * self.touching * longest {
                continue; // about on one line
            }
            for normal in [across.normalized(), -across.normalized()] {
                let height = |c: &Vec3| normal.dot(*c - p);
                if corners.iter().all(|c| height(c) <= self.touching) {
                    let on = |c: &&Vec3| height(c) >= -self.touching;
                    let corners: Vec<Vec3> = corners.iter().filter(on).copied().collect();
                    let known = |f: &Face| f.normal.dot(normal) > 0.0 && f.corners == corners;
                    if !faces.iter().any(known) {
                        faces.push(Face { normal, corners });
                    }
                }
            }
        }
        faces
    }

    /// True when the pieces in the plane of a face cover it completely.
    fn is_filled<'b>(self, face: &Face, pieces: impl Iterator<Item = &'b Piece>) -> bool {
        let origin = face.corners[0];
        let axes = frame(face.normal);
        let place = |v: &Vec3| axes.map(|axis| axis.dot(*v - origin));
        let mut clipper = PolygonClipper::default();
        clipper.add(&round(face.corners.iter().map(place).collect()));
        let area = |clipper: &PolygonClipper| clipper.parts().map(|p| measured(p).0).sum::<f64>();
        let whole = area(&clipper);
        for piece in pieces {
            let height = |v: &Vec3| face.normal.dot(*v - origin).abs();
            if piece.vertices.iter().any(|v| height(v) > self.touching) {
                continue;
            }
            let outline: Vec<PlanePoint> = piece.vertices.iter().map(place).collect();
            let turn = face.normal.dot(piece.normal).signum();
            let next = outline.iter().cycle().skip(1);
            let lines = outline.iter().zip(next).map(|([ax, ay], [bx, by])| {
                // To the left of each edge, with a tolerance.
                let (dx, dy) = (bx - ax, by - ay);
                let slack = self.touching * dx.hypot(dy);
                let [u, v] = [-dy * turn, dx * turn];
                [slack - u * ax - v * ay, u, v]
            });
            let lines: Vec<Line> = lines.collect();
            clipper.subtract(lines.iter(), &Rectangle::of(&outline));
            if area(&clipper) <= GAP * whole {
                return true;
            }
        }
        false
    }
}

/// Sorts points by angle about their centre.
fn round(mut points: Vec<PlanePoint>) -> Vec<PlanePoint> {
    let count = points.len().max(1) as f64;
    let [x, y] = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / count);
    let angle = |p: &PlanePoint| (p[1] - y).atan2(p[0] - x);
    points.sort_by(|p, q| angle(p).total_cmp(&angle(q)));
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::hierarchy::blocks;
    use crate::surfaces::rectangle;
    use crate::surfaces::surface::Surfaces;
    use footlight_show::geometry::{block, vec3};
    use proptest::prelude::*;

    fn floor(x: (f64, f64), y: (f64, f64)) -> Vec<Vec3> {
        rectangle(x, y, 0.0).to_vec()
    }

    fn solids(polygons: Vec<Vec<Vec3>>) -> usize {
        Surfaces::grey(polygons).solids().count
    }

    fn unit() -> Vec<Vec<Vec3>> {
        block([vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0)], false).to_vec()
    }

    /// A block without a bottom, standing on the given polygons.
    fn standing(on: &[Vec<Vec3>]) -> Vec<Vec<Vec3>> {
        [&unit()[..5], on].concat()
    }

    #[test]
    fn a_block_is_a_solid_where_all_that_it_lacks_lies_on_something() {
        assert_eq!(solids(unit()), 1);
        assert_eq!(solids(standing(&[])), 0);
        assert_eq!(solids(standing(&[floor((-5.0, 5.0), (-5.0, 5.0))])), 1);
        assert_eq!(solids(standing(&[floor((0.0, 1.0), (0.0, 1.0))])), 1);
        // Across a joint of the floor; over a gap; over the edge.
        let left = floor((-5.0, 0.4), (-5.0, 5.0));
        let right = |from| floor((from, 5.0), (-5.0, 5.0));
        assert_eq!(solids(standing(&[left.clone(), right(0.4)])), 1);
        assert_eq!(solids(standing(&[left.clone(), right(0.41)])), 0);
        assert_eq!(solids(standing(&[left])), 0);
    }

    #[test]
    fn rooms_and_what_is_not_convex_are_none() {
        let room = unit().into_iter().map(|mut face| {
            face.reverse();
            face
        });
        assert_eq!(solids(room.collect()), 0);
        let mut dented = unit();
        let (low, high) = (vec3(0.0, 0.0, 1.0), vec3(1.0, 1.0, 1.0));
        let dent = vec3(0.5, 0.5, 0.6);
        let rim = [low, vec3(1.0, 0.0, 1.0), high, vec3(0.0, 1.0, 1.0)];
        dented.remove(0);
        dented.extend((0..4).map(|i| vec![rim[i], rim[(i + 1) % 4], dent]));
        assert_eq!(solids(dented), 0);
        // Two sheets back to back are thin, not solid.
        let sheet = floor((0.0, 1.0), (0.0, 1.0));
        let back = sheet.iter().rev().copied().collect();
        assert_eq!(solids(vec![sheet, back]), 0);
    }

    #[test]
    fn backs_are_hidden_from_outside_only() {
        let scene = Surfaces::grey(standing(&[floor((-5.0, 5.0), (-5.0, 5.0))]));
        let hidden = |corners: &[Vec3]| {
            let marks = scene
                .solids()
                .hidden(&scene.pieces, corners, scene.touching());
            marks.iter().filter(|m| **m).count()
        };
        let above = vec3(0.5, 0.5, 3.0);
        // The top and all sides except two are visible from the corner; the sides are edge on from
        // above.
        assert_eq!(hidden(&[vec3(3.0, 3.0, 3.0)]), 2);
        assert_eq!(hidden(&[above]), 4);
        // For a lamp above the whole block, each side faces some part of the lamp.
        let lamp = [(-1.0, -1.0), (2.0, -1.0), (2.0, 2.0), (-1.0, 2.0)];
        assert_eq!(hidden(&lamp.map(|(x, y)| vec3(x, y, 3.0))), 0);
        // Inside, beneath on the floor, and with one end inside.
        assert_eq!(hidden(&[vec3(0.5, 0.5, 0.5)]), 0);
        assert_eq!(hidden(&[vec3(0.5, 0.5, 0.0)]), 0);
        assert_eq!(hidden(&[above, vec3(0.5, 0.5, 0.5)]), 0);
    }

    proptest! {
        /// Every segment to a lamp that is blocked is also blocked without the faces that are
        /// hidden from the lamp.
        #[test]
        fn nothing_is_let_through(
            sizes in prop::collection::vec((-2.0..2.0, -2.0..2.0, 0.1..1.5, 0.1..1.5), 1..6),
            lamp in (-3.0..3.0, -3.0..3.0, 0.0..3.0),
            others in prop::collection::vec((-3.0..3.0, -3.0..3.0, 0.0..3.0), 40),
        ) {
            let mut faces = vec![floor((-4.0, 4.0), (-4.0, 4.0))];
            for (x, y, wide, high) in sizes {
                let low = vec3(x, y, 0.0);
                let corners = [low, low + vec3(wide, wide, high)];
                faces.extend_from_slice(&block(corners, false)[..5]);
            }
            let scene = Surfaces::grey(faces);
            let touching = scene.touching();
            let lamp = vec3(lamp.0, lamp.1, lamp.2);
            let marks = scene.solids().hidden(&scene.pieces, &[lamp], touching);
            prop_assert!(scene.solids().count > 0);
            for (x, y, z) in others {
                let stops = |p: &&Piece| blocks(p, lamp, vec3(x, y, z), touching);
                let of_all = scene.pieces.iter().any(|p| stops(&p));
                let seen = scene.pieces.iter().zip(&marks).filter(|(_, m)| !**m);
                prop_assert_eq!(of_all, seen.map(|(p, _)| p).any(|p| stops(&p)));
            }
        }
    }
}
