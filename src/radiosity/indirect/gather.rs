//! What elements and gather points see of the elements: rows of form factors, kept or made again.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each facet, cell or element, made together"
)]

use super::interpolation::Interpolation;
use super::smoothing::Smoothing;
use crate::geometry::Vec3;

use crate::radiosity::camera::fragment::Fragments;
use crate::radiosity::direct::Setting;
use crate::radiosity::indirect::form::{BLOCK, Block, Rows};
use crate::radiosity::indirect::hemicube::{Hemicube, NearbyEmission, Table, scatter};
use crate::radiosity::mesh::{CellRequest, Layout, Mesh};
use crate::radiosity::step::Step;
use crate::radiosity::visibility::hemicube_raster::VertexBuffer;
use crate::renderer::TransportError;
use crate::renderer::contract::check_memory;
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// About what a gather point takes without its row, bytes: an element and its place in the grid.
const OF_A_GATHER_POINT: usize = 256;

/// Where reflected light is interpolated between.
pub struct GatherPoints {
    /// Elements of a finer grid that only gather.
    pub mesh: Mesh,
    table: Table,
    /// How near to others a gather point need not look itself ([`Interpolation::gather_points`]).
    reach: f64,
    /// Without them they are made again for each use.
    kept: Option<Kept>,
}

/// What the gather points see.
struct Kept {
    /// Form factors to elements, from those gather points that look.
    seen: Vec<(Vec<u32>, Rows)>,
    interpolation: Interpolation,
    smoothing: Smoothing,
}

/// What is looked at, from wherever.
#[derive(Clone, Copy)]
pub struct GatherScene<'a> {
    /// The scene.
    pub setting: Setting<'a>,
    /// Its corners.
    pub vertices: &'a VertexBuffer,
    /// The elements that send light.
    pub to: &'a Mesh,
}

impl GatherPoints {
    /// The finer gather points that the fragments need, and what they see of the elements. Rows
    /// that would take more than a quarter of the memory are not kept.
    ///
    /// # Errors
    /// [`TransportError::Memory`] when not even the gather points fit, and cancel.
    pub fn new(
        gather_scene: GatherScene<'_>,
        seeds: &[Vec3],
        fragments: &Fragments,
        step: Step,
        work: Work<'_>,
    ) -> Result<GatherPoints, TransportError> {
        let setting = gather_scene.setting;
        let mut pixels = vec![0.0; setting.surfaces.facets.len()];
        for f in &fragments.all {
            pixels[f.facet] += f64::from(f.weight);
        }
        let layout = Layout::of_gather_points(setting.surfaces, step.gather_points, &pixels);
        check_memory(
            "the nodes",
            layout.cells().saturating_mul(OF_A_GATHER_POINT),
            work.memory,
        )?;
        let mut requests = vec![CellRequest::default(); layout.cells()];
        for f in &fragments.all {
            for (cell, weight) in layout.grid(f.facet).iter().flat_map(|g| g.stencil(f.point)) {
                requests[cell].wanted |= weight > 0.0;
            }
        }
        show(&layout, fragments, &mut requests);
        let mesh = layout.mesh(setting, seeds, &requests);
        let table = Table::new(step.gather_resolution);
        let limited = Work {
            memory: work.memory / 4,
            ..work
        };
        let meter = Meter::new("final gather", mesh.elements.len());
        let mut seen = Vec::new();
        let interpolation = Interpolation::gather_points(&mesh, step.reach, |gather_points| {
            let (rows, nearby) =
                form_factors(gather_scene, &mesh, gather_points, &table, &meter, limited)?;
            seen.push((gather_points.to_vec(), rows));
            Ok(nearby)
        });
        let kept = match interpolation {
            Ok(interpolation) => Some(Kept {
                seen,
                smoothing: Smoothing::new(&mesh, &interpolation.nearby),
                interpolation,
            }),
            Err(TransportError::Memory { .. }) => None,
            Err(other) => return Err(other),
        };
        Ok(GatherPoints {
            mesh,
            table,
            reach: step.reach,
            kept,
        })
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let kept = self.kept.iter().flat_map(|kept| &kept.seen);
        let rows: usize = kept.map(|(_, rows)| rows.bytes()).sum();
        self.mesh.elements.len() * OF_A_GATHER_POINT + rows
    }

    /// Irradiance at each gather point from a block of radiosities of `width` columns. The same
    /// bits whether the rows were kept or not.
    ///
    /// # Errors
    /// Cancel.
    pub fn gather(
        &self,
        gather_scene: GatherScene<'_>,
        radiosity: &[f32],
        width: usize,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        let mut out = vec![0.0_f32; self.mesh.elements.len() * width];
        if let Some(kept) = &self.kept {
            for (gather_points, rows) in &kept.seen {
                place(
                    gather_points,
                    &rows.times(radiosity, width),
                    width,
                    &mut out,
                );
            }
            kept.interpolation.fill(&mut out, width);
            kept.smoothing.even(&mut out, width);
            return Ok(out);
        }
        let interpolation =
            Interpolation::gather_points(&self.mesh, self.reach, |gather_points| {
                let mut sums = vec![0.0_f32; gather_points.len() * width];
                let nearby = self.look(gather_scene, gather_points, radiosity, &mut sums, work)?;
                place(gather_points, &sums, width, &mut out);
                Ok(nearby)
            })?;
        interpolation.fill(&mut out, width);
        Smoothing::new(&self.mesh, &interpolation.nearby).even(&mut out, width);
        Ok(out)
    }

