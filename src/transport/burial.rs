//! Which points lie inside a solid, where no light can come.
//!
//! Solids are seldom closed: a box that stands on a floor has no bottom, and the floor goes on
//! beneath it. So a point counts as open when it sees a beacon (the eye, a luminaire) or the void,
//! or when a surface that it sees does, twice over; else it is buried. A nook that three bounces
//! from every lamp do not reach is taken for buried too: it is out of sight, and dark. This room
//! knows nothing of meshes.

#![allow(
    clippy::indexing_slicing,
    reason = "pieces are named by the hierarchy, facets by the pieces"
)]

use crate::geometry::Vec3;
use crate::transport::direct::{Luminaire, Setting, frame};
use crate::transport::surface::Piece;
use rayon::prelude::*;

/// Beacons kept at most; more do not make the answer better, only slower where it is no.
const MOST_BEACONS: usize = 16;

/// How many surfaces in a row are asked.
const DEPTH: usize = 2;

/// How far from a corner towards the middle a piece is looked at from behind.
const INSET: f64 = 0.05;

/// Points known to be in the open: the eye and the luminaires.
pub fn beacons(setting: Setting<'_>, lights: &[Luminaire], eye: Vec3) -> Vec<Vec3> {
    let surfaces = setting.surfaces;
    let lift = surfaces.size * 1e-4;
    let mut all: Vec<Vec3> = Vec::new();
    for light in lights {
        match light {
            Luminaire::Panel(pieces) => all.extend(pieces.iter().map(|&i| {
                let piece = &surfaces.pieces[i];
                let sum = piece.vertices.iter().fold(Vec3::ZERO, |s, v| s + *v);
                sum / piece.vertices.len() as f64 + piece.normal * lift
            })),
            Luminaire::Spot(beam) => all.push(beam.position),
        }
    }
    let stride = all.len().div_ceil(MOST_BEACONS - 1).max(1);
    std::iter::once(eye)
        .chain(all.into_iter().step_by(stride))
        .collect()
}

/// Is a point on the front of `facet` buried?
pub fn is_buried(setting: Setting<'_>, beacons: &[Vec3], facet: usize, point: Vec3) -> bool {
    let normal = setting.surfaces.facets[facet].normal;
    !is_open(setting, beacons, normal, point, DEPTH)
}

/// Which pieces have the inside of a solid behind them: seen from the back of the piece, its
/// middle and a place beside each corner are buried.
pub fn solid(setting: Setting<'_>, beacons: &[Vec3]) -> Vec<bool> {
    let pieces = setting.surfaces.pieces.par_iter();
    let closed = |piece: &Piece| {
        let sum = piece.vertices.iter().fold(Vec3::ZERO, |s, v| s + *v);
        let middle = sum / piece.vertices.len() as f64;
        let beside = piece.vertices.iter().map(|v| *v + (middle - *v) * INSET);
        let mut places = std::iter::once(middle).chain(beside);
        places.all(|p| !is_open(setting, beacons, -piece.normal, p, DEPTH))
    };
    pieces.map(closed).collect()
}

