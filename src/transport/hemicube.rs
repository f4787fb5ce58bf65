//! Radiosity by hemicubes.
//!
//! Direct light is exact at every fragment of the image; reflected light is the radiosity of mesh
//! elements, gathered by hemicubes that see each element in four parts. Every light is solved once at unit strength: settings, colours
//! and filters only scale it, so that G is linear by construction. Invariant: mesh, order of
//! summation and number of iterations depend on setup and quality alone. The only part of the other
//! renderer that this module uses is light in haze and in gloss.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, gather point, fragment or source, made together"
)]

mod compose;
pub mod cost;
mod flux;
mod gloss;
pub mod indirect;
pub mod interior;
pub mod mesh;
pub mod raster;
mod rounding;
mod solution;
mod sources;
pub mod step;

use crate::direct::cluster::{Receiver, Receivers};
use crate::direct::projector::{Projector, projector};
use crate::direct::{PreparedLight, check_rig, luminaires};
use crate::gather::bvh::Bvh;
use crate::gather::ray_scene::RayScene;
use crate::hemicube::compose::weight_lists;
use crate::hemicube::gloss::{EyeScene, Gloss};
use crate::hemicube::indirect::form::{Bounces, Rows};
use crate::hemicube::indirect::gather_points::{
    GatherPoints, GatherScene, RowTally, form_factors, record_visible_points,
};
use crate::hemicube::indirect::hemicube::FormFactorTable;
use crate::hemicube::interior::seeds;
use crate::hemicube::mesh::{CellRequest, Layout, Mesh};
use crate::hemicube::raster::VertexBuffer;
use crate::hemicube::rounding::Rounding;
use crate::hemicube::sources::Sources;
use crate::hemicube::step::HemicubeStep;
use crate::memory::MemoryBudget;
use crate::surfaces::FACET_BYTES;
use crate::surfaces::fragment::{Fragment, Fragments, fragments};
use crate::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;
use crate::unit_lights::UnitLights;
use crate::{Setup, TransportError};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_stage::Rig;
use std::sync::Arc;

/// Approximate bytes that a fragment takes apart from its own: a receiver, its clusters, and four
/// gather weights.
const FRAGMENT_BYTES: usize = 180;

/// Approximate bytes of an element with its samples.
const ELEMENT_BYTES: usize = 512;

/// A light at unit strength.
struct Solution {
    /// Irradiance at each fragment, equal in all channels.
    direct: Vec<f32>,
    /// Reflected irradiance at each gather point, three channels interleaved.
    indirect: Vec<f32>,
    /// Radiance that haze scatters to the eye in each pixel, equal in all channels; empty without
    /// haze.
    airlight: Vec<f32>,
    /// Radiance of the light itself in each glossy fragment, before its tint.
    highlights: Vec<f32>,
    /// Radiance of each element, as glossy fragments show it, three channels interleaved; empty
    /// without them.
    elements: Vec<f32>,
}

/// G for one setup and step.
pub struct HemicubeRadiosity {
    rig: Arc<Rig>,
    width: usize,
    height: usize,
    surfaces: Surfaces,
    vertices: VertexBuffer,
    hierarchy: Hierarchy,
    /// Hierarchy for haze and gloss.
    bvh: Option<Bvh>,
    /// `None` when the image shows nothing glossy.
    gloss: Option<Gloss>,
    /// Nodes along a ray of sight in haze.
    nodes: usize,
    lights: Vec<PreparedLight>,
    /// For each light its projector, if it is a projection.
    projectors: Vec<Option<Projector>>,
    mesh: Mesh,
    /// Elements that the final gather and gloss see.
    sources: Sources,
    /// Visibility seeds: points outside all solids.
    seeds: Vec<Vec3>,
    /// Reflectance of each element.
    reflectance: Vec<[f32; 3]>,
    rows: Rows,
    bounces: Bounces,
    gather_points: GatherPoints,
    fragments: Fragments,
    /// `None` when the image shows no round surface.
    rounding: Option<Rounding>,
    /// Reflectance of each fragment; empty when the scene has no textures.
    paints: Vec<[f32; 3]>,
    /// Gather points around each fragment, with their weights.
    gather_weights: Lists<(u32, f32)>,
    /// Share of the image of each element.
    visible_shares: Vec<f64>,
    /// Allowed error of interpolated direct light, relative to its level in the image.
    tolerance: f64,
    /// See `IrradiancePrecision::near`.
    near: f64,
    fragment_receivers: Receivers,
    element_receivers: Receivers,
    /// Approximate bytes held.
    held: usize,
    solutions: Vec<Option<Solution>>,
}

