//! Interior-point rejection: points inside a solid, which no light can reach.
//!
//! Solids are seldom closed: a box on a floor has no bottom, and the floor continues beneath it. So
//! a point is open if a visibility seed (the camera, a luminaire) or the void is visible from it,
//! or if a surface visible from it is open by the same rule, up to two surfaces away. Only the
//! nearest seeds are tested, so a recess with its own lamp has a seed there. A point more than
//! three bounces from its nearest lamps is rejected too: it is nearly dark.

#![allow(
    clippy::indexing_slicing,
    reason = "pieces are named by the hierarchy, facets by the pieces"
)]

use crate::direct::PreparedLight;
use crate::surfaces::hierarchy::SceneGeometry;
use footlight_show::geometry::{Vec3, frame};

/// Most seeds of one light; a panel of many faces has seeds on some of them.
const SEEDS_OF_A_LIGHT: usize = 4;

/// Most seeds tested for one point.
const TESTED: usize = 16;

/// Most surfaces in a chain to a seed.
const DEPTH: usize = 2;

/// The visibility seeds of a scene: the camera and points of the luminaires.
pub fn seeds(setting: SceneGeometry<'_>, lights: &[PreparedLight], eye: Vec3) -> Vec<Vec3> {
    let surfaces = setting.surfaces;
    let lift = surfaces.size * 1e-4;
    let mut all = vec![eye];
    for light in lights {
        match light {
            PreparedLight::Panel(pieces) => {
                let stride = pieces.len().div_ceil(SEEDS_OF_A_LIGHT).max(1);
                all.extend(pieces.iter().step_by(stride).map(|&i| {
                    let piece = &surfaces.pieces[i];
                    let sum = piece.vertices.iter().fold(Vec3::ZERO, |s, v| s + *v);
                    sum / piece.vertices.len() as f64 + piece.normal * lift
                }));
            }
            PreparedLight::Spot(beam) => all.push(beam.position),
        }
    }
    all
}

/// The visibility seeds nearest to a point, the nearest first.
fn nearest(seeds: &[Vec3], p: Vec3) -> impl Iterator<Item = Vec3> {
    let mut best = [(f64::INFINITY, Vec3::ZERO); TESTED];
    for b in seeds {
        let square = (*b - p).dot(*b - p);
        let at = best.partition_point(|(other, _)| *other <= square);
        if at < TESTED {
            best[at..].rotate_right(1);
            best[at] = (square, *b);
        }
    }
    let known = best.into_iter().take(seeds.len());
    known.map(|(_, b)| b)
}

/// True when a point on the front of `facet` is inside a solid.
pub fn is_interior(setting: SceneGeometry<'_>, seeds: &[Vec3], facet: usize, point: Vec3) -> bool {
    !is_open(setting, seeds, facet, point, DEPTH)
}

fn is_open(
    setting: SceneGeometry<'_>,
    seeds: &[Vec3],
    facet: usize,
    p: Vec3,
    depth: usize,
) -> bool {
    let surfaces = setting.surfaces;
    let normal = surfaces.facets[facet].normal;
    let sees = |b: Vec3| {
        normal.dot(b - p) > surfaces.touching() && !setting.hierarchy.blocked(surfaces, p, b)
    };
    if nearest(seeds, p).any(sees) {
        return true;
    }
    let [u, v] = frame(normal);
    let lean = |a: f64, b: f64| normal + u * a + v * b;
    // Unequal slopes, so that rays do not run along the edges of axis-aligned boxes.
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
                && is_open(setting, seeds, piece.facet, p + ray * t, depth - 1)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::beam::Beam;
    use crate::surfaces::hierarchy::Hierarchy;
    use crate::surfaces::rectangle;
    use crate::surfaces::surface::Surfaces;
    use footlight_show::geometry::{block, vec3};
    use footlight_show::model::Spot;
    use footlight_show::units::Rgb;

    /// A floor, and a box without a bottom on it; the wall at y = 1 continues behind the box.
    fn scene() -> Surfaces {
        let floor = rectangle((-9.0, 9.0), (-9.0, 1.0), 0.0).to_vec();
        let wall = [(-9.0, 0.0), (9.0, 0.0), (9.0, 9.0), (-9.0, 9.0)];
        let wall = wall.map(|(x, z)| vec3(x, 1.0, z)).to_vec();
        let corners = [vec3(-1.0, -1.0, 0.0), vec3(1.0, 1.0, 1.0)];
        let [top, south, east, _, west, _] = block(corners, false);
        Surfaces::grey(vec![floor, wall, top, south, east, west])
    }

    #[test]
    fn floor_and_wall_inside_an_open_box_are_interior() {
        let surfaces = scene();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let towards = |n: Vec3, p: Vec3| {
            let on = |f: &crate::surfaces::facet::Facet| f.normal == n && f.height(p).abs() < 1e-9;
            surfaces.facets.iter().position(on).unwrap()
        };
        let eye = [vec3(0.0, -8.0, 2.0)];
        let up = vec3(0.0, 0.0, 1.0);
        let south = vec3(0.0, -1.0, 0.0);
        for (normal, point, enclosed) in [
            (up, vec3(0.1, 0.2, 0.0), true),
            (up, vec3(-0.95, 0.9, 0.0), true),
            (up, vec3(1.1, 0.5, 0.0), false),
            (up, vec3(0.0, -1.001, 0.0), false),
            (up, vec3(0.3, 0.3, 1.0), false),
            (south, vec3(0.2, 1.0, 0.4), true),
            (south, vec3(0.2, 1.0, 1.1), false),
        ] {
            let facet = towards(normal, point);
            assert_eq!(
                is_interior(setting, &eye, facet, point),
                enclosed,
                "{point:?}"
            );
        }
    }

    /// One of forty lamps is in the box, where no other is visible; every third of them would not
    /// include it.
    #[test]
    fn a_lamp_in_a_recess_is_its_seed() {
        let surfaces = scene();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let lamp = |i: u8| {
            let away = vec3(f64::from(i) * 0.2 - 4.0, -6.0, 5.0);
            Spot {
                position: if i == 1 { vec3(0.0, 0.0, 0.5) } else { away },
                aim: vec3(0.0, 0.0, 0.0),
                beam: 20.0,
                field: 40.0,
                intensity: Rgb::WHITE,
            }
        };
        let lights = |from: u8| -> Vec<PreparedLight> {
            let beam = |i| Beam::new(&lamp(i)).unwrap();
            (from..40).map(|i| PreparedLight::Spot(beam(i))).collect()
        };
        let floor = surfaces
            .facets
            .iter()
            .position(|f| f.normal.z > 0.9 && f.vertices.iter().all(|v| v.z == 0.0));
        for (from, enclosed) in [(1, false), (2, true)] {
            let all = seeds(setting, &lights(from), vec3(0.0, -8.0, 2.0));
            let found = is_interior(setting, &all, floor.unwrap(), vec3(0.1, 0.2, 0.0));
            assert_eq!(found, enclosed);
        }
    }
}
