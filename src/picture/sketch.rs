//! A sketch for solving levels: target light, weights, and clipped channels.

use super::exr::layer;
use super::shrink::shrink;
use super::tone::Tone;
use super::{Image, PictureError, decode};
use footlight_show::units::srgb_decode;

/// A sketch in linear light.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    /// Its light.
    pub light: Image,
    /// Weight of each pixel, 0 to 1: the file's alpha.
    pub mask: Vec<f32>,
    /// True for channels that are clipped: their light is at least this.
    pub cut: Vec<bool>,
}

impl Sketch {
    /// Reads a file with about `limit_bytes` of memory. OpenEXR holds light, its colours multiplied
    /// by its alpha; PNG, JPEG and WebP are inverted through `tone`.
    ///
    /// # Errors
    /// [`PictureError`] of the readers.
    pub fn read(bytes: &[u8], tone: Tone, limit_bytes: usize) -> Result<Sketch, PictureError> {
        if bytes.starts_with(b"\x76\x2f\x31\x01") {
            let (mut light, alpha) = layer::decode_with_alpha(bytes, limit_bytes)?;
            let red = alpha
                .iter()
                .flat_map(|image| image.data().iter().step_by(3));
            let mut mask: Vec<f32> = red.map(|a| a.clamp(0.0, 1.0)).collect();
            mask.resize(light.width() * light.height(), 1.0);
            divide(&mut light, &mask);
            let cut = vec![false; light.data().len()];
            return Ok(Sketch { light, mask, cut });
        }
        if !decode::is_read(bytes) {
            return Err(PictureError::Malformed {
                format: "OpenEXR, PNG, JPEG or WebP",
                reason: "it begins like none of them".to_owned(),
            });
        }
        let (mut light, mask) = decode::light_and_alpha(bytes, limit_bytes)?;
        let cut = light.data().iter().map(|v| *v >= 1.0).collect();
        // Black and white are rounded 8-bit codes: on average a quarter, and at least 254.5.
        let [black, white] = [0.25, 254.5].map(|code| srgb_decode(code / 255.0));
        for value in light.data_mut() {
            *value = tone.light(f64::from(*value).clamp(black, white)) as f32;
        }
        Ok(Sketch { light, mask, cut })
    }

    /// The sketch averaged down to a size. A pixel is clipped when part of its area is.
    #[must_use]
    pub fn shrunk(&self, size: (usize, usize)) -> Sketch {
        if self.light.size() == size {
            return self.clone();
        }
        let small = |values: &mut dyn Iterator<Item = f32>| {
            let (wide, high) = self.light.size();
            let image = Image::from_data(wide, high, values.collect());
            shrink(
                &image.unwrap_or_else(|| Image::new(wide, high)),
                size.0,
                size.1,
            )
        };
        let masks = || self.mask.iter().flat_map(|a| [*a; 3]);
        let mut light = small(&mut self.light.data().iter().zip(masks()).map(|(v, a)| v * a));
        let cuts = small(&mut self.cut.iter().map(|cut| f32::from(u8::from(*cut))));
        let mask: Vec<f32> = small(&mut masks())
            .data()
            .iter()
            .step_by(3)
            .copied()
            .collect();
        divide(&mut light, &mask);
        let cut = cuts.data().iter().map(|share| *share > 0.0).collect();
        Sketch { light, mask, cut }
    }
}

/// Divides colours by their alpha.
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

    /// Codes become the light that shows as them, and the end codes become bounds.
    #[test]
    fn codes_are_the_light_that_shows_as_them() {
        let codes: Vec<u8> = (0..=255).flat_map(|c| [c; 3]).collect();
        let sketch = Sketch::read(&png::encode(16, 16, &codes).unwrap(), TONE, 1 << 20).unwrap();
        assert_eq!(TONE.encode(&sketch.light)[3..765], codes[3..765]);
        let [least, .., most] = TONE.thresholds();
        assert!(sketch.light.data()[0] < least && sketch.light.data()[0] > 0.0);
        assert!((sketch.light.data()[767] / most - 1.0).abs() < 1e-6);
        let cut: Vec<usize> = (0..768).filter(|i| sketch.cut[*i]).collect();
        assert_eq!(cut, [765, 766, 767]);
        assert_eq!(sketch.mask, [1.0; 256]);
    }

    /// Two pixels with alpha, averaged to one: each weighs by its alpha.
    #[test]
    fn transparent_pixels_count_less_or_not_at_all() {
        let image = Image::from_data(2, 1, vec![4.0, 4.0, 4.0, 1.0, 1.0, 1.0]).unwrap();
        let of = |mask: [f32; 2]| Sketch {
            light: image.clone(),
            mask: mask.to_vec(),
            cut: vec![false; 6],
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
        assert_eq!(sketch.cut, [false; 6]);
        for bytes in [&b""[..], b"text", b"\x89PNG\r\n\x1a\n", &bytes[..60]] {
            assert!(Sketch::read(bytes, TONE, 1 << 20).is_err());
        }
    }
}
