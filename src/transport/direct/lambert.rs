//! Irradiance from a convex polygon of unit radiance: Lambert's closed form with exact visibility.
//!
//! The irradiance at a point is half the sum, over the polygon's edges, of the angle that the edge
//! subtends times the component of the edge's unit moment along the receiver's normal (Lambert,
//! *Photometria*, 1760). An occluder's shadow on the polygon is the region behind it within the
//! cone from the point through its edges. On the polygon's plane each side of the cone is a
//! straight line, so the visible part is found by two-dimensional clipping, without samples. This
//! module handles one point and one polygon and does not depend on meshes.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over the polygon's own vertices"
)]

use crate::surfaces::clipper::{Line, PlanePoint, PolygonClipper, Rectangle, range};
use crate::surfaces::facet::Piece;
use crate::surfaces::hierarchy::blocks;
use footlight_show::geometry::{Vec3, frame, greater, part_above};

/// Lit parts above which the emitter is halved and each half processed separately, so that the work
/// stays nearly proportional to the number of occluders. A dozen separate occluders stay far below
/// the limit.
const MOST_PARTS: usize = 192;

/// Most halvings of an emitter; after that the remaining occluders are tested at a few points of
/// each part.
const MOST_HALVINGS: usize = 8;

/// Corners lower than this share of the emitter's height above the point are not projected onto the
/// emitter's plane, because of rounding.
const LOW: f64 = 1e-6;

/// A convex emitting polygon, with coordinates in its plane, metres.
#[derive(Clone, Debug)]
pub struct LightPolygon {
    /// At least three.
    pub corners: Vec<Vec3>,
    /// Unit normal of the emitting side.
    pub normal: Vec3,
    /// Corners in the plane's axes, relative to the first corner.
    outline: Vec<PlanePoint>,
    axes: [Vec3; 2],
}

impl LightPolygon {
    /// A polygon with this unit normal.
    pub fn new(corners: Vec<Vec3>, normal: Vec3) -> LightPolygon {
        let axes = frame(normal);
        let origin = corners[0];
        let place = |v: &Vec3| axes.map(|axis| axis.dot(*v - origin));
        LightPolygon {
            outline: corners.iter().map(place).collect(),
            corners,
            normal,
            axes,
        }
    }

    /// True when `point` is in front of the polygon.
    pub fn faces(&self, point: Vec3) -> bool {
        self.normal.dot(point - self.corners[0]) > 0.0
    }

    /// The polygon cut in two across its longest extent; halves of fewer than three corners are
    /// omitted.
    pub fn halves(&self) -> impl Iterator<Item = LightPolygon> {
        let polygon = &self.corners;
        let first = polygon[0];
        let centre = polygon.iter().fold(Vec3::ZERO, |s, v| s + *v) / polygon.len() as f64;
        let far = polygon.iter().fold(first, |far, v| {
            if (*v - first).length() > (far - first).length() {
                *v
            } else {
                far
            }
        });
        let axis = far - first;
        let halves = [axis, -axis].map(|way| part_above(polygon, |v| way.dot(v - centre)));
        let halves = halves.into_iter().filter(|half| half.len() >= 3);
        halves.map(|half| LightPolygon::new(half, self.normal))
    }
}

/// A light polygon's plane seen from a point.
#[derive(Clone, Copy, Debug)]
struct LightCone<'a> {
    polygon: &'a LightPolygon,
    point: Vec3,
    /// First corner of the light polygon.
    origin: Vec3,
}

