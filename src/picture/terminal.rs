//! Images for terminals: half blocks in 24-bit colour, or Kitty's graphics protocol.
//!
//! Invariants: every line resets its colours at its end, so that cut or interleaved output leaves
//! the terminal clean; an image is only made smaller, by averages of light, never larger.

use std::fmt::Write;

use base64::prelude::{BASE64_STANDARD, Engine as _};

use super::shrink::resampled;
use super::{PictureError, png};

/// Space for an image in a terminal, in characters, which count as twice as high as wide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Characters per line.
    pub columns: usize,
    /// Lines.
    pub lines: usize,
}

impl Room {
    /// Half characters, wide and high, for an image: its own size if it fits.
    fn fit(self, width: usize, height: usize) -> [usize; 2] {
        let (columns, lines) = (self.columns as f64, 2.0 * self.lines as f64);
        let scale = (columns / width as f64).min(lines / height as f64).min(1.0);
        [width, height].map(|n| ((n as f64 * scale).round() as usize).max(1))
    }

    /// Number of lines of an image.
    fn lines_of(self, width: usize, height: usize) -> usize {
        if self.holds(width, height) {
            self.fit(width, height)[1].div_ceil(2)
        } else {
            0
        }
    }

    fn holds(self, width: usize, height: usize) -> bool {
        width * height * self.columns * self.lines > 0
    }
}

/// Draws interleaved sRGB bytes (`width` x `height`, rows from the top) as lines of half blocks. A
/// character is two pixels, one above the other. Missing bytes count as black; without pixels or
/// room the text is empty.
pub fn half_blocks(width: usize, height: usize, rgb: &[u8], room: Room) -> String {
    if !room.holds(width, height) {
        return String::new();
    }
    let [wide, high] = room.fit(width, height);
    let rgb = resampled((width, height), rgb, (wide, high));
    let (pixels, _) = rgb.as_chunks::<3>();
    let pixel = |x, y| pixels.get(y * wide + x).copied().unwrap_or_default();
    let mut text = String::new();
    for top in (0..high).step_by(2) {
        for x in 0..wide {
            let [r, g, b] = pixel(x, top);
            // Writing to a string cannot fail.
            let _ = write!(text, "\x1b[38;2;{r};{g};{b}m");
            if top + 1 < high {
                let [r, g, b] = pixel(x, top + 1);
                let _ = write!(text, "\x1b[48;2;{r};{g};{b}m");
            }
            text.push('\u{2580}');
        }
        text.push_str("\x1b[0m\n");
    }
    text
}

/// Most bytes of a chunk of Kitty's protocol.
const PIECE: usize = 4096;

/// The full-resolution image for terminals with Kitty's graphics protocol, as a PNG file over as
/// many characters as half blocks would take; the cursor goes to the line below it. An image with a
/// `number` replaces the previous one of that number.
/// (<https://sw.kovidgoyal.net/kitty/graphics-protocol>: `a=T` transmit and show, `f=100` PNG, `i`
/// and `p` its number, `C=1` leave the cursor, `q=2` answer nothing.)
///
/// # Errors
/// [`PictureError::Size`] when the bytes do not fit that size.
pub fn kitty(
    width: usize,
    height: usize,
    rgb: &[u8],
    room: Room,
    number: Option<u32>,
) -> Result<String, PictureError> {
    let text = BASE64_STANDARD.encode(png::encode(width, height, rgb)?);
    if !room.holds(width, height) {
        return Ok(String::new());
    }
    let ([wide, _], lines) = (room.fit(width, height), room.lines_of(width, height));
    let mut out = String::new();
    let number = number.map_or(String::new(), |n| format!("i={n},p={n},"));
    let mut control = format!("a=T,f=100,C=1,q=2,{number}c={wide},r={lines},");
    let mut rest = text.as_str();
    while !rest.is_empty() {
        let (piece, after) = rest.split_at(PIECE.min(rest.len()));
        let more = u8::from(!after.is_empty());
        let _ = write!(out, "\x1b_G{control}m={more};{piece}\x1b\\");
        control.clear();
        rest = after;
    }
    out.extend(std::iter::repeat_n('\n', lines));
    Ok(out)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    fn room(columns: usize, lines: usize) -> Room {
        Room { columns, lines }
    }

    /// The joined chunks are the PNG file.
    #[test]
    fn kittys_pieces_are_a_picture() {
        let rgb: Vec<u8> = (0..90 * 60 * 3)
            .map(|i: u32| ((i * i) >> 7) as u8)
            .collect();
        let text = kitty(90, 60, &rgb, room(30, 40), Some(7)).unwrap();
        let (pieces, lines) = text.rsplit_once("\x1b\\").unwrap();
        assert_eq!(lines, "\n".repeat(10));
        let pieces: Vec<&str> = pieces.split("\x1b\\").collect();
        assert!(pieces.len() > 2);
        let mut joined = String::new();
        for (i, piece) in pieces.iter().enumerate() {
            let (control, data) = piece
                .strip_prefix("\x1b_G")
                .unwrap()
                .split_once(';')
                .unwrap();
            assert!(data.len() <= 4096);
            assert_eq!(control.contains("i=7,p=7,c=30,r=10"), i == 0, "{control}");
            assert!(control.ends_with(if i + 1 == pieces.len() { "m=0" } else { "m=1" }));
            joined += data;
        }
        assert_eq!(
            joined,
            BASE64_STANDARD.encode(png::encode(90, 60, &rgb).unwrap())
        );
        assert!(kitty(2, 2, &rgb, room(9, 9), None).is_err());
    }

    #[test]
    fn two_rows_make_a_line_and_every_line_resets() {
        let rgb = [1, 2, 3, 4, 5, 6, 7, 8, 9];
        assert_eq!(
            half_blocks(1, 3, &rgb, room(80, 9)),
            "\x1b[38;2;1;2;3m\x1b[48;2;4;5;6m\u{2580}\x1b[0m\n\x1b[38;2;7;8;9m\u{2580}\x1b[0m\n"
        );
    }

    #[test]
    fn boxes_average_light_not_codes() {
        let rgb = [0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0];
        // Half the light of white has the code 188.
        assert_eq!(
            half_blocks(2, 2, &rgb, room(1, 9)),
            "\x1b[38;2;188;188;188m\u{2580}\x1b[0m\n"
        );
    }

    #[test]
    fn size_follows_the_columns_and_never_grows() {
        let rgb = vec![9; 100 * 50 * 3];
        for (columns, allowed, wide, lines) in [
            (40, 99, 40, 10),
            (100, 99, 100, 25),
            (500, 99, 100, 25),
            (1, 99, 1, 1),
            (500, 5, 20, 5),
            (40, 5, 20, 5),
        ] {
            let text = half_blocks(100, 50, &rgb, room(columns, allowed));
            assert_eq!(room(columns, allowed).lines_of(100, 50), lines);
            assert_eq!(text.lines().count(), lines);
            for line in text.lines() {
                assert_eq!(line.matches('\u{2580}').count(), wide);
                assert!(line.ends_with("\x1b[0m"));
            }
        }
        assert_eq!(half_blocks(0, 5, &[], room(10, 10)), "");
        assert_eq!(half_blocks(5, 5, &[], room(0, 10)), "");
        assert_eq!(half_blocks(2, 2, &[], room(9, 9)).lines().count(), 1);
    }
}
