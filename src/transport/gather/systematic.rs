//! Systematic sampling of a stream of weighted arrivals of unknown length (Cochran, *Sampling
//! Techniques*, 1977, chapter 8), with a stride that is a power of two and grows with the stream.
//!
//! An arrival is kept when the running total passes a multiple of the stride at it. Multiples of a
//! larger stride are also multiples of a smaller one, so every arrival kept of a longer stream is
//! kept of a shorter one, and dropped arrivals can be forgotten. The count starts at a random
//! number, so all arrivals are equally likely to be kept wherever the stream ends; keeping the
//! first ones would favour the side from which they come.

/// The sampling rate of a stream, by its total.
#[derive(Clone, Debug)]
pub struct SystematicSample {
    /// Binary logarithm of the stride, by that of the total.
    strides: [u8; u32::BITS as usize],
}

impl SystematicSample {
    /// Keeps approximately `wanted(total)` arrivals, at least one, of a stream of `total` units;
    /// `wanted` may grow no faster than the total.
    pub fn new(wanted: impl Fn(f64) -> f64) -> SystematicSample {
        let stride = |bits: usize| {
            // Centre of the totals that share the stride.
            let total = (bits as f64 + 0.5).exp2();
            let stride = (total / wanted(total).max(1.0)).log2().round();
            // All of them pass a multiple of it.
            stride.clamp(0.0, bits as f64) as u8
        };
        SystematicSample {
            strides: std::array::from_fn(stride),
        }
    }

    /// Rank of the arrival that raises the total from `before` to `after`, in a stream counted from
    /// any number `start`: the binary logarithm of the greatest power of two of which it passes a
    /// multiple. `None` for an empty arrival.
    pub fn rank(start: u32, [before, after]: [u32; 2]) -> Option<u8> {
        // A wrap of the count passes a multiple of all powers.
        let passed = start.wrapping_add(before) ^ start.wrapping_add(after);
        passed.checked_ilog2().map(|rank| rank as u8)
    }

    /// True when an arrival of this rank is kept of a stream with this total.
    pub fn keeps(&self, rank: u8, total: u32) -> bool {
        let bits = total.checked_ilog2().unwrap_or(0);
        rank >= self.strides[bits as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::sampling::hash;

    /// Indices of the kept arrivals, selected at the end of the stream.
    fn kept(sample: &SystematicSample, start: u32, weights: &[u32]) -> Vec<usize> {
        let total = weights.iter().sum();
        let mut sum = 0;
        let is_kept = |(at, weight): (usize, &u32)| {
            sum += weight;
            let rank = SystematicSample::rank(start, [sum - weight, sum]).unwrap();
            sample.keeps(rank, total).then_some(at)
        };
        weights.iter().enumerate().filter_map(is_kept).collect()
    }

    #[test]
    fn arrivals_are_evenly_spread() {
        let sample = SystematicSample::new(|total| 2.0 * total.sqrt());
        for count in 1..3000_usize {
            let kept = kept(&sample, hash(count as u32), &vec![1; count]);
            let gaps: Vec<usize> = kept.windows(2).map(|k| k[1] - k[0]).collect();
            assert!(gaps.iter().all(|gap| *gap == gaps[0]), "{count}: {kept:?}");
            let wanted = (2.0 * (count as f64).sqrt()).min(count as f64);
            let share = kept.len() as f64 / wanted;
            assert!((0.5..=2.0).contains(&share), "{count}: {share}");
        }
    }

    #[test]
    fn every_arrival_is_kept_as_often() {
        let sample = SystematicSample::new(|total| total.cbrt());
        for count in [1, 2, 3, 6, 11, 100] {
            let mut times = vec![0.0; count];
            let starts = 4096_u32;
            for start in 0..starts {
                let kept = kept(&sample, start, &vec![1; count]);
                assert!(!kept.is_empty());
                kept.iter()
                    .for_each(|at| times[*at] += 1.0 / f64::from(starts));
            }
            assert!(times.iter().all(|t| *t == times[0]), "{count}: {times:?}");
        }
    }

    #[test]
    fn what_is_kept_at_the_end_was_kept_before() {
        for wanted in [0.1, 0.7, 3.0] {
            let sample = SystematicSample::new(|total| wanted * total.cbrt().powi(2));
            let weights: Vec<u32> = (0..500).map(|i| 1 + i * i % 37).collect();
            let mut before = vec![];
            for end in 1..=weights.len() {
                let now = kept(&sample, u32::MAX - 900, &weights[..end]);
                assert!(!now.is_empty());
                let old = now.iter().filter(|at| **at + 1 < end);
                assert!(old.copied().all(|at| before.contains(&at)), "{end}");
                before = now;
            }
        }
    }

    #[test]
    fn nothing_that_arrives_passes_nothing() {
        assert_eq!(SystematicSample::rank(3, [7, 7]), None);
        assert_eq!(SystematicSample::rank(0, [u32::MAX - 1, u32::MAX]), Some(0));
    }
}
