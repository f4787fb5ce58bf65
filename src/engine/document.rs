//! A document: a show's text, its meaning, and its history.
//!
//! Invariants: the text always compiles; an edit compiles the whole new text before anything
//! changes, so that an error never drops the last good show; an edit keeps everything that it does
//! not affect (geometry while the stage files are unchanged). A document renders nothing and has no
//! prompt.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Error;
use super::compile::{self, Compiled};
use super::setup::{Loaded, Source};
use footlight_host::files::{self, FileError, Files, Store};
use footlight_picture::Image;
use footlight_picture::tone::{self, Tone};
use footlight_show::diagnostic::{Diagnostics, Label};
use footlight_show::lang;
use footlight_show::lang::edit::{self, Change, Edit};
use footlight_show::model::{Coordinate, NodeId, Pose, Show};
use footlight_show::timeline::{KeySequence, Timeline};
use footlight_show::units::Time;
use footlight_transport::Setup;

/// Most bytes of a text.
pub const TEXT_LIMIT: u64 = 64 << 20;

/// Most bytes of earlier texts kept for `undo`.
const PAST: usize = 64 << 20;

/// A show's text with everything that follows from it, and its edits.
///
/// ```
/// use footlight_engine::Document;
/// use footlight_host::files::Memory;
/// use footlight_show::lang::edit::Edit;
///
/// # fn main() -> Result<(), footlight_engine::Error> {
/// let text = b"show \"S\"\nbank a = x\nlight x spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\n\
///     cue 1 at 0:00 { snap  a 50 }\n";
/// let files = Memory::default();
/// let mut document = Document::new("s.lxq", text, &files)?;
/// document.apply(&Edit::Declare("cue 2 at 0:05 { a 80 }".into()), &files)?;
/// assert_eq!(document.show().cues.len(), 2);
/// document.undo(&files)?;
/// assert_eq!(document.show().cues.len(), 1);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Document {
    name: String,
    path: Option<PathBuf>,
    text: String,
    /// The text as last read or saved.
    saved: String,
    /// Name of the current view; `None` uses the show's first.
    view: Option<String>,
    /// Most bytes of its stage, images and luminaires.
    memory: usize,
    /// Incremented when the text changes its meaning.
    revision: u64,
    compiled: Arc<Compiled>,
    past: Vec<String>,
    future: Vec<String>,
}

/// Result of an edit.
#[derive(Clone, Debug, Default)]
pub struct Edited {
    /// The changed declarations, in order; empty when a whole text was replaced.
    pub changes: Vec<Change>,
    /// Warnings that the previous text did not give.
    pub warnings: Diagnostics,
    /// True when files of the show had changed on disk and were read again.
    pub reread: bool,
}

impl Document {
    /// Creates a document from its text; `name` appears in diagnostics. Files that the show names
    /// are read from `files`.
    ///
    /// # Errors
    /// [`Error::Show`] with every error of the text and of the files it names;
    /// [`Error::TooManyKeys`].
    pub fn new(name: &str, text: &[u8], files: &dyn Files) -> Result<Document, Error> {
        Document::within(name, text, files, usize::MAX)
    }

    /// Like [`Document::new`], with a limit of `memory` bytes for stage, images and luminaires.
    ///
    /// # Errors
    /// As [`Document::new`].
    pub fn within(
        name: &str,
        text: &[u8],
        files: &dyn Files,
        memory: usize,
    ) -> Result<Document, Error> {
        let text = decode(name, text)?;
        let source = Source {
            name,
            text: &text,
            view: None,
            files,
            memory,
        };
        let compiled = compile::compile(source, None)?;
        Ok(Document {
            name: name.to_owned(),
            path: None,
            saved: text.clone(),
            text,
            view: None,
            memory,
            revision: 0,
            compiled: Arc::new(compiled),
            past: Vec::new(),
            future: Vec::new(),
        })
    }

    /// Opens the document in a file, read through `store`.
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be read, else as [`Document::new`].
    pub(super) fn open(
        path: &Path,
        store: &dyn Store,
        files: &dyn Files,
        memory: usize,
    ) -> Result<Document, Error> {
        let text = store.read(path, TEXT_LIMIT)?;
        let name = path.display().to_string();
        let mut document = Document::within(&name, &text, files, memory)?;
        document.path = Some(path.to_owned());
        Ok(document)
    }

    /// Approximate bytes of its stage, images and luminaires.
    pub(super) fn loaded_bytes(&self) -> usize {
        let loaded = self.compiled.loaded.as_ref();
        loaded.map_or(0, Loaded::bytes)
    }

