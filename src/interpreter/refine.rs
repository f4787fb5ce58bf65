//! Refinement: render the settings that the plan puts first until the goal is met.

use super::economy::{self, Ahead};
use super::stage::Again;
use super::{Error, Interpreter, stage};
use crate::plan;
use crate::pool::{Pool, Projection, is_within};
use crate::renderer::Quality;
use crate::work::Patient;

/// When to stop refining; the first of these that is met ends it, and so does the end of the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goal {
    /// Predicted error of the sequence, relative (0.02 = 2 %).
    pub until: Option<f64>,
    /// Number of pictures to render now.
    pub count: Option<usize>,
    /// Seconds to spend now; a picture that is begun is finished, one that is not predicted to fit
    /// is not begun, but for the first.
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
    /// The time is used up, or too short for another picture.
    Spent,
    /// Nothing is left that another picture would improve.
    Complete,
    /// The user stopped it.
    Stopped,
}

impl Ended {
    /// Why, for people; empty where it goes without saying.
    pub(super) fn words(self) -> &'static str {
        match self {
            Ended::Reached => "the error asked for is reached",
            Ended::Counted => "",
            Ended::Spent => "the time is used up",
            Ended::Complete => "every direction that the show needs is refined",
            Ended::Stopped => "stopped; what is finished is kept",
        }
    }
}

/// What a refinement did.
#[derive(Debug)]
pub(super) struct Refined {
    pub ended: Ended,
    /// What is to be said of its economy.
    pub remarks: Vec<String>,
    pub rendered: usize,
    /// Computing alone, what watching took left out.
    pub seconds: f64,
}

impl Default for Refined {
    fn default() -> Refined {
        Refined {
            ended: Ended::Complete,
            remarks: Vec::new(),
            rendered: 0,
            seconds: 0.0,
        }
    }
}

impl Interpreter {
    /// Renders the coarse pictures unless they are there, and takes up the refined ones that this
    /// session and earlier ones left. The first entry of [`Self::steps`] is made here, and one for
    /// each of those.
    ///
    /// # Errors
    /// [`Error::Usage`] when the show has no stage or view, else what rendering says.
    pub fn coarse(&mut self) -> Result<(), Error> {
        self.in_time(|show| {
            if show.is_busy() && show.pool().is_none() {
                show.wait_for_coarse()?;
            }
            show.coarse_since(show.host.clock.seconds())
        })
    }

