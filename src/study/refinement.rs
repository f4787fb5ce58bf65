//! What refining brings: the sequence's true error against refined pictures and against seconds, in
//! every order that was thought of, and as every preview shows it.
//!
//! The truth is every source at the refined quality; the mathematics is [`Trial`]'s. All orders are
//! shown by the shipped preview, so that they differ in their pictures alone; all previews show the
//! pictures of the shipped order. Two bounds stand beside the metrics: a picture for each source,
//! the best first, and an oracle that knows the true errors.

use std::fmt::Write as _;

use super::verdict::{Previewed, previewed};
use super::{Kind, Machine, Quantity, Record, Series, Trial};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::plan::{Metric, PlanError};
use crate::pool::Projection;
use crate::renderer::Cost;

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

/// Errors below this share of the start's are rounding.
const ROUNDING: f64 = 1e-4;
/// The share of the start's error that counts are told for.
const FAR: f64 = 0.05;

const REFINED: &str = "refined pictures";
const ERROR: &str = "true error of the sequence";
const PREDICTED: &str = "predicted time";
const REAL: &str = "real time";
const WORSE: &str = "looks worse than coarse";
const WORST: &str = "worst look over coarse";
const LOOK: &str = "median look over coarse";
const SEQUENCE: &str = "sequence over coarse";

/// What the words beside the chart say of the seconds.
const TIMED_ONCE: &str = "Pictures were timed in the shipped order and bank by bank; the other orders \
    of mixed pictures are given the shipped one's seconds.";

const SHIPPED: &str = "estimated error (shipped)";
const ALONE: &str = "one picture for each bank";
const ORDER: &str = "order: ";
const PREVIEW: &str = "preview: ";
const LOOKS: &str = "looks: ";

/// Everything as a record; `seed` draws the looks that previews are tried on.
///
/// # Errors
/// [`PlanError`]
pub fn record(
    subject: &str,
    machine: Machine,
    trial: &Trial,
    seconds: &Seconds,
    seed: u64,
) -> Result<Record, PlanError> {
    let quantities = [
        (REFINED, ""),
        (ERROR, "%"),
        (PREDICTED, "s"),
        (REAL, "s"),
        (WORSE, "%"),
        (WORST, ""),
        (LOOK, ""),
        (SEQUENCE, ""),
    ];
    let quantities = quantities.map(|(n, u)| Quantity::new(n, u)).into();
    let method = "the truth: every source at the refined quality; real time: of both coarse \
                  qualities and of each refined picture, rendered one by one in the shipped order \
                  and for each source alone; the other orders of mixed pictures are given the \
                  seconds of the shipped one";
    let mut out = Record::new(Kind::Plan, subject, machine, method, quantities);
    let shipped = trial.order(&trial.weighting(Metric::Error)?)?;
    for (name, order) in orders(trial, &shipped)? {
        for m in 0..=order.len() {
            let taken = order.get(..m).unwrap_or(&order);
            let shown = trial.shown(Projection::default(), taken)?;
            let values = [
                m as f64,
                100.0 * trial.error(&shown),
                seconds.predicted(taken),
                seconds.real(name, taken),
            ];
            let label = format!("{m} refined");
            out.add(&format!("{ORDER}{name}"), &label, &[], &values.map(Some));
        }
    }
    for by in Projection::ALL {
        for m in 0..=shipped.len() {
            let taken = shipped.get(..m).unwrap_or(&shipped);
            let error = 100.0 * trial.error(&trial.shown(by, taken)?);
            let values = [Some(m as f64), Some(error)];
            let label = format!("{m} refined");
            out.add(&format!("{PREVIEW}{}", name(by)), &label, &[], &values);
        }
    }
    for row in previewed(trial, seed)? {
        looks(&mut out, &row);
    }
    Ok(out)
}

/// Settings to refine, one after the other.
type Order = Vec<Vec<f64>>;

/// The orders with their names.
fn orders(trial: &Trial, shipped: &Order) -> Result<Vec<(&'static str, Order)>, PlanError> {
    let by = |metric| trial.order(&trial.weighting(metric)?);
    Ok(vec![
        (SHIPPED, shipped.clone()),
        ("settings", by(Metric::Settings)?),
        ("influence, the paper's", by(Metric::Influence)?),
        (ALONE, trial.banks_in_best_order()),
        ("true error: an oracle", trial.order(&trial.oracle()?)?),
    ])
}

fn name(by: Projection) -> String {
    let shipped = by == Projection::default();
    let mark = if shipped { " (shipped)" } else { "" };
    format!("{}{mark}", by.name())
}

fn looks(out: &mut Record, row: &Previewed) {
    let mut values = vec![None; 4];
    values.extend([100.0 * row.worse, row.worst, row.look, row.sequence].map(Some));
    let series = format!("{LOOKS}{}", name(row.projection));
    out.add(&series, "looks of 3 banks, 4 refined", &[], &values);
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
    fn real(&self, order: &str, taken: &[Vec<f64>]) -> f64 {
        let [_, coarse] = self.coarse;
        if taken.is_empty() {
            return coarse;
        }
        let source = |s: &Vec<f64>| s.iter().position(|x| *x != 0.0);
        let last = self.mixed.last().copied().unwrap_or(f64::NAN);
        let each = |(place, setting): (usize, &Vec<f64>)| match order {
            ALONE => source(setting).and_then(|i| self.alone.get(i).copied()),
            _ => Some(self.mixed.get(place).copied().unwrap_or(last)),
        };
        let all = taken.iter().enumerate().map(each);
        coarse + self.prepare + all.map(|s| s.unwrap_or(f64::NAN)).sum::<f64>()
    }
}

