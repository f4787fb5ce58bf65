//! A show open in a client: its text with all includes, its diagnostics, and the last good version.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::buffers::{Buffers, Overlay};
use super::text::{Encoding, Lines};
use footlight_engine::{self as engine, Document, Error};
use footlight_host::files::normal;
use footlight_prompt::Vocabulary;
use footlight_show::diagnostic::{Diagnostic, Diagnostics};
use footlight_show::lang::{self, NamePlace, Token};

/// Memory for a show, and the largest file it may name.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most bytes of a show in memory.
    pub memory: usize,
    /// Most bytes of a file that it names.
    pub file: u64,
}

/// A show, identified by its root file, which includes the others.
#[derive(Debug)]
pub struct OpenShow {
    path: PathBuf,
    files: Overlay,
    memory: usize,
    document: Option<Document>,
    diagnostics: Diagnostics,
    vocabulary: Vocabulary,
}

impl OpenShow {
    /// A show not yet read.
    pub fn new(path: &Path, buffers: &Buffers, limits: Limits) -> OpenShow {
        let folder = path.parent().unwrap_or(Path::new(""));
        OpenShow {
            path: path.to_owned(),
            files: Overlay::new(buffers, folder, limits.file),
            memory: limits.memory,
            document: None,
            diagnostics: Diagnostics::default(),
            vocabulary: Vocabulary::default(),
        }
    }

    /// Reads the current text. When it has errors, the last good show stays.
    pub fn update(&mut self, text: &str) {
        let name = self.path.display().to_string();
        // Limits of files apply to a client's text too.
        let decoded = engine::decode(&name, text.as_bytes());
        let taken = match (decoded, &mut self.document) {
            (Err(error), _) => Err(error),
            (Ok(text), Some(document)) => document.replace(&text, &self.files).map(|_| ()),
            (Ok(_), None) => Document::within(&name, text.as_bytes(), &self.files, self.memory)
                .map(|document| self.document = Some(document)),
        };
        self.diagnostics = match (taken, &mut self.document) {
            (Ok(()), Some(document)) => {
                document.forget_history();
                self.vocabulary = Vocabulary::of(document);
                document.diagnostics().clone()
            }
            (Ok(()), None) => Diagnostics::default(),
            // Text that cannot be decoded has no source.
            (Err(Error::Show(diagnostics)), _) if diagnostics.sources.get(0).is_none() => {
                Diagnostics::of(diagnostics.list, &name, text)
            }
            (Err(Error::Show(diagnostics)), _) => diagnostics,
            (Err(other), _) => {
                let diagnostic = Diagnostic::error("", other.to_string()).at(0, 0..0, "");
                Diagnostics::of(vec![diagnostic], &name, text)
            }
        };
    }

    /// A copy with texts and diagnostics but without the show, for another thread.
    pub fn texts(&self) -> OpenShow {
        OpenShow {
            path: self.path.clone(),
            files: self.files.clone(),
            memory: self.memory,
            document: None,
            diagnostics: self.diagnostics.clone(),
            vocabulary: Vocabulary::default(),
        }
    }

    /// Diagnostics of a text that replaces the show's own.
    pub fn diagnostics_of(&self, text: &str) -> Diagnostics {
        let name = self.path.display().to_string();
        match Document::within(&name, text.as_bytes(), &self.files, self.memory) {
            Ok(document) => document.diagnostics().clone(),
            Err(Error::Show(diagnostics)) => diagnostics,
            Err(_) => self.diagnostics.clone(),
        }
    }

    /// The root file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files of the show, with open texts replacing those on disk.
    pub fn files(&self) -> &Overlay {
        &self.files
    }

    /// The last good show.
    pub fn document(&self) -> Option<&Document> {
        self.document.as_ref()
    }

    /// Diagnostics of the current text.
    pub fn diagnostics(&self) -> &Diagnostics {
        &self.diagnostics
    }

    /// Names of the last good show.
    pub fn vocabulary(&self) -> &Vocabulary {
        &self.vocabulary
    }

    /// The files of the show, in order, with their texts.
    pub fn sources(&self) -> impl Iterator<Item = (PathBuf, &str)> {
        let sources = &self.diagnostics.sources;
        let each = (0..).map_while(|file| sources.get(file));
        each.map(|(name, text)| (normal(Path::new(name)), text))
    }

