//! Solves lights at unit strength in a band: direct light at the fragments, reflected light at the
//! gather points.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, gather point or fragment, made together"
)]

use crate::TransportError;
use crate::contract::check_memory;
use crate::direct::irradiance;
use crate::direct::projector::pixel;
use crate::gather::airlight::Airlight;
use crate::gather::ray_scene::{RayScene, SurfacePoint};
use crate::hemicube::bounced::{BouncedLight, own_values};
use crate::hemicube::gloss::{EyeScene, Gloss};
use crate::hemicube::indirect::gather_points::GatherScene;
use crate::hemicube::{HemicubeRadiosity, Solution};
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

impl HemicubeRadiosity {
    /// Solves the `wanted` lights that are not solved yet, in batches that fit into a quarter of
    /// the memory.
    pub fn solve_lights(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError> {
        let missing: Vec<usize> = wanted
            .iter()
            .copied()
            .filter(|&l| self.solutions[l].is_none())
            .collect();
        // Five blocks of three channels over the elements, two over the sources, three over the gather
        // points, and values of the glossy fragments.
        let gather_points = self.gather_points.mesh.elements.len();
        let sources = self.scene.sources.mesh.elements.len();
        let glossy = self.gloss.as_ref().map_or(0, Gloss::count);
        let each =
            12 * (5 * self.scene.mesh.elements.len() + 2 * sources + 3 * gather_points + glossy);
        let together = (work.memory / 4 / each.max(1)).max(1);
        let begun = (work.memory / 8 / self.bytes_of_begun().max(1)).max(1);
        let done = AtomicUsize::new(0);
        // Direct light of bounced lights, and their light in haze, is computed elsewhere.
        let (whole, bounced): (Vec<usize>, Vec<usize>) = missing
            .iter()
            .partition(|&&l| !self.scene.rig.lights[l].is_bounced());
        for group in whole.chunks(together).chain(bounced.chunks(together)) {
            let bounced = self.scene.bounced(group, work)?;
            let lit: Vec<(&usize, &Arc<BouncedLight>)> = group.iter().zip(&bounced).collect();
            let sharing: Vec<&[(&usize, &Arc<BouncedLight>)]> = lit
                .chunk_by(|(a, _), (b, _)| self.scene.shares_projection(**a, **b))
                .collect();
            let mut direct: Vec<Vec<f32>> = Vec::with_capacity(group.len());
            for begun in sharing.chunks(begun) {
                let parts = begun.par_iter().map(|lights| {
                    let (planes, bounced): (Vec<usize>, Vec<_>) =
                        lights.iter().map(|(l, b)| (**l, *b)).unzip();
                    let lit = self.lit(&planes, bounced[0].level, work)?;
                    let so_far = done.fetch_add(lights.len(), Ordering::Relaxed) + lights.len();
                    work.progress.report("direct light", so_far, missing.len());
                    Ok(lit)
                });
                let parts: Vec<Vec<Vec<f32>>> = parts.collect::<Result<_, TransportError>>()?;
                direct.extend(parts.into_iter().flatten());
            }
            let reflected = self.reflected(&bounced, work)?;
            work.check()?;
            let highlights = self.highlights(group, &mut direct, work)?;
            let has_airlight = !self.scene.rig.lights[group[0]].is_bounced();
            let scattered = match has_airlight {
                true => self.airlight(group, work)?,
                false => Vec::new(),
            };
            let parts = direct.into_iter().zip(reflected).zip(highlights);
            let solved = group.iter().zip(bounced).zip(parts).enumerate();
            for (at, ((&l, bounced), ((direct, indirect), highlights))) in solved {
                let own = scattered.iter().skip(at).step_by(group.len());
                let airlight: Vec<f32> = own.copied().collect();
                let held = [&airlight, &highlights];
                self.held += held
                    .map(|of| size_of_val(of.as_slice()))
                    .iter()
                    .sum::<usize>();
                self.solutions[l] = Some(Solution {
                    direct,
                    indirect,
                    airlight,
                    highlights,
                    bounced: self.scene.kept(l, bounced),
                });
            }
        }
        Ok(())
    }

    /// Radiance of lights that haze scatters to the eye, pixel by pixel; empty without haze.
    fn airlight(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<f32>, TransportError> {
        let Some((haze, bvh)) = self.scene.surfaces.haze.zip(self.scene.bvh.as_ref()) else {
            return Ok(Vec::new());
        };
        let bytes = 8 * lights.len() * self.width * self.height;
        check_memory("light in the haze", bytes, work.memory)?;
        let airlight = Airlight {
            scene: RayScene::new(&self.scene.surfaces, bvh),
            haze,
            nodes: self.scene.step.nodes,
        };
        let emitters = self.scene.emitters(lights);
        // One end for each facet of a pixel.
        let ends = |pixel: usize| {
            let mut ends: Vec<(usize, f32, Vec3)> = Vec::new();
            for f in self.fragments.pixels.get(pixel) {
                let weighted = f.point * f64::from(f.weight);
                match ends.iter_mut().find(|(facet, ..)| *facet == f.facet) {
                    Some((_, weight, sum)) => {
                        *weight += f.weight;
                        *sum += weighted;
                    }
                    None => ends.push((f.facet, f.weight, weighted)),
                }
            }
            let mean = |(facet, weight, sum)| {
                let (facet, point) = (facet as u32, sum / f64::from(weight));
                (weight, SurfacePoint { facet, point })
            };
            ends.into_iter().map(mean)
        };
        let view = (&self.fragments.camera, [self.width, self.height]);
        Ok(airlight.picture(&emitters, view, ends, work)?)
    }

    /// Light of the lights themselves in gloss; see [`Gloss::highlights`]. Empty without it.
    fn highlights(
        &self,
        lights: &[usize],
        direct: &mut [Vec<f32>],
        work: Work<'_>,
    ) -> Result<Vec<Vec<f32>>, Cancelled> {
        let Some((gloss, bvh)) = self.gloss.as_ref().zip(self.scene.bvh.as_ref()) else {
            return Ok(vec![Vec::new(); lights.len()]);
        };
        if self.scene.rig.lights[lights[0]].is_bounced() {
            return Ok(vec![vec![0.0; gloss.count()]; lights.len()]);
        }
        let seen = EyeScene {
            scene: RayScene::new(&self.scene.surfaces, bvh),
            fragments: &self.fragments,
        };
        gloss.highlights(seen, &self.scene.emitters(lights), direct, work)
    }

    /// Bytes of a light during the computation of its direct light. A waiting thread starts another
    /// light, so several may be in progress.
    fn bytes_of_begun(&self) -> usize {
        let places = self.rounding.as_ref().map_or(0, |r| r.sorted.points.len());
        let points = self.fragment_receivers.points.len()
            + self.scene.element_receivers.points.len()
            + places;
        2 * size_of::<f32>() * points
    }

    /// Direct light at the fragments of one light of this level, or of the planes of one projected
    /// image.
    fn lit(
        &self,
        lights: &[usize],
        level: f64,
        work: Work<'_>,
    ) -> Result<Vec<Vec<f32>>, TransportError> {
        let scene = &self.scene;
        if scene.rig.lights[lights[0]].is_bounced() {
            // Direct light of this one is computed elsewhere.
            return Ok(vec![vec![0.0; self.fragments.all().len()]; lights.len()]);
        }
        let precision = scene.precision(scene.step.tolerance * level);
        let (setting, light) = (scene.setting(), &scene.lights[lights[0]]);
        let receivers = &self.fragment_receivers;
        let outlines = Some(&self.fragments);
        let mut seen = irradiance(setting, light, receivers, outlines, precision, work)?;
        if let Some(rounding) = &self.rounding {
            let places = &rounding.sorted;
            let there = irradiance(setting, light, places, None, precision, work)?;
            rounding.mix(&mut seen, &there);
        }
        Ok(lights
            .iter()
            .map(|l| self.on_fragments(*l, &seen))
            .collect())
    }

    /// A light at the fragments, given its light without an image.
    fn on_fragments(&self, light: usize, even: &[f32]) -> Vec<f32> {
        let Some(projector) = &self.scene.projectors[light] else {
            return even.to_vec();
        };
        let seen = self.fragments.all().iter().map(|f| {
            let normal = self.scene.surfaces.facets[f.facet].normal;
            let weight = f64::from(f.weight);
            (
                f.point,
                pixel(&self.fragments.camera, f.point, normal, weight),
            )
        });
        projector.project(even, seen)
    }

    /// Reflected irradiance at every gather point for each light.
    fn reflected(
        &self,
        lights: &[Arc<BouncedLight>],
        work: Work<'_>,
    ) -> Result<Vec<Vec<f32>>, Cancelled> {
        let scene = &self.scene;
        let (sources, width) = (scene.sources.reflectance.len(), 3 * lights.len());
        let mut radiosity = Vec::with_capacity(sources * width);
        for source in 0..sources {
            for light in lights {
                radiosity.extend_from_slice(&light.radiosity[3 * source..][..3]);
            }
        }
        let gather_scene = GatherScene {
            setting: scene.setting(),
            vertices: &scene.vertices,
            to: &scene.sources.mesh,
        };
        let gathered = self
            .gather_points
            .gather(gather_scene, &radiosity, width, work)?;
        let of = |light| own_values(&gathered, (light, width));
        Ok((0..lights.len()).map(of).collect())
    }
}
