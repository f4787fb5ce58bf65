//! How known corrections speak for what is not refined: as numbers, without pictures.
//!
//! With C_i and X_i the pictures of source i at the two coarse qualities, D_i = C_i - X_i is the
//! estimate of the coarse error, and K_j = R_j - C·s_j the correction that refined picture j made
//! known. A [`Projection`] turns a setting L into coefficients c of the refined pictures; a
//! [`Fit`] says how well D foretold K. Both need scalar products only, so that a study can ask for
//! thousands of them at no cost.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by their own shape"
)]

use crate::linalg::{Matrix, svd};
use crate::plan::{self, Metric, PlanError, Weighting};

/// How a setting is made up of refined pictures: the preview is C'·L + sum c_j (R_j - C'·s_j).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// The paper's "refined first": L projected on the refined settings as they are.
    Settings,
    /// The same with each coordinate weighted by the norm of its coarse picture.
    Influence,
    /// In the metric of the estimated errors with their scalar products, L·DᵀD·L.
    FullError,
    /// In the metric of the estimated errors as if they had nothing in common.
    Error,
    /// The same, on coarse pictures extrapolated by the corrections known so far.
    #[default]
    Extrapolated,
    /// The known corrections that come nearest to the estimated error of L: least squares of D·L on
    /// the K_j. The only one that does not reproduce a refined setting.
    Corrections,
}

impl Projection {
    /// All of them, the paper's first.
    pub const ALL: [Projection; 6] = [
        Projection::Settings,
        Projection::Influence,
        Projection::FullError,
        Projection::Error,
        Projection::Extrapolated,
        Projection::Corrections,
    ];

