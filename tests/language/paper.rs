//! Reports at the command line: layout, differences, tables, pages; git's diff driver.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Program;

/// The exit code and all output.
fn footlight(folder: &Path, arguments: &[&str]) -> (i32, String) {
    let output = crate::footlight(folder, arguments);
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.code().unwrap(),
        String::from_utf8(said).unwrap(),
    )
}

const OLD: &str = "show \"A\"\nlight a panel glass\nbank lamps = a\ncue 1 at 0:00 { snap lamps 30 }\ncue 2 at 0:30 { time 4 lamps 40 }\n";

#[test]
fn the_shipped_shows_are_in_their_canonical_layout() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let found = crate::sheets(&root.join("examples"));
    assert!(found.len() >= 8, "{found:?}");
    let names: Vec<&str> = found.iter().map(|p| p.to_str().unwrap()).collect();
    let (code, said) = footlight(&root, &[&["fmt", "--check"], names.as_slice()].concat());
    assert_eq!((code, said.as_str()), (0, ""));
}

#[test]
fn fmt_writes_in_place_and_check_only_looks() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.lxq");
    fs::write(&file, OLD).unwrap();
    assert_eq!(
        footlight(folder.path(), &["fmt", "--check", "a.lxq"]),
        (1, "would change a.lxq\n".to_owned())
    );
    assert_eq!(fs::read_to_string(&file).unwrap(), OLD);
    assert_eq!(footlight(folder.path(), &["fmt", "a.lxq"]).0, 0);
    let written = fs::read_to_string(&file).unwrap();
    assert!(
        written.contains("cue 1  at 0:00 { snap  lamps 30 }\n"),
        "{written}"
    );
    assert_eq!(
        footlight(folder.path(), &["fmt", "--check", "a.lxq"]),
        (0, String::new())
    );
    // A file that does not parse stays unchanged.
    fs::write(&file, "bank = 3\n").unwrap();
    let (code, said) = footlight(folder.path(), &["fmt", "a.lxq"]);
    assert!(code == 1 && said.contains("error[E007]"), "{said}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "bank = 3\n");
}

#[test]
fn diff_speaks_and_exits_as_diff_does() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("old.lxq", OLD);
    write("new.lxq", &OLD.replace("lamps 40", "lamps 55"));
    write("wrong.lxq", "bank = 3\n");
    assert_eq!(
        footlight(folder.path(), &["diff", "old.lxq", "old.lxq"]),
        (0, String::new())
    );
    let (code, said) = footlight(
        folder.path(),
        &["diff", "old.lxq", "new.lxq", "-o", "d.svg"],
    );
    assert_eq!(code, 1, "{said}");
    assert!(
        said.starts_with("cue 2: lamps 40 -> 55 at 0:30\n"),
        "{said}"
    );
    assert!(said.contains("every picture still serves"), "{said}");
    assert!(
        fs::read_to_string(folder.path().join("d.svg"))
            .unwrap()
            .contains("<svg")
    );
    assert_eq!(
        footlight(folder.path(), &["diff", "old.lxq", "wrong.lxq"]).0,
        2
    );
    assert_eq!(
        footlight(folder.path(), &["diff", "old.lxq", "none.lxq"]).0,
        2
    );
    assert_eq!(footlight(folder.path(), &["diff", "old.lxq"]).0, 2);
}

#[test]
fn git_takes_it_as_a_diff_driver() {
    let folder = tempfile::tempdir().unwrap();
    let git = |arguments: &[&str]| {
        let program = assert_cmd::cargo::cargo_bin("footlight");
        let driver = format!("diff.lxq.command='{}' diff", program.display());
        let run = Program::new("git")
            .current_dir(folder.path())
            .args(["-c", "user.name=a", "-c", "user.email=a@b", "-c", &driver])
            .args(arguments)
            .output();
        let output = run.unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    if Program::new("git").arg("--version").output().is_err() {
        return;
    }
    git(&["init", "-q"]);
    fs::write(folder.path().join(".gitattributes"), "*.lxq diff=lxq\n").unwrap();
    fs::write(folder.path().join("a.lxq"), OLD).unwrap();
    git(&["add", "."]);
    git(&["commit", "-qm", "one"]);
    fs::write(folder.path().join("a.lxq"), OLD.replace("0:30", "0:31")).unwrap();
    fs::write(folder.path().join("b.lxq"), OLD).unwrap();
    git(&["add", "."]);
    let said = git(&["diff", "--cached"]);
    assert!(
        said.contains("a.lxq\ncue 2: at 0:30 -> 0:31 (1 s later)\n"),
        "{said}"
    );
    assert!(said.contains("b.lxq\n"), "{said}");
    assert!(said.contains("cue 1: added at 0:00\n"), "{said}");
}

#[test]
fn sheets_and_pages_are_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(
        folder.path().join("a.lxq"),
        "show \"A\"\nbank lamps image \"a.png\"\ncue 1 { lamps 0 }\n",
    )
    .unwrap();
    let first = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/first.lxq");
    let (code, said) = footlight(folder.path(), &["tracksheet", first]);
    assert!(
        code == 0 && said.contains("Night") && said.contains("↑80"),
        "{said}"
    );
    let (code, said) = footlight(folder.path(), &["cuesheet", first, "-o", "cues.csv"]);
    assert_eq!(code, 0, "{said}");
    let csv = fs::read_to_string(folder.path().join("cues.csv")).unwrap();
    assert!(csv.starts_with("cue,label,starts"), "{csv}");
    let (code, said) = footlight(folder.path(), &["explain", "e012"]);
    assert!(
        code == 0 && said.starts_with("E012: a name declared twice\n"),
        "{said}"
    );
    let (code, said) = footlight(folder.path(), &["explain", "E9"]);
    assert!(code == 2 && said.contains("there is no code"), "{said}");
}
