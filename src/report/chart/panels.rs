//! Measurements: series on linear, log or time axes, in several panels.
//!
//! A series has one colour, by its name, in all panels of a drawing, and one legend names all
//! series.

use super::axis::{Axis, Ruler, Tick};
use super::colour::{Colour, Palette, Theme};
use super::drawing::{Anchor, Drawing, Label, MARGIN, Stroke, crisp};
use super::font;
use super::frame::{Frame, Point};
use super::marker::Marker;
use super::trace::thinned;

/// One plot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Title; empty for none.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Series from the bottom up.
    pub series: Vec<Series>,
    /// A labelled value of y, such as a tolerance: a dashed line across.
    pub reference: Option<(f64, String)>,
}

/// Points joined in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Its name in the legend, which determines its colour in every panel.
    pub name: String,
    /// x and y. A point that the axes cannot show (NaN, or zero on logs) breaks the line.
    pub points: Vec<(f64, f64)>,
    /// Shape of its points.
    pub marker: Marker,
    /// A label for each point, in order; left out when there is no room.
    pub labels: Vec<String>,
}

const HEADING: f32 = 13.0;
const SMALL: f32 = 11.5;
const PLOT_HEIGHT: f32 = 250.0;
/// With more points, markers are left out because they would hide the line.
const MOST_MARKERS: usize = 80;
/// With more points, markers are smaller, to leave the line visible.
const CROWD: usize = 14;
/// Space under a plot for the labels of its axis.
const FOOT: f32 = 42.0;
/// Panels per row.
const PAIR: usize = 2;
/// Number of hues; further series repeat them, dashed.
const HUES: usize = 7;

/// Position of a panel.
struct Place<'a> {
    panel: &'a Panel,
    /// The plot including the margins left and right.
    frame: Frame,
    /// The baseline of its title.
    title: f32,
    /// Names of the series that share its colours.
    names: Vec<&'a str>,
}

/// Draws panels side by side: 420 units for each, 640 for a single one. More than two are drawn two
/// per row, each with its own legend and colours.
pub fn panels(title: &str, data: &[Panel], theme: Theme) -> Drawing {
    let palette = theme.palette();
    let each = if data.len() <= 1 { 640.0 } else { 420.0 };
    let width = each * data.len().clamp(1, PAIR) as f32;
    let top = MARGIN + if title.is_empty() { 0.0 } else { 26.0 };
    let (entries, places, foot) = if data.len() > PAIR {
        gallery(data, each, top)
    } else {
        let names = names(data);
        let (entries, below) = legend(data, Frame::new(0.0, top, width, 0.0), HEADING);
        let row = row(data, each, below, below, |_| names.clone());
        (entries, row, plot_top(data, below) + PLOT_HEIGHT + FOOT)
    };
    let height = (foot + MARGIN / 2.0).ceil();
    let mut drawing = Drawing::titled(title, width, height, &palette);
    for entry in &entries {
        entry.draw(&mut drawing, &palette);
    }
    for place in &places {
        draw_panel(&mut drawing, place, &palette);
    }
    if data.is_empty() {
        let at = (width / 2.0, foot - FOOT - PLOT_HEIGHT / 2.0);
        drawing.text(Label::new("no data", at, HEADING, palette.quiet).anchored(Anchor::Middle));
    }
    drawing
}

/// Top of a row's plots, below its titles and the content that ends at `below`.
fn plot_top(row: &[Panel], below: f32) -> f32 {
    let headed = row.iter().any(|panel| !panel.title.is_empty());
    below + if headed { 48.0 } else { 28.0 }
}

/// Places panels side by side, with titles from `top` down and plots under the content that ends at
/// `below`.
fn row<'a>(
    panels: &'a [Panel],
    each: f32,
    top: f32,
    below: f32,
    names: impl Fn(&'a [Panel]) -> Vec<&'a str>,
) -> Vec<Place<'a>> {
    let y = plot_top(panels, below);
    let place = |(index, panel): (usize, &'a Panel)| Place {
        panel,
        frame: Frame::new(index as f32 * each, y, each, PLOT_HEIGHT),
        title: top + 17.0,
        names: names(std::slice::from_ref(panel)),
    };
    panels.iter().enumerate().map(place).collect()
}

