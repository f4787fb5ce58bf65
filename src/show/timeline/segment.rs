//! The segments of a key sequence, and their memory limit.

/// Most bytes of keys and segments.
pub(super) const MOST_BYTES: usize = 256 << 20;

/// The show is too large to hold its keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the key settings of the show need more than {} MB", MOST_BYTES >> 20)]
pub struct TooManyKeys;

/// A stretch on which the setting is one Bezier curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// First instant, microseconds; whole, except at knots inserted for positivity.
    pub(super) start: f64,
    /// Last instant, microseconds; equal to the first only for a last look of zero length.
    pub(super) end: f64,
    /// Its degree, 0 to 3.
    pub degree: usize,
    /// Its `degree + 1` control points, as indices of keys.
    pub keys: Vec<usize>,
}

impl Segment {
    /// First instant, seconds.
    pub fn start(&self) -> f64 {
        self.start / 1e6
    }

    /// Last instant, seconds.
    pub fn end(&self) -> f64 {
        self.end / 1e6
    }

    /// Length, seconds.
    pub fn duration(&self) -> f64 {
        (self.end - self.start) / 1e6
    }
}
