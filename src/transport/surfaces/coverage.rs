//! Exact visibility within a square of the image: the visible facets and their areas.
//!
//! A piece covers the region within the lines of its edges, except where other pieces are nearer.
//! The inverse depth of a plane is linear in the image, so that one plane is nearer than another
//! on a half-plane, and every cut is along a straight line, also for facets that intersect or
//! extend behind the camera. Of coplanar facets the later wins, as in the rasteriser. This module
//! does not depend on lights.

#![allow(
    clippy::indexing_slicing,
    reason = "lines and pieces are named by the surfaces they were made from"
)]

use std::ops::Range;

use crate::surfaces::camera::Camera;
use crate::surfaces::clipper::{self, Line, PlanePoint, PolygonClipper, Rectangle, measured};
use crate::surfaces::facet::Piece;
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;

/// Relative difference of inverse depths below which two planes are coplanar.
const COPLANAR: f64 = 1e-6;

/// The pieces of a scene projected by a camera.
#[derive(Clone, Debug)]
pub struct Silhouettes<'a> {
    surfaces: &'a Surfaces,
    layers: Vec<Layer>,
    lines: Vec<Line>,
}

/// A piece in the image: its boundary lines, and its inverse depth as a linear function.
#[derive(Clone, Debug)]
struct Layer {
    facet: usize,
    /// True when its front is visible. Of two coplanar pieces fronts hide backs, then later facets
    /// earlier ones.
    is_front: bool,
    /// Range in the list of all lines; empty for a piece seen edge on.
    lines: Range<usize>,
    inverse: [f64; 3],
}

impl<'a> Silhouettes<'a> {
    /// Projects all pieces.
    pub fn new(surfaces: &'a Surfaces, camera: &Camera) -> Silhouettes<'a> {
        let mut all = Silhouettes {
            surfaces,
            layers: Vec::with_capacity(surfaces.pieces.len()),
            lines: Vec::new(),
        };
        for piece in &surfaces.pieces {
            all.add(camera, piece);
        }
        all
    }

    fn add(&mut self, camera: &Camera, piece: &Piece) {
        let distance = piece.normal.dot(piece.vertices[0] - camera.origin);
        let from = self.lines.len();
        if distance != 0.0 {
            let n = piece.vertices.len();
            for (i, v) in piece.vertices.iter().enumerate() {
                let [v, w] = [*v, piece.vertices[(i + 1) % n]].map(|p| p - camera.origin);
                let wall = v.cross(w) * distance.signum();
                self.lines.push(clipper::line(camera, wall));
            }
        }
        let across = piece.normal.dot(camera.right) * camera.step_x / distance;
        let down = -piece.normal.dot(camera.up) * camera.step_y / distance;
        let constant = piece.normal.dot(camera.ray(0.0, 0.0)) / distance;
        self.layers.push(Layer {
            is_front: distance < 0.0,
            facet: piece.facet,
            lines: from..self.lines.len(),
            inverse: [constant, across, down],
        });
    }

    fn pieces(&self, facets: &[u32]) -> impl Iterator<Item = &Layer> {
        let pieces = |f: &u32| self.surfaces.facets[*f as usize].pieces.clone();
        let layers = facets.iter().flat_map(move |f| &self.layers[pieces(f)]);
        layers.filter(|layer| !layer.lines.is_empty())
    }
}

/// The visible part of one facet in a square.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
    /// Visible area in pixels of the camera.
    pub area: f64,
    /// Centroid of its largest visible part.
    pub at: PlanePoint,
    /// Area of that part.
    largest: f64,
    /// Range of its convex parts in [`Shares`].
    parts: Range<usize>,
}

impl Share {
    /// Number of convex parts.
    pub fn count(&self) -> usize {
        self.parts.len()
    }
}

/// A square of the image.
#[derive(Clone, Copy, Debug)]
pub struct Square {
    /// Left and upper edges.
    pub corner: PlanePoint,
    /// Its side.
    pub side: f64,
}

/// The visible parts of a square, with working memory for one thread.
#[derive(Debug, Default)]
pub struct Shares {
    clipper: PolygonClipper,
    all: Vec<Share>,
    /// Corners of each convex part.
    parts: Lists<PlanePoint>,
}

