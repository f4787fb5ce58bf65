//! Visibility: segment tests, first hits, and the occluders in a shaft.
//!
//! A bounding volume hierarchy over the convex pieces of the scene. Tests are exact up to rounding.
//! Both sides of a surface block light. Surfaces that contain an end of the segment (within
//! `touching`) do not block, so that a surface does not hide its own points. This module does not
//! depend on light.

#![allow(
    clippy::indexing_slicing,
    reason = "node and piece indices are made and kept by this module alone"
)]

use std::borrow::Borrow;

use crate::surfaces::facet::Piece;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::{Vec3, bounds, greater, smaller};

/// Pieces in a leaf.
const LEAF: usize = 4;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Least coordinates.
    pub low: Vec3,
    /// Greatest coordinates.
    pub high: Vec3,
}

impl Bounds {
    /// Bounds of points.
    pub fn of(points: impl IntoIterator<Item = impl Borrow<Vec3>>) -> Bounds {
        let [low, high] = bounds(points);
        Bounds { low, high }
    }

    fn union(self, o: Bounds) -> Bounds {
        Bounds {
            low: self.low.min(o.low),
            high: self.high.max(o.high),
        }
    }

    /// Maximum of `direction . p` over the box.
    fn support(&self, d: Vec3) -> f64 {
        d.x * if d.x > 0.0 { self.high.x } else { self.low.x }
            + d.y * if d.y > 0.0 { self.high.y } else { self.low.y }
            + d.z * if d.z > 0.0 { self.high.z } else { self.low.z }
    }

    /// True when the segment `origin + t direction`, 0 <= t <= `reach`, meets the box. `inverse`
    /// holds the inverse of each component of the direction.
    fn meets(&self, origin: Vec3, inverse: Vec3, reach: f64) -> bool {
        let (mut enter, mut leave) = (0.0_f64, reach);
        for axis in 0..3 {
            let a = (self.low[axis] - origin[axis]) * inverse[axis];
            let b = (self.high[axis] - origin[axis]) * inverse[axis];
            // `max` and `min` drop the NaN of a ray that lies in the plane of a side.
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        enter <= leave * (1.0 + 1e-12)
    }

    /// True when both have a point in common.
    pub fn overlaps(&self, o: &Bounds) -> bool {
        (0..3).all(|a| self.low[a] <= o.high[a] && o.low[a] <= self.high[a])
    }
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Bounds,
    /// Range of `Hierarchy::order` for a leaf; empty for an inner node.
    leaf: std::ops::Range<usize>,
    /// Children of an inner node.
    children: [usize; 2],
}

/// The hierarchy over all pieces of a scene.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    order: Vec<usize>,
    bounds: Vec<Bounds>,
    touching: f64,
}

/// Geometry of a scene with the hierarchy over it.
#[derive(Clone, Copy, Debug)]
pub struct SceneGeometry<'a> {
    /// Facets and pieces.
    pub surfaces: &'a Surfaces,
    /// Hierarchy over the same pieces.
    pub hierarchy: &'a Hierarchy,
}

impl<'a> SceneGeometry<'a> {
    /// Geometry from a scene's surfaces and their hierarchy.
    pub fn new(surfaces: &'a Surfaces, hierarchy: &'a Hierarchy) -> SceneGeometry<'a> {
        SceneGeometry {
            surfaces,
            hierarchy,
        }
    }
}

/// A half-space that contains a shaft: `normal . p <= offset` for all its points.
#[derive(Clone, Copy, Debug)]
struct Wall {
    normal: Vec3,
    offset: f64,
}

/// Convex hull of a receiver (points of one plane) and an emitter (a convex polygon or a point),
/// given by its side walls.
#[derive(Clone, Debug)]
pub struct Shaft<'a> {
    receiver: &'a [Vec3],
    emitter: &'a [Vec3],
    walls: Vec<Wall>,
    bounds: Bounds,
}

