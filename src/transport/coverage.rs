//! Exact shares of a square of the picture: which facets it shows, and how much of each.
//!
//! The candidates are cut to the square in homogeneous image coordinates, and from each is cut
//! what lies behind another. One over the depth of a plane is linear in the image, so where one
//! plane is nearer than another is a half-plane, and every cut is between convex polygons; facets
//! that pass through each other are right too. Ties in one plane go to the later facet, as in the
//! rasterizer. This room knows nothing of lights.

#![allow(
    clippy::indexing_slicing,
    reason = "indices run over the polygon's own vertices, facets' pieces come from the surfaces"
)]

use crate::raster::Camera;
use crate::transport::surface::{Piece, Surfaces};

/// Relative difference of inverse depths below which two planes count as one.
const COPLANAR: f64 = 1e-6;

/// A place in the image, in the camera's pixels.
pub type Place = [f64; 2];

/// What a square shows of one facet.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Index into [`Surfaces::facets`].
    pub facet: usize,
    /// Visible area, the camera's pixels being squares of area 1.
    pub area: f64,
    /// Centroid of its largest visible part.
    pub at: Place,
    /// The convex parts that are visible.
    pub parts: Vec<Vec<Place>>,
}

/// A piece within the square: its outline, and one over its depth as a linear function.
struct Layer {
    facet: usize,
    /// Is its front seen? Of two in one plane fronts hide backs, then later facets earlier ones.
    is_front: bool,
    outline: Vec<Place>,
    inverse: [f64; 3],
}

/// A square of the image.
#[derive(Clone, Copy, Debug)]
pub struct Square {
    /// Its left and upper edges.
    pub corner: Place,
    /// Its side.
    pub side: f64,
}

/// The visible shares of the candidate facets (ascending, each once) in a square.
pub fn shares(
    surfaces: &Surfaces,
    camera: &Camera,
    square: Square,
    candidates: &[u32],
) -> Vec<Share> {
    let pieces = candidates
        .iter()
        .flat_map(|&f| &surfaces.pieces[surfaces.facets[f as usize].pieces.clone()]);
    let layers: Vec<Layer> = pieces.filter_map(|p| layer(camera, square, p)).collect();
    let mut out: Vec<Share> = Vec::with_capacity(candidates.len());
    for own in &layers {
        let mut parts = vec![own.outline.clone()];
        for other in layers.iter().filter(|o| o.facet != own.facet) {
            let nearer = nearer(other, own);
            let cutter = half(&other.outline, nearer);
            if cutter.len() >= 3 {
                parts = parts.iter().flat_map(|p| outside(p, &cutter)).collect();
            }
        }
        let largest = parts.iter().map(|p| measured(p)).fold(
            (0.0, 0.0, [0.0; 2]),
            |(sum, most, at), (area, centre)| {
                let best = area > most;
                (sum + area, area.max(most), if best { centre } else { at })
            },
        );
        merge(&mut out, own.facet, largest, parts);
    }
    out
}

/// Adds a piece's share to that of its facet; the larger gives the place.
fn merge(
    out: &mut Vec<Share>,
    facet: usize,
    (area, _, at): (f64, f64, Place),
    parts: Vec<Vec<Place>>,
) {
    match out.last_mut().filter(|s| s.facet == facet) {
        Some(share) => {
            if area > share.area {
                share.at = at;
            }
            share.area += area;
            share.parts.extend(parts);
        }
        None => out.push(Share {
            facet,
            area,
            at,
            parts,
        }),
    }
}

/// Where `a` hides `b`: positive values of a linear function of the image.
fn nearer(a: &Layer, b: &Layer) -> [f64; 3] {
    let (near, far) = if (a.is_front, a.facet) > (b.is_front, b.facet) {
        (1.0, 1.0 - COPLANAR)
    } else {
        (1.0 - COPLANAR, 1.0)
    };
    [0, 1, 2].map(|k| a.inverse[k] * near - b.inverse[k] * far)
}

fn layer(camera: &Camera, square: Square, piece: &Piece) -> Option<Layer> {
    let [x, y] = square.corner;
    let distance = piece.normal.dot(piece.vertices[0] - camera.origin);
    if distance == 0.0 {
        return None;
    }
    // Image coordinates times depth, and the depth.
    let mut outline: Vec<[f64; 3]> = piece
        .vertices
        .iter()
        .map(|v| {
            let d = *v - camera.origin;
            let depth = camera.forward.dot(d);
            [
                (camera.right.dot(d) - camera.left * depth) / camera.step_x,
                (camera.top * depth - camera.up.dot(d)) / camera.step_y,
                depth,
            ]
        })
        .collect();
    for side in [
        [1.0, 0.0, -x],
        [-1.0, 0.0, x + square.side],
        [0.0, 1.0, -y],
        [0.0, -1.0, y + square.side],
    ] {
        outline = cut(&outline, |p| {
            side[0] * p[0] + side[1] * p[1] + side[2] * p[2]
        });
        if outline.len() < 3 {
            return None;
        }
    }
    let outline: Vec<Place> = outline
        .iter()
        .filter(|p| p[2] > 0.0)
        .map(|p| [p[0] / p[2], p[1] / p[2]])
        .collect();
    let across = piece.normal.dot(camera.right) * camera.step_x / distance;
    let down = -piece.normal.dot(camera.up) * camera.step_y / distance;
    let constant = piece.normal.dot(camera.ray(0.0, 0.0)) / distance;
    (outline.len() >= 3).then_some(Layer {
        is_front: distance < 0.0,
        facet: piece.facet,
        outline,
        inverse: [constant, across, down],
    })
}

