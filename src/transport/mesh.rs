//! Elements: each facet divided by a grid along its longest edge.
//!
//! A cell of the grid, cut to the facet, is an element with a sample point (where its hemicube
//! stands) and up to four sub-samples (where its direct light is averaged). Points keep a distance
//! from the facet's edges, as visibility is undecided on them, and points inside a solid are left
//! out: what no light can reach must not darken what is interpolated beside it. Facets that
//! reflect nothing have no elements. Invariant: a mesh depends on the scene and the cell size
//! alone. This room knows nothing of lights.

#![allow(
    clippy::indexing_slicing,
    reason = "cells are addressed by row and column clamped to the grid"
)]

use crate::geometry::{Vec3, newell};
use crate::transport::burial::is_buried;
use crate::transport::direct::Setting;
use crate::transport::surface::{Facet, Surfaces};
use rayon::prelude::*;

/// No element: nothing of the cell lies on the facet, or it is buried.
pub const NONE: u32 = u32::MAX;

/// Distance that samples keep from edges, as a share of the scene's size.
const INSET: f64 = 1e-4;

/// Cells along one side of a facet at most.
const MOST_CELLS: f64 = 2048.0;

/// The grid of one facet.
#[derive(Clone, Debug)]
pub struct Grid {
    origin: Vec3,
    along: Vec3,
    across: Vec3,
    /// One over the cell's sides.
    scale: [f64; 2],
    counts: [usize; 2],
    /// Samples of the outermost cells stand on the rim, not at the cells' centres.
    on_rim: bool,
    /// First cell of this grid in [`Mesh::cells`].
    first: usize,
}

impl Grid {
    /// Position in cells, not clamped.
    pub fn place(&self, p: Vec3) -> [f64; 2] {
        let d = p - self.origin;
        [
            d.dot(self.along) * self.scale[0],
            d.dot(self.across) * self.scale[1],
        ]
    }

    /// Cells along the two sides.
    pub fn counts(&self) -> [usize; 2] {
        self.counts
    }

    /// Its first cell in [`Mesh::cells`]; the others follow, line by line.
    pub fn first(&self) -> usize {
        self.first
    }

    /// Cells per metre, along the two sides.
    pub fn slopes(&self) -> [Vec3; 2] {
        [self.along * self.scale[0], self.across * self.scale[1]]
    }

    /// The cell that holds a point of the facet.
    pub fn cell(&self, p: Vec3) -> usize {
        let [u, v] = self.place(p);
        // The cast saturates: below zero is zero.
        let (i, j) = (u as usize, v as usize);
        self.first + j.min(self.counts[1] - 1) * self.counts[0] + i.min(self.counts[0] - 1)
    }

    /// Centre of a cell, numbered within the grid.
    fn middle(&self, local: usize) -> Vec3 {
        let (i, j) = (local % self.counts[0], local / self.counts[0]);
        self.origin
            + self.along * ((i as f64 + 0.5) / self.scale[0])
            + self.across * ((j as f64 + 0.5) / self.scale[1])
    }

    /// Where cell `i` of `n` has its sample, in cells.
    fn stand(&self, i: usize, n: usize) -> f64 {
        match i {
            0 if self.on_rim && n > 1 => 0.0,
            i if self.on_rim && n > 1 && i == n - 1 => n as f64,
            i => i as f64 + 0.5,
        }
    }

    /// The four cells whose samples are around a point, and their bilinear weights; beyond the
    /// outermost samples the nearest count.
    pub fn stencil(&self, p: Vec3) -> [(usize, f64); 4] {
        let [u, v] = self.place(p);
        let axis = |x: f64, n: usize| {
            // The cast saturates: below zero is zero.
            let guess = ((x - 0.5).max(0.0) as usize).min(n - 1);
            let low = if guess > 0 && self.stand(guess, n) > x {
                guess - 1
            } else {
                guess
            };
            let high = (low + 1).min(n - 1);
            let (a, b) = (self.stand(low, n), self.stand(high, n));
            let share = if b > a {
                ((x - a) / (b - a)).clamp(0.0, 1.0)
            } else {
                0.0
            };
            (low, high, share)
        };
        let (i, i1, s) = axis(u, self.counts[0]);
        let (j, j1, t) = axis(v, self.counts[1]);
        let at = |i: usize, j: usize| self.first + j * self.counts[0] + i;
        [
            (at(i, j), (1.0 - s) * (1.0 - t)),
            (at(i1, j), s * (1.0 - t)),
            (at(i, j1), (1.0 - s) * t),
            (at(i1, j1), s * t),
        ]
    }
}

