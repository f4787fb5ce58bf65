//! Linear float pictures, and the formats that carry them.
//!
//! Invariants: an [`Image`] is linear RGB, f32, row 0 on top, interleaved, and may hold negative
//! values. Tone mapping makes display-coded bytes of it and is never applied in place. This room
//! knows nothing of lights or shows.

/// A linear RGB picture, `width` x `height`, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

impl Image {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Image {
        Image {
            width,
            height,
            data: vec![0.0; width * height * 3],
        }
    }

    /// From interleaved channels; `None` unless `data` holds `width * height * 3` numbers.
    pub fn from_data(width: usize, height: usize, data: Vec<f32>) -> Option<Image> {
        (data.len() == width * height * 3).then_some(Image {
            width,
            height,
            data,
        })
    }

    /// Pixels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// All channels, interleaved RGB, row by row from the top.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// The same, writable.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// The pixel in column `x` of row `y`; `None` outside.
    pub fn pixel(&self, x: usize, y: usize) -> Option<[f32; 3]> {
        if x >= self.width || y >= self.height {
            return None;
        }
        let at = (y * self.width + x) * 3;
        self.data.get(at..at + 3)?.try_into().ok()
    }
}
