//! First hits and blocked segments among many triangles.
//!
//! A bounding volume hierarchy with four children per node, split by the surface area heuristic
//! over 16 bins (Wald 2007), with up to four triangles per leaf. Boxes and triangles are in single
//! precision, relative to the centre of the scene, four in a SIMD vector. Among surfaces at the
//! same distance the one that faces the ray is hit, then the one with the smaller facet. This
//! module does not depend on light.

mod build;

use self::build::{Extent, Fork, LEVELS, Primitive, Tree};
use crate::surfaces::surface::Surfaces;
use arrayvec::ArrayVec;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, bounds};
use wide::f32x4;

/// Triangles in a leaf, and children of a node.
const WIDTH: usize = 4;
/// Flag of a child that is a leaf; the other bits are its index.
const LEAF: u32 = 1 << 31;
/// No child, or no triangle.
const NONE: u32 = u32::MAX;
/// Most nodes on the traversal stack: three for each node, which spans at least two levels.
const STACK: usize = 3 * (LEVELS + 32);

type Point = [f32; 3];

/// Boxes of four children.
#[derive(Clone, Debug)]
struct Node {
    /// Low and high of each axis, so that an index selects the side that a ray meets first.
    sides: [[f32x4; 3]; 2],
    children: [u32; WIDTH],
}

/// Four triangles, each as a corner and two edges.
#[derive(Clone, Debug)]
struct Leaf {
    corner: [f32x4; 3],
    edges: [[f32x4; 3]; 2],
    facets: [u32; WIDTH],
}

/// First intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the facet.
    pub facet: u32,
    /// In multiples of the ray's direction.
    pub distance: f32,
    /// True when the surface's front faces the ray.
    pub front: bool,
}

/// The hierarchy over all triangles of a scene.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    root: u32,
    /// Centre of the scene; boxes and triangles are relative to it.
    pub middle: Vec3,
    /// Distances that differ by less are equal, metres.
    touching: f32,
}

impl Bvh {
    /// Builds the hierarchy over all pieces of the surfaces, cut into triangles.
    ///
    /// # Errors
    /// On cancel.
    pub fn new(surfaces: &Surfaces, work: Work<'_>) -> Result<Bvh, Cancelled> {
        let [low, high] = bounds(surfaces.pieces.iter().flat_map(|p| p.vertices.iter()));
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
            let mut forks = vec![Fork::NONE; primitives.len() - 1];
            let tree = Tree::new(&mut primitives, &mut forks, work)?;
            bvh.root = bvh.flatten(tree);
            bvh.nodes.shrink_to_fit();
            bvh.leaves.shrink_to_fit();
        }
        Ok(bvh)
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.leaves.len() * size_of::<Leaf>()
    }

    /// Adds a tree's nodes; returns the index of its root.
    fn flatten(&mut self, tree: Tree<'_>) -> u32 {
        let Some(halves) = tree.halves() else {
            self.leaves.push(leaf(tree.primitives));
            return LEAF | (self.leaves.len() - 1) as u32;
        };
        let mut children = halves.to_vec();
        while children.len() < WIDTH {
            // Children of the largest inner child replace it.
            let mut largest: Option<(usize, f32)> = None;
            for (i, (extent, child)) in children.iter().enumerate() {
                let larger = largest.is_none_or(|(_, most)| extent.area() > most);
                if child.primitives.len() > WIDTH && larger {
                    largest = Some((i, extent.area()));
                }
            }
            let Some((at, _)) = largest else { break };
            let (_, largest) = children.remove(at);
            children.extend(largest.halves().into_iter().flatten());
        }
        let at = self.nodes.len();
        // No ray meets an empty box.
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

    /// First intersection of the ray from `origin` in direction `way`, of any length.
    pub fn first_hit(&self, origin: Vec3, way: Vec3) -> Option<Hit> {
        self.walk::<false>(origin, way, f32::INFINITY, |_| false)
    }

    /// Like [`Bvh::first_hit`], ignoring hits that `passes` accepts.
    pub fn first_hit_past(
        &self,
        origin: Vec3,
        way: Vec3,
        passes: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        self.walk::<false>(origin, way, f32::INFINITY, passes)
    }

    /// True when a surface blocks the segment from `origin` to `origin + way`.
    pub fn is_blocked(&self, origin: Vec3, way: Vec3) -> bool {
        self.walk::<true>(origin, way, 1.0, |_| false).is_some()
    }

    /// Like [`Bvh::is_blocked`], ignoring hits that `passes` accepts.
    pub fn is_blocked_past(
        &self,
        origin: Vec3,
        way: Vec3,
        passes: impl FnMut(&Hit) -> bool,
    ) -> bool {
        self.walk::<true>(origin, way, 1.0, passes).is_some()
    }

    #[inline(always)]
    fn walk<const ANY: bool>(
        &self,
        origin: Vec3,
        way: Vec3,
        reach: f32,
        mut passes: impl FnMut(&Hit) -> bool,
    ) -> Option<Hit> {
        let from = origin - self.middle;
        let origin = [from.x as f32, from.y as f32, from.z as f32];
        let way = [way.x as f32, way.y as f32, way.z as f32];
        // For a ray within a box's plane: a large finite number keeps the product with 0 from being
        // NaN.
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
        let mut waiting = ArrayVec::<(u32, f32), STACK>::new();
        let mut at = self.root;
        if at == NONE {
            return None;
        }
        loop {
            if at & LEAF == 0 {
                let node = &self.nodes[at as usize];
                let (mut met, enter) = node.enter(&ray, nearest + tie);
                // The nearest child is visited first; the others are pushed.
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
                    if let Some(later) = later {
                        waiting.push(later);
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
                let Some((child, t)) = waiting.pop() else {
                    return best;
                };
                if t <= nearest + tie {
                    at = child;
                    break;
                }
            }
        }
    }
}

/// A ray with each number repeated four times.
struct Ray {
    origin: [f32x4; 3],
    way: [f32x4; 3],
    inverse: [f32x4; 3],
    /// For each axis the side of a box that the ray meets first: 0 for low.
    first_side: [usize; 3],
}

impl Node {
    /// Boxes that a ray meets within `reach`, as bits, and the entry distances.
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
    /// Triangles that a ray meets within `reach`, as bits, with distances and determinants,
    /// positive where a front faces the ray (Möller and Trumbore 1997).
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

/// A leaf of up to four triangles, padded with degenerate triangles that no ray meets.
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

#[cfg(test)]
mod tests;
