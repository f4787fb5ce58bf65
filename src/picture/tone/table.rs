//! Light to display bytes by one look-up: exact, and without a power function or a branch.
//!
//! The thresholds of the 255 codes lie at least 0.89 % apart, and floats that agree in their 16
//! leading bits at most 0.78 %: such a stretch of floats holds at most one threshold. A table
//! indexed by these bits holds the code at the start of the stretch and the position of the
//! threshold in the 16 lower bits; the sum with the float's lower bits carries into the next code
//! exactly from the threshold on. The stretches in use are consecutive, so the last bits of their
//! numbers identify them.

/// Channels looked up at a time.
pub const BLOCK: usize = 64;

/// Number of stretches of floats; the thresholds span 15 octaves of 128.
const STRETCHES: usize = 2048;

/// Table of display bytes for one exposure and one curve.
#[derive(Clone, Debug)]
pub struct ByteTable {
    /// A float below the first threshold's stretch: everything darker uses the first entry.
    least: f32,
    /// The last threshold; from it on every byte is 255.
    most: f32,
    /// By the last bits of a stretch's number: the code at its start times 2^16, plus 2^16 minus
    /// the position of its threshold, minus the bits of the stretch's first float.
    entries: [u32; STRETCHES],
}

impl ByteTable {
    /// From the least light of each code from 1 to 255: positive, increasing, normal numbers at
    /// least 0.79 % apart, at most 15 octaves from first to last. Others would be rounded to the
    /// start or the end of a stretch.
    pub(super) fn new(thresholds: &[f32; 255]) -> ByteTable {
        let [dark, .., white] = *thresholds;
        let least = f32::from_bits((dark.to_bits() >> 16 << 16).saturating_sub(1));
        let first = least.to_bits() >> 16;
        let mut entries = [0; STRETCHES];
        for stretch in first..first + STRETCHES as u32 {
            let start = stretch << 16;
            let below = thresholds.partition_point(|t| t.to_bits() < start);
            let inside = thresholds.get(below).map(|t| t.to_bits());
            let carry = inside.filter(|bits| bits >> 16 == stretch);
            let carry = carry.map_or(0, |bits| 0x1_0000 - (bits & 0xffff));
            let entry = (((below as u32) << 16) + carry).wrapping_sub(start);
            if let Some(at) = entries.get_mut(stretch as usize % STRETCHES) {
                *at = entry;
            }
        }
        ByteTable {
            least,
            most: white,
            entries,
        }
    }

    /// The byte of one channel; NaN is black.
    #[inline(always)]
    pub fn byte(&self, light: f32) -> u8 {
        self.code(self.clamped(light)) as u8
    }

    /// Bits of light clamped between the first and the last threshold. In this order NaN becomes
    /// the darkest; each line is one instruction.
    #[inline(always)]
    fn clamped(&self, light: f32) -> u32 {
        let light = if light > self.least {
            light
        } else {
            self.least
        };
        let light = if light < self.most { light } else { self.most };
        light.to_bits()
    }

    #[inline(always)]
    #[allow(
        clippy::indexing_slicing,
        reason = "the rest is below the table's length; a checked look-up would be one channel at a time"
    )]
    fn code(&self, bits: u32) -> u32 {
        let entry = self.entries[(bits >> 16) as usize % STRETCHES];
        entry.wrapping_add(bits) >> 16
    }

    /// The bytes of a block.
    #[inline(always)]
    pub fn block(&self, light: &[f32; BLOCK], out: &mut [u8; BLOCK]) {
        // Local arrays, so that the compiler can exclude aliasing.
        let codes = light.map(|light| self.clamped(light));
        let codes = codes.map(|bits| self.code(bits));
        *out = codes.map(|code| code as u8);
    }

    /// Encodes any number of channels; the shorter side ends it.
    pub fn encode(&self, light: &[f32], out: &mut [u8]) {
        let blocks = light.as_chunks().0.iter();
        for (out, light) in out.as_chunks_mut().0.iter_mut().zip(blocks) {
            self.block(light, out);
        }
        let whole = light.len().min(out.len()) / BLOCK * BLOCK;
        let rest = light.iter().zip(out).skip(whole);
        for (light, out) in rest {
            *out = self.byte(*light);
        }
    }
}
