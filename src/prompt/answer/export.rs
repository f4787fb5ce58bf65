//! The show for another program.

use std::collections::BTreeMap;

use super::usage;
use crate::{Call, Error, Repl, Reply};
use footlight_desk::{ExportError, qlc, usitt};
use footlight_engine as engine;
use footlight_report::{exchange, format};

/// Writes the show as the file's ending says, and reports what is not in it.
pub fn export(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let Some(path) = call.output(&format::EXCHANGE)? else {
        return usage("say a file: export -o show.asc");
    };
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
    if call.has("json") {
        let wrote = [path.display().to_string()];
        let json = exchange::json(&wrote, &carried.losses, &[])?;
        Ok(Reply::text(footlight_show::printable::json(&json)))
    } else {
        reply.text.push(&exchange::describe(&carried.losses));
        Ok(reply)
    }
}
