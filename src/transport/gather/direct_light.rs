//! Direct light in pixels and their parts: more samples where the first ones differ.

use crate::gather::BLOCK;
use crate::gather::emitter::{Emitter, LobeRay, SampleSum};
use crate::gather::parts::{Look, Parts};
use crate::gather::picture_rays::PictureRays;
use crate::gather::ray_scene::{DARK, RayView, Receiver, SurfacePoint};
use crate::gather::sampling::{point, shifted};
use crate::gather::step::{GatherStep, more_pixels};
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;
use std::cell::LazyCell;
use std::f32::consts::PI;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Octaves of spread distinguished below a light's mean level and above it, and bins per octave.
const OCTAVES: u32 = 24;
const PER_OCTAVE: usize = 16;
const BINS: usize = 2 * OCTAVES as usize * PER_OCTAVE;
/// The variance of stratified samples falls with this power of their number.
const STRATIFIED: f32 = 1.25;
/// Least spread of a pixel relative to a neighbour's: its first samples may all miss an edge.
const NEIGHBOUR: f32 = 0.5;
/// Variance, relative to that of units with the most samples, which more samples need not lower.
const IN_VAIN: f64 = 0.25;
/// Share of the noise of a pixel's samples that remains after filtering.
const EVENED: f32 = 0.25;
/// Part of a pixel over which a sample averages a projection, relative to its share of the first
/// samples. Samples lie anywhere in the pixel: with 1, a projection would be blurred beyond it.
const FOOTPRINT: f64 = 0.25;
/// Seed of the point sequence.
const SEED: u32 = 1000;

/// Unit over which samples are summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Whole pixels: more samples resolve edges better.
    Pixel,
    /// Parts of pixels, whose light is filtered afterwards.
    Part,
}

/// Direct light of several lights, which share the lookup of what a sample shows.
pub struct DirectLight<'a> {
    pub rays: PictureRays<'a>,
    pub parts: &'a Parts,
    pub emitters: &'a [Emitter<'a>],
    pub unit: Unit,
    /// Number of lights finished before and in all, for progress.
    pub report: (usize, usize),
}

/// Sample sums of each unit and light, and the numbers of samples.
type Sampled = (Vec<SampleSums>, Vec<u16>);