/// Places two panels per row, each with its own legend between title and plot; also returns the
/// bottom.
fn gallery(data: &[Panel], each: f32, top: f32) -> (Vec<Entry>, Vec<Place<'_>>, f32) {
    let (mut entries, mut places, mut top) = (Vec::new(), Vec::new(), top);
    for pair in data.chunks(PAIR) {
        let mut below = top;
        for (index, panel) in pair.iter().enumerate() {
            let room = Frame::new(index as f32 * each, top + 26.0, each, 0.0);
            let (more, under) = legend(std::slice::from_ref(panel), room, SMALL);
            entries.extend(more);
            // `plot_top` adds the space of the title again.
            below = below.max(under - 24.0);
        }
        places.extend(row(pair, each, top, below, names));
        top = plot_top(pair, below) + PLOT_HEIGHT + FOOT + 14.0;
    }
    (entries, places, top - 14.0)
}

/// The names of all series in order of first appearance.
fn names(data: &[Panel]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for series in data.iter().flat_map(|panel| &panel.series) {
        if !names.contains(&series.name.as_str()) {
            names.push(&series.name);
        }
    }
    names
}

/// The line style of the series with this index.
fn stroke(index: usize, palette: &Palette) -> Stroke {
    Stroke {
        colour: palette.hue(index),
        width: 2.0,
        dash: (index >= HUES).then_some((7.0, 4.0)),
    }
}

/// A name in the legend.
struct Entry {
    at: (f32, f32),
    name: String,
    size: f32,
    marker: Marker,
    index: usize,
}

/// The legend's entries in lines across `room`, and the y below them.
fn legend(data: &[Panel], room: Frame, size: f32) -> (Vec<Entry>, f32) {
    let (left, right) = (room.x + MARGIN, room.right() - MARGIN);
    let (mut x, mut y) = (left, room.y);
    let mut entries = Vec::new();
    let series = || data.iter().flat_map(|panel| &panel.series);
    let all = names(data).into_iter().enumerate();
    for (index, full) in all.filter(|(_, name)| !name.is_empty()) {
        let name = font::fit(full, size, right - left - 34.0);
        let wanted = 30.0 + font::width(&name, size);
        if x > left && x + wanted > right {
            (x, y) = (left, y + 20.0);
        }
        let marker = series().find(|series| series.name == full);
        entries.push(Entry {
            at: (x, y + 8.0),
            name,
            size,
            marker: marker.map_or(Marker::None, |series| series.marker),
            index,
        });
        x += wanted + 22.0;
    }
    let below = if entries.is_empty() { room.y } else { y + 26.0 };
    (entries, below)
}

impl Entry {
    fn draw(&self, drawing: &mut Drawing, palette: &Palette) {
        let (x, y) = self.at;
        let line = stroke(self.index, palette);
        drawing.line((x, y), (x + 24.0, y), line);
        self.marker
            .draw(drawing, (x + 12.0, y), 1.0, line.colour, palette.ground);
        let label = Label::new(&self.name, (x + 30.0, y), self.size, palette.ink);
        drawing.text(label.centred());
    }
}

/// A series in pixel coordinates.
struct Trace<'a> {
    series: &'a Series,
    /// Runs of points without gaps.
    runs: Vec<Vec<Point>>,
    colour: Colour,
}

/// A panel's plot in pixel coordinates.
struct Plot {
    frame: Frame,
    x: Ruler,
    y: Ruler,
}

