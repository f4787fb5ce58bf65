//! Files that luminaires are made of, as a rig needs them: read once, known by their paths.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Lamp;
use super::gobo::Gobo;
use super::photometric::Distribution;

/// Photometric files and slides by their paths in the show.
#[derive(Clone, Debug, Default)]
pub struct LuminaireAssets {
    /// Lights of the stage's files, which come with its geometry.
    pub lamps: Vec<Lamp>,
    /// What luminaires send into each direction.
    pub photometric: BTreeMap<String, Arc<Distribution>>,
    /// What projectors throw.
    pub slides: BTreeMap<String, Arc<Gobo>>,
    /// By path, what of a photometric file was not taken.
    pub notes: BTreeMap<String, String>,
}

impl LuminaireAssets {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let photometric = self.photometric.values().map(|d| d.bytes());
        let slides = self.slides.values().map(|s| s.bytes());
        photometric.chain(slides).sum()
    }
}
