//! What is rendered: plan, refinement, pool, the whole loop.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::usage;
use crate::argument::{duration, error, goal, tolerance, way, whole};
use crate::{Call, Error, Repl, Reply};
use footlight_engine::{self as engine, Ended, Goal, Refinement, TaskList};
use footlight_report::words::{count, exposure, qualities};
use footlight_report::{self as report, refine as words, run as whole_loop};

/// Steps that `plan --next` lists unless another number is given.
const LISTED: usize = 5;

pub fn plan(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if let Some(path) = call.path("tasks") {
        return tasks(repl, call, path);
    }
    if call.has("next") {
        return next(repl, call);
    }
    call.without_words("; a number of steps stands behind --next")?;
    repl.engine.take_up()?;
    let tolerance = tolerance(&repl.engine, call, "tolerance")?;
    let plan = repl.engine.estimate().plan(tolerance)?;
    if call.has("json") {
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
        let goal = Goal::until(tolerance);
        text.push_str(&report::ways::describe(
            &repl.engine.ways(wanted(call, goal)?)?,
            &goal,
        ));
    }
    if repl.engine.estimate().pool().is_some() && !repl.engine.estimate().is_final() {
        let at = qualities(&repl.engine);
        text.push_str(&format!(
            "measured by coarse pictures {at}, rendered first\n"
        ));
    }
    Ok(Reply::text(text))
}

/// Lists the pictures that the tolerance needs for others to render.
fn tasks(repl: &mut Repl, call: &Call, path: &Path) -> Result<Reply, Error> {
    for other in ["next", "json"] {
        if call.has(other) {
            return usage(format!("--{other} does not go with --tasks"));
        }
    }
    call.without_words("; the file of tasks stands behind --tasks")?;
    let goal = Goal::until(tolerance(&repl.engine, call, "tolerance")?);
    let list = TaskList::of(&mut repl.engine, wanted(call, goal)?)?;
    report::tasks::write(repl.engine.host().store.as_ref(), path, &list)?;
    Ok(Reply::text(report::tasks::listed(&list, path)))
}

