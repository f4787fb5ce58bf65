//! Common part of both methods: every light is solved once at unit strength, and images of settings
//! are composed from these.

#![allow(
    clippy::indexing_slicing,
    reason = "one entry for each light of the rig"
)]

use crate::contract::{check_memory, check_settings};
use crate::threads::Threads;
use crate::{Prepared, TransportError};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_stage::{Light, Rig};
use std::sync::Arc;

/// A method that stores its lights at unit strength.
pub trait UnitLights: Send {
    /// Bytes held.
    fn bytes(&self) -> usize;

    /// Pixels of an image.
    fn pixels(&self) -> usize;

    /// Solves the `wanted` lights that are not solved yet.
    ///
    /// # Errors
    /// [`TransportError`] for too small a budget, and on cancel.
    fn solve(&mut self, wanted: &[usize], work: Work<'_>) -> Result<(), TransportError>;

    /// Image of lights of given strengths, all of which are solved.
    fn picture(&self, strengths: &[[f64; 3]]) -> Image;
}

/// A method prepared for the settings of a rig.
pub struct Composed<M> {
    method: M,
    rig: Arc<Rig>,
    first_equal: Vec<usize>,
}

impl<M: UnitLights> Composed<M> {
    /// A method for the lights of a rig.
    pub fn new(method: M, rig: &Arc<Rig>) -> Composed<M> {
        Composed {
            method,
            rig: Arc::clone(rig),
            first_equal: first_equal(&rig.lights),
        }
    }
}

impl<M: UnitLights> Prepared for Composed<M> {
    fn render(
        &mut self,
        settings: &[Vec<f64>],
        work: Work<'_>,
    ) -> Result<Vec<Image>, TransportError> {
        check_settings(settings, self.rig.sources.len())?;
        let strengths = settings.iter();
        let strengths = strengths.map(|s| strengths_of(&self.rig, &self.first_equal, s));
        let strengths: Vec<Vec<[f64; 3]>> = strengths.collect();
        let is_lit = |l: &usize| strengths.iter().any(|s| s[*l].iter().any(|x| *x != 0.0));
        let wanted: Vec<usize> = (0..self.rig.lights.len()).filter(is_lit).collect();
        let method = &mut self.method;
        let work = work.holding(method.bytes());
        let needed = settings.len() * method.pixels() * size_of::<[f32; 3]>();
        check_memory("the pictures", needed, work.memory)?;
        Threads::new(work)?.install(|| {
            method.solve(&wanted, work)?;
            let mut images = Vec::with_capacity(settings.len());
            for (done, strengths) in strengths.iter().enumerate() {
                work.check()?;
                work.progress.report("pictures", done, settings.len());
                images.push(method.picture(strengths));
            }
            work.progress
                .report("pictures", settings.len(), settings.len());
            Ok(images)
        })
    }

    fn bytes(&self) -> usize {
        self.method.bytes()
    }
}

/// Strength of each light in each channel under a setting; the strength of equal lights is added to
/// the first of them.
pub fn strengths_of(rig: &Rig, first_equal: &[usize], setting: &[f64]) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; rig.lights.len()];
    for (source, s) in rig.sources.iter().zip(setting) {
        for emitter in &source.emitters {
            let colour = rig.lights[emitter.light].strength().0;
            let first = first_equal[emitter.light];
            for c in 0..3 {
                out[first][c] += s * emitter.filter.0[c] * colour[c];
            }
        }
    }
    out
}

/// For each light the first panel of the same material, or itself.
pub fn first_equal(lights: &[Light]) -> Vec<usize> {
    let material = |light: &Light| match light {
        Light::Panel { material, .. } => Some(*material),
        _ => None,
    };
    let first = |(i, light): (usize, &Light)| {
        let own = material(light);
        let is_equal = |other: &Light| own.is_some() && material(other) == own;
        lights.iter().position(is_equal).unwrap_or(i)
    };
    lights.iter().enumerate().map(first).collect()
}
