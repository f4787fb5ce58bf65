//! Stated errors of refinement against true ones, over random shows (rooms, dark cues, open
//! squares, textures with projections). `cargo run --release -p footlight-studies --bin measured
//! [SHOWS] [GOAL %]...` refines each show to the goals (2 % and 0.5 %) and measures the stated
//! moment and the end of every cue again with 16 times the paths and pixels. It prints the stated
//! interval, the true errors of the stated moment and of the show, the quality step used, and the
//! cheapest sufficient one.

use std::error::Error;

use footlight_engine::measure::{Effort, independent};
use footlight_engine::{Ended, Engine, Goal, Host};
use footlight_show::units::Time;
use footlight_studies::random_show::random_show;
use footlight_transport::Quality;

/// Random shows.
const SHOWS: u64 = 20;
/// Goals in percent.
const ASKED: [f64; 2] = [2.0, 0.5];
/// Effort for the true error.
const EFFORT: Effort = Effort {
    pixels: 2048,
    paths: 128,
};

type Failure = Box<dyn Error>;

/// Number of statements that held.
#[derive(Default)]
struct Kept {
    cases: usize,
    in_interval: usize,
    above_asked: usize,
    worst: f64,
    seconds: [f64; 2],
}

/// The true errors of moments, with the current images or at a quality; `None` in the dark.
fn truths(
    engine: &mut Engine,
    times: &[Time],
    quality: Option<u8>,
) -> Result<Vec<Option<f64>>, Failure> {
    times
        .iter()
        .map(|time| truth(engine, *time, quality))
        .collect()
}

/// The largest of some errors.
fn worst_of(errors: &[Option<f64>]) -> f64 {
    errors.iter().flatten().copied().fold(0.0, f64::max)
}

fn truth(engine: &mut Engine, time: Time, quality: Option<u8>) -> Result<Option<f64>, Failure> {
    let (setting, home) = (engine.document().setting(time), engine.document().home());
    let image = match quality {
        Some(quality) => engine.render(&setting, Quality(quality))?,
        None => engine.picture_with(&setting, &home)?,
    };
    let found = independent::measure(engine, &image, (&setting, &home), EFFORT)?;
    Ok(found.map(|found| found.error))
}

fn refine(engine: &mut Engine, name: &str, asked: f64, kept: &mut Kept) -> Result<(), Failure> {
    let ended = engine.refine(Goal::until(asked))?.ended;
    let estimate = engine.estimate();
    let quality = estimate.coarse_steps()[1];
    let points = estimate.speed_accuracy()?.alone;
    let mixtures = estimate.refined();
    let measured = estimate.measured().ok_or("nothing was measured")?;
    let Some(worst) = measured.0.first().copied() else {
        return Ok(());
    };
    let cues = engine.document().timeline().cues().iter();
    let ends = cues.map(|cue| cue.completion);
    let times: Vec<Time> = std::iter::once(worst.time).chain(ends).collect();
    let errors = truths(engine, &times, None)?;
    let own = errors.first().copied().flatten().ok_or("not measured")?;
    let of_show = worst_of(&errors);
    let mut cheapest = None;
    for point in &points {
        let is_own = point.quality == quality.0 && mixtures == 0;
        let error = if is_own {
            of_show
        } else {
            worst_of(&truths(engine, &times, Some(point.quality))?)
        };
        if error <= asked {
            cheapest = Some(point);
            break;
        }
    }
    let [least, most] = worst.measured.interval;
    let is_in = least <= own && own <= most;
    let taken = points.iter().filter(|point| point.measured.is_some());
    let taken: f64 = taken.map(|point| point.seconds).sum::<f64>();
    kept.cases += 1;
    kept.in_interval += usize::from(is_in);
    if ended == Some(Ended::Reached) {
        kept.above_asked += usize::from(of_show > asked);
        kept.worst = kept.worst.max(of_show / asked);
    }
    if let Some(cheapest) = cheapest {
        kept.seconds[0] += taken;
        kept.seconds[1] += cheapest.seconds;
    }
    let needed = cheapest.map_or("none".to_owned(), |point| point.quality.to_string());
    println!(
        "{name}: asked {:.1} %, {ended:?}, quality {} and {mixtures} mixtures; stated {:.2} to {:.2} %, true {:.2} %{}, \
         {:.2} % in the whole show; quality {needed} is enough; {taken:.2} s",
        100.0 * asked,
        quality.0,
        100.0 * least,
        100.0 * most,
        100.0 * own,
        if is_in { "" } else { " (outside)" },
        100.0 * of_show,
    );
    Ok(())
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let shows = arguments.next().map_or(Ok(SHOWS), |n| n.parse())?;
    let asked: Vec<f64> = arguments.map(|a| a.parse()).collect::<Result<_, _>>()?;
    let asked = if asked.is_empty() {
        ASKED.to_vec()
    } else {
        asked
    };
    let mut kept = Kept::default();
    for seed in 1..=shows {
        for percent in &asked {
            let show = random_show(seed, [160, 90]);
            let host = Host {
                threads: 2,
                ..Host::default()
            };
            let mut engine = show.open(host)?;
            let name = format!("random {seed}");
            refine(&mut engine, &name, percent / 100.0, &mut kept)?;
        }
    }
    let [taken, needed] = kept.seconds;
    println!(
        "{} cases: {} true errors in the interval stated; {} beyond what was asked and said to be reached, the \
         worst {:.2} times; {:.2} times the seconds of the cheapest step",
        kept.cases,
        kept.in_interval,
        kept.above_asked,
        kept.worst,
        taken / needed
    );
    Ok(())
}
