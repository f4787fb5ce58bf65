//! Refinement: render the settings that the plan puts first until the goal is met.

use super::{Error, Interpreter, stage};
use crate::plan;
use crate::pool::Pool;
use crate::transport::Quality;

/// Refined pictures that must have confirmed an estimated error before it is believed. After one
/// the tavern's prediction was a quarter of the truth, after two seven tenths.
const CONFIRMED: usize = 2;

/// When to stop refining; the first of these that is met ends it, and so does the end of the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Predicted error of the sequence, relative (0.02 = 2 %).
    pub until: Option<f64>,
    /// Number of pictures to render now.
    pub count: Option<usize>,
    /// Seconds to spend now; a picture that is begun is finished.
    pub budget: Option<f64>,
}

/// Where the sequence stood after a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Refined pictures in the pool.
    pub refined: usize,
    /// Seconds of computing since the show was opened.
    pub seconds: f64,
    /// Predicted error of the sequence, relative, as it was known then.
    pub error: f64,
    /// The same before it was calibrated by known corrections; it never rises.
    pub forecast: f64,
}

/// Why refinement ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The predicted error is within what was asked for.
    Reached,
    /// As many pictures as asked for were rendered.
    Counted,
    /// The time is used up.
    Spent,
    /// Nothing is left that another picture would improve.
    Complete,
}

