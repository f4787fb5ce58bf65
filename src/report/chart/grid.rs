//! Values in a grid whose columns are tied to moments on an axis of time. Key settings are an
//! example: each may serve several moments.

use std::collections::BTreeSet;

use super::axis::Ruler;
use super::colour::{Colour, Palette, Theme};
use super::drawing::{Anchor, Drawing, Label, MARGIN, Step, Stroke, crisp};
use super::font;
use super::frame::{Frame, Point};
use super::rows::{NAME, SMALL, WIDTH, merged, name_column, row_name, span, time_ruler};

/// Numbers by rows and columns, and the moments of each column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid {
    /// Title; empty for none.
    pub title: String,
    /// Kind of the columns, such as `key`; their numbers from 1 stand over the grid.
    pub column: String,
    /// Names of the rows, from the top down.
    pub rows: Vec<String>,
    /// The columns from the left, one number per row. 1 is full scale; larger values are drawn
    /// brighter, negative ones in another hue.
    pub columns: Vec<Vec<f64>>,
    /// Moments of the columns.
    pub ties: Vec<Tie>,
    /// Seconds at the left end of the axis.
    pub start: f64,
    /// Seconds at the right end.
    pub end: f64,
    /// Seconds and name of each label under the axis.
    pub cues: Vec<(f64, String)>,
}

/// A moment of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// Index of the column.
    pub column: usize,
    /// Seconds.
    pub time: f64,
    /// Relation of the column to the moment.
    pub stand: Stand,
}

/// Relation of a column to its moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stand {
    /// The curve takes the values there.
    Met,
    /// The curve takes the values there, at an inserted knot.
    Inserted,
    /// The values attract the curve, which does not reach them.
    Near,
}

/// Most rows drawn; the rest are counted.
const MOST_ROWS: usize = 256;
/// Least width of a cell: narrower columns share a cell, which shows the largest value.
const NARROWEST: f32 = 3.0;
const WIDEST: f32 = 160.0;
/// Most ties drawn: more would hide each other.
const MOST_TIES: usize = 4000;
/// Height of the ties between the grid and the axis.
const TIES: f32 = 96.0;

/// Positions of the grid's parts.
struct Layout {
    field: Frame,
    pitch: f32,
    /// Columns per cell.
    share: usize,
    /// Width of a cell.
    cell: f32,
    names: f32,
    axis: f32,
}

impl Layout {
    fn new(data: &Grid) -> Layout {
        let rows = data.rows.len().clamp(1, MOST_ROWS);
        let (names, left) = name_column(data.rows.iter().take(MOST_ROWS));
        let room = WIDTH - MARGIN - left;
        let count = data.columns.len().max(1);
        let share = count.div_ceil((room / NARROWEST) as usize).max(1);
        let cell = (room / count.div_ceil(share) as f32).min(WIDEST);
        let pitch = (440.0 / rows as f32).floor().clamp(14.0, 24.0);
        let title = if data.title.is_empty() { 0.0 } else { 26.0 };
        let top = MARGIN + title + 42.0;
        let field = Frame::new(left, top, room, pitch * rows as f32);
        Layout {
            pitch,
            share,
            cell,
            names,
            axis: field.bottom() + TIES,
            field,
        }
    }

    /// The left edge of a column's cell.
    fn left(&self, column: usize) -> f32 {
        self.field.x + (column / self.share) as f32 * self.cell
    }
}

/// Draws the grid, 840 units wide and as high as the rows need.
pub fn grid(data: &Grid, theme: Theme) -> Drawing {
    let palette = theme.palette();
    let layout = Layout::new(data);
    let cues = if data.cues.is_empty() { 0.0 } else { 20.0 };
    let more = data.rows.len() > MOST_ROWS || layout.share > 1;
    let below = 42.0 + cues + if more { 18.0 } else { 0.0 };
    let height = (layout.axis + below).ceil();
    let mut drawing = Drawing::titled(&data.title, WIDTH, height, &palette);
    legend(&mut drawing, data, &layout, &palette);
    cells(&mut drawing, data, &layout, &palette);
    numbers(&mut drawing, data, &layout, &palette);
    ties(&mut drawing, data, &layout, &palette);
    remark(&mut drawing, data, &layout, cues, &palette);
    drawing
}

