//! Predicted cost of a step on a scene, before any expensive work.
//!
//! The work is counted: hemicubes and their pixels, fragments, pairs of receiver and emitter, form
//! factors. The counts come from the operator's own layouts and from one rasterisation of the view
//! at one sample a pixel; no form factor or shadow is computed. Each count has a unit cost, fitted
//! to measurements of shipped scenes (`cargo run --release -p footlight-studies --bin cost` lists
//! them); a change of the operator needs a new fit. The unit is the time of a small fixed task on
//! the current machine ([`Transport::cost_scale`](crate::Transport::cost_scale)), so the costs do
//! not depend on the machine.

#![allow(
    clippy::indexing_slicing,
    reason = "pixels are addressed within the view, cells within their layout, facets by items"
)]

use crate::hemicube::mesh::Layout;
use crate::hemicube::step::HemicubeStep;
use crate::surfaces::camera::camera;
use crate::surfaces::fragment::is_stretched;
use crate::surfaces::raster::{ItemBuffer, NOTHING};
use crate::surfaces::surface::Surfaces;
use crate::{Cost, Setup, TransportError};
use footlight_show::geometry::Vec3;
use footlight_show::geometry::View;
use footlight_stage::{Light, Rig};

/// Names of the counts of [`Counts::prepare`].
pub const PREPARE: [&str; 7] = [
    "one",
    "pieces drawn in hemicubes",
    "pixels of hemicubes",
    "cells placed",
    "fragments inside",
    "fragments on edges",
    "rays of lobes",
];
/// Names of the counts of [`Counts::lights`].
pub const LIGHTS: [&str; 6] = [
    "elements x emitters",
    "fragments x emitters",
    "the same x depth of the scene",
    "the same where none is interpolated",
    "coefficients x lights",
    "rays of lobes x panels",
];
/// Names of the counts of [`Counts::picture`].
pub const PICTURE: [&str; 3] = ["fragments", "fragments x lights", "rays of lobes"];

/// Units of cost for each of [`PREPARE`].
const PREPARE_COSTS: [f64; 7] = [2.4e-2, 4.5e-7, 7.5e-8, 3.6e-5, 1.5e-7, 2.2e-6, 3.1e-6];
/// Units of cost for each of [`LIGHTS`].
const LIGHTS_COSTS: [f64; 6] = [6.0e-7, 9.0e-8, 1.0e-8, 2.5e-8, 1.05e-8, 1.5e-6];
/// Units of cost for each of [`PICTURE`].
const PICTURE_COSTS: [f64; 3] = [4.0e-8, 3.0e-9, 1.5e-7];

/// The countable work of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Preparation, named by [`PREPARE`].
    pub prepare: [f64; 7],
    /// Solution of all lights, named by [`LIGHTS`].
    pub lights: [f64; 6],
    /// Composition of one image with all lights on, named by [`PICTURE`].
    pub picture: [f64; 3],
}

/// Contents of the view at one sample a pixel.
struct ViewCounts {
    /// Pixels of each facet.
    pixels: Vec<f64>,
    /// Pixels that show one facet, as do their neighbours, and are not stretched on it.
    inside: f64,
    /// Such pixels that are stretched.
    stretched: f64,
    /// All other pixels.
    edges: f64,
    /// End of each pixel's ray, with its facet.
    points: Vec<(usize, Vec3)>,
}

