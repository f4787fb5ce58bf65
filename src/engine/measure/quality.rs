//! Predicted seconds of each quality step for a show.

use serde::Serialize;

use super::Machine;
use super::comparison::{alone_each, bank_names};
use crate::{Engine, Error};
use footlight_picture::Image;
use footlight_transport::{Quality, Transport as _};

/// A step is measured repeatedly while its runs took less than this in total, seconds; the shortest
/// counts.
const ENOUGH: f64 = 0.5;
/// Most runs of a step.
const RUNS: usize = 3;

/// Durations that matter to a user, seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seconds {
    /// Before the first image.
    pub prepare: f64,
    /// Every bank alone, after preparation.
    pub banks: f64,
    /// One more image of banks that were all lit before.
    pub picture: f64,
}

impl Seconds {
    /// Time of all banks including preparation.
    pub fn total(&self) -> f64 {
        self.prepare + self.banks
    }
}

/// A quality step for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityStep {
    /// Its number.
    pub quality: u8,
    /// Predicted durations.
    pub predicted: Seconds,
}

/// Every quality step for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityForecast {
    /// The show's title.
    pub show: String,
    /// The operator.
    pub operator: String,
    /// The machine.
    pub machine: Machine,
    /// Seconds per unit of the operator's cost, on this machine now.
    pub pace: f64,
    /// Steps, the cheapest first.
    pub steps: Vec<QualityStep>,
}

/// Predicted seconds of each quality step for this show.
///
/// # Errors
/// [`Error::NoSetup`], [`Error::NoBanks`], or an error of rendering.
pub fn predict(engine: &Engine) -> Result<QualityForecast, Error> {
    let settings = alone_each(engine, &bank_names(engine)?)?;
    // Three for an rgb bank; the fixed lights are a further source.
    let sources = together(&settings).iter().filter(|s| **s != 0.0).count() as f64;
    let estimate = engine.estimate();
    let rendering = estimate.rendering()?;
    let operator = rendering.layered(engine.host.renderer.as_ref());
    let pace = estimate.measure_pace()?;
    let mut out = QualityForecast {
        show: engine.show().title.clone(),
        operator: operator.name().to_owned(),
        machine: Machine::of(engine.host()),
        pace,
        steps: Vec::new(),
    };
    for quality in 1..=operator.finest().0 {
        let cost = operator.cost(&rendering.setup, Quality(quality));
        let predicted = Seconds {
            prepare: cost.prepare * pace,
            banks: (cost.per_source * sources + cost.per_lone * settings.len() as f64) * pace,
            picture: cost.per_image * pace,
        };
        out.steps.push(QualityStep { quality, predicted });
    }
    Ok(out)
}

/// Images of settings at a quality step including preparation, and the seconds of the fastest of a
/// few runs.
pub(super) fn measured(
    engine: &Engine,
    settings: &[Vec<f64>],
    quality: Quality,
    held: usize,
) -> Result<(Vec<Image>, Seconds), Error> {
    let mut best = measured_once(engine, settings, quality, held)?;
    let mut spent = best.1.total() + best.1.picture;
    for _ in 1..RUNS {
        if spent > ENOUGH {
            break;
        }
        let found = measured_once(engine, settings, quality, held)?;
        spent += found.1.total() + found.1.picture;
        if found.1.total() < best.1.total() {
            best = found;
        }
    }
    Ok(best)
}

fn measured_once(
    engine: &Engine,
    settings: &[Vec<f64>],
    quality: Quality,
    held: usize,
) -> Result<(Vec<Image>, Seconds), Error> {
    let estimate = engine.estimate();
    let rendering = estimate.rendering()?;
    let (work, clock) = (engine.work().holding(held), engine.host.clock.as_ref());
    let begin = clock.seconds();
    let mut operator = rendering.prepare(engine.host.renderer.as_ref(), quality, work)?;
    let prepared = clock.seconds();
    let images = operator.render(settings, work)?;
    let done = clock.seconds();
    operator.render(&[together(settings)], work)?;
    let seconds = Seconds {
        prepare: prepared - begin,
        banks: done - prepared,
        picture: clock.seconds() - done,
    };
    Ok((images, seconds))
}

/// The sum of all settings.
fn together(settings: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = settings.first().map_or(0, Vec::len);
    let sum = |c: usize| settings.iter().filter_map(|s| s.get(c)).sum();
    (0..coordinates).map(sum).collect()
}
