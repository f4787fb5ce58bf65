//! Where methods fail, and what is shipped instead: one against the other on inputs made hard.
//!
//! Every figure is computed here and now by the shipped code and by the naive methods beside it;
//! nothing is read from a file, and every run gives the same. Some seconds in all.

pub mod decomposition;
pub mod furnace;
pub mod hard;
pub mod knot;
pub mod lamp;
pub mod orthogonality;
pub mod wide;

use std::fmt::Write as _;

use self::furnace::{FEW, Furnace, REFLECTANCES};
use self::lamp::Lamp;
use super::comparison::figure;
use super::{Kind, Machine, Quantity, Record, Series};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::renderer::TransportError;
use crate::work::Work;

/// Random matrices of each random kind.
const RANDOM: usize = 60;
/// Elements of the furnace.
const ELEMENTS: usize = 200;
/// Metres from floor to lamp.
const DISTANCES: [f64; 9] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
/// Pixels along a hemicube's edge.
const RESOLUTIONS: [usize; 6] = [8, 16, 32, 64, 128, 256];
/// The hemicubes that distances are tried with.
const CUBES: [usize; 2] = [16, 64];
/// Points of the floor.
const POINTS: u64 = 100;
/// A lamp half a metre wide.
const SIDE: f64 = 0.5;
/// Where resolutions are tried: as wide a room as a lid, at half its width.
const LID: Lamp = Lamp {
    width: 2.0,
    depth: 2.0,
    height: 1.0,
};
/// Smaller residuals are as good as none, and none has no place on a log axis.
const LEAST: f64 = 1e-4;

const CONDITION: &str = "condition number";
const LOSS: &str = "loss of orthogonality";
const PLACE: &str = "matrices, worst first";
const RESIDUAL: &str = "residual, in what rounding explains";
const MET: &str = "1 / (1 - reflectance)";
const MISSED: &str = "radiosity off by";
const SWEEPS: &str = "products or sweeps to 0.1 %";
const DISTANCE: &str = "distance of the lamp";
const RESOLUTION: &str = "pixels along a hemicube's edge";
const OFF: &str = "form factor off by";
const MOVING: &str = "banks that move at once";
const KNOTS: &str = "knots a show";

