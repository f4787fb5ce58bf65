//! Globes: panels of many faces that look round from everywhere, such as bulbs and lanterns.
//!
//! Points spread over the area of a globe waste half of the samples on its far side, and the rest
//! differ by their cosines. Directions spread over the cone of its ball nearly all meet it, and
//! count alike (Shirley, Wang and Zimmerman, *Monte Carlo techniques for direct lighting
//! calculations*, 1996).

use crate::gather::ray_scene::RayScene;
use arrayvec::ArrayVec;
use footlight_show::geometry::{Vec3, bounds, frame, newell};
use std::f64::consts::{PI, TAU};

/// Most globes of a panel, and most of its facets.
const MOST: usize = 16;
const MOST_FACETS: usize = 4096;
/// Least area of a globe, relative to that of its ball: a cube has 0.64, a disc 0.5.
const ROUND: f64 = 0.6;
/// Gap between facets of one globe, metres.
const GAP: f64 = 1e-4;

/// A facet of a panel, or a piece of one.
pub struct Face<'a> {
    facet: u32,
    corners: &'a [Vec3],
    /// Lowest and highest coordinates.
    extent: [Vec3; 2],
}

impl Face<'_> {
    /// A piece with its facet.
    pub fn new(facet: usize, corners: &[Vec3]) -> Face<'_> {
        Face {
            facet: facet as u32,
            corners,
            extent: bounds(corners),
        }
    }
}

/// One globe.
struct Globe {
    middle: Vec3,
    radius: f64,
    /// Ascending.
    facets: Vec<u32>,
}

/// The globes of which a panel consists.
pub struct Globes(Vec<Globe>);

/// A direction towards a globe.
pub struct TowardsGlobe {
    /// Unit vector.
    pub way: Vec3,
    /// Probability density, 1/sr.
    pub density: f64,
    globe: usize,
}

/// The cone of a globe: its unit axis, and one minus the cosine of its half angle.
struct Cone {
    axis: Vec3,
    height: f64,
}

impl Globe {
    fn of(faces: &[&Face<'_>]) -> Option<Globe> {
        let area: f64 = faces.iter().map(|f| newell(f.corners).length() * 0.5).sum();
        let corners = || faces.iter().flat_map(|f| f.corners.iter());
        let [low, high] = bounds(corners());
        let middle = (low + high) * 0.5;
        let radius = corners()
            .map(|c| (*c - middle).length())
            .fold(0.0, f64::max);
        let mut facets: Vec<u32> = faces.iter().map(|f| f.facet).collect();
        facets.sort_unstable();
        facets.dedup();
        let is_round = area >= ROUND * 4.0 * PI * radius * radius;
        (is_round && radius > 0.0).then_some(Globe {
            middle,
            radius,
            facets,
        })
    }

    /// `None` from within its ball.
    fn cone(&self, from: Vec3) -> Option<Cone> {
        let to = self.middle - from;
        let length = to.length();
        let sine = self.radius / length;
        (sine < 1.0).then(|| Cone {
            axis: to * (1.0 / length),
            height: sine * sine / (1.0 + (1.0 - sine * sine).sqrt()),
        })
    }
}

impl Cone {
    /// Solid angle times a bound of the receiver's cosine.
    fn weight(&self, normal: Vec3) -> f64 {
        let sine = (self.height * (2.0 - self.height)).sqrt();
        TAU * self.height * (self.axis.dot(normal) + sine).clamp(0.0, 1.0)
    }

