//! A stranger's show, whose title, labels and names contain terminal controls and direction
//! overrides: no verb passes them on unseen.
#![cfg(unix)]

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use nix::pty::openpty;

/// Renames the window, clears it, moves back, overrides the direction, hides.
const HOSTILE: &str = "\u{1b}]0;pwn\u{7}\u{1b}[2J\u{9b}31m\u{8}\u{7f}\u{202e}\u{2066}\u{200f}\
    \u{61c}\u{200b}\u{feff}\u{2028}=<b>|`,\u{85}end";

/// Characters that no output may contain, by Unicode's own lists.
fn is_forbidden(c: char) -> bool {
    (c.is_control() && c != '\n')
        || "\u{61c}\u{200b}\u{200e}\u{200f}\u{2028}\u{2029}\u{202a}\u{202b}\u{202c}\u{202d}\u{202e}\
            \u{2060}\u{2066}\u{2067}\u{2068}\u{2069}\u{feff}"
            .contains(c)
}

fn assert_clean(what: &str, text: &str) {
    let line = text.lines().find(|line| line.chars().any(is_forbidden));
    assert!(line.is_none(), "{what}: {line:?}");
}

/// A folder of hostile files: `show.lxq` has no errors, each of the others has some.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let name = format!("{}.obj", HOSTILE.replace('/', ""));
    let write = |name: &str, text: String| fs::write(folder.path().join(name), text).unwrap();
    let faces = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    write(
        &name,
        format!("mtllib x.mtl\n{faces}o {HOSTILE}\nusemtl glass\nf 1 2 3 4\n"),
    );
    write("x.mtl", "newmtl glass\nKd 0.5 0.5 0.5\n".to_owned());
    let show = |title: &str, label: &str| {
        format!(
            "show \"{title}\"\nstage \"{name}\"\nview house from 0, -9, 2 to 0, 0, 1 fov 40 size 32x18\n\
             light key spot at 0, -4, 3 aim 0, 0, 1 beam 20 field 30 900 cd\nbank lamps = key\n\
             bank 照明 = key\ngroup all = lamps 照明 // {HOSTILE}\n\
             cue 1 \"{label}\" at 0:00 {{ snap lamps 50 }}\ncue 2 \"{HOSTILE}\" {{ time 3 lamps 80\n\
             \tpart 2 \"{HOSTILE}\" {{ 照明 20 }} }}\n"
        )
    };
    write("show.lxq", show(HOSTILE, HOSTILE));
    write("older.lxq", show("Older", "Older"));
    let broken = |statement: &str| format!("show \"{HOSTILE}\" {statement}\n");
    write(&format!("{HOSTILE}.lxq"), broken("lmaps"));
    write(
        "stage.lxq",
        broken(
            "\nstage \"missing{\u{9b}}.obj\"\nstage \"names.obj\"\nstage \"names.gltf\"\nstage \"number.obj\"\nstage \"colour.obj\"",
        ),
    );
    write(
        "names.obj",
        format!("{faces}mtllib {HOSTILE}.mtl\nusemtl {HOSTILE}\nf 1 2 3\n"),
    );
    write(
        "colour.obj",
        format!("mtllib colour.mtl\n{faces}usemtl x\nf 1 2 3\n"),
    );
    write("colour.mtl", format!("newmtl x\nKd {HOSTILE} 0 0\n"));
    write("number.obj", format!("v 0 {HOSTILE} 0\n"));
    let json = serde_json::Value::String(format!("a\n{HOSTILE}")).to_string();
    let gltf = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"extensionsRequired\": [{json}], \
         \"nodes\": [{{\"mesh\": 7, \"name\": {json}}}], \"scenes\": [{{\"nodes\": [0]}}]}}"
    );
    write("names.gltf", gltf);
    let light = format!("IESNA:LM-63-2002\n[MANUFAC] {HOSTILE}\nTILT=NONE\n1 {HOSTILE} 1 3\n");
    write("light.ies", light);
    write(
        "light.lxq",
        broken(
            "\nlight desk photometric \"light.ies\" at 0, 0, 2 aim 0, 0, 0\nbank b = desk\ncue 1 at 0:00 { snap b 5 }",
        ),
    );
    folder
}

/// Runs the program in a folder; returns both of its outputs.
fn run(folder: &Path, words: &[&str], typed: &str) -> String {
    let mut child = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .current_dir(folder)
        .args(["--pool", "off"])
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(typed.as_bytes())
        .unwrap();
    let done = child.wait_with_output().unwrap();
    let out = [done.stdout, done.stderr].concat();
    String::from_utf8(out).unwrap()
}