impl<'a> Shaft<'a> {
    /// The shaft between convex `receiver` and `emitter`. The walls are planes through an edge of
    /// one and a vertex of the other that have all points on one side. `front` is the receiver's
    /// normal, as nothing behind it can block, and `emitter_normal` likewise, if there is one.
    pub fn new(
        receiver: &'a [Vec3],
        front: Vec3,
        emitter: &'a [Vec3],
        emitter_normal: Option<Vec3>,
        touching: f64,
    ) -> Shaft<'a> {
        let mut walls = Vec::with_capacity(12);
        // Pieces that touch these two planes do not block.
        let plane = |normal: Vec3, points: &[Vec3]| {
            let offset = points
                .iter()
                .map(|p| -normal.dot(*p))
                .fold(f64::NEG_INFINITY, f64::max);
            Wall {
                normal: -normal,
                offset: offset - touching,
            }
        };
        walls.push(plane(front, receiver));
        walls.extend(emitter_normal.map(|n| plane(n, emitter)));
        side_walls(receiver, emitter, touching, &mut walls);
        side_walls(emitter, receiver, touching, &mut walls);
        Shaft {
            receiver,
            emitter,
            walls,
            bounds: Bounds::of(receiver.iter().chain(emitter)),
        }
    }

    /// False when a box lies outside the shaft's bounds or one of its walls.
    fn may_meet(&self, bounds: &Bounds) -> bool {
        let outside = |w: &Wall| -bounds.support(-w.normal) >= w.offset;
        bounds.overlaps(&self.bounds) && !self.walls.iter().any(outside)
    }

    /// True when the piece lies outside one of the walls.
    pub fn misses(&self, piece: &Piece) -> bool {
        self.walls
            .iter()
            .any(|w| piece.vertices.iter().all(|v| w.normal.dot(*v) >= w.offset))
    }

    /// True when every segment from receiver to emitter crosses the piece: those between the
    /// corners do, and all others cross its plane at a positive combination of those crossings.
    pub fn is_blocked_by(&self, piece: &Piece, touching: f64) -> bool {
        let origin = piece.vertices[0];
        let height = |p: &Vec3| piece.normal.dot(*p - origin);
        let side = height(&self.receiver[0]).signum();
        self.receiver.iter().all(|p| height(p) * side > touching)
            && self.emitter.iter().all(|p| height(p) * side < -touching)
            && self
                .receiver
                .iter()
                .all(|a| self.emitter.iter().all(|b| crosses(piece, *a, *b)))
    }
}

fn side_walls(edges: &[Vec3], tips: &[Vec3], slack: f64, walls: &mut Vec<Wall>) {
    if edges.len() < 2 {
        return;
    }
    for (i, &a) in edges.iter().enumerate() {
        let b = edges[(i + 1) % edges.len()];
        for &tip in tips {
            let normal = (b - a).cross(tip - a).normalized();
            if normal == Vec3::ZERO {
                continue;
            }
            let at = normal.dot(a);
            let (mut low, mut high) = (0.0_f64, 0.0_f64);
            for p in tips.iter().chain(edges) {
                let height = normal.dot(*p) - at;
                (low, high) = (smaller(low, height), greater(high, height));
                if low < -slack && high > slack {
                    break;
                }
            }
            if high <= slack && low < -slack {
                walls.push(Wall {
                    normal,
                    offset: at + high,
                });
            } else if low >= -slack && high > slack {
                walls.push(Wall {
                    normal: -normal,
                    offset: -at - low,
                });
            }
        }
    }
}

/// True when the segment from `a` to `b` crosses the convex piece, edges included, up to rounding.
fn crosses(piece: &Piece, a: Vec3, b: Vec3) -> bool {
    let direction = b - a;
    let (mut positive, mut negative) = (false, false);
    for (i, &p) in piece.vertices.iter().enumerate() {
        let q = piece.vertices[(i + 1) % piece.vertices.len()];
        // Six times the signed volume of the tetrahedron a, b, p, q: the side on which the line
        // passes.
        let volume = (p - a).cross(q - a).dot(direction);
        positive |= volume > 0.0;
        negative |= volume < 0.0;
        if positive && negative {
            return false;
        }
    }
    let origin = piece.vertices[0];
    piece.normal.dot(a - origin) * piece.normal.dot(b - origin) < 0.0
}

impl Hierarchy {
    /// Builds the hierarchy over the pieces by splitting at the median of the longest axis.
    pub fn new(surfaces: &Surfaces) -> Hierarchy {
        let bounds: Vec<Bounds> = surfaces
            .pieces
            .iter()
            .map(|p| Bounds::of(p.vertices.iter()))
            .collect();
        let mut hierarchy = Hierarchy {
            nodes: Vec::new(),
            order: (0..bounds.len()).collect(),
            bounds,
            touching: surfaces.touching(),
        };
        if !hierarchy.order.is_empty() {
            hierarchy.build(0, hierarchy.order.len());
        }
        hierarchy
    }

