//! Ends every verb on two large shows at random moments.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::dice::Dice;
use crate::moments::{VERBS, code, start, tell};
use crate::program;

/// The promised time to the end, seconds.
const PROMISED: f64 = 1.0;

/// Latest moment of a signal, milliseconds.
const LAST: usize = 8000;

const ROOM: &str = "surface floor reflectance 0.5 box from -40,-40,-1 to 40,40,0
view house from 0,-39,12 to 0,0,0 fov 60 size 160x90
";

const MTL: &str = "newmtl lamp\nKd 0 0 0\nKe 1 1 1\nnewmtl box\nKd 0.5 0.5 0.5\n";

/// 9,999 cues over 500 banks.
fn sheet(dice: &mut Dice) -> String {
    let mut text = format!("show \"Sheet\"\n{ROOM}");
    for bank in 0..500 {
        let (x, y) = (bank % 25 - 12, bank / 25 - 10);
        let light = format!("at {x},{y},6 aim {x},{y},0 beam 30 field 60 900 cd");
        let _ = writeln!(text, "light l{bank} spot {light}\nbank b{bank} = l{bank}");
    }
    for cue in 1..10_000 {
        let _ = write!(text, "cue {cue} {{ time 3");
        let first = dice.below(60);
        for bank in (first..500).step_by(61) {
            let _ = write!(text, "  b{bank} {}", dice.below(101));
        }
        text.push_str(" }\n");
    }
    text
}

/// 4,000 boxes on a floor, under a panel.
fn boxes(dice: &mut Dice) -> String {
    let mut text = format!("show \"Boxes\"\nstage \"boxes.obj\" z up\n{ROOM}");
    text.push_str(
        "light l panel lamp 900 cd/m2\nlight m spot at 0,0,20 aim 0,0,0 beam 60 field 80 9000 cd\n",
    );
    text.push_str("bank a = l\nbank b = m\ncue 1 { snap  a 80 }\ncue 2 { time 3  a 5  b 70 }\n");
    let _ = dice.below(2);
    text
}

fn obj(dice: &mut Dice) -> String {
    let mut text =
        "mtllib boxes.mtl\nusemtl lamp\nv -2 -2 25\nv -2 2 25\nv 2 2 25\nv 2 -2 25\nf 1 2 3 4\nusemtl box\n"
            .to_owned();
    for i in 0..4000 {
        let (x, y) = (i % 64 - 32, i / 64 - 31);
        let height = 0.2 + dice.below(100) as f64 / 50.0;
        for z in [0.0, height] {
            for (dx, dy) in [(0.1, 0.1), (0.8, 0.1), (0.8, 0.8), (0.1, 0.8)] {
                let _ = writeln!(text, "v {} {} {z}", f64::from(x) + dx, f64::from(y) + dy);
            }
        }
        text.push_str(
            "f -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n",
        );
    }
    text
}

/// The longest delay, verb by verb; false when a promise is broken.
pub fn all(seed: u64, moments: usize) -> bool {
    let mut dice = Dice(seed);
    let folder = tempfile::tempdir().unwrap();
    let sheet = sheet(&mut dice);
    let (boxes, obj) = (boxes(&mut dice), obj(&mut dice));
    for (name, text) in [
        ("sheet.lxq", sheet.as_str()),
        ("boxes.lxq", &boxes),
        ("boxes.obj", &obj),
        ("boxes.mtl", MTL),
        ("other.lxq", &sheet),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut worst = 0.0f64;
    for show in ["sheet.lxq", "boxes.lxq"] {
        let mut check = program(&["check", show]);
        let checked = start(check.current_dir(&folder)).unwrap().wait().unwrap();
        assert!(checked.success(), "{show} has errors");
        for words in VERBS {
            worst = worst.max(verb(folder.path(), words, show, (moments, &mut dice)));
        }
    }
    println!("stop: the worst of all is {worst:.3} s; promised are {PROMISED} s");
    worst <= PROMISED
}

/// The longest delay of a verb; infinite when it ends in a wrong way.
fn verb(
    folder: &Path,
    words: &[&'static str],
    show: &str,
    (moments, dice): (usize, &mut Dice),
) -> f64 {
    let words: Vec<&str> = words
        .iter()
        .map(|w| if *w == "SHOW" { show } else { w })
        .collect();
    let (mut worst, mut told) = (0.0f64, 0);
    for round in 0..moments {
        let signal = [Signal::SIGINT, Signal::SIGTERM, Signal::SIGHUP][round % 3];
        // Early moments are preferred, because most verbs are short.
        let after = dice.below(LAST >> (round % 5));
        let mut program = program(&words);
        program
            .current_dir(folder)
            .args(["--pool", "off", "--quiet"]);
        let Some(found) = tell(&mut program, Duration::from_millis(after as u64), signal).unwrap()
        else {
            continue;
        };
        told += 1;
        worst = worst.max(found.delay);
        if found
            .status
            .code()
            .is_some_and(|c| c != code(signal) && c > 1)
        {
            println!("stop: {words:?}: {} after {signal}", found.status);
            worst = f64::INFINITY;
        }
    }
    println!(
        "stop: {worst:7.3} s at worst of {told:2}: {}",
        words.join(" ")
    );
    worst
}
