//! YUV4MPEG2: uncompressed video that every encoder reads from a pipe.
//!
//! Invariants: the input is display codes; luma and chroma follow ITU-R BT.709 (Kr = 0.2126, Kb =
//! 0.0722) in the limited range of 8 bits, 16 to 235 and 16 to 240. The format names the range but
//! cannot name the matrix, so the encoder needs the option `bt709`. A frame has equal bytes on
//! every machine: ties always round half up.

use super::PictureError;
use super::png::require_size;

/// Number of pixels that share a colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chroma {
    /// Four (4:2:0), the colour in the middle of its square; players everywhere decode it.
    #[default]
    Quarter,
    /// One (4:4:4), without loss of colour.
    Full,
}

/// A film's size, rate and kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Frames per second, in thousandths.
    pub rate: f64,
    /// Sampling of colour.
    pub chroma: Chroma,
}

/// Shares of red, green and blue in luma (BT.709).
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Range and offset of luma, of codes 0 to 255.
const LUMA_RANGE: (f32, f32) = (219.0 / 255.0, 16.0);
/// Range of chroma (of differences -1/2 to 1/2) and its middle.
const CHROMA_RANGE: (f32, f32) = (224.0 / 255.0, 128.0);

impl Film {
    /// The first line of the file.
    pub fn header(&self) -> String {
        let (rate, unit) = reduced((self.rate * 1000.0).round().max(1.0) as u64, 1000);
        let chroma = match self.chroma {
            // The sample positions are those of JPEG, but the range is limited, as the last word
            // says.
            Chroma::Quarter => "420jpeg",
            Chroma::Full => "444",
        };
        let (width, height) = (self.width, self.height);
        format!(
            "YUV4MPEG2 W{width} H{height} F{rate}:{unit} Ip A1:1 C{chroma} XCOLORRANGE=LIMITED\n"
        )
    }

    /// Bytes of a frame, including its header line.
    fn frame_bytes(&self) -> usize {
        let (wide, high) = self.chroma_size();
        MARK.len() + self.width * self.height + 2 * wide * high
    }

    /// Appends a frame from interleaved sRGB bytes, rows from the top.
    ///
    /// # Errors
    /// [`PictureError::Size`] when the bytes do not fit the film's size.
    pub fn push(&self, rgb: &[u8], out: &mut Vec<u8>) -> Result<(), PictureError> {
        require_size(self.width, self.height, rgb)?;
        out.reserve(self.frame_bytes());
        out.extend_from_slice(MARK);
        let (pixels, _) = rgb.as_chunks::<3>();
        out.extend(pixels.iter().map(|p| luma(p.map(f32::from))));
        match self.chroma {
            Chroma::Full => {
                for plane in PLANES {
                    out.extend(pixels.iter().map(|p| plane(p.map(f32::from))));
                }
            }
            Chroma::Quarter => {
                let means = self.quarters(pixels);
                for plane in PLANES {
                    out.extend(means.iter().map(|p| plane(*p)));
                }
            }
        }
        Ok(())
    }

    fn chroma_size(&self) -> (usize, usize) {
        match self.chroma {
            Chroma::Full => (self.width, self.height),
            Chroma::Quarter => (self.width.div_ceil(2), self.height.div_ceil(2)),
        }
    }

    /// Mean codes of every two by two pixels, fewer at an odd edge. (Chroma is linear in the codes,
    /// so the mean of the chroma is the chroma of the mean.)
    fn quarters(&self, pixels: &[[u8; 3]]) -> Vec<[f32; 3]> {
        let mut means = Vec::with_capacity(self.chroma_size().0 * self.chroma_size().1);
        for rows in pixels.chunks(2 * self.width) {
            let (top, bottom) = rows.split_at(self.width.min(rows.len()));
            let mut bottom = bottom.chunks(2);
            for pair in top.chunks(2) {
                let square = pair.iter().chain(bottom.next().unwrap_or_default());
                let (mut sum, mut count) = ([0.0_f32; 3], 0.0_f32);
                for pixel in square {
                    for (sum, code) in sum.iter_mut().zip(pixel) {
                        *sum += f32::from(*code);
                    }
                    count += 1.0;
                }
                means.push(sum.map(|s| s / count));
            }
        }
        means
    }
}

/// Header of a frame.
const MARK: &[u8] = b"FRAME\n";

/// Cb and Cr, in the order of the planes.
const PLANES: [fn([f32; 3]) -> u8; 2] = [
    |rgb| chroma(rgb, rgb[2], LUMA[2]),
    |rgb| chroma(rgb, rgb[0], LUMA[0]),
];

fn weighted([r, g, b]: [f32; 3]) -> f32 {
    LUMA[0] * r + LUMA[1] * g + LUMA[2] * b
}

fn luma(rgb: [f32; 3]) -> u8 {
    (LUMA_RANGE.1 + LUMA_RANGE.0 * weighted(rgb) + 0.5) as u8
}

/// (channel - luma) / 2 (1 - share), between -1/2 and 1/2 of the codes' range.
fn chroma(rgb: [f32; 3], channel: f32, share: f32) -> u8 {
    let difference = (channel - weighted(rgb)) / (2.0 * (1.0 - share));
    (CHROMA_RANGE.1 + CHROMA_RANGE.0 * difference + 0.5) as u8
}

