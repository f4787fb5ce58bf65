//! Hemicubes (as cubic tetrahedra): form factors from a point to the elements.
//!
//! After Cohen and Greenberg, "The Hemi-Cube" (1985), in the form of Beran-Koehn and Pavicic, "A
//! Cubic Tetrahedral Adaptation of the Hemi-Cube Algorithm" (1991): a corner of the cube points
//! along the normal, so that three faces cover the hemisphere as triangles above the horizon, from
//! slope -2 to 1. Each cube is rotated about the normal by a pseudo-random angle, which turns
//! aliasing into noise that averages out. Only the table of pixel form factors is normalised to sum
//! to 1, never a row, so that open scenes lose the light that leaves them; in a closed room a row
//! sums to 1, as outlines overlap. This module does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "buffers and tables have one entry for each pixel, corner, facet or element"
)]

use crate::hemicube::mesh::grid::Grid;
use crate::hemicube::mesh::{Mesh, NONE, PointAboveFacet};
use crate::hemicube::raster::{BLACK, FaceBuffer, HemicubeRasterizer, VertexBuffer, lead};
use crate::surfaces::hierarchy::SceneGeometry;
use footlight_show::geometry::{Vec3, frame};
use footlight_show::hash::{GOLDEN, mix};

/// Form factors of the pixels, one table for all faces of a resolution.
#[derive(Clone, Debug)]
pub struct FormFactorTable {
    resolution: usize,
    weights: Vec<f32>,
    /// Form factors times the depth of the pixel's centre over its distance.
    nearness: Vec<f32>,
}

/// Points along a pixel's side at which its form factor is averaged.
const FINE: usize = 4;

impl FormFactorTable {
    /// For `resolution` pixels along the edge of a cube, which is two thirds of that of a face.
    pub fn new(resolution: usize) -> FormFactorTable {
        let resolution = resolution * 3 / 2;
        let n = (resolution * FINE) as f64;
        let at = |i: usize| (i as f64 + 0.5) * 3.0 / n - 2.0;
        let density = |x: f64, y: f64| (1.0 + x + y).max(0.0) / (1.0 + x * x + y * y).powi(2);
        let pixel = |column: usize, row: usize| -> f64 {
            // A pixel with its centre below the horizon may see nothing: its share is distributed
            // over all pixels.
            if column < lead(resolution, row) {
                return 0.0;
            }
            let fine = (0..FINE * FINE).map(|k| (k % FINE, k / FINE));
            fine.map(|(i, j)| density(at(column * FINE + i), at(row * FINE + j)))
                .sum()
        };
        let raw: Vec<f64> = (0..resolution * resolution)
            .map(|k| pixel(k % resolution, k / resolution))
            .collect();
        let total = 3.0 * raw.iter().sum::<f64>();
        let step = 3.0 / resolution as f64;
        let slant = |k: usize| {
            let [x, y] = [k % resolution, k / resolution].map(|i| (i as f64 + 0.5) * step - 2.0);
            (1.0 + x * x + y * y).sqrt()
        };
        let nearness = raw.iter().enumerate();
        FormFactorTable {
            resolution,
            nearness: nearness
                .map(|(k, w)| (w / total / slant(k)) as f32)
                .collect(),
            weights: raw.iter().map(|w| (w / total) as f32).collect(),
        }
    }
}

/// A row of form factors: elements and their shares, each element once.
pub type Row = Vec<(u32, f32)>;

/// Proximity of the visible surfaces, and the share of the hemisphere that elements cover.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceProximity {
    /// Mean inverse distance of the visible surfaces over the hemisphere, weighted by form factor,
    /// black surfaces included (1/m); a direction without a surface counts as 0.
    pub mean_inverse_distance: f32,
    /// Sum of the form factors to elements, 0 to 1; black surfaces and open directions contribute
    /// none.
    pub form_factor_sum: f32,
}

impl SurfaceProximity {
    /// Inverse of the distance R over which reflected irradiance changes by approximately its own
    /// value (1/m), see `super::interpolation`. It is 0 when no surface is visible, and infinite
    /// when all visible surfaces are black, as elements may become visible nearby.
    pub fn inverse_change_distance(&self) -> f32 {
        if self.mean_inverse_distance > 0.0 {
            self.mean_inverse_distance / self.form_factor_sum
        } else {
            0.0
        }
    }
}

