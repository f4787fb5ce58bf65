//! The page in a real browser: it plays, shows the image of `picture`, mixes like `picture`, and
//! logs nothing to the console; with WebGL and without. Skipped without Chromium.

use std::path::Path;
use std::process::Command;

use footlight_engine::{Engine, Host};
use footlight_host::files::{Memory, MemoryStore, Store};
use footlight_picture::exr::{self, Precision};
use footlight_picture::tone::Tone;
use footlight_picture::{Image, decode};
use footlight_prompt::{Console, Repl};
use footlight_show::timeline::settings as settings_of;
use footlight_show::units::Time;
use footlight_show::units::ToneCurve;
use serde_json::{Value, json};

use crate::browser::{Browser, WEBGL, apart};

const WIDTH: usize = 48;
const HEIGHT: usize = 27;

/// A bank's image: a pool of coloured light, a lamp far beyond white in it, a dim ground; and
/// negative light at the edge if `below` is set.
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

/// A title that could break HTML and scripts, a dimmer of each kind, jumps, curves and holds.
pub const SHOW: &str = "show \"A </script> & <b>title</b> \u{e4}\"
preview { exposure -5.4 }
bank warm image \"warm.exr\"  channel 3
bank cool image \"cool.exr\"  dimmer square
bank edge image \"edge.exr\"  dimmer slow
bank wash image \"wash.exr\" rgb
curve slow = spline 0 0, 0.5 20, 1 100
cue 1 \"Evening\" at 0:00 { snap  warm 80  cool 10  edge 30 }
cue 2 at 0:02 { time 3  curve ease  warm 15  cool full }
cue 3 \"Wash\" at 0:04 { time 2  wash #ff8000  note \"on <b>applause</b>\" }
cue 4 at 0:07 { snap  warm 0  edge full  hang 1 }
cue 5 { time 2  cool 20  edge 0 }
";

pub const TIMES: [f64; 5] = [0.0, 3.1, 4.7, 7.0, 9.3];

/// The images of the show.
pub fn images() -> [(&'static str, Vec<u8>); 4] {
    let coded = |image: &Image| exr::encode(image, Precision::Float, &[]).unwrap();
    [
        ("warm.exr", coded(&pool(10.0, [1.0, 0.6, 0.3], 0.0))),
        ("cool.exr", coded(&pool(30.0, [0.2, 0.5, 1.0], 0.0))),
        ("edge.exr", coded(&pool(20.0, [0.3, 1.0, 0.5], 0.6))),
        ("wash.exr", coded(&pool(24.0, [0.8, 0.8, 0.8], 0.0))),
    ]
}

pub fn open() -> (Repl, MemoryStore) {
    open_with(SHOW)
}

fn open_with(text: &str) -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let add = |files: Memory, (name, file)| files.with(name, file);
    let files = images().into_iter().fold(Memory::default(), add);
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

/// The codes of `picture`, from its PNG file.
pub fn picture(show: &mut Repl, store: &MemoryStore, words: &str) -> Vec<u8> {
    show.execute(&format!("picture {words} -o p.png")).unwrap();
    let file = store.read(Path::new("p.png"), 1 << 25).unwrap();
    let light = decode::light(&file, 1 << 25).unwrap();
    let encoded = |v: &f32| match f64::from(*v) {
        v if v <= 0.003_130_8 => 12.92 * v,
        v => 1.055 * v.powf(1.0 / 2.4) - 0.055,
    };
    let code = |v: &f32| (255.0 * encoded(v)).round() as u8;
    light.data().iter().map(code).collect()
}

/// Held faders, in percent.
const HELD: [(&str, f64); 4] = [
    ("warm", 35.0),
    ("cool", 60.0),
    ("edge", 75.0),
    ("wash.g", 50.0),
];

/// The image with these faders at a time: the sum of the banks by their settings.
fn mixture(show: &mut Repl, seconds: f64) -> Vec<u8> {
    let engine = show.engine_mut();
    engine.coarse().unwrap();
    let time = Time::from_seconds(seconds).unwrap();
    let model = engine.show();
    let mut settings = engine.document().setting(time);
    for (setting, coordinate) in settings.iter_mut().zip(model.coordinates()) {
        if let Some((_, level)) = HELD.iter().find(|(name, _)| *name == coordinate.name) {
            let dimmer = model.banks[coordinate.bank.unwrap()].dimmer;
            *setting = settings_of(dimmer, &model.curves, &[level / 100.0])[0];
        }
    }
    let mut sum = Image::new(WIDTH, HEIGHT);
    for (setting, image) in settings
        .iter()
        .zip(engine.estimate().pool().unwrap().coarse())
    {
        for (to, from) in sum.data_mut().iter_mut().zip(image.data()) {
            *to += *setting as f32 * from;
        }
    }
    let tone = Tone {
        exposure: model.preview.exposure.unwrap(),
        curve: ToneCurve::Filmic,
    };
    tone.encode(&sum)
}

#[test]
#[ignore = "slow"]
fn in_a_browser_the_page_plays_and_shows_what_picture_shows() {
    let (mut show, store) = open();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("show.html");
    let html = page(&mut show, &store);
    std::fs::write(&file, &html).unwrap();
    let added_file = folder.path().join("added.html");
    std::fs::write(&added_file, without_keys(&html)).unwrap();
    let heads_file = folder.path().join("heads.html");
    std::fs::write(
        &heads_file,
        changed(&html, |data| data["heads"] = json!(true)),
    )
    .unwrap();
    let times = TIMES.map(|t| t.to_string()).join(",");
    let pictures = TIMES.map(|t| picture(&mut show, &store, &format!("{t}s")));
    let mixed = mixture(&mut show, 3.1);
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
        // A sum of images in 8 bits: one step for each lit one, dimmed from far beyond white.
        assert!(
            usize::from(off) <= HELD.len(),
            "{name}, mixed by hand: {off} of 255"
        );
        // With heads the change is added to the keys, and each image is rounded for itself.
        let held = browser.report(&heads_file, &format!("test=3.1{hold}{more}"));
        let off = apart(&held[2], &mixed);
        eprintln!("{name}, mixed by hand with heads: {off} of 255");
        assert!(
            usize::from(off) <= 2 * HELD.len(),
            "{name}, mixed by hand with heads: {off} of 255"
        );
        // The same times from the banks' images alone.
        let added = browser.report(&added_file, &format!("test={times}{more}"));
        for ((time, line), picture) in TIMES.iter().zip(&added[2..]).zip(&pictures) {
            let off = apart(line, picture);
            eprintln!("{name} at {time} s, added up: {off} of 255");
            assert!(off <= 6, "{name} at {time} s, added up: {off} of 255");
        }
        assert!(
            browser.console().is_empty(),
            "{name}: {:?}",
            browser.console()
        );
    }
}

