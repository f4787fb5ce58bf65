//! Bounces of lamps that have patches ([`LampPatches`]), at cells and along rays.

use crate::gather::cells::Cells;
use crate::gather::lamp_patches::LampPatches;
use crate::gather::ray_scene::{RayScene, Receiver, SurfacePoint};
use crate::gather::sampling::{hash, point};
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;

/// Patches of each lamp sampled by a point of a cell: a visible cell, another cell.
const CELL_PATCHES: [u32; 2] = [2, 1];
/// Cells in one task.
const RUN: usize = 256;
/// Seed of the point sequence.
const SEED: u32 = 0x55;

/// Light of several lights after each bounce that patches carry.
pub struct FirstBounces<'a> {
    scene: RayScene<'a>,
    cells: &'a Cells,
    /// For each light the patches of its bounces, if it needs any.
    lamps: &'a [Vec<LampPatches>],
    /// Irradiance at each cell from each light, three channels: direct, and then after each bounce.
    /// A light with fewer bounces keeps the values of its last one.
    arrives: Vec<Vec<f32>>,
}

impl<'a> FirstBounces<'a> {
    /// Computes the bounces from the direct irradiance of each cell by each light.
    ///
    /// # Errors
    /// On cancel.
    pub fn new(
        scene: RayScene<'a>,
        cells: &'a Cells,
        lamps: &'a [Vec<LampPatches>],
        direct: Vec<f32>,
        work: Work<'_>,
    ) -> Result<FirstBounces<'a>, Cancelled> {
        let start = direct.iter().flat_map(|direct| [*direct; 3]).collect();
        drop(direct);
        let mut bounces = FirstBounces {
            scene,
            cells,
            lamps,
            arrives: vec![start],
        };
        let most = lamps.iter().map(Vec::len).max().unwrap_or(0);
        for bounce in 0..most {
            let next = bounces.at_cells(bounce, work)?;
            bounces.arrives.push(next);
        }
        Ok(bounces)
    }

    /// Initial irradiance of the exchange between cells, three channels for each cell and light.
    pub fn last(&self) -> &[f32] {
        self.arrives.last().map_or(&[], Vec::as_slice)
    }

    /// Adds the light of patch-carried bounces that a cell reflects, for each ray that counts it.
    /// `passed` holds the numbers of bounds that the rays pass. Three channels for each light.
    pub fn add_rays(
        &self,
        cell: usize,
        passed: impl Iterator<Item = u32> + Clone,
        sums: &mut [f32],
    ) {
        let bounces = self.arrives.len() - 1;
        (0..bounces).for_each(|bounce| self.add_bounce(bounce, cell, passed.clone(), sums));
    }

    fn add_bounce(
        &self,
        bounce: usize,
        cell: usize,
        passed: impl Iterator<Item = u32> + Clone,
        sums: &mut [f32],
    ) {
        let width = 3 * self.lamps.len();
        let arrives = self.arrives[bounce][cell * width..][..width].chunks_exact(3);
        for ((sum, arrives), lamp) in sums.chunks_exact_mut(3).zip(arrives).zip(self.lamps) {
            let is_lit = arrives.iter().any(|a| *a > 0.0);
            let Some(lamp) = lamp.get(bounce).filter(|_| is_lit) else {
                continue;
            };
            let Some(place) = self.cells.points(cell).first() else {
                continue;
            };
            let place = place.place(self.scene).point;
            let rays = passed.clone().filter(|p| lamp.counts(place, *p)).count() as f32;
            let reflected = self.cells.reflectances[cell].iter().zip(arrives);
            for (sum, (r, arrives)) in sum.iter_mut().zip(reflected) {
                *sum += rays * (r * arrives);
            }
        }
    }

    /// Irradiance at all cells after a bounce.
    fn at_cells(&self, bounce: usize, work: Work<'_>) -> Result<Vec<f32>, Cancelled> {
        let mut out = self.last().to_vec();
        let width = 3 * self.lamps.len();
        let runs = out.par_chunks_mut(RUN * width).enumerate();
        runs.try_for_each(|(at, run)| {
            work.check()?;
            let mut sums = vec![0.0_f32; width];
            for (i, out) in run.chunks_exact_mut(width).enumerate() {
                sums.fill(0.0);
                self.add_cell(bounce, at * RUN + i, &mut sums);
                let lights = out.chunks_exact_mut(3).zip(sums.chunks_exact(3));
                for ((out, sum), _) in lights.zip(self.lamps).filter(|(_, l)| l.len() > bounce) {
                    out.copy_from_slice(sum);
                }
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// Adds the mean of a bounce over the points of a cell.
    fn add_cell(&self, bounce: usize, cell: usize, sums: &mut [f32]) {
        let mut rays = 0_u32;
        for met in self.cells.met(cell) {
            rays += 1;
            if let Some(met) = met.filter(|met| met.passed > 0) {
                let other = met.cell + self.cells.seen();
                self.add_bounce(bounce, other, std::iter::once(met.passed), sums);
            }
        }
        let share = 1.0 / rays.max(1) as f32;
        sums.iter_mut().for_each(|sum| *sum *= share);

        let points = self.cells.points(cell);
        let patches = CELL_PATCHES[usize::from(cell >= self.cells.seen())];
        let share = 1.0 / (points.len() as u32 * patches).max(1) as f32;
        let seed = hash(cell as u32) ^ SEED;
        for k in 0..points.len() as u32 * patches {
            let SurfacePoint { facet, point: at } =
                points[(k / patches) as usize].place(self.scene);
            let normal = self.scene.surfaces.facets[facet as usize].normal;
            let at = Receiver {
                point: at,
                normal,
                facet: normal,
            };
            let [random, _] = point(k, seed);
            for (lamp, sum) in self.lamps.iter().zip(sums.chunks_exact_mut(3)) {
                let Some(lamp) = lamp.get(bounce) else {
                    continue;
                };
                let irradiance = lamp.irradiance(self.scene, at, random) as f32;
                for (sum, colour) in sum.iter_mut().zip(lamp.colour(random)) {
                    *sum += share * irradiance * colour;
                }
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use crate::gather::GatherStage;
    use crate::unit_lights::{BandedScene, UnitLights};
    use crate::{Quality, Setup};
    use footlight_host::work::Work;
    use footlight_picture::Image;
    use footlight_show::geometry::profile::Profile;
    use footlight_show::geometry::{Vec3, View, vec3};
    use footlight_show::model::Spot;
    use footlight_show::units::Rgb;
    use footlight_stage::{Light, Material, Polygon, Rig, Scene};
    use std::f64::consts::PI;
    use std::sync::Arc;

    /// A white ceiling at 5 m and a dark wall that the camera faces; a spot of 2 degrees points at
    /// the ceiling, a wider one at a dark floor.
    pub fn setup() -> Setup {
        let quad = |material, corners: [[f64; 3]; 4]| {
            let corners = corners.map(|[x, y, z]| vec3(x, y, z));
            Polygon::new(corners.to_vec(), material)
        };
        let scene = Scene {
            materials: vec![
                Material::diffuse("white", Rgb([0.8, 0.4, 0.2])),
                Material::diffuse("dark", Rgb([0.01; 3])),
            ],
            polygons: vec![
                quad(0, [[0., 0., 5.], [0., 5., 5.], [5., 5., 5.], [5., 0., 5.]]),
                quad(1, [[0., 5., 0.], [5., 5., 0.], [5., 5., 5.], [0., 5., 5.]]),
                quad(1, [[0., 0., 0.], [5., 0., 0.], [5., 5., 0.], [0., 5., 0.]]),
            ],
            ..Scene::default()
        };
        let spot = |z: f64, beam: f64| {
            Light::Spot(Spot {
                position: vec3(2.5, 2.5, z),
                aim: vec3(2.5, 2.5, if z < 2.0 { 5.0 } else { 0.0 }),
                beam,
                field: 2.0 * beam,
                intensity: Rgb::WHITE,
            })
        };
        let rig = Rig {
            lights: vec![spot(0.5, 2.0), spot(4.0, 70.0)],
            sources: Vec::new(),
        };
        let view = View {
            from: vec3(2.5, 0.3, 2.5),
            to: vec3(2.5, 5.0, 2.5),
            fov: 40.0,
            width: 24,
            height: 18,
            roll: 0.0,
        };
        Setup::new(scene, rig, view)
    }

    fn image(lights: &[usize], threads: usize) -> Image {
        let work = Work {
            threads,
            ..Work::silent()
        };
        let stage = GatherStage::new(&setup(), Quality(2), work).unwrap();
        let mut operator = Arc::new(stage).whole(work).unwrap();
        operator.solve(lights, work).unwrap();
        let strength = |light| [f64::from(u8::from(lights[0] == light)); 3];
        operator.picture(&[strength(0), strength(1)])
    }

    /// Radiance of a pixel of the wall by the narrow beam, whose light on the ceiling acts as a
    /// point source.
    pub fn wall(x: usize, y: usize) -> [f64; 3] {
        let flux = Profile::new(2.0, 4.0).unwrap().flux();
        let half = 20_f64.to_radians().tan() * 4.7;
        let [u, v] = [(x, 12.0), (y, 9.0)].map(|(i, n)| (i as f64 + 0.5) / 9.0 - n / 9.0);
        let wall: Vec3 = vec3(2.5 + u * half, 5.0, 2.5 - v * half);
        let to = vec3(2.5, 2.5, 5.0) - wall;
        let kernel = -to.y * to.z / to.dot(to).powi(2);
        [0.8, 0.4, 0.2].map(|reflectance| 0.01 / PI * reflectance * flux / PI * kernel)
    }

    #[test]
    fn a_narrow_beam_on_a_ceiling_lights_a_wall_as_a_point_does() {
        let image = image(&[0], 1);
        let (mut worst, mut ratio) = (0.0_f64, 0.0);
        for y in 0..18 {
            for x in 0..24 {
                let at = 3 * (24 * y + x);
                for (k, exact) in wall(x, y).into_iter().enumerate() {
                    let found = f64::from(image.data()[at + k]) / exact;
                    worst = worst.max((found - 1.0).abs());
                    ratio += found / (24.0 * 18.0 * 3.0);
                }
            }
        }
        assert!(
            worst < 0.04 && (ratio - 1.0).abs() < 0.01,
            "{worst} {ratio}"
        );
    }

    #[test]
    fn light_of_patches_is_the_same_in_any_company_and_number_of_threads() {
        let alone = image(&[0], 1);
        assert_eq!(alone.data(), image(&[0, 1], 1).data());
        assert_eq!(alone.data(), image(&[0], 2).data());
    }
}
