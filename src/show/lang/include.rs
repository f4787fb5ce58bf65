//! `include`: the files of a show, each read once.
//!
//! Invariants: files lie in the show's folder or below it, which the reader ensures; there are at
//! most [`limits::INCLUDES`], with [`limits::FILE`] bytes in all; no file is included twice or in a
//! circle. The content of a file takes the place of its `include`.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::ast::{Declaration, Span};
use super::build::Builder;
use super::decode::decode;
use super::quote::unquoted;
use super::read::Read;
use super::report::{Place, Report};
use super::scan::{Scan, first_word, scan};
use super::syntax::{self, Rule};
use super::{codes, gels, limits};
use crate::diagnostic::{Diagnostic, Sources};
use crate::units::Rgb;
use footlight_host::files::Files;

/// A file of the show.
pub struct Part<'a> {
    /// Index among the sources.
    pub file: u32,
    pub text: Cow<'a, str>,
    /// Relative to the show's folder.
    path: String,
    /// The part that includes it.
    parent: Option<usize>,
    /// The included part, by position of its `include`.
    children: BTreeMap<u32, usize>,
    /// Gels of the tables that it names.
    pub gels: Option<BTreeMap<String, Rgb>>,
}

impl Part<'_> {
    pub fn scan(&self) -> Scan<'_> {
        scan(&self.text)
    }
}

/// Reads the show's file `name`, already among the sources as `file`, and everything that it
/// includes.
pub fn gather<'a>(
    files: &dyn Files,
    sources: &mut Sources,
    (name, file, text): (&str, u32, &'a str),
    report: &mut Report,
) -> Vec<Part<'a>> {
    let (folder, own) = name.rsplit_once(['/', '\\']).unwrap_or(("", name));
    let mut gathering = Gathering {
        files,
        sources,
        report,
        folder,
        bytes: text.len(),
        places: BTreeMap::new(),
        parts: vec![Part {
            file,
            text: Cow::Borrowed(text),
            path: own.to_owned(),
            parent: None,
            children: BTreeMap::new(),
            gels: Some(BTreeMap::new()),
        }],
    };
    let mut next = 0;
    while next < gathering.parts.len() {
        gathering.includes_of(next);
        next += 1;
    }
    gathering.parts
}

/// Joins the parts: the statements of each take the place of its `include`.
pub fn joined<'a>(parts: &[Part<'_>], reads: Vec<Read<'a>>) -> Read<'a> {
    let mut reads: Vec<Option<Read<'a>>> = reads.into_iter().map(Some).collect();
    let mut out = Read::default();
    join(0, parts, &mut reads, &mut out);
    out
}

/// Recursion is bounded by the number of parts.
fn join<'a>(index: usize, parts: &[Part<'_>], reads: &mut [Option<Read<'a>>], out: &mut Read<'a>) {
    let (Some(part), Some(read)) = (
        parts.get(index),
        reads.get_mut(index).and_then(Option::take),
    ) else {
        return;
    };
    out.broken.extend(read.broken);
    out.cue_lost |= read.cue_lost;
    out.names_lost |= read.names_lost || part.gels.is_none();
    let gels = part.gels.iter().flatten();
    out.gels
        .extend(gels.map(|(number, colour)| (number.clone(), *colour)));
    for statement in read.statements {
        match statement.item {
            Declaration::Include => match part.children.get(&statement.span.start) {
                Some(child) => join(*child, parts, reads, out),
                None => out.names_lost = true,
            },
            Declaration::Gels => {}
            _ => out.statements.push(statement),
        }
    }
}

struct Gathering<'a, 's> {
    files: &'s dyn Files,
    sources: &'s mut Sources,
    report: &'s mut Report,
    /// The folder of the show, as messages name it.
    folder: &'s str,
    /// Bytes of all texts.
    bytes: usize,
    /// Position at which each path was included.
    places: BTreeMap<String, Span>,
    parts: Vec<Part<'a>>,
}

impl Gathering<'_, '_> {
    fn includes_of(&mut self, index: usize) {
        let Some(part) = self.parts.get(index) else {
            return;
        };
        let mut found = Vec::new();
        for cut in part.scan().cuts {
            let rule = match first_word(cut.text) {
                "include" => Rule::include_statement,
                "gels" => Rule::gels_statement,
                _ => continue,
            };
            if cut.broken {
                continue;
            }
            let builder = Builder {
                source: &part.text,
                file: part.file,
                base: cut.span.start,
            };
            // A syntax error is reported when the statement is read.
            let path = syntax::parse(rule, cut.text);
            if let Some(path) = path.ok().and_then(|pairs| builder.included(pairs)) {
                found.push((rule, cut.span.start as u32, unquoted(path), path.span));
            }
        }
        for (rule, start, path, span) in found {
            if rule == Rule::gels_statement {
                self.gels(index, &path, span);
                continue;
            }
            let child = self.include(index, &path, span);
            let part = self.parts.get_mut(index);
            if let (Some(child), Some(part)) = (child, part) {
                part.children.insert(start, child);
            }
        }
    }

