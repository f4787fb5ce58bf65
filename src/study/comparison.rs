//! Every bank alone, held against its reference.

use serde::Serialize;

use crate::picture::Image;
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

/// A comparison with the pictures that it was made of.
#[derive(Clone, Debug)]
pub struct Compared {
    /// The figures.
    pub comparison: Comparison,
    /// What was rendered, in the order of the banks.
    pub images: Vec<Image>,
    /// What it was compared with.
    pub references: Vec<Reference>,
}