    /// Sets the limit for stage, images and luminaires, from the next edit on.
    pub(super) fn allow(&mut self, memory: usize) {
        self.memory = memory;
    }

    /// Its name in diagnostics.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The file from which it was read or to which it was saved.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Its text, edits included.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The text as last read or saved.
    pub fn saved_text(&self) -> &str {
        &self.saved
    }

    /// True when the text has unsaved edits.
    pub fn is_unsaved(&self) -> bool {
        self.text != self.saved
    }

    /// The model of the show.
    pub fn show(&self) -> &Show {
        &self.compiled.version.show
    }

    /// Its curves.
    pub fn timeline(&self) -> &Timeline {
        &self.compiled.version.timeline
    }

    /// Checks that a time is within the show.
    ///
    /// # Errors
    /// [`Error::OutsideShow`] if not.
    pub fn check_time(&self, time: Time) -> Result<(), Error> {
        let (start, end) = (self.timeline().start(), self.timeline().end());
        if (start..=end).contains(&time) {
            Ok(())
        } else {
            Err(Error::OutsideShow { time, start, end })
        }
    }

    /// Its key settings.
    pub fn keys(&self) -> &KeySequence {
        &self.compiled.keys
    }

    /// Warnings, with the texts that they point into.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.compiled.version.diagnostics
    }

    /// Line of a statement in the show's own file, from 1; `None` for statements in included files.
    pub fn line_of(&self, id: NodeId) -> Option<usize> {
        let span = self.compiled.version.spans.get(id)?;
        let before = self.text.as_bytes().get(..span.start as usize)?;
        let lines = before.iter().filter(|byte| **byte == b'\n').count();
        (span.file == 0).then_some(lines + 1)
    }

    /// Label of the statement or words of `id`.
    pub(super) fn place(&self, id: NodeId) -> Option<Label> {
        let span = self.compiled.version.spans.get(id)?;
        Some(Label {
            file: span.file as usize,
            span: span.range(),
            text: String::new(),
        })
    }

    /// Everything that follows from the text, for use while the document changes.
    pub fn compiled(&self) -> Arc<Compiled> {
        Arc::clone(&self.compiled)
    }

    /// The scene and rig for a renderer; `None` when the show has no stage or no view.
    pub fn setup(&self) -> Option<&Setup> {
        self.compiled.setup()
    }

    /// The setup for the view of this name; `None` when there is none, or it is not usable.
    pub(super) fn setup_from(&self, view: &str) -> Option<Setup> {
        self.compiled.loaded.as_ref()?.setup_from(self.show(), view)
    }

    /// A setup with the show's heads as fixed lights in these poses, with a source for each
    /// coordinate of [`Show::coordinates`]; unchanged without heads.
    pub(super) fn standing(&self, setup: &Setup, poses: &[Pose]) -> Result<Setup, Error> {
        let Some(loaded) = self.compiled.loaded.as_ref().filter(|_| !poses.is_empty()) else {
            return Ok(setup.clone());
        };
        let standing = loaded.standing(self.show(), poses);
        let rig = standing.map_err(|_| Error::NoSetup)?.rig;
        Ok(Setup {
            rig,
            ..setup.clone()
        })
    }

    /// Name of the current view; `None` when the show has none.
    pub fn view(&self) -> Option<&str> {
        self.show().view().map(|view| view.name.as_str())
    }

    /// The parameters at a time, before the dimmers and as fractions of full: the level of each
    /// bank, for an rgb bank followed by its three emitters, then one for the fixed lights, if any
    /// ([`Show::parameters`] names them). Before the show's start they are those of the start,
    /// after its end those of the end
    /// ([`Timeline::start`](footlight_show::timeline::Timeline::start),
    /// [`end`](footlight_show::timeline::Timeline::end)).
    pub fn levels(&self, time: Time) -> Vec<f64> {
        self.timeline().levels(time)
    }

    /// The light of each coordinate at a time, after the dimmers and relative to full, as input for
    /// [`Engine::picture_with`](super::Engine::picture_with). Times as in
    /// [`Document::levels`].
    pub fn setting(&self, time: Time) -> Vec<f64> {
        self.timeline().evaluate(time)
    }

    /// The home poses of heads, as declared.
    pub fn home(&self) -> Vec<Pose> {
        let heads = self.show().heads().into_iter();
        heads.map(|(_, head, _)| head.home).collect()
    }

    /// Completion of the first cue that leaves a bank with heads lit, or the start if none does:
    /// until then its heads may aim anywhere. `None` for a bank without heads.
    pub fn first_lit(&self, bank: usize) -> Option<Time> {
        let (show, timeline) = (self.show(), self.timeline());
        if !show.heads().iter().any(|(.., of)| *of == bank) {
            return None;
        }
        let own = show.coordinates_of(bank);
        let is_lit = |time: &Time| {
            let setting = timeline.evaluate(*time);
            own.clone()
                .any(|c| setting.get(c).is_some_and(|light| *light > 0.0))
        };
        let mut times = timeline.cues().iter().map(|cue| cue.completion);
        Some(times.find(is_lit).unwrap_or(timeline.start()))
    }

    /// The setting of a bank alone at full, with heads in these poses; `fixed` means all fixed
    /// lights together.
    ///
    /// # Errors
    /// [`Error::NoSuchBank`].
    pub fn alone(&self, bank: &str, poses: &[Pose]) -> Result<Vec<f64>, Error> {
        let show = self.show();
        let coordinates = show.coordinates();
        let of = |c: &Coordinate| {
            let own = c.bank.and_then(|b| show.banks.get(b));
            own.is_some_and(|b| b.name == bank) || c.name == bank
        };
        if !coordinates.iter().any(of) {
            let mut known: Vec<String> = show.banks.iter().map(|b| b.name.clone()).collect();
            known.extend((!show.fixed.is_empty()).then(|| "fixed".to_owned()));
            return Err(Error::NoSuchBank {
                name: bank.to_owned(),
                fixed: show.fixed.iter().any(|f| f.name == bank),
                known,
            });
        }
        let own: Vec<f64> = coordinates
            .iter()
            .map(|c| f64::from(u8::from(of(c))))
            .collect();
        Ok(self.timeline().with_bounced(&own, poses))
    }

    /// Tone for some images: the show's own exposure, or an automatic one for them.
    pub fn tone_of<'i>(&self, images: impl IntoIterator<Item = &'i Image>) -> Tone {
        let own = self.show().preview.exposure;
        let bias = self.show().preview.bias;
        self.tone_at(own.unwrap_or_else(|| tone::auto_exposure(images.into_iter()) + bias))
    }

    /// The show's tone curve at an exposure in stops.
    pub fn tone_at(&self, exposure: f64) -> Tone {
        let preview = &self.show().preview;
        Tone {
            exposure,
            curve: preview.tone,
        }
    }

    /// A number that changes when the text changes its meaning.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Number of edits that [`Document::undo`] can revert.
    pub fn edits(&self) -> usize {
        self.past.len()
    }

    /// Applies an edit as the smallest change of the text. A declaration replaces the one of its
    /// kind and name, or is added at its place.
    ///
    /// # Errors
    /// [`Error::Show`]; the document is then unchanged.
    pub fn apply(&mut self, edit: &Edit, files: &dyn Files) -> Result<Edited, Error> {
        let edited = edit::apply(&self.text, edit).map_err(|list| {
            // Places refer to the typed text.
            let typed = match edit {
                Edit::Declare(text) => text.as_str(),
                _ => "",
            };
            Error::Show(Diagnostics::of(list, "typed", typed))
        })?;
        let mut done = self.compile(&edited.source, self.view.clone(), files)?;
        self.change_text(edited.source);
        done.changes = edited.changes;
        Ok(done)
    }

    /// Replaces the whole text.
    ///
    /// # Errors
    /// As [`Document::apply`].
    pub fn replace(&mut self, text: &str, files: &dyn Files) -> Result<Edited, Error> {
        let done = self.compile(text, self.view.clone(), files)?;
        if text != self.text {
            self.change_text(text.to_owned());
        }
        Ok(done)
    }

    /// Checks that there is a view of this name.
    ///
    /// # Errors
    /// [`Error::NoSuchView`].
    pub(super) fn check_view(&self, name: &str) -> Result<(), Error> {
        let names = self.show().views.iter().map(|view| &view.name);
        if names.clone().any(|known| known == name) {
            Ok(())
        } else {
            Err(Error::NoSuchView {
                name: name.to_owned(),
                known: names.cloned().collect(),
            })
        }
    }

    /// Makes the view of this name current.
    ///
    /// # Errors
    /// [`Error::NoSuchView`]; as [`Document::new`] when a file that the show names has become
    /// unreadable. The document is then unchanged.
    pub(super) fn look_from(&mut self, name: &str, files: &dyn Files) -> Result<Edited, Error> {
        self.check_view(name)?;
        let text = self.text.clone();
        self.compile(&text, Some(name.to_owned()), files)
    }

    /// Reverts the last edit.
    ///
    /// # Errors
    /// [`Error::NothingToUndo`]; [`Error::Show`] when the earlier text no longer compiles, because
    /// files changed. The document is then unchanged.
    pub fn undo(&mut self, files: &dyn Files) -> Result<Edited, Error> {
        let text = self.past.last().ok_or(Error::NothingToUndo)?.clone();
        let done = self.compile(&text, self.view.clone(), files)?;
        self.past.pop();
        self.future.push(std::mem::replace(&mut self.text, text));
        Ok(done)
    }

    /// Applies the last reverted edit again.
    ///
    /// # Errors
    /// [`Error::NothingToRedo`], else as [`Document::undo`].
    pub fn redo(&mut self, files: &dyn Files) -> Result<Edited, Error> {
        let text = self.future.last().ok_or(Error::NothingToRedo)?.clone();
        let done = self.compile(&text, self.view.clone(), files)?;
        self.future.pop();
        self.past.push(std::mem::replace(&mut self.text, text));
        Ok(done)
    }

    /// Formats the text in its canonical layout; false if nothing changed.
    ///
    /// # Errors
    /// [`Error::Show`].
    pub fn format(&mut self) -> Result<bool, Error> {
        let text = format(&self.name, self.text.as_bytes())?;
        let changes = text != self.text;
        if changes {
            self.change_text(text);
        }
        Ok(changes)
    }

    /// Writes the text to `path`. The document's own file is replaced only if its content is still
    /// as read, another existing file never.
    ///
    /// # Errors
    /// [`Error::ChangedOnDisk`], [`Error::FileExists`], [`Error::File`].
    pub fn save(&mut self, path: &Path, store: &dyn Store) -> Result<(), Error> {
        let own = self.path.as_deref() == Some(path);
        match store.read(path, TEXT_LIMIT) {
            Ok(now) if own && now != self.saved.as_bytes() => {
                return Err(Error::ChangedOnDisk(path.to_owned()));
            }
            Ok(now) if !own && now != self.text.as_bytes() => {
                return Err(Error::FileExists(path.to_owned()));
            }
            Ok(_) | Err(FileError::Missing(_)) => {}
            Err(error) => return Err(error.into()),
        }
        store.sweep(path.parent().unwrap_or(Path::new("")));
        store.edit(path, self.text.as_bytes())?;
        self.saved.clone_from(&self.text);
        self.path = Some(path.to_owned());
        Ok(())
    }

    /// True for the show's own file and the files that it reads.
    pub fn reads(&self, path: &Path, files: &dyn Files) -> bool {
        let own = self.path.as_deref();
        own.is_some_and(|own| files::is_same(own, path)) || files.has_read(path)
    }

    /// Replaces the text by one already compiled; `undo` restores the old one.
    fn change_text(&mut self, text: String) {
        self.past.push(std::mem::replace(&mut self.text, text));
        self.future.clear();
        let mut bytes: usize = self.past.iter().map(String::len).sum();
        while bytes > PAST && self.past.len() > 1 {
            bytes -= self.past.remove(0).len();
        }
    }

    /// Clears the history of `undo` and `redo`.
    pub fn forget_history(&mut self) {
        self.past.clear();
        self.future.clear();
    }

    /// Compiles a text for a view. Files that changed on disk are read again.
    fn compile(
        &mut self,
        text: &str,
        view: Option<String>,
        files: &dyn Files,
    ) -> Result<Edited, Error> {
        let reread = files.have_changed();
        let source = Source {
            name: &self.name,
            text,
            view: view.as_deref(),
            files,
            memory: self.memory,
        };
        let old = self.compiled.loaded.as_ref().filter(|_| !reread);
        let compiled = compile::compile(source, old)?;
        let warnings = compiled
            .version
            .diagnostics
            .new_since(&self.compiled.version.diagnostics);
        if text != self.text || reread {
            self.revision += 1;
        }
        self.view = view;
        self.compiled = Arc::new(compiled);
        Ok(Edited {
            warnings,
            reread,
            ..Edited::default()
        })
    }
}

/// Decodes a show's file.
///
/// # Errors
/// [`Error::Show`] when it is not text, or too large.
pub fn decode(name: &str, bytes: &[u8]) -> Result<String, Error> {
    lang::decode(name, bytes).map_err(|diagnostic| {
        Error::Show(Diagnostics {
            list: vec![*diagnostic],
            ..Diagnostics::default()
        })
    })
}

/// Formats a text in its canonical layout.
///
/// # Errors
/// [`Error::Show`] when it does not parse.
pub fn format(name: &str, bytes: &[u8]) -> Result<String, Error> {
    let text = decode(name, bytes)?;
    lang::format(&text).map_err(|list| Error::Show(Diagnostics::of(list, name, &text)))
}
