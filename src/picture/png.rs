//! PNG: 8-bit sRGB pictures; read with 16 bits too.
//!
//! Invariants: the bytes depend on the pixels alone; the file says that its codes are sRGB. What is
//! read is held against the caller's limit before any pixel is.

use std::io::Cursor;

use ::png::{
    BitDepth, ColorType, Compression, Decoder, Encoder, Filter, Limits, SrgbRenderingIntent,
    Transformations,
};

use super::{Codes, Image, PictureError, require_memory};
use crate::units::srgb_decode;

/// Interleaved sRGB bytes (three a pixel, rows from the top) as a PNG file.
///
/// # Errors
/// `PictureError::Size` when there are no pixels or the number of bytes does not fit.
pub fn encode(width: usize, height: usize, rgb: &[u8]) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::new();
    let encoder = encoder(&mut bytes, width, height)?;
    require_size(width, height, rgb)?;
    encoder
        .write_header()
        .and_then(|mut writer| {
            writer.write_image_data(rgb)?;
            writer.finish()
        })
        .map_err(refused)?;
    Ok(bytes)
}

/// The picture in a PNG file, its codes taken as sRGB (IEC 61966-2-1) whatever its header says, and
/// turned linear: 0 to 1, in steps of at most 0.9 % of the whole at 8 bits. Grey becomes RGB; what
/// is transparent lets black through. At most about `limit_bytes` of memory are used.
///
/// # Errors
/// [`PictureError::Malformed`] for a corrupt or truncated file, [`PictureError::Memory`].
pub fn decode(bytes: &[u8], limit_bytes: usize) -> Result<Image, PictureError> {
    // Samples of four channels with two bytes, and the picture.
    let ([width, height], codes, colour, depth) =
        samples(bytes, Transformations::EXPAND, 8 + 12, limit_bytes)?;
    let data = linear(&codes, colour, depth);
    Image::from_data(width, height, data).ok_or_else(|| malformed("some of its pixels are missing"))
}

/// The sRGB codes of a PNG file with alpha, those of 16 bits cut to eight.
///
/// # Errors
/// As [`decode`].
pub fn codes(bytes: &[u8], limit_bytes: usize) -> Result<Codes, PictureError> {
    let wanted = Transformations::EXPAND | Transformations::STRIP_16 | Transformations::ALPHA;
    // Samples and codes are less than codes and the texels that are made of them: eight bytes each,
    // and a third more for the coarser levels.
    let (size, codes, colour, _) = samples(bytes, wanted, 4 + 11, limit_bytes)?;
    let pixel = |pixel: &[u8]| match *pixel {
        [r, g, b, a] => [r, g, b, a],
        [grey, a] => [grey, grey, grey, a],
        _ => [0, 0, 0, 255],
    };
    let pixels = codes.chunks_exact(colour.samples().max(1));
    Ok((size, pixels.map(pixel).collect()))
}

/// Columns and rows, the samples of all pixels, what they stand for and how many bits they have,
/// where a pixel takes so many bytes of the limit.
fn samples(
    bytes: &[u8],
    wanted: Transformations,
    pixel_bytes: u64,
    limit_bytes: usize,
) -> Result<([usize; 2], Vec<u8>, ColorType, BitDepth), PictureError> {
    let limits = Limits { bytes: limit_bytes };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(wanted);
    let mut reader = decoder.read_info().map_err(malformed)?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let needed = (width as u64)
        .saturating_mul(height as u64)
        .saturating_mul(pixel_bytes);
    require_memory((width, height), needed, limit_bytes as u64)?;
    let size = reader.output_buffer_size();
    let mut codes = vec![0; size.ok_or_else(|| malformed("it is too large to be addressed"))?];
    let frame = reader.next_frame(&mut codes).map_err(malformed)?;
    codes.truncate(frame.buffer_size());
    Ok(([width, height], codes, frame.color_type, frame.bit_depth))
}

/// Interleaved linear RGB of samples whose colours are expanded.
fn linear(codes: &[u8], colour: ColorType, depth: BitDepth) -> Vec<f32> {
    let wide = depth == BitDepth::Sixteen;
    let top: u16 = if wide { u16::MAX } else { u16::from(u8::MAX) };
    let share = |code: u16| f64::from(code) / f64::from(top);
    let table: Vec<f32> = (0..=top)
        .map(|code| srgb_decode(share(code)) as f32)
        .collect();
    let samples: Vec<u16> = match wide {
        true => codes
            .chunks_exact(2)
            .map(|c| c.iter().fold(0, |n, b| n << 8 | u16::from(*b)))
            .collect(),
        false => codes.iter().map(|c| u16::from(*c)).collect(),
    };
    let mut out = Vec::with_capacity(samples.len() / colour.samples().max(1) * 3);
    for pixel in samples.chunks_exact(colour.samples().max(1)) {
        let (own, alpha) = match (pixel, colour) {
            ([own @ .., alpha], ColorType::GrayscaleAlpha | ColorType::Rgba) => {
                (own, share(*alpha) as f32)
            }
            _ => (pixel, 1.0),
        };
        let value = |code: &u16| alpha * table.get(usize::from(*code)).copied().unwrap_or_default();
        match own {
            [r, g, b] => out.extend([r, g, b].map(value)),
            [grey, ..] => out.extend([value(grey); 3]),
            [] => {}
        }
    }
    out
}

