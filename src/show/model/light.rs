//! Lights of a show.

use crate::geometry::Vec3;
use crate::geometry::mount::Mount;
use crate::geometry::shape::Shape;
use crate::units::Rgb;

use super::{Head, NodeId};

/// A named luminaire.
#[derive(Clone, Debug, PartialEq)]
pub struct Luminaire {
    /// The statement.
    pub id: NodeId,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: LightKind,
    /// Its kind in the words of the text: `spot`, `panel lamp_glass`.
    pub form: String,
    /// Its colour in the words of the text, `2700 K gel L201`; empty if not given.
    pub colour: String,
    /// The filter of its gel, linear light in each channel; `None` for a light without one.
    pub gel: Option<Rgb>,
    /// Its moving head; `None` for a light that does not move.
    pub head: Option<Head>,
}

/// Kind of a luminaire.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// A material of the stage that emits.
    Panel {
        /// The material's name.
        material: String,
        /// Strength at full; `None` uses the material's.
        strength: Option<Strength>,
    },
    /// A sphere or a disc; its polygons join the scene.
    Shape {
        /// Its form and position.
        shape: Shape,
        /// Strength at full.
        strength: Strength,
    },
    /// A point source measured in a file next to the show.
    Photometric {
        /// The file.
        path: String,
        /// Its mount.
        mount: Mount,
        /// Its colour.
        tint: Rgb,
        /// Brightness at full.
        output: Output,
    },
    /// A projected image from a file next to the show.
    Projection {
        /// The file.
        path: String,
        /// Its mount.
        mount: Mount,
        /// Full angle from the image's bottom to its top, degrees.
        field: f64,
        /// Its colour.
        tint: Rgb,
        /// Brightness of white at full; never `Own`.
        output: Output,
    },
    /// A light of the stage's file.
    ImportedLuminaire(ImportedLuminaire),
    /// A spot (see [`Spot`]).
    Spot(Spot),
    /// The light of a bank or the fixed lights, rendered elsewhere.
    Image(ImageFile),
}

impl LightKind {
    /// Its position, as far as the text gives it; metres.
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

/// Brightness of a point source with its own distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// The brightness in its file.
    Own,
    /// Luminous flux (lm); for a projection, that of a white image.
    Flux(f64),
    /// Peak intensity (cd); for a projection, that of white.
    Peak(f64),
}

/// Brightness of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// Luminance L (cd/m2).
    Luminance(Rgb),
    /// Luminous flux of all the material's polygons (lm): L = flux / (pi area), because a
    /// Lambertian surface emits pi L into its half space.
    Flux(Rgb),
    /// Intensity along the normal, all the material's polygons together (cd): L = intensity / area.
    /// For polygons that face different ways it is the sum of the intensities along their own
    /// normals; for a sphere it is the intensity in every direction, L = intensity / (pi radius^2).
    Intensity(Rgb),
}

/// A light of the stage's file, with the show's changes.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedLuminaire {
    /// Its name in the file.
    pub name: String,
    /// Its position; without an `aim` it keeps its direction.
    pub position: Option<Vec3>,
    /// The point at which it is focused.
    pub aim: Option<Vec3>,
    /// Full angle at half the peak, degrees.
    pub beam: Option<f64>,
    /// Full angle at a tenth of the peak, degrees.
    pub field: Option<f64>,
    /// Its white in place of the file's colour.
    pub white: Option<Rgb>,
    /// The colour in front of it.
    pub gel: Rgb,
    /// Brightness at full.
    pub output: Output,
}

/// A point source with a round beam: half the peak intensity at half the beam angle from the axis,
/// a tenth at half the field angle (see [`crate::geometry::profile`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// Its position.
    pub position: Vec3,
    /// The point at which it is focused.
    pub aim: Vec3,
    /// Full angle at half the peak intensity, degrees.
    pub beam: f64,
    /// Full angle at a tenth of the peak intensity, degrees; more than `beam`.
    pub field: f64,
    /// Peak intensity at unit setting (cd).
    pub intensity: Rgb,
}

/// An image: a file next to the show, and perhaps a layer of it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ImageFile {
    /// Relative to the show's folder.
    pub path: String,
    /// A layer of a multi-layer OpenEXR file.
    pub layer: Option<String>,
}
