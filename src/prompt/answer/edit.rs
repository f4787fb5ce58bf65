//! Edits of the show's text by verbs: delete, copy, rename.

use super::usage;
use crate::argument::cue;
use crate::{Call, Error, Repl, Reply};
use footlight_show::lang::edit::Edit;
use footlight_show::units::CueNumber;

pub fn delete(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    match call.words().as_slice() {
        [] => usage("say what: delete cue 5, delete look night"),
        words => edited(repl, &Edit::Remove(words.join(" "))),
    }
}

pub fn copy(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let ["cue", from, "to", to] = call.words()[..] else {
        return usage("say from and to: copy cue 5 to 7");
    };
    let from = cue(&repl.engine, from)?;
    let number = CueNumber::parse(to);
    let to = number.ok_or_else(|| {
        Error::Usage(format!("`{to}` is not a cue number; write it as 12 or 2.5"))
    })?;
    edited(repl, &Edit::CopyCue { from, to })
}

pub fn rename(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let (from, to) = match call.words()[..] {
        [from, to] | [from, "to", to] => (from.to_owned(), to.to_owned()),
        _ => return usage("say both names: rename lamps to practicals"),
    };
    edited(repl, &Edit::Rename { from, to })
}

fn edited(repl: &mut Repl, edit: &Edit) -> Result<Reply, Error> {
    let before = repl.engine.estimate().refined();
    let edited = repl.engine.edit(edit)?;
    Ok(Reply::text(repl.describe_edit(&edited, before)))
}
