//! Error and time of each quality step: `cargo bench --bench transport`.
//!
//! Prints, for each reference scene, seconds to prepare, to render all banks one by one and to
//! compose one more image, the processor seconds of the first two (all threads; if the system
//! tells), and the error of the mixed image. Without a reference image each bank is compared with
//! the finest step: `--truth FOLDER` keeps those images there, and reads existing ones, so that two
//! versions of the program use one reference. `--pictures FOLDER` also writes the rendered images
//! and the references, as PPM; `--only SCENE` and `--steps 12` select. `uplit` is a room of 1000
//! faces with a bank seen only by reflection; its ground truth takes a few minutes of random walks,
//! and its error is printed with the standard deviation due to their noise.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a bench that reports to its reader"
)]

#[path = "../reference/mod.rs"]
mod reference;
#[path = "../reference/rooms.rs"]
mod rooms;
#[path = "../reference/walk.rs"]
mod walk;

use footlight_host::work::{Silent, Work};
use footlight_picture::Image;
use footlight_picture::exr::{self, Precision};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport};
use reference::{Case, cornell, counted, errors, picture, stage, tavern};
use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|a| a == name);
        at.and_then(|i| arguments.get(i + 1)).map(String::as_str)
    };
    let (folder, truth) = (value("--pictures"), value("--truth"));
    let (only, steps) = (value("--only"), value("--steps"));
    println!(
        "scene    quality  prepare s  all banks s  one more s  processor s  error %  without noise %"
    );
    let wanted = |case: &Case| only.is_none_or(|o| o == case.name);
    let step = |quality: &u8| steps.is_none_or(|s| s.contains(&quality.to_string()));
    for case in [cornell(), stage()].into_iter().filter(wanted) {
        let halves = ["mix_A.exr", "mix_B.exr"].map(|f| picture(case.name, f));
        for quality in (1..=3).filter(step) {
            measure(&case, quality, Some([&halves[0], &halves[1]]), folder);
        }
    }
    let uplit = rooms::uplit(1000, (320, 180));
    if wanted(&uplit) {
        let truth = Truth::of(&uplit);
        for quality in (1..=3).filter(step) {
            truth.against(&uplit, &measure(&uplit, quality, None, folder));
        }
    }
    let tavern = tavern();
    if !wanted(&tavern) {
        return;
    }
    let names: Vec<String> = tavern.rig.sources.iter().map(|s| s.name.clone()).collect();
    let finest = kept(&names, truth).unwrap_or_else(|| {
        let finest = measure(&tavern, 3, None, folder);
        keep(&names, truth, &finest);
        finest
    });
    for quality in (1..=3).filter(step) {
        let banks = measure(&tavern, quality, None, folder);
        against(&names, &banks, &finest);
    }
}

/// Images of an earlier run, if complete.
fn kept(names: &[String], truth: Option<&str>) -> Option<Vec<Image>> {
    let read = |name: &String| {
        let bytes = std::fs::read(format!("{}/{name}.exr", truth?)).ok()?;
        Some(exr::decode(&bytes, 1 << 28).unwrap())
    };
    names.iter().map(read).collect()
}

fn keep(names: &[String], truth: Option<&str>, pictures: &[Image]) {
    for (name, picture) in names.iter().zip(pictures) {
        if let Some(folder) = truth {
            let bytes = exr::encode(picture, Precision::Float, &[]).unwrap();
            std::fs::write(format!("{folder}/{name}.exr"), bytes).unwrap();
        }
    }
}

/// Processor seconds of all threads so far; NaN if the system does not tell it in hundredths under
/// `/proc`.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().nth(11);
    ticks.and_then(|t| t.parse().ok()).unwrap_or(f64::NAN) / 100.0
}

/// Ground truth for some pixels of each bank, by random walks.
struct Truth {
    pixels: Vec<[usize; 2]>,
    found: Vec<walk::Halves>,
}

impl Truth {
    fn of(case: &Case) -> Truth {
        let columns = (6..case.view.width).step_by(12);
        let pixels = columns.flat_map(|x| (6..case.view.height).step_by(12).map(move |y| [x, y]));
        let pixels: Vec<[usize; 2]> = pixels.collect();
        Truth {
            // Enough paths to know an error of 3 % to a thirtieth of it: a few bright pixels
            // dominate the image, and with 8192 paths their noise is still 2.5 %.
            found: walk::walk(case, &pixels, 65536),
            pixels,
        }
    }

