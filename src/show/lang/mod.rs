//! The language of cue sheets: text in, [`Show`], places and diagnostics out.
//!
//! `scan` cuts a text into statements, `syntax` parses each by the grammar (`grammar/lxq.pest`),
//! `build` makes the tree of `ast`, `lower` resolves names and quantities and writes the model.
//! Invariants: every error of a file is reported in one run; time and memory are linear in the text
//! (within [`limits`]); a show comes out exactly when there is no error, and then keeps every
//! invariant of [`crate::model`].

mod ast;
mod beginning;
mod build;
pub mod codes;
pub mod edit;
mod explain;
mod format;
mod gels;
mod include;
mod levels;
pub mod limits;
mod lower;
mod names;
mod preview;
mod quantity;
mod read;
mod report;
mod scan;
mod syntax;
mod token;

use std::ops::Range;

use ast::Word;

pub use ast::Span;
pub use beginning::Beginning;
pub use edit::NamePlace;
pub use explain::{Page, explain, pages};
pub use format::format;
pub use gels::gels_of_table;
pub use levels::{SetLevel, levels};
pub use names::{Kind, is_reserved, nearest};
pub use preview::preview_statement;
pub use report::{Place, too_many};
pub use token::{Token, pieces, tokens};

use crate::diagnostic::{Diagnostic, Sources};
use crate::model::{NodeId, Show};
use crate::units::{Rgb, Time};
use footlight_host::files::{Files, Memory};
use report::Report;

/// Turns the model's node ids back into places.
#[derive(Clone, Debug, Default)]
pub struct SpanMap {
    spans: Vec<Span>,
}

impl SpanMap {
    /// The place of a node: the whole statement, but of a cue or a part only its word and number.
    pub fn get(&self, id: NodeId) -> Option<Span> {
        self.spans.get(id.0 as usize).copied()
    }

    fn add(&mut self, span: Span) -> NodeId {
        self.spans.push(span);
        NodeId(self.spans.len() as u32 - 1)
    }
}

/// What a text came to.
#[derive(Clone, Debug)]
pub struct Parsed {
    /// The show; `None` when there is an error among the diagnostics.
    pub show: Option<Show>,
    /// Places of its nodes.
    pub spans: SpanMap,
    /// Errors and warnings, in order of their places.
    pub diagnostics: Vec<Diagnostic>,
    /// How many warnings there are beside the first, which are kept.
    pub left_out: usize,
}

/// Reads a show from `text`, which joins `sources` under `name`.
///
/// A show without a `show` statement is called by the name of its file, without the ending.
/// It cannot include other files: see [`parse_with_files`].
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

fn too_large(name: &str, size: usize) -> Diagnostic {
    let message = format!(
        "`{name}` has {size} bytes; a show has {} at most",
        limits::FILE
    );
    Diagnostic::error(codes::TOO_LARGE, message)
}

/// The text of a file's bytes, without a byte order mark.
///
/// # Errors
/// A diagnostic without a place when the file is too large, binary or not UTF-8.
pub fn decode(name: &str, bytes: &[u8]) -> Result<String, Box<Diagnostic>> {
    if bytes.len() > limits::FILE {
        return Err(Box::new(too_large(name, bytes.len())));
    }
    let (what, at) = match (
        bytes.iter().position(|b| *b == 0),
        std::str::from_utf8(bytes),
    ) {
        (Some(_), _) if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") => {
            let message = format!("`{name}` looks like UTF-16");
            let help = "save it as UTF-8, which every editor offers";
            let refused = Diagnostic::error(codes::NOT_TEXT, message).help(help);
            return Err(Box::new(refused));
        }
        (Some(at), _) => (format!("not a text: byte {at} is zero"), at),
        (None, Err(error)) => {
            let at = error.valid_up_to();
            (format!("not UTF-8: byte {at} begins no character"), at)
        }
        (None, Ok(text)) => return Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned()),
    };
    let line = bytes.iter().take(at).filter(|b| **b == b'\n').count() + 1;
    let message = format!("`{name}` is {what}");
    let help = format!("the byte is in line {line}; a show is a text file in UTF-8");
    Err(Box::new(
        Diagnostic::error(codes::NOT_TEXT, message).help(help),
    ))
}

