//! The pool of images: coarse images of every source, refined images of mixtures, and previews
//! combined from both.
//!
//! The preview of a setting L is `C'·L + sum c_j (R_j - C'·s_j)`: coarse images C' extrapolated
//! from two coarse qualities, plus the known corrections of refined images R_j at settings s_j,
//! weighted by the projection of L on the s_j in the metric of the coarse error. A refined setting
//! is reproduced exactly. The projection in plain settings, by levels alone, follows Dorsey, Arvo
//! and Greenberg, "Interactive Design of Complex Time-Dependent Lighting" (1995); it can make an
//! image worse than coarse ones alone.
//!
//! Invariants: all images have one size; raw settings and images are kept.

#![allow(
    clippy::indexing_slicing,
    reason = "the Gram matrix is indexed by the pictures it was made of"
)]

pub mod address;
pub mod disk_cache;
pub mod image_cache;
pub mod linear_span;
mod rule;

use std::f64::consts::SQRT_2;
use std::sync::{Arc, OnceLock};

pub use self::rule::{Evidence, Fit, is_within};

use crate::plan::{self, PlanError, Weighting};
use footlight_host::work::{Work, in_order};
use footlight_picture::Image;
use footlight_picture::combine::{add, combine, dot, extrapolate};
use footlight_show::linalg::Matrix;
use footlight_transport::Quality;

/// A refined image with its setting and quality.
#[derive(Clone, Debug)]
pub struct RefinedImage {
    /// The rendered setting, one number for each source.
    pub setting: Vec<f64>,
    /// The image.
    pub image: Arc<Image>,
    /// Its quality step.
    pub quality: Quality,
    evidence: Evidence,
}

/// Coarse and refined images of one scene, rig and view.
#[derive(Clone, Debug)]
pub struct Pool {
    size: (usize, usize),
    coarse: Vec<Arc<Image>>,
    coarser: Vec<Arc<Image>>,
    gram: Matrix,
    /// The norm of D for each source.
    errors: Vec<f64>,
    /// Relative standard error of the sum of squares of each source's D, assuming independent
    /// pixels.
    spreads: Vec<f64>,
    weighting: Weighting,
    refined: Vec<RefinedImage>,
    stated: Option<Stated>,
    fit: Fit,
    /// C' of every source, computed on demand after an image was added: with 24 sources and 10
    /// refined images a preview then reads 34 images instead of 58.
    extrapolated: OnceLock<Vec<Arc<Image>>>,
}

/// Errors known before the first correction, from the operator's statement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// Factor on estimated errors.
    pub calibration: f64,
    /// Error of refined images relative to that of coarse ones.
    pub refined: f64,
    /// Set when images have errors by noise alone.
    pub noise: Option<Noise>,
}

/// Properties of noisy images, from the numbers of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Share of the difference of the two coarse qualities by which the finer one moves.
    extrapolation: f64,
    /// Least ratio of the variance of refined images to that of coarse ones.
    variances: f64,
}

impl Stated {
    /// Statement for unbiased images with these samples per pixel at the two coarse qualities and
    /// in refined images of `sources` together.
    ///
    /// With r times the samples the finer image has 1/r of the variance. The mean of both weighted
    /// by precision, C - D/(1+r), has r/(1+r) of the finer one's variance, and their difference D
    /// has 1+r times it. In an image of many sources each gets its share of the samples.
    pub fn noise([cheap, fine, refined]: [f64; 3], sources: usize) -> Stated {
        let ratio = fine / cheap;
        let variances = sources as f64 * (cheap + fine) / refined;
        let stated = Stated {
            calibration: ratio.sqrt() / (1.0 + ratio),
            refined: 1.0,
            noise: Some(Noise {
                extrapolation: -1.0 / (1.0 + ratio),
                variances,
            }),
        };
        stated.with_refined(variances)
    }

    /// The statement for refined images with `variances` times the variance of coarse ones; light
    /// in both is averaged by precision.
    fn with_refined(self, variances: f64) -> Stated {
        let refined = (variances / (1.0 + variances)).sqrt();
        Stated { refined, ..self }
    }

