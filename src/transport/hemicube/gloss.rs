//! Light that the glossy surfaces of an image reflect to the eye.
//!
//! Rays of the lobe end on elements of the mesh, whose radiance the fragment reflects. Highlights
//! of point sources have a closed form; panels are sampled by rays of the lobe and by points of the
//! panel together (Veach and Guibas, "Optimally Combining Sampling Techniques for Monte Carlo
//! Rendering", 1995). Each pixel has few rays, which differ from those of its neighbours, and light
//! is the mean over a window of pixels. Invariant: rays, shares and windows depend on the setup and
//! the step alone. Lobes are wide; a sharp reflection would show the elements.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each fragment, glossy fragment, element or light, made together"
)]

use crate::TransportError;
use crate::contract::check_memory;
use crate::gather::emitter::{Emitter, LobeRay};
use crate::gather::ray_scene::{DARK, RayScene, Receiver, SurfacePoint};
use crate::gather::sampling::{morton, point};
use crate::hemicube::compose::weight_lists;
use crate::hemicube::mesh::Mesh;
use crate::surfaces::fragment::{Fragment, Fragments};
use crate::surfaces::lists::Lists;
use crate::surfaces::lobe::Lobe;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;

/// Pixels to each side at which the weight in a window falls to zero.
const REACH: usize = 4;
/// Position of a fragment that is not glossy.
const NONE: u32 = u32::MAX;
/// Approximate bytes of a glossy fragment without its rays, and of a ray with the elements at its
/// end.
const FRAGMENT_BYTES: usize = 200;
const RAY_BYTES: usize = 40;
/// Glossy fragments in one task.
const RUN: usize = 256;
/// Least cosine between the normals of fragments in one window, and greatest height of one over the
/// plane of another, relative to their distance.
const ALIKE: f64 = 0.99;
const FLAT: f64 = 0.1;
/// Seeds of the point sequences.
const SEED_WAY: u32 = 0x6105;
const SEED_PANEL: u32 = 0x6106;

/// A fragment of a glossy surface.
#[derive(Clone, Copy)]
struct Glossy {
    pixel: u32,
    fragment: u32,
    /// The first of its rays in the sequence, and their number.
    first: u32,
    rays: u32,
}

/// Glossy fragments of an image.
pub struct Gloss {
    /// In the order of the fragments.
    glossy: Vec<Glossy>,
    /// For each fragment its position in that list, or [`NONE`].
    positions: Vec<u32>,
    /// Elements that each of them shows, with their shares.
    elements: Lists<(u32, f32)>,
    /// For each of them those in its row and in its column that show the same surface, with weights
    /// that sum to 1.
    windows: [Lists<(u32, f32)>; 2],
}

/// The scene, and its fragments that the eye sees.
#[derive(Clone, Copy)]
pub struct EyeScene<'a> {
    pub scene: RayScene<'a>,
    pub fragments: &'a Fragments,
}

impl EyeScene<'_> {
    /// Place, receiver and direction to the eye of a fragment.
    fn place(&self, fragment: u32) -> (SurfacePoint, Receiver, Vec3) {
        let Fragment { facet, point, .. } = self.fragments.all()[fragment as usize];
        let own = &self.scene.surfaces.facets[facet];
        let here = Receiver::new(own, point, self.scene.offset);
        let eye = (self.fragments.camera.origin - point).normalized();
        let facet = facet as u32;
        (SurfacePoint { facet, point }, here, eye)
    }

    fn lobe(&self, glossy: Glossy) -> Option<&Lobe> {
        let fragment = &self.fragments.all()[glossy.fragment as usize];
        self.scene.surfaces.lobe(fragment.facet as u32)
    }

    /// Rays of a fragment's lobe. One that points below the surface has no weight.
    fn rays(&self, glossy: Glossy, place: SurfacePoint) -> impl Iterator<Item = LobeRay> {
        let eye = self.fragments.camera.origin;
        (0..glossy.rays).map(move |k| {
            let random = point(glossy.first.wrapping_add(k), SEED_WAY);
            let found = self.scene.reflected(place, eye, random);
            let (way, weight) = found.unwrap_or((Vec3::ZERO, 0.0));
            let end = found.map(|_| self.scene.shoot(place, way).0);
            let end = end.filter(|end| end.facet != DARK);
            LobeRay {
                place,
                way,
                weight,
                ends: end.map(|end| (end, 1.0)).into_iter().collect(),
            }
        })
    }

    /// Adds the radiance of each panel that a glossy fragment reflects, from its rays.
    fn add_panels(&self, glossy: Glossy, panels: &[&Emitter<'_>], out: &mut Vec<f32>) {
        let start = out.len();
        out.resize(start + panels.len(), 0.0);
        let Some(lobe) = self.lobe(glossy).filter(|_| !panels.is_empty()) else {
            return;
        };
        let (place, here, eye) = self.place(glossy.fragment);
        for (k, ray) in (0..).zip(self.rays(glossy, place)) {
            let random = point(glossy.first.wrapping_add(k), SEED_PANEL);
            for (sum, panel) in out[start..].iter_mut().zip(panels) {
                let sample = panel.sample(self.scene, here, || [Vec3::ZERO; 2], random);
                if let Some(end) = sample.end {
                    let light = panel.in_gloss(self.scene, (lobe, here.normal, eye), &end, &ray);
                    *sum += light as f32 / glossy.rays as f32;
                }
            }
        }
    }

    /// True when the lobes of two fragments show the same things.
    fn is_alike(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|f| &self.fragments.all()[f as usize]);
        let [own, other] = [a, b].map(|f| &self.scene.surfaces.facets[f.facet]);
        let (between, normal) = (b.point - a.point, own.normal_at(a.point));
        a.facet == b.facet
            || own.material == other.material
                && normal.dot(other.normal_at(b.point)) > ALIKE
                && own.normal.dot(between).abs() <= FLAT * between.length()
    }
}