/// A facet's grid relative to a point: cells are `point + slopes . ray / inverse depth`.
#[derive(Clone, Copy, Debug, Default)]
struct PlacedGrid {
    /// Identifies the hemicube for which it was placed.
    stamp: u64,
    slopes: [[f32; 3]; 2],
    /// The point, above the facet.
    point: PointAboveFacet,
    /// Growth of inverse depth along each axis.
    nearness: [f32; 3],
}

/// Sub-samples of a pixel that shows a split cell or its neighbour, in pixels from its centre. A
/// lamp splits the cells of the wall behind it, so the brightest elements are the smallest: one
/// sample a pixel would miss or overrate them.
const SUB_SAMPLES: [[f32; 2]; 4] = [[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]];

/// Most cells between two places that are tested for surfaces on them: more would take as long as a
/// ray.
const MAX_CELLS_BETWEEN: usize = 9;

/// Least inverse depth of a place relative to that of its pixel's centre: the place may lie beyond
/// the facet's horizon.
const MIN_INVERSE_DEPTH: f32 = 0.1;

/// A facet's grid relative to a row of pixels.
#[derive(Clone, Copy, Debug, Default)]
struct GridRow {
    point: PointAboveFacet,
    /// Slopes of a ray, in cells, at the row's start and along the two sides of the face.
    start: [f32; 2],
    slopes: [[f32; 2]; 2],
    /// Growth of inverse depth along the two sides.
    nearness: [f32; 2],
    /// Far rim of the last cell along the two sides of the grid, and the first cell.
    counts: [f32; 2],
    first: usize,
}

impl GridRow {
    /// For the row at `y` of a face with axes `forward`, `right` and `up`.
    fn new(placed: PlacedGrid, grid: &Grid, [forward, right, up]: [usize; 3], y: f32) -> GridRow {
        GridRow {
            point: placed.point,
            start: placed.slopes.map(|s| s[forward] + s[up] * y),
            slopes: placed.slopes.map(|s| [s[right], s[up]]),
            nearness: [right, up].map(|k| placed.nearness[k]),
            counts: grid.counts.map(|c| c as f32 - 1e-3),
            first: grid.first,
        }
    }

    /// Place seen at `x` on the face and `dy` from the row, at a depth.
    #[inline(always)]
    fn place(&self, [x, dy]: [f32; 2], depth: f32) -> [f32; 2] {
        let along = |k: usize| {
            let ray = self.start[k] + self.slopes[k][0] * x + self.slopes[k][1] * dy;
            // The outermost cells take places that rounding moves beyond them.
            (self.point.place[k] + ray * depth)
                .max(0.0)
                .min(self.counts[k])
        };
        [along(0), along(1)]
    }

    /// The cell of a place.
    #[inline(always)]
    fn cell(&self, [u, v]: [f32; 2]) -> usize {
        self.first + v as usize * (self.counts[0] as usize + 1) + u as usize
    }

    /// Cells in the rectangle between two places; `None` when there are too many to test.
    fn between(&self, [a, b]: [[f32; 2]; 2]) -> Option<impl Iterator<Item = usize> + use<>> {
        let range = |k: usize| a[k].min(b[k]) as usize..=a[k].max(b[k]) as usize;
        let (columns, rows) = (range(0), range(1));
        let (first, line) = (self.first, self.counts[0] as usize + 1);
        let count = (1 + columns.end() - columns.start()) * (1 + rows.end() - rows.start());
        let cells = rows.flat_map(move |j| columns.clone().map(move |i| first + j * line + i));
        (count <= MAX_CELLS_BETWEEN).then_some(cells)
    }

    /// Increase of the inverse depth at an offset from a pixel's centre.
    #[inline(always)]
    fn nearer(&self, [dx, dy]: [f32; 2]) -> f32 {
        self.nearness[0] * dx + self.nearness[1] * dy
    }
}

