//! Reading channels of a key, for each storage format.
//!
//! Invariant: everything here is inlined into the loops of [`super`], and so compiled for their
//! instruction set.

use crate::playback::key::half_light;

/// A storage format of a key's channels.
pub(super) trait Key: Copy + Send + Sync {
    /// A stored channel.
    type Stored: Copy + Default;

    /// All stored channels.
    fn stored(&self) -> &[Self::Stored];

    /// True when weighting costs nothing during reading.
    const WEIGHED: bool;

    /// The key with its light multiplied by `weight`; unchanged unless [`Key::WEIGHED`].
    fn weighed(self, weight: f32) -> Self;

    /// The key from a channel on, a multiple of [`BLOCK`].
    fn from(self, channel: usize) -> Self;

    /// The light of a channel.
    fn light(self, stored: Self::Stored) -> f32;
}

/// Single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floats<'a>(pub(super) &'a [f32]);

impl Key for Floats<'_> {
    type Stored = f32;
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
    fn light(self, stored: u16) -> f32 {
        half_light(stored, self.factor)
    }
}
