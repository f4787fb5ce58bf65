//! Numbers of cells in few bits: there are tens of millions.
//!
//! [`PackedNumbers`] keeps their order, in as many bits as the largest of a block needs.
//! [`SortedLists`] keeps lists whose order does not matter, as differences of the sorted numbers in
//! the code of Rice (1979): about the logarithm of the mean difference and three bits for each
//! number, and a bit for each time that it is repeated.

/// Numbers of a block.
const BLOCK: usize = 1 << 14;
/// Bits of a list's parameter.
const PARAMETER: u32 = 5;

/// Numbers in the order in which they came.
#[derive(Debug, Default)]
pub struct PackedNumbers {
    blocks: Vec<(Bits, u32)>,
    /// Of the block that is not full yet.
    open: Vec<u32>,
}

impl PackedNumbers {
    /// Adds numbers.
    pub fn extend(&mut self, numbers: &[u32]) {
        for number in numbers {
            self.open.push(*number);
            if self.open.len() == BLOCK {
                self.close();
            }
        }
    }

    /// Packs what is not packed yet; to be called once, after the last number.
    pub fn close(&mut self) {
        let most = self.open.iter().copied().max().unwrap_or(0);
        let width = (u32::BITS - most.leading_zeros()).max(1);
        let mut bits = Bits::default();
        self.open
            .iter()
            .for_each(|n| bits.push(u64::from(*n), width));
        bits.words.shrink_to_fit();
        self.blocks.push((bits, width));
        self.open.clear();
    }

    /// A number that is packed; 0 where there is none.
    pub fn get(&self, at: usize) -> u32 {
        let Some((bits, width)) = self.blocks.get(at / BLOCK) else {
            return 0;
        };
        (bits.peek((at % BLOCK) * *width as usize) & ((1 << width) - 1)) as u32
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let blocks = self.blocks.iter().map(|(bits, _)| bits.bytes());
        blocks.sum::<usize>() + 4 * self.open.len()
    }
}

/// Lists one after the other, each sorted; their lengths are known to the reader.
#[derive(Debug, Default)]
pub struct SortedLists {
    bits: Bits,
}

impl SortedLists {
    /// Adds a list, which it sorts.
    pub fn push(&mut self, numbers: &mut [u32]) {
        numbers.sort_unstable();
        let largest = numbers.last().copied().unwrap_or(0);
        let alike = || numbers.chunk_by(|a, b| a == b);
        // The best parameter is about the logarithm of 0.69 times the mean difference.
        let mean = f64::from(largest) / alike().count().max(1) as f64;
        let low = (0.69 * mean).max(1.0).log2().round().min(31.0) as u32;
        self.bits.push(u64::from(low), PARAMETER);
        let mut before = 0;
        for times in alike() {
            let difference = u64::from(times[0] - before);
            before = times[0];
            self.bits.push_unary(difference >> low);
            self.bits.push(difference & ((1 << low) - 1), low);
            self.bits.push_unary(times.len() as u64 - 1);
        }
    }

    /// Where the next list will begin.
    pub fn end(&self) -> usize {
        self.bits.length
    }

    /// The numbers of the list of `count` that begins at a place, which is moved to its end, each once
    /// and how often it is there.
    pub fn read<'a>(
        &'a self,
        at: &'a mut usize,
        count: u32,
    ) -> impl Iterator<Item = (u32, u32)> + 'a {
        let low = self.bits.peek(*at) & ((1 << PARAMETER) - 1);
        *at += PARAMETER as usize;
        let (mut number, mut left) = (0, count);
        std::iter::from_fn(move || {
            if left == 0 {
                return None;
            }
            let high = self.bits.unary(at);
            let rest = self.bits.peek(*at) & ((1 << low) - 1);
            *at += low as usize;
            number += (high << low | rest) as u32;
            let times = left.min(self.bits.unary(at) as u32 + 1);
            left -= times;
            Some((number, times))
        })
    }

    /// Gives memory back that no list needs.
    pub fn shrink(&mut self) {
        self.bits.words.shrink_to_fit();
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.bits.bytes()
    }
}

