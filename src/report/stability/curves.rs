//! The curves of each panel, with their names.

use crate::chart::Scale;
use crate::report::Quantity;
use crate::study::stability::furnace::{FEW, Solved};
use crate::study::stability::knot::Knots;
use crate::study::stability::orthogonality::{Family, Way};
use crate::study::stability::{CUBES, Orthogonality, Reflected, Residuals, Stability};

/// A panel of the chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    /// Columns made orthonormal.
    Orthogonality,
    /// Singular value decompositions.
    Decomposition,
    /// Light between equal walls.
    Furnace,
    /// A lamp over the floor, by distance.
    Lamp,
    /// The same by resolution.
    Hemicube,
    /// Knots for positive keys.
    Knots,
}

/// A column of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    /// Condition number.
    Condition,
    /// Loss of orthogonality.
    Loss,
    /// Place among the residuals.
    Place,
    /// Residual.
    Residual,
    /// How often light is met.
    Met,
    /// Error of the radiosity.
    Missed,
    /// Products or sweeps.
    Sweeps,
    /// Distance of the lamp.
    Distance,
    /// Pixels of a hemicube.
    Resolution,
    /// Error of a form factor.
    Off,
    /// Banks that move.
    Moving,
    /// Knots.
    Knots,
}

/// A method's figures in a panel.
#[derive(Clone, Debug)]
pub(super) struct Curve {
    pub(super) name: String,
    /// It is the one that is shipped.
    pub(super) shipped: bool,
    pub(super) points: Vec<Sample>,
}

/// A point of a curve.
#[derive(Clone, Debug, Default)]
pub(super) struct Sample {
    pub(super) label: String,
    pub(super) x: f64,
    pub(super) y: f64,
    /// Products or sweeps that it took.
    pub(super) sweeps: Option<usize>,
    /// The chart shows it, not the table alone.
    pub(super) in_chart: bool,
}

impl View {
    /// In the order of the chart.
    pub(super) const ALL: [View; 6] = [
        View::Orthogonality,
        View::Decomposition,
        View::Furnace,
        View::Lamp,
        View::Hemicube,
        View::Knots,
    ];

    /// What its series' names begin with in the table.
    pub(super) fn prefix(self) -> &'static str {
        match self {
            View::Orthogonality => "orthogonality",
            View::Decomposition => "decomposition",
            View::Furnace => "furnace",
            View::Lamp => "lamp",
            View::Hemicube => "hemicube",
            View::Knots => "knots",
        }
    }

    /// x and y.
    pub(super) fn axes(self) -> [(Column, Scale); 2] {
        let columns = match self {
            View::Orthogonality => [Column::Condition, Column::Loss],
            View::Decomposition => [Column::Place, Column::Residual],
            View::Furnace => [Column::Met, Column::Missed],
            View::Lamp => [Column::Distance, Column::Off],
            View::Hemicube => [Column::Resolution, Column::Off],
            View::Knots => [Column::Moving, Column::Knots],
        };
        columns.map(|column| (column, Scale::Log))
    }
}

impl Column {
    /// In the order of the table.
    pub(super) const ALL: [Column; 12] = [
        Column::Condition,
        Column::Loss,
        Column::Place,
        Column::Residual,
        Column::Met,
        Column::Missed,
        Column::Sweeps,
        Column::Distance,
        Column::Resolution,
        Column::Off,
        Column::Moving,
        Column::Knots,
    ];

    /// Its name and unit.
    pub(super) fn quantity(self) -> Quantity {
        let (name, unit) = match self {
            Column::Condition => ("condition number", ""),
            Column::Loss => ("loss of orthogonality", ""),
            Column::Place => ("matrices, worst first", ""),
            Column::Residual => ("residual, in what rounding explains", ""),
            Column::Met => ("1 / (1 - reflectance)", ""),
            Column::Missed => ("radiosity off by", "%"),
            Column::Sweeps => ("products or sweeps to 0.1 %", ""),
            Column::Distance => ("distance of the lamp", "m"),
            Column::Resolution => ("pixels along a hemicube's edge", ""),
            Column::Off => ("form factor off by", "%"),
            Column::Moving => ("banks that move at once", ""),
            Column::Knots => ("knots a show", ""),
        };
        Quantity::new(name, unit)
    }
}

/// The curves of a panel, in the order of the table.
pub(super) fn curves(stability: &Stability, view: View) -> Vec<Curve> {
    match view {
        View::Orthogonality => {
            let of = |way| orthogonality(way, &stability.orthogonality);
            Way::ALL.map(of).into()
        }
        View::Decomposition => vec![
            residuals("Footlight", true, &stability.ours),
            residuals("nalgebra", false, &stability.nalgebra),
        ],
        View::Furnace => furnace(&stability.furnace),
        View::Lamp => lamp(stability),
        View::Hemicube => hemicube(stability),
        View::Knots => knots(stability),
    }
}

