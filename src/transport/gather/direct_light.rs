//! Direct light in the pixels of one light: more samples where the first ones differ.

use crate::direct::projector::pixel as footprint;
use crate::gather::emitter::{Emitter, Receiver, SampleSum};
use crate::gather::irradiance_filter::SmoothPixel;
use crate::gather::picture_rays::PictureRays;
use crate::gather::sampling::point;
use crate::gather::step::{GatherStep, more_pixels};
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Spreads are distinguished over so many octaves below a light's mean level and as many above it, in
/// so many parts each.
const OCTAVES: u32 = 24;
const PER_OCTAVE: usize = 16;
const BINS: usize = 2 * OCTAVES as usize * PER_OCTAVE;
/// The variance of stratified samples falls with this power of their number.
const STRATIFIED: f32 = 1.25;
/// A pixel's spread is at least this share of a neighbour's: its first samples may all miss an edge.
const NEIGHBOUR: f32 = 0.5;
/// Share of the noise of a pixel's samples that is left when it is evened out.
const EVENED: f32 = 0.25;
/// Seed of the sequence of points.
const SEED: u32 = 1000;

/// Direct light of several lights in pixels: what a sample of a pixel shows is found once for all
/// of them.
pub struct DirectLight<'a> {
    pub rays: PictureRays<'a>,
    /// Facets of the first samples of each pixel.
    pub seen: &'a [u32],
    pub emitters: &'a [Emitter<'a>],
    /// Pixels whose light is evened out afterwards, where it is.
    pub evened: Option<&'a [Option<SmoothPixel>]>,
    /// Lights that were done before, and of how many, for progress.
    pub report: (usize, usize),
}

impl DirectLight<'_> {
    /// Bytes that a pixel takes for each light meanwhile.
    pub const PIXEL_BYTES: usize = size_of::<PixelSums>() + size_of::<u16>();

    /// Adds each light, and the panel itself where it is seen, to a picture of its reflected light.
    ///
    /// # Errors
    /// On cancel.
    pub fn add_to(&self, pictures: &mut [Vec<f32>], work: Work<'_>) -> Result<(), Cancelled> {
        let (sums, samples) = self.sums(pictures, work)?;
        let lights = self.emitters.len();
        for (light, picture) in pictures.iter_mut().enumerate() {
            let own = (light..sums.len()).step_by(lights);
            for (pixel, at) in picture.chunks_exact_mut(3).zip(own) {
                let radiance = sums[at].radiance(f32::from(samples[at]));
                pixel.iter_mut().zip(radiance).for_each(|(p, r)| *p += r);
            }
        }
        Ok(())
    }

    /// The light of each pixel: three channels of each light, and the variance of the highest one.
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
        let variance = |(sums, n): (&PixelSums, f32)| sums.spread(n).powi(2) / (n - 1.0);
        Ok((light, all().map(variance).collect()))
    }

    /// Sums over the samples of each pixel and light, and their numbers.
    fn sums(
        &self,
        pictures: &[impl AsRef<[f32]>],
        work: Work<'_>,
    ) -> Result<(Vec<PixelSums>, Vec<u16>), Cancelled> {
        let first = self.rays.step.first as u16;
        let lights = self.emitters.len();
        let [width, height] = self.rays.size;
        let mut sums = vec![PixelSums::default(); width * height * lights];
        let mut samples = vec![first; sums.len()];
        self.sample(&mut sums, 0, &samples, work)?;
        for (light, picture) in pictures.iter().enumerate() {
            let own = sums.iter().skip(light).step_by(lights);
            let allotted = self.allot(own, picture.as_ref());
            let places = samples.iter_mut().skip(light).step_by(lights);
            places.zip(allotted).for_each(|(to, from)| *to = from);
        }
        self.sample(&mut sums, first, &samples, work)?;
        Ok((sums, samples))
    }

    /// Adds samples to the sums of all pixels and lights, from the one of number `start` up to as many
    /// as each takes.
    fn sample(
        &self,
        sums: &mut [PixelSums],
        start: u16,
        samples: &[u16],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let lights = self.emitters.len();
        let row = self.rays.size[0] * lights;
        let rows = sums.par_chunks_mut(row).zip(samples.par_chunks(row));
        let sampled = AtomicUsize::new(0);
        rows.enumerate().try_for_each(|(y, (sums, samples))| {
            work.check()?;
            let pixels = sums.chunks_exact_mut(lights);
            for (x, (sums, ends)) in pixels.zip(samples.chunks_exact(lights)).enumerate() {
                let pixel = y * self.rays.size[0] + x;
                let end = ends.iter().copied().max().unwrap_or(start);
                (start..end).for_each(|k| self.sample_pixel(pixel, k, sums, ends));
            }
            let sampled = sampled.fetch_add(1, Ordering::Relaxed) + 1;
            // The first samples are few.
            if start > 0 {
                let ((before, all), rows) = (self.report, self.rays.size[1]);
                let done = before + lights * sampled / rows;
                work.progress.report("direct light", done, all);
            }
            Ok(())
        })
    }

    /// Adds sample `k` of a pixel to the sums of those lights that take so many.
    fn sample_pixel(&self, pixel: usize, k: u16, sums: &mut [PixelSums], ends: &[u16]) {
        let scene = self.rays.scene;
        let Some(place) = self.rays.sample(self.seen, pixel, u32::from(k)) else {
            return;
        };
        let facet = &scene.surfaces.facets[place.facet as usize];
        let footprint = || {
            let weight = 1.0 / f64::from(self.rays.step.first);
            footprint(self.rays.camera, place.point, facet.normal, weight)
        };
        let reflectance = scene.surfaces.reflectance_at(facet, place.point, footprint);
        let reflectance = reflectance.map(|r| r as f32);
        let here = Receiver::new(facet, place.point, scene.offset);
        let random = point(self.rays.index(pixel) + u32::from(k), SEED);
        for ((emitter, sums), end) in self.emitters.iter().zip(sums).zip(ends) {
            if k >= *end {
                continue;
            }
            let mut level = 0.0;
            if emitter.is_of(facet.material) {
                sums.shining += 1.0;
                level += 1.0;
            }
            if !facet.is_black() {
                let sample = emitter.sample(scene, here, footprint, random);
                let colour = emitter.colour(random);
                let factors = [0, 1, 2].map(|k| reflectance[k] * colour[k]);
                for (sum, factor) in sums.channels.iter_mut().zip(factors) {
                    sum.add(sample, factor);
                }
                if sample.visible > 0.0 {
                    let highest = factors.iter().copied().fold(0.0, f32::max);
                    level += highest * sample.unoccluded as f32 / PI;
                }
            }
            sums.level += level;
            sums.square += level * level;
        }
    }
}