    fn include(&mut self, index: usize, path: &str, span: Span) -> Option<usize> {
        if path.is_empty() {
            let help = "name a file next to the show: include \"rig.lxq\"";
            let at = (span, "no file");
            return self
                .report
                .error(codes::MISSING, "the include has no file", at, help);
        }
        let from = self.parts.get(index).map_or("", |p| p.path.as_str());
        let path = resolved(from, path);
        if let Some(ancestor) = self.ancestor(index, &path) {
            let message = format!("`{path}` includes itself");
            let label = if ancestor == index {
                "the file it stands in"
            } else {
                "a file that includes this one"
            };
            let help = "leave one of the two out";
            return self
                .report
                .error(codes::CYCLE, message, (span, label), help);
        }
        if let Some(earlier) = self.places.insert(path.clone(), span) {
            let message = format!("`{path}` is included twice");
            self.report.add(
                Diagnostic::error(codes::SAID_TWICE, message)
                    .place(span, "again here")
                    .place(earlier, "first here")
                    .help("keep one of the two"),
            );
            return None;
        }
        if self.parts.len() > limits::INCLUDES {
            let message = format!("more than {} files", limits::INCLUDES);
            let at = (span, "one too many");
            return self.report.error(codes::TOO_LARGE, message, at, "");
        }
        let (text, file) = self.text_of(&path, span)?;
        self.parts.push(Part {
            file,
            text: Cow::Owned(text),
            path,
            parent: Some(index),
            children: BTreeMap::new(),
            gels: Some(BTreeMap::new()),
        });
        Some(self.parts.len() - 1)
    }

    /// Adds a table of gels to the part that names it.
    fn gels(&mut self, index: usize, path: &str, span: Span) {
        let from = self.parts.get(index).map_or("", |p| p.path.as_str());
        let path = resolved(from, path);
        let read = self.text_of(&path, span);
        let table = read.and_then(|(text, file)| gels::table(&text, file, self.report));
        let Some(part) = self.parts.get_mut(index) else {
            return;
        };
        match (table, &mut part.gels) {
            (Some(table), Some(known)) => known.extend(table),
            (_, known) => *known = None,
        }
    }

    /// The text of a file of the show, and its index among the sources.
    fn text_of(&mut self, path: &str, span: Span) -> Option<(String, u32)> {
        let bytes = match self.files.read(path) {
            Ok(bytes) => bytes,
            Err(error) => {
                let help =
                    "a show includes files from its own folder downwards: include \"rig.lxq\"";
                let at = (span, "not included");
                return self
                    .report
                    .error(codes::INCLUDE, error.to_string(), at, help);
            }
        };
        self.bytes += bytes.len();
        if self.bytes > limits::FILE {
            let message = format!("a show has {} bytes at most, with its files", limits::FILE);
            let at = (span, "too much");
            return self.report.error(codes::TOO_LARGE, message, at, "");
        }
        let shown = match self.folder {
            "" => path.to_owned(),
            folder => format!("{folder}/{path}"),
        };
        let text = match decode(&shown, &bytes) {
            Ok(text) => text,
            Err(diagnostic) => {
                self.report.add(diagnostic.place(span, "included here"));
                return None;
            }
        };
        let file = self.sources.add(shown, text.as_str()) as u32;
        Some((text, file))
    }

    /// The part with this path among the part at `index` and the parts that include it.
    fn ancestor(&self, index: usize, path: &str) -> Option<usize> {
        let mut next = Some(index);
        while let Some(i) = next {
            let part = self.parts.get(i)?;
            if part.path == path {
                return Some(i);
            }
            next = part.parent;
        }
        None
    }
}

