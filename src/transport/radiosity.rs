//! The project's own G: radiosity with exact direct light.
//!
//! Light is split into what comes straight from a luminaire, which is exact at every fragment of
//! the picture, and what has been reflected, which is the radiosity of elements gathered by
//! hemicubes. Emission never passes a hemicube. Every number is kept per light at unit strength:
//! settings, colours and filters only scale, so G is linear by construction, and whatever settings
//! have in common is computed once. Invariant: mesh, order of summation and length of iterations
//! follow from scene, rig, view and quality alone.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, node, fragment or source, made together"
)]

use crate::geometry::Vec3;
use crate::picture::Image;
use crate::scene::{Light, Rig, Scene, View};
use crate::transport::burial::beacons;
use crate::transport::cluster::{Receiver, Receivers};
use crate::transport::direct::{Luminaire, Setting, irradiance, luminaires};
use crate::transport::eye::{Fragments, fragments};
use crate::transport::form::{Rows, interreflect};
use crate::transport::hemicube::{Hemicube, Row, Table};
use crate::transport::mesh::{Layout, Mesh, NONE};
use crate::transport::step::{STEPS, Step};
use crate::transport::strength::{check_rig, colour};
use crate::transport::surface::Surfaces;
use crate::transport::visibility::Hierarchy;
use crate::transport::{Cost, Prepared, Quality, Transport, TransportError};
use crate::work::{Cancelled, Work};
use rayon::ThreadPool;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Rows of form factors that one task computes.
const ROWS: usize = 32;

/// Radiosity with hemicubes, five steps of quality.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiosity;

impl Transport for Radiosity {
    fn name(&self) -> &str {
        "radiosity"
    }

    fn finest(&self) -> Quality {
        Quality(STEPS.len() as u8)
    }

    fn prepare(
        &self,
        scene: &Scene,
        rig: &Rig,
        view: &View,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        let step = Step::of(quality)?;
        let operator = pool(work)?.install(|| Operator::new(scene, rig, view, step, work))?;
        Ok(Box::new(operator))
    }

    /// From counts of what will be drawn, with constants measured on two ordinary cores.
    fn cost(&self, scene: &Scene, rig: &Rig, view: &View, quality: Quality) -> Cost {
        let Ok(step) = Step::of(quality) else {
            return Cost::default();
        };
        let polygons = scene.polygons.len() as f64;
        let cubes = |count: usize, resolution: usize| {
            let pixels = 3.0 * (resolution * resolution) as f64;
            (count as f64 + polygons) * (polygons * 0.12e-6 + pixels * 4e-9)
        };
        let nodes = if step.nodes > 0 {
            cubes(step.nodes, step.node_resolution)
        } else {
            0.0
        };
        let pixels = (view.width * view.height) as f64 * (step.split * step.split) as f64;
        let areas = scene.polygons.iter().filter(|p| {
            rig.lights
                .iter()
                .any(|l| matches!(l, Light::Panel { material, .. } if *material == p.material))
        });
        let sources = rig.sources.len().max(1) as f64;
        let emitters = (areas.count() + rig.lights.len()) as f64;
        Cost {
            prepare: cubes(step.elements, step.resolution) + nodes + pixels * 0.8e-6,
            per_source: emitters / sources * (pixels * 0.07e-6 + polygons * 5e-6),
            per_image: pixels * 10e-9 * rig.lights.len() as f64,
        }
    }
}

pub(super) fn pool(work: Work<'_>) -> Result<ThreadPool, TransportError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(work.threads.max(1))
        .build()
        .map_err(|e| TransportError::Scene(format!("no threads: {e}")))
}

/// A light at unit strength.
struct Solution {
    /// Irradiance at each fragment, the same in all channels.
    direct: Vec<f32>,
    /// Reflected irradiance at each node, three channels interleaved.
    indirect: Vec<f32>,
}

/// Direct light of one light at the fragments, and its means on the elements.
type SeenAndMeans = (Vec<f32>, Vec<f32>);

/// Where the reflected light is interpolated between.
struct Nodes {
    mesh: Mesh,
    /// Form factors from nodes to elements.
    rows: Rows,
}

/// G for one scene, rig, view and step.
struct Operator {
    rig: Rig,
    width: usize,
    height: usize,
    surfaces: Surfaces,
    hierarchy: Hierarchy,
    lights: Vec<Luminaire>,
    mesh: Mesh,
    rows: Rows,
    /// A second gather; without it the elements are the nodes.
    nodes: Option<Nodes>,
    fragments: Fragments,
    /// For each fragment the nodes around it and their weights.
    stencils: Vec<[(u32, f32); 4]>,
    /// For each fragment the element that it is on, or [`NONE`].
    shown: Vec<u32>,
    /// How exactly direct light is interpolated, as a share of its level in the picture.
    tolerance: f64,
    fragment_receivers: Receivers,
    element_receivers: Receivers,
    solutions: Vec<Option<Solution>>,
}

