//! A light plot: rig and set from above and from the side, to one scale on A4.

use std::collections::{BTreeMap, BTreeSet};

use super::colour::{Colour, Palette, Theme};
use super::drawing::{Drawing, Label, MARGIN, Step, Stroke, closed};
use super::font;
use super::frame::{Frame, Point};
use super::marker::disc;
use footlight_show::geometry::{Vec3, bounds, newell, vec3};

/// Data of a light plot; lengths are metres, X to stage left, Y upstage, Z up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightPlot {
    /// The show's title.
    pub title: String,
    /// Lights with a position.
    pub lights: Vec<PlottedLight>,
    /// The set.
    pub surfaces: Vec<PlottedSurface>,
}

/// A light at its position.
#[derive(Clone, Debug, PartialEq)]
pub struct PlottedLight {
    /// Position, metres.
    pub at: Vec3,
    /// The point at which it is focused.
    pub aim: Option<Vec3>,
    /// Its channel, or its name.
    pub label: String,
    /// Its symbol.
    pub symbol: Symbol,
    /// The colour of its gel, sRGB, with which the symbol is filled.
    pub gel: Option<[u8; 3]>,
}

/// Symbols of lights; of several at one place the last is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    /// A lantern with a hard edge, or a projector.
    Profile,
    /// A lantern with a soft edge.
    Wash,
    /// A lantern that lights a cloth.
    Flood,
    /// A lamp of another form.
    Lamp,
    /// A moving head.
    Head,
}

impl Symbol {
    /// All symbols with their names in the legend.
    const LEGEND: [(Symbol, &'static str); 5] = [
        (Symbol::Profile, "profile, spot"),
        (Symbol::Wash, "fresnel, PAR, wash"),
        (Symbol::Flood, "flood, batten"),
        (Symbol::Lamp, "other lamp"),
        (Symbol::Head, "moving head"),
    ];

    /// Corners on one side of the axis, from the back to the front; none for a circle.
    fn half(self) -> &'static [Point] {
        match self {
            Symbol::Profile => &[
                (-6.0, 2.0),
                (-3.5, 4.0),
                (-0.5, 4.0),
                (0.5, 2.5),
                (6.0, 2.5),
            ],
            Symbol::Wash => &[(-5.0, 2.0), (-2.0, 4.5), (4.5, 4.5)],
            Symbol::Flood => &[(-2.5, 6.0), (2.5, 6.0)],
            Symbol::Lamp | Symbol::Head => &[],
        }
    }
}

/// A polygon of the set.
#[derive(Clone, Debug, PartialEq)]
pub struct PlottedSurface {
    /// Its corners in order.
    pub vertices: Vec<Vec3>,
    /// Channel or name of the light that it is, if it emits.
    pub label: Option<String>,
}

/// Pixels per metre on paper: 96 per inch, as in SVG.
const METRE: f64 = 96.0 / 0.0254;
/// A4 upright.
const A4: (f32, f32) = (794.0, 1123.0);
/// Space for the title and for the foot.
const HEAD: f32 = 36.0;
const FOOT: f32 = 48.0;
/// Space for the name of a view.
const NAME: f32 = 20.0;
/// Space for symbols and labels around a view.
const RIM: f32 = 26.0;
/// Half the length of a light's symbol.
const SYMBOL: f32 = 6.0;
const TEXT: f32 = 10.0;
/// The widest label.
const LONGEST: f32 = 120.0;
/// Line width of emitting surfaces.
const SHINING: f32 = 1.6;
/// Least length of an edge drawn.
const SHORTEST: f32 = 2.0;

/// One of the two views.
struct View {
    from_side: bool,
    /// Area of the stage on paper.
    frame: Frame,
    /// Stage position of the lower left corner.
    low: Vec3,
    /// Pixels per metre of the stage.
    scale: f64,
}

