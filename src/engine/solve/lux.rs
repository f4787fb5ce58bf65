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
use footlight_transport::Setup;
use footlight_transport::seen::{SeenSurface, reflectances, seen};

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
    let surfaces = surfaces_at(engine, points)?;
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

/// The illuminance that an image of the engine's view shows in each pixel, row by row from the top, and at some
/// points of the view, each with its name for messages. NaN where a pixel shows no matt surface, a black one, or
/// more than one material.
///
/// # Errors
/// [`Error::Solve`] for haze, and for a point that is not seen.
pub fn illuminance_of(
    engine: &Engine,
    image: &Image,
    points: &[(&str, Vec3)],
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let at = surfaces_at(engine, points)?;
    let at = at.iter().map(|surface| falling(image, surface)).collect();
    let seen = reflectances(setup(engine)?, engine.work())?.into_iter();
    let lux = |(pixel, reflectance): (usize, Option<[f64; 3]>)| {
        reflectance.map_or(f64::NAN, |reflectance| {
            falling(image, &SeenSurface { pixel, reflectance })
        })
    };
    Ok((seen.enumerate().map(lux).collect(), at))
}

/// The setup, if its images show illuminance.
fn setup(engine: &Engine) -> Result<&Setup, Error> {
    let setup = engine.document().setup().ok_or(Error::NoSetup)?;
    match setup.scene.haze {
        Some(_) => Err(SolveError::Haze.into()),
        None => Ok(setup),
    }
}

/// The surfaces that the view shows at points.
fn surfaces_at(engine: &Engine, points: &[(&str, Vec3)]) -> Result<Vec<SeenSurface>, Error> {
    let places: Vec<Vec3> = points.iter().map(|(_, place)| *place).collect();
    let found = seen(setup(engine)?, &places, engine.work())?;
    let found = found.into_iter().zip(points).map(|(surface, (point, _))| {
        surface.map_err(|hidden| SolveError::Hidden {
            point: (*point).to_owned(),
            hidden,
        })
    });
    Ok(found.collect::<Result<Vec<SeenSurface>, SolveError>>()?)
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
