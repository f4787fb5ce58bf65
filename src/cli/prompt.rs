//! The prompt: a line editor on a terminal, plain lines from anywhere else.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::{CompletionType, Config, Editor, ExternalPrinter};

use super::editor::{self, Reader};
use super::screen::Screen;
use super::{complain, print, signals};
use footlight_engine::{Background, TEXT_LIMIT};
use footlight_prompt::{Error, Repl, Vocabulary, finished};
use footlight_show::printable::Printable;

/// Events at the prompt.
pub enum Event {
    /// A line was entered, or the terminal failed.
    Line(Result<String, ReadlineError>),
    /// A background task ended.
    Finished,
}

/// Threads for background tasks.
pub struct Threads(Sender<Event>);

impl Threads {
    /// Creates threads that send to `wake` at each end.
    pub fn new(wake: Sender<Event>) -> Threads {
        Threads(wake)
    }
}

/// Reports the end of a task, even after a panic.
struct NotifyOnDrop(Sender<Event>);

impl Drop for NotifyOnDrop {
    fn drop(&mut self) {
        // The receiver is gone once the program leaves.
        let _ = self.0.send(Event::Finished);
    }
}

impl Background for Threads {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        let notify = NotifyOnDrop(self.0.clone());
        // Without a free thread the task is dropped, which counts as its end.
        let _ = thread::Builder::new().spawn(move || {
            let _notify = notify;
            task();
        });
    }
}

/// The line editor on another thread, so that the prompt can work while somebody types.
struct LineReader {
    ask: Sender<(Vocabulary, String)>,
    /// Prints above the current input line.
    printer: Option<Box<dyn ExternalPrinter + Send>>,
    thread: JoinHandle<()>,
}

impl LineReader {
    /// Starts the editor, which sends a line to `send` for each request.
    fn new(coloured: bool, send: Sender<Event>) -> Result<LineReader, ReadlineError> {
        let (ask, asked) = channel::<(Vocabulary, String)>();
        let (ready, begun) = channel();
        let thread = thread::Builder::new().spawn(move || {
            let mut line_editor = match line_editor(coloured) {
                Ok(line_editor) => line_editor,
                Err(error) => {
                    let _ = ready.send(Err(error));
                    return;
                }
            };
            let printer = line_editor.create_external_printer().ok();
            let printer = printer.map(|p| Box::new(p) as Box<dyn ExternalPrinter + Send>);
            let _ = ready.send(Ok(printer));
            type_lines(&mut line_editor, &asked, &send);
        })?;
        let printer = begun
            .recv()
            .map_err(|_| io::Error::other("the line editor broke off"))??;
        Ok(LineReader {
            ask,
            printer,
            thread,
        })
    }

    /// Asks for a line.
    fn ask(&self, repl: &Repl) {
        // After an error the editor has ended, and has sent it.
        let _ = self.ask.send((repl.vocabulary(), prompt(repl)));
    }

    /// Prints something above the current input line.
    fn tell(&mut self, notes: &[Printable]) {
        if notes.is_empty() {
            return;
        }
        let text: String = notes.iter().map(|note| format!("{note}\n")).collect();
        let printed = self.printer.as_mut().map(|p| p.print(text.clone()));
        if !matches!(printed, Some(Ok(()))) {
            print(text);
        }
    }
}

fn line_editor(coloured: bool) -> Result<Editor<Reader, DefaultHistory>, ReadlineError> {
    let config = Config::builder()
        .completion_type(CompletionType::List)
        .max_history_size(editor::REMEMBERED)?
        .build();
    let mut line_editor = Editor::with_config(config)?;
    line_editor.set_helper(Some(Reader::new(coloured)));
    Ok(line_editor)
}

/// Reads a line for each request.
fn type_lines(
    line_editor: &mut Editor<Reader, DefaultHistory>,
    asked: &Receiver<(Vocabulary, String)>,
    send: &Sender<Event>,
) {
    let history = editor::history_file();
    if let Some(file) = &history {
        // Without a file there are no lines yet; other errors are reported when it is written.
        let _ = line_editor.load_history(file);
    }
    for (vocabulary, prompt) in asked {
        if let Some(reader) = line_editor.helper_mut() {
            reader.vocabulary = vocabulary;
        }
        let line = line_editor.readline(&prompt);
        if let Ok(line) = &line {
            // If this fails, only history is lost.
            let _ = line_editor.add_history_entry(line.as_str());
        }
        if send.send(Event::Line(line)).is_err() {
            break;
        }
    }
    if let Some(Err(error)) = history.map(|file| remember(line_editor, &file)) {
        complain(format!("this session is not in the history: {error}\n"));
    }
}

