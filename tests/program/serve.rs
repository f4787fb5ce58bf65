//! `serve` over HTTP: access rights, bounds, visibility of edits and errors, and equal updates for
//! all viewers.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

const SHOW: &str = "show \"Served\"
surface floor reflectance 0.5 box from -3,-3,-1 to 3,3,0
view house from 0,-5,2 to 0,0,0.5 fov 40 size 32x18
light left spot at -2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
bank a = left
cue 1 at 0:00 { snap  a 80 }
cue 2 at 0:02 { time 2  a 15 }
";

/// The program serving a show; it ends with the test.
struct Serving {
    child: Child,
    folder: tempfile::TempDir,
    port: u16,
    run: String,
    watch: String,
}

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Serving {
    fn start() -> Serving {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("s.lxq");
        fs::write(&file, SHOW).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
        command
            .args(["--quiet", "--pool", "off", "serve"])
            .arg(&file);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let mut child = child.unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut token = || loop {
            let line = lines.next().unwrap().unwrap();
            if let Some((_, address)) = line.split_once("http://127.0.0.1:") {
                let (port, token) = address.split_once('/').unwrap();
                return (
                    port.parse().unwrap(),
                    token.trim_end_matches('/').to_owned(),
                );
            }
        };
        let ((port, run), (_, watch)) = (token(), token());
        // Drain the later output.
        std::thread::spawn(move || lines.for_each(drop));
        Serving {
            child,
            folder,
            port,
            run,
            watch,
        }
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("s.lxq")
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(60)))
            .unwrap();
        stream
    }

    /// The raw answer to a request.
    fn raw(&self, request: &str) -> String {
        let mut stream = self.connect();
        // The server may refuse it before it is complete.
        let _ = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn get(&self, path: &str) -> String {
        let port = self.port;
        self.raw(&format!(
            "GET /{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n"
        ))
    }

    fn post(&self, path: &str, headers: &str, body: &str) -> String {
        let (port, length) = (self.port, body.len());
        self.raw(&format!(
            "POST /{path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {length}\r\n{headers}\r\n{body}"
        ))
    }

    fn own(&self) -> String {
        format!("Origin: http://127.0.0.1:{}\r\n", self.port)
    }

    /// Updates for a page, from now on.
    fn events(&self, token: &str) -> impl Iterator<Item = Value> + use<> {
        let mut stream = self.connect();
        let port = self.port;
        write!(
            stream,
            "GET /{token}/events HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n"
        )
        .unwrap();
        let lines = BufReader::new(stream).lines().map(|line| line.unwrap());
        lines.filter_map(|line| serde_json::from_str(line.strip_prefix("data: ")?).ok())
    }
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or_default()
}

const RUN: &str = r#"{"by":"1","cue":"2","time":2.5,"until":4,"ran":0.5,"playing":true,
    "sequence":false,"held":{"a":0.4},"rest":null}"#;

#[test]
fn only_those_with_the_address_are_served_and_only_the_first_runs_the_show() {
    let serving = Serving::start();
    let Serving {
        port, run, watch, ..
    } = &serving;
    let own = serving.own();
    let page = serving.get(&format!("{run}/"));
    assert_eq!(status(&page), "200");
    assert!(page.contains("{\"follows\":false}") && page.contains("connect-src 'self'"));
    assert!(
        !page.contains("Access-Control"),
        "no other page may read it"
    );
    let page = serving.get(&format!("{watch}/?renderer=canvas"));
    assert!(page.contains("{\"follows\":true}") && !page.contains(run.as_str()));
    for path in [
        "",
        "favicon.ico",
        "0000/",
        &run[1..],
        &format!("{}/", run.to_uppercase()),
    ] {
        assert_eq!(status(&serving.get(path)), "403", "{path}");
    }
    assert_eq!(status(&serving.get(&format!("{run}/../{run}/"))), "404");
    assert_eq!(
        status(&serving.get(&format!("{run}/picture/99999999999999999999"))),
        "404"
    );
    // A foreign host name may resolve to this machine, and a foreign page may send requests.
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1"] {
        let request = format!("GET /{run}/ HTTP/1.1\r\nHost: {host}\r\n\r\n");
        assert_eq!(status(&serving.raw(&request)), "421", "{host}");
    }
    let request = format!("GET /{run}/ HTTP/1.1\r\n\r\n");
    assert_eq!(status(&serving.raw(&request)), "421");
    for origin in [
        "http://evil.example",
        "null",
        &format!("https://127.0.0.1:{port}"),
    ] {
        let header = format!("Origin: {origin}\r\n");
        assert_eq!(
            status(&serving.post(&format!("{run}/run"), &header, RUN)),
            "403",
            "{origin}"
        );
    }
    assert_eq!(status(&serving.post(&format!("{run}/run"), "", RUN)), "403");
    let refused = serving.post(&format!("{watch}/run"), &own, RUN);
    assert!(
        status(&refused) == "403" && refused.contains("looks on"),
        "{refused}"
    );
    assert_eq!(
        status(&serving.post(&format!("{run}/show"), &own, RUN)),
        "404"
    );
    assert_eq!(
        status(&serving.post(&format!("{run}/run"), &own, "{}")),
        "400"
    );
    assert_eq!(
        status(&serving.post(&format!("{run}/run"), &own, RUN)),
        "204"
    );
}