/// Colour of a value. Zero has the background colour; any other value is visibly different.
fn shade(value: f64, palette: &Palette) -> Colour {
    let strength = |v: f64| (0.12 + 0.88 * v.clamp(0.0, 1.0)) as f32;
    match value {
        v if v.abs() < 0.5e-3 || v.is_nan() => palette.field,
        v if v < 0.0 => palette.field.toward(palette.hue(1), strength(-v)),
        v if v <= 1.0 => palette.field.toward(palette.hue(0), strength(v)),
        v => palette.hue(0).toward(palette.ink, strength(v - 1.0)),
    }
}

fn cells(drawing: &mut Drawing, data: &Grid, layout: &Layout, palette: &Palette) {
    drawing.rectangle(layout.field, palette.field);
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    for (row, name) in data.rows.iter().take(MOST_ROWS).enumerate() {
        let y = layout.field.y + row as f32 * layout.pitch;
        let at = (layout.field.x, y + layout.pitch / 2.0);
        row_name(drawing, name, layout.names, at, palette);
        for (index, group) in data.columns.chunks(layout.share).enumerate() {
            let values = group.iter().filter_map(|c| c.get(row).copied());
            let colour = shade(values.fold(0.0, larger), palette);
            if colour != palette.field {
                // In whole units, so that cells without a gap leave no seams.
                let edge = |index: usize| (layout.field.x + index as f32 * layout.cell).floor();
                let gap = if layout.cell > 6.0 { 1.0 } else { 0.0 };
                let (x, right) = (edge(index), edge(index + 1));
                let cell = Frame::new(x, y, right - x - gap, layout.pitch - 1.0);
                drawing.rectangle(cell, colour);
            }
        }
    }
    if data.columns.is_empty() || data.rows.is_empty() {
        let at = layout.field.centre();
        drawing.text_around("nothing to show", at, NAME, palette.quiet);
    }
}

/// Numbers the columns if there is room.
fn numbers(drawing: &mut Drawing, data: &Grid, layout: &Layout, palette: &Palette) {
    let y = layout.field.y - 6.0;
    let at = (layout.field.x - 10.0, y);
    let name = Label::new(&data.column, at, SMALL, palette.quiet).anchored(Anchor::End);
    if name.frame().x >= 0.0 {
        drawing.text(name);
    }
    let count = data.columns.len();
    let room = (font::width(&count.to_string(), SMALL) + 6.0) / (layout.cell / layout.share as f32);
    let steps = [
        1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 5000, 10_000, 100_000,
    ];
    let step = steps
        .into_iter()
        .find(|s| *s as f32 >= room)
        .unwrap_or(1_000_000);
    for column in (0..count).filter(|c| c + 1 == 1 || (c + 1) % step == 0) {
        let x = layout.left(column) + layout.cell / 2.0;
        let text = (column + 1).to_string();
        let label = Label::new(&text, (x, y), SMALL, palette.quiet).anchored(Anchor::Middle);
        // The first number gives way to the next round one.
        if column > 0 || step == 1 || room < step as f32 - 1.0 {
            drawing.text(label);
        }
    }
}

/// Draws the axis of time, and lines to it from the columns.
fn ties(drawing: &mut Drawing, data: &Grid, layout: &Layout, palette: &Palette) {
    let field = layout.field;
    let ruler = time_ruler(span(data.start, data.end), field);
    let y = layout.axis;
    let mut drawn = BTreeSet::new();
    let stride = data.ties.len().div_ceil(MOST_TIES).max(1);
    for stand in [Stand::Near, Stand::Met, Stand::Inserted] {
        let ties = data.ties.iter().filter(|t| t.stand == stand);
        for tie in ties.step_by(stride) {
            let Some(x) = ruler.place(tie.time) else {
                continue;
            };
            let (left, x) = (layout.left(tie.column), x.clamp(field.x, field.right()));
            let fresh = drawn.insert((stand as u8, left as i32, x as i32));
            if fresh && tie.column < data.columns.len() {
                let from = (left + layout.cell / 2.0, field.bottom() + 1.0);
                strand(drawing, from, (x, y), stand, palette);
            }
        }
    }
    let firm = Stroke::solid(palette.frame, 1.0);
    drawing.line((field.x, crisp(y)), (field.right(), crisp(y)), firm);
    let mut free = f32::MIN;
    for (x, tick) in ruler.placed_ticks() {
        drawing.line((crisp(x), y), (crisp(x), y + 4.0), firm);
        let label = Label::new(&tick.label, (x, y + 18.0), SMALL, palette.quiet);
        let label = label.anchored(Anchor::Middle);
        if label.frame().x > free && label.frame().right() <= WIDTH {
            free = label.frame().right() + 8.0;
            drawing.text(label);
        }
    }
    cues(drawing, data, &ruler, layout, palette);
}

