//! Drives a real browser. Tests are skipped without Chromium.

use std::cell::{Cell, RefCell};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Chromium, controlled through its pipe by the DevTools protocol; it ends with the test.
pub struct Browser {
    process: Child,
    orders: RefCell<ChildStdin>,
    answers: Receiver<Value>,
    session: String,
    count: Cell<u64>,
    /// Console messages of the page.
    said: RefCell<Vec<Value>>,
    _profile: tempfile::TempDir,
}

/// Most seconds that a test waits.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The zero-terminated messages of a pipe.
fn messages(pipe: ChildStdout) -> Receiver<Value> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let parts = BufReader::new(pipe).split(0);
        for message in parts.map_while(Result::ok) {
            let message = serde_json::from_slice(&message).unwrap();
            if sender.send(message).is_err() {
                return;
            }
        }
    });
    receiver
}

impl Browser {
    /// `None` without Chromium.
    pub fn start(graphics: &[&str]) -> Option<Browser> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let runs = |name: &&&str| Command::new(**name).arg("--version").output().is_ok();
        let Some(name) = names.iter().find(runs) else {
            eprintln!("skipped: Chromium does not run here");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        // The browser reads from file descriptor 3 and writes to 4.
        let mut process = Command::new("sh")
            .args(["-c", "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null"])
            .args([name, "--headless", "--no-sandbox", "--disable-quic"])
            .args([
                "--no-first-run",
                "--disable-sync",
                "--remote-debugging-pipe",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
            ])
            .args(graphics)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut browser = Browser {
            orders: RefCell::new(process.stdin.take().unwrap()),
            answers: messages(process.stdout.take().unwrap()),
            process,
            session: String::new(),
            count: Cell::new(0),
            said: RefCell::default(),
            _profile: profile,
        };
        let targets = browser.order("Target.getTargets", json!({}));
        let targets = targets["targetInfos"].as_array().unwrap().clone();
        let page = targets.iter().find(|t| t["type"] == "page").unwrap();
        let attach = json!({ "targetId": page["targetId"], "flatten": true });
        let attached = browser.order("Target.attachToTarget", attach);
        browser.session = attached["sessionId"].as_str().unwrap().to_owned();
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.order(domain, json!({}));
        }
        Some(browser)
    }

    /// The `result` of a command.
    pub fn order(&self, method: &str, parameters: Value) -> Value {
        let id = self.count.get() + 1;
        self.count.set(id);
        let mut order = json!({ "id": id, "method": method, "params": parameters });
        if !self.session.is_empty() {
            order["sessionId"] = json!(self.session);
        }
        let mut pipe = self.orders.borrow_mut();
        write!(pipe, "{order}\0").unwrap();
        pipe.flush().unwrap();
        loop {
            let answer = self.answers.recv_timeout(PATIENCE).unwrap();
            match answer["method"].as_str() {
                Some("Runtime.consoleAPICalled" | "Runtime.exceptionThrown" | "Log.entryAdded") => {
                    self.said.borrow_mut().push(answer);
                }
                Some(_) => {}
                None if answer["id"] == id => {
                    assert!(answer["error"].is_null(), "{method}: {answer}");
                    return answer["result"].clone();
                }
                None => {}
            }
        }
    }

    pub fn evaluate(&self, script: &str) -> Value {
        let expression = format!("(() => {{ {script} }})()");
        let wanted = json!({ "expression": expression, "returnByValue": true });
        self.order("Runtime.evaluate", wanted)
    }

    /// The result of a script on the page.
    pub fn run(&self, script: &str) -> Value {
        let answer = self.evaluate(script);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Opens a page and waits until the script is true.
    pub fn open(&self, page: &Path, query: &str, until: &str) {
        self.visit(&format!("file://{}?{query}", page.display()), until);
    }

    /// Opens an address and waits until the script is true.
    pub fn visit(&self, address: &str, until: &str) {
        self.order("Page.navigate", json!({ "url": address }));
        self.wait(until);
    }

    pub fn wait(&self, until: &str) {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            let answer = self.evaluate(&format!("return Boolean({until})"));
            if answer["result"]["value"] == json!(true) {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let page = self.run("return document.body.innerText.slice(0, 500)");
        panic!("{until} never came; console: {:?}; {page}", self.console());
    }

    /// Lines of a page's report on frames at some times.
    pub fn report(&self, page: &Path, query: &str) -> Vec<String> {
        self.open(page, query, "document.getElementById('test')");
        let text = self.run("return document.getElementById('test').textContent");
        text.as_str().unwrap().lines().map(str::to_owned).collect()
    }

    /// Console messages of the page.
    pub fn console(&self) -> Vec<Value> {
        self.said.borrow().clone()
    }

    /// Presses a key, by its name, in the focused element.
    pub fn press(&self, key: &str) {
        let (number, text) = match key {
            "Enter" => (13, "\r"),
            "Escape" => (27, ""),
            "End" => (35, ""),
            "Home" => (36, ""),
            "ArrowLeft" => (37, ""),
            "ArrowRight" => (39, ""),
            "ArrowDown" => (40, ""),
            letter => (u32::from(letter.to_uppercase().as_bytes()[0]), letter),
        };
        for kind in ["keyDown", "keyUp"] {
            let event = json!({
                "type": kind, "key": key, "windowsVirtualKeyCode": number,
                "text": if kind == "keyDown" { text } else { "" },
            });
            self.order("Input.dispatchKeyEvent", event);
        }
    }

    /// Shows the page in a window of this size.
    pub fn resize(&self, width: u32, height: u32) {
        let size = json!({
            "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false,
        });
        self.order("Emulation.setDeviceMetricsOverride", size);
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Decodes base64.
pub fn decoded(text: &str) -> Vec<u8> {
    let digit = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let mut out = Vec::new();
    let letters: Vec<u8> = text.bytes().filter(|c| *c != b'=').map(digit).collect();
    for four in letters.chunks(4) {
        let bits =
            four.iter().fold(0_u32, |bits, d| bits << 6 | u32::from(*d)) << (6 * (4 - four.len()));
        out.extend_from_slice(&bits.to_be_bytes()[1..four.len()]);
    }
    out
}

/// The largest difference in steps of 255.
pub fn apart(line: &str, picture: &[u8]) -> u8 {
    let codes = decoded(line);
    assert_eq!(codes.len(), picture.len());
    let off = codes.iter().zip(picture).map(|(a, b)| a.abs_diff(*b));
    off.max().unwrap()
}

/// Graphics by software.
pub const WEBGL: &[&str] = &[
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
];
