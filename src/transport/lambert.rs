//! Irradiance from a convex polygon of unit radiance: Lambert's closed form, exact visibility.
//!
//! The irradiance at a point is half the sum, over the polygon's edges, of the angle that the edge
//! subtends times the component of the edge's unit moment along the receiver's normal (Lambert,
//! Photometria, 1760). An occluder's shadow on the polygon is what lies behind it within the cone
//! from the point through its edges; it is cut away exactly, so shadows have no samples and no
//! noise. This room knows one point and one polygon, nothing of meshes.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over the polygon's own vertices"
)]

use crate::geometry::Vec3;
use crate::transport::surface::Piece;
use crate::transport::visibility::blocks;

/// Lit parts beyond which the emitter is halved and each half begun anew, so that the work stays
/// near the number of occluders. Shadows of a dozen separate occluders stay far below it.
const MOST_PARTS: usize = 192;

/// How often an emitter is halved at most; beyond it the occluders that are left are tested at a
/// few points of each part.
const MOST_HALVINGS: usize = 8;

/// A convex polygon in a small arena: directions from the receiving point, not normalised.
type Part = std::ops::Range<usize>;

/// Working memory for one thread: the lit parts of the emitter.
#[derive(Debug, Default)]
pub struct Clipper {
    arena: Vec<Vec3>,
    parts: Vec<Part>,
    next: Vec<Part>,
    distances: Vec<f64>,
    walls: Vec<Vec3>,
    /// Corners of the occluder at hand, from the point.
    corners: Vec<Vec3>,
    /// The whole emitter above the horizon, and planes through the point and its edges.
    whole: Vec<Vec3>,
    sides: Vec<Vec3>,
}

/// Irradiance per unit radiance at the point from which the polygon's corners are seen in
/// directions `corners` (any length), on a surface of unit `normal`. Counter-clockwise seen from
/// the point's front side gives the sign of the polygon; the part must lie above the horizon.
fn closed_form(corners: &[Vec3], normal: Vec3) -> f64 {
    let mut sum = 0.0;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let moment = a.cross(b);
        let sine = moment.length();
        if sine > 0.0 {
            sum += moment.dot(normal) * (sine.atan2(a.dot(b)) / sine);
        }
    }
    sum.abs() * 0.5
}

/// A convex polygon cut in two across its longest extent.
pub fn halved(polygon: &[Vec3]) -> [Vec<Vec3>; 2] {
    let first = polygon.first().copied().unwrap_or_default();
    let centre = polygon.iter().fold(Vec3::ZERO, |s, v| s + *v) / polygon.len().max(1) as f64;
    let far = polygon.iter().fold(first, |far, v| {
        if (*v - first).length() > (far - first).length() {
            *v
        } else {
            far
        }
    });
    let axis = far - first;
    [1.0, -1.0].map(|sign| {
        let height = |v: Vec3| axis.dot(v - centre) * sign;
        let mut half = Vec::with_capacity(polygon.len() + 1);
        for (i, &a) in polygon.iter().enumerate() {
            let b = polygon[(i + 1) % polygon.len()];
            let (here, there) = (height(a), height(b));
            if here >= 0.0 {
                half.push(a);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                half.push(a + (b - a) * (here / (here - there)));
            }
        }
        half
    })
}

impl Clipper {
    /// Starts with the part of `emitter` above the horizon of a point; false when none is. The
    /// caller has seen to it that the point lies in front of the emitter.
    fn start(&mut self, point: Vec3, normal: Vec3, emitter: &[Vec3]) -> bool {
        self.arena.clear();
        self.parts.clear();
        self.distances.clear();
        self.distances
            .extend(emitter.iter().map(|v| normal.dot(*v - point)));
        for (i, &v) in emitter.iter().enumerate() {
            let j = (i + 1) % emitter.len();
            let (here, there) = (self.distances[i], self.distances[j]);
            if here > 0.0 {
                self.arena.push(v - point);
            }
            if (here > 0.0) != (there > 0.0) {
                let cut = v + (emitter[j] - v) * (here / (here - there));
                self.arena.push(cut - point);
            }
        }
        let count = self.arena.len();
        self.parts.extend((count >= 3).then_some(0..count));
        count >= 3
    }

    /// Irradiance at `point` from the unoccluded `emitter`.
    pub fn unoccluded(&mut self, point: Vec3, normal: Vec3, emitter: &[Vec3]) -> f64 {
        if self.start(point, normal, emitter) {
            closed_form(&self.arena, normal)
        } else {
            0.0
        }
    }

