//! Linear least squares within bounds, on the normal equations, by active sets.
//!
//! The active set is that of Stark and Parker 1995 ("Bounded-variable least-squares"), after Lawson and
//! Hanson 1974. Where several points have the least sum of squares, the nearest to a given one is taken:
//! the proximal point method (Rockafellar 1976) finds a minimiser, and a second problem moves it along the
//! null space of the variables that no bound holds.

#![allow(
    clippy::indexing_slicing,
    reason = "all indices run over the variables"
)]

use nalgebra::{Cholesky, DVector, SymmetricEigen};

use super::Matrix;

/// Weight of the distance from the centre in a proximal step, where each column has norm 1.
const PROXIMAL: f64 = 1e-10;
/// Proximal steps; directions of an eigenvalue above [`PROXIMAL`] at least halve their error in each.
const STEPS: usize = 40;
/// The relative gradient at which steps end.
const FLAT: f64 = 1e-12;
/// Weight of the distance where all eigenvalues are 0 or 1, and the steps in which it is taken back.
const NEAREST: (f64, usize) = (1e-5, 4);
/// Below this eigenvalue a direction is not decided by the sum of squares.
const TIED: f64 = 1e-10;
/// Share of an undecided direction from which on a variable takes part in it.
const SHARE: f64 = 0.05;

/// The least of `x' A x / 2 - b' x` within bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundedSolution {
    /// The minimiser that is nearest to the point asked for.
    pub x: Vec<f64>,
    /// Variables that the sum of squares does not decide one by one, but only together.
    pub tied: Vec<Vec<usize>>,
}

/// The minimiser of `x' A x / 2 - b' x` within `bounds` that is nearest to `near`: the least squares
/// solution for the Gram matrix A (symmetric, positive semidefinite) and the products b with what is
/// fitted. A variable with a zero column keeps its value in `near`.
///
/// The gradient meets the conditions of Karush, Kuhn and Tucker to 1e-9 where columns have norm 1; the
/// distance from `near` is least to about 1e-6.
pub fn bounded_least_squares(
    gram: &Matrix,
    right: &[f64],
    bounds: &[(f64, f64)],
    near: &[f64],
) -> BoundedSolution {
    let n = right.len();
    let norm = |i: usize| match gram[(i, i)] {
        square if square > 0.0 => square.sqrt(),
        _ => 1.0,
    };
    let norms: Vec<f64> = (0..n).map(norm).collect();
    let mut unit = Problem {
        gram: Matrix::from_fn(n, n, |i, j| gram[(i, j)] / (norms[i] * norms[j])),
        right: right.iter().zip(&norms).map(|(b, n)| b / n).collect(),
        bounds: bounds
            .iter()
            .zip(&norms)
            .map(|((l, u), n)| (l * n, u * n))
            .collect(),
        centre: near.iter().zip(&norms).map(|(x, n)| x * n).collect(),
        weight: PROXIMAL,
    };
    let size = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut y = unit.centred();
    let flat = FLAT * size(&unit.right).max(size(&y));
    unit.settle(&mut y, flat);
    // Find the directions that no gradient and no bound decides.
    let gradient = unit.gradient(&y);
    let loose: Vec<usize> = (0..n)
        .filter(|i| gradient[*i].abs() <= 10.0 * flat)
        .collect();
    let m = loose.len();
    let null = null_space(Matrix::from_fn(m, m, |i, j| {
        unit.gram[(loose[i], loose[j])]
    }));
    if null.ncols() > 0 {
        // Move along them, in the measure of the variables themselves, towards the point asked for.
        let along = Matrix::from_fn(m, null.ncols(), |i, k| null[(i, k)] / norms[loose[i]]);
        let along = along.qr().q();
        let gram = Matrix::identity(m, m) - &along * along.transpose();
        let found = &gram * DVector::from_fn(m, |i, _| y[loose[i]] / norms[loose[i]]);
        let (weight, steps) = NEAREST;
        let mut nearest = Problem {
            gram,
            right: found.iter().copied().collect(),
            bounds: loose.iter().map(|i| bounds[*i]).collect(),
            centre: loose.iter().map(|i| near[*i]).collect(),
            weight,
        };
        let mut z = nearest.centred();
        for _ in 0..steps {
            nearest.minimise(&mut z, FLAT * weight);
            let off = &found - &nearest.gram * DVector::from_column_slice(&z);
            let shifted = nearest.right.iter_mut().zip(&off);
            shifted.for_each(|(right, off)| *right += off);
        }
        loose.iter().zip(z).for_each(|(i, z)| y[*i] = z * norms[*i]);
        unit.settle(&mut y, flat);
    }
    let unscaled = |i: usize| match (y[i], unit.bounds[i], bounds[i]) {
        (y, (least, _), (lower, _)) if y <= least => lower,
        (y, (_, most), (_, upper)) if y >= most => upper,
        (y, ..) => y / norms[i],
    };
    let seen = |i: usize| gram[(loose[i], loose[i])] > 0.0;
    let together = &null * null.transpose();
    let linked = |i, j| seen(i) && seen(j) && together[(i, j)].abs() > SHARE;
    let tied = groups(m, linked).into_iter();
    BoundedSolution {
        x: (0..n).map(unscaled).collect(),
        tied: tied
            .map(|group| group.into_iter().map(|i| loose[i]).collect())
            .collect(),
    }
}

