//! PNG, JPEG and WebP files, read by the `image` crate.
//!
//! Codes count as sRGB (IEC 61966-2-1), whatever the file's header or profile says. EXIF
//! orientation is applied. The size in the header is checked against the limit before any pixel is
//! decoded.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::{Codes, Image, PictureError, require_memory};
use footlight_show::units::srgb_decode;

/// Most bytes of a PNG file's header data, such as an inflated colour profile.
const HEADER_BYTES: u64 = 16 << 20;
/// Bytes per pixel of the decoded file and of a rotated copy, 16 bits per channel.
const DECODED: u64 = 8 + 8;
/// Additional bytes per pixel of the WebP decoder.
const WEBP: u64 = 8;

/// True when [`light`] and [`codes`] read files that begin with `bytes`.
pub fn is_read(bytes: &[u8]) -> bool {
    format(bytes).is_some()
}

fn format(bytes: &[u8]) -> Option<ImageFormat> {
    let format = image::guess_format(bytes).ok()?;
    let is_read = matches!(
        format,
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP
    );
    is_read.then_some(format)
}

/// Decodes a file to linear light, 0 to 1, in steps of at most 0.9 % of the whole at 8 bits. Grey
/// becomes RGB; transparent pixels are blended with black. Uses at most about `limit_bytes` of
/// memory.
///
/// # Errors
/// [`PictureError::Malformed`] for a corrupt or truncated file, [`PictureError::Unsupported`] for
/// another format, [`PictureError::Memory`].
pub fn light(bytes: &[u8], limit_bytes: usize) -> Result<Image, PictureError> {
    let (mut image, alpha) = light_and_alpha(bytes, limit_bytes)?;
    let (pixels, _) = image.data.as_chunks_mut::<3>();
    for (pixel, alpha) in pixels.iter_mut().zip(alpha) {
        pixel.iter_mut().for_each(|value| *value *= alpha);
    }
    Ok(image)
}

/// Like [`light`], with the colours of transparent pixels unchanged, and the alpha of each pixel, 0
/// to 1.
///
/// # Errors
/// As [`light`].
pub fn light_and_alpha(
    bytes: &[u8],
    limit_bytes: usize,
) -> Result<(Image, Vec<f32>), PictureError> {
    let decoded = decoded(bytes, DECODED + 16, limit_bytes)?.into_rgba16();
    let table: Vec<f32> = (0..=u16::MAX)
        .map(|code| srgb_decode(f64::from(code) / f64::from(u16::MAX)) as f32)
        .collect();
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let mut data = Vec::with_capacity(width * height * 3);
    let mut mask = Vec::with_capacity(width * height);
    for pixel in decoded.pixels() {
        let [r, g, b, alpha] = pixel.0;
        mask.push(f32::from(alpha) / f32::from(u16::MAX));
        data.extend([r, g, b].map(|c| table.get(usize::from(c)).copied().unwrap_or_default()));
    }
    let image = Image::from_data(width, height, data)
        .ok_or_else(|| PictureError::Size("some of its pixels are missing".to_owned()))?;
    Ok((image, mask))
}

/// The sRGB codes of a file with alpha, 16 bits reduced to eight.
///
/// # Errors
/// As [`light`].
pub fn codes(bytes: &[u8], limit_bytes: usize) -> Result<Codes, PictureError> {
    // The codes and the texels made of them: eight bytes each, and a third more for the smaller
    // levels.
    let decoded = decoded(bytes, 4 + 11, limit_bytes)?.into_rgba8();
    let size = [decoded.width(), decoded.height()].map(|n| n as usize);
    Ok((size, decoded.pixels().map(|pixel| pixel.0).collect()))
}