/// Working memory of one thread.
#[derive(Debug)]
pub struct Hemicube<'a> {
    setting: SceneGeometry<'a>,
    mesh: &'a Mesh,
    table: &'a FormFactorTable,
    rasterizer: HemicubeRasterizer<'a>,
    buffer: FaceBuffer,
    placed: Vec<PlacedGrid>,
    stamp: u64,
    /// [`SUB_SAMPLES`] except in tests.
    places: [[f32; 2]; 4],
    /// Share of each element, and a bit for each element with a share.
    shares: Vec<f32>,
    touched: Vec<u64>,
}

/// Pseudo-random number in 0..1 that depends on `index` alone.
pub fn hash_to_unit(index: u64) -> f64 {
    let mixed = mix(index.wrapping_add(1).wrapping_mul(GOLDEN));
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}

/// Three orthogonal unit vectors whose sum points along `normal`, rotated about it by `turn`, 0 to
/// 1, of the third of a circle after which they repeat.
fn corner(normal: Vec3, turn: f64) -> [Vec3; 3] {
    let [a, b] = frame(normal);
    let third = std::f64::consts::TAU / 3.0;
    [0.0, 1.0, 2.0].map(|k| {
        let (sine, cosine) = ((turn + k) * third).sin_cos();
        normal * (1.0 / 3.0_f64.sqrt()) + (a * cosine + b * sine) * (2.0 / 3.0_f64).sqrt()
    })
}

