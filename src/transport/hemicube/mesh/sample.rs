//! Sample points of a facet: centroids of the parts that squares of its grid cut out of it.
//!
//! Points keep a distance from the facet's edges, where visibility is undefined. This module does
//! not depend on lights or visibility.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count"
)]

use crate::hemicube::mesh::bsp::{Line, height};
use crate::hemicube::mesh::grid::Grid;
use crate::surfaces::facet::Facet;
use crate::surfaces::surface::{Surfaces, kept_inside};
use footlight_show::geometry::{Vec3, newell, part_above};
use std::sync::Arc;

/// The part of a grid square within the facet and its bounds, with a representative point.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Centroid of its largest convex part.
    pub point: Vec3,
    /// Area of all its parts, m².
    pub area: f64,
    /// Least corner and side of the square, in cells of the grid.
    corner: [f64; 2],
    side: f64,
    /// Boundary lines, not negative on the sample.
    bounds: Arc<[Line]>,
}

impl Sample {
    /// The square at a corner with this side, in cells, within bounds; `None` outside the facet.
    pub fn new(
        surfaces: &Surfaces,
        facet: &Facet,
        grid: &Grid,
        (corner, side): ([f64; 2], f64),
        bounds: Arc<[Line]>,
    ) -> Option<Sample> {
        let (mut area, mut largest) = (0.0, (0.0, Vec3::ZERO));
        for piece in &surfaces.pieces[facet.pieces.clone()] {
            let mut part = piece.vertices.to_vec();
            for (axis, scale, low) in [
                (grid.along, grid.scale[0], corner[0]),
                (grid.across, grid.scale[1], corner[1]),
            ] {
                let at = |p: Vec3| axis.dot(p - grid.origin) * scale;
                part = part_above(&part, |p| at(p) - low);
                part = part_above(&part, |p| low + side - at(p));
            }
            for line in bounds.iter() {
                part = part_above(&part, |p| height(*line, grid.place(p)));
            }
            let Some(&first) = part.first() else { continue };
            let local: Vec<Vec3> = part.iter().map(|v| *v - first).collect();
            let own = 0.5 * newell(&local).length();
            area += own;
            if own > largest.0 {
                largest = (own, first + centroid(&local));
            }
        }
        let whole = side * side / (grid.scale[0] * grid.scale[1]);
        (largest.0 > 1e-6 * whole).then(|| Sample {
            point: kept_inside(surfaces, facet, largest.1),
            area,
            corner,
            side,
            bounds,
        })
    }

    /// The sample with another representative point.
    pub fn at(self, point: Vec3) -> Sample {
        Sample { point, ..self }
    }

    /// Its four quarters, clipped to the facet.
    pub fn quarters<'a>(
        &self,
        surfaces: &'a Surfaces,
        facet: &'a Facet,
        grid: &'a Grid,
    ) -> impl Iterator<Item = Sample> + 'a {
        let half = 0.5 * self.side;
        let [u, v] = self.corner;
        let bounds = Arc::clone(&self.bounds);
        [[u, v], [u + half, v], [u, v + half], [u + half, v + half]]
            .into_iter()
            .filter_map(move |corner| {
                Sample::new(surfaces, facet, grid, (corner, half), Arc::clone(&bounds))
            })
    }

    /// Sides of its square in space.
    pub fn sides(&self, grid: &Grid) -> [Vec3; 2] {
        [
            grid.along * (self.side / grid.scale[0]),
            grid.across * (self.side / grid.scale[1]),
        ]
    }
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