impl DirectLight<'_> {
    /// Temporary bytes of a unit for each light.
    pub const UNIT_BYTES: usize = size_of::<SampleSums>() + size_of::<u16>();

    /// Adds each light, and the panel itself where it is visible, to an image of its reflected
    /// light.
    ///
    /// # Errors
    /// On cancel.
    pub fn add_to(&self, pictures: &mut [Vec<f32>], work: Work<'_>) -> Result<(), Cancelled> {
        let (sums, samples) = self.sums(pictures, work)?;
        let lights = self.emitters.len();
        for (light, picture) in pictures.iter_mut().enumerate() {
            for (pixel, out) in picture.chunks_exact_mut(3).enumerate() {
                for unit in self.units(pixel) {
                    let share = self.share(unit);
                    let at = unit * lights + light;
                    let radiance = sums[at].radiance(f32::from(samples[at]));
                    let channels = out.iter_mut().zip(radiance);
                    channels.for_each(|(p, r)| *p += share * r);
                }
            }
        }
        Ok(())
    }

    /// Light of each unit: three channels of each light, and the variance of the highest one.
    ///
    /// # Errors
    /// On cancel.
    pub fn with_variance(
        &self,
        pictures: &[impl AsRef<[f32]>],
        work: Work<'_>,
    ) -> Result<(Vec<f32>, Vec<f32>), Cancelled> {
        let (sums, samples) = self.sums(pictures, work)?;
        let all = || sums.iter().zip(samples.iter().map(|n| f32::from(*n)));
        let light = all().flat_map(|(sums, n)| sums.radiance(n)).collect();
        let variance = |(sums, n): (&SampleSums, f32)| sums.spread(n).powi(2) / (n - 1.0).max(1.0);
        Ok((light, all().map(variance).collect()))
    }

    fn sums(&self, pictures: &[impl AsRef<[f32]>], work: Work<'_>) -> Result<Sampled, Cancelled> {
        let first = self.rays.step.first as u16;
        let lights = self.emitters.len();
        let mut sums = vec![SampleSums::default(); self.count() * lights];
        let mut samples = vec![first; sums.len()];
        self.sample(&mut sums, 0, &samples, work)?;
        for (light, picture) in pictures.iter().enumerate() {
            let own: Vec<SampleSums> = sums.iter().skip(light).step_by(lights).copied().collect();
            let allotted = self.allot(&own, picture.as_ref());
            let places = samples.iter_mut().skip(light).step_by(lights);
            places.zip(allotted).for_each(|(to, from)| *to = from);
        }
        self.sample(&mut sums, first, &samples, work)?;
        Ok((sums, samples))
    }

    /// Number of units.
    fn count(&self) -> usize {
        match self.unit {
            Unit::Pixel => self.parts.pixels.count(),
            Unit::Part => self.parts.all().len(),
        }
    }

    /// Indices of the units of a pixel.
    fn units(&self, pixel: usize) -> Range<usize> {
        match self.unit {
            Unit::Pixel => pixel..pixel + 1,
            Unit::Part => self.parts.pixels.range(pixel),
        }
    }

    /// Share of its pixel.
    fn share(&self, unit: usize) -> f32 {
        match self.unit {
            Unit::Pixel => 1.0,
            Unit::Part => self.parts.all()[unit].share,
        }
    }

    /// Root mean square of a light's image, from the first samples.
    fn level(&self, sums: &[SampleSums], indirect: &[f32]) -> f64 {
        let first = self.rays.step.first as f32;
        let square = |(pixel, indirect): (usize, &[f32])| {
            let direct = self
                .units(pixel)
                .map(|unit| self.share(unit) * sums[unit].level / first);
            f64::from(direct.sum::<f32>() + indirect[1]).powi(2)
        };
        let pixels = indirect.chunks_exact(3).enumerate();
        (pixels.map(square).sum::<f64>() / (indirect.len() / 3).max(1) as f64).sqrt()
    }

    /// Adds samples to the sums of all units and lights, from index `start` up to the number
    /// allotted to each.
    fn sample(
        &self,
        sums: &mut [SampleSums],
        start: u16,
        samples: &[u16],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let lights = self.emitters.len();
        let [width, height] = self.rays.size;
        let rows: Vec<&mut [SampleSums]> = match self.unit {
            Unit::Pixel => sums.chunks_mut(width * lights).collect(),
            Unit::Part => self.parts.rows(width, lights, sums),
        };
        let sampled = AtomicUsize::new(0);
        rows.into_par_iter().enumerate().try_for_each(|(y, sums)| {
            work.check()?;
            let mut sums = sums.chunks_exact_mut(lights);
            for pixel in y * width..(y + 1) * width {
                for (unit, sums) in self.units(pixel).zip(&mut sums) {
                    let ends = &samples[unit * lights..(unit + 1) * lights];
                    let end = ends.iter().copied().max().unwrap_or(start);
                    for k in start..end {
                        self.add_sample((pixel, unit), k, sums, ends);
                    }
                }
            }
            let sampled = sampled.fetch_add(1, Ordering::Relaxed) + 1;
            // The first samples are few.
            if start > 0 {
                let (before, all) = self.report;
                let done = before + lights * sampled / height;
                work.progress.report("direct light", done, all);
            }
            Ok(())
        })
    }

    /// Adds sample `k` of a unit to the sums of the lights that take more than `k`.
    fn add_sample(
        &self,
        (pixel, unit): (usize, usize),
        k: u16,
        sums: &mut [SampleSums],
        ends: &[u16],
    ) {
        let random = point(self.rays.index(pixel) + u32::from(k), SEED);
        let mut levels = [0.0; BLOCK];
        let mut add =
            |view, weight| self.add_view((view, weight), random, (sums, &mut levels), (k, ends));
        match self.unit {
            Unit::Part if self.parts.all()[unit].look == Look::Gloss => return,
            Unit::Part => {
                let view = self.rays.on_part(self.parts, unit, pixel, u32::from(k));
                add(view, view.share as f32);
            }
            Unit::Pixel => self.rays.on_pixel(self.parts, pixel, u32::from(k), |view| {
                let share = view.share * self.rays.scene.clearness(view.length);
                add(view, share as f32);
            }),
        }
        for (sums, level) in sums.iter_mut().zip(levels) {
            sums.level += level;
            sums.square += level * level;
        }
    }

    /// Samples a ray from the lobe of a place.
    fn lobe_ray(&self, place: SurfacePoint, random: [f64; 2]) -> LobeRay {
        let random = shifted(random);
        let scene = self.rays.scene;
        let normal = scene.surfaces.facets[place.facet as usize].normal;
        let reflected = scene.reflected(place, self.rays.camera.origin, random);
        let ends = |(way, _)| scene.layers(place.point + normal * scene.offset, way);
        let (way, weight) = reflected.unwrap_or((normal, 0.0));
        LobeRay {
            place,
            way,
            weight,
            ends: reflected.map(ends).unwrap_or_default(),
        }
    }

    /// Adds the light at a place that a sample shows, and its radiance to the sample's `levels`.
    fn add_view(
        &self,
        (view, weight): (RayView, f32),
        random: [f64; 2],
        (sums, levels): (&mut [SampleSums], &mut [f32]),
        (k, ends): (u16, &[u16]),
    ) {
        let scene = self.rays.scene;
        let place = view.place;
        let facet = &scene.surfaces.facets[place.facet as usize];
        let share = FOOTPRINT / f64::from(self.rays.step.first);
        let footprint = || self.rays.sides(view, share);
        // Samples lie all over the pixel, so each needs one point of a texture, not a mean.
        let reflectance = self.rays.reflectance(view, 0.0);
        let here = Receiver::new(facet, place.point, scene.offset);
        let lobe = scene.surfaces.lobe(place.facet);
        let lobe = lobe.filter(|_| view.mirror == DARK);
        let tint = scene.surfaces.tint(view.mirror);
        let eye = self.rays.camera.origin;
        let seen = (here, Some(eye));
        let wide = lobe.filter(|lobe| lobe.is_wide());
        // Only panels need it.
        let ray = LazyCell::new(|| self.lobe_ray(place, random));
        let lights = self.emitters.iter().zip(sums).zip(levels).zip(ends);
        for (((emitter, sums), level), _) in lights.filter(|(_, end)| k < **end) {
            if emitter.is_of(facet.material) {
                for (sum, tint) in sums.shining.iter_mut().zip(tint) {
                    *sum += weight * tint as f32;
                }
                *level += weight;
            }
            if facet.is_black() {
                continue;
            }
            let sample = emitter.sample(scene, here, footprint, random);
            let colour = emitter.colour(random);
            let reflects = emitter.reflectance(lobe, seen, reflectance);
            let factors = [0, 1, 2].map(|k| weight * reflects[k] as f32 * colour[k]);
            for (sum, factor) in sums.channels.iter_mut().zip(factors) {
                sum.add(sample, factor);
            }
            if let Some((lobe, end)) = wide.zip(sample.end) {
                let way = (eye - place.point).normalized();
                let light = emitter.in_gloss(scene, (lobe, here.normal, way), &end, &ray);
                let light = weight * light as f32;
                for (sum, tint) in sums.shining.iter_mut().zip(lobe.tint) {
                    *sum += light * tint as f32;
                }
                *level += light;
            }
            if sample.visible > 0.0 {
                let highest = factors.iter().copied().fold(0.0, f32::max);
                *level += highest * sample.unoccluded as f32 / PI;
            }
        }
    }
}

