//! Every line that a message offers works when typed.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use footlight_engine::{Document, Error};
use footlight_host::files::Memory;
use footlight_prompt::{Verb, verbs};
use footlight_show::lang;

/// Contexts for the words of a message, inserted at `@`.
const PLACES: &[&str] = &[
    "@",
    "bank b = @",
    "bank b = l @",
    "bank b @",
    "cue 1 { @ }",
    "cue 1 @",
    "cue 1 { x @ }",
    "cue 1 { x 5 @ }",
    "cue 1 { x spline 0 0, @ }",
    "cue 1 { x spline @, 9s 50 }",
    "cue 1 { x hermite 0 0 slope 1, @ }",
    "cue 1 { x (@) }",
    "cue 1 { @ { x 5 } }",
    "curve c = @",
    "curve c = @, 1 100",
    "default time @",
    "effect e = flicker @",
    "group g = @",
    "let v = @",
    "light k @",
    "light k spot at 0, 0, 1  aim 0, 0, 0  @",
    "light k spot at @  aim 0, 0, 0  beam 20  field 30  900 cd",
    "light k panel m @",
    "look n { @ }",
    "preview { @ }",
    "stage \"set.obj\" @",
    "surface s reflectance @",
    "surface s reflectance 0.5 @",
    "view v @",
    "view v from 0, 0, 1  to 0, 0, 0  fov @",
    "view v from 0, 0, 1  to 0, 0, 0  fov 30  @",
];

/// Error codes of a text, except for names and files of other shows.
fn faults(text: &str) -> BTreeSet<String> {
    let show = format!("light l panel m\nbank x = l  rgb\n{text}\n");
    let found = match Document::new("a.lxq", show.as_bytes(), &Memory::default()) {
        Ok(_) => return BTreeSet::new(),
        Err(Error::Show(found)) => found,
        Err(other) => panic!("{text}: {other}"),
    };
    let of_elsewhere = |code: &&str| code.starts_with("E01") || code.starts_with("E3");
    let codes = found.list.iter().map(|d| d.code);
    let codes = codes.filter(|c| c.starts_with('E') && !of_elsewhere(c));
    codes.map(str::to_owned).collect()
}

/// True when words work somewhere: at the prompt, on the command line or in a show.
fn works(words: &str) -> bool {
    let filled = words.replace("NAME", "n").replace("NUMBER", "9");
    let filled = filled.replace('…', "");
    let line = filled.strip_prefix("footlight ").unwrap_or(&filled);
    let first = line.split_whitespace().next().unwrap_or_default();
    let is_verb = verbs().find_subcommand(first).is_some() && !lang::is_declaration(line);
    if is_verb && Verb::parse(line).is_ok() {
        return true;
    }
    PLACES
        .iter()
        .any(|place| faults(&place.replace('@', &filled)).is_empty())
}

/// False for single words, signs and units, which only name something; lines are to be typed.
fn is_line(words: &str) -> bool {
    words.contains(char::is_whitespace) || words.contains('{')
}

/// The lines between backticks.
fn quoted(message: &str) -> impl Iterator<Item = &str> {
    let between = message.split('`').skip(1).step_by(2);
    between.filter(|words| is_line(words))
}

/// Lines offered by the help of messages.
fn offered(text: &str) -> Vec<String> {
    let help = text.lines().filter(|line| line.contains("help: "));
    help.flat_map(quoted).map(str::to_owned).collect()
}

/// Lines offered by errors of the prompt in a transcript; a repetition of the typed line is no
/// offer.
fn offered_at_the_prompt(transcript: &str) -> Vec<String> {
    let mut out = Vec::new();
    let mut typed = "";
    for line in transcript.lines() {
        if let Some((_, behind)) = line.split_once("> ") {
            typed = behind;
        }
        if line.starts_with("error: ") {
            let new = quoted(line).filter(|words| !typed.contains(words));
            out.extend(new.map(str::to_owned));
        }
    }
    out
}

#[test]
fn every_line_that_a_message_offers_works_when_it_is_typed() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut lines = BTreeSet::new();
    for entry in fs::read_dir(root.join("tests/errors")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "txt") {
            lines.extend(offered(&fs::read_to_string(path).unwrap()));
        }
    }
    assert!(lines.len() > 50, "{lines:?}");
    let before = lines.len();
    for entry in fs::read_dir(root.join("tests/transcripts")).unwrap() {
        let transcript = fs::read_to_string(entry.unwrap().path()).unwrap();
        lines.extend(offered_at_the_prompt(&transcript));
    }
    assert!(lines.len() > before + 2, "{lines:?}");
    let idle: Vec<_> = lines.iter().filter(|words| !works(words)).collect();
    assert!(idle.is_empty(), "these lines do not work:\n{idle:#?}");
}
