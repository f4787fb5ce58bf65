//! Unrequested notes of the prompt: banks without light, and the exposure with the line that fixes
//! it.

use std::path::Path;

use footlight_engine::Host;
use footlight_host::files::{MemoryStore, Store};
use footlight_picture::exr;
use footlight_prompt::Repl;

use crate::prompt;

const SHOW: &str = "show \"Told\"
preview { coarse 1  refined 2 }
surface floor reflectance 0.5  quad -2, -2, 0  2, -2, 0  2, 2, 0  -2, 2, 0
view house from 0, -5, 2  to 0, 0, 0  fov 40  size 32x24
light key spot at 0, -1, 3  aim 0, 0, 0  beam 30  field 50  900 cd
light cellar spot at 0, 0, -1  aim 0, 0, -3  beam 30  field 50  900 cd
bank front = key
bank low = cellar  rgb
cue 1 at 0:00 { snap  front 80  low 50 }
cue 2 { time 4  front 20 }
";

fn open() -> Repl {
    let host = Host {
        store: Box::new(MemoryStore::default()),
        ..Host::default()
    };
    prompt("told.lxq", SHOW.as_bytes(), host).unwrap()
}

fn said(show: &mut Repl, line: &str) -> String {
    show.execute(line).unwrap().text.trim_end().to_owned()
}

#[test]
fn check_warns_of_a_bank_without_light_once_pictures_are_there_and_renders_none() {
    let mut show = open();
    let before = said(&mut show, "check");
    assert!(!before.contains("W018"), "{before}");
    assert_eq!(show.engine().images().statistics().rendered, 0);
    said(&mut show, "picture");
    let rendered = show.engine().images().statistics().rendered;
    let after = said(&mut show, "check");
    let warning = "\
warning[W018]: `low` at full puts no light into view `house`
 --> told.lxq:8:1
  |
8 | bank low = cellar  rgb
  | ^^^^^^^^^^^^^^^^^^^^^^
  |
  = help: aim its lights at what the view shows, put them before the set, or look from elsewhere
";
    assert!(after.starts_with(warning), "{after}");
    assert!(after.ends_with("no errors, 1 warning"), "{after}");
    assert_eq!(show.engine().images().statistics().rendered, rendered);
    let dark = said(&mut show, "picture --bank low");
    assert!(dark.ends_with("dark: no light in sight"), "{dark}");
    said(
        &mut show,
        "light cellar spot at 0, 1, 3  aim 0, 0, 0  beam 30  field 50  900 cd",
    );
    said(&mut show, "picture");
    let mended = said(&mut show, "check");
    assert!(mended.ends_with("no errors"), "{mended}");
}

#[test]
fn the_exposure_is_told_everywhere_and_what_holds_it_can_be_typed() {
    let mut show = open();
    let nothing_yet = said(&mut show, "status");
    assert!(!nothing_yet.contains("exposure"), "{nothing_yet}");
    let picture = said(&mut show, "picture");
    let (_, stops) = picture.split_once("exposure ").unwrap();
    let stops = stops.strip_suffix(" stops (auto)").unwrap().to_owned();
    let told = format!("exposure {stops} stops, chosen for the whole sequence; this holds it:\n  ");
    for line in [
        "status",
        "play",
        "play -o show.html",
        "run --count 0 -o out",
    ] {
        let text = said(&mut show, line);
        assert!(text.contains(&told), "{line}: {text}");
    }
    let light = said(&mut show, "frames -o keys.exr");
    assert!(!light.contains("exposure"), "{light}");
    let status = said(&mut show, "status");
    said(&mut show, status.lines().last().unwrap().trim());
    let picture = said(&mut show, "picture");
    assert!(
        picture.ends_with(&format!("exposure {stops} stops")),
        "{picture}"
    );
    let status = said(&mut show, "status");
    assert!(status.contains("stops, as `preview` says"), "{status}");
    assert!(said(&mut show, "picture --bank front").ends_with(&format!("exposure {stops} stops")));
    said(&mut show, "preview { exposure +1.5 }");
    assert!(said(&mut show, "picture").ends_with("exposure 1.50 stops"));
    let refused = show.execute("preview { gap +2 }").unwrap_err().to_string();
    assert!(
        refused.contains("E026") || refused.contains("only `exposure` has a `+`"),
        "{refused}"
    );
}

/// Effects that never end make more keys than memory holds: the show plays as sums of its banks.
#[test]
fn a_show_of_too_many_keys_plays_as_sums() {
    let text = r#"show "Endless"
surface floor  reflectance 0.5  quad -2, -2, 0  2, -2, 0  2, 2, 0  -2, 2, 0
view house  from 0, -4, 2  to 0, 0, 0  fov 40  size 160x90
light key  spot  at 0, -2, 3  aim 0, 0, 0  beam 30  field 60  900 cd
light fill  like key  at 2, -2, 3
bank front = key
bank side = fill
effect storm = flicker  rate 8
effect sea = flicker  rate 5  seed 4
cue 1 at 0:00 { snap  front 80 effect storm  side 40 effect sea }
cue 2 at 2:00 { time 2  front 20 }
"#;
    let store = MemoryStore::default();
    let host = |memory: usize| Host {
        store: Box::new(store.clone()),
        memory,
        ..Host::default()
    };
    let mut show = prompt("e.lxq", text.as_bytes(), host(120 << 20)).unwrap();
    let said = show.execute("run -o out").unwrap().text;
    assert!(said.contains("show.html plays"), "{said}");
    let written = |name: &str| store.paths().iter().any(|path| path.ends_with(name));
    for name in [
        "out/contact-sheet.png",
        "out/cue-sheet.csv",
        "out/curves.png",
        "out/plan.json",
        "out/show.html",
    ] {
        assert!(written(name), "{name}");
    }
    let said = show.execute("play").unwrap().text;
    assert!(said.contains("a sum of the banks"), "{said}");
    let page = show.execute("play -o p.html").unwrap().text;
    assert!(page.contains("2 bank images of 160x90"), "{page}");
    // With memory for its key images the frames are the same.
    let frame = |show: &mut Repl, name: &str| {
        let line = format!("frames --from 1:00.2 --to 1:00.3 -o {name}.exr");
        show.execute(&line).map(|reply| reply.text)
    };
    frame(&mut show, "sum%04d").unwrap();
    let mut rich = prompt("e.lxq", text.as_bytes(), host(4 << 30)).unwrap();
    let said = rich.execute("play").unwrap().text;
    assert!(said.contains("key images"), "{said}");
    frame(&mut rich, "key%04d").unwrap();
    let read = |name: &str| exr::decode(&store.read(Path::new(name), 1 << 20).unwrap(), 1 << 20);
    let [a, b] = ["sum0001.exr", "key0001.exr"].map(|name| read(name).unwrap());
    let off = a.data().iter().zip(b.data()).map(|(a, b)| (a - b).abs());
    let most = a.data().iter().copied().fold(0.0, f32::max);
    assert!(most > 0.0 && off.fold(0.0, f32::max) < 2e-3 * most);
}