impl View {
    fn point(&self, at: Vec3) -> Point {
        let by = (at - self.low) * self.scale;
        let (x, y) = if self.from_side {
            (by.y, by.z)
        } else {
            (by.x, by.y)
        };
        (self.frame.x + x as f32, self.frame.bottom() - y as f32)
    }

    fn name(&self) -> &'static str {
        if self.from_side {
            "From stage left (house to the left)"
        } else {
            "From above (house below, stage left to the right)"
        }
    }

    /// Area for symbols and labels.
    fn room(&self) -> Frame {
        let Frame {
            x,
            y,
            width,
            height,
        } = self.frame;
        Frame::new(x - RIM, y - RIM, width + 2.0 * RIM, height + 2.0 * RIM)
    }
}

/// Draws the plot; also returns the denominator of its scale.
pub fn light_plot(data: &LightPlot, theme: Theme) -> (Drawing, u64) {
    let palette = theme.palette();
    let (views, denominator) = layout(data);
    let title = format!("{}: light plot", data.title);
    let mut drawing = Drawing::titled(&title, A4.0, A4.1, &palette);
    for view in &views {
        set(&mut drawing, data, view, &palette);
        lights(&mut drawing, data, view, &palette);
        let at = (view.frame.x - RIM, view.frame.y - RIM - 5.0);
        drawing.text(Label::new(view.name(), at, 12.0, palette.ink));
    }
    foot(&mut drawing, data, denominator, &palette);
    (drawing, denominator)
}

/// The top view above the side view, and the denominator of their scale.
fn layout(data: &LightPlot) -> ([View; 2], u64) {
    let [low, high] = extent(data);
    let Vec3 {
        x: wide,
        y: deep,
        z: tall,
    } = high - low;
    let between = 2.0 * RIM + NAME;
    let width = f64::from(A4.0 - 2.0 * (MARGIN + RIM)) / wide.max(deep);
    let height = f64::from(A4.1 - HEAD - FOOT - 2.0 * between) / (deep + tall);
    let denominator = round_scale(METRE / width.min(height));
    let scale = METRE / denominator as f64;
    let view = |y: f32, across: f64, up: f64, from_side: bool| {
        let (width, height) = ((scale * across) as f32, (scale * up) as f32);
        let frame = Frame::new(MARGIN + RIM, y, width, height);
        View {
            from_side,
            frame,
            low,
            scale,
        }
    };
    let plan = view(HEAD + NAME + RIM, wide, deep, false);
    let side = view(plan.frame.bottom() + between, deep, tall, true);
    ([plan, side], denominator)
}

/// Bounding box of all lights and surfaces, at least a metre along each axis.
fn extent(data: &LightPlot) -> [Vec3; 2] {
    let lights = data.lights.iter().map(|light| light.at);
    let surfaces = data
        .surfaces
        .iter()
        .flat_map(|surface| surface.vertices.iter().copied());
    let [low, high] = bounds(lights.chain(surfaces).filter(|at| at.is_finite()));
    [low, high.max(low + vec3(1.0, 1.0, 1.0))]
}

/// The least denominator of a scale ruler that is at least `least`.
fn round_scale(least: f64) -> u64 {
    let steps = [10, 15, 20, 25, 30, 40, 50, 75];
    let decades = (0..12).map(|power| 10_u64.pow(power));
    let mut all = decades.flat_map(|ten| steps.map(|step| step * ten));
    all.find(|scale| *scale as f64 >= least).unwrap_or(u64::MAX)
}

