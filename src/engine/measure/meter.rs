//! Error of an image, measured against independent estimates of some of its pixels.
//!
//! With two independent, unbiased estimates `a` and `b` of a pixel `x`, the mean of `(x - a)(x -
//! b)` is the squared error of `x`, whatever the noise of `a` and `b`; the mean of `a b` is the
//! squared light. Pixels next to a visible emitter do not count, because its edges would dominate.
//! For the same reason light far beyond white is cut where a set has gloss: a lamp mirrored in a
//! sharp floor is a few pixels of ten thousand times the light around them.

use std::f64::consts::PI;

use serde::Serialize;

use footlight_host::work::Work;
use footlight_picture::{Image, tone};
use footlight_show::hash::mix;
use footlight_transport::surfaces::emitter_mask;
use footlight_transport::{PixelEstimator, Setup, Transport, TransportError};

/// Number of jackknife blocks for the interval.
const PARTS: usize = 32;
/// Distance from visible emitters, as a fraction (1/64) of the image's width, within which pixels
/// do not count: surfaces a few centimetres from a flame would dominate.
const AROUND: usize = 64;
/// The light that counts at most in a set with gloss, as a multiple of the image's bright light
/// ([`tone::bright_light`]), which shows just below white.
const BEYOND_WHITE: f64 = 16.0;
/// Half width of a 95 % interval, in standard deviations.
const WIDE: f64 = 1.96;

/// Number of estimates for a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Number of pixels.
    pub pixels: usize,
    /// Paths of each of the two estimates of a pixel.
    pub paths: u32,
}

/// A measured error, relative to the root mean square of the light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MeasuredError {
    /// The estimate.
    pub error: f64,
    /// 95 % confidence interval.
    pub interval: [f64; 2],
    /// Mean light of the image over that of the estimates.
    pub mean_ratio: f64,
    /// Number of pixels estimated.
    pub pixels: usize,
    /// Paths of each estimate.
    pub paths: u32,
    /// Duration in seconds.
    pub seconds: f64,
}

impl MeasuredError {
    /// The expected error given the measurement and a prior: images of this kind usually err by
    /// `usual`, and by up to three times as much. Both squares are weighted by precision and
    /// constrained to be positive.
    pub fn likely(&self, usual: f64) -> f64 {
        let weight = |spread: f64| spread.max(f64::MIN_POSITIVE.sqrt()).powi(-2);
        let (square, most) = (self.error.powi(2), self.interval[1].powi(2));
        let [own, prior] = [
            weight((most - square) / WIDE),
            weight((3.0 * usual).powi(2)),
        ];
        let mean = (own * square + prior * usual.powi(2)) / (own + prior);
        let spread = (own + prior).sqrt().recip();
        // The mean of the positive part of a normal distribution; its integral within 1 % by a
        // logistic curve.
        let at = mean / spread;
        let density = (-0.5 * at * at).exp() / (2.0 * PI).sqrt();
        (mean + spread * density * (1.0 + (-1.702 * at).exp())).sqrt()
    }
}

/// Data shared by all measurements in one view.
pub(super) struct Meter {
    estimator: Box<dyn PixelEstimator>,
    /// False at pixels near visible emitters.
    counted: Vec<bool>,
    /// True when the set has gloss.
    is_glossy: bool,
}

impl Meter {
    pub fn new(
        renderer: &dyn Transport,
        setup: &Setup,
        work: Work<'_>,
    ) -> Result<Option<Meter>, TransportError> {
        let Some(estimator) = renderer.estimator(setup, work)? else {
            return Ok(None);
        };
        let (near, width) = (emitter_mask::emitters(setup, work)?, setup.view.width);
        Ok(Some(Meter {
            estimator,
            counted: away_from(&near, width, (width / AROUND).max(1)),
            is_glossy: setup.scene.glosses().next().is_some(),
        }))
    }

