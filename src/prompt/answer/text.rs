//! What is done with the show's text, and what it declares.

use std::path::{Path, PathBuf};

use super::usage;
use crate::{Call, Error, Repl, Reply};
use footlight_engine::{self as engine, ManyKeys, StageMaterial, UnlitBank, Version};
use footlight_host::work::Cancelled;
use footlight_report::format::{self, WIDTH};
use footlight_report::table::Table;
use footlight_report::versions::VersionComparison;
use footlight_report::words::count;
use footlight_report::{self as report, document};
use footlight_report::{sheet, stage};
use footlight_transport::contract::check_memory;

pub fn check(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    let style = repl.console.style;
    let long = engine::measure::wait::long_run(&repl.engine)?;
    let unlit = UnlitBank::find(&mut repl.engine);
    let setup = repl.engine.document().setup();
    let materials = setup.map_or(Vec::new(), |setup| StageMaterial::all(&setup.scene));
    let transparent = stage::transparent(&materials);
    let document = repl.engine.document();
    let many = ManyKeys::of(document, repl.engine.host().memory);
    let text = document::check(document, (long, many), unlit, &transparent, style);
    Ok(Reply::text(text))
}

pub fn show(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let document = repl.engine.document();
    if call.words.is_empty() {
        return Ok(Reply::text(document::listing(document)));
    }
    let name = call.words().join(" ");
    let texts = document::declarations(document, &name);
    if texts.is_empty() {
        usage(format!("nothing in the show is called `{name}`"))
    } else {
        Ok(Reply::text(texts.join("\n")))
    }
}

pub fn view(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    match call.words().as_slice() {
        [] => {}
        [name] => drop(repl.engine.look_from(name)?),
        _ => return usage("say one name: view stalls"),
    }
    Ok(Reply::text(document::views(repl.engine.document())))
}

pub fn undo(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    through_history(repl, true)
}

pub fn redo(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    through_history(repl, false)
}

fn through_history(repl: &mut Repl, back: bool) -> Result<Reply, Error> {
    let old = repl.engine.document().compiled();
    if back {
        repl.engine.undo()?;
    } else {
        repl.engine.redo()?;
    }
    let document = repl.engine.document();
    let difference = sheet::difference(&old.version, &document.compiled().version);
    let changes = difference.changes.iter();
    let mut text: String = changes.map(|change| format!("{change}\n")).collect();
    text.push_str(&document::headline(document));
    let left = count(document.edits(), "edit");
    Ok(Reply::text(format!("{text}\n{left} to undo")))
}

pub fn fmt(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let document = repl.engine.document();
    if call.has("check") {
        let laid_out = engine::format(document.name(), document.text().as_bytes())?;
        return Ok(Reply::text(if laid_out == document.text() {
            "already in its canonical layout"
        } else {
            "`fmt` would change the layout"
        }));
    }
    Ok(Reply::text(if repl.engine.format()? {
        "laid out again; `save` writes it"
    } else {
        "already in its canonical layout"
    }))
}

/// The text against what was last read or saved, or against a file.
pub fn diff(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let (document, host) = (repl.engine.document(), repl.engine.host());
    let (name, old) = match call.words().as_slice() {
        [] => ("as saved", document.saved_text().as_bytes().to_vec()),
        [path] => (*path, host.store.read(Path::new(path), engine::TEXT_LIMIT)?),
        _ => return usage("say one file, or none: diff old.lxq"),
    };
    let files = host.files.as_ref();
    let old = Version::read(name, &old, files)?;
    let new = Version::read(document.name(), document.text().as_bytes(), files)?;
    let compared = VersionComparison::new(old, new);
    let text = match compared.text() {
        text if text.is_empty() => "nothing changed".to_owned(),
        text => text,
    };
    match call.path("output") {
        None => Ok(Reply::text(text)),
        Some(path) => repl.written(path, &compared.chart(path)?, &text),
    }
}

pub fn tracksheet(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let memory = repl.engine.work().memory;
    let work = repl.engine.host().work();
    let sheet = sheet::track_sheet(repl.engine.show(), work);
    check_memory("the track sheet", sheet.bytes(), memory).map_err(engine::Error::from)?;
    table(repl, call, &|| sheet.table(), &|| sheet.words())
}

pub fn cuesheet(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let document = repl.engine.document();
    let sheet = sheet::cue_sheet(document.show(), document.timeline());
    table(repl, call, &|| Ok(sheet.clone()), &|| Ok(sheet.clone()))
}

/// A table in words, or into a file: Markdown, or `plain` as CSV.
fn table(
    repl: &Repl,
    call: &Call,
    table: &dyn Fn() -> Result<Table, Cancelled>,
    plain: &dyn Fn() -> Result<Table, Cancelled>,
) -> Result<Reply, Error> {
    let Some(path) = call.path("output") else {
        let table = table().map_err(engine::Error::from)?;
        return Ok(Reply::text(table.text(2, WIDTH)));
    };
    let written = format::table(table, plain, path)?;
    repl.written(path, written.as_bytes(), "")
}

pub fn explain(_: &mut Repl, call: &Call) -> Result<Reply, Error> {
    match call.words().as_slice() {
        [code] => Ok(Reply::text(report::explain::explain(code)?)),
        _ => usage("say which code: explain E012"),
    }
}

pub fn save(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let own = repl.engine.document().path().map(Path::to_owned);
    let path = match call.words.first() {
        Some(word) => PathBuf::from(word),
        None => own.ok_or(engine::Error::NoFile)?,
    };
    if repl.live.is_blind() {
        return Err(engine::Error::BlindEdits.into());
    }
    repl.engine.save(&path)?;
    Ok(Reply::text(format!("saved {}", path.display())))
}

pub fn quit(repl: &mut Repl, _: &Call) -> Result<Reply, Error> {
    if repl.engine.document().is_unsaved() && !repl.warned {
        repl.warned = true;
        let said = "the edits are not saved: `save`, or `quit` again to drop them";
        return Ok(Reply::text(said));
    }
    // What is being rendered in the background is given up with the engine.
    repl.engine.stop(true);
    Ok(Reply {
        quit: true,
        ..Reply::default()
    })
}
