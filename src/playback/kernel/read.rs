//! How the channels of a key are read, for each way of storing them.
//!
//! Invariant: everything here is inlined into the loops of [`super`], and so compiled for the
//! instructions that these are compiled for.

use crate::picture::tone::BLOCK;
use crate::playback::key::{Samples, byte_light, half_light};

/// How the channels of a key are stored and read.
pub(super) trait Key: Copy + Send + Sync {
    /// One channel as it is stored.
    type Stored: Copy + Default;

    /// All of them.
    fn stored(&self) -> &[Self::Stored];

    /// Whether a key's weight costs nothing when it is read.
    const WEIGHED: bool;

    /// The key with its light times `weight`; itself unless [`Key::WEIGHED`].
    fn weighed(self, weight: f32) -> Self;

    /// The key from a channel on, which is a multiple of [`BLOCK`].
    fn from(self, channel: usize) -> Self;

    /// Whatever the channels of block `index` have in common.
    type Common: Copy;

    /// The same.
    fn common(self, index: usize) -> Self::Common;

    /// The light of a channel, number `lane` of its block.
    fn light(self, stored: Self::Stored, common: Self::Common, lane: usize) -> f32;
}

/// Single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floats<'a>(pub(super) &'a [f32]);

impl Key for Floats<'_> {
    type Stored = f32;
    type Common = ();
    const WEIGHED: bool = false;

    #[inline(always)]
    fn weighed(self, _: f32) -> Self {
        self
    }

    #[inline(always)]
    fn stored(&self) -> &[f32] {
        self.0
    }

    fn from(self, channel: usize) -> Self {
        Floats(self.0.get(channel..).unwrap_or_default())
    }

    #[inline(always)]
    fn common(self, _: usize) {}

    #[inline(always)]
    fn light(self, stored: f32, (): (), _: usize) -> f32 {
        stored
    }
}

/// Half precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halves<'a> {
    pub(super) codes: &'a [u16],
    pub(super) factor: f32,
}

impl Key for Halves<'_> {
    type Stored = u16;
    type Common = ();
    const WEIGHED: bool = true;

    #[inline(always)]
    fn weighed(self, weight: f32) -> Self {
        Halves {
            factor: self.factor * weight,
            ..self
        }
    }

    #[inline(always)]
    fn stored(&self) -> &[u16] {
        self.codes
    }

    fn from(self, channel: usize) -> Self {
        Halves {
            codes: self.codes.get(channel..).unwrap_or_default(),
            ..self
        }
    }

    #[inline(always)]
    fn common(self, _: usize) {}

    #[inline(always)]
    fn light(self, stored: u16, (): (), _: usize) -> f32 {
        half_light(stored, self.factor)
    }
}

/// 8 bits without signs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bytes<'a> {
    codes: &'a [u8],
    low: f32,
    high: f32,
}

impl Key for Bytes<'_> {
    type Stored = u8;
    type Common = ();
    const WEIGHED: bool = true;

    #[inline(always)]
    fn weighed(self, weight: f32) -> Self {
        Bytes {
            low: self.low * weight,
            high: self.high * weight,
            ..self
        }
    }

    #[inline(always)]
    fn stored(&self) -> &[u8] {
        self.codes
    }

    fn from(self, channel: usize) -> Self {
        Bytes {
            codes: self.codes.get(channel..).unwrap_or_default(),
            ..self
        }
    }

    #[inline(always)]
    fn common(self, _: usize) {}

    #[inline(always)]
    fn light(self, stored: u8, (): (), _: usize) -> f32 {
        byte_light(stored, self.low, self.high)
    }
}

/// Codes with a plane of signs; an empty plane: no channel is negative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signed<'a> {
    pub(super) bytes: Bytes<'a>,
    pub(super) negative: &'a [u8],
}

impl Key for Signed<'_> {
    type Stored = u8;
    type Common = [u8; BLOCK / 8];
    const WEIGHED: bool = true;

    #[inline(always)]
    fn weighed(self, weight: f32) -> Self {
        Signed {
            bytes: self.bytes.weighed(weight),
            ..self
        }
    }

    #[inline(always)]
    fn stored(&self) -> &[u8] {
        self.bytes.codes
    }

    fn from(self, channel: usize) -> Self {
        Signed {
            bytes: self.bytes.from(channel),
            negative: self.negative.get(channel / 8..).unwrap_or_default(),
        }
    }

    #[inline(always)]
    fn common(self, index: usize) -> [u8; BLOCK / 8] {
        let (blocks, rest) = self.negative.as_chunks();
        blocks.get(index).copied().unwrap_or_else(|| {
            // The end of a picture, or no signs at all.
            let rest = if index == blocks.len() { rest } else { &[] };
            let mut out = [0; BLOCK / 8];
            for (out, byte) in out.iter_mut().zip(rest) {
                *out = *byte;
            }
            out
        })
    }

    #[inline(always)]
    fn light(self, stored: u8, signs: [u8; BLOCK / 8], lane: usize) -> f32 {
        let bit = signs.get(lane / 8).map_or(0, |byte| byte >> (lane % 8) & 1);
        let light = byte_light(stored, self.bytes.low, self.bytes.high);
        f32::from_bits(light.to_bits() | u32::from(bit) << 31)
    }
}

/// A key in 8 bits.
pub(super) fn signed(key: &Samples) -> Option<Signed<'_>> {
    match key {
        Samples::Byte {
            codes,
            curve,
            negative,
        } => {
            let (low, high) = curve.per_code();
            Some(Signed {
                bytes: Bytes { codes, low, high },
                negative: negative.as_deref().unwrap_or_default(),
            })
        }
        _ => None,
    }
}
