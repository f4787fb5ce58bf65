//! Layers of an OpenEXR file: several images in one.
//!
//! Renderers write them in two ways, and both are read: channels with a dot (`Key.R`, `Key.G`,
//! `Key.B` are the layer `Key`; `View.Key.R` the layer `View.Key`), and parts with names, each with
//! its own R, G and B. Invariant: one pass over the file, however many layers are wanted.

use std::collections::BTreeMap;
use std::io::Cursor;

use exr::block::reader::{ChunksReader, Reader};
use exr::math::Vec2;
use exr::meta::attribute::ChannelDescription;
use exr::meta::header::Header;

use super::{Canvas, NO_CHANNEL, guard_sizes, malformed, rgb_part, text};
use crate::{Image, PictureError, require_memory};

/// Location of a layer: its part, and the indices of R, G and B among the part's channels.
type Place = (usize, [usize; 3]);

/// Names of the layers with R, G and B, sorted; plain R, G and B of an unnamed part are no layer.
///
/// # Errors
/// [`PictureError::Malformed`] when the headers cannot be read.
pub fn names(bytes: &[u8]) -> Result<Vec<String>, PictureError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(malformed)?;
    Ok(places(reader.headers()).into_keys().collect())
}

/// Decodes several layers, in the order requested, each like [`super::decode`]; `None` means the
/// plain R, G and B. Uses at most about `limit_bytes` of memory.
///
/// # Errors
/// For the whole file as [`super::decode`]; for one layer [`PictureError::Layer`] when the file has
/// none of that name, and [`PictureError::NotFinite`].
pub fn decode(
    bytes: &[u8],
    wanted: &[Option<&str>],
    limit_bytes: usize,
) -> Result<Vec<Result<Image, PictureError>>, PictureError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(malformed)?;
    let headers = reader.headers().to_vec();
    guard_sizes(&headers, bytes.len(), limit_bytes as u64)?;
    let known = places(&headers);
    let places = wanted.iter().map(|name| find(&known, *name, &headers));
    painted(reader, &headers, places.collect(), limit_bytes)
}

/// Decodes the plain R, G and B of a file, and the A of that part as the red channel of a second
/// image; `None` without A. A is 0 where there is no pixel.
///
/// # Errors
/// As [`super::decode`].
pub fn decode_with_alpha(
    bytes: &[u8],
    limit_bytes: usize,
) -> Result<(Image, Option<Image>), PictureError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(malformed)?;
    let headers = reader.headers().to_vec();
    guard_sizes(&headers, bytes.len(), limit_bytes as u64)?;
    let plain = find(&places(&headers), None, &headers)?;
    let channels = headers.get(plain.0).map(|header| &header.channels.list);
    let is_alpha = |c: &ChannelDescription| c.name.eq("A") && c.sampling == Vec2(1, 1);
    let alpha = channels.and_then(|list| list.iter().position(is_alpha));
    let mut wanted = vec![Ok(plain)];
    wanted.extend(alpha.map(|a| Ok((plain.0, [a, NO_CHANNEL, NO_CHANNEL]))));
    let mut images = painted(reader, &headers, wanted, limit_bytes)?.into_iter();
    let image = images
        .next()
        .unwrap_or_else(|| Err(super::truncated("no picture")))?;
    Ok((image, images.next().transpose()?))
}

/// Decodes the images at these locations.
fn painted(
    reader: Reader<Cursor<&[u8]>>,
    headers: &[Header],
    places: Vec<Result<Place, PictureError>>,
    limit_bytes: usize,
) -> Result<Vec<Result<Image, PictureError>>, PictureError> {
    let mut slots = Vec::with_capacity(places.len());
    let mut held = 0_u64;
    for place in places {
        slots.push(match place {
            Err(error) => Err(error),
            Ok((part, channels)) => {
                let header = headers
                    .get(part)
                    .ok_or_else(|| super::truncated("no header"))?;
                held = within(header, held, limit_bytes as u64)?;
                Ok((part, Canvas::new(header, channels)?))
            }
        });
    }
    let mut blocks = reader
        .all_chunks(false)
        .map_err(malformed)?
        .sequential_decompressor(false);
    while let Some(block) = blocks.decompress_next_block() {
        let block = block.map_err(malformed)?;
        let Some(header) = headers.get(block.index.layer) else {
            continue;
        };
        let wanted = slots.iter_mut().flatten();
        for (_, canvas) in wanted.filter(|(part, _)| *part == block.index.layer) {
            if block.index.level == Vec2(0, 0) {
                canvas.paint(header, &block)?;
            }
        }
    }
    let finish = |slot: Result<(usize, Canvas), PictureError>| slot?.1.finish();
    Ok(slots.into_iter().map(finish).collect())
}