impl<'a> LightCone<'a> {
    fn new(polygon: &'a LightPolygon, point: Vec3) -> LightCone<'a> {
        LightCone {
            polygon,
            point,
            origin: polygon.corners[0] - point,
        }
    }

    /// Direction to a point of the plane, not normalised.
    fn direction(&self, [x, y]: PlanePoint) -> Vec3 {
        let [u, v] = self.polygon.axes;
        self.origin + u * x + v * y
    }

    /// Distance of the plane along the light polygon's normal; negative, as the polygon faces the
    /// point.
    fn height(&self) -> f64 {
        self.polygon.normal.dot(self.origin)
    }

    /// Line on the plane that bounds `wall . direction > offset`.
    fn line(&self, wall: Vec3, offset: f64) -> Line {
        let [u, v] = self.polygon.axes;
        [wall.dot(self.origin) - offset, wall.dot(u), wall.dot(v)]
    }
}

/// The shadow of an occluder on a light polygon's plane.
#[derive(Debug, Default)]
struct Shadow {
    /// Corners of the occluder, relative to the point.
    corners: Vec<Vec3>,
    /// Corners projected onto the plane; fewer when one cannot be projected.
    places: Vec<PlanePoint>,
    /// Greatest ratio of a corner's distance to that of its projection.
    farthest: f64,
}

impl Shadow {
    /// Projects the corners of a piece. Returns the bounds of the shadow, which are infinite when a
    /// corner cannot be projected.
    fn cast(&mut self, cone: LightCone<'_>, piece: &Piece) -> Rectangle {
        let corners = piece.vertices.iter().map(|v| *v - cone.point);
        self.corners.clear();
        self.corners.extend(corners);
        self.places.clear();
        self.farthest = 0.0;
        let height = cone.height();
        let mut bounds = Rectangle::EMPTY;
        for corner in &self.corners {
            let share = cone.polygon.normal.dot(*corner) / height;
            if share < LOW {
                return Rectangle::EVERYWHERE;
            }
            let on_plane = *corner * (1.0 / share) - cone.origin;
            let place = cone.polygon.axes.map(|axis| axis.dot(on_plane));
            bounds = bounds.with(Rectangle::at(place));
            self.places.push(place);
            self.farthest = greater(self.farthest, share);
        }
        bounds
    }

    /// True when every corner lies in front of the plane, so that the shadow is the polygon of the
    /// projections.
    fn is_before(&self) -> bool {
        self.places.len() == self.corners.len() && self.farthest <= 1.0
    }

    /// True when `each` is true for all lines around the shadow of a piece with this normal and
    /// this height of its plane above the point; stops at the first line for which it is false.
    fn all_lines(
        &self,
        cone: LightCone<'_>,
        (normal, height): (Vec3, f64),
        mut each: impl FnMut(Line) -> bool,
    ) -> bool {
        let side = height.signum();
        let n = self.corners.len();
        let next = |i: usize| if i + 1 < n { i + 1 } else { 0 };
        if self.is_before() {
            // Corners run anticlockwise about the piece's normal, hence also about the light
            // polygon's if the point sees the same side of both.
            let turn = side * cone.height().signum();
            return (0..n).all(|i| each(through(self.places[i], self.places[next(i)], turn)));
        }
        let wall = |i: usize| self.corners[i].cross(self.corners[next(i)]) * side;
        // The shadow begins behind the piece.
        each(cone.line(normal * side, height * side))
            && (0..n).all(|i| each(cone.line(wall(i), 0.0)))
    }
}

/// The line from `p` to `q`, positive on its left if `turn` is 1 and on its right if it is -1.
fn through(p: PlanePoint, q: PlanePoint, turn: f64) -> Line {
    let (x, y) = ((q[0] - p[0]) * turn, (q[1] - p[1]) * turn);
    [y * p[0] - x * p[1], -y, x]
}

/// Working memory of one thread: the lit parts of the emitter.
#[derive(Debug, Default)]
pub struct LambertIntegrator {
    clipper: PolygonClipper,
    /// Shadow of the current occluder.
    shadow: Shadow,
    /// The lines around its shadow.
    lines: Vec<Line>,
    /// Corners of one lit part, relative to the point.
    part: Vec<Vec3>,
}

/// Irradiance per unit radiance on a surface of unit `normal`, from a polygon whose corners lie in
/// directions `corners` (any length), all above the horizon.
pub fn closed_form(corners: &[Vec3], normal: Vec3) -> f64 {
    let mut sum = 0.0;
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[if i + 1 < corners.len() { i + 1 } else { 0 }];
        let moment = a.cross(b);
        let square = moment.dot(moment);
        if square > 0.0 {
            sum += moment.dot(normal) * angle_over_sine(square, a.dot(b));
        }
    }
    sum.abs() * 0.5
}

/// Squared tangent up to which an angle is computed without a square root.
const SMALL: f64 = 0.1;

/// Angle divided by its sine, from the squared sine and the cosine, both scaled by the same length.
/// With t the tangent this is atan(t) / t over the cosine, by the eighth convergent of its
/// continued fraction (Abramowitz and Stegun, *Handbook of Mathematical Functions*, 1964, 4.4.43),
/// whose error up to [`SMALL`] is 1e-14. Most edges of the visible part of a panel subtend a few
/// degrees.
fn angle_over_sine(square: f64, cosine: f64) -> f64 {
    if cosine <= 0.0 || square > SMALL * cosine * cosine {
        let sine = square.sqrt();
        return sine.atan2(cosine) / sine;
    }
    let x = square / (cosine * cosine);
    let above = [3_828_825.0, 6_831_825.0, 3_738_735.0, 638_055.0, 16_384.0];
    let below = [3_828_825.0, 8_108_100.0, 5_675_670.0, 1_455_300.0, 99_225.0];
    let at = |of: [f64; 5]| of.iter().rev().fold(0.0, |sum, c| sum * x + c);
    at(above) / (at(below) * cosine)
}

