//! OpenEXR: exact linear images, in memory.
//!
//! Written numbers are finite. Reading is bounded: the size in the header of *every* part is
//! checked against the caller's limit before any pixel is read, because a corrupt header may ask
//! for terabytes. OpenEXR has no checksum: a flipped bit reads as another number, which only a hash
//! kept elsewhere can detect.

pub mod layer;
mod primaries;
pub mod stack;

use std::io::Cursor;

use exr::block::UncompressedBlock;
use exr::error::Error as ExrError;
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, IntegerBounds, SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::f16;

use nalgebra::{Matrix3, Vector3};

use self::stack::Rows;
use super::{Image, PictureError, require_memory};

/// Storage of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 16 bits, ZIP compressed: for exchange. Relative error at most 2^-11 from 6.1e-5 to 65504;
    /// absolute error at most 3.0e-8 below.
    Half,
    /// 32 bits, uncompressed: exact. (Compression saves little on full floats.)
    Float,
}

/// The largest finite half.
const HALF_MAX: f32 = 65504.0;
/// Most bytes of an attribute's name; longer ones need a flag that old readers lack.
const NAME_LIMIT: usize = 31;

/// Encodes `image` as an OpenEXR file, with `attributes` in its header.
///
/// # Errors
/// [`PictureError::Size`] for an image without pixels, [`PictureError::NotFinite`],
/// [`PictureError::Range`] for magnitudes beyond 65504 at half precision, and
/// [`PictureError::Attribute`] for a name that is empty, longer than 31 bytes, repeated or
/// reserved, or for anything that is not ASCII.
pub fn encode(
    image: &Image,
    precision: Precision,
    attributes: &[(String, String)],
) -> Result<Vec<u8>, PictureError> {
    if image.width() == 0 || image.height() == 0 {
        return Err(PictureError::Size("a picture without pixels".to_owned()));
    }
    let channel = |(name, colour): (&str, usize)| (name.to_owned(), 0, colour);
    let file = Rows {
        channels: [("B", 2), ("G", 1), ("R", 0)].map(channel).to_vec(),
        images: vec![image],
        precision,
    };
    file.encode(image.size(), attributes)
}

/// Decodes the R, G and B channels of an OpenEXR file (scan lines or tiles, 16 or 32 bits, first
/// part that has them), in the size of its display window: pixels outside the data window are
/// black, pixels outside the display window are dropped. Other primaries than those of Rec. 709 are
/// converted. Uses at most about `limit_bytes` of memory.
///
/// # Errors
/// [`PictureError::Malformed`] for a corrupt or truncated file, [`PictureError::Memory`] when its
/// headers ask for more than `limit_bytes`, [`PictureError::Layer`] when only layers have R, G and
/// B, [`PictureError::Unsupported`] when no channels are R, G and B, and
/// [`PictureError::NotFinite`].
pub fn decode(bytes: &[u8], limit_bytes: usize) -> Result<Image, PictureError> {
    let mut images = layer::decode(bytes, &[None], limit_bytes)?;
    images.pop().unwrap_or_else(|| Err(truncated("no picture")))
}

/// The text attributes of the first part's header, except the format's own.
///
/// # Errors
/// [`PictureError::Malformed`] when the headers cannot be read.
pub fn attributes(bytes: &[u8]) -> Result<Vec<(String, String)>, PictureError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(malformed)?;
    let Some(header) = reader.headers().first() else {
        return Ok(Vec::new());
    };
    let own = header.own_attributes.other.iter();
    let all = own.chain(header.shared_attributes.other.iter());
    let found = |(name, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(value) => Some((text(name), text(value))),
        _ => None,
    };
    let mut found: Vec<(String, String)> = all.filter_map(found).collect();
    found.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(found)
}

fn require_finite(image: &Image) -> Result<(), PictureError> {
    let bad = |v: &&f32| !v.is_finite();
    let count = image.data().iter().filter(bad).count();
    let first = image.data().iter().position(|v| !v.is_finite());
    match first {
        None => Ok(()),
        Some(at) => Err(PictureError::NotFinite {
            count,
            x: at / 3 % image.width().max(1),
            y: at / 3 / image.width().max(1),
        }),
    }
}

/// Refuses numbers that would become infinite as a half. Rounding starts at 65520, but anything
/// beyond the largest half is already an error of scale.
fn require_half_range(image: &Image) -> Result<(), PictureError> {
    let beyond = image.data().iter().filter(|v| v.abs() > HALF_MAX);
    let (count, largest) = beyond.fold((0, 0.0_f32), |(n, m), v| (n + 1, m.max(v.abs())));
    if count == 0 {
        return Ok(());
    }
    Err(PictureError::Range {
        count,
        limit: HALF_MAX,
        largest,
    })
}