    /// Prints each bank's error, without the walks' noise.
    fn against(&self, case: &Case, banks: &[Image]) {
        let error = |bank: usize| {
            let (mut apart, mut power, mut noise) = (0.0_f64, 0.0, 0.0);
            for ([x, y], halves) in self.pixels.iter().zip(&self.found) {
                let ours = banks[bank].pixel(*x, *y).unwrap();
                for c in 0..3 {
                    let [a, b] = [0, 1].map(|h| halves[h][bank][c]);
                    let product = (f64::from(ours[c]) - a) * (f64::from(ours[c]) - b);
                    apart += product;
                    power += a * b;
                    // Variance of the product of two numbers of one mean and independent noise.
                    let own = 0.5 * (a - b).powi(2);
                    noise += own * (own + 2.0 * product.max(0.0));
                }
            }
            let error = 100.0 * (apart.abs() / power).sqrt().copysign(apart);
            let deviation = 1e4 * noise.sqrt() / power / (2.0 * error.abs());
            format!("{error:.2} +- {deviation:.2}")
        };
        let sources = case.rig.sources.iter().enumerate();
        let listed: Vec<String> = sources
            .map(|(i, s)| format!("{} {}", s.name, error(i)))
            .collect();
        println!("         against walks, %: {}", listed.join(", "));
    }
}

/// Error of each bank against the finest step.
fn against(names: &[String], banks: &[Image], finest: &[Image]) {
    let mut errors: Vec<(f64, &String)> = banks
        .iter()
        .zip(finest)
        .map(|(bank, best)| {
            let pairs = || bank.data().iter().zip(best.data());
            let apart: f64 = pairs().map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let power: f64 = pairs().map(|(_, b)| f64::from(*b).powi(2)).sum();
            100.0 * (apart / power).sqrt()
        })
        .zip(names)
        .collect();
    errors.sort_by(|a, b| b.0.total_cmp(&a.0));
    let listed: Vec<String> = errors.iter().map(|(e, n)| format!("{n} {e:.2}")).collect();
    println!("         against the finest step, %: {}", listed.join(", "));
}

/// Renders all banks one by one and then the mix; returns the banks.
fn measure(
    case: &Case,
    quality: u8,
    halves: Option<[&Image; 2]>,
    folder: Option<&str>,
) -> Vec<Image> {
    let work = Work {
        progress: &Silent,
        threads: 2,
        memory: 4 << 30,
    };
    let setup = case.setup();
    let (start, begun) = (Instant::now(), processor());
    let mut g = Radiosity.prepare(&setup, Quality(quality), work).unwrap();
    let prepared = start.elapsed().as_secs_f64();
    let n = case.mix.len();
    let banks: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    let alone = g.render(&banks, work).unwrap();
    let all = start.elapsed().as_secs_f64() - prepared;
    let busy = processor() - begun;
    let mixed = g.render(std::slice::from_ref(&case.mix), work).unwrap();
    let more = start.elapsed().as_secs_f64() - prepared - all;
    let error = halves.map_or("-".to_owned(), |halves| {
        let (plain, fair) = errors(&mixed[0], halves, &counted(case, halves[0]));
        format!("{:>8.2} {:>16.2}", plain * 100.0, fair * 100.0)
    });
    let name = case.name;
    println!(
        "{name:<8} {quality:>7} {prepared:>10.3} {all:>12.3} {more:>11.3} {busy:>12.2} {error}"
    );
    if let Some(folder) = folder {
        write(&mixed[0], &format!("{folder}/{name}_{quality}.ppm"));
        if let Some([half, _]) = halves {
            write(half, &format!("{folder}/{name}_reference.ppm"));
        }
    }
    alone
}

/// Writes a plain PPM with a gamma of 2.2, the brightest hundredth clipped.
fn write(image: &Image, path: &str) {
    let mut sorted = image.data().to_vec();
    sorted.sort_by(f32::total_cmp);
    let white = sorted[sorted.len() * 98 / 100].max(1e-9);
    let code = |v: &f32| ((v / white).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8;
    let mut bytes = format!("P6 {} {} 255\n", image.width(), image.height()).into_bytes();
    bytes.extend(image.data().iter().map(code));
    std::fs::write(path, bytes).unwrap();
}
