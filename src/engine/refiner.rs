//! The state machine of refinement: the next images to render, and their use.
//!
//! The blocking call, the background job and the list for a farm drive this [`Refiner`]. It never
//! renders itself, so that its jobs can run anywhere. It chooses a method once; each job is planned
//! from the current show.

use std::sync::Arc;

use super::Error;
use super::estimate::Estimate;
use super::forecast::NextImage;
use super::goal::{Ended, Goal, Refinement, RefinementSummary, TooLarge};
use super::means::Means;
use super::rendering::{self, Job, MeasuredShow, Rendered, Reused};
use super::ways::{Extent, Mixtures, WayForecast};
use crate::measure::MeasuredMoment;
use crate::measure::independent::MeasureJob;
use crate::pool::Pool;
use crate::pool::image_cache::Wanted;
use footlight_picture::Image;
use footlight_show::units::ErrorUnit;
use footlight_transport::layered::images_alone;
use footlight_transport::{Quality, Setup, TransportError};

/// The next step.
pub(super) enum Next {
    /// Render, and pass the images to [`Refiner::collect`].
    Render(Job, Box<Ticket>),
    /// Measure, and pass the errors to [`Refiner::collect_measured`].
    Measure(Box<MeasureJob>),
    /// Existing images were added.
    Added,
    /// Refinement has ended.
    Ended(Ended),
}

/// Purpose of a job's images.
pub(super) struct Ticket {
    pub setup: Setup,
    pub quality: Quality,
    /// Setting of each image.
    settings: Vec<Vec<f64>>,
    /// Existing images of some of the settings.
    found: Vec<Option<Arc<Image>>>,
    /// The addresses of the others.
    wanted: Option<Vec<Wanted>>,
    /// True for corrections, false for the pool's coarse images.
    pub refined: bool,
    /// When planning began.
    begin: f64,
    /// When rendering began.
    pub started: f64,
    /// Predicted seconds of rendering.
    pub predicted: f64,
}

impl Ticket {
    /// Number of images being rendered.
    pub fn rendering(&self) -> usize {
        self.found.iter().filter(|f| f.is_none()).count()
    }

    /// The images being rendered, for the cache; empty when they are not to be kept.
    pub fn wanted(&self) -> &[Wanted] {
        self.wanted.as_deref().unwrap_or_default()
    }
}

/// Coarse images for a future pool.
#[derive(Default)]
struct Coarse {
    /// Their setup, which an edit may change.
    setup: Option<Setup>,
    /// Images of a quality step, one for each source.
    sets: Vec<(Quality, Vec<Arc<Image>>)>,
}

/// Refines step by step until a goal is met.
pub(super) struct Refiner {
    /// The goal, with the view at its beginning.
    pub wanted: Refinement,
    /// Its extent.
    extent: Extent,
    /// The methods compared, once it has chosen.
    pub ways: Option<Vec<WayForecast>>,
    coarse: Coarse,
    pub done: RefinementSummary,
    stopping: bool,
    begin: f64,
    /// Number of images last predicted for the goal.
    needed: usize,
}

impl Refiner {
    pub fn new(wanted: Refinement, extent: Extent, now: f64) -> Refiner {
        Refiner {
            wanted: Refinement {
                goal: wanted.goal.or_one(),
                ..wanted
            },
            extent,
            ways: None,
            coarse: Coarse::default(),
            done: RefinementSummary::default(),
            stopping: false,
            begin: now,
            needed: 0,
        }
    }

    /// Number of images that the goal asks for, or is predicted to need.
    pub fn images_in_all(&self) -> usize {
        self.wanted.goal.count.unwrap_or(self.needed)
    }

    /// Ends the refinement after the current job.
    pub fn stop(&mut self) {
        self.stopping = true;
    }

