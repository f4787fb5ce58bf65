//! Hemicube passes over elements and gather points: rows of form factors, or their products with
//! the radiosities when the rows exceed memory.

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

/// Approximate bytes of a gather point without its row: an element and its place in the grid.
const GATHER_POINT_BYTES: usize = 256;

/// Points of the final gather, at which reflected irradiance is computed; fragments interpolate
/// between them.
pub struct GatherPoints {
    /// Elements of a finer grid, which receive light but do not send it.
    pub mesh: Mesh,
    table: FormFactorTable,
    /// See [`HemicubeStep::reach`].
    reach: f64,
    /// `None` when the rows exceed memory; they are then recomputed for each use.
    stored: Option<StoredRows>,
}

/// Form factors of the gather points, and derived data.
struct StoredRows {
    /// For each pass, the gather points with a hemicube and their rows.
    passes: Vec<(Vec<u32>, Rows)>,
    interpolation: Interpolation,
    smoothing: Smoothing,
}

/// The scene and the elements visible to hemicubes.
#[derive(Clone, Copy)]
pub struct GatherScene<'a> {
    /// The scene.
    pub setting: SceneGeometry<'a>,
    /// Corners of the scene.
    pub vertices: &'a VertexBuffer,
    /// The elements that send light.
    pub to: &'a Mesh,
}

impl GatherPoints {
    /// Selects the gather points that the fragments need, with their form factors to the elements.
    /// `seeds` are points outside all solids, `areas` the pixels of each facet in the whole picture.
    /// If the rows would take more than a quarter of the memory, none is stored, and
    /// [`GatherPoints::gather`] recomputes them at each call.
    ///
    /// # Errors
    /// On cancel; [`TransportError::Memory`] when even the gather points do not fit.
    pub fn new(
        gather_scene: GatherScene<'_>,
        (seeds, areas): (&[Vec3], &[f64]),
        (fragments, rounding): (&Fragments, Option<&Rounding>),
        step: HemicubeStep,
        work: Work<'_>,
    ) -> Result<GatherPoints, TransportError> {
        let setting = gather_scene.setting;
        let layout = Layout::of_gather_points(setting.surfaces, step.gather_points, areas);
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

    /// Approximate bytes of gather points and stored rows.
    pub fn bytes(&self) -> usize {
        let passes = self.stored.iter().flat_map(|stored| &stored.passes);
        let rows: usize = passes.map(|(_, rows)| rows.bytes()).sum();
        self.mesh.elements.len() * GATHER_POINT_BYTES + rows
    }

    /// Reflected irradiance at each gather point, `width` values each, from the radiosities of the
    /// elements, `width` values each. The result is bitwise independent of whether the rows are
    /// stored.
    ///
    /// # Errors
    /// On cancel.
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

    /// Irradiance at some gather points, `width` values each, and their surface proximity: products
    /// of their rows with the radiosities, summed while the hemicubes are drawn.
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

/// Sets each cell's point to the first one that a fragment shows, which is therefore outside all
/// solids.
pub fn record_visible_points(layout: &Layout, fragments: &Fragments, requests: &mut [CellRequest]) {
    for f in fragments.all() {
        if let Some(grid) = layout.grid(f.facet) {
            requests[grid.cell(f.point)]
                .visible_point
                .get_or_insert(f.point);
        }
    }
}

/// Rows computed and their bytes, over several calls of [`form_factors`], for progress reports and
/// the memory check.
pub struct RowTally {
    task: &'static str,
    total: usize,
    done: AtomicUsize,
    /// Bytes of all rows so far.
    bytes: AtomicUsize,
}

impl RowTally {
    /// No rows yet, of at most `total` in the task of this name.
    pub fn new(task: &'static str, total: usize) -> RowTally {
        RowTally {
            task,
            total,
            done: AtomicUsize::new(0),
            bytes: AtomicUsize::new(0),
        }
    }

    /// Counts `rows` more, and reports them.
    fn report(&self, rows: usize, work: Work<'_>) {
        let so_far = self.done.fetch_add(rows, Ordering::Relaxed) + rows;
        work.progress.report(self.task, so_far, self.total);
    }
}

/// Form factors from selected elements of `from` to all elements, and the surface proximity at
/// each.
///
/// # Errors
/// On cancel; [`TransportError::Memory`] when they do not fit.
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

/// Runs `block` on [`BLOCK`] elements at a time, in parallel; returns the results in order.
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
    // One task: enough blocks to make the cost of creating a hemicube negligible.
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

/// Form factors of selected elements of `from` by hemicube, and the surface proximity at each.
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
