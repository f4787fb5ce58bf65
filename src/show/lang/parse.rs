//! Parses a text to a show: the stages in order.

use super::decode::too_large;
use super::report::Report;
use super::spans::SpanMap;
use super::{codes, include, limits, lower, read};
use crate::diagnostic::{Diagnostic, Sources};
use crate::model::Show;
use footlight_host::files::{Files, Memory};

/// Result of parsing.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The show; `None` when a diagnostic is an error.
    pub show: Option<Show>,
    /// Spans of its nodes.
    pub spans: SpanMap,
    /// Errors and warnings, sorted by place.
    pub diagnostics: Vec<Diagnostic>,
    /// Number of warnings left out.
    pub left_out: usize,
}

/// Reads a show from `text`, which joins `sources` under `name`.
///
/// A show without a `show` statement takes its file's name without the extension. It cannot include
/// other files: see [`parse_with_files`].
pub fn parse(sources: &mut Sources, name: &str, text: &str) -> Parsed {
    parse_with_files(&Memory::default(), sources, name, text)
}

/// Reads a show and the files of `files` that it includes.
pub fn parse_with_files(
    files: &dyn Files,
    sources: &mut Sources,
    name: &str,
    text: &str,
) -> Parsed {
    let file = sources.add(name, if text.len() > limits::FILE { "" } else { text });
    let mut report = Report::default();
    if text.len() > limits::FILE {
        report.add(too_large(name, text.len()));
        return failed(report);
    }
    let parts = include::gather(files, sources, (name, file as u32, text), &mut report);
    let scans: Vec<_> = parts.iter().map(include::Part::scan).collect();
    let mut reads = Vec::new();
    for (part, scan) in parts.iter().zip(&scans) {
        reads.push(read::read(&part.text, part.file, scan, &mut report));
    }
    let read = include::joined(&parts, reads);
    if read.statements.is_empty() && !report.failed() {
        let message = format!("`{name}` declares nothing");
        report.add(
            Diagnostic::error(codes::EMPTY, message)
                .at(file, 0..0, "nothing here")
                .help("begin with a title: show \"My show\""),
        );
        return failed(report);
    }
    let (mut show, spans) = lower::lower(&read, &mut report);
    if let Some(show) = &mut show
        && show.title.is_empty()
    {
        let file = name.rsplit_once(['/', '\\']).map_or(name, |(_, file)| file);
        show.title = file.strip_suffix(".lxq").unwrap_or(file).to_owned();
    }
    let (diagnostics, left_out) = report.finish();
    Parsed {
        show,
        spans,
        diagnostics,
        left_out,
    }
}

fn failed(report: Report) -> Parsed {
    let (diagnostics, left_out) = report.finish();
    Parsed {
        show: None,
        spans: SpanMap::default(),
        diagnostics,
        left_out,
    }
}
