//! Levels over time, one strip per row, like automation on a desk.

use super::axis::{Ruler, Scale, clock};
use super::colour::{Colour, Palette, Theme};
use super::curve_chart::{CurveChart, CurveRow};
use super::drawing::{Anchor, Drawing, Label, MARGIN, Stroke, crisp};
use super::frame::{Frame, Point};
use super::moves::SMALL;
use super::trace::{cut, thinned};
use super::{font, moves};

/// Width of a chart.
const WIDTH: f32 = 840.0;
/// Font size of names.
const NAME: f32 = 12.0;
/// Most rows drawn; the rest are counted.
const MOST_ROWS: usize = 512;
/// The height of one line of cue names.
const TIER: f32 = 15.0;

/// Positions of a chart's parts.
struct Layout {
    /// The area of all strips.
    field: Frame,
    pitch: f32,
    gap: f32,
    names: f32,
}

/// Draws the curves, 840 units wide and as high as the rows need.
pub fn curves(data: &CurveChart, theme: Theme) -> Drawing {
    let palette = theme.palette();
    let count = data.rows.len().min(MOST_ROWS);
    let (layout, height) = layout(data, count);
    let mut drawing = Drawing::titled(&data.title, WIDTH, height, &palette);
    let field = layout.field;
    let span = match (data.start, data.end) {
        (start, end) if start.is_finite() && end.is_finite() => (start, end),
        _ => (0.0, 1.0),
    };
    let ruler = Ruler::exact(Scale::Time, span, (field.x, field.right()), 9);

    strips(&mut drawing, &layout, (&data.rows, count), &palette);
    time_grid(&mut drawing, &ruler, field, &palette);
    for (index, row) in data.rows.iter().take(count).enumerate() {
        let strip = layout.strip(index);
        let name = font::fit(&row.name, NAME, layout.names);
        let at = (strip.x - 10.0, strip.centre().1);
        let name = Label::new(&name, at, NAME, palette.ink);
        drawing.text(name.anchored(Anchor::End).centred());
        curve(&mut drawing, row, strip, &ruler, span, &palette);
        moves::bars(&mut drawing, &row.moves, strip, &ruler, &palette);
    }
    cue_lines(&mut drawing, &data.cues, &ruler, field, &palette);
    let playhead = data
        .playhead
        .and_then(|time| playhead(time, &ruler, field, &palette));
    time_labels(&mut drawing, &ruler, field, playhead.as_ref(), &palette);
    if let Some(playhead) = playhead {
        playhead.draw(&mut drawing, field, &palette);
    }
    moves::legend(&mut drawing, data, field, &palette);
    remarks(&mut drawing, data, &layout, count, &palette);
    drawing
}

impl Layout {
    fn strip(&self, index: usize) -> Frame {
        let top = self.field.y + index as f32 * self.pitch;
        Frame::new(self.field.x, top, self.field.width, self.pitch - self.gap)
    }
}

fn layout(data: &CurveChart, count: usize) -> (Layout, f32) {
    let rows = data.rows.iter().take(count);
    let widths = rows.map(|row| font::width(&row.name, NAME));
    let names = widths.fold(0.0, f32::max).min(WIDTH / 5.0).ceil();
    let left = MARGIN + names + if names > 0.0 { 10.0 } else { 0.0 };
    // Few rows are tall enough to read levels; many keep the page short.
    let pitch = (560.0 / count.max(1) as f32).floor().clamp(26.0, 84.0);
    let moves = data.rows.iter().any(|row| !row.moves.is_empty());
    let gap = match (pitch >= 48.0, moves) {
        (true, _) => 8.0,
        (false, true) => moves::BAR,
        (false, false) => 4.0,
    };
    let cues = if data.cues.is_empty() {
        6.0
    } else {
        2.0 * TIER + 8.0
    };
    let title = if data.title.is_empty() { 0.0 } else { 24.0 };
    let ends = data.rows.iter().flat_map(|row| row.ends.iter().flatten());
    let widest = ends
        .map(|end| font::width(end, 10.0))
        .fold(font::width("100", 10.0), f32::max);
    let right = WIDTH - MARGIN - widest.ceil() - 6.0;
    let top = (MARGIN + title + cues).ceil();
    let strips = pitch * count.max(1) as f32 - gap;
    let field = Frame::new(left, top, right - left, strips);
    let remark = if data.rows.len() > count { 18.0 } else { 0.0 };
    let below = 24.0 + moves::legend_height(data) + remark;
    let height = (field.bottom() + below + MARGIN / 2.0).ceil();
    let layout = Layout {
        field,
        pitch,
        gap,
        names,
    };
    (layout, height)
}

