//! Files of luminaires, read once and looked up by path.

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
    /// Distributions of measured luminaires.
    pub photometric: BTreeMap<String, Arc<Distribution>>,
    /// Images of projectors.
    pub slides: BTreeMap<String, Arc<Gobo>>,
    /// By path, a note on parts of a photometric file that are not used.
    pub notes: BTreeMap<String, String>,
}

impl LuminaireAssets {
    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        let photometric = self.photometric.values().map(|d| d.bytes());
        let slides = self.slides.values().map(|s| s.bytes());
        photometric.chain(slides).sum()
    }
}
