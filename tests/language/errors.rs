//! One tiny show for each error, with the whole message compared byte for byte with the text file
//! next to it. `FOOTLIGHT_WRITE_MESSAGES=1 cargo test --test language errors` rewrites the texts;
//! read the difference before committing it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use footlight_engine::{Document, Error};
use footlight_host::files::{Files, Folder, Memory};
use footlight_show::diagnostic::{Diagnostics, Style};
use footlight_show::lang;

/// All diagnostics of a show's text and its files.
fn diagnostics(name: &str, text: &str, files: &dyn Files) -> Diagnostics {
    let opened = Document::new(name, text.as_bytes(), files);
    let failed = opened.is_err();
    let found = match opened {
        Ok(document) => document.diagnostics().clone(),
        Err(Error::Show(diagnostics)) => diagnostics,
        Err(other) => panic!("{name}: {other}"),
    };
    let errors = found.list.iter().any(|d| d.code.starts_with('E'));
    assert_eq!(failed, errors, "{name}");
    found
}

fn message(name: &str, text: &str) -> (String, BTreeSet<&'static str>) {
    let found = diagnostics(name, text, &Folder::new(folder(), 1 << 20));
    let codes = found.list.iter().map(|d| d.code).collect();
    (found.render(Style::Plain).into(), codes)
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/errors")
}

#[test]
fn every_error_explains_itself() {
    let write = std::env::var_os("FOOTLIGHT_WRITE_MESSAGES").is_some();
    let mut shows: Vec<_> = fs::read_dir(folder())
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    shows.retain(|p| p.extension().is_some_and(|e| e == "lxq"));
    shows.sort();
    let (mut wrong, mut seen) = (Vec::new(), BTreeSet::new());
    for path in shows {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy();
        let (found, codes) = message(&name, &text);
        seen.extend(codes);
        assert!(!found.is_empty(), "{name} has no error");
        let beside = path.with_extension("txt");
        if write {
            fs::write(&beside, &found).unwrap();
        } else if fs::read_to_string(&beside).unwrap_or_default() != found {
            wrong.push(format!("{name} says now:\n{found}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Errors that need a too large file, bytes that are not text, or a slow machine are tested
    // elsewhere.
    let elsewhere = ["E001", "E002", "E009", "W018"];
    for row in lang::codes::TABLE {
        let known = seen.contains(row.code) || elsewhere.contains(&row.code);
        assert!(
            known,
            "no show makes the error {} ({})",
            row.code, row.title
        );
    }
}

/// Files for the cue sheets of `grammar/errors.md`.
fn beside() -> Memory {
    let read = |name: &str| fs::read(folder().join(name)).unwrap();
    let batwing = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/luminaires/batwing.ies");
    let set = String::from_utf8(read("little.obj")).unwrap();
    Memory::default()
        .with("set.obj", set.replace("little.mtl", "set.mtl"))
        .with("set.mtl", read("little.mtl"))
        .with("set.gltf", read("little.gltf"))
        .with("back.png", read("small.png"))
        .with("broken.ies", read("broken.ies"))
        .with("desk.ies", fs::read(batwing).unwrap())
}

/// Codes of a cue sheet in the manual. A material or an image that is only a placeholder does not
/// count.
fn codes_of(sheet: &str, about: &str) -> BTreeSet<&'static str> {
    let found = diagnostics("a.lxq", sheet, &beside());
    let of_files = |code: &str| code.starts_with("E3");
    let codes = found.list.iter().map(|d| d.code);
    codes.filter(|c| !of_files(c) || of_files(about)).collect()
}

#[test]
fn the_pages_of_explain_make_their_errors_and_correct_them() {
    let mut without = Vec::new();
    for page in lang::pages() {
        let Some((wrong, right)) = page.sheets() else {
            without.push(page.code);
            continue;
        };
        assert!(
            codes_of(wrong, page.code).contains(page.code),
            "{} is not made by:\n{wrong}",
            page.code
        );
        let left = codes_of(right, page.code);
        let harmless = |code: &&str| code.starts_with('W') && page.code.starts_with('E');
        let bad: Vec<_> = left.iter().filter(|c| !harmless(c)).collect();
        assert!(
            bad.is_empty(),
            "{} is corrected to {bad:?}:\n{right}",
            page.code
        );
    }
    // Codes that no small text can show.
    assert_eq!(without, ["E001", "E002", "E009", "W018", "W020"]);
}
