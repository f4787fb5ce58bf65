//! Writes JPEG: 8-bit images with small errors, a tenth of the size of PNG.

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

use super::PictureError;
use super::png::require_size;

/// Errors stay invisible in a picture that moves.
const QUALITY: u8 = 90;

/// Encodes interleaved bytes (three per pixel, rows from the top) as a JPEG file. A code differs by
/// some units from the original.
///
/// # Errors
/// [`PictureError::Size`] when there are no pixels, more than 65,535 on a side, or the number of
/// bytes does not fit.
pub fn encode(width: usize, height: usize, rgb: &[u8]) -> Result<Vec<u8>, PictureError> {
    require_size(width, height, rgb)?;
    let side = |n: usize| u16::try_from(n).ok().filter(|n| *n > 0);
    let (Some(w), Some(h)) = (side(width), side(height)) else {
        let message = format!("a JPEG file cannot hold {width} x {height} pixels");
        return Err(PictureError::Size(message));
    };
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, QUALITY)
        .encode(rgb, w.into(), h.into(), ExtendedColorType::Rgb8)
        .map_err(|error| PictureError::Size(error.to_string()))?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::decode::codes;

    #[test]
    fn codes_stay_near() {
        let (width, height) = (97, 64);
        // A soft disc of changing colour, as of a beam.
        let code = |i: usize| {
            let (x, y) = ((i / 3 % width) as f64 - 40.0, (i / 3 / width) as f64 - 30.0);
            (200.0 * (-(x * x + y * y) / 400.0).exp()) as u8 + 10 * (i % 3) as u8
        };
        let rgb: Vec<u8> = (0..3 * width * height).map(code).collect();
        let file = encode(width, height, &rgb).unwrap();
        assert!(file.len() < rgb.len() / 5, "{}", file.len());
        let (_, read) = codes(&file, 1 << 20).unwrap();
        let read = read.iter().flat_map(|[rgb @ .., _]| rgb);
        let off = read.zip(&rgb).map(|(a, b)| a.abs_diff(*b));
        assert!(off.max().unwrap() <= 6);
    }

    #[test]
    fn sizes_that_the_format_lacks_are_refused() {
        assert!(encode(0, 0, &[]).is_err() && encode(2, 2, &[0; 11]).is_err());
        let row = vec![0; 3 * 70_000];
        assert!(matches!(
            encode(70_000, 1, &row),
            Err(PictureError::Size(_))
        ));
    }
}
