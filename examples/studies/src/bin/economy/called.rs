//! The economy study for a real, noisy external renderer: processor time of each method, and the
//! true error for the tavern at 320x180.
//!
//! Every image is rendered once and kept in a folder with its time, so that an interrupted run can
//! continue, and each method is charged equally for an image. Errors are products of differences to
//! two ground truths: images of the renderer with independent noise, and images of our own
//! renderer. The former's noise and the latter's bias are independent, so both cancel.

use std::collections::HashMap;
use std::error::Error;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use footlight_engine::pool::Pool;
use footlight_engine::{Ended, Engine, Goal, Host, Refinement, Way};
use footlight_host::files::Folder;
use footlight_host::files::process::{Done, Job, ProcessError, Processes, Programs};
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_report::chart::{self, Axis, Marker, Panel, Scale, Series, Theme};
use footlight_show::linalg::Matrix;
use footlight_transport::outside::{Outside, RendererCall};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport};

use crate::results;

type Failure = Box<dyn Error>;
/// Processor seconds, and the error reached.
type Point = (f64, f64);

/// Quality steps of the renderer.
const STEPS: u8 = 5;
/// Steps of the ground truth, the renderer's and ours.
const TRUTH: Quality = Quality(4);
const OUR_TRUTH: Quality = Quality(2);
/// Salts for another seed of the renderer.
const SALTS: [u64; 2] = [0x5bd1_e995, 0x9e37_79b9];
/// Steps of the paper's mixtures.
const MIXED: [u8; 2] = [3, 4];
/// Goals for our method, relative to the error of the coarsest images.
const WANTED: [f64; 4] = [0.6, 0.3, 0.15, 0.07];
/// Goal at which methods are compared.
const GOAL: f64 = 0.05;
/// Moments below this share of the brightest one's light do not count.
const NEARLY_OUT: f64 = 0.02;

/// A renderer with cached images.
#[derive(Clone)]
struct Kept {
    folder: PathBuf,
    /// Another salt gives other noise.
    salt: u64,
    /// Processor seconds of all requested images.
    charged: Arc<Mutex<f64>>,
}

impl Kept {
    fn charged(&self) -> f64 {
        *self.charged.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The settings with a seed for other noise.
    fn salted(&self, settings: &[u8]) -> Result<Vec<u8>, serde_json::Error> {
        let mut request: HashMap<String, serde_json::Value> = serde_json::from_slice(settings)?;
        let seed = request.get("seed").and_then(serde_json::Value::as_u64);
        let seed = (seed.unwrap_or(0) ^ self.salt) as u32;
        request.insert("seed".to_owned(), seed.into());
        serde_json::to_vec(&request)
    }

    fn rendered(&self, job: &Job<'_>) -> Result<Done, Failure> {
        let is_settings = |input: &&(&str, &str, &[u8])| input.0 == "{settings}";
        let settings = job.inputs.iter().find(is_settings).ok_or("no settings")?.2;
        let settings = self.salted(settings)?;
        let mut name = DefaultHasher::new();
        for (mark, _, bytes) in job.inputs {
            // The order of a map's keys varies between runs.
            match *mark == "{settings}" {
                true => (self.salt, *bytes).hash(&mut name),
                false => bytes.hash(&mut name),
            }
        }
        job.arguments.hash(&mut name);
        let stem = self.folder.join(format!("{:016x}", name.finish()));
        let [picture, seconds] = ["exr", "txt"].map(|ending| stem.with_extension(ending));
        if let Ok(text) = std::fs::read_to_string(&seconds) {
            return Ok(Done {
                output: std::fs::read(picture)?,
                seconds: text.trim().parse()?,
            });
        }
        let inputs: Vec<(&str, &str, &[u8])> = job
            .inputs
            .iter()
            .map(|input| match is_settings(&input) {
                true => (input.0, input.1, settings.as_slice()),
                false => *input,
            })
            .collect();
        let begin = results::children_seconds().ok_or("this system does not tell seconds")?;
        let done = Programs.run(&Job {
            inputs: &inputs,
            ..*job
        })?;
        let took = results::children_seconds().unwrap_or(begin) - begin;
        std::fs::write(picture, &done.output)?;
        std::fs::write(seconds, format!("{took}\n"))?;
        Ok(Done {
            seconds: took,
            ..done
        })
    }
}

impl Processes for Kept {
    fn run(&self, job: &Job<'_>) -> Result<Done, ProcessError> {
        let done = self.rendered(job).map_err(|error| ProcessError::Exit {
            program: job.program.to_owned(),
            status: error.to_string(),
            tail: String::new(),
        })?;
        *self.charged.lock().unwrap_or_else(PoisonError::into_inner) += done.seconds;
        Ok(done)
    }
}

/// The tavern with mixtures at a step.
fn tavern(refined: u8, renderer: Arc<dyn Transport>) -> Result<Engine, Failure> {
    let show = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tavern");
    let text = std::fs::read_to_string(show.join("tavern.lxq"))?
        .replace("size 640x360", "size 320x180")
        .replace("refined 2", &format!("refined {refined}"));
    let host = Host {
        files: Box::new(Folder::new(&show, 1 << 26)),
        threads: 2,
        renderer,
        ..Host::default()
    };
    Ok(Engine::from_text("tavern.lxq", text.as_bytes(), host).map_err(|e| e.to_string())?)
}

/// The tavern with the external renderer, without any images.
fn open(
    call: &RendererCall,
    folder: &Path,
    refined: u8,
    salt: u64,
) -> Result<(Engine, Kept), Failure> {
    let kept = Kept {
        folder: folder.to_owned(),
        salt,
        charged: Arc::default(),
    };
    let renderer = Outside::with(call.clone(), Box::new(kept.clone())).unmeasured();
    Ok((tavern(refined, Arc::new(renderer))?, kept))
}

/// Moments, and each bank's image by a noisy renderer and by a biased one.
struct Truth {
    moments: Vec<Vec<f64>>,
    banks: [Vec<Image>; 2],
    /// Light of each moment.
    light: Vec<f64>,
}

impl Truth {
    fn new(call: &RendererCall, folder: &Path) -> Result<Truth, Failure> {
        let mut engine = tavern(STEPS, Arc::new(Radiosity))?;
        let ours = alone(&mut engine, OUR_TRUTH)?;
        let halves = SALTS.map(|salt| alone(&mut open(call, folder, STEPS, salt)?.0, TRUTH));
        let [a, b] = halves;
        let pairs = a?.into_iter().zip(b?);
        let mean = |(a, b): (Image, Image)| combine(a.size(), &[(0.5, &a), (0.5, &b)], 2);
        let banks = [pairs.map(mean).collect(), ours];
        let mut moments = Vec::new();
        for cue in engine.document().timeline().cues() {
            for part in [0.25, 0.5, 0.75, 1.0] {
                let time = cue.go + (cue.completion - cue.go).scaled(part);
                moments.push(engine.document().setting(time));
            }
        }
        let products = products(&banks[0], &banks[1]);
        Ok(Truth {
            light: moments.iter().map(|l| norm(&products, l)).collect(),
            moments,
            banks,
        })
    }

