//! The interpreter: a show, its plan, its pool, and every verb; the whole REPL without a terminal.
//!
//! An [`Interpreter`] holds one show. Its text is the truth: declarations typed at the prompt are
//! edits of that text, compiled as a whole before anything changes, so a mistake never drops the
//! last good show. What an edit does not touch is kept: geometry while the stage files are the
//! same, operators and pictures while lights and view are the same. Every effect on the outside
//! goes through the [`Host`] that the embedding program gives.

mod answer;
mod beside;
mod chart;
mod compare;
mod compiled;
mod desk;
mod economy;
mod error;
mod exposure;
mod fitting;
mod host;
mod limit;
mod look;
mod measure;
mod method;
mod mistake;
mod output;
mod paper;
mod planning;
mod playing;
mod pool;
mod refine;
mod run;
mod session;
mod stage;
mod trial;
mod tune;
mod verb;
mod vocabulary;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use crate::chart::Drawing;
use crate::diagnostic::Sources;
use crate::files;
use crate::lang;
use crate::pool::archive::{Archive, Tally};
use crate::pool::{Pool, Projection};
use crate::report::notes;
use crate::show::Show;
use crate::timeline::{KeySequence, Timeline};
use crate::units::Time;

pub use self::beside::{Background, Status};
pub use self::desk::Reloaded;
pub use self::economy::{Ahead, Outlook};
pub use self::error::{Error, Report};
pub use self::host::{Canvas, Host, POOL_LIMIT, PoolPlace};
pub use self::method::Method;
pub use self::output::Animation;
pub use self::paper::{Comparison, Formatted, explain, format, formatted};
pub use self::refine::{Ended, Goal, Step};
pub use self::run::Summary;
pub use self::vocabulary::{Completion, Vocabulary};
pub use crate::lang::{Token, time, tokens};
pub use crate::study::comparison::Compared;
pub use crate::study::playback::KeyFormat;
pub use crate::study::tune::Tuned;

pub use self::verb::{Call, OptionSpec, VERBS, Verb, VerbSpec};

use self::compiled::{Compiled, compile, joined};
use self::limit::Deadline;
use self::stage::Stage;

/// The largest text the interpreter reads, in bytes: a show, a stage file, piped commands.
pub const LIMIT: u64 = 64 << 20;

/// A display-coded picture that belongs to a reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Width and height.
    pub size: (usize, usize),
    /// RGB, 8 bits, row by row from the top.
    pub rgb: Vec<u8>,
}

/// What a verb answers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reply {
    /// Words, ending in a newline unless empty.
    pub text: String,
    /// A picture to show beside them.
    pub picture: Option<Shown>,
    /// What the user should be warned of and was not told before: one line each.
    pub notes: Vec<String>,
    /// The user wants to leave.
    pub quit: bool,
    /// The host's pipe carries a file: the words go elsewhere.
    pub beside: bool,
    /// The user stopped it before its end; what is told of was done.
    pub stopped: bool,
}

impl Reply {
    /// Data instead of words.
    fn json(data: &impl Serialize) -> Result<Reply, Error> {
        Ok(Reply::text(json(data)?))
    }

    /// A drawing beside words.
    fn drawn(drawing: &Drawing, text: String) -> Result<Reply, Error> {
        let (width, height, rgb) = drawing.rgb8()?;
        let size = (width, height);
        Ok(Reply {
            picture: Some(Shown { size, rgb }),
            ..Reply::text(text)
        })
    }

    fn text(text: impl Into<String>) -> Reply {
        let mut text = text.into();
        if !text.is_empty() && !text.ends_with('\n') {
            text.push('\n');
        }
        Reply {
            text,
            ..Reply::default()
        }
    }
}

/// Data as text.
fn json(data: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(data).map_err(no_json)
}

fn no_json(error: serde_json::Error) -> Error {
    Error::Usage(format!("no JSON can be made of it: {error}"))
}

