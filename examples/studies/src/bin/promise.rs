//! What is promised of an error against what is true: the shipped shows and 40 random ones (rooms, dark
//! cues, open squares, textures with projections).
//! `cargo run --release -p footlight-studies --bin promise [SHOWS] [MEASURED.txt] [CHART.png]` (`41-52`
//! instead of their number: these random shows alone, none of them shipped) prints, for each show and
//! step of quality, the worst moment's true error against the finest step, and what the operator states, of
//! the light and as displayed; then, over tolerances from 4 to 0.4 % and from 20 to 2 steps, how
//! often the step that is chosen keeps its promise, and what the choice costs over that of one who
//! knows the errors. The chart has what is promised against what is true. Errors are taken from
//! the file where it has a show already, and written to it where not: an hour of rendering is then
//! done once, and what is stated can be judged anew in a second.

#![allow(
    clippy::indexing_slicing,
    reason = "matrices are indexed by the pictures, steps and sources they were made of"
)]

use std::error::Error;
use std::path::Path;

use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_picture::combine::{combine, dot};
use footlight_picture::tone::Tone;
use footlight_picture::{Image, png};
use footlight_report::chart::{self, Axis, Marker, Panel, Scale, Series, Theme};
use footlight_show::geometry::vec3;
use footlight_show::units::ErrorUnit;
use footlight_studies::dice;
use footlight_studies::random_show::{RandomShow, random_show};
use footlight_transport::Quality;

/// Random shows.
const SHOWS: u64 = 40;
/// Darker moments than this share of the brightest one's light do not count.
const NEARLY_OUT: f64 = 0.02;
/// Moments of a cue, as parts of its fade.
const PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

type Failure = Box<dyn Error>;

/// Pixels of a picture that are looked at as displayed, about.
const LOOKED_AT: usize = 20_000;

/// A show's errors and costs, step by step; errors of the light, then in steps of 255.
struct Measured {
    name: String,
    stated: [Vec<f64>; 2],
    truth: [Vec<f64>; 2],
    /// In the operator's units.
    cost: Vec<f64>,
    /// Between this step and the one before it, at the worst moment.
    apart: Vec<f64>,
    about: String,
}

/// A show's true errors, as the file has them.
struct Errors {
    truth: [Vec<f64>; 2],
    apart: Vec<f64>,
}

impl Errors {
    /// A line without the name.
    fn written(&self) -> String {
        let list = |values: &[f64]| {
            let words: Vec<String> = values.iter().map(|v| format!("{v:.6}")).collect();
            words.join(" ")
        };
        let [light, shown] = &self.truth;
        format!("{}; {}; {}", list(light), list(shown), list(&self.apart))
    }

    fn read(line: &str) -> Option<Errors> {
        let list = |text: &str| -> Option<Vec<f64>> {
            text.split_whitespace().map(|w| w.parse().ok()).collect()
        };
        let mut lists = line.split(';').map(list);
        let mut next = || lists.next().flatten();
        Some(Errors {
            truth: [next()?, next()?],
            apart: next()?,
        })
    }
}

/// True errors by name, kept in a file where one is named.
struct Kept {
    path: Option<String>,
    lines: Vec<String>,
}

impl Kept {
    fn new(path: Option<&String>) -> Kept {
        let text = path.map(|path| std::fs::read_to_string(path).unwrap_or_default());
        Kept {
            path: path.cloned(),
            lines: text
                .unwrap_or_default()
                .lines()
                .map(str::to_owned)
                .collect(),
        }
    }

    fn errors(&mut self, name: &str, engine: &mut Engine) -> Result<Errors, Failure> {
        let start = format!("{name}: ");
        let mut known = self
            .lines
            .iter()
            .filter_map(|line| line.strip_prefix(&start));
        if let Some(found) = known.find_map(Errors::read) {
            return Ok(found);
        }
        let found = errors(engine)?;
        self.lines.push(start + &found.written());
        if let Some(path) = &self.path {
            std::fs::write(path, self.lines.join("\n") + "\n")?;
        }
        Ok(found)
    }
}

