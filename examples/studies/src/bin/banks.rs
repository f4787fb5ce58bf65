//! Error against seconds over the steps of quality, every bank alone: `cargo run --release -p
//! footlight-studies --bin banks -- SHOW.lxq [--reference FOLDER] [--quality N] [--once] [FOLDER]`
//! prints a table and writes `transport` (.png, .svg, .csv, .json) to the last folder. Each step is
//! rendered up to three times, or `--once`.
//!
//! Errors are against the pictures `BANK.exr`, or the halves `BANK_A.exr` and `BANK_B.exr`, of the
//! reference folder, else against the finest step. Pixels next to a lamp in sight are left out.

#![allow(clippy::print_stdout, reason = "a program that reports to its reader")]

#[path = "../../../../tests/reference/difference.rs"]
mod difference;
#[path = "../../../../tests/reference/results.rs"]
mod results;

use std::path::{Path, PathBuf};

use difference::{Reference, difference};
use footlight_engine::measure::Machine;
use footlight_engine::measure::meter::away_from;
use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_report::chart::{self, Axis, Drawing, Marker, Panel, Scale, Theme};
use footlight_report::words::{self, figure};
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};
use footlight_studies::timed::banks_alone;
use footlight_transport::Quality;
use footlight_transport::surfaces::emitter_mask;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let show = PathBuf::from(arguments.next().ok_or("the show's file is missing")?);
    let (mut reference, mut only, mut out, mut runs) = (None, None, None, 3);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--reference" => reference = Some(PathBuf::from(arguments.next().ok_or("a folder")?)),
            "--quality" => only = Some(arguments.next().ok_or("a step")?.parse::<u8>()?),
            "--once" => runs = 1,
            _ => out = Some(PathBuf::from(argument)),
        }
    }
    let host = Host {
        files: Box::new(Folder::new(show.parent().unwrap_or(Path::new("")), 1 << 26)),
        threads: 2,
        ..Host::default()
    };
    let text = std::fs::read(&show)?;
    let name = show.file_name().unwrap_or_default().to_string_lossy();
    let engine = Engine::from_text(&name, &text, host).map_err(|e| e.to_string())?;
    let tradeoff = measure(&engine, reference.as_deref(), (only, runs))?;
    print!("{}", describe(&tradeoff));
    if let Some(folder) = out {
        let drawing = drawing(&tradeoff);
        results::write(&folder, "transport", &record(&tradeoff), Some(&drawing));
    }
    Ok(())
}

/// Measures error against time over the quality steps, or at `only` one; the fastest of `runs`
/// counts.
fn measure(
    engine: &Engine,
    folder: Option<&Path>,
    (only, runs): (Option<u8>, usize),
) -> Result<Tradeoff, Failure> {
    let setup = engine.document().setup().ok_or("no stage or no view")?;
    let names: Vec<String> = engine.show().banks.iter().map(|b| b.name.clone()).collect();
    let finest = engine.estimate().finest().0;
    let near = emitter_mask::emitters(setup, engine.work())?;
    let counted = away_from(&near, setup.view.width, 1);
    // When only lamps are visible, they count.
    let mask = Some(counted.as_slice()).filter(|counted| counted.contains(&true));
    let mut last = None;
    let references = match folder {
        Some(folder) => Reference::load(folder, &names)?,
        None => {
            let (images, seconds) = banks_alone(engine, Quality(finest), runs)?;
            last = Some(seconds);
            images.into_iter().map(Reference::of).collect()
        }
    };
    let mut steps = Vec::new();
    for quality in only.map_or(1..=finest, |only| only..=only) {
        let (seconds, errors) = match last.filter(|_| quality == finest) {
            Some(seconds) => (seconds, vec![Some(0.0); names.len()]),
            None => {
                let (images, seconds) = banks_alone(engine, Quality(quality), runs)?;
                let pairs = images.iter().zip(&references);
                let errors = pairs.map(|(i, r)| difference(i, r, mask).map(|d| d.best()));
                (seconds, errors.collect())
            }
        };
        steps.push(Measured {
            quality,
            prepare: seconds.prepare,
            render: seconds.banks,
            banks: names.iter().cloned().zip(errors).collect(),
        });
    }
    let noise_free = references.iter().all(|r| r.halves.is_some());
    Ok(Tradeoff {
        origin: Origin {
            subject: engine.show().title.clone(),
            machine: Machine::of(engine.host()),
        },
        against: match folder {
            Some(_) => Against::References { noise_free },
            None => Against::Quality(finest),
        },
        without_emitters: near.contains(&true) && mask.is_some(),
        coarse: engine.estimate().coarse_steps()[1].0,
        refined: engine.estimate().refined_step().0,
        steps,
    })
}

