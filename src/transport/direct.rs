//! Direct light: one number for each receiver and light, at unit radiance or intensity.
//!
//! Receivers are sorted facet by facet into trees of small flat clusters; one thread works on a
//! chunk of one facet. For every cluster, `panel` and `point_source` drop the emitters and
//! occluders that do not reach it. Where an error is allowed, a cluster is interpolated
//! (`irradiance_patch`). Invariant: results depend on the points alone, not on threads, batches or
//! settings. This module does not depend on colour.

#![allow(
    clippy::indexing_slicing,
    reason = "facets and pieces are named by the surfaces, receivers by their clusters"
)]

pub mod beam;
pub mod cluster;
mod irradiance_patch;
pub(crate) mod lambert;
mod near_field;
mod panel;
mod point_source;
pub(crate) mod projector;
mod quadratic_fit;
mod shadow;

use crate::TransportError;
use crate::contract::check_memory;
use crate::direct::beam::Beam;
use crate::direct::cluster::Receivers;
use crate::direct::irradiance_patch::IrradiancePatch;
use crate::direct::near_field::Picture;
use crate::direct::panel::Panel;
use crate::direct::point_source::PointSourceIntegrator;
use crate::surfaces::facet::Piece;
use crate::surfaces::fragment::Fragments;
use crate::surfaces::hierarchy::SceneGeometry;
use crate::surfaces::surface::Surfaces;
use footlight_host::work::Work;
use footlight_show::geometry::Vec3;
use footlight_stage::{Light, Rig, Scene};
use rayon::prelude::*;

/// A light, prepared for direct illumination.
#[derive(Clone, Debug)]
pub enum PreparedLight {
    /// Indices of the emitting pieces.
    Panel(Vec<usize>),
    /// A point source; for a projection, its uniform light without the image.
    Spot(Beam),
}

impl PreparedLight {
    /// Transmittance of the haze between the light and a point; for a panel an estimate from the
    /// centres of its pieces.
    fn clearness(&self, surfaces: &Surfaces, point: Vec3) -> f64 {
        if surfaces.haze.is_none() {
            return 1.0;
        }
        let clear = |from: Vec3| surfaces.clearness((from - point).length());
        match self {
            PreparedLight::Spot(beam) => clear(beam.position),
            PreparedLight::Panel(pieces) => {
                let (mut sum, mut weight) = (0.0, 0.0);
                for &piece in pieces {
                    let corners = &surfaces.pieces[piece].vertices;
                    let all = corners.iter().fold(Vec3::ZERO, |sum, v| sum + *v);
                    let middle = all / corners.len() as f64;
                    // Nearer pieces contribute more.
                    let near = 1.0 / (middle - point).dot(middle - point).max(1e-6);
                    sum += near * clear(middle);
                    weight += near;
                }
                if weight > 0.0 { sum / weight } else { 1.0 }
            }
        }
    }
}

/// Checks that the parts of a rig are consistent and its numbers finite.
///
/// # Errors
/// [`TransportError::Scene`], which names the light or source.
pub fn check_rig(scene: &Scene, rig: &Rig) -> Result<(), TransportError> {
    for (i, light) in rig.lights.iter().enumerate() {
        let known =
            !matches!(light, Light::Panel { material, .. } if *material >= scene.materials.len());
        if !known || !light.strength().0.iter().all(|c| c.is_finite()) {
            return Err(TransportError::Scene(format!(
                "light {i} has an unknown material or a strength that is not finite"
            )));
        }
    }
    for source in &rig.sources {
        for emitter in &source.emitters {
            if emitter.light >= rig.lights.len() || !emitter.filter.0.iter().all(|c| c.is_finite())
            {
                return Err(TransportError::Scene(format!(
                    "source {} has an unknown light or a filter that is not finite",
                    source.name
                )));
            }
        }
    }
    Ok(())
}

