//! Comparison of every bank alone with its reference.

use std::path::Path;

use serde::Serialize;

use super::{Reference, difference};
use crate::{Engine, Error};
use footlight_picture::Image;
use footlight_transport::Quality;
use footlight_transport::surfaces::emitter_mask;

/// Comparison of a quality step with references.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The quality step.
    pub quality: u8,
    /// Seconds to prepare and to render all banks.
    pub seconds: f64,
    /// Banks in the order of the show.
    pub banks: Vec<BankError>,
}

/// A bank's errors, relative to the root mean square of its reference; `None` if unknown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BankError {
    /// The bank.
    pub name: String,
    /// Over all pixels.
    pub rmse: Option<f64>,
    /// Without the reference's noise; needs halves. Negative zero when the estimate under the root
    /// is negative.
    pub rmse_noise_free: Option<f64>,
    /// Without pixels whose 3 x 3 neighbourhood shows an emitter.
    pub rmse_no_emitters: Option<f64>,
    /// Without noise and emitters.
    pub rmse_noise_free_no_emitters: Option<f64>,
    /// Mean of the image over mean of the reference.
    pub mean_ratio: Option<f64>,
}

impl BankError {
    /// Compares a bank's image with its reference; `counted` is false at pixels near emitters.
    pub fn new(name: &str, image: &Image, reference: &Reference, counted: &[bool]) -> BankError {
        let all = difference::difference(image, reference, None);
        let plain = difference::difference(image, reference, Some(counted));
        BankError {
            name: name.to_owned(),
            rmse: all.map(|d| d.rmse),
            rmse_noise_free: all.and_then(|d| d.noise_free()),
            rmse_no_emitters: plain.map(|d| d.rmse),
            rmse_noise_free_no_emitters: plain.and_then(|d| d.noise_free()),
            mean_ratio: all.map(|d| d.mean_ratio).filter(|r| r.is_finite()),
        }
    }

    /// The figure for judging a quality step: without emitters if anything else is seen, without
    /// noise if there are halves.
    pub fn judged(&self) -> Option<f64> {
        let order = [
            self.rmse_noise_free_no_emitters,
            self.rmse_no_emitters,
            self.rmse_noise_free,
            self.rmse,
        ];
        order.into_iter().flatten().next().map(f64::abs)
    }
}

/// A comparison with its images.
#[derive(Clone, Debug)]
pub struct Compared {
    /// The figures.
    pub comparison: Comparison,
    /// The rendered images, in the order of the banks.
    pub images: Vec<Image>,
    /// The references.
    pub references: Vec<Reference>,
}

/// Renders every bank alone at unit setting, timed including preparation, and compares each with
/// its reference image in `folder`.
///
/// # Errors
/// [`Error::Reference`] when a reference is missing or does not fit, [`Error::NoSetup`],
/// [`Error::NoBanks`], or an error of rendering.
pub fn compare(engine: &Engine, folder: &Path, quality: Quality) -> Result<Compared, Error> {
    let names = bank_names(engine)?;
    let settings = alone_each(engine, &names)?;
    let estimate = engine.estimate();
    let rendering = estimate.rendering()?;
    let work = engine.work();
    let (store, memory) = (engine.host.store.as_ref(), work.memory);
    let size = (rendering.setup.view.width, rendering.setup.view.height);
    let references = Reference::load(store, folder, &names, size, memory)?;
    let near = emitter_mask::emitters(&rendering.setup, work)?;
    let counted = difference::away_from(&near, size.0, 1);
    let held = references.iter().map(Reference::bytes).sum();
    let (images, seconds) = render_alone(engine, &settings, quality, held)?;
    let pairs = names.iter().zip(images.iter().zip(&references));
    let errors = pairs.map(|(name, (i, r))| BankError::new(name, i, r, &counted));
    let comparison = Comparison {
        quality: quality.0,
        seconds: seconds.iter().sum(),
        banks: errors.collect(),
    };
    Ok(Compared {
        comparison,
        images,
        references,
    })
}

/// Images of settings from an operator prepared for them, with the seconds to prepare and to
/// render; `held` bytes of the caller count against the memory.
pub fn render_alone(
    engine: &Engine,
    settings: &[Vec<f64>],
    quality: Quality,
    held: usize,
) -> Result<(Vec<Image>, [f64; 2]), Error> {
    let estimate = engine.estimate();
    let rendering = estimate.rendering()?;
    let (work, clock) = (engine.work().holding(held), engine.host.clock.as_ref());
    let begin = clock.seconds();
    let renderer = engine.host.renderer.as_ref();
    let mut operator = rendering.prepare(renderer, quality, work)?;
    let prepared = clock.seconds();
    let images = operator.render(settings, work)?;
    Ok((images, [prepared - begin, clock.seconds() - prepared]))
}

/// Names of the banks; an error for a show without banks.
pub fn bank_names(engine: &Engine) -> Result<Vec<String>, Error> {
    let names: Vec<String> = engine.show().banks.iter().map(|b| b.name.clone()).collect();
    if names.is_empty() {
        return Err(Error::NoBanks);
    }
    Ok(names)
}

/// The setting of each bank alone at full.
pub fn alone_each(engine: &Engine, names: &[String]) -> Result<Vec<Vec<f64>>, Error> {
    let home = engine.document.home();
    names
        .iter()
        .map(|name| engine.document.alone(name, &home))
        .collect()
}
