//! Airlight of panels: integrals along rays on a coarse grid over the image.
//!
//! The light of a panel in the air changes slowly from one ray of sight to the next; what changes
//! at once is where the ray ends. Each ray of the grid therefore keeps its integral up to every
//! distance, and a pixel interpolates between the four rays around it, each up to the pixel's own
//! distance.

use super::tile::bilinear;
use super::{Airlight, LEAST_SHARE, Pixel, Sight, in_front, phase};
use crate::gather::emitter::{AreaLight, Emitter};
use crate::gather::ray_scene::SurfacePoint;
use crate::gather::sampling::point;
use crate::surfaces::camera::Camera;
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Distances at which a ray keeps its integral.
const KNOTS: usize = 32;
/// Samples of a ray for each node of the step.
const SAMPLES: usize = 16;
/// Cells across the image for the square root of the step's number of nodes.
const ACROSS: f64 = 20.0;
/// Steps of an additive sequence in the square (Roberts, *The Unreasonable Effectiveness of
/// Quasirandom Sequences*, 2018).
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
/// Seed of the samples.
const SEED: u32 = 0xa2;

/// Rays through the corners of square cells of the image.
#[derive(Clone, Copy)]
struct Grid {
    /// Side of a cell, pixels.
    pitch: f64,
    /// Rays from left to right.
    columns: usize,
}

/// Integrals of a panel's airlight along the rays of a grid.
pub(super) struct Field {
    grid: Grid,
    /// Distance, metres, and radiance up to it: [`KNOTS`] pairs for each ray.
    knots: Vec<[f32; 2]>,
}