/// One show and all that is known of it.
pub struct Interpreter {
    host: Host,
    name: String,
    path: Option<PathBuf>,
    source: String,
    /// The text as it was last read or saved.
    saved: String,
    /// What the last compiling learnt of the cues, so that an edit costs what it changes.
    known: lang::Known,
    compiled: Compiled,
    stage: Option<Stage>,
    /// Pictures at hand while there is no stage to hold them.
    archive: Option<Archive>,
    now: Time,
    steps: Vec<Step>,
    /// How long things take here against what the operator predicts.
    pace: economy::Pace,
    /// How pictures are chosen and previews made.
    method: Method,
    /// The view that the user chose.
    looking: Option<String>,
    /// What happens beside the text.
    desk: desk::Desk,
    /// The sequence's automatic exposure, the number of refined pictures it was found with and how:
    /// finding it takes every key image, which each picture would otherwise make anew.
    exposure: Option<(f64, (usize, Projection))>,
    /// How bright each key is, from before the last edit.
    brightness: Option<exposure::Brightness>,
    /// The user asked to leave with unsaved edits and was told so.
    warned: bool,
    /// Remarks that were made, each once.
    told: BTreeSet<String>,
    /// The refinement that goes on beside the prompt.
    beside: Option<beside::Beside>,
    /// What is to be told with the next reply.
    unheard: Vec<String>,
    /// When the call in hand must end, where the host limits that.
    deadline: Option<Arc<Deadline>>,
}

impl std::fmt::Debug for Interpreter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Interpreter")
            .field("name", &self.name)
            .field("host", &self.host)
            .field("steps", &self.steps)
            .finish_non_exhaustive()
    }
}

impl Interpreter {
    /// A show with nothing in it yet.
    ///
    /// # Errors
    /// None in practice: the empty show compiles.
    pub fn empty(host: Host) -> Result<Interpreter, Error> {
        Interpreter::from_text("untitled.lxq", b"show \"Untitled\"\n", host)
    }

    /// A show from its text; `name` is what reports call it.
    ///
    /// # Errors
    /// [`Error::Mistakes`] with every mistake of the text and of the stage files it names.
    pub fn from_text(name: &str, text: &[u8], host: Host) -> Result<Interpreter, Error> {
        let source = decoded(name, text)?;
        let (host, deadline) = limit::limited(host);
        let mut known = lang::Known::default();
        let (compiled, fresh) = compile((name, &source), &host, &mut known, None, None)?;
        let mut archive = Some(host.archive());
        let results = host.transport.results();
        Ok(Interpreter {
            now: compiled.timeline.start(),
            stage: Stage::renew(None, fresh, results.as_deref(), &mut archive),
            archive,
            name: name.to_owned(),
            path: None,
            saved: source.clone(),
            source,
            known,
            compiled,
            host,
            steps: Vec::new(),
            pace: economy::Pace::default(),
            method: Method::default(),
            looking: None,
            desk: desk::Desk::default(),
            exposure: None,
            brightness: None,
            warned: false,
            told: BTreeSet::new(),
            beside: None,
            unheard: Vec::new(),
            deadline,
        })
    }

    /// The show in a file, read through the host's store.
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be read, else as [`Interpreter::from_text`].
    pub fn open(path: &Path, host: Host) -> Result<Interpreter, Error> {
        let text = host.store.read(path, LIMIT)?;
        let name = path.display().to_string();
        let mut interpreter = Interpreter::from_text(&name, &text, host)?;
        interpreter.path = Some(path.to_owned());
        Ok(interpreter)
    }

    /// The model of the show.
    pub fn show(&self) -> &Show {
        &self.compiled.show
    }

    /// Its curves.
    pub fn timeline(&self) -> &Timeline {
        &self.compiled.timeline
    }

    /// Its key settings.
    pub fn keys(&self) -> &KeySequence {
        &self.compiled.keys
    }

    /// Its text, edits included.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// True when the text has edits that were not saved.
    pub fn unsaved(&self) -> bool {
        self.source != self.saved
    }

    /// What is legal in the show but surely not meant.
    pub fn warnings(&self) -> &Report {
        &self.compiled.warnings
    }

    /// Runs a line as if typed at the prompt: a verb, or declarations that change the show.
    ///
    /// # Errors
    /// [`Error`]; the show is then as it was.
    pub fn execute(&mut self, line: &str) -> Result<Reply, Error> {
        let line = line.trim();
        if line.is_empty() || line.starts_with("//") {
            return Ok(Reply::default());
        }
        if lang::is_declaration(line) {
            return self.serve(|show| show.edit(line));
        }
        let call = Call::parse(line).map_err(|error| self.level_meant(line).unwrap_or(error))?;
        self.call(&call)
    }

    /// The way out for somebody who types a level as at a desk: `lamps 50`.
    fn level_meant(&self, line: &str) -> Option<Error> {
        let name = line.split_whitespace().next()?;
        let show = self.show();
        let is_bank = show.banks.iter().any(|b| b.name == name);
        let is_group = show.groups.iter().any(|g| g.name == name);
        ((is_bank || is_group) && verb::find(name).is_err()).then(|| {
            Error::Usage(format!(
                "`{name}` is set in cues; `set {line}` tries it on top of the moment"
            ))
        })
    }

