//! `tune`: the cheapest steps of quality, number of refined pictures and format of keys that are
//! good enough for this show on this machine.
//!
//! Every source is rendered, or found, at every step of the scale; [`study::tune`] does the rest.
//! Seconds are measured where a step's operator was prepared and all its pictures rendered for the
//! purpose; where pictures were found they are the operator's prediction at the pace of what was
//! measured, and said to be.
//!
//! [`study::tune`]: crate::study::tune

use std::sync::Arc;

use super::answer::{count, duration, fraction, percent};
use super::refine::no_stage;
use super::{Call, Error, Interpreter, Reply};
use crate::picture::Image;
use crate::pool::Pool;
use crate::report;
use crate::show::ToneCurve;
use crate::study::tune::{self, Candidate, Expense, Tuned, Tuner};
use crate::renderer::Quality;

/// Steps without which there is nothing to choose: two for coarse pictures, one to hold against.
const LEAST: u8 = 3;

impl Interpreter {
    pub(super) fn answer_tune(&mut self, call: &Call) -> Result<Reply, Error> {
        if let Some(word) = call.words.first() {
            return Err(Error::Usage(format!(
                "`{word}` is left over: tune --until 2%"
            )));
        }
        let until = match call.option("until") {
            Some(text) => fraction(text)?,
            None => self.show().preview.tolerance,
        };
        let budget = call.option("budget").map(duration).transpose()?;
        let tuned = self.tune(until, budget.map(|t| t.seconds()))?;
        if call.option("json").is_some() {
            return Reply::json(&tuned);
        }
        Ok(Reply::text(report::tune::describe(&tuned)))
    }

    /// Chooses what is good enough for an error of the sequence of `until` against the finest step
    /// of the scale, or the finest that is predicted to be measured within `budget` seconds.
    ///
    /// # Errors
    /// [`Error::Usage`] without stage or view, where the scale has too few steps, where the
    /// pictures do not fit into memory, and where no choice is within `until`: then it says what is
    /// reachable. Else what rendering says; pictures that are finished by then are kept.
    pub fn tune(&mut self, until: f64, budget: Option<f64>) -> Result<Tuned, Error> {
        let finest = self.finest().0;
        self.fits_tuning(finest)?;
        let (pictures, steps) = self.measure_steps(finest, budget)?;
        let reference = pictures.len() as u8;
        let work = self.host.work();
        let tuner = Tuner::new(self.keys().clone(), &pictures, steps, work)?;
        let tuner = tuner.ok_or_else(|| {
            Error::Usage("the sequence is black at every step: there is nothing to tune".to_owned())
        })?;
        let candidates = tuner.candidates(until)?;
        let Some(choice) = tune::choice(&candidates, until) else {
            return Err(out_of_reach(&candidates, until, reference));
        };
        let preview = &self.show().preview;
        let as_it_stands = tuner.run(preview.coarse, preview.refined, until)?;
        let playback = self.playback()?;
        let tone = self.tone(playback.images());
        Ok(Tuned {
            show: self.show().title.clone(),
            machine: self.machine(),
            until,
            reference,
            sources: self.sources(),
            steps: tuner.steps().to_vec(),
            choices: tune::front(&candidates),
            choice,
            as_it_stands,
            keys: self.key_formats(&playback, tone)?,
            preview: self.preview_statement(until, choice),
        })
    }

    /// What must hold before anything is rendered.
    fn fits_tuning(&self, finest: u8) -> Result<(), Error> {
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        if finest < LEAST {
            return Err(Error::Usage(format!(
                "the pictures of this show have {} of quality: tune needs {LEAST}, two for coarse \
                 pictures and a finer one to hold them against",
                count(finest.into(), "step"),
            )));
        }
        let pixels = stage.view.width * stage.view.height;
        // As rendered, and as what they are off by.
        let bytes =
            2 * usize::from(finest) * stage.rig.sources.len() * pixels * size_of::<[f32; 3]>();
        if bytes > self.host.memory {
            let mega = |bytes: usize| bytes.div_ceil(1 << 20);
            return Err(Error::Usage(format!(
                "the pictures of every source at every step take {} MB, the memory allowed is {} MB: \
                 give the view a smaller size for tuning, or allow more with --memory",
                mega(bytes),
                mega(self.host.memory)
            )));
        }
        Ok(())
    }

