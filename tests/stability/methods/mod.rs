//! Where the usual methods fail, and what is shipped instead: one against the other on hard inputs.
//!
//! The tests of `stability` assert on these figures and `examples/stability` draws them. All are
//! computed by the shipped code and by the naive methods next to it; every run gives the same, in
//! some seconds.

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
/// The hemicubes that distances are tried with, in pixels along the edge.
pub const CUBES: [usize; 2] = [16, 64];
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

/// What every study found.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// Columns made orthonormal, matrix by matrix, each in every way.
    pub orthogonality: Vec<Orthogonality>,
    /// Residuals of this project's decomposition over the hard list.
    pub ours: Residuals,
    /// Residuals of nalgebra's.
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

/// How orthogonal the columns of a matrix became.
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

/// How wrong singular value decompositions are.
#[derive(Clone, Debug, PartialEq)]
pub struct Residuals(
    /// ‖A − UΣVᵀ‖ / ‖A‖ as multiples of what rounding may explain, the largest first; infinite
    /// where there is no answer.
    pub Vec<f64>,
);

impl Residuals {
    /// How many are more than rounding.
    pub fn wrong(&self) -> usize {
        self.0.iter().filter(|r| **r > 1.0).count()
    }
}

/// Solvers of light between walls, at one reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflected {
    /// Their errors.
    pub solved: Solved,
    /// Sweeps that Jacobi's method takes to 0.1 %.
    pub jacobi: usize,
    /// Sweeps that Gauss and Seidel's takes.
    pub seidel: usize,
}

/// Form factors of a lamp at one distance: relative errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Over the floor, metres.
    pub height: f64,
    /// The closed form's, as shipped.
    pub closed: f64,
    /// The lamp taken for a point.
    pub point: f64,
    /// By hemicubes of the resolutions [`CUBES`].
    pub cubes: [f64; CUBES.len()],
}

/// Form factors of a lamp by hemicubes of one resolution: relative errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Along the edge.
    pub pixels: usize,
    /// At single points.
    pub seen: Seen,
    /// Of the mean over many.
    pub mean: Aliasing,
}

/// Every study, one after the other.
///
/// # Errors
/// None in practice.
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

/// Of this project's solver and of nalgebra's.
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
