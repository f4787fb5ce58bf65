//! The README keeps its word: its commands run, its show is the shipped one, its verbs exist.

use std::fs;
use std::path::PathBuf;

use assert_cmd::Command;
use footlight::repl::VERBS;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).unwrap()
}

/// The code blocks of a language, in order.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let opening = format!("```{language}\n");
    let parts = text.split(&opening).skip(1);
    parts
        .map(|p| p.split("```").next().unwrap().to_owned())
        .collect()
}

#[test]
fn the_two_commands_stand_at_the_top() {
    let commands = blocks(&readme(), "sh");
    assert_eq!(
        commands[0],
        "cargo run --release -- run examples/tavern/tavern.lxq\n"
    );
    assert_eq!(commands[1], "cargo test\n");
}

#[test]
fn the_first_show_is_the_shipped_one() {
    let shipped = fs::read_to_string(root().join("examples/first.lxq")).unwrap();
    assert_eq!(blocks(&readme(), "lxq")[0].trim_end(), shipped.trim_end());
}

#[test]
fn every_verb_is_in_the_table_and_the_manual_of_verbs_is_whole() {
    let text = readme();
    for spec in VERBS {
        let named = format!("`{}", spec.name);
        assert!(text.contains(&named), "{} is not in the README", spec.name);
    }
}

#[test]
fn every_link_leads_to_a_file() {
    let text = readme();
    for link in text
        .split("](")
        .skip(1)
        .map(|l| l.split(')').next().unwrap())
    {
        assert!(root().join(link).exists(), "{link}");
    }
}

/// Runs every `cargo run` line but the tavern's, which takes its time, in a folder of its own.
#[test]
fn its_commands_run() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["first.lxq", "first.obj", "first.mtl"] {
        fs::create_dir_all(folder.path().join("examples")).unwrap();
        let to = folder.path().join("examples").join(name);
        fs::copy(root().join("examples").join(name), to).unwrap();
    }
    let mut ran = 0;
    for line in blocks(&readme(), "sh").concat().lines() {
        let Some(arguments) = line.strip_prefix("cargo run --release -- ") else {
            continue;
        };
        if arguments.contains("tavern") {
            continue;
        }
        let mut command = Command::cargo_bin("footlight").unwrap();
        command
            .current_dir(folder.path())
            .args(arguments.split_whitespace());
        let output = command.write_stdin("show\nquit\n").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{line}: {said}");
        ran += 1;
    }
    assert_eq!(ran, 4);
    let picture = fs::read(folder.path().join("first.png")).unwrap();
    assert_eq!(&picture[1..4], b"PNG");
}
