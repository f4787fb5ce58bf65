//! Rendering: plan, refinement, pool, and the whole loop.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};

use super::usage;
use crate::argument::{self, ByWay, FromView, Output, duration, tolerance, whole};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::{Ended, Goal, Refinement, TaskList};
use footlight_report::words::{count, exposure, qualities};
use footlight_report::{self as report, refine as words, run as whole_loop};
use footlight_show::units::{Time, Tolerance};

/// Options of `plan`.
#[derive(Args, Clone, Debug)]
pub struct PlanArgs {
    /// Print data instead of words
    #[arg(long)]
    json: bool,
    /// Error allowed, such as 2% or 1.5steps (default: the show's preview)
    #[arg(long, value_name = "X", value_parser = argument::error)]
    tolerance: Option<Tolerance>,
    #[command(flatten)]
    pub(crate) by: ByWay,
    #[command(flatten)]
    pub(crate) from: FromView,
    /// Write the pictures that are missing for the tolerance as tasks for `work`
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "json")]
    tasks: Option<Output>,
}

/// The refinement to run.
#[derive(Args, Clone, Debug)]
pub struct RefineArgs {
    #[arg(num_args = 0.., value_names = ["N | until X | for TIME", "&"])]
    words: Vec<String>,
    #[command(flatten)]
    pub(crate) from: FromView,
    #[command(flatten)]
    pub(crate) by: ByWay,
    #[command(flatten)]
    on: OnFarm,
}

/// Option to render on a farm.
#[derive(Args, Clone, Debug)]
struct OnFarm {
    /// Have it rendered by other machines (the manual's page `farm`)
    #[arg(long, value_name = "NAME", value_parser = ["slurm"])]
    farm: Option<String>,
}

/// Option to stop at once.
#[derive(Args, Clone, Debug)]
pub struct StopArgs {
    #[arg(value_parser = ["now"])]
    now: Option<String>,
}

/// Options of `run`.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// Refine until this error, such as 2% or 1.5steps (default: the show's preview)
    #[arg(long, value_name = "X", value_parser = argument::error)]
    until: Option<Tolerance>,
    /// Refine until there are N pictures, stored ones included
    #[arg(long, value_name = "N", value_parser = whole)]
    count: Option<usize>,
    /// Stop refining when this time is used up
    #[arg(long, value_name = "TIME", value_parser = duration)]
    budget: Option<Time>,
    #[command(flatten)]
    pub(crate) from: FromView,
    #[command(flatten)]
    pub(crate) by: ByWay,
    #[command(flatten)]
    on: OnFarm,
    /// Write the key images too, as linear .exr
    #[arg(long)]
    keys: bool,
    /// Where the results go (default: out/ and the show's file name)
    #[arg(long, short, value_name = "DIR", value_hint = ValueHint::DirPath)]
    output: Option<Output>,
}

/// The images to drop.
#[derive(Args, Clone, Debug)]
pub struct PoolArgs {
    #[arg(value_name = "drop [unused | all]")]
    words: Vec<String>,
}

pub fn plan(repl: &mut Repl, asked: &PlanArgs) -> Result<Reply, Error> {
    let tolerance = tolerance(&repl.engine, asked.tolerance);
    if let Some(tasks) = &asked.tasks {
        let path = repl.spared(tasks)?;
        let list = TaskList::of(
            &mut repl.engine,
            asked.by.refinement(Goal::until(tolerance)),
        )?;
        report::tasks::write(repl.engine.host().store.as_ref(), path, &list)?;
        return Ok(Reply::text(report::tasks::listed(&list, path)));
    }
    repl.engine.take_up()?;
    let plan = repl.engine.estimate().plan(tolerance)?;
    if asked.json {
        return Reply::json(&report::plan::form(&plan));
    }
    let mut text = report::plan::describe(&plan);
    if repl.engine.estimate().pool().is_none() {
        text.push_str("by levels alone; counted again once there are pictures\n");
    }
    if let Some(now) = words::so_far(&repl.engine) {
        text.push_str(&now);
    }
    if repl.engine.document().setup().is_some() {
        let wanted = asked.by.refinement(Goal::until(tolerance));
        let goal = wanted.goal;
        text.push_str(&report::ways::describe(&repl.engine.ways(wanted)?, &goal));
        let estimate = repl.engine.estimate();
        if estimate.measures(&goal) && estimate.measured().is_none() {
            text.push_str(
                "errors are those of most shows: `run` and `refine until` measure first\n",
            );
        }
    }
    if repl.engine.estimate().pool().is_some() && !repl.engine.estimate().is_final() {
        let at = qualities(&repl.engine);
        text.push_str(&format!(
            "measured by coarse pictures {at}, rendered first\n"
        ));
    }
    Ok(Reply::text(text))
}