    /// Measures an image, except the duration.
    pub fn measure(
        &self,
        image: &Image,
        setting: &[f64],
        effort: Effort,
        work: Work<'_>,
    ) -> Result<Option<MeasuredError>, TransportError> {
        let most = self.most_light(image);
        let chosen = choose(image, &self.counted, most, effort.pixels);
        let pixels: Vec<usize> = chosen.iter().map(|(pixel, _)| *pixel).collect();
        let halves = self
            .estimator
            .estimate(setting, &pixels, 0..effort.paths, work)?;
        let mut parts = [Sums::default(); PARTS];
        for (at, ((pixel, weight), halves)) in chosen.iter().zip(&halves).enumerate() {
            if halves.iter().flatten().any(|x| x.is_nan()) {
                continue;
            }
            let rgb = image.data().iter().skip(3 * pixel).take(3);
            if let Some(part) = parts.get_mut(at % PARTS) {
                let halves = halves.map(|half| half.map(|x| x.min(most)));
                part.add(rgb.map(|x| f64::from(*x).min(most)), &halves, *weight);
            }
        }
        Ok(Sums::result(&parts).map(|result| MeasuredError {
            pixels: pixels.len(),
            paths: effort.paths,
            ..result
        }))
    }

    /// The light of a channel beyond which more does not count.
    fn most_light(&self, image: &Image) -> f64 {
        if !self.is_glossy {
            return f64::INFINITY;
        }
        match tone::sampled_bright_light(image) {
            // All light is that of a few pixels.
            0.0 => f64::INFINITY,
            bright => BEYOND_WHITE * bright,
        }
    }
}

/// Chooses counted pixels with weights that make sums over them estimate sums over the image: 0.4
/// of them uniformly, 0.3 by their light up to `most`, and 0.3 by its square, to which the error is
/// relative. Systematic sampling: neighbours are rarely chosen together.
fn choose(image: &Image, counted: &[bool], most: f64, count: usize) -> Vec<(usize, f64)> {
    let light = |x: &f32| f64::from(*x).max(0.0).min(most);
    let bright = |rgb: &[f32]| rgb.iter().map(light).sum::<f64>();
    let all_pixels = image.data().chunks_exact(3).map(bright).enumerate();
    let is_counted = |(pixel, _): &(usize, f64)| counted.get(*pixel).copied().unwrap_or(true);
    let light: Vec<(usize, f64)> = all_pixels.filter(is_counted).collect();
    let (all, pixels) = (
        light.iter().map(|(_, own)| own).sum::<f64>(),
        light.len() as f64,
    );
    let squares = light.iter().map(|(_, own)| own * own).sum::<f64>();
    let chance = |own: f64| match all > 0.0 {
        true => 0.4 / pixels + 0.3 * own / all + 0.3 * own * own / squares,
        false => 1.0 / pixels,
    };
    // An offset independent of patterns in the image.
    let start = (mix(count as u64) >> 11) as f64 / (1_u64 << 53) as f64;
    let (mut sum, mut out) = (0.0, Vec::with_capacity(count));
    for (pixel, own) in &light {
        let chance = chance(*own);
        sum += chance * count as f64;
        while (out.len() as f64 + start) < sum && out.len() < count {
            out.push((*pixel, 1.0 / (chance * pixels)));
        }
    }
    out
}

/// Sums over pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    error: f64,
    light: f64,
    shown: f64,
    estimated: f64,
}

impl Sums {
    fn add(&mut self, rgb: impl Iterator<Item = f64>, halves: &[[f64; 3]; 2], weight: f64) {
        let [a, b] = halves;
        for (x, (a, b)) in rgb.zip(a.iter().zip(b)) {
            self.error += weight * (x - a) * (x - b);
            self.light += weight * a * b;
            self.shown += weight * x;
            self.estimated += weight * 0.5 * (a + b);
        }
    }

    fn with(self, sign: f64, other: &Sums) -> Sums {
        Sums {
            error: self.error + sign * other.error,
            light: self.light + sign * other.light,
            shown: self.shown + sign * other.shown,
            estimated: self.estimated + sign * other.estimated,
        }
    }

    /// Estimate of the squared error.
    fn square(&self) -> f64 {
        self.error / self.light
    }

