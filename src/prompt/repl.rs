//! The state of a prompt: its engine, the current moment, and the warnings already reported.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;

use super::Error;
use super::argument::Output;
use footlight_engine::{Edited, Engine, LiveControl};
use footlight_report::chart::Drawing;
use footlight_report::farm::Farm;
use footlight_report::film::{Canvas, Outlets, Shown};
use footlight_report::format::Formats;
use footlight_report::sheet::{self, ShowDifference};
use footlight_report::{self as report, document, refine, versions};
use footlight_show::diagnostic::Style;
use footlight_show::lang::edit::Edit;
use footlight_show::printable::{self, Printable};

/// Services of the embedding program for a prompt.
pub struct Console {
    /// Style of diagnostics in replies.
    pub style: Style,
    /// Target of `-o -`, such as standard output, and the film encoder.
    pub outlets: Outlets,
    /// Shows frames during `play`; without it `play` only reports its speed.
    pub canvas: Option<Box<dyn Canvas>>,
    /// Renders images for `--farm`; without it the option is refused.
    pub farm: Option<Box<dyn Farm>>,
}

impl Default for Console {
    /// Plain text, no outlets, no canvas, no farm.
    fn default() -> Console {
        Console {
            style: Style::Plain,
            outlets: Outlets::default(),
            canvas: None,
            farm: None,
        }
    }
}

/// The answer of a verb.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reply {
    /// The message; ends in a newline unless empty.
    pub text: Printable,
    /// An image to show with it.
    pub picture: Option<Shown>,
    /// Warnings not given before, one line each.
    pub notes: Vec<Printable>,
    /// True when the user wants to leave.
    pub quit: bool,
    /// True when standard output carries a file, so that the message goes elsewhere.
    pub beside: bool,
    /// True when the user stopped the verb early; the reply reports what was done.
    pub stopped: bool,
}

impl Reply {
    /// A reply of data.
    pub(super) fn json(data: &impl Serialize) -> Result<Reply, Error> {
        let text = serde_json::to_string_pretty(data).map_err(report::Error::from)?;
        Ok(Reply::text(printable::json(&text)))
    }

    /// A drawing with a message.
    pub(super) fn drawn(drawing: &Drawing, text: String) -> Result<Reply, Error> {
        let (width, height, rgb) = drawing.rgb8().map_err(report::Error::from)?;
        let size = (width, height);
        Ok(Reply::pictured(Shown { size, rgb }, text))
    }

    /// An image with a message.
    pub(super) fn pictured(picture: Shown, text: String) -> Reply {
        Reply {
            picture: Some(picture),
            ..Reply::text(text)
        }
    }

    pub(super) fn text(text: impl Into<Printable>) -> Reply {
        let mut text = text.into();
        if !text.is_empty() && !text.ends_with('\n') {
            text.push("\n");
        }
        Reply {
            text,
            ..Reply::default()
        }
    }
}

/// Result of loading another text.
#[derive(Debug)]
pub struct Reloaded {
    /// The changes, described for a designer.
    pub reply: Reply,
    /// The changes as data.
    pub difference: ShowDifference,
}

/// A prompt: an engine, the current moment, and the warnings already reported.
///
/// ```
/// use footlight_engine::{Engine, Host};
/// use footlight_prompt::{Console, Repl};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let show = b"show \"S\"\nlight x spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\nbank a = x\n\
///     cue 1 at 0:00 { snap  a 50 }\n";
/// let mut repl = Repl::new(
///     Engine::from_text("s.lxq", show, Host::default())?,
///     Console::default(),
/// );
/// assert!(repl.execute("at 0")?.text.contains("50.0"));
/// # Ok(())
/// # }
/// ```
pub struct Repl {
    pub(super) engine: Engine,
    pub(super) live: LiveControl,
    pub(super) console: Console,
    /// The words that requested the refinement in the background.
    pub(super) refining: String,
    /// True after the user tried to leave with unsaved edits and was warned.
    pub(super) warned: bool,
    /// Warnings already given.
    reported: BTreeSet<Printable>,
    /// Messages for the next reply.
    pub(super) unheard: Vec<Printable>,
}

impl std::fmt::Debug for Repl {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.engine.fmt(f)
    }
}

impl From<Engine> for Repl {
    /// A prompt in plain text, without outlets and canvas.
    fn from(engine: Engine) -> Repl {
        Repl::new(engine, Console::default())
    }
}

impl Repl {
    /// A prompt for an engine.
    pub fn new(engine: Engine, console: Console) -> Repl {
        Repl {
            live: LiveControl::new(engine.document()),
            engine,
            console,
            refining: String::new(),
            warned: false,
            reported: BTreeSet::new(),
            unheard: Vec::new(),
        }
    }

    /// The engine.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The engine for direct calls; edits of its text take effect in the prompt with the next line.
    pub fn engine_mut(&mut self) -> &mut Engine {
        &mut self.engine
    }

    /// The current moment and the trial levels.
    pub fn live(&self) -> &LiveControl {
        &self.live
    }

    /// Runs a request. Messages about ended background work come first, or with the next reply if
    /// there is none now.
    pub(super) fn serve(
        &mut self,
        something: impl FnOnce(&mut Repl) -> Result<Reply, Error>,
    ) -> Result<Reply, Error> {
        let notes = self.poll();
        self.unheard.extend(notes);
        self.live.follow(self.engine.document());
        let done = something(self);
        self.live.follow(self.engine.document());
        let events = self.poll();
        self.unheard.extend(events);
        let mut reply = done.map_err(|error| error.busy(self.background()))?;
        let mut notes = std::mem::take(&mut self.unheard);
        notes.append(&mut reply.notes);
        Ok(Reply { notes, ..reply })
    }

