//! Linear images, and the formats that carry them.
//!
//! ```text
//! EXR, PNG, JPEG, WebP --exr, decode--> Image --combine--> Image --tone--> bytes --png, jpeg, y4m--> file
//! ```
//!
//! - [`Image`] holds linear RGB in single precision.
//! - [`combine`] adds images with weights and finds scalar products; [`shrink`] averages an image
//!   down to fewer pixels.
//! - [`exr`] reads and writes linear images exactly, one or many in a file. [`decode`] reads the
//!   formats that hold 8 bits for each channel.
//! - [`sketch`] reads an image whose light is to be approached by levels.
//! - [`tone`] turns light into display bytes: exposure, tone curve, sRGB code. [`signed`] does so
//!   for images of either sign.
//! - [`png`], [`jpeg`], [`y4m`] and [`terminal`] write display bytes.
//!
//! Invariants:
//!
//! - An [`Image`] is interleaved, row 0 on top, and may hold negative values.
//! - Tone mapping makes new bytes and never changes an image.
//! - No count in a file is trusted for memory: every reader takes a limit in bytes and returns a
//!   [`PictureError`] beyond it.
//! - Sums do not depend on the number of threads.
//!
//! This crate does not know lights, shows or files: it takes bytes and returns bytes. It uses only
//! the units of `footlight-show`.

pub mod combine;
pub mod decode;
pub mod exr;
pub mod jpeg;
pub mod png;
pub mod shrink;
pub mod signed;
pub mod sketch;
pub mod terminal;
pub mod tone;
pub mod y4m;

/// Columns and rows of an image, and its codes as in the file, row by row from the top: red, green,
/// blue and alpha.
pub type Codes = ([usize; 2], Vec<[u8; 4]>);

/// Error of reading or writing an image.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The bytes are not a whole, well-formed file of the format.
    #[error("not a readable {format} file: {reason}")]
    Malformed {
        /// The format's name.
        format: &'static str,
        /// The reader's error.
        reason: String,
    },
    /// A well-formed file of an unsupported kind.
    #[error("cannot read this {format} file: {reason}")]
    Unsupported {
        /// The format's name.
        format: &'static str,
        /// The unsupported feature.
        reason: String,
    },
    /// The file has no such layer.
    #[error("{}", no_layer(wanted.as_deref(), layers))]
    Layer {
        /// The layer requested; `None` for the image outside all layers.
        wanted: Option<String>,
        /// The existing layers.
        layers: Vec<String>,
    },
    /// It would need more memory than allowed.
    #[error("a picture of {width} x {height} pixels needs {needed} bytes; the limit is {limit}")]
    Memory {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Bytes needed, all layers included.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// Some numbers are NaN or infinite.
    #[error(
        "{count} of the picture's numbers are NaN or infinite, the first at column {x}, row {y}"
    )]
    NotFinite {
        /// Their number.
        count: usize,
        /// Column of the first.
        x: usize,
        /// Row of the first.
        y: usize,
    },
    /// Some numbers are beyond what the precision holds.
    #[error(
        "{count} numbers are beyond {limit}, the most that 16 bits hold, the largest is {largest}: \
         write it in 32 bits"
    )]
    Range {
        /// Their number.
        count: usize,
        /// The largest magnitude that the precision holds.
        limit: f32,
        /// The largest magnitude in the image.
        largest: f32,
    },
    /// The file would be larger than allowed, even without optional parts.
    #[error("it needs about {needed} bytes; the limit is {limit}")]
    Bytes {
        /// Bytes needed, estimated.
        needed: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// A size or a buffer that does not fit: no pixels, too many, or the wrong number of bytes.
    #[error("{0}")]
    Size(String),
    /// An attribute that the format cannot hold.
    #[error("attribute `{name}`: {reason}")]
    Attribute {
        /// Its name.
        name: String,
        /// The fault.
        reason: &'static str,
    },
}

fn no_layer(wanted: Option<&str>, layers: &[String]) -> String {
    match (wanted, layers) {
        (Some(name), []) => format!("there is no layer `{name}`, nor any other"),
        (Some(name), _) => format!("there is no layer `{name}`"),
        (None, _) => "all its pictures are in layers".to_owned(),
    }
}

/// Checks that the memory needed is within the limit.
fn require_memory(size: (usize, usize), needed: u64, limit: u64) -> Result<(), PictureError> {
    if needed > limit {
        Err(PictureError::Memory {
            width: size.0,
            height: size.1,
            needed,
            limit,
        })
    } else {
        Ok(())
    }
}

/// A linear RGB image, `width` x `height`, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

impl Image {
    /// A black image.
    pub fn new(width: usize, height: usize) -> Image {
        Image {
            width,
            height,
            data: vec![0.0; width * height * 3],
        }
    }

    /// An image from interleaved channels; `None` unless `data` holds `width * height * 3` numbers.
    pub fn from_data(width: usize, height: usize, data: Vec<f32>) -> Option<Image> {
        (data.len() == width * height * 3).then_some(Image {
            width,
            height,
            data,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
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

    /// Mutable channels.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// Every `step`-th column and row, the first one half a step inside.
    pub fn every(&self, step: usize) -> Image {
        let step = step.max(1);
        let first = |length: usize| (step / 2).min(length.saturating_sub(1));
        let columns = || (first(self.width)..self.width).step_by(step);
        let rows = (first(self.height)..self.height).step_by(step);
        let (width, height) = (columns().len(), rows.len());
        let pixels = rows.flat_map(|y| columns().filter_map(move |x| self.pixel(x, y)));
        Image {
            width,
            height,
            data: pixels.flatten().collect(),
        }
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
