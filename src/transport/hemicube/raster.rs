//! The hemicube rasteriser: all polygons around a point, drawn on the faces of a cube in single
//! precision.
//!
//! Shared corners are stored and transformed once. A face is an item buffer of facets: the nearest
//! wins, or the later one of two in one plane. Backs are drawn first, so that two coincident faces
//! back to back are visible from both sides, then large pieces before small ones. Backs and black
//! facets are drawn as [`BLACK`]: they occlude and send nothing. Invariants: every outline is
//! widened by a five-hundredth of a pixel, and a polygon is clipped nearer than any of its points on
//! the face can be, so that coordinates stay small. This module does not depend on elements or
//! lights.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered by this module; rows and columns are clamped to the sheet"
)]

use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::{Vec3, bounds, greater, smaller};
use std::collections::BTreeMap;

/// Nothing was drawn.
pub const NOTHING: u32 = u32::MAX;

/// A surface that sends no light.
pub const BLACK: u32 = u32::MAX - 1;

/// Pixels by which outlines are widened.
const WIDER: f32 = 2e-3;

/// Rounding error of inverse depths in single precision, relative to their terms.
const ROUNDING: f32 = 4e-7;

/// From this value on all floats are integers.
const WHOLE: f32 = 8_388_608.0;

/// The corners of all pieces.
#[derive(Clone, Debug)]
pub struct VertexBuffer {
    middle: Vec3,
    /// x, y and z of each corner, relative to the centre of the scene.
    corners: [Vec<f32>; 3],
    /// Start of each piece's corners in `loops`.
    starts: Vec<u32>,
    loops: Vec<u32>,
}

impl VertexBuffer {
    /// Collects the corners of a scene's pieces.
    pub fn new(surfaces: &Surfaces) -> VertexBuffer {
        let [low, high] = bounds(surfaces.pieces.iter().flat_map(|p| p.vertices.iter()));
        let mut out = VertexBuffer {
            middle: (low + high) * 0.5,
            corners: [Vec::new(), Vec::new(), Vec::new()],
            starts: vec![0],
            loops: Vec::new(),
        };
        let mut known = BTreeMap::new();
        for piece in &surfaces.pieces {
            for v in piece.vertices.iter() {
                let key = [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
                let next = out.corners[0].len() as u32;
                let at = *known.entry(key).or_insert(next);
                if at == next {
                    let local = *v - out.middle;
                    for (k, list) in out.corners.iter_mut().enumerate() {
                        list.push(local[k] as f32);
                    }
                }
                out.loops.push(at);
            }
            out.starts.push(out.loops.len() as u32);
        }
        out
    }
}

/// First column of a row whose centre is above the horizon, on a face of `edge` pixels a side, of
/// which only a triangle is.
pub fn lead(edge: usize, row: usize) -> usize {
    edge - row
}

/// Item buffer of a face, from slope -2 to 1 both ways.
#[derive(Clone, Debug)]
pub struct FaceBuffer {
    resolution: usize,
    /// Facet of each pixel, [`BLACK`] or [`NOTHING`].
    pub items: Vec<u32>,
    /// Inverse depth along the face's axis; 0 where nothing was drawn.
    pub inverse_depths: Vec<f32>,
    left: Vec<f32>,
    right: Vec<f32>,
}

impl FaceBuffer {
    /// A buffer of `resolution` x `resolution` pixels.
    pub fn new(resolution: usize) -> FaceBuffer {
        FaceBuffer {
            resolution,
            items: vec![NOTHING; resolution * resolution],
            inverse_depths: vec![0.0; resolution * resolution],
            left: vec![0.0; resolution],
            right: vec![0.0; resolution],
        }
    }

    /// Clears the buffer.
    pub fn clear(&mut self) {
        self.items.fill(NOTHING);
        self.inverse_depths.fill(0.0);
    }

    /// First pixel whose centre is at `x` or beyond, from 0 to the resolution.
    fn from(&self, x: f32) -> usize {
        let x = smaller(greater(x, 0.0), self.resolution as f32);
        // At this magnitude floats are integers: the sum is rounded to one, in its low bits.
        let whole = (x + WHOLE).to_bits() - WHOLE.to_bits();
        whole as usize
    }