impl<'a> Hemicube<'a> {
    /// For the elements of `mesh`; `vertices` are those of the scene.
    pub fn new(
        setting: SceneGeometry<'a>,
        vertices: &'a VertexBuffer,
        mesh: &'a Mesh,
        table: &'a FormFactorTable,
    ) -> Hemicube<'a> {
        Hemicube {
            setting,
            mesh,
            table,
            rasterizer: HemicubeRasterizer::new(vertices),
            buffer: FaceBuffer::new(table.resolution),
            placed: vec![PlacedGrid::default(); setting.surfaces.facets.len()],
            stamp: 0,
            places: SUB_SAMPLES,
            shares: vec![0.0; mesh.elements.len()],
            touched: vec![0; mesh.elements.len().div_ceil(64)],
        }
    }

    /// Form factors from `point` of `facet` to every element; `turn`, 0 to 1, rotates the cube.
    pub fn row(&mut self, facet: usize, point: Vec3, turn: f64) -> Row {
        let mut row = Row::new();
        self.visit(facet, point, turn, |element, share| {
            row.push((element, share))
        });
        row
    }

    /// Passes each element with a form factor, after haze, to `take`, once and in ascending order.
    pub fn visit(
        &mut self,
        facet: usize,
        point: Vec3,
        turn: f64,
        mut take: impl FnMut(u32, f32),
    ) -> SurfaceProximity {
        let surfaces = self.setting.surfaces;
        let axes = corner(surfaces.facets[facet].normal, turn);
        self.stamp += 1;
        self.rasterizer.set_viewpoint(surfaces, facet, point, axes);
        let mut mean_inverse_distance = 0.0;
        for face in 0..3 {
            self.buffer.clear();
            self.rasterizer.draw(face, &mut self.buffer);
            mean_inverse_distance += self.sum_of_inverse_distances();
            self.resolve(face, point, axes);
        }
        let mut form_factor_sum = 0.0;
        for (first, word) in (0..).step_by(64).zip(&mut self.touched) {
            let mut bits = std::mem::take(word);
            while bits != 0 {
                let e = first + bits.trailing_zeros();
                bits &= bits - 1;
                let share = std::mem::take(&mut self.shares[e as usize]);
                form_factor_sum += share;
                let clear = match surfaces.haze {
                    None => 1.0,
                    Some(_) => {
                        let way = self.mesh.elements[e as usize].centre - point;
                        surfaces.clearness(way.length()) as f32
                    }
                };
                take(e, clear * share);
            }
        }
        SurfaceProximity {
            mean_inverse_distance,
            form_factor_sum,
        }
    }

    /// Sum over a face of each pixel's form factor over the distance of its surface (1/m); pixels
    /// below the horizon have weight 0.
    fn sum_of_inverse_distances(&self) -> f32 {
        let depths = self.buffer.inverse_depths.iter();
        depths.zip(&self.table.nearness).map(|(d, n)| d * n).sum()
    }

    /// Adds the form factor of each pixel of a face to its visible element.
    fn resolve(&mut self, face: usize, point: Vec3, axes: [Vec3; 3]) {
        let n = self.table.resolution;
        let step = 3.0 / n as f32;
        let turned = [0, 1, 2].map(|k| (face + k) % 3);
        let places = self.places.map(|place| place.map(|d| d * step));
        for row in 0..n {
            let y = (row as f32 + 0.5) * step - 2.0;
            let (mut current, mut grid_row) = (BLACK, GridRow::default());
            for column in lead(n, row)..n {
                let at = row * n + column;
                let item = self.buffer.items[at];
                if item >= BLACK {
                    continue;
                }
                if item != current {
                    let Some(grid) = &self.mesh.grids[item as usize] else {
                        continue;
                    };
                    current = item;
                    grid_row =
                        GridRow::new(self.place(item as usize, point, axes), grid, turned, y);
                }
                let x = (column as f32 + 0.5) * step - 2.0;
                let inverse = self.buffer.inverse_depths[at];
                let middle = grid_row.place([x, 0.0], 1.0 / inverse);
                let home = grid_row.cell(middle);
                let weight = self.table.weights[at];
                if let Some(element) = self.mesh.element_for_display_if_uncut(home) {
                    self.add_to_element(element, weight);
                    continue;
                }
                let mut depths = [0.0; 4];
                let mut around = [[0.0; 2]; 4];
                let mut cells = [home; 4];
                for (i, &[dx, dy]) in places.iter().enumerate() {
                    let nearer = inverse + grid_row.nearer([dx, dy]);
                    depths[i] = 1.0 / nearer.max(MIN_INVERSE_DEPTH * inverse);
                    around[i] = grid_row.place([x + dx, dy], depths[i]);
                    cells[i] = grid_row.cell(around[i]);
                }
                let own = self.mesh.element_for_display(home, middle);
                if self.mesh.is_uncut(home) && cells == [home; 4] {
                    self.add_to_element(own, weight);
                    continue;
                }
                for i in 0..4 {
                    let element = self.mesh.element_for_display(cells[i], around[i]);
                    // A sub-sample hidden by a surface on the facet takes the pixel's centre.
                    let way = [middle, around[i]];
                    let known = || {
                        self.mesh
                            .occludes(grid_row.between(way)?, way, grid_row.point)
                    };
                    let is_hidden = || match known() {
                        Some(hidden) => hidden,
                        None => {
                            let [dx, dy] = places[i];
                            let [forward, right, up] = turned.map(|k| axes[k]);
                            let ray = forward + right * f64::from(x + dx) + up * f64::from(y + dy);
                            let to = point + ray * f64::from(depths[i]);
                            let SceneGeometry {
                                surfaces,
                                hierarchy,
                            } = self.setting;
                            hierarchy.blocked(surfaces, point, to)
                        }
                    };
                    let hidden = element != own && is_hidden();
                    self.add_to_element(if hidden { own } else { element }, weight / 4.0);
                }
            }
        }
    }

    /// Adds to the share of `element`, unless it marks black or nothing.
    #[inline(always)]
    fn add_to_element(&mut self, element: u32, weight: f32) {
        if element != NONE {
            self.shares[element as usize] += weight;
            self.touched[element as usize / 64] |= 1 << (element % 64);
        }
    }

    /// The grid of a facet relative to the point.
    fn place(&mut self, facet: usize, point: Vec3, axes: [Vec3; 3]) -> PlacedGrid {
        let known = self.placed[facet];
        if known.stamp == self.stamp {
            return known;
        }
        let mut made = PlacedGrid {
            stamp: self.stamp,
            ..PlacedGrid::default()
        };
        if let Some(grid) = &self.mesh.grids[facet] {
            let own = &self.setting.surfaces.facets[facet];
            let height = own.height(point);
            made.point.place = grid.place(point).map(|x| x as f32);
            made.point.height = height as f32;
            made.nearness = axes.map(|axis| (own.normal.dot(axis) / -height) as f32);
            made.slopes = grid
                .slopes()
                .map(|slope| axes.map(|axis| slope.dot(axis) as f32));
        }
        self.placed[facet] = made;
        made
    }
}

#[cfg(test)]
mod tests;
