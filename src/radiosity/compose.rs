//! From solved lights to a picture: what each costs at unit strength is added up pixel by pixel.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, node, fragment or pixel, made together"
)]

use super::{Operator, Solution};
use crate::picture::Image;
use crate::radiosity::camera::fragment::Fragment;
use crate::scene::Light;
use rayon::prelude::*;
use std::f64::consts::PI;

/// What each fragment takes of the gather points around it.
pub struct GatherWeights {
    /// Where each fragment's shares end.
    ends: Vec<usize>,
    shares: Vec<(u32, f32)>,
}

/// Fragments whose shares are found at once.
const RUN: usize = 4096;

impl GatherWeights {
    /// Of fragments, each of which adds its shares to a list.
    pub fn by(
        fragments: &[Fragment],
        around: impl Fn(&Fragment, &mut Vec<(u32, f32)>) + Sync,
    ) -> GatherWeights {
        let run = |fragments: &[Fragment]| {
            let mut own = GatherWeights::with_room(fragments.len(), 4 * fragments.len());
            for f in fragments {
                around(f, &mut own.shares);
                own.ends.push(own.shares.len());
            }
            own
        };
        let runs: Vec<GatherWeights> = fragments.par_chunks(RUN).map(run).collect();
        let count = runs.iter().map(|own| own.shares.len()).sum();
        let mut all = GatherWeights::with_room(fragments.len(), count);
        for own in runs {
            let before = all.shares.len();
            all.ends.extend(own.ends.iter().map(|end| before + end));
            all.shares.extend(own.shares);
        }
        all
    }

    fn with_room(fragments: usize, shares: usize) -> GatherWeights {
        GatherWeights {
            ends: Vec::with_capacity(fragments),
            shares: Vec::with_capacity(shares),
        }
    }

    /// GatherPoints and their shares.
    fn of(&self, fragment: usize) -> &[(u32, f32)] {
        let start = fragment.checked_sub(1).map_or(0, |f| self.ends[f]);
        &self.shares[start..self.ends[fragment]]
    }
}

impl Operator {
    /// The picture of lights of given strengths, all of which are solved.
    pub(super) fn compose(&self, strengths: &[[f64; 3]]) -> Image {
        let lit: Vec<(&Solution, [f64; 3])> = self
            .solutions
            .iter()
            .zip(strengths)
            .filter(|(_, s)| s.iter().any(|x| *x != 0.0))
            .filter_map(|(solution, s)| solution.as_ref().map(|x| (x, *s)))
            .collect();
        let gather_points = self
            .gather_points
            .as_ref()
            .map_or(&self.mesh, |n| &n.mesh)
            .elements
            .len();
        let mut indirect = vec![[0.0_f64; 3]; gather_points];
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
        for (gather_point, share) in self.taken.of(f) {
            for c in 0..3 {
                light[c] += f64::from(*share) * indirect[*gather_point as usize][c];
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