fn malformed(reason: impl ToString) -> PictureError {
    PictureError::Malformed {
        format: "PNG",
        reason: reason.to_string(),
    }
}

/// An encoder of 8-bit sRGB. The fast compression takes a twentieth of the balanced one's time for
/// files a tenth larger (the tavern's page: 0.2 s for 4.0, 12.1 MB for 10.9).
pub(super) fn encoder<'w, W: std::io::Write>(
    to: W,
    width: usize,
    height: usize,
) -> Result<Encoder<'w, W>, PictureError> {
    let side = |n: usize| {
        u32::try_from(n)
            .ok()
            .filter(|n| (1..=i32::MAX as u32).contains(n))
    };
    let (Some(w), Some(h)) = (side(width), side(height)) else {
        let message = format!("a PNG file cannot hold {width} x {height} pixels");
        return Err(PictureError::Size(message));
    };
    let mut encoder = Encoder::new(to, w, h);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Adaptive);
    Ok(encoder)
}

/// Three bytes for each pixel.
pub(super) fn require_size(width: usize, height: usize, rgb: &[u8]) -> Result<(), PictureError> {
    let expected = width.checked_mul(height).and_then(|n| n.checked_mul(3));
    if expected == Some(rgb.len()) {
        return Ok(());
    }
    let found = rgb.len();
    let message = format!("{found} bytes are not a picture of {width} x {height} pixels");
    Err(PictureError::Size(message))
}

/// What remains after the sizes have been checked: more than the format's counters hold.
pub(super) fn refused(error: ::png::EncodingError) -> PictureError {
    PictureError::Size(error.to_string())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use proptest::prelude::*;

    fn file(colour: ColorType, depth: BitDepth, data: &[u8]) -> Vec<u8> {
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
        let kinds = [
            (
                ColorType::Rgb,
                BitDepth::Eight,
                vec![255, 188, 0],
                [1.0, half, 0.0],
            ),
            (ColorType::Grayscale, BitDepth::Eight, vec![188], [half; 3]),
            (ColorType::Grayscale, BitDepth::One, vec![0x80], [1.0; 3]),
            (
                ColorType::GrayscaleAlpha,
                BitDepth::Eight,
                vec![188, 51],
                [half * 0.2; 3],
            ),
            (
                ColorType::Rgba,
                BitDepth::Eight,
                vec![255, 188, 0, 0],
                [0.0; 3],
            ),
            // 188/255 as 16 bits is the byte twice.
            (
                ColorType::Rgb,
                BitDepth::Sixteen,
                vec![255, 255, 188, 188, 0, 0],
                [1.0, half, 0.0],
            ),
        ];
        for (colour, depth, data, wanted) in kinds {
            let image = decode(&file(colour, depth, &data), 1 << 10).unwrap();
            let found = image.pixel(0, 0).unwrap();
            for (f, w) in found.iter().zip(wanted) {
                assert!((f - w).abs() < 1e-6, "{colour:?} {depth:?} {found:?}");
            }
        }
    }

    #[test]
    fn a_header_that_asks_for_more_than_the_limit_is_refused() {
        let bytes = encode(40, 50, &[7; 6000]).unwrap();
        assert!(decode(&bytes, 40_000).is_ok());
        assert!(matches!(
            decode(&bytes, 39_999),
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
            if let Ok(image) = decode(&bytes, 1 << 16) {
                prop_assert!(image.data().len() * 4 <= 1 << 16);
            }
        }
    }

    #[test]
    fn pixels_come_back() {
        let rgb: Vec<u8> = (0..7 * 5 * 3).map(|i| (i * 41 % 256) as u8).collect();
        let bytes = encode(7, 5, &rgb).unwrap();
        let mut reader = ::png::Decoder::new(Cursor::new(&bytes))
            .read_info()
            .unwrap();
        let mut back = vec![0; rgb.len()];
        reader.next_frame(&mut back).unwrap();
        assert_eq!(back, rgb);
        assert!(reader.info().srgb.is_some());
        assert_eq!((reader.info().width, reader.info().height), (7, 5));
    }

    #[test]
    fn wrong_sizes_are_refused() {
        for (width, height, bytes) in [(0, 1, 0), (1, 1, 4), (2, 2, 11), (usize::MAX, 2, 0)] {
            let refused = encode(width, height, &vec![0; bytes]);
            assert!(matches!(refused, Err(PictureError::Size(_))));
        }
    }
}
