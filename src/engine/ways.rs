//! Which way to an error costs least: every bank alone at one step of quality, or coarse images and
//! mixtures at a finer one. Plan, run, refinement and status ask here.
//!
//! Seconds are the operator's prediction at this machine's pace, of what is not at hand; errors are
//! what the operator states of a step, and for mixtures what the plan leaves of it. Where the
//! operator states nothing, only mixtures can be judged, by the difference of two coarse steps.

use std::cmp::Ordering;

use serde::Serialize;

use super::forecast::Forecast;
use super::refine::Goal;
use super::rendering::Reused;
use super::{Engine, Error};
use crate::plan::{self, Weighting};
use crate::pool::{Stated, is_within};
use crate::renderer::{Cost, Quality, Transport as _};
use crate::units::{ErrorUnit, Tolerance};

/// How a sequence becomes good enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Whichever is predicted to take the fewest seconds.
    #[default]
    Auto,
    /// Coarse images, and mixtures in the order of the plan (Dorsey, Arvo and Greenberg 1995).
    Paper,
    /// Each source alone at one step of quality.
    Alone,
}

impl Way {
    /// All of them.
    pub const ALL: [Way; 3] = [Way::Auto, Way::Paper, Way::Alone];

    /// As options and reports write it.
    pub fn name(self) -> &'static str {
        match self {
            Way::Auto => "auto",
            Way::Paper => "paper",
            Way::Alone => "alone",
        }
    }
}

/// A way to an error, with what it costs and leaves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WayForecast {
    /// [`Way::Alone`] or [`Way::Paper`].
    pub way: Way,
    /// The step of quality of the images that it renders last.
    pub quality: u8,
    /// Images of sources alone that it has yet to render.
    pub alone: usize,
    /// Mixtures that it has yet to render.
    pub mixed: usize,
    /// Predicted seconds of rendering them.
    pub seconds: f64,
    /// Predicted error of the worst moment then, in the unit of what is asked for.
    pub error: f64,
    /// Whether that is within what is asked for.
    pub reaches: bool,
}

/// How far a step of a plan reaches: seconds until then, and the error.
type Reach = (f64, f64);

impl Engine {
    /// How images are chosen.
    pub fn way(&self) -> Way {
        self.way
    }

    /// Takes another way from now on; images that are there are kept.
    pub fn set_way(&mut self, way: Way) {
        self.way = way;
    }

    /// The ways to a goal from the images that are there, the one that is taken first; none where
    /// nothing can be said before the coarse images are there, or nothing is left to render.
    ///
    /// # Errors
    /// [`Error::NoSetup`]; [`Error::Plan`].
    pub fn ways(&self, goal: &Goal) -> Result<Vec<WayForecast>, Error> {
        let forecast = match self.pool() {
            Some(_) => Some(self.forecast_by(goal.unit())?),
            None => None,
        };
        self.ways_beyond(goal, forecast.as_ref())
    }

    /// The same where the mixtures that are left are known.
    pub(super) fn ways_beyond(
        &self,
        goal: &Goal,
        forecast: Option<&Forecast>,
    ) -> Result<Vec<WayForecast>, Error> {
        let mut ways = Vec::new();
        if self.is_final() {
            return Ok(ways);
        }
        if self.way != Way::Paper {
            ways = self.alone_ways(goal)?;
        }
        if self.way != Way::Alone || ways.is_empty() {
            ways.extend(match forecast {
                Some(forecast) => Some(self.mixed_way(goal, forecast)),
                None => self.mixed_way_unseen(goal)?,
            });
        }
        ways.sort_by(|a, b| compare(a, b, goal.budget));
        Ok(ways)
    }

    /// What the operator states of a step.
    pub(super) fn stated(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let rendering = self.rendering.as_ref()?;
        rendering.stated_error(self.host.renderer.as_ref(), quality, unit)
    }