/// Resolves `path` against the file `from`, relative to the show's folder.
fn resolved(from: &str, path: &str) -> String {
    let folder = from.rsplit_once('/').map_or("", |(folder, _)| folder);
    // An absolute path stays absolute, so that the reader refuses it.
    let folder = if path.starts_with('/') { "" } else { folder };
    let mut out: Vec<&str> = Vec::new();
    for piece in folder
        .split('/')
        .filter(|p| !p.is_empty())
        .chain(path.split('/'))
    {
        match piece {
            "." => {}
            ".." if out.last().is_some_and(|p| !matches!(*p, ".." | "")) => {
                out.pop();
            }
            _ => out.push(piece),
        }
    }
    out.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::{Parsed, parse, parse_with_files};
    use footlight_host::files::Memory;
    use proptest::prelude::*;

    fn parsed(files: &Memory, text: &str) -> Parsed {
        parse_with_files(files, &mut Sources::default(), "shows/show.lxq", text)
    }

    const RIG: &str = "light l panel cloth\ninclude \"more/banks.lxq\"\nlight k panel cloth\n";
    const BANKS: &str = "bank lamps = l\ninclude \"../looks.lxq\"\n";
    const LOOKS: &str = "look night { lamps 5 }\nbank late = k\n";

    fn files() -> Memory {
        Memory::default()
            .with("rig.lxq", RIG)
            .with("more/banks.lxq", BANKS)
            .with("looks.lxq", LOOKS)
    }

    #[test]
    fn what_is_included_stands_where_it_is_included() {
        let text = "show \"S\"\ninclude \"./rig.lxq\"\nbank last = l\ncue 1 { night }\n";
        let show = parsed(&files(), text).show.unwrap();
        let names = |names: Vec<&String>| names.into_iter().cloned().collect::<Vec<_>>();
        assert_eq!(
            names(show.lights.iter().map(|l| &l.name).collect()),
            ["l", "k"]
        );
        assert_eq!(
            names(show.banks.iter().map(|b| &b.name).collect()),
            ["lamps", "late", "last"]
        );
        let whole = "show \"S\"\nlight l panel cloth\nbank lamps = l\nlook night { lamps 5 }\n\
                     bank late = k\nlight k panel cloth\nbank last = l\ncue 1 { night }\n";
        assert_eq!(parse(&mut Sources::default(), "a", whole).show, Some(show));
    }

    #[test]
    fn an_error_is_shown_in_its_own_file() {
        let files = files().with("looks.lxq", "look night { lamp 5 }\n");
        let mut sources = Sources::default();
        let text = "include \"rig.lxq\"\nbank late = k\ncue 1 { night }\n";
        let found = parse_with_files(&files, &mut sources, "shows/s.lxq", text);
        let label = &found.diagnostics[0].labels[0];
        assert_eq!(sources.get(label.file).unwrap().0, "shows/looks.lxq");
        assert_eq!(
            &sources.get(label.file).unwrap().1[label.span.clone()],
            "lamp"
        );
    }

    #[test]
    fn circles_copies_and_files_that_are_none_are_refused() {
        for (path, content, code) in [
            ("a.lxq", "include \"show.lxq\"\n", codes::CYCLE),
            ("a.lxq", "include \"a.lxq\"\n", codes::CYCLE),
            ("a.lxq", "include \"./x/../a.lxq\"\n", codes::CYCLE),
            (
                "a.lxq",
                "include \"b.lxq\"\ninclude \"b.lxq\"\n",
                codes::SAID_TWICE,
            ),
            ("a.lxq", "include \"none.lxq\"\n", codes::INCLUDE),
            ("a.lxq", "include \"../b.lxq\"\n", codes::INCLUDE),
            ("a.lxq", "include \"/b.lxq\"\n", codes::INCLUDE),
            ("a.lxq", "include b.lxq\n", codes::SYNTAX),
            ("a.lxq", "a\0b", codes::NOT_TEXT),
        ] {
            let files = Memory::default()
                .with(path, content)
                .with("b.lxq", "default time 3\n");
            let found = parsed(&files, "include \"a.lxq\"\nshow \"S\"\n").diagnostics;
            let codes: Vec<_> = found.iter().map(|d| d.code).collect();
            assert_eq!(codes, [code], "{content}: {found:#?}");
        }
        let ring = (0..300).fold(Memory::default(), |files, i| {
            files.with(&format!("{i}.lxq"), format!("include \"{}.lxq\"\n", i + 1))
        });
        let found = parsed(&ring, "include \"0.lxq\"\n").diagnostics;
        assert_eq!(found[0].code, codes::TOO_LARGE, "{found:#?}");
    }

    proptest! {
        /// No path resolves to a file above the show's folder.
        #[test]
        fn paths_are_resolved(path in "[a./]{0,12}", from in "(a/){0,2}b") {
            let path = resolved(&from, &path);
            let climbs = path.split('/').skip_while(|p| *p == "..").any(|p| p == "..");
            prop_assert!(!climbs || path.starts_with('/') || path.contains("//"), "{path}");
        }
    }
}
