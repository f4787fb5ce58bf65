//! One pass from key images to a frame: at most three blends, exposure, tone curve and display code.
//! Every key is read once and the frame written once.
//!
//! A frame's bytes equal those of [`ByteTable`] on the blended light on every processor: the loops
//! are compiled for several instruction sets, with equal products and sums in equal order. Lerps
//! preserve to the bit what two keys have in common. Channels are processed [`BLOCK`] at a time.

#[cfg(test)]
mod tests;

use footlight_picture::tone::{BLOCK, ByteTable};
use footlight_show::timeline::Blend;

/// The channels of a block.
type Block = [f32; BLOCK];

/// The blends of one instant, in single precision: number of keys and lerp factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    keys: usize,
    lerps: [f32; 3],
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
        }
    }
}

/// Destination of the blended light.
pub enum BlendTarget<'a> {
    /// Linear light.
    Light(&'a mut [f32]),
    /// Display bytes.
    Bytes(&'a mut [u8], &'a ByteTable),
}

impl<'a> BlendTarget<'a> {
    fn len(&self) -> usize {
        match self {
            BlendTarget::Light(out) => out.len(),
            BlendTarget::Bytes(out, _) => out.len(),
        }
    }

    /// Writes light of the same size.
    pub fn write(self, light: &[f32]) {
        match self {
            BlendTarget::Light(out) => out.copy_from_slice(light),
            BlendTarget::Bytes(out, table) => table.encode(light, out),
        }
    }

    /// Splits at `channels`.
    fn split(self, channels: usize) -> (BlendTarget<'a>, BlendTarget<'a>) {
        let at = channels.min(self.len());
        match self {
            BlendTarget::Light(out) => {
                let (first, rest) = out.split_at_mut(at);
                (BlendTarget::Light(first), BlendTarget::Light(rest))
            }
            BlendTarget::Bytes(out, table) => {
                let (first, rest) = out.split_at_mut(at);
                (
                    BlendTarget::Bytes(first, table),
                    BlendTarget::Bytes(rest, table),
                )
            }
        }
    }
}

/// Blends the channels of key images into `target`, with up to `threads` threads; the result does
/// not depend on their number. A block that a key does not fill counts as black in that key; when
/// keys for `factors` are missing, nothing is written.
pub fn blend(keys: &[&[f32]], factors: Factors, target: BlendTarget<'_>, threads: usize) {
    let channels = target.len();
    let share = channels.div_ceil(threads.max(1)).max(SHARE);
    let share = share.next_multiple_of(BLOCK);
    if share >= channels {
        return by_degree(keys, factors, target);
    }
    std::thread::scope(|scope| {
        let mut rest = target;
        for start in (0..channels).step_by(share) {
            let (part, after) = rest.split(share);
            rest = after;
            let keys = keys.iter().map(|key| key.get(start..).unwrap_or_default());
            let keys: Vec<&[f32]> = keys.collect();
            scope.spawn(move || by_degree(&keys, factors, part));
        }
    });
}

/// Channels per part that are worth a thread: a tenth of a millisecond.
const SHARE: usize = 1 << 18;

/// Everything called is inlined, and so compiled for each instruction set.
#[multiversion::multiversion(targets = "simd")]
fn by_degree(keys: &[&[f32]], factors: Factors, target: BlendTarget<'_>) {
    plainly(keys, factors, target);
}

#[inline(always)]
fn plainly(keys: &[&[f32]], factors: Factors, target: BlendTarget<'_>) {
    let lerps = factors.lerps;
    match (factors.keys, keys) {
        (1, [a, ..]) => by_target([*a], lerps, target),
        (2, [a, b, ..]) => by_target([*a, *b], lerps, target),
        (3, [a, b, c, ..]) => by_target([*a, *b, *c], lerps, target),
        (4, [a, b, c, d, ..]) => by_target([*a, *b, *c, *d], lerps, target),
        _ => {}
    }
}

#[inline(always)]
fn by_target<const N: usize>(keys: [&[f32]; N], factors: [f32; 3], target: BlendTarget<'_>) {
    match target {
        BlendTarget::Light(out) => by_block(keys, factors, out, |light, out| *out = *light),
        BlendTarget::Bytes(out, table) => {
            by_block(keys, factors, out, |light, out| table.block(light, out));
        }
    }
}

#[inline(always)]
fn by_block<T: Copy + Default, const N: usize>(
    keys: [&[f32]; N],
    factors: [f32; 3],
    out: &mut [T],
    write: impl Fn(&Block, &mut [T; BLOCK]),
) {
    let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
    let whole = blocks.len();
    for (index, out) in blocks.iter_mut().enumerate() {
        let light = keys.map(|key| key.as_chunks().0.get(index).unwrap_or(&[0.0; BLOCK]));
        write(&blended(light, factors), out);
    }
    if !rest.is_empty() {
        let light = keys.map(|key| {
            let last = key.get(whole * BLOCK..).unwrap_or_default();
            let mut padded = [0.0; BLOCK];
            for (to, from) in padded.iter_mut().zip(last) {
                *to = *from;
            }
            padded
        });
        let mut last = [T::default(); BLOCK];
        write(&blended(light.each_ref(), factors), &mut last);
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
fn blended<const N: usize>(keys: [&Block; N], factors: [f32; 3]) -> Block {
    let mut out = [0.0; BLOCK];
    let mut light = [0.0; N];
    for lane in 0..BLOCK {
        for k in 0..N {
            light[k] = keys[k][lane];
        }
        out[lane] = lerps(light, factors);
    }
    out
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
