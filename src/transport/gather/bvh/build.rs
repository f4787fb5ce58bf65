//! Construction of the binary tree: triangles split by the surface area heuristic over bins (Wald
//! 2007).

use super::{Point, WIDTH};
use footlight_host::work::{Cancelled, Work};

/// Bins along each axis.
const BINS: usize = 16;
/// Triangles from which the halves are built on two threads.
const PARALLEL: usize = 4096;
/// Levels after which triangles are split in halves instead of by cost, which bounds the depth: 32
/// halvings suffice for any number.
pub const LEVELS: usize = 24;

/// A triangle during construction.
#[derive(Clone, Copy, Debug)]
pub struct Primitive {
    pub low: Point,
    pub high: Point,
    pub corners: [Point; 3],
    pub facet: u32,
}

impl Primitive {
    /// Twice its centre on an axis.
    fn middle(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

/// A growing box.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    pub low: Point,
    pub high: Point,
}

impl Extent {
    pub const EMPTY: Extent = Extent {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    pub fn add(&mut self, low: Point, high: Point) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(low[axis]);
            self.high[axis] = self.high[axis].max(high[axis]);
        }
    }

    pub fn of(primitives: &[Primitive]) -> Extent {
        let mut all = Extent::EMPTY;
        primitives.iter().for_each(|p| all.add(p.low, p.high));
        all
    }

    /// Half its surface area; zero for an empty box.
    pub fn area(&self) -> f32 {
        let side = |axis: usize| (self.high[axis] - self.low[axis]).max(0.0);
        side(0) * side(1) + side(1) * side(2) + side(2) * side(0)
    }
}

/// A group of triangles split in two.
#[derive(Clone, Copy, Debug)]
pub struct Fork {
    /// Boxes of the halves.
    extents: [Extent; 2],
    /// Number of triangles in the first half of each half.
    splits: [u32; 2],
}

impl Fork {
    pub const NONE: Fork = Fork {
        extents: [Extent::EMPTY; 2],
        splits: [0; 2],
    };
}

/// Triangles and the binary tree over them, before four children are merged into a node. All forks
/// are in one slice, one fewer than the triangles. The fork of a group whose first half has `split`
/// triangles follows the forks of that half and precedes those of the other.
#[derive(Clone, Copy)]
pub struct Tree<'a> {
    pub primitives: &'a [Primitive],
    forks: &'a [Fork],
    split: usize,
}

impl<'a> Tree<'a> {
    /// Builds the tree and reorders the triangles.
    ///
    /// # Errors
    /// On cancel.
    pub fn new(
        primitives: &'a mut [Primitive],
        forks: &'a mut [Fork],
        work: Work<'_>,
    ) -> Result<Tree<'a>, Cancelled> {
        let split = build(primitives, forks, 0, work)?;
        Ok(Tree {
            primitives,
            forks,
            split,
        })
    }

    /// The halves and their boxes; `None` for a leaf.
    pub fn halves(&self) -> Option<[(Extent, Tree<'a>); 2]> {
        if self.primitives.len() <= WIDTH {
            return None;
        }
        let split = self.split;
        let Fork { extents, splits } = self.forks[split - 1];
        let half = |primitives, forks, of: usize| {
            let split = splits[of] as usize;
            (
                extents[of],
                Tree {
                    primitives,
                    forks,
                    split,
                },
            )
        };
        let (left, right) = self.primitives.split_at(split);
        Some([
            half(left, &self.forks[..split - 1], 0),
            half(right, &self.forks[split..], 1),
        ])
    }
}

/// Reorders the triangles of a group and sets its forks; `level` counts from the root. Returns the
/// size of the first half.
fn build(
    primitives: &mut [Primitive],
    forks: &mut [Fork],
    level: usize,
    work: Work<'_>,
) -> Result<usize, Cancelled> {
    if primitives.len() <= WIDTH {
        return Ok(0);
    }
    let parallel = primitives.len() > PARALLEL;
    if parallel {
        work.check()?;
    }
    let middle = if level < LEVELS {
        split(primitives)
    } else {
        primitives.len() / 2
    };
    let next = level + 1;
    let (left, right) = primitives.split_at_mut(middle);
    let extents = [Extent::of(left), Extent::of(right)];
    let (first, rest) = forks.split_at_mut(middle - 1);
    let (own, second) = rest.split_at_mut(1);
    let (a, b) = if parallel {
        rayon::join(
            || build(left, first, next, work),
            || build(right, second, next, work),
        )
    } else {
        (
            build(left, first, next, work),
            build(right, second, next, work),
        )
    };
    own[0] = Fork {
        extents,
        splits: [a? as u32, b? as u32],
    };
    Ok(middle)
}

/// Reorders the triangles into two groups; returns the size of the first.
fn split(primitives: &mut [Primitive]) -> usize {
    let half = primitives.len() / 2;
    let mut cheapest: Option<(f32, usize, f32)> = None;
    for axis in 0..3 {
        let middles = primitives.iter().map(|p| p.middle(axis));
        let (low, high) = middles.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), m| {
            (l.min(m), h.max(m))
        });
        if high - low <= 1e-7 {
            continue;
        }
        let scale = BINS as f32 / (high - low);
        let mut bins = [(0usize, Extent::EMPTY); BINS];
        for p in primitives.iter() {
            let bin = (((p.middle(axis) - low) * scale) as usize).min(BINS - 1);
            bins[bin].0 += 1;
            bins[bin].1.add(p.low, p.high);
        }
        // Cost of each split: areas times leaves.
        let leaves = |count: usize| count.div_ceil(WIDTH) as f32;
        let mut right = [0.0; BINS];
        let (mut count, mut extent) = (0, Extent::EMPTY);
        for bin in (1..BINS).rev() {
            count += bins[bin].0;
            extent.add(bins[bin].1.low, bins[bin].1.high);
            right[bin] = if count > 0 {
                extent.area() * leaves(count)
            } else {
                f32::INFINITY
            };
        }
        let (mut count, mut extent) = (0, Extent::EMPTY);
        for bin in 0..BINS - 1 {
            count += bins[bin].0;
            extent.add(bins[bin].1.low, bins[bin].1.high);
            let cost = extent.area() * leaves(count) + right[bin + 1];
            if count > 0 && cheapest.is_none_or(|(least, ..)| cost < least) {
                cheapest = Some((cost, axis, low + (bin + 1) as f32 / scale));
            }
        }
    }
    let Some((_, axis, border)) = cheapest else {
        return half;
    };
    let (mut start, mut end) = (0, primitives.len());
    while start < end {
        if primitives[start].middle(axis) < border {
            start += 1;
        } else {
            end -= 1;
            primitives.swap(start, end);
        }
    }
    if start == 0 || start == primitives.len() {
        half
    } else {
        start
    }
}