    /// The error of all blocks, with the jackknife interval.
    fn result(parts: &[Sums]) -> Option<MeasuredError> {
        let all = parts
            .iter()
            .fold(Sums::default(), |sum, part| sum.with(1.0, part));
        let square = all.square();
        if !(all.light > 0.0 && square.is_finite()) {
            return None;
        }
        let count = parts.len() as f64;
        let off = |part: &Sums| (all.with(-1.0, part).square() - square).powi(2);
        let spread = ((count - 1.0) / count * parts.iter().map(off).sum::<f64>()).sqrt();
        let root = |square: f64| square.max(0.0).sqrt();
        // An estimate below zero is chance: its interval begins at zero and is as wide as another.
        let most = square.max(0.0) + WIDE * spread;
        Some(MeasuredError {
            error: root(square),
            interval: [square - WIDE * spread, most].map(root),
            mean_ratio: all.shown / all.estimated,
            pixels: 0,
            paths: 0,
            seconds: 0.0,
        })
    }
}

/// Pixels without a pixel for which `is` is true within `reach` pixels horizontally, vertically or
/// diagonally.
pub fn away_from(is: &[bool], width: usize, reach: usize) -> Vec<bool> {
    let width = width.max(1);
    let mut away = vec![true; is.len()];
    let found = is.iter().enumerate().filter(|(_, is)| **is);
    for (x, y) in found.map(|(at, _)| (at % width, at / width)) {
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        for y in y.saturating_sub(reach)..=y + reach {
            let row = y * width + columns.start..y * width + columns.end;
            if let Some(row) = away.get_mut(row) {
                row.fill(false);
            }
        }
    }
    away
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;

    #[test]
    fn a_neighbourhood_is_nine_pixels_and_ends_at_the_border() {
        let mut seen = vec![false; 5 * 4];
        seen[0] = true;
        let left: Vec<usize> = (0..20).filter(|&i| !away_from(&seen, 5, 1)[i]).collect();
        assert_eq!(left, [0, 1, 5, 6]);
        seen[0] = false;
        seen[5 + 2] = true;
        let counted = away_from(&seen, 5, 1);
        assert_eq!(counted.iter().filter(|c| !**c).count(), 9);
        assert!(counted[0] && counted[4] && counted[15] && !counted[1]);
    }

    /// A pseudo-random number from -1 to 1.
    fn noise(seed: &mut u64) -> f64 {
        *seed = mix(*seed ^ 0x5bd1);
        (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// An image of 96 x 64 with a bright spot.
    fn picture() -> Image {
        let pixel = |k: usize| match (k % 96, k / 96) {
            (70..74, 20..23) => [30.0; 3],
            (x, _) => [0.2 + x as f32 / 100.0; 3],
        };
        Image::from_data(96, 64, (0..96 * 64).flat_map(pixel).collect()).unwrap()
    }

    #[test]
    fn weights_make_sums_over_chosen_pixels_those_of_the_picture() {
        let image = picture();
        let chosen = choose(&image, &[], f64::INFINITY, 512);
        assert_eq!(chosen.len(), 512);
        let light = |at: usize| f64::from(image.data()[3 * at]);
        let mean = chosen.iter().map(|(at, w)| w * light(*at)).sum::<f64>() / 512.0;
        let exact = (0..96 * 64).map(light).sum::<f64>() / (96.0 * 64.0);
        assert!((mean / exact - 1.0).abs() < 0.02, "{mean} {exact}");
    }

    /// For images with 3 % error at every pixel and estimates with 10 % noise, the interval holds
    /// the error in at least 36 of 40 cases, and noise alone is not taken for an error.
    #[test]
    fn intervals_hold_the_error() {
        let image = picture();
        let mut seed = 1;
        let mut held = [0, 0];
        for _ in 0..40 {
            for (held, off) in held.iter_mut().zip([0.03, 0.0]) {
                let mut parts = [Sums::default(); PARTS];
                for (at, (pixel, weight)) in
                    choose(&image, &[], f64::INFINITY, 512).iter().enumerate()
                {
                    let truth = f64::from(image.data()[3 * pixel]);
                    let sign = noise(&mut seed).signum();
                    let x = truth * (1.0 + off * sign);
                    let mut half = || [truth * (1.0 + 0.17 * noise(&mut seed)); 3];
                    let halves = [half(), half()];
                    parts[at % PARTS].add([x; 3].into_iter(), &halves, *weight);
                }
                let found = Sums::result(&parts);
                let [least, most] = found.map_or([1.0, 0.0], |found| found.interval);
                *held += usize::from(least <= off && off <= most);
            }
        }
        assert!(held.into_iter().all(|held| held >= 36), "{held:?}");
    }

    /// Estimates 2 % more light than an image's, and half of what is beyond 1,000.
    struct HalfTheGlint(Image);

    impl PixelEstimator for HalfTheGlint {
        fn estimate(
            &self,
            _: &[f64],
            pixels: &[usize],
            _: std::ops::Range<u32>,
            _: Work<'_>,
        ) -> Result<Vec<[[f64; 3]; 2]>, TransportError> {
            let of = |pixel: &usize| match f64::from(self.0.data()[3 * pixel]) {
                x if x > 1000.0 => 0.5 * x,
                x => 1.02 * x,
            };
            Ok(pixels.iter().map(|pixel| [[of(pixel); 3]; 2]).collect())
        }
    }

    fn meter(image: &Image, is_glossy: bool) -> Meter {
        Meter {
            estimator: Box::new(HalfTheGlint(image.clone())),
            counted: vec![true; 96 * 64],
            is_glossy,
        }
    }

    /// Where a lamp is mirrored, the picture is white, whether it is ten thousand times as bright
    /// as the rest or twenty thousand times.
    #[test]
    fn a_mirrored_lamp_counts_as_white() {
        let mut image = picture();
        image.data_mut().iter_mut().for_each(|x| *x = x.min(5.0));
        image.data_mut()[3 * 4000..3 * 4002].fill(70_000.0);
        let effort = Effort {
            pixels: 512,
            paths: 1,
        };
        let measured = |is_glossy| {
            let found = meter(&image, is_glossy).measure(&image, &[], effort, Work::silent());
            found.unwrap().unwrap().error
        };
        assert!((measured(true) - 0.02).abs() < 0.002, "{}", measured(true));
        assert!(measured(false) > 0.9, "{}", measured(false));
    }

    /// A spot on less than a hundredth of a black picture is not taken for a mirrored lamp.
    #[test]
    fn the_only_light_counts() {
        let mut image = picture();
        image.data_mut().fill(0.0);
        image.data_mut()[3 * 4000..3 * 4002].fill(100.0);
        assert_eq!(meter(&image, true).most_light(&image), f64::INFINITY);
    }

    #[test]
    fn an_estimate_below_zero_does_not_say_that_there_is_no_error() {
        let part = |at: usize| Sums {
            error: -1e-4 + 1e-5 * (at % 2) as f64,
            light: 1.0,
            shown: 1.0,
            estimated: 1.0,
        };
        let parts: [Sums; PARTS] = std::array::from_fn(part);
        let found = Sums::result(&parts).unwrap();
        assert_eq!(found.error, 0.0);
        assert_eq!(found.interval[0], 0.0);
        assert!(found.interval[1] > 1e-4, "{:?}", found.interval);
    }

    /// A narrow interval determines the result; a wide one leaves the usual error.
    #[test]
    fn a_wide_interval_leaves_what_is_usual() {
        let likely = |error, most: f64| {
            let measured = MeasuredError {
                error,
                interval: [0.0, most],
                mean_ratio: 1.0,
                pixels: 512,
                paths: 32,
                seconds: 0.0,
            };
            measured.likely(0.02)
        };
        assert!((likely(0.06, 0.0601) - 0.06).abs() < 1e-4);
        assert!((0.004..0.02).contains(&likely(0.0, 0.017)));
        let (wide, wider) = (likely(0.1, 0.5), likely(0.1, 5.0));
        assert!(
            (wide / wider - 1.0).abs() < 0.05 && wide < 0.07,
            "{wide} {wider}"
        );
    }

    #[test]
    fn a_dark_picture_is_not_measured() {
        assert!(Sums::result(&[Sums::default(); PARTS]).is_none());
    }
}