fn orthogonality(way: Way, all: &[Orthogonality]) -> Curve {
    let name = match way {
        Way::Classical => "classical Gram-Schmidt",
        Way::Modified => "modified",
        Way::Shipped => "modified twice (shipped)",
        Way::Householder => "Householder",
    };
    let point = |o: &Orthogonality| Sample {
        label: match o.family {
            Family::Lauchli => "Läuchli".to_owned(),
            Family::Hilbert => "Hilbert".to_owned(),
            Family::NearCopies => "near-copies".to_owned(),
        },
        x: o.condition,
        y: o.loss,
        // A show has near-copies of a look, and nothing else of these.
        in_chart: o.family == Family::NearCopies,
        ..Sample::default()
    };
    let own = all.iter().filter(|o| o.way == way);
    Curve {
        name: name.to_owned(),
        shipped: way == Way::Shipped,
        points: own.map(point).collect(),
    }
}

fn residuals(name: &str, shipped: bool, found: &Residuals) -> Curve {
    let points = found.0.iter().enumerate();
    let point = |(i, residual): (usize, &f64)| Sample {
        x: i as f64 + 1.0,
        y: *residual,
        in_chart: true,
        ..Sample::default()
    };
    Curve {
        name: name.to_owned(),
        shipped,
        points: points.map(point).collect(),
    }
}

fn furnace(all: &[Reflected]) -> Vec<Curve> {
    let curve = |name: &str, shipped, off: fn(&Solved) -> f64, sweeps: fn(&Reflected) -> usize| {
        let point = |r: &Reflected| Sample {
            label: format!("reflectance {}", r.solved.reflectance),
            x: 1.0 / (1.0 - f64::from(r.solved.reflectance)),
            y: 100.0 * off(&r.solved),
            sweeps: Some(sweeps(r)),
            in_chart: true,
        };
        Curve {
            name: name.to_owned(),
            shipped,
            points: all.iter().map(point).collect(),
        }
    };
    vec![
        curve(
            "Chebyshev (shipped)",
            true,
            |s| s.ours,
            |r| r.solved.products,
        ),
        curve(
            "Gauss-Seidel, as many sweeps",
            false,
            |s| s.seidel,
            |r| r.seidel,
        ),
        curve(
            "Jacobi, as many products",
            false,
            |s| s.jacobi,
            |r| r.jacobi,
        ),
        curve("four bounces", false, |s| s.few, |_| FEW),
    ]
}

/// A curve of relative errors in percent: labels, x and error.
fn errors(name: &str, shipped: bool, points: impl Iterator<Item = (String, f64, f64)>) -> Curve {
    let point = |(label, x, error)| Sample {
        label,
        x,
        y: 100.0 * error,
        in_chart: true,
        ..Sample::default()
    };
    Curve {
        name: name.to_owned(),
        shipped,
        points: points.map(point).collect(),
    }
}

fn lamp(stability: &Stability) -> Vec<Curve> {
    let all = || stability.distances.iter();
    let label = |height: f64| format!("{height} m");
    let closed = all().map(|d| (label(d.height), d.height, d.closed));
    let point = all().map(|d| (label(d.height), d.height, d.point));
    let mut out = vec![
        errors("closed form (shipped)", true, closed),
        errors("taken for a point", false, point),
    ];
    for (i, resolution) in CUBES.into_iter().enumerate() {
        let cube = all().map(|d| {
            let error = d.cubes.get(i).copied().unwrap_or(f64::NAN);
            (label(d.height), d.height, error)
        });
        out.push(errors(&format!("hemicube of {resolution}"), false, cube));
    }
    out
}

fn hemicube(stability: &Stability) -> Vec<Curve> {
    let all = || stability.resolutions.iter();
    let row = |pixels: usize, error| (format!("{pixels} pixels"), pixels as f64, error);
    vec![
        errors(
            "mean of many, turned (shipped)",
            true,
            all().map(|r| row(r.pixels, r.mean.turned)),
        ),
        errors(
            "mean of many, all aligned",
            false,
            all().map(|r| row(r.pixels, r.mean.aligned)),
        ),
        errors(
            "a point alone",
            false,
            all().map(|r| row(r.pixels, r.seen.hemicube)),
        ),
        errors(
            "closed form, as for lamps",
            false,
            all().map(|r| row(r.pixels, r.seen.ours)),
        ),
    ]
}

fn knots(stability: &Stability) -> Vec<Curve> {
    let curve = |name: &str, shipped, count: fn(&Knots) -> f64| {
        let point = |k: &Knots| Sample {
            label: format!("{} shows of {} banks", k.shows, k.banks),
            x: k.banks as f64,
            y: count(k),
            in_chart: true,
            ..Sample::default()
        };
        Curve {
            name: name.to_owned(),
            shipped,
            points: stability.knots.iter().map(point).collect(),
        }
    };
    vec![
        curve("fewest (shipped)", true, |k| k.fewest),
        curve("halving", false, |k| k.bisection),
        curve("halving, the worst show", false, |k| k.most as f64),
    ]
}
