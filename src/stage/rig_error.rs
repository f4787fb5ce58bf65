//! Errors of lights that do not fit the stage.

use footlight_show::model::NodeId;

/// Reason why a light does not fit the stage.
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
    /// A panel's lumens or candela need the area of a material without polygons.
    #[error("no surface of the stage is of the material `{material}`")]
    NoArea {
        /// The light's statement.
        id: NodeId,
        /// The material's name.
        material: String,
    },
    /// A light's file was not read.
    #[error("the file `{path}` has not been read")]
    Unread {
        /// The light's statement.
        id: NodeId,
        /// The file.
        path: String,
    },
    /// A panel without strength names a material that does not emit.
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
        /// Names of the lights in the files.
        known: Vec<String>,
    },
    /// A light of the stage without a position.
    #[error("`{name}` of the stage shines from infinitely far, which no light here does")]
    Distant {
        /// The light's statement.
        id: NodeId,
        /// Its name in the file.
        name: String,
    },
    /// A light of the stage, with the show's changes, is no valid spot.
    #[error("`{name}` of the stage becomes no spot: {reason}")]
    NoSpot {
        /// The light's statement.
        id: NodeId,
        /// Its name in the file.
        name: String,
        /// The reason.
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
