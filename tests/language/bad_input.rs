//! Bad input from the outside: each gets a clear diagnostic with its place, exit code 1 (or 3 for
//! files), within seconds, and no panic.

use std::fs;

use assert_cmd::Command;

use crate::footlight;

/// Checks `text` as a show; returns the exit code and all output.
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

/// Asserts exit code 1 and that every word is in the output.
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
fn other_files_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    for (name, words) in [
        ("a.obj", "footlight stage a.obj"),
        ("a.mvr", "footlight import a.mvr -o"),
    ] {
        let output = footlight(folder.path(), &["check", name]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            output.status.code() == Some(2) && said.contains(words),
            "{said}"
        );
    }
    let utf_16: Vec<u8> = "\u{feff}show"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    fs::write(folder.path().join("s.lxq"), utf_16).unwrap();
    let output = footlight(folder.path(), &["check", "s.lxq"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        output.status.code() == Some(1) && said.contains("save it as UTF-8"),
        "{said}"
    );
}

/// Exit code, standard output and standard error of `footlight ARGUMENTS` next to a show.
fn told(show: &str, arguments: &[&str]) -> (i32, String, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("show.lxq"), show).unwrap();
    let output = footlight(folder.path(), arguments);
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let code = output.status.code().unwrap_or(-1);
    (code, text(output.stdout), text(output.stderr))
}

#[test]
fn errors_are_told_in_lines_and_in_json() {
    let show = "show \"x\"\n\tbank 照明 = lampe\nbank 照明 = lampe\n";
    let short = "show.lxq:2:12: error[E010]: there is no light called `lampe`\n\
        show.lxq:3:6: error[E012]: `照明` is declared twice\n\
        show.lxq:3:11: error[E010]: there is no light called `lampe`\n";
    for command in ["check", "plan", "repl"] {
        let arguments = ["--format", "short", command, "show.lxq"];
        assert_eq!(told(show, &arguments), (1, short.to_owned(), String::new()));
    }
    let json = concat!(
        r#"[{"code":"E010","help":["the show declares no light yet"],"labels":[{"column":12,"#,
        r#""end":29,"end_column":17,"end_line":2,"file":"show.lxq","line":2,"start":24,"#,
        r#""text":"not declared"}],"message":"there is no light called `lampe`","#,
        r#""severity":"error"}]"#,
        "\n"
    );
    let one = show.split_inclusive('\n').take(2).collect::<String>();
    let arguments = ["check", "show.lxq", "--format", "json"];
    assert_eq!(told(&one, &arguments), (1, json.to_owned(), String::new()));
}

#[test]
fn warnings_are_told_in_lines_and_in_json() {
    let show = "show \"x\"\nlight l spot at 0,0,3 aim 0,0,0 beam 20 field 40 100 cd\n";
    assert_eq!(
        told(show, &["check", "show.lxq", "--format", "short"]),
        (
            0,
            "show.lxq:2:1: warning[W002]: the light `l` is in no bank: it never shines\n"
                .to_owned(),
            String::new()
        )
    );
    let (code, out, _) = told(show, &["check", "show.lxq", "--format", "json"]);
    let found: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert_eq!(found[0]["code"], "W002");
    assert_eq!(found[0]["severity"], "warning");
    let well = "show \"x\"\n";
    let (_, out, _) = told(well, &["check", "show.lxq", "--format", "json"]);
    assert_eq!(out, "[]\n");
    let (_, out, _) = told(well, &["check", "show.lxq", "--format", "short"]);
    assert_eq!(out, "");
}

#[test]
fn what_is_no_error_of_the_text_has_the_same_form() {
    let json = concat!(
        r#"[{"code":null,"help":[],"labels":[],"message":"`none.lxq` does not exist","#,
        r#""severity":"error"}]"#,
        "\n"
    );
    let (code, out, err) = told("", &["check", "none.lxq", "--format", "json"]);
    assert_eq!((code, out.as_str(), err.as_str()), (3, json, ""));
    assert_eq!(told("", &["check", "show.lxq", "--format", "xml"]).0, 2);
}

/// `script` provides a terminal; without it the test is skipped.
#[test]
fn colours_are_for_terminals_that_want_them() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("show.lxq"), "bank = 3\n").unwrap();
    let program = assert_cmd::cargo::cargo_bin("footlight");
    let on_terminal = |no_color: &str, term: &str| {
        let mut script = std::process::Command::new("script");
        script
            .current_dir(folder.path())
            .args(["-qec", &format!("{} check show.lxq", program.display())])
            .arg("/dev/null")
            .env("NO_COLOR", no_color)
            .env("TERM", term);
        script.output().map(|o| o.stdout.contains(&0x1b)).ok()
    };
    let Some(coloured) = on_terminal("", "xterm") else {
        return;
    };
    assert!(coloured);
    assert_eq!(on_terminal("1", "xterm"), Some(false));
    assert_eq!(on_terminal("", "dumb"), Some(false));
    let piped = Command::cargo_bin("footlight")
        .unwrap()
        .current_dir(folder.path())
        .args(["check", "show.lxq"])
        .env_remove("NO_COLOR")
        .output()
        .unwrap();
    assert!(!piped.stderr.contains(&0x1b));
}

#[test]
#[ignore = "slow"]
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
