//! Error of an image, measured against independent estimates of some of its pixels.
//!
//! With two independent, unbiased estimates `a` and `b` of a pixel `x`, the mean of `(x - a)(x -
//! b)` is the squared error of `x`, whatever the noise of `a` and `b`; the mean of `a b` is the
//! squared light. Pixels next to a visible emitter do not count,
//! because its edges would dominate.

use std::f64::consts::PI;
use std::sync::Arc;

use serde::Serialize;

use crate::estimate::Estimate;
use crate::heads::{Unseen, frame};
use crate::rendering::SetupImages;
use crate::{Document, Engine, Error};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_show::hash::mix;
use footlight_show::model::Pose;
use footlight_show::units::{ErrorUnit, Time};
use footlight_transport::surfaces::emitter_mask;
use footlight_transport::{PixelEstimator, Quality, Setup, Transport, TransportError};

/// Number of jackknife blocks for the interval.
const PARTS: usize = 32;
/// Distance from visible emitters, as a fraction (1/64) of the image's width, within which pixels
/// do not count: surfaces a few centimetres from a flame would dominate.
const AROUND: usize = 64;
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

/// Effort for a moment of a show: about a twentieth of the time of its images.
const EFFORT: Effort = Effort {
    pixels: 512,
    paths: 32,
};

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

/// A measured moment of a show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredMoment {
    /// Index into [`Show::cues`](footlight_show::model::Show::cues) of the cue that runs or is complete
    /// then.
    pub cue: usize,
    /// Its time.
    pub time: Time,
    /// The error of its image.
    pub measured: MeasuredError,
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

/// Measures an image of a setting in the current view. `None` when the renderer has no estimator,
/// or the image is dark.
///
/// # Errors
/// [`Error::NoSetup`], or an error of rendering.
pub fn measure(
    engine: &Engine,
    image: &Image,
    (setting, poses): (&[f64], &[Pose]),
    effort: Effort,
) -> Result<Option<MeasuredError>, Error> {
    let begin = engine.host.clock.seconds();
    let (estimate, work) = (engine.estimate(), engine.work());
    let moment = StandingMoment::new(&engine.document, estimate.rendering()?, setting, poses)?;
    let Some(meter) = Meter::new(engine.host.renderer.as_ref(), &moment.setup, work)? else {
        return Ok(None);
    };
    let found = meter.measure(image, &moment.setting, effort, work)?;
    Ok(found.map(|found| MeasuredError {
        seconds: engine.host.clock.seconds() - begin,
        ..found
    }))
}

/// Measures the moment with the largest predicted error, with the existing images. `None` when it
/// cannot be measured, or memory is not sufficient.
///
/// # Errors
/// [`Error::NotRendered`], or an error of rendering.
pub fn measure_worst(engine: &Engine) -> Result<Option<MeasuredMoment>, Error> {
    let estimate = engine.estimate();
    let Some(worst) = estimate.worst_moment(ErrorUnit::Light)? else {
        return Ok(None);
    };
    let Ok(heads) = estimate.heads_seen() else {
        return Ok(None);
    };
    let setting = engine.document.setting(worst.time);
    let poses = engine.document.timeline().poses(worst.time);
    let pool = (estimate.rendered()?, heads.as_ref());
    let image = frame(pool, &setting, &poses, engine.work())?;
    let found = match measure(engine, &image, (&setting, &poses), EFFORT) {
        // Images are usable without the measurement.
        Err(Error::Render(TransportError::Memory { .. })) => None,
        found => found?,
    };
    Ok(found.map(|measured| MeasuredMoment {
        cue: worst.cue,
        time: worst.time,
        measured,
    }))
}

/// A moment with its heads as fixed lights, for the estimator.
struct StandingMoment {
    setup: Setup,
    setting: Vec<f64>,
}

impl StandingMoment {
    fn new(
        document: &Document,
        rendering: &SetupImages,
        setting: &[f64],
        poses: &[Pose],
    ) -> Result<StandingMoment, Error> {
        let own = document.show().coordinates().len();
        Ok(StandingMoment {
            setup: document.standing(&rendering.setup, poses)?,
            setting: setting.iter().copied().take(own).collect(),
        })
    }
}

/// Moments of a show to measure, with all data needed, for any thread.
pub(crate) struct MeasureJob {
    pub setup: Setup,
    pub quality: Quality,
    /// Multiple of the usual effort.
    pub effort: usize,
    moments: Vec<(usize, Time, StandingMoment, Image)>,
}

impl MeasureJob {
    /// Up to three moments of the show with the current images: the one predicted worst, the
    /// brightest, and one chosen pseudo-randomly from the text. If these were measured, the one
    /// with the largest possible error, with four times the effort.
    pub fn new(estimate: &Estimate<'_>, work: Work<'_>) -> Result<MeasureJob, Error> {
        let pool = estimate.rendered()?;
        let (rendering, quality) = (estimate.rendering()?, estimate.coarse_steps()[1]);
        let document = estimate.document;
        let heads = match estimate.heads_seen() {
            Ok(heads) => heads,
            // The heads' light in this view is unknown.
            Err(Unseen) => return Ok(MeasureJob::of_nothing(rendering, quality)),
        };
        let with_picture = |(cue, time)| {
            let (setting, poses) = (document.setting(time), document.timeline().poses(time));
            let image = frame((pool, heads.as_ref()), &setting, &poses, work)?;
            let moment = StandingMoment::new(document, rendering, &setting, &poses)?;
            Ok::<_, Error>((cue, time, moment, image))
        };
        let before = rendering.measured_at(quality, estimate.document);
        let (moments, effort) = match before.and_then(|m| Some((m.doubtful()?, 4 * m.effort))) {
            Some((doubtful, effort)) => (vec![(doubtful.cue, doubtful.time)], effort),
            None => (moments(estimate)?, 1),
        };
        let moments = moments.into_iter().map(with_picture);
        Ok(MeasureJob {
            setup: rendering.setup.clone(),
            quality,
            effort,
            moments: moments.collect::<Result<_, _>>()?,
        })
    }

