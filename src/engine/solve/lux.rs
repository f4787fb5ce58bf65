//! Levels from an illuminance.
//!
//! A matt surface sends reflectance / pi times its illuminance to the eye, so that the images of the banks
//! show how much light each throws on what the view shows.

use std::f64::consts::PI;

use super::{SolveError, Solved, Squares, solved, unknowns};
use crate::{Engine, Error, LiveControl};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_show::linalg::Matrix;
use footlight_show::units::Rgb;
use footlight_transport::seen::{SeenSurface, seen};

/// Levels from an illuminance, and how near they come.
#[derive(Clone, Debug, PartialEq)]
pub struct Illuminance {
    /// The levels.
    pub solved: Solved,
    /// Lux at each point with the levels that stood, and with those solved for.
    pub lux: Vec<[f64; 2]>,
}

/// The levels of the banks and groups of these names, of all banks without one, that bring the illuminance
/// nearest to `lux` at points that the view shows, each with its name for messages.
///
/// # Errors
/// [`Error::Solve`] for a point that is not seen, [`Error::NoSuchBank`], [`Error::NoBanks`], else what
/// rendering says.
pub fn illuminance(
    engine: &mut Engine,
    live: &LiveControl,
    lux: f64,
    points: &[(String, Vec3)],
    banks: &[String],
) -> Result<Illuminance, Error> {
    let mut unknowns = unknowns(engine.document(), live, banks)?;
    let setup = engine.document().setup().ok_or(Error::NoSetup)?;
    if setup.scene.haze.is_some() {
        return Err(SolveError::Haze.into());
    }
    let places: Vec<Vec3> = points.iter().map(|(_, place)| *place).collect();
    let found = seen(setup, &places, engine.work())?.into_iter().zip(points);
    let found = found.map(|(surface, (point, _))| {
        surface.map_err(|hidden| SolveError::Hidden {
            point: point.clone(),
            hidden,
        })
    });
    let surfaces = found.collect::<Result<Vec<SeenSurface>, SolveError>>()?;
    engine.coarse()?;
    let images = engine.bank_images(0)?;
    let standing = live.setting(engine.document());
    // A row for each point: the unknowns, everything else, and what is to be met.
    let n = unknowns.len();
    let own: Vec<usize> = unknowns.iter().map(|unknown| unknown.coordinate).collect();
    let mut rows = Matrix::zeros(surfaces.len(), n + 2);
    for (mut row, surface) in rows.row_iter_mut().zip(&surfaces) {
        let lit: Vec<f64> = images.iter().map(|image| falling(image, surface)).collect();
        let at = |i: usize| lit.get(i).copied().unwrap_or_default();
        let others = standing
            .iter()
            .enumerate()
            .filter(|(i, _)| !own.contains(i));
        let rest: f64 = others.map(|(i, x)| x * at(i)).sum();
        let values = own.iter().map(|i| at(*i)).chain([rest, lux]);
        row.iter_mut()
            .zip(values)
            .for_each(|(to, value)| *to = value);
    }
    let seen: Vec<bool> = rows
        .column_iter()
        .map(|column| column.amax() > 0.0)
        .collect();
    for (unknown, _) in unknowns.iter_mut().zip(&seen).filter(|(_, seen)| !**seen) {
        unknown.bounds = (unknown.stood, unknown.stood);
    }
    let squares = Squares(rows.transpose() * &rows);
    let (solution, _) = squares.solve(&unknowns, 1.0);
    let stood: Vec<f64> = unknowns.iter().map(|unknown| unknown.stood).collect();
    let at = |settings: &[f64]| {
        let terms = settings.iter().copied().chain([1.0, 0.0]);
        &rows * Matrix::from_iterator(n + 2, 1, terms)
    };
    let pairs = at(&stood)
        .iter()
        .zip(&at(&solution.x))
        .map(|(a, b)| [*a, *b])
        .collect();
    let left = |x: &[f64]| squares.left(x, 1.0).sqrt() / (lux * (points.len() as f64).sqrt());
    let solved = solved((engine.document(), live), &unknowns, &solution, &seen, left);
    Ok(Illuminance { solved, lux: pairs })
}

/// The light that falls on a surface, lux where the lights are measured.
fn falling(image: &Image, surface: &SeenSurface) -> f64 {
    let width = image.width().max(1);
    let pixel = image
        .pixel(surface.pixel % width, surface.pixel / width)
        .unwrap_or_default();
    let [r, g, b] = surface.reflectance;
    let [x, y, z] = pixel.map(f64::from);
    PI * Rgb([x / r, y / g, z / b]).luminance()
}
