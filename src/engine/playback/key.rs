//! Key images in playback, in single or half precision; and the page's code of 8 bits.
//!
//! Playback is limited by reading key images, so their size sets its speed. Light is decoded before
//! blending; a larger code never means less light; zero stays zero.
//!
//! A code c of 8 bits, 0 to 1, means the light `low c^2 + high c^8`, with two numbers for each
//! image. The square follows the display's own code, so that darks are coded as finely as they are
//! shown: `low` is at most [`Tone::knee`]. The eighth power covers visible lamps, which must stay a
//! hundred times brighter than white while a cue fades them. Decoding takes only multiplications
//! and no table.
//!
//! [`Tone::knee`]: footlight_picture::tone::Tone::knee

use footlight_picture::Image;

/// Storage format of a key image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Single precision, unchanged: 12 bytes per pixel.
    Float,
    /// Half precision with a scale: relative error at most 2^-11, 6 bytes per pixel.
    Half,
}

impl Format {
    /// All formats, the most exact first.
    pub const ALL: [Format; 2] = [Format::Float, Format::Half];

    /// Its name: `f32` or `f16`.
    pub fn name(self) -> &'static str {
        match self {
            Format::Float => "f32",
            Format::Half => "f16",
        }
    }
}

/// The channels of a key image, interleaved RGB, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum KeyImage {
    /// Unchanged.
    Float(Vec<f32>),
    /// Light = IEEE 754 binary16 times `scale`, a power of two. Never subnormal, infinite or NaN.
    Half {
        /// The bits of the half-precision numbers.
        codes: Vec<u16>,
        /// The light of code 1.0.
        scale: f32,
    },
}

/// Meaning of the 8-bit codes of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByteCurve {
    /// Light per (c/255)^2.
    pub low: f32,
    /// Light per (c/255)^8.
    pub high: f32,
}

/// The brightest light of the 8-bit code, in knees: one hundred times white with the filmic curve.
/// Brighter light is clipped, which is invisible until it fades to a hundredth.
const REACH: f32 = 512.0;

impl ByteCurve {
    /// The curve for an image with the largest magnitude `peak`, with darks as fine as `knee` makes
    /// them; dimmer images have finer steps throughout.
    pub fn new(peak: f32, knee: f32) -> ByteCurve {
        let peak = peak.min(REACH * knee);
        let low = peak.min(knee);
        ByteCurve {
            low,
            high: peak - low,
        }
    }

    /// The light of a code without sign.
    pub fn light(self, code: u8) -> f32 {
        let (low, high) = self.per_code();
        byte_light(code, low, high)
    }

    /// Factors of c^2 and c^8 for integer codes.
    fn per_code(self) -> (f32, f32) {
        let square = 255.0_f64 * 255.0;
        let low = f64::from(self.low) / square;
        let high = f64::from(self.high) / (square * square * square * square);
        (low as f32, high as f32)
    }

    /// Nearest code of each channel's magnitude.
    pub(super) fn codes(self, data: &[f32]) -> Vec<u8> {
        let middles = self.middles();
        let starts = starts(&middles);
        let code = |value: &f32| {
            let magnitude = if value.is_nan() { 0.0 } else { value.abs() };
            let stretch = (magnitude.to_bits() >> 16) as usize % STRETCHES;
            #[allow(
                clippy::indexing_slicing,
                reason = "the rest is below the table's length"
            )]
            let mut code = starts[stretch];
            let magnitude = f64::from(magnitude);
            while (middles.get(usize::from(code))).is_some_and(|middle| *middle < magnitude) {
                code += 1;
            }
            code
        };
        data.iter().map(code).collect()
    }

    /// The light between neighbouring codes, where the nearest code changes. In double precision: a
    /// middle rounded to single could pass a neighbouring value.
    fn middles(self) -> [f64; 255] {
        let light = |code: u8| f64::from(self.light(code));
        std::array::from_fn(|code| {
            let code = code as u8;
            0.5 * (light(code) + light(code + 1))
        })
    }
}

/// Number of stretches of positive floats that agree in their 16 leading bits.
const STRETCHES: usize = 1 << 15;

/// The code at the start of each stretch of floats, from which few middles remain to compare.
fn starts(middles: &[f64; 255]) -> Box<[u8; STRETCHES]> {
    let mut starts = Box::new([0; STRETCHES]);
    let mut code = 0;
    for (stretch, start) in (0u32..).zip(starts.iter_mut()) {
        let light = f64::from(f32::from_bits(stretch << 16));
        while (middles.get(usize::from(code))).is_some_and(|middle| *middle < light) {
            code += 1;
        }
        *start = code;
    }
    starts
}

/// low c^2 + high c^8: the power by three products, without a table.
fn byte_light(code: u8, low: f32, high: f32) -> f32 {
    let c = f32::from(code);
    let c2 = c * c;
    let c4 = c2 * c2;
    low * c2 + high * (c4 * c4)
}

