//! The page in a real browser: it plays, shows what `picture` shows, mixes as `picture` does, and
//! says nothing to the console; with WebGL and without. Where no Chromium is installed it is
//! skipped.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use footlight::engine::{Engine, Host};
use footlight::files::{Memory, MemoryStore, Store};
use footlight::picture::exr::{self, Precision};
use footlight::picture::tone::{Curve, Tone};
use footlight::picture::{Image, png};
use footlight::repl::{Console, Repl};
use footlight::timeline::settings as settings_of;
use footlight::units::Time;
use serde_json::{Value, json};

const WIDTH: usize = 48;
const HEIGHT: usize = 27;

/// A bank's picture: a pool of coloured light, a lamp far beyond white in it, a dim ground; and
/// light below zero at the edge where `below` says so.
fn pool(centre: f32, colour: [f32; 3], below: f32) -> Image {
    let mut image = Image::new(WIDTH, HEIGHT);
    for (i, pixel) in image.data_mut().chunks_exact_mut(3).enumerate() {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        let away = (x - centre).hypot(y - 13.0) / 9.0;
        let lamp = if away < 0.2 { 20.0 } else { 0.0 };
        let edge = if i % WIDTH < 4 { below } else { 0.0 };
        let light = 0.01 + (-away * away).exp() + lamp - edge;
        for (channel, c) in pixel.iter_mut().zip(colour) {
            *channel = 40.0 * c * light;
        }
    }
    image
}

/// A title that HTML and scripts would trip over, a dimmer of each kind, jumps, curves and holds.
const SHOW: &str = "show \"A </script> & <b>title</b> \u{e4}\"
preview { exposure -5.4 }
bank warm image \"warm.exr\"
bank cool image \"cool.exr\"  dimmer square
bank edge image \"edge.exr\"  dimmer slow
bank wash image \"wash.exr\" rgb
curve slow = spline 0 0, 0.5 20, 1 100
cue 1 \"Evening\" at 0:00 { snap  warm 80  cool 10  edge 30 }
cue 2 at 0:02 { time 3  curve ease  warm 15  cool full }
cue 3 \"Wash\" at 0:04 { time 2  wash #ff8000 }
cue 4 at 0:07 { snap  warm 0  edge full  hang 1 }
cue 5 { time 2  cool 20  edge 0 }
";

const TIMES: [f64; 5] = [0.0, 3.1, 4.7, 7.0, 9.3];

fn open() -> (Repl, MemoryStore) {
    open_with(SHOW)
}

fn open_with(text: &str) -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let coded = |image: &Image| exr::encode(image, Precision::Float, &[]).unwrap();
    let files = Memory::default()
        .with("warm.exr", coded(&pool(10.0, [1.0, 0.6, 0.3], 0.0)))
        .with("cool.exr", coded(&pool(30.0, [0.2, 0.5, 1.0], 0.0)))
        .with("edge.exr", coded(&pool(20.0, [0.3, 1.0, 0.5], 0.6)))
        .with("wash.exr", coded(&pool(24.0, [0.8, 0.8, 0.8], 0.0)));
    let host = Host {
        files: Box::new(files),
        store: Box::new(store.clone()),
        ..Host::default()
    };
    let engine = Engine::from_text("show.lxq", text.as_bytes(), host).unwrap();
    (Repl::new(engine, Console::default()), store)
}

fn page(show: &mut Repl, store: &MemoryStore) -> String {
    let told = show.execute("play -o show.html").unwrap().text;
    assert!(told.contains("wrote show.html"), "{told}");
    String::from_utf8(store.read(Path::new("show.html"), 1 << 25).unwrap()).unwrap()
}

/// The codes of `picture`, as a PNG file has them.
fn picture(show: &mut Repl, store: &MemoryStore, words: &str) -> Vec<u8> {
    show.execute(&format!("picture {words} -o p.png")).unwrap();
    let file = store.read(Path::new("p.png"), 1 << 25).unwrap();
    let light = png::decode(&file, 1 << 25).unwrap();
    let encoded = |v: &f32| match f64::from(*v) {
        v if v <= 0.003_130_8 => 12.92 * v,
        v => 1.055 * v.powf(1.0 / 2.4) - 0.055,
    };
    let code = |v: &f32| (255.0 * encoded(v)).round() as u8;
    light.data().iter().map(code).collect()
}

