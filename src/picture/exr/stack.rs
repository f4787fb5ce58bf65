//! Several images as layers of one OpenEXR file.
//!
//! Invariants: one part; channels `LAYER.R`, `LAYER.G`, `LAYER.B` sorted by bytes, which Blender,
//! Nuke and oiiotool recognise as layers; layer names are unique ASCII without dots (which would
//! nest them), at most 29 bytes (so that channels need no long names). The images are not copied:
//! only the file takes further memory.

use std::collections::BTreeSet;
use std::io::Cursor;

use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock, lines::LineRefMut};
use exr::error::{Error as ExrError, Result as ExrResult, UnitResult};
use exr::image::Encoding;
use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, IntegerBounds, SampleType, Text};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, Headers};
use exr::prelude::{SmallVec, f16};

use super::{Precision, layer_attributes, malformed, require_finite, require_half_range};
use crate::{Image, PictureError};

/// Most bytes of a layer's name.
const NAME_LIMIT: usize = 29;

/// A channel of the file: its name, its layer and its colour (0 to 2).
pub(super) type Channel = (String, usize, usize);

/// Encodes `layers` (names as from [`names`], images of one size) as an OpenEXR file, with
/// `attributes` in its header.
///
/// # Errors
/// [`PictureError::Size`] for no layers, no pixels or images of different sizes; else as
/// [`super::encode`].
pub fn encode(
    layers: &[(String, &Image)],
    precision: Precision,
    attributes: &[(String, String)],
) -> Result<Vec<u8>, PictureError> {
    let images: Vec<&Image> = layers.iter().map(|(_, image)| *image).collect();
    let Some(first) = images.first().filter(|image| !image.data().is_empty()) else {
        return Err(PictureError::Size("no picture with pixels".to_owned()));
    };
    let size = first.size();
    if images.iter().any(|image| image.size() != size) {
        return Err(PictureError::Size("layers of different sizes".to_owned()));
    }
    let file = Rows {
        channels: channels(layers),
        images,
        precision,
    };
    file.encode(size, attributes)
}

/// Source of a file's rows.
pub(super) struct Rows<'i> {
    pub(super) channels: Vec<Channel>,
    /// Images of one size.
    pub(super) images: Vec<&'i Image>,
    pub(super) precision: Precision,
}

impl Rows<'_> {
    /// Encodes images of this size, whose numbers fit the precision.
    pub(super) fn encode(
        &self,
        size: (usize, usize),
        attributes: &[(String, String)],
    ) -> Result<Vec<u8>, PictureError> {
        for image in &self.images {
            require_finite(image)?;
            if self.precision == Precision::Half {
                require_half_range(image)?;
            }
        }
        let (sample, encoding) = match self.precision {
            Precision::Half => (SampleType::F16, Encoding::SMALL_LOSSLESS),
            Precision::Float => (SampleType::F32, Encoding::UNCOMPRESSED),
        };
        let described = |(name, _, _): &Channel| ChannelDescription::named(name.as_str(), sample);
        let list: SmallVec<[_; 5]> = self.channels.iter().map(described).collect();
        let header = Header::new(Text::from(""), size, list)
            .with_encoding(
                encoding.compression,
                BlockDescription::ScanLines,
                encoding.line_order,
            )
            .with_attributes(layer_attributes(attributes)?);
        let mut bytes = Vec::new();
        let headers: Headers = SmallVec::from_iter([header]);
        exr::block::write(Cursor::new(&mut bytes), headers, true, |meta, writer| {
            let mut compressor = writer.sequential_blocks_compressor(&meta);
            for header in &meta.headers {
                for (place, index) in header.blocks_increasing_y_order().enumerate() {
                    let block = header.get_absolute_block_pixel_coordinates(index.location)?;
                    compressor.compress_block(place, self.block(header, block)?)?;
                }
            }
            Ok(())
        })
        .map_err(malformed)?;
        Ok(bytes)
    }

    fn block(&self, header: &Header, block: IntegerBounds) -> ExrResult<UncompressedBlock> {
        let index = BlockIndex {
            layer: 0,
            pixel_position: block.position.to_usize("block")?,
            pixel_size: block.size,
            level: Vec2(0, 0),
        };
        let mut done = Ok(());
        let block = UncompressedBlock::from_lines(&header.channels, index, |line| {
            let written = self.write(line);
            if done.is_ok() {
                done = written;
            }
        });
        done.map(|()| block)
    }

    /// A row of one channel.
    fn write(&self, line: LineRefMut<'_>) -> UnitResult {
        let at = line.location;
        let channel = self.channels.get(at.channel);
        let found = channel.and_then(|(_, layer, colour)| Some((self.images.get(*layer)?, colour)));
        let (image, colour) = found.ok_or(ExrError::Invalid("a channel of no layer".into()))?;
        let start = (at.position.1 * image.width() + at.position.0) * 3 + colour;
        let row = image.data().get(start..).unwrap_or_default();
        let sample = |x: usize| row.get(3 * x).copied().unwrap_or_default();
        match self.precision {
            Precision::Half => line.write_samples(|x| f16::from_f32(sample(x))),
            Precision::Float => line.write_samples(sample),
        }
    }
}