fn strips(
    drawing: &mut Drawing,
    layout: &Layout,
    (rows, count): (&[CurveRow], usize),
    palette: &Palette,
) {
    for index in 0..count.max(1) {
        let strip = layout.strip(index);
        drawing.rectangle(strip, palette.field);
        // Label the scale's ends on every tall strip, else only on the first.
        let ends = rows.get(index).and_then(|row| row.ends.as_ref());
        if layout.pitch >= 48.0 || index == 0 || ends.is_some() {
            let x = strip.right() + 6.0;
            let [low, high] = ends.map_or(["0", "100"], |[low, high]| [low, high]);
            for (level, y) in [(high, strip.y + 4.0), (low, strip.bottom() - 4.0)] {
                drawing.text(Label::new(level, (x, y), 10.0, palette.quiet).centred());
            }
        }
        if layout.pitch >= 48.0 {
            let y = crisp(strip.centre().1);
            let stroke = Stroke::solid(palette.grid, 1.0);
            drawing.line((strip.x, y), (strip.right(), y), stroke);
        }
    }
}

fn time_grid(drawing: &mut Drawing, ruler: &Ruler, field: Frame, palette: &Palette) {
    let stroke = Stroke::solid(palette.grid, 1.0);
    for (x, _) in ruler.placed_ticks() {
        let x = crisp(x.min(field.right() - 1.0));
        drawing.line((x, field.y), (x, field.bottom() + 4.0), stroke);
    }
}

fn curve(
    drawing: &mut Drawing,
    row: &CurveRow,
    strip: Frame,
    ruler: &Ruler,
    (start, end): (f64, f64),
    palette: &Palette,
) {
    // Keep half the line's width inside the strip at both ends of the scale.
    let (top, base) = (strip.y + 1.0, strip.bottom() - 1.0);
    let place = |(time, level): (f64, f64)| -> Option<Point> {
        let level = level.clamp(0.0, 1.0) as f32;
        Some((ruler.place(time)?, base + (top - base) * level))
    };
    let placed = |points: &[(f64, f64)]| -> Vec<Point> {
        let inside = cut(points, start, end).into_iter();
        thinned(&inside.filter_map(place).collect::<Vec<_>>())
    };
    let points = placed(&row.points);
    let (Some(first), Some(last)) = (points.first(), points.last()) else {
        return;
    };
    let given = row.colour.map(|rgb| Colour { rgb, alpha: 1.0 });
    let colour = given.map_or(palette.hue(0), |hue| {
        hue.legible(palette.field, palette.ink)
    });
    // The area keeps the given colour if visible; the line must always be distinguishable from the
    // field.
    let area_colour = match given {
        Some(hue) if hue.contrast(palette.field) >= 1.2 => hue.faded(0.45),
        _ => colour.faded(0.32),
    };
    let corners = [(first.0, strip.bottom()), (last.0, strip.bottom())];
    let [left, right] = corners.map(|corner| vec![corner]);
    drawing.polygon(&[left, points.clone(), right].concat(), area_colour);
    let before = placed(&row.before);
    if !before.is_empty() {
        let old = Stroke::dashed(palette.ink.faded(0.75), 1.25, (4.0, 3.0));
        drawing.polyline(&before, old);
    }
    drawing.polyline(&points, Stroke::solid(colour, 1.5));
}

