//! The project's own G: radiosity with exact direct light.
//!
//! Light is split into what comes straight from a luminaire, which is exact at every fragment of
//! the picture, and what has been reflected, which is the radiosity of elements gathered by
//! hemicubes. Emission never passes a hemicube. Every number is kept per light at unit strength:
//! settings, colours and filters only scale, so G is linear by construction, and whatever settings
//! have in common is computed once. Invariant: mesh, order of summation and length of iterations
//! follow from setup and quality alone.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, node, fragment or source, made together"
)]

mod camera;
mod compose;
pub mod cost;
mod direct;
mod geometry;
mod indirect;
mod memory;
mod mesh;
pub mod step;
mod visibility;

pub use camera::emitter_mask;
pub use camera::fragment::camera;
pub use direct::beam::Beam;
pub use direct::cluster::{Receiver, Receivers};
pub use direct::{Luminaire, Precision, Setting, Shining, irradiance, luminaires};
pub use geometry::surface::Surfaces;
pub use indirect::form::{BLOCK, Block, Bounces, Rows};
pub use indirect::hemicube::{Hemicube, Row, Table, scatter};
pub use mesh::sample::kept_inside;
pub use mesh::{CellRequest, Layout, Mesh};
pub use visibility::Hierarchy;
pub use visibility::hemicube_raster::VertexBuffer;
pub use visibility::interior::is_interior;
pub use visibility::raster::Camera;

use crate::geometry::Vec3;
use crate::picture::Image;
use crate::renderer::contract::{check_memory, check_settings};
use crate::renderer::{
    Cost, Prepared, Quality, QualityParameter, Setup, Transport, TransportError,
};
use crate::scene::{Light, Rig};
use crate::work::Work;
use camera::fragment::{Fragment, Fragments, fragments};
use compose::GatherWeights;
use cost::Counts;
use direct::projector::Projector;
use direct::strength::check_rig;
use indirect::gather::{GatherPoints, GatherScene, Meter, form_factors, show};
use memory::MemoryBudget;
use mesh::stitching::Stitching;
use rayon::ThreadPool;
use std::sync::Arc;
use step::{STEPS, Step};
use visibility::interior::seeds;

/// Radiosity with hemicubes, five steps of quality.
#[derive(Clone, Copy, Debug, Default)]
pub struct Radiosity;

impl Transport for Radiosity {
    fn name(&self) -> &str {
        "radiosity"
    }

    fn results(&self) -> Option<String> {
        // The digest of this module and those below it, made by `src/build.rs`: any change of the
        // code is another version, without anybody having to think of it.
        Some(format!("{} {}", self.name(), env!("FOOTLIGHT_OPERATOR")))
    }

    fn finest(&self) -> Quality {
        Quality(STEPS.len() as u8)
    }

    fn prepare(
        &self,
        setup: &Setup,
        quality: Quality,
        work: Work<'_>,
    ) -> Result<Box<dyn Prepared>, TransportError> {
        let step = Step::of(quality)?;
        let operator = Threads::new(work)?.install(|| Operator::new(setup, step, work))?;
        Ok(Box::new(operator))
    }

    /// In units of the pace, from counts of the work; nothing where the scene cannot be used.
    fn cost(&self, setup: &Setup, quality: Quality) -> Cost {
        let counts = Step::of(quality).and_then(|step| Counts::of(setup, step));
        counts.map_or(Cost::default(), |counts| {
            counts.cost(setup.rig.sources.len())
        })
    }

    fn quality_parameters(
        &self,
        setup: &Setup,
        quality: Quality,
    ) -> Result<Vec<QualityParameter>, TransportError> {
        let step = Step::of(quality)?;
        Ok(Counts::of(setup, step)?.quality_parameters(step))
    }

    fn cost_scale(&self, clock: &dyn Fn() -> f64, work: Work<'_>) -> Result<f64, TransportError> {
        cost::cost_scale(clock, work)
    }
}

/// Threads that live for one call of the operator; `None` where the platform has none, and loops
/// run on the caller's.
struct Threads(Option<ThreadPool>);

