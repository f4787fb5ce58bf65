//! Composes an image from solved lights: pixel by pixel, the sum of each light times its strength.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, gather point, fragment or pixel, made together"
)]

use crate::direct::projector::pixel as footprint;
use crate::hemicube::{HemicubeRadiosity, Solution};
use crate::surfaces::fragment::{Fragment, Fragments};
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_stage::Light;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Items whose lists are made together.
const RUN: usize = 4096;

/// A list of indices with weights for each item; `of` adds those of the item with a given index.
///
/// # Errors
/// On cancel.
pub fn weight_lists<T: Sync>(
    items: &[T],
    work: Work<'_>,
    of: impl Fn(usize, &T, &mut Vec<(u32, f32)>) + Sync,
) -> Result<Lists<(u32, f32)>, Cancelled> {
    let run = |(number, items): (usize, &[T])| {
        work.check()?;
        let (mut out, mut weights) = (Lists::default(), Vec::new());
        for (item, number) in items.iter().zip(number * RUN..) {
            of(number, item, &mut weights);
            out.push(weights.drain(..));
        }
        Ok(out)
    };
    let runs: Result<Vec<_>, Cancelled> = items.par_chunks(RUN).enumerate().map(run).collect();
    Ok(Lists::concat(runs?))
}

/// Reflectance of each fragment to the eye, its texture averaged over the covered area, without
/// gloss; empty when the scene has neither.
pub fn paints(surfaces: &Surfaces, fragments: &Fragments) -> Vec<[f32; 3]> {
    let mut facets = surfaces.facets.iter();
    if !surfaces.is_glossy() && facets.all(|f| surfaces.texture(f.material).is_none()) {
        return Vec::new();
    }
    let paint = |f: &Fragment| {
        let facet = &surfaces.facets[f.facet];
        let sides = || {
            footprint(
                &fragments.camera,
                f.point,
                facet.normal,
                f64::from(f.weight),
            )
        };
        let eye = fragments.camera.origin;
        let found = surfaces.reflectance_to(eye, (facet, f.point), sides);
        found.map(|r| r as f32)
    };
    fragments.all().par_iter().map(paint).collect()
}

/// Values of three channels of solved lights, times their strengths.
fn mixed<'a>(
    lit: &[(&'a Solution, [f64; 3])],
    values: impl Fn(&'a Solution) -> &'a [f32],
) -> Vec<[f64; 3]> {
    let lit: Vec<_> = lit
        .iter()
        .map(|(solution, s)| (values(solution), s))
        .collect();
    let count = lit.first().map_or(0, |(values, _)| values.len() / 3);
    let of = |i: usize| {
        let mut sum = [0.0; 3];
        for (values, s) in &lit {
            (0..3).for_each(|c| sum[c] += s[c] * f64::from(values[3 * i + c]));
        }
        sum
    };
    (0..count)
        .into_par_iter()
        .with_min_len(1024)
        .map(of)
        .collect()
}

impl HemicubeRadiosity {
    /// Image of lights of given strengths, all of which are solved.
    pub(super) fn compose(&self, strengths: &[[f64; 3]]) -> Image {
        let lit: Vec<(&Solution, [f64; 3])> = self
            .solutions
            .iter()
            .zip(strengths)
            .filter(|(_, s)| s.iter().any(|x| *x != 0.0))
            .filter_map(|(solution, s)| solution.as_ref().map(|x| (x, *s)))
            .collect();
        if lit.is_empty() {
            return Image::new(self.width, self.height);
        }
        let indirect = mixed(&lit, |solution| &solution.indirect);
        let reflected = self.gloss.as_ref().map(|gloss| {
            let mut radiance = mixed(&lit, |solution| match &solution.bounced {
                Some(bounced) => &bounced.radiosity,
                None => &[],
            });
            radiance
                .as_flattened_mut()
                .iter_mut()
                .for_each(|b| *b /= PI);
            (gloss, gloss.reflected(&radiance))
        });
        let emission = self.emission(strengths);
        let mut image = Image::new(self.width, self.height);
        let rows = image.data_mut().par_chunks_mut(3 * self.width).enumerate();
        rows.for_each(|(y, row)| {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate() {
                let at = y * self.width + x;
                let mut sum = [0.0; 3];
                for f in self.fragments.pixels.range(at) {
                    let glossy = reflected.as_ref().and_then(|(gloss, reflected)| {
                        let at = gloss.position(f)?;
                        Some((at, [0, 1, 2].map(|c| f64::from(reflected[3 * at + c]))))
                    });
                    self.shade((f, glossy), &lit, &indirect, &emission, &mut sum);
                }
                for (solution, s) in &lit {
                    if let Some(scattered) = solution.airlight.get(at) {
                        (0..3).for_each(|c| sum[c] += s[c] * f64::from(*scattered));
                    }
                }
                for (p, s) in pixel.iter_mut().zip(sum) {
                    *p = s as f32;
                }
            }
        });
        image
    }

    /// Adds a fragment's share of its pixel; a glossy one has its position among these and the
    /// radiance of the elements that it shows.
    fn shade(
        &self,
        (f, glossy): (usize, Option<(usize, [f64; 3])>),
        lit: &[(&Solution, [f64; 3])],
        indirect: &[[f64; 3]],
        emission: &[[f64; 3]],
        sum: &mut [f64; 3],
    ) {
        let fragment = &self.fragments.all()[f];
        let facet = &self.scene.surfaces.facets[fragment.facet];
        let mut light = [0.0; 3];
        for (solution, s) in lit {
            let direct = f64::from(solution.direct[f]);
            for c in 0..3 {
                light[c] += s[c] * direct;
            }
        }
        for (gather_point, weight) in self.gather_weights.get(f) {
            for c in 0..3 {
                light[c] += f64::from(*weight) * indirect[*gather_point as usize][c];
            }
        }
        let distance = (fragment.point - self.fragments.camera.origin).length();
        let weight = f64::from(fragment.weight) * self.scene.surfaces.clearness(distance);
        let painted = self.paints.get(f).map(|paint| paint.map(f64::from));
        let reflectance = painted.unwrap_or(facet.reflectance);
        for c in 0..3 {
            let radiance = reflectance[c] / PI * light[c] + emission[facet.material][c];
            sum[c] += weight * radiance;
        }
        if let Some((at, reflected)) = glossy {
            let tint = self.scene.surfaces.tint(fragment.facet as u32);
            for c in 0..3 {
                let own = lit.iter().map(|(x, s)| s[c] * f64::from(x.highlights[at]));
                sum[c] += weight * tint[c] * (reflected[c] + own.sum::<f64>());
            }
        }
    }

    /// Emitted radiance of each material.
    fn emission(&self, strengths: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let materials = self.scene.surfaces.facets.iter().map(|f| f.material + 1);
        let count = materials.max().unwrap_or(0);
        let mut out = vec![[0.0; 3]; count];
        for (light, s) in self.scene.rig.lights.iter().zip(strengths) {
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
