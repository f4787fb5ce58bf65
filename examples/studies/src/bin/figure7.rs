//! A design session measured step by step: Figure 7 of Dorsey, Arvo and Greenberg (1995). `cargo
//! run --release -p footlight-studies --bin figure7 -- [SHOW SESSION] [CHART.png]` replays
//! declarations and `refine` lines of a file (by default the tavern's).
//!
//! The measure is the paper's: 1 - error / (error of coarse images alone), 0 without refinement, 1
//! when everything is refined. The ground truth is every source at the refined step. Seconds are
//! those of coarse images, edits, plans and refined images, without measuring; no image comes from
//! a store.

#![allow(clippy::print_stdout, reason = "a study prints what it found")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use footlight_engine::pool::Pool;
use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_host::work::Work;
use footlight_picture::Image;
use footlight_picture::combine::{combine, dot};
use footlight_prompt::{Console, Repl, finished};
use footlight_report::chart::{self, Axis, Marker, Panel, Scale, Series, Theme};
use footlight_show::linalg::{Matrix, mass};
use footlight_show::timeline::KeySequence;
use footlight_transport::Setup;

/// A moment of the session.
struct Moment {
    what: String,
    is_edit: bool,
    seconds: f64,
    refined: usize,
    /// Relative error of the sequence, and with coarse images alone.
    errors: [f64; 2],
}