    fn direction(&self, [u, v]: [f64; 2]) -> Vec3 {
        let [right, up] = frame(self.axis);
        let cosine = 1.0 - u * self.height;
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (y, x) = (TAU * v).sin_cos();
        (right * x + up * y) * sine + self.axis * cosine
    }
}

impl Globes {
    /// `None` for a panel that consists of other things.
    pub fn of(faces: &[Face<'_>]) -> Option<Globes> {
        let groups = connected(faces)?;
        let globes: Option<Vec<Globe>> = groups.iter().map(|group| Globe::of(group)).collect();
        globes.map(Globes)
    }

    /// The cones of all globes with their weights, and the sum of these; `None` from within a ball.
    fn cones(&self, (from, normal): (Vec3, Vec3)) -> Option<(ArrayVec<(Cone, f64), MOST>, f64)> {
        let cone = |globe: &Globe| {
            let cone = globe.cone(from)?;
            let weight = cone.weight(normal);
            Some((cone, weight))
        };
        let cones: ArrayVec<(Cone, f64), MOST> = self.0.iter().map(cone).collect::<Option<_>>()?;
        let sum = cones.iter().map(|(_, weight)| weight).sum();
        Some((cones, sum))
    }

    /// A direction from a place and its normal towards a globe, chosen by solid angle; `None` from
    /// within a ball, and where all globes are below the horizon.
    pub fn direction(&self, at: (Vec3, Vec3), [u, v]: [f64; 2]) -> Option<TowardsGlobe> {
        let (cones, sum) = self.cones(at)?;
        let mut left = u * sum;
        let last = cones.iter().rposition(|(_, weight)| *weight > 0.0)?;
        for (globe, (cone, weight)) in cones.iter().enumerate() {
            if left >= *weight && globe < last {
                left -= weight;
                continue;
            }
            let share = (left / weight).min(1.0);
            return Some(TowardsGlobe {
                way: cone.direction([share, v]),
                density: weight / sum / (TAU * cone.height),
                globe,
            });
        }
        None
    }

    /// Density of [`Globes::direction`] towards a facet.
    pub fn density(&self, at: (Vec3, Vec3), facet: u32) -> Option<f64> {
        let (cones, sum) = self.cones(at)?;
        let of_facet = |globe: &Globe| globe.facets.binary_search(&facet).is_ok();
        let (cone, weight) = cones.get(self.0.iter().position(of_facet)?)?;
        Some(weight / sum / (TAU * cone.height))
    }

    /// Visible share of a globe's light in a direction.
    pub fn visible(&self, scene: RayScene<'_>, from: Vec3, towards: &TowardsGlobe) -> f64 {
        let Some(globe) = self.0.get(towards.globe) else {
            return 0.0;
        };
        let mut sum = 0.0;
        for (place, share) in scene.layers(from, towards.way) {
            if globe.facets.binary_search(&place.facet).is_ok() {
                sum += share * scene.clearness((place.point - from).length());
            }
        }
        sum
    }
}

/// Groups of faces whose boxes touch; `None` for too many faces or groups.
fn connected<'a>(faces: &'a [Face<'a>]) -> Option<Vec<Vec<&'a Face<'a>>>> {
    if faces.len() > MOST_FACETS {
        return None;
    }
    let mut left: Vec<&Face<'_>> = faces.iter().collect();
    let touch = |[a, b]: [Vec3; 2], [c, d]: [Vec3; 2]| {
        (0..3).all(|axis| a[axis] <= d[axis] + GAP && c[axis] <= b[axis] + GAP)
    };
    let mut groups = Vec::new();
    while let Some(first) = left.pop() {
        let mut group = vec![first];
        let mut done = 0;
        while let Some(own) = group.get(done).map(|face| face.extent) {
            done += 1;
            group.extend(left.extract_if(.., |other| touch(own, other.extent)));
        }
        groups.push(group);
        if groups.len() > MOST {
            return None;
        }
    }
    Some(groups)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::direct::lambert::closed_form;
    use crate::gather::bvh::Bvh;
    use crate::gather::sampling::point;
    use crate::surfaces::surface::Surfaces;
    use footlight_host::work::Work;
    use footlight_show::geometry::shape::Shape;
    use footlight_show::geometry::{part_above, vec3};

    const UP: Vec3 = vec3(0.0, 0.0, 1.0);

    /// Mean and greatest of the samples of the irradiance at the origin, which faces up, from these
    /// balls, and the closed form over their faces.
    fn irradiance(balls: &[(Vec3, f64)]) -> [f64; 3] {
        let ball = |&(centre, radius): &(Vec3, f64)| Shape::Sphere { centre, radius }.polygons();
        let polygons: Vec<Vec<Vec3>> = balls.iter().flat_map(ball).collect();
        let surfaces = Surfaces::grey(polygons.clone());
        let pieces = surfaces.pieces.iter();
        let faces: Vec<Face<'_>> = pieces.map(|p| Face::new(p.facet, &p.vertices)).collect();
        let globes = Globes::of(&faces).unwrap();
        assert_eq!(globes.0.len(), balls.len());

        let faces_us = |p: &&Vec<Vec3>| newell(p).dot(p[0]) < 0.0;
        let seen = polygons.iter().filter(faces_us);
        let exact = seen.map(|p| closed_form(&part_above(p, |v| v.z), UP)).sum();
        let bvh = Bvh::new(&surfaces, Work::silent()).unwrap();
        let scene = RayScene {
            surfaces: &surfaces,
            bvh: &bvh,
            offset: 1e-6,
        };
        let (mut mean, mut most) = (0.0, 0.0_f64);
        for k in 0..1 << 14 {
            let towards = globes.direction((Vec3::ZERO, UP), point(k, 7)).unwrap();
            let cosine = towards.way.dot(UP).max(0.0);
            let light = globes.visible(scene, Vec3::ZERO, &towards) * cosine / towards.density;
            mean += light / f64::from(1 << 14);
            most = most.max(light);
        }
        [mean, most, exact]
    }

    #[test]
    fn samples_of_globes_meet_the_closed_form() {
        let one = (vec3(0.5, 0.0, 2.0), 0.2);
        let two = (vec3(-1.0, 1.0, 0.1), 0.4);
        for balls in [vec![one], vec![two], vec![one, two]] {
            let [mean, most, exact] = irradiance(&balls);
            assert!(
                (mean / exact - 1.0).abs() < 5e-3,
                "{balls:?}: {mean} {exact}"
            );
            // The second ball lies half below the horizon, where cosines vary.
            let wide = if balls[0] == one && balls.len() == 1 {
                1.25
            } else {
                6.0
            };
            assert!(most < wide * exact, "{balls:?}: {most} {exact}");
        }
    }

    #[test]
    fn flat_panels_and_places_within_a_ball_have_no_cones() {
        let square = vec![
            vec3(0.0, 0.0, 1.0),
            vec3(0.0, 1.0, 1.0),
            vec3(1.0, 1.0, 1.0),
        ];
        assert!(Globes::of(&[Face::new(0, &square)]).is_none());
        let ball = Shape::Sphere {
            centre: UP,
            radius: 0.5,
        };
        let polygons = ball.polygons();
        let faces: Vec<Face<'_>> = polygons
            .iter()
            .enumerate()
            .map(|(i, p)| Face::new(i, p))
            .collect();
        let globes = Globes::of(&faces).unwrap();
        assert!(globes.direction((UP, UP), [0.5; 2]).is_none());
    }
}