/// A page as it is written when the keys' images do not fit.
fn without_keys(html: &str) -> String {
    changed(html, |data| {
        let keys = data["keys"].as_u64().unwrap() as usize;
        assert!(keys > 1);
        data["pictures"].as_array_mut().unwrap().drain(..keys);
        data["keys"] = json!(0);
    })
}

/// A page with changed data.
fn changed(html: &str, change: impl FnOnce(&mut Value)) -> String {
    let (head, rest) = html.split_once("id=\"show\">").unwrap();
    let (data, tail) = rest.split_once("</script>").unwrap();
    let mut data: Value = serde_json::from_str(data).unwrap();
    change(&mut data);
    let data = data.to_string().replace('<', "\\u003c");
    format!("{head}id=\"show\">{data}</script>{tail}")
}

/// Actions of a person, by keyboard and by the names in a screen reader.
#[test]
#[ignore = "slow"]
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
    // Arrows, End and Home; the time is shown in words.
    browser.press("End");
    browser.wait("document.getElementById('clock').textContent === '0:10.0'");
    browser.press("ArrowLeft");
    browser.wait("Math.abs(desk.time - 9) < 1e-9");
    browser.press("Home");
    browser.press("ArrowDown");
    // The list follows with the next frame.
    browser.wait(
        "desk.time === 2 && document.querySelector('[aria-current=step]')\
         ?.textContent.replace(/\\s+/g, ' ').startsWith('Cue 2 ')",
    );
    browser.wait("document.getElementById('told').textContent.includes('Cue 2')");
    // A fader by its label: its old and new level, and the way back.
    browser.run("document.querySelector('#bank-0').focus()");
    for _ in 0..5 {
        browser.press("ArrowRight");
    }
    browser.wait("document.getElementById('changed').textContent.includes('warm 80 \u{2192} 85')");
    browser.wait(
        "document.activeElement.getAttribute('aria-valuetext') === \
         '85 percent, held; the sheet says 80'",
    );
    browser.wait("document.getElementById('told').textContent === 'warm held at 85'");
    browser.press("r");
    browser.wait("desk.held.size === 0 && document.getElementById('release').hidden");
    // A cue that hangs on the previous one runs with its GO, as at the prompt.
    browser.run("toCue(3)");
    browser.wait("desk.time === 7 && !desk.playing");
    browser.press("g");
    browser.wait("!desk.playing && desk.time === 10");
    show.execute("goto 3").unwrap();
    let said = show.execute("go").unwrap().text;
    assert!(said.starts_with("at 10s, cue 5"), "{said}");
    colours_are_mixed_by_hand(&browser);
    the_grand_master_dims_what_cues_move(&browser);
    keys_do_the_same_wherever_the_focus_is(&browser);
    levels_come_from_a_picture(&browser);
    the_page_fits(&browser);
    // Every control has a name.
    let unnamed = browser.run(
        "return [...document.querySelectorAll('input, button')].filter((e) => \
         !(e.labels?.length || e.textContent || e.getAttribute('aria-label'))).length",
    );
    assert_eq!(unnamed, json!(0));
    assert_eq!(text("title"), json!("A </script> & <b>title</b> \u{e4}"));
    assert!(browser.console().is_empty(), "{:?}", browser.console());
}

