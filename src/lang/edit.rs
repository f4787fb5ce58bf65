//! Edits of a show's text by whole declarations, as the REPL makes them.
//!
//! Invariants: every byte outside the declarations that change stays as it is, comments, layout
//! and line ends included; a text whose statements cannot be told apart is never edited. Names
//! are not resolved here: the edited text is to be parsed, and dropped if it has errors.

use std::ops::Range;

use super::names::nearest;
use super::read;
use super::report::Report;
use super::scan::{self, Cut, STATEMENTS, first_word};
use super::{codes, limits};
use crate::diagnostic::Diagnostic;
use crate::units::CueNumber;

/// Declarations in one edit; each costs a pass over the source.
const MOST: usize = 100;

/// A text after an edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edited {
    /// The whole new text.
    pub source: String,
    /// What was done, in order.
    pub changes: Vec<Change>,
}

/// What happened to one declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The declaration in words: `cue 2.5`, `bank lamps`, `preview`.
    pub what: String,
    /// It stood there already.
    pub replaced: bool,
}

/// What a declaration declares: statement word and name, number or path.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key {
    word: &'static str,
    name: String,
}

impl Key {
    fn text(&self) -> String {
        format!("{} {}", self.word, self.name).trim_end().to_owned()
    }

    fn rank(&self) -> usize {
        STATEMENTS
            .iter()
            .position(|w| *w == self.word)
            .unwrap_or(STATEMENTS.len())
    }

    fn cue(&self) -> Option<CueNumber> {
        CueNumber::parse(&self.name).filter(|_| self.word == "cue")
    }
}

/// Puts the declarations of `statement` into `source`: each replaces the one of the same kind and
/// name (a cue: of the same number; `show`, `preview`, `default`: the only one) in its place. What
/// is new goes after its kind, a cue into the order of numbers.
///
/// # Errors
/// Diagnostics, whose places are in `statement` (as file 0), when it does not parse; without
/// places when `source` itself cannot be cut into statements. The source is then untouched.
pub fn apply(source: &str, statement: &str) -> Result<Edited, Vec<Diagnostic>> {
    let mut report = Report::default();
    if statement.len() > limits::STATEMENT {
        let message = format!("more than {} bytes at once", limits::STATEMENT);
        return Err(vec![Diagnostic::error(codes::TOO_LARGE, message)]);
    }
    let scan = scan::scan(statement);
    let typed = read::read(statement, 0, &scan, None, &mut report);
    if report.failed() {
        return Err(report.finish());
    }
    if typed.statements.is_empty() {
        let message = "there is no declaration in this";
        return Err(vec![Diagnostic::error(codes::EMPTY, message)]);
    }
    if typed.statements.len() > MOST {
        let message = format!("more than {MOST} declarations at once");
        return Err(vec![Diagnostic::error(codes::TOO_LARGE, message)]);
    }
    let mut out = Edited {
        source: source.to_owned(),
        changes: Vec::new(),
    };
    for cut in scan.cuts {
        let text = statement.get(cut.span).unwrap_or("");
        let Some(key) = key(text) else { continue };
        let change = one(&out.source, text, &key)?;
        out.source = change.0;
        out.changes.push(Change {
            what: key.text(),
            replaced: change.1,
        });
    }
    Ok(out)
}

/// Takes the declaration that `what` names (`cue 2.5`, `bank lamps`, `preview`) out of `source`,
/// with the line it leaves empty.
///
/// # Errors
/// A diagnostic without a place when there is no such declaration.
pub fn remove(source: &str, what: &str) -> Result<Edited, Vec<Diagnostic>> {
    let Some(span) = locate(source, what) else {
        return Err(vec![not_found(source, what)]);
    };
    let line = line_start(source, span.start);
    let alone = source
        .get(line..span.start)
        .is_some_and(|t| t.trim().is_empty());
    let range = if alone {
        line..after_line(source, span.end)
    } else {
        span
    };
    let what = key(what).map_or_else(|| what.to_owned(), |k| k.text());
    Ok(Edited {
        source: spliced(source, range, ""),
        changes: vec![Change {
            what,
            replaced: true,
        }],
    })
}

/// What a declaration declares: `cue 2.5`, `bank lamps`, `preview`.
pub fn name(text: &str) -> Option<String> {
    key(text).map(|key| key.text())
}

/// The bytes of the declaration that `what` names, without the comments around it.
pub fn locate(source: &str, what: &str) -> Option<Range<usize>> {
    let wanted = key(what)?;
    let cuts = scan::scan(source).cuts;
    find(source, &cuts, &wanted).map(|cut| cut.span.clone())
}