/// Renders a goal's images on the named farm, if one is given. Returns a goal that needs no further
/// rendering, and the number of images rendered.
fn on_farm(repl: &mut Repl, on: &OnFarm, wanted: Refinement) -> Result<(Goal, usize), Error> {
    let goal = wanted.goal;
    let Some(name) = &on.farm else {
        return Ok((goal, 0));
    };
    if goal.budget.is_some() {
        return usage("a farm's time is its own: say how many pictures, or until which error");
    }
    let Some(farm) = &repl.console.farm else {
        return usage("there is no farm here");
    };
    let rendered = report::farm::refine(&mut repl.engine, wanted, farm.as_ref())?;
    if rendered > 0 {
        let pictures = count(rendered, "picture");
        repl.unheard
            .push(format!("{name} rendered {pictures}").into());
    }
    let left = Goal {
        count: goal.or_one().count.map(|_| 0),
        ..goal
    };
    Ok((left, rendered))
}

/// The goal given to `refine`.
fn goal(words: &[&str]) -> Result<Goal, Error> {
    let read = |text: &str| argument::error(text).map(Goal::until);
    let goal = match *words {
        [] => Ok(Goal::default()),
        ["until", text] => read(text),
        ["until", number, unit @ ("step" | "steps")] => read(&format!("{number}{unit}")),
        ["for", time] => duration(time).map(|time| Goal {
            budget: Some(time.seconds()),
            ..Goal::default()
        }),
        [number] => whole(number).map(Goal::count),
        _ => return usage("usage: refine [N | until X | for TIME] [&]"),
    };
    goal.map_err(Error::Usage)
}

pub fn refine(repl: &mut Repl, asked: &RefineArgs) -> Result<Reply, Error> {
    let typed = asked.words.join(" ");
    let foreground = typed.strip_suffix('&').unwrap_or(&typed);
    let words: Vec<&str> = foreground.split_whitespace().collect();
    let goal = goal(&words)?;
    let is_farmed = asked.on.farm.is_some();
    repl.engine.idle()?;
    if typed.ends_with('&') {
        if is_farmed {
            return usage("a farm is waited for: say it without `&`");
        }
        repl.engine.start(asked.by.refinement(goal))?;
        repl.refining = in_background(asked, &words);
        let notes = repl.poll();
        return Ok(Reply::text(if notes.is_empty() {
            "refining in the background: `status` shows how far it is".to_owned()
        } else {
            notes.join("\n")
        }));
    }
    let mut before = repl.engine.estimate().steps().len();
    let (goal, _) = on_farm(repl, &asked.on, asked.by.refinement(goal))?;
    let wanted = asked.by.refinement(goal);
    repl.engine.coarse_for(wanted.clone())?;
    if !is_farmed {
        before = repl.engine.estimate().steps().len();
    }
    let done = repl.engine.refine(wanted)?;
    let text = words::refined(&repl.engine, &done, before.saturating_sub(1));
    Ok(Reply {
        stopped: done.ended == Some(Ended::Stopped),
        ..Reply::text(text)
    })
}

