//! `serve`: the live page, with messages on the terminal.

use std::path::Path;
use std::thread;

use super::screen::Screen;
use super::{complain, print};
use footlight_prompt::{Error, Repl};
use footlight_serve::{Operator, serve};
use footlight_show::printable::Printable;

impl Operator for Screen {
    fn tell(&self, text: Printable) {
        print(text);
    }

    fn fail(&self, error: &Error) {
        Screen::fail(self, error);
        complain("the last good show is kept\n");
    }

    fn is_over(&self) -> bool {
        self.stop().is_asked()
    }
}

/// Serves the page until a signal ends it.
pub fn page(
    show: &Path,
    port: u16,
    screen: &Screen,
    mut open: impl FnMut() -> Result<Repl, Error>,
) -> Result<u8, Error> {
    serve(show, port, &mut open, screen)?;
    // Only a signal ends it.
    Ok(screen.stop().code())
}

/// Starts background refinement. Without a free thread the task is dropped, which counts as its
/// end.
pub fn spawn(task: Box<dyn FnOnce() + Send>) {
    let _ = thread::Builder::new().spawn(task);
}
