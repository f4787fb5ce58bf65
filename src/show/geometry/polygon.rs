//! Turns a face of a file into planar polygons with an area, as every format needs.

use crate::geometry::{Vec3, diameter, frame, newell};

/// Largest distance of a vertex from the polygon's plane, relative to the polygon's diameter.
const PLANAR: f64 = 1e-4;
/// Least value of twice the area over the squared diameter; a smaller polygon has no area. Rounding
/// leaves about 1e-16 of the coordinates, so this also holds far from the origin.
const AREA: f64 = 1e-9;

/// Most corners of a face that is cut into triangles: the work grows with their cube.
pub const BENT_LIMIT: usize = 64;

/// Reasons why a face cannot become polygons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShapeError {
    /// Its edges cross.
    #[error("the face crosses itself")]
    Crossing,
    /// It is bent, and has too many corners to be cut.
    #[error("more than {BENT_LIMIT} corners of a bent face")]
    Bent,
}

/// Turns `corners` into polygons: none when they lie on one line, one when they are planar, else
/// triangles that keep the edges.
///
/// # Errors
/// [`ShapeError::Crossing`] when two edges cross, seen along the normal, or when lobes of opposite
/// sense cancel (a symmetric bow tie, which would otherwise vanish unnoticed); [`ShapeError::Bent`]
/// for a bent face of many corners.
pub fn planar(mut corners: Vec<Vec3>) -> Result<Vec<Vec<Vec3>>, ShapeError> {
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    let Some(normal) = normal(&corners) else {
        return if on_a_line(&corners) {
            Ok(Vec::new())
        } else {
            Err(ShapeError::Crossing)
        };
    };
    let flat = Flat::new(&corners, normal);
    if flat.crosses() {
        return Err(ShapeError::Crossing);
    }
    if deviation(&corners, normal) <= PLANAR * diameter(&corners) {
        return Ok(vec![corners]);
    }
    if corners.len() > BENT_LIMIT {
        return Err(ShapeError::Bent);
    }
    triangles(&corners).ok_or(ShapeError::Crossing)
}

/// Triangulates a simple polygon of at most [`BENT_LIMIT`] corners; `None` when that fails.
pub fn triangles(corners: &[Vec3]) -> Option<Vec<Vec<Vec3>>> {
    let mut triangles = Flat::new(corners, normal(corners)?).triangles()?;
    triangles.retain(|triangle| normal(triangle).is_some());
    Some(triangles)
}

/// True when the corners enclose an area beyond rounding.
pub fn has_area(corners: &[Vec3]) -> bool {
    normal(corners).is_some()
}

/// Twice the vector area, computed relative to a corner because products of large coordinates would
/// cancel.
pub fn doubled_area(corners: &[Vec3]) -> Vec3 {
    let origin = corners.first().copied().unwrap_or_default();
    let near: Vec<Vec3> = corners.iter().map(|v| *v - origin).collect();
    newell(&near)
}

/// The unit normal; `None` without an area.
fn normal(corners: &[Vec3]) -> Option<Vec3> {
    let twice_area = doubled_area(corners);
    let least = AREA * diameter(corners).powi(2);
    (twice_area.length() > least).then(|| twice_area.normalized())
}

/// True when all corners lie on the line through the first one and the one farthest from it.
fn on_a_line(corners: &[Vec3]) -> bool {
    let origin = corners.first().copied().unwrap_or_default();
    let near = corners.iter().map(|v| *v - origin);
    let farther = |a: Vec3, b: Vec3| if b.length() > a.length() { b } else { a };
    let along = near.clone().fold(Vec3::ZERO, farther);
    let least = AREA * diameter(corners).powi(2);
    near.map(|v| v.cross(along).length()).all(|a| a <= least)
}

