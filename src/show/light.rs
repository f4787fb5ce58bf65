//! Lights: what the text says each one is, and what the operator G takes for it.

use super::imported_luminaire::{self, ImportedLuminaire};
use super::{NodeId, RigError};
use crate::geometry::Vec3;
use crate::scene::luminaire_asset::LuminaireAssets;
use crate::scene::mount::Mount;
use crate::scene::shape::Shape;
use crate::scene::{self, Measured, Projection, Scene};
use crate::units::Rgb;

/// A named luminaire.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: LightKind,
}

/// What a luminaire is.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// A material of the stage emits.
    Panel {
        /// The material's name.
        material: String,
        /// How bright it is at full; `None` as the material itself says.
        strength: Option<Strength>,
    },
    /// A sphere or a disc; [`Show::add_light_geometry`] puts it into the scene.
    Shape {
        /// Its form and place.
        shape: Shape,
        /// How bright it is at full.
        strength: Strength,
    },
    /// A point source as a file next to the show has it measured (see [`scene::Measured`]).
    Photometric {
        /// The file.
        path: String,
        /// How it hangs.
        mount: Mount,
        /// Its colour.
        tint: Rgb,
        /// How bright it is at full.
        output: Output,
    },
    /// An image next to the show, thrown (see [`scene::Projection`]).
    Projection {
        /// The file.
        path: String,
        /// How it hangs.
        mount: Mount,
        /// Full angle from the image's bottom to its top, degrees.
        field: f64,
        /// Its colour.
        tint: Rgb,
        /// How bright white is at full; never its own.
        output: Output,
    },
    /// A light of the stage's file.
    ImportedLuminaire(ImportedLuminaire),
    /// A spot (see [`scene::Spot`]).
    Spot(scene::Spot),
    /// What a bank or the fixed lights add to the picture, rendered elsewhere.
    Image(scene::ImageFile),
}

impl LightKind {
    /// Where it hangs, as far as the text says so; metres.
    pub fn place(&self) -> Option<Vec3> {
        match self {
            LightKind::Spot(spot) => Some(spot.position),
            LightKind::Photometric { mount, .. } | LightKind::Projection { mount, .. } => {
                Some(mount.position)
            }
            _ => None,
        }
    }
}

/// How bright a point source with a shape of beam of its own is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// As its file says.
    Own,
    /// Luminous flux (lm); of a projection, that of a white image.
    Flux(f64),
    /// Peak intensity (cd); of a projection, that of white.
    Peak(f64),
}

/// How bright a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Luminance L (cd/m2).
    Luminance(Rgb),
    /// Luminous flux of all the material's polygons (lm): L = flux / (pi area), as a Lambertian
    /// surface emits pi L into its half space.
    Flux(Rgb),
    /// Intensity along the normal of all the material's polygons (cd): L = intensity / area. For
    /// polygons that face different ways it is the sum of what each has along its own normal; for
    /// a sphere it is what it has all around, L = intensity / (pi radius^2).
    Intensity(Rgb),
}

impl Strength {
    /// Radiance of a Lambertian surface of `area` square metres that shows `shown` square metres
    /// where its intensity is given.
    fn radiance(self, area: f64, shown: f64) -> Rgb {
        match self {
            Strength::Luminance(rgb) => rgb,
            Strength::Flux(rgb) => rgb.scaled(1.0 / (std::f64::consts::PI * area)),
            Strength::Intensity(rgb) => rgb.scaled(1.0 / shown),
        }
    }
}

impl Light {
    /// What G takes for it: one light, or three for a coloured image.
    pub(super) fn resolved(
        &self,
        scene: &Scene,
        images: &scene::Images,
        luminaires: &LuminaireAssets,
    ) -> Result<Vec<scene::Light>, RigError> {
        let one = match &self.kind {
            LightKind::Image(file) => {
                let read = images.get(file).cloned().map(scene::Light::Image);
                read.ok_or_else(|| RigError::NoImage {
                    id: self.id,
                    path: file.path.clone(),
                })?
            }
            LightKind::Spot(spot) => scene::Light::Spot(spot.clone()),
            LightKind::ImportedLuminaire(imported) => {
                let lamps = &luminaires.lamps;
                scene::Light::Spot(imported_luminaire::spot(self.id, imported, lamps)?)
            }
            LightKind::Panel { material, strength } => panel(self.id, material, *strength, scene)?,
            LightKind::Shape { shape, strength } => {
                let name = shape_material(&self.name);
                let material = scene.materials.iter().rposition(|m| m.name == name);
                let radiance = strength.radiance(shape.area(), shape.shown());
                let missing = || RigError::NoMaterial {
                    id: self.id,
                    material: name.clone(),
                };
                scene::Light::Panel {
                    material: material.ok_or_else(missing)?,
                    radiance,
                }
            }
            LightKind::Photometric {
                path,
                mount,
                tint,
                output,
            } => measured(self.id, path, *mount, *tint, *output, luminaires)?,
            LightKind::Projection {
                path,
                mount,
                field,
                tint,
                output,
            } => {
                let slide = luminaires.slides.get(path);
                let slide = slide.ok_or_else(|| unread(self.id, path))?;
                let candela = match output {
                    Output::Flux(lumens) => lumens / Projection::flux(slide, *field),
                    Output::Peak(candela) => *candela,
                    Output::Own => 0.0,
                };
                let plane = |plane: usize, intensity: Rgb| {
                    scene::Light::Projection(Projection {
                        mount: *mount,
                        field: *field,
                        gobo: slide.clone(),
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
                let lights = planes.map(|(c, primary)| plane(c, whole.filtered(Rgb(primary))));
                return Ok(lights.collect());
            }
        };
        Ok(vec![one])
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
    luminaires: &LuminaireAssets,
) -> Result<scene::Light, RigError> {
    let distribution = luminaires.photometric.get(path);
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
    strength: Option<Strength>,
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
    if area == 0.0 && matches!(strength, Some(Strength::Flux(_) | Strength::Intensity(_))) {
        return Err(RigError::NoArea {
            id,
            material: name(),
        });
    }
    let radiance = strength.map_or(found.emission, |s| s.radiance(area, area));
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