/// Draws the edges of the set thin, those of emitting surfaces strong.
fn set(drawing: &mut Drawing, data: &LightPlot, view: &View, palette: &Palette) {
    for shines in [false, true] {
        let mut edges = BTreeSet::new();
        for surface in data.surfaces.iter().filter(|s| s.label.is_some() == shines) {
            let points: Vec<Point> = surface.vertices.iter().map(|at| view.point(*at)).collect();
            let ends = points.iter().zip(points.iter().cycle().skip(1));
            for (a, b) in ends.filter(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1) >= SHORTEST) {
                // In half pixels, so that coincident edges are drawn once.
                let [a, b] =
                    [a, b].map(|p| ((2.0 * p.0).round() as i64, (2.0 * p.1).round() as i64));
                edges.insert((a.min(b), a.max(b)));
            }
        }
        let place = |(x, y): (i64, i64)| (x as f32 / 2.0, y as f32 / 2.0);
        let edge = |(a, b): ((i64, i64), (i64, i64))| {
            let (a, b) = (place(a), place(b));
            [Step::Move(a.0, a.1), Step::Line(b.0, b.1)]
        };
        let (colour, width) = if shines {
            (palette.ink, SHINING)
        } else {
            (palette.frame, 0.4)
        };
        drawing.path(
            edges.into_iter().flat_map(edge).collect(),
            Stroke::solid(colour, width),
        );
    }
}

/// Lights whose symbols would overlap.
struct Cluster<'d> {
    at: Point,
    lights: Vec<&'d PlottedLight>,
}

impl Cluster<'_> {
    fn distance(&self, (x, y): Point) -> f32 {
        (self.at.0 - x).hypot(self.at.1 - y)
    }
}

/// Draws aim lines, then a symbol and a label for each cluster of lights, then labels of emitting
/// surfaces.
fn lights(drawing: &mut Drawing, data: &LightPlot, view: &View, palette: &Palette) {
    let mut clusters: Vec<Cluster<'_>> = Vec::new();
    for light in &data.lights {
        let at = view.point(light.at);
        match clusters.iter_mut().find(|c| c.distance(at) < SYMBOL) {
            Some(cluster) => cluster.lights.push(light),
            None => clusters.push(Cluster {
                at,
                lights: vec![light],
            }),
        }
        if let Some(aim) = light.aim {
            aim_line(drawing, (at, view.point(aim)), view.room(), palette);
        }
    }
    let around = |(x, y): Point| Frame::new(x - SYMBOL, y - SYMBOL, 2.0 * SYMBOL, 2.0 * SYMBOL);
    let mut taken: Vec<Frame> = clusters.iter().map(|cluster| around(cluster.at)).collect();
    for Cluster { at, lights } in &clusters {
        let aim = lights.iter().find_map(|light| light.aim);
        let aim = aim.map_or(*at, |aim| view.point(aim));
        // Lights of several colours at one place leave the symbol empty.
        let gel = lights.first().and_then(|first| first.gel);
        let gel = gel.filter(|gel| lights.iter().all(|light| light.gel == Some(*gel)));
        if let Some(kind) = lights.iter().map(|light| light.symbol).max() {
            symbol(drawing, (*at, aim), (kind, gel), palette);
        }
    }
    for Cluster { at, lights } in &clusters {
        let text = joined(lights.iter().map(|light| light.label.as_str()).collect());
        label(drawing, (*at, &text), view.room(), &mut taken, palette);
    }
    for (name, at) in shining(data, view) {
        let near = clusters.iter().filter(|c| c.distance(at) < 5.0 * SYMBOL);
        let mut near = near.flat_map(|cluster| &cluster.lights);
        if !near.any(|light| light.label == name) {
            label(drawing, (at, name), view.room(), &mut taken, palette);
        }
    }
}

/// Draws a dashed line from a light to its aim, clipped to the area.
fn aim_line(drawing: &mut Drawing, (from, to): (Point, Point), room: Frame, palette: &Palette) {
    let along = |t: f32| (from.0 + t * (to.0 - from.0), from.1 + t * (to.1 - from.1));
    let mut ends = (0..=64).rev().map(|part| along(part as f32 / 64.0));
    let end = ends.find(|(x, y)| room.holds(&Frame::new(*x, *y, 0.0, 0.0)));
    let end = end.unwrap_or(from);
    drawing.line(from, end, dashed(palette));
    drawing.area(disc(end, 1.2), palette.quiet);
}

