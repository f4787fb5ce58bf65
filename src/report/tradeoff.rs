//! Error against time over the operator's quality steps: the speed-accuracy chart.

use super::words::{self, drawn, figure};
use super::{Quantity, Record, StudyKind};
use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use footlight_engine::measure::tradeoff::{Against, Measured, Tradeoff};

/// Name of the series for the mean of the banks.
const MEAN: &str = "mean of the banks";
const WORST: &str = "worst bank";

/// The table: mean of the banks, worst bank, then each bank, with a point for each step.
pub fn record(tradeoff: &Tradeoff) -> Record {
    let quantities = vec![
        Quantity::new("quality", ""),
        Quantity::new("time, all banks", "s"),
        Quantity::new("time to prepare", "s"),
        Quantity::new("time to render", "s"),
        Quantity::new("error", "%"),
    ];
    let method = method(tradeoff);
    let mut out = Record::new(StudyKind::Transport, &tradeoff.origin, &method, quantities);
    let row = |step: &Measured, error: Option<f64>| {
        [
            Some(f64::from(step.quality)),
            Some(step.seconds()),
            Some(step.prepare),
            Some(step.render),
            error.map(|e| e * 100.0),
        ]
    };
    for (step, marks) in tradeoff.steps.iter().zip(marks(tradeoff)) {
        let label = format!("quality {}", step.quality);
        out.add(MEAN, &label, &marks, &row(step, step.mean()));
        let worst = step.worst();
        let label = match worst {
            Some((name, _)) => format!("{label}: {name}"),
            None => label,
        };
        out.add(WORST, &label, &[], &row(step, worst.map(|(_, e)| e)));
    }
    for step in &tradeoff.steps {
        for (name, error) in &step.banks {
            let label = format!("quality {}", step.quality);
            out.add(&format!("bank {name}"), &label, &[], &row(step, *error));
        }
    }
    out
}

/// Marks of each step.
fn marks(tradeoff: &Tradeoff) -> Vec<Vec<&'static str>> {
    let of = |(step, front): (&Measured, bool)| {
        let is = [
            (front, "pareto"),
            (step.quality == tradeoff.coarse, "coarse"),
            (step.quality == tradeoff.refined, "refined"),
        ];
        is.iter().filter(|(is, _)| *is).map(|(_, m)| *m).collect()
    };
    tradeoff
        .steps
        .iter()
        .zip(tradeoff.front())
        .map(of)
        .collect()
}

/// Reference of the errors.
fn method(tradeoff: &Tradeoff) -> String {
    let against = match tradeoff.against {
        Against::References { noise_free: true } => {
            "against references, their noise taken out".to_owned()
        }
        Against::References { noise_free: false } => "against references".to_owned(),
        Against::Quality(step) => format!("against quality {step}"),
    };
    if tradeoff.without_emitters {
        format!("{against}, lamps in sight left out")
    } else {
        against
    }
}

/// The chart: log of the error over log of the time.
pub fn drawing(tradeoff: &Tradeoff, theme: Theme) -> Drawing {
    let steps = || tradeoff.steps.iter();
    let mean: Vec<(f64, f64)> = steps().map(|s| place(s, s.mean())).collect();
    let worst = steps().map(|s| place(s, s.worst().map(|(_, e)| e)));
    let only = |is: &dyn Fn(usize, &Measured) -> bool| -> Vec<(f64, f64)> {
        let points = steps().zip(&mean).enumerate();
        let kept = points.filter(|(i, (step, _))| is(*i, step));
        kept.map(|(_, (_, at))| *at).collect()
    };
    let front = tradeoff.front();
    let front = only(&|i, _| front.get(i).copied().unwrap_or(false));
    let series = |name: &str, points, marker, labels| chart::Series {
        name: name.to_owned(),
        points,
        marker,
        labels,
    };
    let numbers = steps().map(|s| s.quality.to_string()).collect();
    let named = |s: &Measured| match s.worst() {
        Some((bank, _)) => format!("{}: {bank}", s.quality),
        None => s.quality.to_string(),
    };
    let banks = steps().map(named).collect();
    let coarse = only(&|_, s| s.quality == tradeoff.coarse);
    let refined = only(&|_, s| s.quality == tradeoff.refined);
    let panel = Panel {
        title: heading(tradeoff),
        x: Axis::new("seconds to prepare and render all banks", Scale::Log),
        y: Axis::new("relative RMSE of a bank alone, %", Scale::Log),
        series: vec![
            series(WORST, worst.collect(), Marker::Circle, banks),
            series(MEAN, mean.clone(), Marker::Square, numbers),
            series("Pareto front", staircase(&front), Marker::None, Vec::new()),
            series(
                "the show's coarse step",
                coarse,
                Marker::Triangle,
                Vec::new(),
            ),
            series("its refined step", refined, Marker::Diamond, Vec::new()),
        ],
        reference: None,
    };
    let title = format!(
        "{}: error against time, by quality",
        tradeoff.origin.subject
    );
    chart::panels(&title, &[panel], theme)
}

