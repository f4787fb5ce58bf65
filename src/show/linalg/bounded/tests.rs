#![allow(clippy::unwrap_used, reason = "tests")]

use super::*;
use crate::hash::mix;

/// A pseudo-random number from -1 to 1.
fn number(seed: u64, i: usize) -> f64 {
    (mix(seed << 32 | i as u64) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// The Gram matrix of the columns, and their products with `b`.
fn normal_equations(a: &Matrix, b: &[f64]) -> (Matrix, Vec<f64>) {
    let b = nalgebra::DVector::from_column_slice(b);
    let right = a.transpose() * b;
    (a.transpose() * a, right.iter().copied().collect())
}

fn residual(a: &Matrix, b: &[f64], x: &[f64]) -> f64 {
    let off = a * nalgebra::DVector::from_column_slice(x) - nalgebra::DVector::from_column_slice(b);
    off.norm_squared()
}

/// Violation of the Karush-Kuhn-Tucker conditions for columns of norm 1, relative to the target.
fn violation((gram, right): (&Matrix, &[f64]), bounds: &[(f64, f64)], x: &[f64], size: f64) -> f64 {
    let mut most = 0.0_f64;
    for (i, (lower, upper)) in bounds.iter().enumerate() {
        assert!(*lower <= x[i] && x[i] <= *upper, "{i}: {}", x[i]);
        let product: f64 = (0..x.len()).map(|j| gram[(i, j)] * x[j]).sum();
        let norm = gram[(i, i)].sqrt();
        if norm == 0.0 || lower == upper {
            continue;
        }
        let gradient = (product - right[i]) / (norm * size);
        most = most.max(match () {
            () if x[i] == *lower => -gradient,
            () if x[i] == *upper => gradient,
            () => gradient.abs(),
        });
    }
    most
}

/// Column norms span eight orders of magnitude; in half of the problems some columns are sums of
/// others.
#[test]
fn a_thousand_random_problems_meet_the_conditions_of_optimality() {
    for seed in 0..1000_u64 {
        let pick = |i: usize, count: usize| (mix(seed << 20 | i as u64) % count as u64) as usize;
        let (n, rows) = (1 + pick(0, 30), 3 + pick(1, 60));
        let mut a = Matrix::from_fn(rows, n, |i, j| number(seed, n * i + j).abs());
        for j in 0..n {
            let light = 10_f64.powi(pick(100 + j, 9) as i32 - 6);
            let of: [f64; 2] = [0, 1].map(|k| number(seed, 9000 + 2 * j + k));
            match pick(200 + j, 6) {
                0 if seed % 2 == 0 && j > 1 => {
                    let sum = a.column(j - 1) * of[0] + a.column(j - 2) * of[1];
                    a.set_column(j, &sum);
                }
                1 if seed % 2 == 0 && j > 1 => a.set_column(j, &(a.column(j - 2) * 1.0)),
                2 if seed % 7 == 0 => a.set_column(j, &(a.column(j) * 0.0)),
                _ => a.set_column(j, &(a.column(j) * light)),
            }
        }
        let planted: Vec<f64> = (0..n).map(|j| number(seed, 7000 + j)).collect();
        let mut b: Vec<f64> = (&a * nalgebra::DVector::from_vec(planted))
            .iter()
            .copied()
            .collect();
        b.iter_mut()
            .enumerate()
            .for_each(|(i, b)| *b += 0.3 * number(seed, 8000 + i));
        let bounds: Vec<(f64, f64)> = (0..n)
            .map(|j| match pick(300 + j, 8) {
                0 => (0.4, 0.4),
                1 => (0.0, 1e-3),
                _ => (0.0, 1.0),
            })
            .collect();
        let near: Vec<f64> = (0..n).map(|j| [0.0, 1.0, 0.37][pick(400 + j, 3)]).collect();
        let (gram, right) = normal_equations(&a, &b);
        let found = bounded_least_squares(&gram, &right, &bounds, &near);
        let size = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        let off = violation((&gram, &right), &bounds, &found.x, size);
        assert!(off <= 1e-9, "{seed}: {off:e}");
    }
}

/// Seed, least sum of squares and minimiser, by SciPy 1.17.1's `nnls` for odd seeds and
/// `lsq_linear` from 0 to 1 for even ones, made by
///
/// ```text
/// from scipy.optimize import lsq_linear, nnls
/// M = 2**64 - 1
/// def mix(z):
///     z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9 & M
///     z = (z ^ (z >> 27)) * 0x94d049bb133111eb & M
///     return z ^ (z >> 31)
/// def number(seed, i):
///     return (mix(seed << 32 | i) >> 11) / 2**52 - 1
/// for seed in range(1, 11):
///     n = 2 + seed % 6
///     a = [[number(seed, n * i + j) for j in range(n)] for i in range(12)]
///     b = [2 * number(seed, 1000 + i) + a[i][0] for i in range(12)]
///     if seed % 2:
///         x, norm = nnls(a, b); cost = norm ** 2
///     else:
///         found = lsq_linear(a, b, (0, 1), tol=1e-15); x, cost = found.x, 2 * found.cost
///     print("(%d, %.14f, &%s)," % (seed, cost, [float("%.12f" % v) for v in x]))
/// ```
type Known = (u64, f64, &'static [f64]);

#[rustfmt::skip]
const SCIPY: [Known; 10] = [
    (1, 15.98340066036209, &[2.622902707615, 0.659134740598, 0.0]),
    (2, 10.20992039093267, &[0.586579903831, 0.473400076006, 1.0, 0.0]),
    (3, 11.40157733220767, &[1.466608048028, 0.215019476575, 0.0, 0.0, 0.313634762504]),
    (4, 13.64153536128836, &[1.0, 0.0, 0.0, 0.0, 0.442442374162, 0.0]),
    (5, 9.69933924809075, &[1.611624263961, 0.0, 0.011095459666, 0.0, 0.141419449816, 0.166353357863, 0.0]),
    (6, 9.47294480458021, &[1.0, 0.150841757384]),
    (7, 12.53396221320992, &[1.06387393761, 0.0, 0.0]),
    (8, 10.60495335565083, &[0.94104889686, 0.0, 1.0, 0.998645304496]),
    (9, 11.09865071055965, &[2.282829776955, 0.126706241675, 0.0, 1.208447033384, 0.295015034974]),
    (10, 12.02023146078007, &[1.0, 0.781134202588, 0.0, 0.0, 0.0, 0.989941885033]),
];

#[test]
fn the_minimum_is_that_of_scipy() {
    for (seed, cost, x) in SCIPY {
        let n = x.len();
        let a = Matrix::from_fn(12, n, |i, j| number(seed, n * i + j));
        let b: Vec<f64> = (0..12)
            .map(|i| 2.0 * number(seed, 1000 + i) + a[(i, 0)])
            .collect();
        let upper = if seed % 2 == 1 { f64::INFINITY } else { 1.0 };
        let (gram, right) = normal_equations(&a, &b);
        let found = bounded_least_squares(&gram, &right, &vec![(0.0, upper); n], &vec![0.3; n]);
        let off = residual(&a, &b, &found.x) - cost;
        assert!(off.abs() < 1e-12 * cost, "{seed}: {off:e}");
        for (found, x) in found.x.iter().zip(x) {
            // SciPy's interior point method stops a little short of a bound.
            assert!((found - x).abs() < 1e-9, "{seed}: {found} {x}");
        }
        assert!(found.tied.is_empty());
    }
}

fn near(found: &[f64], expected: &[f64], tolerance: f64) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < tolerance, "{found} {expected}");
    }
}