/// Sample sums of one light in a unit.
#[derive(Clone, Copy, Debug, Default)]
struct SampleSums {
    /// For each channel, weighted by the reflectance of the visible surface.
    channels: [SampleSum; 3],
    /// Samples that show the light itself, for each channel.
    shining: [f32; 3],
    /// Sum of radiance and of its square, for the spread.
    level: f32,
    square: f32,
}

impl SampleSums {
    fn radiance(&self, samples: f32) -> [f32; 3] {
        [0, 1, 2].map(|c| (self.channels[c].irradiance() / PI + self.shining[c]) / samples)
    }

    /// Standard deviation of a sample.
    fn spread(&self, samples: f32) -> f32 {
        let mean = self.level / samples;
        (self.square / samples - mean * mean).max(0.0).sqrt()
    }
}

/// Bin of a spread relative to the light's mean level: a part of an octave.
fn bin(spread: f64) -> usize {
    let octave = f64::from(OCTAVES) + spread.log2();
    ((octave.max(0.0) * PER_OCTAVE as f64) as usize).min(BINS - 1)
}

/// Sum of the squares in each bin of spreads relative to the light's mean level, each with a weight.
fn squares(spreads: impl Iterator<Item = (f64, f64)>) -> Vec<f64> {
    let mut squares = vec![0.0; BINS];
    spreads.for_each(|(weight, spread)| squares[bin(spread)] += weight * spread.powi(2));
    squares
}

/// Samples of the units of a bin. Optimal numbers are proportional to the spread; they are powers
/// of two, over which the point sequence is even.
fn samples(bin: usize, shift: usize, [first, most]: [u32; 2]) -> u32 {
    let octave = ((bin + shift) / PER_OCTAVE) as u32;
    (first << octave.saturating_sub(OCTAVES).min(16)).min(most)
}