    /// The same, with rendering begun at this time.
    pub(super) fn coarse_since(&mut self, begin: f64) -> Result<(), Error> {
        let means = self.host.means();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let before = stage.archive.tally();
        if !stage.coarse(means)? {
            return Ok(());
        }
        let found = stage.archive.tally().since(before).found();
        self.steps.clear();
        // What was found tells nothing of what rendering takes.
        if found == 0 {
            self.time_coarse(begin);
        }
        self.record(begin)?;
        let begin = self.host.clock.seconds();
        let (least, means) = (self.refined_step(), self.host.means());
        let again = self.stage.as_mut().map(|s| s.again(least, means));
        self.add_refined(again.unwrap_or_default(), begin)
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
        if self.is_final() || pool.flawless() {
            return Ok(0.0);
        }
        let norm = self.sequence_norm(pool);
        let keys = &self.compiled.keys;
        Ok(match self.method().projection {
            Projection::Error | Projection::Extrapolated => {
                plan::forecast(keys, &pool.settings(), &pool.weighting(), Some(norm))?
            }
            _ => self
                .projected()?
                .forecast(&plan::second_moment(keys), norm)?,
        })
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
    /// in it is one picture. The coarse pictures' own estimate of their error is trusted alone only
    /// where it leaves room; else an error counts as reached once two refined pictures were held
    /// against it ([`is_within`]).
    ///
    /// A number of pictures is rendered one by one. An error or a time may take several in one
    /// call, where their cost says that it pays; see [`Interpreter::outlook`]. The predicted
    /// seconds decide whether another picture still fits into a time; one is always rendered.
    ///
    /// A cancel ends it after the call in hand, a second one at once.
    ///
    /// # Errors
    /// [`Error`]; pictures finished before it are kept.
    pub fn refine(&mut self, goal: Goal) -> Result<Ended, Error> {
        let refined = self.in_time(|show| show.refine_watched(goal, &mut |_| Ok(())))?;
        Ok(refined.ended)
    }

    /// The same with someone to look at the pool after each call of the operator; the time that
    /// this takes does not count.
    pub(super) fn refine_watched(
        &mut self,
        goal: Goal,
        watch: &mut dyn FnMut(&mut Interpreter) -> Result<(), Error>,
    ) -> Result<Refined, Error> {
        self.idle()?;
        self.coarse()?;
        let goal = goal.or_one();
        let mut done = Refined::default();
        loop {
            if done.rendered > 0 && self.host.progress.cancelled() {
                return Ok(Refined {
                    ended: Ended::Stopped,
                    ..done
                });
            }
            if let Some(ended) = self.ended(&goal, &done)? {
                return Ok(Refined { ended, ..done });
            }
            self.know_pace()?;
            let begin = self.host.clock.seconds();
            let outlook = self.outlook()?;
            let left = goal.budget.map(|s| s - done.seconds);
            let call = economy::call(&outlook, &goal, self.refined(), left);
            // The first one is rendered whatever it takes: else nothing would ever be known.
            if done.rendered > 0 && !call.fits {
                let seconds = outlook.steps.first().map_or(0.0, |s| s.seconds);
                done.remarks.extend(economy::too_long(seconds));
                return Ok(Refined {
                    ended: Ended::Spent,
                    ..done
                });
            }
            if call.pictures == 0 {
                return Ok(Refined {
                    ended: Ended::Complete,
                    ..done
                });
            }
            done.remarks.extend(call.remark);
            let steps = outlook.steps.into_iter().take(call.pictures);
            self.render_refined(steps.collect(), begin)?;
            done.rendered += call.pictures;
            done.seconds += self.host.clock.seconds() - begin;
            let total = done.rendered + call.needed.saturating_sub(call.pictures);
            let total = goal.count.unwrap_or(total);
            let progress = &self.host.progress;
            progress.report("refined pictures", done.rendered, total);
            watch(self)?;
        }
    }

    /// Why no picture is to be rendered after what is done; `None` if one is.
    pub(super) fn ended(&self, goal: &Goal, done: &Refined) -> Result<Option<Ended>, Error> {
        // As it is now: an edit changes it without a picture.
        let error = self.predicted_error()?;
        // Where nothing is known to be wrong nothing is left to refine: that is then the reason.
        let known = error > 0.0 || self.refined() > 0;
        let reached = |wanted: f64| known && is_within(wanted, error, self.refined());
        if goal.until.is_some_and(reached) {
            return Ok(Some(Ended::Reached));
        }
        if goal.count.is_some_and(|count| done.rendered >= count) {
            return Ok(Some(Ended::Counted));
        }
        let spent = goal.budget.is_some_and(|s| done.seconds >= s);
        Ok((spent && done.rendered > 0).then_some(Ended::Spent))
    }

    /// Renders settings in one call, or finds their pictures, and adds them to the pool, in their
    /// order.
    fn render_refined(&mut self, steps: Vec<Ahead>, begin: f64) -> Result<(), Error> {
        self.host.work().check()?;
        let patient = Patient(self.host.progress.as_ref());
        let mut means = self.host.means();
        means.work.progress = &patient;
        let predicted: f64 = steps.iter().map(|s| s.seconds).sum();
        let settings: Vec<Vec<f64>> = steps.into_iter().map(|s| s.setting).collect();
        let quality = self.refined_step();
        let stage = self.stage.as_mut().ok_or_else(no_stage)?;
        let started = self.host.clock.seconds();
        let before = stage.archive.tally();
        let place = stage.pool.as_ref().map_or(0, |p| p.refined().len());
        let pictures = stage.pictures(means, quality, &settings, Some(place))?;
        let found = stage.archive.tally().since(before).found();
        let seconds = self.host.clock.seconds() - started;
        if found == 0 {
            self.pace.learn(predicted, seconds);
        }
        self.add_refined(Again::of(settings, pictures, quality), begin)
    }

    /// Adds pictures to the pool and records where the sequence stands after each.
    pub(super) fn add_refined(&mut self, pictures: Vec<Again>, begin: f64) -> Result<(), Error> {
        let mut begin = begin;
        for picture in pictures {
            let work = self.host.work();
            if let Some(pool) = self.stage.as_mut().and_then(|s| s.pool.as_mut()) {
                pool.add(picture.setting, picture.image, picture.quality, work);
            }
            let now = self.host.clock.seconds();
            self.record(begin)?;
            begin = now;
        }
        Ok(())
    }
}

impl Goal {
    /// One picture where nothing is said.
    pub(super) fn or_one(self) -> Goal {
        match self == Goal::default() {
            true => Goal {
                count: Some(1),
                ..self
            },
            false => self,
        }
    }
}

pub(super) fn no_stage() -> Error {
    Error::Usage(
        "the show has no stage (or surfaces of its own) or no view to render; add them, such as\n  \
         stage \"set.obj\"\n  view house from 0, -12, 1.7 to 0, 0, 2 fov 28 size 640x360"
            .to_owned(),
    )
}