    /// Irradiance at `point` from `emitter` past the `occluders`; those whose plane holds the
    /// point (within `touching`) do not block.
    pub fn occluded<'a>(
        &mut self,
        point: Vec3,
        normal: Vec3,
        emitter: &[Vec3],
        occluders: impl Iterator<Item = &'a Piece> + Clone,
        touching: f64,
    ) -> f64 {
        self.past(point, normal, emitter, occluders, touching, MOST_HALVINGS)
    }

    fn past<'a>(
        &mut self,
        point: Vec3,
        normal: Vec3,
        emitter: &[Vec3],
        occluders: impl Iterator<Item = &'a Piece> + Clone,
        touching: f64,
        halvings: usize,
    ) -> f64 {
        if !self.start(point, normal, emitter) {
            return 0.0;
        }
        self.whole.clone_from(&self.arena);
        self.sides.clear();
        let n = self.whole.len();
        self.sides
            .extend((0..n).map(|i| self.whole[i].cross(self.whole[(i + 1) % n])));
        // All on one side of each, but for rounding on the edge itself.
        let centre = self.whole.iter().fold(Vec3::ZERO, |sum, c| sum + *c);
        for side in &mut self.sides {
            if side.dot(centre) < 0.0 {
                *side = -*side;
            }
        }
        let mut rest = occluders.clone();
        while let Some(piece) = rest.next() {
            self.subtract(point, piece, touching);
            if self.parts.is_empty() {
                return 0.0;
            }
            if self.parts.len() < MOST_PARTS {
                continue;
            }
            if halvings == 0 {
                let rest: Vec<&Piece> = rest.collect();
                return self.sampled(point, normal, &rest, touching);
            }
            return halved(emitter)
                .iter()
                .map(|h| self.past(point, normal, h, occluders.clone(), touching, halvings - 1))
                .sum();
        }
        let arena = &self.arena;
        self.parts
            .iter()
            .map(|p| closed_form(&arena[p.clone()], normal))
            .sum()
    }

    /// Irradiance from the parts cut so far, the `rest` of the occluders tested at a few points of
    /// each part.
    fn sampled(&self, point: Vec3, normal: Vec3, rest: &[&Piece], touching: f64) -> f64 {
        let open = |d: Vec3| !rest.iter().any(|p| blocks(p, point, point + d, touching));
        let mut sum = 0.0;
        for part in &self.parts {
            let corners = &self.arena[part.clone()];
            for pair in corners.windows(2).skip(1) {
                let triangle = [corners[0], pair[0], pair[1]];
                let [a, b, c] = triangle;
                let samples = [
                    a + b + c,
                    a * 2.0 + (b + c) * 0.5,
                    b * 2.0 + (a + c) * 0.5,
                    c * 2.0 + (a + b) * 0.5,
                ];
                let seen = samples.iter().filter(|d| open(**d / 3.0)).count();
                if seen > 0 {
                    sum += closed_form(&triangle, normal) * seen as f64 / samples.len() as f64;
                }
            }
        }
        sum
    }

    /// Cuts away what lies in the shadow of `piece`.
    fn subtract(&mut self, point: Vec3, piece: &Piece, touching: f64) {
        let height = piece.normal.dot(piece.vertices[0] - point);
        if height.abs() <= touching {
            return;
        }
        let side = height.signum();
        // Separated by a plane through the point and an edge of either.
        self.corners.clear();
        self.corners
            .extend(piece.vertices.iter().map(|v| *v - point));
        let corners = self.corners.as_slice();
        let outside = |w: &Vec3| corners.iter().all(|c| w.dot(*c) <= 0.0);
        if self.sides.iter().any(outside) {
            return;
        }
        self.walls.clear();
        for (i, v) in corners.iter().enumerate() {
            let w = corners[if i + 1 < corners.len() { i + 1 } else { 0 }];
            // Inside the cone: wall . direction > 0.
            let wall = v.cross(w) * side;
            if self.whole.iter().all(|c| wall.dot(*c) <= 0.0) {
                return;
            }
            self.walls.push(wall);
        }
        let mut parts = std::mem::take(&mut self.parts);
        let mut next = std::mem::take(&mut self.next);
        next.clear();
        for part in parts.drain(..) {
            self.subtract_from(part, piece.normal * side, height * side, &mut next);
        }
        self.parts = next;
        self.next = parts;
    }

    /// Keeps the lit rest of one part. The shadow is where every wall and the plane
    /// `beyond . direction > distance` hold; each in turn cuts off what is outside it.
    fn subtract_from(&mut self, part: Part, beyond: Vec3, distance: f64, lit: &mut Vec<Part>) {
        let corners = &self.arena[part.clone()];
        let clear_of = |w: &Vec3| corners.iter().all(|c| w.dot(*c) <= 0.0);
        let before = corners.iter().all(|c| beyond.dot(*c) <= distance);
        if before || self.walls.iter().any(clear_of) {
            lit.push(part);
            return;
        }
        let Some(mut rest) = self.cut(part, beyond, distance, lit) else {
            return;
        };
        for i in 0..self.walls.len() {
            match self.cut(rest, self.walls[i], 0.0, lit) {
                Some(inside) => rest = inside,
                None => return,
            }
        }
    }

    /// Splits a part by a plane: outside goes to `lit`, inside is returned.
    fn cut(&mut self, part: Part, wall: Vec3, offset: f64, lit: &mut Vec<Part>) -> Option<Part> {
        let count = part.len();
        self.distances.clear();
        let arena = &self.arena;
        self.distances
            .extend(part.clone().map(|i| wall.dot(arena[i]) - offset));
        let inside = self.distances.iter().filter(|d| **d > 0.0).count();
        if inside == 0 {
            lit.push(part);
            return None;
        }
        if self.distances.iter().all(|d| *d >= 0.0) {
            return Some(part);
        }
        let mut halves = [0..0, 0..0];
        for (half, sign) in halves.iter_mut().zip([1.0, -1.0]) {
            let start = self.arena.len();
            for i in 0..count {
                let j = (i + 1) % count;
                let (here, there) = (self.distances[i] * sign, self.distances[j] * sign);
                let (a, b) = (self.arena[part.start + i], self.arena[part.start + j]);
                if here >= 0.0 {
                    self.arena.push(a);
                }
                if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                    self.arena.push(a + (b - a) * (here / (here - there)));
                }
            }
            *half = start..self.arena.len();
        }
        let [inner, outer] = halves;
        if outer.len() >= 3 {
            lit.push(outer);
        }
        (inner.len() >= 3).then_some(inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    fn rectangle(x: (f64, f64), y: (f64, f64), z: f64) -> Vec<Vec3> {
        vec![
            vec3(x.0, y.0, z),
            vec3(x.0, y.1, z),
            vec3(x.1, y.1, z),
            vec3(x.1, y.0, z),
        ]
    }

    fn occluder(x: (f64, f64), y: (f64, f64), z: f64) -> Piece {
        Piece {
            vertices: rectangle(x, y, z),
            normal: -UP,
            facet: 0,
        }
    }

    /// Form factor between two finite surfaces: mean over the receiver by Gauss-Legendre.
    fn mean_factor(receiver: impl Fn(f64, f64) -> Vec3, normal: Vec3, emitter: &[Vec3]) -> f64 {
        let (nodes, weights) = (
            [0.861_136_311_594_052_6, 0.339_981_043_584_856_3],
            [0.347_854_845_137_453_85, 0.652_145_154_862_546_1],
        );
        let panels = 12;
        let rule: Vec<(f64, f64)> = (0..panels)
            .flat_map(|p| {
                (0..4).map(move |i| {
                    let (x, w) = (
                        nodes[i % 2] * if i < 2 { 1.0 } else { -1.0 },
                        weights[i % 2],
                    );
                    (
                        (f64::from(p) + 0.5 + 0.5 * x) / f64::from(panels),
                        w * 0.5 / f64::from(panels),
                    )
                })
            })
            .collect();
        let mut clipper = Clipper::default();
        let mut sum = 0.0;
        for (u, a) in &rule {
            for (v, b) in &rule {
                sum += a * b * clipper.unoccluded(receiver(*u, *v), normal, emitter);
            }
        }
        sum / PI
    }

    #[test]
    fn parallel_unit_squares() {
        let f = mean_factor(
            |u, v| vec3(u, v, 0.0),
            UP,
            &rectangle((0.0, 1.0), (0.0, 1.0), 1.0),
        );
        assert!((f - 0.199_824_895_698).abs() < 1e-11, "{f}");
        let f = mean_factor(
            |u, v| vec3(2.0 * u, v, 0.0),
            UP,
            &rectangle((0.0, 2.0), (0.0, 1.0), 0.5),
        );
        assert!((f - 0.508_988_669_041).abs() < 1e-9, "{f}");
    }

    #[test]
    fn perpendicular_squares_with_a_common_edge() {
        let wall = [
            vec3(0.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(0.0, 1.0, 1.0),
            vec3(0.0, 0.0, 1.0),
        ];
        let f = mean_factor(|u, v| vec3(u, v, 0.0), UP, &wall);
        // The integrand has a kink at the common edge, which limits the rule, not the form.
        assert!((f - 0.200_043_776_075).abs() < 1e-6, "{f}");
    }

    #[test]
    fn the_horizon_cuts_the_emitter() {
        // The wall from z = -1 to 1 sends as much to the floor as its upper half.
        let mut c = Clipper::default();
        let wall = |low: f64| {
            [
                vec3(1.0, -1.0, low),
                vec3(1.0, 1.0, low),
                vec3(1.0, 1.0, 1.0),
                vec3(1.0, -1.0, 1.0),
            ]
        };
        let whole = c.unoccluded(Vec3::ZERO, UP, &wall(-1.0));
        let half = c.unoccluded(Vec3::ZERO, UP, &wall(0.0));
        assert!((whole - half).abs() < 1e-14 && half > 0.1);
        assert_eq!(
            c.unoccluded(Vec3::ZERO, UP, &rectangle((0.0, 1.0), (0.0, 1.0), -1.0)),
            0.0
        );
    }

    #[test]
    fn half_a_shadow_is_the_other_half_of_the_light() {
        let mut c = Clipper::default();
        let lamp = rectangle((-1.0, 1.0), (-1.0, 1.0), 2.0);
        let half = occluder((-0.5, 0.0), (-3.0, 3.0), 1.0);
        let got = c.occluded(Vec3::ZERO, UP, &lamp, [&half].into_iter(), 1e-9);
        let expected = c.unoccluded(Vec3::ZERO, UP, &rectangle((0.0, 1.0), (-1.0, 1.0), 2.0));
        assert!((got - expected).abs() < 1e-14, "{got} {expected}");
        let whole = occluder((-0.6, 0.6), (-0.6, 0.6), 1.0);
        assert_eq!(
            c.occluded(Vec3::ZERO, UP, &lamp, [&whole].into_iter(), 1e-9),
            0.0
        );
        let behind = occluder((-9.0, 9.0), (-9.0, 9.0), 2.5);
        let all = c.unoccluded(Vec3::ZERO, UP, &lamp);
        assert_eq!(
            c.occluded(Vec3::ZERO, UP, &lamp, [&behind].into_iter(), 1e-9),
            all
        );
    }

    #[test]
    fn a_grid_of_many_occluders_stays_within_bounds() {
        // 400 small squares that cover a quarter of the lamp: far more parts than the cap, so
        // that the lamp is halved several times.
        let mut c = Clipper::default();
        let lamp = rectangle((-1.0, 1.0), (-1.0, 1.0), 2.0);
        let squares: Vec<Piece> = (0..400)
            .map(|i| {
                (
                    f64::from(i % 20) * 0.05 - 0.5,
                    f64::from(i / 20) * 0.05 - 0.5,
                )
            })
            .map(|(x, y)| occluder((x, x + 0.025), (y, y + 0.025), 1.0))
            .collect();
        let got = c.occluded(Vec3::ZERO, UP, &lamp, squares.iter(), 1e-9);
        assert!(c.parts.len() < 2 * MOST_PARTS);
        // What is left: all but each square's own light.
        let mut expected = c.unoccluded(Vec3::ZERO, UP, &lamp);
        for square in &squares {
            let shadow: Vec<Vec3> = square.vertices.iter().map(|v| *v * 2.0).collect();
            expected -= c.unoccluded(Vec3::ZERO, UP, &shadow);
        }
        assert!((got / expected - 1.0).abs() < 1e-9, "{got} {expected}");
    }

    proptest! {
        /// A tilted triangle's shadow against counting 400 x 400 points of the lamp.
        #[test]
        fn agrees_with_counting(
            corners in prop::collection::vec((-1.5..1.5, -1.5..1.5, 0.2..2.5), 3),
        ) {
            let vertices: Vec<Vec3> = corners.iter().map(|&(x, y, z)| vec3(x, y, z)).collect();
            let normal = crate::geometry::newell(&vertices).normalized();
            prop_assume!(normal.dot(vertices[0]).abs() > 0.05);
            let piece = Piece { vertices, normal, facet: 0 };
            let lamp = rectangle((-1.0, 1.0), (-1.0, 1.0), 2.0);
            let mut c = Clipper::default();
            let exact = c.occluded(Vec3::ZERO, UP, &lamp, [&piece].into_iter(), 1e-9);
            let n = 200;
            let mut counted = 0.0;
            for i in 0..n * n {
                let at = |k: i32| (f64::from(k) + 0.5) * 2.0 / f64::from(n) - 1.0;
                let p = vec3(at(i % n), at(i / n), 2.0);
                if !crate::transport::visibility::blocks(&piece, Vec3::ZERO, p, 1e-9) {
                    counted += 4.0 / p.dot(p).powi(2) * 4.0 / f64::from(n * n);
                }
            }
            prop_assert!((exact - counted).abs() < 4e-3, "{} {}", exact, counted);
        }
    }
}
