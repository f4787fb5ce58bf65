//! The ways to an error: as predicted in words, as measured in a chart.

use std::fmt::Write as _;

use super::words::{count, drawn, error, percent, seconds};
use super::{Kind, Quantity, Record};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use crate::engine::measure::tune::Ways;
use crate::engine::{Goal, Way, WayForecast};

/// Seconds of a refined picture of an outside renderer, whose pictures share nothing; those of a coarse
/// one are to it as in the paper (Dorsey, Arvo and Greenberg 1995), 3 minutes to 2 hours.
const OUTSIDE: [f64; 2] = [1.5, 60.0];

const METHOD: &str = "the truth: every source at the finest step; seconds with an outside renderer: 60 a \
    picture at the refined step, 1.5 a coarse one";

/// A table of ways, the one that is taken first; empty where nothing is known of them yet.
pub fn describe(ways: &[WayForecast], goal: &Goal) -> String {
    let mut text = String::new();
    if ways.is_empty() {
        return text;
    }
    let _ = match goal.until {
        Some(until) => writeln!(
            text,
            "ways to an error of {}",
            error(until.error, until.unit)
        ),
        None => writeln!(text, "ways"),
    };
    for (i, way) in ways.iter().enumerate() {
        let mark = match (i, way.reaches) {
            (0, true) => "  <- taken",
            (0, false) => "  <- taken: the nearest",
            (_, true) => "",
            (_, false) => "  does not reach it",
        };
        let _ = writeln!(
            text,
            "  {:<46} {:>8}  {:>9}{mark}",
            name(way),
            seconds(way.seconds),
            error(way.error, goal.unit())
        );
    }
    text
}

/// What a way renders.
fn name(way: &WayForecast) -> String {
    let quality = way.quality;
    let mixtures = count(way.mixed, "mixture");
    match (way.way, way.alone, way.mixed) {
        (_, 0, 0) => "what is there".to_owned(),
        (Way::Alone, ..) => format!("every bank alone at quality {quality}"),
        (_, 0, _) => format!("{mixtures} at quality {quality}"),
        (_, _, 0) => format!("coarse pictures up to quality {quality}"),
        _ => format!("coarse pictures, {mixtures} at quality {quality}"),
    }
}

/// The way that is taken and the next best, in a line; empty where nothing is known of them.
pub fn taken(ways: &[WayForecast]) -> String {
    let [first, rest @ ..] = ways else {
        return String::new();
    };
    let of = |way: &WayForecast| format!("{}, {}", name(way), seconds(way.seconds));
    let mut text = of(first);
    let other = |way: &&WayForecast| way.reaches && name(way) != name(first);
    if let Some(next) = rest.iter().find(other) {
        let _ = write!(text, "; next best: {}", of(next));
    }
    text
}

/// A point of a way: its label, seconds with this renderer and with an outside one, error.
struct Point {
    label: String,
    seconds: [f64; 2],
    error: f64,
}

/// Every source alone, by step.
fn alone(ways: &Ways) -> Vec<Point> {
    let sources = ways.sources as f64;
    // The last step is the truth.
    let known = ways.steps.iter().take(ways.steps.len().saturating_sub(1));
    let point = |step: &crate::engine::measure::tuner::StepCost| {
        let [coarse, refined] = OUTSIDE;
        let each = if step.quality < ways.refined {
            coarse
        } else {
            refined
        };
        Point {
            label: format!("quality {}", step.quality),
            seconds: [step.fixed + step.picture * sources, each * sources],
            error: step.error,
        }
    };
    known.map(point).collect()
}

/// Coarse pictures and mixtures, by their number.
fn mixed(ways: &Ways) -> Vec<Point> {
    let [coarse, refined] = OUTSIDE;
    let begin = 2.0 * coarse * ways.sources as f64;
    let point = |c: &crate::engine::measure::Candidate| Point {
        label: c.pictures.to_string(),
        seconds: [c.seconds, begin + refined * c.pictures as f64],
        error: c.error,
    };
    ways.mixtures.iter().map(point).collect()
}

const ALONE: &str = "every bank alone";
const MIXED: &str = "coarse pictures and mixtures";

/// The table: a series for each way.
pub fn record(ways: &Ways) -> Record {
    let quantities = [
        ("true error of the worst moment", "%"),
        ("seconds", "s"),
        ("seconds with an outside renderer", "s"),
    ];
    let quantities = quantities
        .map(|(name, unit)| Quantity::new(name, unit))
        .into();
    let mut out = Record::new(Kind::Plan, &ways.origin, METHOD, quantities);
    for (series, points) in [(ALONE, alone(ways)), (MIXED, mixed(ways))] {
        for point in points {
            let [own, outside] = point.seconds;
            let values = [100.0 * point.error, own, outside].map(Some);
            out.add(series, &point.label, &[], &values);
        }
    }
    out
}

/// The chart: error against seconds for each way, with this renderer and with an outside one.
pub fn drawing(ways: &Ways, theme: Theme) -> Drawing {
    let all = [
        (ALONE, Marker::Square, alone(ways)),
        (MIXED, Marker::Circle, mixed(ways)),
    ];
    let titles = [
        "This renderer",
        "An outside renderer, 60 s a refined picture",
    ];
    let panels: Vec<Panel> = titles
        .into_iter()
        .enumerate()
        .map(|(which, title)| panel(title, which, &all))
        .collect();
    let title = format!("{}: which way is the cheaper?", ways.origin.subject);
    chart::panels(&title, &panels, theme)
}

fn panel(title: &str, which: usize, ways: &[(&str, Marker, Vec<Point>)]) -> Panel {
    let series = |(name, marker, points): &(&str, Marker, Vec<Point>)| Series {
        name: (*name).to_owned(),
        points: points
            .iter()
            .map(|p| {
                let seconds = p.seconds.get(which).copied();
                (drawn(seconds), drawn(Some(100.0 * p.error)))
            })
            .collect(),
        marker: *marker,
        labels: match *name {
            ALONE => points.iter().map(|p| p.label.clone()).collect(),
            _ => Vec::new(),
        },
    };
    Panel {
        title: title.to_owned(),
        x: Axis::new("seconds, from nothing stored", Scale::Log),
        y: Axis::new("true error of the worst moment, %", Scale::Log),
        series: ways.iter().map(series).collect(),
        reference: None,
    }
}

/// A line for each point.
pub fn measured(ways: &Ways) -> String {
    let mut text = format!(
        "{:<40} {:>8}  {:>9}  {:>17}\n",
        "way", "off by", "takes", "outside renderer"
    );
    for (name, points) in [(ALONE, alone(ways)), (MIXED, mixed(ways))] {
        for point in points {
            let [own, outside] = point.seconds.map(seconds);
            let label = format!("{name}, {}", point.label);
            let error = percent(point.error);
            let _ = writeln!(text, "{label:<40} {error:>6} %  {own:>9}  {outside:>17}");
        }
    }
    text
}
