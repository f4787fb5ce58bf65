//! Linear light to display bytes: exposure, tone curve, sRGB code.
//!
//! Invariants: equal images give equal bytes in every output and on every machine (each byte
//! follows from comparison with 255 thresholds, so no power function runs per pixel); more light
//! never gives a smaller byte; negative and NaN channels show as black, and only here: images keep
//! them. A still stretch is identical to the bit. Dithering is off unless requested, so that two
//! levels compare pixel by pixel.

mod table;

pub use self::table::{BLOCK, ByteTable};

use super::Image;
use footlight_show::units::{ToneCurve, srgb_decode, srgb_encode};

/// Level at which [`auto_exposure`] puts bright light: just below white.
const BRIGHT: f64 = 0.9;
/// Share of an image's pixels that are not brighter than its bright light.
pub(super) const PERCENTILE: f64 = 0.995;
/// Share of the lit pixels that certainly show surfaces rather than lamps.
const SURFACES: f64 = 0.97;
/// Largest ratio of the bright light to those surfaces: beyond it the filmic curve is white anyway.
const BEYOND: f32 = 3.0;
/// Stops that keep every threshold a normal float.
const MOST_STOPS: f64 = 100.0;
/// Least light of a lit pixel, relative to the bright light.
const LIT: f32 = 0.003;

/// An exposure and a tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Stops: light is multiplied by 2^exposure, clamped to 100 either way.
    pub exposure: f64,
    /// The curve after it.
    pub curve: ToneCurve,
}

impl Tone {
    /// Encodes `image` as interleaved sRGB bytes, row by row from the top.
    pub fn encode(&self, image: &Image) -> Vec<u8> {
        let mut out = vec![0; image.data().len()];
        self.table().encode(image.data(), &mut out);
        out
    }

    /// The look-up table of [`Tone::encode`], for many images.
    pub fn table(&self) -> ByteTable {
        ByteTable::new(&self.thresholds())
    }

    /// Display value of light, 0 to 1, not rounded.
    pub fn display(&self, light: f64) -> f64 {
        srgb_encode(self.curve.apply(light * self.gain()))
    }

    /// The light that shows as `brightness`, 0 to 1; for 1, the least light that shows white.
    pub fn light(&self, brightness: f64) -> f64 {
        self.curve.invert(brightness) / self.gain()
    }

    /// The k for which k c^2 is about the light of display value c in the dark, where sRGB's code
    /// is about the square root of brightness.
    pub fn knee(&self) -> f32 {
        (1.0 / (self.curve.slope() * self.gain())) as f32
    }

    fn gain(&self) -> f64 {
        self.exposure.clamp(-MOST_STOPS, MOST_STOPS).exp2()
    }

    /// The least light that rounds to each code from 1 to 255.
    pub fn thresholds(&self) -> [f32; 255] {
        std::array::from_fn(|below| {
            let brightness = srgb_decode((below as f64 + 0.5) / 255.0);
            self.light(brightness) as f32
        })
    }
}

/// Number of negative channels of `image`, which show as black.
pub fn negative(image: &Image) -> usize {
    image.data().iter().filter(|v| **v < 0.0).count()
}

/// One exposure, in stops, for a whole sequence: it puts the bright light of the brightest image
/// just below white (0.9). Without light, 0. Large images are sampled (see [`sampling`]).
///
/// An image's bright light is the 99.5th percentile of its luminance, so that lamps of a few pixels
/// do not darken the rest; and at most three times the 97th percentile of its lit pixels (those of
/// at least 0.3 % of the former), so that larger lamps may be clipped.
pub fn auto_exposure<'a>(images: impl Iterator<Item = &'a Image>) -> f64 {
    exposure(images.map(sampled_bright_light).fold(0.0, f64::max))
}

/// Number of sampled pixels: the brightest half percent of 16,000 are 80.
const SAMPLED: usize = 16_000;

