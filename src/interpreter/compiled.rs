//! From a text to all that follows from it: show, timeline, keys, and what its stage needs.

use super::stage::{self, Stage};
use super::{Error, Host, Report};
use crate::check;
use crate::diagnostic::{Diagnostic, Severity, Sources};
use crate::lang;
use crate::show::Show;
use crate::timeline::{KeyOptions, KeySequence, Timeline};

/// Everything that follows from the text alone.
pub(super) struct Compiled {
    pub show: Show,
    pub timeline: Timeline,
    pub keys: KeySequence,
    pub warnings: Report,
}

impl Compiled {
    /// The text with all that it includes.
    pub fn text(&self) -> String {
        joined(&self.warnings.sources)
    }
}

/// The texts of a show and of what it includes, one after the other.
pub(super) fn joined(sources: &Sources) -> String {
    sources.texts().collect::<Vec<_>>().join("\n")
}

/// Compiles a text as a whole, to be looked at from a view of this name if there is one; nothing is
/// kept of a text with errors.
pub(super) fn compile(
    (name, source): (&str, &str),
    host: &Host,
    known: &mut lang::Known,
    looking: Option<&str>,
    old: Option<&Stage>,
) -> Result<(Compiled, Option<stage::Fresh>), Error> {
    let mut sources = Sources::default();
    let files = host.files.as_ref();
    let parsed = lang::parse_again(known, files, &mut sources, name, source);
    let mut diagnostics = parsed.diagnostics;
    let is_error = |d: &Diagnostic| d.severity == Severity::Error;
    let mut done = None;
    if let Some(mut show) = parsed.show.filter(|_| !diagnostics.iter().any(is_error)) {
        show.look_from(looking.unwrap_or_default());
        let fresh = Stage::read(&show, &parsed.spans, files, host.memory, old);
        let fresh = fresh.unwrap_or_else(|mistakes| {
            diagnostics.extend(mistakes);
            None
        });
        let checked = check::check(&show, &parsed.spans);
        diagnostics.extend(checked.diagnostics);
        if let Some(timeline) = checked.timeline {
            done = Some((show, timeline, fresh));
        }
    }
    let report = Report {
        diagnostics,
        sources,
    };
    match done {
        Some((show, timeline, fresh)) if !report.diagnostics.iter().any(is_error) => {
            let keys = KeySequence::new(&timeline, KeyOptions::default())
                .map_err(|e| Error::Usage(format!("the show is too large: {e}")))?;
            let compiled = Compiled {
                show,
                timeline,
                keys,
                warnings: report,
            };
            Ok((compiled, fresh))
        }
        _ => Err(Error::Mistakes(report)),
    }
}
