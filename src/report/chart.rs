//! Charts: what was measured or written, drawn as PNG and SVG from one list of marks.
//!
//! A chart function ([`curves`], [`grid()`], [`light_plot`], [`panels`], [`sheet`]) lays plain data out as a
//! [`Drawing`], a flat list of marks with absolute places, which is then painted or written as SVG.
//! A layout never fails on numbers: NaN, infinities and values that an axis cannot show are left
//! out, empty data draw an empty chart that says so, long names are shortened, labels that would
//! overlap are dropped. Same data, same bytes. Colours are display coded (sRGB).

mod axis;
mod colour;
mod curve_chart;
mod curves;
mod drawing;
mod font;
mod frame;
mod grid;
mod lane;
mod light_plot;
mod marker;
mod output;
mod paint;
mod panels;
mod rows;
mod sheet;
mod svg;
#[cfg(test)]
mod tests;
mod trace;

pub use axis::{Axis, Scale};
pub use colour::Theme;
pub use curve_chart::{CurveChart, CurveRow, Knot};
pub use curves::curves;
pub use drawing::Drawing;
pub use grid::{Grid, Stand, Tie, grid};
pub use light_plot::{LightPlot, PlottedLight, PlottedSurface, light_plot};
pub use marker::Marker;
pub use panels::{Panel, Series, panels};
pub use sheet::{Sheet, Tile, sheet};

use footlight_picture::PictureError;

/// Why a chart could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ChartError {
    /// The drawing has more pixels than this module paints.
    #[error("a chart of {width} x {height} pixels is over the limit of {limit} pixels a side")]
    TooLarge {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// The most pixels either side may have.
        limit: usize,
    },
    /// A picture's bytes do not fill its size.
    #[error("a picture of {width} x {height} needs {needed} bytes of RGB, it has {found}")]
    Picture {
        /// Pixels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// `width * height * 3`.
        needed: usize,
        /// What was given.
        found: usize,
    },
    /// The PNG encoder refused.
    #[error("could not encode the chart: {0}")]
    Encode(#[from] PictureError),
}
