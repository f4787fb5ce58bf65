//! Whole sessions at the prompt, in memory: edits, refinement, images, results.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::operator::Altered;
use crate::prompt;
use footlight_engine::playback::Player;
use footlight_engine::{Ended, Goal, Host, Version};
use footlight_host::files::{Memory, MemoryStore, Store};
use footlight_host::work::{Progress, Work};
use footlight_picture::tone::Tone;
use footlight_prompt::{self as repl, Repl};
use footlight_report as report;
use footlight_report::versions::VersionComparison;
use footlight_show::units::Time;

const SHOW: &str = r#"// a comment that must survive
show "Session"
preview { tolerance 1%  coarse 1  refined 3  rate 5 }
stage "room.obj"
view house  from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 64x40

light left   spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd  2700 K
light right  spot  at  2, -2, 3.5  aim  0.8, 0.5, 0.5  beam 30  field 50  900 cd  6500 K
light top    panel lamp  400 cd/m2
light exit   panel sign
bank warm = left    channel 1
bank cool = right   channel 2
bank over = top     channel 3  dimmer square
fixed exits = exit  level 20

cue 1 "Preset" at 0:00 { snap  warm 80  cool 10 }   // keep me too
cue 2 "Cross"  at 0:02 { time 6  warm 15  cool 90 }
cue 3 "Top"    at 0:05 { time 3  curve ease  over 70 }
"#;

/// A floor, a back wall, a box, a lamp in the flies and a sign, Y up.
const ROOM: &str = "mtllib room.mtl
v -3 0 3\nv 3 0 3\nv 3 0 -2\nv -3 0 -2\nv 3 3.5 -2\nv -3 3.5 -2
v -0.5 0 0.5\nv 0.5 0 0.5\nv 0.5 0 -0.5\nv -0.5 0 -0.5
v -0.5 1 0.5\nv 0.5 1 0.5\nv 0.5 1 -0.5\nv -0.5 1 -0.5
v -0.4 3.4 0.4\nv 0.4 3.4 0.4\nv 0.4 3.4 -0.4\nv -0.4 3.4 -0.4
v 1.6 3 -1.98\nv 2 3 -1.98\nv 2 3.2 -1.98\nv 1.6 3.2 -1.98
usemtl floor\nf 1 2 3 4\nusemtl wall\nf 4 3 5 6
usemtl box\nf 7 8 12 11\nf 8 9 13 12\nf 9 10 14 13\nf 10 7 11 14\nf 11 12 13 14
usemtl lamp\nf 18 17 16 15\nusemtl sign\nf 19 20 21 22
";

const MATERIALS: &str = "newmtl floor\nKd 0.4 0.35 0.3\nnewmtl wall\nKd 0.6 0.6 0.6\n\
    newmtl box\nKd 0.5 0.2 0.1\nnewmtl lamp\nKd 0 0 0\nKe 1 1 1\nnewmtl sign\nKd 0 0 0\nKe 5 30 8\n";

fn host(store: &MemoryStore) -> Host {
    Host {
        files: Box::new(
            Memory::default()
                .with("room.obj", ROOM)
                .with("room.mtl", MATERIALS),
        ),
        store: Box::new(store.clone()),
        renderer: Arc::new(Altered::unstated()),
        ..Host::default()
    }
}

fn open() -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    store.write(Path::new("s.lxq"), SHOW.as_bytes()).unwrap();
    (crate::open(Path::new("s.lxq"), host(&store)), store)
}

fn seconds(s: f64) -> Time {
    Time::from_seconds(s).unwrap()
}