    /// As options and reports write it.
    pub fn name(self) -> &'static str {
        match self {
            Projection::Settings => "settings",
            Projection::Influence => "influence",
            Projection::FullError => "full-error",
            Projection::Error => "error",
            Projection::Extrapolated => "extrapolated",
            Projection::Corrections => "corrections",
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Projection> {
        Projection::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Coefficients of the refined pictures at `settings`, a row for each of `looks`.
    ///
    /// # Errors
    /// `PlanError` for settings of another number of coordinates, or a decomposition that fails.
    pub fn coefficients(
        self,
        known: &Products,
        settings: &[Vec<f64>],
        looks: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PlanError> {
        let n = known.norms.len();
        let plain = Weighting::settings(n);
        let or_plain =
            |found: Result<Weighting, PlanError>| found.unwrap_or_else(|_| plain.clone());
        match self {
            Projection::Settings => plan::projection(settings, &plain, looks),
            Projection::Influence => {
                let w = or_plain(Weighting::new(Metric::Influence, known.norms.clone()));
                plan::projection(settings, &w, looks)
            }
            Projection::Error | Projection::Extrapolated => {
                plan::projection(settings, &known.weighting, looks)
            }
            Projection::FullError => {
                let root = root(&known.differences, 1e-12)?;
                let mapped = |of: &[Vec<f64>]| -> Vec<Vec<f64>> {
                    of.iter().map(|x| times(&root, x)).collect()
                };
                plan::projection(&mapped(settings), &plain, &mapped(looks))
            }
            Projection::Corrections => nearest(known, looks),
        }
    }
}

/// Scalar products of the pictures of n sources and m refined settings.
#[derive(Clone, Debug)]
pub struct Products {
    /// Norms of the coarse pictures C_i.
    pub norms: Vec<f64>,
    /// The metric of the pool.
    pub weighting: Weighting,
    /// D_i·D_j, n x n; only `full-error` looks at it.
    pub differences: Matrix,
    /// K_j·K_l, m x m; only `corrections` looks at it.
    pub corrections: Matrix,
    /// K_j·D_i, m x n; only `corrections` looks at it.
    pub mixed: Matrix,
}

fn times(matrix: &Matrix, x: &[f64]) -> Vec<f64> {
    let row = |i: usize| matrix.row(i).iter().zip(x).map(|(a, x)| a * x).sum();
    (0..matrix.nrows()).map(row).collect()
}

/// F with FᵀF = `gram`, singular values below `floor` of the largest lifted to it, so that no
/// direction is without weight.
fn root(gram: &Matrix, floor: f64) -> Result<Matrix, PlanError> {
    let found = svd(gram)?;
    let largest = found.sigma.first().copied().unwrap_or(0.0);
    let mut out = found.u.transpose();
    for (i, s) in found.sigma.iter().enumerate() {
        let scale = s.max(floor * largest).sqrt();
        out.row_mut(i).iter_mut().for_each(|x| *x *= scale);
    }
    Ok(out)
}

/// The c that make ‖D·L - sum c_j K_j‖ least, a row for each look; directions of the corrections
/// below 1e-9 of the largest are left out.
fn nearest(known: &Products, looks: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, PlanError> {
    let m = known.corrections.nrows();
    if m == 0 {
        return Ok(vec![Vec::new(); looks.len()]);
    }
    let found = svd(&known.corrections)?;
    let rank = found.rank(1e-9);
    let of = |look: &Vec<f64>| {
        let right = times(&known.mixed, look);
        let mut out = vec![0.0; m];
        for k in 0..rank {
            let u = found.u.column(k);
            let along: f64 = u.iter().zip(&right).map(|(u, r)| u * r).sum();
            let scale = along / found.sigma[k];
            out.iter_mut()
                .zip(u.iter())
                .for_each(|(o, u)| *o += scale * u);
        }
        out
    };
    Ok(looks.iter().map(of).collect())
}

/// What one refined picture tells: scalar products of its correction K with itself and with
/// E = D·s, the difference of the two coarse qualities at its setting, and ‖W s‖².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// K·K
    pub kk: f64,
    /// K·E
    pub ke: f64,
    /// E·E
    pub ee: f64,
    /// The sum of (w_i s_i)²: what E·E would be if the sources' errors had nothing in common.
    pub expected: f64,
}

/// What a prediction is multiplied by before it is believed, with no refined picture and with one.
/// Where coarse pictures alone are foretold to be off by 0.59 and 0.43 %, in the tavern and in
/// Turandot, 0.77 and 1.19 % are true against the finest step: up to 2.8 times as much, as the
/// steps share errors that their difference does not show. Against the refined step it is 1.5 times
/// as much at most in the tavern and 19 of 20 random shows, 3.1 times in the other
/// (`examples/trial.rs`).
const ROOM: [f64; 2] = [3.0, 4.0];

/// Whether an error that was `predicted` with so many refined pictures counts as within `wanted`:
/// without two that it was held against it must leave room, threefold and fourfold.
pub fn is_within(wanted: f64, predicted: f64, refined: usize) -> bool {
    let room = ROOM.get(refined).copied().unwrap_or(1.0);
    room * predicted <= wanted
}

/// What known corrections make of the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Coarse pictures become C + a·D with this a; 0 before the first correction.
    pub extrapolation: f64,
    /// Estimated errors are multiplied by this; 1 before the first correction.
    pub calibration: f64,
}

impl Fit {
    /// Fits the extrapolation factor and the calibration to all known corrections.
    ///
    /// The calibration is the root mean square of each correction's ratio to what was expected of
    /// it, with one further ratio of 1 for the estimate itself: sources err by different factors,
    /// so a few corrections must not speak for all. Ratios rather than sums, because the first
    /// corrections are the largest and would outweigh the rest.
    pub fn of(known: &[Evidence]) -> Fit {
        let sum = |of: fn(&Evidence) -> f64| -> f64 { known.iter().map(of).sum() };
        let (ke, ee) = (sum(|c| c.ke), sum(|c| c.ee));
        let extrapolation = if ee > 0.0 { ke / ee } else { 0.0 };

        // What the extrapolation leaves of the corrections it was fitted to is too little by one
        // degree of freedom; a single correction says nothing of what extrapolation will leave.
        let count = known.len() as f64;
        let (a, freedom) = match known.len() {
            0 | 1 => (0.0, 1.0),
            _ => (extrapolation, count / (count - 1.0)),
        };
        let ratio = |known: &Evidence| {
            let Evidence {
                kk,
                ke,
                ee,
                expected,
            } = *known;
            let left = (kk - 2.0 * a * ke + a * a * ee).max(0.0) * freedom;
            // Where errors of several sources add up, as in the first pictures, they do so in the
            // estimate too: that is no sign that each source errs more than estimated.
            let expected = expected.max(ee);
            if expected > 0.0 { left / expected } else { 1.0 }
        };
        let ratios: f64 = known.iter().map(ratio).sum();
        Fit {
            extrapolation,
            calibration: ((1.0 + ratios) / (1.0 + count)).sqrt(),
        }
    }
}
