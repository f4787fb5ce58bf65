//! A design session from a file, measured as it goes.

use std::path::Path;

use super::usage;
use crate::chart::Theme;
use crate::engine::{self, Command, Session, TEXT_LIMIT};
use crate::lang;
use crate::repl::argument::goal;
use crate::repl::{Call, Error, Repl, Reply, finished};
use crate::report;
use crate::report::format::RECORD;
use crate::study::session as study;

/// A command of the file.
struct Line {
    /// Where it begins, from 1.
    number: usize,
    text: String,
}

pub fn session(repl: &mut Repl, call: &Call) -> Result<Reply, Error> {
    let [path] = call.words.as_slice() else {
        return usage(
            "say which file holds the commands: session FILE, with edits and `refine` lines",
        );
    };
    let output = call.option("output").map(Path::new);
    if let Some(path) = output {
        RECORD.check(path)?;
    }
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
    for line in lines(&text) {
        if let Err(cause) = run(repl, &mut session, &line) {
            failed = Some((line.number, cause));
            break;
        }
    }
    let moments = session.end(&mut repl.engine);
    let reply = reply(repl, moments, truth, to)?;
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

fn run(repl: &mut Repl, session: &mut Session, line: &Line) -> Result<(), Error> {
    let first = line.text.lines().next().unwrap_or_default().trim();
    let command = if lang::is_declaration(&line.text) {
        Command::Edit(line.text.clone())
    } else {
        let call = Call::parse(without_comment(&line.text))?;
        if call.verb.name != "refine" {
            return Err(Error::Usage(format!(
                "a session holds declarations and `refine`; `{first}` is neither"
            )));
        }
        Command::Refine(goal(&call)?)
    };
    let said = study::Command {
        line: line.number,
        text: first.to_owned(),
    };
    Ok(session.run(&mut repl.engine, &command, said)?)
}

fn reply(
    repl: &Repl,
    moments: Vec<study::Moment>,
    truth: bool,
    to: (Option<&Path>, Theme),
) -> Result<Reply, Error> {
    let session = study::Session {
        origin: repl.engine.origin(),
        truth: truth.then(|| repl.engine.refined_step().0),
        metric: repl.engine.metric(),
        moments,
    };
    let text = report::session::describe(&session);
    let record = || report::session::record(&session);
    let drawing = |theme| report::session::drawing(&session, theme);
    repl.deliver(text, &record, &drawing, to)
}

/// A verb's line without what stands behind `//`.
fn without_comment(text: &str) -> &str {
    text.split_once("//").map_or(text, |(words, _)| words)
}

/// The commands with the lines where they begin; declarations go on until they are finished, blank
/// lines and comments are left out.
fn lines(text: &str) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    let mut open = false;
    for (i, line) in text.lines().enumerate() {
        match out.last_mut().filter(|_| open) {
            Some(last) => {
                last.text.push('\n');
                last.text.push_str(line);
            }
            None if line.trim().is_empty() || line.trim_start().starts_with("//") => continue,
            None => out.push(Line {
                number: i + 1,
                text: line.to_owned(),
            }),
        }
        open = out.last().is_some_and(|last| !finished(&last.text));
    }
    out
}
