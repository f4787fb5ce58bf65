//! A smooth function fitted to a few samples near the corners and the centre of a square: a plane
//! and a quadratic term.
//!
//! Invariants: samples that do not determine a slope give no fit, because a slope extrapolated from
//! adjacent places has a large error; a fit is linear in its values. This module does not depend on
//! light.

use crate::direct::cluster::CORNERS;

/// Least ratio of the product of the places' two principal spreads to the squared sum; evenly
/// spread places have 0.25.
const SPREAD: f64 = 0.03;

/// A function on the square from -1 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticFit {
    /// Constant and slopes.
    plane: [f64; 3],
    /// Constant of the quadratic term, its radial part, and its twist.
    bend: [f64; 3],
    /// Greatest difference between the plane and a value.
    pub farthest: f64,
}

impl QuadraticFit {
    /// Fits to values at places, the last near the centre and the others near the corners. `None`
    /// when the places are collinear or close together.
    pub fn through(places: &[[f64; 2]; CORNERS], values: &[f64; CORNERS]) -> Option<QuadraticFit> {
        let plane = plane(places, values)?;
        let mut fit = QuadraticFit {
            plane,
            bend: [0.0; 3],
            farthest: 0.0,
        };
        let rests = places.map(|p| fit.at(p));
        let mut rest = *values;
        for (rest, height) in rest.iter_mut().zip(rests) {
            *rest -= height;
            fit.farthest = fit.farthest.max(rest.abs());
        }
        fit.bend = bend(places, &rest);
        Some(fit)
    }

    /// Value at a place.
    pub fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let [level, east, north] = self.plane;
        let [middle, hill, twist] = self.bend;
        level + east * x + north * y + middle + hill * (x * x + y * y) + twist * x * y
    }
}

/// Least-squares plane: constant and two slopes.
fn plane(places: &[[f64; 2]; CORNERS], values: &[f64; CORNERS]) -> Option<[f64; 3]> {
    let n = CORNERS as f64;
    let x = places.iter().map(|p| p[0]).sum::<f64>() / n;
    let y = places.iter().map(|p| p[1]).sum::<f64>() / n;
    let level = values.iter().sum::<f64>() / n;
    let [mut xx, mut xy, mut yy, mut xv, mut yv] = [0.0; 5];
    for ([px, py], v) in places.iter().zip(values) {
        let (a, b, c) = (px - x, py - y, v - level);
        xx += a * a;
        xy += a * b;
        yy += b * b;
        xv += a * c;
        yv += b * c;
    }
    let area = xx * yy - xy * xy;
    if area <= SPREAD * (xx + yy).powi(2) {
        return None;
    }
    let (east, north) = ((yy * xv - xy * yv) / area, (xx * yv - xy * xv) / area);
    Some([level - east * x - north * y, east, north])
}

/// Quadratic term from the residuals of the plane: the difference of the corners from the centre,
/// and of the diagonals from each other. It is at most a few times the residuals, as the places
/// stay in the square.
fn bend(places: &[[f64; 2]; CORNERS], rest: &[f64; CORNERS]) -> [f64; 3] {
    let [corners @ .., [mx, my]] = places;
    let [outer @ .., inner] = rest;
    let n = corners.len() as f64;
    let distance =
        corners.iter().map(|[x, y]| x * x + y * y).sum::<f64>() / n - (mx * mx + my * my);
    let lift = outer.iter().sum::<f64>() / n - inner;
    let crossed = corners.iter().map(|[x, y]| (x * y).powi(2)).sum::<f64>();
    let turned: f64 = corners.iter().zip(outer).map(|([x, y], r)| x * y * r).sum();
    let hill = if distance > 0.5 { lift / distance } else { 0.0 };
    let twist = if crossed > 1.0 { turned / crossed } else { 0.0 };
    [
        inner - hill * (mx * mx + my * my) - twist * mx * my,
        hill,
        twist,
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "test")]
mod tests {
    use super::*;

    const EVEN: [[f64; 2]; CORNERS] = [
        [-0.9, -0.9],
        [0.9, -0.9],
        [0.9, 0.9],
        [-0.9, 0.9],
        [0.1, -0.1],
    ];

    #[test]
    fn hills_and_twists_are_met_everywhere() {
        let f = |[x, y]: [f64; 2]| 3.0 - x + 0.5 * y + 0.7 * (x * x + y * y) + 0.2 * x * y;
        let places = EVEN.map(|p| if p[0] == 0.1 { [0.0, 0.0] } else { p });
        let fit = QuadraticFit::through(&places, &places.map(f)).unwrap();
        for p in [[0.0, 0.0], [1.0, 0.3], [-0.4, 0.8], [1.0, -1.0]] {
            assert!(
                (fit.at(p) - f(p)).abs() < 1e-9,
                "{p:?}: {} {}",
                fit.at(p),
                f(p)
            );
        }
        // The plane alone errs by the hill everywhere.
        let flat = QuadraticFit {
            bend: [0.0; 3],
            ..fit
        };
        let mean = |g: &dyn Fn([f64; 2]) -> f64| {
            let at = |i: i32| f64::from(i) / 20.0 - 0.975;
            let all = (0..1600).map(|i| g([at(i % 40), at(i / 40)]));
            all.sum::<f64>() / 1600.0
        };
        let (bent, plain) = (mean(&|p| fit.at(p) - f(p)), mean(&|p| flat.at(p) - f(p)));
        assert!(bent.abs() < 1e-9 && plain > 0.3, "{bent} {plain}");
    }

    #[test]
    fn places_along_a_line_tell_no_slope() {
        let narrow = EVEN.map(|[x, _]| [x, 0.97 * x + if x > 0.5 { 0.01 } else { 0.0 }]);
        let values = [0.0, 0.02, 0.1, 0.0, 0.05];
        assert!(QuadraticFit::through(&narrow, &values).is_none());
        assert!(QuadraticFit::through(&[[0.3, 0.3]; CORNERS], &values).is_none());
    }

    #[test]
    fn it_adds_and_scales() {
        let (a, b) = ([1.0, 2.0, 0.5, 0.0, 3.0], [0.0, -1.0, 2.0, 4.0, 1.0]);
        let mixed: Vec<f64> = a.iter().zip(b).map(|(a, b)| 2.0 * a - 3.0 * b).collect();
        let at = |v: &[f64]| {
            QuadraticFit::through(&EVEN, v.try_into().unwrap())
                .unwrap()
                .at([0.4, -0.7])
        };
        assert!((at(&mixed) - (2.0 * at(&a) - 3.0 * at(&b))).abs() < 1e-12);
    }
}