/// Is a point on the side of a surface that `normal` points to in the open?
fn is_open(setting: Setting<'_>, beacons: &[Vec3], normal: Vec3, p: Vec3, depth: usize) -> bool {
    let surfaces = setting.surfaces;
    let sees = |b: &Vec3| {
        normal.dot(*b - p) > surfaces.touching() && !setting.hierarchy.blocked(surfaces, p, *b)
    };
    if beacons.iter().any(sees) {
        return true;
    }
    let [u, v] = frame(normal);
    let lean = |a: f64, b: f64| normal + u * a + v * b;
    // Unequal leanings, so that rays do not run along the edges of axis-aligned boxes.
    [
        lean(0.013, 0.021),
        lean(0.83, 0.37),
        lean(-0.41, 0.79),
        lean(-0.77, -0.43),
        lean(0.39, -0.81),
    ]
    .into_iter()
    .any(|ray| match setting.hierarchy.first_hit(surfaces, p, ray) {
        None => true,
        Some((i, t)) => {
            let piece = &surfaces.pieces[i];
            depth > 0
                && piece.normal.dot(ray) < 0.0
                && is_open(setting, beacons, piece.normal, p + ray * t, depth - 1)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::vec3;
    use crate::scene::{Material, Polygon, Scene, Spot, View};
    use crate::transport::beam::Beam;
    use crate::transport::cluster::{Receiver, Receivers};
    use crate::transport::direct::irradiance;
    use crate::transport::eye::{Sampling, Split, fragments};
    use crate::transport::surface::Surfaces;
    use crate::transport::visibility::Hierarchy;
    use crate::units::Rgb;
    use crate::work::{Silent, Work};

    /// A floor, and a box without a bottom on it; the wall at y = 1 goes on behind the box.
    fn scene() -> Scene {
        let c = |x: f64, y: f64, z: f64| vec3(x, y, z);
        of(&[
            [
                c(-9.0, -9.0, 0.0),
                c(9.0, -9.0, 0.0),
                c(9.0, 1.0, 0.0),
                c(-9.0, 1.0, 0.0),
            ],
            [
                c(-9.0, 1.0, 0.0),
                c(9.0, 1.0, 0.0),
                c(9.0, 1.0, 9.0),
                c(-9.0, 1.0, 9.0),
            ],
            [
                c(-1.0, -1.0, 1.0),
                c(1.0, -1.0, 1.0),
                c(1.0, 1.0, 1.0),
                c(-1.0, 1.0, 1.0),
            ],
            [
                c(-1.0, -1.0, 0.0),
                c(1.0, -1.0, 0.0),
                c(1.0, -1.0, 1.0),
                c(-1.0, -1.0, 1.0),
            ],
            [
                c(1.0, -1.0, 0.0),
                c(1.0, 1.0, 0.0),
                c(1.0, 1.0, 1.0),
                c(1.0, -1.0, 1.0),
            ],
            [
                c(-1.0, 1.0, 0.0),
                c(-1.0, -1.0, 0.0),
                c(-1.0, -1.0, 1.0),
                c(-1.0, 1.0, 1.0),
            ],
        ])
    }

    fn of(quads: &[[Vec3; 4]]) -> Scene {
        let polygons = quads.iter().map(|q| Polygon {
            vertices: q.to_vec(),
            material: 0,
        });
        Scene {
            materials: vec![Material {
                name: "grey".into(),
                reflectance: Rgb([0.5; 3]),
                emission: Rgb::default(),
            }],
            polygons: polygons.collect(),
        }
    }

    #[test]
    fn floor_and_wall_inside_an_open_box_are_buried() {
        let surfaces = Surfaces::new(&scene()).unwrap();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let towards = |n: Vec3, p: Vec3| {
            let on =
                |f: &crate::transport::surface::Facet| f.normal == n && f.height(p).abs() < 1e-9;
            surfaces.facets.iter().position(on).unwrap()
        };
        let eye = [vec3(0.0, -8.0, 2.0)];
        let up = vec3(0.0, 0.0, 1.0);
        let south = vec3(0.0, -1.0, 0.0);
        for (normal, point, buried) in [
            (up, vec3(0.1, 0.2, 0.0), true),
            (up, vec3(-0.95, 0.9, 0.0), true),
            (up, vec3(1.1, 0.5, 0.0), false),
            (up, vec3(0.0, -1.001, 0.0), false),
            (up, vec3(0.3, 0.3, 1.0), false),
            (south, vec3(0.2, 1.0, 0.4), true),
            (south, vec3(0.2, 1.0, 1.1), false),
        ] {
            let facet = towards(normal, point);
            assert_eq!(is_buried(setting, &eye, facet, point), buried, "{point:?}");
        }
    }

    /// A box of half the height on a floor, without a bottom; `lid` of its top is closed.
    fn crate_with(lid: f64) -> Scene {
        let c = |x: f64, y: f64, z: f64| vec3(x, y, z);
        of(&[
            [
                c(-9.0, -9.0, 0.0),
                c(9.0, -9.0, 0.0),
                c(9.0, 9.0, 0.0),
                c(-9.0, 9.0, 0.0),
            ],
            [
                c(-1.0, -1.0, 1.0),
                c(1.0, -1.0, 1.0),
                c(1.0, 2.0 * lid - 1.0, 1.0),
                c(-1.0, 2.0 * lid - 1.0, 1.0),
            ],
            [
                c(-1.0, -1.0, 0.0),
                c(1.0, -1.0, 0.0),
                c(1.0, -1.0, 1.0),
                c(-1.0, -1.0, 1.0),
            ],
            [
                c(1.0, -1.0, 0.0),
                c(1.0, 1.0, 0.0),
                c(1.0, 1.0, 1.0),
                c(1.0, -1.0, 1.0),
            ],
            [
                c(1.0, 1.0, 0.0),
                c(-1.0, 1.0, 0.0),
                c(-1.0, 1.0, 1.0),
                c(1.0, 1.0, 1.0),
            ],
            [
                c(-1.0, 1.0, 0.0),
                c(-1.0, -1.0, 0.0),
                c(-1.0, -1.0, 1.0),
                c(-1.0, 1.0, 1.0),
            ],
        ])
    }

    /// How many pieces close a solid, seen from an eye.
    fn closed(scene: &Scene, eye: Vec3) -> usize {
        let surfaces = Surfaces::new(scene).unwrap();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        solid(setting, &[eye]).iter().filter(|s| **s).count()
    }

    #[test]
    fn a_box_on_the_floor_is_a_solid_and_what_can_be_looked_into_is_none() {
        let outside = vec3(0.0, -8.0, 2.0);
        assert_eq!(closed(&scene(), outside), 4);
        assert_eq!(closed(&crate_with(1.0), outside), 5);
        // A gap of a fifth, and a lamp inside.
        assert_eq!(closed(&crate_with(0.8), outside), 0);
        assert_eq!(closed(&crate_with(1.0), vec3(0.2, 0.1, 0.4)), 0);
    }

    /// The naive rule, that backs never count, lets light through a screen; ours through nothing.
    #[test]
    fn far_sides_left_out_take_no_shadow_away() {
        let screen = [
            vec3(-3.0, 3.0, 0.0),
            vec3(3.0, 3.0, 0.0),
            vec3(3.0, 3.0, 2.0),
            vec3(-3.0, 3.0, 2.0),
        ];
        let mut scene = crate_with(1.0);
        scene.polygons.extend(of(&[screen]).polygons);
        let lamp = vec3(2.0, 6.0, 2.5);
        let mut surfaces = Surfaces::new(&scene).unwrap();
        let hierarchy = Hierarchy::new(&surfaces);
        let open = surfaces.clone();
        let all = Setting {
            surfaces: &open,
            hierarchy: &hierarchy,
        };
        let eye = vec3(-4.0, -8.0, 5.0);
        surfaces.close(&solid(all, &[eye, lamp]));
        assert_eq!(surfaces.pieces.iter().filter(|p| p.solid).count(), 5);
        let near = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let mut backless = open.clone();
        backless.close(&vec![true; open.pieces.len()]);
        let naive = Setting {
            surfaces: &backless,
            hierarchy: &hierarchy,
        };
        let work = Work {
            progress: &Silent,
            threads: 1,
            memory: 1 << 30,
        };
        let view = View {
            from: eye,
            to: vec3(0.0, 0.0, 0.5),
            fov: 40.0,
            width: 80,
            height: 60,
        };
        let sampling = Sampling {
            split: Split::Whole,
            edge_split: Split::Halves,
        };
        let seen = fragments(&open, &view, sampling, work).unwrap();
        let receivers = Receivers::of_fragments(&open, &seen);
        // Under the box too.
        let points: Vec<Receiver> = (0..1024_u32)
            .map(|i| (f64::from(i % 32), f64::from(i / 32)))
            .map(|(x, y)| Receiver {
                point: vec3(0.25 * x - 4.0, 0.25 * y - 4.0, 0.0),
                facet: 0,
            })
            .collect();
        let points = Receivers::new(&open, &points);
        let spot = Beam::new(&Spot {
            position: lamp,
            aim: vec3(0.0, 0.0, 0.0),
            intensity: Rgb([1.0; 3]),
            beam: 60.0,
            field: 120.0,
        });
        let panel = surfaces.facets.iter().position(|f| f.normal.y < -0.5);
        let panel = Luminaire::Panel(vec![surfaces.facets[panel.unwrap()].pieces.start]);
        for light in [Luminaire::Spot(spot.unwrap()), panel] {
            let at = |setting, points: &Receivers, seen| {
                irradiance(setting, &light, points, seen, 0.0, work).unwrap()
            };
            for (points, seen) in [(&receivers, Some(&seen)), (&points, None)] {
                let (exact, ours) = (at(all, points, seen), at(near, points, seen));
                let most = exact.iter().copied().fold(0.0, f32::max);
                let apart = exact.iter().zip(&ours).map(|(a, b)| (a - b).abs());
                assert!(most > 0.0 && apart.fold(0.0, f32::max) <= 1e-5 * most);
            }
            if matches!(light, Luminaire::Spot(_)) {
                let lit = |setting| {
                    let all = at(setting, &receivers, Some(&seen));
                    all.iter().filter(|e| **e > 0.0).count()
                };
                let (naive, exact) = (lit(naive), lit(all));
                assert!(naive > exact + 100, "{naive} {exact}");
            }
        }
    }
}
