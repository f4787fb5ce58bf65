//! What refining brings: the sequence's true error against refined pictures and against seconds, in
//! every order that was thought of, and as every preview shows it.
//!
//! The truth is every source at the refined quality; the mathematics is [`Trial`]'s. All orders are
//! shown by the shipped preview, so that they differ in their pictures alone; all previews show the
//! pictures of the shipped order. Two bounds stand beside the metrics: a picture for each source,
//! the best first, and an oracle that knows the true errors.

use super::verdict::{Previewed, previewed};
use super::{Order, Origin, Trial};
use crate::plan::{Metric, PlanError};
use crate::pool::Projection;
use crate::renderer::Cost;

/// The orders that are compared.
const ORDERS: [Order; 5] = [
    Order::SHIPPED,
    Order::Metric {
        metric: Metric::Settings,
        time_weighted: true,
    },
    Order::Metric {
        metric: Metric::Influence,
        time_weighted: true,
    },
    Order::BankByBank,
    Order::Oracle,
];

/// Errors and seconds by order and by preview.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// The show and the machine.
    pub origin: Origin,
    /// A curve for each order of pictures, as the shipped preview shows them.
    pub orders: Vec<OrderCurve>,
    /// A curve for each preview, of the pictures in the shipped order.
    pub previews: Vec<PreviewCurve>,
    /// How each preview does on looks that nobody planned.
    pub looks: Vec<Previewed>,
}

/// An order of pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct OrderCurve {
    /// Which.
    pub order: Order,
    /// After no refined picture, after one, and so on.
    pub points: Vec<OrderPoint>,
}

/// Where the sequence stands after some refined pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrderPoint {
    /// True error of the sequence, relative.
    pub error: f64,
    /// Seconds from the start as predicted, coarse pictures among them.
    pub predicted: f64,
    /// Seconds from the start as they were; NaN where that is not known.
    pub real: f64,
}

/// A preview of pictures in the shipped order.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewCurve {
    /// Which.
    pub projection: Projection,
    /// True errors of the sequence, relative, after no refined picture, after one, and so on.
    pub errors: Vec<f64>,
}

/// Seconds of everything, as predicted and as they were.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Both coarse qualities of every source: predicted, real.
    pub coarse: [f64; 2],
    /// Predicted cost of refined pictures, in seconds.
    pub cost: Cost,
    /// Real seconds to prepare the refined quality.
    pub prepare: f64,
    /// Real seconds of the pictures of the shipped order, one after the other. Other orders of
    /// mixed pictures are taken to cost the same: each lights all sources with its first.
    pub mixed: Vec<f64>,
    /// Real seconds of every source alone.
    pub alone: Vec<f64>,
}

impl Refinement {
    /// All curves; `seed` draws the looks that previews are tried on.
    ///
    /// # Errors
    /// [`PlanError`]
    pub fn new(
        origin: Origin,
        trial: &Trial,
        seconds: &Seconds,
        seed: u64,
    ) -> Result<Refinement, PlanError> {
        let curve = |order: Order| order_curve(trial, seconds, order);
        let orders: Result<_, PlanError> = ORDERS.into_iter().map(curve).collect();
        let shipped = trial.ordered(Order::SHIPPED)?;
        let curve = |projection: Projection| preview_curve(trial, &shipped, projection);
        let previews: Result<_, PlanError> = Projection::ALL.into_iter().map(curve).collect();
        Ok(Refinement {
            origin,
            orders: orders?,
            previews: previews?,
            looks: previewed(trial, seed)?,
        })
    }
}

impl OrderCurve {
    /// The first number of pictures after which the error is within `share` of the start's.
    pub fn needed(&self, share: f64) -> Option<usize> {
        let start = self.points.first()?.error;
        self.points.iter().position(|p| p.error <= share * start)
    }
}

fn order_curve(trial: &Trial, seconds: &Seconds, order: Order) -> Result<OrderCurve, PlanError> {
    let settings = trial.ordered(order)?;
    let mut points = Vec::new();
    for m in 0..=settings.len() {
        let taken = settings.get(..m).unwrap_or(&settings);
        points.push(OrderPoint {
            error: trial.error(&trial.shown(Projection::default(), taken)?),
            predicted: seconds.predicted(taken),
            real: seconds.real(order, taken),
        });
    }
    Ok(OrderCurve { order, points })
}

fn preview_curve(
    trial: &Trial,
    settings: &[Vec<f64>],
    projection: Projection,
) -> Result<PreviewCurve, PlanError> {
    let mut errors = Vec::new();
    for m in 0..=settings.len() {
        let taken = settings.get(..m).unwrap_or(settings);
        errors.push(trial.error(&trial.shown(projection, taken)?));
    }
    Ok(PreviewCurve { projection, errors })
}

impl Seconds {
    /// Predicted seconds until these pictures are there.
    fn predicted(&self, taken: &[Vec<f64>]) -> f64 {
        let [coarse, _] = self.coarse;
        if taken.is_empty() {
            return coarse;
        }
        let lit = |source: usize| {
            taken
                .iter()
                .any(|s| s.get(source).is_some_and(|x| *x != 0.0))
        };
        let sources = taken.iter().map(Vec::len).max().unwrap_or(0);
        let lit = (0..sources).filter(|i| lit(*i)).count() as f64;
        let each = taken.len() as f64 * self.cost.per_image;
        coarse + self.cost.prepare + lit * self.cost.per_source + each
    }

    /// Real seconds until then.
    fn real(&self, order: Order, taken: &[Vec<f64>]) -> f64 {
        let [_, coarse] = self.coarse;
        if taken.is_empty() {
            return coarse;
        }
        let source = |s: &Vec<f64>| s.iter().position(|x| *x != 0.0);
        let last = self.mixed.last().copied().unwrap_or(f64::NAN);
        let each = |(place, setting): (usize, &Vec<f64>)| match order {
            Order::BankByBank => source(setting).and_then(|i| self.alone.get(i).copied()),
            _ => Some(self.mixed.get(place).copied().unwrap_or(last)),
        };
        let all = taken.iter().enumerate().map(each);
        coarse + self.prepare + all.map(|s| s.unwrap_or(f64::NAN)).sum::<f64>()
    }
}
