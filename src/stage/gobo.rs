//! The image of a scenic projection, prepared for projection.
//!
//! A [`Gobo`] holds the image and smaller ones of half the size each, down to one texel, every
//! texel the exact mean of its area, also for odd sizes: averaging light over many texels costs no
//! more than reading one. Texels are linear; 1 is the projector's peak. Invariants: at least one
//! texel; every number finite and not negative. It depends on neither projectors nor surfaces.

use footlight_picture::shrink::shrink;
use footlight_picture::{Image, PictureError, decode, exr};

/// Most pixels of a slide.
pub const MOST_PIXELS: usize = 1 << 24;

/// Reasons why an image cannot be projected.
#[derive(Debug, thiserror::Error)]
pub enum GoboError {
    /// The file holds no readable image.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Too many pixels.
    #[error("an image of {0} x {1} pixels; a projection takes {MOST_PIXELS} pixels at most")]
    Large(usize, usize),
    /// Negative light.
    #[error("a negative number at column {0}, row {1}")]
    Negative(usize, usize),
    /// The image is black.
    #[error("the image is black all over")]
    Black,
}

/// An image and its prefiltered levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Gobo {
    levels: Vec<Image>,
    grey: bool,
}

impl Gobo {
    /// Reads a PNG, JPEG or WebP file (sRGB-coded, transparent pixels as black) or an OpenEXR file
    /// (linear) within about `limit` bytes.
    ///
    /// # Errors
    /// [`GoboError`].
    pub fn read(bytes: &[u8], limit: usize) -> Result<Gobo, GoboError> {
        let image = match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => exr::decode(bytes, limit)?,
            _ => decode::light(bytes, limit)?,
        };
        Gobo::new(image)
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|l| size_of_val(l.data())).sum()
    }

    /// Prepares a linear image.
    ///
    /// # Errors
    /// [`GoboError`] when it is too large, has negative numbers, or is black.
    pub fn new(image: Image) -> Result<Gobo, GoboError> {
        let (width, height) = (image.width(), image.height());
        if width.saturating_mul(height) > MOST_PIXELS {
            return Err(GoboError::Large(width, height));
        }
        let wrong = image.data().iter().position(|x| !x.is_finite() || *x < 0.0);
        if let Some(at) = wrong {
            return Err(GoboError::Negative(at / 3 % width, at / 3 / width));
        }
        if image.data().iter().all(|x| *x == 0.0) {
            return Err(GoboError::Black);
        }
        let same = |p: &[f32]| p.windows(2).all(|w| w.first() == w.last());
        let grey = image.data().chunks_exact(3).all(same);
        let mut levels = vec![image];
        while let Some(last) = levels.last().filter(|l| l.width() > 1 || l.height() > 1) {
            levels.push(shrink(
                last,
                last.width().div_ceil(2),
                last.height().div_ceil(2),
            ));
        }
        Ok(Gobo { levels, grey })
    }

    /// The full image, from which all levels follow.
    pub fn image(&self) -> Option<&Image> {
        self.levels.first()
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.levels
            .first()
            .map_or((1, 1), |l| (l.width(), l.height()))
    }

    /// True when all channels are equal everywhere.
    pub fn is_grey(&self) -> bool {
        self.grey
    }

    /// One channel at a position (0 to 1 from the left, 0 to 1 from the top), averaged over about
    /// `texels` of the full image: bilinear in the two levels around that size, linear between
    /// them. Beyond the border the border repeats.
    pub fn texel(&self, u: f64, v: f64, texels: f64, channel: usize) -> f64 {
        let most = (self.levels.len() - 1) as f64;
        let level = texels.max(1.0).log2().min(most);
        let (low, share) = (level.floor(), level.fract());
        let at = |index: f64| {
            let image = self.levels.get(index as usize);
            image.map_or(0.0, |image| bilinear(image, u, v, channel))
        };
        let near = at(low);
        if share == 0.0 {
            return near;
        }
        near + (at(low + 1.0) - near) * share
    }
}

