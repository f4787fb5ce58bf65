//! Error against time over the operator's scale of quality: the speed-accuracy chart.

use crate::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use crate::study::comparison::figure;
use crate::study::{Kind, Machine, Point, Quantity, Record};

/// What a step of quality took and how far it was off.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// The step.
    pub quality: u8,
    /// Seconds to prepare.
    pub prepare: f64,
    /// Seconds to render all banks.
    pub render: f64,
    /// Relative error of each bank; `None` where it cannot be known.
    pub banks: Vec<(String, Option<f64>)>,
}

/// What a record says of where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// The show's title.
    pub subject: String,
    /// Where it was measured.
    pub machine: Machine,
    /// What the errors are against.
    pub method: String,
    /// The show's own coarse step.
    pub coarse: u8,
    /// The show's own refined step.
    pub refined: u8,
}

/// Over all banks of a step.
const MEAN: &str = "mean of the banks";
const WORST: &str = "worst bank";
const TIME: &str = "time, all banks";
const ERROR: &str = "error";
const FRONT: &str = "pareto";
const COARSE: &str = "coarse";
const REFINED: &str = "refined";

/// Steps in order of quality as a record: the mean, the worst bank, then each bank.
pub fn record(origin: &Origin, steps: &[Measured]) -> Record {
    let quantities = vec![
        Quantity::new("quality", ""),
        Quantity::new(TIME, "s"),
        Quantity::new("time to prepare", "s"),
        Quantity::new("time to render", "s"),
        Quantity::new(ERROR, "%"),
    ];
    let mut out = Record::new(
        Kind::Transport,
        &origin.subject,
        origin.machine.clone(),
        &origin.method,
        quantities,
    );
    let means: Vec<Option<f64>> = steps.iter().map(mean).collect();
    let place = |(step, mean): (&Measured, &Option<f64>)| (step.prepare + step.render, *mean);
    let front = pareto(&steps.iter().zip(&means).map(place).collect::<Vec<_>>());
    let row = |step: &Measured, error: Option<f64>| {
        [
            Some(f64::from(step.quality)),
            Some(step.prepare + step.render),
            Some(step.prepare),
            Some(step.render),
            error.map(|e| e * 100.0),
        ]
    };
    for ((step, mean), front) in steps.iter().zip(&means).zip(&front) {
        let is = [
            (*front, FRONT),
            (step.quality == origin.coarse, COARSE),
            (step.quality == origin.refined, REFINED),
        ];
        let marks: Vec<&str> = is.iter().filter(|(is, _)| *is).map(|(_, m)| *m).collect();
        let label = format!("quality {}", step.quality);
        out.add(MEAN, &label, &marks, &row(step, *mean));
        let worst = worst(step);
        let label = match worst {
            Some((name, _)) => format!("{label}: {name}"),
            None => label,
        };
        out.add(WORST, &label, &[], &row(step, worst.map(|(_, e)| e)));
    }
    for step in steps {
        for (name, error) in &step.banks {
            let label = format!("quality {}", step.quality);
            out.add(&format!("bank {name}"), &label, &[], &row(step, *error));
        }
    }
    out
}

fn known(step: &Measured) -> impl Iterator<Item = (&str, f64)> {
    let banks = step.banks.iter();
    banks.filter_map(|(name, error)| error.map(|e| (name.as_str(), e)))
}

fn mean(step: &Measured) -> Option<f64> {
    let (count, sum) = known(step).fold((0_usize, 0.0), |(n, s), (_, e)| (n + 1, s + e));
    (count > 0).then(|| sum / count as f64)
}

