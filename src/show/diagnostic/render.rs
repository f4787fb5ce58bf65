//! Diagnostics as text: for people, for `grep`, for programs.
//!
//! Only the lines shown reach the renderer, cut to a readable length, so that a line of 100 KB or a
//! file of 16 MB costs nothing. Hidden characters are made visible before the renderer sets its
//! underlines, because that changes their widths.

use std::collections::BTreeMap;
use std::ops::Range;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet};
use serde_json::json;

use super::{Diagnostic, Label, Severity, Sources};
use crate::printable::{self, Printable, boundary, visible};

/// A format of diagnostics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// For people, with the lines of the source.
    Plain,
    /// Like `Plain`, in colour, for a terminal.
    Colour,
    /// One line each, as editors read them: `file:line:column: error[E010]: message`.
    Short,
    /// For programs: an array of objects, on one line. Lines and columns count from 1, columns in
    /// characters; `start` and `end` are bytes. The code is null where there is none.
    Json,
}

impl Style {
    /// True for the styles that people read, which may end with a summary; the other styles hold
    /// diagnostics and nothing else.
    pub fn is_for_people(self) -> bool {
        matches!(self, Style::Plain | Style::Colour)
    }
}

/// Diagnostics shown to people at once.
pub const MOST: usize = 20;

/// Characters of a source line shown.
const WIDTH: usize = 120;
/// Characters shown before the place that matters.
const BEFORE: usize = 40;
/// Places further apart than this are shown apart.
const TOGETHER: usize = 8;

/// Writes diagnostics; ends with a newline unless empty. People get [`MOST`] of them and the number
/// of the rest; where there are more, errors come before warnings.
pub fn render(diagnostics: &[Diagnostic], sources: &Sources, style: Style) -> Printable {
    render_some((diagnostics, 0), sources, style)
}

/// Like [`render`], with the number of warnings left out.
pub(super) fn render_some(
    (diagnostics, left_out): (&[Diagnostic], usize),
    sources: &Sources,
    style: Style,
) -> Printable {
    let rest = || {
        let message = format!("{left_out} more warnings are left out");
        Diagnostic::warning("", message)
    };
    let rest = (left_out > 0).then(rest);
    let all = diagnostics.iter().chain(&rest);
    let mut index = Index::of(sources);
    match style {
        Style::Json => index.json(all).into(),
        Style::Short => {
            let lines: String = all.map(|d| index.short(d)).collect();
            lines.into()
        }
        Style::Plain => index.long(diagnostics, left_out, &Renderer::plain()).into(),
        Style::Colour => {
            let renderer = Renderer::styled();
            Printable::coloured(&index.long(diagnostics, left_out, &renderer))
        }
    }
}

fn severity(diagnostic: &Diagnostic) -> &'static str {
    match diagnostic.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

/// Line starts of the sources, found once for each file.
pub(super) struct Index<'a> {
    sources: &'a Sources,
    lines: BTreeMap<usize, Vec<usize>>,
}

/// A piece of a source, ready to be shown.
type Excerpt = Snippet<'static, Annotation<'static>>;

/// File, first and last line, and the labels in them; true for the main one.
type Near<'l> = (usize, usize, usize, Vec<(&'l Label, bool)>);