/// The upright image of a file; a pixel takes `pixel_bytes` of the limit.
fn decoded(
    bytes: &[u8],
    pixel_bytes: u64,
    limit_bytes: usize,
) -> Result<DynamicImage, PictureError> {
    let format = format(bytes).ok_or_else(|| PictureError::Unsupported {
        format: "image",
        reason: "it is neither PNG nor JPEG nor WebP".to_owned(),
    })?;
    let (name, besides) = match format {
        ImageFormat::Png => ("PNG", 0),
        ImageFormat::Jpeg => ("JPEG", 0),
        _ => ("WebP", WEBP),
    };
    let malformed = |error: image::ImageError| PictureError::Malformed {
        format: name,
        reason: error.to_string(),
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(match format {
        ImageFormat::Png => HEADER_BYTES.min(limit_bytes as u64),
        _ => limit_bytes as u64,
    });
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(malformed)?;
    let (width, height) = decoder.dimensions();
    let needed = u64::from(width)
        .saturating_mul(u64::from(height))
        .saturating_mul(pixel_bytes + besides);
    require_memory(
        (width as usize, height as usize),
        needed,
        limit_bytes as u64,
    )?;
    let orientation = decoder.orientation().map_err(malformed)?;
    let mut decoded = DynamicImage::from_decoder(decoder).map_err(malformed)?;
    decoded.apply_orientation(orientation);
    Ok(decoded)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use crate::png::encode;
    use ::png::{BitDepth, ColorType, Encoder};
    use proptest::prelude::*;

    /// A lossless WebP file of two pixels, written by libwebp.
    const TWO: &[u8] = include_bytes!("../../tests/kit/two.webp");

    fn png(colour: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 1, 1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(data).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn codes_of_every_kind_become_linear_light() {
        let half = srgb_decode(188.0 / 255.0) as f32;
        let (eight, sixteen) = (BitDepth::Eight, BitDepth::Sixteen);
        let kinds: [(_, _, &[u8], _); 6] = [
            (ColorType::Rgb, eight, &[255, 188, 0], [1.0, half, 0.0]),
            (ColorType::Grayscale, eight, &[188], [half; 3]),
            (ColorType::Grayscale, BitDepth::One, &[0x80], [1.0; 3]),
            (
                ColorType::GrayscaleAlpha,
                eight,
                &[188, 51],
                [half * 0.2; 3],
            ),
            (ColorType::Rgba, eight, &[255, 188, 0, 0], [0.0; 3]),
            // 188/255 in 16 bits is the byte twice.
            (
                ColorType::Rgb,
                sixteen,
                &[255, 255, 188, 188, 0, 0],
                [1.0, half, 0.0],
            ),
        ];
        for (colour, depth, data, wanted) in kinds {
            let image = light(&png(colour, depth, data), 1 << 10).unwrap();
            let found = image.pixel(0, 0).unwrap();
            for (f, w) in found.iter().zip(wanted) {
                assert!((f - w).abs() < 1e-6, "{colour:?} {depth:?} {found:?}");
            }
        }
    }

    #[test]
    fn a_header_that_asks_for_more_than_the_limit_is_refused() {
        let bytes = encode(40, 50, &[7; 6000]).unwrap();
        assert!(light(&bytes, 2000 * 32).is_ok());
        let refused = light(&bytes, 2000 * 32 - 1);
        assert!(matches!(
            refused,
            Err(PictureError::Memory { width: 40, .. })
        ));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn corrupt_files_are_errors_or_pictures(
            edits in prop::collection::vec((0_usize..400, any::<u8>()), 1..6),
            cut in prop::option::of(0_usize..400),
        ) {
            let rgb: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 41 % 256) as u8).collect();
            let mut bytes = encode(7, 5, &rgb).unwrap();
            for (at, value) in edits {
                let at = at % bytes.len();
                bytes[at] = value;
            }
            bytes.truncate(cut.unwrap_or(usize::MAX));
            if let Ok(image) = light(&bytes, 1 << 16) {
                prop_assert!(image.data().len() * 4 <= 1 << 16);
            }
        }
    }

    #[test]
    fn two_pixels_of_webp_with_alpha() {
        let expected = vec![[200, 10, 30, 255], [0, 255, 7, 64]];
        assert_eq!(codes(TWO, 1 << 20).unwrap(), ([2, 1], expected));
        assert!(matches!(codes(TWO, 40), Err(PictureError::Memory { .. })));
        for length in 0..TWO.len() - 2 {
            assert!(codes(TWO.get(..length).unwrap(), 1 << 20).is_err());
        }
    }

    /// A grey image of 16 x 8, its left and right block of one code each, built by hand with
    /// Huffman tables of one code. `orientation` is stored in an EXIF segment.
    fn jpeg(orientation: u8) -> Vec<u8> {
        let mut file = vec![0xff, 0xd8, 0xff, 0xe1, 0, 34];
        file.extend(b"Exif\0\0II*\0\x08\0\0\0\x01\0");
        file.extend([
            0x12,
            0x01,
            3,
            0,
            1,
            0,
            0,
            0,
            orientation,
            0,
            0,
            0,
            0,
            0,
            0,
            0,
        ]);
        file.extend([0xff, 0xdb, 0, 67, 0]);
        file.extend([1; 64]);
        file.extend([0xff, 0xc0, 0, 11, 8, 0, 8, 0, 16, 1, 1, 0x11, 0]);
        for (class, symbol) in [(0x00, 6), (0x10, 0)] {
            file.extend([0xff, 0xc4, 0, 20, class, 1]);
            file.extend([0; 15]);
            file.push(symbol);
        }
        file.extend([0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0]);
        // A block: the code 0, the difference of the mean from the previous block in six bits, then
        // its end. By 40 and 40 eighths, from 128.
        file.extend([0b0101_0000, 0b0101_0000, 0xff, 0xd9]);
        file
    }

    #[test]
    fn photographs_stand_upright() {
        let (left, right) = ([133, 133, 133, 255], [138, 138, 138, 255]);
        let corner = |orientation: u8| {
            let ([width, height], codes) = codes(&jpeg(orientation), 1 << 20).unwrap();
            (width, height, codes[0], codes[codes.len() - 1])
        };
        assert_eq!(corner(1), (16, 8, left, right));
        assert_eq!(corner(2), (16, 8, right, left));
        assert_eq!(corner(3), (16, 8, right, left));
        assert_eq!(corner(6), (8, 16, left, right));
        assert_eq!(corner(8), (8, 16, right, left));
        let file = jpeg(6);
        assert!(matches!(
            codes(&file, 100),
            Err(PictureError::Memory { .. })
        ));
        for length in 0..file.len() - 8 {
            let _ = codes(file.get(..length).unwrap(), 1 << 20);
        }
    }
}