/// Labels of emitting surfaces, each at its largest polygon.
fn shining<'d>(data: &'d LightPlot, view: &View) -> impl Iterator<Item = (&'d str, Point)> {
    let mut largest: BTreeMap<&str, (f64, Vec3)> = BTreeMap::new();
    for PlottedSurface { vertices, label } in &data.surfaces {
        if let Some(label) = label {
            let (area, [low, high]) = (newell(vertices).length(), bounds(vertices));
            let known = largest.entry(label).or_default();
            if area > known.0 {
                *known = (area, (low + high) * 0.5);
            }
        }
    }
    let placed = largest.into_iter();
    placed.map(|(name, (_, at))| (name, view.point(at)))
}

/// Draws a light. A lantern points to its aim, or down the page when the aim is along the view; a
/// head is a circle around a dot, another lamp a circle around a cross.
fn symbol(
    drawing: &mut Drawing,
    (at, aim): (Point, Point),
    (kind, gel): (Symbol, Option<[u8; 3]>),
    palette: &Palette,
) {
    let line = Stroke::solid(palette.ink, 1.2);
    let (dx, dy) = (aim.0 - at.0, aim.1 - at.1);
    let length = dx.hypot(dy);
    let (x, y) = if length < SYMBOL {
        (0.0, 1.0)
    } else {
        (dx / length, dy / length)
    };
    let half = kind.half();
    let other = half.iter().rev().map(|(u, v)| (*u, -v));
    let corners = half.iter().copied().chain(other);
    let placed = |(u, v): Point| (at.0 + u * x - v * y, at.1 + u * y + v * x);
    let outline = match half {
        [] => disc(at, 5.0),
        _ => closed(&corners.map(placed).collect::<Vec<_>>()),
    };
    let fill = gel.map_or(palette.ground, |rgb| Colour { rgb, alpha: 1.0 });
    drawing.area(outline.clone(), fill);
    drawing.path(outline, line);
    if kind == Symbol::Head {
        drawing.area(disc(at, 1.8), palette.ink);
    }
    if kind == Symbol::Lamp {
        for up in [3.5, -3.5] {
            let (from, to) = ((at.0 - 3.5, at.1 - up), (at.0 + 3.5, at.1 + up));
            drawing.line(from, to, Stroke::solid(palette.ink, 0.8));
        }
    }
}

/// Draws a text near a position, where it covers no symbol and no other text, with a line to the
/// position if it is further away. A text without space is left out.
fn label(
    drawing: &mut Drawing,
    (at, text): (Point, &str),
    room: Frame,
    taken: &mut Vec<Frame>,
    palette: &Palette,
) {
    let text = font::fit(text, TEXT, LONGEST);
    let (width, height) = (font::width(&text, TEXT) + 5.0, TEXT + 1.0);
    let rings = (0..8).map(|ring| SYMBOL + 2.0 + 9.0 * ring as f32);
    let mut places = rings.flat_map(|away| {
        (0..16).map(move |turn| {
            let (up, across) = (turn as f32 * std::f32::consts::TAU / 16.0).sin_cos();
            let x = at.0 + across * (away + width / 2.0) - width / 2.0;
            let y = at.1 - up * (away + height / 2.0) - height / 2.0;
            (away, Frame::new(x, y, width, height))
        })
    });
    let is_free = |(_, frame): &(f32, Frame)| {
        room.holds(frame) && !taken.iter().any(|other| other.overlaps(frame))
    };
    let Some((away, frame)) = places.find(is_free) else {
        return;
    };
    if away > 2.0 * SYMBOL {
        drawing.line(at, frame.centre(), Stroke::solid(palette.quiet, 0.5));
    }
    drawing.rectangle(frame, palette.ground);
    drawing.text_around(&text, frame.centre(), TEXT, palette.ink);
    taken.push(frame);
}

