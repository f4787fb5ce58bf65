//! Ground truth by random walks, where there is no closed form.
//!
//! Paths start at the eye and continue from surface to surface in cosine-distributed directions,
//! with exact ray casting; at each vertex the direct light has a closed form. No mesh, no hemicube,
//! no interpolation: the only common part with the operator is the direct light at a point, which
//! is tested against closed forms elsewhere. Half of the paths make one image, the other half
//! another, so that noise can be separated from error.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "test support"
)]

use crate::reference::Case;
use footlight_host::work::Work;
use footlight_show::geometry::{Vec3, frame};
use footlight_show::hash::{GOLDEN, mix};
use footlight_stage::Light;
use footlight_transport::direct::cluster::{Receiver, Receivers};
use footlight_transport::direct::{IrradiancePrecision, PreparedLight, irradiance, luminaires};
use footlight_transport::surfaces::camera::{Camera, camera};
use footlight_transport::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use footlight_transport::surfaces::surface::Surfaces;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Two halves of one pixel's radiance for each source.
pub type Halves = [Vec<[f64; 3]>; 2];

/// Most vertices of a path; the remainder is below a ten-thousandth for walls of reflectance below
/// 0.8.
const MOST_CORNERS: usize = 40;

/// A vertex of a path, where direct light is added.
struct Corner {
    at: Receiver,
    /// Contribution to the eye per unit of irradiance.
    share: [f64; 3],
    half: usize,
}

/// A small generator of sufficient quality (SplitMix64).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        (mix(self.0) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

struct Walker<'a> {
    case: &'a Case,
    surfaces: Surfaces,
    hierarchy: Hierarchy,
    lights: Vec<PreparedLight>,
    camera: Camera,
}

/// The radiance of each source at unit setting in some pixels (column, row), `paths` for each half.
pub fn walk(case: &Case, pixels: &[[usize; 2]], paths: usize) -> Vec<Halves> {
    let surfaces = Surfaces::new(&case.scene).unwrap();
    let walker = Walker {
        case,
        hierarchy: Hierarchy::new(&surfaces),
        lights: luminaires(&surfaces, &case.rig).unwrap(),
        camera: camera(&case.view).unwrap(),
        surfaces,
    };
    let each = |pixel: &[usize; 2]| walker.pixel(*pixel, paths);
    pixels.par_iter().map(each).collect()
}

impl Walker<'_> {
    fn pixel(&self, pixel: [usize; 2], paths: usize) -> Halves {
        let mut out = [0, 1].map(|_| vec![[0.0; 3]; self.case.rig.sources.len()]);
        let mut corners = Vec::new();
        for (half, out) in out.iter_mut().enumerate() {
            let mut dice = Dice((pixel[1] * 65536 + pixel[0]) as u64 * 2 + half as u64);
            dice.0 = dice.0.wrapping_mul(0x2545_f491_4f6c_dd1d);
            // Stratified over the pixel and the first directions: the additive recurrence of the
            // root of x^5 = x + 1, randomly shifted.
            let shift = [0; 4].map(|_| dice.roll());
            let root = 1.167_303_978_261_418_7_f64;
            for path in 0..paths {
                let spread = [0, 1, 2, 3]
                    .map(|k| (shift[k] + path as f64 * root.powi(-(k as i32) - 1)).fract());
                self.path(pixel, half, spread, &mut dice, out, &mut corners);
            }
        }
        self.light(&corners, &mut out);
        for sum in out.iter_mut().flatten().flatten() {
            *sum /= paths as f64;
        }
        out
    }

    /// Traces one path: adds visible emission, and its vertices.
    fn path(
        &self,
        [column, row]: [usize; 2],
        half: usize,
        spread: [f64; 4],
        dice: &mut Dice,
        glow: &mut [[f64; 3]],
        corners: &mut Vec<Corner>,
    ) {
        let mut from = self.case.view.from;
        let mut ray = self
            .camera
            .ray(column as f64 + spread[0], row as f64 + spread[1]);
        let mut share = [1.0 / PI; 3];
        for corner in 0..MOST_CORNERS {
            let Some((piece, t)) = self.hierarchy.first_hit(&self.surfaces, from, ray) else {
                return;
            };
            let piece = &self.surfaces.pieces[piece];
            if piece.normal.dot(ray) >= 0.0 {
                return;
            }
            let facet = &self.surfaces.facets[piece.facet];
            if corner == 0 {
                self.shine(facet.material, glow);
            }
            from += ray * t;
            share = [0, 1, 2].map(|c| share[c] * facet.reflectance[c]);
            let left = share.iter().copied().fold(0.0, f64::max) * PI;
            if left <= 0.0 {
                return;
            }
            let at = Receiver {
                point: from,
                facet: piece.facet,
            };
            corners.push(Corner { at, share, half });
            let stays = if corner < 2 { 1.0 } else { left.min(0.95) };
            if dice.roll() >= stays {
                return;
            }
            share = share.map(|s| s / stays);
            let [a, b] = match corner {
                0 => [spread[2], spread[3]],
                _ => [dice.roll(), dice.roll()],
            };
            ray = lean(piece.normal, a, b);
        }
    }

    fn shine(&self, material: usize, glow: &mut [[f64; 3]]) {
        self.each_part(|source, light, strength| {
            if matches!(self.case.rig.lights[light], Light::Panel { material: m, .. } if m == material) {
                for c in 0..3 {
                    glow[source][c] += strength[c];
                }
            }
        });
    }

    fn each_part(&self, mut take: impl FnMut(usize, usize, [f64; 3])) {
        for (source, s) in self.case.rig.sources.iter().enumerate() {
            for part in &s.emitters {
                let colour = self.case.rig.lights[part.light].strength().0;
                take(
                    source,
                    part.light,
                    [0, 1, 2].map(|c| colour[c] * part.filter.0[c]),
                );
            }
        }
    }

    fn light(&self, corners: &[Corner], out: &mut Halves) {
        let points: Vec<Receiver> = corners.iter().map(|c| c.at).collect();
        let receivers = Receivers::new(&self.surfaces, &points);
        let setting = SceneGeometry {
            surfaces: &self.surfaces,
            hierarchy: &self.hierarchy,
        };
        for (at, light) in self.lights.iter().enumerate() {
            let lit = irradiance(
                setting,
                light,
                &receivers,
                None,
                IrradiancePrecision::EXACT,
                Work::silent(),
            )
            .unwrap();
            let mut sums = [[0.0; 3]; 2];
            for (corner, lit) in corners.iter().zip(lit) {
                for (sum, share) in sums[corner.half].iter_mut().zip(corner.share) {
                    *sum += share * f64::from(lit);
                }
            }
            self.each_part(|source, light, strength| {
                if light != at {
                    return;
                }
                for (out, sums) in out.iter_mut().zip(sums) {
                    for (c, sum) in sums.iter().enumerate() {
                        out[source][c] += strength[c] * sum;
                    }
                }
            });
        }
    }
}

/// A cosine-distributed direction around the normal.
fn lean(normal: Vec3, a: f64, b: f64) -> Vec3 {
    let [u, v] = frame(normal);
    let (sine, cosine) = (a * TAU).sin_cos();
    let out = b.sqrt();
    u * (cosine * out) + v * (sine * out) + normal * (1.0 - b).max(0.0).sqrt()
}