    /// The lines of each file.
    pub fn lines(&self, encoding: Encoding) -> Vec<Lines<'_>> {
        let texts = self.sources().map(|(_, text)| text);
        texts.map(|text| Lines::new(text, encoding)).collect()
    }

    /// The file of a label.
    pub fn file(&self, file: usize) -> Option<(PathBuf, &str)> {
        let (name, text) = self.diagnostics.sources.get(file)?;
        Some((normal(Path::new(name)), text))
    }

    /// Declaration of a name, with the text of its file.
    pub fn declaration_of(&self, name: &str) -> Option<(&str, NamePlace)> {
        let declared = |(_, text, places): (PathBuf, _, Vec<NamePlace>)| {
            let mut places = places.into_iter();
            Some((text, places.find(|place| place.declares.is_some())?))
        };
        self.places_of(name).into_iter().find_map(declared)
    }

    /// Occurrences of a name in each file.
    pub fn places_of(&self, name: &str) -> Vec<(PathBuf, &str, Vec<NamePlace>)> {
        let places = |(path, text)| (path, text, places_of(text, name));
        self.sources().map(places).collect()
    }
}

/// Occurrences of a name in a text. Only statements that contain it are parsed.
pub fn places_of(text: &str, name: &str) -> Vec<NamePlace> {
    let mut out = Vec::new();
    for statement in lang::outline(text) {
        let own = text.get(statement.range.clone()).unwrap_or("");
        if own.contains(name) {
            out.extend(names_of(text, statement.range));
        }
    }
    out.retain(|place| text.get(place.range.clone()) == Some(name));
    out
}

/// Names in the statement at these bytes.
fn names_of(text: &str, statement: Range<usize>) -> impl Iterator<Item = NamePlace> {
    let own = text.get(statement.clone()).unwrap_or("");
    let places = lang::edit::names(own).into_iter();
    places.map(move |place| NamePlace {
        range: statement.start + place.range.start..statement.start + place.range.end,
        ..place
    })
}

/// The bytes of the statement that contains a place, or ends there.
pub fn statement_at(text: &str, at: usize) -> Option<Range<usize>> {
    let mut ranges = lang::outline(text).into_iter().map(|s| s.range);
    ranges.find(|range| (range.start..=range.end).contains(&at))
}

/// The bytes of the name at a place of a text.
pub fn name_at(text: &str, at: usize) -> Option<Range<usize>> {
    let mut ranges = names_of(text, statement_at(text, at)?).map(|place| place.range);
    ranges.find(|range| (range.start..=range.end).contains(&at))
}

/// Paths of a text's includes, as written.
pub fn includes(text: &str) -> Vec<String> {
    let statements = lang::outline(text).into_iter();
    let includes = statements.filter(|statement| statement.word == "include");
    let path = |statement: lang::Outlined<'_>| {
        let own = text.get(statement.range)?;
        let (range, _) = lang::tokens(own)
            .into_iter()
            .find(|(_, token)| *token == Token::Text)?;
        Some(lang::unquote(own.get(range)?))
    };
    includes.filter_map(path).collect()
}

/// Parent folders searched for a show that includes a file.
const FOLDERS: usize = 2;

/// Shows of a folder read in that search.
const SHOWS: usize = 200;

/// The root file for a file: a show next to it or above it that includes it, or the file itself.
pub fn root_of(path: &Path, buffers: &Buffers) -> PathBuf {
    let mut root = path.to_owned();
    // Each step goes to another file; the bound ends cycles.
    for _ in 0..FOLDERS + 2 {
        match includer(&root, buffers) {
            Some(found) if found != path => root = found,
            _ => break,
        }
    }
    root
}

fn includer(path: &Path, buffers: &Buffers) -> Option<PathBuf> {
    for folder in path.ancestors().skip(1).take(FOLDERS + 1) {
        let on_disk = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut shows: Vec<PathBuf> = on_disk.take(20 * SHOWS).map(|e| e.path()).collect();
        let open = buffers.paths().into_iter();
        shows.extend(open.filter(|open| open.parent() == Some(folder)));
        shows.retain(|show| show.extension().is_some_and(|e| e == "lxq") && show != path);
        shows.sort();
        shows.dedup();
        let found = shows.into_iter().take(SHOWS).find(|show| {
            let text: Option<Arc<String>> = buffers.text(show);
            let named = text.into_iter().flat_map(|text| includes(&text));
            named
                .into_iter()
                .any(|name| normal(&folder.join(name)) == path)
        });
        if found.is_some() {
            return found;
        }
    }
    None
}
