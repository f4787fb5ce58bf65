//! The BSP of a mesh cell, split into convex parts by the surfaces that stand on it.
//!
//! Lengths are in cells of the facet's grid. The longest segment within a part splits it first, if
//! it is long enough there or runs across most of the part, and if both sides are large enough; a
//! table's leg thus splits nothing. This module does not depend on space.

#![allow(
    clippy::indexing_slicing,
    reason = "corners are numbered modulo their count"
)]

use crate::surfaces::clipper::PlanePoint;
use crate::surfaces::extent;

/// `l[0] u + l[1] v + l[2]`, not negative on the left of its segment.
pub type Line = [f64; 3];

/// A contact edge in cells of the grid: the line where a surface stands on a cell.
#[derive(Clone, Copy, Debug)]
pub struct CellContactEdge {
    /// Its ends.
    pub ends: [PlanePoint; 2],
    /// Normal of the surface: along the two sides in 1/cell, and upwards in 1/m.
    pub normal: [f64; 3],
    /// Height of the surface above the facet (m).
    pub rise: f64,
}

/// The plane that splits a cell: the surface that stands on its line.
#[derive(Clone, Copy, Debug)]
pub struct SplitPlane {
    /// Intersection with the facet.
    pub line: Line,
    /// `height(line, place) + lean * h` is zero for places of the plane at a height of `h` metres.
    pub lean: f64,
    /// Height of the surface above the facet (m).
    pub rise: f64,
}

/// Greatest depth of the BSP.
const DEEPEST: usize = 4;

/// Least length, in cells, of a segment within a part that cuts it, and the share of the part's
/// length along it that suffices for a shorter one.
const LEAST_LENGTH: f64 = 0.25;
const LEAST_SHARE: f64 = 0.5;

/// Least area of a part, in cells.
const LEAST_AREA: f64 = 0.01;

/// The BSP of a cell.
#[derive(Clone, Debug)]
pub enum BspTree<T> {
    /// An undivided part.
    Leaf(T),
    /// Split by a plane; the part on its line's negative side first.
    Split(SplitPlane, Box<[BspTree<T>; 2]>),
}

/// Splits the unit square at a corner along contact edges; each leaf has its boundary lines, each
/// not negative on its side.
pub fn split_cell(corner: PlanePoint, edges: &[CellContactEdge]) -> BspTree<Vec<Line>> {
    split(&square(corner), edges, Vec::new())
}

fn square([u, v]: PlanePoint) -> [PlanePoint; 4] {
    [[u, v], [u + 1.0, v], [u + 1.0, v + 1.0], [u, v + 1.0]]
}

fn split(
    region: &[PlanePoint],
    edges: &[CellContactEdge],
    bounds: Vec<Line>,
) -> BspTree<Vec<Line>> {
    if bounds.len() == DEEPEST {
        return BspTree::Leaf(bounds);
    }
    let longest = edges
        .iter()
        .filter_map(|edge| Some((edge, divided(region, edge.ends)?)))
        .max_by(|a, b| a.1.0.total_cmp(&b.1.0));
    let Some((edge, (_, line, parts))) = longest else {
        return BspTree::Leaf(bounds);
    };
    let side = |k: usize, l: Line| {
        let bounds = bounds.iter().copied().chain([l]).collect();
        split(&parts[k], edges, bounds)
    };
    let plane = SplitPlane {
        line,
        lean: lean(line, edge.normal),
        rise: edge.rise,
    };
    BspTree::Split(plane, Box::new([side(0, line.map(|x| -x)), side(1, line)]))
}

/// Length of a segment within a region, its line, and the parts below and above that line, if the
/// line cuts the region.
fn divided(
    region: &[PlanePoint],
    segment: [PlanePoint; 2],
) -> Option<(f64, Line, [Vec<PlanePoint>; 2])> {
    let length = length_within(region, segment);
    if length <= 0.0 {
        return None;
    }
    let line = through(segment);
    let parts = [line.map(|x| -x), line].map(|l| clipped(region, l));
    let along = |p: &PlanePoint| line[1] * p[0] - line[0] * p[1];
    let on_line = |p: &&PlanePoint| height(line, **p).abs() < 1e-9;
    let (low, high) = extent(parts[1].iter().filter(on_line).map(along));
    let divides = length >= LEAST_LENGTH || length >= LEAST_SHARE * (high - low);
    let worth = parts.iter().all(|p| area(p) >= LEAST_AREA);
    (divides && worth).then_some((length, line, parts))
}

/// Slope of a plane that stands on a line.
fn lean(line: Line, [u, v, up]: [f64; 3]) -> f64 {
    // The normal's component in the cell is perpendicular to the line, which has unit slope.
    up / (line[0] * u + line[1] * v)
}

/// Signed height of a place over a line.
pub fn height(line: Line, [u, v]: PlanePoint) -> f64 {
    line[0] * u + line[1] * v + line[2]
}

