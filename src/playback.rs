//! Playback: every frame is at most three linear blends of key images.
//!
//! Invariants: a frame reads the key images of one segment only; a segment of degree d takes d
//! blends. This room knows nothing of banks: it sees key images and times.

pub mod key;

use crate::picture::Image;
use crate::plan::PlanError;
use crate::pool::Projected;
use crate::timeline::{Blend, KeySequence, blend};
use crate::units::Time;
use crate::work::{Cancelled, Work};

/// Why key images could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PlaybackError {
    /// The embedding program asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The keys have other coordinates than the pool.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// A show ready to play.
#[derive(Clone, Debug)]
pub struct Playback {
    size: (usize, usize),
    keys: KeySequence,
    images: Vec<Image>,
}

impl Playback {
    /// Makes every key image from a pool as it stands, by a projection.
    ///
    /// # Errors
    /// [`PlaybackError`] on cancel, or when the keys do not fit the pool.
    pub fn new(
        keys: &KeySequence,
        pool: &Projected<'_>,
        work: Work<'_>,
    ) -> Result<Playback, PlaybackError> {
        let mut images = Vec::with_capacity(keys.keys().len());
        for (i, key) in keys.keys().iter().enumerate() {
            work.check()?;
            images.push(pool.preview(key, work)?);
            work.progress.report("key images", i + 1, keys.keys().len());
        }
        Ok(Playback {
            size: pool.size(),
            keys: keys.clone(),
            images,
        })
    }

    /// Width and height of every frame.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// The key images, in the order of the key settings.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// Writes the frame at `time` into `out`, which takes the frames' size; before the first
    /// segment and after the last the show holds its first and last state.
    pub fn frame(&self, time: Time, out: &mut Image) {
        if (out.width(), out.height()) != self.size {
            *out = Image::new(self.size.0, self.size.1);
        }
        let (index, t) = self.keys.segment_at(time);
        let Some(segment) = self.keys.segments().get(index) else {
            return;
        };
        let key = |i: usize| segment.keys.get(i).and_then(|k| self.images.get(*k));
        let data = |i: usize| key(i).map_or(&[][..], Image::data);
        let out = out.data_mut();
        match blend(segment.degree, t) {
            Blend::Hold => out.copy_from_slice(data(0)),
            Blend::Linear(a) => blend_one(out, [data(0), data(1)], a as f32),
            Blend::Quadratic(a) => blend_two(out, [data(0), data(1), data(2)], a.map(|x| x as f32)),
            Blend::Cubic(a) => {
                let keys = [data(0), data(1), data(2), data(3)];
                blend_three(out, keys, a.map(|x| x as f32));
            }
        }
    }
}

/// `a + t (b - a)`: exact at both ends, and between equal values.
#[inline(always)]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}

/// One blend: a linear segment.
#[multiversion::multiversion(targets = "simd")]
fn blend_one(out: &mut [f32], keys: [&[f32]; 2], t: f32) {
    let [a, b] = keys;
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = lerp(*a, *b, t);
    }
}

/// Two blends: a quadratic segment.
#[multiversion::multiversion(targets = "simd")]
fn blend_two(out: &mut [f32], keys: [&[f32]; 3], t: [f32; 2]) {
    let [a, b, c] = keys;
    for (((out, a), b), c) in out.iter_mut().zip(a).zip(b).zip(c) {
        *out = lerp(lerp(*a, *b, t[0]), *c, t[1]);
    }
}

/// Three blends: a cubic segment (the paper's Equation 5).
#[multiversion::multiversion(targets = "simd")]
fn blend_three(out: &mut [f32], keys: [&[f32]; 4], t: [f32; 3]) {
    let [a, b, c, d] = keys;
    for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *out = lerp(lerp(*a, *b, t[0]), lerp(*c, *d, t[1]), t[2]);
    }
}
