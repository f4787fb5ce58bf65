//! A design session, measured as it goes: how good the sequence was, and what it had cost, at every
//! moment of it.
//!
//! The measure is the paper's (its Figure 7): 1 - error / (error of coarse pictures alone), 0 while
//! nothing is refined, 1 where the sequence is as if all of it were. Seconds are what coarse images,
//! edits, plans and refined images take; measuring, and rendering the truth to measure against, are
//! not counted.

use std::borrow::Borrow;

use super::measure::Origin;
use super::{Ended, Engine, Error, Goal};
use crate::lang::edit::Edit;
use crate::linalg::Matrix;
use crate::picture::Image;
use crate::picture::combine::{combine, dot};
use crate::plan::{self, Metric};
use crate::renderer::{Quality, Setup};
use crate::work::Cancelled;

/// A command of a session: declarations that change the show, or a goal of refinement.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// The line where it begins, from 1.
    pub line: usize,
    /// As it is written.
    pub text: String,
    /// What to refine to; `None` for declarations.
    pub goal: Option<Goal>,
}

/// Every moment of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The show and the machine.
    pub origin: Origin,
    /// The quality of the pictures that stand for the truth; `None` where there were none.
    pub truth: Option<u8>,
    /// What chose the pictures, where it was not the best that they allow.
    pub metric: Option<Metric>,
    /// In the order of time.
    pub moments: Vec<Moment>,
}

/// What happened before a moment was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The coarse pictures were rendered.
    Coarse,
    /// Refined pictures were added.
    Refined,
    /// The show was edited.
    Edit,
}

/// Errors of the sequence, relative, beside those of its coarse pictures alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// With the pool as it is.
    pub now: f64,
    /// With coarse pictures alone.
    pub coarse: f64,
}

impl Errors {
    /// 1 - error / (error of coarse alone); `None` where coarse pictures have no error.
    pub fn quality(self) -> Option<f64> {
        (self.coarse > 0.0).then(|| 1.0 - self.now / self.coarse)
    }
}

/// A moment of the session.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// What happened before it.
    pub cause: Cause,
    /// The command that brought it; `None` for the first coarse pictures.
    pub command: Option<Command>,
    /// Seconds of computing so far.
    pub seconds: f64,
    /// Refined pictures in the pool.
    pub refined: usize,
    /// As the plan knows them.
    pub predicted: Errors,
    /// Against pictures of the refined quality throughout, if they were rendered.
    pub truth: Option<Errors>,
}

/// Every source alone at the refined quality, and what that was rendered of.
struct Truth {
    setup: Setup,
    quality: Quality,
    images: Vec<Image>,
}

/// A session being measured.
pub struct Session {
    wanted: bool,
    truth: Option<Truth>,
    moments: Vec<Moment>,
    /// Seconds that count.
    spent: f64,
    /// When counting began again.
    mark: f64,
    /// The store on disk, which is not asked meanwhile: what an earlier session stored would take
    /// no time in this one.
    store: Option<crate::pool::disk_cache::DiskCache>,
}

impl Session {
    /// Begins a session on the show as it stands with its coarse images; with `truth` every moment
    /// is also measured against images of the refined quality throughout. It must be ended.
    ///
    /// # Errors
    /// As [`Engine::coarse`].
    pub fn begin(engine: &mut Engine, truth: bool) -> Result<Session, Error> {
        let mut session = Session {
            wanted: truth,
            truth: None,
            moments: Vec::new(),
            spent: 0.0,
            mark: engine.now(),
            store: engine.image_cache.disk_cache.take(),
        };
        let begun = engine.coarse();
        let measured = begun.and_then(|()| session.measure(engine, Cause::Coarse, None));
        match measured {
            Ok(()) => Ok(session),
            Err(error) => {
                session.end(engine);
                Err(error)
            }
        }
    }

    /// Runs a command and measures after it, after each call of the operator as well.
    ///
    /// # Errors
    /// What the command says; what is finished is kept.
    pub fn run(&mut self, engine: &mut Engine, command: &Command) -> Result<(), Error> {
        let Some(goal) = command.goal else {
            engine.edit(&Edit::Declare(command.text.clone()))?;
            engine.coarse()?;
            return self.measure(engine, Cause::Edit, Some(command));
        };
        let done = engine.refine_watched(goal, &mut |engine| {
            self.measure(engine, Cause::Refined, Some(command))
        })?;
        match done.ended {
            Some(Ended::Stopped) => Err(Cancelled.into()),
            _ => Ok(()),
        }
    }

