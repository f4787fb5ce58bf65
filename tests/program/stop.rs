//! Signals end the program soon, with the right code, and leave no process running.
#![cfg(unix)]

use std::fmt::Write as _;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::moments::{VERBS, code, start, tell};

const SHOW: &str = "show \"Stop\"
surface floor reflectance 0.5 box from -3,-3,-1 to 3,3,0
surface block reflectance 0.6 box from -0.5,-0.5,0 to 0.5,0.5,1
view house from 0,-5,2 to 0,0,0.5 fov 40 size 96x54
light left spot at -2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
light right spot at 2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
bank a = left
bank b = right
cue 1 at 0:00 { snap  a 80  b 10 }
cue 2 at 0:02 { time 2  a 15  b 90 }
";

fn footlight(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command.current_dir(folder).args(words);
    command
}

#[test]
fn every_verb_ends_soon_after_a_signal() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("s.lxq", SHOW), ("other.lxq", SHOW)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let moments = [(20, Signal::SIGINT), (90, Signal::SIGTERM)];
    for words in VERBS {
        let typed = |word: &&'static str| if *word == "SHOW" { "s.lxq" } else { *word };
        let words: Vec<&str> = words.iter().map(typed).collect();
        for (after, signal) in moments {
            let mut program = footlight(folder.path(), &words);
            program.args(["--pool", "off", "--quiet"]);
            let told = tell(&mut program, Duration::from_millis(after), signal).unwrap();
            let Some(told) = told else { continue };
            assert!(told.delay < 5.0, "{words:?} went on for {} s", told.delay);
            // Before the handler is installed, the signal itself ends the process; a verb that is
            // just finished ends well.
            let ended = told.status.signal() == Some(signal as i32)
                || told
                    .status
                    .code()
                    .is_some_and(|c| c == code(signal) || c <= 1);
            assert!(ended, "{words:?}: {}", told.status);
        }
    }
}

/// An import of many cues that is stopped: nothing is written.
#[test]
fn an_import_ends_with_a_signal() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from("Clear All\n");
    for group in 1..2_000 {
        writeln!(text, "Group {group}\n  1 thru 500").unwrap();
    }
    for cue in 1..9_999 {
        let levels = (1..40).map(|channel| format!(" {channel} {}", channel * cue % 100));
        writeln!(text, "Cue {cue}\n  Chan{}", levels.collect::<String>()).unwrap();
    }
    fs::write(folder.path().join("a.asc"), text).unwrap();
    let mut program = footlight(folder.path(), &["import", "a.asc", "-o", "a.lxq"]);
    let told = tell(&mut program, Duration::from_millis(100), Signal::SIGTERM).unwrap();
    let told = told.unwrap();
    assert!(told.delay < 5.0, "{}", told.delay);
    assert_eq!(told.status.code(), Some(143));
    assert!(!folder.path().join("a.lxq").exists());
}

/// A renderer that never ends, with a child that would write a file two seconds later: both are
/// killed and their folder removed, whether the renderer runs for a verb or in the background of a
/// waiting prompt.
#[test]
fn a_signal_ends_the_renderer_with_all_it_started() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.lxq"), SHOW).unwrap();
    fs::write(
        folder.path().join("render.sh"),
        "touch \"$1.begun\"; (sleep 2; touch \"$1.late\") & sleep 600\n",
    )
    .unwrap();
    let cases = [
        ("int", Signal::SIGINT, false),
        ("term", Signal::SIGTERM, false),
        ("hup", Signal::SIGHUP, false),
        ("prompt", Signal::SIGTERM, true),
    ];
    let started = cases.map(|(name, signal, prompt)| {
        let temporary = folder.path().join(format!("tmp-{name}"));
        fs::create_dir(&temporary).unwrap();
        let renderer = format!("sh render.sh {name} {{settings}} {{output}}");
        let words = ["--pool", "off", "--renderer", &renderer];
        let verb: &[&str] = match prompt {
            true => &["repl", "s.lxq"],
            false => &["picture", "s.lxq"],
        };
        let mut program = footlight(folder.path(), verb);
        program.args(words).env("TMPDIR", &temporary);
        program.stdin(Stdio::piped());
        let mut child = start(&mut program).unwrap();
        let mut typed = child.stdin.take();
        if let (true, Some(typed)) = (prompt, &mut typed) {
            use std::io::Write;
            typed.write_all(b"refine &\n").unwrap();
        }
        (name, signal, child, typed, temporary)
    });
    for (name, signal, mut child, typed, temporary) in started {
        let begun = folder.path().join(format!("{name}.begun"));
        let since = Instant::now();
        while !begun.exists() {
            assert!(since.elapsed().as_secs() < 60, "{name}: no renderer");
            sleep(Duration::from_millis(5));
        }
        nix::sys::signal::kill(nix::unistd::Pid::from_raw(child.id().cast_signed()), signal)
            .unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(code(signal)), "{name}");
        assert_eq!(fs::read_dir(temporary).unwrap().count(), 0, "{name}");
        drop(typed);
    }
    sleep(Duration::from_millis(2200));
    for (name, ..) in cases {
        let late = folder.path().join(format!("{name}.late"));
        assert!(!late.exists(), "{name}: a child of the renderer went on");
    }
}