/// Sampling interval of rows and columns for an image's bright light, which gives about 16,000
/// pixels.
pub fn sampling(width: usize, height: usize) -> usize {
    let pixels = |step: usize| width.div_ceil(step) * height.div_ceil(step);
    let mut step = 1;
    while pixels(step) > SAMPLED {
        step += 1;
    }
    step
}

/// Exposure, in stops, that puts bright light just below white.
pub fn exposure(bright: f64) -> f64 {
    if bright > 0.0 {
        (BRIGHT / bright).log2()
    } else {
        0.0
    }
}

/// Bright light of an image, from about 16,000 pixels; see [`auto_exposure`].
pub fn sampled_bright_light(image: &Image) -> f64 {
    bright_light(&image.every(sampling(image.width(), image.height())))
}

/// Bright light of an image, from every pixel; see [`auto_exposure`].
pub fn bright_light(image: &Image) -> f64 {
    let (pixels, _) = image.data().as_chunks::<3>();
    let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mut values: Vec<f32> = pixels.iter().map(luminance).collect();
    let bright = level(&mut values, PERCENTILE);
    values.retain(|v| *v > 0.0 && *v >= LIT * bright);
    f64::from(bright.min(BEYOND * level(&mut values, SURFACES)))
}

/// A percentile of the finite values, dropping the others; 0 when there are none, or when it is
/// negative.
pub(super) fn level(values: &mut Vec<f32>, percentile: f64) -> f32 {
    values.retain(|v| v.is_finite());
    let rank = (values.len() as f64 * percentile) as usize;
    if rank >= values.len() {
        return 0.0;
    }
    let (_, level, _) = values.select_nth_unstable_by(rank, f32::total_cmp);
    level.max(0.0)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use proptest::prelude::*;

    const CURVES: [ToneCurve; 2] = [ToneCurve::Filmic, ToneCurve::Plain];

    fn grey(level: f32) -> Image {
        Image::from_data(1, 1, vec![level; 3]).unwrap()
    }

    #[test]
    fn curves_rise_from_black_to_white_and_invert() {
        for curve in CURVES {
            assert_eq!(curve.apply(0.0), 0.0);
            assert_eq!(curve.apply(f64::INFINITY), 1.0);
            assert_eq!(curve.apply(-1.0), 0.0);
            let mut last = -1.0;
            for step in 0..=2500 {
                let shown = curve.apply(f64::from(step) * 1e-3);
                assert!(shown > last || shown == 1.0);
                last = shown;
                if shown < 1.0 {
                    let back = curve.invert(shown);
                    assert!(
                        (back - f64::from(step) * 1e-3).abs() < 1e-12,
                        "{curve:?} {step}"
                    );
                }
            }
            assert_eq!(last, 1.0);
        }
    }

    #[test]
    fn bytes_are_srgb() {
        let plain = Tone {
            exposure: 1.0,
            curve: ToneCurve::Plain,
        };
        // 18 % grey after one stop; sRGB's code for 0.18 is 118.
        assert_eq!(plain.encode(&grey(0.09)), [118; 3]);
        for (light, byte) in [(0.5, 255), (9.0, 255), (0.0, 0), (-1.0, 0), (f32::NAN, 0)] {
            assert_eq!(plain.encode(&grey(light)), [byte; 3], "{light}");
        }
        for extreme in [-2000.0, 2000.0] {
            let tone = Tone {
                exposure: extreme,
                curve: ToneCurve::Filmic,
            };
            assert_eq!(tone.encode(&grey(0.0)), [0; 3]);
        }
    }

    #[test]
    fn one_exposure_serves_the_brightest_picture_and_not_its_lamps() {
        let mut bright = Image::new(100, 100);
        bright.data_mut().fill(4.0);
        // 0.4 % of the pixels are lamps.
        bright.data_mut()[..120].fill(1e6);
        let dim = grey(0.1);
        let exposure = auto_exposure([&dim, &bright, &Image::new(5, 5)].into_iter());
        assert!((exposure - (0.9_f64 / 4.0).log2()).abs() < 1e-6);
        assert_eq!(auto_exposure([&Image::new(5, 5)].into_iter()), 0.0);
        assert_eq!(
            auto_exposure([&grey(-1.0), &grey(f32::NAN)].into_iter()),
            0.0
        );
        assert_eq!(auto_exposure(std::iter::empty()), 0.0);
        // 2 % lamps, 98 % walls: the lamps are clipped.
        let mut lamps = Image::new(100, 100);
        lamps.data_mut().fill(1.0);
        lamps.data_mut()[..600].fill(50.0);
        let exposure = auto_exposure([&lamps].into_iter());
        assert!((exposure - 0.3_f64.log2()).abs() < 1e-6);
        // Four times as large both ways, so that every fourth row and column is sampled.
        let wide = (0..400 * 400).map(|i| (i / 400 / 4, i % 400 / 4));
        let wide = wide.flat_map(|(y, x)| lamps.pixel(x, y).unwrap()).collect();
        let wide = Image::from_data(400, 400, wide).unwrap();
        assert_eq!((sampling(400, 400), wide.every(4)), (4, lamps.clone()));
        assert_eq!(auto_exposure([&wide].into_iter()), exposure);
        // The lamps are now the only light: they set the exposure.
        lamps.data_mut()[600..].fill(1e-3);
        let exposure = auto_exposure([&lamps].into_iter());
        assert!((exposure - (0.9_f64 / 50.0).log2()).abs() < 1e-6);
        assert_eq!(negative(&grey(-1.0)), 3);
    }

    /// Every threshold and its neighbours, at exposures that put white anywhere in an octave, and
    /// at the ends of the scale.
    #[test]
    fn the_table_is_the_thresholds() {
        let fractions = (0..512).map(|i| f64::from(i) / 512.0);
        let exposures: Vec<f64> = fractions.chain([-2000.0, -100.0, 100.0, 2000.0]).collect();
        for (curve, exposure) in CURVES
            .iter()
            .flat_map(|c| exposures.iter().map(move |e| (*c, *e)))
        {
            let tone = Tone { exposure, curve };
            let (thresholds, table) = (tone.thresholds(), tone.table());
            for (below, threshold) in thresholds.iter().enumerate() {
                let byte = below as u8;
                assert_eq!(table.byte(threshold.next_down()), byte, "{tone:?} {byte}");
                assert_eq!(table.byte(*threshold), byte + 1, "{tone:?} {byte}");
            }
        }
    }

    proptest! {
        /// For any bits, the table agrees with the definition by thresholds.
        #[test]
        fn any_float_is_looked_up_as_it_is_compared(bits: u32, exposure in -120.0..120.0_f64, at in 0_usize..2) {
            let tone = Tone { exposure, curve: CURVES[at] };
            let (thresholds, table) = (tone.thresholds(), tone.table());
            let near = thresholds[bits as usize % 255].to_bits();
            for light in [bits, near.wrapping_add(bits >> 24), near.wrapping_sub(bits >> 24)] {
                let light = f32::from_bits(light);
                let compared = thresholds.partition_point(|t| *t <= light) as u8;
                prop_assert_eq!(table.byte(light), compared, "{}", light);
            }
        }

        /// Comparison with thresholds equals applying the curve and rounding.
        #[test]
        fn thresholds_are_the_curve(light in 0.0_f32..4.0, exposure in -3.0..3.0_f64, at in 0_usize..2) {
            let tone = Tone { exposure, curve: CURVES[at] };
            let shown = 255.0 * srgb_encode(tone.curve.apply(f64::from(light) * exposure.exp2()));
            let byte = f64::from(tone.encode(&grey(light))[0]);
            prop_assert!((byte - shown).abs() <= 0.5 + 1e-4, "{byte} {shown}");
        }
    }
}
