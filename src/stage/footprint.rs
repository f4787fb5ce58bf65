//! Where a prefiltered image is read to average it over a pixel's footprint.
//!
//! A footprint is a parallelogram in the image, its sides in texels. It is read at places in two rows along
//! its longer side, each from a level as wide as half the shorter side: one row of a level as wide as the
//! whole footprint, read bilinearly and between two levels, would blur what is as fine as it. What is
//! more than `MOST_TAPS` times as long as wide is blurred across. This module knows no image.

/// A footprint more than so many times as long as wide is blurred across its shorter side.
const MOST_TAPS: usize = 16;
/// Rows of places.
const ROWS: f64 = 2.0;
/// Least distance of places along a footprint, in texels.
const CLOSE: f64 = 0.5;
/// A footprint narrower than this, in texels, is read in one row: the image hardly bends within it.
const NARROW: f64 = 0.25;

/// Where an image is read for a footprint.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// Texels that each place stands for, along both axes.
    pub size: f64,
    long: f64,
    short: f64,
    along: [f64; 2],
    columns: usize,
    rows: usize,
}

impl Taps {
    /// Over the parallelogram of two sides, in texels.
    pub fn new(sides: [[f64; 2]; 2]) -> Taps {
        let (long, short, along) = axes_of(sides);
        let width = short / ROWS;
        let most = ROWS * MOST_TAPS as f64;
        let columns = (long / width.max(CLOSE)).ceil().clamp(1.0, most);
        Taps {
            size: width.max(long / columns),
            long,
            short,
            along,
            columns: columns as usize,
            rows: if short > NARROW { ROWS as usize } else { 1 },
        }
    }

    /// How many places.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// The places from the footprint's middle, in texels.
    pub fn offsets(&self) -> impl Iterator<Item = [f64; 2]> {
        let [x, y] = self.along;
        let part = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
        (0..self.columns).flat_map(move |i| {
            let t = part(i, self.columns) * self.long;
            (0..self.rows).map(move |j| {
                let s = part(j, self.rows) * self.short;
                [t * x - s * y, t * y + s * x]
            })
        })
    }
}

/// Singular values of the matrix of two sides, and the direction of the longer.
fn axes_of([p, q]: [[f64; 2]; 2]) -> (f64, f64, [f64; 2]) {
    let (xx, xy, yy) = (
        p[0] * p[0] + q[0] * q[0],
        p[0] * p[1] + q[0] * q[1],
        p[1] * p[1] + q[1] * q[1],
    );
    let middle = 0.5 * (xx + yy);
    let spread = (0.5 * (xx - yy)).hypot(xy);
    let angle = 0.5 * xy.atan2(0.5 * (xx - yy));
    let long = (middle + spread).sqrt();
    let short = (middle - spread).max(0.0).sqrt();
    (long, short, [angle.cos(), angle.sin()])
}
