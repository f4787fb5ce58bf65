//! Near-field light: irradiance that varies within a pixel because its source is near.
//!
//! The integral of I cos/d² over an area equals that of I over the solid angle of the area seen
//! from the source. The solid angle of a triangle is exact (Van Oosterom and Strackee, "The Solid
//! Angle of a Plane Triangle", 1983); the smooth intensity is evaluated at centroids. Near a panel
//! that touches the surface, the mean over a pixel is taken at several points.

#![allow(
    clippy::indexing_slicing,
    reason = "fragments are named by their receivers"
)]

use crate::direct::beam::Beam;
use crate::direct::cluster::{Cluster, Receivers};
use crate::direct::shadow::Canvas;
use crate::surfaces::clipper::{PlanePoint, measured};
use crate::surfaces::fragment::Fragments;
use footlight_show::geometry::Vec3;

/// Largest ratio of a pixel's footprint to its distance from a point source for which one point
/// suffices: the inverse square law then errs by about 3/8 of its square, 0.1 %.
const NEAR: f64 = 0.05;

/// Largest such ratio for the part of an outline over which intensity is constant: beams are smooth
/// over this angle, in radians.
const FINE: f64 = 0.05;

/// Most halvings of a triangle; one that contains the foot of the source is never fine enough.
const DEPTH: usize = 24;

/// Part of an image that shows one facet, with the outlines of its fragments.
pub struct Picture<'a> {
    receivers: &'a Receivers,
    fragments: &'a Fragments,
    /// The facet's plane in the image.
    pub canvas: Canvas<'a>,
}

impl<'a> Picture<'a> {
    /// The facet of unit `normal` that holds a chunk of the receivers.
    pub fn new(
        receivers: &'a Receivers,
        fragments: &'a Fragments,
        normal: Vec3,
        chunk: &Cluster,
    ) -> Picture<'a> {
        let camera = &fragments.camera;
        let height = normal.dot(chunk.corners[0] - camera.origin);
        Picture {
            receivers,
            fragments,
            canvas: Canvas {
                camera,
                normal,
                height,
            },
        }
    }

    /// Calls `each` for each convex part of a receiver's outline.
    pub fn outline(&self, receiver: usize, each: impl FnMut(&[PlanePoint])) {
        let fragment = self.receivers.origin[receiver];
        self.fragments.outline(fragment, each);
    }

    /// Approximate length of a pixel on the facet at a point, metres.
    pub fn footprint(&self, point: Vec3) -> f64 {
        let camera = self.canvas.camera;
        let ray = point - camera.origin;
        // Perpendicular to the line of sight a pixel is `step` times the distance; on an inclined
        // surface it is longer by the inverse cosine.
        let step = camera.step_x.max(camera.step_y);
        ray.dot(ray) * step / self.canvas.height.abs()
    }

    /// Mean of `at` over a receiver's outline, evaluated at the centres of `4^depth` triangles for
    /// each of its sides.
    pub fn mean(&self, receiver: usize, depth: u32, mut at: impl FnMut(Vec3) -> f64) -> f64 {
        let (mut sum, mut whole) = (0.0, 0.0);
        self.outline(receiver, |part| {
            let (_, middle) = measured(part);
            let next = part.iter().skip(1).chain(part.first());
            for (a, b) in part.iter().zip(next) {
                let own = area([middle, *a, *b]);
                whole += own;
                let point = |place| self.canvas.point(place);
                sum += own * quartered([middle, *a, *b], depth, &mut |place| at(point(place)));
            }
        });
        if whole > 0.0 { sum / whole } else { 0.0 }
    }
}

/// Mean of the values at the centres of `4^depth` equal parts of a triangle.
fn quartered(
    [a, b, c]: [PlanePoint; 3],
    depth: u32,
    at: &mut impl FnMut(PlanePoint) -> f64,
) -> f64 {
    if depth == 0 {
        return at([0, 1].map(|i| (a[i] + b[i] + c[i]) / 3.0));
    }
    let half = |p: PlanePoint, q: PlanePoint| [0, 1].map(|i| 0.5 * (p[i] + q[i]));
    let [ab, bc, ca] = [half(a, b), half(b, c), half(c, a)];
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    let mut sum = 0.0;
    for part in parts {
        sum += quartered(part, depth - 1, at);
    }
    0.25 * sum
}

