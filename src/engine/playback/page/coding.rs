//! Images in the 8-bit code, as PNG or JPEG files, within a budget.

use super::PageError;
use super::byte_curve::{ByteCurve, peak};
use footlight_host::work::{Work, in_order};
use footlight_picture::shrink::shrink;
use footlight_picture::tone::Tone;
use footlight_picture::{Image, PictureError, jpeg, png};

/// Least width of reduced images.
const NARROWEST: usize = 160;

/// An image in the 8-bit code.
#[derive(Clone, Debug, PartialEq)]
pub struct Coded {
    /// Exposed light per c^2 and per c^8, c being 0 to 1.
    pub law: [f32; 2],
    /// A PNG or JPEG file of the codes c.
    pub codes: Vec<u8>,
    /// A PNG file that is white in negative channels.
    pub signs: Option<Vec<u8>>,
}

impl Coded {
    /// Bytes of its files.
    pub fn bytes(&self) -> usize {
        self.codes.len() + self.signs.as_ref().map_or(0, Vec::len)
    }
}

/// Size and format of the images of a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Form {
    /// Width and height.
    pub size: (usize, usize),
    /// Number of leading images in JPEG, except those with visible signs.
    pub jpegs: usize,
}

/// Encodes images of one size within a budget of bytes in data URLs. If necessary all are reduced
/// alike; returns them with their size.
///
/// # Errors
/// As [`super::write`].
pub fn fit(
    images: &[&Image],
    tone: Tone,
    budget: usize,
    work: Work<'_>,
) -> Result<(Vec<Coded>, (usize, usize)), PageError> {
    let full = images.first().map_or((0, 0), |i| i.size());
    let mut size = full;
    loop {
        match attempt(images, tone, Form { size, jpegs: 0 }, budget, work)? {
            Ok(coded) => return Ok((coded, size)),
            Err(needed) => size = smaller(size, full, needed, budget)?,
        }
    }
}

/// The next size to try when images need `needed` bytes at this one.
pub fn smaller(
    size: (usize, usize),
    full: (usize, usize),
    needed: usize,
    budget: usize,
) -> Result<(usize, usize), PictureError> {
    // The file grows with the number of pixels, and small images compress less well.
    let side = (0.95 * budget as f64 / needed as f64).sqrt();
    let scaled = |n: usize| ((n as f64 * side) as usize).max(1);
    let size = (scaled(size.0), scaled(size.1));
    if size.0 < NARROWEST.min(full.0) {
        Err(PictureError::Bytes {
            needed,
            limit: budget,
        })
    } else {
        Ok(size)
    }
}

/// Number of images from which the total is estimated well within a factor of two.
const ENOUGH: usize = 32;

/// All images in a size within the budget, or the bytes that they would take.
pub type Attempt = Result<Vec<Coded>, usize>;

/// Encodes images as long as they stay within the budget.
pub fn attempt(
    all: &[&Image],
    tone: Tone,
    form: Form,
    budget: usize,
    work: Work<'_>,
) -> Result<Attempt, PageError> {
    let total = all.len();
    let all: Vec<(usize, &Image)> = all.iter().copied().enumerate().collect();
    let mut pictures = Vec::with_capacity(total);
    let mut bytes = 0;
    for together in all.chunks(work.threads.max(1)) {
        work.check()?;
        for picture in all_coded(together, form, tone) {
            let picture = picture?;
            // Bytes in base64.
            bytes += picture.bytes() / 3 * 4;
            pictures.push(picture);
        }
        let estimate = bytes * total / pictures.len();
        if bytes > budget || (pictures.len() >= ENOUGH && estimate > 2 * budget) {
            return Ok(Err(estimate));
        }
        work.progress.report("page", pictures.len(), total);
    }
    Ok(Ok(pictures))
}

/// Encodes numbered images, each on a thread.
fn all_coded(
    images: &[(usize, &Image)],
    form: Form,
    tone: Tone,
) -> Vec<Result<Coded, PictureError>> {
    let one = |&(number, image): &(usize, &Image)| {
        let is_jpeg = number < form.jpegs;
        let (width, height) = form.size;
        if image.size() == form.size {
            coded(image, tone, is_jpeg)
        } else {
            coded(&shrink(image, width, height), tone, is_jpeg)
        }
    };
    in_order(images, images.len(), one)
}

/// Encodes an image of exposed light in 8 bits. Signs are kept if the display could distinguish
/// them from black.
fn coded(image: &Image, tone: Tone, is_jpeg: bool) -> Result<Coded, PictureError> {
    let curve = ByteCurve::new(peak(image), tone.knee());
    let codes = curve.codes(image.data());
    let file = |codes: &[u8]| png::encode(image.width(), image.height(), codes);
    let least = image.data().iter().copied().fold(0.0, f32::min);
    let seen = tone.display(f64::from(-least)) * 255.0 > 0.5;
    let white = |v: &f32| if *v < 0.0 { 255 } else { 0 };
    let gain = tone.exposure.exp2() as f32;
    let (codes, signs) = if seen {
        let signs: Vec<u8> = image.data().iter().map(white).collect();
        (file(&codes)?, Some(file(&signs)?))
    } else {
        let positive = |(code, v): (&u8, &f32)| if *v < 0.0 { 0 } else { *code };
        let codes: Vec<u8> = codes.iter().zip(image.data()).map(positive).collect();
        let jpeg = || jpeg::encode(image.width(), image.height(), &codes);
        (if is_jpeg { jpeg() } else { file(&codes) }?, None)
    };
    Ok(Coded {
        law: [curve.low * gain, curve.high * gain],
        codes,
        signs,
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use footlight_show::units::ToneCurve;

    #[test]
    fn signs_are_kept_where_they_can_be_seen() {
        let tone = Tone {
            exposure: -2.0,
            curve: ToneCurve::Filmic,
        };
        let mut image = Image::from_data(4, 3, (0..36).map(|i| i as f32 / 9.0).collect()).unwrap();
        assert!(coded(&image, tone, false).unwrap().signs.is_none());
        image.data_mut()[5] = -1e-5;
        assert!(coded(&image, tone, false).unwrap().signs.is_none());
        image.data_mut()[5] = -0.1;
        assert!(coded(&image, tone, false).unwrap().signs.is_some());
    }
}