fn largest_difference(a: &footlight_picture::Image, b: &footlight_picture::Image) -> f32 {
    let pairs = a.data().iter().zip(b.data());
    pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

#[test]
fn an_edit_of_a_cue_keeps_every_refined_picture_and_the_next_picture_uses_them() {
    let (mut show, _) = open();
    show.engine_mut().refine(Goal::count(2)).unwrap();
    let before = show.engine_mut().picture(seconds(6.0)).unwrap();
    let reply = show
        .execute("cue 2 \"Cross\"  at 0:02 { time 6  warm 15  cool 40 }")
        .unwrap();
    assert!(
        reply.text.contains("2 refined pictures kept"),
        "{}",
        reply.text
    );
    assert_eq!(show.engine().estimate().refined(), 2);
    let after = show.engine_mut().picture(seconds(6.0)).unwrap();
    assert!(largest_difference(&before, &after) > 0.1);

    // The show compiled from its new text, without refinement, has another preview: images refined
    // before the edit take effect.
    let mut fresh = prompt(
        "t.lxq",
        show.engine().document().text().as_bytes(),
        host(&MemoryStore::default()),
    )
    .unwrap();
    let coarse = fresh.engine_mut().picture(seconds(6.0)).unwrap();
    assert!(largest_difference(&coarse, &after) > 0.0);
}

#[test]
fn moving_a_light_drops_what_no_longer_fits() {
    let (mut show, _) = open();
    show.engine_mut().refine(Goal::count(1)).unwrap();
    show.execute("light left spot at -2, -2, 3 aim 0, 0, 0 beam 30 field 50 900 cd")
        .unwrap();
    assert_eq!(show.engine().estimate().refined(), 0);
}

#[test]
fn levels_are_told_as_they_were_written_and_light_beside_them() {
    let (mut show, _) = open();
    let told = show.execute("at 0:08").unwrap().text;
    // The third cue takes the squared bank to 70: 0.7 squared is 49 % of its light.
    assert!(told.contains("level   light"), "{told}");
    let row = |told: &str, name: &str| -> Vec<String> {
        let line = told.lines().find(|l| l.trim_start().starts_with(name));
        line.unwrap()
            .split_whitespace()
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(row(&told, "over")[1..3], ["70.0", "49.0"], "{told}");
    assert_eq!(row(&told, "warm")[1..3], ["15.0", "15.0"], "{told}");
    let tried = show.execute("set over 20").unwrap().text;
    assert_eq!(row(&tried, "over")[1..3], ["20.0", "4.0"], "{tried}");
    show.execute("release").unwrap();
    show.execute("bank over = top channel 3").unwrap();
    let plain = show.execute("at 0:08").unwrap().text;
    assert!(!plain.contains("light"), "{plain}");
    assert_eq!(row(&plain, "over")[1], "70.0", "{plain}");
}

#[test]
fn an_error_leaves_everything_as_it_was() {
    let (mut show, _) = open();
    show.engine_mut().refine(Goal::count(1)).unwrap();
    let source = show.engine().document().text().to_owned();
    for bad in [
        "cue 2 { wram 40 }",
        "bank warm = nothing",
        "stage \"../x.obj\"",
        "cue 2 { warm 140 }",
    ] {
        let error = show.execute(bad).unwrap_err();
        assert!(error.diagnostics().is_some(), "{bad}: {error}");
        assert_eq!(error.exit_code(), 1);
        assert_eq!(
            (
                show.engine().document().text(),
                show.engine().estimate().refined()
            ),
            (source.as_str(), 1),
            "{bad}"
        );
    }
}

#[test]
fn edits_change_only_their_own_lines_and_save_writes_them() {
    let (mut show, store) = open();
    show.execute("cue 2 \"Cross\" at 0:02 { time 6  warm 20  cool 90 }")
        .unwrap();
    show.execute("save").unwrap();
    let saved = String::from_utf8(store.read(Path::new("s.lxq"), 1 << 20).unwrap()).unwrap();
    let changed: Vec<(&str, &str)> = SHOW
        .lines()
        .zip(saved.lines())
        .filter(|(a, b)| a != b)
        .collect();
    assert_eq!(changed.len(), 1, "{changed:?}");
    assert!(changed[0].1.contains("warm 20"));
    assert!(saved.contains("// keep me too"));
}

#[test]
fn a_file_that_changed_meanwhile_is_not_overwritten() {
    let (mut show, store) = open();
    show.execute("cue 4 at 0:12 { blackout }").unwrap();
    store
        .write(Path::new("s.lxq"), b"show \"someone else's\"\n")
        .unwrap();
    let error = show.execute("save").unwrap_err().to_string();
    assert!(
        error.contains("changed on disk") && error.contains("save OTHER.lxq"),
        "{error}"
    );
    let kept = store.read(Path::new("s.lxq"), 1 << 20).unwrap();
    assert_eq!(kept, b"show \"someone else's\"\n");
    show.execute("save other.lxq").unwrap();
    assert!(!show.engine().document().is_unsaved());
}

#[test]
fn leaving_with_edits_asks_once() {
    let (mut show, _) = open();
    assert!(show.execute("quit").unwrap().quit);
    show.execute("cue 4 at 0:12 { blackout }").unwrap();
    assert!(!show.execute("quit").unwrap().quit);
    assert!(show.execute("quit").unwrap().quit);
}

#[test]
fn refining_everything_makes_previews_equal_to_rendering() {
    let (mut show, _) = open();
    let ended = show.engine_mut().refine(Goal::until(0.0)).unwrap();
    assert_eq!(ended.ended, Some(Ended::Complete));
    for at in [0.0, 3.7, 7.5] {
        let preview = show.engine_mut().picture(seconds(at)).unwrap();
        let setting = show.engine().document().timeline().evaluate(seconds(at));
        let rendered = show
            .engine_mut()
            .render(&setting, footlight_transport::Quality(3))
            .unwrap();
        let peak = rendered.data().iter().copied().fold(0.0, f32::max);
        let off = largest_difference(&preview, &rendered);
        assert!(off <= 2e-5 * peak, "at {at}: {off} of {peak}");
    }
    let errors: Vec<f64> = show
        .engine()
        .estimate()
        .steps()
        .iter()
        .map(|s| s.error)
        .collect();
    assert!(*errors.last().unwrap() < 1e-9, "{errors:?}");
}

fn sha256(bytes: &[u8]) -> String {
    use sha2::Digest as _;
    let digest = sha2::Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn run_leaves_its_results_and_no_keys_of_an_earlier_run() {
    let (mut show, store) = open();
    // Other files in the folder stay; files of an earlier run are removed, unless they were
    // changed.
    let listed = |name: &str| format!("{}  {name}\n", sha256(b"old"));
    let manifest = listed("keys/key998.exr") + &listed("keys/key999.exr");
    for (name, content) in [
        ("keys/key997.exr", "foreign"),
        ("keys/key998.exr", "changed"),
        ("keys/key999.exr", "old"),
        ("keys/image.exr", "mine"),
        ("files.sha256", manifest.as_str()),
    ] {
        let path = Path::new("o").join(name);
        store.write(&path, content.as_bytes()).unwrap();
    }
    let reply = show.execute("run --count 1 --keys -o o").unwrap();
    let keys = show.engine().document().keys().keys().len();
    let names: Vec<String> = store
        .paths()
        .iter()
        .map(|p| p.to_string_lossy().into_owned())
        .collect();
    for name in [
        "o/plan.json",
        "o/curves.png",
        "o/error.png",
        "o/basis.png",
        "o/show.html",
        "o/cue-sheet.csv",
        "o/track-sheet.csv",
        "o/hookup.csv",
        "o/schedule.csv",
        "o/rig.svg",
        "o/contact-sheet.png",
        "o/cues/0001.png",
    ] {
        assert!(
            names.iter().any(|n| n == name),
            "{name} is missing: {names:?}"
        );
    }
    for kept in ["o/keys/key997.exr", "o/keys/key998.exr", "o/keys/image.exr"] {
        assert!(names.iter().any(|n| n == kept), "{kept}: {names:?}");
    }
    let in_keys = names.iter().filter(|n| n.starts_with("o/keys/")).count();
    assert_eq!(in_keys, keys + 3, "{names:?}");
    let manifest = store.read(Path::new("o/files.sha256"), 1 << 20).unwrap();
    let manifest = String::from_utf8(manifest).unwrap();
    let cues = show.engine().show().cues.len();
    assert_eq!(manifest.lines().count(), keys + cues + 12, "{manifest}");
    for line in manifest.lines() {
        let (digest, name) = line.split_once("  ").unwrap();
        let content = store.read(&Path::new("o").join(name), 1 << 28).unwrap();
        assert_eq!(digest, sha256(&content), "{name}");
    }
    for word in ["1 mixture at quality 3", "plays the show"] {
        assert!(
            reply.text.contains(word),
            "`{word}` is missing from:\n{}",
            reply.text
        );
    }
    let key = store.read(Path::new("o/keys/key001.exr"), 1 << 24).unwrap();
    let image = footlight_picture::exr::decode(&key, 1 << 24).unwrap();
    assert_eq!((image.width(), image.height()), (64, 40));
    let header = footlight_picture::exr::attributes(&key).unwrap();
    assert!(
        header
            .iter()
            .any(|(n, v)| n == "settings" && v.contains("warm 0.8")),
        "{header:?}"
    );
    assert!(
        header.iter().any(|(_, v)| v.contains("fixed 1")),
        "{header:?}"
    );
}

#[test]
fn playback_shows_what_the_pool_previews() {
    let (mut show, _) = open();
    show.engine_mut().refine(Goal::count(2)).unwrap();
    let playback = show.engine_mut().playback().unwrap();
    let player = Player::new(&playback, Tone::default(), Work::silent());
    let mut frame = footlight_picture::Image::new(0, 0);
    for at in [0.5, 2.5, 4.1, 5.5, 7.9] {
        player.light(seconds(at), &mut frame);
        let preview = show.engine_mut().picture(seconds(at)).unwrap();
        let peak = preview.data().iter().copied().fold(0.0, f32::max);
        assert!(
            largest_difference(&frame, &preview) <= 1e-5 * peak,
            "at {at}"
        );
    }
}

#[test]
fn the_plan_is_the_same_bytes_in_every_run_and_with_any_threads() {
    let json = |threads: usize, refine: bool| {
        let host = Host {
            threads,
            ..host(&MemoryStore::default())
        };
        let mut show = prompt("s.lxq", SHOW.as_bytes(), host).unwrap();
        let plain = show.execute("plan --json").unwrap().text;
        show.engine_mut().coarse().unwrap();
        if refine {
            show.engine_mut().refine(Goal::default()).unwrap();
        }
        let error = show.execute("plan --json --tolerance 0").unwrap().text;
        (plain, error)
    };
    let first = json(1, false);
    assert_eq!(first, json(2, true));
    let plan: serde_json::Value = serde_json::from_str(&first.1).unwrap();
    assert_eq!(plan["used"], plan["rank"]);
    assert_eq!(
        plan["coordinates"],
        serde_json::json!(["warm", "cool", "over", "fixed"])
    );
    assert_eq!(
        plan["banks"][3],
        serde_json::json!({"name": "exits", "kind": "fixed", "channel": null})
    );
}

/// Cancels after a number of polls.
struct Impatient {
    asked: AtomicUsize,
    patience: usize,
    stopped: Arc<AtomicBool>,
}

impl Progress for Impatient {
    fn cancelled(&self) -> bool {
        let stop = self.asked.fetch_add(1, Ordering::Relaxed) >= self.patience;
        self.stopped.fetch_or(stop, Ordering::Relaxed);
        stop
    }
}

#[test]
fn cancel_is_heard_and_nothing_is_half_done() {
    // The first poll is that of opening the show.
    for patience in [1, 2, 4, 10, 100, 1000, 10_000] {
        let stopped = Arc::new(AtomicBool::new(false));
        let progress = Impatient {
            asked: AtomicUsize::new(0),
            patience,
            stopped: Arc::clone(&stopped),
        };
        let host = Host {
            progress: Box::new(progress),
            ..host(&MemoryStore::default())
        };
        let mut show = prompt("s.lxq", SHOW.as_bytes(), host).unwrap();
        let result = show.engine_mut().refine(Goal::until(0.0));
        if stopped.load(Ordering::Relaxed) {
            match result {
                Ok(done) => assert_eq!(done.ended, Some(Ended::Stopped)),
                Err(error) => assert_eq!(repl::Error::from(error).exit_code(), 130),
            }
        }
        assert_eq!(
            show.engine().estimate().steps().len(),
            if show.engine().estimate().steps().is_empty() {
                0
            } else {
                show.engine().estimate().refined() + 1
            }
        );
    }
}

#[test]
fn a_reload_tells_what_two_readings_would_tell() {
    let (mut show, _) = open();
    let edits = [
        ("cool 90 }", "cool 60  warm.x 3 }"),
        ("time 6  warm 15", "time 9  warm 40"),
        ("dimmer square", "// no dimmer any more"),
        ("cue 3 ", "cue 2.5 \"New\" { cool 10 }\ncue 3 "),
        ("// keep me too", "// another remark"),
    ];
    for (from, to) in edits {
        let old = show.engine().document().text().to_owned();
        let new = old.replace(from, to);
        assert_ne!(old, new);
        let files = Memory::default();
        let [a, b] = [old.as_bytes(), new.as_bytes()];
        let read = |bytes| Version::read("s.lxq", bytes, &files);
        let read_twice = read(a).and_then(|a| Ok(VersionComparison::new(a, read(b)?)));
        match (show.reload(&new), read_twice) {
            (Ok(reloaded), Ok(compared)) => {
                assert_eq!(reloaded.difference, compared.difference);
                if !compared.text().is_empty() {
                    assert_eq!(reloaded.reply.text, compared.text());
                }
                assert_eq!(show.engine().document().text(), new);
            }
            (Err(_), Err(_)) => assert_eq!(show.engine().document().text(), old),
            (reloaded, _) => panic!("{from} -> {to}: {:?}", reloaded.map(|r| r.reply.text)),
        }
    }
}

#[test]
fn every_verb_has_help_and_an_example_that_is_understood() {
    let (mut show, _) = open();
    let list = show.execute("help").unwrap().text;
    for verb in repl::verbs().get_subcommands() {
        let (name, example) = (verb.get_name(), repl::example(verb));
        assert!(list.contains(name), "{list}");
        let page = show.execute(&format!("help {name}")).unwrap().text;
        assert!(page.contains(&example), "{page}");
        repl::Verb::parse(&example).unwrap();
    }
    let error = show.execute("picutre").unwrap_err().to_string();
    assert!(error.contains("did you mean `picture`"), "{error}");
}

/// An edit changes the error without an image: a goal reached before may no longer be.
#[test]
fn an_error_is_reached_by_the_show_as_it_is_now() {
    let text = SHOW.replace("warm 15  cool 90", "warm 15");
    let text = text.replace("over 70", "warm 10");
    let host = host(&MemoryStore::default());
    let mut show = prompt("t.lxq", text.as_bytes(), host).unwrap();
    let until = |error: f64| Goal::until(error);
    show.engine_mut().refine(Goal::count(2)).unwrap();
    let before = show.engine().estimate().predicted_error().unwrap();
    show.execute("cue 3 \"Top\" at 0:05 { time 3  over 100  cool 100 }")
        .unwrap();
    let after = show.engine().estimate().predicted_error().unwrap();
    assert!(after > 4.0 * before, "{before} {after}");
    let refined = show.engine().estimate().refined();
    show.engine_mut().refine(until(after / 2.0)).unwrap();
    assert!(
        show.engine().estimate().refined() > refined,
        "nothing was refined for the new look"
    );
    assert!(show.engine().estimate().predicted_error().unwrap() <= after / 2.0);
}

/// A scene gets no more refinement than it needs: an estimate with a threefold margin is trusted, a
/// nearer one is not.
#[test]
fn a_tolerance_with_room_needs_no_refined_picture() {
    let after = |share: f64| {
        let (mut show, _) = open();
        show.engine_mut().coarse().unwrap();
        let goal = Goal::until(share * show.engine().estimate().predicted_error().unwrap());
        let ran = report::run::run(show.engine_mut(), &goal.into(), Path::new("out"), false);
        let ended = ran.unwrap().ended;
        assert!(ended == Ended::Reached, "{share}: {ended:?}");
        show.engine().estimate().refined()
    };
    assert_eq!(after(3.01), 0);
    assert!(after(2.99) >= 1);
    assert!(after(0.1) >= 2);
}

/// Fixed lights have names, but form one bank that never moves.
#[test]
fn what_is_fixed_is_looked_at_together() {
    let store = MemoryStore::default();
    let mut show = prompt("s.lxq", SHOW.as_bytes(), host(&store)).unwrap();
    let told = show.execute("picture --bank exits -o x.png").unwrap_err();
    assert!(told.to_string().contains("`--bank fixed`"), "{told}");
    let told = show.execute("picture --bank nobody -o x.png").unwrap_err();
    assert!(told.to_string().contains("over, fixed"), "{told}");
    show.execute("picture --bank fixed -o x.png").unwrap();
}