fn bilinear(image: &Image, u: f64, v: f64, channel: usize) -> f64 {
    let axis = |x: f64, n: usize| {
        let at = (x * n as f64 - 0.5).clamp(0.0, (n - 1) as f64);
        // `at` is clamped and not negative.
        let low = at as usize;
        (low, (low + 1).min(n - 1), at - low as f64)
    };
    let (x0, x1, s) = axis(u, image.width());
    let (y0, y1, t) = axis(v, image.height());
    let texel = |x: usize, y: usize| {
        let at = (y * image.width() + x) * 3 + channel;
        f64::from(image.data().get(at).copied().unwrap_or(0.0))
    };
    let top = texel(x0, y0) * (1.0 - s) + texel(x1, y0) * s;
    let bottom = texel(x0, y1) * (1.0 - s) + texel(x1, y1) * s;
    top * (1.0 - t) + bottom * t
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn image(width: usize, height: usize, f: impl Fn(usize, usize) -> [f32; 3]) -> Image {
        let at = |i: usize| f(i % width, i / width);
        let data = (0..width * height).flat_map(at).collect();
        Image::from_data(width, height, data).unwrap()
    }

    #[test]
    fn every_level_keeps_the_mean() {
        for (width, height) in [(1, 1), (8, 8), (7, 5), (100, 3), (1, 9)] {
            let noise =
                |x, y| [(x * 7 + y * 13) % 11, (x * y) % 5 + 1, x % 2].map(|n| n as f32 + 0.5);
            let slide = Gobo::new(image(width, height, noise)).unwrap();
            let mean = |i: &Image, c: usize| {
                let all = i.data().iter().skip(c).step_by(3);
                all.map(|x| f64::from(*x)).sum::<f64>() / (i.width() * i.height()) as f64
            };
            for c in 0..3 {
                let whole = mean(&slide.levels[0], c);
                for level in &slide.levels {
                    assert!(
                        (mean(level, c) / whole - 1.0).abs() < 1e-6,
                        "{width}x{height}"
                    );
                }
                assert!((slide.texel(0.3, 0.9, 1e9, c) / whole - 1.0).abs() < 1e-6);
            }
            assert!(!slide.is_grey());
        }
    }

    #[test]
    fn texels_stand_at_their_centres() {
        let slide = Gobo::new(image(4, 2, |x, y| [x as f32, y as f32, 1.0])).unwrap();
        for x in 0..4 {
            for y in 0..2 {
                let (u, v) = ((x as f64 + 0.5) / 4.0, (y as f64 + 0.5) / 2.0);
                assert!((slide.texel(u, v, 1.0, 0) - x as f64).abs() < 1e-12);
                assert!((slide.texel(u, v, 1.0, 1) - y as f64).abs() < 1e-12);
            }
        }
        assert!((slide.texel(0.5, 0.5, 1.0, 0) - 1.5).abs() < 1e-12);
        // Halfway between the levels of 1 and 2 texels.
        let between = slide.texel(0.125, 0.25, 2.0_f64.sqrt(), 0);
        assert!((between - 0.25).abs() < 1e-12, "{between}");
    }

    #[test]
    fn what_cannot_be_thrown_is_refused() {
        let refused = |i: Image| Gobo::new(i).unwrap_err().to_string();
        assert!(refused(Image::new(3, 2)).contains("black"));
        let negative = image(3, 2, |x, y| {
            [1.0, if (x, y) == (2, 1) { -0.1 } else { 0.0 }, 0.0]
        });
        assert!(refused(negative).contains("column 2, row 1"));
        assert!(refused(Image::new(8192, 2049)).contains("8192 x 2049"));
        for bytes in [
            &b""[..],
            b"GIF89a",
            b"\x89PNG\r\n\x1a\n",
            b"\x76\x2f\x31\x01",
        ] {
            assert!(Gobo::read(bytes, 1 << 20).is_err());
        }
    }
}