impl Threads {
    fn new(work: Work<'_>) -> Result<Threads, TransportError> {
        if cfg!(target_family = "wasm") {
            return Ok(Threads(None));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(work.threads.max(1));
        let pool = pool.build();
        let pool = pool.map_err(|e| TransportError::Scene(format!("no threads: {e}")))?;
        Ok(Threads(Some(pool)))
    }

    fn install<R: Send>(&self, task: impl FnOnce() -> R + Send) -> R {
        match &self.0 {
            Some(pool) => pool.install(task),
            None => task(),
        }
    }
}

/// Bytes of a fragment beside itself, about: its receiver and clusters, four shares of gather
/// points.
const OF_A_FRAGMENT: usize = 180;

/// Bytes of an element with its samples, about.
const OF_AN_ELEMENT: usize = 512;

/// A light at unit strength.
struct Solution {
    /// Irradiance at each fragment, the same in all channels.
    direct: Vec<f32>,
    /// Reflected irradiance at each gather point, three channels interleaved.
    indirect: Vec<f32>,
}

/// G for one setup and step.
struct Operator {
    rig: Arc<Rig>,
    width: usize,
    height: usize,
    surfaces: Surfaces,
    vertices: VertexBuffer,
    hierarchy: Hierarchy,
    lights: Vec<Luminaire>,
    /// For each light, the first that shines alike at unit strength: itself, or another panel of
    /// the same surfaces.
    alike: Vec<usize>,
    /// For each light, how it is cut out of even light if it is a projection.
    projectors: Vec<Option<Projector>>,
    mesh: Mesh,
    /// Points known to be in the open.
    seeds: Vec<Vec3>,
    /// Of each element.
    reflectance: Vec<[f32; 3]>,
    rows: Rows,
    bounces: Bounces,
    /// A second gather; without it the elements are the gather points.
    gather_points: Option<GatherPoints>,
    fragments: Fragments,
    /// For each fragment the gather points around it and their weights.
    taken: GatherWeights,
    /// For each element its share of all that the picture shows.
    shown: Vec<f64>,
    /// How exactly direct light is interpolated, as a share of its level in the picture.
    tolerance: f64,
    /// As [`Precision::near`].
    near: f64,
    fragment_receivers: Receivers,
    element_receivers: Receivers,
    /// Bytes, about.
    held: usize,
    solutions: Vec<Option<Solution>>,
}

impl Operator {
    fn new(setup: &Setup, step: Step, work: Work<'_>) -> Result<Operator, TransportError> {
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let surfaces = Surfaces::new(scene)?;
        let hierarchy = Hierarchy::new(&surfaces);
        let vertices = VertexBuffer::new(&surfaces);
        let setting = Setting {
            surfaces: &surfaces,
            hierarchy: &hierarchy,
        };
        let lights = luminaires(&surfaces, rig)?;
        let mut account = MemoryBudget::new(work);
        // They are found in bands and then put together.
        let pixels = view.width.saturating_mul(view.height);
        let bands = pixels.saturating_mul(2 * size_of::<Fragment>());
        account.check("the picture", bands)?;
        let fragments = fragments(&surfaces, view, step.sampling(), work)?;
        let each = size_of::<Fragment>() + OF_A_FRAGMENT + 4 * rig.lights.len();
        let every = fragments.all.len() * each;
        account.take("direct light at every fragment", every)?;

        let layout = Layout::of_elements(&surfaces, step.elements);
        account.take("the mesh", layout.cells() * OF_AN_ELEMENT)?;
        let seeds = seeds(setting, &lights, view.from);
        let mut requests = vec![CellRequest::WANTED; layout.cells()];
        show(&layout, &fragments, &mut requests);
        let mesh = layout.mesh(setting, &seeds, &requests);
        let gather_scene = GatherScene {
            setting,
            vertices: &vertices,
            to: &mesh,
        };
        let table = Table::new(step.resolution);
        let limited = account.share(2, work);
        let every: Vec<u32> = (0..mesh.elements.len() as u32).collect();
        let meter = Meter::new("form factors", every.len());
        let (rows, _) = form_factors(gather_scene, &mesh, &every, &table, &meter, limited)?;
        account.take("form factors", rows.bytes())?;
        let reflectance: Vec<[f32; 3]> = mesh
            .elements
            .iter()
            .map(|e| surfaces.facets[e.facet].reflectance.map(|r| r as f32))
            .collect();
        let bounces = Bounces::new(&rows, &reflectance);
        let gather_points = match step.gather_points {
            0 => None,
            _ => {
                let left = account.share(1, work);
                Some(GatherPoints::new(
                    gather_scene,
                    &seeds,
                    &fragments,
                    step,
                    left,
                )?)
            }
        };
        account.take(
            "the nodes",
            gather_points.as_ref().map_or(0, GatherPoints::bytes),
        )?;
        let taken = match &gather_points {
            // They stand on the facets' rims: light goes on beyond without more.
            Some(gather_points) => GatherWeights::by(&fragments.all, |f, shares| {
                let around = gather_points.mesh.stencil(f.facet, f.point).into_iter();
                shares.extend(around.filter(|(_, w)| *w > 0.0));
            }),
            None => {
                let stitching = Stitching::new(&surfaces);
                GatherWeights::by(&fragments.all, |f, shares| {
                    stitching.stencil(&mesh, f.facet, f.point, shares);
                })
            }
        };
        Ok(Operator {
            rig: Arc::clone(rig),
            width: view.width,
            height: view.height,
            fragment_receivers: Receivers::of_fragments(&surfaces, &fragments),
            element_receivers: Receivers::new(&surfaces, &samples(&mesh)),
            solutions: rig.lights.iter().map(|_| None).collect(),
            shown: shown(&mesh, &fragments),
            surfaces,
            vertices,
            hierarchy,
            lights,
            alike: alike(&rig.lights),
            projectors: rig.lights.iter().map(projector).collect(),
            mesh,
            seeds,
            reflectance,
            rows,
            bounces,
            gather_points,
            fragments,
            taken,
            tolerance: step.tolerance,
            near: step.near,
            held: account.held,
        })
    }

