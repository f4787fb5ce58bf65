//! Sampling positions that average a prefiltered image over a pixel's footprint.
//!
//! A footprint is a parallelogram in the image, its sides in texels. It is sampled in two rows
//! along its longer side, from a level as wide as half the shorter side: a single row from a level
//! as wide as the whole footprint would blur detail of that size. A footprint more than `MOST_TAPS`
//! times as long as wide is blurred across. This module knows no image.

/// Largest ratio of length to width that is sampled without blurring across.
const MOST_TAPS: usize = 16;
/// Rows of samples.
const ROWS: f64 = 2.0;
/// Least distance of samples along a footprint, texels.
const CLOSE: f64 = 0.5;
/// Width below which a footprint is sampled in one row, texels: the image hardly varies within it.
const NARROW: f64 = 0.25;

/// Sampling positions for a footprint.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// Width of a sample along both axes, texels.
    pub size: f64,
    long: f64,
    short: f64,
    along: [f64; 2],
    columns: usize,
    rows: usize,
}

impl Taps {
    /// Samples for the parallelogram of two sides, in texels.
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

    /// Number of samples.
    pub fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// Sample positions relative to the footprint's middle, texels.
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

/// Singular values of the matrix of two sides, and the direction of the longer axis.
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
