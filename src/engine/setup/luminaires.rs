//! Reads the photometric files and images to project that a show's lights name, each once.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::diagnostic::Diagnostic;
use crate::files::Files;
use crate::lang::SpanMap;
use crate::scene::gobo::Gobo;
use crate::scene::luminaire_asset::LuminaireAssets;
use crate::scene::photometric::Distribution;
use crate::show::{LightKind, NodeId, Show};

use super::diagnostics;

/// The luminaire files of `show`; those that `old` has are taken from there.
///
/// # Errors
/// A diagnostic for every file that cannot be used, at the first light that names it.
pub(super) fn read(
    show: &Show,
    spans: &SpanMap,
    files: &dyn Files,
    old: Option<&LuminaireAssets>,
) -> Result<LuminaireAssets, Vec<Diagnostic>> {
    let mut wanted: [BTreeMap<&str, NodeId>; 2] = Default::default();
    let [photometric, slides] = &mut wanted;
    for light in &show.lights {
        match &light.kind {
            LightKind::Photometric { path, .. } => {
                photometric.entry(path.as_str()).or_insert(light.id);
            }
            LightKind::Projection { path, .. } => {
                slides.entry(path.as_str()).or_insert(light.id);
            }
            _ => {}
        }
    }
    let (mut out, mut errors) = (LuminaireAssets::default(), Vec::new());
    for (path, id) in photometric {
        let known = old.and_then(|o| o.photometric.get(*path)).cloned();
        let file = || {
            let bytes = files.read(path).map_err(|e| e.to_string())?;
            let read = Distribution::parse(&bytes).map(Arc::new);
            read.map_err(|e| diagnostics::photometric_cause(path, &e))
        };
        match known.map_or_else(file, Ok) {
            Ok(read) => drop(out.photometric.insert((*path).to_owned(), read)),
            Err(cause) => errors.push(diagnostics::of_photometric(&cause, *id, spans)),
        }
    }
    for (path, id) in slides {
        let known = old.and_then(|o| o.slides.get(*path)).cloned();
        let file = || {
            let bytes = files.read(path).map_err(|e| e.to_string())?;
            let read = Gobo::read(&bytes).map(Arc::new);
            read.map_err(|e| diagnostics::slide_cause(path, &e))
        };
        match known.map_or_else(file, Ok) {
            Ok(read) => drop(out.slides.insert((*path).to_owned(), read)),
            Err(cause) => errors.push(diagnostics::of_slide(&cause, *id, spans)),
        }
    }
    if errors.is_empty() {
        Ok(out)
    } else {
        Err(errors)
    }
}
