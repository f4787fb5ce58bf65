//! Measurements: of quality, against references, as charts.

use std::path::{Path, PathBuf};

use super::{session, usage};
use crate::chart::Theme;
use crate::repl::argument::{duration, quality as step, tolerance};
use crate::repl::{Call, Error, Repl, Reply};
use crate::report::format::{self, DRAWING, RECORD};
use crate::report::{self, comparison, refinement, tradeoff, ways};
use crate::units::ErrorUnit;

/// The file of commands that `chart session` replays unless another is given, next to the show.
const COMMANDS: &str = "session.txt";

/// Options that belong to one kind only, with that and what to say else.
const PARTIAL: [(&str, &str, &str); 3] = [
    (
        "reference",
        "transport",
        "all else is held against what the show itself can render",
    ),
    ("commands", "session", "it names the file to replay"),
    (
        "truth",
        "session",
        "every other chart has the truth in it where there is one",
    ),
];

const USAGE: &str = "say what to draw: `chart transport` draws error against time over the scale of \
    quality, `chart plan` over refined pictures, `chart ways` over both ways to an error, `chart session` over a session of edits";

pub fn quality(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    call.without_words(": quality tells of all steps")?;
    let forecast = repl.engine.measure_quality(call.has("measure"))?;
    match call.has("json") {
        true => Reply::json(&forecast),
        false => Ok(Reply::text(report::quality::describe(&forecast))),
    }
}

pub fn compare(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    call.without_words("; the folder stands behind --reference")?;
    let Some(folder) = call.path("reference") else {
        return usage(
            "say where the reference pictures are: compare --reference DIR, with DIR/BANK.exr for \
             every bank, or its halves BANK_A.exr and BANK_B.exr",
        );
    };
    let quality = match call.option("quality") {
        Some(text) => step(&repl.engine, text)?,
        None => repl.engine.coarse_steps()[1],
    };
    let path = call.output(&DRAWING)?;
    let compared = repl.engine.compare(folder, quality)?;
    let json = call.has("json");
    let reply = match json {
        true => Reply::json(&compared.comparison)?,
        false => Reply::text(comparison::describe(&compared.comparison)),
    };
    let Some(path) = path else {
        return Ok(reply);
    };
    let drawing = comparison::drawing(&repl.engine.show().title, &compared);
    let drawing = drawing.map_err(report::Error::from)?;
    let bytes = format::drawing(&drawing, 1.0, path)?;
    let written = repl.written(path, &bytes, &reply.text)?;
    Ok(if json { reply } else { written })
}

/// `plan --measure`
pub(super) fn plan(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    call.without_words("; a number of steps stands behind --next")?;
    let until = tolerance(&repl.engine, call, "tolerance")?;
    if until.unit == ErrorUnit::Steps {
        return usage("--measure chooses by an error of the light: say --tolerance 1%");
    }
    let budget = call.option("budget").map(duration).transpose()?;
    let tuned = repl.engine.tune(until.error, budget.map(|t| t.seconds()))?;
    match call.has("json") {
        true => Reply::json(&tuned),
        false => Ok(Reply::text(report::tune::describe(&tuned))),
    }
}

pub fn chart(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let kind = match call.words()[..] {
        [kind] => kind,
        _ => "",
    };
    let path = call.output(&RECORD)?;
    for (option, own, why) in PARTIAL {
        if call.has(option) && kind != own {
            return usage(format!("`--{option}` is for `chart {own}`: {why}"));
        }
    }
    let theme = match call.has("dark") {
        true => Theme::Dark,
        false => Theme::Light,
    };
    let to = (path, theme);
    match kind {
        "transport" => {
            let folder = call.path("reference");
            let found = repl.engine.measure_tradeoff(folder)?;
            let (text, record) = (tradeoff::describe(&found), || tradeoff::record(&found));
            repl.deliver(text, &record, &|theme| tradeoff::drawing(&found, theme), to)
        }
        "session" => {
            let commands = call.path("commands").map(Path::to_owned);
            let commands = commands.unwrap_or_else(|| usual_commands(repl));
            session::replayed(repl, &commands, call.has("truth"), to)
        }
        "plan" => {
            let found = repl.engine.measure_refinement()?;
            let (text, record) = (refinement::describe(&found), || refinement::record(&found));
            repl.deliver(
                text,
                &record,
                &|theme| refinement::drawing(&found, theme),
                to,
            )
        }
        "ways" => {
            let found = repl.engine.measure_ways()?;
            let (text, record) = (ways::measured(&found), || ways::record(&found));
            repl.deliver(text, &record, &|theme| ways::drawing(&found, theme), to)
        }
        _ => usage(USAGE),
    }
}

/// The session next to the show's file.
fn usual_commands(repl: &Repl) -> PathBuf {
    let folder = repl.engine.document().path().and_then(Path::parent);
    folder.unwrap_or(Path::new("")).join(COMMANDS)
}
