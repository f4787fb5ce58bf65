//! Clipping of convex polygons by straight lines in two dimensions.
//!
//! The visible part of a pixel, its part lit by a spot, and the part of a panel visible from a
//! point are all found by clipping in the plane of the image or of the panel, without samples.
//! All parts of one outline share one list of corners, so that clipping allocates nothing. This
//! module does not depend on surfaces or light.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over corners and parts that this module has made"
)]

use std::ops::Range;

use crate::surfaces::camera::Camera;
use footlight_show::geometry::{Vec3, greater, smaller};

/// A place in the image, pixels, or on a panel's plane, metres.
pub type PlanePoint = [f64; 2];

/// A half-plane: positive values of `c + x * a + y * b`, as `[c, a, b]`.
pub type Line = [f64; 3];

/// The value of a line at a place.
pub fn value(line: &Line, at: PlanePoint) -> f64 {
    line[0] + line[1] * at[0] + line[2] * at[1]
}

/// The half-plane of the image, in pixels, in which `normal . ray` is positive.
pub fn line(camera: &Camera, normal: Vec3) -> Line {
    let line = [
        normal.dot(camera.ray(0.0, 0.0)),
        normal.dot(camera.right) * camera.step_x,
        -normal.dot(camera.up) * camera.step_y,
    ];
    let slope = line[1].hypot(line[2]);
    if slope > 0.0 {
        line.map(|l| l / slope)
    } else {
        line
    }
}

/// Area and centroid of a convex polygon.
pub fn measured(polygon: &[PlanePoint]) -> (f64, PlanePoint) {
    let o = polygon[0];
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for w in polygon.windows(2) {
        let [p, q] = [w[0], w[1]].map(|p| [p[0] - o[0], p[1] - o[1]]);
        let twice = p[0] * q[1] - p[1] * q[0];
        area += twice;
        x += twice * (p[0] + q[0]);
        y += twice * (p[1] + q[1]);
    }
    if area == 0.0 {
        return (0.0, o);
    }
    let centre = [o[0] + x / (3.0 * area), o[1] + y / (3.0 * area)];
    (area.abs() * 0.5, centre)
}

/// Minimum and maximum of a line over a rectangle.
pub fn range(line: &Line, Rectangle([left, right, top, bottom]): &Rectangle) -> (f64, f64) {
    let middle = value(line, [0.5 * (left + right), 0.5 * (top + bottom)]);
    let reach = line[1].abs() * (0.5 * (right - left)) + line[2].abs() * (0.5 * (bottom - top));
    (middle - reach, middle + reach)
}

/// Bounds of two coordinates: minimum and maximum of the first, then of the second.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle(pub [f64; 4]);

impl Rectangle {
    /// Contains nothing.
    pub const EMPTY: Rectangle = Rectangle([
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ]);

    /// Contains everything.
    pub const EVERYWHERE: Rectangle = Rectangle([
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
    ]);

    /// Smallest rectangle that contains both.
    pub fn with(self, o: Rectangle) -> Rectangle {
        let [a, b, c, d] = self.0;
        let [e, f, g, h] = o.0;
        Rectangle([smaller(a, e), greater(b, f), smaller(c, g), greater(d, h)])
    }

    /// Rectangle of one point.
    pub fn at([x, y]: PlanePoint) -> Rectangle {
        Rectangle([x, x, y, y])
    }

    /// Smallest rectangle that contains the points.
    pub fn of(places: &[PlanePoint]) -> Rectangle {
        let points = places.iter().map(|p| Rectangle::at(*p));
        points.fold(Rectangle::EMPTY, Rectangle::with)
    }

    /// True when both have more than an edge in common.
    pub fn overlaps(&self, o: &Rectangle) -> bool {
        let [a, b, c, d] = self.0;
        let [e, f, g, h] = o.0;
        a < f && e < b && c < h && g < d
    }
}

/// A convex part of the outline.
#[derive(Clone, Debug)]
struct Part {
    corners: Range<usize>,
    bounds: Rectangle,
}

/// Working memory of one thread: the remaining parts of an outline.
#[derive(Debug, Default)]
pub struct PolygonClipper {
    places: Vec<PlanePoint>,
    parts: Vec<Part>,
    heights: Vec<f64>,
}

