//! Every source rendered at all qualities that a pool deals with, and what that takes.

use crate::engine::{Engine, Error};
use crate::picture::Image;
use crate::plan::{Metric, PlanError};
use crate::pool::Pool;
use crate::renderer::contract::check_memory;
use crate::renderer::{Cost, Quality};
use crate::study::Trial;
use crate::study::refinement::{Refinement, Seconds};

impl Engine {
    /// Renders every source alone at both coarse qualities and the refined one.
    ///
    /// # Errors
    /// [`Error::NoSetup`]; [`Error::OneQuality`] where there is nothing to try;
    /// [`Error::Render`] where all these images do not fit; else what rendering says.
    pub fn trial(&self) -> Result<Trial, Error> {
        Ok(self.tried()?.0)
    }

    /// The true error of the sequence against refined pictures and seconds, by order.
    ///
    /// # Errors
    /// As [`Engine::trial`]; [`Error::AlikeCoarse`] and [`Error::AlikeRefined`] where there is no
    /// error to refine.
    pub fn measure_refinement(&self) -> Result<Refinement, Error> {
        let (trial, mut seconds) = self.tried()?;
        let weighting = trial.weighting(Metric::Error);
        let weighting = weighting.map_err(or_no_weight(Error::AlikeCoarse))?;
        trial.oracle().map_err(or_no_weight(Error::AlikeRefined))?;
        let order = trial.order(&weighting)?;
        (seconds.prepare, seconds.mixed) =
            self.one_by_one("mixed pictures", &order, &mut |_| ())?;
        self.predict(&mut seconds)?;
        Ok(Refinement::new(self.origin(), &trial, &seconds)?)
    }

    /// The trial, and the real seconds of its pictures.
    fn tried(&self) -> Result<(Trial, Seconds), Error> {
        let [cheap, fine] = self.coarse_steps();
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        if cheap == fine {
            return Err(Error::OneQuality);
        }
        let keys = self.document.keys().clone();
        let units = Pool::unit_settings(keys.coordinates());
        let pixels = rendering
            .setup
            .view
            .width
            .saturating_mul(rendering.setup.view.height);
        let needed = pixels.saturating_mul(12).saturating_mul(3 * units.len());
        check_memory("every source at three qualities", needed, self.host.memory)?;
        let mut seconds = Seconds::default();
        let mut coarse = Vec::new();
        for quality in [cheap, fine] {
            let (images, [prepare, render]) = self.render_alone(&units, quality)?;
            seconds.coarse[1] += prepare + render;
            coarse.push(images);
        }
        let mut refined: Vec<Image> = Vec::new();
        let mut keep = |image| refined.push(image);
        (_, seconds.alone) = self.one_by_one("sources alone", &units, &mut keep)?;
        let [coarser, coarse] = coarse.as_slice() else {
            return Err(Error::NoSetup);
        };
        let trial = Trial::new(keys, [coarser, coarse, &refined], self.host.threads);
        Ok((trial.ok_or(Error::NoBanks)?, seconds))
    }

    /// Renders settings one by one at the refined quality, from nothing prepared: the seconds to
    /// prepare and those of each.
    fn one_by_one(
        &self,
        task: &str,
        settings: &[Vec<f64>],
        take: &mut dyn FnMut(Image),
    ) -> Result<(f64, Vec<f64>), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let (work, clock) = (self.host.work(), self.host.clock.as_ref());
        let begin = clock.seconds();
        let renderer = self.host.renderer.as_ref();
        let mut operator = rendering.prepare(renderer, self.refined_step(), work)?;
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
    fn predict(&self, seconds: &mut Seconds) -> Result<(), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let renderer = self.host.renderer.as_ref();
        let pace = self.measure_pace()?;
        let sources = rendering.setup.rig.sources.len() as f64;
        let of = |quality: Quality| {
            let cost = rendering.cost(renderer, quality);
            Cost {
                prepare: cost.prepare * pace,
                per_source: cost.per_source * pace,
                per_image: cost.per_image * pace,
                per_lone: cost.per_lone * pace,
            }
        };
        let all = |step| of(step).alone(sources);
        seconds.coarse[0] = self.coarse_steps().map(all).iter().sum();
        seconds.cost = of(self.refined_step());
        Ok(())
    }
}

/// What to say where all weights are zero.
fn or_no_weight(instead: Error) -> impl FnOnce(PlanError) -> Error {
    |error| match error {
        PlanError::NoWeight => instead,
        other => other.into(),
    }
}