/// A mesh cell that light can reach.
#[derive(Clone, Debug)]
pub struct Element {
    /// Its facet.
    pub facet: usize,
    /// Where its hemicube stands.
    pub centre: Vec3,
    /// Where its direct light is averaged.
    pub samples: Vec<Vec3>,
}

/// Elements of all facets.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// One for each facet; `None` for those that reflect nothing.
    pub grids: Vec<Option<Grid>>,
    /// For each cell of all grids its element, or [`NONE`].
    pub cells: Vec<u32>,
    /// The same, with the nearest element of the grid where a cell has none: what shows of a
    /// nearly hidden cell is lit like its neighbour.
    pub seen: Vec<u32>,
    /// In the order of their cells.
    pub elements: Vec<Element>,
}

/// The cells of a mesh before any is made an element.
#[derive(Clone, Debug)]
pub struct Layout {
    grids: Vec<Option<Grid>>,
    cells: usize,
}

impl Layout {
    /// Grids for about `target` elements over all facets that reflect, at least one each.
    pub fn of_elements(surfaces: &Surfaces, target: usize) -> Layout {
        let side = mean_side(surfaces, target);
        Layout::with(surfaces, |_| side, false)
    }

    /// Grids for a second gather: about `target` nodes over all facets that reflect, more where
    /// the picture shows a facet large (`pixels` of each), one for each 5 x 5 pixels at most. The
    /// outermost nodes stand on the rim, as light changes fastest beside a joint.
    pub fn of_nodes(surfaces: &Surfaces, target: usize, pixels: &[f64]) -> Layout {
        let side = mean_side(surfaces, target);
        let close = |f: usize| (surfaces.facets[f].area * 25.0 / pixels[f].max(1.0)).sqrt();
        Layout::with(surfaces, |f| side.min(close(f)), true)
    }

    fn with(surfaces: &Surfaces, side: impl Fn(usize) -> f64, on_rim: bool) -> Layout {
        let mut cells = 0;
        let grids = surfaces
            .facets
            .iter()
            .enumerate()
            .map(|(i, f)| {
                (!f.is_black()).then(|| {
                    let grid = grid(f, side(i), on_rim, cells);
                    cells += grid.counts[0] * grid.counts[1];
                    grid
                })
            })
            .collect();
        Layout { grids, cells }
    }

    /// Cells of all grids.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// The grid of a facet.
    pub fn grid(&self, facet: usize) -> Option<&Grid> {
        self.grids[facet].as_ref()
    }

    /// Makes elements of the cells that `wanted` names (one flag for each cell).
    pub fn mesh(self, setting: Setting<'_>, beacons: &[Vec3], wanted: &[bool]) -> Mesh {
        let made: Vec<Option<Element>> = self
            .grids
            .par_iter()
            .enumerate()
            .flat_map_iter(|(facet, grid)| {
                let cells = grid
                    .iter()
                    .flat_map(|g| (0..g.counts[0] * g.counts[1]).map(move |c| (g, c)));
                cells.map(move |(g, c)| {
                    wanted[g.first + c]
                        .then(|| element(setting, beacons, facet, g, c))
                        .flatten()
                })
            })
            .collect();
        let mut elements = Vec::new();
        let cells = made
            .into_iter()
            .map(|e| match e {
                Some(e) => {
                    elements.push(e);
                    (elements.len() - 1) as u32
                }
                None => NONE,
            })
            .collect();
        let mut mesh = Mesh {
            grids: self.grids,
            cells,
            seen: Vec::new(),
            elements,
        };
        mesh.seen = mesh.filled();
        mesh
    }
}

/// Side of a cell when `target` of them share the area of all facets that reflect.
fn mean_side(surfaces: &Surfaces, target: usize) -> f64 {
    let lit = surfaces.facets.iter().filter(|f| !f.is_black());
    let area: f64 = lit.map(|f| f.area).sum();
    (area / target.max(1) as f64).sqrt()
}

