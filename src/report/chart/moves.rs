//! Additions to a chart of curves: bars of moves, and the legend.

use super::axis::Ruler;
use super::colour::Palette;
use super::curve_chart::CurveChart;
use super::drawing::{Drawing, Label, Stroke, crisp};
use super::font;
use super::frame::Frame;

/// Font size of all text but names.
pub(super) const SMALL: f32 = 11.0;
/// Gap under a strip for the bars of moves.
pub(super) const BAR: f32 = 7.0;
const MOVE: &str = "a part's move";

/// Height of the legend under the times.
pub(super) fn legend_height(data: &CurveChart) -> f32 {
    if has_legend(data) { 20.0 } else { 0.0 }
}

fn has_legend(data: &CurveChart) -> bool {
    data.rows.iter().any(|row| !row.moves.is_empty())
}

/// Draws a bar for each move, in the gap under a strip.
pub(super) fn bars(
    drawing: &mut Drawing,
    moves: &[(f64, f64)],
    strip: Frame,
    ruler: &Ruler,
    palette: &Palette,
) {
    let y = strip.bottom() + 1.0;
    let mut before = None;
    for (begin, end) in moves {
        let (Some(from), Some(to)) = (ruler.place(*begin), ruler.place(*end)) else {
            continue;
        };
        let clamp = |x: f32| x.clamp(strip.x, strip.right());
        let ends = (clamp(from), clamp(to));
        // Moves on equal pixels become one bar.
        let pixels = Some((ends.0.floor(), ends.1.floor()));
        if pixels != before {
            bar(drawing, ends, y, palette);
        }
        before = pixels;
    }
}

fn bar(drawing: &mut Drawing, (from, to): (f32, f32), y: f32, palette: &Palette) {
    let colour = palette.quiet;
    let width = (to - from).max(1.0);
    drawing.rectangle(Frame::new(from, y + 1.5, width, 1.5), colour.faded(0.75));
    for x in [from, to].map(crisp) {
        drawing.line((x, y), (x, y + 4.5), Stroke::solid(colour, 1.0));
    }
}

/// Explains the signs under the times. The playhead explains itself; it is named only in a legend
/// with other signs.
pub(super) fn legend(drawing: &mut Drawing, data: &CurveChart, field: Frame, palette: &Palette) {
    if !has_legend(data) {
        return;
    }
    let y = field.bottom() + 35.0;
    bar(drawing, (field.x, field.x + 20.0), y - 2.0, palette);
    let mut name = |words, x| {
        drawing.text(Label::new(words, (x + 26.0, y), SMALL, palette.quiet).centred());
    };
    name(MOVE, field.x);
    if data.playhead.is_some() {
        let x = field.x + 26.0 + font::width(MOVE, SMALL) + 20.0;
        name("now", x);
        let stroke = Stroke::solid(palette.playhead, 1.5);
        drawing.line((x + 10.0, y - 6.0), (x + 10.0, y + 6.0), stroke);
    }
}