/// 2^112: the exponent that a half's bits lack when read as a float.
const REBIAS: f32 = f32::from_bits((127 + 112) << 23);
/// Least light that halves keep, relative to an image's brightest: 2^-29.
pub const HALF_RANGE: f64 = 1.0 / (1 << 29) as f64;
/// Light at which halves are clipped.
pub const HALF_BRIGHTEST: f32 = 2.1e9;
/// The largest half.
const HALF_MOST: f32 = 65504.0;
/// The smallest normal half, 2^-14; smaller values become zero. With the peak at 2^15 and more it
/// is 2^-29 of the image's brightest light.
const HALF_LEAST: f32 = 1.0 / 16384.0;

/// The light of a half that is zero or normal, with `factor` = scale times [`REBIAS`]. The sign
/// moves to the top, exponent and mantissa to their positions in a float; only integer instructions
/// are used, so that every processor gives equal bits.
#[inline(always)]
pub(super) fn half_light(code: u16, factor: f32) -> f32 {
    // Sign extension fills the four top bits, three of which are masked.
    let bits = (i32::from(code.cast_signed()) << 13) as u32 & 0x8fff_e000;
    f32::from_bits(bits) * factor
}

/// The factor for [`half_light`].
pub(super) fn half_factor(scale: f32) -> f32 {
    scale * REBIAS
}

/// The nearest half, ties to even; zero below [`HALF_LEAST`] and for NaN, the largest beyond it.
fn half(value: f32) -> u16 {
    if value.is_nan() || value.abs() < HALF_LEAST {
        return 0;
    }
    let magnitude = value.abs().min(HALF_MOST);
    let bits = magnitude.to_bits() - (112 << 23);
    let rounded = (bits + 0x0fff + ((bits >> 13) & 1)) >> 13;
    rounded as u16 | if value < 0.0 { 0x8000 } else { 0 }
}

/// The power of two that scales `peak` to between 2^14 and 2^15; 1 for black. Light beyond 2.1e9 is
/// clipped: the disk of the sun has 1.6e9 cd/m2.
fn half_scale(peak: f32) -> f32 {
    if peak < f32::MIN_POSITIVE {
        return 1.0;
    }
    let exponent = (peak.to_bits() >> 23) as i32 - 127;
    // Keeps the factors normal at both ends of the floats' range.
    2.0_f32.powi((exponent - 14).clamp(-126, 15))
}

impl KeyImage {
    /// Converts `image` to a format.
    ///
    /// Infinite and NaN values are kept in single precision; in half precision NaN becomes zero and
    /// infinities the brightest light of the format.
    pub fn new(image: &Image, format: Format) -> KeyImage {
        let data = image.data();
        match format {
            Format::Float => KeyImage::Float(data.to_vec()),
            Format::Half => {
                let scale = half_scale(peak(image));
                let codes = data.iter().map(|v| half(v / scale)).collect();
                KeyImage::Half { codes, scale }
            }
        }
    }

    /// Bytes of its channels.
    pub fn bytes(&self) -> usize {
        match self {
            KeyImage::Float(data) => size_of_val(data.as_slice()),
            KeyImage::Half { codes, .. } => size_of_val(codes.as_slice()),
        }
    }

    /// The decoded light.
    #[cfg(test)]
    pub fn light(&self) -> Vec<f32> {
        match self {
            KeyImage::Float(data) => data.clone(),
            KeyImage::Half { codes, scale } => {
                let factor = half_factor(*scale);
                codes.iter().map(|c| half_light(*c, factor)).collect()
            }
        }
    }
}

