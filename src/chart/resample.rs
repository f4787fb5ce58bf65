#![allow(
    clippy::indexing_slicing,
    reason = "every index comes from a span cut to the picture's size, which `Picture` proves"
)]
//! Pictures to the size they are shown at: each pixel is the mean, in linear light, of the area
//! it covers. Enlarged by whole numbers this repeats pixels, so a small preview stays honest.

use super::colour::{coded, linear};
use super::drawing::Picture;
use crate::picture::shrink::overlaps;

/// `picture` as RGB8 of `width` x `height`.
pub(super) fn resampled(picture: &Picture, width: usize, height: usize) -> Vec<u8> {
    let (source_width, source_height) = picture.size();
    if (source_width, source_height) == (width, height) || width == 0 || height == 0 {
        return picture.rgb().to_vec();
    }
    let table: [f32; 256] = std::array::from_fn(|code| linear(code as u8));
    let columns = overlaps(source_width, width);
    let mut bytes = Vec::with_capacity(width * height * 3);
    let mut row = vec![0.0_f32; source_width * 3];
    for span in overlaps(source_height, height) {
        row.fill(0.0);
        for (index, weight) in span {
            let source = &picture.rgb()[index * source_width * 3..][..source_width * 3];
            for (sum, &code) in row.iter_mut().zip(source) {
                *sum += weight as f32 * table[usize::from(code)];
            }
        }
        for span in &columns {
            for channel in 0..3 {
                let mean = span
                    .iter()
                    .map(|&(index, weight)| weight as f32 * row[index * 3 + channel])
                    .sum();
                bytes.push(coded(mean));
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_taken_in_linear_light() {
        let picture = Picture::new(2, 1, vec![0, 0, 0, 255, 255, 255]).unwrap();
        // Half the light of white is the code 188, not 128.
        assert_eq!(resampled(&picture, 1, 1), [188, 188, 188]);
    }

    #[test]
    fn doubling_repeats_pixels() {
        let picture = Picture::new(2, 1, vec![10, 20, 30, 200, 100, 50]).unwrap();
        let twice = resampled(&picture, 4, 2);
        let row = [10, 20, 30, 10, 20, 30, 200, 100, 50, 200, 100, 50];
        assert_eq!(twice, [row, row].concat());
    }
}
