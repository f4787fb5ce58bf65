//! The live page: a show served to the browsers of this machine, from the file as it is edited.
//!
//! Invariants: it listens on loopback alone; nothing is answered without one of two random tokens in
//! the address, and nothing to a page from elsewhere; only the first token's pages run the show. All
//! that a client can make it hold is bounded. One thread reads the show and publishes it, one more
//! serves each connection; images are refined in the background meanwhile.

mod audience;
mod http;
mod publisher;

use std::net::{Ipv4Addr, TcpListener};
use std::path::Path;
use std::sync::Arc;

use self::audience::{Audience, Token};
use self::publisher::Publisher;
use footlight_engine::{self as engine, Goal};
use footlight_prompt::saves::{Look, PAUSE, Saves};
use footlight_prompt::{Error, Repl};
use footlight_show::diagnostic::Style;
use footlight_show::printable::{Printable, visible};

/// Who is told what happens, and says when it is over.
pub trait Operator {
    /// Words for a person.
    fn tell(&self, text: Printable);

    /// What is wrong with the show.
    fn fail(&self, error: &Error);

    /// True once nothing is to be served any more.
    fn is_over(&self) -> bool;
}

/// Serves the show at `path`, opened by `open`, on a port of this machine (0: any that is free), until
/// the operator says that it is over. An error in the show leaves the last good one on the page.
///
/// # Errors
/// Where the show's file cannot be read, or the port is taken.
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

/// A show that is being served.
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
                Look::Same => {}
                Look::Away => {
                    let away = self.saves.away();
                    self.publisher.wrong(&away);
                    self.operator.tell(format!("{away}\n").into());
                }
                Look::Saved { text, is_new } => {
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

    /// Opens the show for the first time that it can be.
    fn open(&mut self, open: &mut dyn FnMut() -> Result<Repl, Error>) -> Result<(), Error> {
        let show = open()?;
        self.saves.follow(&show);
        self.show = Some(show);
        Ok(())
    }

    /// Takes a new text.
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

    /// Says what an edit came to, on the page as well. An error that another edit can mend is none of
    /// the program.
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

    /// Takes in what was rendered meanwhile, and shows it.
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

/// Refines a show in the background, to the error that it asks for itself.
fn begin(show: &mut Repl) -> Result<(), Error> {
    let engine = show.engine_mut();
    if engine.is_busy() {
        return Ok(());
    }
    let goal = Goal::until(engine.show().preview.tolerance);
    Ok(engine.start(goal)?)
}
