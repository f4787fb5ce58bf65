//! From the lights of the text to those of the operator G: materials, files and amounts resolved.

use super::light::shape_material;
use super::{Coordinate, Fixed, LightKind, NodeId, Show};
use crate::scene::luminaire_asset::LuminaireAssets;
use crate::scene::shape::Shape;
use crate::scene::{self, Scene};
use crate::units::Rgb;

/// Why a show's lights do not fit its stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// A panel names a material that the stage does not have.
    #[error("the stage has no material `{material}`")]
    NoMaterial {
        /// The light's statement.
        id: NodeId,
        /// The name that was not found.
        material: String,
    },
    /// A panel's lumens or candela are to come from a material that no polygon has.
    #[error("no surface of the stage is of the material `{material}`")]
    NoArea {
        /// The light's statement.
        id: NodeId,
        /// The material's name.
        material: String,
    },
    /// A light's file is not among the fittings.
    #[error("the file `{path}` has not been read")]
    Unread {
        /// The light's statement.
        id: NodeId,
        /// The file.
        path: String,
    },
    /// A panel without a radiance of its own names a material that does not emit.
    #[error("the material `{material}` does not emit")]
    Dark {
        /// The light's statement.
        id: NodeId,
        /// The material's name.
        material: String,
    },
    /// The stage's files have no light of that name.
    #[error("the stage has no light `{name}`")]
    NoLamp {
        /// The light's statement.
        id: NodeId,
        /// The name that was not found.
        name: String,
        /// Those that are there.
        known: Vec<String>,
    },
    /// A light of the stage that has no place.
    #[error("`{name}` of the stage shines from infinitely far, which no light here does")]
    Distant {
        /// The light's statement.
        id: NodeId,
        /// Its name in the file.
        name: String,
    },
    /// A light of the stage with what the show says is no spot.
    #[error("`{name}` of the stage becomes no spot: {reason}")]
    NoSpot {
        /// The light's statement.
        id: NodeId,
        /// Its name in the file.
        name: String,
        /// Why.
        reason: String,
    },
    /// A bank's image was not read.
    #[error("the image `{path}` was not read")]
    NoImage {
        /// The bank's statement.
        id: NodeId,
        /// The file.
        path: String,
    },
}

impl Show {
    /// Puts the lights that have a shape of their own into `scene`, whose other materials and
    /// polygons come first.
    pub fn add_light_geometry(&self, scene: &mut Scene) {
        for (name, shape) in self.shapes() {
            scene.add_shape(shape_material(name), &shape);
        }
    }

    /// The lights with a shape of their own, by name.
    pub fn shapes(&self) -> impl Iterator<Item = (&str, Shape)> {
        self.lights.iter().filter_map(|light| match light.kind {
            LightKind::Shape { shape, .. } => Some((light.name.as_str(), shape)),
            _ => None,
        })
    }

    /// [`Show::rig_with`] for a show whose lights and banks need no files.
    ///
    /// # Errors
    /// Every light that does not fit.
    pub fn rig(&self, scene: &Scene) -> Result<scene::Rig, Vec<RigError>> {
        self.rig_with(scene, &scene::Images::new(), &LuminaireAssets::default())
    }

    /// The lights as the operator G takes them, one source for each coordinate; light names become
    /// indices, materials are looked up in `scene`, which has been furnished, pictures of banks in
    /// `images`, files of lights in `luminaires`.
    ///
    /// # Errors
    /// Every light that does not fit.
    pub fn rig_with(
        &self,
        scene: &Scene,
        images: &scene::Images,
        luminaires: &LuminaireAssets,
    ) -> Result<scene::Rig, Vec<RigError>> {
        let mut errors = Vec::new();
        let mut lights = Vec::new();
        // Where the lights of each statement start, and at last their number.
        let mut starts = vec![0];
        for light in &self.lights {
            match light.resolved(scene, images, luminaires) {
                Ok(resolved) => lights.extend(resolved),
                Err(error) => errors.push(error),
            }
            starts.push(lights.len());
        }
        if !errors.is_empty() {
            return Err(errors);
        }
        let sources = self
            .coordinates()
            .into_iter()
            .map(|coordinate| scene::Source {
                emitters: self.emitters(&coordinate, &starts),
                name: coordinate.name,
            })
            .collect();
        Ok(scene::Rig { lights, sources })
    }

    /// What the channels of all light are multiplied by, so that the preview's white is white.
    fn white(&self) -> Rgb {
        let kelvin = self.preview.white.and_then(Rgb::from_kelvin);
        kelvin.map_or(Rgb::WHITE, |kelvin| Rgb(kelvin.0.map(f64::recip)))
    }

    fn emitters(&self, coordinate: &Coordinate, starts: &[usize]) -> Vec<scene::Emitter> {
        let white = self.white();
        let emitter = |light: usize, filter: Rgb| {
            let (Rgb([r, g, b]), Rgb([red, green, blue])) = (filter, white);
            let filter = Rgb([r * red, g * green, b * blue]);
            let start = |i: usize| starts.get(i).copied().unwrap_or(0);
            let all = start(light)..start(light + 1);
            all.map(move |light| scene::Emitter { light, filter })
        };
        let Some(bank) = coordinate.bank.and_then(|b| self.banks.get(b)) else {
            let of = |f: &Fixed| {
                let filter = Rgb::WHITE.scaled(f.level);
                f.lights
                    .iter()
                    .flat_map(move |l| emitter(*l, filter))
                    .collect::<Vec<_>>()
            };
            return self.fixed.iter().flat_map(of).collect();
        };
        let filter = match coordinate.channel {
            None => Rgb::WHITE,
            Some(0) => Rgb([1.0, 0.0, 0.0]),
            Some(1) => Rgb([0.0, 1.0, 0.0]),
            Some(_) => Rgb([0.0, 0.0, 1.0]),
        };
        bank.lights
            .iter()
            .flat_map(|l| emitter(*l, filter))
            .collect()
    }
}
