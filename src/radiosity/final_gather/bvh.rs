//! First hits and blocked segments among many triangles.
//!
//! A bounding-volume hierarchy of four children a node, split by the surface area heuristic over 16
//! bins (Wald 2007), with up to four triangles a leaf. Boxes and triangles are in single precision,
//! about the middle of the scene, four side by side in a vector. Of surfaces at the same distance the one that faces the ray is hit, then
//! the smaller facet. This module does not depend on light.

use crate::geometry::{Vec3, bounds};
use crate::radiosity::geometry::surface::Surfaces;
use crate::work::{Cancelled, Work};
use wide::f32x4;

/// Triangles in a leaf, and children of a node.
const WIDTH: usize = 4;
/// Bins along each axis.
const BINS: usize = 16;
/// Triangles from which on the halves are built on two threads.
const PARALLEL: usize = 4096;
/// Marks a child that is a leaf; the rest is its index.
const LEAF: u32 = 1 << 31;
/// No child, or no triangle.
const NONE: u32 = u32::MAX;
/// Levels after which triangles are no longer split by cost but in halves, so that the tree's depth
/// is bounded: 32 halvings are enough for any number.
const LEVELS: usize = 24;
/// Nodes that wait on a way down, at most: three for each node, which spans two levels or more.
const STACK: usize = 3 * (LEVELS + 32);

type Point = [f32; 3];

/// Boxes of four children.
#[derive(Clone, Debug)]
struct Node {
    /// Low and high of each axis: the side that a ray meets first is found by its index.
    sides: [[f32x4; 3]; 2],
    children: [u32; WIDTH],
}

/// Four triangles by a corner and two edges.
#[derive(Clone, Debug)]
struct Leaf {
    corner: [f32x4; 3],
    edges: [[f32x4; 3]; 2],
    facets: [u32; WIDTH],
}

/// The first surface that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the facet.
    pub facet: u32,
    /// In lengths of the ray's direction.
    pub distance: f32,
    /// Does its front face the ray?
    pub front: bool,
}

/// The hierarchy over all triangles of a scene.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    root: u32,
    /// Of the scene; boxes and triangles are relative to it.
    pub middle: Vec3,
    /// Distances that differ by less are the same, metres.
    touching: f32,
}

/// A triangle while the tree is built.
#[derive(Clone, Copy, Debug)]
struct Primitive {
    low: Point,
    high: Point,
    corners: [Point; 3],
    facet: u32,
}

impl Primitive {
    /// Twice its middle on an axis.
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

/// A box that grows.
#[derive(Clone, Copy, Debug)]
struct Extent {
    low: Point,
    high: Point,
}

impl Extent {
    const EMPTY: Extent = Extent {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    fn add(&mut self, low: Point, high: Point) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(low[axis]);
            self.high[axis] = self.high[axis].max(high[axis]);
        }
    }

    fn of(primitives: &[Primitive]) -> Extent {
        let mut all = Extent::EMPTY;
        primitives.iter().for_each(|p| all.add(p.low, p.high));
        all
    }

    /// Half its surface; zero of an empty one.
    fn area(&self) -> f32 {
        let side = |axis: usize| (self.high[axis] - self.low[axis]).max(0.0);
        side(0) * side(1) + side(1) * side(2) + side(2) * side(0)
    }
}

/// A binary tree, before four children are gathered into a node.
enum Tree {
    Leaf(Vec<Primitive>),
    Fork(Box<[(Extent, Tree); 2]>),
}

impl Bvh {
    /// Over all pieces of the surfaces, cut into triangles.
    ///
    /// # Errors
    /// On cancel.
    pub fn new(surfaces: &Surfaces, work: Work<'_>) -> Result<Bvh, Cancelled> {
        let [low, high] = bounds(surfaces.pieces.iter().flat_map(|p| &p.vertices));
        let middle = (low + high) * 0.5;
        let near = |v: Vec3| {
            let d = v - middle;
            [d.x as f32, d.y as f32, d.z as f32]
        };
        let mut primitives = Vec::with_capacity(2 * surfaces.pieces.len());
        for piece in &surfaces.pieces {
            let first = near(piece.vertices[0]);
            for pair in piece.vertices[1..].windows(2) {
                let corners = [first, near(pair[0]), near(pair[1])];
                let mut extent = Extent::EMPTY;
                corners.iter().for_each(|c| extent.add(*c, *c));
                primitives.push(Primitive {
                    low: extent.low,
                    high: extent.high,
                    corners,
                    facet: piece.facet as u32,
                });
            }
        }
        let mut bvh = Bvh {
            nodes: Vec::new(),
            leaves: Vec::new(),
            root: NONE,
            middle,
            touching: surfaces.touching() as f32,
        };
        if !primitives.is_empty() {
            let tree = build(&mut primitives, 0, work)?;
            drop(primitives);
            bvh.root = bvh.flatten(&tree);
        }
        Ok(bvh)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.leaves.len() * size_of::<Leaf>()
    }