/// Sums over the samples of one light in a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    /// Of each channel, weighted by the reflectance of what the sample shows.
    channels: [SampleSum; 3],
    /// Samples that show the light itself.
    shining: f32,
    /// Radiance of the samples and its square, for their spread.
    level: f32,
    square: f32,
}

impl PixelSums {
    fn radiance(&self, samples: f32) -> [f32; 3] {
        self.channels
            .map(|c| (c.irradiance() / PI + self.shining) / samples)
    }

    /// Standard deviation of a sample.
    fn spread(&self, samples: f32) -> f32 {
        let mean = self.level / samples;
        (self.square / samples - mean * mean).max(0.0).sqrt()
    }
}

impl DirectLight<'_> {
    /// How many samples each pixel takes, so that the noise of the whole picture is what the step
    /// allows: more where the first samples differ.
    fn allot<'a>(&self, sums: impl Iterator<Item = &'a PixelSums>, indirect: &[f32]) -> Vec<u16> {
        let GatherStep {
            first,
            most,
            noise: aim,
            ..
        } = self.rays.step;
        let aim = aim * more_pixels(self.rays.size).sqrt();
        // Light that is evened out is smooth: a pixel's own spread would favour those whose first samples
        // are low.
        let neighbour_spread = if self.evened.is_some() {
            1.0
        } else {
            NEIGHBOUR
        };
        let n = first as f32;
        let mut square = 0.0;
        let mut own = Vec::with_capacity(indirect.len() / 3);
        for (sums, indirect) in sums.zip(indirect.chunks_exact(3)) {
            let mean = sums.level / n;
            square += f64::from(mean + indirect[1]).powi(2);
            own.push(sums.spread(n));
        }
        let mut spreads = with_neighbours(&own, self.rays.size, neighbour_spread);
        if let Some(smooth) = self.evened {
            let smooth = spreads.iter_mut().zip(smooth).filter(|(_, s)| s.is_some());
            smooth.for_each(|(spread, _)| *spread *= EVENED);
        }
        let pixels = spreads.len() as f64;
        let level = (square / pixels).sqrt();
        if level == 0.0 {
            return vec![first as u16; spreads.len()];
        }
        // Spreads are taken together by parts of an octave.
        let bin = |s: f32| {
            let octave = f64::from(OCTAVES) + (f64::from(s) / level).log2();
            ((octave.max(0.0) * PER_OCTAVE as f64) as usize).min(BINS - 1)
        };
        let mut squares = vec![0.0; BINS];
        for s in &spreads {
            squares[bin(*s)] += (f64::from(*s) / level).powi(2);
        }
        // Samples are fewest for a given noise where they go with the spread: here in powers of two,
        // over which the sequence of points is even.
        let samples = |bin: usize, shift: usize| {
            let octave = ((bin + shift) / PER_OCTAVE) as u32;
            (first << octave.saturating_sub(OCTAVES).min(16)).min(most)
        };
        let noise = |shift: usize| {
            let of = |(bin, square): (usize, &f64)| {
                square / f64::from(samples(bin, shift)).powf(f64::from(STRATIFIED))
            };
            (squares.iter().enumerate().map(of).sum::<f64>() / pixels).sqrt()
        };
        let most_shift = OCTAVES as usize * PER_OCTAVE;
        let shift = (0..most_shift).find(|shift| noise(*shift) <= aim);
        let shift = shift.unwrap_or(most_shift);
        let of = |s: &f32| samples(bin(*s), shift) as u16;
        spreads.iter().map(of).collect()
    }
}

/// The spreads of pixels, raised to a share of their neighbours'.
fn with_neighbours(own: &[f32], [width, height]: [usize; 2], share: f32) -> Vec<f32> {
    let of = |at: usize| {
        let (x, y) = (at % width, at / width);
        let mut most = 0.0_f32;
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                most = most.max(own[y * width + x]);
            }
        }
        own[at].max(share * most)
    };
    (0..own.len()).map(of).collect()
}