fn reduced(a: u64, b: u64) -> (u64, u64) {
    let (mut x, mut y) = (a, b);
    while y > 0 {
        (x, y) = (y, x % y);
    }
    (a / x.max(1), b / x.max(1))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use proptest::prelude::*;

    fn film(width: usize, height: usize, chroma: Chroma) -> Film {
        Film {
            width,
            height,
            rate: 25.0,
            chroma,
        }
    }

    /// Decodes a frame's planes to codes, by the inverse of the standard's matrix in double
    /// precision; colours repeat over their pixels.
    fn decode(film: &Film, frame: &[u8]) -> Vec<[f64; 3]> {
        let planes = frame.strip_prefix(MARK).unwrap();
        let (wide, high) = film.chroma_size();
        let (luma, rest) = planes.split_at(film.width * film.height);
        let (blue, red) = rest.split_at(wide * high);
        assert_eq!(red.len(), wide * high);
        let step = if film.chroma == Chroma::Full { 1 } else { 2 };
        let mut out = Vec::new();
        for y in 0..film.height {
            for x in 0..film.width {
                let at = y / step * wide + x / step;
                let l = (f64::from(luma[y * film.width + x]) - 16.0) / 219.0;
                let b = (f64::from(blue[at]) - 128.0) / 224.0;
                let r = (f64::from(red[at]) - 128.0) / 224.0;
                let (r, b) = (l + 1.5748 * r, l + 1.8556 * b);
                let g = (l - 0.2126 * r - 0.0722 * b) / 0.7152;
                out.push([r, g, b].map(|v| 255.0 * v));
            }
        }
        out
    }

    #[test]
    fn the_header_says_size_rate_and_kind() {
        let header = |rate, chroma| {
            let film = Film {
                rate,
                ..film(640, 360, chroma)
            };
            film.header()
        };
        assert_eq!(
            header(25.0, Chroma::Quarter),
            "YUV4MPEG2 W640 H360 F25:1 Ip A1:1 C420jpeg XCOLORRANGE=LIMITED\n"
        );
        assert!(header(29.97, Chroma::Full).contains(" F2997:100 Ip A1:1 C444 "));
        assert!(header(0.5, Chroma::Full).contains(" F1:2 "));
    }

    #[test]
    fn the_standards_colours_have_the_standards_codes() {
        // BT.709, limited range: black, white, red, green, blue.
        let colours = [
            [0, 0, 0],
            [255, 255, 255],
            [255, 0, 0],
            [0, 255, 0],
            [0, 0, 255],
        ];
        let codes = [
            [16, 128, 128],
            [235, 128, 128],
            [63, 102, 240],
            [173, 42, 26],
            [32, 240, 118],
        ];
        for (colour, code) in colours.iter().zip(codes) {
            let mut frame = Vec::new();
            film(1, 1, Chroma::Full).push(colour, &mut frame).unwrap();
            assert_eq!(frame[MARK.len()..], code, "{colour:?}");
        }
    }

    #[test]
    fn frames_of_another_size_are_refused() {
        assert!(
            film(2, 2, Chroma::Full)
                .push(&[0; 11], &mut Vec::new())
                .is_err()
        );
    }

    proptest! {
        /// Half a step of luma is 0.58 codes, half a step of chroma 1.06 of blue; together less
        /// than 2.
        #[test]
        fn full_chroma_comes_back_to_its_rounding(
            rgb in prop::collection::vec(any::<u8>(), 3 * 7 * 5),
        ) {
            let film = film(7, 5, Chroma::Full);
            let mut frame = Vec::new();
            film.push(&rgb, &mut frame).unwrap();
            prop_assert_eq!(frame.len(), film.frame_bytes());
            for (back, code) in decode(&film, &frame).iter().flatten().zip(&rgb) {
                prop_assert!((back - f64::from(*code)).abs() < 1.7, "{} {}", back, code);
            }
        }

        /// When two by two pixels share a colour only rounding is lost, also at odd edges.
        #[test]
        fn quarter_chroma_keeps_squares_of_one_colour(
            colours in prop::collection::vec(any::<[u8; 3]>(), 4 * 3),
        ) {
            let film = film(7, 5, Chroma::Quarter);
            let rgb: Vec<u8> = (0..5 * 7)
                .flat_map(|at| colours[at / 7 / 2 * 4 + at % 7 / 2])
                .collect();
            let mut frame = Vec::new();
            film.push(&rgb, &mut frame).unwrap();
            prop_assert_eq!(frame.len(), film.frame_bytes());
            for (back, code) in decode(&film, &frame).iter().flatten().zip(&rgb) {
                prop_assert!((back - f64::from(*code)).abs() < 1.7, "{} {}", back, code);
            }
        }

        /// Grey has no chroma, whatever its neighbours.
        #[test]
        fn quarter_chroma_is_the_mean(greys in prop::collection::vec(any::<u8>(), 12)) {
            let film = film(4, 3, Chroma::Quarter);
            let rgb: Vec<u8> = greys.iter().flat_map(|g| [*g; 3]).collect();
            let mut frame = Vec::new();
            film.push(&rgb, &mut frame).unwrap();
            prop_assert!(frame[MARK.len() + 12..].iter().all(|c| *c == 128));
        }
    }
}
