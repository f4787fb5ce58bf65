//! The curves of each panel, with their names.

use crate::methods::furnace::Solved;
use crate::methods::knot::Knots;
use crate::methods::orthogonality::{Family, Way};
use crate::methods::{CUBES, Orthogonality, Reflected, Residuals, Resolution, Stability};

/// A panel of the chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Columns made orthonormal.
    Orthogonality,
    /// Singular value decompositions.
    Decomposition,
    /// Light between equal walls.
    Furnace,
    /// A lamp over the floor, by distance.
    Lamp,
    /// A lamp over the floor, by resolution.
    Hemicube,
    /// Knots for positive keys.
    Knots,
}

/// A method's figures in a panel.
#[derive(Clone, Debug)]
pub struct Curve {
    pub name: String,
    /// True for the shipped method.
    pub shipped: bool,
    /// Measured x and y.
    pub points: Vec<(f64, f64)>,
}

impl View {
    /// All panels, in the order of the chart.
    pub const ALL: [View; 6] = [
        View::Orthogonality,
        View::Decomposition,
        View::Furnace,
        View::Lamp,
        View::Hemicube,
        View::Knots,
    ];

    /// Names of x and y, with their units.
    pub fn axes(self) -> [&'static str; 2] {
        const OFF: &str = "form factor off by, %";
        match self {
            View::Orthogonality => ["condition number", "loss of orthogonality"],
            View::Decomposition => [
                "matrices, worst first",
                "residual, in what rounding explains",
            ],
            View::Furnace => ["1 / (1 - reflectance)", "radiosity off by, %"],
            View::Lamp => ["distance of the lamp, m", OFF],
            View::Hemicube => ["pixels along a hemicube's edge", OFF],
            View::Knots => ["banks that move at once", "knots a show"],
        }
    }
}

/// The curves of a panel.
pub fn curves(stability: &Stability, view: View) -> Vec<Curve> {
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

fn curve(name: &str, shipped: bool, points: impl Iterator<Item = (f64, f64)>) -> Curve {
    Curve {
        name: name.to_owned(),
        shipped,
        points: points.collect(),
    }
}

/// For near-copies of a look: shows have none of the other families.
fn orthogonality(way: Way, all: &[Orthogonality]) -> Curve {
    let name = match way {
        Way::Classical => "classical Gram-Schmidt",
        Way::Modified => "modified",
        Way::Shipped => "modified twice (shipped)",
        Way::Householder => "Householder",
    };
    let own = all
        .iter()
        .filter(|o| o.way == way && o.family == Family::NearCopies);
    let points = own.map(|o| (o.condition, o.loss));
    curve(name, way == Way::Shipped, points)
}

fn residuals(name: &str, shipped: bool, found: &Residuals) -> Curve {
    let points = found.0.iter().enumerate();
    curve(name, shipped, points.map(|(i, r)| (i as f64 + 1.0, *r)))
}

fn furnace(all: &[Reflected]) -> Vec<Curve> {
    let of = |name: &str, shipped, off: fn(&Solved) -> f64| {
        let point = |r: &Reflected| {
            let met = 1.0 / (1.0 - f64::from(r.solved.reflectance));
            (met, 100.0 * off(&r.solved))
        };
        curve(name, shipped, all.iter().map(point))
    };
    vec![
        of("Chebyshev (shipped)", true, |s| s.ours),
        of("Gauss-Seidel, as many sweeps", false, |s| s.seidel),
        of("Jacobi, as many products", false, |s| s.jacobi),
        of("four bounces", false, |s| s.few),
    ]
}

fn lamp(stability: &Stability) -> Vec<Curve> {
    let all = || stability.distances.iter();
    let closed = all().map(|d| (d.height, 100.0 * d.closed));
    let point = all().map(|d| (d.height, 100.0 * d.point));
    let mut out = vec![
        curve("closed form (shipped)", true, closed),
        curve("taken for a point", false, point),
    ];
    for (i, resolution) in CUBES.into_iter().enumerate() {
        let cube = all().filter_map(|d| Some((d.height, 100.0 * d.cubes.get(i)?)));
        out.push(curve(&format!("hemicube of {resolution}"), false, cube));
    }
    out
}

fn hemicube(stability: &Stability) -> Vec<Curve> {
    let of = |name: &str, shipped, off: fn(&Resolution) -> f64| {
        let all = stability.resolutions.iter();
        curve(
            name,
            shipped,
            all.map(|r| (r.pixels as f64, 100.0 * off(r))),
        )
    };
    vec![
        of("mean of many, turned (shipped)", true, |r| r.mean.turned),
        of("mean of many, all aligned", false, |r| r.mean.aligned),
        of("a point alone", false, |r| r.seen.hemicube),
        of("closed form, as for lamps", false, |r| r.seen.ours),
    ]
}

fn knots(stability: &Stability) -> Vec<Curve> {
    let of = |name: &str, shipped, count: fn(&Knots) -> f64| {
        let all = stability.knots.iter();
        curve(name, shipped, all.map(|k| (k.banks as f64, count(k))))
    };
    vec![
        of("fewest (shipped)", true, |k| k.fewest),
        of("halving", false, |k| k.bisection),
        of("halving, the worst show", false, |k| k.most as f64),
    ]
}