    /// Ends the session; what was measured.
    pub fn end(self, engine: &mut Engine) -> Measured {
        engine.image_cache.disk_cache = self.store;
        Measured {
            origin: engine.origin(),
            truth: self.wanted.then(|| engine.refined_step().0),
            metric: engine.metric(),
            moments: self.moments,
        }
    }

    /// Adds a moment; the clock stands still meanwhile.
    fn measure(
        &mut self,
        engine: &mut Engine,
        cause: Cause,
        command: Option<&Command>,
    ) -> Result<(), Error> {
        self.spent += engine.now() - self.mark;
        let predicted = predicted_errors(engine)?;
        let truth = match self.wanted {
            false => None,
            true => Some(true_errors(engine, &mut self.truth)?),
        };
        self.moments.push(Moment {
            cause,
            command: command.cloned(),
            seconds: self.spent,
            refined: engine.refined(),
            predicted,
            truth,
        });
        self.mark = engine.now();
        Ok(())
    }
}

fn predicted_errors(engine: &Engine) -> Result<Errors, Error> {
    let pool = engine.rendered()?;
    if engine.is_final() || pool.has_no_estimated_error() {
        return Ok(Errors::default());
    }
    // The truth is of the refined step: what that is off by itself has no place here.
    let keys = engine.document.keys();
    let norm = match pool.is_relative() {
        true => None,
        false => Some(plan::sequence_norm(pool.gram(), &plan::second_moment(keys))),
    };
    let left = |settings: &[Vec<f64>]| plan::forecast(keys, settings, pool.weighting(), norm);
    let (now, alone) = (left(&pool.settings())?, left(&[])?);
    let now = now * pool.calibration();
    let coarse = alone * pool.calibration();
    Ok(Errors { now, coarse })
}

fn true_errors(engine: &Engine, known: &mut Option<Truth>) -> Result<Errors, Error> {
    let rendering = engine.rendering.as_ref().ok_or(Error::NoSetup)?;
    let pool = engine.rendered()?;
    let units = rendering.units();
    let quality = engine.refined_step();
    let same = |t: &Truth| t.quality == quality && t.setup == rendering.setup;
    let truth = match known.take().filter(same) {
        Some(truth) => truth,
        None => Truth {
            setup: rendering.setup.clone(),
            quality,
            images: engine.render_alone(&units, quality, 0)?.0,
        },
    };
    let truth = &known.insert(truth).images;
    // The preview is linear: what it shows of each source alone is all of it.
    let work = engine.host.work();
    let mut shown = Vec::new();
    for unit in &units {
        work.check()?;
        shown.push(pool.preview(unit, work)?);
    }
    let moment = plan::second_moment(engine.document.keys());
    let threads = engine.host.threads;
    Ok(Errors {
        now: sequence_error(&shown, truth, &moment, threads),
        coarse: sequence_error(pool.coarse(), truth, &moment, threads),
    })
}

/// The error of a sequence shown with `shown` in place of `reference` (a picture for each
/// coordinate at unit setting): sqrt of ∫‖I - I_ref‖² dt / ∫‖I_ref‖² dt, exactly, as the quadratic
/// form of the differences' and the references' Gram matrices with the second moment of the
/// settings, ∫ L·Lᵀ dt. 0 for a sequence without light.
pub fn sequence_error<I: Borrow<Image>>(
    shown: &[I],
    reference: &[Image],
    moment: &Matrix,
    threads: usize,
) -> f64 {
    let off = |(a, b): (&I, &Image)| {
        let terms = [(1.0, a.borrow()), (-1.0, b)];
        combine((b.width(), b.height()), &terms, threads)
    };
    let differences: Vec<Image> = shown.iter().zip(reference).map(off).collect();
    let (error, all) = (energy(&differences, moment), energy(reference, moment));
    if all > 0.0 { (error / all).sqrt() } else { 0.0 }
}

/// Σ_ij M_ij <P_i, P_j>; the moment is symmetric.
fn energy(pictures: &[Image], moment: &Matrix) -> f64 {
    let mut sum = 0.0;
    for (i, (a, row)) in pictures.iter().zip(moment.row_iter()).enumerate() {
        for (j, (b, weight)) in pictures.iter().zip(row.iter()).enumerate().take(i + 1) {
            if *weight != 0.0 {
                sum += if i == j { 1.0 } else { 2.0 } * weight * dot(a, b);
            }
        }
    }
    sum.max(0.0)
}
