//! The page in which a show is edited: typed in a real browser, and its engine's light against the
//! program's own. Skipped where `examples/live/build` has not made the module of these sources.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use footlight::engine::{self, Engine, Host};
use footlight::files::{MemoryStore, Store};
use footlight::playback::page::MODULE;
use footlight::repl::{Console, Repl};
use footlight::units::Time;
use serde_json::json;

use crate::browser::{Browser, apart, decoded};
use crate::page::{SHOW, open, picture};

/// A set of its own, whose lights are rendered.
const SET: &str = "show \"Set \u{1f3ad}\"
preview { exposure -7  coarse 2  refined 3 }
surface floor reflectance 0.5 box from -3,-3,-1 to 3,3,0
surface block reflectance #8040c0 box from -0.5,-0.5,0 to 0.5,0.5,1
view house from 0,-5,2 to 0,0,0.5 fov 40 size 48x27
light left spot at -2,-2,3 aim 0,0,0 beam 30 field 60 900 cd
light right spot at 2,-2,3 aim 0,0,0 beam 30 field 60 900 cd  #ffb36b
bank a = left
bank b = right
cue 1 at 0:00 { snap  a 80  b 10 }
cue 2 at 0:02 { time 2  a 15  b 90 }
";

/// The engine as a module, if it was made of these sources.
fn module() -> Option<Vec<u8>> {
    let beside = PathBuf::from(env!("CARGO_BIN_EXE_footlight"));
    let release = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/release");
    let folders = [beside.parent().unwrap().to_owned(), release];
    let files = folders.map(|folder| folder.join("footlight-live.wasm"));
    let mut modules = files.iter().filter_map(|file| fs::read(file).ok());
    let mark = MODULE.as_bytes();
    let own = modules.find(|module| module.windows(mark.len()).any(|w| w == mark));
    if own.is_none() {
        eprintln!("skipped: `examples/live/build` has not made the module of these sources");
    }
    own
}

/// A show, and the page of it.
fn live(mut show: Repl, store: &MemoryStore, module: &[u8]) -> (Repl, String) {
    store.write(Path::new("live.wasm"), module).unwrap();
    let told = show.execute("play -o show.html --live --wasm live.wasm");
    let told = told.unwrap().text;
    assert!(told.contains("wrote show.html"), "{told}");
    let html = store.read(Path::new("show.html"), 1 << 25).unwrap();
    (show, String::from_utf8(html).unwrap())
}

fn set() -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let host = Host {
        store: Box::new(store.clone()),
        ..Host::default()
    };
    let engine = Engine::from_text("set.lxq", SET.as_bytes(), host).unwrap();
    (Repl::new(engine, Console::default()), store)
}

#[test]
fn what_is_no_module_of_this_version_is_refused_with_the_way_out() {
    let (mut show, store) = open();
    store
        .write(Path::new("old.wasm"), b"\0asm footlight-live 0.0.1")
        .unwrap();
    for (line, said) in [
        (
            "play -o a.html --live --wasm old.wasm",
            "examples/live/build",
        ),
        ("play -o a.html --live --wasm none.wasm", "none.wasm"),
        ("play -o a.html --live", "--wasm"),
        ("play -o a.png --live", "play -o show.html --live"),
        ("play -o a.html --wasm old.wasm", "--live"),
        ("play -o a.html --live --keys f32", "--keys"),
    ] {
        let error = show.execute(line).unwrap_err();
        let report = error.report(footlight::diagnostic::Style::Plain);
        assert!(report.contains(said), "{line}: {report}");
        assert!(store.read(Path::new("a.html"), 1).is_err());
    }
}

/// Types into the sheet in place of what is there.
fn put(browser: &Browser, old: &str, new: &str) {
    let at = json!(old);
    browser.run(&format!(
        "const at = text.value.indexOf({at}); if (at < 0) throw Error('nothing there'); \
         text.focus(); text.setSelectionRange(at, at + {at}.length);"
    ));
    browser.order("Input.insertText", json!({ "text": new }));
}

const READY: &str = "desk.renderer && !text.readOnly";
const WRONG: &str = "document.getElementById('wrong')";

