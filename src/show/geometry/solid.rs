//! Solids that a show declares: quads, boxes, discs, cylinders and spheres as polygons.
//!
//! Round solids are regular polygons of the circle's area. Invariants: polygons are planar, simple,
//! counter-clockwise seen from their visible side.

use crate::geometry::{Vec3, vec3};

use super::polygon::{self, ShapeError};
use super::shape::{ball, ring};

/// A solid on the stage.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// Four corners, counter-clockwise seen from its front.
    Quad {
        /// Metres.
        corners: [Vec3; 4],
        /// True for a quad with a back.
        two_sided: bool,
    },
    /// A box with edges along the axes.
    Cuboid {
        /// Least coordinates, metres.
        low: Vec3,
        /// Greatest coordinates, each beyond the least.
        high: Vec3,
        /// True when seen from inside: a room.
        inside: bool,
    },
    /// A flat round plate.
    Disc {
        /// Its centre, metres.
        centre: Vec3,
        /// A point that its front faces.
        aim: Vec3,
        /// Metres.
        radius: f64,
        /// Corners of the polygon.
        sides: usize,
        /// True for a disc with a back.
        two_sided: bool,
    },
    /// A round column, closed at both ends.
    Cylinder {
        /// The centre of one end, metres.
        from: Vec3,
        /// The centre of the other.
        to: Vec3,
        /// Metres.
        radius: f64,
        /// Faces around.
        sides: usize,
    },
    /// A ball.
    Sphere {
        /// Metres.
        centre: Vec3,
        /// Metres.
        radius: f64,
        /// Approximate number of faces around the equator.
        sides: usize,
    },
}

impl Solid {
    /// True when `point` is inside a closed box.
    pub fn closes_in(&self, point: Vec3) -> bool {
        match self {
            Solid::Cuboid {
                low,
                high,
                inside: false,
            } => (0..3).all(|axis| low[axis] < point[axis] && point[axis] < high[axis]),
            _ => false,
        }
    }

    /// The polygons of the solid, without backs.
    ///
    /// # Errors
    /// [`ShapeError`] when a quad's edges cross.
    pub fn polygons(&self) -> Result<Vec<Vec<Vec3>>, ShapeError> {
        match *self {
            Solid::Quad { corners, .. } => polygon::planar(corners.to_vec()),
            Solid::Cuboid { low, high, inside } => {
                let mut faces = cuboid(low, high);
                if inside {
                    faces.iter_mut().for_each(|face| face.reverse());
                }
                Ok(faces)
            }
            Solid::Disc {
                centre,
                aim,
                radius,
                sides,
                ..
            } => Ok(vec![ring(centre, aim - centre, radius, sides)]),
            Solid::Cylinder {
                from,
                to,
                radius,
                sides,
            } => Ok(cylinder(from, to, radius, sides)),
            Solid::Sphere {
                centre,
                radius,
                sides,
            } => Ok(ball(centre, radius, sides.div_ceil(5))),
        }
    }

    /// True when the solid gets a back, a hair behind its front.
    pub fn two_sided(&self) -> bool {
        matches!(
            self,
            Solid::Quad {
                two_sided: true,
                ..
            } | Solid::Disc {
                two_sided: true,
                ..
            }
        )
    }
}

fn cuboid(a: Vec3, b: Vec3) -> Vec<Vec<Vec3>> {
    let corner = |x: bool, y: bool, z: bool| {
        let of = |high, l, h| if high { h } else { l };
        vec3(of(x, a.x, b.x), of(y, a.y, b.y), of(z, a.z, b.z))
    };
    let face = |corners: [(bool, bool, bool); 4]| corners.map(|(x, y, z)| corner(x, y, z)).to_vec();
    let (l, h) = (false, true);
    vec![
        face([(l, l, l), (l, h, l), (h, h, l), (h, l, l)]),
        face([(l, l, h), (h, l, h), (h, h, h), (l, h, h)]),
        face([(l, l, l), (h, l, l), (h, l, h), (l, l, h)]),
        face([(l, h, l), (l, h, h), (h, h, h), (h, h, l)]),
        face([(l, l, l), (l, l, h), (l, h, h), (l, h, l)]),
        face([(h, l, l), (h, h, l), (h, h, h), (h, l, h)]),
    ]
}