    /// Runs a verb.
    ///
    /// # Errors
    /// [`Error`]; nothing has changed then, but for refined pictures finished before it.
    pub fn call(&mut self, call: &Call) -> Result<Reply, Error> {
        self.serve(|show| {
            let mut reply = show.answer(call)?;
            reply.notes = show.news();
            Ok(reply)
        })
    }

    /// Does something for the user, who is told before of what ended beside the prompt: with the
    /// next reply where there is none now.
    fn serve(
        &mut self,
        something: impl FnOnce(&mut Interpreter) -> Result<Reply, Error>,
    ) -> Result<Reply, Error> {
        let notes = self.attend();
        self.unheard.extend(notes);
        let mut reply = self.in_time(something)?;
        if let Some(seconds) = self.out_of_time().filter(|_| reply.stopped) {
            reply
                .notes
                .push(format!("the limit of time ({seconds} s) is reached"));
        }
        let mut notes = std::mem::take(&mut self.unheard);
        notes.append(&mut reply.notes);
        Ok(Reply { notes, ..reply })
    }

    /// Remarks on the operator and the stored pictures that were not made before.
    fn news(&mut self) -> Vec<String> {
        let remarks = self.host.transport.remarks();
        let mut remarks: Vec<String> = remarks.iter().map(notes::of_operator).collect();
        if let Some(stage) = &mut self.stage {
            remarks.extend(stage.archive.notes().iter().map(notes::of_store));
        }
        remarks.extend(self.clamped());
        remarks.retain(|remark| self.told.insert(remark.clone()));
        remarks
    }

    /// Options of a verb that say how pictures are chosen and made hold for that verb alone.
    fn answer(&mut self, call: &Call) -> Result<Reply, Error> {
        if let Some(path) = call.option("output") {
            self.spare(Path::new(path))?;
        }
        let usual = self.method;
        self.method = usual.with_options(call)?;
        let reply = self.answer_from_view(call);
        if call.verb != Verb::Method {
            self.method = usual;
        }
        reply
    }

    /// Refuses to write results over what the show is read from.
    fn spare(&self, path: &Path) -> Result<(), Error> {
        let own = self.path.as_deref();
        if own.is_some_and(|own| files::is_same(own, path)) || self.host.files.has_read(path) {
            return Err(Error::Usage(format!(
                "`{}` belongs to the show and was not written; choose another name",
                path.display()
            )));
        }
        Ok(())
    }

    /// `--view` holds for its verb alone too.
    fn answer_from_view(&mut self, call: &Call) -> Result<Reply, Error> {
        let Some(name) = call.option("view") else {
            return self.answer_verb(call);
        };
        let usual = self.view().map(str::to_owned);
        self.look_from(name)?;
        let reply = self.answer_verb(call);
        if let Some(usual) = usual {
            self.look_from(&usual)?;
        }
        reply
    }

    fn answer_verb(&mut self, call: &Call) -> Result<Reply, Error> {
        let warned = std::mem::replace(&mut self.warned, false);
        match call.verb {
            Verb::Check => self.answer_check(),
            Verb::Show => self.answer_show(call),
            Verb::At => self.answer_at(call),
            Verb::Plan => self.answer_plan(call),
            Verb::Picture => self.answer_picture(call),
            Verb::Refine => self.answer_refine(call),
            Verb::Status => Ok(self.answer_status()),
            Verb::Wait => self.answer_wait(),
            Verb::Stop => self.answer_stop(call),
            Verb::Play => self.answer_play(call),
            Verb::Plot => self.answer_plot(call),
            Verb::Run => self.answer_run(call),
            Verb::Quality => self.answer_quality(call),
            Verb::Chart => self.answer_chart(call),
            Verb::Tune => self.answer_tune(call),
            Verb::Session => self.answer_session(call),
            Verb::Compare => self.answer_compare(call),
            Verb::Pool => self.answer_pool(call),
            Verb::Method => self.answer_method(call),
            Verb::View => self.answer_view(call),
            Verb::Go => self.answer_go(),
            Verb::Back => self.answer_back(),
            Verb::Goto => self.answer_goto(call),
            Verb::Set => self.answer_set(call),
            Verb::Release => self.answer_release(),
            Verb::Record => self.answer_record(call),
            Verb::Blind => self.answer_blind(call),
            Verb::Undo => self.answer_undo(true),
            Verb::Redo => self.answer_undo(false),
            Verb::Tracksheet => self.answer_tracksheet(call),
            Verb::Cuesheet => self.answer_cuesheet(call),
            Verb::Fmt => self.answer_fmt(call),
            Verb::Diff => self.answer_diff(call),
            Verb::Explain => self.answer_explain(call),
            Verb::Save => self.answer_save(call),
            Verb::Help => answer::help(call),
            Verb::Quit => Ok(self.answer_quit(warned)),
        }
    }