/// The cues inside the field from left to right; cues on one pixel share a label.
fn merged(cues: &[(f64, String)], ruler: &Ruler, field: Frame) -> Vec<(f32, String)> {
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

/// Draws the lines of the cues and their names in two tiers above the field. A name that meets its
/// left neighbour goes up a tier if its line can pass, else it is left out.
fn cue_lines(
    drawing: &mut Drawing,
    cues: &[(f64, String)],
    ruler: &Ruler,
    field: Frame,
    palette: &Palette,
) {
    let stroke = Stroke::solid(palette.ink.faded(0.28), 1.0);
    let mut free = [f32::MIN; 2];
    let mut raised = f32::MIN;
    for (x, text) in merged(cues, ruler, field) {
        let line = crisp(x.min(field.right() - 1.0));
        let width = font::width(&text, SMALL);
        let right_most = WIDTH - MARGIN / 2.0;
        let left = (line - width / 2.0)
            .min(right_most - width)
            .max(MARGIN / 2.0);
        let tier = if left > free[0] && left > raised + 2.0 {
            Some(0)
        } else if left > free[1] && line > free[0] - 3.0 {
            Some(1)
        } else {
            None
        };
        let rise = tier.map_or(0.0, |tier| 4.0 + TIER * tier as f32);
        drawing.line((line, field.y - rise), (line, field.bottom()), stroke);
        let Some(tier) = tier else { continue };
        if let Some(free) = free.get_mut(tier) {
            *free = left + width + 6.0;
        }
        if tier == 1 {
            raised = line;
        }
        let baseline = field.y - rise - 3.0;
        drawing.text(Label::new(&text, (left, baseline), SMALL, palette.ink));
    }
}

/// The playhead's line, and its time under the field.
struct Playhead {
    x: f32,
    label: Label,
}

fn playhead(time: f64, ruler: &Ruler, field: Frame, palette: &Palette) -> Option<Playhead> {
    let x = ruler.place(time).filter(|x| field.spans(*x))?;
    let text = clock(time, 0.1);
    let half = font::width(&text, SMALL) / 2.0;
    let centre = x.clamp(MARGIN / 2.0 + half, WIDTH - MARGIN / 2.0 - half);
    let at = (centre, field.bottom() + 19.0);
    let label = Label::new(&text, at, SMALL, palette.playhead);
    Some(Playhead {
        x,
        label: label.anchored(Anchor::Middle),
    })
}

impl Playhead {
    fn draw(self, drawing: &mut Drawing, field: Frame, palette: &Palette) {
        let (x, foot) = (self.x, field.bottom());
        let stroke = Stroke::solid(palette.playhead, 1.5);
        drawing.line((x, field.y), (x, foot), stroke);
        let triangle = [(x - 4.5, foot + 7.0), (x + 4.5, foot + 7.0), (x, foot)];
        drawing.polygon(&triangle, palette.playhead);
        drawing.text(self.label);
    }
}

/// Draws the times under the field, except those that would touch another label or the playhead's.
fn time_labels(
    drawing: &mut Drawing,
    ruler: &Ruler,
    field: Frame,
    playhead: Option<&Playhead>,
    palette: &Palette,
) {
    let mut taken: Vec<Frame> = playhead
        .iter()
        .map(|head| padded(head.label.frame()))
        .collect();
    for (x, tick) in ruler.placed_ticks() {
        let at = (x, field.bottom() + 19.0);
        let label = Label::new(&tick.label, at, SMALL, palette.quiet).anchored(Anchor::Middle);
        let frame = label.frame();
        if frame.right() <= WIDTH && !taken.iter().any(|other| other.overlaps(&frame)) {
            taken.push(padded(frame));
            drawing.text(label);
        }
    }
}

fn padded(frame: Frame) -> Frame {
    Frame::new(frame.x - 8.0, frame.y, frame.width + 16.0, frame.height)
}

fn remarks(
    drawing: &mut Drawing,
    data: &CurveChart,
    layout: &Layout,
    count: usize,
    palette: &Palette,
) {
    let field = layout.field;
    if count == 0 {
        let at = (field.centre().0, layout.strip(0).centre().1);
        drawing.text_around("no curves", at, NAME, palette.quiet);
    }
    if data.rows.len() > count {
        let text = format!("and {} more rows", data.rows.len() - count);
        let at = (field.x, field.bottom() + 38.0 + moves::legend_height(data));
        drawing.text(Label::new(&text, at, SMALL, palette.quiet));
    }
}