    /// Adds a tree's nodes; returns the index of its root.
    fn flatten(&mut self, tree: &Tree) -> u32 {
        let fork = match tree {
            Tree::Leaf(primitives) => {
                self.leaves.push(leaf(primitives));
                return LEAF | (self.leaves.len() - 1) as u32;
            }
            Tree::Fork(fork) => fork,
        };
        let mut children: Vec<&(Extent, Tree)> = fork.iter().collect();
        while children.len() < WIDTH {
            // The largest child that has children gives way to them.
            let mut largest: Option<(usize, f32)> = None;
            for (i, (extent, child)) in children.iter().enumerate() {
                let larger = largest.is_none_or(|(_, most)| extent.area() > most);
                if matches!(child, Tree::Fork(_)) && larger {
                    largest = Some((i, extent.area()));
                }
            }
            let Some((at, _)) = largest else { break };
            if let Tree::Fork(pair) = &children.remove(at).1 {
                children.extend(pair.iter());
            }
        }
        let at = self.nodes.len();
        // An empty box is met by nothing.
        let [mut low, mut high] = [[[f32::INFINITY; WIDTH]; 3], [[f32::NEG_INFINITY; WIDTH]; 3]];
        for (lane, (extent, _)) in children.iter().enumerate() {
            for axis in 0..3 {
                low[axis][lane] = extent.low[axis] - self.touching;
                high[axis][lane] = extent.high[axis] + self.touching;
            }
        }
        self.nodes.push(Node {
            sides: [low, high].map(|side| side.map(f32x4::new)),
            children: [NONE; WIDTH],
        });
        for (lane, (_, child)) in children.into_iter().enumerate() {
            let index = self.flatten(child);
            self.nodes[at].children[lane] = index;
        }
        at as u32
    }

    /// The first surface on the ray from `origin` in the direction of `way`, of any length.
    pub fn first_hit(&self, origin: Vec3, way: Vec3) -> Option<Hit> {
        self.walk::<false>(origin, way, f32::INFINITY, |_| false)
    }

    /// The same, past what `passes`.
    pub fn first_hit_past(
        &self,
        origin: Vec3,
        way: Vec3,
        passes: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        self.walk::<false>(origin, way, f32::INFINITY, passes)
    }

    /// Does anything stand on the segment from `origin` by `way`, before its end?
    pub fn is_blocked(&self, origin: Vec3, way: Vec3) -> bool {
        self.walk::<true>(origin, way, 1.0, |_| false).is_some()
    }

    /// The same, without what `passes`.
    pub fn is_blocked_past(&self, origin: Vec3, way: Vec3, passes: impl Fn(&Hit) -> bool) -> bool {
        self.walk::<true>(origin, way, 1.0, passes).is_some()
    }

