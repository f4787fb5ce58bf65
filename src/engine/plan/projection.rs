//! Projection of a setting on the refined ones: c = (Sᵀ W² S)⁻¹ Sᵀ W² L, by QR of W·S.

use super::{PlanError, Weighting, weighted_columns};
use footlight_show::linalg::{Matrix, least_squares};

/// For each of `settings`, the coefficients of `pool` that minimise the weighted difference. A
/// setting of the pool itself is reproduced. Settings of the pool in the span of those before them
/// get 0.
///
/// # Errors
/// For settings with a wrong number of coordinates.
pub fn projection(
    pool: &[Vec<f64>],
    weighting: &Weighting,
    settings: &[Vec<f64>],
) -> Result<Vec<Vec<f64>>, PlanError> {
    let w = weighting.lifted();
    for setting in pool.iter().chain(settings) {
        let (found, wanted) = (setting.len(), w.len());
        if found != wanted {
            return Err(PlanError::Shape { found, wanted });
        }
    }
    let right = weighted_columns(settings, &w);
    let mut used: Vec<usize> = (0..pool.len()).collect();
    let solved = loop {
        let columns: Vec<&Vec<f64>> = used.iter().filter_map(|i| pool.get(*i)).collect();
        match least_squares(&weighted_columns(&columns, &w), &right) {
            Ok(x) => break x,
            Err(dependent) if dependent.index < used.len() => {
                used.remove(dependent.index);
            }
            Err(_) => break Matrix::zeros(0, settings.len()),
        }
    };
    let mut out = vec![vec![0.0; pool.len()]; settings.len()];
    for (row, column) in out.iter_mut().zip(solved.column_iter()) {
        for (i, c) in used.iter().zip(column.iter()) {
            if let Some(to) = row.get_mut(*i) {
                *to = *c;
            }
        }
    }
    Ok(out)
}
