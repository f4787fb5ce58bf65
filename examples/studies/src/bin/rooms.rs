//! Seconds, memory and error on rooms of many polygons: `cargo run --release -p footlight-studies
//! --bin rooms -- ROOM.lxq …`.
//!
//! Renders every bank of each show alone at steps 1 and 2 (`--steps 1,3` chooses) and prints the
//! processor seconds from the file to all banks, the peak of resident memory, and, if a folder
//! `ROOM` next to the show has reference images `BANK_A.exr` and `BANK_B.exr`, each bank's error
//! free of their noise and its mean over theirs. Each line is a separate process, for its seconds
//! and memory (Linux; omitted elsewhere).

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../../tests/reference/difference.rs"]
mod difference;
#[path = "../../../../tests/reference/results.rs"]
mod results;

use difference::{Reference, difference};
use footlight::{Engine, Host, Quality, Radiosity, Transport, Work};
use footlight_host::files::Folder;
use std::path::Path;
use std::process::Command;

/// Most bytes of a room's file, and of images.
const LIMIT: u64 = 1 << 30;

fn main() {
    let mut words = std::env::args().skip(1);
    let (mut steps, mut rooms) = ("1,2".to_owned(), Vec::new());
    while let Some(word) = words.next() {
        match word.as_str() {
            "--steps" => steps = words.next().unwrap(),
            "--alone" => return alone(&words.next().unwrap(), &words.next().unwrap()),
            _ => rooms.push(word),
        }
    }
    println!("room, step, processor s, peak MB; of each bank error, mean over reference");
    for room in &rooms {
        for step in steps.split(',') {
            let mut command = Command::new(std::env::current_exe().unwrap());
            let done = command.args(["--alone", room, step]).status().unwrap();
            assert!(done.success(), "{room} at step {step}");
        }
    }
}

/// Renders all banks of a room at a step and prints the cost.
fn alone(path: &str, step: &str) {
    // Like the program.
    footlight_host::files::return_large_blocks();
    let path = Path::new(path);
    let folder = path.parent().unwrap();
    let host = Host {
        files: Box::new(Folder::new(folder, LIMIT)),
        ..Host::default()
    };
    let engine = Engine::open(path, host).unwrap();
    let setup = engine.document().setup().unwrap();
    let work = Work {
        threads: 2,
        memory: 16 << 30,
        ..Work::silent()
    };
    let quality = Quality(step.parse().unwrap());
    let mut operator = Radiosity.prepare(setup, quality, work).unwrap();
    let banks = setup.rig.sources.len();
    let one = |bank: usize| {
        let setting = (0..banks).map(|other| f64::from(u8::from(other == bank)));
        setting.collect::<Vec<f64>>()
    };
    let settings: Vec<Vec<f64>> = (0..banks).map(one).collect();
    let pictures = operator.render(&settings, work).unwrap();
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.1}"));
    let name = path.file_stem().unwrap().to_string_lossy();
    let seconds = shown(results::processor_seconds());
    let memory = shown(results::peak_memory());
    print!("{name:>14} {step} {seconds:>8} {memory:>8}");
    let names: Vec<String> = setup.rig.sources.iter().map(|s| s.name.clone()).collect();
    let references = folder.join(name.as_ref());
    if let Ok(known) = Reference::load(&references, &names) {
        for ((bank, picture), reference) in names.iter().zip(&pictures).zip(&known) {
            let found = difference(picture, reference, None).unwrap();
            let error = 100.0 * found.best();
            print!("  {bank} {error:.2} % {:.4}", found.mean_ratio);
        }
    }
    println!();
}
