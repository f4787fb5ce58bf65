//! Elements: each facet divided by a grid along its longest edge.
//!
//! A cell of the grid, clipped to the facet, is an element with a centre (of its hemicube) and up
//! to four samples (of its direct light). Points inside a solid are omitted, so that they do not
//! darken the interpolation around them. A cell is split along contact edges, where other surfaces
//! stand on the facet (discontinuity meshing): each part is an element, and nothing is interpolated
//! across. Black facets have no elements. Invariant: a mesh depends on the scene, the cell size,
//! the visibility seeds and the requests alone. This module does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "cells are addressed by row and column clamped to the grid"
)]

pub mod bsp;
mod contact;
pub mod element;
pub mod grid;
pub mod sample;

use crate::hemicube::mesh::bsp::{BspTree, CellContactEdge, Line, SplitPlane};
use crate::hemicube::mesh::contact::Contacts;
use crate::hemicube::mesh::element::{Element, Maker};
use crate::hemicube::mesh::grid::Grid;
use crate::surfaces::hierarchy::SceneGeometry;
use crate::surfaces::surface::Surfaces;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;

/// No element: the cell is off the facet or inside a solid.
pub const NONE: u32 = u32::MAX;

/// Flag of a cut cell; the other bits are the index of the root of its BSP.
const CUT: u32 = 1 << 31;

/// Least rise of a surface above a facet, in cells, that cuts a cell.
const LEAST_RISE: f64 = 0.1;

/// Distance from a surface that stands on a cell, in cells, within which a point counts as on it.
const CONTACT_TOLERANCE: f32 = 1e-3;

/// A BSP split of a cell by a surface that stands on it; lengths in cells of the grid.
#[derive(Clone, Copy, Debug)]
struct BspNode {
    /// The contact edge; see [`SplitPlane::line`].
    line: [f32; 3],
    /// See [`SplitPlane::lean`] and [`SplitPlane::rise`].
    lean: f32,
    rise: f32,
    /// Entries, like those of [`Mesh::cells`], where the line is negative and where it is not.
    sides: [u32; 2],
    /// Likewise, for [`Mesh::display_cells`].
    display_sides: [u32; 2],
}

/// A point above a facet.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointAboveFacet {
    /// Its projection onto the facet, in cells of the facet's grid.
    pub place: [f32; 2],
    /// Height (m).
    pub height: f32,
}

impl PointAboveFacet {
    fn on_facet(place: [f32; 2]) -> PointAboveFacet {
        PointAboveFacet { place, height: 0.0 }
    }
}

/// Elements of all facets.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// One for each facet; `None` for facets that reflect nothing.
    pub grids: Vec<Option<Grid>>,
    /// For each cell of all grids its element, [`NONE`], or [`CUT`] and the index of a BSP node.
    cells: Vec<u32>,
    /// Like `cells`, with the nearest element of the grid for a cell without one: the visible rest
    /// of a nearly hidden cell is lit like its neighbour.
    display_cells: Vec<u32>,
    /// For each cell, true when it or an adjacent cell is cut.
    near_cut: Vec<bool>,
    bsp_nodes: Vec<BspNode>,
    /// In cell order.
    pub elements: Vec<Element>,
}

/// A request for a cell of a layout.
#[derive(Clone, Copy, Debug, Default)]
pub struct CellRequest {
    /// True when the cell should become an element.
    pub wanted: bool,
    /// A point of the cell that a fragment shows, which is therefore outside all solids.
    pub visible_point: Option<Vec3>,
}

impl CellRequest {
    /// Requests an element, with no known visible point.
    pub const WANTED: CellRequest = CellRequest {
        wanted: true,
        visible_point: None,
    };
}

/// A cell, by its index in all grids, with its elements.
type MadeCell = (usize, BspTree<Option<Element>>);

/// The cells of a mesh before elements are made.
#[derive(Clone, Debug)]
pub struct Layout {
    grids: Vec<Option<Grid>>,
    cells: usize,
}

impl Layout {
    /// Grids with approximately `target` elements over all facets that reflect, at least one each.
    pub fn of_elements(surfaces: &Surfaces, target: usize) -> Layout {
        let side = mean_side(surfaces, target);
        Layout::with(surfaces, |_| side, false)
    }

