//! The whole loop on a show, with results in a folder and a summary.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::manifest::{PAGE, Results};
use super::measured::range;
use super::refine::too_large;
use super::words::{count, error, exposure, qualities, seconds};
use super::{Error, results, sheet};
use footlight_engine::measure::MeasuredMoment;
use footlight_engine::measure::independent::measure_worst;
use footlight_engine::plan::PlanReport;
use footlight_engine::playback::Playback;
use footlight_engine::pool::image_cache::CacheStatistics;
use footlight_engine::{self as engine, Ended, Engine, Goal, Refinement, WorstMoment};
use footlight_host::work::Cancelled;
use footlight_picture::tone::Tone;
use footlight_show::units::{ErrorUnit, Time, Tolerance};

/// Most columns of the summary.
const WIDTH: usize = 100;

/// Result and cost of a run.
#[derive(Clone, Debug)]
pub struct RunSummary {
    /// The plan at the show's tolerance, in the metric that the pool allows.
    pub plan: PlanReport,
    /// Reason for the end of refinement.
    pub ended: Ended,
    /// Predicted worst moment of the sequence, in the unit of the tolerance.
    pub worst: Option<WorstMoment>,
    /// Measured worst moment.
    pub measured: Option<MeasuredMoment>,
    /// The requested tolerance.
    pub tolerance: Tolerance,
    /// Seconds for images with their errors, and for key images and results.
    pub seconds: [f64; 2],
    /// Exposure of its images, stops.
    pub exposure: f64,
    /// Description of the page, or the reason for its absence.
    pub page: String,
    /// The folder with the results.
    pub folder: PathBuf,
}

/// Sources of a run's images.
#[derive(Clone, Copy, Debug, Default)]
pub struct ImageSources {
    /// Statistics of the engine, including a farm's share.
    pub statistics: CacheStatistics,
    /// Number of images in the pool rendered by a farm for this run.
    pub farmed: usize,
}

/// A run before its results are written.
struct Loop {
    plan: PlanReport,
    ended: Ended,
    measured: Option<MeasuredMoment>,
    /// Tone of cue images and page, and description of the page, when those of the first images are
    /// final.
    written: Option<(Tone, String)>,
    /// `None` when no longer needed.
    playback: Option<Arc<Playback>>,
    /// Seconds for images and measuring.
    seconds: f64,
}

/// Renders coarse images, refines to the goal (whose count includes refined images in the pool),
/// plans, and makes key images. Results go to `folder`: `show.html`, `cues/*.png`,
/// `contact-sheet.png`, `cue-sheet.csv`, `track-sheet.csv`, `hookup.csv`, `schedule.csv`,
/// `rig.svg`, `plan.json`, `curves.png`, `error.png`, `channels.png`, with `with_keys` also
/// `keys/*.exr`, and `files.sha256`, which lists them. Only files that an earlier run listed and
/// that are unchanged since are replaced or removed. `unfinished.txt` marks the folder until all
/// results are written.
///
/// # Errors
/// [`Error::ShowsFile`] and [`Error::Foreign`] before anything is rendered; errors of the engine,
/// of drawing and of writing. Finished refined images stay in the pool.
pub fn run(
    engine: &mut Engine,
    wanted: &Refinement,
    folder: &Path,
    with_keys: bool,
) -> Result<RunSummary, Error> {
    let begin = engine.host().clock.seconds();
    // Check the folder before rendering anything.
    let own = results::names(engine, with_keys);
    let mut results = Results::begin(engine, folder, own.into_iter())?;
    let done = match run_loop(engine, wanted, with_keys, &mut results) {
        Ok(done) => done,
        Err(error) => {
            if results.has_any() {
                let folder = results.folder().display();
                let page = if results.has(PAGE) { "with" } else { "without" };
                let state = format!("unfinished results in {folder}, {page} {PAGE}");
                engine.host().progress.report(&state, 1, 1);
            } else {
                // The folder holds results of one run.
                results.give_up(engine)?;
            }
            return Err(error);
        }
    };
    let tone = match &done.written {
        Some((tone, _)) => *tone,
        None => engine.tone()?,
    };
    let (playback, written) = (done.playback.as_ref(), done.written.map(|(_, page)| page));
    if let Some(playback) = playback.filter(|_| with_keys) {
        results::write_keys(engine, playback, &mut results)?;
    }
    let shown = (playback, tone);
    let page = results::write(engine, &done.plan, shown, written, &mut results)?;
    results.finish(engine)?;
    let all = engine.host().clock.seconds() - begin;
    let tolerance = wanted.goal.until.unwrap_or(engine.show().preview.tolerance);
    Ok(RunSummary {
        plan: done.plan,
        ended: done.ended,
        measured: done.measured,
        worst: engine.estimate().worst_moment(tolerance.unit)?,
        tolerance,
        seconds: [done.seconds, all - done.seconds],
        exposure: tone.exposure,
        page,
        folder: folder.to_owned(),
    })
}

