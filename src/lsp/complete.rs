//! Completion.

use std::ops::Range;
use std::path::Path;

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionTextEdit, Documentation, MarkupContent,
    MarkupKind, TextEdit,
};

use super::hover::of_quantity;
use super::open_show::{OpenShow, statement_at};
use super::outline::endings;
use super::text::{Encoding, Lines};
use footlight_host::files::normal;
use footlight_prompt::{help_of, help_of_word};
use footlight_show::lang::{self, Token};

/// Most files offered from a folder.
const FILES: usize = 200;
/// Most names offered with their statements, which are looked up in the text.
const EXPLAINED: usize = 40;

/// Completions at a place of the text.
pub fn complete(show: &OpenShow, text: &str, at: usize, encoding: Encoding) -> Vec<CompletionItem> {
    let typed = text.get(lang::statement_start(text, at)..at).unwrap_or("");
    let tokens = lang::tokens(typed);
    let (words, start): (Vec<String>, usize) = match tokens.last() {
        Some((range, Token::Text)) if is_open(typed, range) => {
            let before = tokens.len().checked_sub(2).and_then(|i| tokens.get(i));
            let word = before.and_then(|(range, _)| typed.get(range.clone()));
            let Some(endings) = word.and_then(endings) else {
                return Vec::new();
            };
            let inner = typed.get(range.start + 1..).unwrap_or("");
            let mut files = files(show, inner);
            files.retain(|file| {
                let ending = file.rsplit_once('.').map_or("", |(_, ending)| ending);
                file.ends_with('/') || endings.contains(&ending.to_ascii_lowercase().as_str())
            });
            files.truncate(FILES);
            (files, at - inner.len())
        }
        Some((range, Token::Comment)) if range.end == typed.len() => return Vec::new(),
        _ => {
            let completion = show.vocabulary().complete_statement(typed);
            let start = at - (typed.len() - completion.start);
            (completion.words, start)
        }
    };
    let range = Lines::new(text, encoding).range(&(start..at));
    let statement = typed.split_whitespace().next().unwrap_or("");
    let with_places = words.len() <= EXPLAINED;
    let before = text
        .get(..start)
        .unwrap_or("")
        .split_whitespace()
        .next_back();
    let item = |word: String| {
        let (detail, documentation) = about(show, (statement, before), &word, with_places);
        CompletionItem {
            kind: Some(kind(&word)),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit::new(range, word.clone()))),
            label: word,
            detail,
            documentation: documentation.map(|value| {
                let kind = MarkupKind::Markdown;
                Documentation::MarkupContent(MarkupContent { kind, value })
            }),
            ..CompletionItem::default()
        }
    };
    words.into_iter().map(item).collect()
}

/// A word's kind in a few words, and documentation: the statement of a name, if requested, or the
/// manual's row for a word of the language.
fn about(
    show: &OpenShow,
    (statement, before): (&str, Option<&str>),
    word: &str,
    with_places: bool,
) -> (Option<String>, Option<String>) {
    if let Some(kind) = show.vocabulary().kind_of(word) {
        let place = Some(word).filter(|_| with_places);
        let place = place.and_then(|name| show.declaration_of(name));
        let own = place.and_then(|(text, place)| text.get(statement_at(text, place.range.start)?));
        return (
            Some(kind.to_owned()),
            own.map(|own| format!("```lxq\n{own}\n```")),
        );
    }
    if statement.is_empty() || statement == word {
        return match help_of(word) {
            Ok(help) => (
                Some("statement".to_owned()),
                Some(format!("```text\n{help}\n```")),
            ),
            Err(_) => (None, None),
        };
    }
    let (usage, meaning) = help_of_word(statement, word).unzip();
    let other = || match kind(word) {
        CompletionItemKind::UNIT if before == Some("cue") => Some(label_of(show, word)),
        CompletionItemKind::UNIT => of_quantity(word, before, statement).map(str::to_owned),
        CompletionItemKind::FILE if word.ends_with('/') => Some("folder".to_owned()),
        CompletionItemKind::FILE => Some("file".to_owned()),
        _ => None,
    };
    (usage.or_else(other), meaning)
}

/// Label of the cue with this number.
fn label_of(show: &OpenShow, number: &str) -> String {
    let mut cues = show.document().into_iter().flat_map(|d| &d.show().cues);
    let cue = cues.find(|cue| cue.number.to_string() == number);
    cue.map_or("the next number".to_owned(), |cue| {
        format!("cue \"{}\"", cue.label)
    })
}

/// True for a text without its closing quote.
fn is_open(typed: &str, range: &Range<usize>) -> bool {
    let text = typed.get(range.clone()).unwrap_or("");
    range.end == typed.len() && (text.len() == 1 || !text.ends_with('"'))
}

/// Files in the show's folder whose paths begin as typed.
fn files(show: &OpenShow, typed: &str) -> Vec<String> {
    let folder = show.path().parent().unwrap_or(Path::new(""));
    let (below, begun) = typed.rsplit_once('/').map_or(("", typed), |(b, n)| (b, n));
    let searched = normal(&folder.join(below));
    if !searched.starts_with(folder) {
        return Vec::new();
    }
    let entries = std::fs::read_dir(searched).into_iter().flatten().flatten();
    let path = |entry: std::fs::DirEntry| {
        let name = entry.file_name().into_string().ok()?;
        let is_offered = name.starts_with(begun) && !name.starts_with('.');
        let end = if entry.file_type().ok()?.is_dir() {
            "/"
        } else {
            ""
        };
        let below = if below.is_empty() {
            String::new()
        } else {
            format!("{below}/")
        };
        is_offered.then(|| format!("{below}{name}{end}"))
    };
    let mut out: Vec<String> = entries.take(20 * FILES).filter_map(path).collect();
    out.sort();
    out
}

fn kind(word: &str) -> CompletionItemKind {
    if word.starts_with(|c: char| c.is_ascii_digit()) {
        CompletionItemKind::UNIT
    } else if word.contains(['/', '.']) {
        CompletionItemKind::FILE
    } else if lang::keywords().contains(&word) || lang::words().contains(&word) {
        CompletionItemKind::KEYWORD
    } else {
        CompletionItemKind::VARIABLE
    }
}
