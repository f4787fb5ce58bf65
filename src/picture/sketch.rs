//! A picture that levels are to come near to: light, how much of it counts, and where it is cut.

use super::exr::layer;
use super::shrink::shrink;
use super::tone::Tone;
use super::{Image, PictureError, decode};
use footlight_show::units::srgb_decode;

/// What a channel of a sketch says of its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// It is this.
    Exact,
    /// It is at most this: the display shows black.
    AtMost,
    /// It is at least this: the display shows its most.
    AtLeast,
}

/// A sketch in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    /// Its light.
    pub light: Image,
    /// How much each pixel counts, 0 to 1: the file's alpha.
    pub mask: Vec<f32>,
    /// Of each channel.
    pub known: Vec<Known>,
}

impl Sketch {
    /// Reads a file with about `limit_bytes` of memory. OpenEXR is light as it is, its colours multiplied
    /// by its alpha; PNG, JPEG and WebP are displayed with `tone`.
    ///
    /// # Errors
    /// [`PictureError`] as of the readers.
    pub fn read(bytes: &[u8], tone: Tone, limit_bytes: usize) -> Result<Sketch, PictureError> {
        if bytes.starts_with(b"\x76\x2f\x31\x01") {
            let (mut light, alpha) = layer::decode_with_alpha(bytes, limit_bytes)?;
            let red = alpha
                .iter()
                .flat_map(|image| image.data().iter().step_by(3));
            let mut mask: Vec<f32> = red.map(|a| a.clamp(0.0, 1.0)).collect();
            mask.resize(light.width() * light.height(), 1.0);
            divide(&mut light, &mask);
            let known = vec![Known::Exact; light.data().len()];
            return Ok(Sketch { light, mask, known });
        }
        if !decode::is_read(bytes) {
            return Err(PictureError::Malformed {
                format: "OpenEXR, PNG, JPEG or WebP",
                reason: "it begins like none of them".to_owned(),
            });
        }
        let (mut light, mask) = decode::light_and_alpha(bytes, limit_bytes)?;
        // Half a code of 8 bits from either end.
        let [black, white] = [0.5, 254.5].map(|code| tone.light(srgb_decode(code / 255.0)) as f32);
        let of = |value: &mut f32| {
            let (light, known) = match *value {
                v if v <= 0.0 => (black, Known::AtMost),
                v if v >= 1.0 => (white, Known::AtLeast),
                v => (tone.light(f64::from(v)) as f32, Known::Exact),
            };
            *value = light;
            known
        };
        let known = light.data_mut().iter_mut().map(of).collect();
        Ok(Sketch { light, mask, known })
    }

    /// The sketch averaged down to a size. Where a part of an area is white, its light is at least the mean;
    /// where most of it is black, at most.
    #[must_use]
    pub fn shrunk(&self, (width, height): (usize, usize)) -> Sketch {
        if self.light.size() == (width, height) {
            return self.clone();
        }
        let (wide, high) = self.light.size();
        let masks = || self.mask.iter().flat_map(|a| [*a; 3]);
        let small = |data: Vec<f32>| {
            let image = Image::from_data(wide, high, data);
            shrink(
                &image.unwrap_or_else(|| Image::new(wide, high)),
                width,
                height,
            )
        };
        let share = |of: Known| {
            let pairs = self.known.iter().zip(masks());
            small(pairs.map(|(k, a)| if *k == of { a } else { 0.0 }).collect())
        };
        let mut light = small(
            self.light
                .data()
                .iter()
                .zip(masks())
                .map(|(v, a)| v * a)
                .collect(),
        );
        let alphas = small(masks().collect());
        let mask: Vec<f32> = alphas.data().iter().step_by(3).copied().collect();
        divide(&mut light, &mask);
        let (black, white) = (share(Known::AtMost), share(Known::AtLeast));
        let shares = black.data().iter().zip(white.data()).zip(alphas.data());
        let known = shares.map(|((black, white), all)| match () {
            () if *white > 0.0 => Known::AtLeast,
            () if *black > 0.5 * all => Known::AtMost,
            () => Known::Exact,
        });
        Sketch {
            known: known.collect(),
            light,
            mask,
        }
    }
}

/// Takes colours that were multiplied by their alpha back.
fn divide(light: &mut Image, mask: &[f32]) {
    let (pixels, _) = light.data_mut().as_chunks_mut::<3>();
    for (pixel, alpha) in pixels.iter_mut().zip(mask) {
        let by = if *alpha > 0.0 { 1.0 / alpha } else { 0.0 };
        pixel.iter_mut().for_each(|value| *value *= by);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use crate::exr::{Precision, encode};
    use crate::png;
    use footlight_show::units::ToneCurve;

    const TONE: Tone = Tone {
        exposure: -3.0,
        curve: ToneCurve::Filmic,
    };

    /// Codes come back as the light that shows as them, and the ends as bounds.
    #[test]
    fn codes_are_the_light_that_shows_as_them() {
        let codes: Vec<u8> = (0..=255).flat_map(|c| [c; 3]).collect();
        let sketch = Sketch::read(&png::encode(16, 16, &codes).unwrap(), TONE, 1 << 20).unwrap();
        assert_eq!(TONE.encode(&sketch.light)[3..765], codes[3..765]);
        let [least, .., most] = TONE.thresholds();
        let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
        near(sketch.light.data()[0], least);
        near(sketch.light.data()[767], most);
        let ends = [sketch.known[0], sketch.known[3], sketch.known[765]];
        assert_eq!(ends, [Known::AtMost, Known::Exact, Known::AtLeast]);
        assert_eq!(sketch.mask, [1.0; 256]);
    }

    /// Two pixels with alpha, averaged to one: each counts by its alpha.
    #[test]
    fn transparent_pixels_count_less_or_not_at_all() {
        let image = Image::from_data(2, 1, vec![4.0, 4.0, 4.0, 1.0, 1.0, 1.0]).unwrap();
        let known = vec![Known::Exact; 6];
        let of = |mask: [f32; 2]| Sketch {
            light: image.clone(),
            mask: mask.to_vec(),
            known: known.clone(),
        };
        let one = of([0.25, 0.75]).shrunk((1, 1));
        assert_eq!(
            (one.light.data(), &one.mask[..]),
            (&[1.75; 3][..], &[0.5][..])
        );
        let none = of([0.0, 0.0]).shrunk((1, 1));
        assert_eq!(
            (none.light.data(), &none.mask[..]),
            (&[0.0; 3][..], &[0.0][..])
        );
    }

    #[test]
    fn an_exr_is_light_and_counts_as_a_whole() {
        let image = Image::from_data(2, 1, vec![400.0, -1.0, 0.0, 1.0, 2.0, 3.0]).unwrap();
        let bytes = encode(&image, Precision::Float, &[]).unwrap();
        let sketch = Sketch::read(&bytes, TONE, 1 << 20).unwrap();
        assert_eq!((sketch.light, sketch.mask), (image, vec![1.0; 2]));
        assert_eq!(sketch.known, [Known::Exact; 6]);
        for bytes in [&b""[..], b"text", b"\x89PNG\r\n\x1a\n", &bytes[..60]] {
            assert!(Sketch::read(bytes, TONE, 1 << 20).is_err());
        }
    }
}
