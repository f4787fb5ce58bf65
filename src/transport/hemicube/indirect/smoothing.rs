//! Irradiance smoothing: reflected light is averaged over adjacent gather points.
//!
//! A small bright area covers a few pixels of a hemicube, more or less by chance, so single gather
//! points err and show as blotches. Neighbours are averaged where their distance times the mean
//! inverse distance of the surrounding surfaces ([`SurfaceProximity`]) is small, and not near
//! corners, where irradiance does change. Each gather point is compared with its two neighbours
//! along an axis of the grid, so slopes are preserved and only curvature is reduced. Invariant:
//! weights depend on the scene and the gather points alone, so that G stays linear.

#![allow(
    clippy::indexing_slicing,
    reason = "gather points are of the mesh's own elements, whose values are laid out one after the other"
)]

use crate::hemicube::indirect::hemicube::SurfaceProximity;
use crate::hemicube::mesh::Mesh;

/// Distance times mean inverse distance from which gather points are not averaged. Half this value
/// leaves visible blotches where small openings light a wall, at equal total error.
const REACH: f64 = 0.2;

/// Number of smoothing passes.
const ROUNDS: usize = 2;

/// Three adjacent gather points; the middle one moves towards the first and the last by these
/// shares of the differences.
#[derive(Clone, Copy, Debug)]
struct Triple {
    gather_points: [u32; 3],
    shares: [f32; 2],
}

/// The gather points to be averaged, with their weights.
#[derive(Clone, Debug)]
pub struct Smoothing {
    /// Triples along the two axes of the facets' grids.
    triples: [Vec<Triple>; 2],
}

impl Smoothing {
    /// Finds all triples of adjacent uncut gather points along both axes of the grids, and their
    /// weights; `proximity` holds the surface proximity at each gather point.
    pub fn new(mesh: &Mesh, proximity: &[SurfaceProximity]) -> Smoothing {
        let triples = [0, 1].map(|axis| {
            let mut triples = Vec::new();
            mesh.each_three(axis, |gather_points| {
                let [from, at, to] = gather_points.map(|n| mesh.elements[n].centre);
                let (before, behind) = ((at - from).length(), (to - at).length());
                let nearest = gather_points
                    .map(|n| proximity[n].mean_inverse_distance)
                    .into_iter()
                    .fold(0.0, f32::max);
                let weight = 1.0 - before.max(behind) * f64::from(nearest) / REACH;
                if weight > 0.0 {
                    // At weight 1 all three count equally. Linear values do not change.
                    let both = 2.0 * weight / (1.0 + 2.0 * weight) / (before + behind);
                    triples.push(Triple {
                        gather_points: gather_points.map(|n| n as u32),
                        shares: [behind * both, before * both].map(|x| x as f32),
                    });
                }
            });
            triples
        });
        Smoothing { triples }
    }