/// Has a goal's pictures rendered by the farm of this name, where one is said; what is left of the goal
/// then needs no rendering. How many pictures were rendered so is returned with it.
fn on_farm(repl: &mut Repl, call: &Call, goal: Goal) -> Result<(Goal, usize), Error> {
    let Some(name) = call.option("farm") else {
        return Ok((goal, 0));
    };
    if name != "slurm" {
        return usage(format!(
            "there is no farm `{name}`; it is slurm (others: the manual's page `farm`)"
        ));
    }
    if goal.budget.is_some() {
        return usage("a farm's time is its own: say how many pictures, or until which error");
    }
    let Some(farm) = &repl.console.farm else {
        return usage("there is no farm here");
    };
    let rendered = report::farm::refine(&mut repl.engine, wanted(call, goal)?, farm.as_ref())?;
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

/// A goal by the way that is said.
fn wanted(call: &Call, goal: Goal) -> Result<Refinement, Error> {
    let way = call.option("way").map(way).transpose()?;
    Ok(Refinement::from(goal).by(way.unwrap_or_default()))
}

fn next(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let listed = match call.words().as_slice() {
        [] => LISTED,
        [number] => whole(number)?,
        [_, word, ..] => return usage(format!("`{word}` is left over: plan --next [N]")),
    };
    if call.has("tolerance") {
        return usage(
            "--tolerance belongs to the plan of the whole show, not to --next: the next steps \
             follow from the pictures that are there",
        );
    }
    repl.engine.coarse()?;
    repl.engine.calibrate()?;
    let mut forecast = repl.engine.estimate().forecast()?;
    let all = forecast.steps.len();
    forecast.steps.truncate(listed);
    if call.has("json") {
        Reply::json(&forecast)
    } else {
        Ok(Reply::text(words::forecast(&repl.engine, &forecast, all)))
    }
}

pub fn refine(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let mut call = call.clone();
    if let Some(words) = in_background(&mut call) {
        if call.has("farm") {
            return usage("a farm is waited for: say it without `&`");
        }
        if repl.engine.is_busy() {
            return Err(engine::Error::Busy.into());
        }
        repl.engine.start(wanted(&call, goal(&call)?)?)?;
        repl.refining = words;
        let notes = repl.event_notes();
        return Ok(Reply::text(if notes.is_empty() {
            "refining in the background: `status` shows how far it is".to_owned()
        } else {
            notes.join("\n")
        }));
    }
    let goal = goal(&call)?;
    if repl.engine.is_busy() {
        return Err(engine::Error::Busy.into());
    }
    let mut before = repl.engine.steps().len();
    let (goal, _) = on_farm(repl, &call, goal)?;
    let wanted = wanted(&call, goal)?;
    repl.engine.coarse_for(wanted.clone())?;
    if !call.has("farm") {
        before = repl.engine.steps().len();
    }
    let done = repl.engine.refine(wanted)?;
    let text = words::refined(&repl.engine, &done, before.saturating_sub(1));
    Ok(Reply {
        stopped: done.ended == Some(Ended::Stopped),
        ..Reply::text(text)
    })
}

/// Takes the `&` off that asks for work in the background; the line without its options, if it was
/// there.
fn in_background(call: &mut Call) -> Option<String> {
    let last = call.words.last_mut()?;
    *last = last.to_str()?.strip_suffix('&')?.into();
    call.words.retain(|w| !w.is_empty());
    let mut line = String::from("refine ");
    for word in call.words() {
        let _ = write!(line, "{word} ");
    }
    for (name, value) in &call.options {
        let _ = write!(line, "--{name} ");
        if !value.is_empty() {
            let _ = write!(line, "{} ", value.to_string_lossy());
        }
    }
    line.push('&');
    Some(line)
}

pub fn status(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    if let Some(status) = repl.engine.status() {
        return Ok(Reply::text(words::status(&status, repl.background())));
    }
    let mut text = words::idle(&repl.engine);
    // Before the first pictures none is chosen.
    if repl.engine.estimate().pool().is_some() {
        let stops = repl.engine.tone()?.exposure;
        text = format!("{text}\n{}", exposure(repl.engine.show(), stops));
    }
    Ok(Reply::text(text))
}

pub fn wait(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if !repl.engine.is_busy() {
        return status(repl, call);
    }
    Ok(Reply::text(repl.wait()?.join("\n")))
}

pub fn stop(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let at_once = match call.words().as_slice() {
        [] => false,
        ["now"] => true,
        _ => return usage("usage: stop [now]"),
    };
    if !repl.engine.is_busy() {
        return status(repl, call);
    }
    repl.engine.stop(at_once);
    let notes = repl.event_notes();
    Ok(Reply::text(match (notes.is_empty(), at_once) {
        (false, _) => notes.join("\n"),
        (true, false) => {
            "it stops after what is in hand, which is kept; `stop now` gives that up".to_owned()
        }
        (true, true) => "it stops".to_owned(),
    }))
}

pub fn run(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let seconds = |text: &str| duration(text).map(|t| t.seconds());
    let mut goal = Goal {
        until: call.option("until").map(error).transpose()?,
        count: call.option("count").map(whole).transpose()?,
        budget: call.option("budget").map(seconds).transpose()?,
    };
    if goal == Goal::default() {
        goal.until = Some(repl.engine.show().preview.tolerance);
    }
    let folder = call.path("output").map(Path::to_owned);
    let folder = folder.unwrap_or_else(|| default_folder(repl));
    if repl.engine.is_busy() {
        return Err(engine::Error::Busy.into());
    }
    let before = repl.engine.images().statistics();
    let mut farmed = 0;
    if let Some(count) = goal.count {
        // Those that are there are counted once the coarse ones are.
        farmed += on_farm(repl, call, Goal::count(0))?.1;
        let left = count.saturating_sub(repl.engine.estimate().refined());
        farmed += on_farm(repl, call, Goal::count(left))?.1;
    } else {
        farmed += on_farm(repl, call, goal)?.1;
    }
    let summary = whole_loop::run(
        &mut repl.engine,
        &wanted(call, goal)?,
        &folder,
        call.has("keys"),
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

pub fn pool(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let all = match call.words().as_slice() {
        [] => return Ok(Reply::text(report::pool::describe(&repl.engine)?)),
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
