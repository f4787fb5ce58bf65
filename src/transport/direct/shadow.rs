//! Shadows of a point source in the image: the exact lit part of a fragment's outline.
//!
//! The shadow of a convex piece is bounded by its own plane and the planes through the source and
//! its edges. Under a pinhole camera, each of these planes meets a facet in a straight line of the
//! image, so the lit part of an outline is found by two-dimensional polygon clipping, without
//! samples. This module does not depend on intensity or colour.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over polygons, lines and parts that this module has made"
)]

use crate::surfaces::camera::Camera;
use crate::surfaces::clipper::{
    self, Line, PlanePoint, PolygonClipper, Rectangle, measured, value,
};
use crate::surfaces::facet::Piece;
use crate::surfaces::lists::Lists;
use footlight_show::geometry::Vec3;

/// Lit parts of one outline above which each remaining shadow is tested at the centroid of each
/// part only; a dozen occluders of one pixel stay far below.
const MOST_PARTS: usize = 128;

/// A facet's plane and the camera that projects it.
#[derive(Clone, Copy, Debug)]
pub struct Canvas<'a> {
    /// Camera of the image, in pixels.
    pub camera: &'a Camera,
    /// Unit normal of the facet's front.
    pub normal: Vec3,
    /// Height of the facet's plane above the eye; negative when the facet shows its front.
    pub height: f64,
}

impl Canvas<'_> {
    /// The point of the facet's plane seen at a place of the image.
    pub fn point(&self, [x, y]: PlanePoint) -> Vec3 {
        let ray = self.camera.ray(x, y);
        self.camera.origin + ray * (self.height / self.normal.dot(ray))
    }

    /// Line on the canvas that bounds `wall . (p - source) > offset`. With p = eye + ray h / (n .
    /// ray) and n . ray < 0 this is linear in the ray, and the ray is linear in the image.
    fn line(&self, wall: Vec3, source: Vec3, offset: f64) -> Line {
        let c = self.camera;
        let own = wall.dot(c.origin - source) - offset;
        clipper::line(c, self.normal * -own + wall * -self.height)
    }
}

/// Shadows of pieces on a canvas, each as its boundary lines.
#[derive(Clone, Debug, Default)]
pub struct Shadows {
    lines: Lists<Line>,
}

impl Shadows {
    /// Removes all shadows.
    pub fn clear(&mut self) {
        self.lines.clear();
    }

    /// Adds the shadow of a piece from a point. Returns its index, or `None` when the piece's plane
    /// contains the source within `touching`.
    pub fn cast(
        &mut self,
        canvas: &Canvas<'_>,
        source: Vec3,
        piece: &Piece,
        touching: f64,
    ) -> Option<usize> {
        let height = piece.normal.dot(piece.vertices[0] - source);
        if height.abs() <= touching {
            return None;
        }
        let side = height.signum();
        let beyond = canvas.line(piece.normal * side, source, height * side);
        self.lines.add(beyond);
        for (i, v) in piece.vertices.iter().enumerate() {
            let w = piece.vertices[(i + 1) % piece.vertices.len()];
            let wall = (*v - source).cross(w - source) * side;
            self.lines.add(canvas.line(wall, source, 0.0));
        }
        Some(self.lines.end())
    }

    /// Relation of a shadow to a rectangle of the image.
    pub fn meets(&self, shadow: usize, rectangle: &Rectangle) -> Meeting {
        let mut all = true;
        for line in self.lines.get(shadow) {
            let (low, high) = clipper::range(line, rectangle);
            if high <= 0.0 {
                return Meeting::Misses;
            }
            all &= low >= 0.0;
        }
        if all {
            Meeting::Covers
        } else {
            Meeting::Crosses
        }
    }
}

/// Relation of a shadow to a rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meeting {
    /// The rectangle is entirely outside one of the lines.
    Misses,
    /// The rectangle is inside every line.
    Covers,
    /// Neither.
    Crosses,
}

/// Lit part of an outline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lit {
    /// The whole outline.
    Wholly,
    /// The remaining parts.
    Partly,
    /// No part.
    Not,
}

/// Cuts shadows away from an outline within `bounds`; returns the lit part.
pub fn shade(
    clipper: &mut PolygonClipper,
    bounds: &Rectangle,
    shadows: &Shadows,
    list: &[usize],
) -> Lit {
    if clipper.count() == 0 {
        return Lit::Not;
    }
    let mut touched = false;
    for (at, &shadow) in list.iter().enumerate() {
        match shadows.meets(shadow, bounds) {
            Meeting::Misses => continue,
            Meeting::Covers => return Lit::Not,
            Meeting::Crosses => {}
        }
        touched = true;
        if clipper.count() > MOST_PARTS {
            drop_dark(clipper, shadows, &list[at..]);
            break;
        }
        clipper.subtract(shadows.lines.get(shadow).iter(), &Rectangle::EVERYWHERE);
        if clipper.count() == 0 {
            return Lit::Not;
        }
    }
    if touched { Lit::Partly } else { Lit::Wholly }
}