    /// Every source alone at every step, and what that took; the cheapest step first.
    #[allow(clippy::type_complexity, reason = "pictures by step, and the steps")]
    fn measure_steps(
        &mut self,
        finest: u8,
        budget: Option<f64>,
    ) -> Result<(Vec<Vec<Arc<Image>>>, Vec<Expense>), Error> {
        let begin = self.host.clock.seconds();
        let (mut pictures, mut steps) = (Vec::new(), Vec::new());
        // Seconds measured, and what was predicted for the same.
        let mut pace = [0.0; 2];
        for quality in 1..=finest {
            let (done, total) = (usize::from(quality - 1), usize::from(finest));
            self.host.progress.report("measuring steps", done, total);
            let spent = self.host.clock.seconds() - begin;
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
            let (images, expense) = self.measure_step(quality)?;
            if let Some(expense) = expense {
                pace[0] += expense.fixed + expense.picture * self.sources() as f64;
                pace[1] += whole;
            }
            pictures.push(images);
            steps.push(expense.unwrap_or(predicted));
        }
        // The others are not needed for coarse or refined pictures.
        let ([cheap, fine], refined) = (self.coarse_steps(), self.refined_step().0);
        if let Some(stage) = &mut self.stage {
            stage.keep_operators(&[cheap, fine, refined]);
        }
        let scale = match pace {
            [measured, predicted] if predicted > 0.0 => measured / predicted,
            // Nothing was measured: the operator's own small task tells.
            _ => {
                let clock = || self.host.clock.seconds();
                self.host.transport.pace(&clock, self.host.work())?
            }
        };
        for step in steps.iter_mut().filter(|s| !s.measured) {
            step.fixed *= scale;
            step.picture *= scale;
        }
        Ok((pictures, steps))
    }

    /// The pictures of a step; also its seconds where all were rendered, from nothing prepared.
    fn measure_step(&mut self, quality: u8) -> Result<(Vec<Arc<Image>>, Option<Expense>), Error> {
        let means = self.host.means();
        let clock = self.host.clock.as_ref();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let sources = stage.rig.sources.len();
        let (step, units) = (Quality(quality), Pool::unit_settings(sources));
        let fresh = !stage.is_prepared(step);
        let before = stage.archive.tally();
        let begin = clock.seconds();
        let images = stage.pictures(means, step, &units, None)?;
        let all = clock.seconds() - begin;
        if !fresh || stage.archive.tally().since(before).found() > 0 {
            return Ok((images, None));
        }
        let begin = clock.seconds();
        let operator = stage.operator(means.transport, step, means.work)?;
        operator.render(&[vec![1.0; sources]], means.work)?;
        let picture = clock.seconds() - begin;
        let expense = Expense {
            quality,
            fixed: (all - picture * sources as f64).max(0.0),
            picture,
            measured: true,
            error: 0.0,
        };
        Ok((images, Some(expense)))
    }

    /// What the operator says of a step, in its own unit.
    fn predicted_step(&self, quality: u8) -> Result<Expense, Error> {
        let stage = self.stage.as_ref().ok_or_else(no_stage)?;
        let cost = stage.cost(self.host.transport.as_ref(), Quality(quality));
        Ok(Expense {
            quality,
            fixed: cost.prepare + cost.per_source * self.sources() as f64,
            picture: cost.per_image,
            measured: false,
            error: 0.0,
        })
    }

    fn sources(&self) -> usize {
        self.stage.as_ref().map_or(0, |s| s.rig.sources.len())
    }

    /// The show's `preview` with what was chosen in it.
    fn preview_statement(&self, until: f64, choice: Candidate) -> String {
        let preview = &self.show().preview;
        let exposure = preview.exposure;
        let tone = match preview.tone {
            ToneCurve::Filmic => "filmic",
            ToneCurve::Plain => "plain",
        };
        let dither = if preview.dither { "  dither on" } else { "" };
        format!(
            "preview {{ tolerance {}%  gap {}  rate {}  exposure {}  tone {tone}{dither}  coarse {}  refined {} }}",
            // Without the rounding of a division by a hundred.
            (until * 1e6).round() / 1e4,
            preview.gap.seconds(),
            preview.rate,
            exposure.map_or("auto".to_owned(), |stops| stops.to_string()),
            choice.coarse,
            choice.refined.unwrap_or(preview.refined)
        )
    }
}

/// No choice is good enough: which comes nearest, and what to ask for instead.
fn out_of_reach(candidates: &[Candidate], until: f64, reference: u8) -> Error {
    let best = candidates.iter().min_by(|a, b| a.error.total_cmp(&b.error));
    let nearest = best.map_or("nothing".to_owned(), |best| {
        // Up, so that it can be asked for.
        let reachable = (best.error * 1e5).ceil() / 1e3;
        format!(
            "the best is {}, off by {} %: ask for --until {reachable}%",
            report::tune::choice(best),
            percent(best.error)
        )
    });
    Error::Usage(format!(
        "{} % is out of reach: the scale's finest step, {reference}, is what errors are against, and of \
         the others {nearest}",
        percent(until)
    ))
}

#[cfg(test)]
#[path = "tune_test.rs"]
mod tests;
