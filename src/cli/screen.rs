//! Output for a person: replies, errors, progress bars.

use std::io::{self, IsTerminal};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::drawing::{Drawing, InPlace};
use super::stop::{INTERRUPTED, Stop};
use super::{complain, draw, print};
use footlight_host::work::Progress;
use footlight_prompt::{Error, Reply};
use footlight_report::film::Canvas;
use footlight_show::diagnostic::Style;
use footlight_show::printable::visible;

/// Time between lines of progress in a log.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// The terminal.
#[derive(Clone, Debug)]
pub struct Screen {
    bars: Arc<Bars>,
    format: Style,
    /// True when standard output is a terminal with colours.
    coloured: bool,
    /// Drawing method for standard output, if any.
    drawing: Option<Drawing>,
    /// True when standard error is a terminal with colours.
    errors_coloured: bool,
}

impl Screen {
    /// The process's own terminal; `quiet` hides progress bars and images, `format` is the style of
    /// diagnostics, `kitty` enables Kitty's protocol.
    pub fn new(quiet: bool, format: Style, kitty: bool) -> Screen {
        let bars = Arc::new(Bars {
            bar: Mutex::new(None),
            stop: Stop::default(),
            last_line: Mutex::new(Instant::now()),
            quiet,
            is_terminal: io::stderr().is_terminal(),
        });
        let colours = colours();
        Screen {
            bars,
            format,
            coloured: colours && io::stdout().is_terminal(),
            drawing: if kitty {
                Some(Drawing::Kitty)
            } else {
                colours.then_some(Drawing::Blocks)
            }
            .filter(|_| !quiet && io::stdout().is_terminal()),
            errors_coloured: colours && io::stderr().is_terminal(),
        }
    }

    /// True when replies may have colours.
    pub fn is_coloured(&self) -> bool {
        self.coloured
    }

    /// Style of diagnostics in replies.
    pub fn style(&self) -> Style {
        styled(self.format, self.coloured)
    }

    /// Progress bars on standard error, and cancellation by signals.
    pub fn progress(&self) -> Box<dyn Progress> {
        Box::new(Arc::clone(&self.bars))
    }

    /// The received signals.
    pub fn stop(&self) -> &Stop {
        &self.bars.stop
    }

    /// The canvas for `play`, if any.
    pub fn canvas(&self) -> Option<Box<dyn Canvas>> {
        let bars = Arc::clone(&self.bars);
        let clear = Box::new(move || bars.clear());
        Some(Box::new(InPlace::new(self.drawing?, clear)))
    }

    /// Shows a reply: its image if there is a terminal, then its text. False once standard output
    /// is closed.
    pub fn reply(&self, reply: &Reply) -> bool {
        self.bars.clear();
        if let (Some(picture), Some(drawing)) = (&reply.picture, self.drawing) {
            draw(&drawing.draw(picture));
        }
        for note in &reply.notes {
            complain(format!("note: {note}\n"));
        }
        if reply.beside {
            complain(&reply.text);
            return true;
        }
        print(&reply.text)
    }

    /// Shows an error and returns its exit code.
    pub fn fail(&self, error: &Error) -> u8 {
        self.bars.clear();
        if self.format.is_for_people() {
            complain(error.report(styled(self.format, self.errors_coloured)));
        } else {
            // Their readers expect warnings and errors in one place.
            print(error.report(self.format));
        }
        match error.exit_code() {
            INTERRUPTED => self.stop().code(),
            code => code,
        }
    }
}

fn styled(format: Style, coloured: bool) -> Style {
    match format {
        Style::Plain if coloured => Style::Colour,
        other => other,
    }
}

/// False if <https://no-color.org> or a terminal without colours forbids them.
fn colours() -> bool {
    let none = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let dumb = std::env::var_os("TERM").is_some_and(|t| t == "dumb");
    !none && !dumb
}

/// The current progress bar, and the received signals.
#[derive(Debug)]
struct Bars {
    bar: Mutex<Option<(String, ProgressBar)>>,
    stop: Stop,
    /// The time of the last line of progress, where standard error is not a terminal.
    last_line: Mutex<Instant>,
    quiet: bool,
    /// True when standard error is a terminal.
    is_terminal: bool,
}

impl Bars {
    fn clear(&self) {
        let mut held = self.bar.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, bar)) = held.take() {
            bar.finish_and_clear();
        }
    }

    /// Says in a line what is done, at times.
    fn line(&self, task: &str, done: usize, total: usize) {
        let mut last = self
            .last_line
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= BETWEEN_LINES {
            *last = Instant::now();
            complain(format!("{}: {done} of {total}\n", visible(task)));
        }
    }
}

impl Progress for Bars {
    fn report(&self, task: &str, done: usize, total: usize) {
        if self.quiet {
            return;
        }
        if !self.is_terminal {
            return self.line(task, done, total);
        }
        let mut held = self.bar.lock().unwrap_or_else(PoisonError::into_inner);
        let same = held.as_ref().is_some_and(|(name, _)| name == task);
        if !same {
            if let Some((_, bar)) = held.take() {
                bar.finish_and_clear();
            }
            *held = Some((task.to_owned(), new_bar(task, total)));
        }
        if let Some((_, bar)) = held.as_ref() {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        }
    }

    fn cancelled(&self) -> bool {
        self.stop.is_asked()
    }
}

fn new_bar(task: &str, total: usize) -> ProgressBar {
    let bar =
        ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr_with_hz(12));
    let style = ProgressStyle::with_template("{msg:28} {bar:32} {pos}/{len}  {elapsed}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.set_message(visible(task).into_owned());
    bar
}
