//! Pictures for terminals: half blocks in 24-bit colour.
//!
//! Invariants: every line resets its colours at its end, so that a cut or interleaved print leaves
//! the terminal clean; a picture is made smaller, by averages of light over boxes, never larger.

use std::fmt::Write;

use super::tone::{srgb_decode, srgb_encode};

/// Interleaved sRGB bytes (`width` x `height`, rows from the top) as lines of half blocks, at most
/// `columns` characters wide. A character is two pixels, one above the other. Missing bytes count
/// as black; no pixels or no columns make an empty text.
pub fn half_blocks(width: usize, height: usize, rgb: &[u8], columns: usize) -> String {
    let wide = width.min(columns);
    if wide == 0 || height == 0 {
        return String::new();
    }
    let high = ((height as f64 * wide as f64 / width as f64).round() as usize).clamp(1, height);
    let boxes = Boxes::new([width, height], [wide, high], rgb);
    let mut text = String::new();
    for top in (0..high).step_by(2) {
        for x in 0..wide {
            let [r, g, b] = boxes.mean(x, top);
            // Writing to a string cannot fail.
            let _ = write!(text, "\x1b[38;2;{r};{g};{b}m");
            if top + 1 < high {
                let [r, g, b] = boxes.mean(x, top + 1);
                let _ = write!(text, "\x1b[48;2;{r};{g};{b}m");
            }
            text.push('\u{2580}');
        }
        text.push_str("\x1b[0m\n");
    }
    text
}

/// A picture seen as a grid of boxes of whole pixels.
struct Boxes<'p> {
    from: [usize; 2],
    to: [usize; 2],
    rgb: &'p [u8],
    linear: [f64; 256],
}

impl<'p> Boxes<'p> {
    fn new(from: [usize; 2], to: [usize; 2], rgb: &'p [u8]) -> Boxes<'p> {
        let linear = std::array::from_fn(|code| srgb_decode(code as f64 / 255.0));
        Boxes {
            from,
            to,
            rgb,
            linear,
        }
    }

    /// The mean light of a box, coded.
    fn mean(&self, x: usize, y: usize) -> [u8; 3] {
        let ([width, height], [wide, high]) = (self.from, self.to);
        let range = |at: usize, from: usize, to: usize| at * from / to..(at + 1) * from / to;
        let mut sum = [0.0; 3];
        let mut count = 0.0_f64;
        for row in range(y, height, high) {
            for column in range(x, width, wide) {
                let at = (row * width + column) * 3;
                for (sum, code) in sum.iter_mut().zip(self.rgb.iter().skip(at)) {
                    *sum += self
                        .linear
                        .get(usize::from(*code))
                        .copied()
                        .unwrap_or_default();
                }
                count += 1.0;
            }
        }
        sum.map(|s: f64| (srgb_encode(s / count.max(1.0)) * 255.0).round() as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rows_make_a_line_and_every_line_resets() {
        let rgb = [1, 2, 3, 4, 5, 6, 7, 8, 9];
        assert_eq!(
            half_blocks(1, 3, &rgb, 80),
            "\x1b[38;2;1;2;3m\x1b[48;2;4;5;6m\u{2580}\x1b[0m\n\x1b[38;2;7;8;9m\u{2580}\x1b[0m\n"
        );
    }

    #[test]
    fn boxes_average_light_not_codes() {
        let rgb = [0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0];
        // Half the light of white is code 188.
        assert_eq!(
            half_blocks(2, 2, &rgb, 1),
            "\x1b[38;2;188;188;188m\u{2580}\x1b[0m\n"
        );
    }

    #[test]
    fn size_follows_the_columns_and_never_grows() {
        let rgb = vec![9; 100 * 50 * 3];
        for (columns, wide, lines) in [(40, 40, 10), (100, 100, 25), (500, 100, 25), (1, 1, 1)] {
            let text = half_blocks(100, 50, &rgb, columns);
            assert_eq!(text.lines().count(), lines);
            for line in text.lines() {
                assert_eq!(line.matches('\u{2580}').count(), wide);
                assert!(line.ends_with("\x1b[0m"));
            }
        }
        assert_eq!(half_blocks(0, 5, &[], 10), "");
        assert_eq!(half_blocks(5, 5, &[], 0), "");
        assert_eq!(half_blocks(2, 2, &[], 9).lines().count(), 1);
    }
}
