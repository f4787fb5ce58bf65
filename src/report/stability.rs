//! Where the usual methods fail, and what is shipped instead.

mod curves;

use std::fmt::Write as _;

use self::curves::{Column, Curve, View, curves};
use super::words::{drawn, figure};
use super::{Kind, Quantity, Record};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Theme};
use crate::study::stability::Stability;
use crate::study::stability::decomposition::Failures;
use crate::study::stability::furnace::REFLECTANCES;
use crate::study::{Machine, Origin};

/// Smaller residuals are as good as none, and none has no place on a log axis.
const LEAST: f64 = 1e-4;

/// The table: a series for each curve, its values in the columns of its panel.
pub fn record(stability: &Stability) -> Record {
    let origin = Origin {
        subject: "Stability".to_owned(),
        machine: stability.machine.clone(),
    };
    let method = "computed by this run; the same on every run";
    let quantities = Column::ALL.map(Column::quantity).into();
    let mut out = Record::new(Kind::Stability, &origin, method, quantities);
    for view in View::ALL {
        let [x, y] = view.axes().map(|(column, _)| column);
        for curve in curves(stability, view) {
            let series = format!("{}: {}", view.prefix(), curve.name);
            for point in &curve.points {
                let values = Column::ALL.map(|column| match column {
                    column if column == x => Some(point.x),
                    column if column == y => Some(point.y),
                    Column::Sweeps => point.sweeps.map(|s| s as f64),
                    _ => None,
                });
                out.add(&series, &point.label, &[], &values);
            }
        }
    }
    out
}

/// The chart: a panel for each study.
pub fn drawing(stability: &Stability, theme: Theme) -> Drawing {
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
    let [x, y] = view
        .axes()
        .map(|(column, scale)| Axis::new(&column.quantity().heading(), scale));
    Panel {
        title: finding(stability, view),
        x,
        y,
        series: marked.map(series).collect(),
        reference: (view == View::Decomposition).then(|| (1.0, "rounding".to_owned())),
    }
}

/// What is shipped has the first hue in every panel.
fn shipped_first(mut all: Vec<Curve>) -> Vec<Curve> {
    all.sort_by_key(|curve| !curve.shipped);
    all
}

/// A curve from left to right.
fn points(curve: &Curve, view: View) -> Vec<(f64, f64)> {
    let shown = curve.points.iter().filter(|p| p.in_chart).map(|p| {
        let y = drawn(Some(p.y));
        // Nothing wrong at all is drawn at the foot.
        let y = match view {
            View::Decomposition => y.max(LEAST),
            _ => y,
        };
        (drawn(Some(p.x)), y)
    });
    let mut out: Vec<(f64, f64)> = shown.collect();
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// What a panel shows, in a line, with figures of the study.
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

/// What each panel shows, and the range of each of its curves.
pub fn describe(stability: &Stability) -> String {
    let mut out = String::new();
    for view in View::ALL {
        let _ = writeln!(out, "{}", finding(stability, view));
        for curve in shipped_first(curves(stability, view)) {
            let known = || curve.points.iter().map(|p| p.y).filter(|y| y.is_finite());
            let (low, high) = (
                known().fold(f64::INFINITY, f64::min),
                known().fold(0.0, f64::max),
            );
            let _ = writeln!(out, "  {:<32} {low:>9.2e} to {high:>8.2e}", curve.name);
        }
    }
    out
}

/// The table of what solvers make of the hard list: a series for each, a point for each family.
pub fn failures(solvers: &[(&str, Vec<Failures>)]) -> Record {
    let mut quantities = vec![Quantity::new("matrices", "")];
    let counted = [
        "no answer",
        "residual",
        "sum of squares",
        "orthogonality",
        "values",
        "small values",
    ];
    quantities.extend(counted.map(|name| Quantity::new(name, "failures")));
    quantities.push(Quantity::new("worst residual", ""));
    quantities.push(Quantity::new("worst value", "of the largest"));
    let origin = Origin {
        subject: "Hard matrices".to_owned(),
        machine: Machine::here(1, None),
    };
    let method = "failure: beyond 16 eps sqrt(mn); truth planted or in double-double arithmetic";
    let mut out = Record::new(Kind::Stability, &origin, method, quantities);
    for (solver, families) in solvers {
        for row in families {
            let mut values = vec![Some(row.matrices as f64)];
            values.extend(row.counts.map(|n| Some(n as f64)));
            values.extend([Some(row.residual), Some(row.value)]);
            out.add(solver, row.family, &[], &values);
        }
    }
    out
}
