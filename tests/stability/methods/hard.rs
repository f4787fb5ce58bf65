//! Hard matrices, on which some singular value decomposition in use is wrong, slow or never ends,
//! with their singular values (planted, in closed form, or computed in double-double arithmetic).

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed within the shapes that they are made with"
)]

use super::wide::singular_values;
use crate::dice::Dice;
use footlight_show::linalg::{Matrix, Orthonormal};

/// A matrix and its singular values.
#[derive(Clone, Debug)]
pub struct Hard {
    /// Its family.
    pub family: &'static str,
    /// Its name in the family.
    pub name: String,
    /// The matrix.
    pub matrix: Matrix,
    /// Its singular values, descending.
    pub sigma: Vec<f64>,
    /// True when every value is determined to relative accuracy by the matrix's entries (graded
    /// columns).
    pub relative: bool,
}

impl Hard {
    fn new(family: &'static str, name: String, matrix: Matrix, sigma: Vec<f64>) -> Hard {
        let mut sigma = sigma;
        sigma.resize(matrix.nrows().min(matrix.ncols()), 0.0);
        Hard {
            family,
            name,
            matrix,
            sigma,
            relative: false,
        }
    }

    /// With singular values in extended precision.
    fn computed(family: &'static str, name: String, matrix: Matrix) -> Hard {
        let (m, n) = matrix.shape();
        let sigma = singular_values(m, n, |i, j| matrix[(i, j)]);
        let sigma = sigma.into_iter().map(f64::from).collect();
        Hard::new(family, name, matrix, sigma)
    }

    fn graded(self) -> Hard {
        Hard {
            relative: true,
            ..self
        }
    }
}

/// The whole list; `many` random matrices of each random kind.
pub fn list(many: usize) -> Vec<Hard> {
    let mut out = Vec::new();
    out.extend(all_ones());
    out.extend(random(many));
    out.extend((2..=14).map(|n| Hard::computed("Hilbert", format!("{n}"), hilbert(n))));
    out.extend([10, 20, 30].map(|n| Hard::computed("Kahan", format!("{n}"), kahan(n, 0.285))));
    out.extend((1..=15).map(lauchli_of));
    out.extend(repeated());
    out.extend(graded());
    out.extend(ends_of_the_range());
    out.extend(trivial());
    out
}

fn all_ones() -> impl Iterator<Item = Hard> {
    let shapes = (2..=30).flat_map(|m| (2..=30).map(move |n| (m, n)));
    shapes.map(|(m, n)| {
        let a = Matrix::from_element(m, n, 1.0);
        Hard::new(
            "all ones",
            format!("{m} x {n}"),
            a,
            vec![((m * n) as f64).sqrt()],
        )
    })
}

/// Products and matrices of small integers: exact, so that ranks are exact.
fn random(many: usize) -> Vec<Hard> {
    let mut dice = Dice::new(1);
    let mut whole = |m: usize, n: usize, low: f64, high: f64| {
        Matrix::from_fn(m, n, |_, _| dice.between(low, high).floor())
    };
    let (mut out, mut integers) = (Vec::new(), Vec::new());
    for i in 0..many {
        let (m, n, rank) = (2 + i % 11, 2 + (i / 11) % 13, 1 + i % 3);
        let low_rank = whole(m, rank, 0.0, 4.0) * whole(rank, n, 0.0, 4.0);
        let name = format!("{i}: {m} x {n}, rank {rank}");
        out.push(Hard::computed("rank 1 to 3, not negative", name, low_rank));
        let (m, n) = (2 + i % 5, 2 + (i / 5) % 5);
        let small = whole(m, n, -2.0, 3.0);
        let name = format!("{i}: {m} x {n}");
        integers.push(Hard::computed("small whole numbers", name, small));
    }
    let known = Matrix::from_row_slice(3, 3, &[1., 2., 2., 2., -1., -1., 2., 1., -1.]);
    let name = "the 3 x 3".to_owned();
    integers.push(Hard::computed("small whole numbers", name, known));
    out.extend(integers);
    out
}

/// Hilbert's matrix of this size, its entries rounded to doubles.
pub fn hilbert(n: usize) -> Matrix {
    Matrix::from_fn(n, n, |i, j| 1.0 / (i + j + 1) as f64)
}

/// Kahan's: triangular, nearly rank-deficient without a small number on the diagonal.
pub fn kahan(n: usize, c: f64) -> Matrix {
    let s = (1.0 - c * c).sqrt();
    Matrix::from_fn(n, n, |i, j| {
        let scale = s.powi(i as i32);
        match i.cmp(&j) {
            std::cmp::Ordering::Equal => scale,
            std::cmp::Ordering::Less => -c * scale,
            std::cmp::Ordering::Greater => 0.0,
        }
    })
}