    /// Each source alone, at the step of the images that are there and at each finer one.
    fn alone_ways(&self, goal: &Goal) -> Result<Vec<WayForecast>, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let units = rendering.units();
        let now = self.pool().map_or(0, |_| self.coarse_steps()[1].0);
        let mut out = Vec::new();
        for quality in now.max(1)..=self.finest().0 {
            let step = Quality(quality);
            let Some(stated) = self.error_alone(step, goal.unit()) else {
                continue;
            };
            let is_now = quality == now;
            let error = if is_now {
                self.predicted_in(goal.unit())?
            } else {
                stated
            };
            let reaches = |until: Tolerance| {
                if is_now {
                    self.is_reached(until, error)
                } else {
                    error <= until.error
                }
            };
            let (mut missing, mut cost) = (0, 0.0);
            let mut base = self.base_of(step).to_vec();
            base.dedup();
            for step in base {
                let images = self.missing(&units, step)?;
                if images > 0 && !is_now {
                    missing += images;
                    cost += rendering.cost_of_units(self.host.renderer.as_ref(), step, images);
                }
            }
            out.push(WayForecast {
                way: Way::Alone,
                quality,
                alone: missing,
                mixed: 0,
                seconds: cost * self.pace.seconds(),
                error,
                reaches: goal.until.is_some_and(reaches),
            });
        }
        Ok(out)
    }

    /// The error of every source alone at a step. Where the operator states none and has no noise to tell
    /// it, refined images stand for the truth where this way is asked for or taken.
    fn error_alone(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let base = self.rendering.as_ref().and_then(|r| r.base);
        let is_taken = self.way == Way::Alone || base == Some([quality; 2]);
        let is_asked_for = is_taken && quality == self.refined_step();
        let own = is_asked_for && self.samples(quality).is_none();
        let stated = self.stated(quality, unit);
        stated
            .or_else(|| self.noise_alone(quality, unit))
            .or(own.then_some(0.0))
    }

    /// The error of every source alone at a step, from the noise of the images that are there.
    fn noise_alone(&self, quality: Quality, unit: ErrorUnit) -> Option<f64> {
        let pool = self.pool().filter(|pool| pool.is_known())?;
        let [_, now] = self.coarse_steps();
        let fewer = self.samples(now)? / self.samples(quality)?;
        let alone = *self.errors_left(pool, &[], unit).ok()?.first()?;
        Some(pool.planned_error(alone, alone) * fewer.sqrt())
    }

    /// Samples a pixel at a step of an operator with noise.
    fn samples(&self, quality: Quality) -> Option<f64> {
        let rendering = self.rendering.as_ref()?;
        rendering
            .layered(self.host.renderer.as_ref())
            .samples(quality)
    }

    /// The steps at which sources alone are rendered to be seen at one. Noise is told by a second
    /// picture, which makes the first one better by what it costs.
    fn base_of(&self, quality: Quality) -> [Quality; 2] {
        match self.samples(quality) {
            Some(_) => [Quality((quality.0 - 1).max(1)), quality],
            None => [quality; 2],
        }
    }

    /// How many images of `units` are not at hand at a step.
    fn missing(&self, units: &[Vec<f64>], quality: Quality) -> Result<usize, Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let at_hand = rendering.at_hand(&self.image_cache, quality, units, self.store());
        Ok(at_hand.iter().filter(|there| !**there).count())
    }

    /// Mixtures on top of the images that are there.
    fn mixed_way(&self, goal: &Goal, forecast: &Forecast) -> WayForecast {
        let mut seconds = 0.0;
        let reach = |step: &super::NextImage| -> Reach {
            seconds += step.seconds;
            (seconds, step.error)
        };
        let steps: Vec<Reach> = forecast.steps.iter().map(reach).collect();
        let within = |error, mixed| {
            let refined = self.refined() + mixed;
            goal.until
                .is_some_and(|until| is_within(until.error, error, refined, forecast.is_stated))
        };
        let (mixed, seconds, error) = taken(goal, (0.0, forecast.error), &steps, &within);
        let stored = |step: &&super::NextImage| step.stored;
        let found = forecast.steps.iter().take(mixed).filter(stored).count();
        WayForecast {
            way: Way::Paper,
            quality: forecast.quality,
            alone: 0,
            mixed: mixed - found,
            seconds,
            error,
            reaches: within(error, mixed),
        }
    }

    /// The coarse pair and mixtures, before there is any image: what levels alone say of the plan.
    fn mixed_way_unseen(&self, goal: &Goal) -> Result<Option<WayForecast>, Error> {
        let ([cheap, fine], step) = (self.coarse_pair(), self.refined_step());
        let stated = [fine, step].map(|step| self.stated(step, goal.unit()));
        let [Some(coarse), Some(refined)] = stated else {
            return Ok(None);
        };
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let (units, pace) = (rendering.units(), self.pace.seconds());
        let (mut alone, mut begin) = (0, 0.0);
        for quality in [cheap, fine] {
            let missing = self.missing(&units, quality)?;
            if missing > 0 && (quality == fine || cheap < fine) {
                let renderer = self.host.renderer.as_ref();
                begin += pace * rendering.cost_of_units(renderer, quality, missing);
                alone += missing;
            }
        }
        let Cost {
            prepare,
            per_source,
            per_image,
            ..
        } = self.refined_cost()?;
        let fixed = begin + pace * (prepare + units.len() as f64 * per_source);
        let keys = self.document.keys();
        let light = |levels: &[f64]| levels.iter().map(|x| x * x).sum::<f64>().sqrt();
        let moments = plan::Moment::relative(self.settings_of_cues(), light);
        let weighting = Weighting::settings(units.len()).at(moments.clone());
        let next = plan::next(keys, &[], &weighting, None)?.directions;
        let next: Vec<Vec<f64>> = next.into_iter().map(|d| d.setting).collect();
        let left = plan::worst_left(&moments, &[], &next, &weighting);
        let reach = |(i, left): (usize, &f64)| {
            let seconds = fixed + (i + 1) as f64 * per_image * pace;
            let shown = (1.0 - left * left).max(0.0).sqrt();
            (seconds, (coarse * left).hypot(refined * shown))
        };
        let steps: Vec<Reach> = left.iter().skip(2).enumerate().map(reach).collect();
        let within = |error, _| goal.until.is_some_and(|until| error <= until.error);
        let (mixed, seconds, error) = taken(goal, (begin, coarse), &steps, &within);
        Ok(Some(WayForecast {
            way: Way::Paper,
            quality: if mixed > 0 { step.0 } else { fine.0 },
            alone,
            mixed,
            seconds,
            error,
            reaches: within(error, mixed),
        }))
    }

    /// Asks for the coarser step beside images that were rendered to be seen alone, where mixtures are
    /// to be rendered on top of them: the difference of the two orders these.
    pub(super) fn complete_pair(&mut self, goal: &Goal) {
        let mixes = match self.way {
            Way::Paper => goal.or_one().count != Some(0),
            Way::Auto => goal.count.is_some_and(|n| n > 0) && !goal.asks_for_a_way(),
            Way::Alone => false,
        };
        let [_, fine] = self.coarse_pair();
        if let Some(rendering) = self.rendering.as_mut().filter(|_| mixes)
            && rendering.pool.is_some()
            && rendering.base == Some([fine; 2])
        {
            rendering.base = None;
        }
    }

    /// Chooses the steps of the images of sources alone for a goal, unless there are some, from the
    /// ways that it returns.
    pub(super) fn choose_base(&mut self, goal: &Goal) -> Result<Vec<WayForecast>, Error> {
        if self.pool().is_some() || self.is_final() {
            return Ok(Vec::new());
        }
        let asks = goal.asks_for_a_way();
        let ways = if asks { self.ways(goal)? } else { Vec::new() };
        let alone = ways.first().filter(|w| w.way == Way::Alone);
        let chosen = alone.map(|w| Quality(w.quality));
        let base = match chosen {
            Some(quality) => Some(self.base_of(quality)),
            None => self.stored_base()?,
        };
        let refined = self.refined_step();
        // Which step is fine enough, the noise of coarse images tells.
        let is_asked_for = self.way == Way::Alone && !(asks && self.samples(refined).is_some());
        let base = base.or_else(|| is_asked_for.then(|| self.base_of(refined)));
        if let (Some(rendering), Some(base)) = (&mut self.rendering, base) {
            rendering.base = Some(base);
        }
        Ok(ways)
    }

    /// Where no error is stated, takes the refined step for every source if two coarse images of each,
    /// which mixtures come on top of, would cost as much. If only a trial tells that, one source is
    /// rendered at that step; its image serves either way. Whether the step was taken.
    pub(super) fn try_refined(&mut self, goal: &Goal) -> Result<bool, Error> {
        let ([cheap, fine], refined) = (self.coarse_pair(), self.refined_step());
        let is_open = self.way == Way::Auto && goal.asks_for_a_way() && goal.until.is_some();
        let is_told = self.stated(fine, ErrorUnit::Light).is_some() || self.samples(fine).is_some();
        let is_chosen =
            self.pool().is_some() || self.rendering.as_ref().is_none_or(|r| r.base.is_some());
        if !is_open || is_told || is_chosen || self.is_final() || refined <= fine {
            return Ok(false);
        }
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let is_at_hand = self.missing(&rendering.units(), refined)? == 0;
        if !is_at_hand && !self.is_affordable(cheap, refined)? {
            return Ok(false);
        }
        if let Some(rendering) = &mut self.rendering {
            rendering.base = Some([refined; 2]);
        }
        Ok(true)
    }

    /// Whether every source at the refined step takes no longer than twice at the coarse one. Where that
    /// is not known, preparing the latter and an image of a source alone tell it.
    fn is_affordable(&mut self, cheap: Quality, refined: Quality) -> Result<bool, Error> {
        let setting = self.most_lit();
        let rendering = self.rendering.as_mut().ok_or(Error::NoSetup)?;
        let renderer = self.host.renderer.as_ref();
        let sources = rendering.sources() as f64;
        let is_known = rendering.cost(renderer, cheap) != Cost::default();
        if !is_known && rendering.sample.is_none() {
            rendering.operator(renderer, cheap, self.host.work())?;
            let one = [setting];
            let images = rendering.images(&mut self.image_cache, &self.host, refined, &one)?;
            let [setting] = one;
            rendering.sample = images.into_iter().next().map(|image| Reused {
                setting,
                image,
                quality: refined,
            });
        }
        let [coarse, fine] = [cheap, refined].map(|q| rendering.cost(renderer, q).alone(sources));
        Ok(fine <= 2.0 * coarse)
    }

    /// The setting of the source alone that gives most light over all cues, as far as levels tell.
    fn most_lit(&self) -> Vec<f64> {
        let moments = self.settings_of_cues();
        let units = self.rendering.as_ref().map_or(Vec::new(), |r| r.units());
        let lit = |unit: &Vec<f64>| -> f64 {
            let of = |moment: &Vec<f64>| moment.iter().zip(unit).map(|(s, u)| s * u).sum::<f64>();
            moments.iter().map(of).sum()
        };
        let units = units.into_iter();
        units
            .max_by(|a, b| lit(a).total_cmp(&lit(b)))
            .unwrap_or_default()
    }

    /// The finest steps at which an image of every source is at hand, if they are no coarser than what
    /// the show asks for. Where the operator states no errors, both of these are needed for an
    /// estimate, and no others serve.
    pub(super) fn stored_base(&self) -> Result<Option<[Quality; 2]>, Error> {
        let units = self.rendering.as_ref().ok_or(Error::NoSetup)?.units();
        let [cheap, fine] = self.coarse_pair();
        if self.samples(fine).is_some() {
            for quality in (fine.0..=self.finest().0).rev().map(Quality) {
                let pair = self.base_of(quality);
                let missing = pair.map(|step| self.missing(&units, step));
                if missing.into_iter().sum::<Result<usize, Error>>()? == 0 {
                    return Ok(Some(pair));
                }
            }
            return Ok(None);
        }
        if self.stated(fine, ErrorUnit::Light).is_none() {
            let complete = self.missing(&units, cheap)? + self.missing(&units, fine)? == 0;
            return Ok(complete.then_some([cheap, fine]));
        }
        for quality in (fine.0..=self.finest().0).rev().map(Quality) {
            if self.missing(&units, quality)? == 0 {
                let is_pair = quality == fine && self.missing(&units, cheap)? == 0;
                return Ok(Some([if is_pair { cheap } else { quality }, quality]));
            }
        }
        Ok(None)
    }

    /// The steps to render sources alone at instead of going on with mixtures; `None` where these
    /// are the better way, or nothing finer is.
    pub(super) fn finer_base(
        &self,
        goal: &Goal,
        forecast: &Forecast,
    ) -> Result<Option<[Quality; 2]>, Error> {
        if !goal.asks_for_a_way() || self.way == Way::Paper {
            return Ok(None);
        }
        let ways = self.ways_beyond(goal, Some(forecast))?;
        let [_, now] = self.coarse_steps();
        let taken = ways.first().filter(|w| w.way == Way::Alone);
        let finer = taken.map(|w| Quality(w.quality)).filter(|q| *q > now);
        Ok(finer.map(|quality| self.base_of(quality)))
    }

    /// What the operator states of a new pool's errors. Two steps of coarse images estimate their
    /// own error by their difference.
    pub(super) fn stated_of_pool(&self) -> Option<Stated> {
        let [cheap, fine] = self.coarse_steps();
        let samples = [cheap, fine, self.refined_step()].map(|step| self.samples(step));
        if let ([Some(less), Some(more), Some(refined)], true) = (samples, cheap < fine) {
            let sources = self.rendering.as_ref().map_or(0, |r| r.sources());
            return Some(Stated::noise([less, more, refined], sources));
        }
        let coarse = self.error_alone(fine, ErrorUnit::Light)?;
        let refined = self.stated(self.refined_step(), ErrorUnit::Light);
        let refined = refined.unwrap_or(0.0);
        Some(Stated {
            calibration: if cheap < fine { 1.0 } else { coarse },
            refined: if coarse > 0.0 {
                (refined / coarse).min(1.0)
            } else {
                0.0
            },
            noise: None,
        })
    }
}

/// Mixtures taken for a goal from where one stands: how many, the seconds until then and the error.
fn taken(
    goal: &Goal,
    start: Reach,
    steps: &[Reach],
    within: &dyn Fn(f64, usize) -> bool,
) -> (usize, f64, f64) {
    let (mut seconds, mut error) = start;
    let mut count = 0;
    for (ahead, left) in steps {
        let over = goal.budget.is_some_and(|budget| *ahead > budget);
        if within(error, count) || over {
            break;
        }
        (count, seconds, error) = (count + 1, *ahead, *left);
    }
    (count, seconds, error)
}

/// The better of two ways first: what fits into the time, then what reaches the error and is quick,
/// else what comes nearest to it.
fn compare(a: &WayForecast, b: &WayForecast, budget: Option<f64>) -> Ordering {
    let late = |w: &WayForecast| budget.is_some_and(|budget| w.seconds > budget);
    let first = (late(a), !a.reaches).cmp(&(late(b), !b.reaches));
    let quick = a.seconds.total_cmp(&b.seconds);
    let exact = a.error.total_cmp(&b.error);
    first.then(if late(a) || a.reaches {
        quick.then(exact)
    } else {
        exact.then(quick)
    })
}
