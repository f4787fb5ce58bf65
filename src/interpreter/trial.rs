//! A show put on trial: every source rendered at all qualities that a pool deals with, and what
//! that takes.

use super::{Error, Interpreter, refine};
use crate::picture::Image;
use crate::plan::{Metric, PlanError};
use crate::pool::Pool;
use crate::study::Trial;
use crate::study::refinement::{Refinement, Seconds};
use crate::renderer::layered::Layered;
use crate::renderer::{Cost, Quality, Transport as _, TransportError};

/// Why there is nothing to try where refined pictures are of the coarse ones' own quality.
const ALIKE: &str = "coarse pictures are what refined ones would be: nothing changes by refining; a \
    higher `refined` in the show's `preview` does";

/// Why there is nothing to try where both coarse qualities are alike.
const FLAWLESS: &str = "the coarse pictures of both qualities are the same: nothing is wrong with \
    them as far as can be told, and nothing to refine";

/// The looks that previews are tried on are drawn by this.
const SEED: u64 = 0;

impl Interpreter {
    /// Renders every source alone at both coarse qualities and the refined one.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, or its operator has one quality only,
    /// so that there is nothing to try; [`TransportError::Memory`] where all these pictures do not
    /// fit; else what rendering says.
    pub fn trial(&self) -> Result<Trial, Error> {
        Ok(self.tried()?.0)
    }

    /// The true error of the sequence against refined pictures and seconds, by order and preview.
    ///
    /// # Errors
    /// As [`Interpreter::trial`]; [`Error::Usage`] where both coarse pictures of every source are
    /// the same, so that there is no error to refine.
    pub fn chart_plan(&self) -> Result<Refinement, Error> {
        let (trial, mut seconds) = self.tried()?;
        let said = |words: &'static str| {
            move |error| match error {
                PlanError::NoWeight => Error::Usage(words.to_owned()),
                other => other.into(),
            }
        };
        let weighting = trial.weighting(Metric::Error).map_err(said(FLAWLESS))?;
        trial.oracle().map_err(said(ALIKE))?;
        let order = trial.order(&weighting)?;
        (seconds.prepare, seconds.mixed) =
            self.one_by_one("mixed pictures", &order, &mut |_| ())?;
        self.foretell(&mut seconds)?;
        Ok(Refinement::new(self.origin(), &trial, &seconds, SEED)?)
    }

    /// The trial, and the real seconds of its pictures.
    fn tried(&self) -> Result<(Trial, Seconds), Error> {
        let [cheap, fine] = self.coarse_steps();
        let stage = self.stage.as_ref().ok_or_else(refine::no_stage)?;
        if cheap == fine {
            let why = "there is one quality only, so that nothing can be tried";
            return Err(Error::Usage(why.to_owned()));
        }
        let keys = self.keys().clone();
        let units = Pool::unit_settings(keys.coordinates());
        let pixels = stage.view.width.saturating_mul(stage.view.height);
        let needed = pixels.saturating_mul(12).saturating_mul(3 * units.len());
        if needed > self.host.memory {
            return Err(Error::Render(TransportError::Memory {
                what: "every source at three qualities",
                needed,
                budget: self.host.memory,
            }));
        }
        let mut seconds = Seconds::default();
        let mut coarse = Vec::new();
        for quality in [cheap, fine] {
            let (images, [prepare, render]) = self.banks_anew(&units, Quality(quality))?;
            seconds.coarse[1] += prepare + render;
            coarse.push(images);
        }
        let mut refined: Vec<Image> = Vec::new();
        let mut keep = |image| refined.push(image);
        (_, seconds.alone) = self.one_by_one("sources alone", &units, &mut keep)?;
        let [coarser, coarse] = coarse.as_slice() else {
            return Err(refine::no_stage());
        };
        let trial = Trial::new(keys, [coarser, coarse, &refined], self.host.threads);
        let trial =
            trial.ok_or_else(|| Error::Usage("the show has no source to try".to_owned()))?;
        Ok((trial, seconds))
    }

    /// Renders settings one by one at the refined quality, from nothing prepared: the seconds to
    /// prepare and those of each.
    fn one_by_one(
        &self,
        task: &str,
        settings: &[Vec<f64>],
        take: &mut dyn FnMut(Image),
    ) -> Result<(f64, Vec<f64>), Error> {
        let stage = self.stage.as_ref().ok_or_else(refine::no_stage)?;
        let (work, clock) = (self.host.work(), self.host.clock.as_ref());
        let begin = clock.seconds();
        let transport = self.host.transport.as_ref();
        let mut operator = stage.prepare(transport, self.refined_step(), work)?;
        let prepare = clock.seconds() - begin;
        let mut each = Vec::new();
        for (done, setting) in settings.iter().enumerate() {
            work.check()?;
            let begin = clock.seconds();
            let images = operator.render(std::slice::from_ref(setting), work)?;
            each.push(clock.seconds() - begin);
            images.into_iter().for_each(&mut *take);
            work.progress.report(task, done + 1, settings.len());
        }
        Ok((prepare, each))
    }

    /// What the operator predicts, at the pace of this machine now.
    fn foretell(&self, seconds: &mut Seconds) -> Result<(), Error> {
        let stage = self.stage.as_ref().ok_or_else(refine::no_stage)?;
        let transport = self.host.transport.as_ref();
        let clock = || self.host.clock.seconds();
        let pace = Layered::new(&stage.rig, transport).pace(&clock, self.host.work())?;
        let sources = stage.rig.sources.len() as f64;
        let of = |quality: Quality| {
            let cost = stage.cost(transport, quality);
            Cost {
                prepare: cost.prepare * pace,
                per_source: cost.per_source * pace,
                per_image: cost.per_image * pace,
                per_lone: cost.per_lone * pace,
            }
        };
        let all = |step: u8| of(Quality(step)).alone(sources);
        seconds.coarse[0] = self.coarse_steps().map(all).iter().sum();
        seconds.cost = of(self.refined_step());
        Ok(())
    }
}

#[cfg(test)]
#[path = "trial_test.rs"]
mod tests;