/// A row of bits.
#[derive(Debug, Default)]
struct Bits {
    words: Vec<u64>,
    length: usize,
}

impl Bits {
    /// Adds the low `width` bits of a number that has no others, up to 63.
    fn push(&mut self, number: u64, width: u32) {
        let shift = self.length as u32 % 64;
        match self.words.last_mut().filter(|_| shift > 0) {
            Some(word) => *word |= number << shift,
            None if width > 0 => self.words.push(number),
            None => {}
        }
        if shift > 0 && shift + width > 64 {
            self.words.push(number >> (64 - shift));
        }
        self.length += width as usize;
    }

    /// Adds a number as so many zeros and a one.
    fn push_unary(&mut self, mut number: u64) {
        while number >= 32 {
            self.push(0, 32);
            number -= 32;
        }
        self.push(1 << number, number as u32 + 1);
    }

    /// Reads such a number at a place, which is moved to its end.
    fn unary(&self, at: &mut usize) -> u64 {
        let mut number = 0;
        let mut word = self.peek(*at);
        while word == 0 && *at < self.length {
            *at += 64;
            number += 64;
            word = self.peek(*at);
        }
        let zeros = word.trailing_zeros();
        *at += zeros as usize + 1;
        number + u64::from(zeros)
    }

    /// The 64 bits from a place on; zeros behind the end.
    fn peek(&self, at: usize) -> u64 {
        let word = |at: usize| self.words.get(at).copied().unwrap_or(0);
        let shift = at as u32 % 64;
        // Twice, as a shift by 64 is none.
        word(at / 64) >> shift | word(at / 64 + 1) << 1 << (63 - shift)
    }

    fn bytes(&self) -> usize {
        8 * self.words.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiosity::final_gather::sampling::hash;

    /// Numbers of up to so many bits.
    fn numbers(count: u32, bits: u32) -> Vec<u32> {
        (0..count).map(|i| hash(i) >> (32 - bits)).collect()
    }

    #[test]
    fn packed_numbers_come_back_in_order() {
        let all = [numbers(20_000, 1), numbers(20_000, 32), numbers(9, 17)].concat();
        let mut packed = PackedNumbers::default();
        all.chunks(777).for_each(|some| packed.extend(some));
        packed.close();
        assert!((0..all.len()).all(|at| packed.get(at) == all[at]));
        assert!(packed.bytes() < 4 * all.len());
    }

    #[test]
    fn lists_come_back_sorted_and_in_few_bits() {
        let mut lists = vec![vec![], vec![0; 40], vec![u32::MAX, 0, 7], vec![u32::MAX]];
        lists.push([vec![0; 5000], vec![1 << 20]].concat());
        lists.extend((1..33).map(|bits| numbers(600, bits)));
        let mut packed = SortedLists::default();
        let starts: Vec<usize> = lists
            .iter_mut()
            .map(|list| {
                let start = packed.end();
                packed.push(list);
                start
            })
            .collect();
        for (list, start) in lists.iter().zip(starts) {
            let mut at = start;
            let read = packed.read(&mut at, list.len() as u32);
            let read: Vec<u32> = read
                .flat_map(|(n, times)| (0..times).map(move |_| n))
                .collect();
            assert_eq!(read, *list);
        }
        // 600 of a million: the bound is 12.2 bits each, without the one that tells that it is there once.
        let mut one = SortedLists::default();
        one.push(&mut numbers(600, 20));
        assert!(one.end() - 600 < 600 * 13, "{}", one.end());
        let mut twice = SortedLists::default();
        twice.push(&mut numbers(600, 20).repeat(2));
        assert_eq!(twice.end(), one.end() + 600);
    }
}
