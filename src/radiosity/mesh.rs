//! Elements: each facet divided by a grid along its longest edge.
//!
//! A cell of the grid, clipped to the facet, is an element with a centre (of its hemicube) and up to
//! four samples (of its direct light). Points inside a solid are left out, so that they do not
//! darken what is interpolated next to them. Where something stands on the facet the cell is split
//! along its contact edge (discontinuity meshing): each part is an element, and nothing is
//! interpolated across. Black facets have no elements. Invariant: a mesh depends on the scene, the
//! cell size, the visibility seeds and the requests alone. This module does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "cells are addressed by row and column clamped to the grid"
)]

pub mod bsp;
mod contact;
pub mod element;
pub mod grid;
pub mod sample;
pub mod stitching;

use crate::geometry::Vec3;
use crate::radiosity::direct::Setting;
use crate::radiosity::geometry::surface::Surfaces;
use crate::radiosity::mesh::bsp::{Foot, Line, Tree, Upright};
use crate::radiosity::mesh::contact::Contacts;
use crate::radiosity::mesh::element::{Element, Maker};
use crate::radiosity::mesh::grid::Grid;
use rayon::prelude::*;

/// No element: nothing of the cell lies on the facet, or it is inside a solid.
pub const NONE: u32 = u32::MAX;

/// Marks a cell that is cut; the other bits number its first [`Branch`].
const CUT: u32 = 1 << 31;

/// What rises above a facet by less than this share of a cell does not cut it.
const LEAST_RISE: f64 = 0.1;

/// A point nearer than this to what stands on a cell (in cells) counts as on it.
const BEFORE: f32 = 1e-3;

/// What stands on a cell, its foot in cells of its grid.
#[derive(Clone, Copy, Debug)]
struct Branch {
    line: [f32; 3],
    /// As [`Upright::lean`] and [`Upright::rise`].
    lean: f32,
    rise: f32,
    /// What lies where the line is negative, and where it is not: like [`Mesh::cells`].
    sides: [u32; 2],
    /// The same, like [`Mesh::seen`].
    seen: [u32; 2],
}

/// A point above a facet.
#[derive(Clone, Copy, Debug, Default)]
pub struct Above {
    /// Its foot, in cells of the facet's grid.
    pub place: [f32; 2],
    /// Height (m).
    pub height: f32,
}

impl Above {
    fn on_facet(place: [f32; 2]) -> Above {
        Above { place, height: 0.0 }
    }
}

/// Elements of all facets.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// One for each facet; `None` for those that reflect nothing.
    pub grids: Vec<Option<Grid>>,
    /// For each cell of all grids its element, or [`NONE`], or [`CUT`] and the number of a branch.
    cells: Vec<u32>,
    /// The same, with the nearest element of the grid where a cell has none: what shows of a
    /// nearly hidden cell is lit like its neighbour.
    seen: Vec<u32>,
    /// Cells that something divides, and those around them.
    beside_cut: Vec<bool>,
    branches: Vec<Branch>,
    /// In the order of their cells.
    pub elements: Vec<Element>,
}

/// What the caller wants of a cell of a layout.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellRequest {
    /// Is it to be an element?
    pub wanted: bool,
    /// A point of it that the picture shows, which is therefore not inside a solid.
    pub shown: Option<Vec3>,
}

impl CellRequest {
    /// An element; nothing is known to be shown.
    pub const WANTED: CellRequest = CellRequest {
        wanted: true,
        shown: None,
    };
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

