//! The prompt: a line editor on a terminal, plain lines from anywhere else.

use std::io::{BufRead, BufReader, Read};

use rustyline::error::ReadlineError;
use rustyline::history::{DefaultHistory, History};
use rustyline::{CompletionType, Config, Editor};

use super::editor::{self, Reader};
use super::screen::Screen;
use super::{complain, print};
use crate::interpreter::{Error, Interpreter, LIMIT, finished};

/// Talks with a person until they leave; the exit code.
///
/// # Errors
/// [`Error::Device`] when the terminal cannot be used.
pub fn converse(interpreter: &mut Interpreter, screen: &Screen) -> Result<u8, Error> {
    let device = |e: ReadlineError| Error::Device(format!("the terminal: {e}"));
    let config = Config::builder()
        .completion_type(CompletionType::List)
        .build();
    let mut line_editor: Editor<Reader, DefaultHistory> =
        Editor::with_config(config).map_err(device)?;
    line_editor.set_helper(Some(Reader::new(screen.is_coloured())));
    let history = editor::history_file();
    for line in history.iter().flat_map(|file| editor::remembered(file)) {
        let _ = line_editor.add_history_entry(line);
    }
    let known = line_editor.history().len();
    print(&interpreter.greeting());
    let code = loop {
        if let Some(reader) = line_editor.helper_mut() {
            reader.vocabulary = interpreter.vocabulary();
        }
        let line = match line_editor.readline(&prompt(interpreter)) {
            Ok(line) => {
                // A full history only forgets; that is no reason to stop.
                let _ = line_editor.add_history_entry(line.as_str());
                line
            }
            Err(ReadlineError::Interrupted) => continue,
            Err(ReadlineError::Eof) => "quit".to_owned(),
            Err(error) => break Err(device(error)),
        };
        screen.rearm();
        if !each(interpreter, &line, screen) {
            break Ok(0);
        }
    };
    if let Some(file) = &history {
        editor::remember(file, line_editor.history(), known);
    }
    code
}

/// What stands before a line: that edits are blind, if they are.
fn prompt(interpreter: &Interpreter) -> String {
    match interpreter.is_blind() {
        true => "blind> ".to_owned(),
        false => "lxq> ".to_owned(),
    }
}

/// A declaration that is not finished after this many bytes never will be: reading on would look
/// through all of it again at every line.
const LONGEST: usize = 64 << 10;

/// Lines on their way to the interpreter; those of an unfinished declaration wait for the rest.
#[derive(Default)]
struct Pending {
    text: String,
    /// The worst exit code so far.
    worst: u8,
}

impl Pending {
    /// Takes a line and runs what it finishes; false to read no further.
    fn take(&mut self, line: &str, interpreter: &mut Interpreter, screen: &Screen) -> bool {
        self.text.push_str(line);
        if finished(&self.text) {
            return self.run(interpreter, screen);
        }
        self.text.push('\n');
        self.text.len() <= LONGEST
    }

    /// Runs what waits, finished or not; false to leave.
    fn run(&mut self, interpreter: &mut Interpreter, screen: &Screen) -> bool {
        match interpreter.execute(&std::mem::take(&mut self.text)) {
            Ok(reply) => screen.reply(&reply) && !reply.quit,
            Err(error) => {
                self.worst = self.worst.max(screen.fail(&error));
                true
            }
        }
    }
}

/// Runs what was entered, which is several lines when it was pasted; false to leave.
fn each(interpreter: &mut Interpreter, entered: &str, screen: &Screen) -> bool {
    let mut pending = Pending::default();
    for line in entered.lines() {
        if !pending.take(line, interpreter, screen) {
            // Nothing waits after a `quit`; what waits here is too long to be finished.
            return !pending.text.is_empty() && pending.run(interpreter, screen);
        }
    }
    pending.run(interpreter, screen)
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
    let mut pending = Pending::default();
    for line in BufReader::new(input.take(LIMIT)).split(b'\n') {
        let line = line.map_err(|e| Error::Device(format!("the input: {e}")))?;
        let line = String::from_utf8_lossy(&line);
        if !pending.take(line.trim_end_matches('\r'), interpreter, screen) {
            if pending.text.is_empty() {
                return Ok(pending.worst);
            }
            break;
        }
    }
    pending.run(interpreter, screen);
    if interpreter.unsaved() {
        complain("note: the edits were not saved; `save` writes them\n");
    }
    Ok(pending.worst)
}