impl Operator {
    fn new(
        scene: &Scene,
        rig: &Rig,
        view: &View,
        step: Step,
        work: Work<'_>,
    ) -> Result<Operator, TransportError> {
        check_rig(scene, rig)?;
        let surfaces = Surfaces::new(scene)?;
        let hierarchy = Hierarchy::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let lights = luminaires(&surfaces, rig)?;
        let fragments = fragments(&surfaces, view, step.sampling(), work)?;
        let each = size_of::<crate::transport::eye::Fragment>() + 96 + 4 * rig.lights.len();
        within(
            "direct light at every fragment",
            fragments.all.len() * each,
            work,
        )?;

        let layout = Layout::of_elements(&surfaces, step.elements);
        within("the mesh", layout.cells() * 512, work)?;
        let beacons = beacons(setting, &lights, view.from);
        let every = vec![true; layout.cells()];
        let mesh = layout.mesh(setting, &beacons, &every);
        let rows = form_factors(
            &surfaces,
            &mesh,
            &mesh,
            step.resolution,
            "form factors",
            work,
        )?;
        let nodes = match step.nodes {
            0 => None,
            count => Some(finer(
                setting,
                &beacons,
                &mesh,
                &fragments,
                (count, step.node_resolution),
                work,
            )?),
        };
        let seen = nodes.as_ref().map_or(&mesh, |n| &n.mesh);
        let stencils = fragments
            .all
            .par_iter()
            .map(|f| seen.stencil(f.facet, f.point))
            .collect();
        let shown = fragments.all.par_iter().map(|f| {
            let grid = mesh.grids[f.facet].as_ref();
            grid.map_or(NONE, |g| mesh.seen[g.cell(f.point)])
        });
        let shown = shown.collect();
        let sampled: Vec<Receiver> = mesh
            .elements
            .iter()
            .flat_map(|e| {
                e.samples.iter().map(|&point| Receiver {
                    point,
                    facet: e.facet,
                })
            })
            .collect();
        Ok(Operator {
            rig: rig.clone(),
            width: view.width,
            height: view.height,
            fragment_receivers: Receivers::of_fragments(&surfaces, &fragments),
            element_receivers: Receivers::new(&surfaces, &sampled),
            solutions: rig.lights.iter().map(|_| None).collect(),
            surfaces,
            hierarchy,
            lights,
            mesh,
            rows,
            nodes,
            fragments,
            stencils,
            shown,
            tolerance: step.tolerance,
        })
    }

