//! The show's text and its declarations.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};

use super::usage;
use crate::argument::Output;
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_engine::{self as engine, StageMaterial, UnlitBank, Version};
use footlight_host::files::is_same;
use footlight_host::work::Cancelled;
use footlight_report::format::{self, DRAWING, TABLE, WIDTH};
use footlight_report::rig::{self, RigOrder};
use footlight_report::table::Table;
use footlight_report::versions::VersionComparison;
use footlight_report::words::count;
use footlight_report::{self as report, document};
use footlight_report::{sheet, stage};
use footlight_transport::contract::check_memory;

/// The declaration to print.
#[derive(Args, Clone, Debug)]
pub struct ShowArgs {
    #[arg(value_name = "NAME | cue N")]
    words: Vec<String>,
}

/// The view to use.
#[derive(Args, Clone, Debug)]
pub struct ViewArgs {
    #[arg(value_name = "VIEW")]
    view: Option<String>,
}

/// Options of `fmt`.
#[derive(Args, Clone, Debug)]
pub struct FmtArgs {
    /// Only say whether the layout is canonical
    #[arg(long)]
    check: bool,
}

/// The versions to compare.
#[derive(Args, Clone, Debug)]
pub struct DiffArgs {
    /// The older version (default: as read or saved)
    #[arg(value_name = "FILE")]
    old: Option<PathBuf>,
    /// Draw the changed curves as a .png or an .svg
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

/// The file for a table.
#[derive(Args, Clone, Debug)]
pub struct SheetArgs {
    /// Write a .md, .csv or .txt
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Option<Output>,
}

/// The code to explain.
#[derive(Args, Clone, Debug)]
pub struct ExplainArgs {
    #[arg(value_name = "CODE")]
    code: String,
}

/// The file to write.
#[derive(Args, Clone, Debug)]
pub struct SaveArgs {
    #[arg(value_name = "FILE")]
    path: Option<PathBuf>,
}

pub fn check(repl: &mut Repl) -> Result<Reply, Error> {
    let style = repl.console.style;
    let unlit = UnlitBank::find(&mut repl.engine);
    let setup = repl.engine.document().setup();
    let materials = setup.map_or(Vec::new(), |setup| StageMaterial::all(&setup.scene));
    let transparent = stage::transparent(&materials);
    let document = repl.engine.document();
    let text = document::check(document, unlit, &transparent, style);
    Ok(Reply::text(text))
}

pub fn show(repl: &mut Repl, asked: &ShowArgs) -> Result<Reply, Error> {
    let document = repl.engine.document();
    if asked.words.is_empty() {
        return Ok(Reply::text(document::listing(document)));
    }
    let name = asked.words.join(" ");
    let texts = document::declarations(document, &name);
    if texts.is_empty() {
        usage(format!("nothing in the show is called `{name}`"))
    } else {
        Ok(Reply::text(texts.join("\n")))
    }
}

pub fn view(repl: &mut Repl, asked: &ViewArgs) -> Result<Reply, Error> {
    if let Some(view) = &asked.view {
        repl.engine.look_from(view)?;
    }
    Ok(Reply::text(document::views(repl.engine.document())))
}

pub fn undo(repl: &mut Repl) -> Result<Reply, Error> {
    through_history(repl, true)
}

pub fn redo(repl: &mut Repl) -> Result<Reply, Error> {
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

pub fn fmt(repl: &mut Repl, asked: &FmtArgs) -> Result<Reply, Error> {
    let document = repl.engine.document();
    if asked.check {
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

/// Compares the text with the one last read or saved, or with a file.
pub fn diff(repl: &mut Repl, asked: &DiffArgs) -> Result<Reply, Error> {
    let output = repl.optional_output(asked.output.as_ref(), &DRAWING)?;
    let (document, host) = (repl.engine.document(), repl.engine.host());
    let (name, old) = match &asked.old {
        None => (
            "as saved".to_owned(),
            document.saved_text().as_bytes().to_vec(),
        ),
        Some(old) => {
            if let Some(output) = output.filter(|output| is_same(old, output)) {
                return Err(report::Error::ShowsFile(output.to_owned()).into());
            }
            let bytes = host.store.read(old, engine::TEXT_LIMIT)?;
            (old.display().to_string(), bytes)
        }
    };
    let files = host.files.as_ref();
    let old = Version::read(&name, &old, files)?;
    let new = Version::read(document.name(), document.text().as_bytes(), files)?;
    let compared = VersionComparison::new(old, new);
    let text = match compared.text() {
        text if text.is_empty() => "nothing changed".to_owned(),
        text => text,
    };
    match output {
        None => Ok(Reply::text(text)),
        Some(path) => repl.written(path, &compared.chart(path)?, &text),
    }
}

pub fn tracksheet(repl: &mut Repl, asked: &SheetArgs) -> Result<Reply, Error> {
    let memory = repl.engine.work().memory;
    let work = repl.engine.host().work();
    let sheet = sheet::track_sheet(repl.engine.show(), work);
    check_memory("the track sheet", sheet.bytes(), memory).map_err(engine::Error::from)?;
    table(repl, asked, &|| sheet.table(), &|| sheet.words())
}

pub fn cuesheet(repl: &mut Repl, asked: &SheetArgs) -> Result<Reply, Error> {
    let document = repl.engine.document();
    let sheet = sheet::cue_sheet(document.show(), document.timeline());
    table(repl, asked, &|| Ok(sheet.clone()), &|| Ok(sheet.clone()))
}

pub fn hookup(repl: &mut Repl, asked: &SheetArgs) -> Result<Reply, Error> {
    rig(repl, asked, RigOrder::Channel)
}

pub fn schedule(repl: &mut Repl, asked: &SheetArgs) -> Result<Reply, Error> {
    rig(repl, asked, RigOrder::Place)
}

fn rig(repl: &Repl, asked: &SheetArgs, order: RigOrder) -> Result<Reply, Error> {
    let lights = rig::table(repl.engine.document(), order);
    table(repl, asked, &|| Ok(lights.clone()), &|| Ok(lights.clone()))
}

/// A table in words, or in a file: Markdown, or `plain` as CSV.
fn table(
    repl: &Repl,
    asked: &SheetArgs,
    table: &dyn Fn() -> Result<Table, Cancelled>,
    plain: &dyn Fn() -> Result<Table, Cancelled>,
) -> Result<Reply, Error> {
    let Some(path) = repl.optional_output(asked.output.as_ref(), &TABLE)? else {
        let table = table().map_err(engine::Error::from)?;
        return Ok(Reply::text(table.text(2, WIDTH)));
    };
    let written = format::table(table, plain, path)?;
    repl.written(path, written.as_bytes(), "")
}

pub fn explain(asked: &ExplainArgs) -> Result<Reply, Error> {
    Ok(Reply::text(report::explain::explain(&asked.code)?))
}

pub fn save(repl: &mut Repl, asked: &SaveArgs) -> Result<Reply, Error> {
    let own = repl.engine.document().path().map(Path::to_owned);
    let path = asked.path.clone().or(own).ok_or(engine::Error::NoFile)?;
    if repl.live.is_blind() {
        return Err(engine::Error::BlindEdits.into());
    }
    repl.engine.save(&path)?;
    Ok(Reply::text(format!("saved {}", path.display())))
}

pub fn quit(repl: &mut Repl) -> Result<Reply, Error> {
    if repl.engine.document().is_unsaved() && !repl.warned {
        repl.warned = true;
        let said = "the edits are not saved: `save`, or `quit` again to drop them";
        return Ok(Reply::text(said));
    }
    // Rendering in the background ends with the engine.
    repl.engine.stop(true);
    Ok(Reply {
        quit: true,
        ..Reply::default()
    })
}
