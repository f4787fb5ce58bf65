//! Light on the scene: direct and reflected light of each light at unit strength on the elements,
//! solved once for all bands of the picture.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element or source, made together"
)]

use crate::TransportError;
use crate::direct::IrradiancePrecision;
use crate::gather::emitter::Emitter;
use crate::gather::ray_scene::Receiver;
use crate::hemicube::HemicubeScene;
use crate::hemicube::mesh::element::Element;
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;
use std::sync::{Arc, MutexGuard, PoisonError};

/// Light on the scene of one light at unit strength.
pub struct BouncedLight {
    /// Root mean square of its direct light in the picture.
    pub level: f64,
    /// Radiosity of each source, three channels interleaved.
    pub radiosity: Vec<f32>,
}

/// Level of a light, and its direct light on elements and sources.
type DirectOnScene = (f64, [Vec<f32>; 2]);

/// The three channels of one light in rows of this width.
pub fn own_values(values: &[f32], (light, width): (usize, usize)) -> Vec<f32> {
    let rows = values.chunks_exact(width);
    rows.flat_map(|row| row[3 * light..][..3].iter().copied())
        .collect()
}

impl HemicubeScene {
    /// Light on the scene of each of the lights, which are solved now unless they are known.
    ///
    /// # Errors
    /// As [`crate::direct::irradiance`].
    pub(super) fn bounced(
        &self,
        lights: &[usize],
        work: Work<'_>,
    ) -> Result<Vec<Arc<BouncedLight>>, TransportError> {
        let is_new = |l: &usize| self.known()[*l].is_none();
        let new: Vec<usize> = lights.iter().copied().filter(is_new).collect();
        if !new.is_empty() {
            let sharing: Vec<&[usize]> = new
                .chunk_by(|a, b| self.shares_projection(*a, *b))
                .collect();
            let lit = sharing.par_iter().map(|lights| self.lit(lights, work));
            let lit: Vec<_> = lit.collect::<Result<_, TransportError>>()?;
            let (levels, on_elements): (Vec<f64>, Vec<_>) = lit.into_iter().flatten().unzip();
            let radiosity = self.radiosity(&new, &on_elements, work)?;
            for (at, (l, level)) in new.iter().zip(levels).enumerate() {
                let radiosity = own_values(&radiosity, (at, 3 * new.len()));
                self.known()[*l] = Some(Arc::new(BouncedLight { level, radiosity }));
            }
        }
        Ok(lights
            .iter()
            .filter_map(|l| self.known()[*l].clone())
            .collect())
    }

    fn known(&self) -> MutexGuard<'_, Vec<Option<Arc<BouncedLight>>>> {
        self.bounced.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A light's light on the scene, if gloss or another band needs it; else it is forgotten.
    pub(super) fn kept(
        &self,
        light: usize,
        bounced: Arc<BouncedLight>,
    ) -> Option<Arc<BouncedLight>> {
        if self.keeps_light {
            return Some(bounced);
        }
        self.known()[light] = None;
        None
    }

    /// Direct light of one light, or of the planes of one projected image.
    fn lit(&self, lights: &[usize], work: Work<'_>) -> Result<Vec<DirectOnScene>, TransportError> {
        // All planes of an image, wanted or not, so that the precision of one does not depend on
        // the others.
        let is_plane = |l: &usize| *l == lights[0] || self.shares_projection(lights[0], *l);
        let planes: Vec<usize> = (0..self.lights.len()).filter(is_plane).collect();
        let means = self.on_elements(&self.lights[lights[0]], &planes, work)?;
        let level = means.iter().map(|m| self.level(&m[0])).fold(0.0, f64::max);
        let wanted = planes.iter().zip(means).filter(|(l, _)| lights.contains(l));
        Ok(wanted.map(|(_, means)| (level, means)).collect())
    }

    /// True when both are planes of one projected image, which share everything except the texels.
    pub(super) fn shares_projection(&self, a: usize, b: usize) -> bool {
        match (&self.projectors[a], &self.projectors[b]) {
            (Some(a), Some(b)) => a.shares_projection(b),
            _ => false,
        }
    }

    /// Precision for an allowed error of interpolated direct light.
    pub(super) fn precision(&self, allowed: f64) -> IrradiancePrecision {
        IrradiancePrecision {
            allowed,
            near: self.step.near,
        }
    }

    /// Lights as rays see them.
    pub(super) fn emitters(&self, lights: &[usize]) -> Vec<Emitter<'_>> {
        let emitter = |&light: &usize| {
            let projector = self.projectors[light].as_ref();
            Emitter::new(&self.surfaces, &self.lights[light], projector)
        };
        lights.iter().map(emitter).collect()
    }

    /// Root mean square, over the image, of reflectance times irradiance, estimated from the
    /// visible elements.
    fn level(&self, on_elements: &[f32]) -> f64 {
        let elements = self.mesh.elements.iter().zip(&self.visible_shares);
        let power = elements.zip(on_elements).map(|((e, share), direct)| {
            let reflectance = self.surfaces.facets[e.facet].highest_reflectance();
            share * (reflectance * f64::from(*direct)).powi(2)
        });
        power.sum::<f64>().sqrt()
    }

    /// Radiosity of the sources, of all lights together, from the direct light of each on the
    /// elements and sources.
    fn radiosity(
        &self,
        lights: &[usize],
        on_elements: &[[Vec<f32>; 2]],
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let width = on_elements.len() * 3;
        let emitters = match self.surfaces.is_glossy() {
            true => self.emitters(lights),
            false => Vec::new(),
        };
        let share = |l: usize, element: &Element| {
            let emitter = emitters.get(l);
            emitter.map_or(1.0, |emitter| self.reflected_share(emitter, element))
        };
        let mut first = Vec::with_capacity(self.reflectance.len() * width);
        for (i, (own, element)) in self.reflectance.iter().zip(&self.mesh.elements).enumerate() {
            for (l, [direct, _]) in on_elements.iter().enumerate() {
                let lit = direct[i] * share(l, element);
                first.extend(own.map(|r| r * lit));
            }
        }
        let (rows, reflectance) = (&self.rows, &self.reflectance);
        let mut bounced = self
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
        let sources = &self.sources;
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
        Ok(radiosity)
    }

    /// Ratio of the light that an element reflects from a light to that from uniform light.
    fn reflected_share(&self, emitter: &Emitter<'_>, element: &Element) -> f32 {
        let facet = &self.surfaces.facets[element.facet];
        let lobe = self.surfaces.lobe(element.facet as u32);
        let Some(lobe) = lobe else {
            return 1.0;
        };
        let here = Receiver::new(facet, element.centre, 0.0);
        emitter.reflectance(Some(lobe), (here, None), [1.0; 3])[0] as f32
    }
}