    /// Changes the show: declarations replace those of the same kind and name in the text, or are
    /// added at their place. Everything rendered that still means the same is kept.
    ///
    /// # Errors
    /// [`Error::Mistakes`]; the show is then as it was.
    pub fn edit(&mut self, declarations: &str) -> Result<Reply, Error> {
        let edit = lang::edit::Edit::Declare(declarations.to_owned());
        let edited = lang::edit::apply(&self.source, &edit).map_err(|diagnostics| {
            let mut sources = Sources::default();
            sources.add("typed", declarations);
            Error::Mistakes(Report {
                diagnostics,
                sources,
            })
        })?;
        let kept = self.refined();
        let news = self.compile_text(&edited.source, self.looking.clone())?;
        self.change_text(edited.source);
        Ok(Reply::text(self.describe_edit(
            &news,
            &edited.changes,
            kept,
        )))
    }

    /// Takes over what a text comes to, looked at from a view, with everything rendered that still
    /// means the same; what is to be warned of that was not before. Another text lets go of levels
    /// that are being tried, as they are known by the old one's coordinates.
    ///
    /// # Errors
    /// As [`compile`]; nothing has changed then.
    fn compile_text(&mut self, text: &str, looking: Option<String>) -> Result<Report, Error> {
        // What was edited elsewhere is read again.
        let again = self.host.files.have_changed();
        let old = self.stage.as_ref().filter(|_| !again);
        let known = &mut self.known;
        let named = (self.name.as_str(), text);
        let (compiled, fresh) = compile(named, &self.host, known, looking.as_deref(), old)?;
        self.looking = looking;
        if again {
            let told = "files that the show names were changed; they are read again";
            self.unheard.push(told.to_owned());
        }
        let news = compiled.warnings.news(&self.compiled.warnings);
        let results = self.host.transport.results();
        let old = self.stage.take();
        self.stage = Stage::renew(old, fresh, results.as_deref(), &mut self.archive);
        self.drop_useless();
        let (start, end) = (compiled.timeline.start(), compiled.timeline.end());
        self.now = self.now.clamp(start, end);
        if text != self.source {
            self.desk.release();
        }
        self.exposure = None;
        self.compiled = compiled;
        if self.refined() == 0 {
            self.steps.clear();
        }
        Ok(news)
    }

    /// The files that the show was read from beside its own, as they are now: another answer says
    /// that one of them was edited.
    pub fn files_now(&self) -> Vec<files::Stamp> {
        self.host.files.as_is()
    }

    /// Coarse and refined pictures, once there are any.
    pub fn pool(&self) -> Option<&Pool> {
        self.stage.as_ref().and_then(|s| s.pool.as_ref())
    }

    /// The pool, which must have been rendered.
    fn rendered(&self) -> Result<&Pool, Error> {
        self.pool().ok_or_else(refine::no_stage)
    }

    /// Every picture at hand, wherever it is held at present.
    fn archive_mut(&mut self) -> Option<&mut Archive> {
        match &mut self.stage {
            Some(stage) => Some(&mut stage.archive),
            None => self.archive.as_mut(),
        }
    }

    /// How the pictures of this session were come by so far.
    pub fn tally(&self) -> Tally {
        let stage = self.stage.as_ref().map(|s| &s.archive);
        let archive = stage.or(self.archive.as_ref());
        archive.map(Archive::tally).unwrap_or_default()
    }

    /// Number of refined pictures that serve the show.
    pub fn refined(&self) -> usize {
        let least = self.refined_step();
        self.stage.as_ref().map_or(0, |s| s.refined(least))
    }
}

/// The text of a show's file.
///
/// # Errors
/// [`Error::Mistakes`] when it is no text, or too large.
pub fn decoded(name: &str, bytes: &[u8]) -> Result<String, Error> {
    lang::decode(name, bytes).map_err(|diagnostic| {
        Error::Mistakes(Report {
            diagnostics: vec![*diagnostic],
            sources: Sources::default(),
        })
    })
}

/// True when a typed line is finished: a declaration with open braces or quotes goes on.
pub fn finished(line: &str) -> bool {
    !lang::is_declaration(line) || lang::statement_complete(line)
}