/// The largest finite magnitude of an image.
pub fn peak(image: &Image) -> f32 {
    let finite = image
        .data()
        .iter()
        .map(|v| v.abs())
        .filter(|v| v.is_finite());
    finite.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use footlight_picture::tone::Tone;
    use footlight_show::units::ToneCurve;
    use proptest::prelude::*;

    fn row(values: &[f32]) -> Image {
        let data: Vec<f32> = values.iter().flat_map(|v| [*v; 3]).collect();
        Image::from_data(values.len(), 1, data).unwrap()
    }

    fn kept(values: &[f32], format: Format) -> Vec<f32> {
        let image = KeyImage::new(&row(values), format);
        image.light().iter().step_by(3).copied().collect()
    }

    /// Light after the 8-bit code, with its sign, as in the page.
    fn coded(values: &[f32], knee: f32) -> Vec<f32> {
        let curve = ByteCurve::new(peak(&row(values)), knee);
        let codes = curve.codes(values);
        let pairs = codes.iter().zip(values);
        pairs
            .map(|(code, v)| {
                if *v < 0.0 {
                    -curve.light(*code)
                } else {
                    curve.light(*code)
                }
            })
            .collect()
    }

    /// Every normal half against its definition.
    #[test]
    fn halves_are_those_of_ieee_754() {
        for code in 0..=u16::MAX {
            let exponent = i32::from(code >> 10 & 31);
            let mantissa = f64::from(code & 1023) / 1024.0;
            let sign = if code & 0x8000 == 0 { 1.0 } else { -1.0 };
            if !(1..31).contains(&exponent) {
                continue;
            }
            let value = (sign * (1.0 + mantissa) * f64::from(exponent - 15).exp2()) as f32;
            assert_eq!(half(value), code, "{value}");
            assert_eq!(half_light(code, half_factor(1.0)), value);
            assert_eq!(half_light(code, half_factor(0.125)), value / 8.0);
        }
        assert_eq!(half_light(0, half_factor(1.0)), 0.0);
        // Ties go to the even code; the largest half is the limit.
        assert_eq!(half(2049.0), half(2048.0));
        assert_eq!(half(2051.0), half(2052.0));
        for huge in [65519.0, 65520.0, 1e30, f32::INFINITY] {
            assert_eq!(half(huge), half(65504.0));
            assert_eq!(half(-huge), half(-65504.0));
        }
        assert_eq!([half(f32::NAN), half(1e-9), half(-1e-9)], [0; 3]);
    }

    #[test]
    fn a_picture_of_any_brightness_has_halves_of_full_precision() {
        for peak in [1e-30, 1e-20, 0.3, 1.0, 7e4, 1.6e9] {
            let values = [peak, -peak / 3.0, peak * 1e-6, 0.0];
            let back = kept(&values, Format::Half);
            for (value, back) in values.iter().zip(&back) {
                let bound = value.abs() * (2.0_f32).powi(-11) + peak * 2.0_f32.powi(-29);
                assert!((value - back).abs() <= bound, "{value} {back}");
            }
        }
        // Beyond the limit, and black.
        let back = kept(&[3e38, f32::INFINITY, 0.0], Format::Half);
        assert!(back[0] > 2e9 && back[1].is_finite() && back[2] == 0.0);
        assert_eq!(kept(&[0.0, f32::NAN], Format::Half), [0.0, 0.0]);
    }

    #[test]
    fn every_code_of_eight_bits_survives_with_its_sign() {
        for (peak, knee) in [
            (1.0, 1.0),
            (0.02, 0.5),
            (170.0, 0.5),
            (1e6, 3.0),
            (1e-9, 1.0),
        ] {
            let curve = ByteCurve::new(peak, knee);
            let lights: Vec<f32> = (0..=255).map(|c| curve.light(c)).collect();
            assert!(lights.is_sorted_by(|a, b| a < b), "{curve:?}");
            let reached = peak.min(REACH * knee);
            assert!((lights[255] / reached - 1.0).abs() < 1e-6);
            let both: Vec<f32> = lights.iter().flat_map(|l| [*l, -l]).collect();
            assert_eq!(coded(&both, knee), both, "{curve:?}");
        }
    }

    #[test]
    fn what_eight_bits_cannot_hold() {
        let back = coded(&[f32::INFINITY, f32::NAN, 0.5], 1.0);
        assert_eq!(back[0], 0.5);
        assert_eq!(back[1], 0.0);
        assert_eq!(coded(&[0.0, 0.0], 1.0), [0.0, 0.0]);
        let cut = coded(&[1e9, 1.0], 0.5);
        assert!((cut[0] - 256.0).abs() < 1e-3);
    }

    /// Largest error of a key's displayed brightness, in display steps.
    #[test]
    fn light_is_coded_about_as_finely_as_it_is_shown() {
        // By the image's peak, with white at 1.
        let filmic = [(0.2, 0.73), (2.0, 0.73), (8.0, 0.91), (70.0, 1.4)];
        let plain = [(0.2, 0.32), (2.0, 0.94), (8.0, 1.5), (70.0, 2.4)];
        for (curve, bounds) in [(ToneCurve::Filmic, filmic), (ToneCurve::Plain, plain)] {
            let tone = Tone {
                exposure: -2.0,
                curve,
            };
            let steps = |light: f64| 255.0 * tone.display(light);
            let white = tone.light(1.0);
            for (peak, bound) in bounds {
                let peak = peak * white;
                let most = white.min(peak);
                let values: Vec<f32> = (0..=9000)
                    .map(|i| (most * (f64::from(i) / 9000.0).powi(2)) as f32)
                    .chain([peak as f32])
                    .collect();
                let back = coded(&values, tone.knee());
                let off = |(v, b): (&f32, &f32)| (steps((*v).into()) - steps((*b).into())).abs();
                let worst = values.iter().zip(&back).map(off).fold(0.0, f64::max);
                assert!(worst < bound, "{curve:?} {peak}: {worst}");
                assert!(worst > 0.6 * bound, "the bound says something: {worst}");
            }
        }
    }

    proptest! {
        /// The code is the nearest one, for any image.
        #[test]
        fn bytes_are_the_nearest(
            values in prop::collection::vec(-20.0_f32..20.0, 1..40),
            knee in 0.01_f32..50.0,
        ) {
            let peak = values.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            let curve = ByteCurve::new(peak, knee);
            for (value, back) in values.iter().zip(coded(&values, knee)) {
                let value = value.clamp(-REACH * knee, REACH * knee);
                let apart = |light: f32| (f64::from(value.abs()) - f64::from(light)).abs();
                let best = (0..=255).map(|c| apart(curve.light(c))).fold(f64::INFINITY, f64::min);
                prop_assert!(apart(back.abs()) <= best, "{value} {back}");
                prop_assert!(back == 0.0 || (back < 0.0) == (value < 0.0));
            }
        }
    }
}