fn unquoted(word: Word<'_>) -> String {
    unquote(word.text)
}

/// A text without its quotes, and without the backslashes before quotes and backslashes. Any other
/// backslash stays, as in a path of Windows.
pub fn unquote(text: &str) -> String {
    let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
    let mut out = String::new();
    let mut chars = inner.unwrap_or(text).chars().peekable();
    while let Some(c) = chars.next() {
        match (c, chars.peek()) {
            ('\\', Some('"' | '\\')) => out.extend(chars.next()),
            _ => out.push(c),
        }
    }
    out
}

/// A text between quotes, as the language writes it.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A time as a show writes it: `5`, `1.5s`, `1:30`, `250ms`.
pub fn time(text: &str) -> Option<Time> {
    quantity::time(text).ok()
}

/// What a text that parses declares beside cues, in order: what each is (`bank lamps`), and its
/// canonical text.
pub fn declarations(text: &str) -> Vec<(String, String)> {
    let mut out = Vec::new();
    for cut in scan::scan(text).cuts.iter().filter(|cut| !cut.is_cue()) {
        if let (Some(name), Ok(formatted)) = (edit::name(cut.text), format(cut.text)) {
            out.push((name, formatted.trim_end().to_owned()));
        }
    }
    out
}

/// A statement of a text, which need not parse.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outlined<'t> {
    /// Its bytes, without the blanks and comments around it.
    pub range: Range<usize>,
    /// The word that it begins with.
    pub word: &'t str,
    /// Kind and name (`bank lamps`, `cue 2.5`), where it has them.
    pub name: Option<String>,
}

/// The statements of a text, in order.
pub fn outline(text: &str) -> Vec<Outlined<'_>> {
    let outlined = |cut: scan::Cut<'_>| -> Outlined<'_> {
        let range = cut.span.clone();
        let word = text.get(range.start..).map_or("", scan::first_word);
        Outlined {
            word,
            name: edit::name(cut.text),
            range,
        }
    };
    scan::scan(text).cuts.into_iter().map(outlined).collect()
}

/// The colour that `#ffb36b`, `#fb6` or `#orange` is.
pub fn colour(text: &str) -> Option<Rgb> {
    let written = text.strip_prefix('#')?;
    let coded = lower::hex(written).or_else(|| lower::named(written))?;
    Some(Rgb::from_srgb8(coded))
}

/// The names that a text gives to values.
pub fn values(text: &str) -> Vec<String> {
    let cuts = scan::scan(text).cuts.into_iter();
    let names = cuts.filter_map(|cut| edit::name(cut.text));
    let value = |name: String| name.strip_prefix("let ").map(str::to_owned);
    names.filter_map(value).collect()
}

/// The words that begin statements.
pub fn keywords() -> &'static [&'static str] {
    &scan::STATEMENTS
}

/// The words that mean something inside statements.
pub fn words() -> Vec<&'static str> {
    syntax::inner_words().collect()
}

/// True when `text` begins with a statement word. `show` is one only before a title and `view` only
/// before more than a name, since they are also what a user says to be shown something.
pub fn is_declaration(text: &str) -> bool {
    let (word, rest) = scan::split_word(text.trim_start());
    let rest = rest.trim();
    match word {
        "show" => rest.starts_with('"'),
        "view" => rest.contains(char::is_whitespace),
        _ => scan::STATEMENTS.contains(&word),
    }
}

/// True when a typed declaration is finished: braces, quotes and comments are closed, and it does
/// not end in `=`, `,` or `+`.
pub fn statement_complete(text: &str) -> bool {
    !scan::scan(text).open
}

/// Where the statement begins that is typed at byte `at`: a line at the margin outside all braces
/// begins another one.
pub fn statement_start(text: &str, at: usize) -> usize {
    let before = text.get(..at).unwrap_or(text);
    let line = before.rfind('\n').map_or(0, |i| i + 1);
    let Some(last) = outline(before).pop() else {
        return line;
    };
    let own = before.get(last.range.start..).unwrap_or("");
    let margin = before.get(line..);
    let margin = margin.is_some_and(|l| !l.starts_with([' ', '\t']));
    let is_another = line > last.range.start && margin && statement_complete(own);
    if is_another { line } else { last.range.start }
}

#[cfg(test)]
mod tests;
