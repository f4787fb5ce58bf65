//! Compiles a text to its show, curves, key settings, diagnostics and render setup. Texts are
//! compiled only here.

use super::setup::{self, Loaded, Source};
use super::{Error, decode};
use footlight_host::files::Files;
use footlight_show::check;
use footlight_show::diagnostic::{Diagnostics, Sources};
use footlight_show::lang::{self, SpanMap};
use footlight_show::model::Show;
use footlight_show::timeline::{KeySequence, Timeline};
use footlight_transport::Setup;

/// Everything that follows from a show's text. Immutable: an edit compiles a new value.
#[derive(Debug)]
pub struct Compiled {
    /// The model with its curves, and warnings.
    pub version: Version,
    /// The key settings, none of them negative.
    pub keys: KeySequence,
    pub(super) loaded: Option<Loaded>,
}

impl Compiled {
    /// The scene and rig for a renderer; `None` when the show has no stage or no view.
    pub fn setup(&self) -> Option<&Setup> {
        self.loaded.as_ref().map(|loaded| &loaded.setup)
    }
}

/// A text with its curves, without data of the stage.
#[derive(Debug)]
pub struct Version {
    /// The model.
    pub show: Show,
    /// The curves.
    pub timeline: Timeline,
    /// Warnings, with the texts that they point into.
    pub diagnostics: Diagnostics,
    pub(super) spans: SpanMap,
}

impl Version {
    /// Reads a version by its name, its bytes and the files that it may include.
    ///
    /// # Errors
    /// [`Error::Show`] with the errors of the text and its curves.
    pub fn read(name: &str, bytes: &[u8], files: &dyn Files) -> Result<Version, Error> {
        let text = decode(name, bytes)?;
        checked(read(Source {
            name,
            text: &text,
            view: None,
            files,
            memory: 0,
        })?)
    }

    /// The text including its includes.
    pub fn text(&self) -> String {
        let texts = self.diagnostics.sources.texts();
        texts.collect::<Vec<_>>().join("\n")
    }
}

/// The model of a text, with its spans and warnings.
struct Model {
    show: Show,
    spans: SpanMap,
    diagnostics: Diagnostics,
}

fn read(source: Source<'_>) -> Result<Model, Error> {
    let mut sources = Sources::default();
    let Source { name, text, .. } = source;
    let parsed = lang::parse_with_files(source.files, &mut sources, name, text);
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
        }),
        _ => Err(Error::Show(diagnostics)),
    }
}

/// A model with its curves, or an error if these or its diagnostics have errors.
fn checked(model: Model) -> Result<Version, Error> {
    let Model {
        show,
        spans,
        mut diagnostics,
    } = model;
    let checked = check::check(&show, &spans);
    diagnostics.list.extend(checked.diagnostics);
    diagnostics.left_out += checked.left_out;
    match checked.timeline {
        Some(timeline) if !diagnostics.has_errors() => Ok(Version {
            show,
            timeline,
            diagnostics,
            spans,
        }),
        _ => Err(Error::Show(diagnostics)),
    }
}

/// Compiles a whole text with the files that it names, reusing what is unchanged from `old`.
///
/// # Errors
/// [`Error::Show`] with every error of the text, its curves and its files; [`Error::TooManyKeys`].
pub(super) fn compile(source: Source<'_>, old: Option<&Loaded>) -> Result<Compiled, Error> {
    let mut model = read(source)?;
    model.show.look_from(source.view.unwrap_or_default());
    // Report all errors in one run, of files as well as curves.
    let loaded = setup::load(&model.show, &model.spans, source, old);
    let (mut loaded, found) = loaded.unwrap_or_else(|errors| (None, errors));
    model.diagnostics.list.extend(found);
    let mut version = checked(model)?;
    if let Some(loaded) = &mut loaded {
        let show = (&version.show, &version.spans);
        if let Err(error) = loaded.add_bounced(show, version.timeline.bounced()) {
            version.diagnostics.list.push(error);
            return Err(Error::Show(version.diagnostics));
        }
    }
    Ok(Compiled {
        keys: KeySequence::new(&version.timeline)?,
        version,
        loaded,
    })
}
