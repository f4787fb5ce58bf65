//! Points, directions and polygons in metres; f64 throughout.
//!
//! World coordinates are right-handed with Z up, X to stage left (the right-hand side seen from
//! the house) and Y upstage. This module does not depend on materials, lights or pixels.

pub mod figure;
pub mod mount;
pub mod polygon;
pub mod profile;
pub mod shape;
pub mod solid;
mod view;

use std::borrow::Borrow;
use std::ops::{Add, AddAssign, Div, Index, Mul, Neg, Sub};

pub use self::view::{Place, View, upright};

/// The smaller of two numbers, or the second when one is NaN. It is a single instruction; `min` has
/// to look for NaN.
#[inline]
pub fn smaller<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// The greater of two numbers, or the second when one is NaN.
#[inline]
pub fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// A point or a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3 {
    /// Towards stage left.
    pub x: f64,
    /// Upstage.
    pub y: f64,
    /// Up.
    pub z: f64,
}

/// Shorthand for a [`Vec3`].
#[inline]
pub const fn vec3(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3 { x, y, z }
}

impl Vec3 {
    /// The origin, or no direction.
    pub const ZERO: Vec3 = vec3(0.0, 0.0, 0.0);

    /// Scalar product.
    #[inline]
    pub fn dot(self, o: Vec3) -> f64 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    /// Vector product.
    #[inline]
    pub fn cross(self, o: Vec3) -> Vec3 {
        vec3(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }

    /// Euclidean length.
    #[inline]
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// The unit vector in this direction; zero stays zero.
    #[inline]
    pub fn normalized(self) -> Vec3 {
        let l = self.length();
        if l > 0.0 { self / l } else { self }
    }

    /// Component-wise minimum.
    #[inline]
    pub fn min(self, o: Vec3) -> Vec3 {
        vec3(
            smaller(self.x, o.x),
            smaller(self.y, o.y),
            smaller(self.z, o.z),
        )
    }

    /// Component-wise maximum.
    #[inline]
    pub fn max(self, o: Vec3) -> Vec3 {
        vec3(
            greater(self.x, o.x),
            greater(self.y, o.y),
            greater(self.z, o.z),
        )
    }

    /// True when no component is NaN or infinite.
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite()
    }

    /// From Y-up (OBJ, glTF) to Z-up: (x, y, z) becomes (x, -z, y), a proper rotation.
    pub fn y_up_to_z_up(self) -> Vec3 {
        vec3(self.x, -self.z, self.y)
    }
}

impl Add for Vec3 {
    type Output = Vec3;
    #[inline]
    fn add(self, o: Vec3) -> Vec3 {
        vec3(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl AddAssign for Vec3 {
    #[inline]
    fn add_assign(&mut self, o: Vec3) {
        *self = *self + o;
    }
}

impl Sub for Vec3 {
    type Output = Vec3;
    #[inline]
    fn sub(self, o: Vec3) -> Vec3 {
        vec3(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Vec3;
    #[inline]
    fn mul(self, s: f64) -> Vec3 {
        vec3(self.x * s, self.y * s, self.z * s)
    }
}

impl Div<f64> for Vec3 {
    type Output = Vec3;
    #[inline]
    fn div(self, s: f64) -> Vec3 {
        vec3(self.x / s, self.y / s, self.z / s)
    }
}

impl Neg for Vec3 {
    type Output = Vec3;
    #[inline]
    fn neg(self) -> Vec3 {
        vec3(-self.x, -self.y, -self.z)
    }
}

impl Index<usize> for Vec3 {
    type Output = f64;
    /// Axis 0, 1 or 2; any other index means 2.
    #[inline]
    fn index(&self, axis: usize) -> &f64 {
        match axis {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }
}

/// The least and the greatest coordinates of `points`; zero without points.
pub fn bounds(points: impl IntoIterator<Item = impl Borrow<Vec3>>) -> [Vec3; 2] {
    let mut points = points.into_iter().map(|p| *p.borrow());
    let first = points.next().unwrap_or_default();
    points.fold([first; 2], |[low, high], p| [low.min(p), high.max(p)])
}

/// The diagonal of the bounding box of `points`; zero without points.
pub fn diameter(points: impl IntoIterator<Item = impl Borrow<Vec3>>) -> f64 {
    let [low, high] = bounds(points);
    (high - low).length()
}

/// Two unit vectors that span the plane of `normal`.
pub fn frame(normal: Vec3) -> [Vec3; 2] {
    let aside = if normal.x.abs() < 0.6 {
        vec3(1.0, 0.0, 0.0)
    } else {
        vec3(0.0, 1.0, 0.0)
    };
    let u = normal.cross(aside).normalized();
    [u, normal.cross(u)]
}

/// The faces of a box between two corners, the bottom last, seen from outside or from `within`.
pub fn block([low, high]: [Vec3; 2], within: bool) -> [Vec<Vec3>; 6] {
    let corner = |i: u8| {
        let pick = |bit: u8, low: f64, high: f64| if i & bit == 0 { low } else { high };
        vec3(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        )
    };
    let faces: [[u8; 4]; 6] = [
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [1, 3, 7, 5],
        [3, 2, 6, 7],
        [2, 0, 4, 6],
        [0, 2, 3, 1],
    ];
    faces.map(|face| {
        let mut vertices = face.map(corner);
        if within {
            vertices.reverse();
        }
        vertices.to_vec()
    })
}

/// The part of a convex polygon where the linear function `height` is not negative.
pub fn part_above(polygon: &[Vec3], height: impl Fn(Vec3) -> f64) -> Vec<Vec3> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (here, there) = (height(*a), height(*b));
        if here >= 0.0 {
            out.push(*a);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            out.push(*a + (*b - *a) * (here / (here - there)));
        }
    }
    out
}

/// Twice the vector area of a polygon (Newell's method). It points to the side from which the
/// vertices run counter-clockwise.
pub fn newell(vertices: &[Vec3]) -> Vec3 {
    let next = vertices.iter().cycle().skip(1);
    vertices
        .iter()
        .zip(next)
        .fold(Vec3::ZERO, |sum, (a, b)| sum + a.cross(*b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newell_gives_area_and_front() {
        let square = [
            vec3(0.0, 0.0, 0.0),
            vec3(2.0, 0.0, 0.0),
            vec3(2.0, 2.0, 0.0),
            vec3(0.0, 2.0, 0.0),
        ];
        assert_eq!(newell(&square), vec3(0.0, 0.0, 8.0));
        assert_eq!(newell(&[]), Vec3::ZERO);
    }

    #[test]
    fn turning_up_keeps_handedness() {
        let (x, y, z) = (
            vec3(1.0, 0.0, 0.0),
            vec3(0.0, 1.0, 0.0),
            vec3(0.0, 0.0, 1.0),
        );
        assert_eq!(x.y_up_to_z_up().cross(y.y_up_to_z_up()), z.y_up_to_z_up());
        assert_eq!(y.y_up_to_z_up(), z);
    }
}
