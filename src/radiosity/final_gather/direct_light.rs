//! Direct light in the pixels of one light: more samples where the first ones differ.

use crate::radiosity::direct::projector::pixel as footprint;
use crate::radiosity::final_gather::cells::SurfacePoint;
use crate::radiosity::final_gather::emitter::{Emitter, Sample, SampleSum};
use crate::radiosity::final_gather::picture_rays::{PictureRays, each_pixel};
use crate::radiosity::final_gather::sampling::point;
use crate::radiosity::final_gather::step::GatherStep;
use crate::work::{Cancelled, Work};
use std::f64::consts::PI;

/// Of the spread of a pixel's samples, what its neighbours are taken to have at least: the first
/// samples may all miss an edge.
const SPREAD: f64 = 0.5;
/// Seed of the sequence of points.
const SEED: u32 = 1000;

/// Direct light of one light in pixels.
pub struct DirectLight<'a> {
    pub rays: PictureRays<'a>,
    /// Facets of the first samples of each pixel.
    pub seen: &'a [u32],
    pub emitter: &'a Emitter<'a>,
}

impl DirectLight<'_> {
    /// Adds the light, and the panel itself where it is seen, to a picture of its reflected light.
    ///
    /// # Errors
    /// On cancel.
    pub fn add_to(&self, picture: &mut [f32], work: Work<'_>) -> Result<(), Cancelled> {
        let (first, size) = (self.rays.step.first, self.rays.size);
        let begun = each_pixel(size, work, |pixel| {
            let mut sums = PixelSums::default();
            self.sample(pixel, 0..first, &mut sums);
            sums
        })?;
        let samples = allot(&self.rays, &begun, picture);
        let sums = each_pixel(size, work, |pixel| {
            let mut sums = begun[pixel];
            self.sample(pixel, first..samples[pixel], &mut sums);
            sums
        })?;
        for (pixel, sums) in picture.chunks_exact_mut(3).zip(&sums) {
            for (p, radiance) in pixel.iter_mut().zip(sums.radiance()) {
                *p += radiance as f32;
            }
        }
        Ok(())
    }

    /// Adds some samples of a pixel to its sums.
    fn sample(&self, pixel: usize, samples: std::ops::Range<u32>, sums: &mut PixelSums) {
        let scene = self.rays.scene;
        for k in samples {
            sums.samples += 1.0;
            let Some(place) = self.place(pixel, k) else {
                continue;
            };
            let facet = &scene.surfaces.facets[place.facet as usize];
            let mut level = 0.0;
            if self.emitter.is_of(facet.material) {
                sums.shining += 1.0;
                level += 1.0;
            }
            if !facet.is_black() {
                let footprint = || {
                    let weight = 1.0 / f64::from(self.rays.step.first);
                    footprint(self.rays.camera, place.point, facet.normal, weight)
                };
                let random = point(self.rays.index(pixel) + k, SEED);
                let here = (place.point, facet.normal);
                let sample = self.emitter.sample(scene, here, footprint, random);
                for (sum, r) in sums.channels.iter_mut().zip(facet.reflectance) {
                    sum.add(Sample {
                        unoccluded: r * sample.unoccluded,
                        sampled: r * sample.sampled,
                        visible: r * sample.visible,
                    });
                }
                if sample.visible > 0.0 {
                    level += facet.highest_reflectance() * sample.unoccluded / PI;
                }
            }
            sums.level += level;
            sums.square += level * level;
        }
    }

    fn place(&self, pixel: usize, k: u32) -> Option<SurfacePoint> {
        let first = self.rays.step.first;
        if k >= first {
            return self.rays.place(pixel, k);
        }
        let facet = self.seen[pixel * first as usize + k as usize];
        self.rays.on_facet(pixel, k, facet)
    }
}

/// Sums over the samples of one light in a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct PixelSums {
    /// Of each channel, weighted by the reflectance of what the sample shows.
    channels: [SampleSum; 3],
    /// Samples that show the light itself.
    shining: f64,
    /// Radiance of the samples and its square, for their spread.
    level: f64,
    square: f64,
    samples: f64,
}

impl PixelSums {
    fn radiance(&self) -> [f64; 3] {
        let all = self.samples.max(1.0);
        self.channels
            .map(|c| (c.irradiance() / PI + self.shining) / all)
    }
}

/// How many samples each pixel takes, so that the noise of the whole picture is what the step
/// allows: more where the first samples differ.
fn allot(rays: &PictureRays<'_>, sums: &[PixelSums], indirect: &[f32]) -> Vec<u32> {
    let GatherStep {
        first,
        most,
        noise: aim,
        ..
    } = rays.step;
    let n = f64::from(first);
    let mut square = 0.0;
    for (sums, indirect) in sums.iter().zip(indirect.chunks_exact(3)) {
        let mean = sums.level / n + f64::from(indirect[1]);
        square += mean * mean;
    }
    let pixels = sums.len() as f64;
    let level = (square / pixels).sqrt();
    let spread = |s: &PixelSums| {
        let mean = s.level / n;
        (s.square / n - mean * mean).max(0.0).sqrt()
    };
    let own: Vec<f64> = sums.iter().map(spread).collect();
    let spreads = with_neighbours(&own, rays.size);
    let allotted = |scale: f64| {
        let of = |s: &f64| {
            let times = (scale * s / n).max(1.0).log2().round().exp2();
            ((n * times) as u32).min(most)
        };
        spreads.iter().map(of).collect::<Vec<u32>>()
    };
    // Stratified samples do better than their number's root.
    let noise = |samples: &[u32]| {
        let square = spreads.iter().zip(samples);
        let square: f64 = square.map(|(s, n)| s * s / f64::from(*n).powf(1.25)).sum();
        (square / pixels).sqrt()
    };
    let allowed = aim * level;
    if level == 0.0 || noise(&allotted(0.0)) <= allowed {
        return vec![first; sums.len()];
    }
    // Samples are fewest for a given noise where they go with the spread.
    let (mut low, mut high) = (1e-3 / level, 1e9 / level);
    for _ in 0..40 {
        let scale = (low * high).sqrt();
        if noise(&allotted(scale)) > allowed {
            low = scale;
        } else {
            high = scale;
        }
    }
    allotted(high)
}

/// The spreads of pixels, raised where a neighbour's is much greater.
fn with_neighbours(own: &[f64], [width, height]: [usize; 2]) -> Vec<f64> {
    let of = |at: usize| {
        let (x, y) = (at % width, at / width);
        let mut most = 0.0_f64;
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            for x in x.saturating_sub(1)..(x + 2).min(width) {
                most = most.max(own[y * width + x]);
            }
        }
        own[at].max(SPREAD * most)
    };
    (0..own.len()).map(of).collect()
}
