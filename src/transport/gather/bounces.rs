//! Exchange of light between cells.

use crate::gather::cells::Cells;
use footlight_host::work::{Cancelled, Work};
use rayon::prelude::*;
use std::array;

/// Greatest share of initially uniform light left in any cell after the last computed bounce. Later
/// bounces are added as a geometric series, since light falls off evenly by then. A small white
/// niche in a black hall needs many bounces.
const LEFT: f32 = 0.05;
/// Most bounces, and the greatest share of light that a bounce may preserve.
const MOST_BOUNCES: usize = 400;
const MOST_KEPT: f64 = 0.9999;
/// Cells in one task.
const RUN: usize = 256;

/// Bounces between cells.
#[derive(Clone, Copy, Debug)]
pub struct Bounces {
    /// Number of computed bounces.
    count: usize,
    /// Sum of all later bounces as a multiple of the last one, for each channel.
    rest: [f32; 3],
}

impl Cells {
    /// Number of cells in which camera rays end; they are the first ones.
    pub fn seen(&self) -> usize {
        self.count() - self.later()
    }

    /// Follows initially uniform light until little is left.
    ///
    /// # Errors
    /// On cancel.
    pub fn bounces(&self, work: Work<'_>) -> Result<Bounces, Cancelled> {
        let dark = vec![0.0_f32; 3 * self.later()];
        let mut now = vec![1.0_f32; dark.len()];
        let mut next = now.clone();
        let sum = |level: &[f32]| -> [f64; 3] {
            let of = |k: usize| level.iter().skip(k).step_by(3).map(|l| f64::from(*l));
            array::from_fn(|k| of(k).sum())
        };
        let mut out = Bounces {
            count: 0,
            rest: [0.0; 3],
        };
        let mut left = sum(&now);
        while out.count < MOST_BOUNCES && now.iter().any(|level| *level > LEFT) {
            self.reflect(self.seen(), &now, &dark, 1, &mut next, work)?;
            std::mem::swap(&mut now, &mut next);
            let before = std::mem::replace(&mut left, sum(&now));
            out.count += 1;
            out.rest = array::from_fn(|k| {
                // The remainder may be zero.
                let kept = (left[k] / before[k].max(f64::MIN_POSITIVE)).min(MOST_KEPT);
                (kept / (1.0 - kept)) as f32
            });
        }
        Ok(out)
    }

    /// Radiosity, under several lights, of each cell in which camera rays end. `direct` is the
    /// initial irradiance of every cell, three channels for each cell and light. The other cells
    /// exchange light by Jacobi steps. Returns three channels for each cell and light.
    ///
    /// # Errors
    /// On cancel.
    pub fn radiosity(
        &self,
        direct: &[f32],
        lights: usize,
        bounces: &Bounces,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let (seen, later) = direct.split_at(3 * self.seen() * lights);
        let mut now = vec![0.0_f32; later.len()];
        let mut next = now.clone();
        for _ in 0..bounces.count {
            self.reflect(self.seen(), &now, later, lights, &mut next, work)?;
            std::mem::swap(&mut now, &mut next);
        }
        let channels = now.iter_mut().zip(&next).zip(bounces.rest.iter().cycle());
        channels.for_each(|((now, before), rest)| *now += rest * (*now - before));
        drop(next);
        let mut out = vec![0.0_f32; seen.len()];
        self.reflect(0, &now, seen, lights, &mut out, work)?;
        Ok(out)
    }

    /// Light that the cells from `start` on reflect: of direct light, and of the radiosity `now` of
    /// the cells that their rays hit.
    fn reflect(
        &self,
        start: usize,
        now: &[f32],
        direct: &[f32],
        lights: usize,
        out: &mut [f32],
        work: Work<'_>,
    ) -> Result<(), Cancelled> {
        let width = 3 * lights;
        let direct = direct.par_chunks(RUN * width);
        let runs = out.par_chunks_mut(RUN * width).zip(direct).enumerate();
        runs.try_for_each(|(at, (run, direct))| {
            work.check()?;
            let cells = run.chunks_exact_mut(width).zip(direct.chunks_exact(width));
            for (i, (out, arrives)) in cells.enumerate() {
                let cell = start + at * RUN + i;
                out.fill(0.0);
                let mut rays = 0_u32;
                for other in self.met(cell) {
                    rays += 1;
                    let Some(other) = other else {
                        continue;
                    };
                    for (sum, b) in out.iter_mut().zip(&now[other.cell * width..][..width]) {
                        *sum += b;
                    }
                }
                let share = 1.0 / rays.max(1) as f32;
                let reflectances = self.reflectances[cell].iter().cycle();
                for ((b, direct), r) in out.iter_mut().zip(arrives).zip(reflectances) {
                    *b = r * (direct + share * *b);
                }
            }
            Ok(())
        })
    }
}