    #[inline(always)]
    fn walk<const ANY: bool>(
        &self,
        origin: Vec3,
        way: Vec3,
        reach: f32,
        passes: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let from = origin - self.middle;
        let origin = [from.x as f32, from.y as f32, from.z as f32];
        let way = [way.x as f32, way.y as f32, way.z as f32];
        // A ray within a box's plane: a number that is large but finite keeps 0 times it a number.
        let inverse = way.map(|d| {
            let over = 1.0 / d;
            if over.is_finite() { over } else { 1e30 }
        });
        let ray = Ray {
            origin: origin.map(f32x4::splat),
            way: way.map(f32x4::splat),
            inverse: inverse.map(f32x4::splat),
            first_side: inverse.map(|d| usize::from(d < 0.0)),
        };
        let tie = self.touching / length(way);
        let mut best: Option<Hit> = None;
        let mut nearest = reach;
        let mut stack = [(0u32, 0f32); STACK];
        let mut waiting = 0;
        let mut at = self.root;
        if at == NONE {
            return None;
        }
        loop {
            if at & LEAF == 0 {
                let node = &self.nodes[at as usize];
                let (mut met, enter) = node.enter(&ray, nearest + tie);
                // The nearest child is visited first, the others wait.
                let mut next: Option<(u32, f32)> = None;
                while met != 0 {
                    let lane = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let child = (node.children[lane], enter[lane]);
                    let later = match next {
                        Some(known) if known.1 <= child.1 => Some(child),
                        known => {
                            next = Some(child);
                            known
                        }
                    };
                    if let Some(later) = later
                        && let Some(place) = stack.get_mut(waiting)
                    {
                        *place = later;
                        waiting += 1;
                    }
                }
                if let Some((child, _)) = next {
                    at = child;
                    continue;
                }
            } else {
                let leaf = &self.leaves[(at & !LEAF) as usize];
                let (mut met, distances, determinants) = leaf.meet(&ray, nearest + tie);
                while met != 0 {
                    let lane = met.trailing_zeros() as usize;
                    met &= met - 1;
                    let distance = distances[lane];
                    // Another triangle of this leaf may be nearer.
                    if distance >= nearest + tie {
                        continue;
                    }
                    let hit = Hit {
                        facet: leaf.facets[lane],
                        distance,
                        front: determinants[lane] > 0.0,
                    };
                    if passes(&hit) {
                        continue;
                    }
                    if ANY {
                        if distance < reach {
                            return Some(hit);
                        }
                        continue;
                    }
                    let rank = |h: &Hit| (h.front, h.facet);
                    let wins = best
                        .as_ref()
                        .is_none_or(|b| distance < b.distance - tie || rank(&hit) > rank(b));
                    if wins {
                        best = Some(hit);
                        nearest = nearest.min(distance);
                    }
                }
            }
            loop {
                if waiting == 0 {
                    return best;
                }
                waiting -= 1;
                let (child, t) = stack[waiting];
                if t <= nearest + tie {
                    at = child;
                    break;
                }
            }
        }
    }
}

/// A ray, each number four times.
struct Ray {
    origin: [f32x4; 3],
    way: [f32x4; 3],
    inverse: [f32x4; 3],
    /// Of each axis the side of a box that it meets first: 0 the low one.
    first_side: [usize; 3],
}

impl Node {
    /// Which boxes a ray meets within `reach`, as bits, and where it enters them.
    #[inline(always)]
    fn enter(&self, ray: &Ray, reach: f32) -> (u32, [f32; WIDTH]) {
        let (mut enter, mut leave) = (f32x4::ZERO, f32x4::splat(reach));
        for axis in 0..3 {
            let first = ray.first_side[axis];
            let (o, i) = (ray.origin[axis], ray.inverse[axis]);
            enter = enter.fast_max((self.sides[first][axis] - o) * i);
            leave = leave.fast_min((self.sides[1 - first][axis] - o) * i);
        }
        (enter.simd_le(leave).to_bitmask(), enter.to_array())
    }
}

impl Leaf {
    /// Which triangles a ray meets within `reach`, as bits, where, and the determinants, positive
    /// where a front faces the ray (Möller and Trumbore 1997).
    #[inline(always)]
    fn meet(&self, ray: &Ray, reach: f32) -> (u32, [f32; WIDTH], [f32; WIDTH]) {
        let [e, f] = &self.edges;
        let p = wide_cross(&ray.way, f);
        let determinant = wide_dot(&p, e);
        let over = f32x4::ONE / determinant;
        let s = [0, 1, 2].map(|axis| ray.origin[axis] - self.corner[axis]);
        let u = over * wide_dot(&s, &p);
        let q = wide_cross(&s, e);
        let v = over * wide_dot(&ray.way, &q);
        let t = over * wide_dot(f, &q);
        let inside = u.simd_ge(f32x4::ZERO) & v.simd_ge(f32x4::ZERO) & (u + v).simd_le(f32x4::ONE);
        let within = t.simd_gt(f32x4::ZERO) & t.simd_lt(f32x4::splat(reach));
        let met = (inside & within).to_bitmask();
        (met, t.to_array(), determinant.to_array())
    }
}

