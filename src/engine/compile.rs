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

/// A text to compile, and where the files that it names are read from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// What diagnostics call the text.
    pub name: &'a str,
    pub text: &'a str,
    /// The view to look from; the show's first without it.
    pub view: Option<&'a str>,
    pub files: &'a dyn Files,
    /// Bytes that images given as banks may hold.
    pub memory: usize,
}

/// Everything that follows from a show's text. It never changes: an edit compiles another.
#[derive(Debug)]
pub struct Compiled {
    /// The model.
    pub show: Show,
    /// The curves.
    pub timeline: Timeline,
    /// The key settings, made so that none is negative.
    pub keys: KeySequence,
    /// Warnings, with the texts that they point into.
    pub diagnostics: Diagnostics,
    pub(super) loaded: Option<Loaded>,
}

impl Compiled {
    /// The text with all that it includes.
    pub fn text(&self) -> String {
        joined(&self.diagnostics.sources)
    }

    /// What a renderer is given; `None` where the show has no stage or no view.
    pub fn setup(&self) -> Option<&Setup> {
        self.loaded.as_ref().map(|loaded| &loaded.setup)
    }
}

/// The texts of a show and of what it includes, one after the other.
fn joined(sources: &Sources) -> String {
    sources.texts().collect::<Vec<_>>().join("\n")
}

/// A text with its curves, without what its stage needs.
pub struct Version {
    /// The model.
    pub show: Show,
    /// The curves.
    pub timeline: Timeline,
    pub(super) spans: SpanMap,
    diagnostics: Diagnostics,
}

impl Version {
    /// The text with all that it includes.
    pub fn text(&self) -> String {
        joined(&self.diagnostics.sources)
    }
}

/// Parses a text and computes its curves.
pub(super) fn parse(source: Source<'_>, cache: &mut lang::LoweringCache) -> Result<Version, Error> {
    let (parsed, mut diagnostics) = read(source, cache);
    if let (Some(show), false) = (parsed.show, diagnostics.has_errors()) {
        let checked = check::check(&show, &parsed.spans);
        diagnostics.list.extend(checked.diagnostics);
        if let (Some(timeline), false) = (checked.timeline, diagnostics.has_errors()) {
            return Ok(Version {
                show,
                spans: parsed.spans,
                timeline,
                diagnostics,
            });
        }
    }
    Err(Error::Show(diagnostics))
}

fn read(source: Source<'_>, cache: &mut lang::LoweringCache) -> (lang::Parsed, Diagnostics) {
    let mut sources = Sources::default();
    let Source { name, text, .. } = source;
    let mut parsed = lang::parse_again(cache, source.files, &mut sources, name, text);
    let list = std::mem::take(&mut parsed.diagnostics);
    (parsed, Diagnostics { list, sources })
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
    let (parsed, mut diagnostics) = read(source, cache);
    let show = parsed.show.filter(|_| !diagnostics.has_errors());
    let Some(mut show) = show else {
        return Err(Error::Show(diagnostics));
    };
    show.look_from(source.view.unwrap_or_default());
    // All errors in one run: of the files as well as of the curves.
    let loaded = setup::load(&show, &parsed.spans, source, old);
    let loaded = loaded.unwrap_or_else(|errors| {
        diagnostics.list.extend(errors);
        None
    });
    let checked = check::check(&show, &parsed.spans);
    diagnostics.list.extend(checked.diagnostics);
    match checked.timeline {
        Some(timeline) if !diagnostics.has_errors() => Ok(Compiled {
            keys: KeySequence::new(&timeline, KeyOptions::default())?,
            show,
            timeline,
            diagnostics,
            loaded,
        }),
        _ => Err(Error::Show(diagnostics)),
    }
}