/// Reference of the errors, and the machine.
fn heading(tradeoff: &Tradeoff) -> String {
    let machine = words::machine(&tradeoff.origin.machine);
    format!("{}; {machine}", method(tradeoff))
}

/// Seconds and error in percent. A step compared with itself has no error, and cannot be shown on a
/// log axis.
fn place(step: &Measured, error: Option<f64>) -> (f64, f64) {
    let error = error.map(|e| e * 100.0).filter(|e| *e > 0.0);
    (drawn(Some(step.seconds())), drawn(error))
}

/// The least error for a time: the best step so far.
fn staircase(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut sorted: Vec<(f64, f64)> = points.iter().copied().filter(|p| p.1 > 0.0).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<(f64, f64)> = Vec::new();
    for (time, error) in sorted {
        if let Some((_, before)) = out.last().copied() {
            out.push((time, before));
        }
        out.push((time, error));
    }
    out
}

/// One line for each step.
pub fn describe(tradeoff: &Tradeoff) -> String {
    let percent = |e: Option<f64>| e.map_or("-".to_owned(), figure);
    let mut out = format!(
        "{}\n  step     seconds   mean %  worst %\n",
        heading(tradeoff)
    );
    for (step, marks) in tradeoff.steps.iter().zip(marks(tradeoff)) {
        let worst = step.worst();
        let bank = worst.map_or("", |(bank, _)| bank);
        let marks = if marks.is_empty() {
            String::new()
        } else {
            format!("  ({})", marks.join(", "))
        };
        out += &format!(
            "  {:<8} {:>7.3} {:>8} {:>8} {bank}{marks}\n",
            step.quality,
            step.seconds(),
            percent(step.mean()),
            percent(worst.map(|(_, e)| e)),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;
    use footlight_engine::measure::{Machine, Origin};

    fn tradeoff() -> Tradeoff {
        let step = |quality, seconds: f64, errors: [Option<f64>; 2]| Measured {
            quality,
            prepare: 0.75 * seconds,
            render: 0.25 * seconds,
            banks: vec![
                ("front".to_owned(), errors[0]),
                ("back".to_owned(), errors[1]),
            ],
        };
        Tradeoff {
            origin: Origin {
                subject: "Test".to_owned(),
                machine: Machine::here(2, None),
            },
            against: Against::Quality(4),
            without_emitters: false,
            coarse: 1,
            refined: 3,
            steps: vec![
                step(1, 0.1, [Some(0.04), Some(0.02)]),
                step(2, 0.2, [Some(0.05), Some(0.03)]),
                step(3, 0.8, [Some(0.01), None]),
                step(4, 3.0, [Some(0.0), Some(0.0)]),
            ],
        }
    }

    #[test]
    fn the_front_is_drawn_as_a_staircase() {
        assert_eq!(
            staircase(&[(3.0, 1.0), (1.0, 4.0)]),
            [(1.0, 4.0), (3.0, 4.0), (3.0, 1.0)]
        );
    }

    #[test]
    fn a_record_has_the_mean_the_worst_and_every_bank() {
        let record = record(&tradeoff());
        let names: Vec<&str> = record.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, [MEAN, WORST, "bank front", "bank back"]);
        let mean = &record.series[0].points;
        assert_eq!(mean[0].marks, ["pareto", "coarse"]);
        assert!(mean[1].marks.is_empty());
        assert_eq!(mean[2].marks, ["pareto", "refined"]);
        assert!((mean[0].values[4].unwrap() - 3.0).abs() < 1e-9);
        assert!((mean[2].values[4].unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(record.series[1].points[0].label, "quality 1: front");
        assert_eq!(record.series[3].points[2].values[4], None);
        let words = describe(&tradeoff());
        assert!(words.contains("front  (pareto, coarse)"), "{words}");
    }

    #[test]
    fn the_chart_leaves_out_what_is_compared_with_itself() {
        let tradeoff = tradeoff();
        let error = |i: usize| place(&tradeoff.steps[i], tradeoff.steps[i].mean()).1;
        assert!(error(2) > 0.0 && error(3).is_nan());
        for theme in [Theme::Light, Theme::Dark] {
            let svg = drawing(&tradeoff, theme).svg();
            for text in [
                "Pareto front",
                "its refined step",
                "against quality 4",
                "relative RMSE",
            ] {
                assert!(svg.contains(text), "{text}");
            }
        }
    }
}