fn layer_attributes(attributes: &[(String, String)]) -> Result<LayerAttributes, PictureError> {
    let mut layer = LayerAttributes::default();
    for (name, value) in attributes {
        let refuse = |reason| PictureError::Attribute {
            name: name.clone(),
            reason,
        };
        if name.is_empty() || name.len() > NAME_LIMIT || !name.is_ascii() {
            return Err(refuse("a name has 1 to 31 ASCII characters"));
        }
        if RESERVED.split(' ').any(|reserved| reserved == name) {
            return Err(refuse("the format uses this name itself"));
        }
        if !value.is_ascii() || value.contains('\0') {
            return Err(refuse("text must be ASCII"));
        }
        let text = AttributeValue::Text(Text::from(value.as_str()));
        let before = layer.other.insert(Text::from(name.as_str()), text);
        if before.is_some() {
            return Err(refuse("given twice"));
        }
    }
    Ok(layer)
}

/// Reserved names with a fixed type and meaning (OpenEXR standard attributes).
const RESERVED: &str = "adoptedNeutral altitude aperture capDate channels chromaticities \
    chunkCount comments compression dataWindow displayWindow dwaCompressionLevel envmap expTime focus \
    framesPerSecond isoSpeed keyCode latitude lineOrder longitude lookModTransform \
    maxSamplesPerPixel multiView name owner pixelAspectRatio preview renderingTransform \
    screenWindowCenter screenWindowWidth software tiles timeCode type utcOffset version view \
    whiteLuminance wrapmodes xDensity worldToCamera";

/// Checks every header's size against the limit, and the number of chunks against the length of the
/// file (each chunk takes eight bytes in the offset table alone).
fn guard_sizes(headers: &[Header], file: usize, limit: u64) -> Result<(), PictureError> {
    let mut needed = 0_u64;
    for header in headers {
        if header.chunk_count.saturating_mul(8) > file {
            return Err(truncated("fewer bytes than its table of chunks needs"));
        }
        let window = header.shared_attributes.display_window.size;
        needed = needed
            .saturating_add(area(header.layer_size, header.channels.bytes_per_pixel))
            .saturating_add(area(window, 3 * size_of::<f32>()));
        let own = header.layer_size;
        require_memory((own.0.max(window.0), own.1.max(window.1)), needed, limit)?;
    }
    Ok(())
}

fn area(size: Vec2<usize>, bytes_per_pixel: usize) -> u64 {
    (size.0 as u64)
        .saturating_mul(size.1 as u64)
        .saturating_mul(bytes_per_pixel as u64)
}

/// The first flat part with unsubsampled R, G and B, and their indices among its channels.
fn rgb_part(headers: &[Header]) -> Result<(usize, [usize; 3]), PictureError> {
    for (part, header) in headers.iter().enumerate() {
        let find = |name: &str| {
            let mut list = header.channels.list.iter();
            list.position(|c| c.name.eq(name) && c.sampling == Vec2(1, 1))
        };
        if let (false, Some(r), Some(g), Some(b)) = (header.deep, find("R"), find("G"), find("B")) {
            return Ok((part, [r, g, b]));
        }
    }
    let names = headers.iter().flat_map(|h| h.channels.list.iter());
    let names: Vec<String> = names.take(12).map(|c| text(&c.name)).collect();
    Err(PictureError::Unsupported {
        format: "OpenEXR",
        reason: format!("no part has plain R, G and B; it has {}", names.join(", ")),
    })
}

/// Index for a missing channel, whose colour stays black.
const NO_CHANNEL: usize = usize::MAX;

/// The image being read: the display window, and the progress in the data window.
struct Canvas {
    image: Image,
    channels: [usize; 3],
    /// Corner of the data window relative to the display window.
    offset: [i64; 2],
    expected: usize,
    painted: usize,
    /// Conversion from the file's primaries to Rec. 709.
    primaries: Option<Matrix3<f64>>,
}

impl Canvas {
    fn new(header: &Header, channels: [usize; 3]) -> Result<Canvas, PictureError> {
        let IntegerBounds { position, size } = header.shared_attributes.display_window;
        if size.0 == 0 || size.1 == 0 {
            return Err(truncated("an empty display window"));
        }
        let data = header.own_attributes.layer_position;
        let wanted = channels.iter().filter(|c| **c != NO_CHANNEL).count();
        Ok(Canvas {
            image: Image::new(size.0, size.1),
            channels,
            offset: [
                i64::from(data.0) - i64::from(position.0),
                i64::from(data.1) - i64::from(position.1),
            ],
            expected: header.layer_size.0 * header.layer_size.1 * wanted,
            painted: 0,
            primaries: header
                .shared_attributes
                .chromaticities
                .filter(|_| wanted == channels.len())
                .map_or(Ok(None), primaries::to_rec_709)?,
        })
    }

