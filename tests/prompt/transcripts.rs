//! Golden transcripts: sessions at the prompt, compared as a whole. `FOOTLIGHT_BLESS=1 cargo test
//! --test prompt transcripts` writes them anew.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Stopped;
use footlight::engine::Host;
use footlight::files::{Folder, Shelf, Store};
use footlight::repl::finished;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/transcripts")
}

/// Runs the commands of a transcript (lines after `lxq> `, continued after `...> `) on the show
/// that its first line names (`// on sketch/sketch.lxq`), or the first one, and returns it with the
/// answers as they are now.
fn replay(transcript: &str) -> String {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let shelf = Shelf::default();
    let first = transcript.lines().next().unwrap_or_default();
    let named = first.strip_prefix("// on ");
    let path = examples.join(named.unwrap_or("first.lxq"));
    let name = Path::new(path.file_name().unwrap());
    shelf.write(name, &fs::read(&path).unwrap()).unwrap();
    let host = Host {
        files: Box::new(Folder::new(path.parent().unwrap(), 1 << 20)),
        store: Box::new(shelf),
        clock: Box::new(Stopped),
        ..Host::default()
    };
    let mut show = crate::open(name, host);
    let mut out = named.map_or_else(String::new, |_| format!("{first}\n"));
    let mut pending = String::new();
    for line in transcript.lines() {
        let Some(command) = line.strip_prefix("lxq> ").or(line.strip_prefix("...> ")) else {
            continue;
        };
        out += &format!("{line}\n");
        pending += &format!("{command}\n");
        if !finished(&pending) {
            continue;
        }
        match show.execute(&std::mem::take(&mut pending)) {
            Ok(reply) => out += &reply.text,
            Err(error) => out += &error.report(footlight::diagnostic::Style::Plain),
        }
    }
    assert!(
        pending.is_empty(),
        "the transcript ends in an unfinished declaration"
    );
    out
}

#[test]
fn sessions_go_as_written() {
    let mut names: Vec<PathBuf> = fs::read_dir(folder())
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    names.sort();
    assert!(!names.is_empty());
    for path in names {
        let written = fs::read_to_string(&path).unwrap();
        let now = replay(&written);
        if std::env::var_os("FOOTLIGHT_BLESS").is_some() {
            fs::write(&path, &now).unwrap();
        } else {
            assert!(now == written, "{} now goes:\n{now}", path.display());
        }
    }
}
