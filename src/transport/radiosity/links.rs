//! Reflected light evened out between neighbouring nodes that see about the same.
//!
//! A node sees a small bright place in a few pixels of its hemicube, more or less by chance: alone
//! it would show as blotches, as each node errs by itself. How fast reflected light can change is
//! known from how near the things are that a node sees: over a distance d by about d / R, with R
//! the harmonic mean of their distances (Ward, Rubinstein and Clear, "A Ray Tracing Solution for
//! Diffuse Interreflection", 1988). So neighbours are averaged where d / R is small, and left alone
//! beside corners and joints, where light does change. Invariant: weights follow from the scene
//! and the nodes alone, so that G stays linear; what is even stays as it is.

#![allow(
    clippy::indexing_slicing,
    reason = "pairs are of the mesh's own elements, whose values are laid out in rows"
)]

use crate::transport::mesh::Mesh;

/// The share of the mean distance of what they see over which nodes are averaged.
const REACH: f64 = 0.1;

/// Times that neighbours are averaged.
const ROUNDS: usize = 2;

/// Which nodes are averaged, and how much.
#[derive(Clone, Debug)]
pub struct Links {
    pairs: Vec<(u32, u32, f32)>,
    /// Of each node, one over the weight of itself and its neighbours.
    shares: Vec<f32>,
}

impl Links {
    /// Between neighbours on a facet that nothing divides, given for each node one over the mean
    /// distance of what it sees (1/m).
    pub fn new(mesh: &Mesh, closeness: &[f32]) -> Links {
        let mut pairs = Vec::new();
        let mut weights = vec![1.0_f32; mesh.elements.len()];
        mesh.each_pair(|a, b| {
            let apart = (mesh.elements[a].centre - mesh.elements[b].centre).length();
            let nearest = f64::from(closeness[a].max(closeness[b]));
            let weight = (1.0 - apart * nearest / REACH) as f32;
            if weight > 0.0 {
                pairs.push((a as u32, b as u32, weight));
                weights[a] += weight;
                weights[b] += weight;
            }
        });
        Links {
            pairs,
            shares: weights.into_iter().map(f32::recip).collect(),
        }
    }

    /// Averages rows of `width` values, one row for each node.
    pub fn even(&self, values: &mut Vec<f32>, width: usize) {
        for _ in 0..ROUNDS {
            let mut sums = values.clone();
            for &(a, b, weight) in &self.pairs {
                let (a, b) = (a as usize * width, b as usize * width);
                for k in 0..width {
                    sums[a + k] += weight * values[b + k];
                    sums[b + k] += weight * values[a + k];
                }
            }
            for (row, share) in sums.chunks_exact_mut(width.max(1)).zip(&self.shares) {
                row.iter_mut().for_each(|x| *x *= share);
            }
            *values = sums;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, vec3};
    use crate::scene::{Material, Polygon, Scene};
    use crate::transport::direct::Setting;
    use crate::transport::hemicube::{Hemicube, Table, scatter};
    use crate::transport::lambert::{Clipper, Pane};
    use crate::transport::mesh::{Layout, Wish};
    use crate::transport::panorama::Outline;
    use crate::transport::surface::Surfaces;
    use crate::transport::visibility::Hierarchy;
    use crate::units::Rgb;
    use std::f64::consts::PI;

    /// A room of 6 x 6 x 4 m with a small bright square under its ceiling, the last facet.
    fn room() -> (Surfaces, Vec<Vec3>) {
        let corner = |i: usize| {
            let pick = |bit: usize, side: f64| if i & bit == 0 { 0.0 } else { side };
            vec3(pick(1, 6.0), pick(2, 6.0), pick(4, 4.0))
        };
        let walls = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [1, 5, 7, 3],
            [3, 7, 6, 2],
            [2, 6, 4, 0],
        ];
        let spot = [(2.9, 2.9), (2.9, 3.1), (3.1, 3.1), (3.1, 2.9)];
        let spot: Vec<Vec3> = spot.map(|(x, y)| vec3(x, y, 3.99)).to_vec();
        let mut polygons: Vec<Vec<Vec3>> = walls.map(|w| w.map(corner).to_vec()).to_vec();
        polygons.push(spot.clone());
        let polygon = |vertices| Polygon {
            vertices,
            material: 0,
        };
        let scene = Scene {
            materials: vec![Material {
                name: "wall".into(),
                reflectance: Rgb([0.5; 3]),
                emission: Rgb::default(),
            }],
            polygons: polygons.into_iter().map(polygon).collect(),
        };
        (Surfaces::new(&scene).unwrap(), spot)
    }

    /// On the floor under a bright square of 0.2 m, 4 m above: less than a pixel of a hemicube. By
    /// itself each node sees all of it, or nothing.
    #[test]
    fn a_small_bright_place_makes_no_blotches() {
        let (surfaces, spot) = room();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let eye = [vec3(3.0, 3.0, 2.0)];
        let made = |layout: Layout| {
            let wishes = vec![Wish::WANTED; layout.cells()];
            layout.mesh(setting, &eye, &wishes)
        };
        let elements = made(Layout::of_elements(&surfaces, 200));
        let nodes = made(Layout::of_nodes(&surfaces, 20_000, &[0.0; 7]));
        let (outline, table) = (Outline::new(&surfaces), Table::new(16));
        let mut cube = Hemicube::new(&surfaces, &outline, &elements, &table);
        let bright = surfaces.facets.len() - 1;
        let (mut closeness, mut naive) = (Vec::new(), Vec::new());
        for (i, node) in nodes.elements.iter().enumerate() {
            let mut seen = 0.0;
            let near = cube.visit(node.facet, node.centre, scatter(i as u64), |e, share| {
                if elements.elements[e as usize].facet == bright {
                    seen += share;
                }
            });
            closeness.push(near);
            naive.push(seen);
        }
        let mut even = naive.clone();
        Links::new(&nodes, &closeness).even(&mut even, 1);
        let pane = Pane::new(spot, vec3(0.0, 0.0, -1.0));
        let mut clipper = Clipper::default();
        let mut error = |found: &[f32]| {
            let (mut apart, mut power) = (0.0, 0.0);
            for (node, found) in nodes.elements.iter().zip(found) {
                let normal = surfaces.facets[node.facet].normal;
                let beside = (node.centre.x - 3.0).hypot(node.centre.y - 3.0);
                if normal.z > 0.9 && beside < 2.0 {
                    let exact = clipper.unoccluded(node.centre, normal, &pane) / PI;
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
    fn what_is_even_stays_and_corners_are_left_alone() {
        let (surfaces, _) = room();
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let layout = Layout::of_nodes(&surfaces, 2000, &[0.0; 7]);
        let wishes = vec![Wish::WANTED; layout.cells()];
        let nodes = layout.mesh(setting, &[vec3(3.0, 3.0, 2.0)], &wishes);
        let count = nodes.elements.len();
        let mut ones = vec![1.0; 2 * count];
        Links::new(&nodes, &vec![0.1; count]).even(&mut ones, 2);
        assert!(ones.iter().all(|x| (x - 1.0).abs() < 1e-6));
        let mixed: Vec<f32> = (0..count).map(|i| i as f32).collect();
        let mut near = mixed.clone();
        Links::new(&nodes, &vec![10.0; count]).even(&mut near, 1);
        assert_eq!(near, mixed);
    }
}