    fn paint(&mut self, header: &Header, block: &UncompressedBlock) -> Result<(), PictureError> {
        for line in block.lines(&header.channels) {
            let at = line.location;
            let Some(channel) = self.channels.iter().position(|c| *c == at.channel) else {
                continue;
            };
            let kind = header.channels.list.get(at.channel).map(|c| c.sample_type);
            let samples: Vec<f32> = match kind {
                Some(SampleType::F16) => samples(&line, f16::to_f32)?,
                Some(SampleType::U32) => samples(&line, |v: u32| v as f32)?,
                _ => samples(&line, |v: f32| v)?,
            };
            self.painted += samples.len();
            self.paint_row(channel, at.position, &samples);
        }
        Ok(())
    }

    fn paint_row(&mut self, channel: usize, position: Vec2<usize>, samples: &[f32]) {
        let [dx, dy] = self.offset;
        let width = self.image.width();
        let mut rows = self.image.data_mut().chunks_exact_mut(width * 3);
        let row = usize::try_from(position.1 as i64 + dy).ok();
        let Some(row) = row.and_then(|y| rows.nth(y)) else {
            return;
        };
        // Pixels left and right of the display window are dropped.
        let x = position.0 as i64 + dx;
        let [outside, inside] = [-x, x].map(|n| usize::try_from(n).unwrap_or(0));
        let places = row.iter_mut().skip(channel).step_by(3).skip(inside);
        for (to, sample) in places.zip(samples.iter().skip(outside)) {
            *to = *sample;
        }
    }

    fn finish(self) -> Result<Image, PictureError> {
        if self.painted != self.expected {
            return Err(truncated("some of its pixels are missing or given twice"));
        }
        let mut image = self.image;
        require_finite(&image)?;
        if let Some(matrix) = self.primaries {
            let (pixels, _) = image.data_mut().as_chunks_mut::<3>();
            for pixel in pixels {
                let converted = matrix * Vector3::from(pixel.map(f64::from));
                *pixel = converted.map(|v| v as f32).into();
            }
        }
        Ok(image)
    }
}

/// Decodes a header text: UTF-8, as the format's library and other programs write it, or else
/// Latin-1.
fn text(text: &Text) -> String {
    let bytes = text.bytes();
    let utf_8 = std::str::from_utf8(bytes).map(str::to_owned);
    utf_8.unwrap_or_else(|_| bytes.iter().map(|b| char::from(*b)).collect())
}

fn samples<T: exr::io::Data + Copy>(
    line: &exr::block::lines::LineRef<'_>,
    convert: impl Fn(T) -> f32,
) -> Result<Vec<f32>, PictureError> {
    let mut read = vec![T::default(); line.location.sample_count];
    line.read_samples_into_slice(&mut read).map_err(malformed)?;
    Ok(read.into_iter().map(convert).collect())
}

fn malformed(error: ExrError) -> PictureError {
    match error {
        ExrError::NotSupported(reason) => PictureError::Unsupported {
            format: "OpenEXR",
            reason: reason.to_string(),
        },
        ExrError::Invalid(reason) => truncated(&reason),
        ExrError::Io(e) => truncated(&e.to_string()),
        ExrError::Aborted => truncated("aborted"),
    }
}

fn truncated(reason: &str) -> PictureError {
    PictureError::Malformed {
        format: "OpenEXR",
        reason: reason.to_owned(),
    }
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]
mod tests {
    use super::*;
    use ::exr::image::write::WritableImage;
    use ::exr::image::{Encoding, Image as ExrImage, Layer};
    use ::exr::prelude::{AnyChannel, AnyChannels, FlatSamples, SmallVec};
    use proptest::prelude::*;

    const LIMIT: usize = 1 << 20;

    fn sample(width: usize, height: usize) -> Image {
        let wave = |i: usize| ((i * 37 % 101) as f32 - 40.0) / 7.0;
        Image::from_data(width, height, (0..width * height * 3).map(wave).collect()).unwrap()
    }

    #[test]
    fn floats_come_back_bit_for_bit_and_halves_to_their_rounding() {
        let image = sample(33, 19);
        let notes = [("footlight.show".to_owned(), "tavern".to_owned())];
        let bytes = encode(&image, Precision::Float, &notes).unwrap();
        assert_eq!(decode(&bytes, LIMIT).unwrap(), image);
        assert_eq!(attributes(&bytes).unwrap(), notes);
        let half = decode(&encode(&image, Precision::Half, &[]).unwrap(), LIMIT).unwrap();
        for (a, b) in image.data().iter().zip(half.data()) {
            assert!((a - b).abs() <= a.abs() / 2048.0, "{a} {b}");
        }
        let again = decode(&encode(&half, Precision::Half, &[]).unwrap(), LIMIT).unwrap();
        assert_eq!(again, half);
    }