fn draw_panel(drawing: &mut Drawing, place: &Place<'_>, palette: &Palette) {
    let Place { panel, frame, .. } = *place;
    let plot = Plot::new(panel, frame);
    let left = frame.x + MARGIN;
    let room = frame.width - 2.0 * MARGIN;
    let title = font::fit(&panel.title, HEADING, room);
    let at = (left, place.title);
    drawing.text(Label::new(&title, at, HEADING, palette.ink));
    let label = font::fit(&panel.y.label, SMALL, room);
    let at = (left, frame.y - 12.0);
    drawing.text(Label::new(&label, at, SMALL, palette.quiet));
    let label = font::fit(&panel.x.label, SMALL, room);
    // Centred under the plot, but inside the panel when the label is long.
    let half = font::width(&label, SMALL) / 2.0;
    let middle = plot.frame.centre().0;
    let middle = middle.min(frame.right() - MARGIN - half).max(left + half);
    let at = (middle, frame.bottom() + 36.0);
    let label = Label::new(&label, at, SMALL, palette.quiet);
    drawing.text(label.anchored(Anchor::Middle));
    plot.grid(drawing, palette);

    let mut traces = Vec::new();
    for series in &panel.series {
        let runs = plot.runs(&series.points);
        let index = place.names.iter().position(|name| *name == series.name);
        let stroke = stroke(index.unwrap_or(0), palette);
        for run in runs.iter().filter(|run| run.len() > 1) {
            drawing.polyline(run, stroke);
        }
        traces.push(Trace {
            series,
            runs,
            colour: stroke.colour,
        });
    }
    let drawn = plot.reference(drawing, panel, &traces, palette);
    for trace in &traces {
        let Trace {
            series,
            runs,
            colour,
        } = trace;
        // A single point has no line to show it.
        let count = runs.iter().map(Vec::len).sum::<usize>();
        let few = count <= MOST_MARKERS;
        let size = if count > CROWD { 0.75 } else { 1.0 };
        for run in runs.iter().filter(|run| few || run.len() == 1) {
            let marker = match series.marker {
                Marker::None if run.len() == 1 => Marker::Circle,
                other => other,
            };
            for &at in run {
                marker.draw(drawing, at, size, *colour, palette.ground);
            }
        }
    }
    plot.labels(drawing, &traces, drawn, palette);
    if drawn.is_none() && traces.iter().all(|trace| trace.runs.is_empty()) {
        let at = plot.frame.centre();
        drawing.text_around("no data", at, HEADING, palette.quiet);
    }
}

impl Plot {
    fn new(panel: &Panel, frame: Frame) -> Plot {
        // Only points visible on both axes may stretch the axes.
        let seen = |&&(x, y): &&(f64, f64)| panel.x.scale.takes(x) && panel.y.scale.takes(y);
        let all = || panel.series.iter().flat_map(|series| &series.points);
        let points = || all().filter(seen);
        let reference = panel.reference.iter().map(|(value, _)| *value);
        let heights = points().map(|point| point.1).chain(reference);
        let span = (frame.bottom(), frame.y);
        let y = Ruler::round(panel.y.scale, heights, span, 5);
        let widest = y.ticks.iter().map(|tick| font::width(&tick.label, SMALL));
        let labels = widest.fold(0.0, f32::max).ceil();
        let left = frame.x + MARGIN + labels + 8.0;
        let right = frame.right() - MARGIN - 8.0;
        let widths = points().map(|point| point.0);
        let x = Ruler::round(panel.x.scale, widths, (left, right), 6);
        Plot {
            frame: Frame::new(left, frame.y, right - left, frame.height),
            x,
            y,
        }
    }

    fn grid(&self, drawing: &mut Drawing, palette: &Palette) {
        let Frame { x, y, .. } = self.frame;
        let (right, foot) = (self.frame.right(), self.frame.bottom());
        let thin = Stroke::solid(palette.grid, 1.0);
        let major = |(_, tick): &(f32, &Tick)| !tick.label.is_empty();
        for (at, tick) in self.y.placed_ticks().filter(major) {
            drawing.line((x, crisp(at)), (right, crisp(at)), thin);
            let label = Label::new(&tick.label, (x - 8.0, at), SMALL, palette.quiet);
            drawing.text(label.anchored(Anchor::End).centred());
        }
        let mut free = f32::MIN;
        for (at, tick) in self.x.placed_ticks().filter(major) {
            drawing.line((crisp(at), y), (crisp(at), foot + 4.0), thin);
            let label = Label::new(&tick.label, (at, foot + 18.0), SMALL, palette.quiet);
            let label = label.anchored(Anchor::Middle);
            if label.frame().x > free {
                free = label.frame().right() + 8.0;
                drawing.text(label);
            }
        }
        let firm = Stroke::solid(palette.frame, 1.0);
        for (at, _) in self.y.placed_ticks().filter(|tick| !major(tick)) {
            drawing.line((x, crisp(at)), (x + 3.0, crisp(at)), firm);
        }
        for (at, _) in self.x.placed_ticks().filter(|tick| !major(tick)) {
            drawing.line((crisp(at), foot - 3.0), (crisp(at), foot), firm);
        }
        drawing.line((x, crisp(foot)), (right, crisp(foot)), firm);
    }

    /// The points in pixels, in unbroken runs.
    fn runs(&self, points: &[(f64, f64)]) -> Vec<Vec<Point>> {
        let placed: Vec<Option<Point>> = points
            .iter()
            .map(|&(x, y)| Some((self.x.place(x)?, self.y.place(y)?)))
            .collect();
        placed
            .split(Option::is_none)
            .filter(|run| !run.is_empty())
            .map(|run| thinned(&run.iter().copied().flatten().collect::<Vec<_>>()))
            .collect()
    }