/// Checks the bytes held once an image of this header's display window is added.
fn within(header: &Header, held: u64, limit: u64) -> Result<u64, PictureError> {
    let window = header.shared_attributes.display_window.size;
    let needed = held.saturating_add(super::area(window, 3 * size_of::<f32>()));
    require_memory((window.0, window.1), needed, limit)?;
    Ok(needed)
}

fn find(
    known: &BTreeMap<String, Place>,
    name: Option<&str>,
    headers: &[Header],
) -> Result<Place, PictureError> {
    let missing = || PictureError::Layer {
        wanted: name.map(str::to_owned),
        layers: known.keys().cloned().collect(),
    };
    match name {
        Some(name) => known.get(name).copied().ok_or_else(missing),
        None if known.is_empty() => rgb_part(headers),
        None => rgb_part(headers).map_err(|_| missing()),
    }
}

/// All layers by name. When two parts have a layer of one name, the first keeps it and later ones
/// become `PART.LAYER`.
fn places(headers: &[Header]) -> BTreeMap<String, Place> {
    let mut out = BTreeMap::new();
    for (part, header) in headers.iter().enumerate().filter(|(_, h)| !h.deep) {
        let title = header.own_attributes.layer_name.as_ref();
        let title = title.map(text).unwrap_or_default();
        for (prefix, channels) in groups(header) {
            let name = if prefix.is_empty() { &title } else { &prefix };
            let long = format!("{title}.{prefix}");
            let free = [name, &long].into_iter().find(|n| !out.contains_key(*n));
            if let Some(free) = free.filter(|n| !n.is_empty()) {
                out.insert(free.clone(), (part, channels));
            }
        }
    }
    out
}

/// Names before `.R`, `.G` and `.B` among a part's channels, when all three exist.
fn groups(header: &Header) -> BTreeMap<String, [usize; 3]> {
    let mut found: BTreeMap<String, [Option<usize>; 3]> = BTreeMap::new();
    for (at, channel) in header.channels.list.iter().enumerate() {
        let name = text(&channel.name);
        let (prefix, last) = name.rsplit_once('.').unwrap_or(("", &name));
        let colour = ["R", "G", "B"].iter().position(|c| *c == last);
        let (Some(colour), Vec2(1, 1)) = (colour, channel.sampling) else {
            continue;
        };
        if let Some(slot) = found.entry(prefix.to_owned()).or_default().get_mut(colour) {
            slot.get_or_insert(at);
        }
    }
    let whole = |(prefix, [r, g, b]): (String, [Option<usize>; 3])| Some((prefix, [r?, g?, b?]));
    found.into_iter().filter_map(whole).collect()
}

#[cfg(test)]
#[allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test's own data"
)]
mod tests {
    use super::*;
    use exr::image::write::WritableImage;
    use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
    use exr::meta::attribute::{IntegerBounds, Text};
    use exr::meta::header::{ImageAttributes, LayerAttributes};
    use exr::prelude::SmallVec;

    const LIMIT: usize = 1 << 20;

