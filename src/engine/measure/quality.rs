//! What each step of quality sets, costs and leaves.

use std::path::Path;

use crate::engine::{Engine, Error};
use crate::picture::Image;
use crate::radiosity::emitter_mask;
use crate::renderer::{Quality, Transport as _};
use crate::study::forecast::{Forecast, Seconds, Step};
use crate::study::tradeoff::{Against, Measured, Tradeoff};
use crate::study::{BankError, Machine, Origin, Reference, difference};

/// A step is measured again while all its runs took less than this, seconds; the shortest counts.
const ENOUGH: f64 = 0.5;
/// But not more often than this.
const RUNS: usize = 3;

impl Engine {
    /// The show and the machine that a result is of.
    pub(crate) fn origin(&self) -> Origin {
        Origin {
            subject: self.show().title.clone(),
            machine: self.machine(),
        }
    }

    pub(crate) fn machine(&self) -> Machine {
        Machine::here(self.host.threads, self.host.processor.clone())
    }

    /// What each step of quality sets for this show and what it will cost; also what it does cost,
    /// when `measure`d.
    ///
    /// # Errors
    /// [`Error::NoSetup`], [`Error::NoBanks`], else what rendering says.
    pub fn measure_quality(&self, measure: bool) -> Result<Forecast, Error> {
        let settings = self.alone_each(&self.bank_names()?)?;
        // Three for an rgb bank; the fixed lights are a source that no bank lights.
        let sources = together(&settings).iter().filter(|s| **s != 0.0).count() as f64;
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let operator = rendering.layered(self.host.renderer.as_ref());
        let pace = self.measure_pace()?;
        let mut out = Forecast {
            show: self.show().title.clone(),
            operator: operator.name().to_owned(),
            machine: self.machine(),
            pace,
            steps: Vec::new(),
        };
        for quality in 1..=operator.finest().0 {
            let step = Quality(quality);
            let sets = operator.quality_parameters(&rendering.setup, step)?;
            let cost = operator.cost(&rendering.setup, step);
            let predicted = Seconds {
                prepare: cost.prepare * pace,
                banks: (cost.per_source * sources + cost.per_lone * settings.len() as f64) * pace,
                picture: cost.per_image * pace,
            };
            out.steps.push(Step {
                quality,
                sets,
                predicted,
                measured: None,
            });
        }
        if measure {
            let total = out.steps.len();
            for (done, step) in out.steps.iter_mut().enumerate() {
                self.host.progress.report("measuring steps", done, total);
                step.measured = Some(self.measured(&settings, Quality(step.quality))?.1);
            }
        }
        Ok(out)
    }

    /// Pictures of settings at a quality, from nothing prepared, and the seconds of the fastest of
    /// a few runs.
    fn measured(
        &self,
        settings: &[Vec<f64>],
        quality: Quality,
    ) -> Result<(Vec<Image>, Seconds), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let (work, clock) = (self.host.work(), self.host.clock.as_ref());
        let renderer = self.host.renderer.as_ref();
        let mut best: Option<(Vec<Image>, Seconds)> = None;
        let mut spent = 0.0;
        for _ in 0..RUNS {
            let begin = clock.seconds();
            let mut operator = rendering.prepare(renderer, quality, work)?;
            let prepared = clock.seconds();
            let images = operator.render(settings, work)?;
            let done = clock.seconds();
            operator.render(&[together(settings)], work)?;
            let found = Seconds {
                prepare: prepared - begin,
                banks: done - prepared,
                picture: clock.seconds() - done,
            };
            spent += clock.seconds() - begin;
            if best.as_ref().is_none_or(|(_, b)| found.total() < b.total()) {
                best = Some((images, found));
            }
            if spent > ENOUGH {
                break;
            }
        }
        best.ok_or(Error::NoSetup)
    }

    /// Error against time over the scale of quality, every bank alone: against the pictures in
    /// `folder`, or against the finest step. Pixels beside an emitter are left out where others
    /// are seen.
    ///
    /// # Errors
    /// As [`Engine::compare`].
    pub fn measure_tradeoff(&self, folder: Option<&Path>) -> Result<Tradeoff, Error> {
        let names = self.bank_names()?;
        let settings = self.alone_each(&names)?;
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let work = self.host.work();
        let finest = rendering.finest(self.host.renderer.as_ref()).0;
        let size = (rendering.setup.view.width, rendering.setup.view.height);
        let near = emitter_mask::emitters(&rendering.setup, work)?;
        let counted = difference::away_from(&near, size.0);
        let report = |done: u8| {
            let (done, total) = (usize::from(done), usize::from(finest));
            self.host.progress.report("measuring steps", done, total);
        };
        report(0);
        let mut last = None;
        let references = match folder {
            Some(folder) => {
                let store = self.host.store.as_ref();
                Reference::load(store, folder, &names, size, work.memory)?
            }
            None => {
                let (images, seconds) = self.measured(&settings, Quality(finest))?;
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
        let mut steps = Vec::new();
        for quality in 1..=finest {
            if let Some(seconds) = last.filter(|_| quality == finest) {
                steps.push(step_of(quality, seconds, vec![Some(0.0); names.len()]));
                continue;
            }
            let (images, seconds) = self.measured(&settings, Quality(quality))?;
            let pairs = names.iter().zip(images.iter().zip(&references));
            let errors = pairs.map(|(n, (i, r))| BankError::new(n, i, r, &counted).judged());
            steps.push(step_of(quality, seconds, errors.collect()));
            report(quality);
        }
        // Where nothing but lamps is seen they are counted.
        let left_out = near.contains(&true) && counted.contains(&true);
        let noise_free = references.iter().all(|r| r.halves.is_some());
        Ok(Tradeoff {
            origin: self.origin(),
            against: match folder {
                Some(_) => Against::References { noise_free },
                None => Against::Quality(finest),
            },
            without_emitters: left_out,
            coarse: self.coarse_steps()[1].0,
            refined: self.refined_step().0,
            steps,
        })
    }
}

/// All of the settings at once.
fn together(settings: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = settings.first().map_or(0, Vec::len);
    let sum = |c: usize| settings.iter().filter_map(|s| s.get(c)).sum();
    (0..coordinates).map(sum).collect()
}
