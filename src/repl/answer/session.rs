//! A design session from a file, measured as it goes.

use std::path::Path;

use super::usage;
use crate::chart::Theme;
use crate::engine::session::{Command, Measured};
use crate::engine::{self, Session, TEXT_LIMIT};
use crate::lang;
use crate::repl::argument::goal;
use crate::repl::{Call, Error, Repl, Reply, finished};
use crate::report;
use crate::report::format::RECORD;

pub fn session(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let [path] = call.words.as_slice() else {
        return usage(
            "say which file holds the commands: session FILE, with edits and `refine` lines",
        );
    };
    let output = call.output(&RECORD)?;
    replayed(
        repl,
        Path::new(path),
        call.has("truth"),
        (output, Theme::Light),
    )
}

/// Replays a file and hands over what was measured. What is finished is kept and written even where
/// a later line is wrong.
pub fn replayed(
    repl: &mut Repl,
    path: &Path,
    truth: bool,
    to: (Option<&Path>, Theme),
) -> Result<Reply, Error> {
    let bytes = repl.engine.host().store.read(path, TEXT_LIMIT)?;
    let text = String::from_utf8(bytes).map_err(|_| engine::Error::NotText(path.to_owned()))?;
    let mut session = Session::begin(&mut repl.engine, truth)?;
    let mut failed = None;
    for command in commands(&text) {
        let line = command.line;
        if let Err(cause) = run(repl, &mut session, command) {
            failed = Some((line, cause));
            break;
        }
    }
    let measured = session.end(&mut repl.engine);
    let reply = reply(repl, &measured, to)?;
    match failed {
        None => Ok(reply),
        Some((line, cause)) => Err(Error::Session {
            path: path.display().to_string(),
            line,
            cause: Box::new(cause),
            before: reply.text,
        }),
    }
}

fn run(repl: &mut Repl, session: &mut Session, mut command: Command) -> Result<(), Error> {
    if !lang::is_declaration(&command.text) {
        let call = Call::parse(without_comment(&command.text))?;
        if call.verb.name != "refine" {
            let text = command.text.trim();
            return usage(format!(
                "a session holds declarations and `refine`; `{text}` is neither"
            ));
        }
        command.goal = Some(goal(&call)?);
    }
    Ok(session.run(&mut repl.engine, &command)?)
}

fn reply(repl: &Repl, session: &Measured, to: (Option<&Path>, Theme)) -> Result<Reply, Error> {
    let text = report::session::describe(session);
    let record = || report::session::record(session);
    let drawing = |theme| report::session::drawing(session, theme);
    repl.deliver(text, &record, &drawing, to)
}

/// A verb's line without what stands behind `//`.
fn without_comment(text: &str) -> &str {
    text.split_once("//").map_or(text, |(words, _)| words)
}

/// The commands with the lines where they begin; declarations go on until they are finished, blank
/// lines and comments are left out.
fn commands(text: &str) -> Vec<Command> {
    let mut out: Vec<Command> = Vec::new();
    let mut open = false;
    for (i, line) in text.lines().enumerate() {
        match out.last_mut().filter(|_| open) {
            Some(last) => {
                last.text.push('\n');
                last.text.push_str(line);
            }
            None if line.trim().is_empty() || line.trim_start().starts_with("//") => continue,
            None => out.push(Command {
                line: i + 1,
                text: line.to_owned(),
                goal: None,
            }),
        }
        open = out.last().is_some_and(|last| !finished(&last.text));
    }
    out
}