impl Airlight<'_> {
    /// Integrals of each light that is a panel, given the parts of pixels with their ends of sight.
    ///
    /// # Errors
    /// On cancel.
    pub(super) fn fields<I: Iterator<Item = (f32, SurfacePoint)>>(
        &self,
        emitters: &[Emitter<'_>],
        (camera, size): (&Camera, [usize; 2]),
        ends: impl Fn(usize) -> I + Sync,
        work: Work<'_>,
    ) -> Result<Vec<Option<Field>>, Cancelled> {
        let is_panel = |emitter: &Emitter<'_>| matches!(emitter, Emitter::Area(_));
        let has_panels = emitters.iter().any(is_panel);
        let grid = has_panels.then(|| self.grid((camera, size), ends, work));
        let grid = grid.transpose()?;
        let field = |emitter: &Emitter<'_>| match (emitter, &grid) {
            (Emitter::Area(panel), Some((grid, longest))) => {
                let knots = self.knots(panel, camera, (*grid, longest), work)?;
                Ok(Some(Field { grid: *grid, knots }))
            }
            _ => Ok(None),
        };
        emitters.iter().map(field).collect()
    }

    /// A panel's airlight in a pixel.
    pub(super) fn in_pixel(&self, emitter: &Emitter<'_>, field: &Field, pixel: &Pixel) -> f32 {
        let direct = pixel.direct.iter();
        let direct = direct.map(|(share, sight)| share * field.light(pixel.place, sight.length));
        direct.sum::<f32>() + self.sum(emitter, &pixel.mirrored)
    }

    /// The grid for an image, and the greatest distance that the pixels around each ray see, metres.
    fn grid<I: Iterator<Item = (f32, SurfacePoint)>>(
        &self,
        (camera, [width, height]): (&Camera, [usize; 2]),
        ends: impl Fn(usize) -> I + Sync,
        work: Work<'_>,
    ) -> Result<(Grid, Vec<f64>), Cancelled> {
        let deepest = self.deepest();
        let length = |pixel: usize| {
            work.check()?;
            let (mut rest, mut longest) = (1.0, 0.0_f64);
            for (share, end) in ends(pixel) {
                rest -= share;
                longest = longest.max((end.point - camera.origin).length());
            }
            // Backs and the void are not parts.
            Ok(if rest > LEAST_SHARE {
                deepest
            } else {
                longest.min(deepest)
            })
        };
        let pixels = (0..width * height).into_par_iter();
        let lengths: Vec<f64> = pixels.map(length).collect::<Result<_, Cancelled>>()?;
        let across = (ACROSS * (self.nodes as f64).sqrt()).ceil();
        let pitch = width as f64 / across;
        let columns = across as usize + 1;
        let rows = (height as f64 / pitch).ceil() as usize + 1;
        let grid = Grid { pitch, columns };
        let mut longest = vec![0.0; rows * columns];
        for (pixel, length) in lengths.into_iter().enumerate() {
            let (rays, _) = grid.around([pixel % width, pixel / width]);
            for ray in rays {
                longest[ray] = length.max(longest[ray]);
            }
        }
        Ok((grid, longest))
    }

    fn knots(
        &self,
        panel: &AreaLight,
        camera: &Camera,
        (grid, longest): (Grid, &[f64]),
        work: Work<'_>,
    ) -> Result<Vec<[f32; 2]>, Cancelled> {
        let mut knots = vec![[0.0; 2]; KNOTS * longest.len()];
        let rays = knots.par_chunks_mut(KNOTS).zip(longest).enumerate();
        rays.try_for_each(|(ray, (knots, length))| {
            work.check()?;
            let place = [ray % grid.columns, ray / grid.columns];
            let [x, y] = place.map(|k| k as f64 * grid.pitch);
            let sight = Sight::from_eye(camera, camera.ray(x, y), *length);
            self.sum_along(panel, &sight, point(ray as u32, SEED), knots);
            Ok(())
        })?;
        Ok(knots)
    }

    /// The integral along a ray up to each of its knots.
    fn sum_along(&self, panel: &AreaLight, sight: &Sight, shift: [f64; 2], knots: &mut [[f32; 2]]) {
        let count = SAMPLES * self.nodes;
        let sample = |k: usize| {
            let random = [0, 1].map(|axis| (shift[axis] + k as f64 * PLASTIC[axis]).fract());
            let (position, normal, area) = self.lifted(panel, random)?;
            let to = position - sight.eye;
            let [start, end] = in_front(normal, (to, sight.way), sight.length)?;
            let middle = sight.way.dot(to);
            // A sample stands for a disc, whose light is bounded.
            let disc = area / (PI * count as f64);
            let off = to - sight.way * middle;
            let h = (off.dot(off) + disc).sqrt();
            let [first, last] = [start, end].map(|t| ((t - middle) / h).atan());
            let share = (k as f64 + 0.5) / count as f64;
            let t = middle + h * (first + share * (last - first)).tan();
            let x = sight.eye + sight.way * t;
            let d = x - position;
            let distance = d.length().max(f64::MIN_POSITIVE);
            let light = area * normal.dot(d).max(0.0) / distance * (last - first) / h;
            let scattered = light * phase(self.haze.forward, -d.dot(sight.way) / distance);
            let seen = self.scene.transmittance(x, position - x) * self.scene.clearness(t);
            Some((t, scattered * seen))
        };
        let mut samples: Vec<(f64, f64)> = (0..count).filter_map(sample).collect();
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let scale = self.haze.albedo * self.haze.extinction / count as f64;
        let (mut sum, mut summed) = (0.0, 0);
        let last = knots.len() - 1;
        for (k, knot) in knots.iter_mut().enumerate() {
            let until = k * samples.len() / last;
            sum += samples[summed..until]
                .iter()
                .map(|(_, light)| light)
                .sum::<f64>();
            summed = until;
            // Between the sample and the next; none lies before the first.
            let here = match (samples.get(until.wrapping_sub(1)), samples.get(until)) {
                (Some(from), Some(to)) => 0.5 * (from.0 + to.0),
                (None, Some(to)) => to.0,
                (_, None) => sight.length,
            };
            *knot = [here as f32, (scale * sum) as f32];
        }
    }
}

impl Field {
    /// The panel's airlight in a pixel, up to a distance in metres.
    pub(super) fn light(&self, pixel: [usize; 2], length: f64) -> f32 {
        let (rays, fractions) = self.grid.around(pixel);
        let up_to = |ray: usize| {
            let knots = &self.knots[ray * KNOTS..][..KNOTS];
            let k = knots.partition_point(|[t, _]| f64::from(*t) < length);
            let Some([from, before]) = k.checked_sub(1).map(|k| knots[k]) else {
                return 0.0;
            };
            let Some([to, after]) = knots.get(k) else {
                return before;
            };
            let share = (length as f32 - from) / (to - from).max(f32::MIN_POSITIVE);
            before + share * (after - before)
        };
        bilinear(rays.map(up_to), fractions)
    }
}