fn wide_dot(a: &[f32x4; 3], b: &[f32x4; 3]) -> f32x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn wide_cross(a: &[f32x4; 3], b: &[f32x4; 3]) -> [f32x4; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: Point, b: Point) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: Point) -> f32 {
    dot(a, a).sqrt()
}

/// A leaf of up to four triangles; its other places are triangles of no size, which nothing meets.
fn leaf(primitives: &[Primitive]) -> Leaf {
    let mut numbers = [[[0.0; WIDTH]; 3]; 3];
    let mut facets = [NONE; WIDTH];
    for (lane, primitive) in primitives.iter().enumerate() {
        let [a, b, c] = primitive.corners;
        for axis in 0..3 {
            numbers[0][axis][lane] = a[axis];
            numbers[1][axis][lane] = b[axis] - a[axis];
            numbers[2][axis][lane] = c[axis] - a[axis];
        }
        facets[lane] = primitive.facet;
    }
    let [corner, first, second] = numbers.map(|vector| vector.map(f32x4::new));
    Leaf {
        corner,
        edges: [first, second],
        facets,
    }
}

fn build(primitives: &mut [Primitive], level: usize, work: Work<'_>) -> Result<Tree, Cancelled> {
    if primitives.len() <= WIDTH {
        return Ok(Tree::Leaf(primitives.to_vec()));
    }
    let parallel = primitives.len() > PARALLEL;
    if parallel {
        work.check()?;
    }
    let middle = if level < LEVELS {
        split(primitives)
    } else {
        primitives.len() / 2
    };
    let next = level + 1;
    let (left, right) = primitives.split_at_mut(middle);
    let extents = [Extent::of(left), Extent::of(right)];
    let (a, b) = if parallel {
        rayon::join(|| build(left, next, work), || build(right, next, work))
    } else {
        (build(left, next, work), build(right, next, work))
    };
    let [first, second] = extents;
    Ok(Tree::Fork(Box::new([(first, a?), (second, b?)])))
}