    /// Plans the next job from the current show and pool. Existing refined images are added to the
    /// pool here, and the pool is created here once its coarse images exist.
    pub fn advance(&mut self, means: &mut Means<'_>) -> Result<Next, Error> {
        if self.stopping {
            return Ok(Next::Ended(Ended::Stopped));
        }
        let is_measuring_due = loop {
            // The measured error of the first images decides the method.
            let estimate = means.estimate(&self.wanted);
            if self.extent != Extent::AtOnce && estimate.is_measuring_due(&self.wanted.goal) {
                break true;
            }
            if self.ways.is_none() {
                let (goal, extent) = (&self.wanted.goal, self.extent);
                let choice = means.estimate(&self.wanted).choose(goal, extent)?;
                if choice.base.is_some() {
                    means.images.rendering(&self.wanted.view)?.base = choice.base;
                }
                self.ways = choice.ways;
            }
            if !means.estimate(&self.wanted).is_pool_due() {
                break false;
            }
            let [_, fine] = means.estimate(&self.wanted).coarse_steps();
            match self.next_coarse(means) {
                Ok(Some((job, ticket))) => return Ok(Next::Render(job, Box::new(ticket))),
                // These images may lead to finer ones.
                Ok(None) => self.make_pool(means)?,
                Err(Error::Render(error)) if self.settle(means, fine, &error) => {}
                Err(error) => return Err(error),
            }
        };
        if self.extent == Extent::Coarse {
            return Ok(Next::Ended(Ended::Counted));
        }
        let estimate = means.estimate(&self.wanted);
        if is_measuring_due {
            let job = MeasureJob::new(&estimate, means.host.work())?;
            return Ok(Next::Measure(Box::new(job)));
        }
        if let Some(ended) = estimate.ended(&self.wanted.goal, &self.done)? {
            return Ok(Next::Ended(ended));
        }
        let begin = means.now();
        let forecast = estimate.forecast(self.wanted.goal.unit())?;
        let forecast = forecast.ok_or(Error::NotRendered)?;
        let left = self.left();
        let Some(seconds) = forecast.steps.first().map(|s| s.seconds) else {
            return Ok(Next::Ended(self.nothing_left(&estimate, forecast.error)));
        };
        // The first image is always rendered, because otherwise no prediction would ever be
        // corrected.
        if self.done.images > 0 && left.budget.is_some_and(|budget| seconds > budget) {
            self.done.too_long = Some(seconds);
            return Ok(Next::Ended(Ended::Spent));
        }
        let needed = Mixtures::of(&forecast, &left, estimate.refined()).images;
        self.needed = self.done.images + needed.max(1);
        let images = match self.extent {
            Extent::AtOnce => needed.max(1),
            Extent::Coarse | Extent::Goal => 1,
        };
        let steps = forecast.steps.into_iter().take(images).collect();
        self.next_refined(means, steps, begin)
    }

    /// Reason why no image is left to render, although an error remains.
    fn nothing_left(&self, estimate: &Estimate<'_>, error: f64) -> Ended {
        let goal = &self.wanted.goal;
        let is_stated = estimate.pool().is_some_and(Pool::is_stated);
        let is_short = goal.asks_for_a_way() && is_stated && error > 0.0;
        let is_finest = estimate.coarse_steps()[1] == estimate.finest();
        match estimate.too_large() {
            Some(large) if is_short || estimate.refined_step() >= large.quality => {
                Ended::Memory(large)
            }
            _ if is_short && is_finest && goal.until.is_some() => Ended::Finest,
            _ => Ended::Complete,
        }
    }

    /// The rest of the goal.
    fn left(&self) -> Goal {
        let Goal {
            until,
            count,
            budget,
        } = self.wanted.goal;
        Goal {
            until,
            count: count.map(|count| count.saturating_sub(self.done.images)),
            budget: budget.map(|seconds| seconds - self.done.seconds),
        }
    }

    /// A job for refined images, or existing ones.
    fn next_refined(
        &mut self,
        means: &mut Means<'_>,
        steps: Vec<NextImage>,
        begin: f64,
    ) -> Result<Next, Error> {
        let predicted: f64 = steps.iter().map(|s| s.seconds).sum();
        let settings: Vec<Vec<f64>> = steps.into_iter().map(|s| s.setting).collect();
        let quality = means.estimate(&self.wanted).refined_step();
        let store = means.host.store.as_ref();
        let (image_cache, of_view) = means.images.split(&self.wanted.view)?;
        let rendering = &mut of_view.rendering;
        let place = rendering.pool.as_ref().map_or(0, |p| p.refined().len());
        let (found, missing) = rendering.find(image_cache, quality, &settings, Some(place), store);
        let ticket = Ticket {
            setup: rendering.setup.clone(),
            quality,
            settings,
            found,
            wanted: missing.wanted,
            refined: true,
            begin,
            started: means.host.clock.seconds(),
            predicted,
        };
        if missing.settings.is_empty() {
            self.add(means, ticket, Vec::new())?;
            return Ok(Next::Added);
        }
        let memory = means.host.memory;
        let job = rendering.new_job(quality, missing.settings, memory);
        Ok(Next::Render(job, Box::new(ticket)))
    }

