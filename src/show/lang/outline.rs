//! The statements of a text that need not parse: their positions and names.

use super::format::format;
use super::{edit, scan, syntax};
use std::ops::Range;

/// Declarations of a text that parses, without cues, in order: the name (`bank lamps`) and the
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
    /// Its bytes, without surrounding blanks and comments.
    pub range: Range<usize>,
    /// Its first word.
    pub word: &'t str,
    /// Kind and name (`bank lamps`, `cue 2.5`), if it has them.
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

/// Names of the values in a text.
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

/// True when `text` begins with a statement word. `show` counts only before a title, and `view`
/// only before more than a name, because both are also commands of the prompt.
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

/// Start of the statement that contains byte `at`; a line at the margin outside all braces begins
/// another statement.
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
