//! Ordered dithering: light between two codes shows as both, in a fixed pattern.
//!
//! Each pixel of an 8 x 8 tile has its threshold (Bayer, "An optimum method for two-level rendition
//! of continuous-tone pictures", 1973), so that the tile's mean light is right to a 64th of a step.
//! The pattern does not move, a pixel's three channels have one threshold, so that grey stays grey,
//! and light that a code stands for shows as that code.

use super::{ByteTable, Tone};
use crate::units::srgb_decode;

/// Side of a tile.
const SIDE: usize = 8;

/// Thresholds of a tile, in 64ths: Bayer's matrix, which is the bits of x ^ y and of y, interleaved,
/// the lowest first.
const TILE: [[u8; SIDE]; SIDE] = [
    [0, 32, 8, 40, 2, 34, 10, 42],
    [48, 16, 56, 24, 50, 18, 58, 26],
    [12, 44, 4, 36, 14, 46, 6, 38],
    [60, 28, 52, 20, 62, 30, 54, 22],
    [3, 35, 11, 43, 1, 33, 9, 41],
    [51, 19, 59, 27, 49, 17, 57, 25],
    [15, 47, 7, 39, 13, 45, 5, 37],
    [63, 31, 55, 23, 61, 29, 53, 21],
];

/// Light to display bytes with a pattern.
#[derive(Clone, Debug)]
pub struct Dither {
    /// The code below light.
    below: ByteTable,
    /// The light of each code, and the inverse of the step to the next; 0 at white.
    steps: [(f32, f32); 256],
}

impl Dither {
    pub(super) fn new(tone: &Tone) -> Dither {
        let lights: [f32; 256] =
            std::array::from_fn(|code| tone.light(srgb_decode(code as f64 / 255.0)) as f32);
        let [_, above @ ..] = lights;
        let step = |(light, next): (f32, &f32)| (light, 1.0 / (next - light));
        let mut steps = lights.map(|light| (light, 0.0));
        for (to, from) in steps.iter_mut().zip(lights.into_iter().zip(&above)) {
            *to = step(from);
        }
        Dither {
            below: ByteTable::new(&above),
            steps,
        }
    }

    /// The bytes of a picture so many channels wide; the shorter side ends it.
    pub fn encode(&self, row: usize, light: &[f32], out: &mut [u8]) {
        let row = row.max(1);
        let rows = light.chunks(row).zip(out.chunks_mut(row));
        for ((light, out), thresholds) in rows.zip(TILE.iter().cycle()) {
            let thresholds = thresholds.iter().flat_map(|t| [*t; 3]).cycle();
            for ((light, out), threshold) in light.iter().zip(out).zip(thresholds) {
                *out = self.byte(*light, threshold);
            }
        }
    }

    #[inline(always)]
    fn byte(&self, light: f32, threshold: u8) -> u8 {
        let code = self.below.byte(light);
        let (start, per_step) = self
            .steps
            .get(usize::from(code))
            .copied()
            .unwrap_or_default();
        let place = (light - start) * per_step;
        // NaN is not above.
        code + u8::from(place > (f32::from(threshold) + 0.5) / (SIDE * SIDE) as f32)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::super::{Curve, Tone};
    use super::*;
    use crate::picture::Image;

    fn tones() -> [Tone; 2] {
        [Curve::Filmic, Curve::Plain].map(|curve| Tone {
            exposure: 0.7,
            curve,
            dither: true,
        })
    }

    #[test]
    fn a_tile_has_every_threshold_once() {
        let mut sorted = TILE.concat();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, t)| usize::from(*t) == i));
        // Bayer's own first corner: 0 and half a step beside each other.
        assert_eq!(
            [TILE[0][..2].to_vec(), TILE[1][..2].to_vec()],
            [[0, 32], [48, 16]]
        );
        for (y, row) in TILE.iter().enumerate() {
            for (x, threshold) in row.iter().enumerate() {
                let bits = |bit: usize| (((x ^ y) >> bit & 1) << 1) | (y >> bit & 1);
                let interleaved = bits(0) << 4 | bits(1) << 2 | bits(2);
                assert_eq!(usize::from(*threshold), interleaved, "{x} {y}");
            }
        }
    }

    #[test]
    fn the_mean_of_a_tile_is_its_light() {
        for tone in tones() {
            let lights: Vec<f64> = (0..=255)
                .map(|c| tone.light(srgb_decode(f64::from(c) / 255.0)))
                .collect();
            for i in 1..4000 {
                let light = tone.light(srgb_decode(f64::from(i) / 4000.0));
                let code = lights.partition_point(|l| *l <= light) - 1;
                let image = Image::from_data(8, 8, vec![light as f32; 192]).unwrap();
                let shown = tone.encode(&image);
                let mean = shown.iter().map(|c| lights[usize::from(*c)]).sum::<f64>() / 192.0;
                let step = lights[(code + 1).min(255)] - lights[code.min(254)];
                assert!(
                    (mean - light).abs() <= step / 127.0,
                    "{tone:?} {light} {mean}"
                );
                let near = |c: &u8| usize::from(*c) == code || usize::from(*c) == code + 1;
                assert!(shown.iter().all(near), "{tone:?} {light} {shown:?}");
                assert!(
                    shown
                        .as_chunks::<3>()
                        .0
                        .iter()
                        .all(|[r, g, b]| r == g && g == b)
                );
            }
        }
    }

    #[test]
    fn what_a_code_stands_for_and_what_is_beyond_is_plain() {
        for tone in tones() {
            for code in 0..=255_u8 {
                let light = tone.light(srgb_decode(f64::from(code) / 255.0)) as f32;
                let image = Image::from_data(9, 9, vec![light; 243]).unwrap();
                assert!(tone.encode(&image).iter().all(|c| *c == code), "{code}");
            }
            for (light, code) in [(f32::NAN, 0), (-1.0, 0), (f32::INFINITY, 255), (1e30, 255)] {
                let image = Image::from_data(9, 1, vec![light; 27]).unwrap();
                assert!(tone.encode(&image).iter().all(|c| *c == code), "{light}");
            }
        }
    }
}