    /// Statement of an operator that gives errors: the factor on estimates, and the errors of
    /// coarse and of refined images.
    pub fn of(calibration: f64, coarse: f64, refined: f64) -> Stated {
        let share = if coarse > 0.0 { refined / coarse } else { 0.0 };
        Stated {
            calibration,
            refined: share.min(1.0),
            noise: None,
        }
    }

    /// Error contributed by refined images, before calibration, when coarse images still show
    /// `left` of the error `alone`.
    pub fn error_of_refined(self, left: f64, alone: f64) -> f64 {
        let share = if alone > 0.0 { left / alone } else { 0.0 };
        self.refined * alone * (1.0 - share * share).max(0.0).sqrt()
    }

    /// Weight of refined images relative to coarse ones.
    fn refined_weight(self) -> f64 {
        match self.noise {
            Some(_) => 1.0 - self.refined * self.refined,
            None => 1.0,
        }
    }
}

/// Safety margin for noise in standard errors: exceeded in 1 of 44 cases.
const CONFIDENCE: f64 = 2.0;

/// C' is kept if it takes at most the memory of a task divided by this.
const EXTRAPOLATED_MEMORY_DIVISOR: usize = 4;

impl Pool {
    /// The settings of coarse images: each of `sources` sources alone at unit setting.
    pub fn unit_settings(sources: usize) -> Vec<Vec<f64>> {
        let unit = |i: usize| (0..sources).map(|j| f64::from(u8::from(i == j))).collect();
        (0..sources).map(unit).collect()
    }

    /// Creates a pool from coarse images, one for each source, and optionally (or empty) as many of
    /// the next cheaper quality.
    ///
    /// # Errors
    /// [`PlanError::Weight`] when an image has a pixel that is not finite.
    pub fn new<I: Into<Arc<Image>>>(
        coarse: Vec<I>,
        coarser: Vec<I>,
        work: Work<'_>,
    ) -> Result<Pool, PlanError> {
        let shared = |images: Vec<I>| images.into_iter().map(Into::into).collect();
        let [coarse, coarser]: [Vec<Arc<Image>>; 2] = [coarse, coarser].map(shared);
        let size = coarse.first().map_or((0, 0), |c| c.size());
        let n = coarse.len();
        let mut gram = Matrix::zeros(n, n);
        let pairs: Vec<[usize; 2]> = (0..n).flat_map(|i| (0..=i).map(move |j| [i, j])).collect();
        let products = in_order(&pairs, work.threads, |[i, j]| dot(&coarse[*i], &coarse[*j]));
        for ([i, j], product) in pairs.into_iter().zip(products) {
            gram[(i, j)] = product;
            gram[(j, i)] = product;
        }
        let difference = |(fine, cheap): (&Arc<Image>, &Arc<Image>)| {
            let difference = combine(size, &[(1.0, fine), (-1.0, cheap)], work.threads);
            let squares = || difference.data().iter().map(|d| f64::from(*d).powi(2));
            let sum: f64 = squares().sum();
            let spread = squares().map(|d| d * d).sum::<f64>().sqrt();
            (sum.sqrt(), if sum > 0.0 { spread / sum } else { 0.0 })
        };
        let (errors, spreads): (Vec<f64>, Vec<f64>) =
            coarse.iter().zip(&coarser).map(difference).unzip();
        Ok(Pool {
            size,
            weighting: weighting(&errors, &norms(&gram))?,
            coarse,
            coarser,
            gram,
            errors,
            spreads,
            refined: Vec::new(),
            stated: None,
            fit: Fit::of(1.0, &[]),
            extrapolated: OnceLock::new(),
        })
    }

    /// Adds the operator's statement about errors, except for `exact` sources, to a pool without
    /// refined images. Noise is assumed as large as its estimate allows, because both the image's
    /// own and that of D deviate from expectation.
    ///
    /// # Errors
    /// As [`Pool::new`].
    pub fn stating(mut self, stated: Option<Stated>, exact: &[bool]) -> Result<Pool, PlanError> {
        self.stated = stated;
        if self.is_relative() {
            let norms = self.norms().into_iter().zip(exact);
            let weights: Vec<f64> = norms
                .map(|(n, exact)| if *exact { 0.0 } else { n })
                .collect();
            self.weighting = weighting(&[], &weights)?;
        }
        if stated.is_some_and(|stated| stated.noise.is_some()) {
            for (error, spread) in self.errors.iter_mut().zip(&self.spreads) {
                *error *= (1.0 + CONFIDENCE * SQRT_2 * spread).sqrt();
            }
            self.weighting = weighting(&self.errors, &norms(&self.gram))?;
        }
        self.fit = self.fit();
        Ok(self)
    }

