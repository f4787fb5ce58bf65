//! Linear least squares within bounds, on the normal equations.
//!
//! When several points have the least sum of squares, the result is the one nearest to a given
//! point, by the proximal point method (Rockafellar 1976): each step adds a small multiple of the
//! distance from the last point. Each step is a strictly convex problem, solved by block principal
//! pivoting (Júdice and Pires 1994).

#![allow(
    clippy::indexing_slicing,
    reason = "all indices run over the variables"
)]

use nalgebra::{Cholesky, SymmetricEigen};

use super::{Matrix, Vector};

/// Weight of the distance in a step, relative to a largest column of norm 1; columns below
/// [`SMALL`] weigh as if they had that norm.
const WEIGHT: f64 = 1e-9;
const SMALL: f64 = 1e-3;
/// Most steps, and the step after which small columns weigh no more than others, so that their
/// distance does not hold up the rest.
const STEPS: (usize, usize) = (60, 8);
/// Relative gradient at which the iteration ends.
const FLAT: f64 = 1e-12;
/// Eigenvalue below which the sum of squares does not decide a direction.
const TIED: f64 = 1e-10;
/// Least share of a variable in an undecided direction to count as tied.
const SHARE: f64 = 0.05;
/// Block pivots without progress before single pivots, which terminate for certain.
const PATIENCE: usize = 5;

/// A minimiser of `x' A x / 2 - b' x` within bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct BoundedSolution {
    /// The minimiser nearest to the given point.
    pub x: Vec<f64>,
    /// Variables that the sum of squares decides only jointly.
    pub tied: Vec<usize>,
}

/// The minimiser of `x' A x / 2 - b' x` within `bounds` nearest to `near`. This is the
/// least-squares solution for the Gram matrix A (symmetric, positive semidefinite) and the products
/// b with the target. A variable whose column is zero keeps its value in `near`.
///
/// The Karush-Kuhn-Tucker conditions hold to 1e-9 for columns of norm 1; the distance is least to
/// about 1e-6.
pub fn bounded_least_squares(
    gram: &Matrix,
    right: &[f64],
    bounds: &[(f64, f64)],
    near: &[f64],
) -> BoundedSolution {
    let n = right.len();
    let norms = gram
        .diagonal()
        .map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
    let gram = Matrix::from_fn(n, n, |i, j| gram[(i, j)] / (norms[i] * norms[j]));
    let right = Vector::from_column_slice(right).component_div(&norms);
    let [low, high] = [|b: &(f64, f64)| b.0, |b: &(f64, f64)| b.1]
        .map(|end| Vector::from_iterator(n, bounds.iter().map(end)).component_mul(&norms));
    let near = Vector::from_column_slice(near).component_mul(&norms);
    let mut y = near.zip_zip_map(&low, &high, f64::clamp);
    // Measure the distance in the variables themselves, before columns are scaled.
    let mut weights = norms.map(|norm| WEIGHT / (norm / norms.max()).max(SMALL).powi(2));
    let flat = FLAT * right.amax().max(y.amax());
    let violation = |y: &Vector| {
        let gradient = &gram * y - &right;
        let moved = (y - gradient).zip_zip_map(&low, &high, f64::clamp);
        (moved - y).amax()
    };
    for step in 0..STEPS.0 {
        if violation(&y) <= flat {
            break;
        }
        if step == STEPS.1 {
            weights.fill(WEIGHT);
        }
        y = proximal((&gram, &weights), &right, (&low, &high), &y, 0.1 * flat);
    }
    let gradient = &gram * &y - &right;
    let loose: Vec<usize> = (0..n)
        .filter(|i| gram[(*i, *i)] > 0.0 && gradient[*i].abs() <= 10.0 * flat)
        .collect();
    let x = |i: usize| match y[i] {
        y if y <= low[i] => bounds[i].0,
        y if y >= high[i] => bounds[i].1,
        y => y / norms[i],
    };
    let of = Matrix::from_fn(loose.len(), loose.len(), |i, j| gram[(loose[i], loose[j])]);
    let tied = undecided(of).into_iter().map(|i| loose[i]);
    BoundedSolution {
        tied: tied.collect(),
        x: (0..n).map(x).collect(),
    }
}

/// Variables of the null space of a matrix.
fn undecided(gram: Matrix) -> Vec<usize> {
    let n = gram.nrows();
    if n == 0 {
        return Vec::new();
    }
    let of = SymmetricEigen::new(gram);
    let null: Vec<usize> = (0..n).filter(|k| of.eigenvalues[*k] < TIED).collect();
    let share = |i: &usize| {
        null.iter()
            .map(|k| of.eigenvectors[(*i, *k)].powi(2))
            .sum::<f64>()
    };
    (0..n).filter(|i| share(i) > SHARE).collect()
}

/// Minimises the function plus the weighted distance from `centre` within bounds.
fn proximal(
    (gram, weights): (&Matrix, &Vector),
    right: &Vector,
    (low, high): (&Vector, &Vector),
    centre: &Vector,
    tolerance: f64,
) -> Vector {
    let n = right.len();
    let mut y = centre.clone();
    let mut free: Vec<bool> = (0..n).map(|i| low[i] < y[i] && y[i] < high[i]).collect();
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    // In exact arithmetic, single pivots never return to an earlier set.
    for _ in 0..100 + 20 * n {
        let own: Vec<usize> = (0..n).filter(|i| free[*i]).collect();
        let down = right - gram * &y - (&y - centre).component_mul(weights);
        let mut part = Matrix::from_fn(own.len(), own.len(), |i, j| gram[(own[i], own[j])]);
        (0..own.len()).for_each(|i| part[(i, i)] += weights[own[i]]);
        let Some(solver) = Cholesky::new(part) else {
            break;
        };
        let step = solver.solve(&Vector::from_fn(own.len(), |i, _| down[own[i]]));
        own.iter().zip(&step).for_each(|(i, step)| y[*i] += step);
        let down = right - gram * &y - (&y - centre).component_mul(weights);
        let wrong = |i: &usize| match free[*i] {
            true => y[*i] < low[*i] || y[*i] > high[*i],
            false => {
                low[*i] < high[*i]
                    && (y[*i] <= low[*i] && down[*i] > tolerance
                        || y[*i] >= high[*i] && down[*i] < -tolerance)
            }
        };
        let mut wrong: Vec<usize> = (0..n).filter(wrong).collect();
        if wrong.is_empty() {
            break;
        }
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else if patience > 0 {
            patience -= 1;
        } else {
            wrong.drain(..wrong.len() - 1);
        }
        for i in wrong {
            free[i] = !free[i];
            y[i] = y[i].clamp(low[i], high[i]);
        }
    }
    y.zip_zip_map(low, high, f64::clamp)
}

#[cfg(test)]
mod tests;
