//! Cost of a method until the sequence is good enough: images and seconds to 10, 5, 2 and 1 % of
//! the error of coarse images alone, for the tavern and Turandot. `cargo run --release -p
//! footlight-studies --bin economy [RECORD.csv | RECORD.json]` prints the table and writes the
//! record; `full` before it uses the shows at full size.
//!
//! Three methods: a refined image for each bank, the best first; the paper's (settings normalised
//! by time-averaged influence, every key equal); ours (estimated error, weighted by time). Errors
//! are exact, against every source refined ([`Trial`]). Three operators: radiosity as shipped,
//! timed here; and two external renderers whose images share no work, at the paper's costs, one of
//! which renders negative light in one run while the other needs a second. Ours renders the coarse
//! images at two qualities, for the estimate; the others at one.
//!
//! `economy --renderer 'mitsuba --samples 1' FOLDER [CHART.png]` runs a real external renderer
//! (module `called`).

mod called;
#[path = "../../../../../tests/reference/results.rs"]
mod results;

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use footlight_engine::measure::Machine;
use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_report::words;
use footlight_studies::projection::keys_alike;
use footlight_studies::record::{Origin, Quantity, Record, StudyKind};
use footlight_studies::timed::{Seconds, banks_alone};
use footlight_studies::trial::{Metric, Shown, Trial, trial};
use footlight_transport::Quality;

/// Goals, relative to the initial error.
const GOALS: [f64; 4] = [0.10, 0.05, 0.02, 0.01];
/// Minutes of the paper's coarse and refined images of its tavern; a coarse one of half the quality
/// is assumed to cost half.
const PAPER: [f64; 2] = [3.0, 120.0];
/// Settings have 1 as their largest number; below this a number is rounding of the decomposition.
const ROUNDING: f64 = 1e-9;

/// Costs of an operator, in one unit of time.
struct Operator {
    name: &'static str,
    unit: &'static str,
    /// Every source alone at the cheaper and at the finer coarse quality.
    coarse: [f64; 2],
    /// Cost before the first refined image.
    prepare: f64,
    /// Cost of each source first lit by a refined image.
    source: f64,
    /// Cost of each refined image.
    picture: f64,
    /// True when an image with light of both signs counts as two.
    twice: bool,
}

/// Settings in the order of refinement, and the error after each number of them.
struct Method {
    name: &'static str,
    order: Vec<Vec<f64>>,
    errors: Vec<f64>,
    /// True when it needs coarse images of two qualities.
    estimates: bool,
}

impl Method {
    fn new(
        name: &'static str,
        trial: &Trial,
        order: Vec<Vec<f64>>,
        show: impl Fn(&[Vec<f64>]) -> Result<Shown, footlight_engine::plan::PlanError>,
    ) -> Result<Method, Box<dyn Error>> {
        let mut errors = Vec::new();
        for count in 0..=order.len() {
            let shown = show(order.get(..count).unwrap_or_default())?;
            errors.push(trial.error(&shown));
        }
        Ok(Method {
            name,
            order,
            errors,
            estimates: name == "ours",
        })
    }

    /// Number of images after which the error stays within a share of the initial one.
    fn needed(&self, share: f64) -> usize {
        let start = self.errors.first().copied().unwrap_or_default();
        let over = self.errors.iter().rposition(|e| *e > share * start);
        over.map_or(0, |last| (last + 1).min(self.order.len()))
    }

    /// Cost of that number of images with an operator, from scratch.
    fn takes(&self, operator: &Operator, pictures: usize) -> f64 {
        let [cheap, fine] = operator.coarse;
        let coarse = fine + if self.estimates { cheap } else { 0.0 };
        let settings = self.order.get(..pictures).unwrap_or_default();
        let runs = |s: &Vec<f64>| {
            let both = s.iter().any(|x| *x > ROUNDING) && s.iter().any(|x| *x < -ROUNDING);
            if operator.twice && both { 2.0 } else { 1.0 }
        };
        let lit = |i: &usize| {
            settings
                .iter()
                .any(|s| s.get(*i).is_some_and(|x| *x != 0.0))
        };
        let sources = self.order.first().map_or(0, Vec::len);
        let lit = (0..sources).filter(lit).count() as f64;
        let prepare = if pictures > 0 { operator.prepare } else { 0.0 };
        coarse
            + prepare
            + lit * operator.source
            + operator.picture * settings.iter().map(runs).sum::<f64>()
    }
}

fn open(name: &str, full: bool) -> Result<Engine, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
    let file = format!("{name}.lxq");
    let mut text = std::fs::read_to_string(folder.join(&file))?;
    if !full {
        text = text.replace("size 640x360", "size 160x90");
    }
    let host = Host {
        files: Box::new(Folder::new(&folder, 1 << 26)),
        threads: 2,
        ..Host::default()
    };
    Engine::from_text(&file, text.as_bytes(), host).map_err(|e| e.to_string().into())
}