/// The loop; it writes results of the first images when better ones may follow.
fn run_loop(
    engine: &mut Engine,
    wanted: &Refinement,
    with_keys: bool,
    results: &mut Results<'_>,
) -> Result<Loop, Error> {
    engine.idle()?;
    let begin = engine.host().clock.seconds();
    let rendered = engine.images().statistics().rendered;
    engine.coarse_for(wanted.clone())?;
    let coarse = engine.host().clock.seconds();
    let is_new = engine.images().statistics().rendered > rendered;
    let mut written = None;
    let images = |engine: &Engine| {
        (
            engine.estimate().coarse_steps(),
            engine.estimate().refined(),
        )
    };
    let first = images(engine);
    if is_new && engine.estimate().may_refine(&wanted.goal) {
        written = results::write_first(engine, results)?;
        let place = format!("first pictures in {}", results.folder().display());
        engine.host().progress.report(&place, 1, 1);
    }
    let begun = engine.host().clock.seconds();
    // Stored images count, so that a second run renders nothing.
    let goal = Goal {
        count: (wanted.goal.count).map(|n| n.saturating_sub(engine.estimate().refined())),
        ..wanted.goal
    };
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
    // Images of single sources were measured on the way.
    let measured = match engine.estimate().refined() {
        0 => engine
            .estimate()
            .measured()
            .and_then(|(m, _)| m.first().copied()),
        _ => measure_worst(engine)?,
    };
    // The error chart needs seconds, even when nothing was rendered.
    engine.calibrate()?;
    let refined = engine.host().clock.seconds();
    let tolerance = goal.until.unwrap_or(engine.show().preview.tolerance);
    let plan = engine.estimate().plan(tolerance)?;
    let written = written.filter(|_| images(engine) == first && !with_keys);
    let playback = if written.is_some() {
        None
    } else {
        Some(engine.playback()?)
    };
    Ok(Loop {
        plan,
        ended,
        measured,
        written,
        playback,
        seconds: coarse - begin + refined - begun,
    })
}

/// The summary for a designer: at most six lines, unless one is too wide.
pub fn describe(engine: &Engine, done: &RunSummary, images: &ImageSources) -> String {
    let mut text = line("error", &error_words(engine, done));
    text += &line("took", &took(engine, done));
    let sources = count(engine.show().coordinates().len(), "picture");
    let refined = match engine.estimate().refined() {
        0 => String::new(),
        n => format!(
            ", {} at quality {}",
            count(n, "mixture"),
            engine.estimate().refined_step().0
        ),
    };
    let quality = qualities(engine);
    let pictures = format!("{sources} {quality}{refined}; {}", come_by(images));
    text += &line("pictures", &pictures);
    let _ = writeln!(text, "{}", exposure(engine.show(), done.exposure));
    let page = &done.page;
    let folder = done.folder.display();
    let results = format!("in {folder}: {page}; error.png shows what more seconds buy");
    text += &line("results", &results);
    text
}

