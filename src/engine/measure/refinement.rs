//! What refining brings: the worst moment's true error against refined images and against seconds, by
//! the order in which images are refined.
//!
//! The truth is every source at the refined quality; the mathematics is [`Trial`]'s. All orders are
//! shown by the shipped preview, so that they differ in their images alone. Two bounds are given
//! with the metrics: an image for each source, the best first, and the order by the true errors.

use super::{Order, Origin, Trial};
use crate::engine::{Engine, Error};
use crate::plan::{Metric, PlanError};
use crate::renderer::{Cost, Quality};
use crate::work::Work;

/// The orders that are compared.
const ORDERS: [Order; 5] = [
    Order::SHIPPED,
    Order::Metric(Metric::Settings),
    Order::Metric(Metric::Influence),
    Order::BankByBank,
    Order::Oracle,
];

/// Errors and seconds by order.
#[derive(Clone, Debug, PartialEq)]
pub struct Refinement {
    /// The show and the machine.
    pub origin: Origin,
    /// A curve for each order of pictures, as the shipped preview shows them.
    pub orders: Vec<OrderCurve>,
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
    /// True error of the worst moment, relative.
    pub error: f64,
    /// Seconds from the start as predicted, coarse pictures among them.
    pub predicted: f64,
    /// Seconds from the start as they were; NaN where that is not known.
    pub real: f64,
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
    /// All curves.
    fn new(
        origin: Origin,
        trial: &Trial,
        seconds: &Seconds,
        work: Work<'_>,
    ) -> Result<Refinement, Error> {
        let curve = |order: Order| order_curve(trial, seconds, order, work);
        let orders: Result<_, Error> = ORDERS.into_iter().map(curve).collect();
        Ok(Refinement {
            origin,
            orders: orders?,
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

fn order_curve(
    trial: &Trial,
    seconds: &Seconds,
    order: Order,
    work: Work<'_>,
) -> Result<OrderCurve, Error> {
    let settings = trial.ordered(order)?;
    let mut points = Vec::new();
    for m in 0..=settings.len() {
        work.check()?;
        let (taken, _) = settings.split_at(m);
        points.push(OrderPoint {
            error: trial.error(&trial.shown(taken)?),
            predicted: seconds.predicted(taken),
            real: seconds.real(order, taken),
        });
    }
    Ok(OrderCurve { order, points })
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

impl Engine {
    /// The true error of the worst moment against refined pictures and seconds, by order.
    ///
    /// # Errors
    /// As [`Engine::trial`]; [`Error::AlikeCoarse`] and [`Error::AlikeRefined`] where there is no
    /// error to refine.
    pub fn measure_refinement(&self) -> Result<Refinement, Error> {
        let (trial, mut seconds) = self.tried()?;
        let weighting = trial.weighting(Metric::Error);
        let weighting = weighting.map_err(or_no_weight(Error::AlikeCoarse))?;
        trial.oracle().map_err(or_no_weight(Error::AlikeRefined))?;
        let order = trial.order(&weighting)?;
        (seconds.prepare, seconds.mixed) =
            self.one_by_one(("mixed pictures", 0), &order, &mut |_| ())?;
        self.predict(&mut seconds)?;
        Refinement::new(self.origin(), &trial, &seconds, self.host.work())
    }

    /// What the operator predicts, at the pace of this machine now.
    fn predict(&self, seconds: &mut Seconds) -> Result<(), Error> {
        let rendering = self.rendering.as_ref().ok_or(Error::NoSetup)?;
        let renderer = self.host.renderer.as_ref();
        let pace = self.measure_pace()?;
        let sources = rendering.setup.rig.sources.len() as f64;
        let of = |quality: Quality| {
            let cost = rendering.cost(renderer, quality);
            Cost {
                prepare: cost.prepare * pace,
                per_source: cost.per_source * pace,
                per_image: cost.per_image * pace,
                per_lone: cost.per_lone * pace,
            }
        };
        let all = |step| of(step).alone(sources);
        seconds.coarse[0] = self.coarse_pair().map(all).iter().sum();
        seconds.cost = of(self.refined_step());
        Ok(())
    }
}

/// What to say where all weights are zero.
fn or_no_weight(instead: Error) -> impl FnOnce(PlanError) -> Error {
    |error| match error {
        PlanError::NoWeight => instead,
        other => other.into(),
    }
}
