//! Drawings of the show and its plan: keys, spectrum.

use std::collections::BTreeMap;

use super::curves::cues_in_time;
use super::results::ROUNDING;
use super::words::{self, count};
use crate::chart::{self, Axis, Drawing, Grid, Marker, Panel, Scale, Series, Stand, Theme, Tie};
use footlight_engine::Document;
use footlight_engine::plan::{PlanReport, Predicted};
use footlight_show::timeline::KeySequence;
use footlight_show::units::ErrorUnit;

/// The key settings in a grid, tied to their moments.
pub fn keys(document: &Document, theme: Theme) -> (Drawing, String) {
    let (keys, show) = (document.keys(), document.show());
    let inserted = match keys.inserted() {
        0 => "none put in between".to_owned(),
        n => format!("{} put in so that no key is negative", count(n, "knot")),
    };
    let counted = format!(
        "{} for {}",
        count(keys.keys().len(), "key setting"),
        count(keys.segments().len(), "segment")
    );
    let data = Grid {
        title: format!("{}: {counted}, {inserted}", show.title),
        column: "key".to_owned(),
        rows: show.coordinates().into_iter().map(|c| c.name).collect(),
        columns: keys.keys().to_vec(),
        ties: ties(keys),
        start: document.timeline().start().seconds(),
        end: document.timeline().end().seconds(),
        cues: cues_in_time(show, document.timeline()),
    };
    (chart::grid(&data, theme), format!("{counted}, {inserted}"))
}

/// Moments of each key: the ends of its segments, and for inner control points equal steps between
/// (Greville abscissae). A key with two relations to one moment gets the stronger one.
fn ties(keys: &KeySequence) -> Vec<Tie> {
    let mut found: BTreeMap<(usize, i64), Tie> = BTreeMap::new();
    let rank = |stand: Stand| match stand {
        Stand::Near => 0,
        Stand::Met => 1,
        Stand::Inserted => 2,
    };
    for segment in keys.segments() {
        for (place, column) in segment.keys.iter().enumerate() {
            let along = place as f64 / segment.degree.max(1) as f64;
            let stand = match place {
                0 if segment.is_inserted() => Stand::Inserted,
                p if p == 0 || p == segment.degree => Stand::Met,
                _ => Stand::Near,
            };
            let tie = Tie {
                column: *column,
                time: segment.start() + along * segment.duration(),
                stand,
            };
            let at = (*column, (tie.time * 1e6).round() as i64);
            let known = found.entry(at).or_insert(tie);
            if rank(stand) > rank(known.stand) {
                *known = tie;
            }
        }
    }
    found.into_values().collect()
}

/// The singular values and the error that remains, with the tolerance.
pub fn spectrum(plan: &PlanReport, theme: Theme) -> (Drawing, String) {
    let words = format!(
        "{} of {} reach {}",
        count(plan.used, "refined picture"),
        plan.rank,
        words::error(plan.tolerance, plan.unit)
    );
    let title = format!("{}: {words}", plan.show);
    (chart::panels(&title, &[shares(plan)], theme), words)
}

/// Shares of the sequence's light: of each direction, and of the remainder after it.
fn shares(plan: &PlanReport) -> Panel {
    let total = plan
        .singular_values
        .iter()
        .map(|s| s * s)
        .sum::<f64>()
        .sqrt();
    let start = plan.predicted.first().map_or(1.0, |p| p.error);
    let scale = if total > 0.0 { start / total } else { 0.0 };
    let values = plan.singular_values.iter().enumerate();
    let (by, unit) = match plan.unit {
        ErrorUnit::Light => (100.0, "% of the sequence"),
        ErrorUnit::Steps => (1.0, "steps of 255"),
    };
    let shown = |x: f64| {
        if x > ROUNDING { by * x } else { f64::NAN }
    };
    let left = plan.predicted.iter();
    let leaves_nothing = |p: &Predicted| p.refined == plan.used && p.error <= ROUNDING;
    let label = |p: &Predicted| match count(p.refined, "picture") {
        _ if p.refined != plan.used => String::new(),
        pictures if leaves_nothing(p) => format!("{pictures}: nothing left"),
        pictures => format!("{pictures}: {}", words::error(p.error, plan.unit)),
    };
    // An image that leaves no error is drawn under the tolerance, at the bottom.
    let height = |p: &Predicted| {
        if leaves_nothing(p) {
            0.25 * by * plan.tolerance
        } else {
            shown(p.error)
        }
    };
    Panel {
        title: "by the light that it is missing".to_owned(),
        x: Axis::new("refined pictures", Scale::Whole),
        y: Axis::new(unit, Scale::Log),
        series: vec![
            Series {
                name: "error predicted after so many pictures".to_owned(),
                points: left
                    .clone()
                    .map(|p| (p.refined as f64, height(p)))
                    .collect(),
                marker: Marker::Square,
                labels: left.map(label).collect(),
            },
            Series {
                name: "singular value: what each one adds".to_owned(),
                points: values
                    .map(|(i, s)| (i as f64 + 1.0, shown(scale * s)))
                    .collect(),
                marker: Marker::Circle,
                labels: Vec::new(),
            },
        ],
        reference: Some((
            by * plan.tolerance,
            format!("tolerance {}", words::error(plan.tolerance, plan.unit)),
        )),
    }
}