    /// Draws labels of points, each on the side where it hides the least, none over another or over
    /// the name of the reference line.
    fn labels(
        &self,
        drawing: &mut Drawing,
        traces: &[Trace<'_>],
        named: Option<Frame>,
        palette: &Palette,
    ) {
        let mut taken: Vec<Frame> = named.into_iter().collect();
        for Trace { series, .. } in traces {
            for (&(x, y), text) in series.points.iter().zip(&series.labels) {
                let (Some(x), Some(y)) = (self.x.place(x), self.y.place(y)) else {
                    continue;
                };
                let beside = [
                    ((x + 9.0, y - 7.0), Anchor::Start),
                    ((x + 9.0, y + 15.0), Anchor::Start),
                    ((x - 9.0, y - 7.0), Anchor::End),
                    ((x - 9.0, y + 15.0), Anchor::End),
                    ((x, y - 12.0), Anchor::Middle),
                    ((x, y + 20.0), Anchor::Middle),
                    // Under the top of the plot, next to a falling line.
                    ((x + 12.0, y + 1.0), Anchor::Start),
                    ((x - 12.0, y + 1.0), Anchor::End),
                ];
                let free = |label: &Label| {
                    let frame = label.frame();
                    self.frame.holds(&frame) && !taken.iter().any(|t| t.overlaps(&frame))
                };
                let places = beside
                    .map(|(at, anchor)| Label::new(text, at, SMALL, palette.ink).anchored(anchor));
                let best = places.into_iter().filter(free);
                if let Some(label) = best.min_by_key(|label| met(traces, &label.frame())) {
                    taken.push(label.frame());
                    drawing.text(label);
                }
            }
        }
    }

    /// Draws the reference line, its name at the end and side where it hides the least. Returns the
    /// frame of the name, or `None` if the axis cannot show the line.
    fn reference(
        &self,
        drawing: &mut Drawing,
        panel: &Panel,
        traces: &[Trace<'_>],
        palette: &Palette,
    ) -> Option<Frame> {
        let (value, name) = panel.reference.as_ref()?;
        let y = self.y.place(*value)?;
        let (left, right) = (self.frame.x, self.frame.right());
        let stroke = Stroke::dashed(palette.quiet, 1.5, (5.0, 4.0));
        drawing.line((left, crisp(y)), (right, crisp(y)), stroke);
        let name = font::fit(name, SMALL, self.frame.width * 0.8);
        let ends = [(right - 4.0, Anchor::End), (left + 4.0, Anchor::Start)];
        let sides = [y - 5.0, y + 14.0];
        let places = ends.iter().flat_map(|&(x, anchor)| {
            sides.map(|y| Label::new(&name, (x, y), SMALL, palette.ink).anchored(anchor))
        });
        let hidden = |label: &Label| {
            let frame = label.frame();
            // Outside the plot it would meet the axes' labels.
            met(traces, &frame) + if self.frame.holds(&frame) { 0 } else { 1000 }
        };
        let best = places.min_by_key(hidden)?;
        let frame = best.frame();
        drawing.text(best);
        Some(frame)
    }
}

/// Distance between samples of a line, pixels.
const SAMPLED: f32 = 4.0;

/// Amount of the lines near the frame: samples of their segments, and points, which weigh more.
fn met(traces: &[Trace<'_>], frame: &Frame) -> usize {
    let runs = traces.iter().flat_map(|trace| &trace.runs);
    runs.map(|run| met_by_run(run, frame)).sum()
}

fn met_by_run(run: &[Point], frame: &Frame) -> usize {
    let near = |x: f32, y: f32| frame.overlaps(&Frame::new(x - 4.0, y - 4.0, 8.0, 8.0));
    let alone = run.iter().filter(|(x, y)| near(*x, *y)).count();
    let hidden = run.windows(2).map(|pair| match pair {
        [from, to] => {
            let way = (to.0 - from.0, to.1 - from.1);
            let parts = (way.0.hypot(way.1) / SAMPLED).ceil().max(1.0) as usize;
            let at = |part: &usize| *part as f32 / parts as f32;
            let on = |share: f32| near(from.0 + way.0 * share, from.1 + way.1 * share);
            (1..parts).filter(|part| on(at(part))).count()
        }
        _ => 0,
    });
    4 * alone + hidden.sum::<usize>()
}