fn drop_dark(clipper: &mut PolygonClipper, shadows: &Shadows, rest: &[usize]) {
    clipper.retain(|part| {
        let (_, centre) = measured(part);
        let inside = |&s: &usize| shadows.lines.get(s).iter().all(|l| value(l, centre) > 0.0);
        !rest.iter().any(inside)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::hierarchy::blocks;
    use crate::surfaces::rectangle;
    use footlight_show::geometry::{newell, vec3};
    use proptest::prelude::*;

    const SQUARE: [PlanePoint; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn piece(vertices: Vec<Vec3>) -> Piece {
        Piece {
            normal: newell(&vertices).normalized(),
            vertices: vertices.into(),
            facet: 0,
        }
    }

    /// Lit share of the pixel on the wall with `normal` through (0, 0, -3).
    fn lit(normal: Vec3, source: Vec3, pieces: &[Piece]) -> f64 {
        let camera = Camera::of_square(1.0);
        let canvas = Canvas {
            camera: &camera,
            normal,
            height: normal.dot(vec3(0.0, 0.0, -3.0)),
        };
        let mut shadows = Shadows::default();
        let cast = |p: &Piece| shadows.cast(&canvas, source, p, 1e-9);
        let list: Vec<usize> = pieces.iter().filter_map(cast).collect();
        let mut clipper = PolygonClipper::default();
        clipper.clear();
        clipper.add(&SQUARE);
        match shade(
            &mut clipper,
            &Rectangle([0.0, 1.0, 0.0, 1.0]),
            &shadows,
            &list,
        ) {
            Lit::Wholly => 1.0,
            Lit::Not => 0.0,
            Lit::Partly => clipper.parts().map(|p| measured(p).0).sum(),
        }
    }

    const FRONT: Vec3 = vec3(0.0, 0.0, 1.0);

    /// A slat between a lamp and a wall casts a shadow a tenth of a pixel wide: a point sample at
    /// the pixel's centre would find no shadow or only shadow.
    #[test]
    fn a_shadow_narrower_than_a_pixel_takes_its_share() {
        // The pixel shows x from -3 to 3 on the wall; the lamp is 4 in front of it, the slat 2.
        let lamp = vec3(0.0, 0.0, 1.0);
        let slat = |x: f64| piece(rectangle((x - 0.15, x + 0.15), (-9.0, 9.0), -1.0).to_vec());
        let middle = vec3(0.0, 0.0, -3.0);
        for (x, naive) in [(0.0, 0.0), (0.5, 1.0)] {
            let slat = slat(x);
            let point = f64::from(u8::from(!blocks(&slat, middle, lamp, 1e-9)));
            assert_eq!(point, naive);
            assert!((lit(FRONT, lamp, &[slat]) - 0.9).abs() < 1e-12);
        }
        // Overlapping shadows count once; a complete cover leaves nothing lit.
        assert!((lit(FRONT, lamp, &[slat(0.0), slat(0.1)]) - (0.9 - 0.1 / 3.0)).abs() < 1e-12);
        let cover = piece(vec![
            vec3(-9.0, -9.0, -1.0),
            vec3(9.0, -9.0, -1.0),
            vec3(0.0, 9.0, -1.0),
        ]);
        assert_eq!(lit(FRONT, lamp, &[cover]), 0.0);
    }

    /// More shadows than the part limit still give the right share, to the size of the parts.
    #[test]
    fn a_fence_of_many_bars_stays_within_bounds() {
        let lamp = vec3(0.0, 0.0, 1.0);
        let bars: Vec<Piece> = (0..600)
            .map(|i| {
                (
                    f64::from(i % 60) / 20.0 - 1.5,
                    f64::from(i / 60) * 0.3 - 1.5,
                )
            })
            .map(|(x, y)| piece(rectangle((x, x + 0.025), (y, y + 0.3), -1.0).to_vec()))
            .collect();
        let share = lit(FRONT, lamp, &bars);
        assert!((share - 0.5).abs() < 0.3, "{share}");
    }

    proptest! {
        /// Compares random triangles in front of a tilted wall with counting 100 x 100 rays.
        #[test]
        fn agrees_with_counting(
            triangles in prop::collection::vec(
                prop::collection::vec((-3.0..3.0, -3.0..3.0, -3.5..1.5), 3), 1..4),
            (x, y, z) in (-3.0..3.0, -3.0..3.0, -1.0..2.0),
            (tilt, turn) in (-0.4..0.4, -0.4..0.4),
        ) {
            let pieces: Vec<Piece> = triangles
                .iter()
                .map(|t| piece(t.iter().map(|&(x, y, z)| vec3(x, y, z)).collect()))
                .collect();
            let source = vec3(x, y, z);
            let normal = vec3(tilt, turn, 1.0).normalized();
            prop_assume!(pieces.iter().all(|p| p.normal.dot(p.vertices[0] - source).abs() > 0.02));
            let exact = lit(normal, source, &pieces);
            let n = 100;
            let camera = Camera::of_square(1.0);
            let height = normal.dot(vec3(0.0, 0.0, -3.0));
            let mut counted = 0;
            for i in 0..n * n {
                let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
                let ray = camera.ray(at(i % n), at(i / n));
                let point = ray * (height / normal.dot(ray));
                counted += i32::from(!pieces.iter().any(|p| blocks(p, point, source, 1e-9)));
            }
            let counted = f64::from(counted) / f64::from(n * n);
            prop_assert!((exact - counted).abs() < 0.02, "{} {}", exact, counted);
        }
    }
}