impl Grid {
    /// The rays around the centre of a pixel, and its place between them.
    fn around(&self, pixel: [usize; 2]) -> ([usize; 4], [f32; 2]) {
        let at = pixel.map(|k| (k as f64 + 0.5) / self.pitch);
        let [column, row] = at.map(|k| k as usize);
        let first = row * self.columns + column;
        let below = first + self.columns;
        (
            [first, first + 1, below, below + 1],
            at.map(|k| k.fract() as f32),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{haze, with_air};
    use super::*;
    use footlight_show::geometry::{Vec3, vec3};

    /// A square of 1 m at the origin that faces x.
    fn panel() -> Vec<Vec3> {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        corners.map(|[y, z]| vec3(0.0, y, z)).to_vec()
    }

    /// The double integral over the panel and a ray, by the midpoint rule.
    fn integral(air: &Airlight<'_>, sight: &Sight) -> f64 {
        const SIDE: usize = 16;
        const PARTS: usize = 2000;
        let at = |k: usize| (k as f64 + 0.5) / SIDE as f64 - 0.5;
        let part = sight.length / PARTS as f64;
        let mut sum = 0.0;
        for t in (0..PARTS).map(|k| (k as f64 + 0.5) * part) {
            let x = sight.eye + sight.way * t;
            for (j, k) in (0..SIDE).flat_map(|j| (0..SIDE).map(move |k| (j, k))) {
                let d = x - vec3(0.0, at(j), at(k));
                let r = d.length();
                let light = (d.x / r).max(0.0) / (r * r);
                let scattered = phase(air.haze.forward, -d.dot(sight.way) / r);
                sum += light * scattered * (-air.haze.extinction * (t + r)).exp();
            }
        }
        air.haze.albedo * air.haze.extinction * sum * part / (SIDE * SIDE) as f64
    }

    /// Rays in front of the panel, towards it, away from it, across its plane, and along it.
    fn rays() -> impl Iterator<Item = Sight> {
        let eyes = [
            [4.0, 3.0, 1.0],
            [1.0, -5.0, 0.3],
            [-3.0, 4.0, -1.0],
            [0.4, -6.0, 0.0],
        ];
        let ends = [
            [3.0, -4.0, 0.5],
            [0.2, 1.0, 2.0],
            [5.0, -1.0, 1.0],
            [0.4, 6.0, 0.0],
        ];
        let vec = |[x, y, z]: [f64; 3]| vec3(x, y, z);
        eyes.into_iter().flat_map(move |eye| {
            ends.into_iter().map(move |end| Sight {
                eye: vec(eye),
                way: (vec(end) - vec(eye)).normalized(),
                length: (vec(end) - vec(eye)).length(),
                spread: 1e-6,
            })
        })
    }

    #[test]
    fn a_panel_lights_all_the_air_before_it() {
        with_air(haze(0.05, 0.3), &[panel()], |air| {
            let emitter = Emitter::Area(AreaLight::new(air.scene.surfaces, &[0]));
            for sight in rays() {
                let exact = integral(&air, &sight);
                let found = air.radiance(&emitter, &sight, 0.5);
                assert!(
                    (found / exact - 1.0).abs() < 0.2,
                    "{sight:?}: {found} for {exact}"
                );
                let sample = |k| air.sample(&emitter, &sight, [point(k, 3), point(k, 4)]);
                let mean = (0..4096).map(sample).sum::<f64>() / 4096.0;
                assert!(
                    (mean / exact - 1.0).abs() < 0.05,
                    "{sight:?}: mean {mean} for {exact}"
                );
            }
        });
    }

    /// A ray through the panel itself meets the samples' discs.
    fn is_through(sight: &Sight) -> bool {
        let at = sight.eye - sight.way * (sight.eye.x / sight.way.x);
        at.y.abs().max(at.z.abs()) < 0.5
    }

    #[test]
    fn a_ray_keeps_its_integral_up_to_every_distance() {
        for (nodes, past, through) in [(8, 0.05, 0.15), (32, 0.02, 0.05)] {
            with_air(haze(0.05, 0.3), &[panel()], |air| {
                let air = Airlight { nodes, ..air };
                let light = AreaLight::new(air.scene.surfaces, &[0]);
                for sight in rays() {
                    let mut knots = vec![[0.0; 2]; 4 * KNOTS];
                    for (k, knots) in knots.chunks_mut(KNOTS).enumerate() {
                        air.sum_along(&light, &sight, point(k as u32, 5), knots);
                    }
                    let grid = Grid {
                        pitch: 1.0,
                        columns: 2,
                    };
                    let field = Field { grid, knots };
                    let whole = integral(&air, &sight);
                    let allowed = if is_through(&sight) { through } else { past };
                    for share in [0.25, 0.5, 0.75, 1.0] {
                        let length = share * sight.length;
                        let exact = integral(&air, &Sight { length, ..sight });
                        let found = f64::from(field.light([0, 0], length));
                        let apart = (found - exact).abs() / whole;
                        assert!(apart < allowed, "{nodes}, {share} of {sight:?}: {apart}");
                    }
                }
            });
        }
    }
}
