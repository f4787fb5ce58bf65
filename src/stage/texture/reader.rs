//! Reads image files of a stage to [`Pixels`], each once, within a memory limit.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Pixels;
use footlight_picture::PictureError;
use footlight_picture::decode::codes;

/// Most bytes of all textures of a stage file, decoded.
pub const MOST_BYTES: usize = 1 << 30;

/// Channels of an image to read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channels {
    /// Colour and alpha.
    All,
    /// Colour, also where the image is transparent, as glTF 2.0 requires for `alphaMode OPAQUE`.
    Colour,
}

/// Reads images within a limit.
#[derive(Debug)]
pub struct TextureReader {
    /// Most bytes to use.
    limit: usize,
    /// Bytes in use.
    taken: usize,
    /// Bytes that refused images would need.
    refused: u64,
    /// Results by name and channels.
    known: BTreeMap<(String, Channels), Result<Arc<Pixels>, String>>,
    /// Means of images that hold numbers.
    means: BTreeMap<String, Result<[f64; 4], String>>,
}

impl TextureReader {
    /// Creates a reader with this much memory, in bytes.
    pub fn new(memory: usize) -> TextureReader {
        TextureReader {
            limit: memory.min(MOST_BYTES),
            taken: 0,
            refused: 0,
            known: BTreeMap::new(),
            means: BTreeMap::new(),
        }
    }

    /// Reads the image of this name.
    ///
    /// # Errors
    /// The reason, as the end of a sentence.
    pub fn read(
        &mut self,
        name: &str,
        channels: Channels,
        content: impl FnOnce() -> Result<Vec<u8>, String>,
    ) -> Result<Arc<Pixels>, String> {
        let key = (name.to_owned(), channels);
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let pixels = match self.known.get(&(name.to_owned(), Channels::All)) {
            Some(Ok(whole)) if !whole.is_transparent() => Ok(whole.clone()),
            _ => content().and_then(|bytes| self.pixels(&bytes, channels)),
        };
        self.known.insert(key, pixels.clone());
        pixels
    }

    /// The mean of each channel, 0 to 1, of an image that holds numbers instead of colours.
    ///
    /// # Errors
    /// The reason, as the end of a sentence.
    pub fn mean(
        &mut self,
        name: &str,
        content: impl FnOnce() -> Result<Vec<u8>, String>,
    ) -> Result<[f64; 4], String> {
        if let Some(known) = self.means.get(name) {
            return known.clone();
        }
        let left = self.limit.saturating_sub(self.taken);
        let texels = content().and_then(|bytes| {
            let (_, texels) = codes(&bytes, left).map_err(|error| self.in_words(error))?;
            Ok(texels)
        });
        let mean = texels.map(|texels| {
            let mut sums = [0_u64; 4];
            for texel in &texels {
                let channels = sums.iter_mut().zip(texel);
                channels.for_each(|(sum, code)| *sum += u64::from(*code));
            }
            sums.map(|sum| sum as f64 / (255.0 * texels.len().max(1) as f64))
        });
        self.means.insert(name.to_owned(), mean.clone());
        mean
    }

    fn pixels(&mut self, bytes: &[u8], channels: Channels) -> Result<Arc<Pixels>, String> {
        let left = self.limit.saturating_sub(self.taken);
        let (size, mut codes) = codes(bytes, left).map_err(|error| self.in_words(error))?;
        if channels == Channels::Colour {
            codes.iter_mut().for_each(|[.., alpha]| *alpha = 255);
        }
        let pixels = Pixels::new(size, &codes);
        self.taken += pixels.bytes();
        Ok(Arc::new(pixels))
    }

    /// The reason why an image cannot be read; for a too large one, with advice.
    fn in_words(&mut self, error: PictureError) -> String {
        let PictureError::Memory {
            width,
            height,
            needed,
            limit,
        } = error
        else {
            return error.to_string();
        };
        // Counts all images refused so far, so that the last message gives enough memory for all.
        self.refused = self.refused.saturating_add(needed);
        let enough = self.refused.saturating_add(self.taken as u64);
        let more = if enough <= MOST_BYTES as u64 {
            format!(
                ", or allow more with `--memory {}`",
                enough.div_ceil(1 << 20)
            )
        } else {
            String::new()
        };
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        format!(
            "{width} x {height} pixels need {:.1} MB to be read, and {:.1} MB are left for textures; \
             make the image smaller{more}",
            megabytes(needed),
            megabytes(limit)
        )
    }
}