/// Least shift of the numbers of samples with which the noise of the mean image is at most `aim`,
/// or is mostly that of units with the `most` samples. More samples of others would then be in
/// vain, as with a bright lamp in a mirror. `squares` are the mean squared spreads of each bin.
fn shift(squares: &[f64], [first, most]: [u32; 2], aim: f64) -> usize {
    let is_enough = |shift: &usize| {
        let [mut full, mut others] = [0.0; 2];
        for (bin, square) in squares.iter().enumerate() {
            let samples = samples(bin, *shift, [first, most]);
            let variance = square / f64::from(samples).powf(f64::from(STRATIFIED));
            let sum = if samples < most {
                &mut others
            } else {
                &mut full
            };
            *sum += variance;
        }
        full + others <= aim * aim || others <= IN_VAIN * full
    };
    let all = OCTAVES as usize * PER_OCTAVE;
    (0..all).find(is_enough).unwrap_or(all)
}

impl DirectLight<'_> {
    /// Samples of a light for each unit, so that the noise of the whole image meets the step's
    /// target: more where the first samples differ.
    fn allot(&self, sums: &[SampleSums], indirect: &[f32]) -> Vec<u16> {
        let GatherStep {
            first,
            edge,
            most,
            noise: aim,
            ..
        } = self.rays.step;
        let aim = aim * more_pixels(self.rays.size).sqrt();
        let level = self.level(sums, indirect);
        if level == 0.0 {
            return vec![first as u16; sums.len()];
        }
        let spreads = self.spreads(sums);
        let relative = |spread: &f32| f64::from(*spread) / level;
        let share = 1.0 / self.parts.pixels.count() as f64;
        let squares = squares(spreads.iter().map(|s| (share, relative(s))));
        let shift = shift(&squares, [first, most], aim);
        let of = |(unit, s): (usize, &f32)| {
            let least = if self.is_mirrored(unit) { edge } else { first };
            samples(bin(relative(s)), shift, [first, most]).max(least) as u16
        };
        spreads.iter().enumerate().map(of).collect()
    }
}

impl DirectLight<'_> {
    /// True for a pixel that shows a reflection in a glossy surface: few of its samples may hit
    /// bright objects.
    fn is_mirrored(&self, unit: usize) -> bool {
        let own = || self.parts.pixels.get(unit).iter();
        self.unit == Unit::Pixel && own().any(|part| part.look == Look::Mirrored)
    }

    /// Approximate standard deviation of a sample of each unit, as a share of its pixel, from its
    /// first samples, raised by that of adjacent units.
    fn spreads(&self, sums: &[SampleSums]) -> Vec<f32> {
        let first = self.rays.step.first as f32;
        let spread = |unit: usize| sums[unit].spread(first);
        // Filtered light is smooth: its own spread would favour units whose first samples are low.
        let (neighbours, left) = match self.unit {
            Unit::Pixel => (NEIGHBOUR, 1.0),
            Unit::Part => (1.0, EVENED),
        };
        let [width, height] = self.rays.size;
        let highest = |pixel| self.units(pixel).map(spread).fold(0.0, f32::max);
        let highest: Vec<f32> = (0..width * height).map(highest).collect();
        let mut out = Vec::with_capacity(sums.len());
        for pixel in 0..width * height {
            let (x, y) = (pixel % width, pixel / width);
            let mut most = 0.0_f32;
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    most = most.max(highest[y * width + x]);
                }
            }
            let of = |unit| left * self.share(unit) * spread(unit).max(neighbours * most);
            out.extend(self.units(pixel).map(of));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisier_units_have_more_samples_until_the_aim_is_met() {
        let own = squares([(0.9, 0.02), (0.1, 1.0)].into_iter());
        let shift = shift(&own, [8, 1024], 0.02);
        let [few, many] = [0.02, 1.0].map(|spread| samples(bin(spread), shift, [8, 1024]));
        assert_eq!(few, 8);
        let noise = (0.1 / f64::from(many).powf(1.25) + 0.9 * 4e-4 / 8_f64.powf(1.25)).sqrt();
        assert!(many > 8 && many < 1024 && noise < 0.02, "{many}: {noise}");
    }

    /// A few pixels show a lamp in a mirror, and no number of samples makes them as even as asked.
    #[test]
    fn units_that_cannot_be_cured_cost_the_others_nothing() {
        let [calm, hopeless] = [0.05, 200.0];
        let own = squares([(0.999, calm), (0.001, hopeless)].into_iter());
        let shift = shift(&own, [8, 64], 0.05);
        let [few, many] = [calm, hopeless].map(|spread| samples(bin(spread), shift, [8, 64]));
        assert_eq!([few, many], [8, 64]);
    }
}
