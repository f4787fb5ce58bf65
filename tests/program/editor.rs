//! The language server with real clients: Neovim and pytest-lsp, if installed; and its end.

use std::fs;
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};

const SHOW: &str = "show \"Él\"\n\
    light x   spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\n\
    bank lamps = x\n\
    cue 1 \"ü🎭\" at 0:00 { snap  lmaps   50 }\n";

#[test]
fn neovim_is_told_what_is_wrong_and_mends_it() {
    if Command::new("nvim").arg("--version").output().is_err() {
        println!("skipped: nvim is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().canonicalize().unwrap();
    fs::write(path.join("show.lxq"), SHOW).unwrap();
    let client = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/program/editor.lua");
    let mut program = Command::new("nvim");
    program.args([
        "--clean",
        "--headless",
        "-n",
        "-c",
        &format!("luafile {client}"),
    ]);
    program.env("FOLDER", &path).env("HOME", &path);
    program.env("FOOTLIGHT", env!("CARGO_BIN_EXE_footlight"));
    let done = program.output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    let told = fs::read_to_string(path.join("told.json")).expect(&said);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    assert_eq!(told["line"], 3, "{told}");
    // Neovim counts bytes: two for the letter, four for the mask.
    let at = SHOW.lines().nth(3).unwrap().find("lmaps").unwrap();
    assert_eq!(told["column"], at, "{told}");
    assert!(
        told["message"]
            .as_str()
            .unwrap()
            .contains("did you mean `lamps`?")
    );
    assert_eq!(told["fix"], "write `lamps`");
    assert_eq!(told["left"], 0);
    assert!(
        told["hover"].as_str().unwrap().contains("at most 50 %"),
        "{told}"
    );
    let written = fs::read_to_string(path.join("show.lxq")).unwrap();
    let mended = SHOW.replace("lmaps", "lamps");
    let plain = path.join("plain.lxq");
    fs::write(&plain, mended).unwrap();
    let mut fmt = Command::new(env!("CARGO_BIN_EXE_footlight"));
    assert!(fmt.arg("fmt").arg(&plain).status().unwrap().success());
    assert_eq!(written, fs::read_to_string(&plain).unwrap());
}

#[test]
fn pytest_lsp_finds_the_protocol_kept() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let imported = Command::new(&python)
        .args(["-c", "import pytest_lsp"])
        .output();
    if !imported.is_ok_and(|done| done.status.success()) {
        println!("skipped: the Python package pytest-lsp is not installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let tests = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/program/editor.py");
    let mut client = Command::new(python);
    client.args(["-m", "pytest", "-q", "-p", "no:cacheprovider"]);
    // Messages for which the editor has not declared support are errors too.
    client.args(["-W", "error::pytest_lsp.LspSpecificationWarning", tests]);
    client.arg("--basetemp").arg(folder.path().join("shows"));
    client.env("PYTHONDONTWRITEBYTECODE", "1");
    client.env("FOOTLIGHT", env!("CARGO_BIN_EXE_footlight"));
    let done = client.output().unwrap();
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(done.status.success(), "{said}");
}

/// The program with a client that sent nothing.
fn started() -> Child {
    Command::new(env!("CARGO_BIN_EXE_footlight"))
        .arg("lsp")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// The program with an initialized client.
fn begun() -> Child {
    let mut server = started();
    let begin = r#"{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"capabilities":{}}}"#;
    send(&mut server, begin);
    let mut answer = [0; 16];
    let stdout = server.stdout.as_mut().unwrap();
    stdout.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"Content-Length: ");
    server
}

fn send(server: &mut Child, message: &str) {
    let stdin = server.stdin.as_mut().unwrap();
    write!(stdin, "Content-Length: {}\r\n\r\n{message}", message.len()).unwrap();
    stdin.flush().unwrap();
}

#[test]
fn a_client_that_is_killed_is_no_error_to_speak_of() {
    let opened = r#"{"jsonrpc":"2.0","method":"textDocument/didOpen","params":{"textDocument":{
        "uri":"file:///nowhere/a.lxq","languageId":"lxq","version":1,"text":"cue 1 { a"}}}"#;
    for in_a_message in [false, true] {
        let mut server = begun();
        // Close the output, so that diagnostics cannot be sent.
        drop(server.stdout.take());
        send(&mut server, opened);
        if in_a_message {
            let stdin = server.stdin.as_mut().unwrap();
            stdin.write_all(b"Content-Length: 99\r\n\r\n{").unwrap();
        }
        let done = server.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&done.stderr), "");
        assert_eq!(done.status.code(), Some(1));
    }
}

#[test]
fn the_server_ends_as_the_protocol_says() {
    let shutdown = r#"{"jsonrpc":"2.0","id":2,"method":"shutdown"}"#;
    let exit = r#"{"jsonrpc":"2.0","method":"exit"}"#;
    for (messages, code) in [(&[shutdown, exit][..], 0), (&[exit], 1)] {
        let mut server = begun();
        messages
            .iter()
            .for_each(|message| send(&mut server, message));
        let done = server.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&done.stderr), "");
        assert_eq!(done.status.code(), Some(code));
    }
}

#[test]
fn what_comes_before_the_beginning_is_refused() {
    let early = r#"{"jsonrpc":"2.0","id":7,"method":"textDocument/hover","params":{}}"#;
    let opened = r#"{"jsonrpc":"2.0","method":"textDocument/didOpen","params":{}}"#;
    let exit = r#"{"jsonrpc":"2.0","method":"exit"}"#;
    for is_gone in [false, true] {
        let mut server = started();
        if is_gone {
            drop(server.stdout.take());
        }
        // The server may have ended already, like its client.
        let messages = [early, early, opened, early, exit];
        for message in messages {
            let stdin = server.stdin.as_mut().unwrap();
            let length = message.len();
            let _ = write!(stdin, "Content-Length: {length}\r\n\r\n{message}");
        }
        let done = server.wait_with_output().unwrap();
        assert_eq!(String::from_utf8_lossy(&done.stderr), "");
        assert_eq!(done.status.code(), Some(1));
        let said = String::from_utf8_lossy(&done.stdout).into_owned();
        let refusals = if is_gone { 0 } else { 3 };
        assert_eq!(said.matches("-32002").count(), refusals, "{said}");
    }
}
