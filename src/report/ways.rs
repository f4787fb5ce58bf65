//! Describes the methods for reaching an error.

use std::fmt::Write as _;

use super::words::{count, error, seconds};
use footlight_engine::{Goal, Way, WayForecast};

/// A table of methods, the chosen one first; empty when nothing is known about them yet.
pub fn describe(ways: &[WayForecast], goal: &Goal) -> String {
    let mut text = String::new();
    if ways.is_empty() {
        return text;
    }
    let _ = match goal.until {
        Some(until) => writeln!(
            text,
            "ways to an error of {}",
            error(until.error, until.unit)
        ),
        None => writeln!(text, "ways"),
    };
    for (i, way) in ways.iter().enumerate() {
        let mark = match (i, way.reaches) {
            (0, true) => "  <- taken",
            (0, false) => "  <- taken: the nearest",
            (_, true) => "",
            (_, false) => "  does not reach it",
        };
        let _ = writeln!(
            text,
            "  {:<46} {:>8}  {:>9}{mark}",
            name(way),
            seconds(way.seconds),
            error(way.error, goal.unit())
        );
    }
    text
}

/// Describes the images that a method renders.
fn name(way: &WayForecast) -> String {
    let quality = way.quality;
    let mixtures = count(way.mixed, "mixture");
    match (way.way, way.alone, way.mixed) {
        (_, 0, 0) => "stored pictures are enough".to_owned(),
        (Way::Alone, ..) => format!("every bank alone at quality {quality}"),
        (_, 0, _) => format!("{mixtures} at quality {quality}"),
        (_, _, 0) => format!("coarse pictures up to quality {quality}"),
        _ => format!("coarse pictures, {mixtures} at quality {quality}"),
    }
}