/// A panel of the chart: which series it shows, and of which columns.
struct View {
    /// What its series' names begin with.
    prefix: &'static str,
    x: (&'static str, Scale),
    y: (&'static str, Scale),
}

const VIEWS: [View; 6] = [
    View {
        prefix: "orthogonality",
        x: (CONDITION, Scale::Log),
        y: (LOSS, Scale::Log),
    },
    View {
        prefix: "decomposition",
        x: (PLACE, Scale::Log),
        y: (RESIDUAL, Scale::Log),
    },
    View {
        prefix: "furnace",
        x: (MET, Scale::Log),
        y: (MISSED, Scale::Log),
    },
    View {
        prefix: "lamp",
        x: (DISTANCE, Scale::Log),
        y: (OFF, Scale::Log),
    },
    View {
        prefix: "hemicube",
        x: (RESOLUTION, Scale::Log),
        y: (OFF, Scale::Log),
    },
    View {
        prefix: "knots",
        x: (MOVING, Scale::Log),
        y: (KNOTS, Scale::Log),
    },
];

/// Rows on their way into the record.
struct Sheet {
    record: Record,
}

impl Sheet {
    /// A row of a panel's series: the values of some columns.
    fn add(&mut self, series: &str, label: &str, values: &[(&str, f64)]) {
        let mut row = vec![None; self.record.quantities.len()];
        for (column, value) in values {
            if let Some(cell) = self.record.column(column).and_then(|c| row.get_mut(c)) {
                *cell = Some(*value);
            }
        }
        self.record.add(series, label, &[], &row);
    }
}

/// Every study, one after the other.
///
/// # Errors
/// Cancel; else none in practice.
pub fn study(machine: Machine, work: Work<'_>) -> Result<Record, TransportError> {
    let quantities = [
        (CONDITION, ""),
        (LOSS, ""),
        (PLACE, ""),
        (RESIDUAL, ""),
        (MET, ""),
        (MISSED, "%"),
        (SWEEPS, ""),
        (DISTANCE, "m"),
        (RESOLUTION, ""),
        (OFF, "%"),
        (MOVING, ""),
        (KNOTS, ""),
    ];
    let quantities = quantities.map(|(n, u)| Quantity::new(n, u)).into();
    let method = "computed by this run; the same on every run";
    let mut out = Sheet {
        record: Record::new(Kind::Stability, "Stability", machine, method, quantities),
    };
    type Part = fn(&mut Sheet, Work<'_>) -> Result<(), TransportError>;
    let parts: [Part; 6] = [
        orthogonality,
        decomposition,
        reflected,
        distances,
        resolutions,
        knots,
    ];
    for (done, part) in parts.iter().enumerate() {
        work.check()?;
        work.progress.report("studies", done, parts.len());
        part(&mut out, work)?;
    }
    Ok(out.record)
}

fn orthogonality(out: &mut Sheet, work: Work<'_>) -> Result<(), TransportError> {
    for (family, matrices) in orthogonality::families() {
        work.check()?;
        for a in &matrices {
            let condition = orthogonality::condition(a);
            for (name, way) in orthogonality::WAYS {
                let loss = orthogonality::loss(&way(a));
                let series = format!("orthogonality: {name}");
                out.add(&series, family, &[(CONDITION, condition), (LOSS, loss)]);
            }
        }
    }
    Ok(())
}

fn decomposition(out: &mut Sheet, work: Work<'_>) -> Result<(), TransportError> {
    let all = hard::list(RANDOM);
    let solvers: [(&str, decomposition::Solver); 2] = [
        ("Footlight", decomposition::ours),
        ("nalgebra", decomposition::nalgebra),
    ];
    // nalgebra takes empty matrices for a fault.
    let full: Vec<hard::Hard> = all.into_iter().filter(|h| !h.matrix.is_empty()).collect();
    for (name, solve) in solvers {
        work.check()?;
        for (i, residual) in decomposition::residuals(&full, solve)
            .into_iter()
            .enumerate()
        {
            let values = [(PLACE, i as f64 + 1.0), (RESIDUAL, residual)];
            out.add(&format!("decomposition: {name}"), "", &values);
        }
    }
    Ok(())
}

fn reflected(out: &mut Sheet, work: Work<'_>) -> Result<(), TransportError> {
    let furnace = Furnace::new(ELEMENTS)?;
    for reflectance in REFLECTANCES {
        let solved = furnace.solve(reflectance, work)?;
        let label = format!("reflectance {reflectance}");
        let met = 1.0 / (1.0 - f64::from(reflectance));
        let rows = [
            ("Chebyshev (shipped)", solved.ours, Some(solved.products)),
            ("Gauss-Seidel, as many sweeps", solved.seidel, None),
            ("Jacobi, as many products", solved.jacobi, None),
            ("four bounces", solved.few, Some(FEW)),
        ];
        for (name, off, products) in rows {
            let sweeps = match name {
                n if n.starts_with("Jacobi") => Some(furnace.sweeps(reflectance, false)),
                n if n.starts_with("Gauss") => Some(furnace.sweeps(reflectance, true)),
                _ => products,
            };
            let mut values = vec![(MET, met), (MISSED, 100.0 * off)];
            values.extend(sweeps.map(|s| (SWEEPS, s as f64)));
            out.add(&format!("furnace: {name}"), &label, &values);
        }
        work.check()?;
    }
    Ok(())
}

fn distances(out: &mut Sheet, work: Work<'_>) -> Result<(), TransportError> {
    for height in DISTANCES {
        let lamp = Lamp {
            width: SIDE,
            depth: SIDE,
            height,
        };
        let mut row = |name: &str, off: f64| {
            let label = format!("{height} m");
            let values = [(DISTANCE, height), (OFF, 100.0 * off)];
            out.add(&format!("lamp: {name}"), &label, &values);
        };
        for (i, resolution) in CUBES.into_iter().enumerate() {
            work.check()?;
            let seen = lamp.seen(resolution, height.max(SIDE), POINTS, work)?;
            if i == 0 {
                row("closed form (shipped)", seen.ours);
                row("taken for a point", seen.point);
            }
            row(&format!("hemicube of {resolution}"), seen.hemicube);
        }
    }
    Ok(())
}

fn resolutions(out: &mut Sheet, work: Work<'_>) -> Result<(), TransportError> {
    for resolution in RESOLUTIONS {
        work.check()?;
        let seen = LID.seen(resolution, LID.height, POINTS, work)?;
        let mean = LID.aliasing(resolution, POINTS)?;
        let rows = [
            ("mean of many, turned (shipped)", mean.turned),
            ("mean of many, all aligned", mean.aligned),
            ("a point alone", seen.hemicube),
            ("closed form, as for lamps", seen.ours),
        ];
        for (name, off) in rows {
            let label = format!("{resolution} pixels");
            let values = [(RESOLUTION, resolution as f64), (OFF, 100.0 * off)];
            out.add(&format!("hemicube: {name}"), &label, &values);
        }
    }
    Ok(())
}

fn knots(out: &mut Sheet, _work: Work<'_>) -> Result<(), TransportError> {
    for (banks, counts) in knot::counted() {
        let found = knot::summary(banks, &counts);
        let label = format!("{} shows of {banks} banks", counts.len());
        let rows = [
            ("fewest (shipped)", found.fewest),
            ("halving", found.bisection),
            ("halving, the worst show", found.most as f64),
        ];
        for (name, count) in rows {
            let values = [(MOVING, banks as f64), (KNOTS, count)];
            out.add(&format!("knots: {name}"), &label, &values);
        }
    }
    Ok(())
}

/// A record's series of a panel, with the names that they have there.
fn of_view<'a>(record: &'a Record, view: &View) -> Vec<(&'a str, &'a Series)> {
    let named = |s: &'a Series| {
        let (prefix, name) = s.name.split_once(": ")?;
        (prefix == view.prefix).then_some((name, s))
    };
    record.series.iter().filter_map(named).collect()
}

/// The chart of a record made by [`study`].
pub fn drawing(record: &Record, theme: Theme) -> Drawing {
    let panels: Vec<Panel> = VIEWS.iter().map(|view| panel(record, view)).collect();
    let title = "Where the usual methods fail, and what Footlight does instead";
    chart::panels(title, &panels, theme)
}

const MARKERS: [Marker; 4] = [
    Marker::Circle,
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
];

fn panel(record: &Record, view: &View) -> Panel {
    let axis = |(name, scale): (&str, Scale)| {
        let heading = record.column(name).and_then(|c| record.quantities.get(c));
        let heading = heading.map_or_else(|| name.to_owned(), Quantity::heading);
        Axis::new(&heading, scale)
    };
    let ordered = shipped_first(of_view(record, view));
    let series = ordered.into_iter().zip(MARKERS.into_iter().cycle());
    Panel {
        title: finding(record, view),
        x: axis(view.x),
        y: axis(view.y),
        series: series
            .map(|((name, series), marker)| chart::Series {
                name: name.to_owned(),
                points: points(record, series, view),
                marker,
                labels: Vec::new(),
            })
            .collect(),
        reference: (view.prefix == "decomposition").then(|| (1.0, "rounding".to_owned())),
    }
}

/// What is shipped has the first hue in every panel.
fn shipped_first<'a>(mut all: Vec<(&'a str, &'a Series)>) -> Vec<(&'a str, &'a Series)> {
    all.sort_by_key(|(name, _)| !(name.contains("(shipped)") || *name == "Footlight"));
    all
}

