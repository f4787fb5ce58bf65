//! Smaller images, by averages of light.

use super::Image;
use footlight_show::units::{srgb_decode, srgb_encode};

/// Shrinks `image` to `width` x `height` pixels, at most its size: each is the mean of the light on
/// its area, with pixels cut by its edges counted in part. The mean of the whole image stays.
pub fn shrink(image: &Image, width: usize, height: usize) -> Image {
    let (wide, high) = image.size();
    let (width, height) = (width.clamp(1, wide.max(1)), height.clamp(1, high.max(1)));
    let columns = overlaps(wide, width);
    let mut out = Image::new(width, height);
    let rows = out.data_mut().chunks_exact_mut(3 * width);
    for (row, parts) in rows.zip(overlaps(high, height)) {
        for (y, share) in parts {
            let start = 3 * wide * y;
            let from = image.data().get(start..start + 3 * wide);
            add_row(row, from.unwrap_or_default(), &columns, share as f32);
        }
    }
    out
}

/// Adds a row of the larger image, weighted by `share`, to one of the smaller.
fn add_row(row: &mut [f32], from: &[f32], columns: &[Vec<(usize, f64)>], share: f32) {
    let (pixels, _) = from.as_chunks::<3>();
    for (to, parts) in row.chunks_exact_mut(3).zip(columns) {
        for (x, part) in parts {
            let weight = share * *part as f32;
            let pixel = pixels.get(*x).copied().unwrap_or_default();
            for (to, from) in to.iter_mut().zip(pixel) {
                *to += weight * from;
            }
        }
    }
}

/// Resamples interleaved sRGB bytes to `to` columns and rows, each pixel the mean of its area in
/// linear light. Enlargement by whole numbers repeats pixels. Missing bytes count as black.
pub fn resampled(from: (usize, usize), rgb: &[u8], to: (usize, usize)) -> Vec<u8> {
    let table: [f32; 256] = std::array::from_fn(|code| srgb_decode(code as f64 / 255.0) as f32);
    let columns = overlaps(from.0, to.0);
    let mut bytes = Vec::with_capacity(to.0 * to.1 * 3);
    for span in overlaps(from.1, to.1) {
        let mut row = vec![[0.0_f32; 3]; from.0];
        for (y, share) in span {
            let source = rgb.get(from.0 * y * 3..).unwrap_or_default();
            for (sum, code) in row.as_flattened_mut().iter_mut().zip(source) {
                *sum += share as f32 * table.get(usize::from(*code)).copied().unwrap_or_default();
            }
        }
        for span in &columns {
            let mut mean = [0.0_f32; 3];
            add_row(
                &mut mean,
                row.as_flattened(),
                std::slice::from_ref(span),
                1.0,
            );
            let coded = |v: f32| (255.0 * srgb_encode(f64::from(v.clamp(0.0, 1.0)))).round() as u8;
            bytes.extend(mean.map(coded));
        }
    }
    bytes
}

/// For each of `to` equal parts of `from` pixels: the pixels in it and their shares, which add up
/// to one. Shares caused by rounding are dropped.
pub fn overlaps(from: usize, to: usize) -> Vec<Vec<(usize, f64)>> {
    let size = from as f64 / to as f64;
    let part = |i: usize| {
        let (start, end) = (i as f64 * size, (i + 1) as f64 * size);
        let pixels = start.floor() as usize..(end.ceil() as usize).min(from);
        let share = |p: usize| (end.min(p as f64 + 1.0) - start.max(p as f64)) / size;
        pixels
            .map(|p| (p, share(p)))
            .filter(|(_, s)| *s > 1e-12)
            .collect()
    };
    (0..to).map(part).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use proptest::prelude::*;

    #[test]
    fn shares_of_every_part_sum_to_one_and_stay_inside() {
        for (from, to) in [(7, 3), (3, 7), (640, 233), (1, 5), (5, 1), (4, 8)] {
            for part in overlaps(from, to) {
                let sum: f64 = part.iter().map(|(_, share)| share).sum();
                assert!((sum - 1.0).abs() < 1e-5);
                assert!(part.iter().all(|&(pixel, _)| pixel < from));
            }
        }
    }

    #[test]
    fn halves_are_means_and_parts_count_in_part() {
        let grey = |values: &[f32], w, h| {
            let data = values.iter().flat_map(|v| [*v, 0.0, -v]).collect();
            Image::from_data(w, h, data).unwrap()
        };
        let four = grey(&[1.0, 3.0, 5.0, 7.0], 2, 2);
        assert_eq!(shrink(&four, 1, 1), grey(&[4.0], 1, 1));
        assert_eq!(shrink(&four, 1, 2), grey(&[2.0, 6.0], 1, 2));
        let three = grey(&[0.0, 3.0, 9.0], 3, 1);
        assert_eq!(shrink(&three, 2, 1), grey(&[1.0, 7.0], 2, 1));
        assert_eq!(shrink(&four, 2, 2), four);
    }

    #[test]
    fn coded_pixels_are_means_of_light_and_repeat_when_doubled() {
        // Half the light of white has the code 188, not 128.
        let (size, pair) = ((2, 1), [0, 0, 0, 255, 255, 255]);
        assert_eq!(resampled(size, &pair, (1, 1)), [188, 188, 188]);
        let row = [10, 20, 30, 10, 20, 30, 200, 100, 50, 200, 100, 50];
        let twice = resampled(size, &[10, 20, 30, 200, 100, 50], (4, 2));
        assert_eq!(twice, [row, row].concat());
    }

    proptest! {
        #[test]
        fn the_mean_stays(
            (wide, high, width, height) in (1_usize..20, 1_usize..20).prop_flat_map(|(w, h)| {
                (Just(w), Just(h), 1..=w, 1..=h)
            }),
            seed in any::<u32>(),
        ) {
            let value = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) ^ seed) as f32 / 4e9;
            let data: Vec<f32> = (0..wide * high * 3).map(value).collect();
            let image = Image::from_data(wide, high, data).unwrap();
            let small = shrink(&image, width, height);
            prop_assert_eq!(small.size(), (width, height));
            let mean = |image: &Image| {
                let sum: f64 = image.data().iter().map(|v| f64::from(*v)).sum();
                sum / image.data().len() as f64
            };
            prop_assert!((mean(&small) - mean(&image)).abs() < 1e-5 * mean(&image));
        }
    }
}