/// Orders the triangles into two groups; returns the size of the first.
fn split(primitives: &mut [Primitive]) -> usize {
    let half = primitives.len() / 2;
    let mut cheapest: Option<(f32, usize, f32)> = None;
    for axis in 0..3 {
        let middles = primitives.iter().map(|p| p.middle(axis));
        let (low, high) = middles.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), m| {
            (l.min(m), h.max(m))
        });
        if high - low <= 1e-7 {
            continue;
        }
        let scale = BINS as f32 / (high - low);
        let mut bins = [(0usize, Extent::EMPTY); BINS];
        for p in primitives.iter() {
            let bin = (((p.middle(axis) - low) * scale) as usize).min(BINS - 1);
            bins[bin].0 += 1;
            bins[bin].1.add(p.low, p.high);
        }
        // Cost of each split: areas times leaves.
        let leaves = |count: usize| count.div_ceil(WIDTH) as f32;
        let mut right = [0.0; BINS];
        let (mut count, mut extent) = (0, Extent::EMPTY);
        for bin in (1..BINS).rev() {
            count += bins[bin].0;
            extent.add(bins[bin].1.low, bins[bin].1.high);
            right[bin] = if count > 0 {
                extent.area() * leaves(count)
            } else {
                f32::INFINITY
            };
        }
        let (mut count, mut extent) = (0, Extent::EMPTY);
        for bin in 0..BINS - 1 {
            count += bins[bin].0;
            extent.add(bins[bin].1.low, bins[bin].1.high);
            let cost = extent.area() * leaves(count) + right[bin + 1];
            if count > 0 && cheapest.is_none_or(|(least, ..)| cost < least) {
                cheapest = Some((cost, axis, low + (bin + 1) as f32 / scale));
            }
        }
    }
    let Some((_, axis, border)) = cheapest else {
        return half;
    };
    let (mut start, mut end) = (0, primitives.len());
    while start < end {
        if primitives[start].middle(axis) < border {
            start += 1;
        } else {
            end -= 1;
            primitives.swap(start, end);
        }
    }
    if start == 0 || start == primitives.len() {
        half
    } else {
        start
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3;
    use crate::radiosity::final_gather::sampling::point;

    /// Squares of different sizes anywhere in a room.
    fn squares(count: u32) -> Surfaces {
        let square = |i: u32| {
            let ([x, y], [z, size], [turn, tilt]) = (point(i, 1), point(i, 2), point(i, 3));
            let middle = vec3(x, y, z) * 10.0;
            let way = vec3(turn - 0.5, tilt - 0.5, 0.3).normalized();
            let [u, v] = crate::geometry::frame(way).map(|side| side * (0.1 + size));
            vec![
                middle - u - v,
                middle + u - v,
                middle + u + v,
                middle - u + v,
            ]
        };
        Surfaces::grey((0..count).map(square).collect())
    }

    fn by_all(surfaces: &Surfaces, origin: Vec3, way: Vec3) -> Option<(usize, f64)> {
        let mut best: Option<(usize, f64)> = None;
        for piece in &surfaces.pieces {
            let facet = &surfaces.facets[piece.facet];
            let distance = -facet.height(origin) / facet.normal.dot(way);
            let nearer = best.is_none_or(|(_, known)| distance < known);
            if distance > 0.0 && nearer && piece.holds(origin + way * distance) {
                best = Some((piece.facet, distance));
            }
        }
        best
    }

    #[test]
    fn hits_are_those_of_a_search_through_all() {
        let surfaces = squares(700);
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        let mut met = 0;
        for i in 0..2000 {
            let ([x, y], [z, a], [b, c]) = (point(i, 4), point(i, 5), point(i, 6));
            let origin = vec3(x, y, z) * 12.0 - vec3(1.0, 1.0, 1.0);
            let way = vec3(a - 0.5, b - 0.5, c - 0.5) * 3.0;
            let hit = bvh.first_hit(origin, way);
            let expected = by_all(&surfaces, origin, way);
            // A ray along an edge may be told either way.
            let Some((facet, distance)) = expected else {
                assert!(hit.is_none(), "{i}");
                continue;
            };
            met += 1;
            let hit = hit.unwrap();
            assert_eq!(hit.facet as usize, facet, "{i}: {hit:?}, {distance}");
            let off = (f64::from(hit.distance) - distance).abs();
            assert!(off < 1e-5 * (10.0 + distance), "{i}: {off}");
            let front = surfaces.facets[facet].normal.dot(way) < 0.0;
            assert_eq!(hit.front, front, "{i}");
            for (share, blocked) in [(0.99, false), (1.01, true)] {
                let way = way * (distance * share);
                assert_eq!(bvh.is_blocked(origin, way), blocked, "{i} {share}");
            }
        }
        assert!(met > 500, "{met}");
    }

    /// Of two sheets back to back the one that faces the ray is hit, of two in one plane the
    /// smaller.
    #[test]
    fn of_surfaces_at_one_place_the_front_and_the_smaller_are_hit() {
        let sheet = |half: f64, up: bool| {
            let mut corners = vec![
                vec3(-half, -half, 0.0),
                vec3(half, -half, 0.0),
                vec3(half, half, 0.0),
                vec3(-half, half, 0.0),
            ];
            if !up {
                corners.reverse();
            }
            corners
        };
        let sheets = vec![sheet(1.0, true), sheet(1.0, false), sheet(0.5, true)];
        let surfaces = Surfaces::grey(sheets);
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        for (x, up, size) in [(0.8, true, 4.0), (0.8, false, 4.0), (0.2, true, 1.0)] {
            let height = if up { 3.0 } else { -3.0 };
            let hit = bvh.first_hit(vec3(x, 0.1, height), vec3(0.0, 0.0, -height));
            let hit = hit.unwrap();
            let facet = &surfaces.facets[hit.facet as usize];
            assert!(hit.front && (facet.area - size).abs() < 1e-9, "{x} {up}");
            assert_eq!(facet.normal.z > 0.0, up, "{x}");
        }
    }

    #[test]
    fn nothing_is_hit_in_an_empty_scene() {
        let bvh = Bvh::new(&Surfaces::grey(Vec::new()), Work::silent()).unwrap();
        assert_eq!(bvh.first_hit(Vec3::ZERO, vec3(1.0, 0.0, 0.0)), None);
        assert!(!bvh.is_blocked(Vec3::ZERO, vec3(1.0, 0.0, 0.0)));
    }
}
