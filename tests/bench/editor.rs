//! Response times of the language server: `cargo bench --bench editor`.
//!
//! The benchmark drives the program as an editor does, through its pipes. A keystroke inserts a
//! character at a random place and removes it again, or changes a digit and restores it, so that
//! half of the texts have errors; a following request makes the server read the show at once,
//! without its pause of 100 ms; the time ends when the diagnostics of that text arrive. Measured on
//! the tavern and on shows of 300 and of 2,000 cues on 200 banks: keystrokes, also while semantic
//! tokens are computed, and all requests. Then memory over 10,000 keystrokes on the tavern, and the
//! image of a cue after a level in it was changed and the show saved. Processor time of all threads
//! is printed next to elapsed time, if the system tells it.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a bench that reports to its reader"
)]

#[path = "cue_sheet.rs"]
mod cue_sheet;

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

use cue_sheet::dice::Dice;
use cue_sheet::{Size, cue_sheet};
use serde_json::{Value, json};

const KEYSTROKES: usize = 200;
const MANY_KEYSTROKES: usize = 10_000;
const SAVES: usize = 20;
const ANSWERS: usize = 5;

/// Requests about the last word of this kind in the text.
const REQUESTS: [(&str, &str); 15] = [
    ("textDocument/semanticTokens/full", "look"),
    ("textDocument/documentSymbol", "look"),
    ("textDocument/foldingRange", "look"),
    ("textDocument/documentLink", "look"),
    ("textDocument/inlayHint", "look"),
    ("textDocument/codeLens", "look"),
    ("textDocument/formatting", "look"),
    ("textDocument/codeAction", "look"),
    ("textDocument/completion", "\n  "),
    ("textDocument/hover", "cue"),
    ("textDocument/definition", "look "),
    ("textDocument/references", "look "),
    ("textDocument/documentHighlight", "look "),
    ("textDocument/prepareRename", "look "),
    ("textDocument/rename", "look "),
];

fn main() {
    let folder = tempfile::tempdir().unwrap();
    let set = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tavern");
    for entry in fs::read_dir(set).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
        }
    }
    let tavern = fs::read_to_string(folder.path().join("tavern.lxq")).unwrap();
    let sheet = |cues: usize| {
        let (banks, moved) = (200, 20);
        let sheet = cue_sheet(Size { banks, cues, moved });
        format!("{sheet}default time 5\nlook night {{ b1 3 }}\n")
    };
    for (name, text) in [
        ("tavern.lxq", &tavern),
        ("300.lxq", &sheet(300)),
        ("2000.lxq", &sheet(2000)),
    ] {
        let begin = Instant::now();
        let mut editor = Editor::open(folder.path(), name, text);
        let opened = 1000.0 * begin.elapsed().as_secs_f64();
        println!("{name}, from the start of the server to the first diagnostics: {opened:.0} ms");
        let times = editor.keystrokes(KEYSTROKES);
        println!("{name}, from a keystroke to the diagnostics: {times}");
        let times = editor.keystrokes_with_colours();
        println!("{name}, a blank while colours are worked out: {times}");
        for (method, word) in REQUESTS {
            let times = editor.answers(method, word);
            println!("{name}, {method}: {times}");
        }
    }
    let mut editor = Editor::open(folder.path(), "tavern.lxq", &tavern);
    editor.keystrokes(KEYSTROKES);
    let before = editor.held();
    editor.keystrokes(MANY_KEYSTROKES);
    println!(
        "tavern.lxq, held after {KEYSTROKES} and after {MANY_KEYSTROKES} more keystrokes: {before} and {} MB",
        editor.held()
    );
    let times = editor.pictures();
    println!("tavern.lxq, from a save to the new picture of cue 4: {times}");
}

/// Repeated timings.
#[derive(Default)]
struct Times {
    /// Elapsed milliseconds.
    passed: Vec<f64>,
    /// Processor milliseconds.
    spent: Vec<f64>,
}