/// Joins channels in order, three or more consecutive ones as a range; then names.
fn joined(labels: Vec<&str>) -> String {
    let mut numbers: Vec<u32> = labels
        .iter()
        .filter_map(|label| label.parse().ok())
        .collect();
    numbers.sort_unstable();
    numbers.dedup();
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let run = |run: &[u32]| match run {
        [first, _, .., last] => format!("{first}–{last}"),
        few => few
            .iter()
            .map(u32::to_string)
            .collect::<Vec<_>>()
            .join(", "),
    };
    let names: BTreeSet<&str> = labels
        .into_iter()
        .filter(|label| label.parse::<u32>().is_err())
        .collect();
    let all = runs.map(run).chain(names.into_iter().map(str::to_owned));
    all.collect::<Vec<_>>().join(", ")
}

/// Draws the scale bar and the scale below the legend of the symbols that the plot has.
fn foot(drawing: &mut Drawing, data: &LightPlot, denominator: u64, palette: &Palette) {
    let (y, scale) = (A4.1 - MARGIN - 6.0, METRE / denominator as f64);
    let decades = (-1..12).map(|power| 10_f64.powi(power));
    let lengths = decades.flat_map(|ten| [ten, 2.0 * ten, 5.0 * ten]);
    let metres = lengths
        .take_while(|metres| metres * scale <= 200.0)
        .last()
        .unwrap_or(0.1);
    let length = (metres * scale) as f32;
    drawing.rectangle(Frame::new(MARGIN, y - 6.0, length, 6.0), palette.ink);
    for part in [1.0, 3.0] {
        let frame = Frame::new(
            MARGIN + 0.25 * part * length,
            y - 5.0,
            0.25 * length - 1.0,
            4.0,
        );
        drawing.rectangle(frame, palette.ground);
    }
    let text = format!("{metres} m    1:{denominator} on A4");
    let at = (MARGIN + length + 8.0, y);
    drawing.text(Label::new(&text, at, TEXT, palette.ink));
    let name = |drawing: &mut Drawing, (x, y): Point, text: &str| {
        drawing.text(Label::new(text, (x + 24.0, y + 4.0), TEXT, palette.ink));
        (x + font::width(text, TEXT) + 40.0, y)
    };
    let mut at = (MARGIN, y - 19.0);
    for (kind, text) in Symbol::LEGEND {
        if data.lights.iter().any(|light| light.symbol == kind) {
            let (middle, aim) = ((at.0 + 9.0, at.1), (at.0 + 18.0, at.1));
            symbol(drawing, (middle, aim), (kind, None), palette);
            at = name(drawing, at, text);
        }
    }
    let shining = Stroke::solid(palette.ink, SHINING);
    for (line, text) in [(shining, "shining surface"), (dashed(palette), "aim")] {
        drawing.line(at, (at.0 + 18.0, at.1), line);
        at = name(drawing, at, text);
    }
}