/// Prepares the rig's lights.
///
/// # Errors
/// [`TransportError::Scene`] for a spot with impossible angles or aim, and for a bank
/// given as an image, which [`crate::layered`] adds.
pub fn luminaires(surfaces: &Surfaces, rig: &Rig) -> Result<Vec<PreparedLight>, TransportError> {
    rig.lights
        .iter()
        .enumerate()
        .map(|(i, light)| match light {
            Light::Panel { material, .. } => {
                let lit = |p: &Piece| surfaces.facets[p.facet].material == *material;
                let pieces = (0..surfaces.pieces.len()).filter(|&p| lit(&surfaces.pieces[p]));
                Ok(PreparedLight::Panel(pieces.collect()))
            }
            Light::Image(_) => Err(TransportError::Scene(format!(
                "light {i} is an image: it cannot shine on the stage"
            ))),
            _ => Beam::of(light)
                .map(PreparedLight::Spot)
                .ok_or_else(|| match light {
                    Light::Spot(_) => TransportError::Scene(format!(
                        "light {i}: a spot needs 0 < beam < field <= 360 degrees and an aim"
                    )),
                    _ => bad_mount(i),
                }),
        })
        .collect()
}

fn bad_mount(light: usize) -> TransportError {
    let needs = "needs a place, another one to aim at, and an angle below 180 degrees";
    TransportError::Scene(format!("light {light} {needs}"))
}

/// Precision of direct light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradiancePrecision {
    /// Allowed error of reflectance times interpolated irradiance, measured at the samples; 0
    /// evaluates every receiver.
    pub allowed: f64,
    /// Distance within which a panel's light is averaged over a pixel instead of evaluated at its
    /// centre, relative to the distance at which the two begin to differ.
    pub near: f64,
}

impl IrradiancePrecision {
    /// Exact everywhere.
    pub const EXACT: IrradiancePrecision = IrradiancePrecision {
        allowed: 0.0,
        near: 1.0,
    };
}

/// Irradiance at every receiver, in the given order, per unit radiance or peak intensity of one
/// light. If the receivers are fragments, a spot's irradiance is the mean over each outline, and so
/// is a panel's where it is near ([`IrradiancePrecision::near`]); otherwise the irradiance at the
/// point.
///
/// # Errors
/// On cancel; [`TransportError::Memory`] when the occluders of a panel fill half of the memory.
pub fn irradiance(
    setting: SceneGeometry<'_>,
    light: &PreparedLight,
    receivers: &Receivers,
    fragments: Option<&Fragments>,
    IrradiancePrecision { allowed, near }: IrradiancePrecision,
    work: Work<'_>,
) -> Result<Vec<f32>, TransportError> {
    let of_thread = work.memory / 2 / work.threads.max(1);
    let parts: Result<Vec<Vec<f32>>, TransportError> = receivers
        .chunks
        .par_iter()
        .map(|(facet, cluster)| {
            work.check()?;
            let own = &setting.surfaces.facets[*facet];
            // A highlight multiplies the error.
            let reflectance = match setting.surfaces.lobe(*facet as u32) {
                Some(_) => 1.0,
                None => own.highest_reflectance(),
            };
            let allowed = if reflectance > 0.0 {
                allowed / reflectance
            } else {
                f64::INFINITY
            };
            let mut patch = IrradiancePatch::new(&receivers.points, cluster, own.normal, allowed);
            match light {
                PreparedLight::Panel(pieces) => {
                    let picture =
                        fragments.map(|f| Picture::new(receivers, f, own.normal, cluster));
                    let mut panel = Panel::new(setting, own.normal, *facet, (near, of_thread));
                    let fits = panel.shine(pieces, picture.as_ref(), cluster, &mut patch);
                    let needed = if fits {
                        0
                    } else {
                        work.memory.saturating_mul(2)
                    };
                    check_memory("what shades a light of many faces", needed, work.memory)?;
                }
                PreparedLight::Spot(beam) => {
                    let mut source = PointSourceIntegrator::new(setting, beam, own.normal);
                    source.shine(receivers, fragments, cluster, &mut patch);
                }
            }
            Ok(patch.sums.iter().map(|s| *s as f32).collect())
        })
        .collect();
    let mut out = vec![0.0; receivers.points.len()];
    let places = receivers.origin.iter().zip(&receivers.points);
    for (value, (&at, point)) in parts?.iter().flatten().zip(places) {
        out[at] = *value * light.clearness(setting.surfaces, *point) as f32;
    }
    Ok(out)
}