    /// Strength of each light in each channel under a setting, counted at the first of those that
    /// are alike.
    fn strengths(&self, setting: &[f64]) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.rig.lights.len()];
        for (source, s) in self.rig.sources.iter().zip(setting) {
            for emitter in &source.emitters {
                let colour = self.rig.lights[emitter.light].strength().0;
                let first = self.alike[emitter.light];
                for c in 0..3 {
                    out[first][c] += s * emitter.filter.0[c] * colour[c];
                }
            }
        }
        out
    }
}

impl Prepared for Operator {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        check_settings(settings, self.rig.sources.len())?;
        let strengths: Vec<Vec<[f64; 3]>> = settings.iter().map(|s| self.strengths(s)).collect();
        let wanted: Vec<usize> = (0..self.lights.len())
            .filter(|&l| strengths.iter().any(|s| s[l].iter().any(|x| *x != 0.0)))
            .collect();
        let pixels = self.width * self.height;
        let work = Work {
            memory: work.memory.saturating_sub(self.held),
            ..work
        };
        check_memory("the pictures", settings.len() * pixels * 12, work.memory)?;
        Threads::new(work)?.install(|| {
            self.solve(&wanted, work)?;
            let mut images = Vec::with_capacity(settings.len());
            for (done, s) in strengths.iter().enumerate() {
                work.check()?;
                work.progress.report("pictures", done, settings.len());
                images.push(self.compose(s));
            }
            work.progress
                .report("pictures", settings.len(), settings.len());
            Ok(images)
        })
    }
}

/// For each element its share of all that the picture shows.
fn shown(mesh: &Mesh, fragments: &Fragments) -> Vec<f64> {
    let mut out = vec![0.0; mesh.elements.len()];
    let mut all = 0.0;
    for f in &fragments.all {
        let pixels = f64::from(f.weight);
        all += pixels;
        if let Some(own) = out.get_mut(mesh.at(f.facet, f.point) as usize) {
            *own += pixels;
        }
    }
    out.iter_mut().for_each(|own| *own /= f64::max(all, 1.0));
    out
}

/// The samples of all elements.
fn samples(mesh: &Mesh) -> Vec<Receiver> {
    let pairs = mesh.elements.iter().flat_map(|e| {
        let facet = e.facet;
        e.samples.iter().map(move |s| (s.point, facet))
    });
    pairs
        .map(|(point, facet)| Receiver { point, facet })
        .collect()
}

/// For each light the first that is a panel of the same material, or itself.
fn alike(lights: &[Light]) -> Vec<usize> {
    let material = |light: &Light| match light {
        Light::Panel { material, .. } => Some(*material),
        _ => None,
    };
    let first = |(i, light): (usize, &Light)| {
        let own = material(light);
        let same = |other: &Light| own.is_some() && material(other) == own;
        lights.iter().position(same).unwrap_or(i)
    };
    lights.iter().enumerate().map(first).collect()
}

fn projector(light: &Light) -> Option<Projector> {
    match light {
        Light::Projection(projection) => Projector::new(projection),
        _ => None,
    }
}