impl<'a> Index<'a> {
    pub(super) fn of(sources: &'a Sources) -> Index<'a> {
        Index {
            sources,
            lines: BTreeMap::new(),
        }
    }

    fn text(&self, file: usize) -> (&'a str, &'a str) {
        self.sources.get(file).unwrap_or(("", ""))
    }

    fn starts(&mut self, file: usize) -> &[usize] {
        let (_, text) = self.text(file);
        self.lines.entry(file).or_insert_with(|| {
            let after = text.bytes().enumerate().filter(|(_, b)| *b == b'\n');
            std::iter::once(0)
                .chain(after.map(|(i, _)| i + 1))
                .collect()
        })
    }

    /// Line of a byte, from 0.
    fn line(&mut self, file: usize, byte: usize) -> usize {
        let after = self.starts(file).partition_point(|start| *start <= byte);
        after.saturating_sub(1)
    }

    /// Bytes of a line, without its end.
    fn line_range(&mut self, file: usize, line: usize) -> Range<usize> {
        let (_, text) = self.text(file);
        let starts = self.starts(file);
        let start = starts.get(line).copied().unwrap_or(text.len());
        let end = starts.get(line + 1).map_or(text.len(), |next| next - 1);
        let end = end.max(start);
        let cr = text.get(start..end).is_some_and(|t| t.ends_with('\r'));
        start..end - usize::from(cr)
    }

    /// Line and column of a byte, both from 1.
    pub(super) fn position(&mut self, file: usize, byte: usize) -> (usize, usize) {
        let byte = boundary(self.text(file).1, byte);
        let line = self.line(file, byte);
        let start = self.line_range(file, line).start;
        let before = self.text(file).1.get(start..byte);
        (line + 1, before.map_or(0, |t| t.chars().count()) + 1)
    }

    fn short(&mut self, diagnostic: &Diagnostic) -> String {
        let place = diagnostic.labels.first().map_or(String::new(), |label| {
            let (line, column) = self.position(label.file, label.span.start);
            format!("{}:{line}:{column}: ", self.text(label.file).0)
        });
        let kind = severity(diagnostic);
        let code = match diagnostic.code {
            "" => String::new(),
            code => format!("[{code}]"),
        };
        let line = format!("{place}{kind}{code}: {}", diagnostic.message);
        visible(&line).into_owned() + "\n"
    }

    fn json<'d>(&mut self, diagnostics: impl Iterator<Item = &'d Diagnostic>) -> String {
        let all: Vec<_> = diagnostics
            .map(|d| {
                let labels: Vec<_> = d.labels.iter().map(|l| self.json_label(l)).collect();
                json!({
                    "severity": severity(d),
                    "code": (!d.code.is_empty()).then_some(d.code),
                    "message": d.message,
                    "labels": labels,
                    "help": d.help,
                })
            })
            .collect();
        printable::json(&serde_json::Value::Array(all).to_string()) + "\n"
    }

    fn json_label(&mut self, label: &Label) -> serde_json::Value {
        let (line, column) = self.position(label.file, label.span.start);
        let (end_line, end_column) = self.position(label.file, label.span.end);
        json!({
            "file": self.text(label.file).0,
            "start": label.span.start,
            "end": label.span.end,
            "line": line,
            "column": column,
            "end_line": end_line,
            "end_column": end_column,
            "text": label.text,
        })
    }

    fn long(&mut self, diagnostics: &[Diagnostic], left_out: usize, renderer: &Renderer) -> String {
        let mut out = String::new();
        let mut shown: Vec<&Diagnostic> = diagnostics.iter().collect();
        if shown.len() > MOST {
            shown.sort_by_key(|d| d.severity == Severity::Warning);
        }
        for diagnostic in shown.iter().take(MOST) {
            out += &self.report(diagnostic, renderer);
            out += "\n\n";
        }
        let more = diagnostics.len().saturating_sub(MOST) + left_out;
        if more > 0 {
            out += &format!("and {more} more\n\n");
        }
        // One blank line between diagnostics, none at the end.
        if !out.is_empty() {
            out.pop();
        }
        out
    }

    fn report(&mut self, diagnostic: &Diagnostic, renderer: &Renderer) -> String {
        let level = match diagnostic.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let title = level.primary_title(visible(&diagnostic.message));
        let title = match diagnostic.code {
            "" => title,
            code => title.id(code),
        };
        let mut group = Group::with_title(title);
        for excerpt in self.excerpts(&diagnostic.labels) {
            group = group.element(excerpt);
        }
        for help in &diagnostic.help {
            group = group.element(Level::HELP.message(visible(help)));
        }
        renderer.render(&[group])
    }

    /// Labels that are near each other in one file share an excerpt.
    fn excerpts(&mut self, labels: &[Label]) -> Vec<Excerpt> {
        let mut groups: Vec<Near<'_>> = Vec::new();
        for (i, label) in labels.iter().enumerate() {
            let line = self.line(label.file, label.span.start);
            let near = groups.iter_mut().find(|(file, first, last, _)| {
                *file == label.file && line + TOGETHER >= *first && line <= *last + TOGETHER
            });
            match near {
                Some((_, first, last, members)) => {
                    (*first, *last) = ((*first).min(line), (*last).max(line));
                    members.push((label, i == 0));
                }
                None => groups.push((label.file, line, line, vec![(label, i == 0)])),
            }
        }
        let each = groups.into_iter();
        each.map(|(file, first, last, labels)| self.excerpt(file, first..last + 1, &labels))
            .collect()
    }