fn cylinder(from: Vec3, to: Vec3, radius: f64, sides: usize) -> Vec<Vec<Vec3>> {
    let axis = to - from;
    let top = ring(to, axis, radius, sides);
    let bottom: Vec<Vec3> = top.iter().map(|v| *v - axis).collect();
    let next = |ring: &[Vec3]| {
        let rest = ring.iter().skip(1).chain(ring.first()).copied();
        rest.collect::<Vec<_>>()
    };
    let (top_next, bottom_next) = (next(&top), next(&bottom));
    let pairs = bottom
        .iter()
        .zip(&bottom_next)
        .zip(top.iter().zip(&top_next));
    let mut faces: Vec<Vec<Vec3>> = pairs.map(|((a, b), (d, c))| vec![*a, *b, *c, *d]).collect();
    faces.push(bottom.into_iter().rev().collect());
    faces.push(top);
    faces
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use std::f64::consts::PI;

    use super::*;
    use crate::geometry::newell;

    /// Six times the volume of closed faces, positive when they are seen from outside.
    fn volume(faces: &[Vec<Vec3>]) -> f64 {
        faces.iter().map(|f| newell(f).dot(f[0]) / 6.0).sum::<f64>()
    }

    fn area(faces: &[Vec<Vec3>]) -> f64 {
        faces.iter().map(|f| 0.5 * newell(f).length()).sum()
    }

    #[test]
    fn boxes_hold_their_volume_and_rooms_are_boxes_turned_inside_out() {
        let cuboid = |inside| Solid::Cuboid {
            low: vec3(-1.0, 2.0, 0.0),
            high: vec3(1.0, 5.0, 4.0),
            inside,
        };
        let faces = cuboid(false).polygons().unwrap();
        assert!((volume(&faces) - 24.0).abs() < 1e-12);
        assert!((area(&faces) - 52.0).abs() < 1e-12);
        assert!((volume(&cuboid(true).polygons().unwrap()) + 24.0).abs() < 1e-12);
    }

    #[test]
    fn round_solids_have_the_area_of_the_circle() {
        let (from, to) = (vec3(1.0, 0.0, 0.5), vec3(1.0, 2.0, 2.0));
        let (radius, sides) = (0.3, 9);
        let column = Solid::Cylinder {
            from,
            to,
            radius,
            sides,
        };
        let faces = column.polygons().unwrap();
        assert_eq!(faces.len(), 11);
        assert!((volume(&faces) - PI * 0.09 * 2.5).abs() < 1e-12);
        let disc = Solid::Disc {
            centre: from,
            aim: to,
            radius,
            sides,
            two_sided: true,
        };
        let faces = disc.polygons().unwrap();
        assert!((area(&faces) - PI * 0.09).abs() < 1e-12);
        assert!(newell(&faces[0]).dot(to - from) > 0.0 && disc.two_sided());
    }

    #[test]
    fn a_bent_quad_becomes_triangles_and_a_crossed_one_nothing() {
        let quad = |z: f64, y: f64| {
            let corners = [
                (0.0, 0.0, 0.0),
                (1.0, 0.0, 0.0),
                (1.0, y, z),
                (0.0, 1.0, 0.0),
            ];
            Solid::Quad {
                corners: corners.map(|(x, y, z)| vec3(x, y, z)),
                two_sided: false,
            }
        };
        assert_eq!(quad(0.0, 1.0).polygons().unwrap().len(), 1);
        assert_eq!(quad(0.5, 1.0).polygons().unwrap().len(), 2);
        let bow = Solid::Quad {
            corners: [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| vec3(x, y, 0.0)),
            two_sided: false,
        };
        assert!(bow.polygons().is_err());
    }
}
