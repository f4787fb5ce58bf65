//! A design session: the quality of the sequence against computing time and refined pictures.

use std::fmt::Write as _;

use super::words::{drawn, figure};
use super::{Kind, Quantity, Record};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::engine::session::{Cause, Errors, Measured, Moment};

/// The table: a point for each moment.
pub fn record(session: &Measured) -> Record {
    let quantities = vec![
        Quantity::new("computing time", "s"),
        Quantity::new("refined pictures", ""),
        Quantity::new("predicted error", "%"),
        Quantity::new("predicted error of coarse alone", "%"),
        Quantity::new("predicted", ""),
        Quantity::new("true error", "%"),
        Quantity::new("true error of coarse alone", "%"),
        Quantity::new("true", ""),
    ];
    let method = method(session);
    let mut out = Record::new(Kind::Session, &session.origin, &method, quantities);
    for moment in &session.moments {
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
        out.add("session", &label(moment), &[cause(moment.cause)], &values);
    }
    out
}

fn method(session: &Measured) -> String {
    let truth = match session.truth {
        Some(step) => format!("every source at quality {step} is the truth"),
        None => "predicted alone".to_owned(),
    };
    match session.metric {
        Some(metric) => format!("{truth} (metric {})", metric.name()),
        None => truth,
    }
}

fn cause(cause: Cause) -> &'static str {
    match cause {
        Cause::Coarse => "coarse",
        Cause::Refined => "refined",
        Cause::Edit => "edit",
    }
}

/// What brought a moment: `line 5: refine 2`.
pub fn label(moment: &Moment) -> String {
    match &moment.command {
        Some(command) => {
            let first = command.text.lines().next().unwrap_or_default();
            format!("line {}: {}", command.line, first.trim())
        }
        None => "coarse pictures".to_owned(),
    }
}

/// The chart: 1 - error / (error of coarse pictures alone) against time and against refined
/// pictures.
pub fn drawing(session: &Measured, theme: Theme) -> Drawing {
    let panel = |title: &str, axis: &str, scale, x: &dyn Fn(&Moment) -> f64| Panel {
        title: title.to_owned(),
        x: Axis::new(axis, scale),
        y: Axis::new("1 - error / error of coarse alone", Scale::Linear),
        series: traces(&session.moments, x),
        reference: Some((1.0, "all refined".to_owned())),
    };
    let panels = [
        panel(
            "by computing time",
            "seconds of computing",
            Scale::Linear,
            &|m| m.seconds,
        ),
        panel(
            "by refined pictures",
            "refined pictures",
            Scale::Whole,
            &|m| m.refined as f64,
        ),
    ];
    let title = format!(
        "{}: how good was the sequence, and when?",
        session.origin.subject
    );
    chart::panels(&title, &panels, theme)
}

/// Prediction, truth where it is known, and the edits on the better known of both.
fn traces(moments: &[Moment], x: &dyn Fn(&Moment) -> f64) -> Vec<chart::Series> {
    if moments.is_empty() {
        return Vec::new();
    }
    let curve = |of: &dyn Fn(&Moment) -> Option<Errors>| -> Vec<(f64, f64)> {
        let quality = |m| drawn(of(m).and_then(Errors::quality));
        let points = moments.iter().map(|m| (drawn(Some(x(m))), quality(m)));
        points.collect()
    };
    let known = |curve: &[(f64, f64)]| curve.iter().any(|p| p.1.is_finite());
    let predicted = curve(&|m| Some(m.predicted));
    let truth = curve(&|m| m.truth);
    let best = if known(&truth) { &truth } else { &predicted };
    let mut edits = Vec::new();
    for (moment, at) in moments.iter().zip(best) {
        if moment.cause == Cause::Edit {
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

/// A line for each moment.
pub fn describe(session: &Measured) -> String {
    let mut out = format!(
        "{:>9} {:>7} {:>11} {:>8}  {:>8} {:>8}  what\n",
        "seconds", "refined", "predicted %", "true %", "1-e/e0", "true"
    );
    for moment in &session.moments {
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
            label(moment)
        );
    }
    out
}
