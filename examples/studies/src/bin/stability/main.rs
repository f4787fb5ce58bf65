//! Failures of common methods, and Footlight's alternatives. `cargo run --release -p
//! footlight-studies --bin stability [CHART.png | CHART.svg]` prints the range of each curve and
//! draws them. The figures are those of `tests/stability`, equal on every run.

mod curves;
#[path = "../../../../../tests/stability/methods/mod.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod methods;

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use footlight_studies::dice;

use curves::{Curve, View, curves};
use footlight_host::files::{Disk, Store};
use footlight_report::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use footlight_report::{format, words::figure};
use methods::Stability;
use methods::furnace::REFLECTANCES;

/// Least residual drawn: smaller ones count as none, and zero cannot be shown on a log axis.
const LEAST: f64 = 1e-4;

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Box<dyn Error>> {
    let found = methods::study()?;
    print!("{}", describe(&found));
    if let Some(path) = std::env::args().nth(1) {
        let path = Path::new(&path);
        let drawing = drawing(&found, Theme::Light);
        Disk.write(path, &format::drawing(&drawing, 1.0, path)?)?;
    }
    Ok(())
}

/// The chart: a panel for each study.
fn drawing(stability: &Stability, theme: Theme) -> Drawing {
    let panels = View::ALL.map(|view| panel(stability, view));
    let title = "Where the usual methods fail, and what Footlight does instead";
    chart::panels(title, &panels, theme)
}

const MARKERS: [Marker; 4] = [
    Marker::Circle,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
];

fn panel(stability: &Stability, view: View) -> Panel {
    let curves = shipped_first(curves(stability, view));
    let series = |(curve, marker): (Curve, Marker)| chart::Series {
        points: points(&curve, view),
        name: curve.name,
        marker,
        labels: Vec::new(),
    };
    let marked = curves.into_iter().zip(MARKERS.into_iter().cycle());
    let [x, y] = view.axes().map(|label| Axis::new(label, Scale::Log));
    Panel {
        title: finding(stability, view),
        x,
        y,
        series: marked.map(series).collect(),
        reference: (view == View::Decomposition).then(|| (1.0, "rounding".to_owned())),
    }
}

/// Gives the shipped method the first hue in every panel.
fn shipped_first(mut all: Vec<Curve>) -> Vec<Curve> {
    all.sort_by_key(|curve| !curve.shipped);
    all
}

/// A curve from left to right, without values that are not finite.
fn points(curve: &Curve, view: View) -> Vec<(f64, f64)> {
    let mut out = curve.points.clone();
    out.retain(|(_, y)| y.is_finite());
    if view == View::Decomposition {
        for (_, y) in &mut out {
            *y = y.max(LEAST);
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// One line about a panel, with figures of the study.
fn finding(stability: &Stability, view: View) -> String {
    match view {
        View::Orthogonality => {
            "Near-copies of a look: how orthogonal does a basis stay?".to_owned()
        }
        View::Decomposition => format!(
            "SVD of {} matrices: nalgebra wrong on {}, ours on {}",
            stability.nalgebra.0.len(),
            stability.nalgebra.wrong(),
            stability.ours.wrong()
        ),
        View::Furnace => {
            let at = REFLECTANCES.last().copied().unwrap_or_default();
            let few = stability.furnace.iter().map(|r| r.solved.few);
            let few = few.filter(|f| f.is_finite()).fold(0.0, f64::max);
            format!("Four bounces lose {} % at reflectance {at}", figure(few))
        }
        View::Lamp => "A lamp of 0.5 m over the floor: what sees it right?".to_owned(),
        View::Hemicube => "Reflected light: errors of cubes add up, or cancel".to_owned(),
        View::Knots => "Knots for positive keys, on 500 random shows".to_owned(),
    }
}

/// One line about each panel, and the range of each of its curves.
fn describe(stability: &Stability) -> String {
    let mut out = String::new();
    for view in View::ALL {
        let _ = writeln!(out, "{}", finding(stability, view));
        for curve in shipped_first(curves(stability, view)) {
            let known = || curve.points.iter().map(|p| p.1).filter(|y| y.is_finite());
            let (low, high) = (
                known().fold(f64::INFINITY, f64::min),
                known().fold(0.0, f64::max),
            );
            let _ = writeln!(out, "  {:<32} {low:>9.2e} to {high:>8.2e}", curve.name);
        }
    }
    out
}