/// Adds up entries with the same index.
fn merge(list: &mut Vec<(u32, f32)>) {
    list.sort_unstable_by_key(|(index, _)| *index);
    list.dedup_by(|(next, more), (index, weight)| {
        *weight += if next == index { *more } else { 0.0 };
        next == index
    });
    list.retain(|(_, weight)| *weight > 0.0);
}

impl Gloss {
    /// For an image `width` pixels wide, with `rays` rays a pixel; `None` if it shows nothing
    /// glossy.
    ///
    /// # Errors
    /// On cancel; [`TransportError::Memory`] when the rays do not fit.
    pub fn new(
        seen: EyeScene<'_>,
        mesh: &Mesh,
        (width, rays): (usize, usize),
        work: Work<'_>,
    ) -> Result<Option<Gloss>, TransportError> {
        let EyeScene { scene, fragments } = seen;
        let (mut glossy, mut pixels) = (Vec::new(), Lists::default());
        for pixel in 0..fragments.pixels.count() {
            let place = morton(pixel % width, pixel / width);
            let mut first = place.wrapping_mul(rays as u32);
            for fragment in fragments.pixels.range(pixel) {
                let own = &fragments.all()[fragment];
                if scene.surfaces.lobe(own.facet as u32).is_none() {
                    continue;
                }
                let rays = (f64::from(own.weight) * rays as f64).ceil() as u32;
                let fragment = fragment as u32;
                pixels.add(glossy.len() as u32);
                glossy.push(Glossy {
                    pixel: pixel as u32,
                    fragment,
                    first,
                    rays,
                });
                first = first.wrapping_add(rays);
            }
            pixels.end();
        }
        if glossy.is_empty() {
            return Ok(None);
        }
        let all_rays: usize = glossy.iter().map(|own| own.rays as usize).sum();
        let bytes = FRAGMENT_BYTES * glossy.len() + RAY_BYTES * all_rays;
        check_memory("reflections", bytes, work.memory)?;
        let elements = weight_lists(&glossy, work, |_, glossy, out| {
            let (place, ..) = seen.place(glossy.fragment);
            for ray in seen.rays(*glossy, place) {
                for (end, _) in &ray.ends {
                    let clear = scene.clearness((end.point - place.point).length());
                    let weight = (ray.weight * clear / f64::from(glossy.rays)) as f32;
                    let around = mesh.stencil(end.facet as usize, end.point);
                    out.extend(around.map(|(element, w)| (element, w * weight)));
                }
            }
            merge(out);
        })?;
        let height = fragments.pixels.count() / width;
        let window = |[across, down]: [usize; 2]| {
            weight_lists(&glossy, work, |_, own: &Glossy, out| {
                let pixel = own.pixel as usize;
                for step in 0..2 * REACH - 1 {
                    let at = |from: usize, way: usize| {
                        (from + way * step).checked_sub(way * (REACH - 1))
                    };
                    let (x, y) = (at(pixel % width, across), at(pixel / width, down));
                    let inside = x.filter(|x| *x < width).zip(y.filter(|y| *y < height));
                    let near = inside.map_or(&[][..], |(x, y)| pixels.get(y * width + x));
                    let tent = (REACH - step.abs_diff(REACH - 1)) as f32;
                    for other in near {
                        let fragment = glossy[*other as usize].fragment;
                        if seen.is_alike(own.fragment, fragment) {
                            let share = fragments.all()[fragment as usize].weight;
                            out.push((*other, tent * share));
                        }
                    }
                }
                let sum: f32 = out.iter().map(|(_, weight)| weight).sum();
                out.iter_mut().for_each(|(_, weight)| *weight /= sum);
            })
        };
        let windows = [window([1, 0])?, window([0, 1])?];
        let mut positions = vec![NONE; fragments.all().len()];
        for (at, own) in (0..).zip(&glossy) {
            positions[own.fragment as usize] = at;
        }
        Ok(Some(Gloss {
            glossy,
            positions,
            elements,
            windows,
        }))
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let windows = self.windows.iter().map(Lists::bytes).sum::<usize>();
        let own = size_of_val(self.glossy.as_slice()) + size_of_val(self.positions.as_slice());
        own + self.elements.bytes() + windows
    }

