//! Lights as the text says them.

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
    /// What it is.
    pub kind: LightKind,
    /// Its kind as the text names it: `spot`, `panel lamp_glass`.
    pub form: String,
    /// Its colour as the text writes it, `2700 K gel L201`; empty where the text has none.
    pub colour: String,
    /// How it moves; `None` where it stands still.
    pub head: Option<Head>,
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
    /// A sphere or a disc; its polygons join the scene.
    Shape {
        /// Its form and place.
        shape: Shape,
        /// How bright it is at full.
        strength: Strength,
    },
    /// A point source as a file next to the show has it measured.
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
    /// An image next to the show, thrown.
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
    /// A spot (see [`Spot`]).
    Spot(Spot),
    /// What a bank or the fixed lights add to the picture, rendered elsewhere.
    Image(ImageFile),
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

/// A light of the stage's file, and what the show says otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedLuminaire {
    /// Its name in the file.
    pub name: String,
    /// Where it hangs; without an `aim` it keeps its direction.
    pub position: Option<Vec3>,
    /// The point it is focused on.
    pub aim: Option<Vec3>,
    /// Full angle at half the peak, degrees.
    pub beam: Option<f64>,
    /// Full angle at a tenth of the peak, degrees.
    pub field: Option<f64>,
    /// Its white in place of the file's colour.
    pub white: Option<Rgb>,
    /// The colour before it.
    pub gel: Rgb,
    /// How bright it is at full.
    pub output: Output,
}

/// A point source with a round beam: half the peak intensity at half the beam angle from the
/// axis, a tenth at half the field angle, by the law of [`crate::geometry::profile`].
#[derive(Clone, Debug, PartialEq)]
pub struct Spot {
    /// Where it hangs.
    pub position: Vec3,
    /// The point it is focused on.
    pub aim: Vec3,
    /// Full angle at half the peak intensity, degrees.
    pub beam: f64,
    /// Full angle at a tenth of the peak intensity, degrees; more than `beam`.
    pub field: f64,
    /// Peak intensity at unit setting (cd).
    pub intensity: Rgb,
}

/// Where a picture stands: a file next to the show, and perhaps a layer of it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ImageFile {
    /// Relative to the show's folder.
    pub path: String,
    /// A layer of a multi-layer OpenEXR file.
    pub layer: Option<String>,
}