fn channels(layers: &[(String, &Image)]) -> Vec<Channel> {
    let mut out: Vec<Channel> = Vec::with_capacity(3 * layers.len());
    for (layer, (name, _)) in layers.iter().enumerate() {
        let colours = ["R", "G", "B"].into_iter().enumerate();
        out.extend(colours.map(|(colour, letter)| (format!("{name}.{letter}"), layer, colour)));
    }
    out.sort();
    out
}

/// Turns names into layer names: letters without an ASCII equivalent and dots become `_`, long
/// names are cut, and repeated ones are numbered.
pub fn names<'n>(wanted: impl IntoIterator<Item = &'n str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut one = |name: &str| {
        let plain = |c: char| match c {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '-' | '_' => c,
            _ => '_',
        };
        let base: String = name.chars().map(plain).collect();
        let base = match base.as_str() {
            "" => "_",
            base => base,
        };
        let (mut number, mut tail) = (1, String::new());
        loop {
            let room = NAME_LIMIT.saturating_sub(tail.len());
            let name: String = base.chars().take(room).chain(tail.chars()).collect();
            if taken.insert(name.clone()) {
                return name;
            }
            number += 1;
            tail = format!("_{number}");
        }
    };
    wanted.into_iter().map(&mut one).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::super::{attributes, layer};
    use super::*;

    fn ramp(width: usize, height: usize, seed: usize) -> Image {
        let wave = |i: usize| ((i * 37 + seed * 11) % 101) as f32 / 7.0 - 4.0;
        Image::from_data(width, height, (0..width * height * 3).map(wave).collect()).unwrap()
    }

    #[test]
    fn layers_come_back_by_name_whatever_their_order() {
        // More rows than a block has, and names in another order than the images.
        let images: Vec<Image> = (0..5).map(|i| ramp(23, 37, i)).collect();
        let wanted = names(["key2", "fill", "key10", "Back", "lamp.r"]);
        let layers: Vec<(String, &Image)> = wanted.iter().cloned().zip(&images).collect();
        let notes = [("settings".to_owned(), "key2: lamp 1".to_owned())];
        for precision in [Precision::Float, Precision::Half] {
            let bytes = encode(&layers, precision, &notes).unwrap();
            let mut sorted = wanted.clone();
            sorted.sort();
            assert_eq!(layer::names(&bytes).unwrap(), sorted);
            assert_eq!(attributes(&bytes).unwrap(), notes);
            let asked: Vec<Option<&str>> = wanted.iter().map(|n| Some(n.as_str())).collect();
            let found = layer::decode(&bytes, &asked, 1 << 20).unwrap();
            for (found, image) in found.into_iter().zip(&images) {
                let found = found.unwrap();
                for (a, b) in found.data().iter().zip(image.data()) {
                    let room = if precision == Precision::Float {
                        0.0
                    } else {
                        b.abs() / 2048.0
                    };
                    assert!((a - b).abs() <= room, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn names_are_plain_short_and_each_once() {
        let long = "x".repeat(40);
        let found = names(["lamp.r", "lamp_r", "Stra\u{df}e", "", &long, &long]);
        assert_eq!(found[..4], ["lamp_r", "lamp_r_2", "Stra_e", "_"]);
        assert_eq!(found[4], "x".repeat(29));
        assert_eq!(found[5], format!("{}_2", "x".repeat(27)));
    }

    #[test]
    fn what_cannot_be_one_file_is_refused() {
        let (small, large) = (ramp(2, 2, 0), ramp(3, 2, 0));
        let of = |layers: &[(String, &Image)]| encode(layers, Precision::Half, &[]).is_err();
        assert!(of(&[]));
        assert!(of(&[("a".to_owned(), &small), ("b".to_owned(), &large)]));
        assert!(of(&[("a".to_owned(), &Image::new(0, 0))]));
        let mut bright = small.clone();
        bright.data_mut()[0] = 1e5;
        assert!(of(&[("a".to_owned(), &bright)]));
    }
}
