//! Measurements: of quality, against references, as charts.

use super::usage;
use crate::argument::quality as step;
use crate::{Call, Error, Repl, Reply, removed};
use footlight_engine as engine;
use footlight_report::chart::Theme;
use footlight_report::format::{self, DRAWING, RECORD};
use footlight_report::{self as report, comparison, tradeoff};

pub fn quality(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    call.without_words(": quality tells of all steps")?;
    let forecast = engine::measure::quality::measure(&repl.engine, call.has("measure"))?;
    if call.has("json") {
        Reply::json(&forecast)
    } else {
        Ok(Reply::text(report::quality::describe(&forecast)))
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
        None => repl.engine.estimate().coarse_steps()[1],
    };
    let path = call.output(&DRAWING)?;
    let compared = engine::measure::comparison::compare(&repl.engine, folder, quality)?;
    let json = call.has("json");
    let reply = if json {
        Reply::json(&compared.comparison)?
    } else {
        Reply::text(comparison::describe(&compared.comparison))
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

pub fn chart(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    if call.words()[..] != ["transport"] {
        let words = call.words().join(" ");
        return usage(removed(&format!("chart {words}")).unwrap_or_else(|| {
            "`chart transport` draws error against time over the scale of quality".to_owned()
        }));
    }
    let path = call.output(&RECORD)?;
    let theme = if call.has("dark") {
        Theme::Dark
    } else {
        Theme::Light
    };
    let found = engine::measure::tradeoff::measure(&repl.engine, call.path("reference"))?;
    let (text, record) = (tradeoff::describe(&found), || tradeoff::record(&found));
    repl.deliver(
        text,
        &record,
        &|theme| tradeoff::drawing(&found, theme),
        (path, theme),
    )
}
