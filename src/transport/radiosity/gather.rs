//! What elements and nodes see of the elements: rows of form factors, kept or made again.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each facet, cell or element, made together"
)]

use super::links::Links;
use super::within;
use crate::geometry::Vec3;
use crate::transport::TransportError;
use crate::transport::direct::Setting;
use crate::transport::eye::Fragments;
use crate::transport::form::{BLOCK, Block, Rows};
use crate::transport::hemicube::{Hemicube, Table, scatter};
use crate::transport::mesh::{Layout, Mesh, Wish};
use crate::transport::panorama::Outline;
use crate::transport::surface::Surfaces;
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Where reflected light is interpolated between.
pub struct Nodes {
    /// Elements of a finer grid that only gather.
    pub mesh: Mesh,
    table: Table,
    /// Form factors from nodes to elements, and which nodes are averaged; without them they are
    /// made again for each use.
    kept: Option<(Rows, Links)>,
}

/// What is looked at, from wherever.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// The scene.
    pub surfaces: &'a Surfaces,
    /// Its corners.
    pub outline: &'a Outline,
    /// The elements that send light.
    pub to: &'a Mesh,
}

impl Nodes {
    /// The finer nodes that the fragments need, and what they see of the elements. Rows that would
    /// take more than a quarter of the memory are not kept.
    ///
    /// # Errors
    /// [`TransportError::Memory`] when not even the nodes fit, and cancel.
    pub fn new(
        setting: Setting<'_>,
        sight: Sight<'_>,
        beacons: &[Vec3],
        fragments: &Fragments,
        (count, resolution): (usize, usize),
        work: Work<'_>,
    ) -> Result<Nodes, TransportError> {
        let mut pixels = vec![0.0; setting.surfaces.facets.len()];
        for f in &fragments.all {
            pixels[f.facet] += f64::from(f.weight);
        }
        let layout = Layout::of_nodes(setting.surfaces, count, &pixels);
        within("the nodes", layout.cells().saturating_mul(96), work)?;
        let mut wishes = vec![Wish::default(); layout.cells()];
        for f in &fragments.all {
            for (cell, weight) in layout.grid(f.facet).iter().flat_map(|g| g.stencil(f.point)) {
                wishes[cell].wanted |= weight > 0.0;
            }
        }
        show(&layout, fragments, &mut wishes);
        let mesh = layout.mesh(setting, beacons, &wishes);
        let table = Table::new(resolution);
        let limited = Work {
            memory: work.memory / 4,
            ..work
        };
        let kept = match form_factors(sight, &mesh, &table, "final gather", limited) {
            Ok((rows, closeness)) => Some((rows, Links::new(&mesh, &closeness))),
            Err(TransportError::Memory { .. }) => None,
            Err(other) => return Err(other),
        };
        Ok(Nodes { mesh, table, kept })
    }

    /// Irradiance at each node from a block of radiosities of `width` columns. The same bits
    /// whether the rows were kept or not.
    ///
    /// # Errors
    /// Cancel.
    pub fn gather(
        &self,
        sight: Sight<'_>,
        radiosity: &[f32],
        width: usize,
        work: Work<'_>,
    ) -> Result<Vec<f32>, Cancelled> {
        if let Some((rows, links)) = &self.kept {
            let mut out = rows.times(radiosity, width);
            links.even(&mut out, width);
            return Ok(out);
        }
        let mut closeness = vec![0.0_f32; self.mesh.elements.len()];
        let mut out = vec![0.0_f32; self.mesh.elements.len() * width];
        let nodes = self.mesh.elements.par_chunks(BLOCK).enumerate();
        nodes
            .zip(out.par_chunks_mut(BLOCK * width.max(1)))
            .zip(closeness.par_chunks_mut(BLOCK))
            .try_for_each(|(((block, nodes), out), closeness)| {
                work.check()?;
                let mut cube = Hemicube::new(sight.surfaces, sight.outline, sight.to, &self.table);
                for (i, node) in nodes.iter().enumerate() {
                    let turn = scatter((block * BLOCK + i) as u64);
                    let sums = &mut out[i * width..(i + 1) * width];
                    closeness[i] = cube.visit(node.facet, node.centre, turn, |element, share| {
                        let from = element as usize * width;
                        for (sum, x) in sums.iter_mut().zip(&radiosity[from..from + width]) {
                            *sum += share * x;
                        }
                    });
                }
                Ok(())
            })?;
        Links::new(&self.mesh, &closeness).even(&mut out, width);
        Ok(out)
    }
}

/// A block of rows, and [`Hemicube::visit`]'s answer for each.
type Seen = (Block, Vec<f32>);

/// Notes for each cell a point of it that the picture shows.
pub fn show(layout: &Layout, fragments: &Fragments, wishes: &mut [Wish]) {
    for f in &fragments.all {
        if let Some(grid) = layout.grid(f.facet) {
            wishes[grid.cell(f.point)].shown.get_or_insert(f.point);
        }
    }
}

/// Form factors from each element of `from` to all elements in sight, and for each one over the
/// mean distance of what it sees.
///
/// # Errors
/// [`TransportError::Memory`] when they do not fit, and cancel.
pub fn form_factors(
    sight: Sight<'_>,
    from: &Mesh,
    table: &Table,
    task: &'static str,
    work: Work<'_>,
) -> Result<(Rows, Vec<f32>), TransportError> {
    let total = from.elements.len();
    let done = AtomicUsize::new(0);
    let bytes = AtomicUsize::new(0);
    let count = Ordering::Relaxed;
    // The work of one task: enough blocks that making a hemicube does not count.
    let tasks: Result<Vec<Vec<Seen>>, TransportError> = from
        .elements
        .par_chunks(4 * BLOCK)
        .enumerate()
        .map(|(task_at, elements)| {
            let mut cube = Hemicube::new(sight.surfaces, sight.outline, sight.to, table);
            let mut blocks = Vec::new();
            for (at, elements) in elements.chunks(BLOCK).enumerate() {
                work.check()?;
                let mut block = Block::default();
                let mut closeness = Vec::with_capacity(elements.len());
                for (i, e) in elements.iter().enumerate() {
                    let turn = scatter(((task_at * 4 + at) * BLOCK + i) as u64);
                    let near = cube.visit(e.facet, e.centre, turn, |c, share| block.push(c, share));
                    closeness.push(near);
                    block.end_row();
                }
                block.trim();
                let own = block.bytes();
                within("form factors", bytes.fetch_add(own, count) + own, work)?;
                blocks.push((block, closeness));
                let so_far = done.fetch_add(elements.len(), count) + elements.len();
                work.progress.report(task, so_far, total);
            }
            Ok(blocks)
        })
        .collect();
    let (blocks, closeness): (Vec<Block>, Vec<Vec<f32>>) = tasks?.into_iter().flatten().unzip();
    Ok((Rows::of(blocks), closeness.concat()))
}
