//! Modules keep to the table in the documentation of `src/lib.rs`: none imports upwards or what its
//! row does not name, and each outside crate stays in its own module; the engine has no prose, and
//! what it gives is small.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

#[path = "../src/build.rs"]
#[allow(dead_code, reason = "the script's `main` is cargo's to call")]
mod build;

/// Crates that only derive traits or define none of the program's behaviour.
const FREE: &[&str] = &[
    "std",
    "core",
    "crate",
    "super",
    "self",
    "serde",
    "thiserror",
    "footlight",
];

#[derive(Debug)]
struct Row {
    layer: u32,
    imports: BTreeSet<String>,
    crates: BTreeSet<String>,
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn names(cell: &str) -> BTreeSet<String> {
    cell.split(',')
        .map(|s| s.trim().trim_matches('`').to_owned())
        .filter(|s| !s.is_empty() && s != "-")
        .collect()
}

/// The table of `src/lib.rs`, by module.
fn table() -> BTreeMap<String, Row> {
    let text = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let mut rows: BTreeMap<String, Row> = BTreeMap::new();
    for line in text.lines().filter_map(|l| l.strip_prefix("//! | ")) {
        let cells: Vec<&str> = line
            .trim_end_matches('|')
            .split('|')
            .map(str::trim)
            .collect();
        let Ok(layer) = cells[0].parse() else {
            continue;
        };
        assert_eq!(cells.len(), 5, "a row of the table has five cells: {line}");
        let all_above = cells[3] == "all above";
        let imports = if all_above {
            rows.keys().cloned().collect()
        } else {
            names(cells[3])
        };
        let row = Row {
            layer,
            imports,
            crates: names(cells[4]),
        };
        rows.insert(cells[1].trim_matches('`').to_owned(), row);
    }
    rows
}

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// The module a file belongs to; `None` for the two roots and the build script.
fn module(path: &Path) -> Option<String> {
    let inside = path.strip_prefix(root().join("src")).unwrap();
    let first = inside
        .components()
        .next()
        .unwrap()
        .as_os_str()
        .to_string_lossy();
    let name = first.trim_end_matches(".rs").to_owned();
    (!["lib", "main", "build"].contains(&name.as_str())).then_some(name)
}

/// Source text without comments, strings and test modules: what the module itself says.
fn own_code(text: &str) -> String {
    let untested = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let lines = untested
        .lines()
        .map(|l| l.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Names that follow `prefix` in `text`, one for each use; `prefix{a::x, b}` gives `a` and `b`.
fn following(text: &str, prefix: &str) -> BTreeSet<String> {
    let mut out = BTreeSet::new();
    for (at, _) in text.match_indices(prefix) {
        let before = text[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':') {
            continue;
        }
        let rest = &text[at + prefix.len()..];
        if let Some(group) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut word = String::new();
            let mut words = Vec::new();
            for c in group.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => words.push(std::mem::take(&mut word)),
                    _ if depth == 0 => word.push(c),
                    _ => {}
                }
            }
            words.push(word);
            out.extend(words.iter().map(|w| first_name(w.trim())));
        } else {
            out.insert(first_name(rest));
        }
    }
    out.remove("");
    out
}

