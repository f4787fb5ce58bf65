//! Quick fixes from the help of diagnostics: a replacement is offered when the show then has fewer
//! errors.

use std::collections::BTreeMap;
use std::ops::Range;

use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, Diagnostic, TextEdit, Uri, WorkspaceEdit,
};

use super::open_show::OpenShow;
use super::text::{Encoding, Lines};
use footlight_show::diagnostic::Severity;
use footlight_show::lang;

/// Most fixes tried for one diagnostic.
const TRIED: usize = 6;

/// The fixes for diagnostics within a range of a file of the show.
pub fn actions(
    show: &OpenShow,
    (text, uri): (&str, &Uri),
    range: lsp_types::Range,
    encoding: Encoding,
    own: impl Fn(usize) -> bool,
    shown: impl Fn(&footlight_show::diagnostic::Diagnostic) -> Diagnostic,
) -> Vec<CodeActionOrCommand> {
    let lines = Lines::new(text, encoding);
    let asked = lines.bytes(range);
    let mut out = Vec::new();
    for diagnostic in &show.diagnostics().list {
        let Some(label) = diagnostic.labels.first().filter(|label| own(label.file)) else {
            continue;
        };
        if label.span.end < asked.start || label.span.start > asked.end {
            continue;
        }
        let here = text.get(label.span.clone()).unwrap_or("");
        let offered = diagnostic.help.iter().flat_map(|help| typed(help, here));
        let is_surplus = diagnostic.help.iter().any(|h| h.starts_with("remove it"));
        let offered = offered.map(str::to_owned).chain(habit(here));
        let offered = offered.chain(is_surplus.then(String::new));
        let offered = offered.map(|offered| (label.span.clone(), offered));
        let next = diagnostic.labels.get(1).map(|label| label.span.start);
        let closed = (here == "{").then(|| closing(text, label.span.start, next));
        for (span, offered) in closed.into_iter().chain(offered).take(TRIED) {
            let mut mended = text.to_owned();
            mended.replace_range(span.clone(), &offered);
            // Only the show's own file can be tried alone.
            if label.file == 0
                && errors(&show.diagnostics_of(&mended)) >= errors(show.diagnostics())
            {
                continue;
            }
            if label.file != 0
                && !diagnostic
                    .help
                    .iter()
                    .any(|h| h.starts_with("did you mean"))
            {
                continue;
            }
            let title = if offered.is_empty() {
                format!("remove `{here}`")
            } else {
                format!("write `{}`", offered.trim())
            };
            let edit = TextEdit::new(lines.range(&span), offered);
            let changes = BTreeMap::from([(uri.to_string(), (uri.clone(), vec![edit]))]);
            out.push(CodeActionOrCommand::CodeAction(CodeAction {
                title,
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![shown(diagnostic)]),
                edit: Some(WorkspaceEdit {
                    changes: Some(changes.into_values().collect()),
                    ..WorkspaceEdit::default()
                }),
                is_preferred: Some(true),
                ..CodeAction::default()
            }));
        }
    }
    out
}

/// Position and text of the brace that closes the one at `open`: before the next statement, or at
/// the end.
fn closing(text: &str, open: usize, next: Option<usize>) -> (Range<usize>, String) {
    let before = text.get(..next.unwrap_or(text.len())).unwrap_or(text);
    let end = before.trim_end().len();
    // A brace after a line comment would be part of it.
    let is_long = text.get(open..end).unwrap_or("").contains(['\n', '/']);
    let brace = if is_long { "\n}" } else { " }" };
    (end..end, brace.to_owned())
}

/// Text between backquotes in a line of help, except examples: a suggested name, or words that
/// share names and numbers with the text `here`.
fn typed<'h>(help: &'h str, here: &'h str) -> impl Iterator<Item = &'h str> {
    let is_meant = help.starts_with("did you mean");
    let odd = help.split('`').skip(1).step_by(2);
    let is_own = |word: &str| {
        let word = word.trim_matches(|c: char| "{},()%".contains(c));
        // The writer has to choose a level.
        let known = !["full", "out"].contains(&word)
            && (lang::words().contains(&word) || lang::keywords().contains(&word));
        word.is_empty() || known || here.contains(word)
    };
    odd.filter(move |text| !text.is_empty() && (is_meant || text.split_whitespace().all(is_own)))
}

/// Words of desks' command lines, and their replacements.
const HABITS: [(&str, &str); 3] = [("at", ""), ("@", ""), ("in", "time")];

/// The text `here` with its first word replaced, if that is such a word.
fn habit(here: &str) -> Option<String> {
    HABITS.iter().find_map(|(habit, meant)| {
        let rest = here.strip_prefix(habit)?;
        let is_word = rest.is_empty() || rest.starts_with(' ');
        is_word.then(|| format!("{meant}{rest}").trim_start().to_owned())
    })
}

fn errors(diagnostics: &footlight_show::diagnostic::Diagnostics) -> usize {
    let list = diagnostics.list.iter();
    list.filter(|d| d.severity == Severity::Error).count()
}
