//! Systematic sampling of a stream of weighted arrivals of unknown length (Cochran, *Sampling
//! Techniques*, 1977, chapter 8): every so many-th is kept, the stride a power of two that grows with
//! the stream.
//!
//! The arrival at which a running total passes a multiple of the stride is kept. A greater stride's
//! multiples are among a smaller one's, so that what is kept of a longer stream was kept of a shorter
//! one, and what falls away can be forgotten on the way. The count starts at a random number, so that
//! all arrivals are kept as often, wherever the stream ends: to keep the first ones, or more of them,
//! would favour the side from which they come.

/// How much is kept of a stream, by its total.
#[derive(Clone, Debug)]
pub struct SystematicSample {
    /// Binary logarithm of the stride, by that of the total.
    strides: [u8; u32::BITS as usize],
}

impl SystematicSample {
    /// Of a stream of `total` units about `wanted(total)` arrivals, and at least one; they may grow no
    /// faster than the total.
    pub fn new(wanted: impl Fn(f64) -> f64) -> SystematicSample {
        let stride = |bits: usize| {
            // The middle of the totals that share it.
            let total = (bits as f64 + 0.5).exp2();
            let stride = (total / wanted(total).max(1.0)).log2().round();
            // A multiple of it is passed by all of them.
            stride.clamp(0.0, bits as f64) as u8
        };
        SystematicSample {
            strides: std::array::from_fn(stride),
        }
    }

    /// Rank of the arrival that raises the total from `before` to `after`, in a stream that is counted
    /// from `start`, any number: the binary logarithm of the greatest power of two of which it passes a
    /// multiple. `None` where nothing arrives.
    pub fn rank(start: u32, [before, after]: [u32; 2]) -> Option<u8> {
        // Where the count wraps a multiple of all powers is passed.
        let passed = start.wrapping_add(before) ^ start.wrapping_add(after);
        passed.checked_ilog2().map(|rank| rank as u8)
    }

    /// Is an arrival of this rank kept of a stream that has come to `total`?
    pub fn keeps(&self, rank: u8, total: u32) -> bool {
        let bits = total.checked_ilog2().unwrap_or(0);
        rank >= self.strides[bits as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::sampling::hash;

    /// Indices of the arrivals of weights that are kept, chosen at the end.
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
