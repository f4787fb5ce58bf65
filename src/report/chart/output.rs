//! Output of a drawing: pixels, PNG, SVG.

use super::drawing::Drawing;
use super::{ChartError, paint, svg};
use footlight_picture::png;

impl Drawing {
    /// Columns, rows, and the painted pixels: RGB8, row 0 on top.
    ///
    /// # Errors
    /// [`ChartError::TooLarge`] over the module's limit.
    pub fn rgb8(&self) -> Result<(usize, usize, Vec<u8>), ChartError> {
        paint::rgb8(self)
    }

    /// The painted pixels as a PNG file.
    ///
    /// # Errors
    /// [`ChartError::TooLarge`] over the module's limit, [`ChartError::Encode`] from the encoder.
    pub fn png(&self) -> Result<Vec<u8>, ChartError> {
        let (width, height, rgb) = self.rgb8()?;
        Ok(png::encode(width, height, &rgb)?)
    }

    /// The drawing as an SVG document, with text as text.
    pub fn svg(&self) -> String {
        svg::document(self)
    }
}