    /// Strength of each light in each channel under a setting.
    fn strengths(&self, setting: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.rig.lights.len()];
        for (source, s) in self.rig.sources.iter().zip(setting) {
            for emitter in &source.emitters {
                let colour = colour(&self.rig.lights[emitter.light]);
                for c in 0..3 {
                    out[emitter.light][c] += s * emitter.filter.0[c] * colour[c];
                }
            }
        }
        out
    }

    /// Solves those of the `wanted` lights that are not solved yet.
    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), Cancelled> {
        let missing: Vec<usize> = wanted
            .iter()
            .copied()
            .filter(|&l| self.solutions[l].is_none())
            .collect();
        if missing.is_empty() {
            return Ok(());
        }
        let setting = Setting {
            surfaces: &self.surfaces,
            hierarchy: &self.hierarchy,
        };
        let done = AtomicUsize::new(0);
        let lit: Result<Vec<SeenAndMeans>, Cancelled> = missing
            .par_iter()
            .map(|&l| {
                let light = &self.lights[l];
                let samples = irradiance(setting, light, &self.element_receivers, None, 0.0, work)?;
                let means = self.means(&samples);
                let allowed = self.tolerance * self.level(&means);
                let receivers = &self.fragment_receivers;
                let outlines = Some(&self.fragments);
                let seen = irradiance(setting, light, receivers, outlines, allowed, work)?;
                let so_far = done.fetch_add(1, Ordering::Relaxed) + 1;
                work.progress.report("direct light", so_far, missing.len());
                Ok((seen, means))
            })
            .collect();
        let (direct, on_elements): (Vec<_>, Vec<_>) = lit?.into_iter().unzip();
        let indirect = self.reflected(&on_elements);
        work.check()?;
        for ((l, direct), indirect) in missing.into_iter().zip(direct).zip(indirect) {
            self.solutions[l] = Some(Solution { direct, indirect });
        }
        Ok(())
    }

    /// Root mean square, over the picture, of reflectance times irradiance, estimated from the
    /// elements that the picture shows.
    fn level(&self, on_elements: &[f32]) -> f64 {
        let (mut power, mut weight) = (0.0, 0.0);
        for (f, shown) in self.fragments.all.iter().zip(&self.shown) {
            let share = f64::from(f.weight);
            weight += share;
            if let Some(direct) = on_elements.get(*shown as usize) {
                let reflectance = self.surfaces.facets[f.facet].reflectance;
                let most = reflectance.iter().copied().fold(0.0, f64::max);
                power += share * (most * f64::from(*direct)).powi(2);
            }
        }
        (power / f64::max(weight, 1.0)).sqrt()
    }

    /// Mean over each element's sub-samples.
    fn means(&self, samples: &[f32]) -> Vec<f32> {
        let mut at = 0;
        let elements = self.mesh.elements.iter();
        elements
            .map(|e| {
                let own = &samples[at..at + e.samples.len()];
                at += e.samples.len();
                own.iter().sum::<f32>() / own.len().max(1) as f32
            })
            .collect()
    }

    /// Reflected irradiance at every node for each light, from its direct light on the elements.
    fn reflected(&self, on_elements: &[Vec<f32>]) -> Vec<Vec<f32>> {
        let width = on_elements.len() * 3;
        let mut reflectance = Vec::with_capacity(self.mesh.elements.len() * width);
        let mut first = Vec::with_capacity(reflectance.capacity());
        let mut bound = 0.0_f64;
        for (i, e) in self.mesh.elements.iter().enumerate() {
            let own = self.surfaces.facets[e.facet].reflectance;
            bound = own.iter().fold(bound, |b, r| b.max(*r));
            for direct in on_elements {
                for r in own {
                    reflectance.push(r as f32);
                    first.push(r as f32 * direct[i]);
                }
            }
        }
        let radiosity = interreflect(&self.rows, &first, &reflectance, width, bound);
        let rows = self.nodes.as_ref().map_or(&self.rows, |n| &n.rows);
        let gathered = rows.times(&radiosity, width);
        (0..on_elements.len())
            .map(|l| {
                gathered
                    .chunks_exact(width)
                    .flat_map(|row| row[3 * l..3 * l + 3].to_vec())
                    .collect()
            })
            .collect()
    }

    /// The picture of lights of given strengths, all of which are solved.
    fn compose(&self, strengths: &[[f64; 3]]) -> Image {
        let lit: Vec<(&Solution, [f64; 3])> = self
            .solutions
            .iter()
            .zip(strengths)
            .filter(|(_, s)| s.iter().any(|x| *x != 0.0))
            .filter_map(|(solution, s)| solution.as_ref().map(|x| (x, *s)))
            .collect();
        let nodes = self
            .nodes
            .as_ref()
            .map_or(&self.mesh, |n| &n.mesh)
            .elements
            .len();
        let mut indirect = vec![[0.0_f64; 3]; nodes];
        indirect
            .par_iter_mut()
            .with_min_len(1024)
            .enumerate()
            .for_each(|(i, sum)| {
                for (solution, s) in &lit {
                    for c in 0..3 {
                        sum[c] += s[c] * f64::from(solution.indirect[3 * i + c]);
                    }
                }
            });
        let glow = self.emission(strengths);
        let mut image = Image::new(self.width, self.height);
        let rows = image.data_mut().par_chunks_mut(3 * self.width).enumerate();
        rows.for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let at = y * self.width + x;
                let mut sum = [0.0; 3];
                for f in self.fragments.offsets[at]..self.fragments.offsets[at + 1] {
                    self.shade(f, &lit, &indirect, &glow, &mut sum);
                }
                for (p, s) in pixel.iter_mut().zip(sum) {
                    *p = s as f32;
                }
            }
        });
        image
    }

    /// Adds a fragment's share of its pixel.
    fn shade(
        &self,
        f: usize,
        lit: &[(&Solution, [f64; 3])],
        indirect: &[[f64; 3]],
        glow: &[[f64; 3]],
        sum: &mut [f64; 3],
    ) {
        let fragment = &self.fragments.all[f];
        let facet = &self.surfaces.facets[fragment.facet];
        let mut light = [0.0; 3];
        for (solution, s) in lit {
            let direct = f64::from(solution.direct[f]);
            for c in 0..3 {
                light[c] += s[c] * direct;
            }
        }
        for (node, weight) in self.stencils[f] {
            if weight != 0.0 {
                for c in 0..3 {
                    light[c] += f64::from(weight) * indirect[node as usize][c];
                }
            }
        }
        let weight = f64::from(fragment.weight);
        for c in 0..3 {
            let radiance = facet.reflectance[c] / PI * light[c] + glow[facet.material][c];
            sum[c] += weight * radiance;
        }
    }

    /// Emitted radiance of each material.
    fn emission(&self, strengths: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let count = self
            .surfaces
            .facets
            .iter()
            .map(|f| f.material + 1)
            .max()
            .unwrap_or(0);
        let mut out = vec![[0.0; 3]; count];
        for (light, s) in self.rig.lights.iter().zip(strengths) {
            if let Light::Panel { material, .. } = light
                && let Some(sum) = out.get_mut(*material)
            {
                for c in 0..3 {
                    sum[c] += s[c];
                }
            }
        }
        out
    }
}