    /// Replaces the stated errors by measured ones.
    pub fn restate(&mut self, stated: Stated) {
        self.stated = Some(stated);
        self.fit = self.fit();
    }

    /// True when errors rest on the operator's statement.
    pub fn is_stated(&self) -> bool {
        self.stated.is_some()
    }

    /// True when weights are light and an error is a share of it: the operator states an error of
    /// the coarse images, which have one quality.
    pub fn is_relative(&self) -> bool {
        self.is_stated() && self.coarser.is_empty()
    }

    /// True when errors are known before any correction: stated, or as the noise of images that
    /// differ only by it.
    pub fn is_known(&self) -> bool {
        self.is_relative() || self.stated.is_some_and(|s| s.noise.is_some())
    }

    /// Predicted relative error when coarse images still show `left` of the error `alone`, both as
    /// estimated before calibration. The stated error of refined images stays: corrections
    /// calibrate only coarse ones.
    pub fn error(&self, left: f64, alone: f64) -> f64 {
        self.error_by(self.calibration(), left, alone)
    }

    /// The error as predicted before the first refined image.
    pub fn planned_error(&self, left: f64, alone: f64) -> f64 {
        self.error_by(self.prior(), left, alone)
    }

    fn error_by(&self, calibration: f64, left: f64, alone: f64) -> f64 {
        let refined = self.stated.map_or(0.0, |s| s.error_of_refined(left, alone));
        (calibration * left).hypot(self.prior() * refined)
    }

    /// Factor on estimated errors before the first correction.
    fn prior(&self) -> f64 {
        self.stated.map_or(1.0, |s| s.calibration)
    }

    /// Width and height of every image.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The coarse image of each source at unit setting.
    pub fn coarse(&self) -> &[Arc<Image>] {
        &self.coarse
    }

    /// Coarse images of the next cheaper quality; empty if there are none.
    pub fn coarser(&self) -> &[Arc<Image>] {
        &self.coarser
    }

    /// The refined images, oldest first.
    pub fn refined(&self) -> &[RefinedImage] {
        &self.refined
    }

    /// Every image: coarse, coarser, refined.
    pub fn pictures(&self) -> impl Iterator<Item = &Arc<Image>> {
        let refined = self.refined.iter().map(|r| &r.image);
        self.coarse.iter().chain(&self.coarser).chain(refined)
    }

    /// Bytes of all images.
    pub fn image_bytes(&self) -> usize {
        self.pictures().map(|image| size_of_val(image.data())).sum()
    }

    /// Bytes of the extrapolated images kept for previews.
    pub fn extrapolated_bytes(&self) -> usize {
        let kept = self.extrapolated.get();
        kept.map_or(0, |kept| {
            kept.iter().map(|image| size_of_val(image.data())).sum()
        })
    }

    /// The pool with every `step`-th column and row of its images, and the errors of the full ones:
    /// its previews equal these pixels of full previews.
    pub fn thinned(&self, step: usize) -> Pool {
        let thin = |image: &Arc<Image>| match step {
            0 | 1 => image.clone(),
            _ => Arc::new(image.every(step)),
        };
        let refined = self.refined.iter().map(|r| RefinedImage {
            image: thin(&r.image),
            ..r.clone()
        });
        let coarse: Vec<Arc<Image>> = self.coarse.iter().map(thin).collect();
        Pool {
            size: coarse.first().map_or((0, 0), |c| c.size()),
            coarse,
            coarser: self.coarser.iter().map(thin).collect(),
            refined: refined.collect(),
            gram: self.gram.clone(),
            errors: self.errors.clone(),
            spreads: self.spreads.clone(),
            weighting: self.weighting.clone(),
            stated: self.stated,
            fit: self.fit,
            extrapolated: OnceLock::new(),
        }
    }

    /// Scalar products of the coarse images, sources x sources.
    pub fn gram(&self) -> &Matrix {
        &self.gram
    }

    /// The best weights available: with two coarse qualities each source's estimated error, the
    /// norm of the difference of its two images, else the norm of its image. If all of these are
    /// zero, each source counts equally.
    pub fn weighting(&self) -> &Weighting {
        &self.weighting
    }