fn strand(
    drawing: &mut Drawing,
    (a, top): Point,
    (b, foot): Point,
    stand: Stand,
    palette: &Palette,
) {
    let middle = (top + foot) / 2.0;
    let stroke = match stand {
        Stand::Met => Stroke::solid(palette.quiet.faded(0.8), 1.0),
        Stand::Inserted => Stroke::solid(palette.hue(1), 1.25),
        Stand::Near => Stroke::dashed(palette.quiet.faded(0.7), 1.0, (2.0, 3.0)),
    };
    let bow = Step::Cubic([a, middle, b, middle, b, foot]);
    drawing.path(vec![Step::Move(a, top), bow], stroke);
    if stand == Stand::Inserted {
        diamond(drawing, (b, foot), palette.hue(1));
    }
}

/// A small square on its corner.
fn diamond(drawing: &mut Drawing, (x, y): Point, colour: Colour) {
    let corners = [(x, y - 5.0), (x + 4.0, y), (x, y + 5.0), (x - 4.0, y)];
    drawing.polygon(&corners, colour);
}

/// Draws the cue names under the times, as far as there is room.
fn cues(drawing: &mut Drawing, data: &Grid, ruler: &Ruler, layout: &Layout, palette: &Palette) {
    let y = layout.axis + 38.0;
    if data.cues.is_empty() {
        return;
    }
    let name = Label::new("cue", (layout.field.x - 10.0, y), SMALL, palette.quiet);
    let name = name.anchored(Anchor::End);
    let mut free = 0.0;
    if name.frame().x >= 0.0 {
        free = name.frame().right() + 4.0;
        drawing.text(name);
    }
    for (x, text) in merged(&data.cues, ruler, layout.field) {
        let label = Label::new(&text, (x, y), SMALL, palette.ink).anchored(Anchor::Middle);
        if label.frame().x > free && label.frame().right() <= WIDTH {
            free = label.frame().right() + 6.0;
            drawing.text(label);
        }
    }
}

/// Explains colours and lines above the grid.
fn legend(drawing: &mut Drawing, data: &Grid, layout: &Layout, palette: &Palette) {
    let y = layout.field.y - 30.0;
    let mut x = MARGIN;
    let values = || data.columns.iter().flatten();
    let word = |drawing: &mut Drawing, x: &mut f32, text: &str| {
        drawing.text(Label::new(text, (*x, y), SMALL, palette.quiet).centred());
        *x += font::width(text, SMALL) + 16.0;
    };
    for step in 1..=5 {
        let colour = shade(f64::from(step) / 5.0, palette);
        drawing.rectangle(Frame::new(x, y - 6.0, 14.0, 12.0), colour);
        x += 14.0;
    }
    x += 6.0;
    word(drawing, &mut x, "20 to 100 %");
    let scale = [
        (values().any(|v| *v > 1.001), 1.5, "beyond full"),
        (values().any(|v| *v < -1e-3), -0.7, "negative"),
    ];
    for (_, value, text) in scale.into_iter().filter(|(there, ..)| *there) {
        drawing.rectangle(Frame::new(x, y - 6.0, 14.0, 12.0), shade(value, palette));
        x += 20.0;
        word(drawing, &mut x, text);
    }
    let stands = [
        (Stand::Met, "shown then"),
        (Stand::Near, "bends the curve"),
        (Stand::Inserted, "put in so that no key is negative"),
    ];
    for (stand, text) in stands {
        if data.ties.iter().any(|t| t.stand == stand) {
            let (top, foot) = ((x + 8.0, y - 7.0), (x + 8.0, y + 5.0));
            strand(drawing, top, foot, stand, palette);
            x += 20.0;
            word(drawing, &mut x, text);
        }
    }
}

fn remark(drawing: &mut Drawing, data: &Grid, layout: &Layout, cues: f32, palette: &Palette) {
    let mut parts = Vec::new();
    if layout.share > 1 {
        parts.push(format!(
            "{} columns share a cell, which shows the largest",
            layout.share
        ));
    }
    if data.rows.len() > MOST_ROWS {
        parts.push(format!("and {} more rows", data.rows.len() - MOST_ROWS));
    }
    let at = (layout.field.x, layout.axis + 36.0 + cues);
    drawing.text(Label::new(&parts.join("; "), at, SMALL, palette.quiet));
}
