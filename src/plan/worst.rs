//! What refining leaves of single moments: the error that counts is that of the worst one.

use super::Weighting;
use crate::linalg::Orthonormal;

/// A moment of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Its setting.
    pub setting: Vec<f64>,
    /// What an error there is multiplied by, such as one over its light; 0 where none counts.
    pub scale: f64,
}

/// The largest weighted rest over the moments, each times its scale: with nothing refined, with the
/// settings of `pool`, and with each of `directions` after them. It never rises.
pub fn worst_left(
    moments: &[Moment],
    pool: &[Vec<f64>],
    directions: &[Vec<f64>],
    weighting: &Weighting,
) -> Vec<f64> {
    let w = weighting.lifted();
    let weighted = |setting: &[f64], scale: f64| -> Vec<f64> {
        setting.iter().zip(&w).map(|(x, w)| x * w * scale).collect()
    };
    let lit = moments.iter().filter(|m| m.scale > 0.0);
    let mut rests: Vec<Vec<f64>> = lit.map(|m| weighted(&m.setting, m.scale)).collect();
    let mut span = Orthonormal::new();
    let mut out = vec![largest(&rests)];
    let mut refine = |setting: &Vec<f64>, rests: &mut Vec<Vec<f64>>| {
        if span.push(&weighted(setting, 1.0)).is_ok() {
            take_away(span.vectors().last(), rests);
        }
    };
    for setting in pool {
        refine(setting, &mut rests);
    }
    out.push(largest(&rests));
    for setting in directions {
        refine(setting, &mut rests);
        out.push(largest(&rests));
    }
    out
}

fn largest(rests: &[Vec<f64>]) -> f64 {
    let square = |rest: &Vec<f64>| rest.iter().map(|x| x * x).sum::<f64>();
    rests.iter().map(square).fold(0.0, f64::max).sqrt()
}

/// Takes the component along a unit vector away from each of some vectors.
fn take_away(unit: Option<&Vec<f64>>, rests: &mut [Vec<f64>]) {
    for (rest, unit) in rests.iter_mut().zip(unit.into_iter().cycle()) {
        let along: f64 = rest.iter().zip(unit).map(|(x, q)| x * q).sum();
        rest.iter_mut().zip(unit).for_each(|(x, q)| *x -= along * q);
    }
}