    /// Smooths `values`, a row of `width` values for each gather point, in place.
    pub fn smooth(&self, values: &mut [f32], width: usize) {
        let mut old = values.to_vec();
        for triples in self.triples.iter().cycle().take(2 * ROUNDS) {
            for triple in triples {
                let [from, at, to] = triple.gather_points.map(|n| n as usize * width);
                let [first, last] = triple.shares;
                for k in 0..width {
                    let own = old[at + k];
                    values[at + k] += first * (old[from + k] - own) + last * (old[to + k] - own);
                }
            }
            old.copy_from_slice(values);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::lambert::{LambertIntegrator, LightPolygon};
    use crate::hemicube::indirect::hemicube::{FormFactorTable, Hemicube, hash_to_unit};
    use crate::hemicube::mesh::Layout;
    use crate::hemicube::mesh::element::Element;
    use crate::hemicube::raster::VertexBuffer;
    use crate::surfaces::hierarchy::Hierarchy;
    use crate::surfaces::hierarchy::SceneGeometry;
    use crate::surfaces::surface::Surfaces;
    use footlight_show::geometry::{Vec3, block, vec3};
    use std::f64::consts::PI;

    /// A room of 6 x 6 x 4 m with a small bright square under its ceiling, the last facet.
    fn room() -> (Surfaces, Vec<Vec3>) {
        let spot = [(2.9, 2.9), (2.9, 3.1), (3.1, 3.1), (3.1, 2.9)];
        let spot: Vec<Vec3> = spot.map(|(x, y)| vec3(x, y, 3.99)).to_vec();
        let mut polygons = block([Vec3::ZERO, vec3(6.0, 6.0, 4.0)], true).to_vec();
        polygons.push(spot.clone());
        (Surfaces::grey(polygons), spot)
    }

    /// On the floor, 4 m below a bright square of 0.2 m, which is smaller than a pixel of a
    /// hemicube: each gather point alone sees the whole square or nothing.
    #[test]
    fn a_small_bright_place_makes_no_blotches() {
        let (surfaces, spot) = room();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let eye = [vec3(3.0, 3.0, 2.0)];
        let elements = Layout::of_elements(&surfaces, 200).mesh_of_all_cells(setting, &eye);
        let layout = Layout::of_gather_points(&surfaces, 20_000, &[0.0; 7]);
        let gather_points = layout.mesh_of_all_cells(setting, &eye);
        let (vertices, table) = (VertexBuffer::new(&surfaces), FormFactorTable::new(16));
        let mut cube = Hemicube::new(setting, &vertices, &elements, &table);
        let bright = surfaces.facets.len() - 1;
        let (mut proximity, mut naive) = (Vec::new(), Vec::new());
        for (i, gather_point) in gather_points.elements.iter().enumerate() {
            let mut seen = 0.0;
            let near = cube.visit(
                gather_point.facet,
                gather_point.centre,
                hash_to_unit(i as u64),
                |e, share| {
                    if elements.elements[e as usize].facet == bright {
                        seen += share;
                    }
                },
            );
            proximity.push(near);
            naive.push(seen);
        }
        let mut even = naive.clone();
        Smoothing::new(&gather_points, &proximity).smooth(&mut even, 1);
        let light_polygon = LightPolygon::new(spot, vec3(0.0, 0.0, -1.0));
        let mut integrator = LambertIntegrator::default();
        let mut error = |found: &[f32]| {
            let (mut apart, mut power) = (0.0, 0.0);
            for (gather_point, found) in gather_points.elements.iter().zip(found) {
                let normal = surfaces.facets[gather_point.facet].normal;
                let beside = (gather_point.centre.x - 3.0).hypot(gather_point.centre.y - 3.0);
                if normal.z > 0.9 && beside < 2.0 {
                    let exact =
                        integrator.unoccluded(gather_point.centre, normal, &light_polygon) / PI;
                    apart += (f64::from(*found) - exact).powi(2);
                    power += exact * exact;
                }
            }
            (apart / power).sqrt()
        };
        let (naive, even) = (error(&naive), error(&even));
        println!("blotches: {naive:.3} naive, {even:.3} evened out");
        assert!(naive > 0.5, "{naive}");
        assert!(even < 0.45 * naive, "{even} of {naive}");
    }

    #[test]
    fn slopes_stay_and_corners_are_left_alone() {
        let (surfaces, _) = room();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let layout = Layout::of_gather_points(&surfaces, 2000, &[0.0; 7]);
        let gather_points = layout.mesh_of_all_cells(setting, &[vec3(3.0, 3.0, 2.0)]);
        let count = gather_points.elements.len();
        let slope = |e: &Element| [1.0, e.centre.dot(vec3(0.3, -0.2, 0.5)) as f32];
        let near = |mean_inverse_distance: f32| {
            vec![
                SurfaceProximity {
                    mean_inverse_distance,
                    form_factor_sum: 1.0
                };
                count
            ]
        };
        let slopes: Vec<f32> = gather_points.elements.iter().flat_map(slope).collect();
        let mut found = slopes.clone();
        Smoothing::new(&gather_points, &near(0.1)).smooth(&mut found, 2);
        let apart = found.iter().zip(&slopes).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-5);
        let mixed: Vec<f32> = (0..count).map(|i| i as f32).collect();
        let mut left = mixed.clone();
        Smoothing::new(&gather_points, &near(10.0)).smooth(&mut left, 1);
        assert_eq!(left, mixed);
    }
}
