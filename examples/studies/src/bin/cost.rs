//! Fits the unit costs of `src/transport/hemicube/cost.rs` to measurements of every shipped scene
//! at every step, and prints prediction over measurement for each: `cargo run --release -p
//! footlight-studies --bin cost`.
//!
//! `--check` only prints, `--quick` leaves out the finest step. Times are in units of cost,
//! calibrated before each step, so the machine's speed and other load matter little; an idle
//! machine is still better. The fit minimizes squared relative errors over non-negative costs.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

#[path = "../../../../tests/reference/mod.rs"]
mod reference;
#[path = "../../../../tests/reference/rooms.rs"]
mod rooms;

use footlight_host::work::{Silent, Work};
use footlight_stage::Gloss;
use footlight_transport::hemicube::cost::{Counts, LIGHTS, PICTURE, PREPARE};
use footlight_transport::hemicube::step::HemicubeStep;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport};
use reference::{Case, cornell, furnace, stage, tavern};
use rooms::{first, room};
use std::time::Instant;

/// A step on a scene: its counts, and its time in units of cost.
struct Sample {
    name: String,
    counts: Counts,
    took: [f64; 3],
    predicted: [f64; 3],
    /// Predicted share of composing the images of the banks in rendering them.
    pictures: f64,
}

fn main() {
    let check = std::env::args().any(|a| a == "--check");
    let quick = std::env::args().any(|a| a == "--quick");
    let begin = Instant::now();
    let clock = || begin.elapsed().as_secs_f64();
    let work = Work {
        progress: &Silent,
        threads: 2,
        memory: 4 << 30,
    };
    let cases = [
        first(),
        furnace(),
        cornell(),
        stage(),
        varnished("first v.", first()),
        varnished("stage v.", stage()),
        varnished("tavern v.", tavern()),
        tavern(),
        room(200, 4, (320, 180)),
        room(1000, 8, (320, 180)),
    ];
    let mut samples = Vec::new();
    println!(
        "scene   step   unit of cost ms   seconds: prepare  banks  picture   predicted/measured: prepare  banks  together  picture"
    );
    for case in &cases {
        for quality in 1..=Radiosity.finest().0 - u8::from(quick) {
            let pace = Radiosity.cost_scale(&clock, work).unwrap();
            let sample = measure(case, Quality(quality), pace, &clock, work);
            let seconds = sample.took.map(|t| t * pace);
            let ratio = |a: f64, b: f64| a / b;
            let [p, b, i] = sample.predicted;
            let [tp, tb, ti] = sample.took;
            println!(
                "{:<12} {:>12.1} {:>17.3} {:>7.3} {:>8.4} {:>25.2} {:>6.2} {:>8.2} {:>8.2}",
                sample.name,
                pace * 1e3,
                seconds[0],
                seconds[1],
                seconds[2],
                ratio(p, tp),
                ratio(b, tb),
                ratio(p + b, tp + tb),
                ratio(i, ti),
            );
            samples.push(sample);
        }
    }
    if check {
        return;
    }
    let rows = |of: fn(&Counts) -> Vec<f64>, part: usize| -> Vec<(Vec<f64>, f64)> {
        let each = samples.iter().map(|s| {
            let own = [
                s.took[0],
                (s.took[1] - s.pictures).max(0.2 * s.took[1]),
                s.took[2],
            ];
            (of(&s.counts), own[part])
        });
        each.collect()
    };
    fitted(
        "OF_PREPARE",
        &PREPARE,
        &rows(|c| c.prepare.to_vec(), 0),
        &samples,
    );
    fitted(
        "OF_LIGHTS",
        &LIGHTS,
        &rows(|c| c.lights.to_vec(), 1),
        &samples,
    );
    fitted(
        "OF_PICTURE",
        &PICTURE,
        &rows(|c| c.picture.to_vec(), 2),
        &samples,
    );
}

/// A scene whose every upward surface is varnished.
fn varnished(name: &'static str, mut case: Case) -> Case {
    let floors = case.scene.polygons.iter().filter(|polygon| {
        let [a, b, c] = [0, 1, 2].map(|corner| polygon.vertices[corner]);
        (b - a).cross(c - a).normalized().z > 0.99
    });
    for floor in floors {
        case.scene.materials[floor.material].gloss = Some(Gloss::varnish(0.3));
    }
    Case { name, ..case }
}

fn measure(
    case: &Case,
    quality: Quality,
    pace: f64,
    clock: &dyn Fn() -> f64,
    work: Work<'_>,
) -> Sample {
    let n = case.rig.sources.len();
    let unit = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let banks: Vec<Vec<f64>> = (0..n).map(unit).collect();
    let mut best = [f64::INFINITY; 3];
    let mut spent = 0.0;
    let setup = case.setup();
    for _ in 0..3 {
        let mut marks = vec![clock()];
        let mut g = Radiosity.prepare(&setup, quality, work).unwrap();
        marks.push(clock());
        g.render(&banks, work).unwrap();
        marks.push(clock());
        g.render(&[vec![1.0; n]], work).unwrap();
        marks.push(clock());
        for (best, pair) in best.iter_mut().zip(marks.windows(2)) {
            *best = best.min(pair[1] - pair[0]);
        }
        spent += marks[3] - marks[0];
        if spent > 1.5 {
            break;
        }
    }
    let step = HemicubeStep::of(quality).unwrap();
    let counts = Counts::of(&setup, step).unwrap();
    let cost = counts.cost(n);
    let pictures = cost.per_lone * n as f64;
    let banks = cost.per_source * n as f64 + pictures;
    Sample {
        name: format!("{} {}", case.name, quality.0),
        took: best.map(|t| t / pace),
        pictures,
        predicted: [cost.prepare, banks, cost.per_image],
        counts,
    }
}

/// Non-negative least squares of relative errors by coordinate descent, and the quality of the fit.
fn fitted(name: &str, names: &[&str], rows: &[(Vec<f64>, f64)], samples: &[Sample]) {
    let width = names.len();
    let scaled: Vec<Vec<f64>> = rows
        .iter()
        .map(|(counts, took)| counts.iter().map(|c| c / took).collect())
        .collect();
    let mut units = vec![0.0; width];
    for _ in 0..20_000 {
        for k in 0..width {
            let (mut up, mut down) = (0.0, 0.0);
            for row in &scaled {
                let others: f64 = (0..width)
                    .filter(|j| *j != k)
                    .map(|j| units[j] * row[j])
                    .sum();
                up += row[k] * (1.0 - others);
                down += row[k] * row[k];
            }
            units[k] = if down > 0.0 {
                f64::max(up / down, 0.0)
            } else {
                0.0
            };
        }
    }
    let ratio = |row: &Vec<f64>| -> f64 { row.iter().zip(&units).map(|(c, u)| c * u).sum() };
    let mut ratios: Vec<(f64, &str)> = scaled
        .iter()
        .zip(samples)
        .map(|(row, s)| (ratio(row), s.name.as_str()))
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (low, high) = (ratios[0], ratios[ratios.len() - 1]);
    let written: Vec<String> = units.iter().map(|u| format!("{u:.3e}")).collect();
    println!("\nconst {name}: [f64; {width}] = [{}];", written.join(", "));
    println!(
        "  fits within {:.2} ({}) to {:.2} ({})",
        low.0, low.1, high.0, high.1
    );
    for (unit, name) in units.iter().zip(names) {
        println!("  {unit:.3e} units of cost for {name}");
    }
}