impl Counts {
    /// Counts the work of a step.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup.
    pub fn of(setup: &Setup, step: HemicubeStep) -> Result<Counts, TransportError> {
        let Setup { scene, rig, view } = setup;
        let surfaces = Surfaces::shapes(scene)?;
        let in_view = ViewCounts::of(&surfaces, view)?;
        let pieces = surfaces.pieces.len() as f64;
        let elements = Layout::of_elements(&surfaces, step.elements).cells();
        let layout = Layout::of_gather_points(&surfaces, step.gather_points, &in_view.pixels);
        let (gather_points, hemicubes) = in_view.gather_points(&layout, step.reach);
        let cubes = [
            (elements as f64, step.resolution),
            (hemicubes, step.gather_resolution),
        ];
        let cubes = cubes.map(|(n, r)| (n, 3.0 * (r * r) as f64));
        let all = elements as f64 + hemicubes;
        let (inside, edges) = (
            in_view.inside * step.sampling.split.parts().pow(2) as f64
                + in_view.stretched * step.sampling.stretched_split.parts().pow(2) as f64,
            // An edge pixel shows two or three facets.
            in_view.edges * 2.2 * step.sampling.edge_split.parts().pow(2) as f64,
        );
        let fragments = inside + edges;
        // Without interpolation every fragment is evaluated.
        let evaluated = if step.tolerance > 0.0 { 0.0 } else { fragments };
        let emitters = emitters(&surfaces, rig) as f64;
        let lights = rig.lights.len() as f64;
        let is_panel = |light: &&Light| matches!(light, Light::Panel { .. });
        let panels = rig.lights.iter().filter(is_panel).count() as f64;
        let rays = step.lobe_rays as f64 * in_view.glossy(setup, &surfaces);
        let coefficients: f64 = cubes
            .iter()
            .map(|(n, pixels)| n * (elements as f64).min(0.5 * pixels))
            .sum();
        Ok(Counts {
            prepare: [
                1.0,
                all * pieces,
                cubes.iter().map(|(n, pixels)| n * pixels).sum(),
                (elements + gather_points) as f64,
                inside,
                edges,
                rays,
            ],
            lights: [
                4.0 * elements as f64 * emitters,
                fragments * emitters,
                fragments * emitters * (1.0 + pieces).log2(),
                evaluated * emitters * (1.0 + pieces).log2(),
                coefficients * lights,
                rays * panels,
            ],
            picture: [fragments, fragments * lights, rays],
        })
    }

    /// Cost in units of [`Transport::cost_scale`](crate::Transport::cost_scale).
    pub fn cost(&self, sources: usize) -> Cost {
        let sum = |counts: &[f64], units: &[f64]| -> f64 {
            counts.iter().zip(units).map(|(c, u)| c * u).sum()
        };
        // A source has its share of the lights.
        let [fragments, lit, rays] = self.picture;
        let alone = [fragments, lit / sources.max(1) as f64, rays];
        Cost {
            prepare: sum(&self.prepare, &PREPARE_COSTS),
            per_source: sum(&self.lights, &LIGHTS_COSTS) / sources.max(1) as f64,
            per_image: sum(&self.picture, &PICTURE_COSTS),
            per_lone: sum(&alone, &PICTURE_COSTS),
        }
    }
}

/// Number of convex emitting polygons and points of all lights.
fn emitters(surfaces: &Surfaces, rig: &Rig) -> usize {
    let of = |light: &Light| match light {
        Light::Panel { material, .. } => {
            let own = surfaces.facets.iter().filter(|f| f.material == *material);
            own.map(|f| f.pieces.len()).sum()
        }
        _ => 1,
    };
    rig.lights.iter().map(of).sum()
}

impl ViewCounts {
    /// Counts a view; a large one is counted at reduced size and scaled.
    fn of(surfaces: &Surfaces, view: &View) -> Result<ViewCounts, TransportError> {
        camera(view)?;
        let mut times = 1;
        while (view.width / times).max(1) * (view.height / times).max(1) > MOST_PIXELS {
            times += 1;
        }
        let small = View {
            width: (view.width / times).max(1),
            height: (view.height / times).max(1),
            ..view.clone()
        };
        let mut out = ViewCounts::at_once(surfaces, &small)?;
        // Edges scale with length, everything else with area.
        let times = times as f64;
        out.edges *= times;
        for area in [&mut out.inside, &mut out.stretched]
            .into_iter()
            .chain(&mut out.pixels)
        {
            *area *= times * times;
        }
        Ok(out)
    }

