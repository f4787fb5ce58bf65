//! Projections of a setting on refined settings, and the paper's order of refinement.
//!
//! With D_i the difference of source i's coarse images and K_j the correction known from refined
//! image j, a [`Projection`] turns a setting L into coefficients c of the refined images R_j at
//! settings s_j: the preview is C·L + sum c_j (R_j - C·s_j). Footlight uses
//! [`Projection::Extrapolated`]; the others serve for comparison.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by their own shape"
)]

use crate::trial::{Metric, Shown, Trial};
use footlight_engine::plan::{self, PlanError, Weighting};
use footlight_engine::pool::Pool;
use footlight_show::linalg::{Matrix, svd};

/// Method of composing a setting from refined images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    /// The paper's "refined first": L projected on the refined settings, unweighted.
    Settings,
    /// Each coordinate weighted by the norm of its coarse image.
    Influence,
    /// In the metric of the estimated errors with their scalar products, L·DᵀD·L.
    FullError,
    /// In the metric of the estimated errors, assumed uncorrelated.
    Error,
    /// Like `Error`, on coarse images extrapolated by the known corrections: the pool's method.
    Extrapolated,
    /// The known corrections nearest to the estimated error of L: least squares of D·L on the K_j.
    /// The only projection that does not reproduce refined settings.
    Corrections,
}

impl Projection {
    /// All projections, the paper's first.
    pub const ALL: [Projection; 6] = [
        Projection::Settings,
        Projection::Influence,
        Projection::FullError,
        Projection::Error,
        Projection::Extrapolated,
        Projection::Corrections,
    ];

    /// Its name in tables.
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

    /// Images of each source as shown with refined images of `settings`.
    ///
    /// # Errors
    /// [`PlanError`]
    pub fn shown(self, trial: &Trial, settings: &[Vec<f64>]) -> Result<Shown, PlanError> {
        if self == Projection::Extrapolated {
            return trial.shown(settings);
        }
        let units = Pool::unit_settings(trial.norms.len());
        let c = self.coefficients(trial, settings, &units)?;
        Ok(Shown::new(settings, &c, 0.0))
    }

    /// Coefficients of the refined images of `settings`, a row for each of `looks`.
    ///
    /// # Errors
    /// [`PlanError`]
    pub fn coefficients(
        self,
        trial: &Trial,
        settings: &[Vec<f64>],
        looks: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PlanError> {
        let plain = Weighting::settings(trial.norms.len());
        match self {
            Projection::Settings => plan::projection(settings, &plain, looks),
            Projection::Influence => {
                let w = Weighting::new(trial.norms.clone())?;
                plan::projection(settings, &w, looks)
            }
            Projection::Error | Projection::Extrapolated => {
                plan::projection(settings, &trial.weighting(Metric::Error)?, looks)
            }
            Projection::FullError => {
                let root = root(&trial.dd, 1e-12)?;
                let mapped = |of: &[Vec<f64>]| -> Vec<Vec<f64>> {
                    of.iter().map(|x| times(&root, x)).collect()
                };
                plan::projection(&mapped(settings), &plain, &mapped(looks))
            }
            Projection::Corrections => nearest(trial, settings, looks),
        }
    }
}

fn times(matrix: &Matrix, x: &[f64]) -> Vec<f64> {
    let row = |i: usize| matrix.row(i).iter().zip(x).map(|(a, x)| a * x).sum();
    (0..matrix.nrows()).map(row).collect()
}

/// F with FᵀF = `gram`; singular values below `floor` of the largest are raised to it, so that
/// every direction has weight.
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

/// The c that minimise ‖D·L - sum c_j K_j‖, a row for each look; directions of the corrections
/// below 1e-9 of the largest are dropped.
fn nearest(
    trial: &Trial,
    settings: &[Vec<f64>],
    looks: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>, PlanError> {
    let (n, m) = (trial.norms.len(), settings.len());
    if m == 0 {
        return Ok(vec![Vec::new(); looks.len()]);
    }
    let s = Matrix::from_fn(n, m, |i, j| settings[j][i]);
    let corrections = s.transpose() * &trial.kk * &s;
    let mixed = s.transpose() * &trial.kd;
    let found = svd(&corrections)?;
    let rank = found.rank(1e-9);
    let of = |look: &Vec<f64>| {
        let right = times(&mixed, look);
        let mut out = vec![0.0; m];
        for k in 0..rank {
            let u = found.u.column(k);
            let along: f64 = u.iter().zip(&right).map(|(u, r)| u * r).sum();
            let scale = along / found.sigma[k];
            for (out, u) in out.iter_mut().zip(u.iter()) {
                *out += scale * u;
            }
        }
        out
    };
    Ok(looks.iter().map(of).collect())
}

/// Least weight, relative to the largest.
const FLOOR: f64 = 1e-6;
/// Singular values below this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

/// Settings to refine in the paper's order: the left singular vectors of W·K, with a column of K
/// for each key setting, whatever its duration.
///
/// # Errors
/// [`PlanError`]
pub fn keys_alike(trial: &Trial, w: &Weighting) -> Result<Vec<Vec<f64>>, PlanError> {
    let keys = trial.keys().keys();
    let largest = w.weights().iter().fold(0.0_f64, |a, b| a.max(*b));
    let w: Vec<f64> = (w.weights().iter())
        .map(|w| w.max(FLOOR * largest))
        .collect();
    let found = svd(&Matrix::from_fn(w.len(), keys.len(), |i, j| {
        w[i] * keys[j][i]
    }))?;
    let setting = |k: usize| {
        let raw: Vec<f64> = (w.iter().enumerate())
            .map(|(i, w)| found.u[(i, k)] / w)
            .collect();
        let scale = raw.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        raw.iter().map(|x| x / scale).collect()
    };
    Ok((0..found.rank(ROUNDING)).map(setting).collect())
}
