//! Additions to a chart of curves: bars of moves, the lane of knots, and the legend.

use super::axis::Ruler;
use super::colour::{Colour, Palette};
use super::curve_chart::{ChartKnot, CurveChart};
use super::drawing::{Anchor, Drawing, Label, MARGIN, Stroke, crisp};
use super::font;
use super::frame::{Frame, Point};
use super::rows::{SMALL, WIDTH};

/// Gap under a strip for the bars of moves.
pub(super) const BAR: f32 = 7.0;
/// Height of the lane of knots.
const LANE: f32 = 14.0;
const GAP: f32 = 9.0;
const NAME: &str = "knots";

/// Height that the knots add to the field.
pub(super) fn height(data: &CurveChart) -> f32 {
    if data.knots.is_empty() {
        0.0
    } else {
        GAP + LANE
    }
}

/// Width of the lane's name.
pub(super) fn name_width(data: &CurveChart) -> f32 {
    if data.knots.is_empty() {
        0.0
    } else {
        font::width(NAME, SMALL)
    }
}

/// Height of the legend under the times.
pub(super) fn legend_height(data: &CurveChart) -> f32 {
    if entries(data).is_empty() { 0.0 } else { 20.0 }
}

/// Draws a bar for each move, in the gap under a strip.
pub(super) fn moves(
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

/// Draws the lane at the bottom of the field.
pub(super) fn knots(
    drawing: &mut Drawing,
    knots: &[ChartKnot],
    field: Frame,
    ruler: &Ruler,
    palette: &Palette,
) {
    if knots.is_empty() {
        return;
    }
    let lane = Frame::new(field.x, field.bottom() - LANE, field.width, LANE);
    drawing.rectangle(lane, palette.field);
    let middle = lane.y + LANE / 2.0;
    let label = Label::new(NAME, (lane.x - 10.0, middle), SMALL, palette.quiet);
    drawing.text(label.anchored(Anchor::End).centred());
    // Inserted knots are drawn over the others.
    let ordered = [false, true].map(|i| knots.iter().filter(move |k| k.inserted == i));
    let mut before = None;
    for knot in ordered.into_iter().flatten() {
        let Some(x) = ruler.place(knot.time) else {
            continue;
        };
        let pixel = Some((x.floor(), knot.inserted));
        if lane.spans(x) && pixel != before {
            let at = (x.min(lane.right() - 1.0), middle);
            sign(drawing, at, knot.inserted, palette);
        }
        before = pixel;
    }
}

/// Draws an upright line, or a diamond for an inserted knot.
fn sign(drawing: &mut Drawing, (x, y): Point, inserted: bool, palette: &Palette) {
    if inserted {
        return diamond(drawing, (x, y), palette.hue(1));
    }
    let stroke = Stroke::solid(palette.quiet, 1.0);
    drawing.line((crisp(x), y - 5.0), (crisp(x), y + 5.0), stroke);
}

/// A small square on its corner.
pub(super) fn diamond(drawing: &mut Drawing, (x, y): Point, colour: Colour) {
    let corners = [(x, y - 5.0), (x + 4.0, y), (x, y + 5.0), (x - 4.0, y)];
    drawing.polygon(&corners, colour);
}

#[derive(Clone, Copy, PartialEq)]
enum Sign {
    Move,
    Knot(bool),
    Playhead,
}

/// The signs used in the chart, with their meaning.
fn entries(data: &CurveChart) -> Vec<(Sign, &'static str)> {
    let knot = |inserted| data.knots.iter().any(|k| k.inserted == inserted);
    let moves = data.rows.iter().any(|row| !row.moves.is_empty());
    // The playhead is self-explanatory; it is named only in a legend with other signs.
    let rest = moves || !data.knots.is_empty();
    let all = [
        (moves, Sign::Move, "a part's move"),
        (knot(false), Sign::Knot(false), "knot"),
        (
            knot(true),
            Sign::Knot(true),
            "knot put in so that no key is negative",
        ),
        (data.playhead.is_some() && rest, Sign::Playhead, "now"),
    ];
    let there = all.into_iter().filter(|(there, ..)| *there);
    there.map(|(_, sign, words)| (sign, words)).collect()
}

/// Explains the signs under the times.
pub(super) fn legend(drawing: &mut Drawing, data: &CurveChart, field: Frame, palette: &Palette) {
    let y = field.bottom() + 35.0;
    let mut x = field.x;
    for (sign_of, words) in entries(data) {
        let width = font::width(words, SMALL);
        if x + 28.0 + width > WIDTH - MARGIN {
            return;
        }
        match sign_of {
            Sign::Move => bar(drawing, (x, x + 20.0), y - 2.0, palette),
            Sign::Knot(inserted) => sign(drawing, (x + 10.0, y), inserted, palette),
            Sign::Playhead => {
                let stroke = Stroke::solid(palette.playhead, 1.5);
                drawing.line((x + 10.0, y - 6.0), (x + 10.0, y + 6.0), stroke);
            }
        }
        drawing.text(Label::new(words, (x + 26.0, y), SMALL, palette.quiet).centred());
        x += 26.0 + width + 20.0;
    }
}
