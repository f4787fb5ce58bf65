//! A design session from a file, measured as it goes.
//!
//! The file holds what would be typed: declarations, which may take several lines, and goals of
//! refinement. Seconds are what coarse images, edits, plans and refined images take; measuring, and
//! rendering the truth to measure against, are not counted.

use super::{Ended, Engine, Error, Goal};
use crate::lang::edit::Edit;
use crate::picture::Image;
use crate::plan;
use crate::renderer::{Quality, Setup};
use crate::study::session::{self, Errors, Event, Moment};
use crate::work::Cancelled;

/// A command of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Declarations that change the show.
    Edit(String),
    /// Refinement.
    Refine(Goal),
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
        let measured = begun.and_then(|()| session.measure(engine, Event::Coarse, None));
        match measured {
            Ok(()) => Ok(session),
            Err(error) => {
                session.end(engine);
                Err(error)
            }
        }
    }

    /// Runs a command and measures after it, after each call of the operator as well; `said` is
    /// where it stands and how it was written.
    ///
    /// # Errors
    /// What the command says; what is finished is kept.
    pub fn run(
        &mut self,
        engine: &mut Engine,
        command: &Command,
        said: session::Command,
    ) -> Result<(), Error> {
        match command {
            Command::Edit(text) => {
                engine.edit(&Edit::Declare(text.clone()))?;
                engine.coarse()?;
                self.measure(engine, Event::Edit, Some(said))
            }
            Command::Refine(goal) => {
                let done = engine.refine_watched(*goal, &mut |engine| {
                    self.measure(engine, Event::Refined, Some(said.clone()))
                })?;
                match done.ended {
                    Some(Ended::Stopped) => Err(Cancelled.into()),
                    _ => Ok(()),
                }
            }
        }
    }

    /// Ends the session; what was measured.
    pub fn end(self, engine: &mut Engine) -> Vec<Moment> {
        engine.image_cache.disk_cache = self.store;
        self.moments
    }

    /// Adds a moment; the clock stands still meanwhile.
    fn measure(
        &mut self,
        engine: &mut Engine,
        event: Event,
        command: Option<session::Command>,
    ) -> Result<(), Error> {
        self.spent += engine.now() - self.mark;
        let predicted = predicted_errors(engine)?;
        let truth = match self.wanted {
            false => None,
            true => Some(true_errors(engine, &mut self.truth)?),
        };
        self.moments.push(Moment {
            event,
            command,
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
    let now = engine.predicted_error()?;
    if engine.is_final() || pool.flawless() {
        return Ok(Errors { now, coarse: 0.0 });
    }
    let norm = Some(engine.sequence_norm(pool));
    let alone = plan::forecast(engine.document.keys(), &[], &pool.weighting(), norm)?;
    let coarse = alone * engine.calibration();
    Ok(Errors { now, coarse })
}

fn true_errors(engine: &Engine, known: &mut Option<Truth>) -> Result<Errors, Error> {
    let rendering = engine.rendering.as_ref().ok_or(Error::NoSetup)?;
    let pool = engine.rendered()?;
    let units = rendering.units();
    let quality = engine.refined_step();
    let same = |t: &Truth| t.quality == quality && t.setup == rendering.setup;
    if !known.as_ref().is_some_and(same) {
        *known = Some(Truth {
            setup: rendering.setup.clone(),
            quality,
            images: engine.render_alone(&units, quality)?.0,
        });
    }
    let truth = known.as_ref().map_or(&[][..], |t| t.images.as_slice());
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
        now: session::sequence_error(&shown, truth, &moment, threads),
        coarse: session::sequence_error(pool.coarse(), truth, &moment, threads),
    })
}