    /// Number of glossy fragments.
    pub fn count(&self) -> usize {
        self.glossy.len()
    }

    /// Position of a fragment among the glossy ones.
    pub fn position(&self, fragment: usize) -> Option<usize> {
        let at = self.positions[fragment];
        (at != NONE).then_some(at as usize)
    }

    /// Means over the windows of values of the glossy fragments, `channels` for each.
    fn even(&self, mut values: Vec<f32>, channels: usize) -> Vec<f32> {
        for windows in &self.windows {
            let mut means = vec![0.0_f32; values.len()];
            let rows = means.par_chunks_exact_mut(channels.max(1)).enumerate();
            rows.with_min_len(RUN).for_each(|(glossy, means)| {
                for (other, weight) in windows.get(glossy) {
                    let own = &values[*other as usize * channels..];
                    let pairs = means.iter_mut().zip(own);
                    pairs.for_each(|(mean, value)| *mean += weight * value);
                }
            });
            values = means;
        }
        values
    }

    /// Radiance that each glossy fragment reflects, for radiances of the elements; three channels
    /// each.
    pub fn reflected(&self, elements: &[[f64; 3]]) -> Vec<f32> {
        let mut all = vec![0.0; 3 * self.count()];
        let rows = all.par_chunks_exact_mut(3).with_min_len(RUN).enumerate();
        rows.for_each(|(glossy, radiance)| {
            let mut sum = [0.0; 3];
            for (element, weight) in self.elements.get(glossy) {
                let radiance = elements[*element as usize];
                (0..3).for_each(|c| sum[c] += f64::from(*weight) * radiance[c]);
            }
            radiance.copy_from_slice(&sum.map(|s| s as f32));
        });
        self.even(all, 3)
    }

    /// Radiance of each light, at unit strength, that each glossy fragment reflects by its lobe.
    /// Scales direct light of the fragments to the share that reaches their matt part.
    ///
    /// # Errors
    /// On cancel.
    pub fn highlights(
        &self,
        seen: EyeScene<'_>,
        emitters: &[Emitter<'_>],
        direct: &mut [Vec<f32>],
        work: Work<'_>,
    ) -> Result<Vec<Vec<f32>>, Cancelled> {
        let panels: Vec<&Emitter<'_>> = emitters.iter().filter(|e| e.is_panel()).collect();
        let run = |run: &[Glossy]| {
            work.check()?;
            let mut out = Vec::with_capacity(run.len() * panels.len());
            for glossy in run {
                seen.add_panels(*glossy, &panels, &mut out);
            }
            Ok(out)
        };
        let runs: Result<Vec<Vec<f32>>, Cancelled> = self.glossy.par_chunks(RUN).map(run).collect();
        let sampled = self.even(runs?.concat(), panels.len());
        let of = |(light, direct): (usize, &mut Vec<f32>)| {
            work.check()?;
            let emitter = &emitters[light];
            let panel = emitters[..light].iter().filter(|e| e.is_panel()).count();
            let highlight = |(at, glossy): (usize, &Glossy)| {
                let Some(lobe) = seen.lobe(*glossy) else {
                    return 0.0;
                };
                let (_, here, eye) = seen.place(glossy.fragment);
                let direct = &mut direct[glossy.fragment as usize];
                let lit = *direct;
                let middle = emitter.middle(here.point);
                let way = middle.map(|to| (to - here.point).normalized());
                if let Some(way) = way {
                    *direct *= lobe.matt_from(here.normal.dot(way).max(0.0)) as f32;
                }
                if emitter.is_panel() {
                    return sampled[at * panels.len() + panel];
                }
                let value = way.map_or(0.0, |way| lobe.value(here.normal, eye, way));
                lit * value as f32
            };
            Ok(self.glossy.iter().enumerate().map(highlight).collect())
        };
        direct.par_iter_mut().enumerate().map(of).collect()
    }
}