/// The line through a segment, of unit slope.
fn through([a, b]: [PlanePoint; 2]) -> Line {
    let (x, y) = (b[0] - a[0], b[1] - a[1]);
    let length = x.hypot(y);
    let (p, q) = (-y / length, x / length);
    [p, q, -(p * a[0] + q * a[1])]
}

/// Length of a segment within a convex region with anticlockwise corners.
fn length_within(region: &[PlanePoint], [a, b]: [PlanePoint; 2]) -> f64 {
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    let n = region.len();
    for i in 0..n {
        let line = through([region[i], region[(i + 1) % n]]);
        let (from, to) = (height(line, a), height(line, b));
        if from < 0.0 && to < 0.0 {
            return 0.0;
        }
        let at = from / (from - to);
        if from < 0.0 {
            enter = enter.max(at);
        } else if to < 0.0 {
            leave = leave.min(at);
        }
    }
    (leave - enter).max(0.0) * (b[0] - a[0]).hypot(b[1] - a[1])
}

/// The part of a convex region where a line is not negative.
fn clipped(region: &[PlanePoint], line: Line) -> Vec<PlanePoint> {
    let mut out = Vec::with_capacity(region.len() + 1);
    let n = region.len();
    for i in 0..n {
        let (a, b) = (region[i], region[(i + 1) % n]);
        let (here, there) = (height(line, a), height(line, b));
        if here >= 0.0 {
            out.push(a);
        }
        if here * there < 0.0 {
            let t = here / (here - there);
            out.push([0, 1].map(|k| a[k] + (b[k] - a[k]) * t));
        }
    }
    out
}

fn area(region: &[PlanePoint]) -> f64 {
    let n = region.len();
    let twice = |i: usize| {
        let (a, b) = (region[i], region[(i + 1) % n]);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..n).map(twice).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upright(ends: [PlanePoint; 2]) -> CellContactEdge {
        let [a, b] = ends;
        let normal = [a[1] - b[1], b[0] - a[0], 0.0];
        CellContactEdge {
            ends,
            normal,
            rise: 1.0,
        }
    }

    fn leaves(tree: &BspTree<Vec<Line>>) -> Vec<&Vec<Line>> {
        match tree {
            BspTree::Leaf(bounds) => vec![bounds],
            BspTree::Split(_, sides) => sides.iter().flat_map(leaves).collect(),
        }
    }

    fn part(corner: PlanePoint, bounds: &[Line]) -> f64 {
        let square = square(corner).to_vec();
        area(&bounds.iter().fold(square, |r, l| clipped(&r, *l)))
    }

    #[test]
    fn the_parts_of_a_cell_add_up_to_it() {
        let box_inside = [
            [[3.2, 5.3], [3.7, 5.3]],
            [[3.7, 5.3], [3.7, 5.9]],
            [[3.7, 5.9], [3.2, 5.9]],
            [[3.2, 5.9], [3.2, 5.3]],
        ];
        let tree = split_cell([3.0, 5.0], &box_inside.map(upright));
        let areas: Vec<f64> = leaves(&tree).iter().map(|b| part([3.0, 5.0], b)).collect();
        assert_eq!(areas.len(), 5);
        assert!((areas.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(areas.iter().any(|a| (a - 0.3).abs() < 1e-12), "{areas:?}");
    }

    #[test]
    fn what_runs_along_the_rim_or_is_short_or_elsewhere_cuts_nothing() {
        for segment in [
            [[0.0, 0.0], [1.0, 0.0]],
            [[0.4, 0.5], [0.6, 0.5]],
            [[1.2, 0.0], [1.2, 1.0]],
            [[0.0, 0.995], [1.0, 0.995]],
        ] {
            let tree = split_cell([0.0, 0.0], &[upright(segment)]);
            assert_eq!(leaves(&tree).len(), 1, "{segment:?}");
        }
        let across = upright([[-3.0, 0.2], [9.0, 0.7]]);
        assert_eq!(leaves(&split_cell([0.0, 0.0], &[across])).len(), 2);
    }

    /// A roof over cells of 2 m by .5 m that rises by 3 m per metre across.
    #[test]
    fn a_plane_is_zero_at_its_own_points() {
        let ends = [[0.0, 0.5], [1.0, 0.5]];
        let normal = [0.0, -3.0 * 0.5, 1.0];
        let edge = CellContactEdge {
            ends,
            normal,
            rise: 2.0,
        };
        let BspTree::Split(roof, _) = split_cell([0.0, 0.0], &[edge]) else {
            panic!("not cut");
        };
        for up in [0.0, 0.3, 2.0] {
            let place = [0.7, 0.5 + up / 3.0 / 0.5];
            assert!((height(roof.line, place) + roof.lean * up).abs() < 1e-12);
        }
    }
}
