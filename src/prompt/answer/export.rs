//! Export of the show to other programs.

use std::collections::BTreeMap;

use clap::{Args, ValueHint};

use crate::argument::Output;
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_desk::{ExportError, qlc, usitt};
use footlight_engine as engine;
use footlight_report::{exchange, format};

/// The file to write.
#[derive(Args, Clone, Debug)]
pub struct ExportArgs {
    /// Print data instead of words
    #[arg(long)]
    json: bool,
    /// Write a .asc (USITT ASCII) or a .qxw (QLC+)
    #[arg(long, short, value_name = "FILE", value_hint = ValueHint::FilePath)]
    output: Output,
}

/// Writes the show in the format of the file's extension, and reports the losses.
pub fn export(repl: &mut Repl, asked: &ExportArgs) -> Result<Reply, Error> {
    let path = repl.output(&asked.output, &format::EXCHANGE)?;
    let document = repl.engine.document();
    let (show, timeline) = (document.show(), document.timeline());
    let write = match format::ending(path).as_str() {
        "qxw" => qlc::write,
        _ => usitt::write,
    };
    let work = repl.engine.host().work();
    let mut carried = write(show, timeline, work).map_err(|error| match error {
        ExportError::Cancelled(cancelled) => engine::Error::from(cancelled).into(),
        ExportError::Timeline(_) => Error::Usage(error.to_string()),
    })?;
    let lines: BTreeMap<String, Option<usize>> = show
        .cues
        .iter()
        .map(|cue| (cue.number.to_string(), document.line_of(cue.id)))
        .collect();
    for loss in &mut carried.losses {
        let cue = loss.cue.as_ref().and_then(|cue| lines.get(cue));
        loss.line = cue.copied().flatten();
    }
    let mut reply = repl.written(path, carried.text.as_bytes(), "")?;
    if asked.json {
        let wrote = [path.display().to_string()];
        let json = exchange::json(&wrote, &carried.losses, &[])?;
        Ok(Reply::text(footlight_show::printable::json(&json)))
    } else {
        reply.text.push(&exchange::describe(&carried.losses));
        Ok(reply)
    }
}