    fn excerpt(&mut self, file: usize, lines: Range<usize>, labels: &[(&Label, bool)]) -> Excerpt {
        let (name, source) = self.text(file);
        let first_line = lines.start + 1;
        let (mut text, mut places) = (String::new(), Vec::new());
        for line in lines {
            let range = self.line_range(file, line);
            let here = |l: &&(&Label, bool)| (range.start..=range.end).contains(&l.0.span.start);
            let mut labels: Vec<_> = labels.iter().filter(here).collect();
            labels.sort_by_key(|(label, main)| (!main, label.span.start));
            let centre = labels.first().map_or(range.start, |(l, _)| l.span.start);
            let shown = window(source, range.clone(), centre);
            let cut_before = if shown.start > range.start { "…" } else { "" };
            let cut_after = if shown.end < range.end { "…" } else { "" };
            let base = text.len() + cut_before.len();
            for (label, main) in labels {
                // The first line of a longer piece stands for it.
                let start = boundary(source, label.span.start.clamp(shown.start, shown.end));
                let end = boundary(source, label.span.end.clamp(start, shown.end));
                let printed = |byte| seen(source.get(shown.start..byte).unwrap_or("")).len();
                let place = base + printed(start)..base + printed(end);
                places.push(annotation(place, label, *main));
            }
            let piece = seen(source.get(shown).unwrap_or(""));
            text += &[cut_before, &piece, cut_after, "\n"].concat();
        }
        text.pop();
        Snippet::source(text)
            .line_start(first_line)
            .path(visible(name).into_owned())
            .annotations(places)
    }
}

/// A piece of a line as shown, except for tabs, which the renderer aligns.
fn seen(piece: &str) -> String {
    let tab = |c: char| if c == '\t' { c } else { printable::shown(c) };
    piece.chars().map(tab).collect()
}

/// The part of a line shown: the whole line, or [`WIDTH`] characters around `centre`.
fn window(source: &str, line: Range<usize>, centre: usize) -> Range<usize> {
    let text = source.get(line.clone()).unwrap_or("");
    if text.len() <= WIDTH {
        return line;
    }
    let before = source.get(line.start..boundary(source, centre));
    let mut before = before.unwrap_or("").char_indices().rev();
    let skip = before.nth(BEFORE).map_or(0, |(i, _)| i);
    let rest = text.get(skip..).unwrap_or("");
    let mut letters = rest.char_indices();
    let length = letters.nth(WIDTH).map_or(rest.len(), |(i, _)| i);
    line.start + skip..line.start + skip + length
}