    /// Grids for a final gather, with approximately `target` gather points over all facets that
    /// reflect, or on each facet one for each 5 x 5 of the `pixels` that show it, if that is more.
    /// The outermost gather points lie on the rim, as light changes fastest next to a joint.
    pub fn of_gather_points(surfaces: &Surfaces, target: usize, pixels: &[f64]) -> Layout {
        let side = mean_side(surfaces, target);
        let close = |f: usize| (surfaces.facets[f].area * 25.0 / pixels[f].max(1.0)).sqrt();
        Layout::with(surfaces, |f| side.min(close(f)), true)
    }

    /// Grids with each cell of these divided into four.
    pub fn quartered(&self) -> Layout {
        let quartered = |grid: &Option<Grid>| grid.as_ref().map(Grid::quartered);
        Layout {
            grids: self.grids.iter().map(quartered).collect(),
            cells: 4 * self.cells,
        }
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
    pub fn mesh_of_all_cells(self, setting: SceneGeometry<'_>, seeds: &[Vec3]) -> Mesh {
        let requests = vec![CellRequest::WANTED; self.cells];
        let made = self.mesh(setting, seeds, &requests, Work::silent());
        made.unwrap()
    }

    /// Makes elements of the requested cells, given one request for each cell.
    ///
    /// # Errors
    /// On cancel.
    pub fn mesh(
        self,
        setting: SceneGeometry<'_>,
        seeds: &[Vec3],
        requests: &[CellRequest],
        work: Work<'_>,
    ) -> Result<Mesh, Cancelled> {
        let contacts = Contacts::new(setting.surfaces);
        let facets = self.grids.par_iter().enumerate();
        let made = facets.map(|(facet, grid)| {
            work.check()?;
            let Some(grid) = grid else {
                return Ok(Vec::new());
            };
            let trees = trees(grid, facet, &contacts).into_iter().enumerate();
            let wanted = trees.filter(|(cell, _)| requests[grid.first + cell].wanted);
            let made = wanted.map(|(cell, tree)| {
                work.check()?;
                let maker = Maker {
                    setting,
                    seeds,
                    facet,
                    grid,
                    cell,
                    visible_point: requests[grid.first + cell].visible_point,
                };
                Ok((grid.first + cell, maker.elements(tree)))
            });
            made.collect()
        });
        let made: Vec<Vec<MadeCell>> = made.collect::<Result<_, Cancelled>>()?;
        let mut mesh = Mesh {
            grids: self.grids,
            cells: vec![NONE; self.cells],
            display_cells: Vec::new(),
            near_cut: Vec::new(),
            bsp_nodes: Vec::new(),
            elements: Vec::new(),
        };
        for (cell, tree) in made.into_iter().flatten() {
            let (own, _) = mesh.add_tree(tree);
            mesh.cells[cell] = own;
        }
        mesh.display_cells = mesh.with_nearest_elements();
        mesh.near_cut = mesh.cells_near_cuts();
        Ok(mesh)
    }
}

/// BSPs of the cells of a facet's grid, in order.
fn trees(grid: &Grid, facet: usize, contacts: &Contacts<'_>) -> Vec<BspTree<Vec<Line>>> {
    let least = LEAST_RISE / grid.scale[0].max(grid.scale[1]);
    let mut edges = vec![Vec::new(); grid.counts[0] * grid.counts[1]];
    for edge in contacts.of(facet, least) {
        let ends = edge.ends.map(|p| grid.place(p));
        let normal = grid.normal(edge.normal);
        for local in grid.between(ends) {
            edges[local].push(CellContactEdge {
                ends,
                normal,
                rise: edge.rise,
            });
        }
    }
    let cells = edges.iter().enumerate();
    cells
        .map(|(local, own)| bsp::split_cell(grid.corner(local), own))
        .collect()
}

/// Side of a cell when `target` cells cover the area of all facets that reflect.
fn mean_side(surfaces: &Surfaces, target: usize) -> f64 {
    let lit = surfaces.facets.iter().filter(|f| !f.is_black());
    let area: f64 = lit.map(|f| f.area).sum();
    (area / target.max(1) as f64).sqrt()
}

impl Mesh {
    /// The element at a point of a facet, or the nearest one if its cell has none; [`NONE`] if
    /// there is none.
    pub fn at(&self, facet: usize, p: Vec3) -> u32 {
        let Some(grid) = &self.grids[facet] else {
            return NONE;
        };
        self.element_for_display(grid.cell(p), grid.place(p).map(|x| x as f32))
    }