fn measured(name: &str, engine: &mut Engine, kept: &mut Kept) -> Result<Measured, Failure> {
    let Errors { truth, apart } = kept.errors(name, engine)?;
    let n = engine.show().coordinates().len();
    let finest = engine.estimate().finest().0;
    let setup = engine.document().setup().ok_or("no setup")?;
    let renderer = &engine.host().renderer;
    let stated = |unit| {
        let all = (1..=finest).map(|q| renderer.stated_error(setup, Quality(q), unit));
        all.map(|error| error.unwrap_or(0.0)).collect()
    };
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
        stated: [stated(ErrorUnit::Light), stated(ErrorUnit::Steps)],
        truth,
        cost: cost.collect(),
        apart,
        about: format!(
            "polygons {} sources {n} pixels {} reflectance {:.3}",
            setup.scene.polygons.len(),
            setup.view.width * setup.view.height,
            reflected / area
        ),
    })
}

/// Renders every source at every step.
fn errors(engine: &mut Engine) -> Result<Errors, Failure> {
    let n = engine.show().coordinates().len();
    let finest = engine.estimate().finest().0;
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
    let mut moments: Vec<Vec<f64>> = Vec::new();
    for cue in engine.document().timeline().cues() {
        for part in PARTS {
            let time = cue.go + (cue.completion - cue.go).scaled(part);
            moments.push(engine.document().setting(time));
        }
    }
    let last = &steps[usize::from(finest) - 1];
    let lights = norms(last, None, &moments);
    let brightest = lights.iter().fold(0.0f64, |m, x| m.max(*x));
    let is_lit = |(_, light): &(&Vec<f64>, &f64)| **light > NEARLY_OUT * brightest;
    let lit: Vec<&Vec<f64>> = (moments.iter().zip(&lights).filter(is_lit))
        .map(|(moment, _)| moment)
        .collect();
    let worst = |a: &[Image], b: &[Image]| {
        let errors = norms(a, Some(b), &moments);
        let lit = errors.iter().zip(&lights);
        lit.filter(|(_, light)| **light > NEARLY_OUT * brightest)
            .fold(0.0f64, |m, (e, light)| m.max(e / light))
    };
    Ok(Errors {
        truth: [
            steps.iter().map(|step| worst(step, last)).collect(),
            displayed(engine, &steps, &lit),
        ],
        apart: steps.windows(2).map(|w| worst(&w[0], &w[1])).collect(),
    })
}

/// The worst moment's error of each step as displayed: the 99th percentile of the pixels' largest
/// differences, in steps of 255.
fn displayed(engine: &Engine, steps: &[Vec<Image>], moments: &[&Vec<f64>]) -> Vec<f64> {
    let (width, height) = steps[0][0].size();
    let apart = (width * height / LOOKED_AT).isqrt().max(1);
    let thin = |step: &Vec<Image>| step.iter().map(|i| i.every(apart)).collect();
    let thin: Vec<Vec<Image>> = steps.iter().map(thin).collect();
    let picture = |step: &[Image], moment: &[f64]| {
        let terms: Vec<(f64, &Image)> = moment.iter().copied().zip(step).collect();
        combine(step[0].size(), &terms, 2)
    };
    let last = &thin[thin.len() - 1];
    let keys = engine.document().keys().keys();
    let keys: Vec<Image> = keys.iter().map(|key| picture(last, key)).collect();
    let tone = engine.document().tone_of(&keys);
    let mut worst = vec![0.0f64; thin.len()];
    for moment in moments {
        let truth: Vec<f64> = shown(&tone, &picture(last, moment));
        for (step, worst) in thin.iter().zip(&mut worst) {
            let seen = shown(&tone, &picture(step, moment));
            let pixels = seen.chunks(3).zip(truth.chunks(3));
            let off = pixels.map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max));
            let mut off: Vec<f64> = off.collect();
            off.sort_by(f64::total_cmp);
            *worst = worst.max(255.0 * off[(off.len() - 1) * 99 / 100]);
        }
    }
    worst
}

