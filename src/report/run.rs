//! The whole loop on a show, with its results in a folder, and its summary.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::headline;
use super::manifest::Results;
use super::measured::range;
use super::words::{count, error, exposure, percent, qualities};
use super::{Error, results, sheet, ways};
use footlight_engine::measure::independent::{self, Effort, MeasuredMoment};
use footlight_engine::plan::PlanReport;
use footlight_engine::playback::Playback;
use footlight_engine::pool::image_cache::CacheStatistics;
use footlight_engine::{self as engine, Ended, Engine, Goal, Refinement, WayForecast, WorstMoment};
use footlight_host::work::Cancelled;
use footlight_show::units::{ErrorUnit, Tolerance};
use footlight_transport::TransportError;

/// Effort of each measured moment: about a twentieth of the time that a show of twenty banks takes.
const EFFORT: Effort = Effort {
    pixels: 512,
    paths: 64,
};

/// An interval that is wider says little.
const TOO_WIDE: f64 = 0.04;

/// What a run did, and what it took.
#[derive(Clone, Debug)]
pub struct RunSummary {
    /// The plan at the show's own tolerance, in the metric that the pool allows.
    pub plan: PlanReport,
    /// The ways that it had, the one that it took first; none where that was asked for.
    pub ways: Vec<WayForecast>,
    /// Why refinement ended.
    pub ended: Ended,
    /// Where the sequence is predicted to be worst.
    pub worst: Option<WorstMoment>,
    /// The same as displayed.
    pub worst_shown: Option<WorstMoment>,
    /// Measured errors of some of its moments; the worst first.
    pub measured: Vec<MeasuredMoment>,
    /// The tolerance that was asked for.
    pub tolerance: Tolerance,
    /// Seconds for coarse images, plan, refinement, key images, and writing with playback.
    pub seconds: [f64; 5],
    /// The exposure of its pictures, stops.
    pub exposure: f64,
    /// Memory held the key images.
    pub keys: bool,
    /// What could not be made of its results, and why.
    pub missing: Option<String>,
    /// The folder with the results.
    pub folder: PathBuf,
}

/// How a run's images were come by.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImageSources {
    /// As the engine counts them, a farm's part in it.
    pub statistics: CacheStatistics,
    /// How many of those from the pool a farm has rendered for it.
    pub farmed: usize,
}

/// A run before its results are written.
struct Loop {
    plan: PlanReport,
    ways: Vec<WayForecast>,
    ended: Ended,
    /// `None` where memory does not hold the key images.
    playback: Option<Arc<Playback>>,
    /// The clock at the beginning and after coarse images, plan, refinement and key images.
    marks: [f64; 5],
}

/// Coarse images, plan, refinement until the goal, whose count is that of the pool's refined images
/// in all, key images; the results go to `folder`: `show.html`, `cues/*.png`, `contact-sheet.png`,
/// `cue-sheet.csv`, `track-sheet.csv`, `plan.json`, `curves.png`, `error.png`, `basis.png`, with
/// `with_keys` also `keys/*.exr`, and `files.sha256`, which lists them. Of what lies there only what
/// an earlier run listed and is unchanged since is replaced or removed. While they are written, and
/// where that is cut off, `unfinished.txt` says so.
///
/// # Errors
/// [`Error::ShowsFile`] and [`Error::Foreign`] before anything is rendered; what the engine, drawing
/// and writing say; refined images finished before it stay in the pool.
pub fn run(
    engine: &mut Engine,
    wanted: &Refinement,
    folder: &Path,
    with_keys: bool,
) -> Result<RunSummary, Error> {
    // Before anything is rendered: a folder that cannot be written to is refused at once.
    let own = results::names(engine, with_keys);
    let mut results = Results::begin(engine, folder, own.into_iter())?;
    let done = match run_loop(engine, wanted) {
        Ok(done) => done,
        Err(error) => {
            // Nothing was written yet: what lies there is of one run.
            results.give_up(engine)?;
            return Err(error);
        }
    };
    let tone = match &done.playback {
        Some(playback) => engine.document().tone_of(playback.images()),
        None => engine.tone()?,
    };
    let playback = (done.playback.as_ref(), tone);
    let missing = results::write(engine, &done.plan, playback, with_keys, &mut results)?;
    results.finish(engine)?;
    let end = engine.host().clock.seconds();
    let measured = match independent::measure_show(engine, EFFORT) {
        // The results are there without it.
        Err(engine::Error::Render(TransportError::Memory { .. })) => Vec::new(),
        measured => measured?,
    };
    let [a, b, c, d, e] = done.marks;
    Ok(RunSummary {
        plan: done.plan,
        ways: done.ways,
        ended: done.ended,
        worst: engine.estimate().worst_moment(ErrorUnit::Light)?,
        worst_shown: engine.estimate().worst_moment(ErrorUnit::Steps)?,
        measured,
        tolerance: wanted.goal.until.unwrap_or(engine.show().preview.tolerance),
        seconds: [b - a, c - b, d - c, e - d, end - e],
        exposure: tone.exposure,
        keys: done.playback.is_some(),
        missing,
        folder: folder.to_owned(),
    })
}

