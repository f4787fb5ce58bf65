//! Golden transcripts: sessions at the prompt, compared as a whole. `FOOTLIGHT_BLESS=1 cargo test
//! --test prompt transcripts` rewrites them.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Stopped;
use footlight_engine::Host;
use footlight_host::files::{Folder, MemoryStore, Store};
use footlight_prompt::finished;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The files of a folder with this extension, sorted.
fn files_of(folder: &str, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == ending));
    paths.sort();
    assert!(!paths.is_empty());
    paths
}

/// Runs the commands of a transcript (lines after `lxq> `, continued after `...> `) on a show at
/// `path`, and returns it with the current answers.
fn replay(transcript: &str, path: &Path, show: &[u8]) -> String {
    let store = MemoryStore::default();
    let name = Path::new(path.file_name().unwrap());
    store.write(name, show).unwrap();
    let host = Host {
        files: Box::new(Folder::new(path.parent().unwrap(), 1 << 20)),
        store: Box::new(store),
        clock: Box::new(Stopped),
        ..Host::default()
    };
    let mut show = crate::open(name, host);
    let mut out = String::new();
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
            Err(error) => out += &error.report(footlight_show::diagnostic::Style::Plain),
        }
    }
    assert!(
        pending.is_empty(),
        "the transcript ends in an unfinished declaration"
    );
    out
}

fn compare(path: &Path, written: &str, now: &str) {
    if std::env::var_os("FOOTLIGHT_BLESS").is_some() {
        fs::write(path, now).unwrap();
    } else {
        assert!(now == written, "{} now goes:\n{now}", path.display());
    }
}

/// A transcript's show is named in its first line (`// on sketch/sketch.lxq`), or is the first one.
#[test]
fn sessions_go_as_written() {
    for path in files_of("tests/transcripts", "txt") {
        let written = fs::read_to_string(&path).unwrap();
        let first = written.lines().next().unwrap_or_default();
        let named = first.strip_prefix("// on ");
        let show = root().join("examples").join(named.unwrap_or("first.lxq"));
        let head = named.map_or_else(String::new, |_| format!("{first}\n"));
        let now = head + &replay(&written, &show, &fs::read(&show).unwrap());
        compare(&path, &written, &now);
    }
}

/// The transcripts of README and manual, each on the show above it in the page, or on the first
/// one.
#[test]
fn sessions_of_the_manual_go_as_written() {
    let mut pages = files_of("src/manual", "md");
    pages.extend(["README.md", "grammar/README.md"].map(|name| root().join(name)));
    let first = root().join("examples/first.lxq");
    let mut count = 0;
    for page in pages {
        let written = fs::read_to_string(&page).unwrap();
        let mut path = first.clone();
        let mut show = fs::read_to_string(&path).unwrap();
        let mut pieces: Vec<String> = written.split("```").map(str::to_owned).collect();
        // Every second piece is a block of code that begins with its language.
        for block in pieces.iter_mut().skip(1).step_by(2) {
            if let Some(text) = block.strip_prefix("lxq\n") {
                show = text.to_owned();
                path = first.with_file_name("show.lxq");
            } else if block.starts_with("text\nlxq> ") {
                *block = format!("text\n{}", replay(block, &path, show.as_bytes()));
                count += 1;
            }
        }
        compare(&page, &written, &pieces.join("```"));
    }
    assert!(count >= 5);
}
