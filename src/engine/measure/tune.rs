//! The cheapest steps of quality, number of refined images and format of keys that are good enough
//! for this show on this machine.
//!
//! Every source is rendered, or found, at every step of the scale; [`super::tuner`] does the rest.
//! Seconds are measured where a step's operator was prepared and all its images rendered for the
//! purpose; where images were found they are the operator's prediction, scaled by what was
//! measured, and marked as such.

use std::sync::Arc;

use super::Origin;
use super::tuner::{self, Candidate, StepCost, Tuned, Tuner};
use crate::engine::{Engine, Error};
use crate::lang;
use crate::picture::Image;
use crate::pool::Pool;
use crate::renderer::Quality;
use crate::show::Preview;

/// The ways to an error, as measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Ways {
    /// The show and the machine.
    pub origin: Origin,
    /// How many images a step renders of sources alone.
    pub sources: usize,
    /// Every source alone, by step; the last is the truth.
    pub steps: Vec<StepCost>,
    /// The step of mixtures.
    pub refined: u8,
    /// Coarse images with none, one, two ... mixtures.
    pub mixtures: Vec<Candidate>,
}

/// Steps without which there is nothing to choose: two for coarse images, one to compare with.
const LEAST: u8 = 3;

impl Engine {
    /// Chooses what is good enough for an error of the worst moment of `until` against the finest step
    /// of the scale, or the finest that is predicted to be measured within `budget` seconds.
    ///
    /// # Errors
    /// [`Error::NoSetup`], [`Error::TooFewSteps`], [`Error::MeasureMemory`], [`Error::Black`];
    /// [`Error::OutOfReach`] where no choice is within `until`. Else what rendering says; images
    /// that are finished by then are kept.
    pub fn tune(&mut self, until: f64, budget: Option<f64>) -> Result<Tuned, Error> {
        let finest = self.finest().0;
        self.fits_tuning(finest)?;
        let (pictures, steps) = self.measure_steps(finest, budget)?;
        let reference = pictures.len() as u8;
        let work = self.host.work();
        let sequence = (self.document.keys().clone(), self.settings_of_cues());
        let tuner = Tuner::new(sequence, &pictures, steps, work)?;
        let tuner = tuner.ok_or(Error::Black)?;
        let candidates = tuner.candidates(until, self.host.work())?;
        let Some(choice) = tuner::choice(&candidates, until) else {
            return Err(out_of_reach(&candidates, until, reference));
        };
        let preview = self.show().preview.clone();
        let playback = self.playback()?;
        let tone = self.tone_of(playback.images());
        Ok(Tuned {
            show: self.show().title.clone(),
            machine: self.machine(),
            until,
            reference,
            sources: self.sources(),
            steps: tuner.steps().to_vec(),
            choices: tuner::front(&candidates),
            choice,
            keys: self.key_formats(&playback, tone)?,
            preview: lang::preview_statement(&Preview {
                tolerance: until.into(),
                coarse: choice.coarse,
                refined: choice.refined.unwrap_or(preview.refined),
                ..preview
            }),
        })
    }

    /// What each way to an error takes and leaves, against the finest step.
    ///
    /// # Errors
    /// As [`Engine::tune`], but for what is out of reach.
    pub fn measure_ways(&mut self) -> Result<Ways, Error> {
        let finest = self.finest().0;
        self.fits_tuning(finest)?;
        let (pictures, steps) = self.measure_steps(finest, None)?;
        let work = self.host.work();
        let sequence = (self.document.keys().clone(), self.settings_of_cues());
        let tuner = Tuner::new(sequence, &pictures, steps, work)?;
        let tuner = tuner.ok_or(Error::Black)?;
        let [cheap, _] = self.coarse_pair();
        Ok(Ways {
            origin: self.origin(),
            sources: self.sources(),
            steps: tuner.steps().to_vec(),
            refined: self.refined_step().0,
            mixtures: tuner.mixtures(cheap.0, self.refined_step().0)?,
        })
    }

