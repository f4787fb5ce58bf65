//! Filters the noise of gathered light over the parts of pixels that show one surface.
//!
//! Reflected light on a surface varies over the distance of the visible surfaces (Ward, Rubinstein
//! and Clear 1988). Within a small share of that distance a part takes the value of a plane fitted
//! to its neighbours, which keeps gradients and removes noise. Weights depend on geometry alone.

use crate::gather::parts::{ALIKE, Look, Part, Parts};
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, frame};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Pixels on each side used for the fit.
const REACH: usize = 8;
/// Stride of the neighbours of a part seen in a glossy surface: such parts are mostly dim, so fewer
/// neighbours suffice. The light of wide lobes is first averaged over the pixels in between, as a
/// ray that meets something bright would be repeated in a grid of dots.
const SPARSE_STEP: usize = 3;

impl Part {
    /// Weight of another part of the same material, and its position in this part's plane, in radii
    /// along the plane's axes; `None` for another surface.
    fn weight(&self, [u, v]: [Vec3; 2], other: &Part) -> Option<(f64, [f64; 2])> {
        let alike = self.normal.dot(other.normal);
        if alike < ALIKE {
            return None;
        }
        let way = other.point - self.point;
        let radius = f64::from(self.radius.min(other.radius));
        let square = way.dot(way) / (radius * radius);
        let height = way.dot(self.normal).abs().min(way.dot(other.normal).abs());
        if square >= 1.0 || height > 0.1 * radius {
            return None;
        }
        let weight = (1.0 - square) * (1.0 - 10.0 * (1.0 - alike)).max(0.0);
        // Fewer rays have more noise.
        let weight = weight * f64::from(other.rays);
        (weight > 0.0).then_some((weight, [way.dot(u) / radius, way.dot(v) / radius]))
    }
}

/// Pixels within `reach`, `step` apart, each with a factor that falls to 0 at the edge.
fn around(
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
    [reach, step]: [usize; 2],
) -> impl Iterator<Item = (usize, f64)> {
    let near = move |middle: usize, count: usize| {
        let all = middle.saturating_sub(reach)..(middle + reach + 1).min(count);
        all.filter(move |at| at.abs_diff(middle).is_multiple_of(step))
    };
    let pairs = near(y, rows).flat_map(move |j| near(x, columns).map(move |i| [i, j]));
    pairs.filter_map(move |[i, j]| {
        let square = i.abs_diff(x).pow(2) + j.abs_diff(y).pow(2);
        let fade = 1.0 - square as f64 / (reach + 1).pow(2) as f64;
        (fade > 0.0).then_some((j * columns + i, fade))
    })
}

/// Values of all parts (`width` numbers each), fitted to their neighbours.
///
/// # Errors
/// On cancel.
pub fn filter(
    parts: &Parts,
    columns: usize,
    values: &[f32],
    width: usize,
    work: Work<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let fit = Fit {
        parts,
        columns,
        width,
        work,
    };
    let is_wide = |part: &Part| part.look == Look::Gloss;
    let even = if parts.all().iter().any(is_wide) {
        Some(fit.around(values, |part| is_wide(part).then_some([1, 1]))?)
    } else {
        None
    };
    let step = |part: &Part| match part.look {
        Look::Matt => 1,
        Look::Mirrored | Look::Gloss => SPARSE_STEP,
    };
    fit.around(even.as_deref().unwrap_or(values), |part| {
        Some([REACH, step(part)])
    })
}

/// Parts and the numbers of each, to be fitted.
struct Fit<'a> {
    parts: &'a Parts,
    columns: usize,
    width: usize,
    work: Work<'a>,
}

