//! Positions of declarations in a text, and of new ones.

use std::ops::Range;

use super::change::{Action, Change, Splice};
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::names::nearest;
use crate::lang::scan::{self, Cut, STATEMENTS, comment_length, first_word, split_word};
use crate::units::CueNumber;

/// Identity of a declaration: statement word and name, number or path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    word: &'static str,
    name: String,
}

impl Key {
    /// Reads the key from the first two words of a statement.
    pub fn of(text: &str) -> Option<Key> {
        let (word, range) = heading(text)?;
        let name = text.get(range)?;
        let name = match word {
            // One spelling for each number: `2.50` is cue 2.5.
            "cue" => CueNumber::parse(name).map_or_else(|| name.to_owned(), |n| n.to_string()),
            _ => name.to_owned(),
        };
        Some(Key { word, name })
    }

    /// Key of the cue with this number.
    pub fn cue(number: CueNumber) -> Key {
        Key {
            word: "cue",
            name: number.to_string(),
        }
    }

    /// The change with this action.
    pub fn change(self, action: Action) -> Change {
        Change {
            kind: self.word,
            name: self.name,
            action,
        }
    }

    fn text(&self) -> String {
        format!("{} {}", self.word, self.name).trim_end().to_owned()
    }

    fn rank(&self) -> usize {
        STATEMENTS
            .iter()
            .position(|w| *w == self.word)
            .unwrap_or(STATEMENTS.len())
    }

    fn number(&self) -> Option<CueNumber> {
        CueNumber::parse(&self.name).filter(|_| self.word == "cue")
    }
}

/// The first word of a statement, and the range of its name, number or path, without quotes.
pub fn heading(text: &str) -> Option<(&'static str, Range<usize>)> {
    let (first, rest) = split_word(text.trim_start());
    let word = STATEMENTS.into_iter().find(|w| *w == first)?;
    let rest = after_blanks(rest);
    let at = text.len() - rest.len();
    let range = match word {
        "show" | "preview" | "haze" | "default" => 0..0,
        "cue" => {
            let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'));
            0..end.unwrap_or(rest.len())
        }
        // A figure is named by its position.
        "figure" => {
            let ends = [" height", " facing"].map(|word| rest.find(word).unwrap_or(rest.len()));
            let end = ends.into_iter().min().unwrap_or_default();
            0..rest.get(..end)?.trim_end().len()
        }
        _ if rest.starts_with('"') => 1..rest.get(1..)?.find('"')? + 1,
        _ => 0..first_word(rest).len(),
    };
    Some((word, at + range.start..at + range.end))
}

/// Name of a declaration: `cue 2.5`, `bank lamps`, `preview`.
pub fn name(text: &str) -> Option<String> {
    Key::of(text).map(|key| key.text())
}

/// Bytes of the declaration that `what` names, without the comments around it.
pub fn locate(source: &str, what: &str) -> Option<Range<usize>> {
    let wanted = Key::of(what)?;
    let cuts = scan::scan(source).cuts;
    find(&cuts, &wanted).map(|cut| cut.span.clone())
}

/// Finds the statement that `what` names, such as `cue 2.5`, and its key.
///
/// # Errors
/// One diagnostic when the text has no such declaration.
pub fn resolve<'c, 's>(
    cuts: &'c [Cut<'s>],
    what: &str,
) -> Result<(&'c Cut<'s>, Key), Vec<Diagnostic>> {
    let found = Key::of(what).and_then(|key| Some((find(cuts, &key)?, key)));
    found.ok_or_else(|| vec![not_found(cuts, what)])
}

fn not_found(cuts: &[Cut<'_>], what: &str) -> Diagnostic {
    let keys: Vec<String> = keys(cuts).map(|(key, _)| key.text()).collect();
    let message = format!("there is no `{}` in the show", what.trim());
    let diagnostic = Diagnostic::error(codes::UNKNOWN_NAME, message);
    match nearest(what.trim(), keys.iter().map(String::as_str)) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None if includes(cuts) => diagnostic.help(IN_ANOTHER_FILE),
        None => diagnostic.help("name it by kind and name, such as `cue 2.5` or `bank lamps`"),
    }
}

/// Advice for a declaration of an included file.
pub const IN_ANOTHER_FILE: &str = "what an included file declares is edited in that file";

/// True when the text includes others.
pub fn includes(cuts: &[Cut<'_>]) -> bool {
    keys(cuts).any(|(key, _)| key.word == "include")
}

fn keys<'c, 's>(cuts: &'c [Cut<'s>]) -> impl Iterator<Item = (Key, &'c Cut<'s>)> {
    cuts.iter()
        .filter_map(|cut| Some((Key::of(cut.text)?, cut)))
}

/// The statement that declares `wanted`.
pub fn find<'c, 's>(cuts: &'c [Cut<'s>], wanted: &Key) -> Option<&'c Cut<'s>> {
    let (_, cut) = keys(cuts).find(|(key, _)| key == wanted)?;
    Some(cut)
}