    /// Draws a convex outline in pixels. Its inverse depth is `plane[0] + plane[1] column +
    /// plane[2] row` at the centres of pixels, to within `slack`.
    fn draw(&mut self, vertices: &[[f32; 2]], plane: [f32; 3], slack: f32, item: u32) {
        let (mut low, mut high) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for p in vertices {
            for k in 0..2 {
                (low[k], high[k]) = (smaller(low[k], p[k]), greater(high[k], p[k]));
            }
        }
        let (first, top) = (self.from(low[0] - WIDER), self.from(low[1] - WIDER));
        let (end, bottom) = (self.from(high[0] + WIDER), self.from(high[1] + WIDER));
        // Most pieces of a detailed scene lie between the centres of pixels or below the horizon.
        if top >= bottom || first >= end || end <= lead(self.resolution, bottom - 1) {
            return;
        }
        self.left[top..bottom].fill(f32::INFINITY);
        self.right[top..bottom].fill(f32::NEG_INFINITY);
        let mut a = vertices[vertices.len() - 1];
        for &b in vertices {
            self.scan(a, b);
            a = b;
        }
        for row in top..bottom {
            let (left, right) = (self.left[row] - WIDER, self.right[row] + WIDER);
            let lead = lead(self.resolution, row);
            let (from, to) = (self.from(left).max(lead), self.from(right));
            if from >= to {
                continue;
            }
            let base = plane[0] + plane[2] * row as f32;
            let range = row * self.resolution + from..row * self.resolution + to;
            let items = &mut self.items[range.clone()];
            let inverse_depths = &mut self.inverse_depths[range][..items.len()];
            for i in 0..items.len() {
                let inverse = base + plane[1] * (from + i) as i32 as f32;
                let wins = (inverse > 0.0) & (inverse + slack >= inverse_depths[i]);
                inverse_depths[i] = if wins { inverse } else { inverse_depths[i] };
                items[i] = if wins { item } else { items[i] };
            }
        }
    }

    /// Widens the ends of the rows that an edge crosses.
    fn scan(&mut self, a: [f32; 2], b: [f32; 2]) {
        let (a, b) = if a[1] < b[1] { (a, b) } else { (b, a) };
        let rise = b[1] - a[1];
        let slope = if rise > 1e-6 {
            (b[0] - a[0]) / rise
        } else {
            0.0
        };
        for row in self.from(a[1] - WIDER)..self.from(b[1] + WIDER) {
            // An edge along the row: both ends count.
            let (x, z) = if rise > 1e-6 {
                let along = smaller(greater(row as f32 + 0.5 - a[1], 0.0), rise);
                let x = a[0] + slope * along;
                (x, x)
            } else {
                (a[0], b[0])
            };
            self.left[row] = smaller(self.left[row], smaller(x, z));
            self.right[row] = greater(self.right[row], greater(x, z));
        }
    }
}

/// A piece above the horizon.
#[derive(Clone, Copy, Debug)]
struct VisiblePiece {
    piece: u32,
    item: u32,
    /// Faces on which it may appear, one bit each.
    faces: u8,
    /// Distance of its plane, and its normal divided by it, along the three axes.
    distance: f32,
    plane: [f32; 3],
}

/// Pieces around one point, in the axes of its cube.
#[derive(Debug)]
pub struct HemicubeRasterizer<'a> {
    vertices: &'a VertexBuffer,
    turned: [Vec<f32>; 3],
    /// [`sides`] of each corner.
    sides: Vec<u8>,
    /// Corners on the current face, in pixels; meaningless behind it.
    projected: [Vec<f32>; 2],
    /// Backs and fronts, drawn in this order.
    seen: [Vec<VisiblePiece>; 2],
    flat: Vec<[f32; 2]>,
}

/// A point lies on the face of its largest coordinate, so a polygon is not on a face if another
/// coordinate is larger at all its corners. For each face, the bits of [`sides`].
const REJECTED: [u8; 3] = [0b100_001, 0b000_110, 0b011_000];

fn sides([x, y, z]: [f32; 3]) -> u8 {
    let bit = |b: bool, k: u8| u8::from(b) << k;
    bit(x < y, 0) | bit(y < x, 1) | bit(y < z, 2) | bit(z < y, 3) | bit(z < x, 4) | bit(x < z, 5)
}

impl<'a> HemicubeRasterizer<'a> {
    /// Working memory for a scene.
    pub fn new(vertices: &'a VertexBuffer) -> HemicubeRasterizer<'a> {
        let count = vertices.corners[0].len();
        HemicubeRasterizer {
            vertices,
            turned: [vec![0.0; count], vec![0.0; count], vec![0.0; count]],
            sides: vec![0; count],
            projected: [vec![0.0; count], vec![0.0; count]],
            seen: [Vec::new(), Vec::new()],
            flat: Vec::new(),
        }
    }

    /// Transforms everything into the `axes` of a cube at `point` of `facet`, whose sum points
    /// along the facet's normal, and keeps the pieces that rise above the facet's plane.
    pub fn set_viewpoint(
        &mut self,
        surfaces: &Surfaces,
        facet: usize,
        point: Vec3,
        axes: [Vec3; 3],
    ) {
        let local = point - self.vertices.middle;
        let [px, py, pz] = [local.x as f32, local.y as f32, local.z as f32];
        let [cx, cy, cz] = &self.vertices.corners;
        for (axis, out) in axes.iter().zip(&mut self.turned) {
            let [ax, ay, az] = [axis.x as f32, axis.y as f32, axis.z as f32];
            for (((t, x), y), z) in out.iter_mut().zip(cx).zip(cy).zip(cz) {
                *t = ax * (x - px) + ay * (y - py) + az * (z - pz);
            }
        }
        let [tx, ty, tz] = &self.turned;
        for (((out, x), y), z) in self.sides.iter_mut().zip(tx).zip(ty).zip(tz) {
            *out = sides([*x, *y, *z]);
        }
        let touching = surfaces.touching();
        let horizon = (touching * 3.0_f64.sqrt()) as f32;
        self.seen.iter_mut().for_each(Vec::clear);
        for (i, piece) in surfaces.pieces.iter().enumerate() {
            let (mut outside, mut highest) = (u8::MAX, f32::NEG_INFINITY);
            for &c in self.corners(i) {
                let p = self.corner(c);
                outside &= self.sides[c as usize];
                highest = greater(highest, p[0] + p[1] + p[2]);
            }
            if piece.facet == facet || highest <= horizon {
                continue;
            }
            let faces = (0..3).filter(|&k| outside & REJECTED[k] == 0);
            let faces = faces.fold(0_u8, |sum, k| sum | 1 << k);
            let distance = piece.normal.dot(piece.vertices[0] - point);
            if faces == 0 || distance.abs() <= touching * 1e-3 {
                continue; // seen edge on
            }
            let is_back = distance > 0.0;
            let black = is_back || surfaces.facets[piece.facet].is_black();
            self.seen[usize::from(!is_back)].push(VisiblePiece {
                piece: i as u32,
                item: if black { BLACK } else { piece.facet as u32 },
                faces,
                distance: distance.abs() as f32,
                plane: axes.map(|axis| (piece.normal.dot(axis) / distance) as f32),
            });
        }
    }

    fn corners(&self, piece: usize) -> &'a [u32] {
        let starts = &self.vertices.starts;
        &self.vertices.loops[starts[piece] as usize..starts[piece + 1] as usize]
    }