    /// Grids for a second gather: about `target` gather points over all facets that reflect, more
    /// where the picture shows a facet large (`pixels` of each), one for each 5 x 5 pixels at most.
    /// The outermost gather points stand on the rim, as light changes fastest beside a joint.
    pub fn of_gather_points(surfaces: &Surfaces, target: usize, pixels: &[f64]) -> Layout {
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
                    let grid = Grid::over(f, side(i), on_rim, cells);
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

    /// For tests: an element for each cell.
    #[cfg(test)]
    pub fn whole(self, setting: Setting<'_>, seeds: &[Vec3]) -> Mesh {
        let requests = vec![CellRequest::WANTED; self.cells];
        self.mesh(setting, seeds, &requests)
    }

    /// Makes elements of the cells that are wanted (one request for each cell).
    pub fn mesh(self, setting: Setting<'_>, seeds: &[Vec3], requests: &[CellRequest]) -> Mesh {
        let contacts = Contacts::new(setting.surfaces);
        let made: Vec<(usize, Tree<Option<Element>>)> = self
            .grids
            .par_iter()
            .enumerate()
            .flat_map_iter(|(facet, grid)| {
                let cells = grid.iter().flat_map(|grid| {
                    let trees = trees(grid, facet, &contacts).into_iter().enumerate();
                    trees.map(move |(cell, tree)| (grid, cell, tree))
                });
                let made: Vec<_> = cells
                    .filter(|(grid, cell, _)| requests[grid.first + cell].wanted)
                    .map(|(grid, cell, tree)| {
                        let maker = Maker {
                            setting,
                            seeds,
                            facet,
                            grid,
                            cell,
                            shown: requests[grid.first + cell].shown,
                        };
                        (grid.first + cell, maker.elements(tree))
                    })
                    .collect();
                made
            })
            .collect();
        let mut mesh = Mesh {
            grids: self.grids,
            cells: vec![NONE; self.cells],
            seen: Vec::new(),
            beside_cut: Vec::new(),
            branches: Vec::new(),
            elements: Vec::new(),
        };
        for (cell, tree) in made {
            let (own, _) = mesh.add_tree(tree);
            mesh.cells[cell] = own;
        }
        mesh.seen = mesh.filled();
        mesh.beside_cut = mesh.around_cuts();
        mesh
    }
}

/// The cells of a facet's grid, in order, each as it is cut.
fn trees(grid: &Grid, facet: usize, contacts: &Contacts<'_>) -> Vec<Tree<Vec<Line>>> {
    let least = LEAST_RISE / grid.scale[0].max(grid.scale[1]);
    let mut feet = vec![Vec::new(); grid.counts[0] * grid.counts[1]];
    for foot in contacts.of(facet, least) {
        let ends = foot.ends.map(|p| grid.place(p));
        let normal = grid.normal(foot.normal);
        for local in grid.between(ends) {
            feet[local].push(Foot {
                ends,
                normal,
                rise: foot.rise,
            });
        }
    }
    let cells = feet.iter().enumerate();
    cells
        .map(|(local, own)| bsp::cut(grid.corner(local), own))
        .collect()
}

/// Side of a cell when `target` of them share the area of all facets that reflect.
fn mean_side(surfaces: &Surfaces, target: usize) -> f64 {
    let lit = surfaces.facets.iter().filter(|f| !f.is_black());
    let area: f64 = lit.map(|f| f.area).sum();
    (area / target.max(1) as f64).sqrt()
}

impl Mesh {
    /// The element at a point of a facet, or what is nearest to it; [`NONE`] if there is none.
    pub fn at(&self, facet: usize, p: Vec3) -> u32 {
        let Some(grid) = &self.grids[facet] else {
            return NONE;
        };
        self.seen(grid.cell(p), grid.place(p).map(|x| x as f32))
    }

    /// The branch that an entry of [`Mesh::cells`] or [`Mesh::seen`] numbers.
    fn branch(&self, entry: u32) -> Option<&Branch> {
        let is_branch = entry & CUT != 0 && entry != NONE;
        is_branch.then(|| &self.branches[(entry & !CUT) as usize])
    }

    /// The element seen at a place (in cells of its grid) of a cell.
    pub fn seen(&self, cell: usize, place: [f32; 2]) -> u32 {
        let mut found = self.seen[cell];
        while let Some(branch) = self.branch(found) {
            found = branch.seen[branch.side(place)];
        }
        found
    }

    /// The element seen anywhere in a cell, [`NONE`] included; `None` if something divides it or a
    /// cell beside it.
    pub fn seen_whole(&self, cell: usize) -> Option<u32> {
        (!self.beside_cut[cell]).then_some(self.seen[cell])
    }

    /// Does nothing divide a cell?
    pub fn is_whole(&self, cell: usize) -> bool {
        let own = self.cells[cell];
        own == NONE || own & CUT == 0
    }

