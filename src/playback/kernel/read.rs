//! How the channels of a key are read, for each way of storing them.
//!
//! Invariant: everything here is inlined into the loops of [`super`], and so compiled for the
//! instructions that these are compiled for.

use crate::picture::tone::BLOCK;
use crate::playback::key::{KeyImage, byte_light, half_light};

/// Something of each channel of a block.
type Block<T> = [T; BLOCK];

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

    /// Whether no channel of the block is negative: of keys that store no signs, always.
    #[inline(always)]
    fn is_plain(_: Self::Common) -> bool {
        true
    }

    /// The sign bit of each channel, at its place in a float.
    #[inline(always)]
    fn signs(_: Self::Common) -> Block<u32> {
        [0; BLOCK]
    }

    /// The light of a channel, its sign left out.
    fn light(self, stored: Self::Stored) -> f32;
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
    fn light(self, stored: f32) -> f32 {
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
    fn light(self, stored: u16) -> f32 {
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
    fn light(self, stored: u8) -> f32 {
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

    /// Few channels are negative, and they lie together: most blocks have none.
    #[inline(always)]
    fn is_plain(signs: [u8; BLOCK / 8]) -> bool {
        u64::from_ne_bytes(signs) == 0
    }

    #[inline(always)]
    fn signs(signs: [u8; BLOCK / 8]) -> Block<u32> {
        let mut out = [0; BLOCK];
        for (eight, byte) in out.as_chunks_mut::<8>().0.iter_mut().zip(signs) {
            // Eight lanes shifted by constants, which is one instruction.
            for (lane, out) in eight.iter_mut().enumerate() {
                *out = u32::from(byte) << (31 - lane) & 1 << 31;
            }
        }
        out
    }

    #[inline(always)]
    fn light(self, stored: u8) -> f32 {
        self.bytes.light(stored)
    }
}

/// A key in 8 bits.
pub(super) fn signed(key: &KeyImage) -> Option<Signed<'_>> {
    match key {
        KeyImage::Byte {
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
