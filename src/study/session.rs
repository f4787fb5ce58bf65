//! A design session: how good the sequence was, and what it had cost, at every moment of it.
//!
//! The measure is the paper's (its Figure 7): 1 - error / (error of coarse pictures alone), 0 while
//! nothing is refined, 1 where the sequence is as if all of it were.

use std::borrow::Borrow;
use std::fmt::Write as _;

use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::linalg::Matrix;
use crate::picture::Image;
use crate::picture::combine::{combine, dot};
use crate::study::comparison::figure;
use crate::study::{Kind, Machine, Quantity, Record, Series};

/// What happened before a moment was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The coarse pictures were rendered.
    Coarse,
    /// Refined pictures were added.
    Refined,
    /// The show was edited.
    Edit,
}

impl Event {
    fn name(self) -> &'static str {
        match self {
            Event::Coarse => "coarse",
            Event::Refined => "refined",
            Event::Edit => "edit",
        }
    }
}

/// Errors of the sequence, relative, beside those of its coarse pictures alone.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    pub event: Event,
    /// Line of the commands and what stands there.
    pub label: String,
    /// Seconds of computing so far.
    pub seconds: f64,
    /// Refined pictures in the pool.
    pub refined: usize,
    /// As the plan knows them.
    pub predicted: Errors,
    /// Against pictures of the refined quality throughout, if they were rendered.
    pub truth: Option<Errors>,
}

const SERIES: &str = "session";
const TIME: &str = "computing time";
const REFINED: &str = "refined pictures";
const PREDICTED: &str = "predicted";
const TRUE: &str = "true";

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
    for (i, a) in pictures.iter().enumerate() {
        for (j, b) in pictures.iter().enumerate().take(i + 1) {
            let weight = moment.get((i, j)).copied().unwrap_or(0.0);
            if weight != 0.0 {
                sum += if i == j { 1.0 } else { 2.0 } * weight * dot(a, b);
            }
        }
    }
    sum.max(0.0)
}

/// The moments as a record.
pub fn record(subject: &str, machine: Machine, method: &str, moments: &[Moment]) -> Record {
    let quantities = vec![
        Quantity::new(TIME, "s"),
        Quantity::new(REFINED, ""),
        Quantity::new("predicted error", "%"),
        Quantity::new("predicted error of coarse alone", "%"),
        Quantity::new(PREDICTED, ""),
        Quantity::new("true error", "%"),
        Quantity::new("true error of coarse alone", "%"),
        Quantity::new(TRUE, ""),
    ];
    let mut out = Record::new(Kind::Session, subject, machine, method, quantities);
    for moment in moments {
        let errors = |e: Option<Errors>| {
            [
                e.map(|e| 100.0 * e.now),
                e.map(|e| 100.0 * e.coarse),
                e.and_then(Errors::quality),
            ]
        };
        let mut values = vec![Some(moment.seconds), Some(moment.refined as f64)];
        values.extend(errors(Some(moment.predicted)));
        values.extend(errors(moment.truth));
        out.add(SERIES, &moment.label, &[moment.event.name()], &values);
    }
    out
}

/// The chart of a record made by [`record`]: the measure against time and against refined pictures.
pub fn drawing(record: &Record, theme: Theme) -> Drawing {
    let panel = |title: &str, x: &str, axis: &str, scale| {
        let series = record.series.iter().find(|s| s.name == SERIES);
        let series = series.map_or(Vec::new(), |s| traces(record, s, x));
        Panel {
            title: title.to_owned(),
            x: Axis::new(axis, scale),
            y: Axis::new("1 - error / error of coarse alone", Scale::Linear),
            series,
            reference: Some((1.0, "all refined".to_owned())),
        }
    };
    let panels = [
        panel(
            "by computing time",
            TIME,
            "seconds of computing",
            Scale::Linear,
        ),
        panel(
            "by refined pictures",
            REFINED,
            "refined pictures",
            Scale::Whole,
        ),
    ];
    let title = format!("{}: how good was the sequence, and when?", record.subject);
    chart::panels(&title, &panels, theme)
}

/// Prediction, truth where it is known, and the edits on the better known of both.
fn traces(record: &Record, series: &Series, x: &str) -> Vec<chart::Series> {
    let known = |curve: &Vec<(f64, f64)>| curve.iter().any(|p| p.1.is_finite());
    let (predicted, truth) = (
        record.curve(series, x, PREDICTED),
        record.curve(series, x, TRUE),
    );
    let best = if known(&truth) { &truth } else { &predicted };
    let mut edits = Vec::new();
    for (point, at) in series.points.iter().zip(best) {
        if point.marks.iter().any(|m| m == Event::Edit.name()) {
            // Unknown points between them keep the markers unjoined.
            edits.extend([*at, (f64::NAN, f64::NAN)]);
        }
    }
    let trace = |name: &str, points, marker| chart::Series {
        name: name.to_owned(),
        points,
        marker,
        labels: Vec::new(),
    };
    let mut out = vec![trace("as predicted", predicted.clone(), Marker::Circle)];
    if known(&truth) {
        out.push(trace("true", truth.clone(), Marker::Square));
    }
    out.push(trace("after an edit", edits, Marker::Diamond));
    out
}

/// The moments as a table.
pub fn describe(moments: &[Moment]) -> String {
    let mut out = format!(
        "{:>9} {:>7} {:>11} {:>8}  {:>8} {:>8}  what\n",
        "seconds", "refined", "predicted %", "true %", "1-e/e0", "true"
    );
    for moment in moments {
        let error = |e: Option<Errors>| e.map_or("-".to_owned(), |e| figure(e.now));
        let quality = |e: Option<Errors>| {
            let quality = e.and_then(Errors::quality);
            quality.map_or("-".to_owned(), |q| format!("{q:.3}"))
        };
        let _ = writeln!(
            out,
            "{:>9.2} {:>7} {:>11} {:>8}  {:>8} {:>8}  {}",
            moment.seconds,
            moment.refined,
            error(Some(moment.predicted)),
            error(moment.truth),
            quality(Some(moment.predicted)),
            quality(moment.truth),
            moment.label
        );
    }
    out
}
