//! A plan in words, and as the JSON of `plan.json`.

use std::fmt::Write as _;

use serde::Serialize;

use super::words::{self, count};
use footlight_engine::plan::{LeftOut, PlanReport};
use footlight_engine::pool::is_within;
use footlight_show::printable::{self, trimmed};
use footlight_show::units::ErrorUnit;

/// The JSON form of a plan.
#[derive(Serialize)]
struct Form<'a> {
    /// Version of this form.
    schema: u32,
    #[serde(flatten)]
    plan: &'a PlanReport,
    left_out: Vec<Item>,
}

/// Something that the plan leaves out.
#[derive(Serialize)]
struct Item {
    /// Its kind.
    what: &'static str,
    /// Its name, or a number.
    name: String,
    /// The reason, for a designer.
    why: String,
}

/// The plan as JSON data.
pub fn form(plan: &PlanReport) -> impl Serialize {
    Form {
        schema: 0,
        plan,
        left_out: plan.left_out.iter().map(|l| item(l, plan.unit)).collect(),
    }
}

/// The plan as JSON, indented.
pub fn json(plan: &PlanReport) -> Result<String, serde_json::Error> {
    Ok(printable::json(&serde_json::to_string_pretty(&form(plan))?))
}

fn item(left_out: &LeftOut, unit: ErrorUnit) -> Item {
    let (what, name) = match left_out {
        LeftOut::StaysOut { name }
        | LeftOut::Constant { name, .. }
        | LeftOut::MultipleOf { name, .. }
        | LeftOut::Unseen { name } => ("bank", name.clone()),
        LeftOut::HeldSegments(n) => ("segments", n.to_string()),
        LeftOut::JoinedKnots(n) => ("knots", n.to_string()),
        LeftOut::MergedKeys(n) => ("keys", n.to_string()),
        LeftOut::InsertedKnots(n) => ("inserted knots", n.to_string()),
        LeftOut::SparedDirections { count, .. } => ("directions", count.to_string()),
        LeftOut::OneQuality => ("refinement", "of every bank".to_owned()),
    };
    Item {
        what,
        name,
        why: why(left_out, unit),
    }
}

fn why(left_out: &LeftOut, unit: ErrorUnit) -> String {
    let reason = match left_out {
        LeftOut::Constant { setting, .. } => {
            let share = number(100.0 * setting);
            return format!("stays at {share} % of its light throughout");
        }
        LeftOut::MultipleOf { other, factor, .. } => {
            let share = match number(*factor).as_str() {
                "1" => "the same share".to_owned(),
                factor => format!("{factor} times the share"),
            };
            return format!(
                "always gives {share} of its light that `{other}` gives: they share their refined images"
            );
        }
        LeftOut::SparedDirections {
            used,
            error,
            tolerance,
            ..
        } => {
            let (by, unit) = match unit {
                ErrorUnit::Light => (100.0, "%"),
                ErrorUnit::Steps => (1.0, "steps"),
            };
            return format!(
                "mixtures for {used} directions are enough: the predicted error is {} {unit}, you asked \
                 for {} {unit}",
                number(by * error),
                number(by * tolerance)
            );
        }
        LeftOut::StaysOut { .. } => "stays out throughout: it needs no picture",
        LeftOut::Unseen { .. } => "adds nothing to the error of this view: it comes last",
        LeftOut::HeldSegments(_) => "nothing changes in them: one key each, no blends",
        LeftOut::JoinedKnots(_) => "where nothing bends: the neighbouring segments are one",
        LeftOut::MergedKeys(_) => "control points equal another key: one image serves them all",
        LeftOut::InsertedKnots(_) => "were added so that no key needs negative light",
        LeftOut::OneQuality => {
            "nothing is left to refine: quality has one step here, the first pictures are final"
        }
    };
    reason.to_owned()
}

/// At most four digits, without trailing zeros.
fn number(x: f64) -> String {
    let digits = (3 - x.abs().log10().floor().clamp(-6.0, 3.0) as i32).clamp(0, 9) as usize;
    trimmed(&format!("{x:.digits$}"))
}

/// Describes the plan: its size, the predicted errors, its omissions.
pub fn describe(plan: &PlanReport) -> String {
    let mut text = String::new();
    let curved = plan.segments.iter().filter(|s| s.degree > 1).count();
    let _ = writeln!(
        text,
        "{} ({curved} curved), {}; at most {} needed",
        count(plan.segments.len(), "segment"),
        count(plan.keys.len(), "key"),
        count(plan.rank, "refined picture")
    );
    if plan.head_poses > 0 {
        let _ = writeln!(
            text,
            "moving heads: {} of reflected light, each for one pose; the other poses are mixed from them",
            count(plan.head_poses, "picture")
        );
    }
    let pictures = count(plan.used, "refined picture");
    let mut predicted = plan.predicted.iter();
    let is_reached = predicted.any(|step| {
        step.refined == plan.used && is_within(plan.tolerance, step.error, plan.used, true)
    });
    let pictures = if is_reached {
        format!("{pictures} of {} for an error of", plan.rank)
    } else {
        format!("all {pictures} leave more than")
    };
    let _ = writeln!(
        text,
        "{pictures} {}{}; predicted after each",
        words::error(plan.tolerance, plan.unit),
        if plan.unit == ErrorUnit::Light {
            " of the light"
        } else {
            ""
        }
    );
    for step in &plan.predicted {
        let mark = if is_reached && step.refined == plan.used {
            "  <- tolerance"
        } else {
            ""
        };
        let _ = writeln!(
            text,
            "  {:>3}  {:>10}{mark}",
            step.refined,
            words::error(step.error, plan.unit)
        );
    }
    if !plan.left_out.is_empty() {
        text.push_str("left out\n");
    }
    for left_out in &plan.left_out {
        let Item { what, name, why } = item(left_out, plan.unit);
        let _ = writeln!(text, "  {what} {name}: {why}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_have_four_digits_at_most_and_no_trailing_zero() {
        for (number, shown) in [
            (40.0, "40"),
            (0.5, "0.5"),
            (1.0 / 3.0, "0.3333"),
            (12_345.6, "12346"),
            (0.0, "0"),
        ] {
            assert_eq!(super::number(number), shown);
        }
    }

    #[test]
    fn a_reason_names_what_is_left_out_and_why() {
        let left_out = LeftOut::MultipleOf {
            name: "b1".to_owned(),
            other: "b0".to_owned(),
            factor: 0.5,
        };
        let Item { what, name, why } = item(&left_out, ErrorUnit::Light);
        assert_eq!((what, name.as_str()), ("bank", "b1"));
        assert_eq!(
            why,
            "always gives 0.5 times the share of its light that `b0` gives: they share their refined images"
        );
        let left_out = LeftOut::Constant {
            name: "b2".to_owned(),
            setting: 0.4,
        };
        assert_eq!(
            item(&left_out, ErrorUnit::Light).why,
            "stays at 40 % of its light throughout"
        );
        let left_out = LeftOut::SparedDirections {
            count: 3,
            used: 2,
            error: 0.0125,
            tolerance: 0.02,
        };
        let Item { name, why, .. } = item(&left_out, ErrorUnit::Light);
        assert_eq!(name, "3");
        assert!(why.ends_with("error is 1.25 %, you asked for 2 %"), "{why}");
    }
}