    fn of_nothing(rendering: &SetupImages, quality: Quality) -> MeasureJob {
        MeasureJob {
            setup: rendering.setup.clone(),
            quality,
            effort: 1,
            moments: Vec::new(),
        }
    }

    /// Runs the measurement; empty when nothing can be measured.
    pub fn run(
        &self,
        renderer: &dyn Transport,
        work: Work<'_>,
    ) -> Result<Vec<MeasuredMoment>, TransportError> {
        // More pixels, and more paths for each.
        let by = self.effort.isqrt();
        let effort = Effort {
            pixels: EFFORT.pixels * by,
            paths: EFFORT.paths * by as u32,
        };
        let mut measured = Vec::new();
        let mut meter: Option<(&Setup, Meter)> = None;
        for (at, (cue, time, moment, image)) in self.moments.iter().enumerate() {
            work.progress.report("measuring", at, self.moments.len());
            // Heads have other poses at each moment.
            let known = meter.take().filter(|(setup, _)| **setup == moment.setup);
            let (_, meter) = match known {
                Some(known) => meter.insert(known),
                None => match Meter::new(renderer, &moment.setup, work) {
                    Ok(Some(new)) => meter.insert((&moment.setup, new)),
                    // Images are usable without the measurement.
                    Ok(None) | Err(TransportError::Memory { .. }) => return Ok(measured),
                    Err(error) => return Err(error),
                },
            };
            let found = meter.measure(image, &moment.setting, effort, work)?;
            measured.extend(found.map(|measured| MeasuredMoment {
                cue: *cue,
                time: *time,
                measured,
            }));
        }
        Ok(measured)
    }
}

/// The moments for [`MeasureJob`].
fn moments(estimate: &Estimate<'_>) -> Result<Vec<(usize, Time)>, Error> {
    let document = estimate.document;
    let light_of = |image: &Arc<Image>| image.data().iter().map(|x| f64::from(*x)).sum::<f64>();
    let light: Vec<f64> = estimate.rendered()?.coarse().iter().map(light_of).collect();
    let with_brightness = |moment: (usize, Time)| {
        let setting = document.setting(moment.1);
        let pairs = setting.iter().zip(&light);
        (pairs.map(|(s, l)| s * l).sum::<f64>(), moment)
    };
    let all = estimate.moments_of_cues().into_iter().map(with_brightness);
    let lit: Vec<(f64, (usize, Time))> = all.filter(|(bright, _)| *bright > 0.0).collect();
    let brightest = lit.iter().max_by(|(a, _), (b, _)| a.total_cmp(b));
    let text = document.text().bytes();
    let chance = text.fold(0, |seed, byte| mix(seed ^ u64::from(byte)));
    let picked = lit.get((chance % lit.len().max(1) as u64) as usize);
    let worst = estimate.worst_moment(ErrorUnit::Light)?;
    let worst = worst.map(|worst| (worst.cue, worst.time));
    let mut moments: Vec<(usize, Time)> = Vec::new();
    let others = [brightest, picked].into_iter().flatten();
    for moment in worst.into_iter().chain(others.map(|(_, moment)| *moment)) {
        if !moments.iter().any(|(_, time)| *time == moment.1) {
            moments.push(moment);
        }
    }
    Ok(moments)
}

/// Data shared by all measurements in one view.
struct Meter {
    estimator: Box<dyn PixelEstimator>,
    /// False at pixels near visible emitters.
    counted: Vec<bool>,
}

impl Meter {
    fn new(
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
        }))
    }

    /// Measures an image, except the duration.
    fn measure(
        &self,
        image: &Image,
        setting: &[f64],
        effort: Effort,
        work: Work<'_>,
    ) -> Result<Option<MeasuredError>, TransportError> {
        let chosen = choose(image, &self.counted, effort.pixels);
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
                part.add(rgb.map(|x| f64::from(*x)), halves, *weight);
            }
        }
        Ok(Sums::result(&parts).map(|result| MeasuredError {
            pixels: pixels.len(),
            paths: effort.paths,
            ..result
        }))
    }
}

/// Chooses counted pixels with weights that make sums over them estimate sums over the image: 0.4
/// of them uniformly, 0.3 by their light, and 0.3 by its square, to which the error is relative.
/// Systematic sampling: neighbours are rarely chosen together.
fn choose(image: &Image, counted: &[bool], count: usize) -> Vec<(usize, f64)> {
    let bright = |rgb: &[f32]| rgb.iter().map(|x| f64::from(*x).max(0.0)).sum::<f64>();
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
        let chosen = choose(&image, &[], 512);
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
                for (at, (pixel, weight)) in choose(&image, &[], 512).iter().enumerate() {
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
