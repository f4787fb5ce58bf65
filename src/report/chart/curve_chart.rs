//! Data of a chart of curves.

/// Levels over time, with marked moments.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveChart {
    /// Title; empty for none.
    pub title: String,
    /// Seconds at the left edge.
    pub start: f64,
    /// Seconds at the right edge.
    pub end: f64,
    /// Rows from the top down.
    pub rows: Vec<CurveRow>,
    /// Seconds and name of each line across the rows.
    pub cues: Vec<(f64, String)>,
    /// Seconds of the current moment.
    pub playhead: Option<f64>,
}

/// One curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveRow {
    /// Its label on the left.
    pub name: String,
    /// Words for level 0 and level 1, if the level is not a percentage.
    pub ends: Option<[String; 2]>,
    /// Display-coded; `None` uses the theme's colour. A colour too near the background is moved
    /// away from it.
    pub colour: Option<[u8; 3]>,
    /// Seconds and level 0 to 1, joined by straight lines; two points at one time are a jump; the
    /// first and last levels extend outwards. Levels beyond 0 and 1 are drawn at the strip's edge.
    pub points: Vec<(f64, f64)>,
    /// The curve before a change, drawn dashed; empty for none.
    pub before: Vec<(f64, f64)>,
    /// Start and end of each move in seconds, drawn as bars under the curve.
    pub moves: Vec<(f64, f64)>,
}