fn dashed(palette: &Palette) -> Stroke {
    Stroke::dashed(palette.quiet, 0.5, (4.0, 3.0))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "tests")]

    use super::*;

    fn light(at: Vec3, label: &str) -> PlottedLight {
        PlottedLight {
            at,
            aim: Some(vec3(0.0, 0.0, 0.0)),
            label: label.to_owned(),
            symbol: Symbol::Profile,
            gel: None,
        }
    }

    #[test]
    fn a_metre_on_paper_is_a_metre_over_the_scale() {
        let data = LightPlot {
            lights: vec![
                light(vec3(-5.0, -8.0, 6.0), "1"),
                light(vec3(5.0, 2.0, 6.0), "2"),
            ],
            ..LightPlot::default()
        };
        let ([plan, side], denominator) = layout(&data);
        let metres = |pixels: f32| f64::from(pixels) / 96.0 * 0.0254 * denominator as f64;
        let [a, b] = [0, 1].map(|light| plan.point(data.lights[light].at));
        assert!((metres(b.0 - a.0) - 10.0).abs() < 1e-4);
        assert!((metres(a.1 - b.1) - 10.0).abs() < 1e-4);
        let [a, b] = [0, 1].map(|light| side.point(data.lights[light].at));
        assert!((metres(b.0 - a.0) - 10.0).abs() < 1e-4 && a.1 == b.1);
        assert!(plan.room().bottom() < side.room().y && side.room().bottom() < A4.1 - FOOT);
    }

    /// Forty lights on four pipes: every channel is written once in the plan, and no text covers
    /// another.
    #[test]
    fn labels_do_not_cover_each_other() {
        let at = |n: u32| vec3(0.5 * f64::from(n % 10), f64::from(n / 10), 5.0);
        let lights = (0..40).map(|n| light(at(n), &(100 + 2 * n).to_string()));
        let data = LightPlot {
            lights: lights.collect(),
            ..LightPlot::default()
        };
        let (drawing, _) = light_plot(&data, Theme::Light);
        let texts = drawing.text_boxes();
        for (index, (text, frame)) in texts.iter().enumerate() {
            let covers = |(_, other): &&(String, Frame)| {
                let line = |f: &Frame| Frame::new(f.x, f.centre().1 - 5.0, f.width, 10.0);
                line(frame).overlaps(&line(other))
            };
            let covered = texts[index + 1..].iter().find(covers);
            assert_eq!(covered, None, "{text}");
        }
        for channel in (0..40).map(|n| (100 + 2 * n).to_string()) {
            assert_eq!(texts.iter().filter(|(text, _)| *text == channel).count(), 1);
        }
    }

    #[test]
    fn the_legend_names_the_kinds_of_the_plot() {
        let of = |kinds: &[Symbol]| {
            let lights = kinds.iter().zip(0_u8..);
            let placed = |(symbol, n): (&Symbol, u8)| PlottedLight {
                symbol: *symbol,
                ..light(vec3(f64::from(n), 3.0, 5.0), "1")
            };
            let data = LightPlot {
                lights: lights.map(placed).collect(),
                ..LightPlot::default()
            };
            light_plot(&data, Theme::Light).0.text_boxes()
        };
        let all = Symbol::LEGEND.map(|(symbol, _)| symbol);
        let (few, all) = (of(&[Symbol::Head]), of(&all));
        let has = |texts: &[(String, Frame)], name| texts.iter().any(|(text, _)| text == name);
        for (symbol, name) in Symbol::LEGEND {
            assert!(has(&all, name), "{name}");
            assert_eq!(has(&few, name), symbol == Symbol::Head, "{name}");
        }
        let right = all.iter().map(|(_, frame)| frame.x + frame.width);
        assert!(right.fold(0.0, f32::max) <= A4.0 - MARGIN);
    }

    #[test]
    fn a_symbol_has_the_colour_of_its_gel_unless_another_light_hides_behind_it() {
        let of = |gels: [[u8; 3]; 2]| {
            let lit = gels.map(|gel| PlottedLight {
                gel: Some(gel),
                ..light(vec3(0.0, 3.0, 5.0), "1")
            });
            let data = LightPlot {
                lights: lit.into(),
                ..LightPlot::default()
            };
            light_plot(&data, Theme::Light).0.svg()
        };
        let (blue, red) = ([0x20, 0x40, 0xff], [0xff, 0x20, 0x20]);
        assert!(of([blue, blue]).contains("#2040ff"));
        let mixed = of([blue, red]);
        assert!(!mixed.contains("#2040ff") && !mixed.contains("#ff2020"));
    }

    #[test]
    fn channels_that_follow_each_other_are_a_range() {
        let said = joined(vec!["12", "spill", "3", "2", "1", "11", "12"]);
        assert_eq!(said, "1–3, 11, 12, spill");
    }
}