#[test]
fn in_a_browser_the_sheet_is_typed_and_seen() {
    let Some(module) = module() else { return };
    let (show, store) = open();
    let (mut native, html) = live(show, &store, &module);
    native.execute("play -o plain.html").unwrap();
    let plain = store.read(Path::new("plain.html"), 1 << 25).unwrap();
    let extra = html.len().saturating_sub(plain.len());
    eprintln!("{extra} bytes more than the page that only plays");
    assert!(extra < 3_000_000, "{extra} bytes more");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("show.html");
    fs::write(&file, &html).unwrap();
    let Some(browser) = Browser::start(&["--disable-gpu"]) else {
        return;
    };
    browser.open(&file, "renderer=canvas", READY);
    for seconds in [0.0, 3.1, 9.3] {
        let wanted = picture(&mut native, &store, &format!("{seconds}s"));
        let off = apart(&shown(&browser, seconds), &wanted);
        assert!(off <= 6, "at {seconds} s: {off} of 255");
    }
    browser.run(
        "text.addEventListener('input', () => { self.began = performance.now(); }, true); \
         desk.changed = () => { self.took = performance.now() - self.began; };",
    );
    // The best of some: the machine may have other things to do.
    let mut least = f64::INFINITY;
    let levels = ["full", "90", "80", "70", "65", "60"].map(|level| format!("cool {level}"));
    for pair in levels.windows(2) {
        put(&browser, &pair[0], &pair[1]);
        let level: f64 = pair[1].trim_start_matches("cool ").parse().unwrap();
        let setting = (level / 100.0).powi(2);
        browser.wait(&format!(
            "show.settings.some((s) => Math.abs(s[1] - {setting}) < 1e-9)"
        ));
        least = least.min(browser.run("return self.took").as_f64().unwrap());
    }
    eprintln!("a level is seen {least:.1} ms after it was typed");
    assert!(least < 100.0, "{least} ms");
    let edited = shown(&browser, 4.7);
    a_mistake_is_told(&browser);
    what_fits_is_offered(&browser);
    // GO, from the page beside the sheet.
    browser.press("Escape");
    browser.press(" ");
    browser.wait("desk.cue === 0");
    // What is saved is what `fmt` makes of it, and stands in the sheet then.
    browser.run(
        "self.saved = null; const make = URL.createObjectURL; URL.createObjectURL = (blob) => \
         { blob.text().then((text) => { self.saved = text; }); return make.call(URL, blob); }; \
         document.getElementById('save').click();",
    );
    browser.wait("self.saved !== null");
    let typed = SHOW.replace("cool full", "cool 60");
    let laid = engine::format("show.lxq", typed.as_bytes(), 1 << 30).unwrap();
    assert_eq!(browser.run("return self.saved"), json!(laid));
    assert_eq!(browser.run("return text.value"), json!(laid));
    for (width, height) in [(1280, 800), (1440, 900), (390, 844)] {
        browser.resize(width, height);
        browser.wait("document.documentElement.scrollWidth <= innerWidth");
    }
    // The edited page shows what a page shows that is made of the edited sheet.
    native
        .execute("cue 2 at 0:02 { time 3  curve ease  warm 15  cool 60 }")
        .unwrap();
    let (_, html) = live(native, &store, &module);
    fs::write(&file, html).unwrap();
    browser.open(&file, "renderer=canvas", READY);
    assert_eq!(shown(&browser, 4.7), edited);
    assert!(browser.console().is_empty(), "{:?}", browser.console());
}

/// The codes of a moment on the page.
fn shown(browser: &Browser, seconds: f64) -> String {
    let codes = browser.run(&format!(
        "const moment = momentAt(show, {seconds}); desk.renderer.draw(moment, \
         sumAt(moment.settings)); return told(desk.renderer)"
    ));
    codes.as_str().unwrap().to_owned()
}

fn a_mistake_is_told(browser: &Browser) {
    put(browser, "warm 15", "wram 15");
    browser.wait(&format!(
        "!{WRONG}.hidden && {WRONG}.textContent.includes('did you mean `warm`') && \
         document.querySelector('#colours .error').textContent === 'wram'"
    ));
    let kept = browser.run("return show.settings.some((s) => Math.abs(s[0] - 0.15) < 1e-9)");
    assert_eq!(kept, json!(true), "the last good show stays");
    put(browser, "wram 15", "warm 15");
    browser.wait(&format!("!{WRONG}.textContent.includes('error')"));
}

