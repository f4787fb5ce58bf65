//! What each step of quality sets and costs for a show: predicted, and measured when asked.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::Machine;
use super::comparison::{alone_each, bank_names};
use crate::{Engine, Error};
use footlight_picture::Image;
use footlight_transport::{Quality, QualityParameter, Transport as _};

/// A step is measured again while all its runs took less than this, seconds; the shortest counts.
const ENOUGH: f64 = 0.5;
/// But not more often than this.
const RUNS: usize = 3;

/// Seconds of the three things that one waits for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seconds {
    /// Before the first picture.
    pub prepare: f64,
    /// Every bank alone, after that.
    pub banks: f64,
    /// One more picture of banks that were all lit before.
    pub picture: f64,
}

impl Seconds {
    /// What all banks take from nothing.
    pub fn total(&self) -> f64 {
        self.prepare + self.banks
    }
}

/// A step of quality for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Its number.
    pub quality: u8,
    /// What it sets.
    #[serde(serialize_with = "by_name")]
    pub sets: Vec<QualityParameter>,
    /// As predicted.
    pub predicted: Seconds,
    /// As measured, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<Seconds>,
}

/// Every step of the scale for a show.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QualityForecast {
    /// The show's title.
    pub show: String,
    /// The operator.
    pub operator: String,
    /// Where.
    pub machine: Machine,
    /// Seconds of the operator's unit of cost here and now.
    pub pace: f64,
    /// Cheapest first.
    pub steps: Vec<Step>,
}

fn by_name<S: Serializer>(sets: &[QualityParameter], out: S) -> Result<S::Ok, S::Error> {
    let named: BTreeMap<&str, f64> = sets.iter().map(|e| (e.name, e.amount)).collect();
    named.serialize(out)
}

/// What each step of quality sets for this show and what it will cost; also what it does cost,
/// when `measure`d.
///
/// # Errors
/// [`Error::NoSetup`], [`Error::NoBanks`], else what rendering says.
pub fn measure(engine: &Engine, measure: bool) -> Result<QualityForecast, Error> {
    let settings = alone_each(engine, &bank_names(engine)?)?;
    // Three for an rgb bank; the fixed lights are a source that no bank lights.
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
        let step = Quality(quality);
        let sets = operator.quality_parameters(&rendering.setup, step)?;
        let cost = operator.cost(&rendering.setup, step);
        let predicted = Seconds {
            prepare: cost.prepare * pace,
            banks: (cost.per_source * sources + cost.per_lone * settings.len() as f64) * pace,
            picture: cost.per_image * pace,
        };
        out.steps.push(Step {
            quality,
            sets,
            predicted,
            measured: None,
        });
    }
    if measure {
        let total = out.steps.len();
        for (done, step) in out.steps.iter_mut().enumerate() {
            engine.host.progress.report("measuring steps", done, total);
            step.measured = Some(measured(engine, &settings, Quality(step.quality), 0)?.1);
        }
    }
    Ok(out)
}

/// Pictures of settings at a quality, from nothing prepared, and the seconds of the fastest of
/// a few runs.
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

/// All of the settings at once.
fn together(settings: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = settings.first().map_or(0, Vec::len);
    let sum = |c: usize| settings.iter().filter_map(|s| s.get(c)).sum();
    (0..coordinates).map(sum).collect()
}