/// A browser, driven over HTTP by the WebDriver protocol (W3C); it ends with the test.
struct Browser {
    driver: Child,
    port: u16,
    session: String,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// `None` where there is no Chromium with its driver.
    fn start(graphics: &[&str]) -> Option<Browser> {
        let mut command = Command::new("chromedriver");
        command
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut driver = match command.spawn() {
            Ok(driver) => driver,
            Err(error) => {
                eprintln!("skipped: chromedriver does not run here ({error})");
                return None;
            }
        };
        let mut lines = BufReader::new(driver.stdout.take().unwrap()).lines();
        let started = lines.find_map(|line| {
            let line = line.unwrap();
            let (_, port) = line.split_once("successfully on port ")?;
            port.trim_end_matches('.').parse().ok()
        });
        let profile = tempfile::tempdir().unwrap();
        let mut browser = Browser {
            driver,
            port: started.unwrap(),
            session: String::new(),
            _profile: profile,
        };
        let mut words: Vec<String> = [
            "--headless",
            "--no-sandbox",
            "--disable-quic",
            "--no-first-run",
            "--disable-sync",
            "--disable-background-networking",
            "--disable-component-update",
        ]
        .iter()
        .chain(graphics)
        .map(|word| (*word).to_owned())
        .collect();
        words.push(format!(
            "--user-data-dir={}",
            browser._profile.path().display()
        ));
        let wanted = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": { "args": words },
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let made = browser.post("/session", &wanted);
        browser.session = format!("/session/{}", made["sessionId"].as_str().unwrap());
        Some(browser)
    }

    fn post(&self, path: &str, body: &Value) -> Value {
        self.ask(
            "POST",
            &format!("{}{path}", self.session),
            &body.to_string(),
        )
    }

