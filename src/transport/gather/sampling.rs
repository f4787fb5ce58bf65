//! Sample points: scrambled Sobol points and cosine-weighted directions.
//!
//! Points depend on indices and seeds alone, so that results do not depend on the number of
//! threads. This module does not depend on scenes.

use footlight_show::geometry::{Vec3, frame};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Finaliser of a 32-bit hash (Wang; constants of Wellons 2018).
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Owen scrambling by a hash in which each bit depends only on the higher ones (Laine and Karras
/// 2011; Burley 2020).
fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits().wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x.reverse_bits()
}

/// Second dimension of the Sobol sequence: bit `j` from the left is the sum, modulo 2, of the bits
/// `i` of the index for which `i` choose `j` is odd, that is where `i` has all bits of `j` (Lucas
/// 1878). Hence the bits of each block of two, four and so on are added to those of its other half.
fn second_dimension(index: u32) -> u32 {
    let mut bits = index;
    bits ^= bits >> 1 & 0x5555_5555;
    bits ^= bits >> 2 & 0x3333_3333;
    bits ^= bits >> 4 & 0x0f0f_0f0f;
    bits ^= bits >> 8 & 0x00ff_00ff;
    bits ^= bits >> 16;
    bits.reverse_bits()
}

/// Point `index` of a scrambled and shuffled (0, 2)-sequence, in the unit square.
pub fn point(index: u32, seed: u32) -> [f64; 2] {
    let seed = hash(seed);
    let shuffled = scramble(index, seed);
    let x = scramble(shuffled.reverse_bits(), hash(seed ^ 0x0123_4567));
    let y = scramble(second_dimension(shuffled), hash(seed ^ 0x089a_bcde));
    [x, y].map(|v| f64::from(v >> 8) / f64::from(1 << 24))
}

/// A uniform pair shifted by half the square: another uniform pair.
pub fn shifted([u, v]: [f64; 2]) -> [f64; 2] {
    [(u + 0.5).fract(), (v + 0.5).fract()]
}

/// Index of a pixel along a Morton curve: neighbours in the image are neighbours in the sequence,
/// so that their errors differ (Ahmed and Wonka 2020).
pub fn morton(x: usize, y: usize) -> u32 {
    let spread = |v: usize| {
        let mut v = (v & 0xffff) as u32;
        v = (v | v << 8) & 0x00ff_00ff;
        v = (v | v << 4) & 0x0f0f_0f0f;
        v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(x) | spread(y) << 1
}

/// A direction about `normal` with the density cosine over pi, by the concentric map of the square
/// to the disc (Shirley and Chiu 1997).
pub fn cosine_direction(normal: Vec3, [u, v]: [f64; 2]) -> Vec3 {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return normal;
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * b / a)
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * a / b)
    };
    let height = (1.0 - radius * radius).max(1e-6).sqrt();
    let [s, t] = frame(normal);
    let way = s * (radius * angle.cos()) + t * (radius * angle.sin()) + normal * height;
    way.normalized()
}

#[cfg(test)]
mod tests {
    use super::*;
    use footlight_show::geometry::vec3;

    /// Reference by direction numbers, each the one before plus half of itself.
    #[test]
    fn the_second_dimension_is_that_of_sobol() {
        let by_direction_numbers = |index: u32| {
            let numbers = (0..32).scan(1_u32 << 31, |next, bit| {
                let own = *next;
                *next ^= own >> 1;
                Some(if index >> bit & 1 == 1 { own } else { 0 })
            });
            numbers.fold(0, |sum, own| sum ^ own)
        };
        for i in (0..300).chain((0..300).map(hash)) {
            assert_eq!(second_dimension(i), by_direction_numbers(i), "{i}");
        }
    }

    /// Every elementary interval of 64 consecutive points contains one of them, for every seed.
    #[test]
    fn points_are_a_net() {
        for seed in 0..20 {
            for (columns, rows) in [(64, 1), (8, 8), (1, 64), (4, 16)] {
                let mut found = vec![0; 64];
                for i in 128..192 {
                    let [x, y] = point(i, seed);
                    let at = (x * f64::from(columns)) as usize * rows as usize
                        + (y * f64::from(rows)) as usize;
                    found[at] += 1;
                }
                assert!(found.iter().all(|n| *n == 1), "{seed} {columns}x{rows}");
            }
        }
    }

    /// The mean cosine of a cosine-weighted direction is 2/3; the mean tangent components are 0.
    #[test]
    fn directions_are_weighted_by_the_cosine() {
        let normal = vec3(0.6, 0.0, 0.8);
        let mut sum = Vec3::ZERO;
        for i in 0..4096 {
            let way = cosine_direction(normal, point(i, 7));
            assert!(normal.dot(way) > 0.0 && (way.length() - 1.0).abs() < 1e-12);
            sum += way;
        }
        assert!((sum / 4096.0 - normal * (2.0 / 3.0)).length() < 1e-3);
    }
}
