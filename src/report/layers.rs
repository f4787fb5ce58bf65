//! Many images in one OpenEXR file, each with its lights.

use super::Error;
use super::format::header;
use super::words::{count, setting};
use footlight_engine::playback::Playback;
use footlight_engine::{self as engine, Engine};
use footlight_picture::Image;
use footlight_picture::exr::{Precision, stack};
use footlight_show::model::{Coordinate, Show};
use footlight_transport::contract::check_memory;

/// The object of the memory error, with advice.
const ALL_AT_ONCE: &str = "a file of all these layers (numbered pictures, `-o frame####.exr`, are \
    written one at a time)";

/// Selection of layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layers {
    /// Every key image.
    Keys,
    /// Every coordinate alone at full, as in previews.
    Banks,
    /// The refined images; without them, the coarse ones.
    Basis,
}

/// A layer: its name, its lights, and the image.
type Layer<'i> = (String, String, &'i Image);

/// Writes key images, banks or the basis as layers of one file, whose header names the lights of
/// each. All layers and the file are in memory at once; beyond the host's budget that is refused.
/// Returns the file and its description.
pub fn layers(
    engine: &Engine,
    playback: &Playback,
    layers: Layers,
    precision: Precision,
) -> Result<(Vec<u8>, String), Error> {
    check_size(engine, playback, layers, precision)?;
    let show = engine.show();
    let banks = match layers {
        Layers::Banks => engine.bank_images(playback.image_bytes())?,
        Layers::Keys | Layers::Basis => Vec::new(),
    };
    let (what, layers) = match layers {
        Layers::Keys => ("key image", key_layers(engine, playback)),
        Layers::Banks => ("bank", bank_layers(show, banks.iter())),
        Layers::Basis => basis_layers(engine)?,
    };
    let names = stack::names(layers.iter().map(|(name, ..)| name.as_str()));
    let mut about = vec![header("show", &show.title)];
    let lit = names.iter().zip(&layers);
    let lit: Vec<String> = lit.map(|(n, (_, lit, _))| format!("{n}: {lit}")).collect();
    about.push(header("settings", &lit.join("\n")));
    let images = layers.iter().map(|(_, _, image)| *image);
    let named: Vec<(String, &Image)> = names.into_iter().zip(images).collect();
    let bytes = stack::encode(&named, precision, &about)?;
    let (width, height) = playback.size();
    let layers = count(named.len(), what);
    let size = bytes.len() as f64 / 1e6;
    let text = format!("{layers} of {width}x{height} as layers, {size:.1} MB");
    Ok((bytes, text))
}

/// Checks that everything fits into memory: the key images held, the images to be made, and the
/// file, assumed uncompressed.
fn check_size(
    engine: &Engine,
    playback: &Playback,
    layers: Layers,
    precision: Precision,
) -> Result<(), Error> {
    let keys = playback.keys().keys().len();
    let banks = engine.show().coordinates().len();
    let (made, written) = match layers {
        Layers::Keys => (0, keys),
        Layers::Banks => (banks, banks),
        Layers::Basis => (0, basis_layers(engine)?.1.len()),
    };
    let channel = match precision {
        Precision::Half => 2,
        Precision::Float => size_of::<f32>(),
    };
    let (width, height) = playback.size();
    let each = (keys + made) * size_of::<f32>() + written * channel;
    let needed = width.saturating_mul(height).saturating_mul(3 * each);
    let checked = check_memory(ALL_AT_ONCE, needed, engine.work().memory);
    Ok(checked.map_err(engine::Error::from)?)
}

fn key_layers<'i>(engine: &Engine, playback: &'i Playback) -> Vec<Layer<'i>> {
    let keys = playback
        .images()
        .iter()
        .zip(engine.document().keys().keys());
    keys.enumerate()
        .map(|(i, (image, key))| {
            let name = format!("key{:03}", i + 1);
            (name, setting(engine.show(), key), image)
        })
        .collect()
}

/// One layer for each coordinate, lit alone.
fn bank_layers<'i>(show: &Show, images: impl Iterator<Item = &'i Image>) -> Vec<Layer<'i>> {
    let coordinates = show.coordinates().into_iter().zip(images);
    let layer = |(c, image): (Coordinate, _)| {
        let lit = format!("{} 1", c.name);
        (c.name, lit, image)
    };
    coordinates.map(layer).collect()
}

/// The refined images; without them the coarse ones, which are then the basis.
fn basis_layers(engine: &Engine) -> Result<(&'static str, Vec<Layer<'_>>), Error> {
    let pool = engine.estimate().pool().ok_or(engine::Error::NotRendered)?;
    let refined = pool.refined().iter().enumerate().map(|(i, refined)| {
        let name = format!("basis{:03}", i + 1);
        let lit = setting(engine.show(), &refined.setting);
        (name, lit, refined.image.as_ref())
    });
    let refined: Vec<Layer<'_>> = refined.collect();
    if !refined.is_empty() {
        return Ok(("refined picture", refined));
    }
    let coarse = pool.coarse().iter().map(AsRef::as_ref);
    Ok(("coarse picture", bank_layers(engine.show(), coarse)))
}