    /// True when two coarse qualities were rendered and every pair of images is equal to the bit,
    /// as with a renderer that ignores quality: the estimated error is zero and nothing is worth
    /// refining.
    pub fn has_no_estimated_error(&self) -> bool {
        !self.errors.is_empty() && self.errors.iter().all(|e| *e == 0.0)
    }

    /// The norm of each coarse image at unit setting.
    pub fn norms(&self) -> Vec<f64> {
        norms(&self.gram)
    }

    /// Factor by which estimated errors must be multiplied to agree with the known corrections;
    /// before the first, 1 or the operator's statement.
    pub fn calibration(&self) -> f64 {
        self.fit.calibration
    }

    /// Settings of the refined images.
    pub fn settings(&self) -> Vec<Vec<f64>> {
        self.refined.iter().map(|r| r.setting.clone()).collect()
    }

    /// Adds a refined image; false, without a change, for a wrong size or number of sources.
    pub fn add(
        &mut self,
        setting: Vec<f64>,
        image: impl Into<Arc<Image>>,
        quality: Quality,
        work: Work<'_>,
    ) -> bool {
        let image = image.into();
        if image.size() != self.size || setting.len() != self.coarse.len() {
            return false;
        }
        let mut terms = vec![(1.0, image.as_ref())];
        terms.extend(negative(&setting).zip(images(&self.coarse)));
        let k = combine(self.size, &terms, work.threads);
        let e = self.difference(&setting, work);
        let terms = setting.iter().zip(self.weighting.weights());
        let evidence = Evidence {
            kk: dot(&k, &k),
            ke: dot(&k, &e),
            ee: dot(&e, &e),
            expected: terms.map(|(s, w)| (s * w) * (s * w)).sum(),
        };
        self.refined.push(RefinedImage {
            setting,
            image,
            quality,
            evidence,
        });
        self.fit = self.fit();
        self.stated = self.stated.map(|stated| self.with_noise_of_refined(stated));
        self.extrapolated = OnceLock::new();
        true
    }

    /// The fit to all known corrections.
    fn fit(&self) -> Fit {
        if let Some(noise) = self.stated.and_then(|stated| stated.noise) {
            return Fit {
                extrapolation: noise.extrapolation,
                calibration: self.prior(),
            };
        }
        // Refined images at the coarse step tell nothing about its error.
        let tell = self.stated.is_none_or(|stated| stated.refined < 1.0);
        let known = self.refined.iter().filter(|_| tell).map(|r| r.evidence);
        Fit::of(self.prior(), &known.collect::<Vec<Evidence>>())
    }

    /// For noisy images: updates the noise of refined images from their differences to coarse ones
    /// beyond the noise of these. A sampler that chooses among many lights may be noisier than each
    /// light's share of the samples suggests.
    fn with_noise_of_refined(&self, stated: Stated) -> Stated {
        let Some(noise) = stated.noise else {
            return stated;
        };
        let a = noise.extrapolation;
        let variances = |refined: &RefinedImage| {
            let Evidence {
                kk,
                ke,
                ee,
                expected,
            } = refined.evidence;
            let differ = (kk - 2.0 * a * ke + a * a * ee).max(0.0);
            let coarse = stated.calibration * stated.calibration * expected;
            (coarse > 0.0).then(|| differ / coarse - 1.0)
        };
        let known: Vec<f64> = self.refined.iter().filter_map(variances).collect();
        let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
        stated.with_refined(mean.max(noise.variances))
    }

    /// Adds C'·s to an image.
    fn add_extrapolated(&self, sum: &mut Image, setting: &[f64], work: Work<'_>) {
        let by = self.fit.extrapolation;
        let beyond =
            |(fine, cheap): (&Arc<Image>, &Arc<Image>)| extrapolate(fine, cheap, by, work.threads);
        let pairs = self.coarse.iter().zip(&self.coarser);
        let bytes = self.coarse.len() * self.size.0 * self.size.1 * size_of::<[f32; 3]>();
        if bytes <= work.memory / EXTRAPOLATED_MEMORY_DIVISOR {
            let kept = self
                .extrapolated
                .get_or_init(|| pairs.map(|pair| Arc::new(beyond(pair))).collect());
            let terms: Vec<(f64, &Image)> = setting.iter().copied().zip(images(kept)).collect();
            return add(sum, &terms, work.threads);
        }
        // Adding one image at a time gives equal sums, to the bit.
        for (weight, pair) in setting.iter().zip(pairs).filter(|(w, _)| **w != 0.0) {
            add(sum, &[(*weight, &beyond(pair))], work.threads);
        }
    }