    /// The next job for coarse images; `None` once all exist.
    fn next_coarse(&mut self, means: &mut Means<'_>) -> Result<Option<(Job, Ticket)>, Error> {
        let [cheap, fine] = means.estimate(&self.wanted).coarse_steps();
        let host = means.host;
        let (renderer, store) = (host.renderer.as_ref(), host.store.as_ref());
        let pace = means.images.pace;
        let (image_cache, of_view) = means.images.split(&self.wanted.view)?;
        let rendering = &mut of_view.rendering;
        if self.coarse.setup.as_ref() != Some(&rendering.setup) {
            self.coarse = Coarse {
                setup: Some(rendering.setup.clone()),
                ..Coarse::default()
            };
        }
        // An edit may have changed the steps since the last job.
        let sets = &mut self.coarse.sets;
        sets.retain(|(quality, _)| [cheap, fine].contains(quality));
        let units = rendering.units();
        for quality in rendering::each_step([cheap, fine]) {
            if self.coarse.sets.iter().any(|(q, _)| *q == quality) {
                continue;
            }
            let (found, missing) = rendering.find(image_cache, quality, &units, None, store);
            if missing.settings.is_empty() {
                let images = rendering::in_order(found, Vec::new());
                self.coarse.sets.push((quality, images));
                continue;
            }
            let later = if quality < fine {
                let at_hand = rendering.at_hand(image_cache, fine, &units, store);
                at_hand.iter().filter(|there| !**there).count()
            } else {
                0
            };
            let held = image_cache.bytes();
            let (images, memory) = (missing.settings.len() + later, host.memory);
            rendering.check_images(renderer, images, (memory, held))?;
            let cost = rendering.cost_of_units(renderer, quality, missing.settings.len());
            let now = host.clock.seconds();
            let ticket = Ticket {
                setup: rendering.setup.clone(),
                quality,
                settings: units,
                found,
                wanted: missing.wanted,
                refined: false,
                begin: now,
                started: now,
                predicted: cost * pace.seconds(),
            };
            let job = rendering.new_job(quality, missing.settings, memory);
            return Ok(Some((job, ticket)));
        }
        Ok(None)
    }

    /// Creates the pool from the existing coarse images, with the refined images of this session
    /// and earlier ones.
    fn make_pool(&mut self, means: &mut Means<'_>) -> Result<(), Error> {
        let mut coarse = std::mem::take(&mut self.coarse);
        coarse.sets.sort_by_key(|(quality, _)| *quality);
        let mut finest_first = coarse.sets.into_iter().rev().map(|(_, images)| images);
        let images = finest_first.next().ok_or(Error::NotRendered)?;
        // A single quality step has no coarser images.
        let coarser = finest_first.next().unwrap_or_default();
        let pool = Pool::new(images, coarser, means.host.work())?;
        let estimate = means.estimate(&self.wanted);
        let (stated, steps) = (estimate.stated_of_pool(), estimate.coarse_steps());
        let (image_cache, of_view) = means.images.split(&self.wanted.view)?;
        let rendering = &mut of_view.rendering;
        let exact: Vec<bool> = images_alone(&rendering.setup.rig).collect();
        rendering.pool = Some(pool.stating(stated, &exact)?);
        rendering.pool_base = Some(steps);
        rendering::trim(image_cache, means.host.memory);
        of_view.steps.clear();
        means.record(&self.wanted, self.begin)?;
        means.reuse_refined(&self.wanted)
    }

    /// Takes a job's operator, if the setup is still the job's, and its images. A cancelled job has
    /// no images but returns its operator.
    ///
    /// # Errors
    /// The error of rendering, including a cancel; adding the images may fail too.
    pub fn collect(
        &mut self,
        means: &mut Means<'_>,
        ticket: Ticket,
        rendered: Rendered,
    ) -> Result<(), Error> {
        let Ok(rendering) = means.images.rendering(&self.wanted.view) else {
            return Ok(());
        };
        let same = rendering.setup == ticket.setup;
        if same {
            rendering.return_operator(ticket.quality, rendered.operator);
        }
        let images = match rendered.images {
            Err(error) if same && self.settle(means, ticket.quality, &error) => return Ok(()),
            images => images?,
        };
        let (image_cache, of_view) = means.images.split(&self.wanted.view)?;
        let rendering = &mut of_view.rendering;
        let has_pool = rendering.pool.is_some();
        let store = means.host.store.as_ref();
        let kept = rendering::take_in(image_cache, ticket.wanted.as_deref(), images, store);
        rendering::trim(image_cache, means.host.memory);
        let seconds = means.host.clock.seconds() - ticket.started;
        // Existing images tell nothing about rendering time.
        if ticket.found.iter().all(Option::is_none) {
            if !ticket.refined {
                rendering.taken.insert(ticket.quality.0, seconds);
            }
            means.images.pace.learn(ticket.predicted, seconds);
        }
        if !ticket.refined {
            // In a goal of a number of images, only mixtures count.
            if self.wanted.goal.count.is_none() {
                self.done.images += kept.len();
                self.done.seconds += seconds;
            }
            if self.coarse.setup.as_ref() == Some(&ticket.setup) {
                let images = rendering::in_order(ticket.found, kept);
                self.coarse.sets.push((ticket.quality, images));
            }
            return Ok(());
        }
        // For another rig they are used once its pool is created.
        if !same || !has_pool {
            self.done.images += kept.len();
            self.done.seconds += seconds;
            return Ok(());
        }
        self.add(means, ticket, kept)
    }

