//! Hard matrices, on which some SVD in use is wrong, slow or never ends. `svd` verifies itself, so
//! each `unwrap` here is a check; planted singular values are compared too.

use super::*;
use proptest::prelude::*;

fn check(a: &Matrix) -> Svd {
    let svd = svd(a).unwrap();
    assert_eq!(svd.sigma.len(), a.nrows().min(a.ncols()));
    svd
}

/// Checks planted singular values, to `tolerance` of the largest.
fn planted(a: &Matrix, sigma: &[f64], tolerance: f64) {
    let svd = check(a);
    let largest = sigma.iter().fold(0.0f64, |s, x| s.max(*x));
    for (i, found) in svd.sigma.iter().enumerate() {
        let want = sigma.get(i).copied().unwrap_or(0.0);
        assert!(
            (found - want).abs() <= tolerance * largest,
            "sigma {i}: {found:e} for {want:e}"
        );
    }
}

/// A product of Householder reflections: orthogonal to rounding.
fn orthogonal(n: usize, seed: u64) -> Matrix {
    let mut q = Matrix::identity(n, n);
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    for _ in 0..n.min(6) {
        let v = nalgebra::DVector::from_fn(n, |_, _| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        });
        let v = v.normalize();
        q -= 2.0 * &v * (v.transpose() * &q);
    }
    q
}

fn with_sigma(m: usize, n: usize, sigma: &[f64]) -> Matrix {
    let (u, v) = (orthogonal(m, 7 + n as u64), orthogonal(n, 99 + m as u64));
    let mut s = Matrix::zeros(m, n);
    for (i, x) in sigma.iter().enumerate() {
        s[(i, i)] = *x;
    }
    u * s * v.transpose()
}

#[test]
fn empty_and_zero() {
    for (m, n) in [(0, 0), (0, 5), (5, 0)] {
        assert!(check(&Matrix::zeros(m, n)).sigma.is_empty());
    }
    for (m, n) in [(1, 1), (1, 7), (7, 1), (4, 9)] {
        let svd = check(&Matrix::zeros(m, n));
        assert!(svd.sigma.iter().all(|s| *s == 0.0));
        assert_eq!(svd.rank(0.0), 0);
        let u = svd.u.transpose() * &svd.u;
        assert_eq!(u, Matrix::identity(m.min(n), m.min(n)));
    }
}

#[test]
fn all_ones_of_every_shape() {
    for m in 1..=30 {
        for n in 1..=30 {
            let a = Matrix::from_element(m, n, 1.0);
            planted(&a, &[((m * n) as f64).sqrt()], 1e-15);
            assert_eq!(check(&a).rank(0.0), 1, "{m} x {n}");
        }
    }
}

#[test]
fn the_three_by_three_that_nalgebra_gets_wrong() {
    let a = Matrix::from_row_slice(3, 3, &[1., 2., 2., 2., -1., -1., 2., 1., -1.]);
    // AᵀA has the characteristic polynomial x³ − 21x² + 120x − 100 (by hand).
    let svd = check(&a);
    for s in &svd.sigma {
        let x = s * s;
        assert!((((x - 21.0) * x + 120.0) * x - 100.0).abs() < 1e-11, "{s}");
    }
}

#[test]
fn planted_rank_and_repeated_values() {
    for (m, n, r) in [(6, 21, 1), (40, 12, 3), (24, 24, 5), (9, 60, 8)] {
        let sigma: Vec<f64> = (0..r).map(|i| 1.0 / (1 + i) as f64).collect();
        let a = with_sigma(m, n, &sigma);
        planted(&a, &sigma, 1e-14);
        assert_eq!(check(&a).rank(0.0), r);
    }
    planted(&with_sigma(20, 15, &[2.0; 15]), &[2.0; 15], 1e-14);
    let groups = [3.0, 3.0, 3.0, 1.0, 1.0, 1e-9, 1e-9];
    planted(&with_sigma(7, 12, &groups), &groups, 1e-14);
    planted(&Matrix::identity(17, 17), &[1.0; 17], 1e-15);
}

#[test]
fn graded_keeps_relative_accuracy() {
    // A diagonal over 300 decades, permuted: every value is recovered.
    let n = 31;
    let mut a = Matrix::zeros(n, n);
    for i in 0..n {
        a[(i, (i * 7) % n)] = 10f64.powi(150 - 10 * i as i32);
    }
    // Values below 1e-290 of the largest count as zero.
    for (i, s) in check(&a).sigma.iter().enumerate().take(n - 1) {
        let want = 10f64.powi(150 - 10 * i as i32);
        assert!((s / want - 1.0).abs() < 1e-14, "{s:e} for {want:e}");
    }
    // Columns of orthogonal matrices, graded: sigma is the grading.
    let grades: Vec<f64> = (0..12).map(|i| 10f64.powi(-i)).collect();
    let mut b = orthogonal(20, 3).columns(0, 12).into_owned();
    for (j, g) in grades.iter().enumerate() {
        b.column_mut(j).scale_mut(*g);
    }
    for (s, want) in check(&b).sigma.iter().zip(&grades) {
        assert!((s / want - 1.0).abs() < 1e-13, "{s:e} for {want:e}");
    }
}

