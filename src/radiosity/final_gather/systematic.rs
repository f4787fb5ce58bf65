//! Systematic sampling of a stream of weighted arrivals of unknown length (Cochran, *Sampling
//! Techniques*, 1977, chapter 8): every so many-th is kept, the stride a power of two that grows with
//! the stream.
//!
//! The arrival at which a running total passes a multiple of the stride is kept. A greater stride's
//! multiples are among a smaller one's, so that what is kept of a longer stream was kept of a shorter
//! one, and what falls away can be forgotten on the way. All parts of the stream count alike, wherever
//! it ends: keeping the first ones, or denser at first, would favour the side from which they come.

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
            // Its first multiple is passed by all of them.
            stride.clamp(0.0, bits as f64) as u8
        };
        SystematicSample {
            strides: std::array::from_fn(stride),
        }
    }

    /// Rank of the arrival that raises the total from `before` to `after`: the binary logarithm of the
    /// greatest power of two of which it passes a multiple. `None` where nothing arrives.
    pub fn rank(before: u32, after: u32) -> Option<u8> {
        (before ^ after).checked_ilog2().map(|rank| rank as u8)
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

    /// Indices of the arrivals of weights that are kept, chosen at the end.
    fn kept(sample: &SystematicSample, weights: &[u32]) -> Vec<usize> {
        let total = weights.iter().sum();
        let mut sum = 0;
        let ranks = weights.iter().map(|weight| {
            sum += weight;
            SystematicSample::rank(sum - weight, sum).unwrap()
        });
        let ranks = ranks.enumerate();
        let kept = ranks.filter(|(_, rank)| sample.keeps(*rank, total));
        kept.map(|(at, _)| at).collect()
    }

    #[test]
    fn arrivals_are_evenly_spread() {
        let sample = SystematicSample::new(|total| 2.0 * total.sqrt());
        for count in 1..3000_usize {
            let kept = kept(&sample, &vec![1; count]);
            let gaps: Vec<usize> = kept.windows(2).map(|k| k[1] - k[0]).collect();
            assert!(gaps.iter().all(|gap| *gap == gaps[0]), "{count}: {kept:?}");
            let wanted = (2.0 * (count as f64).sqrt()).min(count as f64);
            let share = kept.len() as f64 / wanted;
            assert!((0.5..=2.0).contains(&share), "{count}: {share}");
        }
    }

    #[test]
    fn every_part_of_the_stream_counts_alike() {
        // The mean of a ramp is its middle, within one stride.
        let sample = SystematicSample::new(|total| total.cbrt().powi(2));
        for count in [1000_usize, 4095, 4096, 20_000] {
            let kept = kept(&sample, &vec![1; count]);
            let mean = kept.iter().sum::<usize>() as f64 / kept.len() as f64;
            let off = mean / count as f64 - 0.5;
            assert!(off.abs() < 1.0 / kept.len() as f64, "{count}: {off}");
        }
    }

    #[test]
    fn what_is_kept_at_the_end_was_kept_before() {
        for wanted in [0.1, 0.7, 3.0] {
            let sample = SystematicSample::new(|total| wanted * total.cbrt().powi(2));
            let weights: Vec<u32> = (0..500).map(|i| 1 + i * i % 37).collect();
            let mut before = vec![];
            for end in 1..=weights.len() {
                let now = kept(&sample, &weights[..end]);
                assert!(!now.is_empty());
                let old = now.iter().filter(|at| **at + 1 < end);
                assert!(old.copied().all(|at| before.contains(&at)), "{end}");
                before = now;
            }
        }
    }

    #[test]
    fn nothing_that_arrives_passes_nothing() {
        assert_eq!(SystematicSample::rank(7, 7), None);
        assert_eq!(SystematicSample::rank(u32::MAX - 1, u32::MAX), Some(0));
    }
}
