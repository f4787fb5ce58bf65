//! Mean direct light of each element, the start of the iteration.
//!
//! Four samples per element suffice far from the light. Near it, and where a beam's edge or a
//! shadow crosses the element, they may miss the mean, and all reflected light would have that
//! error. Therefore an element whose samples differ by more than a share of the light's flux is
//! repeatedly divided into quarters until they agree. Invariant: the samples depend on the light at
//! unit strength alone, so that G stays linear.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element or sample, made together"
)]

use crate::TransportError;
use crate::direct::cluster::{Receiver, Receivers};
use crate::direct::{PreparedLight, irradiance};
use crate::hemicube::HemicubeScene;
use crate::hemicube::interior::is_interior;
use crate::hemicube::mesh::sample::Sample;
use footlight_host::work::Work;
use rayon::prelude::*;

/// Allowed difference between the samples of an element, relative to the flux that all elements
/// reflect.
const ALLOWED: f64 = 5e-4;

/// Most subdivisions of a sample.
const DEEPEST: usize = 4;

/// A part of an element and its uniform light.
#[derive(Clone)]
struct Part {
    element: usize,
    sample: Sample,
    light: f32,
    /// True for a sample of the mesh, false for a part of one.
    is_whole: bool,
}

impl HemicubeScene {
    /// Mean direct irradiance of each element and of each of its sources, for one light or for the
    /// planes of one projected image, which share everything except the texels.
    ///
    /// # Errors
    /// As [`irradiance`].
    pub fn on_elements(
        &self,
        light: &PreparedLight,
        lights: &[usize],
        work: Work<'_>,
    ) -> Result<Vec<[Vec<f32>; 2]>, TransportError> {
        let parts = self.parts(light, work)?;
        Ok(lights.iter().map(|&l| self.means(l, &parts)).collect())
    }

