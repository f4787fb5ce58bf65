//! Describes refinement: steps, status.

use std::borrow::Cow;
use std::fmt::Write as _;

use super::words::{count, percent, seconds};
use footlight_engine::{Ended, Engine, Event, JobStatus, RefinementSummary, Status, TooLarge};

/// The reason why refinement ended; empty if obvious.
pub fn ended(ended: Ended) -> Cow<'static, str> {
    Cow::Borrowed(match ended {
        Ended::Reached => "the error asked for is reached",
        Ended::Counted => "",
        Ended::Spent => "the time is used up",
        Ended::Complete => "every direction that the show needs is refined",
        Ended::Finest => {
            "as exact as the renderer gets: the finest step of quality is itself off by more than \
             was asked for"
        }
        Ended::Memory(large) => {
            let needs = too_large(&large);
            return Cow::Owned(format!("as exact as the memory allows: {needs}"));
        }
        Ended::Stopped => "stopped; what is finished is kept",
    })
}

/// Note on a quality step beyond the memory, with the option that allows it.
pub fn too_large(large: &TooLarge) -> String {
    format!(
        "quality {} needs `--memory {}` or more",
        large.quality.0,
        large.memory.div_ceil(1 << 20)
    )
}

/// Note on a next image that does not fit into the time.
fn too_long(done: &RefinementSummary) -> Option<String> {
    let takes = seconds(done.too_long?);
    Some(format!(
        "the next picture would take {takes}, which does not fit"
    ))
}

/// Describes the steps from `first` on, and the reason for the end.
pub fn refined(engine: &Engine, done: &RefinementSummary, first: usize) -> String {
    let mut text = String::new();
    for step in engine.estimate().steps().iter().skip(first) {
        let _ = writeln!(
            text,
            "{}",
            self::step(step.refined, step.error, step.seconds)
        );
    }
    if let Some(note) = too_long(done) {
        let _ = writeln!(text, "{note}");
    }
    text.push_str(&done.ended.map_or(Cow::Borrowed(""), ended));
    text
}

/// One line about the state of the sequence.
fn step(refined: usize, error: f64, seconds: f64) -> String {
    format!(
        "{refined:>3} refined  predicted error {:>8} % of the light  {seconds:.1} s",
        percent(error)
    )
}

/// An event in lines; `words` requested the refinement in the background.
pub fn event(event: &Event, words: &str) -> Vec<String> {
    let (done, failed, error, refined) = match event {
        Event::FilesReread => {
            let said = "files that the show names were changed; they are read again";
            return vec![said.to_owned()];
        }
        Event::RefinementEnded {
            done,
            failed,
            error,
            refined,
        } => (done, failed, error, refined),
    };
    let why = match failed {
        Some(error) => Cow::Owned(format!("stopped: {error}")),
        None => done.ended.map_or(Cow::Borrowed(""), ended),
    };
    let mut text = format!("{words}: ");
    if let Some(error) = error {
        let refined = count(*refined, "refined picture");
        let _ = write!(
            text,
            "predicted error {} % of the light with {refined}; ",
            percent(*error)
        );
    }
    text.push_str(if why.is_empty() { "done" } else { &why });
    too_long(done).into_iter().chain([text]).collect()
}

/// State of the refinement in the background, in a few lines.
pub fn status(status: &Status, words: &str) -> String {
    let mut text = format!("{words}: ");
    match status.error {
        Some(error) => {
            let done = match status.rendered {
                0 => "no picture finished yet".to_owned(),
                n => format!("{} in {}", count(n, "picture"), seconds(status.seconds)),
            };
            let _ = writeln!(
                text,
                "{done}, predicted error {} % of the light",
                percent(error)
            );
        }
        None => text.push_str("before the first refined picture\n"),
    }
    if let Some(job) = &status.job {
        describe_job(job, &mut text);
    }
    text
}

fn describe_job(job: &JobStatus, text: &mut String) {
    let what = match job.images {
        0 => "measuring errors".to_owned(),
        _ if job.refined => "a picture".to_owned(),
        images => count(images, "coarse picture"),
    };
    let quality = job.quality.0;
    let _ = write!(
        text,
        "  in hand: {what} at quality {quality}, {}",
        seconds(job.spent)
    );
    if job.predicted > 0.0 {
        let _ = write!(text, " of {} predicted", seconds(job.predicted));
    }
    match &job.task {
        (_, _, 0) => {}
        (task, done, total) => {
            let _ = write!(text, " ({task}: {done} of {total})");
        }
    }
    text.push('\n');
}

/// Message when no refinement runs in the background.
pub fn idle(engine: &Engine) -> String {
    let mut text = "nothing is running in the background".to_owned();
    if let Some(step) = engine.estimate().steps().last() {
        let refined = count(step.refined, "refined picture");
        let _ = write!(
            text,
            "; {refined}, predicted error {} % of the light",
            percent(step.error)
        );
    }
    text
}

/// State of the sequence, in one line; `None` before there are images.
pub fn so_far(engine: &Engine) -> Option<String> {
    let step = engine.estimate().steps().last()?;
    let refined = count(step.refined, "refined picture");
    Some(format!(
        "so far: {refined}, error {} %\n",
        percent(step.error)
    ))
}

/// Note when the show asks for quality steps beyond the scale.
pub fn clamped(engine: &Engine) -> Option<String> {
    let finest = engine.estimate().finest().0;
    let preview = &engine.show().preview;
    let beyond = preview.coarse.max(preview.refined) > finest;
    let scale = engine.document().setup().is_some() && finest > 1 && beyond;
    scale.then(|| {
        let name = engine.host().renderer.name();
        let (coarse, refined) = (preview.coarse, preview.refined);
        format!(
            "the show asks for quality `coarse {coarse}  refined {refined}`, the scale of the {name} is \
             1 to {finest}: {finest} is taken instead; the default, `coarse 1  refined 2`, is faster"
        )
    })
}
