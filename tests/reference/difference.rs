//! The measure of error: relative root mean square, over pixels and channels.
//!
//! sqrt(mean (x-b)²) / sqrt(mean b²). A sampled reference is noisy; given two halves A and B with
//! independent noise, mean (x-A)(x-B) estimates mean (x-b)² free of their noise. The estimate may
//! be negative.

#![allow(dead_code, clippy::unwrap_used, reason = "used by several programs")]

use std::error::Error;
use std::path::Path;

use footlight_picture::{Image, exr};

/// An image used as ground truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// The best estimate.
    pub mean: Image,
    /// Two estimates with independent noise; `mean` is their mean.
    pub halves: Option<[Image; 2]>,
}

impl Reference {
    /// A single image of unknown noise.
    pub fn of(mean: Image) -> Reference {
        Reference { mean, halves: None }
    }

    /// A reference from two halves; `None` when their sizes differ.
    pub fn of_halves(a: Image, b: Image) -> Option<Reference> {
        let numbers = a.data().iter().zip(b.data());
        let mean = numbers.map(|(p, q)| 0.5 * (p + q)).collect();
        let same = (a.width(), a.height()) == (b.width(), b.height());
        let mean = Image::from_data(a.width(), a.height(), mean).filter(|_| same)?;
        Some(Reference {
            mean,
            halves: Some([a, b]),
        })
    }

    /// The references of `banks` in a folder: `BANK.exr`, or the halves `BANK_A.exr` and
    /// `BANK_B.exr`.
    pub fn load(folder: &Path, banks: &[String]) -> Result<Vec<Reference>, Box<dyn Error>> {
        let read = |bank: &str, end: &str| -> Result<Image, Box<dyn Error>> {
            let bytes = std::fs::read(folder.join(format!("{bank}{end}.exr")))?;
            Ok(exr::decode(&bytes, 1 << 30)?)
        };
        let load = |bank: &String| match (read(bank, "_A"), read(bank, "_B")) {
            (Ok(a), Ok(b)) => Reference::of_halves(a, b).ok_or_else(|| "two sizes".into()),
            _ => Ok(Reference::of(read(bank, "")?)),
        };
        banks.iter().map(load).collect()
    }
}

/// Comparison of an image with its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// sqrt(mean (x-b)²) / sqrt(mean b²).
    pub rmse: f64,
    /// mean (x-A)(x-B) / mean b², signed; `None` without halves.
    pub noise_free_square: Option<f64>,
    /// Mean of the image over mean of the reference.
    pub mean_ratio: f64,
}

impl Difference {
    /// The root of [`Difference::noise_free_square`]; negative zero when that is negative, because
    /// the error is below the resolution of the halves.
    pub fn noise_free(&self) -> Option<f64> {
        self.noise_free_square
            .map(|square| if square < 0.0 { -0.0 } else { square.sqrt() })
    }

    /// The best available error: free of noise if there are halves.
    pub fn best(&self) -> f64 {
        self.noise_free().unwrap_or(self.rmse).abs()
    }
}

/// Compares `image` with `reference`, over the pixels selected by `counted` (row by row) or over
/// all. `None` when no pixel is counted, the reference is black there, or the sizes differ.
pub fn difference(
    image: &Image,
    reference: &Reference,
    counted: Option<&[bool]>,
) -> Option<Difference> {
    let size = |i: &Image| (i.width(), i.height());
    let halves = reference.halves.as_ref();
    let mut others = std::iter::once(&reference.mean).chain(halves.into_iter().flatten());
    let pixels = image.width() * image.height();
    if others.any(|i| size(image) != size(i)) || counted.is_some_and(|c| c.len() != pixels) {
        return None;
    }
    let counts = |pixel: usize| counted.is_none_or(|c| c.get(pixel) == Some(&true));
    let [mut plain, mut fair, mut power, mut ours, mut theirs] = [0.0_f64; 5];
    let numbers = image.data().iter().zip(reference.mean.data()).enumerate();
    for (at, (x, b)) in numbers.filter(|(at, _)| counts(at / 3)) {
        let (x, b) = (f64::from(*x), f64::from(*b));
        plain += (x - b) * (x - b);
        power += b * b;
        ours += x;
        theirs += b;
        if let Some([one, two]) = halves {
            let half = |h: &Image| h.data().get(at).map_or(b, |v| f64::from(*v));
            fair += (x - half(one)) * (x - half(two));
        }
    }
    (power > 0.0).then(|| Difference {
        rmse: (plain / power).sqrt(),
        noise_free_square: halves.map(|_| fair / power),
        mean_ratio: ours / theirs,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise in -0.5..0.5 from Knuth's 64-bit linear congruential generator.
    fn noise(seed: &mut u64) -> f32 {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 40) as f32 / (1_u64 << 24) as f32 - 0.5
    }

    fn picture(of: impl FnMut(usize) -> f32) -> Image {
        Image::from_data(64, 64, (0..64 * 64 * 3).map(of).collect()).unwrap()
    }

    #[test]
    fn halves_tell_an_error_far_below_their_noise() {
        let mut seed = 7;
        let truth = |at: usize| 1.0 + (at % 17) as f32 / 17.0;
        // 20 % of noise in each half, 1 % of error in the image.
        let a = picture(|at| truth(at) + 1.2 * noise(&mut seed));
        let b = picture(|at| truth(at) + 1.2 * noise(&mut seed));
        let x = picture(|at| 1.01 * truth(at));
        let found = difference(&x, &Reference::of_halves(a, b).unwrap(), None).unwrap();
        assert!(found.rmse > 0.1, "{found:?}");
        let fair = found.noise_free().unwrap();
        assert!((fair - 0.01).abs() < 0.015, "{found:?}");
        assert!((found.mean_ratio - 1.01).abs() < 0.005, "{found:?}");
    }

    #[test]
    fn what_cannot_be_known_is_absent_and_what_is_negative_says_so() {
        let black = Reference::of(Image::new(64, 64));
        let grey = picture(|_| 0.5);
        assert_eq!(difference(&grey, &black, None), None);
        assert_eq!(
            difference(&Image::new(2, 2), &Reference::of(grey.clone()), None),
            None
        );
        let none = vec![false; 64 * 64];
        let plain = Reference::of(grey.clone());
        assert_eq!(difference(&grey, &plain, Some(&none)), None);
        let same = difference(&grey, &plain, None).unwrap();
        assert_eq!((same.rmse, same.noise_free()), (0.0, None));

        // The image lies between the halves: the product is negative everywhere.
        let halves = Reference::of_halves(picture(|_| 0.4), picture(|_| 0.6)).unwrap();
        let between = difference(&grey, &halves, None).unwrap();
        let fair = between.noise_free().unwrap();
        assert!(fair == 0.0 && fair.is_sign_negative());
        assert!(between.noise_free_square.unwrap() < 0.0);
    }
}
