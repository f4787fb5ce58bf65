//! Bad input from the outside: each gets a clear diagnostic with its place, exit code 1 (or 3 for
//! files), within seconds, and no panic.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

fn footlight(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::cargo_bin("footlight").unwrap();
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    // Far beyond the two seconds that a person waits, so that a busy machine does not fail it.
    command.timeout(std::time::Duration::from_secs(20));
    command.output().unwrap()
}

/// Checks `text` as a show; the exit code and everything that was said.
fn check(text: &[u8], beside: &[(&str, &str)]) -> (i32, String) {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in beside {
        fs::write(folder.path().join(name), content).unwrap();
    }
    fs::write(folder.path().join("show.lxq"), text).unwrap();
    let output = footlight(folder.path(), &["check", "show.lxq"]);
    let said = [output.stdout, output.stderr].concat();
    (
        output.status.code().unwrap_or(-1),
        String::from_utf8(said).unwrap(),
    )
}

/// Every word must be in what was said, and the exit code be 1.
fn refused(text: &[u8], beside: &[(&str, &str)], words: &[&str]) {
    let (code, said) = check(text, beside);
    assert_eq!(code, 1, "{said}");
    assert!(!said.contains("panicked"), "{said}");
    for word in words {
        assert!(said.contains(word), "`{word}` is missing from:\n{said}");
    }
}

const LAMP: &str =
    "show \"x\"\nlight lamp spot at 0,0,3 aim 0,0,0 beam 20 field 40 100 cd\nbank lamps = lamp\n";

#[test]
fn an_unknown_bank_is_named_with_its_place() {
    let show = format!("{LAMP}cue 1 {{ lmps 40 }}\n");
    refused(show.as_bytes(), &[], &["lmps", "show.lxq:4", "lamps"]);
}

#[test]
fn an_unknown_light_is_named_with_its_place() {
    refused(
        b"show \"x\"\nbank lamps = lampe\n",
        &[],
        &["lampe", "show.lxq:2"],
    );
}

#[test]
fn a_bad_number_is_shown() {
    let show = format!("{LAMP}cue 1 {{ lamps 4..0 }}\n");
    refused(show.as_bytes(), &[], &["show.lxq:4"]);
}

#[test]
fn a_level_over_100_percent_is_refused() {
    let show = format!("{LAMP}cue 1 {{ lamps 140 }}\n");
    refused(show.as_bytes(), &[], &["140", "100", "show.lxq:4"]);
}

#[test]
fn a_missing_stage_file_is_named_where_it_is_asked_for() {
    refused(
        b"show \"x\"\nstage \"none.obj\"\n",
        &[],
        &["none.obj", "show.lxq:2", "does not exist"],
    );
}

#[test]
fn a_stage_outside_the_folder_is_not_read() {
    for path in ["../secret.obj", "/etc/passwd", "a/../../secret.obj"] {
        let show = format!("show \"x\"\nstage \"{path}\"\n");
        refused(
            show.as_bytes(),
            &[],
            &["outside the show's folder", "show.lxq:2"],
        );
    }
}

#[test]
fn a_truncated_stage_file_is_refused() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 1 2 7\n";
    refused(
        b"show \"x\"\nstage \"a.obj\"\n",
        &[("a.obj", obj)],
        &["a.obj", "show.lxq:2"],
    );
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1";
    refused(
        b"show \"x\"\nstage \"a.obj\"\n",
        &[("a.obj", obj)],
        &["a.obj", "show.lxq:2"],
    );
}

#[test]
fn an_empty_file_is_no_show() {
    refused(b"", &[], &["show.lxq"]);
    refused(b"\n\n  // nothing\n", &[], &["show.lxq"]);
}

#[test]
fn a_binary_file_is_no_show() {
    refused(
        &[0x7f, b'E', b'L', b'F', 0, 1, 2, 0xff, 0xfe],
        &[],
        &["show.lxq"],
    );
    refused(&[0xff; 4000], &[], &["show.lxq"]);
}

#[test]
fn ten_megabytes_of_brackets_are_refused_at_once() {
    for bracket in ["{", "(", "}", "{\n", "cue 1 {"] {
        let show = bracket.repeat(10_000_000 / bracket.len());
        refused(show.as_bytes(), &[], &["show.lxq"]);
    }
}

#[test]
fn a_show_that_is_not_there_is_a_matter_of_files() {
    let folder = tempfile::tempdir().unwrap();
    let output = footlight(folder.path(), &["check", "none.lxq"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("none.lxq"));
}

#[test]
fn unknown_commands_and_options_are_a_matter_of_usage() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["chekc", "x.lxq"][..],
        &["check"],
        &["plan", "x.lxq", "--tolerence", "2%"],
    ] {
        let output = footlight(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn an_unfinished_declaration_at_the_prompt_ends_with_the_input() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::cargo_bin("footlight").unwrap();
    let input = "cue 1 {\n".to_owned() + &"lamps 4\n".repeat(20_000);
    command
        .current_dir(folder.path())
        .arg("repl")
        .write_stdin(input);
    let output = command
        .timeout(std::time::Duration::from_secs(20))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
}
