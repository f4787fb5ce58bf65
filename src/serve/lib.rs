//! The live page: serves a show to the browsers of this machine, from the file as it is edited.
//!
//! ```text
//! file --saves--> Repl --publisher--> audience --http--> pages
//!                   ^---- goes, levels ------------------'
//! ```
//!
//! [`serve`] runs the service until its [`Operator`] ends it.
//!
//! Invariants:
//!
//! - It listens on loopback only; every request needs one of two random tokens in its address, and
//!   requests from foreign pages are refused. Only the first token's pages run the show.
//! - The memory that a client can use is bounded.
//! - One thread reads the show and publishes it, one more serves each connection; images are
//!   refined in the background.
//!
//! This crate does not know the language or the player: the page's own script plays the show from
//! the data and images that it gets.

mod audience;
mod http;
mod publisher;

use std::net::{Ipv4Addr, TcpListener};
use std::path::Path;
use std::sync::Arc;

use self::audience::{Audience, Token};
use self::publisher::Publisher;
use footlight_engine::{self as engine, Goal};
use footlight_prompt::saves::{PAUSE, Poll, Saves};
use footlight_prompt::{Error, Repl};
use footlight_show::diagnostic::Style;
use footlight_show::printable::{Printable, visible};

/// Receives reports, and ends the service.
pub trait Operator {
    /// Reports a message for people.
    fn tell(&self, text: Printable);

    /// Reports an error of the show.
    fn fail(&self, error: &Error);

    /// True once the service should end.
    fn is_over(&self) -> bool;
}

/// Serves the show at `path`, opened by `open`, on a port of this machine (0: any free one), until
/// the operator ends it. After an error in the show, the page keeps the last good version.
///
/// # Errors
/// When the show's file cannot be read, or the port is in use.
pub fn serve(
    path: &Path,
    port: u16,
    open: &mut dyn FnMut() -> Result<Repl, Error>,
    operator: &dyn Operator,
) -> Result<(), Error> {
    let saves = Saves::new(path)?;
    let device = |error: std::io::Error| {
        let words = format!("port {port}: {error}; without `--port` one that is free is taken");
        Error::Device(words)
    };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(device)?;
    let port = listener.local_addr().map_err(device)?.port();
    let title = visible(&path.display().to_string()).into_owned();
    let audience = Arc::new(Audience::new(&title, port, [Token::new()?, Token::new()?]));
    http::listen(listener, &audience);
    let [run, watch] = audience.addresses();
    operator.tell(
        format!(
            "serving {} on this machine; Ctrl-C ends it\nto run it:   {run}\nto watch it: {watch}\n",
            path.display()
        )
        .into(),
    );
    Served {
        path,
        saves,
        show: None,
        publisher: Publisher::new(audience),
        operator,
    }
    .go_on(open)
}

/// A show being served.
struct Served<'a> {
    path: &'a Path,
    saves: Saves,
    show: Option<Repl>,
    publisher: Publisher,
    operator: &'a dyn Operator,
}

impl Served<'_> {
    fn go_on(mut self, open: &mut dyn FnMut() -> Result<Repl, Error>) -> Result<(), Error> {
        let opened = self.open(open);
        self.judge(opened)?;
        while !self.operator.is_over() {
            std::thread::sleep(PAUSE);
            match self.saves.look(self.show.as_ref()) {
                Poll::Same => {}
                Poll::Away => {
                    let away = self.saves.away();
                    self.publisher.wrong(&away);
                    self.operator.tell(format!("{away}\n").into());
                }
                Poll::Saved { text, is_new } => {
                    let taken = match self.show {
                        Some(_) => self.reload(&text),
                        None => self.open(open),
                    };
                    if is_new || taken.is_ok() {
                        self.judge(taken)?;
                    }
                }
            }
            self.refine()?;
        }
        Ok(())
    }

    /// Opens the show as soon as that succeeds.
    fn open(&mut self, open: &mut dyn FnMut() -> Result<Repl, Error>) -> Result<(), Error> {
        let show = open()?;
        self.saves.follow(&show);
        self.show = Some(show);
        Ok(())
    }

    /// Loads a new text.
    fn reload(&mut self, text: &[u8]) -> Result<(), Error> {
        let Some(show) = &mut self.show else {
            return Ok(());
        };
        let text = engine::decode(&self.path.display().to_string(), text)?;
        let reloaded = show.reload(&text);
        self.saves.follow(show);
        self.operator.tell(reloaded?.reply.text);
        Ok(())
    }

    /// Reports the result of an edit, on the page as well. An error that another edit can fix does
    /// not end the service.
    fn judge(&mut self, taken: Result<(), Error>) -> Result<(), Error> {
        let taken = taken.and_then(|()| match &mut self.show {
            Some(show) => begin(show),
            None => Ok(()),
        });
        match taken {
            Ok(()) => {
                self.publisher.wrong("");
                self.publisher.expire();
            }
            Err(_) if self.operator.is_over() => {}
            Err(error) if error.is_of_input() => {
                self.publisher.wrong(&error.report(Style::Plain));
                self.operator.fail(&error);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Takes newly rendered images, and publishes them.
    fn refine(&mut self) -> Result<(), Error> {
        let Some(show) = &mut self.show else {
            return Ok(());
        };
        let mut failed = None;
        for event in show.engine_mut().poll() {
            if let engine::Event::RefinementEnded {
                failed: Some(error),
                ..
            } = event
            {
                failed = Some(Error::from(error));
            }
        }
        let published = match failed {
            Some(error) => Err(error),
            None => self.publisher.publish(show.engine_mut()),
        };
        match published {
            Err(error) => self.judge(Err(error)),
            Ok(()) => Ok(()),
        }
    }
}

/// Refines a show in the background, to its own tolerance.
fn begin(show: &mut Repl) -> Result<(), Error> {
    let engine = show.engine_mut();
    if engine.is_busy() {
        return Ok(());
    }
    let goal = Goal::until(engine.show().preview.tolerance);
    Ok(engine.start(goal)?)
}