/// The measured error of the worst moment, else the predicted one, and the tolerance.
fn error_words(engine: &Engine, done: &RunSummary) -> String {
    let mut asked = error(done.tolerance.error, done.tolerance.unit);
    asked += match done.ended {
        Ended::Reached | Ended::Stopped => "",
        Ended::Counted => "; as many pictures as asked for",
        Ended::Spent => "; the time is used up",
        Ended::Complete => "; nothing left to refine",
        Ended::Finest => "; no quality reaches that",
        Ended::Memory(_) => "; memory allows no less",
    };
    if let Some(worst) = &done.measured {
        let at = moment(engine, worst.cue, worst.time);
        let [least, most] = worst.measured.interval;
        return if least > 0.0 {
            format!("{} at {at}; asked for {asked}", range(&worst.measured))
        } else {
            // The prediction includes the measurements. It counts for mixtures, and where chance
            // alone leaves room for more than the error that counts as reached.
            let is_light = done.tolerance.unit == ErrorUnit::Light;
            let is_open = done.ended == Ended::Reached && is_light && most > done.tolerance.error;
            let is_open = is_open || engine.estimate().refined() > 0;
            let predicted = done.worst.filter(|_| is_open);
            let predicted = predicted.map_or(String::new(), |worst| {
                format!(" ({} predicted)", error(worst.error, done.tolerance.unit))
            });
            let most = 100.0 * most;
            format!("below {most:.1} %{predicted} at {at}; asked for {asked}")
        };
    }
    match &done.worst {
        Some(worst) => {
            let of = error(worst.error, done.tolerance.unit);
            let at = moment(engine, worst.cue, worst.time);
            format!("{of} at {at}, predicted; asked for {asked}")
        }
        None => format!("none known; asked for {asked}"),
    }
}

/// Seconds taken, and the cost of halving the error.
fn took(engine: &Engine, done: &RunSummary) -> String {
    let [images, rest] = done.seconds;
    let mut text = format!(
        "{}: pictures and errors {}, results {}",
        seconds(images + rest),
        seconds(images),
        seconds(rest)
    );
    match &done.ended {
        Ended::Memory(large) => {
            let _ = write!(text, "; {}", too_large(large));
            return text;
        }
        Ended::Finest => return text,
        _ => {}
    }
    let estimate = engine.estimate();
    let found = estimate.speed_accuracy().unwrap_or_default();
    let now = estimate.predicted_error().unwrap_or(0.0);
    let ahead = found.alone.iter().chain(&found.mixtures);
    let half = ahead.filter(|point| point.error <= 0.5 * now && point.measured.is_none());
    if let Some(point) = half.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) {
        let _ = write!(
            text,
            "; half the error takes some {}",
            seconds(point.seconds)
        );
    }
    text
}

/// Number of images found and rendered.
fn come_by(images: &ImageSources) -> String {
    let CacheStatistics {
        rendered, summed, ..
    } = images.statistics;
    let found = images.statistics.found();
    let parts = [
        (summed, "sums of others"),
        (images.farmed, "rendered on the farm"),
    ];
    let parts = parts.iter().filter(|(n, _)| *n > 0);
    let parts: Vec<String> = parts
        .map(|(n, what)| format!("{n} of them {what}"))
        .collect();
    if parts.is_empty() {
        format!("from the pool: {found}, rendered: {rendered}")
    } else {
        let parts = parts.join(", ");
        format!("from the pool: {found} ({parts}), rendered: {rendered}")
    }
}

/// `cue 7, 0:46`
fn moment(engine: &Engine, cue: usize, time: Time) -> String {
    let cue = engine.show().cues.get(cue);
    let number = cue.map_or(String::new(), |cue| cue.number.to_string());
    format!("cue {number}, {}", sheet::clock(time.rounded()))
}

/// A line of the summary, wrapped at [`WIDTH`].
fn line(of: &str, words: &str) -> String {
    let mut text = format!("{of:<8}");
    let mut width = text.len();
    for word in words.split(' ') {
        let own = word.chars().count() + 1;
        if width + own > WIDTH {
            text += "\n        ";
            width = 8;
        }
        text.push(' ');
        text += word;
        width += own;
    }
    text + "\n"
}
