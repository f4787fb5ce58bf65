//! README and manual are correct: the README's commands run, its show is the shipped one, every
//! verb has its line, every link has a target.

use std::fs;
use std::path::PathBuf;

use assert_cmd::Command;
use footlight_prompt::verbs;

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
fn every_verb_and_option_is_in_the_manual_of_verbs() {
    let text = fs::read_to_string(root().join("src/manual/commands.md")).unwrap();
    for verb in verbs().get_subcommands() {
        let name = verb.get_name();
        assert!(
            text.contains(&format!("`{name}")),
            "{name} is not in the manual"
        );
        for option in verb.get_arguments().filter(|a| !a.is_positional()) {
            let named = match option.get_short() {
                Some(letter) => format!("`-{letter}`"),
                None => format!("--{}", option.get_long().unwrap()),
            };
            assert!(text.contains(&named), "{name} {named}");
        }
    }
}

#[test]
fn every_link_leads_to_a_file() {
    let mut pages = vec![root().join("README.md"), root().join("grammar/README.md")];
    let entries = fs::read_dir(root().join("src/manual")).unwrap();
    pages.extend(entries.map(|entry| entry.unwrap().path()));
    assert!(pages.len() > 5);
    for page in pages {
        let text = fs::read_to_string(&page).unwrap();
        let links = text.split("](").skip(1);
        for link in links.map(|l| l.split(')').next().unwrap()) {
            let found = page.parent().unwrap().join(link).exists();
            assert!(found || link.starts_with("https://"), "{link}");
        }
    }
}

/// Runs every `footlight` line in a fresh folder.
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
        let Some(arguments) = line.strip_prefix("footlight ") else {
            continue;
        };
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
