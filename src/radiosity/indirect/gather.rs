//! What elements and nodes see of the elements: rows of form factors, kept or made again.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each facet, cell or element, made together"
)]

use super::between::Between;
use super::links::Links;
use crate::geometry::Vec3;

use crate::radiosity::camera::eye::Fragments;
use crate::radiosity::direct::Setting;
use crate::radiosity::indirect::form::{BLOCK, Block, Rows};
use crate::radiosity::indirect::hemicube::{Hemicube, Outlook, Table, scatter};
use crate::radiosity::mesh::{Layout, Mesh, Wish};
use crate::radiosity::step::Step;
use crate::radiosity::visibility::panorama::Outline;
use crate::renderer::TransportError;
use crate::renderer::contract::check_memory;
use crate::work::{Cancelled, Work};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// About what a node takes without its row, bytes: an element and its place in the grid.
const OF_A_NODE: usize = 256;

/// Where reflected light is interpolated between.
pub struct Nodes {
    /// Elements of a finer grid that only gather.
    pub mesh: Mesh,
    table: Table,
    /// How near to others a node need not look itself ([`Between::nodes`]).
    reach: f64,
    /// Without them they are made again for each use.
    kept: Option<Kept>,
}

/// What the nodes see.
struct Kept {
    /// Form factors to elements, from those nodes that look.
    seen: Vec<(Vec<u32>, Rows)>,
    between: Between,
    links: Links,
}