/// The loop without its results.
fn run_loop(engine: &mut Engine, wanted: &Refinement) -> Result<Loop, Error> {
    engine.idle()?;
    let begin = engine.host().clock.seconds();
    let ways = engine.coarse_for(wanted.clone())?;
    let coarse = engine.host().clock.seconds();
    // Those that earlier runs stored count, so that a second run renders nothing.
    let goal = Goal {
        count: (wanted.goal.count).map(|n| n.saturating_sub(engine.estimate().refined())),
        ..wanted.goal
    };
    let tolerance = goal.until.unwrap_or(engine.show().preview.tolerance);
    let plan = engine.estimate().plan(tolerance)?;
    let planned = engine.host().clock.seconds();
    let ended = engine
        .refine(Refinement {
            goal,
            ..wanted.clone()
        })?
        .ended;
    let ended = ended.ok_or(engine::Error::TaskLost)?;
    if ended == Ended::Stopped {
        return Err(Cancelled.into());
    }
    // The chart of what is ahead shows seconds, even where nothing was left to render.
    engine.calibrate()?;
    let refined = engine.host().clock.seconds();
    let playback = match engine.playback() {
        Ok(playback) => Some(playback),
        // All else of the results needs none.
        Err(engine::Error::KeyImages(_)) => None,
        Err(error) => return Err(error.into()),
    };
    let keys = engine.host().clock.seconds();
    Ok(Loop {
        plan,
        ways,
        ended,
        playback,
        marks: [begin, coarse, planned, refined, keys],
    })
}

/// The summary that a designer reads.
pub fn describe(engine: &Engine, done: &RunSummary, images: &ImageSources) -> String {
    let [coarse, plan, refine, keys, write] = done.seconds;
    let mut text = headline(engine.document()) + "\n" + &measured(engine, done);
    let sources = engine.show().coordinates().len();
    let coarse_words = format!("{} {}", count(sources, "picture"), qualities(engine));
    text += &line("coarse", &coarse_words, coarse);
    let plan_words = format!(
        "{}, {}, rank {} (pictures that make all keys)",
        count(done.plan.segments.len(), "segment"),
        count(done.plan.keys.len(), "key"),
        done.plan.rank
    );
    text += &line("plan", &plan_words, plan);
    if !done.ways.is_empty() {
        let _ = writeln!(text, "  {:<9} {}", "way", ways::taken(&done.ways));
    }
    text += &line("refine", &refinement(engine, done.ended), refine);
    if let (Some(light), Some(steps)) = (done.worst, done.worst_shown) {
        let (of_light, shown) = (moment(engine, &light), moment(engine, &steps));
        let percent = error(light.error, ErrorUnit::Light);
        let steps = error(steps.error, ErrorUnit::Steps);
        let second = if of_light == shown { "" } else { &shown };
        let _ = writeln!(
            text,
            "  {:<9}{of_light} {percent} of the light there,{second} {steps} of 255 as displayed, \
             predicted",
            "worst"
        );
    }
    text += &come_by(images);
    let cues = count(engine.show().cues.len(), "cue picture");
    let mut written = format!("{cues}, sheets, charts");
    if done.keys {
        text += &line("keys", &count(done.plan.keys.len(), "key image"), keys);
        written = format!("page, {written}");
    }
    text += &line("write", &written, write);
    let _ = writeln!(text, "  {}", exposure(engine.show(), done.exposure));
    if let Some(missing) = &done.missing {
        let _ = writeln!(text, "  {missing}");
    }
    let folder = done.folder.display();
    let page = match done.missing {
        None => "show.html plays the show in a browser; ",
        Some(_) => "",
    };
    let _ = writeln!(
        text,
        "  results in {folder}: {page}cues/, contact-sheet.png,"
    );
    text += "  cue-sheet.csv, track-sheet.csv, plan.json, curves.png, error.png, basis.png\n";
    text
}