    fn build(&mut self, from: usize, to: usize) -> usize {
        let centre = |b: &Bounds| b.low + b.high;
        let all = &self.order[from..to];
        let start = self.bounds[all[0]];
        let bounds = all.iter().fold(start, |b, &i| b.union(self.bounds[i]));
        let centres = Bounds::of(all.iter().map(|&i| centre(&self.bounds[i])));
        let at = self.nodes.len();
        self.nodes.push(Node {
            bounds,
            leaf: from..to,
            children: [0, 0],
        });
        if to - from <= LEAF {
            return at;
        }
        let extent = centres.high - centres.low;
        let axis = if extent.x >= extent.y && extent.x >= extent.z {
            0
        } else if extent.y >= extent.z {
            1
        } else {
            2
        };
        let middle = (to - from) / 2;
        let keys = &self.bounds;
        self.order[from..to].select_nth_unstable_by(middle, |&a, &b| {
            let (a_key, b_key) = (centre(&keys[a])[axis], centre(&keys[b])[axis]);
            a_key.total_cmp(&b_key).then(a.cmp(&b))
        });
        let left = self.build(from, from + middle);
        let right = self.build(from + middle, to);
        self.nodes[at].leaf = from..from;
        self.nodes[at].children = [left, right];
        at
    }

    fn leaves(&self) -> Leaves<'_> {
        let mut stack = Vec::with_capacity(64);
        stack.extend((!self.nodes.is_empty()).then_some(0));
        Leaves {
            hierarchy: self,
            stack,
        }
    }

    /// True when any piece crosses the segment from `a` to `b`, except surfaces within `touching`
    /// of an end.
    pub fn blocked(&self, surfaces: &Surfaces, a: Vec3, b: Vec3) -> bool {
        let inverse = inverse(b - a);
        let blocks = |&i: &usize| blocks(&surfaces.pieces[i], a, b, self.touching);
        let mut leaves = self.leaves();
        while let Some(leaf) = leaves.next(|bounds| bounds.meets(a, inverse, 1.0)) {
            if leaf.iter().any(blocks) {
                return true;
            }
        }
        false
    }

    /// The first piece hit by the ray from `origin` along `direction` and the ray parameter; pieces
    /// whose plane contains the origin are ignored.
    pub fn first_hit(
        &self,
        surfaces: &Surfaces,
        origin: Vec3,
        direction: Vec3,
    ) -> Option<(usize, f64)> {
        let inverse = inverse(direction);
        let mut best: Option<(usize, f64)> = None;
        let mut leaves = self.leaves();
        let reach = |best: Option<(usize, f64)>| best.map_or(f64::INFINITY, |b| b.1);
        while let Some(leaf) = leaves.next(|bounds| bounds.meets(origin, inverse, reach(best))) {
            for &i in leaf {
                let piece = &surfaces.pieces[i];
                let height = piece.normal.dot(piece.vertices[0] - origin);
                if height.abs() <= self.touching {
                    continue;
                }
                let t = height / piece.normal.dot(direction);
                let nearer = best.is_none_or(|(j, s)| t < s || (t == s && i < j));
                if t > 0.0
                    && t.is_finite()
                    && nearer
                    && crosses(piece, origin, origin + direction * (2.0 * t))
                {
                    best = Some((i, t));
                }
            }
        }
        best
    }

    /// All pieces that may meet the shaft, by rising index.
    pub fn occluders(&self, surfaces: &Surfaces, shaft: &Shaft<'_>, found: &mut Vec<usize>) {
        found.clear();
        let mut leaves = self.leaves();
        while let Some(leaf) = leaves.next(|bounds| shaft.may_meet(bounds)) {
            for &i in leaf {
                let near = self.bounds[i].overlaps(&shaft.bounds);
                if near && !shaft.misses(&surfaces.pieces[i]) {
                    found.push(i);
                }
            }
        }
        found.sort_unstable();
    }
}

/// Inverse of each component of a direction.
fn inverse(direction: Vec3) -> Vec3 {
    Vec3 {
        x: 1.0 / direction.x,
        y: 1.0 / direction.y,
        z: 1.0 / direction.z,
    }
}