/// The part of a convex polygon where a linear function is not negative.
fn cut<const N: usize>(polygon: &[[f64; N]], height: impl Fn(&[f64; N]) -> f64) -> Vec<[f64; N]> {
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, a) in polygon.iter().enumerate() {
        let b = &polygon[(i + 1) % polygon.len()];
        let (here, there) = (height(a), height(b));
        if here >= 0.0 {
            out.push(*a);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let t = here / (here - there);
            out.push(std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t));
        }
    }
    out
}

fn half(polygon: &[Place], line: [f64; 3]) -> Vec<Place> {
    cut(polygon, |p| line[0] + line[1] * p[0] + line[2] * p[1])
}

/// Convex parts of a convex polygon outside another.
fn outside(polygon: &[Place], cutter: &[Place]) -> Vec<Vec<Place>> {
    let turn = doubled(cutter).signum();
    let mut parts = Vec::new();
    let mut rest = polygon.to_vec();
    for (i, a) in cutter.iter().enumerate() {
        let b = cutter[(i + 1) % cutter.len()];
        let (u, v) = ((b[0] - a[0]) * turn, (b[1] - a[1]) * turn);
        // Positive inside.
        let line = [v * a[0] - u * a[1], -v, u];
        let apart = half(&rest, line.map(|c| -c));
        if apart.len() >= 3 {
            parts.push(apart);
        }
        rest = half(&rest, line);
        if rest.len() < 3 {
            return parts;
        }
    }
    parts
}

/// Twice the signed area.
fn doubled(polygon: &[Place]) -> f64 {
    let o = polygon[0];
    polygon
        .windows(2)
        .map(|w| (w[0][0] - o[0]) * (w[1][1] - o[1]) - (w[0][1] - o[1]) * (w[1][0] - o[0]))
        .sum()
}

/// Area and centroid of a convex polygon.
pub fn measured(polygon: &[Place]) -> (f64, Place) {
    let o = polygon[0];
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for w in polygon.windows(2) {
        let [p, q] = [w[0], w[1]].map(|p| [p[0] - o[0], p[1] - o[1]]);
        let twice = p[0] * q[1] - p[1] * q[0];
        area += twice;
        x += twice * (p[0] + q[0]);
        y += twice * (p[1] + q[1]);
    }
    if area == 0.0 {
        return (0.0, o);
    }
    let centre = [o[0] + x / (3.0 * area), o[1] + y / (3.0 * area)];
    (area.abs() * 0.5, centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, vec3};
    use crate::scene::{Material, Polygon, Scene};
    use crate::units::Rgb;

    /// One pixel of side 2 at distance 1, towards -z, x to the right.
    fn eye() -> Camera {
        Camera {
            origin: Vec3::ZERO,
            right: vec3(1.0, 0.0, 0.0),
            up: vec3(0.0, 1.0, 0.0),
            forward: vec3(0.0, 0.0, -1.0),
            left: -1.0,
            top: 1.0,
            step_x: 2.0,
            step_y: 2.0,
        }
    }

    fn seen(quads: &[[Vec3; 4]]) -> Vec<f64> {
        let scene = Scene {
            materials: vec![Material {
                name: "grey".into(),
                reflectance: Rgb([0.5; 3]),
                emission: Rgb::default(),
            }],
            polygons: quads
                .iter()
                .map(|q| Polygon {
                    vertices: q.to_vec(),
                    material: 0,
                })
                .collect(),
        };
        let surfaces = Surfaces::new(&scene).unwrap();
        let all: Vec<u32> = (0..surfaces.facets.len() as u32).collect();
        let square = Square {
            corner: [0.0, 0.0],
            side: 1.0,
        };
        let found = shares(&surfaces, &eye(), square, &all);
        found.iter().map(|s| s.area).collect()
    }

    fn upright(x: (f64, f64), y: (f64, f64), z: f64) -> [Vec3; 4] {
        [
            vec3(x.0, y.0, z),
            vec3(x.1, y.0, z),
            vec3(x.1, y.1, z),
            vec3(x.0, y.1, z),
        ]
    }

    #[test]
    fn what_stands_before_takes_its_exact_share() {
        let wall = upright((-9.0, 9.0), (-9.0, 9.0), -3.0);
        // At distance 1 the pixel is 2 x 2: this covers a tenth of its width, half its height.
        let post = upright((0.3, 0.5), (-2.0, 0.0), -1.0);
        let areas = seen(&[wall, post]);
        assert!((areas[0] - 0.95).abs() < 1e-12 && (areas[1] - 0.05).abs() < 1e-12);
        // Behind the wall it takes none.
        let hidden = upright((0.3, 0.5), (-2.0, 0.0), -4.0);
        assert!((seen(&[wall, hidden])[0] - 1.0).abs() < 1e-12);
        // In its plane the smaller wins.
        let poster = upright((-3.0, 0.0), (-3.0, 3.0), -3.0);
        let areas = seen(&[wall, poster]);
        assert!((areas[0] - 0.5).abs() < 1e-9 && (areas[1] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn planes_that_cross_share_along_their_line() {
        let wall = upright((-9.0, 9.0), (-9.0, 9.0), -2.0);
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
