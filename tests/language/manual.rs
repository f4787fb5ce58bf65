//! Every example of the manual and every example show is read; none has an error, except where the
//! manual names its code (```lxq,E032).

use std::fs;
use std::path::PathBuf;

use footlight_host::files::{Files, Folder, Memory};
use footlight_show::diagnostic::{Sources, Style, render};
use footlight_show::{check, lang};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn complaints(files: &dyn Files, name: &str, text: &str) -> (Vec<&'static str>, String) {
    let mut sources = Sources::default();
    let parsed = lang::parse_with_files(files, &mut sources, name, text);
    let mut found = parsed.diagnostics;
    if let Some(show) = parsed.show {
        found.extend(check::check(&show, &parsed.spans).diagnostics);
    }
    let codes = found.iter().map(|d| d.code).collect();
    (codes, render(&found, &sources, Style::Plain).into())
}

#[test]
fn the_manuals_examples_are_shows() {
    let mut manual = fs::read_to_string(root().join("grammar/README.md")).unwrap();
    for page in fs::read_dir(root().join("src/manual")).unwrap() {
        manual += &fs::read_to_string(page.unwrap().path()).unwrap();
    }
    let rig = "light key spot at 0, -3, 4  aim 0, 0, 1  beam 24  field 40  1200 cd\n";
    let gels = "number,name,colour\nL201,Full C.T. Blue,#9dc1ff\nL106,Primary Red,#d00000\n";
    let files = Memory::default().with("rig.lxq", rig).with("lee.csv", gels);
    let mut count = 0;
    for block in manual.split("```lxq").skip(1) {
        let (wanted, rest) = block.split_once('\n').unwrap();
        let (codes, text) = complaints(&files, "README.md", rest.split("```").next().unwrap());
        let errors: Vec<&str> = codes.into_iter().filter(|c| c.starts_with('E')).collect();
        let wanted: Vec<&str> = wanted.split(',').skip(1).collect();
        assert_eq!(errors, wanted, "{text}");
        count += 1;
    }
    assert!(count >= 9);
}

/// The manual's list of reserved words is exact.
#[test]
fn the_manuals_reserved_words_are_the_reserved_words() {
    let manual = fs::read_to_string(root().join("grammar/README.md")).unwrap();
    let list = manual.split("these cannot be names: `").nth(1).unwrap();
    let listed: Vec<&str> = list.split('`').next().unwrap().split_whitespace().collect();
    // Units that a blank may separate from their numbers.
    let units = ["K", "cd", "lm"];
    let inner = lang::words();
    let words = lang::keywords().iter().chain(&inner).chain(&units);
    for word in words {
        let show = format!("light l panel m\nbank {word} = l\ncue 1 {{ blackout }}\n");
        let refused = complaints(&Memory::default(), "names.lxq", &show)
            .0
            .contains(&"E013");
        let said = listed.contains(word) || lang::keywords().contains(word);
        assert_eq!(refused, said, "{word}");
    }
    let known = |w: &&str| inner.contains(w) || units.contains(w);
    assert!(listed.iter().all(known));
}

#[test]
fn the_examples_are_shows_without_a_complaint() {
    let mut found = crate::sheets(&root().join("examples"));
    // Included files are not shows.
    found.retain(|p| !p.components().any(|c| c.as_os_str() == "parts"));
    assert!(!found.is_empty());
    for path in found {
        let text = fs::read_to_string(&path).unwrap();
        let files = Folder::new(path.parent().unwrap(), 1 << 20);
        let (_, complaints) = complaints(&files, &path.to_string_lossy(), &text);
        assert_eq!(complaints, "");
    }
}

/// The manual's table of lanterns has the figures of the data file.
#[test]
fn the_lanterns_of_the_manual_are_those_of_the_table() {
    let rows: String = footlight_show::lang::lanterns()
        .map(|lantern| {
            let unit = if lantern.is_flux { "lm" } else { "cd" };
            format!(
                "| `\"{}\"` | {} | {} | {} {unit} | {} |\n",
                lantern.name, lantern.beam, lantern.field, lantern.amount, lantern.product
            )
        })
        .collect();
    let manual = fs::read_to_string(root().join("grammar/README.md")).unwrap();
    assert!(manual.contains(&rows), "{rows}");
}
