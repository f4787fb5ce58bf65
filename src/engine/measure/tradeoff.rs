//! Error against time over the operator's quality steps.

use std::path::Path;

use super::comparison::{alone_each, bank_names};
use super::quality::{Seconds, measured};
use super::{BankError, Origin, Reference, difference};
use crate::{Engine, Error};
use footlight_transport::Quality;
use footlight_transport::surfaces::emitter_mask;

/// The error of every quality step against its time.
#[derive(Clone, Debug, PartialEq)]
pub struct Tradeoff {
    /// The show and the machine.
    pub origin: Origin,
    /// The reference.
    pub against: Against,
    /// True when pixels next to an emitter are left out of the errors.
    pub without_emitters: bool,
    /// The show's own coarse step.
    pub coarse: u8,
    /// The show's own refined step.
    pub refined: u8,
    /// In order of quality.
    pub steps: Vec<Measured>,
}

/// The ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Reference images.
    References {
        /// True when each comes as two halves, so that noise does not count.
        noise_free: bool,
    },
    /// The operator's own images at this step.
    Quality(u8),
}

/// Time and error of a quality step.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The step.
    pub quality: u8,
    /// Seconds to prepare.
    pub prepare: f64,
    /// Seconds to render all banks.
    pub render: f64,
    /// Relative error of each bank; `None` if unknown.
    pub banks: Vec<(String, Option<f64>)>,
}

impl Measured {
    /// Seconds to prepare and to render all banks.
    pub fn seconds(&self) -> f64 {
        self.prepare + self.render
    }

    /// The mean over banks with a known error; `None` without any.
    pub fn mean(&self) -> Option<f64> {
        let (count, sum) = (self.known()).fold((0_usize, 0.0), |(n, s), (_, e)| (n + 1, s + e));
        (count > 0).then(|| sum / count as f64)
    }

    /// The bank with the largest error; `None` when no bank has an error.
    pub fn worst(&self) -> Option<(&str, f64)> {
        let off = self.known().filter(|(_, error)| *error > 0.0);
        off.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn known(&self) -> impl Iterator<Item = (&str, f64)> {
        let banks = self.banks.iter();
        banks.filter_map(|(name, error)| error.map(|e| (name.as_str(), e)))
    }
}

impl Tradeoff {
    /// For each step, true when no other has both a smaller mean error and a shorter time.
    pub fn front(&self) -> Vec<bool> {
        let points = self.steps.iter().map(|s| (s.seconds(), s.mean()));
        pareto(&points.collect::<Vec<_>>())
    }
}

/// For each point (time, error), true when no other one beats it in both.
pub fn pareto(points: &[(f64, Option<f64>)]) -> Vec<bool> {
    let beaten = |time: f64, error: f64| {
        points
            .iter()
            .any(|(t, e)| e.is_some_and(|e| *t <= time && e <= error && (*t < time || e < error)))
    };
    let on = |&(time, error): &(f64, Option<f64>)| error.is_some_and(|e| !beaten(time, e));
    points.iter().map(on).collect()
}

/// Measures error against time over the quality steps, for every bank alone: against the images in
/// `folder`, or against the finest step. Pixels next to an emitter are left out if others are
/// visible.
///
/// # Errors
/// As [`compare`](super::comparison::compare).
pub fn measure(engine: &Engine, folder: Option<&Path>) -> Result<Tradeoff, Error> {
    let names = bank_names(engine)?;
    let settings = alone_each(engine, &names)?;
    let estimate = engine.estimate();
    let rendering = estimate.rendering()?;
    let work = engine.work();
    let finest = rendering.finest(engine.host.renderer.as_ref()).0;
    let size = (rendering.setup.view.width, rendering.setup.view.height);
    let near = emitter_mask::emitters(&rendering.setup, work)?;
    let counted = difference::away_from(&near, size.0, 1);
    let report = |done: u8| {
        let (done, total) = (usize::from(done), usize::from(finest));
        engine.host.progress.report("measuring steps", done, total);
    };
    report(0);
    let mut last = None;
    let references = match folder {
        Some(folder) => {
            let store = engine.host.store.as_ref();
            Reference::load(store, folder, &names, size, work.memory)?
        }
        None => {
            let (images, seconds) = measured(engine, &settings, Quality(finest), 0)?;
            last = Some(seconds);
            images.into_iter().map(Reference::of).collect()
        }
    };
    let step_of = |quality, seconds: Seconds, errors: Vec<Option<f64>>| Measured {
        quality,
        prepare: seconds.prepare,
        render: seconds.banks,
        banks: names.iter().cloned().zip(errors).collect(),
    };
    let held = references.iter().map(Reference::bytes).sum();
    let mut steps = Vec::new();
    for quality in 1..=finest {
        if let Some(seconds) = last.filter(|_| quality == finest) {
            steps.push(step_of(quality, seconds, vec![Some(0.0); names.len()]));
            continue;
        }
        let (images, seconds) = measured(engine, &settings, Quality(quality), held)?;
        let pairs = names.iter().zip(images.iter().zip(&references));
        let errors = pairs.map(|(n, (i, r))| BankError::new(n, i, r, &counted).judged());
        steps.push(step_of(quality, seconds, errors.collect()));
        report(quality);
    }
    // When only lamps are visible, they count.
    let left_out = near.contains(&true) && counted.contains(&true);
    let noise_free = references.iter().all(|r| r.halves.is_some());
    Ok(Tradeoff {
        origin: Origin::of(engine),
        against: match folder {
            Some(_) => Against::References { noise_free },
            None => Against::Quality(finest),
        },
        without_emitters: left_out,
        coarse: estimate.coarse_steps()[1].0,
        refined: estimate.refined_step().0,
        steps,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (1.0, Some(4.0)),
            (2.0, Some(5.0)),
            (3.0, Some(1.0)),
            (4.0, None),
        ];
        assert_eq!(pareto(&points), [true, false, true, false]);
        // Equal points do not beat each other.
        assert_eq!(pareto(&[(1.0, Some(1.0)), (1.0, Some(1.0))]), [true, true]);
    }
}