/// Läuchli's, 7 x 6: a row of ones over `e` times the identity.
pub fn lauchli(e: f64) -> Matrix {
    Matrix::from_fn(7, 6, |i, j| match i {
        0 => 1.0,
        i if i == j + 1 => e,
        _ => 0.0,
    })
}

fn lauchli_of(exponent: i32) -> Hard {
    let e = 10f64.powi(-exponent);
    let mut sigma = vec![e; 6];
    sigma[0] = (6.0 + e * e).sqrt();
    Hard::new("Läuchli", format!("{e:e}"), lauchli(e), sigma)
}

/// Sylvester's of 2^k: integers, all singular values equal.
fn hadamard(k: u32) -> Matrix {
    let n = 1 << k;
    Matrix::from_fn(n, n, |i, j| {
        if (i & j).count_ones() % 2 == 0 {
            1.0
        } else {
            -1.0
        }
    })
}

fn repeated() -> Vec<Hard> {
    let family = "repeated values";
    let mut out: Vec<Hard> = (1..=5)
        .map(|k| {
            let root = f64::from(1 << k).sqrt();
            Hard::new(
                family,
                format!("Hadamard 2^{k}"),
                hadamard(k),
                vec![root; 1 << k],
            )
        })
        .collect();
    out.push(Hard::new(
        family,
        "identity".to_owned(),
        Matrix::identity(17, 17),
        vec![1.0; 17],
    ));
    // Scaled columns of Hadamard's: three values, each repeated.
    let mut groups = hadamard(4);
    let scales = [3.0, 1.0, 3.0, 2f64.powi(-30), 1.0, 3.0, 2f64.powi(-30), 1.0];
    for (j, mut column) in groups.column_iter_mut().enumerate() {
        column *= scales[j % 8];
    }
    let mut sigma: Vec<f64> = (0..16).map(|j| 4.0 * scales[j % 8]).collect();
    sigma.sort_by(|a, b| b.total_cmp(a));
    out.push(Hard::new(family, "groups".to_owned(), groups, sigma).graded());
    out
}

/// Orthonormal columns, by this project's own method.
fn orthonormal(rows: usize, columns: usize) -> Matrix {
    let mut dice = Dice::new(3);
    let mut set = Orthonormal::new();
    while set.vectors().len() < columns {
        let vector: Vec<f64> = (0..rows).map(|_| dice.between(-1.0, 1.0)).collect();
        let _ = set.push(&vector);
    }
    set.matrix(rows)
}

fn graded() -> Vec<Hard> {
    let n = 29;
    let value = |i: usize| 10f64.powi(140 - 10 * i as i32);
    let mut diagonal = Matrix::zeros(n, n);
    for i in 0..n {
        diagonal[(i, (i * 7) % n)] = value(i);
    }
    let sigma = (0..n).map(value).collect();
    let name = "diagonal, 1e140 to 1e-140".to_owned();
    let mut out = vec![Hard::new("graded", name, diagonal, sigma).graded()];
    for decades in [1, 2, 4] {
        let mut a = orthonormal(20, 12);
        for (j, mut column) in a.column_iter_mut().enumerate() {
            column *= 10f64.powi(-decades * j as i32);
        }
        let name = format!("columns, {decades} decades each");
        out.push(Hard::computed("graded", name, a).graded());
    }
    out
}

/// Integer matrices times powers of two: exact, at the ends of the doubles' range.
fn ends_of_the_range() -> Vec<Hard> {
    let base = Matrix::from_fn(6, 4, |i, j| ((i * i + 3 * j + i * j) % 7) as f64);
    let sigma = singular_values(6, 4, |i, j| base[(i, j)]);
    let of = |exponent: i32| {
        // In two steps, because the power alone may be out of range.
        let half = exponent / 2;
        let (a, b) = (2f64.powi(half), 2f64.powi(exponent - half));
        let scaled = base.map(|x| x * a * b);
        let sigma = sigma.iter().map(|s| f64::from(*s) * a * b).collect();
        Hard::new("ends of the range", format!("2^{exponent}"), scaled, sigma)
    };
    [-1074, -1060, -1022, -1000, -500, 500, 1000, 1017]
        .map(of)
        .into()
}

