//! Convex parts of the picture, cut by straight lines.
//!
//! What a pixel shows, and what is lit of it, are both found by cutting polygons in two dimensions:
//! no samples, no bias, edges sharp at any size. All parts of one outline share one list of
//! corners, so that cutting allocates nothing. This room knows nothing of surfaces or light.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over corners and parts that this module has made"
)]

use crate::geometry::Vec3;
use crate::raster::Camera;

/// A place in the picture, in pixels.
pub type Place = [f64; 2];

/// A half-plane of the picture: positive values of `c + x * a + y * b`, as `[c, a, b]`.
pub type Line = [f64; 3];

/// The value of a line at a place.
pub fn value(line: &Line, at: Place) -> f64 {
    line[0] + line[1] * at[0] + line[2] * at[1]
}

/// Where in the picture `normal . ray` is positive, its values in pixels.
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
pub fn measured(polygon: &[Place]) -> (f64, Place) {
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

type Part = std::ops::Range<usize>;

/// Working memory for one thread: what is left of an outline.
#[derive(Debug, Default)]
pub struct Stencil {
    places: Vec<Place>,
    parts: Vec<Part>,
    next: Vec<Part>,
    heights: Vec<f64>,
}

impl Stencil {
    /// Forgets the outline.
    pub fn clear(&mut self) {
        self.places.clear();
        self.parts.clear();
    }

    /// Adds a convex part of the outline.
    pub fn add(&mut self, outline: &[Place]) {
        let from = self.places.len();
        self.places.extend_from_slice(outline);
        self.parts.push(from..self.places.len());
    }

    /// How many parts are left.
    pub fn count(&self) -> usize {
        self.parts.len()
    }

    /// The outline of each part that is left.
    pub fn parts(&self) -> impl Iterator<Item = &[Place]> {
        self.parts.iter().map(|p| &self.places[p.clone()])
    }

    /// Leaves the parts that `wanted` says.
    pub fn retain(&mut self, mut wanted: impl FnMut(&[Place]) -> bool) {
        let places = &self.places;
        self.parts.retain(|p| wanted(&places[p.clone()]));
    }

    /// Cuts away all but what lies within the lines.
    pub fn keep<'a>(&mut self, lines: impl Iterator<Item = &'a Line> + Clone) {
        self.each_part(|stencil, part, _| {
            let mut rest = Some(part);
            for line in lines.clone() {
                rest = rest.and_then(|r| stencil.cut(r, line).0);
            }
            rest
        });
    }

    /// Cuts away what lies within the lines.
    pub fn subtract<'a>(&mut self, lines: impl Iterator<Item = &'a Line> + Clone) {
        self.each_part(|stencil, part, left| {
            let corners = &stencil.places[part.clone()];
            let outside = |l: &Line| corners.iter().all(|c| value(l, *c) <= 0.0);
            if lines.clone().any(outside) {
                return Some(part);
            }
            let mut rest = Some(part);
            for line in lines.clone() {
                rest = rest.and_then(|r| {
                    let (inside, outside) = stencil.cut(r, line);
                    left.extend(outside);
                    inside
                });
            }
            None
        });
    }

    /// Replaces every part by what is returned and what is added to the list.
    fn each_part(
        &mut self,
        mut replace: impl FnMut(&mut Self, Part, &mut Vec<Part>) -> Option<Part>,
    ) {
        let mut parts = std::mem::take(&mut self.parts);
        let mut next = std::mem::take(&mut self.next);
        next.clear();
        for part in parts.drain(..) {
            let left = replace(self, part, &mut next);
            next.extend(left);
        }
        self.parts = next;
        self.next = parts;
    }

    /// What of a part is inside a line, and what is outside.
    fn cut(&mut self, part: Part, line: &Line) -> (Option<Part>, Option<Part>) {
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
