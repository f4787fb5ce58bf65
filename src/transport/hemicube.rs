//! Radiosity by hemicubes.
//!
//! Direct light is exact at every fragment of the image; reflected light is the radiosity of mesh
//! elements, gathered by hemicubes that see each element in four parts. Every light is solved once
//! at unit strength: settings, colours and filters only scale it, so that G is linear by
//! construction. Large pictures are made in bands of rows, which share the mesh. Invariant: mesh,
//! order of summation and number of iterations depend on setup and quality alone. The only part of
//! the other renderer that this module uses is light in haze and in gloss.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light, element, gather point, fragment or source, made together"
)]

mod bounced;
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
pub mod sources;
pub mod step;

use crate::contract::check_memory;
use crate::direct::cluster::{Receiver, Receivers};
use crate::direct::projector::{Projector, projector};
use crate::direct::{PreparedLight, check_rig, luminaires};
use crate::gather::bvh::Bvh;
use crate::gather::ray_scene::RayScene;
use crate::hemicube::bounced::BouncedLight;
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
use crate::surfaces::camera::Window;
use crate::surfaces::fragment::{Fragment, Fragments, fragments};
use crate::surfaces::hierarchy::{Hierarchy, SceneGeometry};
use crate::surfaces::lists::Lists;
use crate::surfaces::surface::Surfaces;
use crate::unit_lights::{BandedScene, Bands, UnitLights};
use crate::{Setup, TransportError};
use footlight_host::work::{Cancelled, Work};
use footlight_picture::Image;
use footlight_show::geometry::Vec3;
use footlight_stage::Rig;
use std::ops::Range;
use std::sync::{Arc, Mutex};

/// Approximate bytes that a fragment takes apart from its own: a receiver, its clusters, and four
/// gather weights.
const FRAGMENT_BYTES: usize = 180;

/// Approximate bytes of a band of the picture.
const BAND_BYTES: usize = 448 << 20;

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
    /// Light on the scene; `None` if nothing needs it any more.
    bounced: Option<Arc<BouncedLight>>,
}

/// A scene meshed for a view and a step of quality: everything that the bands of the picture share.
pub struct HemicubeScene {
    rig: Arc<Rig>,
    step: HemicubeStep,
    bands: Bands,
    /// Fragments of the picture until its only band is made; `None` when there are several.
    fragments: Mutex<Option<Fragments>>,
    /// Visible area of each facet, pixels.
    areas: Vec<f64>,
    surfaces: Surfaces,
    vertices: VertexBuffer,
    hierarchy: Hierarchy,
    /// Hierarchy for haze and gloss.
    bvh: Option<Bvh>,
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
    /// Share of the image of each element.
    visible_shares: Vec<f64>,
    element_receivers: Receivers,
    /// True when gloss or another band needs the light on the scene later.
    keeps_light: bool,
    /// For each light its light on the scene, once solved.
    bounced: Mutex<Vec<Option<Arc<BouncedLight>>>>,
    /// Approximate bytes held.
    held: usize,
}

/// G for one setup and step, in a band of the picture.
pub struct HemicubeRadiosity {
    scene: Arc<HemicubeScene>,
    width: usize,
    height: usize,
    /// `None` when the image shows nothing glossy.
    gloss: Option<Gloss>,
    gather_points: GatherPoints,
    fragments: Fragments,
    /// `None` when the image shows no round surface.
    rounding: Option<Rounding>,
    /// Reflectance of each fragment; empty when the scene has no textures.
    paints: Vec<[f32; 3]>,
    /// Gather points around each fragment, with their weights.
    gather_weights: Lists<(u32, f32)>,
    fragment_receivers: Receivers,
    /// Approximate bytes held.
    held: usize,
    solutions: Vec<Option<Solution>>,
}

