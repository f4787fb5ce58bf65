//! What each step of quality sets and costs: predicted, and measured when asked.

use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

use crate::renderer::QualityParameter;
use crate::study::Machine;

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
pub struct Forecast {
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
