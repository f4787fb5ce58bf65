//! Numbers in words, equal in every report.

use footlight_engine::Engine;
use footlight_engine::measure::Machine;
use footlight_show::lang;
use footlight_show::model::{Cue, Preview, Show};
use footlight_show::units::{ErrorUnit, Time};

/// `1 cue`, `2 cues`.
pub fn count(n: usize, what: &str) -> String {
    let plural = if n == 1 { "" } else { "s" };
    format!("{n} {what}{plural}")
}

/// Quality steps of the coarse images: `at quality 1`, `at quality 1 and 2`.
pub fn qualities(engine: &Engine) -> String {
    match engine.estimate().coarse_steps() {
        [cheap, fine] if cheap == fine => format!("at quality {}", fine.0),
        [cheap, fine] => format!("at quality {} and {}", cheap.0, fine.0),
    }
}

/// A relative number in percent: three digits, at most three decimals.
pub fn percent(x: f64) -> String {
    digits(x * 100.0, 0.9995)
}

/// A number with three digits; below `least`, with three decimals.
fn digits(number: f64, least: f64) -> String {
    match number.abs() {
        n if n >= 99.95 => format!("{number:.0}"),
        n if n >= 9.995 => format!("{number:.1}"),
        n if n >= least || n == 0.0 => format!("{number:.2}"),
        _ => format!("{number:.3}"),
    }
}

/// An error with its unit: `2.00 %`, `1.5 steps`.
pub fn error(error: f64, unit: ErrorUnit) -> String {
    match unit {
        ErrorUnit::Light => format!("{} %", percent(error)),
        // Three digits, like percentages.
        ErrorUnit::Steps => format!("{} steps", percent(error / 100.0)),
    }
}

/// A measured error in percent with three digits, for tables of errors.
pub fn figure(share: f64) -> String {
    digits(share * 100.0, 0.0995)
}

/// The exposure of a sequence, and for an automatic one the line that fixes it.
pub fn exposure(show: &Show, stops: f64) -> String {
    if show.preview.exposure.is_some() {
        return format!("exposure {stops} stops, as `preview` says");
    }
    let held = Preview {
        exposure: Some((stops * 100.0).round() / 100.0),
        bias: 0.0,
        ..show.preview.clone()
    };
    let held = lang::preview_statement(&held);
    format!("exposure {stops:.2} stops, chosen for the whole sequence; this holds it:\n  {held}")
}

/// Seconds with a suitable unit: `12 ms`, `3.40 s`; from a minute on whole seconds, `1:30`.
pub fn seconds(seconds: f64) -> String {
    match seconds {
        s if s < 0.9995 => format!("{:.0} ms", s * 1000.0),
        s if s < 60.0 => format!("{s:.2} s"),
        s => Time::from_seconds(s.round()).map_or(format!("{s:.0} s"), |t| t.to_string()),
    }
}

/// Bytes in kB or MB.
pub fn megabytes(bytes: u64) -> String {
    match bytes {
        0..=999_999 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// A cue's label in quotes; empty if it has none.
pub fn label(cue: &Cue) -> String {
    if cue.label.is_empty() {
        return String::new();
    }
    format!("\"{}\"", cue.label)
}

/// Coordinates with their settings: `lamp 0.64, day 0.05`.
pub fn setting(show: &Show, setting: &[f64]) -> String {
    let coordinates = show.coordinates();
    let pairs = coordinates.iter().zip(setting);
    let words: Vec<String> = pairs.map(|(c, s)| format!("{} {s}", c.name)).collect();
    words.join(", ")
}

/// `1 thread, NAME, linux x86_64`.
pub fn machine(machine: &Machine) -> String {
    let threads = count(machine.threads, "thread");
    match &machine.processor {
        Some(name) => format!("{threads}, {name}, {}", machine.system),
        None => format!("{threads}, {}", machine.system),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentage_has_three_digits_also_where_it_rounds_up() {
        let all = [1.0, 0.9996, 0.3, 0.099_999_9, 0.02, 0.009_999_9, 0.005, 0.0];
        let words = all.map(percent);
        let expected = [
            "100", "100", "30.0", "10.0", "2.00", "1.00", "0.500", "0.00",
        ];
        assert_eq!(words, expected);
    }
}