    /// The BSP node of an entry of [`Mesh::cells`] or [`Mesh::display_cells`].
    fn bsp_node(&self, entry: u32) -> Option<&BspNode> {
        let is_node = entry & CUT != 0 && entry != NONE;
        is_node.then(|| &self.bsp_nodes[(entry & !CUT) as usize])
    }

    /// The element whose light a place of a cell (in cells of its grid) shows: the cell's own, or
    /// the nearest of the grid; [`NONE`] if there is none.
    pub fn element_for_display(&self, cell: usize, place: [f32; 2]) -> u32 {
        let mut found = self.display_cells[cell];
        while let Some(node) = self.bsp_node(found) {
            found = node.display_sides[node.side(place)];
        }
        found
    }

    /// The element whose light every place of a cell shows, possibly [`NONE`]; `None` if the cell
    /// or an adjacent one is cut.
    pub fn element_for_display_if_uncut(&self, cell: usize) -> Option<u32> {
        (!self.near_cut[cell]).then_some(self.display_cells[cell])
    }

    /// True when a cell is one element or none, not split by a contact edge.
    pub fn is_uncut(&self, cell: usize) -> bool {
        let own = self.cells[cell];
        own == NONE || own & CUT == 0
    }

    /// True when surfaces that stand on `cells` hide the second place of the facet from a `point`
    /// from which the first is visible. Only a surface between the two places and between the point
    /// and the second can do so, if the ray from the point crosses it below its top. If the ray
    /// passes above it, another object may stand on top, and the result is `None`.
    pub fn occludes(
        &self,
        cells: impl Iterator<Item = usize>,
        [visible, place]: [[f32; 2]; 2],
        point: PointAboveFacet,
    ) -> Option<bool> {
        let mut above = false;
        for cell in cells {
            // Only the nodes on the path to the second place can lie between.
            let mut found = self.display_cells[cell];
            while let Some(node) = self.bsp_node(found) {
                let at = node.signed_distance(PointAboveFacet::on_facet(place));
                let from = node.signed_distance(point);
                let side = usize::from(at >= 0.0);
                let is_behind = from * at.signum() < CONTACT_TOLERANCE;
                if node.side(visible) != side && is_behind {
                    if at.abs() * point.height < node.rise * (at - from).abs() {
                        return Some(true);
                    }
                    above = true;
                }
                found = node.display_sides[side];
            }
        }
        (!above).then_some(false)
    }

    /// The element of a cell at a place; [`NONE`] if there is none.
    fn own_element(&self, cell: usize, place: [f64; 2]) -> u32 {
        let mut found = self.cells[cell];
        while let Some(node) = self.bsp_node(found) {
            found = node.sides[node.side(place.map(|x| x as f32))];
        }
        found
    }

    /// Adds the elements of a cell; returns its entries of [`Mesh::cells`] and
    /// [`Mesh::display_cells`].
    fn add_tree(&mut self, tree: BspTree<Option<Element>>) -> (u32, u32) {
        match tree {
            BspTree::Leaf(None) => (NONE, NONE),
            BspTree::Leaf(Some(element)) => {
                self.elements.push(element);
                let at = (self.elements.len() - 1) as u32;
                (at, at)
            }
            BspTree::Split(SplitPlane { line, lean, rise }, sides) => {
                let [low, high] = (*sides).map(|side| self.add_tree(side));
                // A part without an element is hidden; if rounding shows it, it takes its
                // neighbour's light.
                let display_sides = match (low.1, high.1) {
                    (NONE, NONE) => return (NONE, NONE),
                    (NONE, other) | (other, NONE) => [other, other],
                    (low, high) => [low, high],
                };
                self.bsp_nodes.push(BspNode {
                    line: line.map(|x| x as f32),
                    lean: lean as f32,
                    rise: rise as f32,
                    sides: [low.0, high.0],
                    display_sides,
                });
                let at = CUT | (self.bsp_nodes.len() - 1) as u32;
                (at, at)
            }
        }
    }

