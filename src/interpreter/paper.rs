//! The show on paper: `tracksheet`, `cuesheet`, `fmt`, `diff`, `explain`.
//!
//! Nothing here needs the stage or a picture, so that the command line can do it to any text; only
//! where both are at hand `diff` counts the pictures that serve on.

use std::collections::BTreeSet;
use std::path::Path;

use super::output::{ending, hue, points, unknown_ending};
use super::stage::Stage;
use super::{Call, Error, Host, Interpreter, LIMIT, Reply, Report, decoded, joined};
use crate::chart::{self, Theme};
use crate::check;
use crate::diagnostic::Sources;
use crate::files::{Files, Store};
use crate::lang::{self, SpanMap};
use crate::pool::address::Digest;
use crate::pool::archive::Archive;
use crate::report::sheet::{self, Difference, Table, Version};
use crate::show::Show;
use crate::timeline::Timeline;
use crate::renderer::Quality;

/// Characters of a line of a table in words.
const WIDTH: usize = 100;

/// What `fmt` found a file to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formatted {
    /// In its canonical layout already.
    Already,
    /// In another layout; written anew unless it was only checked.
    Changed,
}

/// A text with its curves.
struct Sheet {
    /// With all that it includes.
    text: String,
    show: Show,
    spans: SpanMap,
    timeline: Timeline,
}

impl Sheet {
    fn read(name: &str, bytes: &[u8], files: &dyn Files) -> Result<Sheet, Error> {
        let mut sources = Sources::default();
        let mistakes = |diagnostics, sources| {
            Error::Mistakes(Report {
                diagnostics,
                sources,
            })
        };
        let text = decoded(name, bytes)?;
        let mut known = lang::Known::default();
        let parsed = lang::parse_again(&mut known, files, &mut sources, name, &text);
        let mut diagnostics = parsed.diagnostics;
        if let Some(show) = parsed.show {
            let checked = check::check(&show, &parsed.spans);
            if let Some(timeline) = checked.timeline {
                return Ok(Sheet {
                    text: joined(&sources),
                    show,
                    spans: parsed.spans,
                    timeline,
                });
            }
            diagnostics.extend(checked.diagnostics);
        }
        Err(mistakes(diagnostics, sources))
    }

    /// The names of the refined pictures in `archive` that serve this version; none where it has
    /// no stage, or one that cannot be read. The scene of `known` is taken where it is the same.
    fn serving(&self, host: &Host, archive: &Archive, known: Option<&Stage>) -> BTreeSet<Digest> {
        let (files, transport) = (host.files.as_ref(), host.transport.as_ref());
        let read = Stage::read(&self.show, &self.spans, files, host.memory, known);
        let results = transport.results();
        let stage = Stage::renew(None, read.unwrap_or(None), results.as_deref(), &mut None);
        stage.map_or_else(BTreeSet::new, |stage| {
            let finest = stage.finest(transport).0;
            let least = Quality(self.show.preview.refined.clamp(1, finest));
            stage.serving(archive, least, host.store.as_ref())
        })
    }

    fn version(&self) -> Version<'_> {
        Version {
            text: &self.text,
            show: &self.show,
            timeline: &self.timeline,
        }
    }
}

/// The manual's page about a code.
///
/// # Errors
/// [`Error::Usage`] when there is no such code.
pub fn explain(code: &str) -> Result<String, Error> {
    let page = lang::explain(code).map_err(Error::Usage)?;
    let mut text = format!("{}: {}\n\n", page.code, page.title);
    let mut sheet = false;
    for line in page.text.lines() {
        if line.starts_with("```") {
            sheet = !sheet;
            continue;
        }
        let indent = if sheet { "    " } else { "" };
        text.push_str(format!("{indent}{line}").trim_end());
        text.push('\n');
    }
    Ok(text)
}

/// Brings the file at `path` into its canonical layout, or only looks whether it is.
///
/// # Errors
/// [`Error::Mistakes`] when it does not parse, [`Error::File`]; the file is then untouched.
pub fn format(store: &dyn Store, path: &Path, look: bool) -> Result<Formatted, Error> {
    let name = path.display().to_string();
    let bytes = store.read(path, LIMIT)?;
    let text = formatted(&name, &bytes)?;
    if text.as_bytes() == bytes {
        return Ok(Formatted::Already);
    }
    if !look {
        store.write(path, text.as_bytes())?;
    }
    Ok(Formatted::Changed)
}

