//! Reads the photometric files and images to project that a show's lights name, each once.

use std::collections::BTreeMap;
use std::sync::Arc;

use footlight_show::diagnostic::Diagnostic;
use footlight_show::lang::SpanMap;
use footlight_show::model::{LightKind, NodeId, Show};
use footlight_stage::gobo::Gobo;
use footlight_stage::luminaire_asset::LuminaireAssets;
use footlight_stage::photometric::Distribution;

use super::Source;
use super::diagnostics;

/// Reads the luminaire files of `show`, in about `memory` bytes, reusing those of `old`. Also
/// returns warnings about contents that are not used.
///
/// # Errors
/// A diagnostic for every file that cannot be used, at the first light that names it.
pub(super) fn read(
    show: &Show,
    spans: &SpanMap,
    source: Source<'_>,
    old: Option<&LuminaireAssets>,
) -> Result<(LuminaireAssets, Vec<Diagnostic>), Vec<Diagnostic>> {
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
    let (mut out, mut warnings, mut errors) = (LuminaireAssets::default(), Vec::new(), Vec::new());
    let mut left = source.memory;
    let bytes = |path: &str| source.files.read(path).map_err(|e| e.to_string());
    for (path, id) in photometric {
        let known = old.and_then(|o| {
            let read = o.photometric.get(*path)?;
            Some((Arc::clone(read), o.notes.get(*path).cloned()))
        });
        let file = || {
            let read = Distribution::noted(&bytes(path)?);
            let (read, note) = read.map_err(|e| diagnostics::photometric_cause(path, &e))?;
            if read.bytes() > left {
                let reason = diagnostics::no_room(read.bytes(), left);
                return Err(diagnostics::slide_cause(path, &reason));
            }
            Ok((Arc::new(read), note))
        };
        match known.map_or_else(file, Ok) {
            Ok((read, note)) => {
                left = left.saturating_sub(read.bytes());
                out.photometric.insert((*path).to_owned(), read);
                if let Some(note) = note {
                    warnings.push(diagnostics::of_file_notes(
                        path,
                        *id,
                        std::slice::from_ref(&note),
                        spans,
                    ));
                    out.notes.insert((*path).to_owned(), note);
                }
            }
            Err(cause) => errors.push(diagnostics::of_photometric(&cause, *id, spans)),
        }
    }
    for (path, id) in slides {
        let known = old.and_then(|o| o.slides.get(*path)).cloned();
        let file = || {
            let read = Gobo::read(&bytes(path)?, left).map(Arc::new);
            read.map_err(|e| diagnostics::slide_cause(path, &e))
        };
        match known.map_or_else(file, Ok) {
            Ok(read) => {
                left = left.saturating_sub(read.bytes());
                out.slides.insert((*path).to_owned(), read);
            }
            Err(cause) => errors.push(diagnostics::of_slide(&cause, *id, spans)),
        }
    }
    if errors.is_empty() {
        Ok((out, warnings))
    } else {
        Err(errors)
    }
}