    /// Does what stands on some cells hide the second place of the facet from a point that sees the
    /// first? Only what stands between the two places and between the point and the second can. It
    /// hides the place if the ray from the point crosses it below its top; if the ray passes above,
    /// something may stand on top of it, and the result is `None`.
    pub fn hides(
        &self,
        cells: impl Iterator<Item = usize>,
        [seen, place]: [[f32; 2]; 2],
        point: Above,
    ) -> Option<bool> {
        let mut above = false;
        for cell in cells {
            // Only the branches on the path to the second place can be between.
            let mut found = self.seen[cell];
            while let Some(branch) = self.branch(found) {
                let (at, from) = (branch.over(Above::on_facet(place)), branch.over(point));
                let side = usize::from(at >= 0.0);
                let is_behind = from * at.signum() < BEFORE;
                if branch.side(seen) != side && is_behind {
                    if at.abs() * point.height < branch.rise * (at - from).abs() {
                        return Some(true);
                    }
                    above = true;
                }
                found = branch.seen[side];
            }
        }
        (!above).then_some(false)
    }

    /// The element that a place of a cell belongs to, if there is one.
    fn own(&self, cell: usize, place: [f64; 2]) -> u32 {
        let mut found = self.cells[cell];
        while let Some(branch) = self.branch(found) {
            found = branch.sides[branch.side(place.map(|x| x as f32))];
        }
        found
    }

    /// Adds the elements of a cell; returns its entries of [`Mesh::cells`] and [`Mesh::seen`].
    fn add_tree(&mut self, tree: Tree<Option<Element>>) -> (u32, u32) {
        match tree {
            Tree::Leaf(None) => (NONE, NONE),
            Tree::Leaf(Some(element)) => {
                self.elements.push(element);
                let at = (self.elements.len() - 1) as u32;
                (at, at)
            }
            Tree::Branch(Upright { line, lean, rise }, sides) => {
                let [low, high] = (*sides).map(|side| self.add_tree(side));
                // A part without an element is hidden: what rounding shows of it is its neighbour.
                let (low_seen, high_seen) = match (low.1, high.1) {
                    (NONE, NONE) => return (NONE, NONE),
                    (NONE, other) | (other, NONE) => (other, other),
                    both => both,
                };
                self.branches.push(Branch {
                    line: line.map(|x| x as f32),
                    lean: lean as f32,
                    rise: rise as f32,
                    sides: [low.0, high.0],
                    seen: [low_seen, high_seen],
                });
                let at = CUT | (self.branches.len() - 1) as u32;
                (at, at)
            }
        }
    }

    /// Elements around a point of a facet and their bilinear weights, which sum to 1: of the cells
    /// beside it those that are elements on the same side of all that stands there, or else its
    /// own, or else the nearest of the grid's neighbourhood. Weights are all zero if there is none.
    pub fn stencil(&self, facet: usize, p: Vec3) -> [(u32, f32); 4] {
        let mut out = [(0, 0.0); 4];
        let Some(grid) = &self.grids[facet] else {
            return out;
        };
        let (home, place) = (grid.cell(p), grid.place(p));
        let around = grid.stencil(p).map(|(cell, weight)| {
            let element = match self.is_whole(cell) {
                true => self.cells[cell],
                false => self.own(cell, grid.clamped(cell, place)),
            };
            // Where the way to the cell leaves this one, or, seen from there, comes in.
            let way = || grid.clamped(home, grid.clamped(cell, place));
            let same = self.is_whole(home) || self.own(home, place) == self.own(home, way());
            (element, if same && element != NONE { weight } else { 0.0 })
        });
        let total: f64 = around.iter().map(|(_, w)| w).sum();
        if total > 1e-6 {
            for (slot, (element, w)) in out.iter_mut().zip(around) {
                if w > 0.0 {
                    *slot = (element, (w / total) as f32);
                }
            }
            return out;
        }
        let own = self.own(home, place);
        let nearest = match own {
            NONE => self.nearest(grid, p, 64),
            own => Some(own),
        };
        if let Some(e) = nearest {
            out[0] = (e, 1.0);
        }
        out
    }

    /// Does nothing stand between two points of a facet, at most a cell apart?
    pub fn is_one(&self, facet: usize, points: [Vec3; 2]) -> bool {
        let Some(grid) = &self.grids[facet] else {
            return false;
        };
        let [a, b] = points.map(|p| (grid.cell(p), grid.place(p)));
        let are_whole = self.is_whole(a.0) && self.is_whole(b.0);
        are_whole || a.0 == b.0 && self.own(a.0, a.1) == self.own(b.0, b.1)
    }

