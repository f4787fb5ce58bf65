//! The grid of a facet: its cells and the neighbourhood of a point.
//!
//! This module does not depend on other facets.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count, axes by two"
)]

use crate::surfaces::extent;
use crate::surfaces::facet::Facet;
use footlight_show::geometry::Vec3;

/// Most cells along one side of a facet.
const MOST_CELLS: f64 = 2048.0;

/// The grid of one facet.
#[derive(Clone, Debug)]
pub struct Grid {
    pub(super) origin: Vec3,
    pub(super) along: Vec3,
    pub(super) across: Vec3,
    /// Inverse of the cell's sides.
    pub(super) scale: [f64; 2],
    /// Cells along the two sides.
    pub counts: [usize; 2],
    /// True when samples of the outermost cells lie on the rim instead of the centres.
    pub(super) on_rim: bool,
    /// Index of its first cell in all grids; the others follow line by line.
    pub first: usize,
}

impl Grid {
    /// A grid over a facet, with cells of approximately `side` metres; its cells start at `first`.
    pub(super) fn over(facet: &Facet, side: f64, on_rim: bool, first: usize) -> Grid {
        let n = facet.vertices.len();
        let edges = (0..n).map(|i| facet.vertices[(i + 1) % n] - facet.vertices[i]);
        let longest = edges.fold(Vec3::ZERO, |best, e| {
            // Only a clearly longer edge wins, so that the choice between opposite edges of a
            // rectangle is stable.
            if e.length() > best.length() * (1.0 + 1e-9) {
                e
            } else {
                best
            }
        });
        let along = longest.normalized();
        let across = facet.normal.cross(along);
        let vertices = facet.vertices.iter().map(|v| *v - facet.vertices[0]);
        let [u, v] = [along, across].map(|axis| extent(vertices.clone().map(|d| axis.dot(d))));
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

    /// The grid with each cell divided into four.
    pub(super) fn quartered(&self) -> Grid {
        Grid {
            scale: self.scale.map(|s| 2.0 * s),
            counts: self.counts.map(|n| 2 * n),
            first: 4 * self.first,
            ..self.clone()
        }
    }

    /// Position in cells, not clamped.
    pub fn place(&self, p: Vec3) -> [f64; 2] {
        let d = p - self.origin;
        [
            d.dot(self.along) * self.scale[0],
            d.dot(self.across) * self.scale[1],
        ]
    }

    /// Cells per metre, along the two sides.
    pub fn slopes(&self) -> [Vec3; 2] {
        [self.along * self.scale[0], self.across * self.scale[1]]
    }

    /// Converts a normal to units of the grid: per cell along the two sides, per metre upwards.
    pub(super) fn normal(&self, normal: Vec3) -> [f64; 3] {
        let [along, across] = [self.along, self.across].map(|axis| normal.dot(axis));
        let up = normal.dot(self.along.cross(self.across));
        [along / self.scale[0], across / self.scale[1], up]
    }

    /// The cell that contains a point of the facet.
    pub fn cell(&self, p: Vec3) -> usize {
        let [u, v] = self.place(p);
        // The cast saturates: below zero is zero.
        let (i, j) = (u as usize, v as usize);
        self.at([i.min(self.counts[0] - 1), j.min(self.counts[1] - 1)])
    }

    /// Columns and rows of all cells, line by line.
    pub fn positions(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.counts;
        (0..rows).flat_map(move |j| (0..columns).map(move |i| [i, j]))
    }

    /// The cell at a column and row.
    pub fn at(&self, [i, j]: [usize; 2]) -> usize {
        self.first + j * self.counts[0] + i
    }

    /// Column and row of a cell, by its index within the grid.
    pub(super) fn position(&self, local: usize) -> [usize; 2] {
        [local % self.counts[0], local / self.counts[0]]
    }

    /// Least corner of a cell, by its index within the grid, in cells.
    pub(super) fn corner(&self, local: usize) -> [f64; 2] {
        self.position(local).map(|k| k as f64)
    }

    /// The place within a cell nearest to a place.
    pub(super) fn clamped(&self, cell: usize, place: [f64; 2]) -> [f64; 2] {
        let low = self.corner(cell - self.first);
        [0, 1].map(|k| place[k].clamp(low[k], low[k] + 1.0))
    }

    /// Indices within the grid of the cells in the rectangle between two places.
    pub(super) fn between(&self, [a, b]: [[f64; 2]; 2]) -> impl Iterator<Item = usize> + use<> {
        let columns = self.counts[0];
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]), a[k].max(b[k]));
            // The cast saturates: below zero is zero.
            (low as usize)..(high.max(0.0).ceil() as usize).min(self.counts[k])
        };
        let (across, along) = (range(1), range(0));
        across.flat_map(move |j| along.clone().map(move |i| j * columns + i))
    }

    /// Centre of a cell, by its index within the grid.
    pub(super) fn middle(&self, local: usize) -> Vec3 {
        let [i, j] = self.position(local);
        self.origin
            + self.along * ((i as f64 + 0.5) / self.scale[0])
            + self.across * ((j as f64 + 0.5) / self.scale[1])
    }

    /// Position of the sample of cell `i` of `n`, in cells.
    pub fn stand(&self, i: usize, n: usize) -> f64 {
        match i {
            0 if self.on_rim && n > 1 => 0.0,
            i if self.on_rim && n > 1 && i == n - 1 => n as f64,
            i => i as f64 + 0.5,
        }
    }

    /// The four cells whose samples surround a point, and their bilinear weights; beyond the
    /// outermost samples the nearest ones count.
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
        [
            (self.at([i, j]), (1.0 - s) * (1.0 - t)),
            (self.at([i1, j]), s * (1.0 - t)),
            (self.at([i, j1]), (1.0 - s) * t),
            (self.at([i1, j1]), s * t),
        ]
    }
}