fn not_found(source: &str, what: &str) -> Diagnostic {
    let keys: Vec<String> = scan::scan(source)
        .cuts
        .iter()
        .filter_map(|c| key(source.get(c.span.clone())?))
        .map(|k| k.text())
        .collect();
    let message = format!("there is no `{}` in the show", what.trim());
    let diagnostic = Diagnostic::error(codes::UNKNOWN_NAME, message);
    match nearest(what.trim(), keys.iter().map(String::as_str)) {
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None => diagnostic.help("name it by kind and name, such as `cue 2.5` or `bank lamps`"),
    }
}

/// What a statement declares, from its first two words.
fn key(text: &str) -> Option<Key> {
    let text = text.trim_start();
    let first = first_word(text);
    let word = STATEMENTS.into_iter().find(|w| *w == first)?;
    let rest = after_blanks(text.get(first.len()..)?);
    let name = match word {
        "show" | "preview" | "default" => String::new(),
        "cue" => {
            let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'));
            let number = rest.get(..end.unwrap_or(rest.len()))?;
            // One number, one spelling: `2.50` is cue 2.5.
            CueNumber::parse(number).map_or_else(|| number.to_owned(), |n| n.to_string())
        }
        _ if rest.starts_with('"') => {
            let end = rest.get(1..)?.find('"')? + 2;
            rest.get(1..end - 1)?.to_owned()
        }
        _ => first_word(rest).to_owned(),
    };
    Some(Key { word, name })
}

/// `text` without leading blanks and comments.
fn after_blanks(text: &str) -> &str {
    let mut rest = text.trim_start();
    loop {
        let skipped = if let Some(comment) = rest.strip_prefix("//") {
            comment.find('\n').and_then(|i| comment.get(i..))
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").and_then(|i| comment.get(i + 2..))
        } else {
            return rest;
        };
        rest = skipped.unwrap_or("").trim_start();
    }
}

fn find<'c>(source: &str, cuts: &'c [Cut], wanted: &Key) -> Option<&'c Cut> {
    cuts.iter()
        .find(|cut| source.get(cut.span.clone()).and_then(key).as_ref() == Some(wanted))
}

/// The source with one declaration put in, and whether it replaced another.
fn one(source: &str, text: &str, wanted: &Key) -> Result<(String, bool), Vec<Diagnostic>> {
    let scan = scan::scan(source);
    if !scan.faults.is_empty() {
        let message = "the show's own text has open braces, quotes or comments";
        let help = "mend the file first; `check` shows where";
        return Err(vec![Diagnostic::error(codes::UNCLOSED, message).help(help)]);
    }
    let end_of_line = if source.contains("\r\n") {
        "\r\n"
    } else {
        "\n"
    };
    if let Some(cut) = find(source, &scan.cuts, wanted) {
        let line = source.get(line_start(source, cut.span.start)..cut.span.start);
        let indent = line.filter(|t| t.trim().is_empty()).unwrap_or("");
        let text = fitted(text, indent, end_of_line);
        return Ok((spliced(source, cut.span.clone(), &text), true));
    }
    let text = fitted(text, "", end_of_line);
    let keys = scan.cuts.iter().filter_map(|cut| {
        let key = source.get(cut.span.clone()).and_then(key)?;
        Some((key, cut))
    });
    let keys: Vec<(Key, &Cut)> = keys.collect();
    let source = match before(&keys, wanted) {
        Some(cut) => {
            let at = after_line(source, cut.span.end);
            let closed = at == 0 || source.get(..at).is_some_and(|t| t.ends_with('\n'));
            let text = if closed {
                format!("{text}{end_of_line}")
            } else {
                format!("{end_of_line}{text}")
            };
            spliced(source, at..at, &text)
        }
        None => {
            let next = keys.first().map_or(source.len(), |(_, cut)| cut.span.start);
            // The first cue of all goes before the other cues, not before the show.
            let cue = keys
                .iter()
                .find(|(key, _)| wanted.word == "cue" && key.word == "cue");
            let at = cue.map_or(next, |(_, cut)| cut.span.start);
            let gap = if at == source.len() && !source.is_empty() && !source.ends_with('\n') {
                end_of_line
            } else {
                ""
            };
            spliced(source, at..at, &format!("{gap}{text}{end_of_line}"))
        }
    };
    Ok((source, false))
}

