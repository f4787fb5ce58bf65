//! WebP files, read only: lossy and lossless; of one that moves the first picture.

use std::io::Cursor;

use image_webp::WebPDecoder;

use super::{Codes, PictureError, require_memory};

/// The sRGB codes of a WebP file. At most about `limit_bytes` of memory are used.
///
/// # Errors
/// [`PictureError::Malformed`] for a corrupt file, [`PictureError::Memory`].
pub fn codes(bytes: &[u8], limit_bytes: usize) -> Result<Codes, PictureError> {
    let mut decoder = WebPDecoder::new(Cursor::new(bytes)).map_err(malformed)?;
    let (width, height) = decoder.dimensions();
    let size = [width as usize, height as usize];
    // What the decoder keeps and what comes out, beside codes and texels as of a PNG file.
    let needed = u64::from(width)
        .saturating_mul(u64::from(height))
        .saturating_mul(8 + 4 + 11);
    require_memory((size[0], size[1]), needed, limit_bytes as u64)?;
    decoder.set_memory_limit(limit_bytes);
    let length = decoder
        .output_buffer_size()
        .ok_or_else(|| malformed("its size is none that can be"))?;
    let mut found = vec![0; length];
    decoder.read_image(&mut found).map_err(malformed)?;
    let codes = match decoder.has_alpha() {
        true => found.as_chunks::<4>().0.to_vec(),
        false => {
            let (rgb, _) = found.as_chunks::<3>();
            rgb.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect()
        }
    };
    Ok((size, codes))
}

fn malformed(reason: impl ToString) -> PictureError {
    PictureError::Malformed {
        format: "WebP",
        reason: reason.to_string(),
    }
}

/// Tests, and a file for those of others.
#[cfg(test)]
pub mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Two pixels without loss, as libwebp writes them.
    pub const TWO: &[u8] = &[
        82, 73, 70, 70, 34, 0, 0, 0, 87, 69, 66, 80, 86, 80, 56, 76, 21, 0, 0, 0, 47, 1, 0, 0, 16,
        15, 240, 133, 255, 65, 254, 193, 197, 129, 126, 35, 28, 25, 209, 255, 0, 0,
    ];

    #[test]
    fn two_pixels_with_alpha() {
        let expected = vec![[200, 10, 30, 255], [0, 255, 7, 64]];
        assert_eq!(super::codes(TWO, 1 << 20).unwrap(), ([2, 1], expected));
        let small = super::codes(TWO, 40);
        assert!(matches!(small, Err(PictureError::Memory { .. })));
        for length in 0..TWO.len() - 2 {
            assert!(super::codes(TWO.get(..length).unwrap(), 1 << 20).is_err());
        }
    }
}
