//! Values that vary over a polygon: shading normal and texture coordinates.
//!
//! Both are linear functions on the polygon's plane; on a triangle that is always possible, larger
//! faces are made so. Polygons of any number of corners, merged ones too, then use one formula.
//! Invariants: every number is finite. This module does not depend on materials.

#![allow(
    clippy::indexing_slicing,
    reason = "arrays of two, three or four numbers, by constants"
)]

use footlight_show::geometry::solid::Solid;
use footlight_show::geometry::{Vec3, newell, vec3};

/// Cosine above which two normals count as equal: 1 degree.
const SAME: f64 = 0.999_85;
/// Least cosine between a shading normal and the polygon's own.
const LEAN: f64 = 0.1;
/// Tolerance of texture coordinates, relative to the image.
const OFF_PLACE: f64 = 5e-4;
/// Tolerance of normals.
const OFF_NORMAL: f64 = 0.02;

/// Shading normal and texture coordinates over a polygon.
#[derive(Clone, Debug, PartialEq)]
pub struct Shading {
    /// Reference point of the linear functions.
    pub origin: Vec3,
    /// The normal at the origin, and its derivatives along X, Y and Z.
    pub normal: Option<[Vec3; 4]>,
    /// Each texture coordinate (0 to 1 from the left, 0 to 1 from the top): value at the origin and
    /// gradient.
    pub place: Option<[(f64, Vec3); 2]>,
    /// Number of a sheet, shared by front and back: transparency lets light through both or
    /// neither.
    pub sheet: u32,
}

/// A corner with its attributes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corner {
    /// Position, metres.
    pub point: Vec3,
    /// Normal of any length, as in the file.
    pub normal: Option<Vec3>,
    /// Texture coordinate.
    pub place: Option<[f64; 2]>,
}

impl Shading {
    /// Shading of a round solid's face in this plane (a point and the unit normal); `None` for a
    /// flat solid.
    pub fn of_solid(solid: &Solid, (point, normal): (Vec3, Vec3)) -> Option<Shading> {
        match *solid {
            Solid::Cylinder { from, to, .. } => {
                let axis = (to - from).normalized();
                let is_end = normal.dot(axis).abs() > 0.5;
                (!is_end).then(|| Shading::round_axis(from, axis))
            }
            Solid::Sphere { centre, .. } if (point - centre).length() > 0.0 => {
                Some(Shading::round_centre(centre))
            }
            _ => None,
        }
    }

    /// Shading from a planar polygon's corners; `None` for flat shading without a texture.
    ///
    /// # Errors
    /// [`Bent`] when the values at more than three corners are not linear.
    pub fn of_corners(corners: &[Corner]) -> Result<Option<Shading>, Bent> {
        let points: Vec<Vec3> = corners.iter().map(|c| c.point).collect();
        let (Some(plane), Some(first)) = (Plane::new(&points), corners.first()) else {
            return Ok(None);
        };
        let normal = match normals(corners, plane.normal) {
            Some(normals) => {
                let parts = [0, 1, 2].map(|axis| {
                    plane.fit(&points, |i| normals.get(i).map(|n| n[axis]), OFF_NORMAL)
                });
                let [x, y, z] = parts;
                let ((a, dx), (b, dy), (c, dz)) = (x?, y?, z?);
                let column = |axis: usize| vec3(dx[axis], dy[axis], dz[axis]);
                Some([vec3(a, b, c), column(0), column(1), column(2)])
            }
            None => None,
        };
        let is_placed = corners
            .iter()
            .all(|c| c.place.is_some_and(|p| p.iter().all(|v| v.abs() < 1e6)));
        let place = if is_placed {
            let of = |axis: usize| {
                let value = |i: usize| corners.get(i).and_then(|c| c.place).map(|p| p[axis]);
                plane.fit(&points, value, OFF_PLACE)
            };
            Some([of(0)?, of(1)?])
        } else {
            None
        };
        let shading = Shading {
            normal,
            place,
            ..Shading::flat(first.point)
        };
        Ok((normal.is_some() || place.is_some()).then_some(shading))
    }

    /// Shading that does not vary.
    pub fn flat(origin: Vec3) -> Shading {
        Shading {
            origin,
            normal: None,
            place: None,
            sheet: 0,
        }
    }

    /// Normals around an axis, for a cylinder's faces.
    fn round_axis(origin: Vec3, axis: Vec3) -> Shading {
        let axis = axis.normalized();
        let across = |way: Vec3| way - axis * way.dot(axis);
        Shading::of_gradient(origin, across)
    }

    /// Normals around a centre, for a sphere's faces.
    fn round_centre(origin: Vec3) -> Shading {
        Shading::of_gradient(origin, |way| way)
    }

    fn of_gradient(origin: Vec3, of: impl Fn(Vec3) -> Vec3) -> Shading {
        let way = |axis: usize| {
            let unit = |i: usize| if i == axis { 1.0 } else { 0.0 };
            of(vec3(unit(0), unit(1), unit(2)))
        };
        Shading {
            normal: Some([Vec3::ZERO, way(0), way(1), way(2)]),
            ..Shading::flat(origin)
        }
    }

    /// The unit shading normal at a point of a polygon with the normal `flat`, limited so that the
    /// polygon is never seen from behind.
    pub fn normal(&self, point: Vec3, flat: Vec3) -> Vec3 {
        let Some([value, x, y, z]) = self.normal else {
            return flat;
        };
        let d = point - self.origin;
        let smooth = (value + x * d.x + y * d.y + z * d.z).normalized();
        let lean = smooth.dot(flat);
        // NaN when it has no direction.
        if lean >= LEAN {
            smooth
        } else if smooth.is_finite() && smooth != Vec3::ZERO {
            (smooth + flat * (LEAN - lean)).normalized()
        } else {
            flat
        }
    }