/// Appends this session's lines to those of other sessions.
fn remember(
    line_editor: &mut Editor<Reader, DefaultHistory>,
    file: &Path,
) -> Result<(), ReadlineError> {
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    line_editor.append_history(file)
}

/// Runs an interactive session and returns its exit code.
pub fn converse(
    repl: &mut Repl,
    screen: &Screen,
    (wake, events): (Sender<Event>, &Receiver<Event>),
) -> Result<u8, Error> {
    let device = |e: ReadlineError| Error::Device(format!("the terminal: {e}"));
    signals::keep_terminal();
    let mut line_reader = LineReader::new(screen.is_coloured(), wake).map_err(device)?;
    print(repl.greeting());
    screen.stop().rearm();
    line_reader.ask(repl);
    let mut code = Ok(0);
    for event in events {
        let line = match event {
            Event::Finished => {
                line_reader.tell(&repl.poll());
                continue;
            }
            Event::Line(Ok(line)) => line,
            Event::Line(Err(ReadlineError::Interrupted)) => {
                line_reader.ask(repl);
                continue;
            }
            Event::Line(Err(ReadlineError::Eof)) => "quit".to_owned(),
            Event::Line(Err(error)) => {
                code = Err(device(error));
                break;
            }
        };
        screen.stop().rearm();
        if !each(repl, &line, screen) {
            break;
        }
        line_reader.ask(repl);
    }
    drop(line_reader.ask);
    // The thread writes the history before it ends.
    let _ = line_reader.thread.join();
    code
}

/// The prompt before a line, which shows blind edits.
fn prompt(repl: &Repl) -> String {
    if repl.live().is_blind() {
        "blind> ".to_owned()
    } else {
        "lxq> ".to_owned()
    }
}

/// Most bytes of a declaration: a longer one is never finished, and reading on would scan it again
/// at every line.
const LONGEST: usize = 64 << 10;

/// Lines for the prompt; an unfinished declaration waits for the rest.
#[derive(Default)]
struct Pending {
    text: String,
    /// The worst exit code so far.
    worst: u8,
}

impl Pending {
    /// Adds a line and runs it if it is complete; false to read no further.
    fn take(&mut self, line: &str, repl: &mut Repl, screen: &Screen) -> bool {
        self.text.push_str(line);
        if finished(&self.text) {
            return self.run(repl, screen);
        }
        self.text.push('\n');
        self.text.len() <= LONGEST
    }

    /// Runs the pending lines, finished or not; false to leave.
    fn run(&mut self, repl: &mut Repl, screen: &Screen) -> bool {
        match repl.execute(&std::mem::take(&mut self.text)) {
            Ok(reply) => {
                if reply.stopped {
                    self.worst = self.worst.max(screen.stop().code());
                }
                screen.reply(&reply) && !reply.quit
            }
            Err(error) => {
                self.worst = self.worst.max(screen.fail(&error));
                true
            }
        }
    }
}

/// Runs the entered lines, of which there are several after a paste; false to leave.
fn each(repl: &mut Repl, entered: &str, screen: &Screen) -> bool {
    let mut pending = Pending::default();
    for line in entered.lines() {
        if !pending.take(line, repl, screen) {
            // Nothing is pending after a `quit`; pending text here is too long to be finished.
            return !pending.text.is_empty() && pending.run(repl, screen);
        }
    }
    pending.run(repl, screen)
}

/// Runs all lines of `input`, continuing after errors; returns the worst exit code.
pub fn batch(repl: &mut Repl, input: impl Read, screen: &Screen) -> Result<u8, Error> {
    let mut pending = Pending::default();
    for line in BufReader::new(input.take(TEXT_LIMIT)).split(b'\n') {
        let line = line.map_err(|e| Error::Device(format!("the input: {e}")))?;
        let line = String::from_utf8_lossy(&line);
        if !pending.take(line.trim_end_matches('\r'), repl, screen) {
            if pending.text.is_empty() {
                return Ok(pending.worst);
            }
            break;
        }
    }
    pending.run(repl, screen);
    for note in repl.wait()? {
        print(format!("{note}\n"));
    }
    if repl.engine().document().is_unsaved() {
        complain("note: the edits were not saved; `save` writes them\n");
    }
    Ok(pending.worst)
}
