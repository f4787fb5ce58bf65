//! Time and memory against the size of the task: `cargo run --release -p footlight-studies --bin
//! scale -- FOLDER`.
//!
//! Closed rooms of boxes, grown in one direction at a time: polygons 100 to 20,000, pixels to 1920
//! x 1080, banks 1 to 200. Prints each measurement and the exponents of growth, and writes
//! `scale.json`, `scale.csv`, `scale.png` and `scale.svg` to the folder. Each point runs in a
//! separate process, so that its peak of resident memory can be measured (Linux; omitted
//! elsewhere). `--quality Q` chooses the step (1), `--quick` leaves out the slowest points.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../../tests/reference/mod.rs"]
mod reference;
#[path = "../../../../tests/reference/results.rs"]
mod results;
#[path = "../../../../tests/reference/rooms.rs"]
mod rooms;

use footlight_engine::measure::Machine;
use footlight_host::files::processor;
use footlight_host::work::{Silent, Work};
use footlight_report::chart::{self, Axis, Marker, Panel, Scale, Theme};
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport};
use rooms::room;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Directions of growth, each named by its count.
const WAYS: [&str; 3] = ["polygons", "pixels", "banks"];

/// Polygons, banks and size of a task.
#[derive(Clone, Copy)]
struct Task {
    polygons: usize,
    banks: usize,
    size: (usize, usize),
}

impl Task {
    fn amount(&self, way: &str) -> f64 {
        match way {
            "polygons" => self.polygons as f64,
            "pixels" => (self.size.0 * self.size.1) as f64,
            _ => self.banks as f64,
        }
    }
}

fn tasks(way: &str, quick: bool) -> Vec<Task> {
    let plain = Task {
        polygons: 200,
        banks: 4,
        size: (320, 180),
    };
    let few = if quick { 4 } else { 99 };
    match way {
        "polygons" => [100, 300, 1000, 3000, 10_000, 20_000]
            .iter()
            .take(few)
            .map(|&polygons| Task { polygons, ..plain })
            .collect(),
        "pixels" => [(160, 90), (320, 180), (640, 360), (1280, 720), (1920, 1080)]
            .iter()
            .take(few)
            .map(|&size| Task { size, ..plain })
            .collect(),
        _ => [1, 4, 16, 64, 200]
            .iter()
            .take(few)
            .map(|&banks| Task { banks, ..plain })
            .collect(),
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let option = |name: &str| {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).cloned()
    };
    let quality: u8 = option("--quality").map_or(1, |q| q.parse().unwrap());
    if let Some(task) = option("--task") {
        return alone(&task, Quality(quality));
    }
    let quick = arguments.iter().any(|a| a == "--quick");
    let folder = arguments.first().filter(|a| !a.starts_with("--"));
    let quantities = vec![
        Quantity::new("amount", ""),
        Quantity::new("time to prepare", "s"),
        Quantity::new("time to render all banks", "s"),
        Quantity::new("peak memory", "MB"),
    ];
    let origin = Origin {
        subject: "Scale".to_owned(),
        machine: Machine::here(2, processor()),
    };
    let method = format!("closed rooms of boxes at quality {quality}, every bank alone");
    let mut record = Record::new(StudyKind::Scale, &origin, &method, quantities);
    for way in WAYS {
        println!("{way:>10}  prepare s  all banks s  peak MB");
        for task in tasks(way, quick) {
            let [prepare, render, memory] = measured(task, quality);
            let amount = task.amount(way);
            println!("{amount:>10} {prepare:>10.3} {render:>12.3} {memory:>8.1}");
            let values = [amount, prepare, render, memory].map(Some);
            record.add(way, &format!("{amount} {way}"), &[], &values);
        }
        results::exponents(&record, way);
    }
    if let Some(folder) = folder {
        write(&record, Path::new(folder));
    }
}

/// Runs a task in a separate process.
fn measured(task: Task, quality: u8) -> [f64; 3] {
    let Task {
        polygons,
        banks,
        size,
    } = task;
    let words = format!("{polygons},{banks},{},{}", size.0, size.1);
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--task", &words, "--quality", &quality.to_string()]);
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let mut numbers = text
        .split_whitespace()
        .map(|w| w.parse().unwrap_or(f64::NAN));
    std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN))
}

/// Runs a task and prints its seconds and megabytes.
fn alone(words: &str, quality: Quality) {
    let numbers: Vec<usize> = words.split(',').map(|w| w.parse().unwrap()).collect();
    let case = room(numbers[0], numbers[1], (numbers[2], numbers[3]));
    let work = Work {
        progress: &Silent,
        threads: 2,
        memory: 8 << 30,
    };
    let setup = case.setup();
    let begin = Instant::now();
    let mut g = Radiosity.prepare(&setup, quality, work).unwrap();
    let prepared = begin.elapsed().as_secs_f64();
    let n = case.rig.sources.len();
    // Bank by bank, like a refinement: memory then holds the operator, not the images.
    for bank in 0..n {
        let unit: Vec<f64> = (0..n).map(|j| f64::from(u8::from(j == bank))).collect();
        g.render(&[unit], work).unwrap();
    }
    let rendered = begin.elapsed().as_secs_f64() - prepared;
    println!(
        "{prepared} {rendered} {}",
        results::peak_memory().unwrap_or(f64::NAN)
    );
}

fn write(record: &Record, folder: &Path) {
    let panel = |way: &str| {
        let series = record.series.iter().find(|s| s.name == way);
        let curve = |name: &str, marker| chart::Series {
            name: match name {
                "peak memory" => "peak memory, GB".to_owned(),
                other => format!("{other}, s"),
            },
            points: series.map_or(Vec::new(), |s| {
                let scale = if name == "peak memory" { 1e-3 } else { 1.0 };
                let points = record.curve(s, "amount", name);
                points.into_iter().map(|(x, y)| (x, y * scale)).collect()
            }),
            marker,
            labels: Vec::new(),
        };
        Panel {
            title: format!("by {way}; threads: {}", record.machine.threads),
            x: Axis::new(way, Scale::Log),
            y: Axis::new("seconds; gigabytes", Scale::Log),
            series: vec![
                curve("time to prepare", Marker::Circle),
                curve("time to render all banks", Marker::Square),
                curve("peak memory", Marker::Triangle),
            ],
            reference: None,
        }
    };
    let processor = record.machine.processor.as_deref();
    let title = format!("{}; {}", record.method, processor.unwrap_or("unnamed"));
    let drawing = chart::panels(&title, &WAYS.map(panel), Theme::Light);
    results::write(folder, "scale", record, Some(&drawing));
}