#[test]
fn no_verb_of_the_prompt_prints_what_commands_the_terminal() {
    let folder = folder();
    let hostile = format!("unknown{HOSTILE}");
    let lines = [
        "check",
        "show",
        "show cue 2",
        "show show",
        "show group all",
        "at 0:02",
        "go",
        "back",
        "goto 2",
        "set lamps 30",
        "set",
        "record 3 \"\u{202e}\u{1b}c\"",
        "undo",
        "redo",
        "cuesheet",
        "tracksheet",
        "hookup",
        "schedule",
        "status",
        "plan",
        "plan --json",
        "pool",
        "view",
        "diff",
        "diff older.lxq",
        "help",
        "explain E010",
        "plot",
        "play",
        "blind",
        "fmt --check",
        "export -o desk.asc",
        "export -o desk.qxw",
        "cuesheet -o sheet.csv",
        "cuesheet -o sheet.md",
        "cuesheet -o sheet.txt",
        "tracksheet -o tracks.csv",
        "hookup -o lights.csv",
        "plot rig -o rig.svg",
        "plot -o curves.svg",
        "play -o show.html",
        "picture -o picture.exr",
        "save \u{1b}[2J.lxq",
        "lmaps \u{9b} 5",
        "cue 9 \"\u{1b}\" { lmaps\u{202e} 5 }",
        "cue 10 \"\u{1b}[31m\u{202e}\" { lamps 5 }",
    ];
    let named = [
        "help",
        "explain",
        "show",
        "at",
        "goto",
        "view",
        "plot",
        "diff",
        "set",
        "plan",
        "picture -o",
        "solve",
        "",
    ];
    let mut typed: String = lines.iter().map(|line| format!("{line}\n")).collect();
    for verb in named {
        typed += &format!("{verb} {hostile}\n");
    }
    let said = run(folder.path(), &["repl", "show.lxq"], &typed);
    assert_clean("the prompt", &said);
    assert!(said.contains("␛]0;pwn␇␛[2J�31m"), "{said}");
    for file in [
        "sheet.csv",
        "sheet.md",
        "sheet.txt",
        "tracks.csv",
        "curves.svg",
    ] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        assert_clean(file, &text.replace("\r\n", "\n"));
    }
    let page = fs::read_to_string(folder.path().join("show.html")).unwrap();
    assert_clean("show.html", &page);
    assert!(page.contains("=&lt;b&gt;"));
    let header = fs::read(folder.path().join("picture.exr")).unwrap();
    assert!(!header.windows(4).any(|w| w == b"]0;p" || w == b"\x1b[2J"));
}

#[test]
fn no_command_prints_what_commands_the_terminal() {
    let folder = folder();
    let named = format!("{HOSTILE}.lxq");
    let said = run(folder.path(), &["check", "stage.lxq"], "");
    for file in ["names.gltf", "number.obj", "colour.mtl"] {
        let line = said
            .lines()
            .find(|line| line.contains(&format!("`{file}`")));
        assert!(
            line.is_some_and(|line| line.contains("␛]0;pwn␇␛[2J�31m")),
            "{said}"
        );
    }
    assert!(
        said.contains("`␛]0;pwn␇␛[2J�31m"),
        "the library that an OBJ names: {said}"
    );
    let said = run(folder.path(), &["check", "light.lxq"], "");
    assert!(said.contains("line 4: `␛]0;pwn␇␛[2J�31m"), "{said}");
    let missing = format!("missing{HOSTILE}.lxq");
    for words in [
        &["check", "show.lxq"][..],
        &["check", "show.lxq", "--format", "json"],
        &["check", &named],
        &["check", &named, "--format", "short"],
        &["check", &named, "--format", "json"],
        &["check", "stage.lxq"],
        &["check", "stage.lxq", "--format", "short"],
        &["check", "light.lxq"],
        &["check", &missing],
        &["diff", "older.lxq", "show.lxq"],
        &["diff", "older.lxq", &missing],
        &["fmt", "--check", &missing],
        &["fmt", "--check", "show.lxq"],
        &["explain", HOSTILE],
        &[HOSTILE],
        &[&named],
        &["check", "show.lxq", HOSTILE],
        &["check", "show.lxq", "--format", HOSTILE],
        &["play", "show.lxq", "--renderer", HOSTILE],
        &["plot", "rig", &named],
    ] {
        let said = run(folder.path(), words, "");
        assert!(!said.is_empty(), "{words:?}");
        assert_clean(&format!("{words:?}"), &said);
        if words.contains(&"json") {
            let _: serde_json::Value = serde_json::from_str(&said).unwrap();
        }
    }
}

#[test]
fn at_a_terminal_only_our_own_colours_pass() {
    let folder = folder();
    let pty = openpty(None, None).unwrap();
    let end = || Stdio::from(pty.slave.try_clone().unwrap());
    let mut child = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .current_dir(folder.path())
        .args(["check", "--pool", "off", "stage.lxq"])
        .env("TERM", "xterm")
        .env_remove("NO_COLOR")
        .stdin(Stdio::null())
        .stdout(end())
        .stderr(end())
        .spawn()
        .unwrap();
    drop(pty.slave);
    let mut bytes = Vec::new();
    // The read fails once the program has ended.
    let _ = fs::File::from(pty.master).read_to_end(&mut bytes);
    child.wait().unwrap();
    let shown = String::from_utf8(bytes).unwrap().replace("\r\n", "\n");
    let mut plain = String::new();
    for (i, part) in shown.split("\u{1b}[").enumerate() {
        let sgr = part.find(|c: char| !(c.is_ascii_digit() || c == ';'));
        let colour = i > 0 && sgr.is_some_and(|at| part[at..].starts_with('m'));
        assert!(i == 0 || colour, "{part:?}");
        plain += part
            .get(sgr.filter(|_| colour).map_or(0, |at| at + 1)..)
            .unwrap();
    }
    assert!(
        plain.len() < shown.len() && plain.contains("error"),
        "{shown}"
    );
    assert_clean("colours", &plain);
}
