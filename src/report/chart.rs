//! Charts: data drawn as PNG and SVG from one list of marks.
//!
//! A chart function ([`curves`], [`light_plot`], [`panels`], [`sheet`]) lays data out
//! as a [`Drawing`], a flat list of marks with absolute positions, which is then painted or written
//! as SVG. A layout never fails on numbers: NaN, infinities and values that an axis cannot show are
//! left out, empty data draw an empty chart that says so, long names are shortened, overlapping
//! labels are dropped. Equal data give equal bytes. Colours are display coded (sRGB).

mod axis;
mod colour;
mod curve_chart;
mod curves;
mod drawing;
mod false_colour;
mod font;
mod frame;
mod light_plot;
mod marker;
mod moves;
mod output;
mod paint;
mod panels;
mod sheet;
mod svg;
#[cfg(test)]
mod tests;
mod trace;

pub use axis::{Axis, Scale};
pub use colour::Theme;
pub use curve_chart::{CurveChart, CurveRow};
pub use curves::curves;
pub use drawing::Drawing;
pub use false_colour::{FalseColour, false_colour};
pub use light_plot::{LightPlot, PlottedLight, PlottedSurface, Symbol, light_plot};
pub use marker::Marker;
pub use panels::{Panel, Series, panels};
pub use sheet::{Sheet, Tile, sheet};

use footlight_picture::PictureError;

/// Reason why a chart could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ChartError {
    /// The drawing exceeds the pixel limit.
    #[error("a chart of {width} x {height} pixels is over the limit of {limit} pixels a side")]
    TooLarge {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Most pixels of a side.
        limit: usize,
    },
    /// An image's bytes do not fit its size.
    #[error("a picture of {width} x {height} needs {needed} bytes of RGB, it has {found}")]
    Picture {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// `width * height * 3`.
        needed: usize,
        /// Bytes given.
        found: usize,
    },
    /// The PNG encoder refused.
    #[error("could not encode the chart: {0}")]
    Encode(#[from] PictureError),
}