impl std::fmt::Display for Times {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, (times, clock)) in [(&self.passed, "passed"), (&self.spent, "on the processor")]
            .into_iter()
            .enumerate()
        {
            let mut sorted = times.clone();
            sorted.sort_by(f64::total_cmp);
            let Some(worst) = sorted.last() else {
                continue;
            };
            let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
            let (median, most) = (at(0.5), at(0.95));
            let comma = if i > 0 { "; " } else { "" };
            write!(
                f,
                "{comma}median {median:.1}, 95 of 100 {most:.1}, worst {worst:.1} ms {clock}"
            )?;
        }
        Ok(())
    }
}

/// A client with one text open.
struct Editor {
    server: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    uri: String,
    path: std::path::PathBuf,
    text: String,
    version: usize,
    dice: Dice,
}

impl Editor {
    fn open(folder: &Path, name: &str, text: &str) -> Editor {
        let mut server = Command::new(env!("CARGO_BIN_EXE_footlight"))
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let path = folder.canonicalize().unwrap().join(name);
        let mut editor = Editor {
            to: server.stdin.take().unwrap(),
            from: BufReader::new(server.stdout.take().unwrap()),
            server,
            uri: format!("file://{}", path.display()),
            path,
            text: text.to_owned(),
            version: 0,
            dice: Dice::new(7),
        };
        let encodings = json!({ "general": { "positionEncodings": ["utf-8"] } });
        editor.ask("initialize", json!({ "capabilities": encodings }));
        editor.tell("initialized", json!({}));
        let document =
            json!({ "uri": editor.uri, "languageId": "lxq", "version": 0, "text": text });
        editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
        editor.diagnostics();
        editor
    }