impl PolygonClipper {
    /// Removes the outline.
    pub fn clear(&mut self) {
        self.places.clear();
        self.parts.clear();
    }

    /// Adds a convex part of the outline.
    pub fn add(&mut self, outline: &[PlanePoint]) {
        let from = self.places.len();
        self.places.extend_from_slice(outline);
        self.push(from..self.places.len());
    }

    /// Number of remaining parts.
    pub fn count(&self) -> usize {
        self.parts.len()
    }

    /// Outline of each remaining part.
    pub fn parts(&self) -> impl Iterator<Item = &[PlanePoint]> {
        self.parts.iter().map(|p| &self.places[p.corners.clone()])
    }

    /// Bounds of the remaining parts.
    pub fn bounds(&self) -> Rectangle {
        let bounds = self.parts.iter().map(|p| p.bounds);
        bounds.fold(Rectangle::EMPTY, Rectangle::with)
    }

    /// Keeps the parts for which `wanted` is true.
    pub fn retain(&mut self, mut wanted: impl FnMut(&[PlanePoint]) -> bool) {
        let places = &self.places;
        self.parts.retain(|p| wanted(&places[p.corners.clone()]));
    }

    /// Keeps only the region within the lines.
    pub fn keep<'a>(&mut self, lines: impl Iterator<Item = &'a Line> + Clone) {
        for at in (0..self.parts.len()).rev() {
            let part = self.parts.swap_remove(at).corners;
            let inside = |rest, line| self.cut(rest, line).0;
            if let Some(rest) = lines.clone().try_fold(part, inside) {
                self.push(rest);
            }
        }
    }

    /// Cuts away the region within the lines, which must lie in `bounds`.
    pub fn subtract<'a>(
        &mut self,
        lines: impl Iterator<Item = &'a Line> + Clone,
        bounds: &Rectangle,
    ) {
        // From the last on: new parts lie outside and are not clipped again.
        for at in (0..self.parts.len()).rev() {
            let part = &self.parts[at];
            if !part.bounds.overlaps(bounds) {
                continue;
            }
            let corners = &self.places[part.corners.clone()];
            let outside = |l: &Line| corners.iter().all(|c| value(l, *c) <= 0.0);
            if lines.clone().any(outside) {
                continue;
            }
            let mut rest = self.parts.swap_remove(at).corners;
            for line in lines.clone() {
                let (inside, outside) = self.cut(rest, line);
                if let Some(outside) = outside {
                    self.push(outside);
                }
                match inside {
                    Some(inside) => rest = inside,
                    None => break,
                }
            }
        }
    }

    fn push(&mut self, corners: Range<usize>) {
        let bounds = Rectangle::of(&self.places[corners.clone()]);
        self.parts.push(Part { corners, bounds });
    }

    /// Splits a part into its regions inside and outside a line.
    fn cut(
        &mut self,
        part: Range<usize>,
        line: &Line,
    ) -> (Option<Range<usize>>, Option<Range<usize>>) {
        self.heights.clear();
        let places = &self.places;
        self.heights
            .extend(part.clone().map(|i| value(line, places[i])));
        if self.heights.iter().all(|h| *h >= 0.0) {
            return (Some(part), None);
        }
        if self.heights.iter().all(|h| *h <= 0.0) {
            return (None, Some(part));
        }
        let count = part.len();
        let mut halves = [0..0, 0..0];
        for (half, sign) in halves.iter_mut().zip([1.0, -1.0]) {
            let start = self.places.len();
            for i in 0..count {
                let j = (i + 1) % count;
                let (here, there) = (self.heights[i] * sign, self.heights[j] * sign);
                let (a, b) = (self.places[part.start + i], self.places[part.start + j]);
                if here >= 0.0 {
                    self.places.push(a);
                }
                if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                    let t = here / (here - there);
                    self.places
                        .push([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
                }
            }
            *half = start..self.places.len();
        }
        let [inside, outside] = halves.map(|half| (half.len() >= 3).then_some(half));
        (inside, outside)
    }
}
