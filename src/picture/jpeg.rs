//! JPEG files, read only: baseline and progressive, grey, colour and CMYK.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{Codes, PictureError, require_memory};

/// The sRGB codes of a JPEG file. At most about `limit_bytes` of memory are used.
///
/// # Errors
/// [`PictureError::Malformed`] for a corrupt file, [`PictureError::Memory`].
pub fn codes(bytes: &[u8], limit_bytes: usize) -> Result<Codes, PictureError> {
    // 65,500 is the format's own limit.
    let options = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(65_500)
        .set_max_height(65_500);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(malformed)?;
    let info = decoder
        .info()
        .ok_or_else(|| malformed("it has no header"))?;
    let size = [usize::from(info.width), usize::from(info.height)];
    // What progressive files keep, RGB and what comes out are 13; codes and the texels made of them,
    // as of a PNG file, are more.
    let needed = (size[0] as u64)
        .saturating_mul(size[1] as u64)
        .saturating_mul(4 + 11);
    require_memory((size[0], size[1]), needed, limit_bytes as u64)?;
    let rgb = decoder.decode().map_err(malformed)?;
    let (rgb, _) = rgb.as_chunks::<3>();
    let codes = rgb.iter().map(|[r, g, b]| [*r, *g, *b, 255]);
    Ok((size, codes.collect()))
}

fn malformed(reason: impl ToString) -> PictureError {
    PictureError::Malformed {
        format: "JPEG",
        reason: reason.to_string(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A grey image of 8 x 8, one code all over, by hand: Huffman tables of one code each.
    #[test]
    fn a_block_of_one_colour() {
        let mut file = vec![0xff, 0xd8, 0xff, 0xdb, 0, 67, 0];
        file.extend([1; 64]);
        file.extend([0xff, 0xc0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0]);
        for (class, symbol) in [(0x00, 6), (0x10, 0)] {
            file.extend([0xff, 0xc4, 0, 20, class, 1]);
            file.extend([0; 15]);
            file.push(symbol);
        }
        // The mean differs from 128 by 40 / 8: six bits, 101000; then the end of the block.
        file.extend([
            0xff,
            0xda,
            0,
            8,
            1,
            1,
            0,
            0,
            63,
            0,
            0b0101_0000,
            0b1111_1111,
            0,
            0xff,
            0xd9,
        ]);
        let (size, codes) = super::codes(&file, 1 << 20).unwrap();
        assert_eq!(size, [8, 8]);
        assert_eq!(codes, vec![[133, 133, 133, 255]; 64]);
        assert!(matches!(
            super::codes(&file, 100),
            Err(PictureError::Memory { .. })
        ));
        for length in 0..file.len() - 8 {
            let _ = super::codes(file.get(..length).unwrap(), 1 << 20);
        }
    }
}