fn grid(facet: &Facet, side: f64, on_rim: bool, first: usize) -> Grid {
    let n = facet.vertices.len();
    let edges = (0..n).map(|i| facet.vertices[(i + 1) % n] - facet.vertices[i]);
    let longest = edges.fold(Vec3::ZERO, |best, e| {
        // A clear winner only, so that the opposite edges of a rectangle do not compete.
        if e.length() > best.length() * (1.0 + 1e-9) {
            e
        } else {
            best
        }
    });
    let along = longest.normalized();
    let across = facet.normal.cross(along);
    let extent = |axis: Vec3| {
        facet
            .vertices
            .iter()
            .map(|v| axis.dot(*v - facet.vertices[0]))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            })
    };
    let (u, v) = (extent(along), extent(across));
    let more = if on_rim { 1.0 } else { 0.0 };
    let count = |length: f64| ((length / side).round() + more).clamp(1.0, MOST_CELLS);
    let counts = [count(u.1 - u.0), count(v.1 - v.0)];
    Grid {
        origin: facet.vertices[0] + along * u.0 + across * v.0,
        along,
        across,
        scale: [counts[0] / (u.1 - u.0), counts[1] / (v.1 - v.0)],
        counts: counts.map(|c| c as usize),
        on_rim,
        first,
    }
}

impl Mesh {
    /// Elements around a point of a facet and their bilinear weights, which sum to 1: of the cells
    /// beside it those that are elements, or else the nearest element of the grid's neighbourhood.
    /// Weights are all zero if there is none.
    pub fn stencil(&self, facet: usize, p: Vec3) -> [(u32, f32); 4] {
        let mut out = [(0, 0.0); 4];
        let Some(grid) = &self.grids[facet] else {
            return out;
        };
        let around = grid.stencil(p);
        let known = |c: usize| self.cells[c] != NONE;
        let total: f64 = around
            .iter()
            .filter(|(c, _)| known(*c))
            .map(|(_, w)| w)
            .sum();
        if total > 1e-6 {
            for (slot, (c, w)) in out.iter_mut().zip(around) {
                if known(c) {
                    *slot = (self.cells[c], (w / total) as f32);
                }
            }
        } else if let Some(e) = self.nearest(grid, p, 64) {
            out[0] = (e, 1.0);
        }
        out
    }

    fn filled(&self) -> Vec<u32> {
        let mut seen = self.cells.clone();
        for grid in self.grids.iter().flatten() {
            for local in 0..grid.counts[0] * grid.counts[1] {
                if seen[grid.first + local] == NONE
                    && let Some(e) = self.nearest(grid, grid.middle(local), 2)
                {
                    seen[grid.first + local] = e;
                }
            }
        }
        seen
    }

    /// The nearest element of the grid up to `reach` cells away, ring by ring.
    fn nearest(&self, grid: &Grid, p: Vec3, reach: usize) -> Option<u32> {
        let local = grid.cell(p) - grid.first;
        let (ci, cj) = (
            (local % grid.counts[0]) as isize,
            (local / grid.counts[0]) as isize,
        );
        let reach = grid.counts[0].max(grid.counts[1]).min(reach) as isize;
        (0..=reach).find_map(|ring| {
            (-ring..=ring)
                .flat_map(|dj| (-ring..=ring).map(move |di| (di, dj)))
                .filter(|(di, dj)| di.abs().max(dj.abs()) == ring)
                .filter_map(|(di, dj)| {
                    let (i, j) = (ci + di, cj + dj);
                    let inside = i >= 0
                        && j >= 0
                        && (i as usize) < grid.counts[0]
                        && (j as usize) < grid.counts[1];
                    inside.then(|| grid.first + j as usize * grid.counts[0] + i as usize)
                })
                .map(|c| self.cells[c])
                .filter(|e| *e != NONE)
                .min_by(|&a, &b| {
                    let d = |e: u32| (self.elements[e as usize].centre - p).length();
                    d(a).total_cmp(&d(b))
                })
        })
    }
}