impl Shares {
    /// Computes the visible parts of the candidate facets (ascending, each once) in a square.
    pub fn find(
        &mut self,
        silhouettes: &Silhouettes<'_>,
        Square { corner, side }: Square,
        candidates: &[u32],
    ) {
        self.all.clear();
        self.parts.clear();
        let [x, y] = corner;
        let outline = [[x, y], [x + side, y], [x + side, y + side], [x, y + side]];
        for own in silhouettes.pieces(candidates) {
            self.clipper.clear();
            self.clipper.add(&outline);
            self.clipper
                .keep(silhouettes.lines[own.lines.clone()].iter());
            for other in silhouettes.pieces(candidates) {
                if self.clipper.count() == 0 {
                    break;
                }
                if other.facet != own.facet {
                    // First the line that most often shows that nothing is cut.
                    let nearer = [nearer(other, own)];
                    let lines = nearer.iter().chain(&silhouettes.lines[other.lines.clone()]);
                    self.clipper.subtract(lines, &Rectangle::EVERYWHERE);
                }
            }
            self.merge(own.facet);
        }
    }

    /// Visible parts, facet by facet.
    pub fn all(&self) -> &[Share] {
        &self.all
    }

    /// Convex parts of a share.
    pub fn parts(&self, share: &Share) -> impl Iterator<Item = &[PlanePoint]> {
        share.parts.clone().map(|part| self.parts.get(part))
    }

    /// Adds the remaining parts of a piece to its facet's share.
    fn merge(&mut self, facet: usize) {
        if self.clipper.count() == 0 {
            return;
        }
        let from = self.parts.count();
        if self.all.last().is_none_or(|share| share.facet != facet) {
            self.all.push(Share {
                facet,
                area: 0.0,
                at: [0.0; 2],
                largest: 0.0,
                parts: from..from,
            });
        }
        let Some(share) = self.all.last_mut() else {
            return;
        };
        for part in self.clipper.parts() {
            let (area, at) = measured(part);
            share.area += area;
            if area > share.largest {
                (share.largest, share.at) = (area, at);
            }
            self.parts.push(part.iter().copied());
        }
        share.parts.end = self.parts.count();
    }
}

/// Line whose positive side is the region where `a` hides `b`.
fn nearer(a: &Layer, b: &Layer) -> Line {
    let (near, far) = if (a.is_front, a.facet) > (b.is_front, b.facet) {
        (1.0, 1.0 - COPLANAR)
    } else {
        (1.0 - COPLANAR, 1.0)
    };
    [0, 1, 2].map(|k| a.inverse[k] * near - b.inverse[k] * far)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::rectangle;
    use footlight_show::geometry::{Vec3, vec3};

    fn seen(quads: &[[Vec3; 4]]) -> Vec<f64> {
        let surfaces = Surfaces::grey(quads.iter().map(|q| q.to_vec()).collect());
        let all: Vec<u32> = (0..surfaces.facets.len() as u32).collect();
        let square = Square {
            corner: [0.0, 0.0],
            side: 1.0,
        };
        let mut shares = Shares::default();
        shares.find(
            &Silhouettes::new(&surfaces, &Camera::of_square(1.0)),
            square,
            &all,
        );
        shares.all().iter().map(|s| s.area).collect()
    }

    #[test]
    fn what_stands_before_takes_its_exact_share() {
        let wall = rectangle((-9.0, 9.0), (-9.0, 9.0), -3.0);
        // At distance 1 the pixel is 2 x 2: this covers a tenth of its width and half its height.
        let post = rectangle((0.3, 0.5), (-2.0, 0.0), -1.0);
        let areas = seen(&[wall, post]);
        assert!((areas[0] - 0.95).abs() < 1e-12 && (areas[1] - 0.05).abs() < 1e-12);
        // Behind the wall it covers nothing.
        let hidden = rectangle((0.3, 0.5), (-2.0, 0.0), -4.0);
        assert!((seen(&[wall, hidden])[0] - 1.0).abs() < 1e-12);
        // In the wall's plane the smaller facet wins.
        let poster = rectangle((-3.0, 0.0), (-3.0, 3.0), -3.0);
        let areas = seen(&[wall, poster]);
        assert!((areas[0] - 0.5).abs() < 1e-9 && (areas[1] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn planes_that_cross_share_along_their_line() {
        let wall = rectangle((-9.0, 9.0), (-9.0, 9.0), -2.0);
        // Meets the wall at x = 1, is nearer to the right of it, and meets the pixel's right edge
        // at x = z.
        let slanted = [
            vec3(-0.5, -8.0, -3.5),
            vec3(1.9, -8.0, -1.1),
            vec3(1.9, 8.0, -1.1),
            vec3(-0.5, 8.0, -3.5),
        ];
        // On the line x / depth = 1/2: three quarters of the way across. The later facet wins the
        // band in which the planes are coplanar, so the line shifts by about its width.
        let areas = seen(&[wall, slanted]);
        assert!((areas[0] - 0.75).abs() < COPLANAR, "{areas:?}");
        assert!((areas[1] - 0.25).abs() < COPLANAR, "{areas:?}");
    }
}
