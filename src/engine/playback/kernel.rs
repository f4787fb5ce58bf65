//! One pass from key images to a frame: decoding, at most three blends, exposure, tone curve and
//! display code. Every key is read once and the frame written once.
//!
//! A frame's bytes equal those of [`ByteTable`] on the blended light on every processor: the loops
//! are compiled for several instruction sets, with equal products and sums in equal order. Keys in
//! single precision are blended by lerps, which preserve to the bit what two keys have in common;
//! for other keys the weight is part of the product that decodes them. Channels are processed
//! [`BLOCK`] at a time.

mod read;
#[cfg(test)]
mod tests;

use self::read::{Floats, Halves, Key};
use super::key::{KeyImage, half_factor};
use footlight_picture::tone::{BLOCK, ByteTable};
use footlight_show::timeline::Blend;

/// The channels of a block.
type Block = [f32; BLOCK];

/// The blends of one instant, in single precision: number of keys, lerp factors, and the resulting
/// weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    keys: usize,
    lerps: [f32; 3],
    weights: [f32; 4],
}

impl Factors {
    /// Converts exact factors.
    pub fn new(blend: Blend) -> Factors {
        let factors = match blend {
            Blend::Hold => [0.0; 3],
            Blend::Linear(a) => [a, 0.0, 0.0],
            Blend::Quadratic([a, b]) => [a, b, 0.0],
            Blend::Cubic(factors) => factors,
        };
        Factors {
            keys: blend.lerps() + 1,
            lerps: factors.map(|f| f as f32),
            weights: blend.weights().map(|w| w as f32),
        }
    }
}

/// Destination of the blended light.
pub enum Target<'a> {
    /// Linear light.
    Light(&'a mut [f32]),
    /// Display bytes.
    Bytes(&'a mut [u8], &'a ByteTable),
}

impl<'a> Target<'a> {
    fn len(&self) -> usize {
        match self {
            Target::Light(out) => out.len(),
            Target::Bytes(out, _) => out.len(),
        }
    }

    /// Splits at `channels`.
    fn split(self, channels: usize) -> (Target<'a>, Target<'a>) {
        let at = channels.min(self.len());
        match self {
            Target::Light(out) => {
                let (first, rest) = out.split_at_mut(at);
                (Target::Light(first), Target::Light(rest))
            }
            Target::Bytes(out, table) => {
                let (first, rest) = out.split_at_mut(at);
                (Target::Bytes(first, table), Target::Bytes(rest, table))
            }
        }
    }
}

/// The keys of one segment, in one format.
#[derive(Clone, Debug)]
pub struct Keys<'a>(Stored<'a>);