    /// Takes finished background images, starts the next ones, and returns messages to report.
    /// Cheap while nothing is finished; every verb calls it first.
    pub fn poll(&mut self) -> Vec<Printable> {
        let events = self.engine.poll();
        let words = self.background();
        events
            .iter()
            .flat_map(|event| refine::event(event, words))
            .map(Printable::from)
            .collect()
    }

    /// The words that requested the refinement in the background.
    pub(super) fn background(&self) -> &str {
        match self.refining.as_str() {
            "" => "refine &",
            words => words,
        }
    }

    /// Waits until the refinement in the background has ended, and returns messages to report.
    ///
    /// # Errors
    /// As [`Engine::wait`]; the refinement then continues.
    pub fn wait(&mut self) -> Result<Vec<Printable>, Error> {
        self.engine.wait()?;
        Ok(self.poll())
    }

    /// New warnings of the renderer and the store.
    pub(super) fn warnings(&mut self) -> Vec<Printable> {
        let (remarks, store) = self.engine.warnings();
        let mut all: Vec<Printable> = Vec::new();
        all.extend(remarks.iter().map(ToString::to_string).map(Printable::from));
        all.extend(store.iter().map(|note| Printable::from(note.to_string())));
        all.extend(refine::clamped(&self.engine).map(Printable::from));
        all.retain(|warning| self.reported.insert(warning.clone()));
        all
    }

    /// Runs a request as seen from a view, which applies to it alone.
    pub(super) fn seen_from(
        &mut self,
        view: Option<&str>,
        act: impl FnOnce(&mut Repl) -> Result<Reply, Error>,
    ) -> Result<Reply, Error> {
        let usual = self.engine.document().view().map(str::to_owned);
        if let Some(view) = view {
            self.engine.look_from(view)?;
        }
        let reply = act(self);
        if let Some(usual) = usual.filter(|_| view.is_some()) {
            self.engine.look_from(&usual)?;
        }
        reply
    }

    /// The path of a file to write, whose extension must be one of `formats`.
    pub(super) fn output<'o>(
        &self,
        output: &'o Output,
        formats: &Formats,
    ) -> Result<&'o Path, Error> {
        let path = self.spared(output)?;
        formats.check(path)?;
        Ok(path)
    }

    /// Like [`Repl::output`], for an optional file.
    pub(super) fn optional_output<'o>(
        &self,
        output: Option<&'o Output>,
        formats: &Formats,
    ) -> Result<Option<&'o Path>, Error> {
        output
            .map(|output| self.output(output, formats))
            .transpose()
    }

    /// The path of a file or folder to write. A file of the show itself is refused; unfinished
    /// files of earlier processes are removed.
    pub(super) fn spared<'o>(&self, Output(path): &'o Output) -> Result<&'o Path, Error> {
        let host = self.engine.host();
        if self.engine.document().reads(path, host.files.as_ref()) {
            return Err(report::Error::ShowsFile(path.to_owned()).into());
        }
        host.store.sweep(path.parent().unwrap_or(Path::new("")));
        Ok(path)
    }

    /// Changes the show by typed declarations.
    pub(super) fn declare(&mut self, declarations: &str) -> Result<Reply, Error> {
        let before = self.engine.estimate().refined();
        let edit = Edit::Declare(declarations.to_owned());
        let edited = self.engine.edit(&edit)?;
        Ok(Reply::text(self.describe_edit(&edited, before)))
    }

    /// Describes the result of an edit, given the number of refined images before it.
    pub(super) fn describe_edit(&self, edited: &Edited, before: usize) -> Printable {
        let refined = [before, self.engine.estimate().refined()];
        let document = self.engine.document();
        document::edited(document, edited, refined, self.console.style)
    }

    /// Replaces the whole text, keeping rendered images that are still valid; `undo` restores the
    /// old one.
    ///
    /// # Errors
    /// As [`Engine::replace`]; the show is then unchanged.
    pub fn reload(&mut self, text: &str) -> Result<Reloaded, Error> {
        let before = self.engine.estimate().refined();
        let old = self.engine.document().compiled();
        let edited = self.engine.replace(text)?;
        self.live.follow(self.engine.document());
        let difference =
            sheet::difference(&old.version, &self.engine.document().compiled().version);
        let text = match versions::describe(&difference) {
            text if text.is_empty() => self.describe_edit(&edited, before),
            text => text.into(),
        };
        let mut notes = std::mem::take(&mut self.unheard);
        notes.extend(self.poll());
        let reply = Reply {
            notes,
            ..Reply::text(text)
        };
        Ok(Reloaded { reply, difference })
    }

    /// The first message at the prompt.
    pub fn greeting(&self) -> Printable {
        let document = self.engine.document();
        let warnings = match document.diagnostics().warnings() {
            0 => String::new(),
            n => format!(
                "{}; type `check` to see {}\n",
                report::words::count(n, "warning"),
                if n == 1 { "it" } else { "them" }
            ),
        };
        format!(
            "Footlight {}. {}\n{warnings}`help` lists the verbs; declarations change the show.\n",
            env!("CARGO_PKG_VERSION"),
            document::headline(document)
        )
        .into()
    }

    /// Current cue for the prompt: number and label; empty before the first.
    pub fn place(&self) -> Printable {
        document::place(self.engine.document(), &self.live).into()
    }
}