    #[test]
    fn what_the_format_cannot_hold_is_refused() {
        let with = |v: f32| Image::from_data(1, 1, vec![0.0, v, 0.0]).unwrap();
        let nan = encode(&with(f32::NAN), Precision::Float, &[]);
        assert!(matches!(nan, Err(PictureError::NotFinite { count: 1, .. })));
        let large = encode(&with(-7e4), Precision::Half, &[]);
        assert!(matches!(large, Err(PictureError::Range { .. })));
        assert!(encode(&with(-7e4), Precision::Float, &[]).is_ok());
        let empty = encode(&Image::new(0, 3), Precision::Float, &[]);
        assert!(matches!(empty, Err(PictureError::Size(_))));
        for (name, value) in [
            ("compression", "x"),
            ("", "x"),
            ("n\u{e4}me", "x"),
            ("a", "\u{e4}"),
        ] {
            let note = [(name.to_owned(), value.to_owned())];
            let refused = encode(&with(1.0), Precision::Float, &note);
            assert!(
                matches!(refused, Err(PictureError::Attribute { .. })),
                "{name}"
            );
        }
    }

    #[test]
    fn the_header_is_held_against_the_limit() {
        let bytes = encode(&sample(64, 64), Precision::Float, &[]).unwrap();
        let refused = decode(&bytes, 64 * 64 * 12);
        assert!(matches!(
            refused,
            Err(PictureError::Memory { width: 64, .. })
        ));
        // The far corner of the data window, an attribute of four integers, is moved to 2^30.
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        let mut huge = bytes.clone();
        huge[at + 8..at + 12].copy_from_slice(&(1_i32 << 30).to_le_bytes());
        let refused = decode(&huge, usize::MAX / 2);
        assert!(refused.is_err());
        assert!(decode(&huge, LIMIT).is_err());
    }

    /// A file whose data window (2 x 2 at (3, 1)) lies partly outside its display window (4 x 3 at
    /// (0, 0)), with `R` in 32-bit integers, `G` in halves and `B` in floats.
    #[test]
    fn windows_and_sample_types_are_respected() {
        let channel = |name: &str, samples| AnyChannel::new(name, samples);
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![
            channel("R", FlatSamples::U32(vec![1, 2, 3, 4])),
            channel(
                "G",
                FlatSamples::F16([5.0, 6.0, 7.0, 8.0].map(f16::from_f32).to_vec()),
            ),
            channel("B", FlatSamples::F32(vec![9.0, 10.0, 11.0, 12.0])),
        ]));
        let mut layer = Layer::new(
            (2, 2),
            LayerAttributes::default(),
            Encoding::UNCOMPRESSED,
            channels,
        );
        layer.attributes.layer_position = Vec2(3, 1);
        let mut file = ExrImage::from_layer(layer);
        file.attributes.display_window = IntegerBounds::new((0, 0), (4, 3));
        let mut bytes = Vec::new();
        file.write()
            .non_parallel()
            .to_buffered(Cursor::new(&mut bytes))
            .unwrap();
        let image = decode(&bytes, LIMIT).unwrap();
        assert_eq!(image.size(), (4, 3));
        assert_eq!(image.pixel(3, 1).unwrap(), [1.0, 5.0, 9.0]);
        assert_eq!(image.pixel(3, 2).unwrap(), [3.0, 7.0, 11.0]);
        assert_eq!(image.data().iter().filter(|v| **v != 0.0).count(), 6);
    }

    #[test]
    fn every_truncation_is_an_error() {
        for precision in [Precision::Half, Precision::Float] {
            let bytes = encode(&sample(9, 21), precision, &[]).unwrap();
            for end in 0..bytes.len() {
                assert!(decode(&bytes[..end], LIMIT).is_err(), "{end}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// No panic, and no image larger than the limit.
        #[test]
        fn corrupt_files_stay_within_the_limit(
            half in any::<bool>(),
            edits in prop::collection::vec((0_usize..1200, any::<u8>()), 1..6),
            cut in prop::option::of(0_usize..1200),
        ) {
            let precision = if half { Precision::Half } else { Precision::Float };
            let mut bytes = encode(&sample(9, 21), precision, &[]).unwrap();
            for (at, value) in edits {
                let at = at % bytes.len();
                bytes[at] = value;
            }
            bytes.truncate(cut.unwrap_or(usize::MAX));
            if let Ok(image) = decode(&bytes, LIMIT) {
                prop_assert!(image.data().len() * 4 <= LIMIT);
            }
        }

        #[test]
        fn garbage_is_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            prop_assert!(decode(&bytes, LIMIT).is_err());
        }
    }
}