/// A series' curve from left to right; of the families of matrices the look's near-copies alone,
/// which are what a show has.
fn points(record: &Record, series: &Series, view: &View) -> Vec<(f64, f64)> {
    let curve = record.curve(series, view.x.0, view.y.0);
    let labelled = series.points.iter().zip(curve);
    let wanted = labelled.filter(|(p, _)| view.x.0 != CONDITION || p.label == "near-copies");
    let shown = |(_, (x, y)): (&super::Point, (f64, f64))| {
        // Nothing wrong at all is drawn at the foot.
        let y = match view.y.0 {
            RESIDUAL => y.max(LEAST),
            _ => y,
        };
        (x, y)
    };
    let mut out: Vec<(f64, f64)> = wanted.map(shown).collect();
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

/// The largest value of a column in a series.
fn most(record: &Record, name: &str, column: &str) -> f64 {
    let series = record.series.iter().find(|s| s.name == name);
    let values = series.map_or(Vec::new(), |s| record.curve(s, column, column));
    values.into_iter().map(|p| p.0).fold(0.0, f64::max)
}

/// What a panel shows, in a line, with figures of the record.
fn finding(record: &Record, view: &View) -> String {
    match view.prefix {
        "orthogonality" => "Near-copies of a look: how orthogonal does a basis stay?".to_owned(),
        "decomposition" => {
            let beyond = |name: &str| {
                let series = record.series.iter().find(|s| s.name == name);
                let all = series.map_or(Vec::new(), |s| record.curve(s, PLACE, RESIDUAL));
                // An absent figure is no answer at all.
                let wrong = all.iter().filter(|(_, r)| r.is_nan() || *r > 1.0).count();
                (wrong, all.len())
            };
            let (theirs, all) = beyond("decomposition: nalgebra");
            let (ours, _) = beyond("decomposition: Footlight");
            format!("SVD of {all} matrices: nalgebra wrong on {theirs}, ours on {ours}")
        }
        "furnace" => {
            let at = REFLECTANCES.last().copied().unwrap_or_default();
            let few = most(record, "furnace: four bounces", MISSED) / 100.0;
            format!("Four bounces lose {} % at reflectance {at}", figure(few))
        }
        "lamp" => "A lamp of 0.5 m over the floor: what sees it right?".to_owned(),
        "hemicube" => "Reflected light: errors of cubes add up, or cancel".to_owned(),
        _ => "Knots for positive keys, on 500 random shows".to_owned(),
    }
}

/// The findings in words.
pub fn describe(record: &Record) -> String {
    let mut out = String::new();
    for view in &VIEWS {
        let _ = writeln!(out, "{}", finding(record, view));
        for (name, series) in shipped_first(of_view(record, view)) {
            let values = record.curve(series, view.y.0, view.y.0);
            let known = || values.iter().map(|p| p.0).filter(|v| v.is_finite());
            let (low, high) = (
                known().fold(f64::INFINITY, f64::min),
                known().fold(0.0, f64::max),
            );
            let _ = writeln!(out, "  {name:<32} {low:>9.2e} to {high:>8.2e}");
        }
    }
    out
}