/// The measured error of the worst moment, and whether it is more than was asked for.
fn measured(engine: &Engine, done: &RunSummary) -> String {
    let Some(worst) = done.measured.first() else {
        return String::new();
    };
    let cue = engine.show().cues.get(worst.cue);
    let number = cue.map_or(String::new(), |cue| cue.number.to_string());
    let asked = done.tolerance;
    let [least, most] = worst.measured.interval;
    let of_light = asked.unit == ErrorUnit::Light;
    let moment = format!("cue {number}, {}", sheet::clock(worst.time.rounded()));
    let words = if most - least > TOO_WIDE {
        // Noise hides the error.
        format!(
            "below {:.0} % at {moment}, measured; `measure cue {number} --paths 1024` says more",
            100.0 * most
        )
    } else if of_light && least > asked.error {
        let asked = percent(asked.error);
        format!(
            "{} at {moment}, measured; {asked} % asked for",
            range(&worst.measured)
        )
    } else {
        format!("{} at {moment}, measured", range(&worst.measured))
    };
    let seconds = done.measured.iter().map(|m| m.measured.seconds).sum();
    line("error", &words, seconds)
}

/// How many images were found, and how many rendered.
fn come_by(images: &ImageSources) -> String {
    let CacheStatistics {
        rendered, summed, ..
    } = images.statistics;
    let found = count(images.statistics.found(), "picture");
    let parts = [
        (summed, "sums of others"),
        (images.farmed, "rendered on the farm"),
    ];
    let parts = parts.iter().filter(|(n, _)| *n > 0);
    let parts: Vec<String> = parts
        .map(|(n, what)| format!("{n} of them {what}"))
        .collect();
    let from_pool = if parts.is_empty() {
        found
    } else {
        format!("{found} ({})", parts.join(", "))
    };
    format!(
        "  {:<9} from the pool: {from_pool}, rendered: {rendered}\n",
        "pictures"
    )
}

/// ` cue 7 at 0:46:`
fn moment(engine: &Engine, worst: &WorstMoment) -> String {
    let cue = engine.show().cues.get(worst.cue);
    let number = cue.map_or(String::new(), |cue| cue.number.to_string());
    let time = sheet::clock(worst.time.rounded());
    format!(" cue {number} at {time}:")
}

/// A step of the run: what was done, and the seconds that it took.
fn line(step: &str, done: &str, seconds: f64) -> String {
    format!("  {step:<9} {done:<66} {seconds:>6.1} s\n")
}

fn refinement(engine: &Engine, ended: Ended) -> String {
    let steps = engine.estimate().steps();
    let first = steps.first().map_or(0.0, |s| s.error);
    let last = steps.last().map_or(0.0, |s| s.error);
    let ended = match ended {
        Ended::Reached => "tolerance reached",
        Ended::Counted => "as many as asked for",
        Ended::Spent => "budget used up",
        Ended::Complete => "nothing left to refine",
        Ended::Finest => "the finest step is off by more than was asked for",
        Ended::Stopped => "stopped",
    };
    format!(
        "{} at quality {}; error {} % -> {} %, predicted ({ended})",
        count(engine.estimate().refined(), "picture"),
        engine.estimate().refined_step().0,
        percent(first),
        percent(last)
    )
}