fn trivial() -> Vec<Hard> {
    let mut out: Vec<Hard> = [(1, 1), (1, 7), (7, 1), (4, 9), (0, 0), (0, 5), (5, 0)]
        .map(|(m, n)| {
            Hard::new(
                "zero or empty",
                format!("{m} x {n}"),
                Matrix::zeros(m, n),
                Vec::new(),
            )
        })
        .into();
    for n in 1..=20 {
        let x = Matrix::from_fn(n, 1, |i, _| (i + 1) as f64);
        let norm = ((n * (n + 1) * (2 * n + 1) / 6) as f64).sqrt();
        let family = "one row or column";
        out.push(Hard::new(family, format!("{n} x 1"), x.clone(), vec![norm]));
        out.push(Hard::new(
            family,
            format!("1 x {n}"),
            x.transpose(),
            vec![norm],
        ));
    }
    out
}

/// A decomposition under test.
#[derive(Clone, Debug)]
pub struct Found {
    /// Left vectors, as columns.
    pub u: Matrix,
    /// Singular values.
    pub sigma: Vec<f64>,
    /// Right vectors, as columns.
    pub v: Matrix,
}

/// Errors of a decomposition, as multiples of the rounding tolerance 16·eps·sqrt(mn).
#[derive(Clone, Copy, Debug, Default)]
pub struct Verdict {
    /// ‖A − UΣVᵀ‖ / ‖A‖ (Frobenius).
    pub residual: f64,
    /// |Σσ² − ‖A‖²| / ‖A‖².
    pub squares: f64,
    /// The larger of ‖UᵀU − 1‖ and ‖VᵀV − 1‖.
    pub orthogonality: f64,
    /// Largest error of a singular value, over the largest value.
    pub values: f64,
    /// Largest error of a singular value over the value itself, if the matrix determines it.
    pub relative: f64,
}

impl Verdict {
    /// True when each is within rounding.
    pub fn good(&self) -> bool {
        let all = [self.residual, self.squares, self.orthogonality, self.values];
        all.iter().all(|x| *x <= 1.0)
    }
}

/// Judges a decomposition against its definition and the true values.
pub fn judge(hard: &Hard, found: &Found) -> Verdict {
    let (m, n) = hard.matrix.shape();
    let allowed = 16.0 * f64::EPSILON * ((m * n) as f64).sqrt();
    let largest = hard.matrix.amax();
    if largest == 0.0 {
        let off = found.sigma.iter().fold(0.0f64, |a, b| a.max(b.abs()));
        return Verdict {
            values: if off == 0.0 { 0.0 } else { f64::INFINITY },
            ..Verdict::default()
        };
    }
    // Scale by the largest power of two, so that no square leaves the range.
    let half = -(largest.log2().floor() as i32) / 2;
    let rest = -(largest.log2().floor() as i32) - half;
    let scale = |x: f64| x * 2f64.powi(half) * 2f64.powi(rest);
    let a = hard.matrix.map(scale);
    let sigma: Vec<f64> = found.sigma.iter().map(|s| scale(*s)).collect();
    let mut product = found.u.clone();
    for (mut column, s) in product.column_iter_mut().zip(&sigma) {
        column *= *s;
    }
    let apart = |q: &Matrix| (q.transpose() * q - Matrix::identity(q.ncols(), q.ncols())).norm();
    let squares: f64 = sigma.iter().map(|s| s * s).sum();
    let truth: Vec<f64> = hard.sigma.iter().map(|s| scale(*s)).collect();
    let off = |(s, t): (&f64, &f64)| (s - t).abs();
    let worst = |of: &dyn Fn((&f64, &f64)) -> f64| {
        // NaN is as wrong as possible.
        let wrong = |x: f64| if x.is_nan() { f64::INFINITY } else { x };
        sigma
            .iter()
            .zip(&truth)
            .map(|p| wrong(of(p)))
            .fold(0.0f64, f64::max)
    };
    // A subnormal result is rounded to the smallest subnormal, whatever the method.
    let grain = scale(f64::from_bits(1)).min(1.0);
    let own = |(s, t): (&f64, &f64)| (off((s, t)) - grain).max(0.0) / t;
    Verdict {
        residual: ((product * found.v.transpose() - &a).norm() - grain).max(0.0)
            / a.norm()
            / allowed,
        squares: (squares / a.norm_squared() - 1.0).abs() / (allowed + 4.0 * grain),
        orthogonality: apart(&found.u).max(apart(&found.v)) / allowed,
        values: worst(&|p| (off(p) - grain).max(0.0) / truth[0]) / allowed,
        relative: if hard.relative {
            worst(&own) / allowed
        } else {
            0.0
        },
    }
}