impl HemicubeRadiosity {
    /// Prepares the operator.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    pub fn new(
        setup: &Setup,
        step: HemicubeStep,
        work: Work<'_>,
    ) -> Result<HemicubeRadiosity, TransportError> {
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let mut budget = MemoryBudget::new(work);
        budget.take("the stage", scene.polygons.len() * FACET_BYTES)?;
        let surfaces = Surfaces::new(scene)?;
        work.check()?;
        let hierarchy = Hierarchy::new(&surfaces);
        let vertices = VertexBuffer::new(&surfaces);
        let setting = SceneGeometry::new(&surfaces, &hierarchy);
        let lights = luminaires(&surfaces, rig)?;
        let uses_rays = surfaces.haze.is_some() || surfaces.is_glossy();
        let bvh = uses_rays.then(|| Bvh::new(&surfaces, work)).transpose()?;
        budget.take(
            "the hierarchy of triangles",
            bvh.as_ref().map_or(0, Bvh::bytes),
        )?;
        // Bands of the image are computed separately and then copied together.
        let pixels = view.width.saturating_mul(view.height);
        let bands = pixels.saturating_mul(2 * size_of::<Fragment>());
        budget.check("the picture", bands)?;
        let fragments = fragments(&surfaces, view, step.sampling, work)?;
        let each = size_of::<Fragment>() + FRAGMENT_BYTES + 4 * rig.lights.len();
        let every = fragments.all().len() * each;
        budget.take("direct light at every fragment", every)?;

        let rounding = Rounding::new(&surfaces, &fragments);
        budget.take(
            "round surfaces",
            rounding.as_ref().map_or(0, Rounding::bytes),
        )?;

        let layout = Layout::of_elements(&surfaces, step.elements);
        // Each element and its four sources.
        budget.take("the mesh", 5 * layout.cells() * ELEMENT_BYTES)?;
        let seeds = seeds(setting, &lights, view.from);
        let mut requests = vec![CellRequest::WANTED; layout.cells()];
        record_visible_points(&layout, &fragments, &mut requests);
        let mesh = layout.clone().mesh(setting, &seeds, &requests, work)?;
        let sources = Sources::new(&layout, &mesh, (setting, &seeds, &fragments), work)?;

        let gloss = match bvh.as_ref().filter(|_| surfaces.is_glossy()) {
            Some(bvh) => {
                let seen = EyeScene {
                    scene: RayScene::new(&surfaces, bvh),
                    fragments: &fragments,
                };
                let size = (view.width, step.lobe_rays);
                Gloss::new(seen, &sources.mesh, size, budget.share(1, work))?
            }
            None => None,
        };
        budget.take("reflections", gloss.as_ref().map_or(0, Gloss::bytes))?;

        let gather_scene = GatherScene {
            setting,
            vertices: &vertices,
            to: &mesh,
        };
        let table = FormFactorTable::new(step.resolution);
        let limited = budget.share(2, work);
        let every: Vec<u32> = (0..mesh.elements.len() as u32).collect();
        let tally = RowTally::new("form factors", every.len());
        let (rows, _) = form_factors(gather_scene, &mesh, &every, &table, &tally, limited)?;
        budget.take("form factors", rows.bytes())?;
        let reflectance = mesh.elements.iter().map(|e| e.reflectance(&surfaces));
        let reflectance: Vec<[f32; 3]> = reflectance.map(|of| of.map(|r| r as f32)).collect();
        work.check()?;
        let bounces = Bounces::new(&rows, &reflectance);

        let gather_scene = GatherScene {
            to: &sources.mesh,
            ..gather_scene
        };
        let left = budget.share(1, work);
        let gather_points = GatherPoints::new(
            gather_scene,
            &seeds,
            (&fragments, rounding.as_ref()),
            step,
            left,
        )?;
        budget.take("gather points", gather_points.bytes())?;
        let count = gather_points.mesh.elements.len();
        let reflected = size_of::<[f32; 3]>() * count * rig.lights.len();
        budget.take("reflected light at every gather point", reflected)?;
        work.check()?;
        let gather_weights = weights(&gather_points.mesh, &fragments, rounding.as_ref(), work)?;
        work.check()?;
        Ok(HemicubeRadiosity {
            rig: Arc::clone(rig),
            width: view.width,
            height: view.height,
            fragment_receivers: Receivers::of_fragments(&surfaces, &fragments),
            element_receivers: Receivers::new(&surfaces, &samples(&mesh)),
            solutions: rig.lights.iter().map(|_| None).collect(),
            visible_shares: visible_shares(&mesh, &fragments),
            rounding,
            paints: compose::paints(&surfaces, &fragments),
            surfaces,
            vertices,
            hierarchy,
            bvh,
            gloss,
            nodes: step.nodes,
            lights,
            projectors: rig.lights.iter().map(projector).collect(),
            mesh,
            sources,
            seeds,
            reflectance,
            rows,
            bounces,
            gather_points,
            fragments,
            gather_weights,
            tolerance: step.tolerance,
            near: step.near,
            held: budget.held,
        })
    }
}