fn worst(step: &Measured) -> Option<(&str, f64)> {
    let off = known(step).filter(|(_, error)| *error > 0.0);
    off.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Which of the points (time, error) no other one beats in both.
pub fn pareto(points: &[(f64, Option<f64>)]) -> Vec<bool> {
    let beaten = |time: f64, error: f64| {
        points
            .iter()
            .any(|(t, e)| e.is_some_and(|e| *t <= time && e <= error && (*t < time || e < error)))
    };
    let on = |&(time, error): &(f64, Option<f64>)| error.is_some_and(|e| !beaten(time, e));
    points.iter().map(on).collect()
}

/// The chart of a record made by [`record`]: log of the error over log of the time.
pub fn drawing(record: &Record, theme: Theme) -> Drawing {
    let find = |name: &str| record.series.iter().find(|s| s.name == name);
    let curve = |name: &str| find(name).map_or(Vec::new(), |s| shown(record.curve(s, TIME, ERROR)));
    let labels = |name: &str| {
        let points = find(name).map_or(&[][..], |s| s.points.as_slice());
        let short = |p: &Point| p.label.trim_start_matches("quality ").to_owned();
        points.iter().map(short).collect::<Vec<String>>()
    };
    let mean = curve(MEAN);
    let marked = |mark: &str| {
        let points = find(MEAN).map_or(&[][..], |s| s.points.as_slice());
        let with = points.iter().zip(&mean);
        with.filter(|(p, _)| p.marks.iter().any(|m| m == mark))
            .map(|(_, at)| *at)
            .collect::<Vec<(f64, f64)>>()
    };
    let series = |name: &str, points, marker, labels| chart::Series {
        name: name.to_owned(),
        points,
        marker,
        labels,
    };
    let panel = Panel {
        title: format!("{}; {}", record.method, record.machine.describe()),
        x: Axis::new("seconds to prepare and render all banks", Scale::Log),
        y: Axis::new("relative RMSE of a bank alone, %", Scale::Log),
        series: vec![
            series(WORST, curve(WORST), Marker::Circle, labels(WORST)),
            series(MEAN, mean.clone(), Marker::Square, labels(MEAN)),
            series(
                "Pareto front",
                staircase(&marked(FRONT)),
                Marker::None,
                Vec::new(),
            ),
            series(
                "the show's coarse step",
                marked(COARSE),
                Marker::Triangle,
                Vec::new(),
            ),
            series(
                "its refined step",
                marked(REFINED),
                Marker::Diamond,
                Vec::new(),
            ),
        ],
        reference: None,
    };
    let title = format!("{}: error against time, by quality", record.subject);
    chart::panels(&title, &[panel], theme)
}

/// Without the errors that are nothing: a step held against itself has no place on a log axis.
fn shown(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points
        .into_iter()
        .map(|(t, e)| (t, if e > 0.0 { e } else { f64::NAN }))
        .collect()
}

/// What can be had in a time: the error of the best step so far.
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

/// The record in words: a line for each step.
pub fn describe(record: &Record) -> String {
    let find = |name: &str| record.series.iter().find(|s| s.name == name);
    let (Some(mean), Some(worst)) = (find(MEAN), find(WORST)) else {
        return String::new();
    };
    let error = |point: &Point| {
        let column = record.column(ERROR)?;
        point.values.get(column).copied().flatten()
    };
    let percent = |e: Option<f64>| e.map_or("-".to_owned(), |e| figure(e / 100.0));
    let time = |point: &Point| {
        let column = record.column(TIME);
        column
            .and_then(|c| point.values.get(c).copied().flatten())
            .unwrap_or(f64::NAN)
    };
    let mut out = format!(
        "{}; {}\n  step     seconds   mean %  worst %\n",
        record.method,
        record.machine.describe()
    );
    for (m, w) in mean.points.iter().zip(&worst.points) {
        let bank = w.label.split_once(": ").map_or("", |(_, bank)| bank);
        let marks = match m.marks.is_empty() {
            true => String::new(),
            false => format!("  ({})", m.marks.join(", ")),
        };
        out += &format!(
            "  {:<8} {:>7.3} {:>8} {:>8} {bank}{marks}\n",
            m.label.trim_start_matches("quality "),
            time(m),
            percent(error(m)),
            percent(error(w)),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;

    fn steps() -> Vec<Measured> {
        let step = |quality, seconds: f64, errors: [Option<f64>; 2]| Measured {
            quality,
            prepare: 0.75 * seconds,
            render: 0.25 * seconds,
            banks: vec![
                ("front".to_owned(), errors[0]),
                ("back".to_owned(), errors[1]),
            ],
        };
        vec![
            step(1, 0.1, [Some(0.04), Some(0.02)]),
            step(2, 0.2, [Some(0.05), Some(0.03)]),
            step(3, 0.8, [Some(0.01), None]),
            step(4, 3.0, [Some(0.0), Some(0.0)]),
        ]
    }

    fn origin() -> Origin {
        Origin {
            subject: "Test".to_owned(),
            machine: Machine::here(2, None),
            method: "against step 4".to_owned(),
            coarse: 1,
            refined: 3,
        }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (1.0, Some(4.0)),
            (2.0, Some(5.0)),
            (3.0, Some(1.0)),
            (4.0, None),
        ];
        assert_eq!(pareto(&points), [true, false, true, false]);
        // Of two equal points neither beats the other.
        assert_eq!(pareto(&[(1.0, Some(1.0)), (1.0, Some(1.0))]), [true, true]);
        assert_eq!(
            staircase(&[(3.0, 1.0), (1.0, 4.0)]),
            [(1.0, 4.0), (3.0, 4.0), (3.0, 1.0)]
        );
    }

    #[test]
    fn a_record_has_the_mean_the_worst_and_every_bank() {
        let record = record(&origin(), &steps());
        let names: Vec<&str> = record.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, [MEAN, WORST, "bank front", "bank back"]);
        let mean = &record.series[0].points;
        assert_eq!(mean[0].marks, [FRONT, COARSE]);
        assert!(mean[1].marks.is_empty());
        assert_eq!(mean[2].marks, [FRONT, REFINED]);
        assert!((mean[0].values[4].unwrap() - 3.0).abs() < 1e-9);
        assert!((mean[2].values[4].unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(record.series[1].points[0].label, "quality 1: front");
        assert_eq!(record.series[3].points[2].values[4], None);
        let words = describe(&record);
        assert!(words.contains("front  (pareto, coarse)"), "{words}");
    }

    #[test]
    fn the_chart_leaves_out_what_is_held_against_itself() {
        let record = record(&origin(), &steps());
        let curve = shown(record.curve(&record.series[0], TIME, ERROR));
        assert!(curve[2].1 > 0.0 && curve[3].1.is_nan());
        for theme in [Theme::Light, Theme::Dark] {
            let svg = drawing(&record, theme).svg();
            for text in [
                "Pareto front",
                "its refined step",
                "against step 4",
                "relative RMSE",
            ] {
                assert!(svg.contains(text), "{text}");
            }
        }
    }
}
