//! Pseudo-random numbers that are the same on every machine.

use footlight_show::hash::{GOLDEN, mix};

/// Vigna's splitmix64.
#[derive(Clone, Debug)]
pub struct Dice(u64);

impl Dice {
    /// A generator; the same seed gives the same numbers.
    pub fn new(seed: u64) -> Dice {
        Dice(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        mix(self.0)
    }

    /// A number in [`from`, `to`).
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number in [`from`, `to`].
    pub fn whole(&mut self, from: usize, to: usize) -> usize {
        from + (self.next() >> 11) as usize % (to - from + 1)
    }

    /// True with this probability.
    pub fn chance(&mut self, share: f64) -> bool {
        self.between(0.0, 1.0) < share
    }
}