impl UnitLights for HemicubeRadiosity {
    fn bytes(&self) -> usize {
        self.held
    }

    fn pixels(&self) -> usize {
        self.width * self.height
    }

    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError> {
        self.solve_lights(wanted, work)
    }

    fn picture(&self, strengths: &[[f64; 3]]) -> Image {
        self.compose(strengths)
    }
}

/// Gather points of each fragment with their interpolation weights.
fn weights(
    gather_points: &Mesh,
    fragments: &Fragments,
    rounding: Option<&Rounding>,
    work: Work<'_>,
) -> Result<Lists<(u32, f32)>, Cancelled> {
    let around = |facet: usize, point: Vec3, weights: &mut Vec<(u32, f32)>| {
        let around = gather_points.stencil(facet, point).into_iter();
        weights.extend(around.filter(|(_, w)| *w > 0.0));
    };
    let Some(rounding) = rounding else {
        return weight_lists(fragments.all(), work, |_, f, weights| {
            around(f.facet, f.point, weights);
        });
    };
    weight_lists(fragments.all(), work, |number, f, weights| {
        for (facet, point, share) in rounding.places(number, f) {
            let first = weights.len();
            around(facet, point, weights);
            weights[first..].iter_mut().for_each(|(_, w)| *w *= share);
        }
        // A place without gather points leaves its share to the others.
        let sum: f32 = weights.iter().map(|(_, w)| w).sum();
        if sum > 0.0 {
            weights.iter_mut().for_each(|(_, w)| *w /= sum);
        }
    })
}

/// Share of the image of each element.
fn visible_shares(mesh: &Mesh, fragments: &Fragments) -> Vec<f64> {
    let mut shares = vec![0.0; mesh.elements.len()];
    let mut all = 0.0;
    for f in fragments.all() {
        let pixels = f64::from(f.weight);
        all += pixels;
        // A facet that reflects nothing has no element.
        if let Some(own) = shares.get_mut(mesh.at(f.facet, f.point) as usize) {
            *own += pixels;
        }
    }
    shares.iter_mut().for_each(|own| *own /= f64::max(all, 1.0));
    shares
}

/// Samples of all elements.
fn samples(mesh: &Mesh) -> Vec<Receiver> {
    let mut receivers = Vec::new();
    for e in &mesh.elements {
        receivers.extend(e.samples.iter().map(|s| Receiver {
            point: s.point,
            facet: e.facet,
        }));
    }
    receivers
}