fn first_name(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// Outside crates named in the manifest.
fn dependencies() -> BTreeSet<String> {
    let text = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let section = text.split("[dependencies]").nth(1).unwrap();
    let section = section.split("\n[").next().unwrap();
    let lines = section.lines().filter_map(|l| l.split_once('='));
    lines
        .map(|(name, _)| name.trim().replace('-', "_"))
        .collect()
}

#[test]
fn every_module_keeps_to_its_row() {
    let table = table();
    let outside = dependencies();
    assert!(
        table.len() > 10 && outside.len() > 5,
        "the table and the manifest were read"
    );
    let mut files = Vec::new();
    sources(&root().join("src"), &mut files);
    let mut wrong = Vec::new();
    for path in &files {
        let Some(name) = module(path) else { continue };
        let Some(row) = table.get(&name) else {
            wrong.push(format!("`{name}` has no row in the table of src/lib.rs"));
            continue;
        };
        let code = own_code(&fs::read_to_string(path).unwrap());
        let shown = path.strip_prefix(root()).unwrap().display();
        for import in following(&code, "crate::") {
            if import != name && table.contains_key(&import) && !row.imports.contains(&import) {
                wrong.push(format!("{shown}: `{name}` may not import `{import}`"));
            }
        }
        for krate in &outside {
            // A module of our own of the same name is imported by its path from `crate`.
            let own = code.split(';').any(|s| {
                s.contains("use crate::")
                    && s.split(|c: char| !c.is_alphanumeric()).any(|w| w == krate)
            });
            let used = !own && code.contains(&format!("{krate}::"));
            let free = FREE.contains(&krate.as_str()) || row.crates.contains(krate);
            if used && !free {
                wrong.push(format!(
                    "{shown}: the crate `{krate}` does not belong to `{name}`"
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Whatever the operator may import decides what its pictures look like, so all of it must be in
/// the version by which stored pictures are found.
#[test]
fn the_operators_version_covers_all_that_it_may_import() {
    let table = table();
    let mut modules = BTreeSet::new();
    let mut open = vec!["radiosity".to_owned()];
    while let Some(module) = open.pop() {
        open.extend(table[&module].imports.iter().cloned());
        modules.insert(module);
    }
    let covered = build::MODULES.map(str::to_owned);
    assert_eq!(modules, BTreeSet::from(covered));
}

#[test]
fn any_change_of_the_operators_code_is_another_version() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join("src").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("radiosity.rs", "mod gather;");
    write("radiosity/gather.rs", "a * b");
    write("geometry.rs", "c");
    let version = || build::digest(folder.path()).unwrap();
    let first = version();
    assert_eq!(first, version());
    for other in ["lang.rs", "radiosity/tests.rs", "scene/obj/read_test.rs"] {
        write(other, "draws nothing");
        assert_eq!(version(), first, "{other}");
    }
    let mut seen = BTreeSet::from([first]);
    for (name, text) in [
        ("radiosity/gather.rs", "a + b"),
        ("radiosity/indirect/deep.rs", "new"),
        ("geometry.rs", ""),
        ("units.rs", "c"),
    ] {
        write(name, text);
        assert!(seen.insert(version()), "{name}");
    }
    fs::write(folder.path().join("Cargo.lock"), "rayon 2").unwrap();
    assert!(seen.insert(version()), "other crates");
    // What the program was built with is that of these very sources.
    assert_eq!(build::digest(&root()).unwrap(), env!("FOOTLIGHT_OPERATOR"));
}

/// Where the engine may make sentences: its errors and diagnostics.
const SENTENCES: [&str; 2] = ["engine/error.rs", "engine/setup/diagnostics.rs"];

#[test]
fn the_engine_has_no_prose() {
    let mut files = Vec::new();
    sources(&root().join("src/engine"), &mut files);
    files.push(root().join("src/engine.rs"));
    let mut wrong = Vec::new();
    for path in &files {
        let text = fs::read_to_string(path).unwrap();
        let shown = path.strip_prefix(root().join("src")).unwrap();
        let allowed = SENTENCES.iter().any(|s| shown == Path::new(s));
        let tests = shown.to_string_lossy().ends_with("_test.rs");
        if allowed || tests {
            continue;
        }
        for maker in ["format!(", "write!(", "writeln!(", "print!(", "println!("] {
            if own_code(&text).contains(maker) {
                wrong.push(format!("{} makes words: {maker}", shown.display()));
            }
        }
    }
    assert!(files.len() > 20, "the engine's files were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn modules_are_private_and_the_public_names_are_few() {
    let text = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    let mut names = 0;
    for item in text.split(";\n") {
        let item = item.trim_start();
        if let Some(at) = item.find("pub use ") {
            if item.contains("#[doc(hidden)]") {
                continue;
            }
            let list = item[at..].split_once('{').map_or("one", |(_, list)| list);
            names += list
                .split(',')
                .filter(|n| !n.trim().trim_end_matches('}').is_empty())
                .count();
        }
    }
    let internals = "if #[cfg(feature = \"internals\")] {\n";
    let (closed, open) = text.split_once(internals).unwrap();
    let (open, rest) = open.split_once('}').unwrap();
    let manual = closed.split_once("#[cfg(doc)]\npub mod manual {").unwrap();
    assert!(open.contains("pub mod engine;"));
    assert!(!manual.0.contains("pub mod ") && !rest.contains("pub mod "));
    assert!((40..=68).contains(&names), "{names} public names");
}

#[test]
fn rows_import_downwards_only() {
    let table = table();
    for (name, row) in &table {
        for import in &row.imports {
            let Some(below) = table.get(import) else {
                panic!("`{name}` imports `{import}`, which has no row");
            };
            assert!(
                below.layer < row.layer,
                "`{name}` may not import `{import}`: not below it"
            );
        }
    }
}

#[test]
fn the_scanner_sees_grouped_and_plain_imports() {
    let code =
        "use crate::plan::{self, X};\nuse crate::{units::Time, show};\nlet a = crate::files::x();";
    let found = following(code, "crate::");
    let expected = ["plan", "units", "show", "files"].map(str::to_owned);
    assert_eq!(found, BTreeSet::from(expected));
}
