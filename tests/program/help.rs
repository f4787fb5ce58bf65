//! Help and manual are correct: every example of every `--help`, and every line of the manual that
//! calls the program, runs in a shell, and every verb's example at the prompt.
#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use footlight_engine::{Background, Engine, Host};
use footlight_host::files::{Folder, MemoryStore};
use footlight_prompt::{Console, Repl, example, verbs};

use crate::outside::{SPOTS, shown_in_the_manual};

/// A show with everything that the examples name.
const SHOW: &str = r#"show "Examples"
preview { tolerance 2%  coarse 1  refined 2  rate 2 }
view house   from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 64x36
view stalls  from 2, -4, 1.2  to 0, 0, 1.2  fov 45  size 64x36

surface floor  reflectance 0.5  quad -3, -3, 0  3, -3, 0  3, 3, 0  -3, 3, 0
surface wall   reflectance 0.6  quad -3, 3, 0  3, 3, 0  3, 3, 3  -3, 3, 3

light left   spot at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd  2700 K
light cloth  spot at 0, -2, 3.5  aim 0, 3, 1.5  beam 60  field 80  400 cd
bank lamps = left
bank sky = cloth rgb

cue 1 at 0:00 { snap  lamps 20  sky #102040 }
cue 2 at 0:10 { time 6  lamps 80 }
cue 3 at 1:30 { time 4  lamps 5  sky #403010 }
"#;

fn project() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A folder with the program and everything that the examples name.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Place {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        write("show.lxq", SHOW);
        write("spots.py", &shown_in_the_manual(SPOTS));
        write("old.lxq", &SHOW.replace("lamps 80", "lamps 60"));
        for name in ["outside.lxq", "set.obj", "set.mtl", "render.py"] {
            let from = project().join("examples/outside").join(name);
            fs::copy(from, folder.path().join(name)).unwrap();
        }
        for name in ["house.asc", "plan.mvr"] {
            let from = project().join("examples/desk").join(name);
            fs::copy(from, folder.path().join(name)).unwrap();
        }
        fs::create_dir(folder.path().join("refs")).unwrap();
        let place = Place(folder);
        assert!(place.shell("footlight fmt old.lxq").status.success());
        for bank in ["lamps", "sky"] {
            let line =
                format!("footlight picture show.lxq --bank {bank} --quality 1 -o refs/{bank}.exr");
            assert_eq!(place.shell(&line).status.code(), Some(0), "{line}");
        }
        let sketch = place.shell("footlight picture show.lxq --cue 3 -o sketch.png");
        assert_eq!(sketch.status.code(), Some(0));
        place
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs a line in a shell with the program on its path.
    fn shell(&self, line: &str) -> Output {
        let program = Path::new(env!("CARGO_BIN_EXE_footlight"));
        let path = std::env::var("PATH").unwrap_or_default();
        let path = format!("{}:{path}", program.parent().unwrap().display());
        let mut command = Command::new("sh");
        command.args(["-c", line]).current_dir(self.path());
        command.env("PATH", path).output().unwrap()
    }

    fn help(&self, command: &str) -> String {
        let output = self.shell(&format!("footlight {command} --help"));
        assert!(output.status.success(), "{command}");
        String::from_utf8(output.stdout).unwrap()
    }
}

/// First words of the lines below `Commands:` up to the next blank one.
fn commands(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap();
    let lines = list.lines().take_while(|l| !l.is_empty());
    let names = lines.filter(|l| l.starts_with("  ") && !l.starts_with("   "));
    names
        .map(|l| l.split_whitespace().next().unwrap().to_owned())
        .collect()
}

#[test]
#[ignore = "slow"]
fn every_example_of_the_help_runs() {
    let place = Place::new();
    let root = place.help("");
    let mut examples: Vec<String> = Vec::new();
    for command in commands(&root) {
        let help = match command.as_str() {
            "help" => continue,
            _ => place.help(&command),
        };
        let own = help.split("Example").nth(1);
        let own = own.unwrap_or_else(|| panic!("{command} has no example"));
        let lines = own.lines().filter_map(|l| l.strip_prefix("  footlight "));
        let before = examples.len();
        examples.extend(lines.map(str::to_owned));
        assert!(examples.len() > before, "{command}");
    }
    let shown = root.split("Examples:").nth(1).unwrap().lines();
    examples.extend(shown.filter_map(|l| l.strip_prefix("  footlight ").map(str::to_owned)));
    // Also those of the manual, except those that need another program.
    let python = Command::new("python3").args(["-c", "0"]).output();
    let has_python = python.is_ok_and(|output| output.status.success());
    let before = examples.len();
    for page in fs::read_dir(project().join("src/manual")).unwrap() {
        let page = page.unwrap().path();
        // The commands of these pages depend on each other; `roads.rs` runs them.
        let roads = ["desk.md", "live.md", "plan.md", "qlc.md"];
        if roads.iter().any(|road| page.ends_with(road)) {
            continue;
        }
        let page = fs::read_to_string(page).unwrap();
        let lines = page.lines().filter_map(|l| l.strip_prefix("footlight "));
        let others = ["ffmpeg", "mitsuba", "blender"];
        let lines = lines.filter(|l| !others.iter().any(|program| l.contains(program)));
        let lines = lines.filter(|l| has_python || !l.contains("python3"));
        examples.extend(lines.map(str::to_owned));
    }
    assert!(
        before >= 20 && examples.len() >= before + 10,
        "{examples:?}"
    );
    let mut seen = BTreeSet::new();
    examples.retain(|example| seen.insert(example.clone()));
    for example in examples {
        // These run until stopped; `serve.rs` and `editor.rs` test them.
        if ["serve", "lsp"]
            .iter()
            .any(|word| example.starts_with(word))
        {
            continue;
        }
        // `diff` reports a difference, and `compare` may report one too; `send` would play the
        // whole show, and is stopped.
        let (limit, fine) = match example.split(' ').next() {
            Some("diff") => ("", Some(1)),
            Some("send") => ("timeout --preserve-status 1s ", Some(143)),
            _ => ("", Some(0)),
        };
        let output = place.shell(&format!("{limit}footlight --quiet {example}"));
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), fine, "footlight {example}\n{said}");
        // The announced output file must exist.
        let words: Vec<&str> = example.split_whitespace().collect();
        let named = words.windows(2).find(|w| w[0] == "-o" || w[0] == ">");
        if let Some(file) = named.map(|w| w[1].trim_matches('\'')) {
            // The first of the numbered images.
            let file = file.replace("####", "0001");
            assert!(place.path().join(file).exists(), "{example}");
        }
    }
}

