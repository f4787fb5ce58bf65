//! Contact edges: lines along which other surfaces touch or cross a facet.
//!
//! Light changes abruptly across such a line, so a mesh cell must not extend over it. Surfaces that
//! hardly rise above the facet are ignored. This module does not depend on cells or lights.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count, pieces by the sorted list"
)]

use crate::surfaces::extent;
use crate::surfaces::facet::{Facet, Piece};
use crate::surfaces::hierarchy::Bounds;
use crate::surfaces::surface::Surfaces;
use footlight_show::geometry::{Vec3, vec3};

/// A segment along which a surface stands on a facet.
pub struct ContactEdge {
    /// Its ends in the facet's plane (m).
    pub ends: [Vec3; 2],
    /// Normal of that surface.
    pub normal: Vec3,
    /// Height of that surface above the facet (m).
    pub rise: f64,
}

/// All pieces, in search order.
pub struct Contacts<'a> {
    surfaces: &'a Surfaces,
    /// Pieces with their bounds, by the least x.
    boxes: Vec<(usize, Bounds)>,
}

impl<'a> Contacts<'a> {
    /// Sorts a scene's pieces.
    pub fn new(surfaces: &'a Surfaces) -> Contacts<'a> {
        let pieces = surfaces.pieces.iter().enumerate();
        let mut boxes: Vec<(usize, Bounds)> = pieces
            .map(|(i, p)| (i, Bounds::of(p.vertices.iter())))
            .collect();
        boxes.sort_by(|(i, a), (j, b)| a.low.x.total_cmp(&b.low.x).then(i.cmp(j)));
        Contacts { surfaces, boxes }
    }

    /// Contact edges of a facet with the surfaces that rise more than `least` (m) above it.
    pub fn of(&self, facet: usize, least: f64) -> Vec<ContactEdge> {
        let own = &self.surfaces.facets[facet];
        let touching = self.surfaces.touching();
        let edge = |p: &Piece| {
            let (ends, rise) = contact_segment(own, p, least.max(touching), touching)?;
            let normal = self.surfaces.facets[p.facet].normal;
            Some(ContactEdge { ends, normal, rise })
        };
        self.around(facet).filter_map(edge).collect()
    }

    /// Pieces of other facets whose bounds touch a facet's.
    fn around(&self, facet: usize) -> impl Iterator<Item = &Piece> {
        let own = &self.surfaces.facets[facet];
        let touching = self.surfaces.touching();
        let margin = vec3(1.0, 1.0, 1.0) * touching;
        let mut bounds = Bounds::of(own.vertices.iter());
        bounds.low = bounds.low - margin;
        bounds.high += margin;
        let end = self
            .boxes
            .partition_point(|(_, b)| b.low.x <= bounds.high.x);
        let near = self.boxes[..end].iter();
        near.filter(move |(_, b)| b.overlaps(&bounds))
            .map(|(i, _)| &self.surfaces.pieces[*i])
            .filter(move |p| p.facet != facet)
    }
}

/// Segment in which a piece meets the plane of a facet, and its height, if it rises above the
/// plane.
fn contact_segment(
    facet: &Facet,
    piece: &Piece,
    least: f64,
    touching: f64,
) -> Option<([Vec3; 2], f64)> {
    let heights: Vec<f64> = piece.vertices.iter().map(|v| facet.height(*v)).collect();
    let (lowest, highest) = extent(heights.iter().copied());
    if highest <= least || lowest > touching {
        return None;
    }
    let n = heights.len();
    let mut ends: Vec<Vec3> = Vec::new();
    for i in 0..n {
        let (a, b) = (heights[i], heights[(i + 1) % n]);
        let (from, to) = (piece.vertices[i], piece.vertices[(i + 1) % n]);
        if a.abs() <= touching {
            ends.push(from);
        } else if (a < -touching && b > touching) || (a > touching && b < -touching) {
            ends.push(from + (to - from) * (a / (a - b)));
        }
    }
    let apart = |p: &Vec3| (*p - ends[0]).length();
    let far = ends
        .iter()
        .copied()
        .max_by(|p, q| apart(p).total_cmp(&apart(q)))?;
    ((far - ends[0]).length() > touching).then(|| ([ends[0], far], highest))
}