    /// The `value` of an answer.
    fn ask(&self, verb: &str, path: &str, body: &str) -> Value {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let patience = Some(Duration::from_secs(60));
        stream.set_read_timeout(patience).unwrap();
        let length = body.len();
        write!(
            stream,
            "{verb} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        )
        .unwrap();
        // The driver keeps its connections open, whatever it is asked: the length says when to
        // stop.
        let mut answer = BufReader::new(stream);
        let (mut head, mut length) = (String::new(), 0);
        while !head.ends_with("\r\n\r\n") {
            let start = head.len();
            assert!(answer.read_line(&mut head).unwrap() > 0, "{head}");
            let line = head[start..].to_lowercase();
            if let Some(bytes) = line.strip_prefix("content-length:") {
                length = bytes.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; length];
        answer.read_exact(&mut body).unwrap();
        let answer: Value = serde_json::from_slice(&body).unwrap();
        assert!(head.contains(" 200 "), "{verb} {path}: {answer}");
        answer["value"].clone()
    }

    /// What a script on the page returns.
    fn run(&self, script: &str) -> Value {
        self.post("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// Opens a page and waits until the script is true.
    fn open(&self, page: &Path, query: &str, until: &str) {
        let address = format!("file://{}?{query}", page.display());
        self.post("/url", &json!({ "url": address }));
        self.wait(until);
    }

    fn wait(&self, until: &str) {
        for _ in 0..600 {
            if self.run(&format!("return Boolean({until})")) == json!(true) {
                return;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
        let page = self.run("return document.body.innerText.slice(0, 500)");
        assert!(
            page.is_null(),
            "{until} never came; console: {}; {page}",
            self.console()
        );
    }

    /// The lines of a page's report of frames at some seconds.
    fn report(&self, page: &Path, query: &str) -> Vec<String> {
        self.open(page, query, "document.getElementById('test')");
        let text = self.run("return document.getElementById('test').textContent");
        text.as_str().unwrap().lines().map(str::to_owned).collect()
    }

    /// What the page has said to the console since it was last asked.
    fn console(&self) -> Value {
        self.post("/se/log", &json!({ "type": "browser" }))
    }

    /// Types a key into whatever has the focus.
    fn press(&self, key: &str) {
        let actions = ["keyDown", "keyUp"].map(|kind| json!({ "type": kind, "value": key }));
        let actions = json!({ "actions": [{ "type": "key", "id": "keys", "actions": actions }] });
        self.post("/actions", &actions);
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() && !std::thread::panicking() {
            self.ask("DELETE", &self.session, "");
        }
        // It may have ended by itself.
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

fn decoded(text: &str) -> Vec<u8> {
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
fn apart(line: &str, picture: &[u8]) -> u8 {
    let codes = decoded(line);
    assert_eq!(codes.len(), picture.len());
    let off = codes.iter().zip(picture).map(|(a, b)| a.abs_diff(*b));
    off.max().unwrap()
}

/// Faders held by hand, in percent.
const HELD: [(&str, f64); 4] = [
    ("warm", 35.0),
    ("cool", 60.0),
    ("edge", 75.0),
    ("wash.g", 50.0),
];

/// What those faders show at a time: the sum of the banks by their settings.
fn mixture(show: &mut Repl, seconds: f64) -> Vec<u8> {
    let engine = show.engine_mut();
    engine.coarse().unwrap();
    let time = Time::from_seconds(seconds).unwrap();
    let model = engine.show();
    let mut settings = engine.setting(time);
    for (setting, coordinate) in settings.iter_mut().zip(model.coordinates()) {
        if let Some((_, level)) = HELD.iter().find(|(name, _)| *name == coordinate.name) {
            let dimmer = model.banks[coordinate.bank.unwrap()].dimmer;
            *setting = settings_of(dimmer, &model.curves, &[level / 100.0])[0];
        }
    }
    let mut sum = Image::new(WIDTH, HEIGHT);
    for (setting, image) in settings.iter().zip(engine.pool().unwrap().coarse()) {
        for (to, from) in sum.data_mut().iter_mut().zip(image.data()) {
            *to += *setting as f32 * from;
        }
    }
    let tone = Tone {
        exposure: model.preview.exposure.unwrap(),
        curve: Curve::Filmic,
        dither: false,
    };
    tone.encode(&sum)
}

const WEBGL: &[&str] = &[
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
];

#[test]
fn in_a_browser_the_page_plays_and_shows_what_picture_shows() {
    let (mut show, store) = open();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("show.html");
    std::fs::write(&file, page(&mut show, &store)).unwrap();
    let times = TIMES.map(|t| t.to_string()).join(",");
    let pictures = TIMES.map(|t| picture(&mut show, &store, &format!("{t}s")));
    let mixed = mixture(&mut show, 3.1);
    show.execute("preview { exposure -5.4  dither on }")
        .unwrap();
    let dithered_file = folder.path().join("dithered.html");
    std::fs::write(&dithered_file, page(&mut show, &store)).unwrap();
    let dithered_pictures = TIMES.map(|t| picture(&mut show, &store, &format!("{t}s")));
    let hold = HELD
        .map(|(name, level)| format!("&hold={name}:{level}"))
        .concat();
    for (name, more, graphics) in [
        ("WebGL", "", WEBGL),
        ("canvas", "&renderer=canvas", &["--disable-gpu"][..]),
    ] {
        let Some(browser) = Browser::start(graphics) else {
            return;
        };
        let lines = browser.report(&file, &format!("test={times}{more}"));
        assert_eq!(lines[0], name);
        let played: f64 = lines[1].parse().unwrap();
        assert!((0.3..3.0).contains(&played), "{name} played {played} s");
        assert_eq!(lines.len(), 2 + TIMES.len());
        for ((time, line), picture) in TIMES.iter().zip(&lines[2..]).zip(&pictures) {
            let off = apart(line, picture);
            eprintln!("{name} at {time} s: {off} of 255");
            assert!(off <= 2, "{name} at {time} s: {off} of 255");
        }
        let held = browser.report(&file, &format!("test=3.1{hold}{more}"));
        let off = apart(&held[2], &mixed);
        eprintln!("{name}, mixed by hand: {off} of 255");
        // A sum of pictures in 8 bits: one step for each that is lit, dimmed from far beyond white.
        assert!(
            usize::from(off) <= HELD.len(),
            "{name}, mixed by hand: {off} of 255"
        );
        // Dithered: the pattern of `picture`, one step beside the plain page here and there.
        let dithered_lines = browser.report(&dithered_file, &format!("test={times}{more}"));
        for (at, time) in TIMES.iter().enumerate() {
            let (line, plain) = (&dithered_lines[2 + at], decoded(&lines[2 + at]));
            let off = apart(line, &dithered_pictures[at]);
            assert!(off <= 2, "{name} at {time} s, dithered: {off} of 255");
            assert!(apart(line, &plain) <= 1, "{name} at {time} s");
            let moved = decoded(line)
                .iter()
                .zip(&plain)
                .filter(|(a, b)| a != b)
                .count();
            assert!(
                moved > plain.len() / 20,
                "{name} at {time} s: {moved} of {}",
                plain.len()
            );
        }
        assert_eq!(browser.console(), json!([]), "{name}");
    }
}

/// What a person does, by keyboard and by the names that a screen reader tells.
#[test]
fn the_desk_is_played_by_keyboard_and_tells_what_it_does() {
    let (mut show, store) = open();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("show.html");
    std::fs::write(&file, page(&mut show, &store)).unwrap();
    let Some(browser) = Browser::start(&["--disable-gpu"]) else {
        return;
    };
    browser.open(
        &file,
        "renderer=canvas",
        "!document.getElementById('go').disabled",
    );
    let text = |id: &str| {
        browser.run(&format!(
            "return document.getElementById('{id}').textContent"
        ))
    };
    // GO runs the first cue, a snap; the second takes three seconds and ends complete.
    browser.press(" ");
    browser.wait("document.getElementById('told').textContent.includes('Cue 1')");
    browser.wait("!desk.playing && desk.time === 0");
    browser.press("p");
    browser.wait("desk.playing && desk.time > 0.1");
    browser.press("p");
    browser.wait("!desk.playing");
    // Arrows, End and Home; the time is told in words.
    browser.press("\u{e010}");
    browser.wait("document.getElementById('clock').textContent === '0:10.0'");
    browser.press("\u{e012}");
    browser.wait("Math.abs(desk.time - 9) < 1e-9");
    browser.press("\u{e011}");
    browser.press("\u{e015}");
    // The list follows with the next frame drawn.
    browser.wait(
        "desk.time === 2 && document.querySelector('[aria-current=step]')\
         ?.getAttribute('aria-label') === 'Cue 2, at 0:02.0'",
    );
    browser.wait("document.getElementById('told').textContent.includes('Cue 2')");
    // A fader by its label: what it held, what it holds, and the way back.
    browser.run("document.querySelector('#bank-0').focus()");
    for _ in 0..5 {
        browser.press("\u{e014}");
    }
    browser.wait("document.getElementById('changed').textContent.includes('warm 80 \u{2192} 85')");
    browser.wait(
        "document.activeElement.getAttribute('aria-valuetext') === \
         '85 percent, held; the sheet says 80'",
    );
    browser.wait("document.getElementById('told').textContent === 'warm held at 85'");
    browser.press("r");
    browser.wait("desk.held.size === 0 && document.getElementById('release').hidden");
    // A cue that hangs on the one before runs with its GO, as it does at the prompt.
    browser.run("toCue(3)");
    browser.wait("desk.time === 7 && !desk.playing");
    browser.press("g");
    browser.wait("!desk.playing && desk.time === 10");
    show.execute("goto 3").unwrap();
    let said = show.execute("go").unwrap().text;
    assert!(said.starts_with("at 10s, cue 5"), "{said}");
    // Every control has a name.
    let unnamed = browser.run(
        "return [...document.querySelectorAll('input, button')].filter((e) => \
         !(e.labels?.length || e.textContent || e.getAttribute('aria-label'))).length",
    );
    assert_eq!(unnamed, json!(0));
    assert_eq!(text("title"), json!("A </script> & <b>title</b> \u{e4}"));
    assert_eq!(browser.console(), json!([]));
}

/// What GO comes to, from random presses in the page's own code: one line a press, the cue and the
/// light at rest behind it.
const PRESSES: &str = r#"
const show = JSON.parse(require("fs").readFileSync(process.argv[2], "utf8"));
let state = Number(process.argv[3]);
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
const run = standing(show), near = (a, b) => Math.abs(a - b) < 1e-6;
for (let presses = 0; ; presses++) {
  const before = lightOf(show, run), was = run.cue;
  if (!pressGo(show, run)) break;
  if (run.cue !== was + 1 && presses > 0) throw Error(`cue ${was} to ${run.cue}`);
  const takes = new Map(show.cues[run.cue].moves);
  lightOf(show, run).forEach((light, i) => {
    if (takes.get(i) !== 0 && !near(light, before[i])) throw Error(`${i} jumps from ${before[i]} to ${light}`);
  });
  if (random() < 0.5) { goOn(show, run, 5 * random()); if (random() < 0.7) continue; }
  while (goOn(show, run, 3 * random())) ;
  console.log(run.cue, lightOf(show, run).join(" "));
}
"#;

/// A show with splits, delays, a long fade below short cues, and cues that start by themselves.
const CHAINED: &str = "show \"Chained\"
preview { exposure -5.4 }
bank warm image \"warm.exr\"
bank cool image \"cool.exr\"  dimmer square
bank edge image \"edge.exr\"
bank wash image \"wash.exr\" rgb
cue 1 { time 2  warm 30 }
cue 2 { time 3/5  warm 80  cool 40  follow 1 }
cue 3 { time 20  edge 70  delay 1  hang 2 }
cue 4 { snap  warm 10 }
cue 5 { time 4  wash 60 #ff8000 }
cue 6 { time 2  wash #0040ff  cool out }
cue 7 { blackout }
";

#[test]
fn go_runs_the_cues_as_the_prompt_does_whenever_it_is_pressed() {
    let folder = tempfile::tempdir().unwrap();
    for (text, cues) in [(SHOW, 5), (CHAINED, 7)] {
        let (mut show, store) = open_with(text);
        let html = page(&mut show, &store);
        let data = html.split("id=\"show\">").nth(1).unwrap();
        let data = data.split("</script>").next().unwrap();
        let (json, script) = (folder.path().join("show.json"), folder.path().join("go.js"));
        std::fs::write(&json, data).unwrap();
        let code = [
            include_str!("../../src/playback/page/light.js"),
            include_str!("../../src/playback/page/go.js"),
            PRESSES,
        ];
        std::fs::write(&script, code.concat()).unwrap();
        let mut seen = std::collections::BTreeSet::new();
        for seed in 1..9 {
            let mut node = Command::new("node");
            let Ok(output) = node.arg(&script).arg(&json).arg(seed.to_string()).output() else {
                eprintln!("skipped: node does not run here");
                return;
            };
            let said = String::from_utf8(output.stderr).unwrap();
            assert!(output.status.success(), "seed {seed}: {said}");
            for line in String::from_utf8(output.stdout).unwrap().lines() {
                let mut numbers = line.split(' ').map(|n| n.parse::<f64>().unwrap());
                let cue = numbers.next().unwrap() as usize;
                seen.insert(cue);
                show.execute(&format!("goto {}", cue + 1)).unwrap();
                let document = show.engine().document();
                let wanted = show.live().setting(document);
                for (light, wanted) in numbers.zip(wanted) {
                    assert!((light - wanted).abs() < 1e-5, "seed {seed}: {line}");
                }
            }
        }
        assert!(
            seen.contains(&(cues - 1)) && seen.len() > cues / 2,
            "{seen:?}"
        );
    }
}
