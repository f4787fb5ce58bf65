//! Checks that every operator makes before it prepares or renders.

use super::{Quality, TransportError};
use footlight_picture::Image;

/// Checks that a quality is on the scale from 1 to `finest`.
///
/// # Errors
/// [`TransportError::Quality`] if not.
pub fn check_quality(quality: Quality, finest: Quality) -> Result<(), TransportError> {
    if (1..=finest.0).contains(&quality.0) {
        Ok(())
    } else {
        Err(TransportError::Quality(quality.0, finest.0))
    }
}

/// Checks that each setting has one finite number for each source of the rig.
///
/// # Errors
/// [`TransportError::Setting`] if not.
pub fn check_settings(settings: &[Vec<f64>], sources: usize) -> Result<(), TransportError> {
    let fits = |s: &Vec<f64>| s.len() == sources && s.iter().all(|x| x.is_finite());
    if settings.iter().all(fits) {
        Ok(())
    } else {
        Err(TransportError::Setting { expected: sources })
    }
}

/// Checks that an operator returned one image of the view's size for each setting.
///
/// # Errors
/// [`TransportError::Pictures`] if not.
pub fn check_pictures(
    pictures: &[Image],
    settings: usize,
    view: (usize, usize),
) -> Result<(), TransportError> {
    let sizes = pictures
        .iter()
        .map(|picture| (picture.width(), picture.height()));
    if pictures.len() == settings && sizes.clone().all(|size| size == view) {
        return Ok(());
    }
    Err(TransportError::Pictures {
        found: sizes.collect(),
        settings,
        view,
    })
}

/// Checks that `needed` bytes for `what` are within the budget, in bytes.
///
/// # Errors
/// [`TransportError::Memory`] if not.
pub fn check_memory(
    what: &'static str,
    needed: usize,
    budget: usize,
) -> Result<(), TransportError> {
    if needed <= budget {
        Ok(())
    } else {
        Err(TransportError::Memory {
            what,
            needed,
            budget,
        })
    }
}