#[test]
fn what_a_client_can_take_is_bounded() {
    let serving = Serving::start();
    let Serving { port, run, .. } = &serving;
    let long = format!(
        "GET /{run}/ HTTP/1.1\r\nCookie: {}\r\n\r\n",
        "a".repeat(40 << 10)
    );
    let answer = serving.raw(&long);
    assert!(answer.is_empty() || status(&answer) == "431", "{answer}");
    let many = format!("GET /{run}/ HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(100));
    assert_eq!(status(&serving.raw(&many)), "431");
    for (length, wanted) in [
        ("99999999999999999999", "411"),
        ("1000000000000", "413"),
        ("x", "411"),
    ] {
        let head = format!(
            "POST /{run}/run HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {length}\r\n\r\n"
        );
        assert_eq!(status(&serving.raw(&head)), wanted, "{length}");
    }
    assert_eq!(status(&serving.raw("\u{1}\u{2}\r\n\r\n")), "400");
    assert_eq!(status(&serving.raw("DELETE / HTTP/1.1\r\n\r\n")), "405");
    // Clients without an address, silent or slow, cannot block the page and GO.
    let strangers: Vec<TcpStream> = (0..200)
        .map(|i| {
            let mut stream = serving.connect();
            let begun = if i % 2 == 0 {
                ""
            } else {
                "GET /nobody/ HTTP/1.1\r\nA: "
            };
            stream.write_all(begun.as_bytes()).unwrap();
            stream
        })
        .collect();
    let since = Instant::now();
    assert_eq!(status(&serving.get(&format!("{run}/"))), "200");
    let go = serving.post(&format!("{run}/run"), &serving.own(), "{}");
    assert_eq!(status(&go), "400", "{go}");
    assert!(since.elapsed().as_secs() < 5, "{:?}", since.elapsed());
    drop(strangers);
    assert_eq!(status(&serving.get(&format!("{run}/"))), "200");
}

#[test]
fn edits_and_errors_are_seen_by_all_and_it_ends_at_once() {
    let mut serving = Serving::start();
    let mut pages = [serving.events(&serving.run), serving.events(&serving.watch)];
    let first = pages[0].find(|now| now["version"] == 1).unwrap();
    assert_eq!(first["wrong"], "");
    let data = |serving: &Serving| {
        let answer = serving.get(&format!("{}/show", serving.watch));
        let body = answer.split_once("\r\n\r\n").unwrap().1.to_owned();
        serde_json::from_str::<Value>(&body).unwrap()
    };
    let show = data(&serving);
    assert_eq!(show["title"], "Served");
    let picture = show["pictures"][0]["codes"].as_str().unwrap().to_owned();
    let path = format!("{}/{picture}", serving.watch);
    assert!(serving.get(&path).contains("Content-Type: image/png"));

    // Another level is another version with equal images, as long as the exposure stays.
    fs::write(serving.file(), SHOW.replace("a 15", "a 45")).unwrap();
    let since = Instant::now();
    for page in &mut pages {
        page.find(|now| now["version"].as_u64() >= Some(2)).unwrap();
    }
    eprintln!(
        "an edit is published after {:.0} ms",
        1000.0 * since.elapsed().as_secs_f64()
    );
    let edited = data(&serving);
    let settings = edited["settings"].as_array().unwrap();
    assert!(
        settings
            .iter()
            .any(|s| (s[0].as_f64().unwrap() - 0.45).abs() < 1e-9)
    );
    assert_eq!(
        edited["pictures"][0]["codes"].as_str(),
        Some(picture.as_str())
    );

    // An error is reported with its place and advice; the version stays.
    fs::write(serving.file(), SHOW.replace("a 15", "b 45")).unwrap();
    for page in &mut pages {
        let now = page.find(|now| now["wrong"] != "").unwrap();
        let wrong = now["wrong"].as_str().unwrap();
        assert!(
            wrong.contains("s.lxq:7") && wrong.contains("help"),
            "{wrong}"
        );
    }
    assert_eq!(data(&serving)["settings"], edited["settings"]);
    fs::write(serving.file(), SHOW).unwrap();
    for page in &mut pages {
        page.find(|now| now["wrong"] == "").unwrap();
    }

    // All pages receive an action of the first address, and so do later ones.
    let own = serving.own();
    let posted = Instant::now();
    assert_eq!(
        status(&serving.post(&format!("{}/run", serving.run), &own, RUN)),
        "204"
    );
    for page in &mut pages {
        let now = page.find(|now| now["run"]["cue"] == "2").unwrap();
        assert_eq!(now["run"]["held"]["a"], 0.4);
        assert!(now["age"].as_f64().unwrap() <= posted.elapsed().as_secs_f64());
    }
    std::thread::sleep(Duration::from_millis(300));
    let late = serving.events(&serving.watch).next().unwrap();
    let age = late["age"].as_f64().unwrap();
    assert!(
        (0.3..=posted.elapsed().as_secs_f64()).contains(&age),
        "{age}"
    );

    // Ctrl-C, with pages open.
    kill(
        Pid::from_raw(serving.child.id().cast_signed()),
        Signal::SIGINT,
    )
    .unwrap();
    let since = Instant::now();
    assert_eq!(serving.child.wait().unwrap().code(), Some(130));
    assert!(
        since.elapsed().as_secs_f64() < 1.0,
        "it went on for {:?}",
        since.elapsed()
    );
}

#[test]
fn a_show_that_cannot_be_read_yet_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let missing = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .args(["serve", "none.lxq"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(missing.status.code(), Some(3));
    assert!(missing.stdout.is_empty());
    let serving = Serving::start();
    fs::write(serving.file(), "show \"Empty\"\nbank x = nothing\n").unwrap();
    let mut page = serving.events(&serving.run);
    page.find(|now| now["wrong"].as_str().unwrap().contains("nothing"))
        .unwrap();
    fs::write(serving.file(), SHOW).unwrap();
    page.find(|now| now["wrong"] == "" && now["version"].as_u64() >= Some(1))
        .unwrap();
}