    fn corner(&self, c: u32) -> [f32; 3] {
        let c = c as usize;
        [self.turned[0][c], self.turned[1][c], self.turned[2][c]]
    }

    /// Draws the kept pieces on the face along axis 0, 1 or 2; the next axis points right and the
    /// one after it up, both from slope -2 to 1.
    pub fn draw(&mut self, face: usize, buffer: &mut FaceBuffer) {
        let scale = buffer.resolution as f32 / 3.0;
        let (f, r, u) = (face, (face + 1) % 3, (face + 2) % 3);
        self.project([f, r, u], scale);
        let counts = [0, 1].map(|side| self.seen[side].len());
        for (side, k) in [0, 1]
            .iter()
            .flat_map(|&s| (0..counts[s]).map(move |k| (s, k)))
        {
            let seen = self.seen[side][k];
            if seen.faces & 1 << face == 0 {
                continue;
            }
            // Points of the plane on the face are deeper than its distance over root 6.
            let near = 0.4 * seen.distance;
            let whole = self.gather(seen.piece as usize, f, near);
            if !whole {
                self.flatten(seen.piece as usize, [f, r, u], near, scale);
            }
            if self.flat.len() < 3 {
                continue;
            }
            let step = 1.0 / scale;
            let [pf, pr, pu] = [seen.plane[f], seen.plane[r], seen.plane[u]];
            let middle = 0.5 * step - 2.0;
            let plane = [pf + (pr + pu) * middle, pr * step, pu * step];
            let slack = ROUNDING * (pf.abs() + pr.abs() + pu.abs());
            buffer.draw(&self.flat, plane, slack, seen.item);
        }
    }

    /// Projects every corner once, several per instruction.
    fn project(&mut self, [f, r, u]: [usize; 3], scale: f32) {
        let shift = 2.0 * scale;
        let depths = &self.turned[f];
        for (out, from) in self.projected.iter_mut().zip([r, u]) {
            for ((out, x), depth) in out.iter_mut().zip(&self.turned[from]).zip(depths) {
                *out = x * (scale / depth) + shift;
            }
        }
    }

    /// Copies a piece entirely deeper than `near` into `flat`; returns false if the piece must be
    /// cut.
    fn gather(&mut self, piece: usize, face: usize, near: f32) -> bool {
        let corners = self.corners(piece);
        let depths = &self.turned[face];
        if corners.iter().any(|c| depths[*c as usize] <= near) {
            return false;
        }
        let [x, y] = &self.projected;
        let places = corners.iter().map(|c| [x[*c as usize], y[*c as usize]]);
        self.flat.clear();
        self.flat.extend(places);
        true
    }

    /// Clips a piece to depths beyond `near`, into `flat`, in pixels.
    fn flatten(&mut self, piece: usize, [f, r, u]: [usize; 3], near: f32, scale: f32) {
        self.flat.clear();
        let corners = self.corners(piece);
        let project = |p: [f32; 3]| {
            let each = scale / p[f];
            [p[r] * each + 2.0 * scale, p[u] * each + 2.0 * scale]
        };
        let Some(&last) = corners.last() else { return };
        let mut a = self.corner(last);
        for &c in corners {
            let b = self.corner(c);
            if (a[f] > near) != (b[f] > near) {
                let share = (near - a[f]) / (b[f] - a[f]);
                let mut cut = [0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * share);
                cut[f] = near;
                self.flat.push(project(cut));
            }
            if b[f] > near {
                self.flat.push(project(b));
            }
            a = b;
        }
    }
}
