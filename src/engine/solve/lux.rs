//! Levels for an illuminance.
//!
//! A matt surface reflects reflectance / pi times its illuminance towards the eye, so that the
//! images of the banks tell the illuminance from each on visible surfaces.

use std::f64::consts::PI;

use super::{SolveError, Solved, Squares, lights, solved, unknowns};
use crate::{Engine, Error, LiveControl};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::linalg::{Matrix, Vector};
use footlight_show::units::Rgb;
use footlight_transport::seen::{SeenSurface, seen};

/// Levels for an illuminance, and the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Illuminance {
    /// The levels.
    pub solved: Solved,
    /// Illuminance in lux at each point, before and after.
    pub lux: Vec<[f64; 2]>,
}

/// The levels of the named banks and groups, or of all banks without names, that bring the
/// illuminance nearest to `lux` at visible points, each with its name for messages. rgb banks keep
/// their colours.
///
/// # Errors
/// [`Error::Solve`] for a point that is not visible, [`Error::NoSuchBank`], [`Error::NoBanks`], or
/// an error of rendering.
pub fn illuminance(
    engine: &mut Engine,
    live: &LiveControl,
    lux: f64,
    points: &[(&str, Vec3)],
    banks: &[&str],
) -> Result<Illuminance, Error> {
    let mut unknowns = unknowns((engine.document(), live), banks, true)?;
    let setup = engine.document().setup().ok_or(Error::NoSetup)?;
    if setup.scene.haze.is_some() {
        return Err(SolveError::Haze.into());
    }
    let places: Vec<Vec3> = points.iter().map(|(_, place)| *place).collect();
    let found = seen(setup, &places, engine.work())?.into_iter().zip(points);
    let found = found.map(|(surface, (point, _))| {
        surface.map_err(|hidden| SolveError::Hidden {
            point: (*point).to_owned(),
            hidden,
        })
    });
    let surfaces = found.collect::<Result<Vec<SeenSurface>, SolveError>>()?;
    let lit = |image| {
        surfaces
            .iter()
            .map(|surface| falling(&image, surface))
            .collect()
    };
    let (lights, stood): (Vec<Vec<f64>>, _) = lights(engine, live, lit)?;
    // One row per point: the light of each coordinate, and the target.
    let n = lights.len();
    let lit = |i, j| lights.get(j).map_or(lux, |light: &Vec<f64>| light[i]);
    let rows = Matrix::from_fn(surfaces.len(), n + 1, lit);
    let seen: Vec<bool> = rows
        .column_iter()
        .map(|column| column.amax() > 0.0)
        .collect();
    unknowns
        .iter_mut()
        .for_each(|unknown| unknown.hold_unless(&seen));
    let squares = Squares {
        sums: rows.transpose() * &rows,
        stood,
    };
    let solution = squares.solve(&unknowns, 1.0);
    let at = |settings: &[f64]| rows.columns(0, n) * Vector::from_column_slice(settings);
    let (before, after) = (at(&squares.stood), at(&solution.settings));
    let sums = (&squares, 1.0, rows.column(n).norm_squared());
    let solved = solved((engine.document(), live), &unknowns, &solution, sums, &seen);
    let pairs = before
        .iter()
        .zip(&after)
        .map(|(before, after)| [*before, *after]);
    Ok(Illuminance {
        solved,
        lux: pairs.collect(),
    })
}

/// Illuminance of a surface from its radiance, lux when the lights are measured.
fn falling(image: &Image, surface: &SeenSurface) -> f64 {
    let width = image.width().max(1);
    let pixel = image
        .pixel(surface.pixel % width, surface.pixel / width)
        .unwrap_or_default();
    let [r, g, b] = surface.reflectance;
    let [x, y, z] = pixel.map(f64::from);
    PI * Rgb([x / r, y / g, z / b]).luminance()
}