    /// Adds up what some gather points see of a block of radiosities, without keeping the rows.
    fn look(
        &self,
        gather_scene: GatherScene<'_>,
        gather_points: &[u32],
        radiosity: &[f32],
        sums: &mut [f32],
        work: Work<'_>,
    ) -> Result<Vec<NearbyEmission>, Cancelled> {
        let width = sums.len() / gather_points.len().max(1);
        let (done, all) = (AtomicUsize::new(0), gather_points.len());
        let mut nearby = vec![NearbyEmission::default(); gather_points.len()];
        gather_points
            .par_chunks(BLOCK)
            .zip(sums.par_chunks_mut(BLOCK * width.max(1)))
            .zip(nearby.par_chunks_mut(BLOCK))
            .try_for_each(|((gather_points, sums), nearby)| {
                work.check()?;
                let so_far = done.fetch_add(gather_points.len(), Ordering::Relaxed);
                work.progress.report("final gather", so_far, all);
                let mut cube = Hemicube::new(
                    gather_scene.setting,
                    gather_scene.vertices,
                    gather_scene.to,
                    &self.table,
                );
                for (i, &at) in gather_points.iter().enumerate() {
                    let gather_point = &self.mesh.elements[at as usize];
                    let turn = scatter(u64::from(at));
                    let sums = &mut sums[i * width..(i + 1) * width];
                    nearby[i] = cube.visit(
                        gather_point.facet,
                        gather_point.centre,
                        turn,
                        |element, share| {
                            let from = element as usize * width;
                            for (sum, x) in sums.iter_mut().zip(&radiosity[from..from + width]) {
                                *sum += share * x;
                            }
                        },
                    );
                }
                Ok::<(), Cancelled>(())
            })?;
        Ok(nearby)
    }
}

/// Puts rows of values, one for each of some gather points, where they belong among all.
fn place(gather_points: &[u32], values: &[f32], width: usize, all: &mut [f32]) {
    for (gather_point, row) in gather_points.iter().zip(values.chunks_exact(width.max(1))) {
        let at = *gather_point as usize * width;
        all[at..at + width].copy_from_slice(row);
    }
}

/// A block of rows, and [`Hemicube::visit`]'s answer for each.
type Seen = (Block, Vec<NearbyEmission>);

/// Notes for each cell a point of it that the picture shows.
pub fn show(layout: &Layout, fragments: &Fragments, requests: &mut [CellRequest]) {
    for f in &fragments.all {
        if let Some(grid) = layout.grid(f.facet) {
            requests[grid.cell(f.point)].shown.get_or_insert(f.point);
        }
    }
}

/// How far a task is, over several calls of [`form_factors`].
pub struct Meter {
    task: &'static str,
    total: usize,
    done: AtomicUsize,
    /// Of all rows so far.
    bytes: AtomicUsize,
}

impl Meter {
    /// Of a task of so many rows at most.
    pub fn new(task: &'static str, total: usize) -> Meter {
        Meter {
            task,
            total,
            done: AtomicUsize::new(0),
            bytes: AtomicUsize::new(0),
        }
    }
}

/// Form factors from some elements of `from` to all elements in sight, and what each sees all
/// in all.
///
/// # Errors
/// [`TransportError::Memory`] when they do not fit, and cancel.
pub fn form_factors(
    gather_scene: GatherScene<'_>,
    from: &Mesh,
    which: &[u32],
    table: &Table,
    meter: &Meter,
    work: Work<'_>,
) -> Result<(Rows, Vec<NearbyEmission>), TransportError> {
    let count = Ordering::Relaxed;
    // The work of one task: enough blocks that making a hemicube does not count.
    let tasks: Result<Vec<Vec<Seen>>, TransportError> = which
        .par_chunks(4 * BLOCK)
        .map(|which| {
            let mut cube = Hemicube::new(
                gather_scene.setting,
                gather_scene.vertices,
                gather_scene.to,
                table,
            );
            let mut blocks = Vec::new();
            for which in which.chunks(BLOCK) {
                work.check()?;
                let mut block = Block::default();
                let mut nearby = Vec::with_capacity(which.len());
                for &at in which {
                    let e = &from.elements[at as usize];
                    let turn = scatter(u64::from(at));
                    let near = cube.visit(e.facet, e.centre, turn, |c, share| block.push(c, share));
                    nearby.push(near);
                    block.end_row();
                }
                block.trim();
                let own = block.bytes();
                let all = meter.bytes.fetch_add(own, count) + own;
                check_memory("form factors", all, work.memory)?;
                blocks.push((block, nearby));
                let so_far = meter.done.fetch_add(which.len(), count) + which.len();
                work.progress.report(meter.task, so_far, meter.total);
            }
            Ok(blocks)
        })
        .collect();
    let (blocks, nearby): (Vec<Block>, Vec<Vec<NearbyEmission>>) =
        tasks?.into_iter().flatten().unzip();
    Ok((Rows::of(blocks), nearby.concat()))
}
