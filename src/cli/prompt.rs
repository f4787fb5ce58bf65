//! The prompt: a line editor on a terminal, plain lines from anywhere else.

use std::io::{BufRead, BufReader, Read};

use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::validate::{ValidationContext, ValidationResult, Validator};
use rustyline::{Completer, Editor, Helper, Highlighter, Hinter};

use super::screen::Screen;
use super::{complain, print};
use crate::interpreter::{Error, Interpreter, LIMIT, finished};

/// Asks for a line again while a declaration in it is not finished.
#[derive(Completer, Helper, Highlighter, Hinter)]
struct Reader;

impl Validator for Reader {
    fn validate(&self, context: &mut ValidationContext<'_>) -> rustyline::Result<ValidationResult> {
        Ok(if finished(context.input()) {
            ValidationResult::Valid(None)
        } else {
            ValidationResult::Incomplete
        })
    }
}

/// Talks with a person until they leave; the exit code.
///
/// # Errors
/// [`Error::Device`] when the terminal cannot be used.
pub fn converse(interpreter: &mut Interpreter, screen: &Screen) -> Result<u8, Error> {
    let device = |e: ReadlineError| Error::Device(format!("the terminal: {e}"));
    let mut editor: Editor<Reader, DefaultHistory> = Editor::new().map_err(device)?;
    editor.set_helper(Some(Reader));
    print(&interpreter.greeting());
    loop {
        let line = match editor.readline("lxq> ") {
            Ok(line) => line,
            Err(ReadlineError::Interrupted) => continue,
            Err(ReadlineError::Eof) => "quit".to_owned(),
            Err(error) => return Err(device(error)),
        };
        // A full history only forgets; that is no reason to stop.
        let _ = editor.add_history_entry(line.as_str());
        screen.rearm();
        if !each(interpreter, &line, screen) {
            return Ok(0);
        }
    }
}

/// Runs what was entered, which is several lines when it was pasted; false to leave.
fn each(interpreter: &mut Interpreter, entered: &str, screen: &Screen) -> bool {
    let mut pending = String::new();
    let mut lines = entered.lines().peekable();
    while let Some(line) = lines.next() {
        pending.push_str(line);
        if !finished(&pending) && lines.peek().is_some() {
            pending.push('\n');
            continue;
        }
        match interpreter.execute(&std::mem::take(&mut pending)) {
            Ok(reply) => {
                if !screen.reply(&reply) || reply.quit {
                    return false;
                }
            }
            Err(error) => {
                screen.fail(&error);
            }
        }
    }
    true
}

/// Runs the lines of `input` to their end, going on after mistakes; the exit code is the worst of
/// theirs.
///
/// # Errors
/// [`Error::Device`] when the input cannot be read.
pub fn batch(
    interpreter: &mut Interpreter,
    input: impl Read,
    screen: &Screen,
) -> Result<u8, Error> {
    let mut lines = BufReader::new(input.take(LIMIT)).split(b'\n');
    let mut worst = 0;
    let mut pending = String::new();
    loop {
        let line = match lines.next() {
            None if pending.is_empty() => break,
            None => None,
            Some(line) => {
                let bytes = line.map_err(|e| Error::Device(format!("the input: {e}")))?;
                Some(String::from_utf8_lossy(&bytes).into_owned())
            }
        };
        let last = line.is_none();
        if let Some(line) = line {
            pending.push_str(line.trim_end_matches('\r'));
            if !finished(&pending) {
                pending.push('\n');
                continue;
            }
        }
        match interpreter.execute(&std::mem::take(&mut pending)) {
            Ok(reply) => {
                if !screen.reply(&reply) || reply.quit {
                    return Ok(worst);
                }
            }
            Err(error) => worst = worst.max(screen.fail(&error)),
        }
        if last {
            break;
        }
    }
    if interpreter.unsaved() {
        complain("note: the edits were not saved; `save` writes them\n");
    }
    Ok(worst)
}