impl Moment {
    fn quality(&self) -> f64 {
        1.0 - self.errors[0] / self.errors[1]
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let tavern = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tavern");
    let own = [tavern.join("tavern.lxq"), tavern.join("session.txt")];
    let (show, session, chart) = match words.as_slice() {
        [show, session, rest @ ..] => (show, session, rest.first()),
        [chart] => (&own[0], &own[1], Some(chart)),
        [] => (&own[0], &own[1], None),
    };
    let folder = show.parent().unwrap_or(Path::new("."));
    let host = Host {
        files: Box::new(Folder::new(folder, 1 << 26)),
        threads: 2,
        ..Host::default()
    };
    let text = std::fs::read(show)?;
    let engine = Engine::from_text("show.lxq", &text, host).map_err(|e| e.to_string())?;
    let mut repl = Repl::new(engine, Console::default());
    let mut truth = None;
    let mut seconds = 0.0;
    let mut moments = Vec::new();
    for command in commands(&std::fs::read_to_string(session)?) {
        let begin = Instant::now();
        if command.is_empty() {
            repl.engine_mut().coarse()?;
        } else {
            repl.execute(&command)
                .map_err(|e| format!("{command}: {e}"))?;
            repl.engine_mut().coarse()?;
        }
        seconds += begin.elapsed().as_secs_f64();
        let what = command.lines().next().unwrap_or_default().to_owned();
        let moment = Moment {
            is_edit: !what.is_empty() && !what.starts_with("refine"),
            what,
            seconds,
            refined: repl.engine().estimate().refined(),
            errors: errors(repl.engine(), &mut truth)?,
        };
        println!(
            "{:9.2} s  {:2} refined  {:.3}  {}",
            moment.seconds,
            moment.refined,
            moment.quality(),
            moment.what
        );
        moments.push(moment);
    }
    if let Some(path) = chart {
        let drawing = chart::panels(
            "How good was the sequence, and when?",
            &[
                panel(&moments, "seconds of computing", Scale::Linear, |m| {
                    m.seconds
                }),
                panel(&moments, "refined images", Scale::Whole, |m| {
                    m.refined as f64
                }),
            ],
            Theme::Light,
        );
        std::fs::write(path, drawing.magnified(2.0).png()?)?;
    }
    Ok(())
}

/// The lines of a session, `refine N` as N lines, after an empty line for the coarse images.
fn commands(text: &str) -> Vec<String> {
    let mut out = vec![String::new()];
    let mut open = String::new();
    for line in text.lines() {
        if open.is_empty() && (line.trim().is_empty() || line.trim_start().starts_with("//")) {
            continue;
        }
        open.push_str(line);
        if !finished(&open) {
            open.push('\n');
            continue;
        }
        let command = std::mem::take(&mut open);
        match command.strip_prefix("refine") {
            Some(count) => {
                let count = count.trim().parse().unwrap_or(1);
                out.extend(std::iter::repeat_n("refine".to_owned(), count));
            }
            None => out.push(command),
        }
    }
    out
}

/// Errors of the sequence with the current images, and with coarse images alone. The ground truth
/// is reused while the scene is unchanged.
fn errors(
    engine: &Engine,
    known: &mut Option<(Setup, Vec<Image>)>,
) -> Result<[f64; 2], Box<dyn Error>> {
    let work = Work::silent();
    let setup = engine
        .document()
        .setup()
        .ok_or("the show has no stage or view")?;
    let units = Pool::unit_settings(engine.show().coordinates().len());
    let truth = match known.take() {
        Some((old, truth)) if old == *setup => truth,
        _ => {
            let step = engine.estimate().refined_step();
            let renderer = &engine.host().renderer;
            renderer.prepare(setup, step, work)?.render(&units, work)?
        }
    };
    let pool = engine.estimate().pool().ok_or("nothing is rendered")?;
    let shown: Vec<Image> = units
        .iter()
        .map(|unit| pool.preview(unit, work))
        .collect::<Result<_, _>>()?;
    let coarse: Vec<&Image> = pool.coarse().iter().map(AsRef::as_ref).collect();
    let moment = second_moment(engine.document().keys());
    let all = energy(&truth.iter().collect::<Vec<_>>(), &moment);
    let off = |shown: &[&Image]| {
        let pairs = shown.iter().zip(&truth);
        let apart: Vec<Image> = pairs
            .map(|(a, b)| combine(b.size(), &[(1.0, *a), (-1.0, b)], 2))
            .collect();
        (energy(&apart.iter().collect::<Vec<_>>(), &moment) / all).sqrt()
    };
    let errors = [off(&shown.iter().collect::<Vec<_>>()), off(&coarse)];
    *known = Some((setup.clone(), truth));
    Ok(errors)
}

/// A sequence's second moment M = ∫ L(t) L(t)ᵀ dt (t in seconds): Σ h · K · B · Kᵀ, exact.
fn second_moment(keys: &KeySequence) -> Matrix {
    let mut moment = Matrix::zeros(keys.coordinates(), keys.coordinates());
    for segment in keys.segments() {
        let points = segment.keys.iter().filter_map(|key| keys.keys().get(*key));
        let k = Matrix::from_iterator(
            keys.coordinates(),
            segment.keys.len(),
            points.flatten().copied(),
        );
        moment += segment.duration() * &k * mass(segment.degree) * k.transpose();
    }
    moment
}

/// Σ_ij M_ij <P_i, P_j>: the light of a sequence whose settings have the second moment M.
fn energy(images: &[&Image], moment: &Matrix) -> f64 {
    let mut sum = 0.0;
    for (a, row) in images.iter().zip(moment.row_iter()) {
        for (b, weight) in images.iter().zip(row.iter()) {
            if *weight != 0.0 {
                sum += weight * dot(a, b);
            }
        }
    }
    sum.max(0.0)
}

fn panel(moments: &[Moment], axis: &str, scale: Scale, x: impl Fn(&Moment) -> f64) -> Panel {
    let point = |m: &Moment| (x(m), m.quality());
    let edits = moments.iter().filter(|m| m.is_edit);
    // NaN points between the markers keep them unjoined.
    let edits = edits.flat_map(|m| [point(m), (f64::NAN, f64::NAN)]);
    let series = |name: &str, points, marker| Series {
        name: name.to_owned(),
        points,
        marker,
        labels: Vec::new(),
    };
    Panel {
        title: format!("by {axis}"),
        x: Axis::new(axis, scale),
        y: Axis::new("1 - error / error of coarse images", Scale::Linear),
        series: vec![
            series(
                "quality",
                moments.iter().map(point).collect(),
                Marker::Square,
            ),
            series("after an edit", edits.collect(), Marker::Diamond),
        ],
        reference: Some((1.0, "all refined".to_owned())),
    }
}