    /// Elements around a point of a facet and their bilinear weights, which sum to 1: among the
    /// surrounding cells, elements on the same side of all contact edges; failing that the cell's
    /// own element; failing that the nearest one in the grid's neighbourhood. All weights are zero
    /// if there is none.
    pub fn stencil(&self, facet: usize, p: Vec3) -> [(u32, f32); 4] {
        let mut out = [(0, 0.0); 4];
        let Some(grid) = &self.grids[facet] else {
            return out;
        };
        let (home, place) = (grid.cell(p), grid.place(p));
        let around = grid.stencil(p).map(|(cell, weight)| {
            let element = if self.is_uncut(cell) {
                self.cells[cell]
            } else {
                self.own_element(cell, grid.clamped(cell, place))
            };
            // Where the path to the cell leaves this one, or, seen from there, enters it.
            let way = || grid.clamped(home, grid.clamped(cell, place));
            let same = self.is_uncut(home)
                || self.own_element(home, place) == self.own_element(home, way());
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
        let own = self.own_element(home, place);
        let nearest = match own {
            NONE => self.nearest(grid, p, 64),
            own => Some(own),
        };
        if let Some(e) = nearest {
            out[0] = (e, 1.0);
        }
        out
    }

    /// The element of a cell (column and row); `None` if the cell is cut or empty.
    pub fn uncut_element(&self, grid: &Grid, at: [usize; 2]) -> Option<usize> {
        let element = self.cells[grid.at(at)];
        (element & CUT == 0).then_some(element as usize)
    }

    /// Calls `take` for each uncut element, with its grid, column and row.
    pub fn each_uncut(&self, mut take: impl FnMut(&Grid, [usize; 2], usize)) {
        for grid in self.grids.iter().flatten() {
            for at in grid.positions() {
                if let Some(element) = self.uncut_element(grid, at) {
                    take(grid, at, element);
                }
            }
        }
    }

    /// Calls `take` once for each pair of adjacent uncut elements of a facet.
    pub fn each_pair(&self, mut take: impl FnMut(usize, usize)) {
        for grid in self.grids.iter().flatten() {
            let [columns, rows] = grid.counts;
            let mut both = |a: [usize; 2], b: [usize; 2]| {
                let [a, b] = [a, b].map(|at| self.cells[grid.at(at)]);
                // Parts of a cut cell are separated by the surface there, and so is their light.
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

    /// Calls `take` for each three adjacent uncut elements along an axis of a facet's grid, in the
    /// order of the middle one.
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

    /// [`Mesh::cells`] with the nearest element, up to 2 cells away, for cells without one.
    fn with_nearest_elements(&self) -> Vec<u32> {
        let mut filled = self.cells.clone();
        for grid in self.grids.iter().flatten() {
            for local in 0..grid.counts[0] * grid.counts[1] {
                if filled[grid.first + local] == NONE
                    && let Some(e) = self.nearest(grid, grid.middle(local), 2)
                {
                    filled[grid.first + local] = e;
                }
            }
        }
        filled
    }

    /// For each cell, true when it or an adjacent cell is cut.
    fn cells_near_cuts(&self) -> Vec<bool> {
        let mut around = vec![false; self.cells.len()];
        for grid in self.grids.iter().flatten() {
            let [columns, rows] = grid.counts;
            let is_cut = |at: &[usize; 2]| !self.is_uncut(grid.at(*at));
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
                self.own_element(cell, grid.clamped(cell, place))
            });
            elements
                .filter(|e| *e != NONE)
                .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        })
    }
}

impl BspNode {
    /// Index of the side of a place.
    fn side(&self, place: [f32; 2]) -> usize {
        usize::from(self.signed_distance(PointAboveFacet::on_facet(place)) >= 0.0)
    }

    /// Signed distance of a point from the plane that stands on the line, in cells; not negative on
    /// the second side.
    fn signed_distance(&self, point: PointAboveFacet) -> f32 {
        let ([a, b, c], [u, v]) = (self.line, point.place);
        a * u + b * v + c + self.lean * point.height
    }
}
