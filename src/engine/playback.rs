//! Playback: every frame takes at most three linear blends of key images.
//!
//! A [`Playback`] holds the key images of a pool; a [`Player`] makes frames of them in one pass
//! ([`kernel`]). A frame reads the key images of one segment; a segment of degree d takes d blends.
//! A show with more key images than memory holds, as with effects that go on for minutes, plays as
//! sums of the pool's images instead.

pub mod kernel;
pub mod page;
mod player;

pub use self::player::Player;

use std::sync::Arc;

use self::kernel::{BlendTarget, Factors};
use crate::heads::Heads;
use crate::plan::PlanError;
use crate::pool::Pool;
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::timeline::{KeySequence, blend};
use footlight_show::units::Time;

/// Bytes of a key image's pixel.
const BYTES_PER_PIXEL: usize = size_of::<[f32; 3]>();

/// Reason why key images could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PlaybackError {
    /// The embedding program cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The keys' coordinates differ from the pool's.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// A show ready to play.
#[derive(Clone, Debug)]
pub struct Playback {
    size: (usize, usize),
    keys: KeySequence,
    light: Light,
    heads: Option<Heads>,
}

/// Source of the frames.
#[derive(Clone, Debug)]
enum Light {
    /// One image for each key.
    Keys(Vec<Image>),
    /// Images to be added up.
    Sums(Arc<Pool>),
}

impl Playback {
    /// Makes every key image from the current pool, if they take at most two thirds of the memory:
    /// the rest is for what is made of them. Otherwise the playback adds up the images of the pool.
    ///
    /// # Errors
    /// [`PlaybackError`] on cancel, or when the keys do not fit the pool.
    pub fn new(keys: &KeySequence, pool: &Pool, work: Work<'_>) -> Result<Playback, PlaybackError> {
        if !Playback::has_keys(keys, pool, work.memory) {
            return Ok(Playback {
                size: pool.size(),
                keys: keys.clone(),
                light: Light::Sums(Arc::new(pool.clone())),
                heads: None,
            });
        }
        let mut images = Vec::with_capacity(keys.keys().len());
        for (i, key) in keys.keys().iter().enumerate() {
            work.check()?;
            images.push(pool.preview(key, work)?);
            work.progress.report("key images", i + 1, keys.keys().len());
        }
        Ok(Playback {
            size: pool.size(),
            keys: keys.clone(),
            light: Light::Keys(images),
            heads: None,
        })
    }

    /// Adds heads, whose light is added to every frame.
    #[must_use]
    pub fn with_heads(self, heads: Option<Heads>) -> Playback {
        Playback { heads, ..self }
    }

    /// The heads, if any.
    pub fn heads(&self) -> Option<&Heads> {
        self.heads.as_ref()
    }

    /// True when key images take at most two thirds of the memory.
    pub(crate) fn has_keys(keys: &KeySequence, pool: &Pool, memory: usize) -> bool {
        let (width, height) = pool.size();
        keys.keys().len() * BYTES_PER_PIXEL * width * height <= memory / 3 * 2
    }

    /// Uses key images made elsewhere, one for each of the keys and all of one size; `None`
    /// otherwise.
    pub fn of(keys: &KeySequence, images: Vec<Image>) -> Option<Playback> {
        let size = images.first()?.size();
        let fit = images.len() == keys.keys().len() && images.iter().all(|i| i.size() == size);
        fit.then(|| Playback {
            size,
            keys: keys.clone(),
            light: Light::Keys(images),
            heads: None,
        })
    }

    /// Width and height of every frame.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The key images, in the order of the key settings; none when frames are sums.
    pub fn images(&self) -> &[Image] {
        match &self.light {
            Light::Keys(images) => images,
            Light::Sums(_) => &[],
        }
    }

    /// The image of a key; black for an index beyond the last.
    pub fn key_image(&self, key: usize) -> Image {
        let image = match &self.light {
            Light::Keys(images) => images.get(key).cloned(),
            Light::Sums(pool) => {
                let setting = self.keys.keys().get(key);
                setting.and_then(|setting| pool.preview(setting, Work::silent()).ok())
            }
        };
        image.unwrap_or_else(|| self.black())
    }

    fn black(&self) -> Image {
        Image::new(self.size.0, self.size.1)
    }

    /// The key settings and the segments between them.
    pub fn keys(&self) -> &KeySequence {
        &self.keys
    }

    /// Bytes of the key images.
    pub fn image_bytes(&self) -> usize {
        let images = self.images().iter();
        images.map(|image| size_of_val(image.data())).sum()
    }

    /// The light of a frame; times outside the sequence show its first and last look.
    pub fn frame(&self, time: Time) -> Image {
        let mut out = self.blended(time);
        self.add_heads(time, &mut out);
        out
    }

    /// A frame without the direct light of heads.
    pub(crate) fn blended(&self, time: Time) -> Image {
        let mut out = self.black();
        self.blend(time, BlendTarget::Light(out.data_mut()), 1);
        out
    }

    /// Blends the key images of a moment, or adds up the images of the pool.
    fn blend(&self, time: Time, target: BlendTarget<'_>, threads: usize) {
        let images = match &self.light {
            Light::Keys(images) => images,
            Light::Sums(pool) => {
                let work = Work {
                    threads,
                    ..Work::silent()
                };
                // Settings of the keys fit the pool.
                if let Ok(sum) = pool.preview(&self.keys.evaluate(time), work) {
                    target.write(sum.data());
                }
                return;
            }
        };
        let (index, t) = self.keys.segment_at(time);
        if let Some(segment) = self.keys.segments().get(index) {
            let keys = segment.keys.iter();
            let keys = keys.filter_map(|key| Some(images.get(*key)?.data()));
            let keys: Vec<&[f32]> = keys.collect();
            kernel::blend(
                &keys,
                Factors::new(blend(segment.degree, t)),
                target,
                threads,
            );
        }
    }

    /// Adds the light of heads to a frame.
    fn add_heads(&self, time: Time, frame: &mut Image) {
        if let Some(heads) = &self.heads {
            // A frame is short and not cancelled.
            let _ = heads.add_at(time, frame, Work::silent());
        }
    }
}