/// Depth-first traversal of the leaves of a hierarchy.
struct Leaves<'a> {
    hierarchy: &'a Hierarchy,
    stack: Vec<usize>,
}

impl<'a> Leaves<'a> {
    /// Pieces of the next leaf reached through boxes that `enters` accepts.
    fn next(&mut self, enters: impl Fn(&Bounds) -> bool) -> Option<&'a [usize]> {
        while let Some(at) = self.stack.pop() {
            let node = &self.hierarchy.nodes[at];
            if !enters(&node.bounds) {
                continue;
            }
            if !node.leaf.is_empty() {
                return Some(&self.hierarchy.order[node.leaf.clone()]);
            }
            self.stack.extend(node.children);
        }
        None
    }
}

/// True when the piece blocks the segment, its ends excluded.
pub fn blocks(piece: &Piece, a: Vec3, b: Vec3, touching: f64) -> bool {
    let origin = piece.vertices[0];
    let (ha, hb) = (piece.normal.dot(a - origin), piece.normal.dot(b - origin));
    ha * hb < 0.0 && ha.abs() > touching && hb.abs() > touching && crosses(piece, a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::rectangle;
    use footlight_show::geometry::vec3;
    use proptest::prelude::*;

    fn square(z: f64, half: f64) -> Vec<Vec3> {
        rectangle((-half, half), (-half, half), z).to_vec()
    }

    fn point() -> impl Strategy<Value = Vec3> {
        (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| vec3(x, y, z))
    }

    #[test]
    fn both_sides_block_and_ends_do_not() {
        let s = Surfaces::grey(vec![square(0.0, 1.0)]);
        let h = Hierarchy::new(&s);
        let (above, below) = (vec3(0.1, 0.2, 1.0), vec3(0.3, 0.1, -1.0));
        assert!(h.blocked(&s, above, below) && h.blocked(&s, below, above));
        assert!(!h.blocked(&s, above, vec3(0.1, 0.1, 0.0)));
        assert!(!h.blocked(&s, above, vec3(5.0, 0.0, -1.0)));
        let (piece, t) = h.first_hit(&s, above, vec3(0.0, 0.0, -2.0)).unwrap();
        assert_eq!(piece, 0);
        assert!((t - 0.5).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn hierarchy_agrees_with_testing_every_piece(
            triangles in prop::collection::vec((point(), point(), point()), 1..60),
            (a, b) in (point(), point()),
        ) {
            let s = Surfaces::grey(triangles.into_iter().map(|(p, q, r)| vec![p, q, r]).collect());
            let h = Hierarchy::new(&s);
            let every = s.pieces.iter().any(|p| blocks(p, a, b, s.touching()));
            prop_assert_eq!(h.blocked(&s, a, b), every);
        }

        /// The shaft's list contains every occluder of any segment between the two ends, and a
        /// piece reported to block the whole shaft blocks each segment.
        #[test]
        fn shafts_are_conservative(
            triangles in prop::collection::vec((point(), point(), point()), 1..40),
            (height, half) in (1.0..3.0, 0.05..2.0),
            samples in prop::collection::vec((0.01..0.99, 0.01..0.99, 0.01..0.99, 0.01..0.99), 12),
        ) {
            let s = Surfaces::grey(triangles.into_iter().map(|(p, q, r)| vec![p, q, r]).collect());
            let h = Hierarchy::new(&s);
            let receiver = square(-1.2, 0.3);
            let emitter: Vec<Vec3> = square(height, half).into_iter().rev().collect();
            let up = vec3(0.0, 0.0, 1.0);
            let shaft = Shaft::new(&receiver, up, &emitter, Some(-up), s.touching());
            let mut found = Vec::new();
            h.occluders(&s, &shaft, &mut found);
            let on = |q: &[Vec3], u: f64, v: f64| {
                q[0] + (q[1] - q[0]) * u + (q[3] - q[0]) * v
            };
            for (u, v, x, y) in samples {
                let (a, b) = (on(&receiver, u, v), on(&emitter, x, y));
                for (i, piece) in s.pieces.iter().enumerate() {
                    let blocked = blocks(piece, a, b, s.touching());
                    prop_assert!(!blocked || found.contains(&i));
                    prop_assert!(blocked || !shaft.is_blocked_by(piece, s.touching()));
                }
            }
        }
    }
}