    /// The texture coordinate at a point; the middle if there is none.
    pub fn place(&self, point: Vec3) -> [f64; 2] {
        let at = |(value, gradient): (f64, Vec3)| value + gradient.dot(point - self.origin);
        self.place.map_or([0.5; 2], |place| place.map(at))
    }

    /// Maps vectors along the polygon to the texture.
    pub fn sides(&self, vectors: [Vec3; 2]) -> [[f64; 2]; 2] {
        let of = |vector: Vec3| match self.place {
            Some(place) => place.map(|(_, gradient)| gradient.dot(vector)),
            None => [0.0; 2],
        };
        vectors.map(of)
    }

    /// Rotates it with its polygon by `by`.
    pub fn turn(&mut self, by: impl Fn(Vec3) -> Vec3) {
        self.origin = by(self.origin);
        if let Some([value, x, y, z]) = self.normal {
            // The rows of the matrix rotate with positions, its values with normals.
            let row = |axis: usize| by(vec3(x[axis], y[axis], z[axis]));
            let rows = [row(0), row(1), row(2)];
            let column = |axis: usize| by(vec3(rows[0][axis], rows[1][axis], rows[2][axis]));
            self.normal = Some([by(value), column(0), column(1), column(2)]);
        }
        if let Some(place) = &mut self.place {
            place
                .iter_mut()
                .for_each(|(_, gradient)| *gradient = by(*gradient));
        }
    }

    /// Scales and then moves it with its polygon.
    pub fn stretch(&mut self, scale: f64, at: Vec3) {
        self.origin = self.origin * scale + at;
        if let Some([_, gradients @ ..]) = &mut self.normal {
            gradients.iter_mut().for_each(|g| *g = *g / scale);
        }
        if let Some(place) = &mut self.place {
            place
                .iter_mut()
                .for_each(|(_, gradient)| *gradient = *gradient / scale);
        }
    }

    /// Shading of the polygon's back.
    #[must_use]
    pub fn of_back(&self) -> Shading {
        Shading {
            normal: self.normal.map(|n| n.map(|v| -v)),
            ..self.clone()
        }
    }

    /// True when two neighbours continue each other, tested at the corners of both.
    pub fn continues(&self, other: &Shading, at: &[Vec3]) -> bool {
        let same_kind = self.normal.is_some() == other.normal.is_some()
            && self.place.is_some() == other.place.is_some();
        let near = |point: &Vec3| {
            let (p, q) = (self.place(*point), other.place(*point));
            let normal = |s: &Shading| s.normal(*point, Vec3::ZERO);
            (p[0] - q[0]).abs().max((p[1] - q[1]).abs()) <= OFF_PLACE
                && (normal(self) - normal(other)).length() <= OFF_NORMAL
        };
        same_kind && at.iter().all(near)
    }
}

/// The corners' values are not linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bent;

/// Unit normals of corners; `None` when they equal the polygon's own, or are unusable.
fn normals(corners: &[Corner], flat: Vec3) -> Option<Vec<Vec3>> {
    let unit = |c: &Corner| {
        let normal = c.normal?.normalized();
        (normal.is_finite() && normal.dot(flat) > LEAN).then_some(normal)
    };
    let all: Vec<Vec3> = corners.iter().map(unit).collect::<Option<_>>()?;
    all.iter().any(|n| n.dot(flat) < SAME).then_some(all)
}

/// Three corners that span the polygon's plane.
struct Plane {
    normal: Vec3,
    corners: [usize; 3],
    /// Gradients of the barycentric coordinates of the second and the third corner.
    dual: [Vec3; 2],
}

impl Plane {
    fn new(points: &[Vec3]) -> Option<Plane> {
        let first = *points.first()?;
        let near: Vec<Vec3> = points.iter().map(|p| *p - first).collect();
        let normal = newell(&near).normalized();
        // The widest of the triangles at the first corner.
        let pairs =
            (1..near.len()).flat_map(|i| (i + 1..near.len().min(i + 16)).map(move |j| (i, j)));
        let area = |(i, j): &(usize, usize)| match (near.get(*i), near.get(*j)) {
            (Some(a), Some(b)) => a.cross(*b).dot(normal),
            _ => 0.0,
        };
        let (i, j) = pairs.max_by(|a, b| area(a).abs().total_cmp(&area(b).abs()))?;
        let (a, b) = (*near.get(i)?, *near.get(j)?);
        let over = 1.0 / area(&(i, j));
        let dual = [b.cross(normal) * over, normal.cross(a) * over];
        dual.iter().all(|d| d.is_finite()).then_some(Plane {
            normal,
            corners: [0, i, j],
            dual,
        })
    }

    /// Fits a linear function to values at the corners: value at the first corner, and gradient.
    fn fit(
        &self,
        points: &[Vec3],
        value: impl Fn(usize) -> Option<f64>,
        off: f64,
    ) -> Result<(f64, Vec3), Bent> {
        let at = |i: usize| value(i).ok_or(Bent);
        let [a, b, c] = self.corners;
        let first = at(a)?;
        let gradient = self.dual[0] * (at(b)? - first) + self.dual[1] * (at(c)? - first);
        let origin = points.first().copied().ok_or(Bent)?;
        for (i, point) in points.iter().enumerate() {
            let fitted = first + gradient.dot(*point - origin);
            let miss = (at(i)? - fitted).abs();
            if miss.is_nan() || miss > off {
                return Err(Bent);
            }
        }
        Ok((first, gradient))
    }
}

#[cfg(test)]
mod tests;
