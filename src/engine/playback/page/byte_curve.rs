//! The page's code of 8 bits for light; a larger code never means less light; zero stays zero.
//!
//! A code c, 0 to 1, means the light `low c^2 + high c^8`, with two numbers for each image. The
//! square follows the display's own code, so that darks are coded as finely as they are shown: `low`
//! is at most [`Tone::knee`]. The eighth power covers visible lamps, which must stay a hundred times
//! brighter than white while a cue fades them. Decoding takes only multiplications and no table.
//!
//! [`Tone::knee`]: footlight_picture::tone::Tone::knee

use footlight_picture::Image;

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
