//! Failures of common methods against the shipped ones, on hard inputs.
//!
//! The tests of `stability` assert on these figures and `examples/stability` draws them. They are
//! computed by the shipped code and by the naive methods next to it; every run gives equal results,
//! in a few seconds.

pub mod decomposition;
pub mod furnace;
pub mod hard;
pub mod knot;
pub mod lamp;
pub mod orthogonality;
pub mod wide;

use self::furnace::{Furnace, REFLECTANCES, Solved};
use self::knot::Knots;
use self::lamp::{Aliasing, Lamp, Seen};
use self::orthogonality::{Family, Way};
use footlight_transport::TransportError;

/// Random matrices of each random kind.
const RANDOM: usize = 60;
/// Elements of the furnace.
const ELEMENTS: usize = 200;
/// Metres from floor to lamp.
const DISTANCES: [f64; 9] = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0];
/// Pixels along a hemicube's edge.
const RESOLUTIONS: [usize; 6] = [8, 16, 32, 64, 128, 256];
/// Resolutions of the hemicubes at varying distances, pixels along the edge.
pub const CUBES: [usize; 2] = [16, 64];
/// Number of points of the floor.
const POINTS: u64 = 100;
/// Side of the lamp, metres.
const SIDE: f64 = 0.5;
/// The lamp for varying resolutions: a lid as wide as the room, at half its width.
const LID: Lamp = Lamp {
    width: 2.0,
    depth: 2.0,
    height: 1.0,
};

/// Results of every study.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// Orthogonality of columns, matrix by matrix, with each method.
    pub orthogonality: Vec<Orthogonality>,
    /// Residuals of this project's decomposition over the hard list.
    pub ours: Residuals,
    /// Residuals of nalgebra's decomposition.
    pub nalgebra: Residuals,
    /// Light between equal walls, by reflectance.
    pub furnace: Vec<Reflected>,
    /// A lamp over the floor, by distance.
    pub distances: Vec<Distance>,
    /// A lamp over the floor, by the resolution of hemicubes.
    pub resolutions: Vec<Resolution>,
    /// Knots for positive keys, by the number of banks.
    pub knots: Vec<Knots>,
}

/// Orthogonality of a matrix's columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthogonality {
    /// The method.
    pub way: Way,
    /// The family of the matrix.
    pub family: Family,
    /// The condition number of the matrix.
    pub condition: f64,
    /// ‖QᵀQ − 1‖ in the Frobenius norm.
    pub loss: f64,
}

/// Residuals of singular value decompositions.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals(
    /// ‖A − UΣVᵀ‖ / ‖A‖ as multiples of the rounding tolerance, the largest first; infinite without
    /// an answer.
    pub Vec<f64>,
);

impl Residuals {
    /// Number of residuals beyond rounding.
    pub fn wrong(&self) -> usize {
        self.0.iter().filter(|r| **r > 1.0).count()
    }
}

/// Solvers for light between walls, at one reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflected {
    /// Their errors.
    pub solved: Solved,
    /// Sweeps of Jacobi's method to 0.1 %.
    pub jacobi: usize,
    /// Sweeps of Gauss-Seidel to 0.1 %.
    pub seidel: usize,
}

/// Form factors of a lamp at one distance: relative errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Height over the floor, metres.
    pub height: f64,
    /// By the shipped closed form.
    pub closed: f64,
    /// With the lamp as a point.
    pub point: f64,
    /// By hemicubes of the resolutions [`CUBES`].
    pub cubes: [f64; CUBES.len()],
}

/// Form factors of a lamp by hemicubes of one resolution: relative errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Pixels along the edge.
    pub pixels: usize,
    /// Errors at single points.
    pub seen: Seen,
    /// Error of the mean over many.
    pub mean: Aliasing,
}

/// Runs every study.
///
/// # Errors
/// Never in practice.
pub fn study() -> Result<Stability, TransportError> {
    let [ours, nalgebra] = decompositions();
    let knots = knot::counted();
    Ok(Stability {
        orthogonality: orthogonality(),
        ours,
        nalgebra,
        furnace: reflected()?,
        distances: distances()?,
        resolutions: resolutions()?,
        knots: knots.iter().map(|(n, c)| knot::summary(*n, c)).collect(),
    })
}

fn orthogonality() -> Vec<Orthogonality> {
    let mut out = Vec::new();
    for (family, matrices) in orthogonality::families() {
        for a in &matrices {
            let condition = orthogonality::condition(a);
            out.extend(Way::ALL.map(|way| Orthogonality {
                way,
                family,
                condition,
                loss: orthogonality::loss(&way.orthonormalize(a)),
            }));
        }
    }
    out
}

/// Residuals of this project's solver and of nalgebra's.
fn decompositions() -> [Residuals; 2] {
    let mut all = hard::list(RANDOM);
    // nalgebra panics on empty matrices.
    all.retain(|hard| !hard.matrix.is_empty());
    let solvers: [decomposition::Solver; 2] = [decomposition::ours, decomposition::nalgebra];
    solvers.map(|solve| Residuals(decomposition::residuals(&all, solve)))
}

fn reflected() -> Result<Vec<Reflected>, TransportError> {
    let furnace = Furnace::new(ELEMENTS)?;
    let mut out = Vec::new();
    for reflectance in REFLECTANCES {
        out.push(Reflected {
            solved: furnace.solve(reflectance)?,
            jacobi: furnace.sweeps(reflectance, false),
            seidel: furnace.sweeps(reflectance, true),
        });
    }
    Ok(out)
}

fn distances() -> Result<Vec<Distance>, TransportError> {
    let mut out = Vec::new();
    for height in DISTANCES {
        let lamp = Lamp {
            width: SIDE,
            depth: SIDE,
            height,
        };
        let seen = |resolution| lamp.seen(resolution, height.max(SIDE), POINTS);
        let [coarse, fine] = CUBES;
        let (coarse, fine) = (seen(coarse)?, seen(fine)?);
        out.push(Distance {
            height,
            closed: coarse.ours,
            point: coarse.point,
            cubes: [coarse.hemicube, fine.hemicube],
        });
    }
    Ok(out)
}

fn resolutions() -> Result<Vec<Resolution>, TransportError> {
    let mut out = Vec::new();
    for pixels in RESOLUTIONS {
        out.push(Resolution {
            pixels,
            seen: LID.seen(pixels, LID.height, POINTS)?,
            mean: LID.aliasing(pixels, POINTS)?,
        });
    }
    Ok(out)
}
