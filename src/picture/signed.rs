//! Signed images (basis images, differences) as display bytes.
//!
//! Zero is dark grey, light amber and negative light blue, brighter with magnitude: all common
//! kinds of colour blindness can distinguish the two. The largest channel of either sign counts,
//! not luminance, in which a blue source would almost vanish. Where some channels are positive and
//! others negative, both colours add up towards white.

use super::Image;
use super::tone::{PERCENTILE, level};
use footlight_show::units::srgb_encode;

/// Zero.
const NEUTRAL: [f64; 3] = [0.075, 0.075, 0.08];
/// Full light, display-coded.
const POSITIVE: [f64; 3] = [1.0, 0.76, 0.36];
/// Full negative light, display-coded.
const NEGATIVE: [f64; 3] = [0.22, 0.52, 1.0];

/// Encodes `image` in signed colours as interleaved RGB bytes: `scale` and beyond is full amber,
/// `-scale` full blue, with sRGB's coding between, so that faint light is visible. NaN counts as
/// zero; a scale that is not positive makes everything neutral.
pub fn encode(image: &Image, scale: f32) -> Vec<u8> {
    let (pixels, _) = image.data().as_chunks::<3>();
    let gain = if scale > 0.0 {
        1.0 / f64::from(scale)
    } else {
        0.0
    };
    let mut out = vec![0; pixels.len() * 3];
    for (to, pixel) in out.as_chunks_mut().0.iter_mut().zip(pixels) {
        *to = colour(*pixel, gain);
    }
    out
}

/// A scale for `image`: the 99.5th percentile of the magnitudes, so that a few emitters do not
/// dominate.
pub fn scale(image: &Image) -> f32 {
    let (pixels, _) = image.data().as_chunks::<3>();
    let magnitude = |pixel: &[f32; 3]| pixel.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
    level(&mut pixels.iter().map(magnitude).collect(), PERCENTILE)
}

fn colour(pixel: [f32; 3], gain: f64) -> [u8; 3] {
    let largest = |sign: f64| {
        let light = pixel.iter().map(|v| sign * f64::from(*v) * gain);
        srgb_encode(light.fold(0.0, f64::max).min(1.0))
    };
    let (positive, negative) = (largest(1.0), largest(-1.0));
    let mut codes = [0; 3];
    for (((code, zero), warm), cool) in codes.iter_mut().zip(NEUTRAL).zip(POSITIVE).zip(NEGATIVE) {
        let mixed = zero + positive * (warm - zero) + negative * (cool - zero);
        *code = (mixed.clamp(0.0, 1.0) * 255.0).round() as u8;
    }
    codes
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;

    fn shown(pixel: [f32; 3]) -> [u8; 3] {
        let image = Image::from_data(1, 1, pixel.to_vec()).unwrap();
        encode(&image, 2.0).try_into().unwrap()
    }

    #[test]
    fn signs_are_told_apart_by_hue_and_amounts_by_brightness() {
        let brightness = |c: [u8; 3]| c.iter().map(|v| u32::from(*v)).sum::<u32>();
        let zero = shown([0.0; 3]);
        assert!(brightness(zero) < 80);
        let mut last = (zero, zero);
        for step in 1..=20 {
            let level = step as f32 / 10.0;
            // Blue light is not negative light.
            let (light, dark) = (shown([0.0, 0.0, level]), shown([-level, 0.0, 0.0]));
            assert!(light[0] > light[2], "{level}");
            assert!(dark[2] > dark[0], "{level}");
            assert!(brightness(light) > brightness(last.0));
            assert!(brightness(dark) > brightness(last.1));
            last = (light, dark);
        }
        assert_eq!(shown([9.0; 3]), last.0);
        assert_eq!(shown([f32::NAN; 3]), zero);
        assert_eq!(encode(&Image::new(1, 1), 0.0), zero);
    }

    #[test]
    fn the_scale_passes_over_a_few_emitters() {
        let mut image = Image::new(20, 20);
        image.data_mut().fill(-3.0);
        image.data_mut()[0] = 1e5;
        assert_eq!(scale(&image), 3.0);
    }
}