/// The canonical layout of a text.
///
/// # Errors
/// [`Error::Mistakes`] when it does not parse.
pub fn formatted(name: &str, bytes: &[u8]) -> Result<String, Error> {
    let text = decoded(name, bytes)?;
    lang::format(&text).map_err(|diagnostics| {
        let mut sources = Sources::default();
        sources.add(name, &text);
        Error::Mistakes(Report {
            diagnostics,
            sources,
        })
    })
}

/// Two versions of a show held against each other.
pub struct Comparison {
    old: Sheet,
    new: Sheet,
    /// What changed.
    pub difference: Difference,
    /// Refined pictures at hand that serve the older version, and those of them that serve the
    /// newer one too.
    serving: Option<[usize; 2]>,
}

impl Comparison {
    /// Reads both, each by its name, its bytes and the files that it may include.
    ///
    /// # Errors
    /// [`Error::Mistakes`] of the first that has any.
    pub fn new(
        old: (&str, &[u8], &dyn Files),
        new: (&str, &[u8], &dyn Files),
    ) -> Result<Comparison, Error> {
        let old = Sheet::read(old.0, old.1, old.2)?;
        let new = Sheet::read(new.0, new.1, new.2)?;
        Ok(Comparison {
            difference: sheet::difference(old.version(), new.version()),
            old,
            new,
            serving: None,
        })
    }

    /// Counts the pictures in the host's store that serve on.
    #[must_use]
    pub fn with_pictures(self, host: &Host) -> Comparison {
        let archive = host.archive();
        self.counted(host, &archive, None)
    }

    fn counted(mut self, host: &Host, archive: &Archive, known: Option<&Stage>) -> Comparison {
        let old = self.old.serving(host, archive, known);
        let new = self.new.serving(host, archive, known);
        self.serving = Some([old.len(), old.intersection(&new).count()]);
        self
    }

    /// The changes in words, and whether pictures still serve; empty when there are none.
    pub fn text(&self) -> String {
        told(&self.difference, self.serving)
    }

    /// The changed curves, the old ones dashed.
    ///
    /// # Errors
    /// [`Error::Usage`] for a file that is neither .png nor .svg, [`Error::Chart`].
    pub fn chart(&self, path: &Path) -> Result<Vec<u8>, Error> {
        let old = self.old.show.coordinates();
        let mut rows = Vec::new();
        for (i, coordinate) in self.new.show.coordinates().into_iter().enumerate() {
            let changed = |c: &sheet::CurveChange| c.name == coordinate.name;
            let before = old.iter().position(|c| c.name == coordinate.name);
            if let Some(k) = before.filter(|_| self.difference.curves.iter().any(changed)) {
                rows.push(chart::Row {
                    points: points(&self.new.timeline, i),
                    before: points(&self.old.timeline, k),
                    colour: hue(&coordinate),
                    name: coordinate.name,
                    ..chart::Row::default()
                });
            }
        }
        let (a, b) = (&self.old.timeline, &self.new.timeline);
        let cues = self.new.show.cues.iter().zip(b.cues());
        let curves = chart::Curves {
            title: format!("{}: what changed (before: dashed)", self.new.show.title),
            start: a.start().min(b.start()).seconds(),
            end: a.end().max(b.end()).seconds(),
            rows,
            cues: cues
                .map(|(cue, time)| (time.go.seconds(), cue.number.to_string()))
                .collect(),
            ..chart::Curves::default()
        };
        let drawing = chart::curves(&curves, Theme::Dark);
        match ending(path).as_str() {
            "png" => Ok(drawing.png()?),
            "svg" => Ok(drawing.svg().into_bytes()),
            _ => Err(unknown_ending(path, ".png or .svg")),
        }
    }
}