    fn at_once(surfaces: &Surfaces, view: &View) -> Result<ViewCounts, TransportError> {
        let camera = camera(view)?;
        let mut buffer = ItemBuffer::new(view.width, view.height);
        for piece in &surfaces.pieces {
            buffer.draw(&camera, &piece.vertices, piece.normal, piece.facet as u32);
        }
        let items = buffer.items();
        let at = |x: usize, y: usize| items[y * view.width + x];
        let mut out = ViewCounts {
            pixels: vec![0.0; surfaces.facets.len()],
            inside: 0.0,
            stretched: 0.0,
            edges: 0.0,
            points: Vec::new(),
        };
        for y in 0..view.height {
            for x in 0..view.width {
                let item = at(x, y);
                let (left, above) = (x.saturating_sub(1), y.saturating_sub(1));
                let right = (x + 1).min(view.width - 1);
                let below = (y + 1).min(view.height - 1);
                let around = [at(left, y), at(right, y), at(x, above), at(x, below)];
                let is_edge = around.iter().any(|other| *other != item);
                if is_edge {
                    out.edges += 1.0;
                }
                if item == NOTHING {
                    continue;
                }
                let facet = &surfaces.facets[item as usize];
                let ray = camera.ray(x as f64 + 0.5, y as f64 + 0.5);
                if !is_edge && is_stretched(facet, &camera, ray) {
                    out.stretched += 1.0;
                } else if !is_edge {
                    out.inside += 1.0;
                }
                out.pixels[item as usize] += 1.0;
                let depth = -facet.height(camera.origin) / facet.normal.dot(ray);
                if depth.is_finite() {
                    out.points
                        .push((item as usize, camera.origin + ray * depth));
                }
            }
        }
        Ok(out)
    }

    /// Pixels that show glossy surfaces.
    fn glossy(&self, setup: &Setup, surfaces: &Surfaces) -> f64 {
        let facets = surfaces.facets.iter().zip(&self.pixels);
        let materials = &setup.scene.materials;
        let glossy = facets.filter(|(facet, _)| {
            let material = materials.get(facet.material);
            material.is_some_and(|material| material.gloss.is_some())
        });
        glossy.map(|(_, pixels)| pixels).sum()
    }

    /// Number of gather points of a layout that the image needs, and approximately how many of
    /// them have their own hemicube at a `reach` ([`HemicubeStep::reach`]): those near the rim,
    /// where joints are.
    fn gather_points(&self, layout: &Layout, reach: f64) -> (usize, f64) {
        let mut wanted = vec![false; layout.cells()];
        for (facet, point) in &self.points {
            for (cell, weight) in layout.grid(*facet).iter().flat_map(|g| g.stencil(*point)) {
                wanted[cell] |= weight > 0.0;
            }
        }
        let (mut count, mut hemicubes) = (0, 0.0);
        for grid in (0..self.pixels.len()).filter_map(|facet| layout.grid(facet)) {
            let [columns, rows] = grid.counts;
            for [i, j] in grid.positions().filter(|at| wanted[grid.at(*at)]) {
                let rim = i.min(j).min(columns - 1 - i).min(rows - 1 - j);
                let far = reach * rim as f64 / CHANGE;
                count += 1;
                hemicubes += 0.25_f64.powi(DENSITIES.iter().filter(|d| far >= **d).count() as i32);
            }
        }
        (count, hemicubes)
    }
}

/// Pixels of the largest image that is counted at full size.
const MOST_PIXELS: usize = 1 << 21;

/// Rate of change of reflected light near a joint, times the distance from the joint.
const CHANGE: f64 = 0.3;

/// Distances from a joint, in reaches, beyond which one gather point in 4, 16 and 64 has a
/// hemicube.
const DENSITIES: [f64; 3] = [1.0, 2.0, 4.0];