impl LambertIntegrator {
    /// Starts with the part of a light polygon above the horizon of a point.
    fn start(&mut self, cone: LightCone<'_>, normal: Vec3) {
        self.clipper.clear();
        self.clipper.add(&cone.polygon.outline);
        let horizon = cone.line(normal, 0.0);
        self.clipper.keep(std::iter::once(&horizon));
    }

    /// Irradiance at `point` from the unoccluded `polygon`; the point must lie in front of it.
    pub fn unoccluded(&mut self, point: Vec3, normal: Vec3, polygon: &LightPolygon) -> f64 {
        let cone = LightCone::new(polygon, point);
        self.start(cone, normal);
        self.light(cone, normal)
    }

    /// Irradiance at `point` from a light polygon behind the `occluders`; an occluder whose plane
    /// contains the point (within `touching`) is ignored.
    pub fn occluded<'a>(
        &mut self,
        point: Vec3,
        normal: Vec3,
        polygon: &LightPolygon,
        occluders: impl Iterator<Item = &'a Piece> + Clone,
        touching: f64,
    ) -> f64 {
        let cone = LightCone::new(polygon, point);
        self.past(cone, normal, occluders, touching, MOST_HALVINGS)
    }

    fn past<'a>(
        &mut self,
        cone: LightCone<'_>,
        normal: Vec3,
        occluders: impl Iterator<Item = &'a Piece> + Clone,
        touching: f64,
        halvings: usize,
    ) -> f64 {
        self.start(cone, normal);
        let whole = self.clipper.bounds();
        let mut rest = occluders.clone();
        while self.clipper.count() > 0 {
            let Some(piece) = rest.next() else {
                return self.light(cone, normal);
            };
            self.subtract(cone, &whole, piece, touching);
            if self.clipper.count() < MOST_PARTS {
                continue;
            }
            if halvings == 0 {
                let rest: Vec<&Piece> = rest.collect();
                return self.sampled(cone, normal, &rest, touching);
            }
            let halves = cone.polygon.halves().map(|half| {
                let cone = LightCone::new(&half, cone.point);
                self.past(cone, normal, occluders.clone(), touching, halvings - 1)
            });
            return halves.sum();
        }
        0.0
    }

    /// Irradiance from the remaining parts.
    fn light(&mut self, cone: LightCone<'_>, normal: Vec3) -> f64 {
        let mut sum = 0.0;
        for part in self.clipper.parts() {
            self.part.clear();
            self.part.extend(part.iter().map(|p| cone.direction(*p)));
            sum += closed_form(&self.part, normal);
        }
        sum
    }

    /// Irradiance from the remaining parts, with the `rest` of the occluders tested at a few points
    /// of each.
    fn sampled(
        &mut self,
        cone: LightCone<'_>,
        normal: Vec3,
        rest: &[&Piece],
        touching: f64,
    ) -> f64 {
        let point = cone.point;
        let open = |d: Vec3| !rest.iter().any(|p| blocks(p, point, point + d, touching));
        let mut sum = 0.0;
        for part in self.clipper.parts() {
            self.part.clear();
            self.part.extend(part.iter().map(|p| cone.direction(*p)));
            for pair in self.part.windows(2).skip(1) {
                let triangle = [self.part[0], pair[0], pair[1]];
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

    /// Cuts away the shadow of `piece`; `whole` bounds the remaining parts.
    fn subtract(&mut self, cone: LightCone<'_>, whole: &Rectangle, piece: &Piece, touching: f64) {
        let height = piece.normal.dot(piece.vertices[0] - cone.point);
        if height.abs() <= touching {
            return;
        }
        let bounds = self.shadow.cast(cone, piece);
        if !bounds.overlaps(whole) {
            return;
        }
        let lines = &mut self.lines;
        lines.clear();
        let plane = (piece.normal, height);
        let is_met = self.shadow.all_lines(cone, plane, |line| {
            let (least, greatest) = range(&line, whole);
            // A line that contains the whole emitter cuts nothing.
            if least < 0.0 {
                lines.push(line);
            }
            greatest > 0.0
        });
        if is_met {
            self.clipper.subtract(self.lines.iter(), &bounds);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::{newell, vec3};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    fn polygon(corners: &[Vec3]) -> LightPolygon {
        LightPolygon::new(corners.to_vec(), newell(corners).normalized())
    }

    fn corners(x: (f64, f64), y: (f64, f64), z: f64) -> Vec<Vec3> {
        vec![
            vec3(x.0, y.0, z),
            vec3(x.0, y.1, z),
            vec3(x.1, y.1, z),
            vec3(x.1, y.0, z),
        ]
    }

    fn rectangle(x: (f64, f64), y: (f64, f64), z: f64) -> LightPolygon {
        polygon(&corners(x, y, z))
    }

    fn occluder(x: (f64, f64), y: (f64, f64), z: f64) -> Piece {
        Piece {
            vertices: corners(x, y, z).into(),
            normal: -UP,
            facet: 0,
        }
    }

    /// Form factor between two finite surfaces: Gauss-Legendre mean over the receiver.
    fn mean_factor(
        receiver: impl Fn(f64, f64) -> Vec3,
        normal: Vec3,
        emitter: &LightPolygon,
    ) -> f64 {
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
        let mut integrator = LambertIntegrator::default();
        let mut sum = 0.0;
        for (u, a) in &rule {
            for (v, b) in &rule {
                sum += a * b * integrator.unoccluded(receiver(*u, *v), normal, emitter);
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
        let wall = polygon(&[
            vec3(0.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(0.0, 1.0, 1.0),
            vec3(0.0, 0.0, 1.0),
        ]);
        let f = mean_factor(|u, v| vec3(u, v, 0.0), UP, &wall);
        // The integrand has a kink at the common edge, which limits the quadrature rule, not the
        // form.
        assert!((f - 0.200_043_776_075).abs() < 1e-6, "{f}");
    }

    #[test]
    fn the_horizon_cuts_the_emitter() {
        // A wall from z = -1 to 1 gives the floor as much light as its upper half.
        let mut c = LambertIntegrator::default();
        let wall = |low: f64| {
            polygon(&[
                vec3(1.0, -1.0, low),
                vec3(1.0, 1.0, low),
                vec3(1.0, 1.0, 1.0),
                vec3(1.0, -1.0, 1.0),
            ])
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
        let mut c = LambertIntegrator::default();
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
        // 400 small squares that cover a quarter of the lamp: far more parts than the limit, so the
        // lamp is halved several times.
        let mut c = LambertIntegrator::default();
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
        assert!(c.clipper.count() < 2 * MOST_PARTS);
        // The lamp's light less that of each square.
        let mut expected = c.unoccluded(Vec3::ZERO, UP, &lamp);
        for square in &squares {
            let shadow: Vec<Vec3> = square.vertices.iter().map(|v| *v * 2.0).collect();
            expected -= c.unoccluded(Vec3::ZERO, UP, &polygon(&shadow));
        }
        assert!((got / expected - 1.0).abs() < 1e-9, "{got} {expected}");
    }

    #[test]
    fn small_angles_need_no_root() {
        for i in 1..=1000 {
            let angle = f64::from(i) * 1e-3;
            let (sine, cosine) = angle.sin_cos();
            let found = angle_over_sine(9.0 * sine * sine, 3.0 * cosine) * 3.0 * sine / angle;
            assert!((found - 1.0).abs() < 1e-14, "{angle}: {}", found - 1.0);
        }
    }

    proptest! {
        /// Compares a tilted triangle's shadow with counting 200 x 200 points of the lamp.
        #[test]
        fn agrees_with_counting(
            corners in prop::collection::vec((-1.5..1.5, -1.5..1.5, 0.2..2.5), 3),
        ) {
            let vertices: Vec<Vec3> = corners.iter().map(|&(x, y, z)| vec3(x, y, z)).collect();
            let normal = newell(&vertices).normalized();
            prop_assume!(normal.dot(vertices[0]).abs() > 0.05);
            let piece = Piece { vertices: vertices.into(), normal, facet: 0 };
            let lamp = rectangle((-1.0, 1.0), (-1.0, 1.0), 2.0);
            let mut c = LambertIntegrator::default();
            let exact = c.occluded(Vec3::ZERO, UP, &lamp, [&piece].into_iter(), 1e-9);
            let n = 200;
            let mut counted = 0.0;
            for i in 0..n * n {
                let at = |k: i32| (f64::from(k) + 0.5) * 2.0 / f64::from(n) - 1.0;
                let p = vec3(at(i % n), at(i / n), 2.0);
                if !crate::surfaces::hierarchy::blocks(&piece, Vec3::ZERO, p, 1e-9) {
                    counted += 4.0 / p.dot(p).powi(2) * 4.0 / f64::from(n * n);
                }
            }
            prop_assert!((exact - counted).abs() < 4e-3, "{} {}", exact, counted);
        }
    }
}
