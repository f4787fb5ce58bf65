//! What is promised of an error against what is true: the shipped shows and 40 random ones (rooms, dark
//! cues, open squares, textures with projections).
//! `cargo run --release --example promise [SHOWS]` prints, for each show and step of quality, the
//! worst moment's true error against the finest step, and what the operator states; then, over
//! tolerances from 4 to 0.4 %, how often the step that is chosen keeps its promise, and what the
//! choice costs over that of one who knows the errors.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by the pictures, steps and sources they were made of"
)]

#[path = "../trial/dice.rs"]
mod dice;
#[path = "../trial/random_show.rs"]
#[allow(dead_code, reason = "not all of it is wanted here")]
mod random_show;

use std::error::Error;
use std::path::Path;

use footlight::engine::{Engine, Host};
use footlight::files::Folder;
use footlight::geometry::vec3;
use footlight::picture::combine::dot;
use footlight::picture::{Image, png};
use footlight::renderer::Quality;
use random_show::{RandomShow, random_show};

/// Random shows.
const SHOWS: u64 = 40;
/// Darker moments than this share of the brightest one's light do not count.
const NEARLY_OUT: f64 = 0.05;
/// Moments of a cue, as parts of its fade.
const PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

type Failure = Box<dyn Error>;

/// A show's errors and costs, step by step.
struct Measured {
    name: String,
    stated: Vec<f64>,
    truth: Vec<f64>,
    /// In the operator's units.
    cost: Vec<f64>,
    /// Between this step and the one before it, at the worst moment.
    apart: Vec<f64>,
    about: String,
}

fn measured(name: &str, engine: &mut Engine) -> Result<Measured, Failure> {
    let n = engine.show().coordinates().len();
    let finest = engine.finest().0;
    let mut steps = Vec::new();
    for quality in 1..=finest {
        let mut images = Vec::new();
        for i in 0..n {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            images.push(engine.render(&unit, Quality(quality))?);
        }
        steps.push(images);
    }
    let mut moments = Vec::new();
    for cue in engine.document().timeline().cues() {
        for part in PARTS {
            let time = cue.go + (cue.completion - cue.go).scaled(part);
            moments.push(engine.setting(time));
        }
    }
    let last = &steps[usize::from(finest) - 1];
    let lights = norms(last, None, &moments);
    let brightest = lights.iter().fold(0.0f64, |m, x| m.max(*x));
    let worst = |a: &[Image], b: &[Image]| {
        let errors = norms(a, Some(b), &moments);
        let lit = errors.iter().zip(&lights);
        lit.filter(|(_, light)| **light > NEARLY_OUT * brightest)
            .fold(0.0f64, |m, (e, light)| m.max(e / light))
    };
    let setup = engine.setup().ok_or("no setup")?;
    let renderer = &engine.host().renderer;
    let stated = (1..=finest).map(|q| renderer.stated_error(setup, Quality(q)).unwrap_or(0.0));
    let cost = (1..=finest).map(|q| renderer.cost(setup, Quality(q)).alone(n as f64));
    let (mut area, mut reflected) = (0.0, 0.0);
    for polygon in &setup.scene.polygons {
        let own = area_of(&polygon.vertices);
        let rho = setup.scene.materials[polygon.material].reflectance.0;
        area += own;
        reflected += own * (rho[0] + rho[1] + rho[2]) / 3.0;
    }
    Ok(Measured {
        name: name.to_owned(),
        stated: stated.collect(),
        truth: steps.iter().map(|step| worst(step, last)).collect(),
        cost: cost.collect(),
        apart: steps.windows(2).map(|w| worst(&w[0], &w[1])).collect(),
        about: format!(
            "polygons {} sources {n} pixels {} reflectance {:.3}",
            setup.scene.polygons.len(),
            setup.view.width * setup.view.height,
            reflected / area
        ),
    })
}

/// The norm of each moment's light, or of its difference between two sets of pictures.
fn norms(images: &[Image], from: Option<&[Image]>, moments: &[Vec<f64>]) -> Vec<f64> {
    let off: Vec<Image> = match from {
        None => images.to_vec(),
        Some(from) => {
            let pairs = images.iter().zip(from);
            pairs
                .map(|(a, b)| {
                    let terms = [(1.0, a), (-1.0, b)];
                    footlight::picture::combine::combine(a.size(), &terms, 2)
                })
                .collect()
        }
    };
    let n = off.len();
    let mut gram = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            gram[i][j] = dot(&off[i], &off[j]);
            gram[j][i] = gram[i][j];
        }
    }
    let norm = |l: &Vec<f64>| {
        let row = |i: usize| (0..n).map(|j| gram[i][j] * l[j]).sum::<f64>() * l[i];
        (0..n).map(row).sum::<f64>().max(0.0).sqrt()
    };
    moments.iter().map(norm).collect()
}

fn area_of(vertices: &[footlight::geometry::Vec3]) -> f64 {
    let first = vertices[0];
    let pairs = vertices.windows(2);
    let sum = pairs.fold(vec3(0.0, 0.0, 0.0), |sum, w| {
        sum + (w[0] - first).cross(w[1] - first)
    });
    0.5 * sum.dot(sum).sqrt()
}