impl Prepared for Operator {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        let expected = self.rig.sources.len();
        if settings
            .iter()
            .any(|s| s.len() != expected || !s.iter().all(|x| x.is_finite()))
        {
            return Err(TransportError::Setting { expected });
        }
        let strengths: Vec<Vec<[f64; 3]>> = settings.iter().map(|s| self.strengths(s)).collect();
        let wanted: Vec<usize> = (0..self.lights.len())
            .filter(|&l| strengths.iter().any(|s| s[l].iter().any(|x| *x != 0.0)))
            .collect();
        let pixels = self.width * self.height;
        within("the pictures", settings.len() * pixels * 12, work)?;
        pool(work)?.install(|| {
            self.solve(&wanted, work)?;
            let mut images = Vec::with_capacity(settings.len());
            for (done, s) in strengths.iter().enumerate() {
                work.check()?;
                work.progress.report("pictures", done, settings.len());
                images.push(self.compose(s));
            }
            work.progress
                .report("pictures", settings.len(), settings.len());
            Ok(images)
        })
    }
}

fn within(what: &'static str, needed: usize, work: Work<'_>) -> Result<(), TransportError> {
    if needed > work.memory {
        return Err(TransportError::Memory {
            what,
            needed,
            budget: work.memory,
        });
    }
    Ok(())
}

/// The finer nodes that the fragments need, and what they see of the elements.
fn finer(
    setting: Setting<'_>,
    beacons: &[Vec3],
    mesh: &Mesh,
    fragments: &Fragments,
    (count, resolution): (usize, usize),
    work: Work<'_>,
) -> Result<Nodes, TransportError> {
    let mut pixels = vec![0.0; setting.surfaces.facets.len()];
    for f in &fragments.all {
        pixels[f.facet] += f64::from(f.weight);
    }
    let layout = Layout::of_nodes(setting.surfaces, count, &pixels);
    within("the nodes", layout.cells() * 96, work)?;
    let mut wanted = vec![false; layout.cells()];
    for f in &fragments.all {
        for (cell, weight) in layout.grid(f.facet).iter().flat_map(|g| g.stencil(f.point)) {
            wanted[cell] |= weight > 0.0;
        }
    }
    let nodes = layout.mesh(setting, beacons, &wanted);
    let rows = form_factors(
        setting.surfaces,
        &nodes,
        mesh,
        resolution,
        "final gather",
        work,
    )?;
    Ok(Nodes { mesh: nodes, rows })
}

/// Form factors from each element of `from` to all elements of `to`.
fn form_factors(
    surfaces: &Surfaces,
    from: &Mesh,
    to: &Mesh,
    resolution: usize,
    task: &'static str,
    work: Work<'_>,
) -> Result<Rows, TransportError> {
    let table = Table::new(resolution);
    let total = from.elements.len();
    let most = to.elements.len().min(3 * resolution * resolution);
    let done = AtomicUsize::new(0);
    let bytes = AtomicUsize::new(0);
    let count = Ordering::Relaxed;
    let rows: Result<Vec<Vec<Row>>, TransportError> = from
        .elements
        .par_chunks(ROWS)
        .enumerate()
        .map(|(chunk, elements)| {
            work.check()?;
            let mut cube = Hemicube::new(surfaces, to, &table);
            let rows: Vec<Row> = elements
                .iter()
                .enumerate()
                .map(|(i, e)| cube.row(e.facet, e.centre, (chunk * ROWS + i) as u64))
                .collect();
            let entries: usize = rows.iter().map(|r| r.len().min(most)).sum();
            // Twice: as rows and, for a moment, in the compressed store.
            within(
                "form factors",
                bytes.fetch_add(16 * entries, count) + 16 * entries,
                work,
            )?;
            let so_far = done.fetch_add(elements.len(), count) + elements.len();
            work.progress.report(task, so_far, total);
            Ok(rows)
        })
        .collect();
    let rows: Vec<Row> = rows?.into_iter().flatten().collect();
    Ok(Rows::new(&rows))
}