#[test]
fn hilbert() {
    // Values of the 8 x 8 from a computation with 40 digits of the literature's determinant:
    // det(H8) = 2.73705011379151e-33 (Choi, "Tricks or treats with the Hilbert matrix", 1983).
    let a = Matrix::from_fn(8, 8, |i, j| 1.0 / (i + j + 1) as f64);
    let svd = check(&a);
    let determinant: f64 = svd.sigma.iter().product();
    assert!((determinant / 2.737_050_113_791_51e-33 - 1.0).abs() < 1e-5);
    assert!((svd.sigma[0] - 1.695_938_996_921_949).abs() < 1e-14);
    for n in [12, 20, 40] {
        check(&Matrix::from_fn(n, n, |i, j| 1.0 / (i + j + 1) as f64));
    }
}

#[test]
fn kahan() {
    let (n, c) = (30, 0.285f64);
    let s = (1.0 - c * c).sqrt();
    let a = Matrix::from_fn(n, n, |i, j| {
        let scale = s.powi(i as i32);
        match i.cmp(&j) {
            std::cmp::Ordering::Equal => scale,
            std::cmp::Ordering::Less => -c * scale,
            std::cmp::Ordering::Greater => 0.0,
        }
    });
    let svd = check(&a);
    // Triangular: the product of the singular values is the product of the diagonal.
    let logs: f64 = svd.sigma.iter().map(|x| x.ln()).sum();
    let want = (0..n).map(|i| i as f64 * s.ln()).sum::<f64>();
    assert!((logs - want).abs() < 1e-8);
}

#[test]
fn lauchli() {
    for e in [1e-4f64, 1e-8, 1e-12] {
        let a = Matrix::from_fn(7, 6, |i, j| match i {
            0 => 1.0,
            i if i == j + 1 => e,
            _ => 0.0,
        });
        let svd = check(&a);
        assert!((svd.sigma[0] - (6.0 + e * e).sqrt()).abs() < 1e-15 * 4.0);
        for s in &svd.sigma[1..] {
            assert!((s - e).abs() < 1e-15, "{s:e} for {e:e}");
        }
    }
}

#[test]
fn ends_of_the_range() {
    let tiny = f64::from_bits(1);
    for scale in [tiny, 3.0 * tiny, 1e-310, 1e-300, 1e300, 1e307] {
        let a = Matrix::from_fn(3, 2, |i, j| scale * [[1., 0.], [0., 2.], [0., 0.]][i][j]);
        let svd = check(&a);
        assert_eq!(svd.sigma, vec![2.0 * scale, scale]);
    }
    assert_eq!(
        svd(&Matrix::from_element(30, 30, f64::MAX)),
        Err(SvdError::Overflow)
    );
    check(&Matrix::from_fn(5, 5, |i, j| tiny * (1 + i * j) as f64));
}

#[test]
fn one_row_or_column() {
    for n in 1..=20 {
        let x = Matrix::from_fn(n, 1, |i, _| (i as f64 + 1.0).sin());
        planted(&x, &[x.norm()], 1e-15);
        planted(&x.transpose(), &[x.norm()], 1e-15);
    }
}

#[test]
fn not_finite_is_an_error_with_its_place() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut a = Matrix::from_element(3, 4, 1.0);
        a[(1, 2)] = bad;
        let error = svd(&a).unwrap_err();
        assert!(matches!(
            error,
            SvdError::NotFinite {
                row: 1,
                column: 2,
                ..
            }
        ));
    }
}

#[test]
fn the_check_finds_a_wrong_decomposition() {
    let a = with_sigma(6, 4, &[3.0, 2.0, 1.0, 0.5]);
    let good = svd(&a).unwrap();
    let mut wrong = good.clone();
    wrong.sigma[0] *= 1.0 + 1e-12;
    assert!(verify(&a, &wrong).is_err());
    let mut wrong = good.clone();
    wrong.u[(0, 0)] += 1e-12;
    assert!(verify(&a, &wrong).is_err());
    let mut wrong = good.clone();
    wrong.sigma.swap(1, 2);
    assert!(verify(&a, &wrong).is_err());
    assert!(verify(&a, &good).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn small_integer_matrices(m in 1..8usize, n in 1..8usize, seed in any::<u64>()) {
        let mut s = seed | 1;
        let a = Matrix::from_fn(m, n, |_, _| {
            s ^= s << 13; s ^= s >> 7; s ^= s << 17;
            (s % 5) as f64 - 2.0
        });
        prop_assert!(svd(&a).is_ok());
    }

    #[test]
    fn the_same_bits_twice_and_signs_fixed(m in 1..9usize, n in 1..9usize, seed in any::<u64>()) {
        let a = with_sigma(m, n, &[]) + orthogonal(m.max(n), seed).view((0, 0), (m, n));
        let (x, y) = (svd(&a).unwrap(), svd(&a).unwrap());
        prop_assert_eq!(&x, &y);
        for column in x.u.column_iter() {
            let largest = column.amax();
            let first = column.iter().find(|v| v.abs() >= largest * (1.0 - 1e-8)).unwrap();
            prop_assert!(*first >= 0.0);
        }
        let flipped = svd(&-&a).unwrap();
        prop_assert!((flipped.u - x.u).amax() < 1e-6 || x.sigma.windows(2).any(|w| w[0] - w[1] < 1e-6));
    }
}