/// Largest distance of a corner from the plane through their mean.
fn deviation(corners: &[Vec3], normal: Vec3) -> f64 {
    let sum = corners.iter().fold(Vec3::ZERO, |sum, v| sum + *v);
    let mean = sum / corners.len().max(1) as f64;
    let off = corners.iter().map(|v| (*v - mean).dot(normal).abs());
    off.fold(0.0, f64::max)
}

/// Twice the area over the squared longest side.
fn shape(triangle: &[Corner; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner.vertex);
    let sides = [b - a, c - b, a - c].map(|side| side.dot(side));
    let longest = sides.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    (b - a).cross(c - a).length() / longest
}

/// A corner and its coordinates in the plane.
#[derive(Clone, Copy)]
struct Corner {
    vertex: Vec3,
    at: [f64; 2],
}

/// A polygon projected along its normal, counter-clockwise.
struct Flat {
    corners: Vec<Corner>,
    /// Twice the area below which an area is rounding noise.
    noise: f64,
}

impl Flat {
    fn new(corners: &[Vec3], normal: Vec3) -> Flat {
        let [u, v] = frame(normal);
        let origin = corners.first().copied().unwrap_or_default();
        let flat = corners.iter().map(|&vertex| Corner {
            vertex,
            at: [(vertex - origin).dot(u), (vertex - origin).dot(v)],
        });
        Flat {
            corners: flat.collect(),
            noise: 1e-12 * diameter(corners).powi(2),
        }
    }

    /// Twice the signed area of a triangle, or zero when it is rounding noise.
    fn turn(&self, a: Corner, b: Corner, c: Corner) -> f64 {
        let ([ax, ay], [bx, by], [cx, cy]) = (a.at, b.at, c.at);
        let twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
        if twice.abs() <= self.noise {
            0.0
        } else {
            twice
        }
    }

    /// True when two edges cross in their interiors. Edges that touch, as the bridges to holes do,
    /// are fine.
    fn crosses(&self) -> bool {
        let next = self.corners.iter().cycle().skip(1);
        let edges: Vec<(Corner, Corner)> =
            self.corners.iter().copied().zip(next.copied()).collect();
        edges.iter().enumerate().any(|(i, &(a, b))| {
            edges.iter().skip(i + 2).any(|&(c, d)| {
                self.turn(a, b, c) * self.turn(a, b, d) < 0.0
                    && self.turn(c, d, a) * self.turn(c, d, b) < 0.0
            })
        })
    }

    /// Cuts off ears one by one (Meisters 1975), the best-shaped first, because slivers make poor
    /// elements; `None` when no ear is left.
    fn triangles(mut self) -> Option<Vec<Vec<Vec3>>> {
        let mut triangles = Vec::new();
        while self.corners.len() >= 3 {
            let count = self.corners.len();
            let triple = |i: usize| {
                let corner = |k: usize| self.corners.get((i + k) % count).copied();
                Some([corner(count - 1)?, corner(0)?, corner(1)?])
            };
            let best = |slack| {
                let ears = (0..count).filter_map(|i| Some((i, triple(i)?)));
                ears.filter(|(_, ear)| self.is_ear(*ear, slack))
                    .max_by(|(_, a), (_, b)| shape(a).total_cmp(&shape(b)))
            };
            // A corner close to the cut would leave a sliver. Cut such an ear only when there is no
            // other.
            let (at, ear) = best(1e9 * self.noise).or_else(|| best(0.0))?;
            triangles.push(ear.map(|c| c.vertex).to_vec());
            self.corners.remove(at);
        }
        Some(triangles)
    }

    /// True for a convex (or straight) corner whose triangle holds no other corner by more than
    /// `slack` (twice an area). Straight ears are dropped later because they have no area.
    fn is_ear(&self, [a, b, c]: [Corner; 3], slack: f64) -> bool {
        let inside = |p: &Corner| {
            self.turn(a, b, *p) > 0.0 && self.turn(b, c, *p) > 0.0 && self.turn(c, a, *p) >= -slack
        };
        self.turn(a, b, c) >= 0.0 && !self.corners.iter().any(inside)
    }
}