/// The line that asks for a refinement in the background.
fn in_background(asked: &RefineArgs, words: &[&str]) -> String {
    let mut line = String::from("refine ");
    for word in words {
        let _ = write!(line, "{word} ");
    }
    if let Some(view) = &asked.from.view {
        let _ = write!(line, "--view {view} ");
    }
    if let Some(way) = asked.by.way {
        let _ = write!(line, "--way {} ", way.name());
    }
    line.push('&');
    line
}

pub fn status(repl: &mut Repl) -> Result<Reply, Error> {
    if let Some(status) = repl.engine.status() {
        return Ok(Reply::text(words::status(&status, repl.background())));
    }
    let mut text = words::idle(&repl.engine);
    // Without coarse pictures no exposure is chosen.
    if repl.engine.estimate().pool().is_some() {
        let stops = repl.engine.tone()?.exposure;
        text = format!("{text}\n{}", exposure(repl.engine.show(), stops));
    }
    Ok(Reply::text(text))
}

pub fn wait(repl: &mut Repl) -> Result<Reply, Error> {
    if !repl.engine.is_busy() {
        return status(repl);
    }
    Ok(Reply::text(repl.wait()?.join("\n")))
}

pub fn stop(repl: &mut Repl, asked: &StopArgs) -> Result<Reply, Error> {
    let at_once = asked.now.is_some();
    if !repl.engine.is_busy() {
        return status(repl);
    }
    repl.engine.stop(at_once);
    let notes = repl.poll();
    Ok(Reply::text(match (notes.is_empty(), at_once) {
        (false, _) => notes.join("\n"),
        (true, false) => {
            "it stops after what is in hand, which is kept; `stop now` gives that up".to_owned()
        }
        (true, true) => "it stops".to_owned(),
    }))
}

pub fn run(repl: &mut Repl, asked: &RunArgs) -> Result<Reply, Error> {
    let mut goal = Goal {
        until: asked.until,
        count: asked.count,
        budget: asked.budget.map(|time| time.seconds()),
    };
    if goal == Goal::default() {
        goal.until = Some(repl.engine.show().preview.tolerance);
    }
    let folder = match &asked.output {
        Some(output) => repl.spared(output)?.to_owned(),
        None => default_folder(repl),
    };
    repl.engine.idle()?;
    let before = repl.engine.images().statistics();
    let mut farmed = 0;
    if let Some(count) = goal.count {
        // Refined pictures are counted only once the coarse ones exist.
        farmed += on_farm(repl, &asked.on, asked.by.refinement(Goal::count(0)))?.1;
        let left = count.saturating_sub(repl.engine.estimate().refined());
        farmed += on_farm(repl, &asked.on, asked.by.refinement(Goal::count(left)))?.1;
    } else {
        farmed += on_farm(repl, &asked.on, asked.by.refinement(goal))?.1;
    }
    let summary = whole_loop::run(
        &mut repl.engine,
        &asked.by.refinement(goal),
        &folder,
        asked.keys,
    )?;
    let images = whole_loop::ImageSources {
        statistics: repl.engine.images().statistics().since(before),
        farmed,
    };
    Ok(Reply::text(whole_loop::describe(
        &repl.engine,
        &summary,
        &images,
    )))
}

fn default_folder(repl: &Repl) -> PathBuf {
    let document = repl.engine.document();
    let show = document.path().unwrap_or(Path::new(document.name()));
    Path::new("out").join(show.file_stem().unwrap_or_default())
}

pub fn pool(repl: &mut Repl, asked: &PoolArgs) -> Result<Reply, Error> {
    let words: Vec<&str> = asked.words.iter().map(String::as_str).collect();
    let all = match words[..] {
        [] => return Ok(Reply::text(report::pool::describe(&repl.engine))),
        ["drop"] | ["drop", "unused"] => false,
        ["drop", "all"] => true,
        _ => {
            return usage(
                "usage: pool, pool drop unused (what this show cannot use), or pool drop all",
            );
        }
    };
    let freed = repl.engine.drop_images(all)?;
    Ok(Reply::text(report::pool::freed(&freed)))
}