/// Two equal columns and one of twice their light share a sum with the least change: by Lagrange
/// multipliers, each moves in proportion to its light. When one reaches a bound, the others
/// continue.
#[test]
fn ties_are_the_smallest_change() {
    let a = Matrix::from_row_slice(2, 4, &[1.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let solve = |sum: f64, stood: [f64; 4]| {
        let (gram, right) = normal_equations(&a, &[sum, 0.25]);
        bounded_least_squares(&gram, &right, &[(0.0, 1.0); 4], &stood)
    };
    // The start gives 0.9; the missing 0.7 is divided 1 : 1 : 2 by light.
    let found = solve(1.6, [0.1, 0.4, 0.2, 0.9]);
    assert_eq!(found.tied, [0, 1, 2]);
    let by = 0.7 / 6.0;
    near(&found.x, &[0.1 + by, 0.4 + by, 0.2 + 2.0 * by, 0.25], 1e-6);
    // The third stops at full; the two others share 1.0.
    let found = solve(3.0, [0.1, 0.2, 0.9, 0.0]);
    near(&found.x, &[0.45, 0.55, 1.0, 0.25], 1e-6);
    // The start fits already.
    let found = solve(0.9, [0.1, 0.4, 0.2, 0.25]);
    near(&found.x, &[0.1, 0.4, 0.2, 0.25], 1e-9);
    // The target exceeds their sum: all are at full, and nothing is tied.
    let found = solve(9.0, [0.1, 0.4, 0.2, 0.25]);
    near(&found.x, &[1.0, 1.0, 1.0, 0.25], 1e-9);
    assert!(found.tied.is_empty());
}

/// A column without light keeps its value. Columns that differ by single-precision rounding are
/// tied; columns that differ by a thousandth are not.
#[test]
fn columns_that_are_alike_to_rounding_are_tied() {
    let rows = 4000;
    let column = |i: usize, scale: f64| scale * (1.5 + number(5, i));
    let rounded = |i: usize, seed: u64, by: f64| column(i, 1.0) * (1.0 + by * number(seed, i));
    let of = |by: f64| {
        let a = Matrix::from_fn(rows, 4, |i, j| match j {
            0 => f64::from(column(i, 1.0) as f32),
            1 => f64::from((3.0 * rounded(i, 6, by)) as f32) / 3.0,
            2 => 0.0,
            _ => number(7, i).abs(),
        });
        let known = [0.3, 0.6, 0.0, 0.5];
        let b = &a * nalgebra::DVector::from_column_slice(&known);
        let (gram, right) = normal_equations(&a, b.as_slice());
        bounded_least_squares(&gram, &right, &[(0.0, 1.0); 4], &[0.5, 0.5, 0.7, 0.0])
    };
    let alike = of(0.0);
    near(&alike.x, &[0.45, 0.45, 0.7, 0.5], 1e-5);
    assert_eq!(alike.tied, [0, 1]);
    let apart = of(1e-3);
    near(&apart.x, &[0.3, 0.6, 0.7, 0.5], 1e-5);
    assert!(apart.tied.is_empty());
}
