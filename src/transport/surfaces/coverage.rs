//! Exact visibility within a square of the picture: which facets it shows, and the area of each.
//!
//! A piece covers what lies within the lines of its edges, less what lies behind other pieces. One
//! over the depth of a plane is linear in the picture, so that one plane is nearer than another on a
//! half-plane, and every cut is along a straight line, also for facets that intersect or reach
//! behind the camera. Of coplanar facets the later wins, as in the rasterizer. This module does not
//! depend on lights.

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

/// Relative difference of inverse depths below which two planes count as one.
const COPLANAR: f64 = 1e-6;

/// The pieces of a scene projected by a camera.
#[derive(Clone, Debug)]
pub struct Silhouettes<'a> {
    surfaces: &'a Surfaces,
    layers: Vec<Layer>,
    lines: Vec<Line>,
}

/// A piece in the picture: the lines around it, and one over its depth as a linear function.
#[derive(Clone, Debug)]
struct Layer {
    facet: usize,
    /// Is its front seen? Of two in one plane fronts hide backs, then later facets earlier ones.
    is_front: bool,
    /// Among all lines; none for a piece seen edge on.
    lines: Range<usize>,
    inverse: [f64; 3],
}

impl<'a> Silhouettes<'a> {
    /// Of all pieces.
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

/// What a square shows of one facet.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
    /// Visible area, the camera's pixels being squares of area 1.
    pub area: f64,
    /// Centroid of its largest visible part.
    pub at: PlanePoint,
    /// Area of that part.
    largest: f64,
    /// Its convex parts, among those of [`Shares`].
    parts: Range<usize>,
}

impl Share {
    /// How many convex parts it has.
    pub fn count(&self) -> usize {
        self.parts.len()
    }
}

/// A square of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Square {
    /// Its left and upper edges.
    pub corner: PlanePoint,
    /// Its side.
    pub side: f64,
}

/// What a square shows, with the working memory to find it; for one thread.
#[derive(Debug, Default)]
pub struct Shares {
    clipper: PolygonClipper,
    all: Vec<Share>,
    /// Corners of each convex part.
    parts: Lists<PlanePoint>,
}

impl Shares {
    /// Finds the visible shares of the candidate facets (ascending, each once) in a square.
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

    /// What was found, facet by facet.
    pub fn all(&self) -> &[Share] {
        &self.all
    }

    /// The convex parts of a share.
    pub fn parts(&self, share: &Share) -> impl Iterator<Item = &[PlanePoint]> {
        share.parts.clone().map(|part| self.parts.get(part))
    }

    /// Adds what the clipper has left of a piece to its facet's share.
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

/// Where `a` hides `b`: positive values of a linear function of the picture.
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
        // At distance 1 the pixel is 2 x 2: this covers a tenth of its width, half its height.
        let post = rectangle((0.3, 0.5), (-2.0, 0.0), -1.0);
        let areas = seen(&[wall, post]);
        assert!((areas[0] - 0.95).abs() < 1e-12 && (areas[1] - 0.05).abs() < 1e-12);
        // Behind the wall it takes none.
        let hidden = rectangle((0.3, 0.5), (-2.0, 0.0), -4.0);
        assert!((seen(&[wall, hidden])[0] - 1.0).abs() < 1e-12);
        // In its plane the smaller wins.
        let poster = rectangle((-3.0, 0.0), (-3.0, 3.0), -3.0);
        let areas = seen(&[wall, poster]);
        assert!((areas[0] - 0.5).abs() < 1e-9 && (areas[1] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn planes_that_cross_share_along_their_line() {
        let wall = rectangle((-9.0, 9.0), (-9.0, 9.0), -2.0);
        // Meets the wall where x = 1, nearer to the right, and the pixel's right edge at x = z.
        let slanted = [
            vec3(-0.5, -8.0, -3.5),
            vec3(1.9, -8.0, -1.1),
            vec3(1.9, 8.0, -1.1),
            vec3(-0.5, 8.0, -3.5),
        ];
        // x / depth = 1/2 on the line: three quarters of the way across. The later facet wins the
        // band in which the planes count as one, so the line shifts by about its width.
        let areas = seen(&[wall, slanted]);
        assert!((areas[0] - 0.75).abs() < COPLANAR, "{areas:?}");
        assert!((areas[1] - 0.25).abs() < COPLANAR, "{areas:?}");
    }
}