#[derive(Clone, Debug)]
enum Stored<'a> {
    Floats(Vec<Floats<'a>>),
    Halves(Vec<Halves<'a>>),
}

impl<'a> Keys<'a> {
    /// Keys in single precision.
    pub fn floats(keys: impl Iterator<Item = &'a [f32]>) -> Keys<'a> {
        Keys(Stored::Floats(keys.map(Floats).collect()))
    }

    /// Keys as stored; `None` unless all have one format.
    pub fn new(keys: &[&'a KeyImage]) -> Option<Keys<'a>> {
        let stored = match keys.first()? {
            KeyImage::Float(_) => Stored::Floats(all(keys, |key| match key {
                KeyImage::Float(data) => Some(Floats(data)),
                _ => None,
            })?),
            KeyImage::Half { .. } => Stored::Halves(all(keys, |key| match key {
                KeyImage::Half { codes, scale } => Some(Halves {
                    codes,
                    factor: half_factor(*scale),
                }),
                _ => None,
            })?),
        };
        Some(Keys(stored))
    }

    /// Blends the keys into `target`, with up to `threads` threads; the result does not depend on
    /// their number. A block that a key does not fill counts as black in that key; when keys for
    /// `factors` are missing, nothing is written.
    pub fn blend(&self, factors: Factors, target: Target<'_>, threads: usize) {
        match &self.0 {
            Stored::Floats(keys) => spread(keys, factors, target, threads, floats),
            Stored::Halves(keys) => spread(keys, factors, target, threads, halves),
        }
    }
}

fn all<'a, K>(keys: &[&'a KeyImage], key: impl Fn(&'a KeyImage) -> Option<K>) -> Option<Vec<K>> {
    keys.iter().map(|k| key(k)).collect()
}

/// Channels per part that are worth a thread: a tenth of a millisecond.
const SHARE: usize = 1 << 18;

/// Divides the frame into parts, one per thread.
fn spread<K: Key>(
    keys: &[K],
    factors: Factors,
    target: Target<'_>,
    threads: usize,
    task: fn(&[K], Factors, Target<'_>),
) {
    let channels = target.len();
    let share = channels.div_ceil(threads.max(1)).max(SHARE);
    let share = share.next_multiple_of(BLOCK);
    if share >= channels {
        return task(keys, factors, target);
    }
    std::thread::scope(|scope| {
        let mut rest = target;
        for start in (0..channels).step_by(share) {
            let (part, after) = rest.split(share);
            rest = after;
            let keys: Vec<K> = keys.iter().map(|key| key.from(start)).collect();
            scope.spawn(move || task(&keys, factors, part));
        }
    });
}

// One entry for each storage format: the functions called are inlined, and so compiled for each
// instruction set.

#[multiversion::multiversion(targets = "simd")]
fn floats(keys: &[Floats<'_>], factors: Factors, target: Target<'_>) {
    by_degree(keys, factors, target);
}

#[multiversion::multiversion(targets = "simd")]
fn halves(keys: &[Halves<'_>], factors: Factors, target: Target<'_>) {
    by_degree(keys, factors, target);
}

#[inline(always)]
fn by_degree<K: Key>(keys: &[K], factors: Factors, target: Target<'_>) {
    let [p, q, r, s] = factors.weights;
    let lerps = factors.lerps;
    match (factors.keys, keys) {
        (1, [a, ..]) => by_target([*a], lerps, target),
        (2, [a, b, ..]) => by_target([a.weighed(p), b.weighed(q)], lerps, target),
        (3, [a, b, c, ..]) => {
            by_target([a.weighed(p), b.weighed(q), c.weighed(r)], lerps, target);
        }
        (4, [a, b, c, d, ..]) => {
            let keys = [a.weighed(p), b.weighed(q), c.weighed(r), d.weighed(s)];
            by_target(keys, lerps, target);
        }
        _ => {}
    }
}

#[inline(always)]
fn by_target<K: Key, const N: usize>(keys: [K; N], factors: [f32; 3], target: Target<'_>) {
    match target {
        Target::Light(out) => by_block(keys, factors, out, |light, out| *out = *light),
        Target::Bytes(out, table) => {
            by_block(keys, factors, out, |light, out| table.block(light, out));
        }
    }
}

#[inline(always)]
fn by_block<K: Key, T: Copy + Default, const N: usize>(
    keys: [K; N],
    factors: [f32; 3],
    out: &mut [T],
    write: impl Fn(&Block, &mut [T; BLOCK]),
) {
    let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
    let whole = blocks.len();
    let black = [K::Stored::default(); BLOCK];
    for (index, out) in blocks.iter_mut().enumerate() {
        let stored = keys.each_ref().map(|key| {
            let (stored, _) = key.stored().as_chunks();
            stored.get(index).unwrap_or(&black)
        });
        write(&blended(keys, stored, factors), out);
    }
    if !rest.is_empty() {
        let stored = keys.each_ref().map(|key| {
            let last = key.stored().get(whole * BLOCK..).unwrap_or_default();
            let mut padded = [K::Stored::default(); BLOCK];
            for (to, from) in padded.iter_mut().zip(last) {
                *to = *from;
            }
            padded
        });
        let mut last = [T::default(); BLOCK];
        write(&blended(keys, stored.each_ref(), factors), &mut last);
        for (to, from) in rest.iter_mut().zip(last) {
            *to = from;
        }
    }
}

/// The light of a block.
#[inline(always)]
#[allow(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    reason = "lanes of blocks, all of one length: so it becomes one loop over registers"
)]
fn blended<K: Key, const N: usize>(
    keys: [K; N],
    stored: [&[K::Stored; BLOCK]; N],
    factors: [f32; 3],
) -> Block {
    let mixed = |light| {
        if K::WEIGHED {
            sum(light)
        } else {
            lerps(light, factors)
        }
    };
    let mut out = [0.0; BLOCK];
    let mut light = [0.0; N];
    for lane in 0..BLOCK {
        for k in 0..N {
            light[k] = keys[k].light(stored[k][lane]);
        }
        out[lane] = mixed(light);
    }
    out
}

/// The sum of weighted light.
#[inline(always)]
fn sum<const N: usize>(light: [f32; N]) -> f32 {
    match light.as_slice() {
        [a] => *a,
        [a, b] => a + b,
        [a, b, c] => (a + b) + c,
        [a, b, c, d] => (a + b) + (c + d),
        _ => 0.0,
    }
}

/// The lerps of [`footlight_show::timeline::blend()`]; the paper's Equation 5 for four keys.
#[inline(always)]
fn lerps<const N: usize>(light: [f32; N], [t, u, v]: [f32; 3]) -> f32 {
    match light.as_slice() {
        [a] => *a,
        [a, b] => lerp(*a, *b, t),
        [a, b, c] => lerp(lerp(*a, *b, t), *c, u),
        [a, b, c, d] => lerp(lerp(*a, *b, t), lerp(*c, *d, u), v),
        _ => 0.0,
    }
}

/// `a + t (b - a)`: exact at both ends, and between equal values.
#[inline(always)]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}
