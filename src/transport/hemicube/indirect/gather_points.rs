//! Hemicube passes over elements and gather points: rows of form factors, or their products with
//! the radiosities where the rows do not fit into memory.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each facet, cell or element, made together"
)]

use crate::TransportError;
use crate::contract::check_memory;
use crate::hemicube::indirect::form::{BLOCK, Block, Rows, times};
use crate::hemicube::indirect::hemicube::{
    FormFactorTable, Hemicube, SurfaceProximity, hash_to_unit,
};
use crate::hemicube::indirect::interpolation::Interpolation;
use crate::hemicube::indirect::smoothing::Smoothing;
use crate::hemicube::mesh::{CellRequest, Layout, Mesh};
use crate::hemicube::raster::VertexBuffer;
use crate::hemicube::rounding::Rounding;
use crate::hemicube::step::HemicubeStep;
use crate::surfaces::fragment::Fragments;
use crate::surfaces::hierarchy::SceneGeometry;
use footlight_host::work::{Cancelled, Work};
use footlight_show::geometry::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes that a gather point takes without its row, about: an element and its place in the grid.
const GATHER_POINT_BYTES: usize = 256;

/// The points of the final gather, which finds reflected irradiance there; fragments interpolate
/// between them.
pub struct GatherPoints {
    /// Elements of a finer grid, which receive and do not send.
    pub mesh: Mesh,
    table: FormFactorTable,
    /// As [`HemicubeStep::reach`].
    reach: f64,
    /// `None` where the rows together do not fit into memory: all are made again for each use.
    stored: Option<StoredRows>,
}

/// Form factors of the gather points, and what follows from them.
struct StoredRows {
    /// For each pass, the gather points with a hemicube and their rows.
    passes: Vec<(Vec<u32>, Rows)>,
    interpolation: Interpolation,
    smoothing: Smoothing,
}

/// The scene and the elements that hemicubes see.
#[derive(Clone, Copy)]
pub struct GatherScene<'a> {
    /// The scene.
    pub setting: SceneGeometry<'a>,
    /// Its corners.
    pub vertices: &'a VertexBuffer,
    /// The elements that send light.
    pub to: &'a Mesh,
}

impl GatherPoints {
    /// The gather points that the fragments need, with their form factors to the elements. If the
    /// rows together would take more than a quarter of the memory, none is stored, and
    /// [`GatherPoints::gather`] makes all of them again at each call.
    ///
    /// # Errors
    /// [`TransportError::Memory`] when not even the gather points fit, and cancel.
    pub fn new(
        gather_scene: GatherScene<'_>,
        seeds: &[Vec3],
        (fragments, rounding): (&Fragments, Option<&Rounding>),
        step: HemicubeStep,
        work: Work<'_>,
    ) -> Result<GatherPoints, TransportError> {
        let setting = gather_scene.setting;
        let pixels = fragments.visible_areas(setting.surfaces.facets.len());
        let layout = Layout::of_gather_points(setting.surfaces, step.gather_points, &pixels);
        check_memory(
            "gather points",
            layout.cells().saturating_mul(GATHER_POINT_BYTES),
            work.memory,
        )?;
        let mut requests = vec![CellRequest::default(); layout.cells()];
        let mut want = |facet: usize, point: Vec3| {
            for (cell, weight) in layout.grid(facet).iter().flat_map(|g| g.stencil(point)) {
                requests[cell].wanted |= weight > 0.0;
            }
        };
        fragments.all().iter().for_each(|f| want(f.facet, f.point));
        let round = rounding.into_iter().flat_map(Rounding::receivers);
        round.for_each(|r| want(r.facet, r.point));
        record_visible_points(&layout, fragments, &mut requests);
        let mesh = layout.mesh(setting, seeds, &requests, work)?;
        let table = FormFactorTable::new(step.gather_resolution);
        let limited = Work {
            memory: work.memory / 4,
            ..work
        };
        let tally = RowTally::new("final gather", mesh.elements.len());
        let mut passes = Vec::new();
        let interpolation = Interpolation::new(&mesh, step.reach, |which| {
            let (rows, proximity) =
                form_factors(gather_scene, &mesh, which, &table, &tally, limited)?;
            passes.push((which.to_vec(), rows));
            Ok(proximity)
        });
        let stored = match interpolation {
            Ok(interpolation) => Some(StoredRows {
                passes,
                smoothing: Smoothing::new(&mesh, &interpolation.proximity),
                interpolation,
            }),
            Err(TransportError::Memory { .. }) => None,
            Err(other) => return Err(other),
        };
        Ok(GatherPoints {
            mesh,
            table,
            reach: step.reach,
            stored,
        })
    }

    /// Bytes held, about: gather points and stored rows.
    pub fn bytes(&self) -> usize {
        let passes = self.stored.iter().flat_map(|stored| &stored.passes);
        let rows: usize = passes.map(|(_, rows)| rows.bytes()).sum();
        self.mesh.elements.len() * GATHER_POINT_BYTES + rows
    }