impl HemicubeScene {
    /// Meshes a scene.
    ///
    /// # Errors
    /// [`TransportError`] for an unusable setup or too small a budget, and on cancel.
    pub fn new(
        setup: &Setup,
        step: HemicubeStep,
        work: Work<'_>,
    ) -> Result<HemicubeScene, TransportError> {
        let Setup { scene, rig, view } = setup;
        check_rig(scene, rig)?;
        let window = Window::new(view)?;
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

        let each = pixel_bytes(step, rig);
        let bands = Bands::new(window, each, BAND_BYTES);
        // The picture and its largest band.
        let rows = bands.rows.iter().map(Range::len).max().unwrap_or(0);
        let least = size_of::<[f32; 3]>() * window.pixels() + each * rows * window.width;
        budget.check("the picture", least)?;
        let left = budget.share(1, work);
        let mut kept = None;
        // The fragments of one band after another; those of a single one are kept.
        let mut each_band = |see: &mut dyn FnMut(&Fragments)| {
            for band in bands.apart() {
                let fragments = match kept.take() {
                    Some(fragments) => fragments,
                    None => seen(&surfaces, &band, step, left)?,
                };
                see(&fragments);
                kept = bands.is_whole().then_some(fragments);
            }
            Ok::<(), TransportError>(())
        };
        let layout = Layout::of_elements(&surfaces, step.elements);
        let finer = layout.quartered();
        let requests = |layout: &Layout| vec![CellRequest::WANTED; layout.cells()];
        let (mut requested, mut of_sources) = (requests(&layout), requests(&finer));
        let mut areas = vec![0.0; surfaces.facets.len()];
        each_band(&mut |fragments| {
            record_visible_points(&layout, fragments, &mut requested);
            record_visible_points(&finer, fragments, &mut of_sources);
            for f in fragments.all() {
                areas[f.facet] += f64::from(f.weight);
            }
        })?;
        // Each element and its four sources.
        budget.take("the mesh", 5 * layout.cells() * ELEMENT_BYTES)?;
        let seeds = seeds(setting, &lights, view.from);
        let mesh = layout.mesh(setting, &seeds, &requested, work)?;
        let sources = finer.mesh(setting, &seeds, &of_sources, work)?;
        let sources = Sources::new(sources, &mesh, &surfaces);
        let mut visible_shares = vec![0.0; mesh.elements.len()];
        each_band(&mut |fragments| add_visible(&mesh, fragments, &mut visible_shares))?;
        let all: f64 = areas.iter().sum();
        visible_shares
            .iter_mut()
            .for_each(|own| *own /= all.max(1.0));

        let keeps_light = !bands.is_whole() || surfaces.is_glossy();
        if keeps_light {
            let radiosity = size_of::<[f32; 3]>() * sources.mesh.elements.len() * lights.len();
            budget.take("reflected light of every source", radiosity)?;
        }
        let held_for_band = kept.as_ref().map_or(0, |f| size_of_val(f.all()));
        budget.take("the picture", held_for_band)?;
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
        Ok(HemicubeScene {
            rig: Arc::clone(rig),
            step,
            keeps_light,
            fragments: Mutex::new(kept),
            areas,
            bounces: Bounces::new(&rows, &reflectance),
            rows,
            reflectance,
            element_receivers: Receivers::new(&surfaces, &samples(&mesh)),
            projectors: rig.lights.iter().map(projector).collect(),
            held: budget.held - held_for_band,
            bounced: Mutex::new(vec![None; lights.len()]),
            bands,
            surfaces,
            vertices,
            hierarchy,
            bvh,
            lights,
            mesh,
            sources,
            seeds,
            visible_shares,
        })
    }

    /// The geometry with its hierarchy.
    fn setting(&self) -> SceneGeometry<'_> {
        SceneGeometry::new(&self.surfaces, &self.hierarchy)
    }
}

impl BandedScene for HemicubeScene {
    type Band = HemicubeRadiosity;

    fn bands(&self) -> &Bands {
        &self.bands
    }

    fn bytes(&self) -> usize {
        self.held
    }

