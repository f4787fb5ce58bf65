//! Many pictures in one OpenEXR file, each with what was lit in it.

use std::path::Path;

use super::described;
use super::target::Layers;
use crate::interpreter::answer::count;
use crate::interpreter::{Error, Interpreter, Reply};
use crate::picture::Image;
use crate::picture::exr::{Precision, stack};
use crate::playback::Playback;
use crate::renderer::TransportError;
use crate::show::Coordinate;

/// What does not fit, and the way out.
const ALL_AT_ONCE: &str = "a file of all these layers (numbered pictures, `-o frame####.exr`, are \
    written one at a time; `--memory` allows more)";

/// A layer: its name, what was lit, and the picture.
type Layer<'i> = (String, String, &'i Image);

impl Interpreter {
    /// Writes key images, banks or the basis as layers; the header says what each was lit by. All
    /// layers and the file are in memory at once, which is refused beyond the host's budget.
    pub(super) fn write_layers(
        &self,
        playback: &Playback,
        path: &Path,
        layers: Layers,
        precision: Precision,
    ) -> Result<Reply, Error> {
        self.hold_layers(playback, layers, precision)?;
        let banks = match layers {
            Layers::Banks => self.bank_images()?,
            Layers::Keys | Layers::Basis => Vec::new(),
        };
        let (what, layers) = match layers {
            Layers::Keys => ("key image", self.key_layers(playback)),
            Layers::Banks => ("bank", self.bank_layers(banks.iter())),
            Layers::Basis => self.basis_layers()?,
        };
        let names = stack::names(layers.iter().map(|(name, ..)| name.as_str()));
        let mut header = vec![described("show", &self.show().title)];
        let lit = names.iter().zip(&layers);
        let lit: Vec<String> = lit.map(|(n, (_, lit, _))| format!("{n}: {lit}")).collect();
        header.push(described("settings", &lit.join("\n")));
        let images = layers.iter().map(|(_, _, image)| *image);
        let named: Vec<(String, &Image)> = names.into_iter().zip(images).collect();
        let bytes = stack::encode(&named, precision, &header)?;
        let (width, height) = playback.size();
        let layers = count(named.len(), what);
        let size = bytes.len() as f64 / 1e6;
        let text = format!("{layers} of {width}x{height} as layers, {size:.1} MB");
        self.write_reply(Some(path), &bytes, text)
    }

    /// Refuses what would not fit into memory: the key images, which are there, pictures that are
    /// yet to be made, and the file, taken as uncompressed.
    fn hold_layers(
        &self,
        playback: &Playback,
        layers: Layers,
        precision: Precision,
    ) -> Result<(), Error> {
        let keys = playback.images().len();
        let banks = self.show().coordinates().len();
        let (made, written) = match layers {
            Layers::Keys => (0, keys),
            Layers::Banks => (banks, banks),
            Layers::Basis => (0, self.basis_layers()?.1.len()),
        };
        let channel = match precision {
            Precision::Half => 2,
            Precision::Float => size_of::<f32>(),
        };
        let (width, height) = playback.size();
        let each = (keys + made) * size_of::<f32>() + written * channel;
        let needed = width.saturating_mul(height).saturating_mul(3 * each);
        if needed > self.host.memory {
            return Err(Error::Render(TransportError::Memory {
                what: ALL_AT_ONCE,
                needed,
                budget: self.host.memory,
            }));
        }
        Ok(())
    }

    /// Every coordinate alone at full, as the pool has it.
    pub(super) fn bank_images(&self) -> Result<Vec<Image>, Error> {
        let pool = self.projected()?;
        let total = self.show().coordinates().len();
        let mut images = Vec::with_capacity(total);
        for i in 0..total {
            self.host.work().check()?;
            let alone: Vec<f64> = (0..total).map(|j| f64::from(u8::from(i == j))).collect();
            images.push(pool.preview(&alone, self.host.work())?);
            self.host.progress.report("banks", i + 1, total);
        }
        Ok(images)
    }

    fn key_layers<'i>(&self, playback: &'i Playback) -> Vec<Layer<'i>> {
        let keys = playback.images().iter().zip(self.keys().keys());
        keys.enumerate()
            .map(|(i, (image, key))| {
                let name = format!("key{:03}", i + 1);
                (name, self.setting_in_words(key), image)
            })
            .collect()
    }

    /// A layer for each coordinate, lit alone.
    fn bank_layers<'i>(&self, images: impl Iterator<Item = &'i Image>) -> Vec<Layer<'i>> {
        let coordinates = self.show().coordinates().into_iter().zip(images);
        let layer = |(c, image): (Coordinate, _)| {
            let lit = format!("{} 1", c.name);
            (c.name, lit, image)
        };
        coordinates.map(layer).collect()
    }

    /// The refined pictures; without them the coarse ones, which are the basis then.
    fn basis_layers(&self) -> Result<(&'static str, Vec<Layer<'_>>), Error> {
        let pool = self.rendered()?;
        let refined = pool.refined().iter().enumerate().map(|(i, refined)| {
            let name = format!("basis{:03}", i + 1);
            let lit = self.setting_in_words(&refined.setting);
            (name, lit, refined.image.as_ref())
        });
        let refined: Vec<Layer<'_>> = refined.collect();
        if !refined.is_empty() {
            return Ok(("refined picture", refined));
        }
        let coarse = pool.coarse().iter().map(AsRef::as_ref);
        Ok(("coarse picture", self.bank_layers(coarse)))
    }

    /// Coordinates with their settings: `lamp 0.64, day 0.05`.
    pub(super) fn setting_in_words(&self, setting: &[f64]) -> String {
        let coordinates = self.show().coordinates();
        let pairs = coordinates.iter().zip(setting);
        let words: Vec<String> = pairs.map(|(c, s)| format!("{} {s}", c.name)).collect();
        words.join(", ")
    }
}