/// True when the irradiance of a point source must be averaged over the pixel that shows `point`.
pub fn is_near(beam: &Beam, picture: &Picture<'_>, point: Vec3) -> bool {
    let d = point - beam.position;
    picture.footprint(point) > NEAR * d.length()
}

/// Mean unoccluded irradiance times area, and area, of a convex outline in an image, per unit of
/// the light's own intensity. Every part of a pixel has equal weight.
pub fn light(beam: &Beam, canvas: &Canvas<'_>, part: &[PlanePoint]) -> (f64, f64) {
    let (mut light, mut whole) = (0.0, 0.0);
    let corner = |place: &PlanePoint| Corner::new(*place, beam, canvas);
    let Some((first, rest)) = part.split_first() else {
        return (0.0, 0.0);
    };
    for pair in rest.windows(2) {
        if let [a, b] = pair {
            let own = area([*first, *a, *b]);
            let corners = [corner(first), corner(a), corner(b)];
            whole += own;
            light += own * over((beam, canvas), corners, DEPTH);
        }
    }
    (light, whole)
}

/// Area of a triangle in the image.
fn area([a, b, c]: [PlanePoint; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1]]);
    0.5 * (u[0] * v[1] - u[1] * v[0]).abs()
}

/// A corner in the image, and relative to the source.
#[derive(Clone, Copy)]
struct Corner {
    place: PlanePoint,
    way: Vec3,
}

impl Corner {
    fn new(place: PlanePoint, beam: &Beam, canvas: &Canvas<'_>) -> Corner {
        Corner {
            place,
            way: canvas.point(place) - beam.position,
        }
    }
}

/// Mean irradiance over a triangle of the image.
fn over(source: (&Beam, &Canvas<'_>), [a, b, c]: [Corner; 3], depth: usize) -> f64 {
    let ways = [a, b, c].map(|corner| corner.way);
    let [u, v, w] = ways;
    let centre = (u + v + w) * (1.0 / 3.0);
    let sides = [v - w, w - u, u - v].map(|side| side.dot(side));
    let longest = sides[0].max(sides[1]).max(sides[2]);
    if depth == 0 || longest <= FINE * FINE * centre.dot(centre) {
        let area = 0.5 * (v - u).cross(w - u).length();
        let angle = solid_angle(ways);
        return if area > 0.0 {
            source.0.share(centre) * angle / area
        } else {
            0.0
        };
    }
    // The corner opposite the side to be halved, and that side.
    let [tip, from, to] = if longest == sides[0] {
        [a, b, c]
    } else if longest == sides[1] {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let half = |i: usize| 0.5 * (from.place[i] + to.place[i]);
    let middle = Corner::new([half(0), half(1)], source.0, source.1);
    let first = over(source, [tip, from, middle], depth - 1);
    let second = over(source, [tip, middle, to], depth - 1);
    0.5 * (first + second)
}

/// Solid angle of a triangle seen from the origin, steradians.
fn solid_angle([a, b, c]: [Vec3; 3]) -> f64 {
    let [la, lb, lc] = [a, b, c].map(Vec3::length);
    let triple = a.dot(b.cross(c)).abs();
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * triple.atan2(below)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use footlight_show::geometry::vec3;

    #[test]
    fn an_octant_is_an_eighth_of_the_sphere() {
        let octant = [
            vec3(2.0, 0.0, 0.0),
            vec3(0.0, 3.0, 0.0),
            vec3(0.0, 0.0, 1.0),
        ];
        assert!((solid_angle(octant) - 0.5 * PI).abs() < 1e-14);
        assert_eq!(solid_angle([octant[0], octant[1], octant[0]]), 0.0);
    }

    #[test]
    fn small_triangles_have_the_angle_of_the_cosine_law() {
        let h = 1e-4;
        let at = |x: f64, y: f64| vec3(1.0 + x, 0.5 + y, 2.0);
        let small = [at(0.0, 0.0), at(h, 0.0), at(0.0, h)];
        let d = at(h / 3.0, h / 3.0);
        let expected = 0.5 * h * h * d.z / d.length().powi(3);
        assert!((solid_angle(small) / expected - 1.0).abs() < 1e-6);
    }
}
