//! Evens out the noise of gathered light over pixels that show one smooth surface.
//!
//! Reflected light on a surface changes over the distance of what the surface sees (Ward, Rubinstein
//! and Clear 1988): within a small share of it a pixel takes the value of a plane fitted to its
//! neighbours, so that a gradient stays and only noise is evened out. Weights depend on geometry
//! alone.

use crate::gather::ray_scene::SurfacePoint;
use crate::surfaces::facet::Facet;
use crate::surfaces::surface::Surfaces;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::{Vec3, frame};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Pixels to each side that a pixel is fitted to.
const REACH: usize = 6;
/// Cosine between normals that count as one surface.
const ALIKE: f64 = 0.9;
/// The same between facets that are shaded by normals of corners.
const ROUND: f64 = 0.5;
/// Rays shorter than this count as so long, metres.
const LEAST: f64 = 1e-3;

/// Do two of a view's items, facets or what is none, belong to different surfaces?
pub fn differ(surfaces: &Surfaces, [a, b]: [u32; 2]) -> bool {
    match [a, b].map(|item| surfaces.facets.get(item as usize)) {
        [Some(a), Some(b)] => !is_one_surface(a, b),
        [a, b] => a.is_some() != b.is_some(),
    }
}

/// Are two facets of one material and about one direction?
fn is_one_surface(a: &Facet, b: &Facet) -> bool {
    let least = if a.is_smooth() && b.is_smooth() {
        ROUND
    } else {
        ALIKE
    };
    a.material == b.material && a.normal.dot(b.normal) >= least
}

/// A pixel that shows one material of about one direction.
#[derive(Clone, Copy, Debug)]
pub struct SmoothPixel {
    point: Vec3,
    normal: Vec3,
    material: usize,
    /// Radius of the filter there, metres.
    radius: f64,
}

impl SmoothPixel {
    /// Of a pixel that shows these places and whose rays are so long; `None` unless it is smooth.
    pub fn new(
        surfaces: &Surfaces,
        places: &[SurfacePoint],
        distances: impl Iterator<Item = f64>,
        share: f64,
    ) -> Option<SmoothPixel> {
        let facet = |place: &SurfacePoint| &surfaces.facets[place.facet as usize];
        let first = facet(places.first()?);
        let (mut point, mut normal) = (Vec3::ZERO, Vec3::ZERO);
        for place in places {
            let own = facet(place);
            if !is_one_surface(own, first) {
                return None;
            }
            point += place.point;
            normal += own.normal_at(place.point);
        }
        let point = point / places.len() as f64;
        let normal = normal.normalized();
        let (mut count, mut near) = (0.0, 0.0);
        for distance in distances {
            count += 1.0;
            near += 1.0 / distance.max(LEAST);
        }
        let mean = count / near;
        let is_flat = |p: &SurfacePoint| (p.point - point).dot(normal).abs() <= 0.05 * mean;
        let radius = (share * mean).min(1e6);
        places.iter().all(is_flat).then_some(SmoothPixel {
            point,
            normal,
            material: first.material,
            radius,
        })
    }

    /// How much another pixel counts, 0 to 1, and where it lies in this one's plane, in radii along
    /// the plane's axes.
    fn weight(&self, [u, v]: [Vec3; 2], other: &SmoothPixel) -> Option<(f64, [f64; 2])> {
        let alike = self.normal.dot(other.normal);
        if self.material != other.material || alike < ALIKE {
            return None;
        }
        let way = other.point - self.point;
        let radius = self.radius.min(other.radius);
        let square = way.dot(way) / (radius * radius);
        let height = way.dot(self.normal).abs().min(way.dot(other.normal).abs());
        if square >= 1.0 || height > 0.1 * radius {
            return None;
        }
        let weight = (1.0 - square) * (1.0 - 10.0 * (1.0 - alike)).max(0.0);
        (weight > 0.0).then_some((weight, [way.dot(u) / radius, way.dot(v) / radius]))
    }
}

/// Values of all pixels (`width` numbers each), those of smooth ones fitted to their neighbours.
///
/// # Errors
/// On cancel.
pub fn filter(
    smooth: &[Option<SmoothPixel>],
    [columns, rows]: [usize; 2],
    values: &[f32],
    width: usize,
    work: Work<'_>,
) -> Result<Vec<f32>, Cancelled> {
    let mut out = values.to_vec();
    let lines = out.par_chunks_mut(width * columns).enumerate();
    lines.try_for_each(|(y, line)| {
        work.check()?;
        let mut near: Vec<(usize, f64, [f64; 2])> = Vec::new();
        for (x, out) in line.chunks_exact_mut(width).enumerate() {
            let Some(own) = smooth[y * columns + x] else {
                continue;
            };
            near.clear();
            let axes = frame(own.normal);
            for y in y.saturating_sub(REACH)..(y + REACH + 1).min(rows) {
                for x in x.saturating_sub(REACH)..(x + REACH + 1).min(columns) {
                    let at = y * columns + x;
                    let found = smooth[at].and_then(|other| own.weight(axes, &other));
                    near.extend(found.map(|(weight, place)| (at, weight, place)));
                }
            }
            let fit = plane(&near);
            out.fill(0.0);
            for (at, weight, [u, v]) in &near {
                let share = weight * (fit[0] + fit[1] * u + fit[2] * v);
                let value = &values[at * width..(at + 1) * width];
                for (sum, value) in out.iter_mut().zip(value) {
                    *sum += share as f32 * value;
                }
            }
        }
        Ok(())
    })?;
    Ok(out)
}

/// Evens out light that may have shadows with edges (three channels of each light, and the variance of the
/// highest one) where it differs from that of its neighbours by no more than noise: a pixel takes the
/// filtered light and the share of the difference that is signal (Lee, *Digital image enhancement and
/// noise filtering by use of local statistics*, 1980).
///
/// # Errors
/// On cancel.
pub fn even_out(
    smooth: &[Option<SmoothPixel>],
    size: [usize; 2],
    light: &mut [f32],
    variance: &[f32],
    work: Work<'_>,
) -> Result<(), Cancelled> {
    let lights = variance.len() / smooth.len().max(1);
    let even = filter(smooth, size, light, 3 * lights, work)?;
    let pairs = light.chunks_exact(3).zip(even.chunks_exact(3));
    let squares = pairs.zip(variance).flat_map(|((light, even), noise)| {
        let difference = |k: usize| (light[k] - even[k]).powi(2);
        [difference(0).max(difference(1)).max(difference(2)), *noise]
    });
    let squares: Vec<f32> = squares.collect();
    let squares = filter(smooth, size, &squares, 2 * lights, work)?;
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

/// The coefficients that give the value at the middle of the plane fitted by weighted least
/// squares: a neighbour counts its weight times `c[0] + c[1] u + c[2] v`. The weighted mean where
/// the neighbours do not span a plane.
fn plane(near: &[(usize, f64, [f64; 2])]) -> Vector3<f64> {
    let mut moments = Matrix3::zeros();
    for (_, weight, [u, v]) in near {
        let basis = Vector3::new(1.0, *u, *v);
        moments += basis * basis.transpose() * *weight;
    }
    // Of few neighbours on one side the slope is mostly noise: it is held back a little.
    let all = moments[(0, 0)].max(f64::MIN_POSITIVE);
    moments[(1, 1)] += 0.01 * all;
    moments[(2, 2)] += 0.01 * all;
    let unit = Vector3::new(1.0, 0.0, 0.0);
    match moments.cholesky() {
        Some(factors) => factors.solve(&unit),
        None => unit / all,
    }
}
