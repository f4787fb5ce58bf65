//! Names and their occurrences: definition, references, highlights, rename.

use std::collections::BTreeMap;
use std::path::Path;

use lsp_types::{DocumentHighlight, DocumentHighlightKind, Location, TextEdit, Uri, WorkspaceEdit};

use super::buffers::uri_of;
use super::open_show::{OpenShow, name_at, places_of};
use super::text::{Encoding, Lines};
use footlight_show::lang::{self, NamePlace};

/// Occurrences of the name at a place: all, or its declarations.
pub fn locations(
    show: &OpenShow,
    (text, at): (&str, usize),
    wanted: impl Fn(bool) -> bool,
    encoding: Encoding,
) -> Vec<Location> {
    let Some(name) = name_at(text, at).and_then(|range| text.get(range)) else {
        return Vec::new();
    };
    let mut out = Vec::new();
    for (path, text, places) in show.places_of(name) {
        let lines = Lines::new(text, encoding);
        let places = places.iter();
        let wanted = places.filter(|place| wanted(place.declares.is_some()));
        let location = |place: &NamePlace| {
            let range = lines.range(&place.range);
            Some(Location::new(uri_of(&path)?, range))
        };
        out.extend(wanted.filter_map(location));
    }
    out
}

/// Occurrences of the name in its own file.
pub fn highlights((text, at): (&str, usize), encoding: Encoding) -> Vec<DocumentHighlight> {
    let Some(name) = name_at(text, at).and_then(|range| text.get(range)) else {
        return Vec::new();
    };
    let lines = Lines::new(text, encoding);
    let own = places_of(text, name).into_iter();
    own.map(|place| DocumentHighlight {
        range: lines.range(&place.range),
        kind: Some(match place.declares {
            Some(_) => DocumentHighlightKind::WRITE,
            None => DocumentHighlightKind::READ,
        }),
    })
    .collect()
}

/// Renames the name at a place in all files of the show.
///
/// # Errors
/// A message for the user: why the new name is refused.
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
    let is_used = |name: &str, counts: fn(&NamePlace) -> bool| {
        let mut files = show.places_of(name).into_iter();
        files.any(|(.., places)| places.iter().any(counts))
    };
    if name != to && is_used(to, |_| true) {
        return Err(format!("`{to}` is used already: choose another name"));
    }
    if !is_used(name, |place| place.declares.is_some()) {
        return Err(format!("`{name}` is the stage's name, not the show's"));
    }
    let mut changes: BTreeMap<String, (Uri, Vec<TextEdit>)> = BTreeMap::new();
    for (path, text, places) in show.places_of(name) {
        let lines = Lines::new(text, encoding);
        let edit = |place: &NamePlace| TextEdit::new(lines.range(&place.range), to.to_owned());
        let edits: Vec<TextEdit> = places.iter().map(edit).collect();
        if !edits.is_empty() {
            let uri = address(&path)?;
            changes.insert(uri.to_string(), (uri, edits));
        }
    }
    Ok(WorkspaceEdit {
        changes: Some(changes.into_values().collect()),
        ..WorkspaceEdit::default()
    })
}

fn address(path: &Path) -> Result<Uri, String> {
    uri_of(path).ok_or_else(|| format!("`{}` has no address", path.display()))
}