fn what_fits_is_offered(browser: &Browser) {
    put(browser, "cool 60", "cool 60  wa");
    let offers = "[...document.querySelectorAll('#offers button')].map((b) => b.textContent)";
    browser.wait(&format!("{offers}.some((word) => word.startsWith('warm'))"));
    // A tab takes the first; what was there before comes back.
    let key = json!({ "type": "keyDown", "key": "Tab", "windowsVirtualKeyCode": 9 });
    browser.order("Input.dispatchKeyEvent", key);
    browser.wait("/cool 60  (warm|wash)/.test(text.value)");
    let typed = browser.run("return text.value.match(/cool 60  (warm|wash)/)[0]");
    put(browser, typed.as_str().unwrap(), "cool 60");
    browser.wait(&format!("!{WRONG}.textContent.includes('error')"));
}

#[test]
fn in_a_browser_another_light_is_rendered() {
    let Some(module) = module() else { return };
    let (show, store) = set();
    let (mut native, html) = live(show, &store, &module);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("set.html");
    fs::write(&file, html).unwrap();
    let Some(browser) = Browser::start(&["--disable-gpu"]) else {
        return;
    };
    browser.open(&file, "renderer=canvas", READY);
    put(&browser, "-2,-2,3", "-1,-2,3");
    browser.wait("good.scene === 1 && lit.pictures !== first.pictures");
    browser.wait("document.getElementById('judged').textContent === ''");
    let line = "light left spot at -1,-2,3 aim 0,0,0 beam 30 field 60 900 cd";
    native.execute(line).unwrap();
    let shown = browser.run(
        "const moment = momentAt(show, 3); \
         desk.renderer.draw(moment, sumAt(moment.settings)); return told(desk.renderer)",
    );
    let off = apart(shown.as_str().unwrap(), &picture(&mut native, &store, "3s"));
    eprintln!("another light, rendered in the page: {off} of 255");
    assert!(off <= 4, "{off} of 255");
    assert!(browser.console().is_empty(), "{:?}", browser.console());
}

const ASK: &str = r#"
const [, , file, sheet, ...seconds] = process.argv;
engineOf(require("fs").readFileSync(file)).then((ask) => {
  const opened = ask({ open: JSON.parse(sheet) });
  if (opened.failed) throw Error(opened.failed);
  for (const second of seconds) console.log(ask({ light: Number(second) }).light);
});
"#;

/// The module's light in Node is the program's, channel by channel.
#[test]
fn the_modules_light_is_the_programs() {
    let Some(module) = module() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (file, script) = (
        folder.path().join("live.wasm"),
        folder.path().join("ask.js"),
    );
    fs::write(&file, module).unwrap();
    let code = [include_str!("../../src/playback/page/engine.js"), ASK];
    fs::write(&script, code.concat()).unwrap();
    let sheet = json!({ "name": "set.lxq", "text": SET, "files": {}, "exposure": 0.0 });
    let mut node = Command::new("node");
    let asked = node.arg(&script).arg(&file).arg(sheet.to_string());
    let Ok(output) = asked.args(["0", "3", "4"]).output() else {
        eprintln!("skipped: node does not run here");
        return;
    };
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    let (mut native, _) = set();
    let lines = String::from_utf8(output.stdout).unwrap();
    assert_eq!(lines.lines().count(), 3);
    for (line, seconds) in lines.lines().zip([0.0, 3.0, 4.0]) {
        let bytes = decoded(line);
        let light = bytes
            .chunks_exact(4)
            .map(|v| f32::from_le_bytes(v.try_into().unwrap()));
        let time = Time::from_seconds(seconds).unwrap();
        let image = native.engine_mut().picture(time).unwrap();
        assert_eq!(light.len(), image.data().len());
        let most = image.data().iter().copied().fold(0.0, f32::max);
        let off = light.zip(image.data()).map(|(a, b)| (a - b).abs() / most);
        let off = off.fold(0.0, f32::max);
        eprintln!("at {seconds} s: {off:e} of the brightest");
        assert!(most > 1.0 && off <= 1e-6, "at {seconds} s: {off:e}");
    }
}