    /// The element of a cell (column and row) that nothing divides.
    pub fn whole(&self, grid: &Grid, at: [usize; 2]) -> Option<usize> {
        let element = self.cells[grid.at(at)];
        (element & CUT == 0).then_some(element as usize)
    }

    /// Each of those, with its grid, column and row.
    pub fn each_whole(&self, mut take: impl FnMut(&Grid, [usize; 2], usize)) {
        for grid in self.grids.iter().flatten() {
            for at in grid.positions() {
                if let Some(element) = self.whole(grid, at) {
                    take(grid, at, element);
                }
            }
        }
    }

    /// Each two elements that lie side by side on a facet, once.
    pub fn each_pair(&self, mut take: impl FnMut(usize, usize)) {
        for grid in self.grids.iter().flatten() {
            let [columns, rows] = grid.counts;
            let mut both = |a: [usize; 2], b: [usize; 2]| {
                let [a, b] = [a, b].map(|at| self.cells[grid.at(at)]);
                // Parts of a cut cell are divided by what stands there, as is their light.
                if (a | b) & CUT == 0 {
                    take(a as usize, b as usize);
                }
            };
            for [i, j] in grid.positions() {
                if i + 1 < columns {
                    both([i, j], [i + 1, j]);
                }
                if j + 1 < rows {
                    both([i, j], [i, j + 1]);
                }
            }
        }
    }

    /// Each three elements that lie in a row along an axis of a facet's grid, nothing between them,
    /// by the one in the middle.
    pub fn each_three(&self, axis: usize, mut take: impl FnMut([usize; 3])) {
        for grid in self.grids.iter().flatten() {
            let count = grid.counts[0] * grid.counts[1];
            let (along, step) = (grid.counts[axis], [1, grid.counts[0]][axis]);
            let inner = |local: &usize| {
                let at = local / step % along;
                at > 0 && at + 1 < along
            };
            for local in (0..count).filter(inner) {
                let middle = grid.first + local;
                let three = [middle - step, middle, middle + step].map(|c| self.cells[c]);
                if three.iter().all(|e| e & CUT == 0) {
                    take(three.map(|e| e as usize));
                }
            }
        }
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

    /// For each cell, whether it or one beside it is cut.
    fn around_cuts(&self) -> Vec<bool> {
        let mut around = vec![false; self.cells.len()];
        for grid in self.grids.iter().flatten() {
            let [columns, rows] = grid.counts;
            let is_cut = |at: &[usize; 2]| !self.is_whole(grid.at(*at));
            for [i, j] in grid.positions().filter(is_cut) {
                for y in j.saturating_sub(1)..(j + 2).min(rows) {
                    let line = grid.first + y * columns;
                    around[line + i.saturating_sub(1)..line + (i + 2).min(columns)].fill(true);
                }
            }
        }
        around
    }

    /// The nearest element of the grid up to `reach` cells away, ring by ring.
    fn nearest(&self, grid: &Grid, p: Vec3, reach: usize) -> Option<u32> {
        let [ci, cj] = grid.position(grid.cell(p) - grid.first);
        let [columns, rows] = grid.counts;
        let place = grid.place(p);
        let distance = |e: u32| (self.elements[e as usize].centre - p).length();
        (0..=columns.max(rows).min(reach)).find_map(|ring| {
            let across = ci.saturating_sub(ring)..(ci + ring + 1).min(columns);
            let along = cj.saturating_sub(ring)..(cj + ring + 1).min(rows);
            let square = along.flat_map(|j| across.clone().map(move |i| [i, j]));
            let is_on_ring = |[i, j]: &[usize; 2]| i.abs_diff(ci).max(j.abs_diff(cj)) == ring;
            let cells = square.filter(is_on_ring);
            let elements = cells.map(|at| {
                let cell = grid.at(at);
                self.own(cell, grid.clamped(cell, place))
            });
            elements
                .filter(|e| *e != NONE)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        })
    }
}

impl Branch {
    fn side(&self, place: [f32; 2]) -> usize {
        usize::from(self.over(Above::on_facet(place)) >= 0.0)
    }

    /// How far a point is before what stands on the line, in cells.
    fn over(&self, point: Above) -> f32 {
        let ([a, b, c], [u, v]) = (self.line, point.place);
        a * u + b * v + c + self.lean * point.height
    }
}
