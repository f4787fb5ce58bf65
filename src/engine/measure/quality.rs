//! Predicted seconds of each quality step for a show.

use serde::Serialize;

use super::Machine;
use crate::{Engine, Error};
use footlight_transport::{Quality, Transport as _};

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
    let document = engine.document();
    let home = document.home();
    let banks = engine.show().banks.iter();
    let settings: Vec<Vec<f64>> = banks
        .map(|bank| document.alone(&bank.name, &home))
        .collect::<Result<_, _>>()?;
    if settings.is_empty() {
        return Err(Error::NoBanks);
    }
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

/// The sum of all settings.
fn together(settings: &[Vec<f64>]) -> Vec<f64> {
    let coordinates = settings.first().map_or(0, Vec::len);
    let sum = |c: usize| settings.iter().filter_map(|s| s.get(c)).sum();
    (0..coordinates).map(sum).collect()
}