/// A random show of one of four kinds.
fn random(seed: u64) -> Result<Engine, Failure> {
    let RandomShow {
        mut show,
        mut stage,
        mut materials,
    } = random_show(seed, [160, 90]);
    match seed % 4 {
        // One bank by itself, dim, after everything else.
        1 => {
            let banks = show.matches("\nbank ").count();
            let mut cue = "cue 90 at 3:00 { time 3\n".to_owned();
            for bank in 0..banks {
                cue += &format!("  b{bank} {}\n", if bank == 1 { "60" } else { "out" });
            }
            show += &(cue + "}\n");
        }
        // No walls.
        2 => {
            let mut open = String::new();
            let mut is_wall = false;
            for line in stage.lines() {
                if let Some(material) = line.strip_prefix("usemtl ") {
                    is_wall = ["back", "side"].contains(&material);
                }
                if !(is_wall && line.starts_with("f ")) {
                    open += &format!("{line}\n");
                }
            }
            stage = open;
        }
        3 => {
            stage = stage.replacen(
                "f 1 2 3 4\n",
                "vt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\nf 1/1 2/2 3/3 4/4\n",
                1,
            );
            materials = materials.replacen("newmtl floor\n", "newmtl floor\nmap_Kd cloth.png\n", 1);
            show = show.replacen(
                "\ncue 1 ",
                "\nlight slides project \"cloth.png\" from 0, -8, 4 aim 0, 4, 1.5 field 40 30000 cd\n\
                 bank slide = slides\ncue 1 ",
                1,
            );
            show += "cue 90 at 3:00 { time 3  slide full }\n";
        }
        _ => {}
    }
    let image = png::encode(64, 64, &cloth(seed))?;
    let files = footlight::files::Memory::default()
        .with("room.obj", stage)
        .with("room.mtl", materials)
        .with("cloth.png", image);
    let host = Host {
        files: Box::new(files),
        threads: 2,
        ..Host::default()
    };
    Ok(Engine::from_text("random.lxq", show.as_bytes(), host).map_err(|e| e.to_string())?)
}

/// Checks with stripes across, 64 x 64.
fn cloth(seed: u64) -> Vec<u8> {
    let mut dice = dice::Dice::new(seed);
    let stripes: Vec<u8> = (0..64).map(|_| dice.whole(30, 255) as u8).collect();
    let mut out = Vec::new();
    for y in 0..64 {
        for x in 0..64 {
            let check = if (x / 8 + y / 8) % 2 == 0 { 255 } else { 60 };
            out.extend([check, stripes[y], stripes[x]]);
        }
    }
    out
}

const SHIPPED: [&str; 8] = [
    "first.lxq",
    "hall/hall.lxq",
    "luminaires/luminaires.lxq",
    "sketch/sketch.lxq",
    "reference/stage/stage.lxq",
    "reference/cornell/cornell.lxq",
    "tavern/tavern.lxq",
    "turandot/turandot.lxq",
];

fn shipped(name: &str) -> Result<Engine, Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(name);
    let folder = path.parent().ok_or("no folder")?;
    let text = std::fs::read_to_string(&path)?;
    let host = Host {
        files: Box::new(Folder::new(folder, 1 << 26)),
        threads: 2,
        ..Host::default()
    };
    Ok(Engine::from_text(name, text.as_bytes(), host).map_err(|e| e.to_string())?)
}

/// The first step whose error is within a tolerance, else the finest.
fn chosen(errors: &[f64], tolerance: f64) -> usize {
    let finest = errors.len() - 1;
    let coarse = errors.iter().take(finest);
    coarse
        .into_iter()
        .position(|e| *e <= tolerance)
        .unwrap_or(finest)
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Failure> {
    let shows = std::env::args().nth(1).and_then(|n| n.parse().ok());
    let mut all = Vec::new();
    for seed in 1..=shows.unwrap_or(SHOWS) {
        all.push(measured(&format!("random {seed}"), &mut random(seed)?)?);
        print(&all[all.len() - 1]);
    }
    for name in SHIPPED {
        all.push(measured(name, &mut shipped(name)?)?);
        print(&all[all.len() - 1]);
    }
    judge(&all);
    Ok(())
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn print(m: &Measured) {
    let list = |values: &[f64], by: f64| {
        let words: Vec<String> = values.iter().map(|v| format!("{:.3}", by * v)).collect();
        words.join(" ")
    };
    println!(
        "{}; {}; true {}; stated {}; apart {}; cost {}",
        m.name,
        m.about,
        list(&m.truth, 100.0),
        list(&m.stated, 100.0),
        list(&m.apart, 100.0),
        list(&m.cost, 1.0)
    );
}

/// Promises kept, and what they cost.
#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn judge(all: &[Measured]) {
    let (mut count, mut kept, mut spent, mut least) = (0, 0, 0.0, 0.0);
    let mut worst = 0.0f64;
    let mut losses = Vec::new();
    for show in all {
        for i in 0..24 {
            let tolerance = 0.04 * 0.1_f64.powf(f64::from(i) / 23.0);
            let ours = chosen(&show.stated, tolerance);
            let best = chosen(&show.truth, tolerance);
            count += 1;
            let ratio = show.truth[ours] / tolerance;
            kept += usize::from(ratio <= 1.0);
            worst = worst.max(ratio);
            spent += show.cost[ours];
            least += show.cost[best];
            losses.push(show.cost[ours] / show.cost[best]);
        }
    }
    losses.sort_by(f64::total_cmp);
    println!(
        "{kept} of {count} promises kept; the worst is off by {worst:.2} times; seconds over those of \
         one who knows: {:.2} in all, median {:.2}, 9 of 10 within {:.2}",
        spent / least,
        losses[losses.len() / 2],
        losses[losses.len() * 9 / 10]
    );
}
