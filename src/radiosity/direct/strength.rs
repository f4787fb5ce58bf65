//! How strong the lights of a rig are, and whether the rig can be used at all.

use crate::renderer::TransportError;
use crate::scene::{Light, Rig, Scene};

/// Refuses a rig whose parts do not fit together or whose numbers are not finite.
///
/// # Errors
/// [`TransportError::Scene`] that names the light or source.
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