fn element(
    setting: Setting<'_>,
    beacons: &[Vec3],
    facet: usize,
    grid: &Grid,
    cell: usize,
) -> Option<Element> {
    let (i, j) = (cell % grid.counts[0], cell / grid.counts[0]);
    let f = &setting.surfaces.facets[facet];
    let open = |p: &Vec3| !is_buried(setting, beacons, facet, *p);
    let part = |a: f64, b: f64, side: f64| {
        let p = largest_part(
            setting.surfaces,
            f,
            grid,
            [i as f64 + a, j as f64 + b],
            side,
        )?;
        Some(kept_inside(setting.surfaces, f, p))
    };
    let mut centre = part(0.0, 0.0, 1.0)?;
    if grid.on_rim {
        let [u, v] = [grid.stand(i, grid.counts[0]), grid.stand(j, grid.counts[1])];
        let p = grid.origin + grid.along * (u / grid.scale[0]) + grid.across * (v / grid.scale[1]);
        let p = kept_inside(setting.surfaces, f, p);
        let pieces = &setting.surfaces.pieces[f.pieces.clone()];
        if pieces.iter().any(|piece| piece.holds(p)) {
            centre = p;
        }
        // A node only gathers: its sub-samples matter where it cannot stand itself.
        if open(&centre) {
            return Some(Element {
                facet,
                centre,
                samples: Vec::new(),
            });
        }
    }
    let quarters = [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)];
    let samples: Vec<Vec3> = quarters
        .iter()
        .filter_map(|&(a, b)| part(a, b, 0.5))
        .filter(open)
        .collect();
    if samples.is_empty() {
        return None;
    }
    if !open(&centre) {
        // Half hidden: stand on the visible sub-sample nearest to the centre.
        let distance = |p: &Vec3| (*p - centre).length();
        let nearest = samples
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        centre = nearest.copied().unwrap_or(centre);
    }
    Some(Element {
        facet,
        centre,
        samples,
    })
}

/// Centroid of the largest convex part of the facet within a square of the grid of `side` cells.
fn largest_part(
    surfaces: &Surfaces,
    facet: &Facet,
    grid: &Grid,
    corner: [f64; 2],
    side: f64,
) -> Option<Vec3> {
    let mut best = (0.0, None);
    for piece in &surfaces.pieces[facet.pieces.clone()] {
        let mut part = piece.vertices.clone();
        for (axis, scale, low) in [
            (grid.along, grid.scale[0], corner[0]),
            (grid.across, grid.scale[1], corner[1]),
        ] {
            let at = |p: Vec3| axis.dot(p - grid.origin) * scale;
            part = keep(&part, |p| at(p) - low);
            part = keep(&part, |p| low + side - at(p));
        }
        let Some(&first) = part.first() else { continue };
        let local: Vec<Vec3> = part.iter().map(|v| *v - first).collect();
        let area = newell(&local).length();
        if area > best.0 {
            best = (area, Some(first + centroid(&local)));
        }
    }
    let whole = 2.0 * side * side / (grid.scale[0] * grid.scale[1]);
    best.1.filter(|_| best.0 > 1e-6 * whole)
}

/// Centroid of a convex polygon whose first vertex is the origin.
fn centroid(local: &[Vec3]) -> Vec3 {
    let (sum, total) = local
        .windows(2)
        .skip(1)
        .fold((Vec3::ZERO, 0.0), |(sum, total), pair| {
            let area = pair[0].cross(pair[1]).length();
            (sum + (pair[0] + pair[1]) * (area / 3.0), total + area)
        });
    if total > 0.0 { sum / total } else { Vec3::ZERO }
}

/// The part of a convex polygon where `height` is not negative.
fn keep(polygon: &[Vec3], height: impl Fn(Vec3) -> f64) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (here, there) = (height(a), height(b));
        if here >= 0.0 {
            out.push(a);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            out.push(a + (b - a) * (here / (here - there)));
        }
    }
    out
}

/// Moves a point of the facet away from the facet's edges by a ten-thousandth of the scene, or as far as it goes.
pub fn kept_inside(surfaces: &Surfaces, facet: &Facet, p: Vec3) -> Vec3 {
    let margin = (surfaces.size * INSET).min(0.2 * facet.area.sqrt());
    let n = facet.vertices.len();
    let mut moved = p;
    for i in 0..n {
        let (a, b) = (facet.vertices[i], facet.vertices[(i + 1) % n]);
        let edge = b - a;
        let length = edge.length();
        let inward = facet.normal.cross(edge) / length;
        let along = (moved - a).dot(edge) / length;
        let height = (moved - a).dot(inward);
        // Only edges that the point is beside: others of a concave facet do not bound it here.
        if height < margin && height > -margin && along > -margin && along < length + margin {
            moved += inward * (margin - height);
        }
    }
    moved
}