/// `text` without leading blanks and comments.
fn after_blanks(text: &str) -> &str {
    let mut rest = text.trim_start();
    while let Some(length) = comment_length(rest) {
        let (_, after) = rest.split_at(length);
        rest = after.trim_start();
    }
    rest
}

/// Replaces a declaration by `text`.
pub fn replaced(source: &str, cut: &Cut<'_>, text: &str) -> Splice {
    let indent = indent(source, cut.span.start).unwrap_or("");
    Splice {
        range: cut.span.clone(),
        text: fitted(text, indent, end_of_line(source)),
    }
}

/// Inserts the declaration `text` at its place in the order of declarations.
pub fn added(source: &str, cuts: &[Cut<'_>], text: &str, wanted: &Key) -> Splice {
    let end_of_line = end_of_line(source);
    let text = fitted(text, "", end_of_line);
    let keys: Vec<(Key, &Cut<'_>)> = keys(cuts).collect();
    if let Some(cut) = before(&keys, wanted) {
        let at = after_line(source, cut.span.end);
        let closed = source.get(..at).is_some_and(|t| t.ends_with('\n'));
        let text = if closed {
            format!("{text}{end_of_line}")
        } else {
            format!("{end_of_line}{text}")
        };
        return Splice {
            range: at..at,
            text,
        };
    }
    // The very first cue goes before the other cues, not before the show.
    let cue = keys
        .iter()
        .find(|(key, _)| wanted.word == "cue" && key.word == "cue");
    let at = match cue.or(keys.first()) {
        Some((_, cut)) if indent(source, cut.span.start).is_some() => {
            line_start(source, cut.span.start)
        }
        Some((_, cut)) => cut.span.start,
        None => source.len(),
    };
    let gap = if at == source.len() && !source.is_empty() && !source.ends_with('\n') {
        end_of_line
    } else {
        ""
    };
    Splice {
        range: at..at,
        text: format!("{gap}{text}{end_of_line}"),
    }
}

/// The declaration after which a new one goes.
fn before<'c, 's>(keys: &[(Key, &'c Cut<'s>)], wanted: &Key) -> Option<&'c Cut<'s>> {
    if let Some(number) = wanted.number()
        && keys.iter().any(|(key, _)| key.word == "cue")
    {
        let smaller = keys
            .iter()
            .filter_map(|(key, cut)| Some((key.number()?, *cut)));
        return smaller
            .filter(|(n, _)| *n < number)
            .max_by_key(|(n, _)| *n)
            .map(|(_, cut)| cut);
    }
    let same = keys.iter().rfind(|(key, _)| key.word == wanted.word);
    let earlier = || keys.iter().rfind(|(key, _)| key.rank() < wanted.rank());
    same.or_else(earlier).map(|(_, cut)| *cut)
}

/// The declaration with the indentation and line ends of its surroundings.
fn fitted(text: &str, indent: &str, end_of_line: &str) -> String {
    let plain = text.replace("\r\n", "\n");
    plain.replace('\n', &format!("{end_of_line}{indent}"))
}

/// The line ending of a text.
pub fn end_of_line(source: &str) -> &'static str {
    if source.contains("\r\n") {
        "\r\n"
    } else {
        "\n"
    }
}

/// Start of the line of a place.
pub fn line_start(source: &str, at: usize) -> usize {
    let before = source.get(..at).unwrap_or("");
    before.rfind('\n').map_or(0, |i| i + 1)
}

/// The blanks between the line start and a place; `None` when there is other text.
pub fn indent(source: &str, at: usize) -> Option<&str> {
    let before = source.get(line_start(source, at)..at)?;
    before.trim().is_empty().then_some(before)
}

/// Start of the line after a statement and the comments on its last line.
pub fn after_line(source: &str, end: usize) -> usize {
    let (_, mut rest) = source.split_at(end);
    while let Some(c) = rest.chars().next() {
        if c == '\n' {
            return source.len() - rest.len() + 1;
        }
        (_, rest) = rest.split_at(comment_length(rest).unwrap_or(c.len_utf8()));
    }
    source.len()
}

/// A statement's span, extended to the whole line if the line would be left empty.
pub fn with_line(source: &str, span: Range<usize>) -> Range<usize> {
    if indent(source, span.start).is_none() {
        return span;
    }
    let (start, end) = (line_start(source, span.start), after_line(source, span.end));
    let before = source.get(..start).unwrap_or("");
    let line = source.get(start..end).unwrap_or("");
    // A text whose last line has no end keeps none.
    let start = if line.ends_with('\n') {
        start
    } else {
        before
            .strip_suffix('\n')
            .map_or(start, |b| b.strip_suffix('\r').unwrap_or(b).len())
    };
    start..end
}