/// Our operator as measured, and the two external ones.
fn operators(show: &Engine, sources: f64) -> Result<Vec<Operator>, Box<dyn Error>> {
    let banks = show.show().banks.len() as f64;
    let measured = |quality: u8| banks_alone(show, Quality(quality), 3).map(|(_, seconds)| seconds);
    // The record measures banks, each one image; an rgb bank is three sources.
    let source = |s: &Seconds| ((s.banks - banks * s.picture) / sources).max(0.0);
    let all = |s: &Seconds| s.prepare + sources * (source(s) + s.picture);
    let coarse = show.show().preview.coarse;
    let (cheap, fine) = (measured(coarse)?, measured(coarse + 1)?);
    let refined = measured(coarse + 2)?;
    let [minutes, refining] = PAPER;
    let outside = |name, twice| Operator {
        name,
        unit: "min",
        coarse: [0.5 * minutes * sources, minutes * sources],
        prepare: 0.0,
        source: 0.0,
        picture: refining,
        twice,
    };
    Ok(vec![
        Operator {
            name: "radiosity",
            unit: "s",
            coarse: [all(&cheap), all(&fine)],
            prepare: refined.prepare,
            source: source(&refined),
            picture: refined.picture,
            twice: false,
        },
        outside("outside, signed light", false),
        outside("outside, two runs for it", true),
    ])
}

fn methods(trial: &Trial) -> Result<Vec<Method>, Box<dyn Error>> {
    let plain = trial.weighting(Metric::Settings)?;
    let influence = trial.weighting(Metric::Influence)?;
    let error = trial.weighting(Metric::Error)?;
    Ok(vec![
        Method::new("one a bank", trial, trial.banks_in_best_order(), |s| {
            trial.shown_in(&plain, s)
        })?,
        Method::new("the paper's", trial, keys_alike(trial, &influence)?, |s| {
            trial.shown_in(&influence, s)
        })?,
        Method::new("ours", trial, trial.order(&error)?, |s| trial.shown(s))?,
    ])
}

fn record(full: bool) -> Result<Record, Box<dyn Error>> {
    let mut quantities = Vec::new();
    for what in ["pictures", "time"] {
        for goal in GOALS {
            let name = format!("{what} to {} %", 100.0 * goal);
            quantities.push(Quantity::new(
                &name,
                if what == "time" { "s or min" } else { "" },
            ));
        }
    }
    let size = if full { "640x360" } else { "160x90" };
    let method = format!(
        "{size}; true error of the sequence as a share of that of coarse pictures alone; outside \
         renderers at the paper's {} and {} minutes a picture",
        PAPER[0], PAPER[1]
    );
    let origin = Origin {
        subject: "tavern, turandot".to_owned(),
        machine: Machine::here(2, None),
    };
    let mut out = Record::new(StudyKind::Trial, &origin, &method, quantities);
    for name in ["tavern", "turandot"] {
        let show = open(name, full)?;
        let trial = trial(&show)?;
        let sources = trial.keys().coordinates();
        for operator in operators(&show, sources as f64)? {
            for method in methods(&trial)? {
                let pictures = GOALS.map(|goal| method.needed(goal));
                let times = pictures.map(|count| method.takes(&operator, count));
                let values = pictures.map(|n| n as f64).into_iter().chain(times);
                let values: Vec<Option<f64>> = values.map(Some).collect();
                let series = format!("{name}: {}", operator.name);
                out.add(&series, method.name, &[operator.unit], &values);
            }
        }
    }
    Ok(out)
}

/// The table in Markdown.
fn table(record: &Record) -> String {
    let mut out =
        "| show and operator | method | 10 % | 5 % | 2 % | 1 % |\n|---|---|---|---|---|---|\n"
            .to_owned();
    for series in &record.series {
        for point in &series.points {
            let value = |i: usize| point.values.get(i).copied().flatten().unwrap_or(f64::NAN);
            let unit = point.marks.first().map_or("", String::as_str);
            let _ = write!(out, "| {} | {} |", series.name, point.label);
            for goal in 0..GOALS.len() {
                let (pictures, time) = (value(goal), value(goal + GOALS.len()));
                let time = match unit {
                    "min" => format!("{:.1} h", time / 60.0),
                    _ => format!("{time:.1} s"),
                };
                let _ = write!(out, " {pictures}: {time} |");
            }
            out.push('\n');
        }
    }
    out
}

#[allow(clippy::print_stdout, reason = "an example shows what it found")]
fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [option, line, folder, picture @ ..] = &words[..]
        && option == "--renderer"
    {
        let picture = picture.first().map(String::as_str);
        return called::run(line, Path::new(folder), picture);
    }
    let record = record(words.iter().any(|w| w == "full"))?;
    println!(
        "{}; {}\n\n{}",
        words::machine(&record.machine),
        record.method,
        table(&record)
    );
    for path in &words {
        match Path::new(path).extension().and_then(|e| e.to_str()) {
            Some("json") => std::fs::write(path, record.json()?)?,
            Some("csv") => std::fs::write(path, record.csv())?,
            _ => {}
        }
    }
    Ok(())
}
