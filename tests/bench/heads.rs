//! Frames per second of moving heads, on one thread: `RAYON_NUM_THREADS=1 cargo bench --bench
//! heads`.
//!
//! Eight narrow heads sweep over a small stage, 640x360, with and without haze: milliseconds of a
//! whole frame, the share of the heads' light, and the seconds of preparation.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench that reports to its reader"
)]

use std::fmt::Write as _;
use std::time::Instant;

use footlight_engine::{Engine, Host};
use footlight_picture::Image;
use footlight_show::units::Time;

const STAGE: &str = "show \"S\"\n\
    surface floor reflectance 0.6 box from -6,-4,-1 to 6,6,0\n\
    surface wall reflectance #a08060 box from -6,5,0 to 6,6,6\n\
    surface side reflectance 0.7 box from -6,-4,0 to -5,5,6\n\
    surface block reflectance 0.5 box from 1,1,0 to 2.5,2.5,1.2\n\
    view house from 0,-12,3 to 0,1,1.5 fov 36 size 640x360\n";

/// Targets of the heads in sequence.
const AIMS: [&str; 4] = ["0,3,0", "-4,4,3", "3,-2,0", "0,-14,1"];
const FRAMES: i64 = 120;

fn show(haze: &str) -> String {
    let mut text = format!("{STAGE}{haze}\n");
    let names: Vec<String> = (1..=8).map(|n| format!("mh_{n}")).collect();
    for (n, name) in names.iter().enumerate() {
        let x = n as f64 * 1.4 - 4.9;
        writeln!(
            text,
            "light {name} spot at {x},1,5.7 aim {x},1,0 beam 6 field 10 30000 cd moves"
        )
        .unwrap();
    }
    writeln!(text, "bank heads = {}", names.join(" ")).unwrap();
    text += "cue 1 at 0:00 { snap heads full }\n";
    for (n, aim) in AIMS.iter().enumerate() {
        writeln!(
            text,
            "cue {} at 0:{:02} {{ time 3  heads to {aim} }}",
            n + 2,
            3 * n + 1
        )
        .unwrap();
    }
    text
}

fn main() {
    for haze in ["", "haze 60m  forward 0.6"] {
        let host = Host {
            threads: 1,
            ..Host::default()
        };
        let mut engine = Engine::from_text("s.lxq", show(haze).as_bytes(), host).unwrap();
        let begin = Instant::now();
        let playback = engine.playback().unwrap();
        let player = engine.player().unwrap();
        let start = begin.elapsed().as_secs_f64();
        let heads = playback.heads().unwrap();
        let (mut bytes, mut image) = (Vec::new(), Image::new(640, 360));
        let [mut whole, mut adding] = [0.0; 2];
        for k in 0..FRAMES {
            let time = Time::from_micros(k * 12_000_000 / FRAMES);
            let begin = Instant::now();
            player.frame(time, &mut bytes);
            whole += begin.elapsed().as_secs_f64();
            image.data_mut().fill(0.0);
            let begin = Instant::now();
            heads.add_at(time, &mut image, engine.work()).unwrap();
            adding += begin.elapsed().as_secs_f64();
        }
        let of = |seconds: f64| 1000.0 * seconds / FRAMES as f64;
        println!(
            "{:22} {:.1} frames a second: {:.1} ms, the heads' light {:.1} ms of it; {start:.1} s before",
            if haze.is_empty() {
                "without haze"
            } else {
                haze
            },
            1000.0 / of(whole),
            of(whole),
            of(adding)
        );
    }
}