/// An rgb bank has a level and a colour; the colour stays while the level moves.
fn colours_are_mixed_by_hand(browser: &Browser) {
    browser.run("toCue(3)");
    browser.wait("document.querySelector('[type=color]').value === '#ff8000'");
    browser.run(
        "const well = document.querySelector('[aria-label=\"wash, colour\"]'); \
         well.value = '#0040ff'; well.dispatchEvent(new Event('input'));",
    );
    let changed = "document.getElementById('changed').textContent";
    browser.wait(&format!(
        "{changed} === 'Held: wash 100 #ff8000 \u{2192} 100 #0040ff'"
    ));
    browser.run("document.querySelector('#bank-3').focus()");
    for _ in 0..4 {
        browser.press("ArrowLeft");
    }
    browser.wait(&format!("{changed}.endsWith(' 96 #0040ff')"));
    // Light of level and colour: 0.96 of the decoded code (64/255 of sRGB is 0.05127 of light).
    let held = browser.run("return [3, 4, 5].map((i) => desk.held.get(i).toFixed(4)).join(' ')");
    assert_eq!(held, json!("0.0000 0.0492 0.9600"));
    browser.press("Escape");
    browser
        .wait("desk.held.size === 0 && document.querySelector('[type=color]').value === '#ff8000'");
}

/// A picture of known levels gives these levels back; one of another shape is refused.
fn levels_come_from_a_picture(browser: &Browser) {
    browser.run("toCue(1)");
    browser.run(
        "const meant = { warm: 0.35, cool: 0.6, edge: 0.75 }; \
         for (const f of faders) hold(f, f.mixer ? { level: 0.5, colour: [1, 0.2, 0.6] } : { level: meant[f.name] });",
    );
    let sum = "sumAt(lightOf(show, desk), momentAt(show, desk.time))";
    browser.run(&format!(
        "desk.renderer.draw(momentAt(show, desk.time), {sum}); \
         const copy = document.createElement('canvas'); \
         [copy.width, copy.height] = show.size; \
         copy.getContext('2d').drawImage(document.getElementById('picture'), 0, 0); \
         copy.toBlob((blob) => {{ window.given = new File([blob], 'meant.png'); }});"
    ));
    browser.wait("window.given");
    browser.press("r");
    browser.wait("desk.held.size === 0");
    let said = "document.getElementById('sketched').textContent";
    browser.run(
        "const drop = new Event('drop', { bubbles: true, cancelable: true }); \
         drop.dataTransfer = { files: [window.given] }; \
         document.getElementById('frame').dispatchEvent(drop);",
    );
    browser.wait(&format!("{said}.includes(' % before')"));
    let found = browser.run(
        "const light = lightOf(show, desk); return faders.map((f) => { \
         const { level, colour } = mixesOf(f, light).now; \
         return colour ? colour.map((c) => c * settingOf(f.law, level)) : [level]; }).flat()",
    );
    let wash = [0.5, 0.1, 0.3];
    for (found, meant) in found
        .as_array()
        .unwrap()
        .iter()
        .zip([&[0.35, 0.6, 0.75][..], &wash].concat())
    {
        let found = found.as_f64().unwrap();
        assert!((found - meant).abs() < 0.01, "{found} for {meant}");
    }
    browser.run(
        "const narrow = Object.assign(document.createElement('canvas'), { width: 20, height: 40 }); \
         narrow.getContext('2d').fillRect(0, 0, 20, 40); \
         narrow.toBlob((blob) => solveSketch(new File([blob], 'narrow.png')));",
    );
    browser.wait(&format!("{said}.includes('20x40')"));
    browser.run("solveSketch(new File(['no picture'], 'text.png'))");
    browser.wait(&format!("{said}.includes('is not a PNG')"));
    browser.press("r");
    browser.wait(&format!("desk.held.size === 0 && {said} === ''"));
}