    /// Parts of the elements, as fine as the light requires.
    fn parts(&self, light: &PreparedLight, work: Work<'_>) -> Result<Vec<Part>, TransportError> {
        let mut groups = self.first_parts(light, work)?;
        let power = |p: &Part| self.weight(p.element) * p.sample.area * f64::from(p.light);
        let allowed = ALLOWED * groups.iter().flatten().map(power).sum::<f64>();
        let differences = self.neighbour_difference(&groups);
        let apart = |g: &[Part]| self.spread(g, g.first().map_or(0.0, |p| differences[p.element]));
        let (uneven, even): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| apart(g) > allowed);
        let mut done = even.concat();
        groups = self.quartered(light, &uneven.concat(), work)?;
        for depth in 1..=DEEPEST {
            let (uneven, even): (Vec<_>, Vec<_>) = groups
                .into_iter()
                .partition(|g| depth < DEEPEST && self.spread(g, 0.0) > allowed);
            done.extend(even.into_iter().flatten());
            groups = self.quartered(light, &uneven.concat(), work)?;
        }
        Ok(done)
    }

    /// Greatest reflectance of an element, which weights errors of its light.
    fn weight(&self, element: usize) -> f64 {
        let most = self.reflectance[element]
            .iter()
            .copied()
            .fold(0.0, f32::max);
        f64::from(most)
    }

    /// For each element the greatest difference between its light and that of its neighbours, which
    /// may reveal light that its own samples miss.
    fn neighbour_difference(&self, groups: &[Vec<Part>]) -> Vec<f64> {
        let mean = |g: &Vec<Part>| {
            let sum: f64 = g.iter().map(|p| f64::from(p.light)).sum();
            sum / g.len().max(1) as f64
        };
        let means: Vec<f64> = groups.iter().map(mean).collect();
        let mut apart = vec![0.0; means.len()];
        self.mesh.each_pair(|a, b| {
            let between = (means[a] - means[b]).abs();
            apart[a] = f64::max(apart[a], between);
            apart[b] = f64::max(apart[b], between);
        });
        apart
    }

    /// Spread of the parts of a group, as reflected flux; at least half of the `difference` from
    /// the neighbours.
    fn spread(&self, group: &[Part], difference: f64) -> f64 {
        let area: f64 = group.iter().map(|p| p.sample.area).sum();
        let flux: f64 = group
            .iter()
            .map(|p| p.sample.area * f64::from(p.light))
            .sum();
        let mean = flux / area;
        let off = |p: &Part| p.sample.area * (f64::from(p.light) - mean).abs();
        let own: f64 = group.iter().map(off).sum();
        let weight = group.first().map_or(0.0, |p| self.weight(p.element));
        weight * own.max(0.5 * area * difference)
    }

    /// The mesh's own samples, element by element.
    fn first_parts(
        &self,
        light: &PreparedLight,
        work: Work<'_>,
    ) -> Result<Vec<Vec<Part>>, TransportError> {
        let receivers = &self.element_receivers;
        let precision = self.precision(0.0);
        let all = irradiance(self.setting(), light, receivers, None, precision, work)?;
        let mut all = all.into_iter();
        let group = |(element, samples): (usize, &Vec<Sample>)| {
            let parts = samples.iter().zip(all.by_ref());
            let part = |(sample, light): (&Sample, f32)| Part {
                element,
                sample: sample.clone(),
                light,
                is_whole: true,
            };
            parts.map(part).collect::<Vec<Part>>()
        };
        let samples = self.mesh.elements.iter().map(|e| &e.samples);
        Ok(samples.enumerate().map(group).collect())
    }

    /// Quarters of each part, without those inside a solid, which are dark.
    fn quartered(
        &self,
        light: &PreparedLight,
        parts: &[Part],
        work: Work<'_>,
    ) -> Result<Vec<Vec<Part>>, TransportError> {
        if parts.is_empty() {
            return Ok(Vec::new());
        }
        let quarters = |p: &Part| -> Vec<Part> {
            let at = self.mesh.elements[p.element].facet;
            let facet = &self.surfaces.facets[at];
            let grid = self.mesh.grids[at].as_ref();
            let samples = grid.map(|g| p.sample.quarters(&self.surfaces, facet, g));
            let part = |sample| Part {
                sample,
                is_whole: false,
                ..p.clone()
            };
            samples.into_iter().flatten().map(part).collect()
        };
        let mut groups: Vec<Vec<Part>> = parts.par_iter().map(quarters).collect();
        let receiver = |p: &Part| Receiver {
            point: p.sample.point,
            facet: self.mesh.elements[p.element].facet,
        };
        let receivers: Vec<Receiver> = groups.iter().flatten().map(receiver).collect();
        let receivers = Receivers::new(&self.surfaces, &receivers);
        let precision = self.precision(0.0);
        let lit = irradiance(self.setting(), light, &receivers, None, precision, work)?;
        for (part, lit) in groups.iter_mut().flatten().zip(lit) {
            part.light = lit;
        }
        let enclosed = |p: &Part| {
            let facet = self.mesh.elements[p.element].facet;
            p.light == 0.0 && is_interior(self.setting(), &self.seeds, facet, p.sample.point)
        };
        groups
            .par_iter_mut()
            .for_each(|g| g.retain(|p| !enclosed(p)));
        groups.retain(|g| !g.is_empty());
        Ok(groups)
    }

    /// Mean over the parts of each element, and of each source; for a projection, multiplied by its
    /// image. A source is lit like the elements around it where these are evenly lit: its one sample
    /// may lie in a shadow that hardly touches it.
    fn means(&self, light: usize, parts: &[Part]) -> [Vec<f32>; 2] {
        let [elements, sources] = [&self.mesh, &self.sources.mesh];
        let mut sums = [elements, sources].map(|mesh| vec![[0.0_f64; 2]; mesh.elements.len()]);
        let even: Vec<f32> = parts.iter().map(|p| p.light).collect();
        for (part, lit) in parts.iter().zip(self.through_image(light, parts, even)) {
            let facet = elements.elements[part.element].facet;
            let source = sources.at(facet, part.sample.point) as usize;
            let own = [Some(part.element), (!part.is_whole).then_some(source)];
            for (sums, at) in sums.iter_mut().zip(own) {
                // A part within a solid has no source.
                if let Some([area, flux]) = at.and_then(|at| sums.get_mut(at)) {
                    *area += part.sample.area;
                    *flux += part.sample.area * f64::from(lit);
                }
            }
        }
        let mean = |[area, flux]: [f64; 2]| (area > 0.0).then_some((flux / area) as f32);
        let [whole, quarters] = sums;
        let whole: Vec<f32> = whole.into_iter().map(|s| mean(s).unwrap_or(0.0)).collect();
        let quarter = |(source, sums)| {
            let around = || self.sources.interpolated(source, |e| whole[e]);
            mean(sums).unwrap_or_else(around)
        };
        let quarters = quarters.into_iter().enumerate().map(quarter).collect();
        [whole, quarters]
    }

    fn through_image(&self, light: usize, parts: &[Part], even: Vec<f32>) -> Vec<f32> {
        let Some(projector) = &self.projectors[light] else {
            return even;
        };
        let samples = parts.iter().filter_map(|p| {
            let grid = self.mesh.grids[self.mesh.elements[p.element].facet].as_ref()?;
            Some((p.sample.point, p.sample.sides(grid)))
        });
        projector.project(&even, samples)
    }
}