fn shown(tone: &Tone, image: &Image) -> Vec<f64> {
    let light = image.data().iter();
    light
        .map(|v| tone.display(f64::from(*v).max(0.0)))
        .collect()
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
                    combine(a.size(), &terms, 2)
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

fn area_of(vertices: &[footlight_show::geometry::Vec3]) -> f64 {
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
    let files = footlight_host::files::Memory::default()
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
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
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
    let words: Vec<String> = std::env::args().skip(1).collect();
    let range = words.iter().find_map(|word| word.split_once('-'));
    let others = range.and_then(|(a, b)| Some(a.parse().ok()?..=b.parse().ok()?));
    let shows = words.iter().find_map(|word| word.parse().ok());
    let mut kept = Kept::new(words.iter().find(|word| word.ends_with(".txt")));
    let mut all = Vec::new();
    let shipped_too: &[&str] = if others.is_some() { &[] } else { &SHIPPED };
    for seed in others.unwrap_or(1..=shows.unwrap_or(SHOWS)) {
        let name = format!("random {seed}");
        all.push(measured(&name, &mut random(seed)?, &mut kept)?);
        print(&all[all.len() - 1]);
    }
    for name in shipped_too {
        all.push(measured(name, &mut shipped(name)?, &mut kept)?);
        print(&all[all.len() - 1]);
    }
    let panels: Vec<Panel> = UNITS.iter().map(|unit| judge(&all, unit)).collect();
    if let Some(path) = words.iter().find(|word| word.ends_with(".png")) {
        let title = "What is promised of an error, and what is true";
        let drawing = chart::panels(title, &panels, Theme::Light).magnified(2.0);
        std::fs::write(path, drawing.png()?)?;
    }
    Ok(())
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn print(m: &Measured) {
    let list = |values: &[f64], by: f64| {
        let words: Vec<String> = values.iter().map(|v| format!("{:.3}", by * v)).collect();
        words.join(" ")
    };
    println!(
        "{}; {}; true {} %, {} steps; stated {} %, {} steps; apart {} %; cost {}",
        m.name,
        m.about,
        list(&m.truth[0], 100.0),
        list(&m.truth[1], 1.0),
        list(&m.stated[0], 100.0),
        list(&m.stated[1], 1.0),
        list(&m.apart, 100.0),
        list(&m.cost, 1.0)
    );
}

/// A unit of error: which, its name, what it is multiplied by, the largest tolerance.
const UNITS: [(usize, &str, f64, f64); 2] = [
    (0, "% of the light", 100.0, 0.04),
    (1, "steps of 255 as displayed", 1.0, 20.0),
];
/// Tolerances, from the largest down to a tenth.
const TOLERANCES: i32 = 24;

/// Promises kept, and what they cost; what is promised against what is true.
#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn judge(all: &[Measured], (which, name, by, largest): &(usize, &str, f64, f64)) -> Panel {
    let (mut count, mut kept, mut spent, mut least) = (0, 0, 0.0, 0.0);
    let mut worst = 0.0f64;
    let mut losses = Vec::new();
    // The median show, 19 of 20, the worst one.
    let ranks = [all.len() / 2, all.len() * 19 / 20, all.len() - 1];
    let mut lines = [Vec::new(), Vec::new(), Vec::new()];
    for i in 0..TOLERANCES {
        let tolerance = largest * 0.1_f64.powf(f64::from(i) / f64::from(TOLERANCES - 1));
        let mut errors = Vec::new();
        for show in all {
            let (stated, truth) = (&show.stated[*which], &show.truth[*which]);
            let (ours, best) = (chosen(stated, tolerance), chosen(truth, tolerance));
            count += 1;
            let ratio = truth[ours] / tolerance;
            kept += usize::from(ratio <= 1.0);
            worst = worst.max(ratio);
            spent += show.cost[ours];
            least += show.cost[best];
            losses.push(show.cost[ours] / show.cost[best]);
            errors.push(truth[ours]);
        }
        errors.sort_by(f64::total_cmp);
        for (line, rank) in lines.iter_mut().zip(ranks) {
            line.push((by * tolerance, by * errors[rank]));
        }
    }
    losses.sort_by(f64::total_cmp);
    println!(
        "{name}: {kept} of {count} promises kept; the worst is off by {worst:.2} times; seconds over \
         those of one who knows: {:.2} in all, median {:.2}, 9 of 10 within {:.2}",
        spent / least,
        losses[losses.len() / 2],
        losses[losses.len() * 9 / 10]
    );
    let line = [0.1, 1.0].map(|share| by * largest * share).map(|x| (x, x));
    let series = |name: &str, points: Vec<(f64, f64)>, marker| Series {
        name: name.to_owned(),
        points,
        marker,
        labels: Vec::new(),
    };
    let [median, most, worst_of_all] = lines;
    Panel {
        title: format!("{kept} of {count} kept, the worst off by {worst:.2} times"),
        x: Axis::new(&format!("asked for, {name}"), Scale::Log),
        y: Axis::new("true error of the worst moment", Scale::Log),
        series: vec![
            series("the median show", median, Marker::Circle),
            series("19 of 20 shows are within", most, Marker::Square),
            series("the worst show", worst_of_all, Marker::Triangle),
            series("as asked for", line.into(), Marker::None),
        ],
        reference: None,
    }
}