/// An annotation of a place in an excerpt.
fn annotation(place: Range<usize>, label: &Label, main: bool) -> Annotation<'static> {
    let kind = if main {
        AnnotationKind::Primary
    } else {
        AnnotationKind::Context
    };
    let words = (!label.text.is_empty()).then(|| visible(&label.text).into_owned());
    kind.span(place).label(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(text: &str, span: Range<usize>) -> (Vec<Diagnostic>, Sources) {
        let mut sources = Sources::default();
        let file = sources.add("a.lxq", text);
        let one = Diagnostic::error("E010", "no such bank")
            .at(file, span, "not declared")
            .help("did you mean `lamps`?");
        (vec![one], sources)
    }

    #[test]
    fn people_see_the_line() {
        let (found, sources) = sample("show \"a\"\n  lmaps 5\n", 11..16);
        assert_eq!(
            render(&found, &sources, Style::Plain),
            "error[E010]: no such bank\n --> a.lxq:2:3\n  |\n2 |   lmaps 5\n  |   ^^^^^ not declared\n  |\n  = help: did you mean `lamps`?\n"
        );
        assert_eq!(
            render(&found, &sources, Style::Short),
            "a.lxq:2:3: error[E010]: no such bank\n"
        );
        assert!(render(&found, &sources, Style::Colour).contains("\u{1b}["));
        assert_eq!(render(&[], &sources, Style::Plain), "");
    }

    #[test]
    fn tabs_and_wide_characters_keep_their_columns() {
        let text = "\tcue \"照明\" lmaps";
        let start = text.find("lmaps").unwrap();
        let (found, sources) = sample(text, start..start + 5);
        let plain = render(&found, &sources, Style::Plain);
        // A tab is shown as four columns, each of the two characters takes two.
        assert!(plain.contains("\n1 |     cue \"照明\" lmaps\n"), "{plain}");
        assert!(
            plain.contains(&format!("\n  | {}^^^^^ not", " ".repeat(4 + 5 + 6))),
            "{plain}"
        );
        assert!(render(&found, &sources, Style::Short).starts_with("a.lxq:1:11: "));
    }

    #[test]
    fn long_lines_are_cut_and_control_characters_are_shown() {
        let mut text = "x ".repeat(50_000);
        text.insert_str(60_000, "\u{1b}[31mlmaps");
        let (found, sources) = sample(&text, 60_005..60_010);
        let plain = render(&found, &sources, Style::Plain);
        assert!(
            plain.len() < 1000 && plain.contains("^^^^^ not declared"),
            "{plain}"
        );
        assert!(!plain.contains('\u{1b}'));
    }

    #[test]
    fn underlines_stand_under_their_words_behind_hidden_characters() {
        let before = "cue \u{1b}]0;x\u{7}\u{9b}\u{202e}\u{200b}\u{feff}\u{2028}é ";
        let text = format!("{before}lmaps\u{202c} x");
        let (mut found, sources) = sample(&text, before.len()..before.len() + 5);
        found[0].message.push_str(" `\u{1b}[2J\n\u{2066}`");
        let plain = render(&found, &sources, Style::Plain);
        let blanks = " ".repeat(before.chars().count());
        let shown = format!(
            "error[E010]: no such bank `␛[2J␊�`\n --> a.lxq:1:18\n  |\n1 | cue ␛]0;x␇�����é lmaps� x\n  \
             | {blanks}^^^^^ not declared\n"
        );
        assert!(plain.starts_with(&shown), "{plain}");
        let coloured = render(&found, &sources, Style::Colour);
        assert_eq!(coloured.replace("\u{1b}[2J", "").len(), coloured.len());
        let short = render(&found, &sources, Style::Short);
        assert_eq!(short, "a.lxq:1:18: error[E010]: no such bank `␛[2J␊�`\n");
        let json = render(&found, &sources, Style::Json);
        assert!(json.contains("\\u001b[2J\\n\\u2066"), "{json}");
    }

    #[test]
    fn json_has_every_place() {
        let (found, sources) = sample("é lmaps", 3..8);
        let value: serde_json::Value =
            serde_json::from_str(&render(&found, &sources, Style::Json)).unwrap();
        let label = &value[0]["labels"][0];
        assert_eq!(
            (label["column"].as_u64(), label["end_column"].as_u64()),
            (Some(3), Some(8))
        );
        assert_eq!(value[0]["code"], "E010");
    }

    #[test]
    fn there_is_an_end() {
        let (one, sources) = sample("lmaps", 0..5);
        let many = vec![one[0].clone(); MOST + 7];
        let plain = render(&many, &sources, Style::Plain);
        assert_eq!(plain.matches("error[").count(), MOST);
        assert!(plain.ends_with("\nand 7 more\n"), "{plain}");
    }

    #[test]
    fn what_is_left_out_is_counted_and_hides_no_error() {
        let (one, sources) = sample("lmaps", 0..5);
        let mut many = vec![Diagnostic::warning("W001", "no cue moves it"); MOST + 7];
        many.extend(one);
        let write = |style| render_some((&many, 1234), &sources, style);
        let plain = write(Style::Plain);
        assert!(plain.starts_with("error[E010]: no such bank\n"), "{plain}");
        assert_eq!(plain.matches("warning[").count(), MOST - 1);
        assert!(plain.ends_with("\nand 1242 more\n"), "{plain}");
        let short = write(Style::Short);
        let last =
            "\na.lxq:1:1: error[E010]: no such bank\nwarning: 1234 more warnings are left out\n";
        assert!(short.ends_with(last), "{short}");
        let json: serde_json::Value = serde_json::from_str(&write(Style::Json)).unwrap();
        let all = json.as_array().unwrap();
        assert_eq!(all.len(), many.len() + 1);
        assert_eq!(
            all[many.len()]["message"],
            "1234 more warnings are left out"
        );
    }
}