impl Fit<'_> {
    /// Fits each part for which `near` gives reach and stride of the neighbours.
    fn around(
        &self,
        values: &[f32],
        near: impl Fn(&Part) -> Option<[usize; 2]> + Sync,
    ) -> Result<Vec<f32>, Cancelled> {
        let (parts, columns, width) = (self.parts, self.columns, self.width);
        let mut out = values.to_vec();
        let rows = parts.pixels.count() / columns.max(1);
        // This test alone rejects most neighbours of a glossy pixel.
        let kind = |part: &Part| 2 * part.material + u32::from(part.look == Look::Gloss);
        let kinds: Vec<u32> = parts.all().iter().map(kind).collect();
        let lines = parts.rows(columns, width, &mut out).into_par_iter();
        lines.enumerate().try_for_each(|(y, line)| {
            self.work.check()?;
            let mut found: Vec<(usize, f64, [f64; 2])> = Vec::new();
            let mut outs = line.chunks_exact_mut(width);
            for x in 0..columns {
                for own in parts.pixels.get(y * columns + x) {
                    let (Some(out), Some(near)) = (outs.next(), near(own)) else {
                        continue;
                    };
                    found.clear();
                    let axes = frame(own.normal);
                    let pixels = around([x, y], [columns, rows], near);
                    let all = pixels.flat_map(|(pixel, fade)| {
                        parts.pixels.range(pixel).map(move |at| (at, fade))
                    });
                    for (at, fade) in all.filter(|(at, _)| kinds[*at] == kind(own)) {
                        let own = own.weight(axes, &parts.all()[at]);
                        found.extend(own.map(|(weight, place)| (at, fade * weight, place)));
                    }
                    let fit = plane(&found);
                    out.fill(0.0);
                    for (at, weight, [u, v]) in &found {
                        let share = weight * (fit[0] + fit[1] * u + fit[2] * v);
                        let value = &values[at * width..(at + 1) * width];
                        for (sum, value) in out.iter_mut().zip(value) {
                            *sum += share as f32 * value;
                        }
                    }
                }
            }
            Ok(())
        })?;
        Ok(out)
    }
}

/// Filters light that may have shadow edges (three channels of each light, and the variance of the
/// highest one) where it differs from its neighbours only by noise: a part takes the filtered light
/// plus the signal share of the difference (Lee, *Digital image enhancement and noise filtering by
/// use of local statistics*, 1980).
///
/// # Errors
/// On cancel.
pub fn even_out(
    parts: &Parts,
    columns: usize,
    light: &mut [f32],
    variance: &[f32],
    work: Work<'_>,
) -> Result<(), Cancelled> {
    let lights = variance.len() / parts.all().len().max(1);
    let even = filter(parts, columns, light, 3 * lights, work)?;
    let pairs = light.chunks_exact(3).zip(even.chunks_exact(3));
    let squares = pairs.zip(variance).flat_map(|((light, even), noise)| {
        let difference = |k: usize| (light[k] - even[k]).powi(2);
        [difference(0).max(difference(1)).max(difference(2)), *noise]
    });
    let squares: Vec<f32> = squares.collect();
    let squares = filter(parts, columns, &squares, 2 * lights, work)?;
    let pairs = light.chunks_exact_mut(3).zip(even.chunks_exact(3));
    for ((light, even), squares) in pairs.zip(squares.chunks_exact(2)) {
        let [all, noise] = [squares[0], squares[1]];
        let signal = if all > noise {
            1.0 - noise.max(0.0) / all
        } else {
            0.0
        };
        for (light, even) in light.iter_mut().zip(even) {
            *light = even + signal * (*light - even);
        }
    }
    Ok(())
}

/// Coefficients of the value at the centre of the plane fitted by weighted least squares: a
/// neighbour counts with its weight times `c[0] + c[1] u + c[2] v`. Gives the weighted mean where
/// the neighbours do not span a plane.
fn plane(near: &[(usize, f64, [f64; 2])]) -> Vector3<f64> {
    let mut moments = Matrix3::zeros();
    for (_, weight, [u, v]) in near {
        let basis = Vector3::new(1.0, *u, *v);
        moments += basis * basis.transpose() * *weight;
    }
    // With few neighbours on one side the slope is mostly noise, so it is damped slightly.
    let all = moments[(0, 0)].max(f64::MIN_POSITIVE);
    moments[(1, 1)] += 0.03 * all;
    moments[(2, 2)] += 0.03 * all;
    let unit = Vector3::new(1.0, 0.0, 0.0);
    match moments.cholesky() {
        Some(factors) => factors.solve(&unit),
        None => unit / all,
    }
}