    /// Channels of constant value, 3 x 2 pixels.
    type Part<'a> = (Option<&'a str>, &'a [(&'a str, f32)]);

    fn file(parts: &[Part<'_>]) -> Vec<u8> {
        let layer = |(name, channels): &Part<'_>| {
            let channel = |(name, value): &(&str, f32)| {
                AnyChannel::new(*name, FlatSamples::F32(vec![*value; 6]))
            };
            let list: SmallVec<_> = channels.iter().map(channel).collect();
            let attributes = LayerAttributes {
                layer_name: name.map(Text::from),
                ..LayerAttributes::default()
            };
            let channels = AnyChannels::sort(list);
            Layer::new((3, 2), attributes, Encoding::FAST_LOSSLESS, channels)
        };
        let layers: SmallVec<[_; 2]> = parts.iter().map(layer).collect();
        let window = ImageAttributes::new(IntegerBounds::from_dimensions((3, 2)));
        let image = ExrImage::from_layers(window, layers);
        let mut out = Vec::new();
        let to = Cursor::new(&mut out);
        image.write().non_parallel().to_buffered(to).unwrap();
        out
    }

    #[test]
    fn channels_with_dots_are_layers() {
        let file = file(&[(
            None,
            &[
                ("View.Key.R", 1.0),
                ("View.Key.G", -2.0),
                ("View.Key.B", 3.0),
                ("Fill.R", 4.0),
                ("Fill.G", 5.0),
                ("Fill.B", f32::NAN),
                ("Depth.Z", 7.0),
                ("Half.R", 7.0),
            ],
        )]);
        assert_eq!(names(&file).unwrap(), ["Fill", "View.Key"]);
        let wanted = [Some("View.Key"), Some("Fill"), Some("Key"), None];
        let found = decode(&file, &wanted, LIMIT).unwrap();
        let image = found[0].as_ref().unwrap();
        assert_eq!(image.size(), (3, 2));
        assert_eq!(image.pixel(2, 1).unwrap(), [1.0, -2.0, 3.0]);
        assert!(matches!(
            &found[1],
            Err(PictureError::NotFinite {
                count: 6,
                x: 0,
                y: 0
            })
        ));
        assert!(matches!(
            &found[2],
            Err(PictureError::Layer { wanted: Some(n), layers }) if n == "Key" && layers.len() == 2
        ));
        assert!(matches!(
            &found[3],
            Err(PictureError::Layer { wanted: None, .. })
        ));
    }

    #[test]
    fn named_parts_are_layers() {
        let one = [
            ("B", 1.0),
            ("G", 1.0),
            ("R", 1.0),
            ("s.B", 3.0),
            ("s.G", 3.0),
            ("s.R", 3.0),
        ];
        let two = [
            ("B", 2.0),
            ("G", 2.0),
            ("R", 2.0),
            ("s.B", 4.0),
            ("s.G", 4.0),
            ("s.R", 4.0),
        ];
        let file = file(&[(Some("front"), &one), (Some("back"), &two)]);
        assert_eq!(names(&file).unwrap(), ["back", "back.s", "front", "s"]);
        let wanted = [Some("back"), Some("front"), Some("s"), Some("back.s"), None];
        let found = decode(&file, &wanted, LIMIT).unwrap();
        let first = |image: &Result<Image, _>| image.as_ref().unwrap().pixel(0, 0).unwrap()[0];
        let values: Vec<f32> = found.iter().map(first).collect();
        assert_eq!(values, [2.0, 1.0, 3.0, 4.0, 1.0]);
    }

    #[test]
    fn more_layers_than_the_budget_holds_are_refused() {
        let rgb = [("R", 1.0), ("G", 1.0), ("B", 1.0)];
        let file = file(&[(None, &rgb)]);
        let wanted = vec![None; 3];
        assert!(decode(&file, &wanted, 3 * 6 * 12).is_ok());
        assert!(matches!(
            decode(&file, &wanted, 3 * 6 * 12 - 1),
            Err(PictureError::Memory { .. })
        ));
    }

    /// Alpha is read from the part of the colours.
    #[test]
    fn alpha_is_read_beside_the_colours() {
        let colours = [("R", 1.0), ("G", 2.0), ("B", 3.0)];
        let with = [("A", 0.25), ("R", 1.0), ("G", 2.0), ("B", 3.0)];
        let (image, alpha) = decode_with_alpha(&file(&[(None, &with)]), LIMIT).unwrap();
        assert_eq!(image.pixel(2, 1), Some([1.0, 2.0, 3.0]));
        assert_eq!(alpha.unwrap().pixel(2, 1), Some([0.25, 0.0, 0.0]));
        let (image, alpha) = decode_with_alpha(&file(&[(None, &colours)]), LIMIT).unwrap();
        assert_eq!((image.pixel(0, 0), alpha), (Some([1.0, 2.0, 3.0]), None));
        assert!(decode_with_alpha(&file(&[(None, &with)]), 50).is_err());
    }
}