impl Interpreter {
    /// Renders the coarse pictures unless they are there. The first entry of [`Self::steps`] is
    /// made here.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn coarse(&mut self) -> Result<(), Error> {
        let begin = self.host.clock.seconds();
        let work = self.host.work();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        if !stage.coarse(self.host.transport.as_ref(), work)? {
            return Ok(());
        }
        self.steps.clear();
        self.record(begin)
    }

    /// The two steps of quality at which coarse pictures are rendered: what the show asks for, and
    /// the finer one whose pictures serve as coarse ones; their difference estimates the error.
    pub(super) fn coarse_steps(&self) -> [u8; 2] {
        stage::coarse_steps(self.show().preview.coarse, self.finest())
    }

    /// The finest step of the scale that the show's lights are rendered on.
    pub(super) fn finest(&self) -> Quality {
        let transport = self.host.transport.as_ref();
        let of_stage = |stage: &stage::Stage| stage.finest(transport);
        self.stage
            .as_ref()
            .map_or_else(|| transport.finest(), of_stage)
    }

    /// The step that refined pictures are rendered at.
    pub(super) fn refined_step(&self) -> Quality {
        Quality(self.show().preview.refined.clamp(1, self.finest().0))
    }

    /// What to say where the show asks for steps of quality beyond the scale.
    pub(super) fn clamped(&self) -> Option<String> {
        let finest = self.finest().0;
        let preview = &self.show().preview;
        let beyond = preview.coarse.max(preview.refined) > finest;
        let scale = self.stage.is_some() && finest > 1 && beyond;
        scale.then(|| {
            let (name, coarse, refined) =
                (self.host.transport.name(), preview.coarse, preview.refined);
            format!(
                "the show asks for quality `coarse {coarse}  refined {refined}`, the scale of the \
                 {name} ends at {finest}: that is taken instead"
            )
        })
    }

    /// What to say in a plan where pictures share no work; `None` where they do, or where there
    /// is nothing to refine.
    pub(super) fn unshared(&self) -> Option<String> {
        let stage = self.stage.as_ref().filter(|_| !self.is_final())?;
        let cost = stage.cost(self.host.transport.as_ref(), self.refined_step());
        let shares = cost.prepare > 0.0 || cost.per_source > 0.0;
        let each = match cost.per_image > 0.0 {
            true => format!("{:.2} s each, as measured", cost.per_image),
            false => "not measured yet".to_owned(),
        };
        (!shares).then(|| {
            format!(
                "pictures share no work here ({each}; with negative light two runs): refining \
                 several at once does not pay"
            )
        })
    }

    /// True when the first pictures are as good as any: the scale has one step, so that nothing is
    /// left to refine. So it is where every bank is an image.
    pub fn is_final(&self) -> bool {
        self.stage.is_some() && self.finest() == Quality(1)
    }

    /// The sequence after each picture, coarse alone first.
    pub fn steps(&self) -> &[Step] {
        &self.steps
    }

    fn record(&mut self, begin: f64) -> Result<(), Error> {
        let spent = self.steps.last().map_or(0.0, |s| s.seconds);
        let forecast = self.forecast()?;
        let step = Step {
            refined: self.refined(),
            seconds: spent + self.host.clock.seconds() - begin,
            error: forecast * self.calibration(),
            forecast,
        };
        self.steps.push(step);
        Ok(())
    }

    /// Predicted error of the sequence as the pool stands, relative.
    ///
    /// # Errors
    /// [`Error::Usage`] before the coarse pictures are rendered.
    pub fn predicted_error(&self) -> Result<f64, Error> {
        Ok(self.forecast()? * self.calibration())
    }

    fn forecast(&self) -> Result<f64, Error> {
        let pool = self.rendered()?;
        if self.is_final() {
            return Ok(0.0);
        }
        let norm = Some(self.sequence_norm(pool));
        Ok(plan::forecast(
            &self.compiled.keys,
            &pool.settings(),
            &pool.weighting(),
            norm,
        )?)
    }

    /// What known corrections make of the estimated errors.
    pub(super) fn calibration(&self) -> f64 {
        self.pool().map_or(1.0, Pool::calibration)
    }

    /// sqrt ∫ ||I(t)||² dt of the sequence, from the coarse pictures.
    pub(super) fn sequence_norm(&self, pool: &Pool) -> f64 {
        plan::sequence_norm(pool.gram(), &plan::second_moment(&self.compiled.keys))
    }

    /// Renders refined pictures in the order of the plan until `goal` is met; a goal with nothing
    /// in it is one picture. The coarse pictures' own estimate of their error is not trusted
    /// alone: an error counts as reached once two refined pictures were held against it.
    ///
    /// # Errors
    /// [`Error`]; pictures finished before it are kept.
    pub fn refine(&mut self, goal: Goal) -> Result<Ended, Error> {
        self.coarse()?;
        let goal = match goal {
            Goal {
                until: None,
                count: None,
                budget: None,
            } => Goal {
                count: Some(1),
                ..goal
            },
            goal => goal,
        };
        let begin = self.host.clock.seconds();
        let mut rendered = 0;
        loop {
            if goal
                .until
                .is_some_and(|error| self.refined() >= CONFIRMED && self.last_error() <= error)
            {
                return Ok(Ended::Reached);
            }
            if goal.count.is_some_and(|count| rendered >= count) {
                return Ok(Ended::Counted);
            }
            if goal
                .budget
                .is_some_and(|s| self.host.clock.seconds() - begin >= s)
            {
                return Ok(Ended::Spent);
            }
            if !self.refine_one()? {
                return Ok(Ended::Complete);
            }
            rendered += 1;
            let total = goal.count.unwrap_or(rendered.max(self.planned(&goal)));
            self.host
                .progress
                .report("refined pictures", rendered, total);
        }
    }

    fn last_error(&self) -> f64 {
        self.steps.last().map_or(f64::INFINITY, |s| s.error)
    }

    /// Renders the best next picture; false when nothing is left to improve.
    fn refine_one(&mut self) -> Result<bool, Error> {
        let begin = self.host.clock.seconds();
        let work = self.host.work();
        work.check()?;
        if self.is_final() {
            return Ok(false);
        }
        let quality = self.refined_step();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let pool = stage.pool.as_ref().ok_or_else(no_stage)?;
        let next = plan::next(
            &self.compiled.keys,
            &pool.settings(),
            &pool.weighting(),
            None,
        )?;
        let Some(direction) = next.directions.into_iter().next() else {
            return Ok(false);
        };
        let setting = vec![direction.setting];
        let rendered = stage
            .operator(self.host.transport.as_ref(), quality, work)?
            .render(&setting, work)?;
        let images = setting.into_iter().zip(rendered);
        if let Some(pool) = stage.pool.as_mut() {
            for (setting, image) in images {
                pool.add(setting, image, quality, work);
            }
        }
        self.record(begin)?;
        Ok(true)
    }

    /// How many pictures a goal is likely to take in all, for the progress bar.
    fn planned(&self, goal: &Goal) -> usize {
        let Some(pool) = self.pool() else {
            return 0;
        };
        let until = goal.until.unwrap_or(0.0);
        let norm = Some(self.sequence_norm(pool));
        let next = plan::next(
            &self.compiled.keys,
            &pool.settings(),
            &pool.weighting(),
            norm,
        );
        let more = next.map_or(0, |next| {
            let over = |d: &&plan::Direction| pool.calibration() * d.error > until;
            next.directions.iter().take_while(over).count() + 1
        });
        self.steps.len().saturating_sub(1) + more
    }
}

pub(super) fn no_stage() -> Error {
    Error::Usage(
        "the show has no stage or no view to render; add them, such as\n  \
         stage \"set.obj\"\n  view house from 0, -12, 1.7 to 0, 0, 2 fov 28 size 640x360"
            .to_owned(),
    )
}
