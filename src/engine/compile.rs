//! From a text to all that follows from it: show, curves, key settings, diagnostics and the setup
//! to render. The only place where a text is compiled.

use super::Error;
use super::setup::{self, Loaded};
use crate::check;
use crate::diagnostic::{Diagnostics, Sources};
use crate::files::Files;
use crate::lang::{self, SpanMap};
use crate::renderer::Setup;
use crate::show::Show;
use crate::timeline::{KeyOptions, KeySequence, Timeline};

/// Bytes of a show that count among what the program itself takes.
pub(super) const SMALL_SHOW: usize = 8 << 20;

/// A text to compile, and where the files that it names are read from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// What diagnostics call the text.
    pub name: &'a str,
    pub text: &'a str,
    /// The view to look from; the show's first without it.
    pub view: Option<&'a str>,
    pub files: &'a dyn Files,
    /// Bytes that reading it may take, images given as banks included.
    pub memory: usize,
}

impl Source<'_> {
    /// The source with `held` bytes less to read it in.
    #[must_use]
    pub(super) fn holding(self, held: usize) -> Self {
        Source {
            memory: self.memory.saturating_sub(held),
            ..self
        }
    }
}

/// Everything that follows from a show's text. It never changes: an edit compiles another.
#[derive(Debug)]
pub struct Compiled {
    /// The model with its curves, and warnings.
    pub version: Version,
    /// The key settings, made so that none is negative.
    pub keys: KeySequence,
    pub(super) loaded: Option<Loaded>,
}

impl Compiled {
    /// Bytes that it holds, about.
    pub(super) fn bytes(&self) -> usize {
        let loaded = self.loaded.as_ref().map_or(0, Loaded::bytes);
        self.unshared_bytes() + loaded
    }

    /// Bytes that it holds for itself, about, where another one has the same stage and images.
    pub(super) fn unshared_bytes(&self) -> usize {
        self.version.bytes() + self.keys.bytes()
    }

    /// What a renderer is given; `None` where the show has no stage or no view.
    pub fn setup(&self) -> Option<&Setup> {
        self.loaded.as_ref().map(|loaded| &loaded.setup)
    }
}

/// A text with its curves, without what its stage needs.
#[derive(Debug)]
pub struct Version {
    /// The model.
    pub show: Show,
    /// The curves.
    pub timeline: Timeline,
    /// Warnings, with the texts that they point into.
    pub diagnostics: Diagnostics,
    pub(super) spans: SpanMap,
    /// Bytes that the model and the texts take, about.
    bytes: usize,
}

impl Version {
    /// Bytes that it holds, about.
    pub fn bytes(&self) -> usize {
        self.bytes + self.timeline.bytes()
    }

    /// The text with all that it includes.
    pub fn text(&self) -> String {
        let texts = self.diagnostics.sources.texts();
        texts.collect::<Vec<_>>().join("\n")
    }
}

/// Parses a text and computes its curves.
pub(super) fn parse(source: Source<'_>, cache: &mut lang::LoweringCache) -> Result<Version, Error> {
    checked(read(source, cache)?, source.memory)
}

/// The model that a text means, with its places and warnings.
struct Model {
    show: Show,
    spans: SpanMap,
    diagnostics: Diagnostics,
    /// Bytes that it takes with the texts, about.
    bytes: usize,
}

fn read(source: Source<'_>, cache: &mut lang::LoweringCache) -> Result<Model, Error> {
    cache.memory = source.memory.max(SMALL_SHOW);
    let mut sources = Sources::default();
    let Source { name, text, .. } = source;
    let parsed = lang::parse_again(cache, source.files, &mut sources, name, text);
    let list = parsed.diagnostics;
    let left_out = parsed.left_out;
    let diagnostics = Diagnostics {
        list,
        left_out,
        sources,
    };
    match parsed.show {
        Some(show) if !diagnostics.has_errors() => Ok(Model {
            show,
            spans: parsed.spans,
            diagnostics,
            bytes: parsed.bytes,
        }),
        _ => Err(Error::Show(diagnostics)),
    }
}

/// A model with its curves, unless these or its diagnostics have errors.
fn checked(model: Model, memory: usize) -> Result<Version, Error> {
    let Model {
        show,
        spans,
        mut diagnostics,
        bytes,
    } = model;
    let left = memory.max(SMALL_SHOW).saturating_sub(bytes);
    let checked = check::check_within(&show, &spans, left);
    diagnostics.list.extend(checked.diagnostics);
    diagnostics.left_out += checked.left_out;
    match checked.timeline {
        Some(timeline) if !diagnostics.has_errors() => Ok(Version {
            show,
            timeline,
            diagnostics,
            spans,
            bytes,
        }),
        _ => Err(Error::Show(diagnostics)),
    }
}

/// Compiles a text as a whole, with the files that it names; `old` gives what it still has in
/// common with them.
///
/// # Errors
/// [`Error::Show`] with every error of the text, its curves and its files; nothing is kept of such
/// a text. [`Error::TooManyKeys`].
pub(super) fn compile(
    source: Source<'_>,
    cache: &mut lang::LoweringCache,
    old: Option<&Loaded>,
) -> Result<Compiled, Error> {
    let mut model = read(source, cache)?;
    model.show.look_from(source.view.unwrap_or_default());
    // All errors in one run: of the files as well as of the curves.
    let loaded = setup::load(&model.show, &model.spans, source, old);
    let (loaded, found) = loaded.unwrap_or_else(|errors| (None, errors));
    model.diagnostics.list.extend(found);
    let held = loaded.as_ref().map_or(0, Loaded::bytes);
    let version = checked(model, source.memory.saturating_sub(held))?;
    let left = source.memory.saturating_sub(held).max(SMALL_SHOW);
    let left = left.saturating_sub(version.bytes());
    Ok(Compiled {
        keys: KeySequence::within(&version.timeline, KeyOptions::default(), left)?,
        version,
        loaded,
    })
}