    fn send(&mut self, message: &Value) {
        let message = message.to_string();
        write!(
            self.to,
            "Content-Length: {}\r\n\r\n{message}",
            message.len()
        )
        .unwrap();
        self.to.flush().unwrap();
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The answer to the only pending request.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.send(&json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params }));
        let answer = self.wait(|message| message["id"] == 1 && message["method"].is_null());
        assert!(answer["error"].is_null(), "{method}: {answer}");
        answer
    }

    fn wait(&mut self, is_it: impl Fn(&Value) -> bool) -> Value {
        loop {
            let mut length = 0;
            let mut line = String::new();
            while line != "\r\n" {
                line.clear();
                self.from.read_line(&mut line).unwrap();
                if let Some(bytes) = line.strip_prefix("Content-Length: ") {
                    length = bytes.trim().parse().unwrap();
                }
            }
            let mut message = vec![0; length];
            self.from.read_exact(&mut message).unwrap();
            let message = serde_json::from_slice(&message).unwrap();
            if is_it(&message) {
                return message;
            }
        }
    }

    /// Waits for the diagnostics of the current text.
    fn diagnostics(&mut self) {
        let version = self.version;
        self.wait(|message| {
            message["method"] == "textDocument/publishDiagnostics"
                && message["params"]["version"] == version
        });
    }

    /// Replaces some bytes, and waits for the diagnostics.
    fn put(&mut self, at: usize, bytes: usize, new: &str, times: &mut Times) {
        let place = |at: usize| {
            let before = &self.text[..at];
            let line = before.rfind('\n').map_or(0, |end| end + 1);
            json!({ "line": before.matches('\n').count(), "character": at - line })
        };
        let range = json!({ "start": place(at), "end": place(at + bytes) });
        self.version += 1;
        let document = json!({ "uri": self.uri, "version": self.version });
        let change = json!({
            "textDocument": document, "contentChanges": [{ "range": range, "text": new }],
        });
        self.text.replace_range(at..at + bytes, new);
        let begin = self.begin();
        self.tell("textDocument/didChange", change);
        let document = json!({ "textDocument": { "uri": self.uri } });
        let lenses = "textDocument/codeLens";
        self.send(&json!({ "jsonrpc": "2.0", "id": 2, "method": lenses, "params": document }));
        self.diagnostics();
        self.end(begin, times);
    }

    fn keystrokes(&mut self, count: usize) -> Times {
        let mut times = Times::default();
        while times.passed.len() < count {
            let mut at = self.dice.whole(0, self.text.len() - 1);
            while !self.text.is_char_boundary(at) {
                at -= 1;
            }
            let typed = ["x", "{", "}", "\"", " ", "7", "\n"][self.dice.whole(0, 6)];
            self.put(at, 0, typed, &mut times);
            self.put(at, typed.len(), "", &mut times);
            let rest = &self.text[at..];
            let Some(digit) = rest.find(|c: char| c.is_ascii_digit()) else {
                continue;
            };
            let at = at + digit;
            let old = self.text[at..=at].to_owned();
            let new = self.dice.whole(0, 9).to_string();
            self.put(at, 1, &new, &mut times);
            self.put(at, 1, &old, &mut times);
        }
        times
    }

    /// Sends requests about the whole text, or about a word in it.
    fn answers(&mut self, method: &str, word: &str) -> Times {
        let mut times = Times::default();
        let at = self.text.rfind(word).unwrap();
        let line = self.text[..at].matches('\n').count();
        let column = at - self.text[..at].rfind('\n').map_or(0, |end| end + 1);
        let column = if word.ends_with(' ') {
            column + word.len()
        } else {
            column + 1
        };
        let place = json!({ "line": line, "character": column });
        let asked = json!({
            "textDocument": { "uri": self.uri }, "position": place, "newName": "another",
            "range": { "start": place, "end": place },
            "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1 },
            "options": { "tabSize": 2, "insertSpaces": true },
        });
        for _ in 0..ANSWERS {
            let begin = self.begin();
            self.ask(method, asked.clone());
            self.end(begin, &mut times);
        }
        times
    }

    /// Types while semantic tokens are computed, which editors request after each change.
    fn keystrokes_with_colours(&mut self) -> Times {
        let mut times = Times::default();
        let at = self.text.rfind('}').unwrap();
        for i in 0..KEYSTROKES / 4 {
            let document = json!({ "textDocument": { "uri": self.uri } });
            let colours = "textDocument/semanticTokens/full";
            self.send(
                &json!({ "jsonrpc": "2.0", "id": 1000 + i, "method": colours, "params": document }),
            );
            self.put(at, 0, " ", &mut times);
        }
        times
    }

    /// Changes a level of cue 4 and saves.
    fn pictures(&mut self) -> Times {
        let picture = json!({ "command": "footlight.picture", "arguments": [self.uri, "4"] });
        let begin = Instant::now();
        self.ask("workspace/executeCommand", picture);
        println!(
            "tavern.lxq, the first picture of cue 4: {:.1} s",
            begin.elapsed().as_secs_f64()
        );
        let before = "lit     = outdoors + { lamps ";
        let at = self.text.find(before).unwrap() + before.len();
        let mut times = Times::default();
        for level in 0..SAVES {
            let typed = (30 + level).to_string();
            self.put(at, 2, &typed, &mut Times::default());
            fs::write(&self.path, &self.text).unwrap();
            let begin = self.begin();
            let document = json!({ "uri": self.uri });
            self.tell("textDocument/didSave", json!({ "textDocument": document }));
            self.wait(|message| message["method"] == "footlight/picture");
            self.end(begin, &mut times);
        }
        times
    }

    fn begin(&self) -> (Instant, Option<f64>) {
        (Instant::now(), self.spent())
    }

    fn end(&self, (begin, spent): (Instant, Option<f64>), times: &mut Times) {
        times.passed.push(1000.0 * begin.elapsed().as_secs_f64());
        let spent = self.spent().zip(spent);
        times.spent.extend(spent.map(|(now, then)| now - then));
    }

    /// Processor milliseconds of the server's threads.
    fn spent(&self) -> Option<f64> {
        let threads = fs::read_dir(format!("/proc/{}/task", self.server.id())).ok()?;
        let mut nanoseconds = 0.0;
        for thread in threads {
            let text = fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?;
            nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
        }
        Some(1e-6 * nanoseconds)
    }

    /// Megabytes of the server; empty if the system does not tell.
    fn held(&self) -> String {
        let status = fs::read_to_string(format!("/proc/{}/status", self.server.id()));
        let status = status.unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let bytes = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
        bytes.map_or("?".to_owned(), |kilobytes| {
            format!("{:.1}", kilobytes / 1024.0)
        })
    }
}

impl Drop for Editor {
    fn drop(&mut self) {
        // The server ends with its input; it may have ended already.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