/// Runs background tasks immediately.
struct AtOnce;

impl Background for AtOnce {
    fn start(&self, task: Box<dyn FnOnce() + Send>) {
        task();
    }
}

#[test]
#[ignore = "slow"]
fn every_verb_does_its_example_at_the_prompt() {
    let place = Place::new();
    for verb in verbs().get_subcommands() {
        let store = MemoryStore::default();
        let bytes = fs::read(place.path().join("show.lxq")).unwrap();
        footlight_host::files::Store::write(&store, Path::new("show.lxq"), &bytes).unwrap();
        for name in ["refs/lamps.exr", "refs/sky.exr", "sketch.png"] {
            let bytes = fs::read(place.path().join(name)).unwrap();
            footlight_host::files::Store::write(&store, Path::new(name), &bytes).unwrap();
        }
        let host = Host {
            files: Box::new(Folder::new(place.path(), 1 << 20)),
            store: Box::new(store),
            background: Some(Box::new(AtOnce)),
            ..Host::default()
        };
        let engine = Engine::open(Path::new("show.lxq"), host).unwrap();
        let mut show = Repl::new(engine, Console::default());
        let before: &[&str] = match verb.get_name() {
            "goto" => &["set lamps 30", "record 2.5 \"Up\" --time 3"],
            "release" | "record" | "update" | "insert" => &["set lamps 30"],
            "undo" => &["cue 2 { lamps 10 }"],
            "redo" => &["cue 2 { lamps 10 }", "undo"],
            "back" => &["goto 3"],
            _ => &[],
        };
        for line in before.iter().chain([&example(verb).as_str()]) {
            if let Err(error) = show.execute(line) {
                let report = error.report(footlight_show::diagnostic::Style::Plain);
                panic!("{line}: {report}");
            }
        }
    }
}