/// The declaration after which a new one goes.
fn before<'c>(keys: &[(Key, &'c Cut)], wanted: &Key) -> Option<&'c Cut> {
    if let Some(number) = wanted.cue()
        && keys.iter().any(|(key, _)| key.word == "cue")
    {
        let smaller = keys
            .iter()
            .filter_map(|(key, cut)| Some((key.cue()?, *cut)));
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

fn spliced(source: &str, range: Range<usize>, text: &str) -> String {
    let before = source.get(..range.start).unwrap_or("");
    let after = source.get(range.end..).unwrap_or("");
    [before, text, after].concat()
}

fn line_start(source: &str, at: usize) -> usize {
    let before = source.get(..at).unwrap_or("");
    before.rfind('\n').map_or(0, |i| i + 1)
}

/// Where the line after a statement begins, which is after the comments beside it.
fn after_line(source: &str, end: usize) -> usize {
    let rest = source.get(end..).unwrap_or("");
    let mut at = 0;
    while let Some(here) = rest.get(at..) {
        let step = if here.starts_with("/*") {
            here.find("*/").map(|i| i + 2)
        } else if here.starts_with("//") {
            here.find('\n')
        } else if here.starts_with('\n') {
            return end + at + 1;
        } else {
            here.chars().next().map(char::len_utf8)
        };
        match step {
            Some(step) => at += step,
            None => break,
        }
    }
    source.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHOW: &str = "// top\nshow \"A\"\n\nbank a = x  // one\nbank b = y /* two\n lines */\n\n// the cues\ncue 1 { a 5 }\n  cue 3 {\n    a 6 // six\n  } // three\n";

    fn applied(source: &str, statement: &str) -> String {
        apply(source, statement).unwrap().source
    }

    #[test]
    fn a_declaration_replaces_its_namesake_in_place() {
        assert_eq!(
            applied(SHOW, "bank a = z channel 4"),
            SHOW.replace("bank a = x", "bank a = z channel 4")
        );
        let two = apply(SHOW, " show \"B\"\ncue 3.0 {\n a 7\n}\n").unwrap();
        let expected = SHOW
            .replace("show \"A\"", "show \"B\"")
            .replace("cue 3 {\n    a 6 // six\n  }", "cue 3.0 {\n   a 7\n  }");
        assert_eq!(two.source, expected);
        assert!(two.changes.iter().all(|c| c.replaced));
        assert_eq!(two.changes[1].what, "cue 3");
    }

    #[test]
    fn a_new_declaration_goes_after_its_kind_and_a_cue_into_its_order() {
        let after = |line: &str, new: &str| SHOW.replace(line, &format!("{line}{new}"));
        assert_eq!(
            applied(SHOW, "bank c = z"),
            after(" lines */\n", "bank c = z\n")
        );
        assert_eq!(
            applied(SHOW, "cue 2 { }"),
            after("cue 1 { a 5 }\n", "cue 2 { }\n")
        );
        assert_eq!(
            applied(SHOW, "cue 9 { }"),
            after("// three\n", "cue 9 { }\n")
        );
        assert_eq!(
            applied(SHOW, "cue 0.5 { }"),
            after("// the cues\n", "cue 0.5 { }\n")
        );
        assert_eq!(
            applied(SHOW, "view v from 0,0,0"),
            after("show \"A\"\n", "view v from 0,0,0\n")
        );
        assert_eq!(applied("", "cue 1 { }"), "cue 1 { }\n");
        assert_eq!(applied("cue 1 { }", "cue 2 { }"), "cue 1 { }\ncue 2 { }");
        assert_eq!(
            applied("cue 1 { }\r\n", "cue 2 {\n}"),
            "cue 1 { }\r\ncue 2 {\r\n}\r\n"
        );
        assert_eq!(
            applied("bank a = b", "show \"A\""),
            "show \"A\"\nbank a = b"
        );
    }

    #[test]
    fn removing_takes_the_line() {
        assert_eq!(
            remove(SHOW, "bank a").unwrap().source,
            SHOW.replace("bank a = x  // one\n", "")
        );
        assert_eq!(
            remove(SHOW, "cue 3").unwrap().source,
            SHOW.replace("  cue 3 {\n    a 6 // six\n  } // three\n", "")
        );
        let error = remove(SHOW, "bank c").unwrap_err();
        assert_eq!(error[0].help, ["did you mean `bank a`?"]);
        assert_eq!(&SHOW[locate(SHOW, "cue 1.0").unwrap()], "cue 1 { a 5 }");
    }

    #[test]
    fn a_mistake_leaves_everything() {
        assert_eq!(
            apply(SHOW, "cue 2 { lamps }}").unwrap_err()[0].code,
            codes::STRAY_BRACE
        );
        assert_eq!(apply(SHOW, "bank = 3").unwrap_err()[0].code, codes::SYNTAX);
        assert_eq!(
            apply("cue 1 {", "cue 2 { }").unwrap_err()[0].code,
            codes::UNCLOSED
        );
        assert_eq!(apply(SHOW, "// nothing").unwrap_err()[0].code, codes::EMPTY);
    }
}