    /// Reflected irradiance at each gather point, `width` values each, from the radiosities of the
    /// elements, `width` values each. The same bits whether the rows are stored or not.
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
        if let Some(stored) = &self.stored {
            for (which, rows) in &stored.passes {
                set_rows(which, &rows.times(radiosity, width), width, &mut out);
            }
            stored.interpolation.fill(&mut out, width);
            stored.smoothing.smooth(&mut out, width);
            return Ok(out);
        }
        let interpolation = Interpolation::new(&self.mesh, self.reach, |which| {
            let (sums, proximity) =
                self.gather_without_rows(gather_scene, which, radiosity, width, work)?;
            set_rows(which, &sums, width, &mut out);
            Ok(proximity)
        })?;
        interpolation.fill(&mut out, width);
        Smoothing::new(&self.mesh, &interpolation.proximity).smooth(&mut out, width);
        Ok(out)
    }

    /// Irradiance at some gather points, `width` values each, and their surface proximity: the
    /// products of their rows with the radiosities, added up while the hemicubes are drawn.
    fn gather_without_rows(
        &self,
        gather_scene: GatherScene<'_>,
        which: &[u32],
        radiosity: &[f32],
        width: usize,
        work: Work<'_>,
    ) -> Result<(Vec<f32>, Vec<SurfaceProximity>), Cancelled> {
        let tally = RowTally::new("final gather", which.len());
        let block = |cube: &mut Hemicube<'_>, which: &[u32]| {
            let (rows, proximity) = rows(cube, &self.mesh, which, work)?;
            let mut sums = vec![0.0_f32; which.len() * width];
            times(&rows, radiosity, width, &mut sums);
            Ok::<_, Cancelled>((sums, proximity))
        };
        let blocks = in_blocks(gather_scene, which, &self.table, &tally, work, block)?;
        let (sums, proximity): (Vec<_>, Vec<_>) = blocks.into_iter().unzip();
        Ok((sums.concat(), proximity.concat()))
    }
}

/// Copies rows of `width` values, one for each gather point of `which`, to their places in `all`.
fn set_rows(which: &[u32], values: &[f32], width: usize, all: &mut [f32]) {
    for (gather_point, row) in which.iter().zip(values.chunks_exact(width.max(1))) {
        let at = *gather_point as usize * width;
        all[at..at + width].copy_from_slice(row);
    }
}

/// Sets for each cell the first point of it that a fragment shows, which is therefore not inside a
/// solid.
pub fn record_visible_points(layout: &Layout, fragments: &Fragments, requests: &mut [CellRequest]) {
    for f in fragments.all() {
        if let Some(grid) = layout.grid(f.facet) {
            requests[grid.cell(f.point)]
                .visible_point
                .get_or_insert(f.point);
        }
    }
}

/// Rows made and the bytes that they take, over several calls of [`form_factors`]: for progress
/// reports and the check of memory.
pub struct RowTally {
    task: &'static str,
    total: usize,
    done: AtomicUsize,
    /// Of all rows so far.
    bytes: AtomicUsize,
}

impl RowTally {
    /// No rows yet, of `total` at most in a task of this name.
    pub fn new(task: &'static str, total: usize) -> RowTally {
        RowTally {
            task,
            total,
            done: AtomicUsize::new(0),
            bytes: AtomicUsize::new(0),
        }
    }

    /// Counts `rows` more as made, and reports it.
    fn report(&self, rows: usize, work: Work<'_>) {
        let so_far = self.done.fetch_add(rows, Ordering::Relaxed) + rows;
        work.progress.report(self.task, so_far, self.total);
    }
}

/// Form factors from some elements of `from` to all elements, and the surface proximity at each.
///
/// # Errors
/// [`TransportError::Memory`] when they do not fit, and cancel.
pub fn form_factors(
    gather_scene: GatherScene<'_>,
    from: &Mesh,
    which: &[u32],
    table: &FormFactorTable,
    tally: &RowTally,
    work: Work<'_>,
) -> Result<(Rows, Vec<SurfaceProximity>), TransportError> {
    let block = |cube: &mut Hemicube<'_>, which: &[u32]| {
        let (mut block, proximity) = rows(cube, from, which, work)?;
        block.shrink();
        let own = block.bytes();
        let all = tally.bytes.fetch_add(own, Ordering::Relaxed) + own;
        check_memory("form factors", all, work.memory)?;
        Ok::<_, TransportError>((block, proximity))
    };
    let blocks = in_blocks(gather_scene, which, table, tally, work, block)?;
    let (blocks, proximity): (Vec<Block>, Vec<_>) = blocks.into_iter().unzip();
    Ok((Rows::of(blocks), proximity.concat()))
}

/// Runs `block` on [`BLOCK`] elements at a time, in parallel; its results in order.
fn in_blocks<R: Send, E: From<Cancelled> + Send>(
    gather_scene: GatherScene<'_>,
    which: &[u32],
    table: &FormFactorTable,
    tally: &RowTally,
    work: Work<'_>,
    block: impl Fn(&mut Hemicube<'_>, &[u32]) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let GatherScene {
        setting,
        vertices,
        to,
    } = gather_scene;
    // The work of one task: enough blocks that making a hemicube does not count.
    let tasks = which.par_chunks(4 * BLOCK).map(|which| {
        let mut cube = Hemicube::new(setting, vertices, to, table);
        let mut results = Vec::new();
        for which in which.chunks(BLOCK) {
            results.push(block(&mut cube, which)?);
            tally.report(which.len(), work);
        }
        Ok(results)
    });
    let results: Result<Vec<Vec<R>>, E> = tasks.collect();
    Ok(results?.into_iter().flatten().collect())
}

/// Form factors of some elements of `from`, found by a hemicube, and the surface proximity at each.
fn rows(
    cube: &mut Hemicube<'_>,
    from: &Mesh,
    which: &[u32],
    work: Work<'_>,
) -> Result<(Block, Vec<SurfaceProximity>), Cancelled> {
    let mut block = Block::default();
    let mut proximity = Vec::with_capacity(which.len());
    for &at in which {
        work.check()?;
        let e = &from.elements[at as usize];
        let turn = hash_to_unit(u64::from(at));
        let take = |element, share| block.add((element, share));
        proximity.push(cube.visit(e.facet, e.centre, turn, take));
        block.end();
    }
    Ok((block, proximity))
}
