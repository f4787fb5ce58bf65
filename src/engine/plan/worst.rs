//! Errors of single moments after refinement; the worst moment counts.

use super::Weighting;
use footlight_show::linalg::Orthonormal;

/// A moment of a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Its setting.
    pub setting: Vec<f64>,
    /// Factor on its error, such as one over its light; 0 if it does not count.
    pub scale: f64,
}

impl Moment {
    /// Moments whose errors count relative to their light; a moment below `NEARLY_OUT` of the
    /// brightest does not count.
    pub fn relative(settings: Vec<Vec<f64>>, light: impl Fn(&[f64]) -> f64) -> Vec<Moment> {
        let lights: Vec<f64> = settings.iter().map(|s| light(s)).collect();
        let least = NEARLY_OUT * lights.iter().copied().fold(0.0, f64::max);
        let moment = |(setting, light): (Vec<f64>, f64)| Moment {
            scale: if light > least { 1.0 / light } else { 0.0 },
            setting,
        };
        settings.into_iter().zip(lights).map(moment).collect()
    }

    /// Its setting, weighted and scaled.
    pub(super) fn weighted(&self, w: &[f64]) -> Vec<f64> {
        let pairs = self.setting.iter().zip(w);
        pairs.map(|(x, w)| x * w * self.scale).collect()
    }
}

/// Light, relative to the brightest moment's, below which a moment is nearly out.
const NEARLY_OUT: f64 = 0.02;

/// The largest weighted remainder over the moments, each times its scale: without refinement, with
/// the settings of `pool`, and with each of `directions` after them. It never rises.
pub fn worst_left(
    moments: &[Moment],
    pool: &[Vec<f64>],
    directions: &[Vec<f64>],
    weighting: &Weighting,
) -> Vec<f64> {
    let w = weighting.lifted();
    let lit = moments.iter().filter(|m| m.scale > 0.0);
    let mut rests: Vec<Vec<f64>> = lit.map(|m| m.weighted(&w)).collect();
    let mut span = Orthonormal::new();
    let mut out = vec![largest(&rests)];
    let mut refine = |setting: &Vec<f64>, rests: &mut Vec<Vec<f64>>| {
        let weighted: Vec<f64> = setting.iter().zip(&w).map(|(x, w)| x * w).collect();
        if span.push(&weighted).is_ok() {
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

/// Removes the component along a unit vector from each vector.
fn take_away(unit: Option<&Vec<f64>>, rests: &mut [Vec<f64>]) {
    for (rest, unit) in rests.iter_mut().zip(unit.into_iter().cycle()) {
        let along: f64 = rest.iter().zip(unit).map(|(x, q)| x * q).sum();
        rest.iter_mut().zip(unit).for_each(|(x, q)| *x -= along * q);
    }
}
