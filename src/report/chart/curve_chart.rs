//! The data of a chart of curves.

/// Levels over time, with the moments that matter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveChart {
    /// Over everything; empty for none.
    pub title: String,
    /// Seconds at the left edge.
    pub start: f64,
    /// Seconds at the right edge.
    pub end: f64,
    /// From the top down.
    pub rows: Vec<CurveRow>,
    /// Seconds and name of each line across the rows.
    pub cues: Vec<(f64, String)>,
    /// Seconds of the present moment.
    pub playhead: Option<f64>,
    /// Knots in a lane under the rows; no lane without any.
    pub knots: Vec<Knot>,
}

/// Where the curves' pieces meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Knot {
    /// Seconds.
    pub time: f64,
    /// It was put in between: told apart by shape and colour.
    pub inserted: bool,
}

/// One curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveRow {
    /// Written on its left.
    pub name: String,
    /// Display-coded; the theme's own without. One too near the background is moved away from it.
    pub colour: Option<[u8; 3]>,
    /// Seconds and level 0 to 1, straight between them; two points at one time are a jump, the
    /// first and last levels hold outside. Levels beyond 0 and 1 are drawn at the strip's edge.
    pub points: Vec<(f64, f64)>,
    /// What the curve was before a change, drawn dashed; empty for none.
    pub before: Vec<(f64, f64)>,
    /// Seconds of the beginning and the end of each move, drawn as bars under the curve.
    pub moves: Vec<(f64, f64)>,
}