    /// Continues without a quality step that does not fit into memory, after operators of other
    /// steps are dropped; false for other errors, and when no coarser images can serve.
    fn settle(&mut self, means: &mut Means<'_>, quality: Quality, error: &TransportError) -> bool {
        let &TransportError::Memory { needed, budget, .. } = error else {
            return false;
        };
        let pair = means.estimate(&self.wanted).coarse_pair();
        let allowed = means.host.memory + means.document.loaded_bytes();
        let memory = allowed.saturating_add(needed.saturating_sub(budget));
        let Ok(rendering) = means.images.rendering(&self.wanted.view) else {
            return false;
        };
        if rendering.has_other_operators(quality) {
            rendering.keep_operators(&[quality.0]);
            return true;
        }
        let known = rendering.pool_base.filter(|_| rendering.pool.is_some());
        let least = known.unwrap_or(pair);
        let is_finer = quality > least[1];
        if is_finer {
            rendering.keep_operators(&[]);
            rendering.too_large = Some(TooLarge { quality, memory });
            rendering.base = Some(least);
            (self.ways, self.coarse) = (None, Coarse::default());
        }
        is_finer
    }

    /// Takes measured errors, which may lead to another method.
    pub fn collect_measured(
        &mut self,
        means: &mut Means<'_>,
        job: &MeasureJob,
        (mut moments, seconds): (Vec<MeasuredMoment>, f64),
    ) -> Result<(), Error> {
        let estimate = means.estimate(&self.wanted);
        let now = estimate.step_error(job.quality, ErrorUnit::Light);
        let now = now.unwrap_or(0.0);
        let document = means.document;
        let rendering = means.images.rendering(&self.wanted.view)?;
        if rendering.setup != job.setup {
            return Ok(());
        }
        let before = rendering.measured_at(job.quality, document);
        let expected = before.map_or(now, |before| before.expected);
        let is_new = |m: &&MeasuredMoment| !moments.iter().any(|new| new.time == m.time);
        let kept: Vec<MeasuredMoment> = before
            .iter()
            .flat_map(|before| &before.moments)
            .filter(is_new)
            .copied()
            .collect();
        moments.extend(kept);
        let likely = |m: &MeasuredMoment| m.measured.likely(expected);
        moments.sort_by(|a, b| likely(b).total_cmp(&likely(a)));
        let error = moments.first().map_or(now, likely);
        let in_all = seconds + before.map_or(0.0, |before| before.seconds);
        if now > 0.0 {
            rendering.error_scale *= error / now;
        }
        rendering.measured.retain(|m| m.quality != job.quality);
        rendering.measured.push(MeasuredShow {
            quality: job.quality,
            revision: document.revision(),
            moments,
            error,
            expected,
            effort: job.effort,
            seconds: in_all,
        });
        let stated = means.estimate(&self.wanted).stated_of_pool();
        let rendering = means.images.rendering(&self.wanted.view)?;
        if let (Some(pool), Some(stated)) = (&mut rendering.pool, stated) {
            pool.restate(stated);
        }
        self.done.seconds += seconds;
        self.ways = None;
        means.record(&self.wanted, means.now())
    }

    /// Adds refined images to the pool, in the order of their settings.
    fn add(
        &mut self,
        means: &mut Means<'_>,
        ticket: Ticket,
        rendered: Vec<Arc<Image>>,
    ) -> Result<(), Error> {
        let images = rendering::in_order(ticket.found, rendered);
        self.done.images += images.len();
        let pairs = ticket.settings.into_iter().zip(images);
        let quality = ticket.quality;
        let refined = pairs.map(|(setting, image)| Reused {
            setting,
            image,
            quality,
        });
        means.add_refined(&self.wanted, refined.collect(), ticket.begin)?;
        self.done.seconds += means.now() - ticket.begin;
        Ok(())
    }

    /// Abandons a job that will never return: its operator is lost.
    pub fn abandon(&mut self, means: &mut Means<'_>, ticket: &Ticket) {
        if let Ok(rendering) = means.images.rendering(&self.wanted.view) {
            rendering.return_operator(ticket.quality, None);
        }
    }
}