/// Series of a kind, with their names.
fn of<'a>(record: &'a Record, kind: &str) -> Vec<(&'a str, &'a Series)> {
    let named = |s: &'a Series| Some((s.name.strip_prefix(kind)?, s));
    record.series.iter().filter_map(named).collect()
}

/// What is shipped comes last and so lies over the others, as crosses that do not hide them.
fn shipped_last<'a>(mut lines: Vec<(&'a str, &'a Series)>) -> Vec<(&'a str, &'a Series)> {
    lines.sort_by_key(|(name, _)| is_shipped(name));
    lines
}

fn is_shipped(name: &str) -> bool {
    name.contains("(shipped)")
}

/// The first number of pictures after which the error is within [`FAR`] of the start's.
fn needed(record: &Record, series: &Series) -> Option<usize> {
    let curve = record.curve(series, REFINED, ERROR);
    let start = curve.first()?.1;
    curve.iter().position(|(_, error)| *error <= FAR * start)
}

const MARKERS: [Marker; 4] = [
    Marker::Square,
    Marker::Triangle,
    Marker::Diamond,
    Marker::Circle,
];

/// The chart of a record made by [`record`].
pub fn drawing(record: &Record, theme: Theme) -> Drawing {
    let orders = shipped_last(of(record, ORDER));
    let count = |name: &str| {
        let found = orders.iter().find(|(n, _)| *n == name);
        found.and_then(|(_, s)| needed(record, s))
    };
    let told = |n: Option<usize>| n.map_or("-".to_owned(), |n| n.to_string());
    let first = format!(
        "To {:.0} % of the start: {} pictures; bank by bank {}",
        100.0 * FAR,
        told(count(SHIPPED)),
        told(count(ALONE))
    );
    let seconds = "seconds from the start, coarse pictures among them";
    let previews = shipped_last(of(record, PREVIEW));
    let panels = [
        panel(record, &orders, &first, (REFINED, REFINED, Scale::Whole)),
        panel(
            record,
            &orders,
            "How long does it take? (mixed pictures: as shipped)",
            (REAL, seconds, Scale::Linear),
        ),
        panel(
            record,
            &orders,
            "How long was it foretold to take?",
            (PREDICTED, seconds, Scale::Linear),
        ),
        panel(
            record,
            &previews,
            "What do six previews make of the same pictures?",
            (REFINED, REFINED, Scale::Whole),
        ),
    ];
    let title = format!(
        "{}: what does refining bring, and for how long?",
        record.subject
    );
    chart::panels(&title, &panels, theme)
}

fn panel(
    record: &Record,
    lines: &[(&str, &Series)],
    title: &str,
    (column, label, scale): (&str, &str, Scale),
) -> Panel {
    let line = |((name, series), marker): (&(&str, &Series), Marker)| {
        let curve = record.curve(series, column, ERROR);
        let start = curve.first().map_or(0.0, |p| p.1);
        // Rounding has no place on a log axis.
        let shown = |(x, y): (f64, f64)| (x, if y > ROUNDING * start { y } else { f64::NAN });
        chart::Series {
            name: (*name).to_owned(),
            points: curve.into_iter().map(shown).collect(),
            marker: match is_shipped(name) {
                true => Marker::Cross,
                false => marker,
            },
            labels: Vec::new(),
        }
    };
    Panel {
        title: title.to_owned(),
        x: Axis::new(label, scale),
        y: Axis::new("true error of the sequence, %", Scale::Log),
        series: lines
            .iter()
            .zip(MARKERS.into_iter().cycle())
            .map(line)
            .collect(),
        reference: None,
    }
}

/// The record in words.
pub fn describe(record: &Record) -> String {
    let mut out = format!(
        "{:<28} {:>14} {:>14} {:>12}\n",
        "order",
        format!("to {:.0} % of start", 100.0 * FAR),
        "real seconds",
        "predicted"
    );
    for (name, series) in of(record, ORDER) {
        let count = needed(record, series);
        let at = |column: &str| {
            let curve = record.curve(series, column, ERROR);
            let found = count.and_then(|m| curve.get(m).copied());
            found.map_or("-".to_owned(), |p| format!("{:.2}", p.0))
        };
        let shown = count.map_or("-".to_owned(), |m| format!("{m} pictures"));
        let _ = writeln!(
            out,
            "{name:<28} {shown:>14} {:>14} {:>12}",
            at(REAL),
            at(PREDICTED)
        );
    }
    let _ = writeln!(out, "{TIMED_ONCE}");
    let _ = writeln!(
        out,
        "\n{:<28} {:>14} {:>14} {:>12} {:>10}",
        "preview, 4 refined", "looks worse %", "worst look", "median look", "sequence"
    );
    for (name, series) in of(record, LOOKS) {
        let at = |column: &str| {
            record
                .curve(series, column, column)
                .first()
                .map_or(f64::NAN, |p| p.0)
        };
        let _ = writeln!(
            out,
            "{name:<28} {:>14.1} {:>14.2} {:>12.2} {:>10.3}",
            at(WORSE),
            at(WORST),
            at(LOOK),
            at(SEQUENCE)
        );
    }
    out
}
