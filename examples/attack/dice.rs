//! Seeded random numbers (Vigna's splitmix64).

use footlight_show::hash::{GOLDEN, mix};

pub struct Dice(pub u64);

impl Dice {
    /// A number below `end`, which is not 0.
    pub fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(GOLDEN);
        (mix(self.0) % end as u64) as usize
    }
}