/// The changes in words, and whether pictures still serve: of those at hand that serve the older
/// version, those that serve the newer one too, where they were counted. Empty without a change.
pub(super) fn told(difference: &Difference, serving: Option<[usize; 2]>) -> String {
    if difference.is_empty() {
        return String::new();
    }
    let pictures = match (serving, difference.pictures) {
        (Some([old, both]), _) if old > 0 && both == old => {
            format!("every refined picture still serves ({old} of {old})")
        }
        (Some([old, both]), _) if old > 0 => format!(
            "{both} of {old} refined pictures still serve; the others show what has changed of \
             the rig, the stage or the view, or are too coarse now"
        ),
        (_, true) => "the rig, the stage or the view changed; those that depend on it are \
                      rendered anew (`pool` counts the others)"
            .to_owned(),
        (_, false) => "every refined picture still serves".to_owned(),
    };
    format!("{}\npictures: {pictures}\n", difference.text())
}

impl std::fmt::Debug for Comparison {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.difference.fmt(f)
    }
}

impl Interpreter {
    pub(super) fn answer_explain(&self, call: &Call) -> Result<Reply, Error> {
        match call.words.as_slice() {
            [code] => explain(code).map(Reply::text),
            _ => Err(Error::Usage("say which code: explain E012".to_owned())),
        }
    }

    /// Brings the show's text into its canonical layout; the show stays what it is.
    pub(super) fn answer_fmt(&mut self, call: &Call) -> Result<Reply, Error> {
        let text = formatted(&self.name, self.source.as_bytes())?;
        if text == self.source {
            return Ok(Reply::text("already in its canonical layout"));
        }
        if call.option("check").is_some() {
            return Ok(Reply::text("`fmt` would change the layout"));
        }
        self.change_text(text);
        Ok(Reply::text("laid out anew; `save` writes it"))
    }

    /// The text against what was last read or saved, or against a file.
    pub(super) fn answer_diff(&mut self, call: &Call) -> Result<Reply, Error> {
        let (name, old) = match call.words.as_slice() {
            [] => ("as saved".to_owned(), self.saved.clone().into_bytes()),
            [path] => (path.clone(), self.host.store.read(Path::new(path), LIMIT)?),
            _ => {
                return Err(Error::Usage(
                    "say one file, or none: diff old.lxq".to_owned(),
                ));
            }
        };
        let files = self.host.files.as_ref();
        let mut compared = Comparison::new(
            (&name, &old, files),
            (&self.name, self.source.as_bytes(), files),
        )?;
        let stage = self.stage.as_ref();
        if let Some(archive) = stage.map(|s| &s.archive).or(self.archive.as_ref()) {
            compared = compared.counted(&self.host, archive, stage);
        }
        let text = match compared.text() {
            text if text.is_empty() => "nothing changed".to_owned(),
            text => text,
        };
        match call.option("output").map(Path::new) {
            None => Ok(Reply::text(text)),
            Some(path) => {
                self.host.store.write(path, &compared.chart(path)?)?;
                Ok(Reply::text(format!(
                    "{}\nwrote {}",
                    text.trim_end(),
                    path.display()
                )))
            }
        }
    }

    pub(super) fn answer_tracksheet(&mut self, call: &Call) -> Result<Reply, Error> {
        let sheet = sheet::track_sheet(self.show());
        self.table(call, &sheet.table(), &sheet.words())
    }

    pub(super) fn answer_cuesheet(&mut self, call: &Call) -> Result<Reply, Error> {
        let table = sheet::cue_sheet(self.show(), self.timeline());
        self.table(call, &table, &table)
    }

    /// A table in words, or into a file: Markdown, or `plain` as CSV.
    fn table(&self, call: &Call, table: &Table, plain: &Table) -> Result<Reply, Error> {
        let Some(path) = call.option("output").map(Path::new) else {
            return Ok(Reply::text(table.text(2, WIDTH)));
        };
        let text = match ending(path).as_str() {
            "md" => table.markdown(),
            "csv" => plain.csv(),
            "txt" => table.text(2, WIDTH),
            _ => return Err(unknown_ending(path, ".md, .csv or .txt")),
        };
        self.host.store.write(path, text.as_bytes())?;
        Ok(Reply::text(format!("wrote {}", path.display())))
    }
}