    /// Error of the worst moment, relative to its light, when banks look like `shown`.
    fn error(&self, shown: &[Image]) -> f64 {
        let off = |half: &Vec<Image>| -> Vec<Image> {
            let pairs = shown.iter().zip(half);
            let off = |(a, b): (&Image, &Image)| combine(a.size(), &[(1.0, a), (-1.0, b)], 2);
            pairs.map(off).collect()
        };
        let [a, b] = self.banks.each_ref().map(off);
        let products = products(&a, &b);
        let brightest = self.light.iter().copied().fold(0.0, f64::max);
        let errors = self.moments.iter().zip(&self.light);
        errors
            .filter(|(_, light)| **light > NEARLY_OUT * brightest)
            .map(|(moment, light)| norm(&products, moment) / light)
            .fold(0.0, f64::max)
    }
}

fn products(a: &[Image], b: &[Image]) -> Matrix {
    Matrix::from_fn(a.len(), b.len(), |i, j| match (a.get(i), b.get(j)) {
        (Some(a), Some(b)) => dot(a, b),
        _ => 0.0,
    })
}

/// The square root of lᵀ·G·l.
fn norm(products: &Matrix, l: &[f64]) -> f64 {
    let l = Matrix::from_column_slice(l.len(), 1, l);
    (l.transpose() * products * &l).sum().max(0.0).sqrt()
}

/// An image of each bank at a step.
fn alone(engine: &mut Engine, step: Quality) -> Result<Vec<Image>, Failure> {
    let units = Pool::unit_settings(engine.show().coordinates().len());
    let render = |unit: &Vec<f64>| Ok(engine.render(unit, step)?);
    units.iter().map(render).collect()
}

/// Each bank's image from what was rendered.
fn shown(engine: &Engine) -> Result<Vec<Image>, Failure> {
    let pool = engine.estimate().pool().ok_or("no pictures")?;
    let work = Work {
        threads: 2,
        memory: 1 << 30,
        ..Work::silent()
    };
    let units = Pool::unit_settings(pool.coarse().len());
    let look = |unit: &Vec<f64>| Ok(pool.preview(unit, work)?);
    units.iter().map(look).collect()
}

/// The paper's method: coarse images, then mixtures at a step to the end of the plan, with a point
/// for each.
fn mixtures(
    call: &RendererCall,
    folder: &Path,
    step: u8,
    truth: &Truth,
) -> Result<Vec<Point>, Failure> {
    let (mut engine, kept) = open(call, folder, step, 0)?;
    let by_mixtures = |count| Refinement::from(Goal::count(count)).by(Way::Paper);
    engine.coarse_for(by_mixtures(0))?;
    let mut points = vec![(kept.charged(), truth.error(&shown(&engine)?))];
    while engine.refine(by_mixtures(1))?.ended == Some(Ended::Counted) {
        points.push((kept.charged(), truth.error(&shown(&engine)?)));
        report(&format!("mixtures at step {step}"), &points);
    }
    Ok(points)
}

/// An image of each bank, from scratch at each step except the first.
fn one_for_each(call: &RendererCall, folder: &Path, truth: &Truth) -> Result<Vec<Point>, Failure> {
    let mut points = Vec::new();
    for step in 2..=STEPS {
        let (mut engine, kept) = open(call, folder, step, 0)?;
        engine.coarse_for(Refinement::from(Goal::count(0)).by(Way::Alone))?;
        points.push((kept.charged(), truth.error(&shown(&engine)?)));
        report("one for each bank", &points);
    }
    Ok(points)
}

/// The program's method, from scratch to each goal.
fn ours(
    call: &RendererCall,
    folder: &Path,
    coarse: f64,
    truth: &Truth,
) -> Result<Vec<Point>, Failure> {
    let mut points = Vec::new();
    for share in WANTED {
        let (mut engine, kept) = open(call, folder, STEPS, 0)?;
        let goal = Goal::until(share * coarse);
        engine.coarse_for(goal)?;
        engine.refine(goal)?;
        points.push((kept.charged(), truth.error(&shown(&engine)?)));
        report(&format!("ours to {:.2} %", 100.0 * share * coarse), &points);
    }
    Ok(points)
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn report(name: &str, points: &[Point]) {
    if let Some((seconds, error)) = points.last() {
        println!("{name}: {seconds:.1} s, {:.2} %", 100.0 * error);
    }
}

/// Seconds to reach an error, interpolated on log axes, or extrapolated by the law of noise.
fn seconds_to(error: f64, points: &[Point]) -> f64 {
    for pair in points.windows(2) {
        if let [(s, e), (t, f)] = pair
            && *f <= error
        {
            let share = ((e / error).ln() / (e / f).ln()).clamp(0.0, 1.0);
            return s * (t / s).powf(share);
        }
    }
    points
        .last()
        .map_or(f64::NAN, |(s, e)| s * (e / error).powi(2))
}

/// Renders, prints the results, and draws them.
#[allow(clippy::print_stdout, reason = "an example shows what it found")]
pub fn run(line: &str, folder: &Path, picture: Option<&str>) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)?;
    let call = RendererCall {
        steps: STEPS,
        timeout: 3600.0,
        ..RendererCall::parse(line)?
    };
    let truth = Truth::new(&call, folder)?;
    let coarse = truth.error(&alone(&mut open(&call, folder, STEPS, 0)?.0, Quality(1))?);
    println!("coarse: {:.2} %", 100.0 * coarse);
    let mut ends = Vec::new();
    let series = |name: &str, points: &[Point], marker| Series {
        name: name.to_owned(),
        points: points
            .iter()
            .map(|(s, e)| (*s, 100.0 * e / coarse))
            .collect(),
        marker,
        labels: Vec::new(),
    };
    let banks = one_for_each(&call, folder, &truth)?;
    let ours = ours(&call, folder, coarse, &truth)?;
    let mut drawn = vec![
        series("one picture for each bank", &banks, Marker::Circle),
        series("ours", &ours, Marker::Triangle),
    ];
    for step in MIXED {
        let points = mixtures(&call, folder, step, &truth)?;
        ends.extend(points.last().copied());
        let samples = 4_u32.pow(u32::from(step) - 1);
        let name = format!("the paper's mixtures, {samples} times the samples");
        drawn.push(series(&name, &points, Marker::None));
    }
    for (name, points) in [
        ("one for each bank", banks),
        ("the paper's", ends),
        ("ours", ours),
    ] {
        println!(
            "{name}: {:.0} s to {} %",
            seconds_to(GOAL * coarse, &points),
            100.0 * GOAL
        );
    }
    if let Some(picture) = picture {
        let panel = Panel {
            title: String::new(),
            x: Axis::new("processor seconds of the renderer", Scale::Log),
            y: Axis::new(
                "true error of the worst moment, % of the coarse pictures'",
                Scale::Log,
            ),
            series: drawn,
            reference: Some((100.0 * GOAL, "5 %".to_owned())),
        };
        let title = "The tavern by a path tracer";
        let drawing = chart::panels(title, &[panel], Theme::Light).magnified(2.0);
        std::fs::write(picture, drawing.png()?)?;
    }
    Ok(())
}
