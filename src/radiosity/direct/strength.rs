//! How strong the lights of a rig are, and whether the rig can be used at all.

use crate::renderer::TransportError;
use crate::scene::{Light, Rig, Scene};

/// Radiance of a panel, peak intensity of a spot or a projection; of a measured luminaire what
/// multiplies the candela of its file; 1 for an image, which has its own numbers.
pub fn colour(light: &Light) -> [f64; 3] {
    match light {
        Light::Panel { radiance, .. } => radiance.0,
        Light::Spot(spot) => spot.intensity.0,
        Light::Image(_) => [1.0; 3],
        Light::Measured(measured) => measured.factor.0,
        Light::Projection(projection) => projection.intensity.0,
    }
}

/// Refuses a rig whose parts do not fit together or whose numbers are not finite.
///
/// # Errors
/// [`TransportError::Scene`] that names the light or source.
pub fn check_rig(scene: &Scene, rig: &Rig) -> Result<(), TransportError> {
    for (i, light) in rig.lights.iter().enumerate() {
        let known =
            !matches!(light, Light::Panel { material, .. } if *material >= scene.materials.len());
        if !known || !colour(light).iter().all(|c| c.is_finite()) {
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
