//! Every bank alone, held against its reference.

use serde::Serialize;

use crate::chart::{self, ChartError, Drawing, Sheet, Theme, Tile};
use crate::picture::combine::{combine, dot};
use crate::picture::{Image, signed};
use crate::study::{Reference, difference};

/// A quality against references.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// The step of the scale.
    pub quality: u8,
    /// Seconds to prepare and to render all banks.
    pub seconds: f64,
    /// In the order of the show.
    pub banks: Vec<BankError>,
}

/// A bank's errors, relative to the root mean square of its reference; `None` where they cannot be
/// known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BankError {
    /// The bank.
    pub name: String,
    /// Over all pixels.
    pub rmse: Option<f64>,
    /// The same without the reference's noise; needs halves. A negative zero where the estimate
    /// under the root is negative.
    pub rmse_noise_free: Option<f64>,
    /// Without pixels whose 3 x 3 neighbourhood shows an emitter of any light.
    pub rmse_no_emitters: Option<f64>,
    /// Both.
    pub rmse_noise_free_no_emitters: Option<f64>,
    /// Mean of the picture over mean of the reference.
    pub mean_ratio: Option<f64>,
}

impl BankError {
    /// Holds a bank's picture against its reference; `counted` is false at pixels near emitters.
    pub fn new(name: &str, image: &Image, reference: &Reference, counted: &[bool]) -> BankError {
        let all = difference(image, reference, None);
        let plain = difference(image, reference, Some(counted));
        BankError {
            name: name.to_owned(),
            rmse: all.map(|d| d.rmse),
            rmse_noise_free: all.and_then(|d| d.noise_free()),
            rmse_no_emitters: plain.map(|d| d.rmse),
            rmse_noise_free_no_emitters: plain.and_then(|d| d.noise_free()),
            mean_ratio: all.map(|d| d.mean_ratio).filter(|r| r.is_finite()),
        }
    }

    /// The figure a step of quality is judged by: without emitters where anything else is seen,
    /// without noise where halves allow it.
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

/// A bank's picture beside its reference.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The bank's errors.
    pub bank: &'a BankError,
    /// What was rendered.
    pub image: &'a Image,
    /// What it should be.
    pub reference: &'a Reference,
}

/// The differences as a contact sheet: amber where the picture is brighter than its reference,
/// blue where it is darker, one scale for all, as a share of each reference's root mean square.
///
/// # Errors
/// [`ChartError`] for pictures without pixels.
pub fn sheet(title: &str, pairs: &[Pair<'_>]) -> Result<Drawing, ChartError> {
    let parts: Vec<(Image, f64)> = pairs.iter().map(relative).collect();
    let scale = parts
        .iter()
        .map(|(image, _)| signed::scale(image))
        .fold(0.0, f32::max);
    let tile = |(pair, (image, _)): (&Pair<'_>, &(Image, f64))| Tile {
        size: (image.width(), image.height()),
        rgb: signed::encode(image, scale),
        caption: caption(pair.bank),
    };
    let data = Sheet {
        title: title.to_owned(),
        tiles: pairs.iter().zip(&parts).map(tile).collect(),
        columns: None,
        legend: format!(
            "picture minus reference: amber brighter, blue darker, full colour at {} % of the \
             reference's RMS; the figures are relative RMSE in %",
            figure(f64::from(scale))
        ),
    };
    chart::sheet(&data, Theme::Dark)
}

/// The difference divided by the reference's root mean square, and that.
fn relative(pair: &Pair<'_>) -> (Image, f64) {
    let mean = &pair.reference.mean;
    let size = (mean.width(), mean.height());
    let rms = (dot(mean, mean) / mean.data().len().max(1) as f64).sqrt();
    let gain = if rms > 0.0 { 1.0 / rms } else { 0.0 };
    (combine(size, &[(gain, pair.image), (-gain, mean)], 1), rms)
}

fn caption(bank: &BankError) -> String {
    let shown = |v: Option<f64>| v.map_or("-".to_owned(), |v| figure(v.abs()));
    let mut text = format!("{}: {} %", bank.name, shown(bank.rmse));
    if bank.rmse_noise_free.is_some() {
        text = format!("{text}, {} % without noise", shown(bank.rmse_noise_free));
    }
    if bank.rmse_no_emitters != bank.rmse {
        let best = bank.rmse_noise_free_no_emitters.or(bank.rmse_no_emitters);
        text = format!("{text}, {} % off emitters", shown(best));
    }
    text
}

/// A share in percent with three digits.
pub fn figure(share: f64) -> String {
    let percent = share * 100.0;
    match percent.abs() {
        p if p >= 99.95 => format!("{percent:.0}"),
        p if p >= 9.995 => format!("{percent:.1}"),
        p if p >= 0.0995 || p == 0.0 => format!("{percent:.2}"),
        _ => format!("{percent:.3}"),
    }
}