/// What is looked at, from wherever.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// The scene.
    pub setting: Setting<'a>,
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
        sight: Sight<'_>,
        beacons: &[Vec3],
        fragments: &Fragments,
        step: Step,
        work: Work<'_>,
    ) -> Result<Nodes, TransportError> {
        let setting = sight.setting;
        let mut pixels = vec![0.0; setting.surfaces.facets.len()];
        for f in &fragments.all {
            pixels[f.facet] += f64::from(f.weight);
        }
        let layout = Layout::of_nodes(setting.surfaces, step.nodes, &pixels);
        check_memory(
            "the nodes",
            layout.cells().saturating_mul(OF_A_NODE),
            work.memory,
        )?;
        let mut wishes = vec![Wish::default(); layout.cells()];
        for f in &fragments.all {
            for (cell, weight) in layout.grid(f.facet).iter().flat_map(|g| g.stencil(f.point)) {
                wishes[cell].wanted |= weight > 0.0;
            }
        }
        show(&layout, fragments, &mut wishes);
        let mesh = layout.mesh(setting, beacons, &wishes);
        let table = Table::new(step.node_resolution);
        let limited = Work {
            memory: work.memory / 4,
            ..work
        };
        let meter = Meter::new("final gather", mesh.elements.len());
        let mut seen = Vec::new();
        let between = Between::nodes(&mesh, step.reach, |nodes| {
            let (rows, outlooks) = form_factors(sight, &mesh, nodes, &table, &meter, limited)?;
            seen.push((nodes.to_vec(), rows));
            Ok(outlooks)
        });
        let kept = match between {
            Ok(between) => Some(Kept {
                seen,
                links: Links::new(&mesh, &between.outlooks),
                between,
            }),
            Err(TransportError::Memory { .. }) => None,
            Err(other) => return Err(other),
        };
        Ok(Nodes {
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
        self.mesh.elements.len() * OF_A_NODE + rows
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
        let mut out = vec![0.0_f32; self.mesh.elements.len() * width];
        if let Some(kept) = &self.kept {
            for (nodes, rows) in &kept.seen {
                place(nodes, &rows.times(radiosity, width), width, &mut out);
            }
            kept.between.fill(&mut out, width);
            kept.links.even(&mut out, width);
            return Ok(out);
        }
        let between = Between::nodes(&self.mesh, self.reach, |nodes| {
            let mut sums = vec![0.0_f32; nodes.len() * width];
            let outlooks = self.look(sight, nodes, radiosity, &mut sums, work)?;
            place(nodes, &sums, width, &mut out);
            Ok(outlooks)
        })?;
        between.fill(&mut out, width);
        Links::new(&self.mesh, &between.outlooks).even(&mut out, width);
        Ok(out)
    }

    /// Adds up what some nodes see of a block of radiosities, without keeping the rows.
    fn look(
        &self,
        sight: Sight<'_>,
        nodes: &[u32],
        radiosity: &[f32],
        sums: &mut [f32],
        work: Work<'_>,
    ) -> Result<Vec<Outlook>, Cancelled> {
        let width = sums.len() / nodes.len().max(1);
        let (done, all) = (AtomicUsize::new(0), nodes.len());
        let mut outlooks = vec![Outlook::default(); nodes.len()];
        nodes
            .par_chunks(BLOCK)
            .zip(sums.par_chunks_mut(BLOCK * width.max(1)))
            .zip(outlooks.par_chunks_mut(BLOCK))
            .try_for_each(|((nodes, sums), outlooks)| {
                work.check()?;
                let so_far = done.fetch_add(nodes.len(), Ordering::Relaxed);
                work.progress.report("final gather", so_far, all);
                let mut cube = Hemicube::new(sight.setting, sight.outline, sight.to, &self.table);
                for (i, &at) in nodes.iter().enumerate() {
                    let node = &self.mesh.elements[at as usize];
                    let turn = scatter(u64::from(at));
                    let sums = &mut sums[i * width..(i + 1) * width];
                    outlooks[i] = cube.visit(node.facet, node.centre, turn, |element, share| {
                        let from = element as usize * width;
                        for (sum, x) in sums.iter_mut().zip(&radiosity[from..from + width]) {
                            *sum += share * x;
                        }
                    });
                }
                Ok::<(), Cancelled>(())
            })?;
        Ok(outlooks)
    }
}

/// Puts rows of values, one for each of some nodes, where they belong among all.
fn place(nodes: &[u32], values: &[f32], width: usize, all: &mut [f32]) {
    for (node, row) in nodes.iter().zip(values.chunks_exact(width.max(1))) {
        let at = *node as usize * width;
        all[at..at + width].copy_from_slice(row);
    }
}

/// A block of rows, and [`Hemicube::visit`]'s answer for each.
type Seen = (Block, Vec<Outlook>);

/// Notes for each cell a point of it that the picture shows.
pub fn show(layout: &Layout, fragments: &Fragments, wishes: &mut [Wish]) {
    for f in &fragments.all {
        if let Some(grid) = layout.grid(f.facet) {
            wishes[grid.cell(f.point)].shown.get_or_insert(f.point);
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
    sight: Sight<'_>,
    from: &Mesh,
    which: &[u32],
    table: &Table,
    meter: &Meter,
    work: Work<'_>,
) -> Result<(Rows, Vec<Outlook>), TransportError> {
    let count = Ordering::Relaxed;
    // The work of one task: enough blocks that making a hemicube does not count.
    let tasks: Result<Vec<Vec<Seen>>, TransportError> = which
        .par_chunks(4 * BLOCK)
        .map(|which| {
            let mut cube = Hemicube::new(sight.setting, sight.outline, sight.to, table);
            let mut blocks = Vec::new();
            for which in which.chunks(BLOCK) {
                work.check()?;
                let mut block = Block::default();
                let mut outlooks = Vec::with_capacity(which.len());
                for &at in which {
                    let e = &from.elements[at as usize];
                    let turn = scatter(u64::from(at));
                    let outlook =
                        cube.visit(e.facet, e.centre, turn, |c, share| block.push(c, share));
                    outlooks.push(outlook);
                    block.end_row();
                }
                block.trim();
                let own = block.bytes();
                let all = meter.bytes.fetch_add(own, count) + own;
                check_memory("form factors", all, work.memory)?;
                blocks.push((block, outlooks));
                let so_far = meter.done.fetch_add(which.len(), count) + which.len();
                work.progress.report(meter.task, so_far, meter.total);
            }
            Ok(blocks)
        })
        .collect();
    let (blocks, outlooks): (Vec<Block>, Vec<Vec<Outlook>>) = tasks?.into_iter().flatten().unzip();
    Ok((Rows::of(blocks), outlooks.concat()))
}
