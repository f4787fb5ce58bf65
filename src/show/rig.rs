//! From the lights of the text to those of the operator G: materials, files and amounts resolved.

use super::hung;
use super::{Light, LightKind, NodeId, Output, RigError, Strength};
use crate::scene::fitting::Fittings;
use crate::scene::mount::Mount;
use crate::scene::{self, Measured, Projection, Scene};
use crate::units::Rgb;

/// What G takes for one light: one light, or three for a coloured image.
pub(super) fn resolve(
    light: &Light,
    scene: &Scene,
    images: &scene::Images,
    fittings: &Fittings,
) -> Result<Vec<scene::Light>, RigError> {
    match &light.kind {
        LightKind::Image(file) => {
            let read = images.get(file).cloned().map(scene::Light::Image);
            let missing = || RigError::NoImage {
                id: light.id,
                path: file.path.clone(),
            };
            Ok(vec![read.ok_or_else(missing)?])
        }
        LightKind::Spot(spot) => Ok(vec![scene::Light::Spot(spot.clone())]),
        LightKind::Hung(hung) => {
            hung::spot(light.id, hung, &fittings.lamps).map(|s| vec![scene::Light::Spot(s)])
        }
        LightKind::Panel { material, strength } => {
            panel(light.id, material, *strength, scene).map(|panel| vec![panel])
        }
        LightKind::Shape { shape, strength } => {
            let name = shape_material(&light.name);
            let material = scene.materials.iter().rposition(|m| m.name == name);
            let radiance = strength.radiance(shape.area(), shape.shown());
            let missing = || RigError::NoMaterial {
                id: light.id,
                material: name.clone(),
            };
            Ok(vec![scene::Light::Panel {
                material: material.ok_or_else(missing)?,
                radiance: radiance.unwrap_or_default(),
            }])
        }
        LightKind::Photometric {
            path,
            mount,
            tint,
            output,
        } => measured(light.id, path, *mount, *tint, *output, fittings).map(|m| vec![m]),
        LightKind::Projection {
            path,
            mount,
            field,
            tint,
            output,
        } => {
            let slide = fittings.slides.get(path);
            let slide = slide.ok_or_else(|| unread(light.id, path))?;
            let candela = match output {
                Output::Flux(lumens) => lumens / Projection::flux(slide, *field),
                Output::Peak(candela) => *candela,
                Output::Own => 0.0,
            };
            let plane = |plane: usize, intensity: Rgb| {
                scene::Light::Projection(Projection {
                    mount: *mount,
                    field: *field,
                    slide: slide.clone(),
                    plane,
                    intensity,
                })
            };
            let whole = tint.scaled(candela);
            if slide.is_grey() {
                return Ok(vec![plane(0, whole)]);
            }
            let primaries = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let planes = primaries.into_iter().enumerate();
            Ok(planes
                .map(|(c, primary)| plane(c, whole.filtered(Rgb(primary))))
                .collect())
        }
    }
}

fn unread(id: NodeId, path: &str) -> RigError {
    let path = path.to_owned();
    RigError::Unread { id, path }
}

fn measured(
    id: NodeId,
    path: &str,
    mount: Mount,
    tint: Rgb,
    output: Output,
    fittings: &Fittings,
) -> Result<scene::Light, RigError> {
    let distribution = fittings.photometric.get(path);
    let distribution = distribution.ok_or_else(|| unread(id, path))?;
    let factor = match output {
        Output::Own => 1.0,
        Output::Flux(lumens) => lumens / distribution.flux(),
        Output::Peak(candela) => candela / distribution.peak(),
    };
    Ok(scene::Light::Measured(Measured {
        mount,
        distribution: distribution.clone(),
        factor: tint.scaled(factor),
    }))
}

/// The material of a light's own shape; two words, which no material of a stage is.
pub(super) fn shape_material(light: &str) -> String {
    format!("light {light}")
}

fn panel(
    id: NodeId,
    material: &str,
    strength: Strength,
    scene: &Scene,
) -> Result<scene::Light, RigError> {
    let mut materials = scene.materials.iter().enumerate();
    let found = materials.find(|(_, m)| m.name == material);
    let name = || material.to_owned();
    let (index, found) = found.ok_or_else(|| RigError::NoMaterial {
        id,
        material: name(),
    })?;
    let area = scene.area(index);
    if area == 0.0 && matches!(strength, Strength::Flux(_) | Strength::Intensity(_)) {
        return Err(RigError::NoArea {
            id,
            material: name(),
        });
    }
    let radiance = strength.radiance(area, area).unwrap_or(found.emission);
    if radiance == Rgb::default() {
        return Err(RigError::Dark {
            id,
            material: name(),
        });
    }
    Ok(scene::Light::Panel {
        material: index,
        radiance,
    })
}
