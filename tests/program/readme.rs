//! The README and the manual keep their word: the tutorial goes as written, every verb has its line, every link
//! leads somewhere, and both read easily.

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

fn tutorial() -> String {
    fs::read_to_string(root().join("src/manual/tutorial.md")).unwrap()
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
fn the_tutorials_show_is_the_shipped_one() {
    let shipped = fs::read_to_string(root().join("examples/letter/letter.lxq")).unwrap();
    let shows = blocks(&tutorial(), "lxq");
    assert_eq!(shows.last().unwrap().trim_end(), shipped.trim_end());
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
    // Rustdoc has its pages elsewhere: there these come first.
    let in_rustdoc = fs::read_to_string(root().join("src/manual-links.md")).unwrap();
    for page in pages {
        let text = fs::read_to_string(&page).unwrap();
        let links = text.split("](").skip(1);
        let links = links.map(|l| l.split(')').next().unwrap());
        let defined = text.lines().filter_map(|line| line.split_once("]: "));
        let defined = defined.filter(|(name, _)| name.starts_with('['));
        for (name, _) in defined.clone() {
            assert!(in_rustdoc.contains(&format!("{name}]: ../")), "{name}]");
        }
        for link in links.chain(defined.map(|(_, link)| link)) {
            let path = link.split('#').next().unwrap();
            let found = page.parent().unwrap().join(path).exists();
            assert!(found || link.starts_with("https://"), "{link}");
        }
    }
}

/// Follows the tutorial in an empty folder: writes its shows, types its commands, compares the answers.
#[test]
#[ignore = "slow"]
fn the_tutorial_goes_as_written() {
    let folder = tempfile::tempdir().unwrap();
    let (mut answer, mut ran) = (String::new(), 0);
    for block in tutorial().split("```").skip(1).step_by(2) {
        let (language, text) = block.split_once('\n').unwrap();
        match language {
            "lxq" => fs::write(folder.path().join("show.lxq"), text).unwrap(),
            "sh" => {
                answer.clear();
                for line in text.lines() {
                    let arguments = line.strip_prefix("footlight ").unwrap();
                    let mut command = Command::cargo_bin("footlight").unwrap();
                    command.current_dir(folder.path()).arg("--quiet");
                    let output = command.args(arguments.split(' ')).output().unwrap();
                    assert!(output.status.success(), "{line}: {output:?}");
                    answer += std::str::from_utf8(&output.stdout).unwrap();
                    ran += 1;
                }
            }
            _ if text.starts_with("lxq> ") || text.starts_with("footlight serve") => {}
            _ => assert_eq!(text, answer),
        }
    }
    assert_eq!(ran, 6);
    for name in ["cue2.png", "cue3.png", "out/show/contact-sheet.png"] {
        let picture = fs::read(folder.path().join(name)).unwrap();
        assert_eq!(&picture[1..4], b"PNG");
    }
}

/// Reading ease after Flesch: 60 and more is plain English.
#[test]
fn readme_and_tutorial_read_easily() {
    for (name, page) in [("README", readme()), ("tutorial", tutorial())] {
        let ease = reading_ease(&page);
        println!("{name}: {ease:.1}");
        assert!(ease >= 60.0, "{name}: {ease:.0}");
    }
    for (word, syllables) in [
        ("table", 2),
        ("file", 1),
        ("wanted", 2),
        ("named", 1),
        ("the", 1),
    ] {
        assert_eq!(vowel_groups(word), syllables, "{word}");
    }
    let hard = "Illumination discontinuities necessitate computationally prohibitive subdivision.";
    assert!(reading_ease(hard) < 0.0 && reading_ease("The cat sat on the mat.") > 100.0);
}

/// 206.835 - 1.015 words a sentence - 84.6 syllables a word, of prose alone.
fn reading_ease(page: &str) -> f64 {
    let mut prose = String::new();
    for text in page.split("```").step_by(2) {
        for paragraph in text.split("\n\n") {
            let lines = paragraph.lines().map(str::trim);
            let is_prose =
                |line: &&str| !line.starts_with(['|', '#', '!']) && !line.contains("]: ");
            prose.extend(lines.filter(is_prose).flat_map(|line| [line, " "]));
            prose += ". ";
        }
    }
    // A link's target is no text, and neither is code.
    let targets = prose.split("](").enumerate().map(|(i, part)| match i {
        0 => part,
        _ => part.split_once(')').map_or("", |(_, rest)| rest),
    });
    let prose: String = targets.collect();
    let prose: String = prose.split('`').step_by(2).collect();
    let (mut words, mut syllables, mut sentences) = (0.0, 0.0, 0.0);
    let mut is_open = false;
    for word in prose.split_whitespace() {
        if word.contains(char::is_alphabetic) {
            words += 1.0;
            syllables += f64::from(vowel_groups(word));
            is_open = true;
        }
        if is_open && word.ends_with(['.', '!', '?', ':']) {
            sentences += 1.0;
            is_open = false;
        }
    }
    206.835 - 1.015 * words / sentences - 84.6 * syllables / words
}

/// Syllables of a word: its groups of vowels, without a silent e.
fn vowel_groups(word: &str) -> u32 {
    let word = word.to_lowercase();
    let word = word.trim_matches(|c: char| !c.is_alphabetic());
    let is_vowel = |c: char| "aeiouy".contains(c);
    let stem = match word {
        _ if word.ends_with("le") => word
            .strip_suffix("le")
            .filter(|stem| stem.ends_with(is_vowel)),
        _ if word.ends_with("ed") => word
            .strip_suffix("ed")
            .filter(|stem| !stem.ends_with(['t', 'd'])),
        _ if word.ends_with("es") => {
            let stem = word.strip_suffix("es");
            stem.filter(|stem| !stem.ends_with(['s', 'x', 'z', 'c', 'g', 'h']))
        }
        _ => word.strip_suffix('e'),
    };
    let (mut groups, mut inside) = (0, false);
    for c in stem.unwrap_or(word).chars() {
        groups += u32::from(is_vowel(c) && !inside);
        inside = is_vowel(c);
    }
    groups.max(1)
}