    fn band(
        self: Arc<Self>,
        window: Window,
        work: Work<'_>,
    ) -> Result<HemicubeRadiosity, TransportError> {
        let (surfaces, step, setting) = (&self.surfaces, self.step, self.setting());
        let lights = self.rig.lights.len();
        let mut budget = MemoryBudget::new(work);
        let kept = self.fragments.lock().ok().and_then(|mut kept| kept.take());
        let fragments = match kept {
            Some(fragments) => fragments,
            None => seen(surfaces, &window, step, work)?,
        };
        let every = fragments.all().len() * fragment_bytes(lights);
        budget.take("direct light at every fragment", every)?;
        let rounding = Rounding::new(surfaces, &fragments);
        budget.take(
            "round surfaces",
            rounding.as_ref().map_or(0, Rounding::bytes),
        )?;
        let gloss = match self.bvh.as_ref().filter(|_| surfaces.is_glossy()) {
            Some(bvh) => {
                let seen = EyeScene {
                    scene: RayScene::new(surfaces, bvh),
                    fragments: &fragments,
                };
                let size = (window.width, step.lobe_rays);
                Gloss::new(seen, &self.sources.mesh, size, budget.share(1, work))?
            }
            None => None,
        };
        budget.take("reflections", gloss.as_ref().map_or(0, Gloss::bytes))?;
        let gather_scene = GatherScene {
            setting,
            vertices: &self.vertices,
            to: &self.sources.mesh,
        };
        let gather_points = GatherPoints::new(
            gather_scene,
            (&self.seeds, &self.areas),
            (&fragments, rounding.as_ref()),
            step,
            budget.share(1, work),
        )?;
        budget.take("gather points", gather_points.bytes())?;
        let count = gather_points.mesh.elements.len();
        let reflected = size_of::<[f32; 3]>() * count * lights;
        budget.take("reflected light at every gather point", reflected)?;
        work.check()?;
        let gather_weights = weights(&gather_points.mesh, &fragments, rounding.as_ref(), work)?;
        work.check()?;
        Ok(HemicubeRadiosity {
            width: window.width,
            height: window.height,
            fragment_receivers: Receivers::of_fragments(surfaces, &fragments),
            paints: compose::paints(surfaces, &fragments),
            solutions: self.rig.lights.iter().map(|_| None).collect(),
            held: budget.held,
            scene: self,
            gloss,
            gather_points,
            fragments,
            rounding,
            gather_weights,
        })
    }
}

impl UnitLights for HemicubeRadiosity {
    fn bytes(&self) -> usize {
        self.held
    }

    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError> {
        self.solve_lights(wanted, work)
    }

    fn picture(&self, strengths: &[[f64; 3]]) -> Image {
        self.compose(strengths)
    }
}

/// Approximate bytes of a fragment for this many lights.
fn fragment_bytes(lights: usize) -> usize {
    size_of::<Fragment>() + FRAGMENT_BYTES + size_of::<f32>() * lights
}

/// Approximate bytes of a pixel that shows one facet, for all lights of a rig.
fn pixel_bytes(step: HemicubeStep, rig: &Rig) -> usize {
    let fragments = step.sampling.split.parts().pow(2);
    fragments * fragment_bytes(rig.lights.len())
}

/// The fragments of a window, if they fit into the memory left.
fn seen(
    surfaces: &Surfaces,
    window: &Window,
    step: HemicubeStep,
    work: Work<'_>,
) -> Result<Fragments, TransportError> {
    // Parts of the window are computed separately and then copied together.
    let parts = window.pixels().saturating_mul(2 * size_of::<Fragment>());
    check_memory("the picture", parts, work.memory)?;
    Ok(fragments(surfaces, window, step.sampling, work)?)
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

/// Adds the pixels that show each element.
fn add_visible(mesh: &Mesh, fragments: &Fragments, pixels: &mut [f64]) {
    for f in fragments.all() {
        // A facet that reflects nothing has no element.
        if let Some(own) = pixels.get_mut(mesh.at(f.facet, f.point) as usize) {
            *own += f64::from(f.weight);
        }
    }
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