    /// D·s: the difference of the two coarse qualities at a setting.
    fn difference(&self, setting: &[f64], work: Work<'_>) -> Image {
        if self.coarser.is_empty() {
            return Image::new(self.size.0, self.size.1);
        }
        let plus = setting.iter().copied().zip(images(&self.coarse));
        let minus = negative(setting).zip(images(&self.coarser));
        let terms: Vec<(f64, &Image)> = plus.chain(minus).collect();
        combine(self.size, &terms, work.threads)
    }

    /// The best image of a setting from the pool without rendering; pixels may be slightly
    /// negative.
    ///
    /// # Errors
    /// [`PlanError`] for a wrong number of coordinates.
    pub fn preview(&self, setting: &[f64], work: Work<'_>) -> Result<Image, PlanError> {
        let (c, rest) = self.parts(setting)?;
        let refined = self.refined.iter().map(|r| r.image.as_ref());
        let mut terms: Vec<(f64, &Image)> = c.into_iter().zip(refined).collect();
        let extrapolates = !self.coarser.is_empty() && self.fit.extrapolation != 0.0;
        if !extrapolates {
            terms.extend(rest.iter().copied().zip(images(&self.coarse)));
        }
        let mut out = combine(self.size, &terms, work.threads);
        if extrapolates {
            self.add_extrapolated(&mut out, &rest, work);
        }
        Ok(out)
    }

    /// The light of a setting, to which errors are relative: the norm of its coarse image, or of
    /// its weighted coordinates if [`Pool::is_relative`].
    pub fn light(&self, setting: &[f64]) -> f64 {
        let n = setting.len().min(self.coarse.len());
        let of = |i: usize| -> f64 {
            if self.is_relative() {
                setting[i] * setting[i] * self.gram[(i, i)]
            } else {
                (0..n)
                    .map(|j| setting[i] * self.gram[(i, j)] * setting[j])
                    .sum()
            }
        };
        (0..n).map(of).sum::<f64>().max(0.0).sqrt()
    }

    /// Coefficients c of the refined images at a setting L, and the remainder L - S·c for the
    /// coarse ones. Noisy images of light in both are averaged by precision.
    fn parts(&self, setting: &[f64]) -> Result<(Vec<f64>, Vec<f64>), PlanError> {
        let looks = [setting.to_vec()];
        let mut c = plan::projection(&self.settings(), &self.weighting, &looks)?.concat();
        let weight = self.stated.map_or(1.0, Stated::refined_weight);
        c.iter_mut().for_each(|c| *c *= weight);
        let rest = self.rest(setting, &c);
        Ok((c, rest))
    }

    /// L - S·c.
    fn rest(&self, setting: &[f64], c: &[f64]) -> Vec<f64> {
        let mut rest = setting.to_vec();
        for (refined, c) in self.refined.iter().zip(c) {
            for (r, s) in rest.iter_mut().zip(&refined.setting) {
                *r -= c * s;
            }
        }
        rest
    }
}

/// The weights of [`Pool::weighting`].
fn weighting(errors: &[f64], norms: &[f64]) -> Result<Weighting, PlanError> {
    let weights = if errors.is_empty() { norms } else { errors };
    match Weighting::new(weights.to_vec()) {
        Err(PlanError::NoWeight) => Ok(Weighting::settings(norms.len())),
        other => other,
    }
}

/// The norm of each image, from the scalar products.
fn norms(gram: &Matrix) -> Vec<f64> {
    gram.diagonal().iter().map(|x| x.max(0.0).sqrt()).collect()
}

fn images(shared: &[Arc<Image>]) -> impl Iterator<Item = &Image> {
    shared.iter().map(AsRef::as_ref)
}

fn negative(setting: &[f64]) -> impl Iterator<Item = f64> {
    setting.iter().map(|s| -s)
}

#[cfg(test)]
mod tests;
