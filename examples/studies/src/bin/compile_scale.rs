//! Time from text to plan against the size of the show: `cargo run --release -p footlight-studies
//! --bin compile_scale -- [FOLDER]`.
//!
//! Shows of 100 to 5,000 cues on 200 banks, and of 1 to 200 banks with 2,000 cues; a cue moves a
//! tenth of the banks. Prints for each the seconds of compiling (text to key settings), of the
//! plan, and of an edit of one cue as at the prompt, with the peak of memory; and the exponents of
//! growth. Each show runs in a separate process, so that its peak of resident memory can be
//! measured (Linux; omitted elsewhere). Times are processor time if the system tells it, so that
//! other load matters little. Writes `compile_scale` as .json, .csv, .png and .svg to the folder.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../../tests/bench/cue_sheet.rs"]
mod cue_sheet;
#[path = "../../../../tests/reference/results.rs"]
mod results;

use cue_sheet::{Size, cue_sheet};
use footlight_engine::measure::Machine;
use footlight_engine::plan::{Plan, Weighting};
use footlight_engine::{Engine, Host};
use footlight_host::files::processor;
use footlight_report::chart::{self, Axis, Marker, Panel, Scale, Theme};
use footlight_report::words;
use footlight_show::lang::edit::Edit;
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Directions of growth.
const WAYS: [&str; 2] = ["cues", "banks"];
/// Measured quantities of each show.
const MEASURED: [&str; 4] = ["compiling", "plan", "edit of one cue", "peak memory"];

fn sizes(way: &str) -> Vec<Size> {
    let of = |banks: usize, cues| Size {
        banks,
        cues,
        moved: banks.div_ceil(10),
    };
    match way {
        "cues" => [100, 200, 500, 1000, 2000, 5000]
            .map(|cues| of(200, cues))
            .into(),
        _ => [1, 4, 16, 64, 200].map(|banks| of(banks, 2000)).into(),
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [first, words] = arguments.as_slice()
        && first == "--size"
    {
        return alone(words);
    }
    let mut quantities = vec![Quantity::new("amount", "")];
    quantities.extend(MEASURED.map(|name| {
        let unit = if name == "peak memory" { "MB" } else { "s" };
        Quantity::new(name, unit)
    }));
    let origin = Origin {
        subject: "Compiling".to_owned(),
        machine: Machine::here(1, processor()),
    };
    let method = "a cue moves a tenth of the banks; processor time, means";
    let mut record = Record::new(StudyKind::Scale, &origin, method, quantities);
    for way in WAYS {
        println!("{way:>10}  compile ms   plan ms   edit ms   peak MB");
        for size in sizes(way) {
            let amount = if way == "cues" { size.cues } else { size.banks } as f64;
            let [compile, plan, edit, memory] = measured(size);
            let [c, p, e] = [compile, plan, edit].map(|s| 1e3 * s);
            println!("{amount:>10} {c:>11.1} {p:>9.1} {e:>9.1} {memory:>9.1}");
            let values = [amount, compile, plan, edit, memory].map(Some);
            record.add(way, &format!("{amount} {way}"), &[], &values);
        }
        results::exponents(&record, way);
    }
    if let Some(folder) = arguments.first() {
        let chart = chart::panels(
            &title(&record),
            &WAYS.map(|w| panel(&record, w)),
            Theme::Light,
        );
        results::write(Path::new(folder), "compile_scale", &record, Some(&chart));
    }
}

fn title(record: &Record) -> String {
    format!("Text to plan; {}", words::machine(&record.machine))
}

/// Runs a show in a separate process.
fn measured(size: Size) -> [f64; 4] {
    let words = format!("{},{},{}", size.banks, size.cues, size.moved);
    let mut command = Command::new(std::env::current_exe().unwrap());
    let output = command.args(["--size", &words]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let mut numbers = text
        .split_whitespace()
        .map(|w| w.parse().unwrap_or(f64::NAN));
    std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
}

/// Compiles, plans and edits a show and prints seconds and megabytes.
fn alone(words: &str) {
    let numbers: Vec<usize> = words.split(',').map(|w| w.parse().unwrap()).collect();
    let [banks, cues, moved] = numbers[..] else {
        return;
    };
    let text = cue_sheet(Size { banks, cues, moved });
    let open = || Engine::from_text("large.lxq", text.as_bytes(), Host::default()).unwrap();
    let compile = mean(3, || drop(open()));
    let mut show = open();
    let plan = mean(2, || {
        let keys = show.document().keys();
        let weighting = Weighting::settings(keys.coordinates());
        drop(Plan::new(keys, &weighting, 0.02).unwrap());
    });
    let mut level = 0;
    let edit = mean(10, || {
        level = (level + 1) % 100;
        let cue = format!("cue {} {{ time 3  b1 {level} }}", cues / 2);
        drop(show.edit(&Edit::Declare(cue)).unwrap());
    });
    let memory = results::peak_memory().unwrap_or(f64::NAN);
    println!("{compile} {plan} {edit} {memory}");
}

/// Mean seconds over at least `least` runs and half a second.
fn mean(least: usize, mut run: impl FnMut()) -> f64 {
    let idle = Instant::now();
    let now = || processor_seconds().unwrap_or_else(|| idle.elapsed().as_secs_f64());
    let begin = now();
    let mut runs = 0;
    while runs < least || now() - begin < 0.5 {
        run();
        runs += 1;
    }
    (now() - begin) / runs as f64
}

fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    let nanoseconds: f64 = text.split(' ').next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

fn panel(record: &Record, way: &str) -> Panel {
    let series = record.series.iter().find(|s| s.name == way);
    let markers = [
        Marker::Circle,
        Marker::Square,
        Marker::Triangle,
        Marker::Diamond,
    ];
    let curve = |(name, marker): (&str, Marker)| {
        let (shown, scale) = match name {
            "peak memory" => ("peak memory, GB".to_owned(), 1e-3),
            other => (format!("{other}, s"), 1.0),
        };
        let points = series.map_or(Vec::new(), |s| record.curve(s, "amount", name));
        chart::Series {
            name: shown,
            points: points.into_iter().map(|(x, y)| (x, y * scale)).collect(),
            marker,
            labels: Vec::new(),
        }
    };
    Panel {
        title: match way {
            "cues" => "200 banks".to_owned(),
            _ => "2,000 cues".to_owned(),
        },
        x: Axis::new(way, Scale::Log),
        y: Axis::new("seconds; gigabytes", Scale::Log),
        series: MEASURED.into_iter().zip(markers).map(curve).collect(),
        reference: None,
    }
}
