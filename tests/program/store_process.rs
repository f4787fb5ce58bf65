//! The pool on disk between processes: two at once, and one that is killed at any moment.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const SHOW: &str = r#"show "Processes"
preview { tolerance 1%  coarse 1  refined 2 }
stage "room.obj"
view house  from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 160x100
light left   spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd
light right  spot  at  2, -2, 3.5  aim  0.8, 0.5, 0.5  beam 30  field 50  900 cd
bank warm = left
bank cool = right
cue 1 at 0:00 { snap  warm 80  cool 10 }
cue 2 at 0:02 { time 2  warm 15  cool 90 }
"#;

const ROOM: &str =
    "mtllib room.mtl\nv -3 0 3\nv 3 0 3\nv 3 0 -2\nv -3 0 -2\nv 3 3.5 -2\nv -3 3.5 -2
usemtl wall\nf 1 2 3 4\nf 4 3 5 6\n";

fn show(folder: &Path) {
    fs::write(folder.join("s.lxq"), SHOW).unwrap();
    fs::write(folder.join("room.obj"), ROOM).unwrap();
    fs::write(folder.join("room.mtl"), "newmtl wall\nKd 0.5 0.5 0.4\n").unwrap();
}

fn start(folder: &Path, out: &str, pool: &str) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    let arguments = [
        "run", "s.lxq", "--count", "2", "--keys", "-o", out, "--pool", pool,
    ];
    command.current_dir(folder).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn said(output: &Output) -> String {
    let text = [&output.stdout[..], &output.stderr[..]].concat();
    String::from_utf8_lossy(&text).into_owned()
}

fn finish(child: Child) -> String {
    let output = child.wait_with_output().unwrap();
    let text = said(&output);
    assert!(output.status.success(), "{text}");
    assert!(!text.contains("note:"), "{text}");
    text
}

fn same_keys(folder: &Path, one: &str, other: &str) {
    let mut count = 0;
    for entry in fs::read_dir(folder.join(one).join("keys")).unwrap() {
        let name = entry.unwrap().file_name();
        let of = |out: &str| fs::read(folder.join(out).join("keys").join(&name)).unwrap();
        assert!(of(one) == of(other), "{name:?} of {one} and {other}");
        count += 1;
    }
    assert!(count > 1);
}

#[test]
fn two_processes_at_once_share_a_store() {
    let folder = tempfile::tempdir().unwrap();
    show(folder.path());
    finish(start(folder.path(), "alone", "off"));
    assert!(!folder.path().join(".footlight").exists());
    let both = ["a", "b"].map(|out| start(folder.path(), out, ".footlight"));
    both.into_iter().for_each(|child| {
        finish(child);
    });
    same_keys(folder.path(), "alone", "a");
    same_keys(folder.path(), "alone", "b");
    let text = finish(start(folder.path(), "c", ".footlight"));
    assert!(
        text.contains("from the pool: ") && text.contains("rendered: 0"),
        "{text}"
    );
    let ignore = fs::read(folder.path().join(".footlight/.gitignore")).unwrap();
    assert_eq!(ignore, b"*\n");
}

/// Killed after 10, 20, 30 ... milliseconds until a run succeeds; each image left behind is valid.
#[test]
#[ignore = "slow"]
fn a_process_killed_at_any_moment_leaves_a_sound_store() {
    let folder = tempfile::tempdir().unwrap();
    show(folder.path());
    finish(start(folder.path(), "alone", "off"));
    let stored = || {
        let pictures = folder.path().join(".footlight/pictures");
        let scene_keys = fs::read_dir(pictures).into_iter().flatten().flatten();
        let files = scene_keys.flat_map(|g| fs::read_dir(g.path()).into_iter().flatten().flatten());
        let whole = files.filter(|f| f.path().extension().is_some_and(|e| e == "exr"));
        whole.count()
    };
    let mut most = 0;
    for round in 1..=40 {
        let mut child = start(folder.path(), "killed", ".footlight");
        std::thread::sleep(Duration::from_millis(20 * round));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(stored() >= most, "a killed process took something away");
        most = stored();
        if most == 4 {
            break;
        }
    }
    let text = finish(start(folder.path(), "last", ".footlight"));
    let left = format!("rendered: {}\n", 4 - most);
    assert!(text.contains(&left), "{left}: {text}");
    same_keys(folder.path(), "alone", "last");
}
