//! Names and where they stand: definition, references, highlights, rename.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use lsp_types::{DocumentHighlight, DocumentHighlightKind, Location, TextEdit, Uri, WorkspaceEdit};

use super::buffers::uri_of;
use super::open_show::OpenShow;
use super::text::{Encoding, Lines};
use crate::lang;

/// The bytes of the name at a place of a text.
pub fn name_at(text: &str, at: usize) -> Option<Range<usize>> {
    let places = lang::edit::names(text).into_iter();
    let mut ranges = places.map(|place| place.range);
    ranges.find(|range| (range.start..=range.end).contains(&at))
}

/// Where the name at a place stands: all places, or those that declare it.
pub fn locations(
    show: &OpenShow,
    (text, at): (&str, usize),
    wanted: impl Fn(bool) -> bool,
    encoding: Encoding,
) -> Vec<Location> {
    let Some(name) = name_at(text, at).and_then(|range| text.get(range)) else {
        return Vec::new();
    };
    let places = show.places_of(name).into_iter();
    let wanted = places.filter(|(_, _, place)| wanted(place.declares.is_some()));
    let location = |(path, text, place): (PathBuf, &str, lang::NamePlace)| {
        let range = Lines::new(text, encoding).range(&place.range);
        Some(Location::new(uri_of(&path)?, range))
    };
    wanted.filter_map(location).collect()
}

/// The places of the name in its own file.
pub fn highlights((text, at): (&str, usize), encoding: Encoding) -> Vec<DocumentHighlight> {
    let Some(name) = name_at(text, at).and_then(|range| text.get(range)) else {
        return Vec::new();
    };
    let lines = Lines::new(text, encoding);
    let own = lang::edit::names(text).into_iter();
    let own = own.filter(|place| text.get(place.range.clone()) == Some(name));
    own.map(|place| DocumentHighlight {
        range: lines.range(&place.range),
        kind: Some(match place.declares {
            Some(_) => DocumentHighlightKind::WRITE,
            None => DocumentHighlightKind::READ,
        }),
    })
    .collect()
}

/// Another name for what stands at a place, in all files of the show.
///
/// # Errors
/// A sentence for the user: why it cannot be called so.
pub fn rename(
    show: &OpenShow,
    (text, at): (&str, usize),
    to: &str,
    encoding: Encoding,
) -> Result<WorkspaceEdit, String> {
    let name = name_at(text, at).and_then(|range| text.get(range));
    let name = name.ok_or("there is no name here")?;
    if let Some(refused) = lang::edit::refused_name(to) {
        let help = refused.help.join("; ");
        return Err(format!("{}: {help}", refused.message));
    }
    if show.diagnostics().has_errors() {
        let why = "the show has errors, so that names may be missed: mend them first";
        return Err(why.to_owned());
    }
    if name != to && !show.places_of(to).is_empty() {
        return Err(format!("`{to}` is used already: choose another name"));
    }
    if !show
        .places_of(name)
        .iter()
        .any(|(_, _, place)| place.declares.is_some())
    {
        return Err(format!("`{name}` is the stage's name, not the show's"));
    }
    let mut changes: BTreeMap<String, (Uri, Vec<TextEdit>)> = BTreeMap::new();
    for (path, text, place) in show.places_of(name) {
        let range = Lines::new(text, encoding).range(&place.range);
        let uri = address(&path)?;
        let edits = changes.entry(uri.to_string());
        let (_, edits) = edits.or_insert_with(|| (uri, Vec::new()));
        edits.push(TextEdit::new(range, to.to_owned()));
    }
    Ok(WorkspaceEdit {
        changes: Some(changes.into_values().collect()),
        ..WorkspaceEdit::default()
    })
}

fn address(path: &Path) -> Result<Uri, String> {
    uri_of(path).ok_or_else(|| format!("`{}` has no address", path.display()))
}