/// The error of every quality step against its time.
#[derive(Clone, Debug, PartialEq)]
struct Tradeoff {
    /// The show and the machine.
    origin: Origin,
    /// The reference.
    against: Against,
    /// True when pixels next to an emitter are left out of the errors.
    without_emitters: bool,
    /// The show's own coarse step.
    coarse: u8,
    /// The show's own refined step.
    refined: u8,
    /// In order of quality.
    steps: Vec<Measured>,
}

/// The ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Against {
    /// Reference images.
    References {
        /// True when each comes as two halves, so that noise does not count.
        noise_free: bool,
    },
    /// The operator's own images at this step.
    Quality(u8),
}

/// Time and error of a quality step.
#[derive(Clone, Debug, PartialEq)]
struct Measured {
    /// The step.
    quality: u8,
    /// Seconds to prepare.
    prepare: f64,
    /// Seconds to render all banks.
    render: f64,
    /// Relative error of each bank; `None` if unknown.
    banks: Vec<(String, Option<f64>)>,
}

impl Measured {
    /// Seconds to prepare and to render all banks.
    fn seconds(&self) -> f64 {
        self.prepare + self.render
    }

    /// The mean over banks with a known error; `None` without any.
    fn mean(&self) -> Option<f64> {
        let (count, sum) = (self.known()).fold((0_usize, 0.0), |(n, s), (_, e)| (n + 1, s + e));
        (count > 0).then(|| sum / count as f64)
    }

    /// The bank with the largest error; `None` when no bank has an error.
    fn worst(&self) -> Option<(&str, f64)> {
        let off = self.known().filter(|(_, error)| *error > 0.0);
        off.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn known(&self) -> impl Iterator<Item = (&str, f64)> {
        let banks = self.banks.iter();
        banks.filter_map(|(name, error)| error.map(|e| (name.as_str(), e)))
    }
}

impl Tradeoff {
    /// For each step, true when no other has both a smaller mean error and a shorter time.
    fn front(&self) -> Vec<bool> {
        let points = self.steps.iter().map(|s| (s.seconds(), s.mean()));
        pareto(&points.collect::<Vec<_>>())
    }
}

/// For each point (time, error), true when no other one beats it in both.
fn pareto(points: &[(f64, Option<f64>)]) -> Vec<bool> {
    let beaten = |time: f64, error: f64| {
        points
            .iter()
            .any(|(t, e)| e.is_some_and(|e| *t <= time && e <= error && (*t < time || e < error)))
    };
    let on = |&(time, error): &(f64, Option<f64>)| error.is_some_and(|e| !beaten(time, e));
    points.iter().map(on).collect()
}

/// Name of the series for the mean of the banks.
const MEAN: &str = "mean of the banks";
const WORST: &str = "worst bank";

/// The table: mean of the banks, worst bank, then each bank, with a point for each step.
fn record(tradeoff: &Tradeoff) -> Record {
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
fn drawing(tradeoff: &Tradeoff) -> Drawing {
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
    chart::panels(&title, &[panel], Theme::Light)
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
    (step.seconds(), error.unwrap_or(f64::NAN))
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
fn describe(tradeoff: &Tradeoff) -> String {
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
