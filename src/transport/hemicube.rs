//! The hemicube: which surfaces a point sees, weighted by form factor.
//!
//! After Cohen and Greenberg, "The Hemi-Cube" (1985), with two changes. The cube is turned about
//! the normal by an angle of its own, drawn from the sample's index: aliasing becomes noise
//! without pattern, several times smaller when summed. And only the table of delta form factors is
//! normalised to sum to 1, never a row, so that open scenes lose the light that leaves them. Item
//! buffers hold facets; where on the facet a pixel falls follows from its depth. This room knows
//! nothing of lights.

#![allow(
    clippy::indexing_slicing,
    reason = "buffers and tables have one entry for each pixel"
)]

use crate::geometry::Vec3;
use crate::raster::{Camera, ItemBuffer, NOTHING};
use crate::transport::direct::frame;
use crate::transport::mesh::{Mesh, NONE};
use crate::transport::surface::Surfaces;

/// The pixels' share of the hemisphere, one table for all hemicubes of a resolution.
#[derive(Clone, Debug)]
pub struct Table {
    resolution: usize,
    top: Vec<f32>,
    side: Vec<f32>,
}

impl Table {
    /// For `resolution` pixels along an edge, which must be even.
    pub fn new(resolution: usize) -> Table {
        let n = resolution as f64;
        let at = |i: usize| (i as f64 + 0.5) * 2.0 / n - 1.0;
        let mut top = Vec::new();
        let mut side = Vec::new();
        for j in 0..resolution {
            for i in 0..resolution {
                let (x, y) = (at(i), at(j));
                top.push((1.0 + x * x + y * y).powi(-2));
                if j < resolution / 2 {
                    let z = (resolution / 2 - 1 - j) as f64 * 2.0 / n + 1.0 / n;
                    side.push(z * (1.0 + x * x + z * z).powi(-2));
                }
            }
        }
        let total: f64 = top.iter().sum::<f64>() + 4.0 * side.iter().sum::<f64>();
        let scaled = |v: Vec<f64>| v.into_iter().map(|w| (w / total) as f32).collect();
        Table {
            resolution,
            top: scaled(top),
            side: scaled(side),
        }
    }
}

/// A row of form factors: elements by rising index and their shares.
pub type Row = Vec<(u32, f32)>;

/// Working memory for one thread.
#[derive(Debug)]
pub struct Hemicube<'a> {
    surfaces: &'a Surfaces,
    mesh: &'a Mesh,
    table: &'a Table,
    top: ItemBuffer,
    side: ItemBuffer,
    visible: Vec<usize>,
    /// Share of each element, and which have one.
    shares: Vec<f32>,
    touched: Vec<u32>,
}

/// A number in 0..1 that looks random, from an index (the finaliser of SplitMix64).
fn scatter(index: u64) -> f64 {
    let mut z = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

impl<'a> Hemicube<'a> {
    /// Hemicubes that look at `mesh`.
    pub fn new(surfaces: &'a Surfaces, mesh: &'a Mesh, table: &'a Table) -> Hemicube<'a> {
        let n = table.resolution;
        Hemicube {
            surfaces,
            mesh,
            table,
            top: ItemBuffer::new(n, n),
            side: ItemBuffer::new(n, n / 2),
            visible: Vec::new(),
            shares: vec![0.0; mesh.elements.len()],
            touched: Vec::new(),
        }
    }

    /// Form factors from `point` of `facet` to every element; `index` turns the cube.
    pub fn row(&mut self, facet: usize, point: Vec3, index: u64) -> Row {
        let normal = self.surfaces.facets[facet].normal;
        let [a, b] = frame(normal);
        let (sine, cosine) = (scatter(index) * std::f64::consts::FRAC_PI_2).sin_cos();
        let (u, v) = (a * cosine + b * sine, b * cosine - a * sine);
        self.gather_pieces(facet, point);
        let n = self.table.resolution as f64;
        let camera = |right, up, forward, top| Camera {
            origin: point,
            right,
            up,
            forward,
            left: -1.0,
            top,
            step_x: 2.0 / n,
            step_y: 2.0 / n,
        };
        self.face(&camera(u, v, normal, 1.0), true);
        for (right, forward) in [(u, v), (-v, u), (-u, -v), (v, -u)] {
            self.face(&camera(right, normal, forward, 1.0), false);
        }
        self.touched.sort_unstable();
        let shares = &mut self.shares;
        self.touched
            .drain(..)
            .map(|e| (e, std::mem::take(&mut shares[e as usize])))
            .collect()
    }

    /// Pieces that reach above the horizon; the facet's own plane is not among them.
    fn gather_pieces(&mut self, facet: usize, point: Vec3) {
        let normal = self.surfaces.facets[facet].normal;
        let touching = self.surfaces.touching();
        let above = |v: &Vec3| normal.dot(*v - point) > touching;
        self.visible.clear();
        for (i, piece) in self.surfaces.pieces.iter().enumerate() {
            if piece.facet != facet && piece.vertices.iter().any(above) {
                self.visible.push(i);
            }
        }
    }

    fn face(&mut self, camera: &Camera, is_top: bool) {
        let (buffer, weights) = if is_top {
            (&mut self.top, &self.table.top)
        } else {
            (&mut self.side, &self.table.side)
        };
        buffer.clear();
        for &i in &self.visible {
            let piece = &self.surfaces.pieces[i];
            // Outside one side of the face's pyramid: slopes of 1 to the left and right.
            let beyond = |d: Vec3| {
                piece
                    .vertices
                    .iter()
                    .all(|v| d.dot(*v - camera.origin) <= 0.0)
            };
            let outside = beyond(camera.forward + camera.right)
                || beyond(camera.forward - camera.right)
                || beyond(camera.forward - camera.up)
                || (is_top && beyond(camera.forward + camera.up));
            if !outside {
                buffer.draw(camera, &piece.vertices, piece.normal, piece.facet as u32);
            }
        }
        let width = self.table.resolution;
        let pixels = buffer
            .items()
            .iter()
            .zip(buffer.inverse_depths())
            .zip(weights);
        for (at, ((&item, &inverse), &weight)) in pixels.enumerate() {
            if item == NOTHING {
                continue;
            }
            let facet = &self.surfaces.facets[item as usize];
            let Some(grid) = &self.mesh.grids[item as usize] else {
                continue;
            };
            let ray = camera.ray((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
            if facet.normal.dot(ray) >= 0.0 {
                continue; // the black back
            }
            let element = self.mesh.seen[grid.cell(camera.origin + ray * (1.0 / inverse))];
            if element != NONE {
                let share = &mut self.shares[element as usize];
                if *share == 0.0 {
                    self.touched.push(element);
                }
                *share += weight;
            }
        }
    }
}
