//! What refining brings: errors against refined pictures and seconds, by order.

use std::fmt::Write as _;

use super::words::drawn;
use super::{Kind, Quantity, Record};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::engine::measure::Order;
use crate::engine::measure::refinement::{OrderCurve, OrderPoint, Refinement};
use crate::plan::Metric;

/// Errors below this share of the start's are rounding.
const ROUNDING: f64 = 1e-4;
/// The share of the start's error that counts are given for.
const FAR: f64 = 0.05;

const REFINED: &str = "refined pictures";

/// What the words beside the chart say of the seconds.
const TIMED_ONCE: &str = "Pictures were timed in the shipped order and bank by bank; the other orders \
    of mixed pictures are given the shipped one's seconds.";

const METHOD: &str = "the truth: every source at the refined quality; real time: of both coarse \
    qualities and of each refined picture, rendered one by one in the shipped order and for each \
    source alone; the other orders of mixed pictures are given the seconds of the shipped one";

/// The table: a series for each order.
pub fn record(refinement: &Refinement) -> Record {
    let quantities = [
        (REFINED, ""),
        ("true error of the worst moment", "%"),
        ("predicted time", "s"),
        ("real time", "s"),
    ];
    let quantities = quantities.map(|(n, u)| Quantity::new(n, u)).into();
    let mut out = Record::new(Kind::Plan, &refinement.origin, METHOD, quantities);
    for curve in &refinement.orders {
        let series = format!("order: {}", order(curve.order));
        for (m, point) in curve.points.iter().enumerate() {
            let values = [m as f64, 100.0 * point.error, point.predicted, point.real];
            out.add(&series, &format!("{m} refined"), &[], &values.map(Some));
        }
    }
    out
}

fn order(order: Order) -> &'static str {
    match order {
        Order::Metric(metric) => match metric {
            Metric::Error => "estimated error (shipped)",
            Metric::Settings => "settings",
            Metric::Norm => "brightness",
            Metric::Influence => "influence, the paper's",
        },
        Order::BankByBank => "one picture for each bank",
        Order::Oracle => "true error: an oracle",
    }
}

const MARKERS: [Marker; 4] = [
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::Circle,
];

/// The chart: the error by order against pictures and against seconds.
pub fn drawing(refinement: &Refinement, theme: Theme) -> Drawing {
    let needed = |order: Order| {
        let found = refinement.orders.iter().find(|c| c.order == order);
        let count = found.and_then(|c| c.needed(FAR));
        count.map_or("-".to_owned(), |n| n.to_string())
    };
    let first = format!(
        "To {:.0} % of the start: {} pictures; bank by bank {}",
        100.0 * FAR,
        needed(Order::SHIPPED),
        needed(Order::BankByBank)
    );
    let panel = |title: &str, x: &str, scale, of: &dyn Fn(usize, &OrderPoint) -> f64| Panel {
        title: title.to_owned(),
        x: Axis::new(x, scale),
        y: Axis::new("true error of the worst moment, %", Scale::Log),
        series: lines(&refinement.orders, of),
        reference: None,
    };
    let seconds = "seconds from the start, coarse pictures among them";
    let real = "How long does it take? (mixed pictures: as shipped)";
    let predicted = "How long was it predicted to take?";
    let panels = [
        panel(&first, REFINED, Scale::Whole, &|m, _| m as f64),
        panel(real, seconds, Scale::Linear, &|_, p| p.real),
        panel(predicted, seconds, Scale::Linear, &|_, p| p.predicted),
    ];
    let title = format!(
        "{}: what does refining bring, and for how long?",
        refinement.origin.subject
    );
    chart::panels(&title, &panels, theme)
}

/// A line for each order: x, and the error in percent.
fn lines(orders: &[OrderCurve], x: &dyn Fn(usize, &OrderPoint) -> f64) -> Vec<chart::Series> {
    // What is shipped comes last and so lies over the others, as crosses that do not hide them.
    let mut curves: Vec<&OrderCurve> = orders.iter().collect();
    curves.sort_by_key(|curve| curve.order == Order::SHIPPED);
    let error = |point: &OrderPoint| drawn(Some(100.0 * point.error));
    let line = |(curve, marker): (&OrderCurve, Marker)| {
        let start = curve.points.first().map_or(0.0, error);
        let points = curve.points.iter().enumerate().map(|(m, point)| {
            let y = error(point);
            // Rounding has no place on a log axis.
            let shown = if y > ROUNDING * start { y } else { f64::NAN };
            (drawn(Some(x(m, point))), shown)
        });
        chart::Series {
            name: order(curve.order).to_owned(),
            points: points.collect(),
            marker: match curve.order {
                Order::SHIPPED => Marker::Cross,
                _ => marker,
            },
            labels: Vec::new(),
        }
    };
    let marked = curves.into_iter().zip(MARKERS.into_iter().cycle());
    marked.map(line).collect()
}

/// A line for each order.
pub fn describe(refinement: &Refinement) -> String {
    let mut out = format!(
        "{:<28} {:>14} {:>14} {:>12}\n",
        "order",
        format!("to {:.0} % of start", 100.0 * FAR),
        "real seconds",
        "predicted"
    );
    for curve in &refinement.orders {
        let count = curve.needed(FAR);
        let point = count.and_then(|m| curve.points.get(m));
        let at = |of: &dyn Fn(&OrderPoint) -> f64| {
            point.map_or("-".to_owned(), |p| format!("{:.2}", drawn(Some(of(p)))))
        };
        let shown = count.map_or("-".to_owned(), |m| format!("{m} pictures"));
        let _ = writeln!(
            out,
            "{:<28} {shown:>14} {:>14} {:>12}",
            order(curve.order),
            at(&|p| p.real),
            at(&|p| p.predicted)
        );
    }
    let _ = writeln!(out, "{TIMED_ONCE}");
    out
}
