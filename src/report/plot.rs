//! Drawing of the plan's spectrum.

use super::results::ROUNDING;
use super::words::{self, count};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Series, Theme};
use footlight_engine::plan::{PlanReport, Predicted};
use footlight_show::units::ErrorUnit;

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