    /// What must hold before anything is rendered.
    fn fits_tuning(&self, finest: u8) -> Result<(), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        if finest < LEAST {
            return Err(Error::TooFewSteps {
                found: finest,
                needed: LEAST,
            });
        }
        let pixels = rendering.setup.view.width * rendering.setup.view.height;
        // As rendered, and as what they are off by.
        let bytes = 2
            * usize::from(finest)
            * rendering.setup.rig.sources.len()
            * pixels
            * size_of::<[f32; 3]>();
        if bytes > self.host.memory {
            return Err(Error::MeasureMemory {
                needed: bytes,
                budget: self.host.memory,
            });
        }
        Ok(())
    }

    /// Every source alone at every step, and what that took; the cheapest step first.
    #[allow(clippy::type_complexity, reason = "pictures by step, and the steps")]
    fn measure_steps(
        &mut self,
        finest: u8,
        budget: Option<f64>,
    ) -> Result<(Vec<Vec<Arc<Image>>>, Vec<StepCost>), Error> {
        let begin = self.now();
        let (mut pictures, mut steps) = (Vec::new(), Vec::new());
        // Seconds measured, and what was predicted for the same.
        let mut pace = [0.0; 2];
        for quality in 1..=finest {
            let (done, total) = (usize::from(quality - 1), usize::from(finest));
            self.host.progress.report("measuring steps", done, total);
            let spent = self.now() - begin;
            let predicted = self.predicted_step(quality)?;
            let scale = match pace {
                [measured, predicted] if predicted > 0.0 => measured / predicted,
                _ => 1.0,
            };
            let whole = predicted.fixed + predicted.picture * self.sources() as f64;
            let over = budget.is_some_and(|b| spent + whole * scale > b);
            if over && quality > LEAST {
                break;
            }
            let (images, cost) = self.measure_step(quality)?;
            if let Some(cost) = cost {
                pace[0] += cost.fixed + cost.picture * self.sources() as f64;
                pace[1] += whole;
            }
            pictures.push(images);
            steps.push(cost.unwrap_or(predicted));
        }
        // The others are not needed for coarse or refined pictures.
        let ([cheap, fine], refined) = (self.coarse_steps(), self.refined_step().0);
        if let Some(rendering) = &mut self.rendering {
            rendering.keep_operators(&[cheap.0, fine.0, refined]);
        }
        let scale = match pace {
            [measured, predicted] if predicted > 0.0 => measured / predicted,
            // Nothing was measured: the operator's own small task does.
            _ => self.measure_pace()?,
        };
        for step in steps.iter_mut().filter(|s| !s.measured) {
            step.fixed *= scale;
            step.picture *= scale;
        }
        Ok((pictures, steps))
    }

    /// The pictures of a step; also its seconds where all were rendered, from nothing prepared.
    fn measure_step(&mut self, quality: u8) -> Result<(Vec<Arc<Image>>, Option<StepCost>), Error> {
        let (host, image_cache) = (&self.host, &mut self.image_cache);
        let clock = host.clock.as_ref();
        let rendering = self.rendering.as_mut().ok_or(Error::NoSetup)?;
        let sources = rendering.setup.rig.sources.len();
        let (step, units) = (Quality(quality), Pool::unit_settings(sources));
        let fresh = !rendering.is_prepared(step);
        let before = image_cache.statistics();
        let begin = clock.seconds();
        let images = rendering.images(image_cache, host, step, &units)?;
        let all = clock.seconds() - begin;
        if !fresh || image_cache.statistics().since(before).found() > 0 {
            return Ok((images, None));
        }
        let begin = clock.seconds();
        let operator = rendering.operator(host.renderer.as_ref(), step, host.work())?;
        operator.render(&[vec![1.0; sources]], host.work())?;
        let picture = clock.seconds() - begin;
        let cost = StepCost {
            quality,
            fixed: (all - picture * sources as f64).max(0.0),
            picture,
            measured: true,
            error: 0.0,
        };
        Ok((images, Some(cost)))
    }

    /// What the operator says of a step, in its own unit.
    fn predicted_step(&self, quality: u8) -> Result<StepCost, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let cost = rendering.cost(self.host.renderer.as_ref(), Quality(quality));
        Ok(StepCost {
            quality,
            fixed: cost.prepare + cost.per_source * self.sources() as f64,
            picture: cost.per_image,
            measured: false,
            error: 0.0,
        })
    }

    fn sources(&self) -> usize {
        self.rendering.as_ref().map_or(0, |r| r.sources())
    }
}

/// The choice that comes nearest to an error that none reaches.
fn out_of_reach(candidates: &[Candidate], until: f64, reference: u8) -> Error {
    let best = candidates.iter().min_by(|a, b| a.error.total_cmp(&b.error));
    Error::OutOfReach {
        until,
        reference,
        best: best.copied(),
    }
}
