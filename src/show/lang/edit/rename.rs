//! Renaming, and every place that uses a name.
//!
//! The places come from the parsed statements, so that strings, comments, materials, files and
//! labels are never taken for names.

use std::ops::Range;

use pest::iterators::Pair;

use super::change::{Action, Change, EditedText, Splice};
use super::place::{self, Key};
use super::sound;
use crate::diagnostic::Diagnostic;
use crate::lang::codes;
use crate::lang::lower::hex;
use crate::lang::names::{self, Kind};
use crate::lang::scan::{Cut, first_word, scan};
use crate::lang::syntax::{self, Rule};

/// An occurrence of a name.
struct Place<'t> {
    text: &'t str,
    range: Range<usize>,
    /// Kind of the declaration, at a declaring place.
    declares: Option<Kind>,
    /// The statement of the place.
    statement: &'t str,
    /// Start of the statement.
    start: usize,
}

/// Renames `from` to `to` throughout the text.
pub fn rename(source: &str, from: &str, to: &str) -> Result<EditedText, Vec<Diagnostic>> {
    let scan = sound(source)?;
    let places = places(&scan.cuts)?;
    check(to, &places)?;
    if !places
        .iter()
        .any(|p| p.text == from && p.declares.is_some())
    {
        return Err(vec![not_declared(&scan.cuts, from, &places)]);
    }
    let (mut splices, mut changes) = (Vec::new(), Vec::new());
    let mut last = None;
    for place in places.iter().filter(|p| p.text == from) {
        splices.push(Splice {
            range: place.range.clone(),
            text: to.to_owned(),
        });
        if last.replace(place.start) != Some(place.start) {
            changes.extend(change(place, to));
        }
    }
    EditedText::new(source, splices, changes)
}

/// The change reported for the statement of a place.
fn change(place: &Place<'_>, to: &str) -> Option<Change> {
    let key = Key::of(place.statement)?;
    Some(key.change(match place.declares {
        Some(_) => Action::Renamed(to.to_owned()),
        None => Action::Updated,
    }))
}

/// Checks that `to` is a valid name not yet in use.
fn check(to: &str, places: &[Place<'_>]) -> Result<(), Vec<Diagnostic>> {
    if syntax::prefix(Rule::name, to) != Some(to.len()) {
        let message = format!("`{to}` is not a name");
        let help = "a name begins with a letter and has letters, digits, `_` and `-`";
        return Err(vec![Diagnostic::error(codes::SYNTAX, message).help(help)]);
    }
    if names::is_reserved(to) {
        return Err(vec![names::reserved(to)]);
    }
    let same = |p: &&Place<'_>| p.text == to;
    let declared = places.iter().filter(same).find_map(|p| p.declares);
    let message = match (declared, places.iter().any(|p| p.text == to)) {
        (Some(kind), _) => format!("`{to}` is {} already", kind.phrase()),
        (None, true) => format!("`{to}` is used already, for something of an included file"),
        (None, false) => return Ok(()),
    };
    let help = "a name stands for one thing in the whole show: choose another";
    Err(vec![
        Diagnostic::error(codes::DECLARED_TWICE, message).help(help),
    ])
}

fn not_declared(cuts: &[Cut<'_>], from: &str, places: &[Place<'_>]) -> Diagnostic {
    let message = format!("nothing is called `{from}` in the show's own text");
    let diagnostic = Diagnostic::error(codes::UNKNOWN_NAME, message);
    let declared = places.iter().filter(|p| p.declares.is_some());
    let near = names::nearest(from, declared.map(|p| p.text));
    match near {
        _ if places.iter().any(|p| p.text == from) => diagnostic.help(place::IN_ANOTHER_FILE),
        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
        None if place::includes(cuts) => diagnostic.help(place::IN_ANOTHER_FILE),
        None => diagnostic,
    }
}

/// All occurrences of names in a text, in order.
fn places<'t>(cuts: &[Cut<'t>]) -> Result<Vec<Place<'t>>, Vec<Diagnostic>> {
    let mut out = Vec::new();
    for cut in cuts {
        let Some(found) = places_in(cut) else {
            let message = "the show's own text has errors, so that names in it may be missed";
            let help = "mend the file first; `check` shows where";
            return Err(vec![Diagnostic::error(codes::SYNTAX, message).help(help)]);
        };
        out.extend(found);
    }
    Ok(out)
}

/// Occurrences of names in a statement; `None` when it does not parse.
fn places_in<'t>(cut: &Cut<'t>) -> Option<Vec<Place<'t>>> {
    let word = first_word(cut.text);
    let pairs = syntax::parse(syntax::rule_of(word)?, cut.text).ok()?;
    let mut declares = Kind::of_statement(word);
    let mut found = Vec::new();
    pairs.for_each(|pair| names_in(pair, &mut found));
    let start = cut.span.start;
    let place = |name: pest::Span<'t>| Place {
        text: name.as_str(),
        range: start + name.start()..start + name.end(),
        // In a declaring statement, the first name is the declared one.
        declares: declares.take(),
        statement: cut.text,
        start,
    };
    Some(found.into_iter().map(place).collect())
}

/// An occurrence of a name in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamePlace {
    /// Its bytes.
    pub range: Range<usize>,
    /// Kind of the declaration, at a declaring place.
    pub declares: Option<Kind>,
}

/// The occurrences of names in a text, in order; statements that do not parse are skipped.
pub fn names(text: &str) -> Vec<NamePlace> {
    let cuts = scan(text).cuts;
    let found = cuts.iter().filter(|cut| !cut.broken).filter_map(places_in);
    let place = |place: Place<'_>| NamePlace {
        range: place.range,
        declares: place.declares,
    };
    found.flatten().map(place).collect()
}

/// Diagnostic for a text that cannot be a name in any show.
pub fn refused_name(name: &str) -> Option<Diagnostic> {
    check(name, &[]).err()?.pop()
}

/// Collects the names of the show in a piece of a statement, in order. Recursion is bounded by the
/// nesting of brackets.
fn names_in<'t>(pair: Pair<'t, Rule>, out: &mut Vec<pest::Span<'t>>) {
    match pair.as_rule() {
        Rule::name => out.push(pair.as_span()),
        // `#dusk` names a value unless it reads as a colour such as `#ddaa55`.
        Rule::colour => {
            let span = pair.as_span();
            let name = span
                .as_str()
                .strip_prefix('#')
                .filter(|name| hex(name).is_none());
            if name.is_some_and(|name| !name.is_empty()) {
                out.extend(span.get(1..));
            }
        }
        // Material names belong to the stage.
        Rule::material => {}
        _ => pair.into_inner().for_each(|inner| names_in(inner, out)),
    }
}
