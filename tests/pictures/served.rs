//! The served page in a real browser: an edit of the file becomes visible, an error appears next to
//! the last good show, and viewers see actions within 100 ms. Skipped without Chromium.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use serde_json::json;

use crate::browser::{Browser, apart};
use crate::page::{SHOW, images, open, picture};

/// The program serving a show; it ends with the test.
struct Serving(Child);

impl Drop for Serving {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Difference of two desks' clocks, seconds.
fn out_of_step(a: &Browser, b: &Browser) -> f64 {
    let begun = |browser: &Browser| {
        let clock = "return Date.now() / 1000 - desk.time - (performance.now() - desk.last) / 1000";
        browser.run(clock).as_f64().unwrap()
    };
    (begun(a) - begun(b)).abs()
}

const READY: &str = "desk.renderer && !document.getElementById('go').disabled";

#[test]
#[ignore = "slow"]
fn in_a_browser_edits_are_seen_and_viewers_are_in_step() {
    let folder = tempfile::tempdir().unwrap();
    for (name, file) in images() {
        fs::write(folder.path().join(name), file).unwrap();
    }
    let file = folder.path().join("show.lxq");
    fs::write(&file, SHOW).unwrap();
    let graphics: &[&str] = &["--disable-gpu"];
    let (Some(desk), Some(viewer)) = (Browser::start(graphics), Browser::start(graphics)) else {
        return;
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command
        .args(["--quiet", "--pool", "off", "serve"])
        .arg(&file);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
    let mut serving = Serving(child.unwrap());
    let lines = BufReader::new(serving.0.stdout.take().unwrap()).lines();
    let lines = lines.map(|line| line.unwrap());
    let mut addresses = lines.filter_map(|line| Some(line.split_once("http")?.1.to_owned()));
    let mut address = || format!("http{}?renderer=canvas", addresses.next().unwrap());
    let (run, watch) = (address(), address());
    desk.visit(&run, READY);
    viewer.visit(&watch, READY);

    // It shows the image of `picture`, to the accuracy of a sum of banks in 8 bits.
    let (mut native, store) = open();
    for seconds in [0.0, 3.1, 9.3] {
        let shown = desk.run(&format!(
            "const moment = momentAt(show, {seconds}); \
             desk.renderer.draw(moment, sumAt(moment.settings)); return told(desk.renderer)"
        ));
        let wanted = picture(&mut native, &store, &format!("{seconds}s"));
        let off = apart(shown.as_str().unwrap(), &wanted);
        eprintln!("served, at {seconds} s: {off} of 255");
        assert!(off <= 6, "at {seconds} s: {off} of 255");
    }
    viewers_follow(&desk, &viewer, &watch);
    edits_are_seen(&desk, &viewer, &file);
    // When the program ends, the page says so and keeps its image.
    drop(serving);
    let state = "document.getElementById('state').textContent";
    desk.wait(&format!("{state}.startsWith('Not connected')"));
    let lost =
        "ERR_CONNECTION_REFUSED|ERR_INCOMPLETE_CHUNKED|ERR_EMPTY_RESPONSE|ERR_CONNECTION_RESET";
    for browser in [&desk, &viewer] {
        let said = browser.console();
        let other = said.iter().filter(|said| {
            let text = said.to_string();
            !lost.split('|').any(|error| text.contains(error))
        });
        assert_eq!(other.count(), 0, "{said:?}");
    }
}

fn viewers_follow(desk: &Browser, viewer: &Browser, watch: &str) {
    let hidden = "getComputedStyle(document.getElementById('go')).display === 'none'";
    viewer.wait(hidden);
    assert_eq!(desk.run(&format!("return {hidden}")), json!(false));
    desk.press(" ");
    viewer.wait("desk.cue === 0 && !desk.playing");
    // A viewer cannot start anything.
    viewer.press(" ");
    viewer.run("go(); back(); document.querySelector('#cues button').click();");
    viewer.visit(watch, READY);
    desk.press(" ");
    for browser in [desk, viewer] {
        browser.wait("desk.cue === 1 && desk.playing && desk.last !== undefined");
    }
    let off = out_of_step(desk, viewer);
    eprintln!("viewers are {:.0} ms apart", 1000.0 * off);
    assert!(off < 0.1, "{off} s apart");
    // A viewer that connects in the middle of a fade is in step too.
    viewer.visit(
        watch,
        &format!("({READY}) && desk.playing && desk.last !== undefined"),
    );
    let off = out_of_step(desk, viewer);
    eprintln!("one that comes later is {:.0} ms apart", 1000.0 * off);
    assert!(off < 0.1, "{off} s apart");
    for browser in [desk, viewer] {
        browser.wait("!desk.playing && Math.abs(desk.time - 4) < 1e-3");
    }
    desk.run("hold(faders[0], { level: 0.4 })");
    viewer.wait("desk.held.get(0) === 0.4");
    viewer.wait("document.getElementById('bank-0').value === '40'");
    desk.press("r");
    viewer.wait("desk.held.size === 0");
    desk.run("seek(4.5)");
    viewer.wait("desk.time === 4.5 && desk.cue === 2");
}

fn edits_are_seen(desk: &Browser, viewer: &Browser, file: &std::path::Path) {
    let wrong = "document.getElementById('wrong')";
    desk.run("toCue(1)");
    let begin = Instant::now();
    let edited = SHOW.replace("cue 2 at 0:02 { time 3", "cue 2 \"Later\" at 0:03 { time 3");
    fs::write(file, &edited).unwrap();
    for browser in [desk, viewer] {
        browser.wait("show.cues[1].label === 'Later' && desk.cue === 1 && desk.time === 3");
    }
    eprintln!(
        "an edit is seen after {:.0} ms",
        1000.0 * begin.elapsed().as_secs_f64()
    );
    viewer.wait("document.getElementById('current').textContent === 'Cue 2 Later'");
    // An error with its place and advice appears, and the last good show stays.
    fs::write(file, edited.replace("cool full", "coool full")).unwrap();
    for browser in [desk, viewer] {
        browser.wait(&format!(
            "!{wrong}.hidden && {wrong}.textContent.includes('show.lxq:9') && \
             {wrong}.textContent.includes('did you mean `cool`')"
        ));
        assert_eq!(browser.run("return show.cues[1].label"), json!("Later"));
        for (width, height) in [(1280, 800), (1440, 900), (390, 844)] {
            browser.resize(width, height);
            browser.wait("document.documentElement.scrollWidth <= innerWidth");
        }
    }
    fs::write(file, edited.replace("cool full", "cool 70")).unwrap();
    for browser in [desk, viewer] {
        browser.wait(&format!(
            "{wrong}.hidden && show.settings.some((s) => Math.abs(s[1] - 0.49) < 1e-9)"
        ));
    }
    // One more bank, and other images.
    let more = edited.replace("bank edge", "bank more image \"warm.exr\"\nbank edge");
    fs::write(file, more).unwrap();
    viewer.wait("faders.length === 5 && document.querySelectorAll('.bank').length === 5");
    desk.wait("faders.length === 5 && desk.cue === 1");
}
