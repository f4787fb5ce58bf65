//! Solves lights at unit strength: direct light at the fragments, reflected light at the gather
//! points.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, gather point or fragment, made together"
)]

use crate::TransportError;
use crate::contract::check_memory;
use crate::direct::projector::pixel;
use crate::direct::{IrradiancePrecision, irradiance};
use crate::gather::airlight::Airlight;
use crate::gather::emitter::Emitter;
use crate::gather::ray_scene::{RayScene, Receiver, SurfacePoint};
use crate::hemicube::gloss::{EyeScene, Gloss};
use crate::hemicube::indirect::gather_points::GatherScene;
use crate::hemicube::mesh::element::Element;
use crate::hemicube::{HemicubeRadiosity, Solution};
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Direct light of one light at the fragments, and its mean on each element and source.
type DirectLight = (Vec<f32>, [Vec<f32>; 2]);

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
            let sharing: Vec<&[usize]> = group
                .chunk_by(|a, b| self.shares_projection(*a, *b))
                .collect();
            let mut lit: Vec<DirectLight> = Vec::with_capacity(group.len());
            for begun in sharing.chunks(begun) {
                let parts: Result<Vec<Vec<DirectLight>>, TransportError> = begun
                    .par_iter()
                    .map(|lights| {
                        let lit = self.lit(lights, work)?;
                        let so_far = done.fetch_add(lights.len(), Ordering::Relaxed) + lights.len();
                        work.progress.report("direct light", so_far, missing.len());
                        Ok(lit)
                    })
                    .collect();
                lit.extend(parts?.into_iter().flatten());
            }
            let (mut direct, on_elements): (Vec<_>, Vec<_>) = lit.into_iter().unzip();
            let reflected = self.reflected(group, &on_elements, work)?;
            work.check()?;
            let highlights = self.highlights(group, &mut direct, work)?;
            let has_airlight = !self.scene.rig.lights[group[0]].is_bounced();
            let scattered = match has_airlight {
                true => self.airlight(group, work)?,
                false => Vec::new(),
            };
            let parts = direct.into_iter().zip(reflected).zip(highlights);
            let solved = group.iter().zip(parts).enumerate();
            for (at, (&l, ((direct, [indirect, elements]), highlights))) in solved {
                let own = scattered.iter().skip(at).step_by(group.len());
                let airlight: Vec<f32> = own.copied().collect();
                let held = [&airlight, &highlights, &elements];
                self.held += held
                    .map(|of| size_of_val(of.as_slice()))
                    .iter()
                    .sum::<usize>();
                self.solutions[l] = Some(Solution {
                    direct,
                    indirect,
                    airlight,
                    highlights,
                    elements,
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
        let emitters = self.emitters(lights);
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

    fn emitters(&self, lights: &[usize]) -> Vec<Emitter<'_>> {
        let emitter = |&light: &usize| {
            let projector = self.scene.projectors[light].as_ref();
            Emitter::new(&self.scene.surfaces, &self.scene.lights[light], projector)
        };
        lights.iter().map(emitter).collect()
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
        gloss.highlights(seen, &self.emitters(lights), direct, work)
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

    /// True when both are planes of one projected image, which share everything except the texels.
    fn shares_projection(&self, a: usize, b: usize) -> bool {
        match (&self.scene.projectors[a], &self.scene.projectors[b]) {
            (Some(a), Some(b)) => a.shares_projection(b),
            _ => false,
        }
    }

    /// Direct light of one light, or of the planes of one projected image.
    fn lit(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<DirectLight>, TransportError> {
        let light = &self.scene.lights[lights[0]];
        // All planes of an image, wanted or not, so that the precision of one does not depend on
        // the others.
        let is_plane = |l: &usize| *l == lights[0] || self.shares_projection(lights[0], *l);
        let planes: Vec<usize> = (0..self.scene.lights.len()).filter(is_plane).collect();
        let means = self.on_elements(light, &planes, work)?;
        let level = means.iter().map(|m| self.level(&m[0])).fold(0.0, f64::max);
        let precision = self.precision(self.scene.step.tolerance * level);
        if self.scene.rig.lights[lights[0]].is_bounced() {
            // Direct light of this one is computed elsewhere.
            let none = || vec![0.0; self.fragments.all().len()];
            let wanted = planes.iter().zip(means).filter(|(l, _)| lights.contains(l));
            return Ok(wanted.map(|(_, means)| (none(), means)).collect());
        }
        let receivers = &self.fragment_receivers;
        let outlines = Some(&self.fragments);
        let mut seen = irradiance(
            self.scene.setting(),
            light,
            receivers,
            outlines,
            precision,
            work,
        )?;
        if let Some(rounding) = &self.rounding {
            let places = &rounding.sorted;
            let there = irradiance(self.scene.setting(), light, places, None, precision, work)?;
            rounding.mix(&mut seen, &there);
        }
        let wanted = planes.iter().zip(means).filter(|(l, _)| lights.contains(l));
        Ok(wanted
            .map(|(l, m)| (self.on_fragments(*l, &seen), m))
            .collect())
    }

    /// Precision for an allowed error of interpolated direct light.
    pub fn precision(&self, allowed: f64) -> IrradiancePrecision {
        IrradiancePrecision {
            allowed,
            near: self.scene.step.near,
        }
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

    /// Root mean square, over the image, of reflectance times irradiance, estimated from the
    /// visible elements.
    fn level(&self, on_elements: &[f32]) -> f64 {
        let elements = self
            .scene
            .mesh
            .elements
            .iter()
            .zip(&self.scene.visible_shares);
        let power = elements.zip(on_elements).map(|((e, share), direct)| {
            let reflectance = self.scene.surfaces.facets[e.facet].highest_reflectance();
            share * (reflectance * f64::from(*direct)).powi(2)
        });
        power.sum::<f64>().sqrt()
    }

    /// Reflected irradiance at every gather point for each light, from its direct light on the
    /// elements and sources, and the radiance of the sources that gloss shows.
    fn reflected(
        &self,
        lights: &[usize],
        on_elements: &[[Vec<f32>; 2]],
        work: Work<'_>,
    ) -> Result<Vec<[Vec<f32>; 2]>, Cancelled> {
        let width = on_elements.len() * 3;
        let gloss = self.gloss.as_ref();
        let emitters = gloss.map_or_else(Vec::new, |_| self.emitters(lights));
        let share = |l: usize, element: &Element| {
            let emitter = emitters.get(l);
            emitter.map_or(1.0, |emitter| self.bounced(emitter, element))
        };
        let mut first = Vec::with_capacity(self.scene.reflectance.len() * width);
        for (i, (own, element)) in self
            .scene
            .reflectance
            .iter()
            .zip(&self.scene.mesh.elements)
            .enumerate()
        {
            for (l, [direct, _]) in on_elements.iter().enumerate() {
                let lit = direct[i] * share(l, element);
                first.extend(own.map(|r| r * lit));
            }
        }
        let (rows, reflectance) = (&self.scene.rows, &self.scene.reflectance);
        let mut bounced =
            self.scene
                .bounces
                .interreflect(rows, &first, reflectance, width, work)?;
        // From radiosity to reflected irradiance.
        let lines = bounced.chunks_mut(width).zip(first.chunks(width));
        for ((line, first), own) in lines.zip(reflectance) {
            for ((b, first), r) in line.iter_mut().zip(first).zip(own.iter().cycle()) {
                *b = if *r > 0.0 { (*b - first) / r } else { 0.0 };
            }
        }
        drop(first);
        let sources = &self.scene.sources;
        let mut radiosity = Vec::with_capacity(sources.reflectance.len() * width);
        for (i, (own, source)) in sources
            .reflectance
            .iter()
            .zip(&sources.mesh.elements)
            .enumerate()
        {
            for (l, [_, direct]) in on_elements.iter().enumerate() {
                let lit = direct[i] * share(l, source);
                let at = |c: usize| sources.interpolated(i, |e| bounced[e * width + 3 * l + c]);
                radiosity.extend([0, 1, 2].map(|c| own[c] * (lit + at(c))));
            }
        }
        drop(bounced);
        let gather_scene = GatherScene {
            setting: self.scene.setting(),
            vertices: &self.scene.vertices,
            to: &self.scene.sources.mesh,
        };
        let gathered = self
            .gather_points
            .gather(gather_scene, &radiosity, width, work)?;
        let of = |values: &[f32], l: usize| -> Vec<f32> {
            let rows = values.chunks_exact(width);
            rows.flat_map(|row| row[3 * l..3 * l + 3].iter().copied())
                .collect()
        };
        let shown = |l: usize| -> Vec<f32> {
            if self.gloss.is_none() {
                return Vec::new();
            }
            of(&radiosity, l).iter().map(|b| b / PI as f32).collect()
        };
        Ok((0..on_elements.len())
            .map(|l| [of(&gathered, l), shown(l)])
            .collect())
    }

    /// Ratio of the light that an element reflects from a light to that from uniform light.
    fn bounced(&self, emitter: &Emitter<'_>, element: &Element) -> f32 {
        let facet = &self.scene.surfaces.facets[element.facet];
        let lobe = self.scene.surfaces.lobe(element.facet as u32);
        let Some(lobe) = lobe else {
            return 1.0;
        };
        let here = Receiver::new(facet, element.centre, 0.0);
        emitter.reflectance(Some(lobe), (here, None), [1.0; 3])[0] as f32
    }
}
