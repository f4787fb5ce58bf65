//! The first bounce of lamps that have patches ([`LampPatches`]), at cells and along rays.

use crate::gather::cells::Cells;
use crate::gather::emitter::Receiver;
use crate::gather::lamp_patches::LampPatches;
use crate::gather::ray_scene::{RayScene, SurfacePoint};
use crate::gather::sampling::{hash, point};
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;

/// Patches of each lamp that a point of a cell takes light from.
const CELL_PATCHES: u32 = 2;
/// Cells that one task works on.
const RUN: usize = 256;
/// Seed of the sequence of points.
const SEED: u32 = 0x55;

/// The first bounce of several lights.
#[derive(Clone, Copy)]
pub struct FirstBounce<'a> {
    pub scene: RayScene<'a>,
    pub cells: &'a Cells,
    /// For each light its patches, if it has any.
    pub lamps: &'a [Option<LampPatches>],
    /// Irradiance that comes to each cell from each of the lights directly.
    pub direct: &'a [f32],
}

impl FirstBounce<'_> {
    /// Adds what a cell reflects of the lights with patches, for each ray that counts it; `passed` are
    /// the numbers of bounds that the rays pass. Three channels a light.
    pub fn add_rays(
        &self,
        cell: usize,
        passed: impl Iterator<Item = u32> + Clone,
        sums: &mut [f32],
    ) {
        let lights = self.lamps.len();
        let direct = &self.direct[cell * lights..][..lights];
        for ((sum, direct), lamp) in sums.chunks_exact_mut(3).zip(direct).zip(self.lamps) {
            let Some(lamp) = lamp.as_ref().filter(|_| *direct > 0.0) else {
                continue;
            };
            let Some(place) = self.cells.points(cell).first() else {
                continue;
            };
            let place = place.place(self.scene).point;
            let rays = passed.clone().filter(|p| lamp.counts(place, *p)).count() as f32;
            for (sum, r) in sum.iter_mut().zip(self.cells.reflectances[cell]) {
                *sum += rays * (r * direct);
            }
        }
    }

    /// Irradiance with which light between cells starts, three channels for each cell and light: direct
    /// light, or of a light with patches its first bounce.
    ///
    /// # Errors
    /// On cancel.
    pub fn at_cells(&self, work: Work<'_>) -> Result<Vec<f32>, Cancelled> {
        let mut out: Vec<f32> = self.direct.iter().flat_map(|direct| [*direct; 3]).collect();
        if self.lamps.iter().all(Option::is_none) {
            return Ok(out);
        }
        let width = 3 * self.lamps.len();
        let runs = out.par_chunks_mut(RUN * width).enumerate();
        runs.try_for_each(|(at, run)| {
            work.check()?;
            let mut sums = vec![0.0_f32; width];
            for (i, out) in run.chunks_exact_mut(width).enumerate() {
                sums.fill(0.0);
                self.add_cell(at * RUN + i, &mut sums);
                let lights = out.chunks_exact_mut(3).zip(sums.chunks_exact(3));
                for ((out, sum), _) in lights.zip(self.lamps).filter(|(_, l)| l.is_some()) {
                    out.copy_from_slice(sum);
                }
            }
            Ok(())
        })?;
        Ok(out)
    }

    /// Adds the mean of the first bounce over the points of a cell.
    fn add_cell(&self, cell: usize, sums: &mut [f32]) {
        let mut rays = 0_u32;
        for met in self.cells.met(cell) {
            rays += 1;
            if let Some(met) = met.filter(|met| met.passed > 0) {
                let other = met.cell + self.cells.seen();
                self.add_rays(other, std::iter::once(met.passed), sums);
            }
        }
        let share = 1.0 / rays.max(1) as f32;
        sums.iter_mut().for_each(|sum| *sum *= share);

        let points = self.cells.points(cell);
        let share = 1.0 / (points.len() as u32 * CELL_PATCHES).max(1) as f32;
        let seed = hash(cell as u32) ^ SEED;
        for k in 0..points.len() as u32 * CELL_PATCHES {
            let SurfacePoint { facet, point: at } =
                points[(k / CELL_PATCHES) as usize].place(self.scene);
            let normal = self.scene.surfaces.facets[facet as usize].normal;
            let at = Receiver {
                point: at,
                normal,
                facet: normal,
            };
            let [random, _] = point(k, seed);
            for (lamp, sum) in self.lamps.iter().zip(sums.chunks_exact_mut(3)) {
                let Some(lamp) = lamp else {
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
