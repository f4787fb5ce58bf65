//! Edits of the show's text by verbs: delete, copy, rename.

use clap::Args;

use super::usage;
use crate::argument::{check_cue, number};
use crate::error::Error;
use crate::repl::{Repl, Reply};
use footlight_show::lang::edit::Edit;

/// The declaration to delete.
#[derive(Args, Clone, Debug)]
pub struct DeleteArgs {
    #[arg(value_name = "cue N | WORD NAME", required = true)]
    words: Vec<String>,
}

/// The cue to copy, and its new number.
#[derive(Args, Clone, Debug)]
pub struct CopyArgs {
    #[arg(value_name = "cue N to NUMBER", required = true)]
    words: Vec<String>,
}

/// The name to change, and the new one.
#[derive(Args, Clone, Debug)]
pub struct RenameArgs {
    #[arg(value_name = "NAME to NEW", required = true)]
    words: Vec<String>,
}

pub fn delete(repl: &mut Repl, asked: &DeleteArgs) -> Result<Reply, Error> {
    edited(repl, &Edit::Remove(asked.words.join(" ")))
}

pub fn copy(repl: &mut Repl, asked: &CopyArgs) -> Result<Reply, Error> {
    let [cue, from, to, copy] = asked.words.as_slice() else {
        return usage("say from and to: copy cue 5 to 7");
    };
    if (cue.as_str(), to.as_str()) != ("cue", "to") {
        return usage("say from and to: copy cue 5 to 7");
    }
    let from = number(from).map_err(Error::Usage)?;
    check_cue(&repl.engine, from)?;
    let to = number(copy).map_err(Error::Usage)?;
    edited(repl, &Edit::CopyCue { from, to })
}

pub fn rename(repl: &mut Repl, asked: &RenameArgs) -> Result<Reply, Error> {
    let words: Vec<&str> = asked.words.iter().map(String::as_str).collect();
    let (from, to) = match words[..] {
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
