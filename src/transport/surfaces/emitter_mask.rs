//! Pixels that show a light itself.

use crate::surfaces::camera::Window;
use crate::surfaces::fragment::{Sampling, Split, fragments};
use crate::surfaces::surface::Surfaces;
use crate::threads::Threads;
use crate::{Setup, TransportError};
use footlight_host::work::Work;
use footlight_stage::Light;

/// For each pixel of the setup's view, row by row, true when any part of it shows the front of a
/// surface that emits light of the rig.
///
/// # Errors
/// [`TransportError`] for an unusable scene or view, and on cancel.
pub fn emitters(setup: &Setup, work: Work<'_>) -> Result<Vec<bool>, TransportError> {
    let Setup { scene, rig, view } = setup;
    let surfaces = Surfaces::shapes(scene)?;
    let sampling = Sampling::new(Split::Whole, Split::Whole, Split::Whole);
    let window = Window::new(view)?;
    let seen = Threads::new(work)?.install(|| fragments(&surfaces, &window, sampling, work))?;
    let emits = |material: usize| {
        let of = |l: &Light| matches!(l, Light::Panel { material: m, .. } if *m == material);
        rig.lights.iter().any(of)
    };
    let lit: Vec<bool> = surfaces.facets.iter().map(|f| emits(f.material)).collect();
    let shows_lit = |pixel| {
        let mut shown = seen.pixels.get(pixel).iter();
        shown.any(|f| lit.get(f.facet) == Some(&true))
    };
    Ok((0..seen.pixels.count()).map(shows_lit).collect())
}