/// Blackout and grand master scale every term of a frame except the fixed lights.
fn the_grand_master_dims_what_cues_move(browser: &Browser) {
    browser.run("toCue(3)");
    browser.press("0");
    browser.wait("document.getElementById('blackout').getAttribute('aria-pressed') === 'true'");
    browser.wait("document.getElementById('left').textContent === 'Blackout'");
    let terms = "behindGrand(momentAt(show, desk.time), lightOf(show, desk), null)";
    assert_eq!(
        browser.run(&format!("return {terms}.length")),
        json!(0),
        "a blackout leaves nothing"
    );
    browser.press("0");
    browser.press("-");
    browser.wait("document.getElementById('grand').value === '95'");
    let sum = format!("return {terms}.reduce((sum, term) => sum + term.weight, 0).toFixed(6)");
    assert_eq!(browser.run(&sum), json!("0.950000"));
    // A fixed light is unaffected by the grand master.
    let fixed = browser.run(&format!(
        "const edge = show.coordinates[2]; edge.varies = false; \
         const term = {terms}.at(-1), whole = lightOf(show, desk)[2]; edge.varies = true; \
         return [term.picture === show.keys + edge.picture, (term.weight / whole).toFixed(6)]"
    ));
    assert_eq!(fixed, json!([true, "0.050000"]));
    browser.press("+");
    browser.wait("document.getElementById('left').textContent === ''");
    let label = "return document.querySelector('label[for=bank-0]').textContent";
    assert_eq!(browser.run(label), json!("channel 3 warm"));
    // Dark and light mode, and back.
    let ground = "getComputedStyle(document.body).backgroundColor";
    let before = browser.run(&format!("return {ground}"));
    browser.press("d");
    assert_ne!(browser.run(&format!("return {ground}")), before);
    browser.press("d");
    assert_eq!(browser.run(&format!("return {ground}")), before);
}

fn keys_do_the_same_wherever_the_focus_is(browser: &Browser) {
    for place in [
        ".bank input",
        "[type=color]",
        "#stop",
        "#cues button",
        "summary",
    ] {
        browser.run("toCue(2); document.getElementById('help').open = false;");
        browser.run(&format!("document.querySelector('{place}').focus()"));
        browser.press(" ");
        browser.wait("desk.cue === 4 || desk.cue === 3");
        let help = browser.run("return document.getElementById('help').open");
        assert_eq!(help, json!(false), "{place}");
    }
    browser.run("document.querySelectorAll('#cues button')[1].focus()");
    browser.press("Enter");
    browser.wait("desk.cue === 1 && desk.time === 2 && !desk.playing");
    // GO in the middle of a fade after a seek: only the rest of the fade runs.
    browser.run("seek(3); go();");
    browser.wait("desk.cue === 2");
    let left = browser.run("return remaining(desk)").as_f64().unwrap();
    assert!(left <= 2.0, "{left}");
    browser.wait("!desk.playing && desk.time === 6");
    browser.run("toCue(1)");
    // The note of the next cue is visible, and not interpreted as HTML.
    browser
        .wait("document.getElementById('next').textContent === 'GO: 3 Wash (on <b>applause</b>)'");
}

fn the_page_fits(browser: &Browser) {
    let facts = browser.run("return document.getElementById('facts').textContent");
    assert_eq!(facts, json!("5 cues, 4 banks, 0:10"));
    let lit = "[...document.querySelectorAll('#cues canvas')].filter((c) => \
        c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v, i) => i % 4 < 3 && v > 40)).length";
    browser.wait(&format!("{lit} === 5"));
    for (width, height) in [(1280, 800), (1440, 900), (390, 844)] {
        browser.resize(width, height);
        browser.wait("document.documentElement.scrollWidth <= innerWidth");
        let go = "document.getElementById('go').getBoundingClientRect().bottom < innerHeight";
        browser.wait(go);
    }
    browser.resize(1280, 800);
    browser.wait("document.getElementById('banks').getBoundingClientRect().bottom < innerHeight");
}

/// Result of GO under random presses in the page's own code: one line per press, with the cue and
/// the remaining light.
const PRESSES: &str = r#"
const show = JSON.parse(require("fs").readFileSync(process.argv[2], "utf8"));
let state = Number(process.argv[3]);
const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
for (const mixer of show.mixers) {
  for (let i = 0; i < 200; i++) {
    const time = show.start + (show.end - show.start) * random();
    const { level, colour } = mixAt(mixer.track, time), light = settingOf(mixer.law, level);
    const settings = settingsAt(show, time).slice(mixer.first, mixer.first + 3);
    const off = Math.max(...settings.map((setting, c) => Math.abs(light * colour[c] - setting)));
    if (off > 0.01) throw Error(`${mixer.name} at ${time}: ${settings} is not ${light} of ${colour}`);
  }
}
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

/// A show with splits, delays, a long fade below short cues, and automatic cues.
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
cue 5 { time 4  curve ease  wash 60 #ff8000 }
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
            include_str!("../../src/engine/playback/page/light.js"),
            include_str!("../../src/engine/playback/page/go.js"),
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
