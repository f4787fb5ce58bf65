//! Rows along an axis of time, shared by charts of curves and grids.

use super::axis::{Ruler, Scale};
use super::colour::Palette;
use super::drawing::{Anchor, Drawing, Label, MARGIN};
use super::font;
use super::frame::{Frame, Point};

/// Width of a chart.
pub(super) const WIDTH: f32 = 840.0;
/// Font size of names.
pub(super) const NAME: f32 = 12.0;
/// Font size of other text.
pub(super) const SMALL: f32 = 11.0;

/// The span of an axis of time, seconds; one second for an empty span.
pub(super) fn span(start: f64, end: f64) -> (f64, f64) {
    if start.is_finite() && end.is_finite() {
        (start, end)
    } else {
        (0.0, 1.0)
    }
}

/// The axis of time along a field.
pub(super) fn time_ruler(span: (f64, f64), field: Frame) -> Ruler {
    Ruler::exact(Scale::Time, span, (field.x, field.right()), 9)
}

/// Width of the column of names, at most a fifth of the page, and the left edge of the field.
pub(super) fn name_column<'n>(names: impl Iterator<Item = &'n String>) -> (f32, f32) {
    let widths = names.map(|name| font::width(name, NAME));
    let width = widths.fold(0.0, f32::max).min(WIDTH / 5.0).ceil();
    let gap = if width > 0.0 { 10.0 } else { 0.0 };
    (width, MARGIN + width + gap)
}

/// Draws a name in its column, centred at the height `middle`, shortened to the column.
pub(super) fn row_name(
    drawing: &mut Drawing,
    name: &str,
    column: f32,
    (x, middle): Point,
    palette: &Palette,
) {
    let text = font::fit(name, NAME, column);
    let label = Label::new(&text, (x - 10.0, middle), NAME, palette.ink);
    drawing.text(label.anchored(Anchor::End).centred());
}

/// The cues inside the field from left to right; cues on one pixel share a label.
pub(super) fn merged(cues: &[(f64, String)], ruler: &Ruler, field: Frame) -> Vec<(f32, String)> {
    let mut placed: Vec<(f32, &str)> = cues
        .iter()
        .filter_map(|(time, name)| Some((ruler.place(*time)?, name.as_str())))
        .filter(|(x, _)| field.spans(*x))
        .collect();
    placed.sort_by(|a, b| a.0.total_cmp(&b.0));
    placed
        .chunk_by(|a, b| a.0.floor() == b.0.floor())
        .filter_map(|group| match group {
            [] => None,
            [(x, name)] => Some((*x, font::fit(name, SMALL, 90.0))),
            [(x, one), (_, two)] => {
                let both = [one, two].map(|name| font::fit(name, SMALL, 45.0));
                Some((*x, both.join(", ")))
            }
            [(x, name), rest @ ..] => {
                let name = font::fit(name, SMALL, 70.0);
                Some((*x, format!("{name} +{}", rest.len())))
            }
        })
        .collect()
}