/// The directions of a matrix's eigenvalues that count as zero, side by side.
fn null_space(gram: Matrix) -> Matrix {
    let m = gram.nrows();
    if m == 0 {
        return gram;
    }
    let SymmetricEigen {
        eigenvalues,
        eigenvectors,
    } = SymmetricEigen::new(gram);
    let null: Vec<usize> = (0..m).filter(|k| eigenvalues[*k] < TIED).collect();
    Matrix::from_fn(m, null.len(), |i, k| eigenvectors[(i, null[k])])
}

/// The groups of more than one of `count` things that are linked, directly or by others.
fn groups(count: usize, linked: impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in 0..count {
        let (own, others): (Vec<_>, Vec<_>) = groups
            .into_iter()
            .partition(|group: &Vec<usize>| group.iter().any(|j| linked(i, *j)));
        groups = others;
        let mut joined = own.concat();
        joined.push(i);
        groups.push(joined);
    }
    groups.retain(|group| group.len() > 1);
    groups
}

/// A quadratic function within bounds, and the weighted distance from a centre.
struct Problem {
    gram: Matrix,
    right: Vec<f64>,
    bounds: Vec<(f64, f64)>,
    centre: Vec<f64>,
    weight: f64,
}

impl Problem {
    /// The point within the bounds that is nearest to the centre.
    fn centred(&self) -> Vec<f64> {
        let pairs = self.centre.iter().zip(&self.bounds);
        pairs
            .map(|(x, (lower, upper))| x.clamp(*lower, *upper))
            .collect()
    }

    /// The gradient of the function without the distance.
    fn gradient(&self, x: &[f64]) -> Vec<f64> {
        let row = |i: usize| -> f64 {
            x.iter()
                .enumerate()
                .map(|(j, x)| self.gram[(i, j)] * x)
                .sum()
        };
        (0..x.len()).map(|i| row(i) - self.right[i]).collect()
    }

    /// How fast the function falls towards the inside from a bound, or either way from between them.
    fn fall(&self, i: usize, x: f64, gradient: f64) -> f64 {
        match self.bounds[i] {
            (lower, upper) if lower >= upper => 0.0,
            (lower, _) if x <= lower => -gradient,
            (_, upper) if x >= upper => gradient,
            _ => gradient.abs(),
        }
    }

    /// The largest violation of the conditions of Karush, Kuhn and Tucker.
    fn violation(&self, x: &[f64]) -> f64 {
        let gradient = self.gradient(x);
        (0..x.len()).fold(0.0, |most, i| most.max(self.fall(i, x[i], gradient[i])))
    }

    /// Takes `x`, within bounds, to a minimiser of the function alone.
    fn settle(&mut self, x: &mut [f64], flat: f64) {
        for _ in 0..STEPS {
            if self.violation(x) <= flat {
                break;
            }
            self.centre.copy_from_slice(x);
            self.minimise(x, 0.1 * flat);
        }
    }

    /// Takes `x`, within bounds, to the least of the function and the distance.
    fn minimise(&self, x: &mut [f64], tolerance: f64) {
        let n = x.len();
        let is_free = |(x, (lower, upper)): (&f64, &(f64, f64))| lower < x && x < upper;
        let mut free: Vec<bool> = x.iter().zip(&self.bounds).map(is_free).collect();
        let mut given_up = vec![false; n];
        // Each pass frees a variable; in exact arithmetic no set of free ones comes twice.
        for _ in 0..10 * n + 10 {
            while let Some(hit) = self.descend(x, &free) {
                free[hit] = false;
            }
            let gradient = self.whole_gradient(x);
            let held = (0..n).filter(|i| !free[*i] && !given_up[*i]);
            let falls = held.map(|i| (self.fall(i, x[i], gradient[i]), i));
            let steepest = falls.max_by(|(a, _), (b, _)| a.total_cmp(b));
            let Some((_, freed)) = steepest.filter(|(fall, _)| *fall > tolerance) else {
                break;
            };
            free[freed] = true;
            let before = x[freed];
            if let Some(hit) = self.descend(x, &free) {
                free[hit] = false;
                // Rounding alone made it look as if it could move.
                given_up[freed] |= hit == freed && x[freed] == before;
            }
        }
    }

    fn whole_gradient(&self, x: &[f64]) -> Vec<f64> {
        let pairs = x.iter().zip(&self.centre);
        let own = self.gradient(x).into_iter().zip(pairs);
        own.map(|(own, (x, centre))| own + self.weight * (x - centre))
            .collect()
    }

    /// Moves the free variables towards the least, as far as bounds allow; which one a bound stopped.
    fn descend(&self, x: &mut [f64], free: &[bool]) -> Option<usize> {
        let own: Vec<usize> = (0..x.len()).filter(|i| free[*i]).collect();
        let gradient = self.whole_gradient(x);
        let mut gram = Matrix::from_fn(own.len(), own.len(), |i, j| self.gram[(own[i], own[j])]);
        (0..own.len()).for_each(|i| gram[(i, i)] += self.weight);
        let down = DVector::from_fn(own.len(), |i, _| -gradient[own[i]]);
        let step = Cholesky::new(gram)?.solve(&down);
        let (mut length, mut hit) = (1.0, None);
        for (i, step) in own.iter().zip(&step) {
            let (lower, upper) = self.bounds[*i];
            let bound = if *step < 0.0 { lower } else { upper };
            let room = (bound - x[*i]) / step;
            if *step != 0.0 && room < length {
                (length, hit) = (room.max(0.0), Some((*i, bound)));
            }
        }
        own.iter()
            .zip(&step)
            .for_each(|(i, step)| x[*i] += length * step);
        let (stopped, bound) = hit?;
        x[stopped] = bound;
        Some(stopped)
    }
}

#[cfg(test)]
mod tests;
