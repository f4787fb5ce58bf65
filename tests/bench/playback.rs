//! Playback speed against its bound: `cargo bench --bench playback`.
//!
//! Four key images become one frame of display bytes: by a sum over banks instead of keys, by three
//! separate blends, and by the fused kernel on one and two threads; next to each, the time to read
//! the same bytes without processing them. Then the same blends by OpenCV and numpy
//! (`tests/peers/playback.py`), if Python has them. All methods alternate in every round, and the
//! median counts; single-threaded ones are timed by the processor's clock if the system tells it,
//! so that ratios hold on a busy machine (figures of two threads need an idle one). Last, the frame
//! budget of editing: from a retyped cue to the bytes of the image at the current time, with 24
//! coarse images (of two qualities) and 10 refined ones. `--rounds 40` takes more rounds, `--size
//! 1280x720` only one size.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a bench that reports to its reader"
)]

#[path = "edit_frame.rs"]
mod edit_frame;

use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use footlight_engine::playback::kernel::{self, BlendTarget, Factors};
use footlight_picture::Image;
use footlight_picture::combine::combine;
use footlight_picture::tone::Tone;
use footlight_show::timeline::{Blend, blend};

/// Banks of the naive sum: the number of the tavern's sources.
const BANKS: usize = 22;
/// Position of the frame in a cubic segment.
const MOMENT: f64 = 0.37;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|a| a == name);
        at.and_then(|i| arguments.get(i + 1)).map(String::as_str)
    };
    let rounds = value("--rounds").map_or(15, |r| usize::max(3, r.parse().unwrap()));
    for (width, height) in [(1280, 720), (1920, 1080)] {
        let name = format!("{width}x{height}");
        if value("--size").is_none_or(|size| size == name) {
            frames((width, height), rounds);
        }
    }
    edit_frame::measure(rounds);
}

/// A method of making a frame, or a pass of reading for comparison.
struct Way<'a> {
    name: String,
    /// Bytes read.
    bytes: usize,
    run: Box<dyn FnMut() + 'a>,
}

fn frames(size: (usize, usize), rounds: usize) {
    let banks: Vec<Image> = (0..BANKS).map(|b| picture(size, b)).collect();
    let tone = Tone::default();
    let table = tone.table();
    let channels = size.0 * size.1 * 3;
    let keys: Vec<&[f32]> = banks[..4].iter().map(Image::data).collect();
    let factors = Factors::new(blend(3, MOMENT));
    let mut ways: Vec<Way<'_>> = Vec::new();
    ways.push(Way {
        name: "reading four keys".to_owned(),
        bytes: 4 * 4 * channels,
        run: Box::new(|| {
            for key in &keys {
                black_box(read(key));
            }
        }),
    });
    let mut shown = vec![0; channels];
    ways.push(Way {
        name: format!("sum of {BANKS} banks"),
        bytes: BANKS * 4 * channels,
        run: Box::new({
            let (banks, table) = (&banks, &table);
            move || {
                let terms: Vec<(f64, &Image)> = banks.iter().map(|b| (0.3, b)).collect();
                let sum = combine(size, &terms, 1);
                table.encode(sum.data(), &mut shown);
            }
        }),
    });
    let mut shown = vec![0; channels];
    let mut passes = [0, 1].map(|_| vec![0.0; channels]);
    ways.push(Way {
        name: "three blends, then encoding".to_owned(),
        bytes: 4 * 4 * channels,
        run: Box::new({
            let (banks, table) = (&banks, &table);
            move || {
                three_passes(banks, &mut passes);
                table.encode(&passes[0], &mut shown);
            }
        }),
    });
    for threads in [1, 2] {
        let mut shown = vec![0; channels];
        let (keys, table) = (&keys, &table);
        ways.push(Way {
            name: format!("fused, threads: {threads}"),
            bytes: 4 * 4 * channels,
            run: Box::new(move || {
                kernel::blend(
                    keys,
                    factors,
                    BlendTarget::Bytes(&mut shown, table),
                    threads,
                );
                black_box(&shown);
            }),
        });
    }
    let (best, peers) = turns(&mut ways, size, rounds);
    let of_reading = beside_reading(&mut ways, 4 * rounds);
    report(size, &ways, &best, &of_reading, &peers);
}

/// For each method the speed relative to reading the same bytes. Shared memory changes its speed
/// within a second, so each frame is paired with a reading right after it, and the median of the
/// pairs counts.
fn beside_reading(ways: &mut [Way<'_>], pairs: usize) -> Vec<Option<f64>> {
    let of = |way: usize, ways: &mut [Way<'_>]| {
        let same =
            |other: &Way<'_>| other.bytes == ways[way].bytes && other.name.starts_with("reading");
        let reading = ways.iter().position(same)?;
        let mut timed = |at: usize| {
            let begin = Instant::now();
            (ways[at].run)();
            begin.elapsed().as_secs_f64()
        };
        let ratios = (0..pairs).map(|_| timed(reading) / timed(way));
        Some(median(ratios.collect()))
    };
    (0..ways.len()).map(|way| of(way, ways)).collect()
}

/// Approximate duration of a round in processor seconds: the system's clock ticks in hundredths.
const TURN: f64 = 0.06;

/// The seconds of each method, and of the peers.
fn turns(ways: &mut [Way<'_>], size: (usize, usize), rounds: usize) -> (Vec<f64>, Peers) {
    let mut times = vec![Vec::new(); ways.len()];
    let mut runs = vec![1; ways.len()];
    let mut peers = Peers::default();
    for round in 0..rounds {
        for ((way, times), runs) in ways.iter_mut().zip(&mut times).zip(&mut runs) {
            let time = turn(way, *runs) / *runs as f64;
            // The first round warms up and gives the number of runs per round; it may have been
            // disturbed.
            match round {
                0 => *runs = ((TURN / time.max(1e-6)) as usize).clamp(6, 100),
                _ => times.push(time),
            }
        }
        if round % 2 == 0 && peers.missing.is_none() {
            peers.take_turn(size);
        }
    }
    (times.into_iter().map(median).collect(), peers)
}

fn turn(way: &mut Way<'_>, runs: usize) -> f64 {
    let (begin, spent) = (Instant::now(), on_processor());
    for _ in 0..runs {
        (way.run)();
    }
    let passed = begin.elapsed().as_secs_f64();
    let own = on_processor().zip(spent).map(|(now, then)| now - then);
    match own {
        Some(own) if runs > 1 && !way.name.ends_with("threads: 2") => own,
        _ => passed,
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Processor seconds of this thread.
fn on_processor() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

/// Times of other libraries for the frame, milliseconds of each round.
#[derive(Default)]
struct Peers {
    turns: Vec<(String, Vec<f64>)>,
    missing: Option<String>,
}

impl Peers {
    fn take_turn(&mut self, (width, height): (usize, usize)) {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/peers/playback.py");
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
        let size = [width, height].map(|n| n.to_string());
        let said = Command::new(python).arg(script).args(size).output();
        let said = match said {
            Ok(said) if said.status.success() => String::from_utf8(said.stdout).unwrap(),
            Ok(said) => {
                let why = String::from_utf8_lossy(&said.stderr).into_owned();
                self.missing = why.lines().last().map(str::to_owned);
                return;
            }
            Err(error) => {
                self.missing = Some(error.to_string());
                return;
            }
        };
        for (at, line) in said.lines().enumerate() {
            let (name, time) = line.rsplit_once(' ').unwrap();
            let time: f64 = time.parse().unwrap();
            match self.turns.get_mut(at) {
                Some((_, turns)) => turns.push(time),
                None => self.turns.push((name.to_owned(), vec![time])),
            }
        }
    }
}

fn report(
    (width, height): (usize, usize),
    ways: &[Way<'_>],
    best: &[f64],
    of_reading: &[Option<f64>],
    peers: &Peers,
) {
    println!("\n{width}x{height}, four keys, one frame of bytes");
    println!(
        "{:36} {:>8} {:>9} {:>7} {:>14}",
        "", "ms", "frames/s", "GB/s", "of reading"
    );
    for ((way, best), ratio) in ways.iter().zip(best).zip(of_reading) {
        let ratio = ratio.map_or(String::new(), |r| format!("{r:.2}"));
        let rate = way.bytes as f64 / best / 1e9;
        let ms = best * 1e3;
        println!(
            "{:36} {ms:8.2} {:9.0} {rate:7.1} {ratio:>14}",
            way.name,
            1.0 / best
        );
    }
    let peers_take = peers
        .turns
        .iter()
        .map(|(n, turns)| (n, median(turns.clone())));
    let peers_take: Vec<(&String, f64)> = peers_take.collect();
    for (name, ms) in &peers_take {
        println!("{name:36} {ms:8.2} {:9.0}", 1e3 / ms);
    }
    if let Some(why) = &peers.missing {
        println!("no peers (PYTHON names an interpreter with numpy and cv2): {why}");
    }
    let find = |name: &str| {
        let at = ways.iter().position(|w| w.name == name);
        at.map(|at| best[at] * 1e3)
    };
    let ours = find("fused, threads: 1").unwrap();
    let name = "OpenCV addWeighted f32";
    if let Some((_, ms)) = peers_take.iter().find(|(n, _)| *n == name) {
        println!("ours is {:.2} times as fast as {name}", ms / ours);
    }
}

/// An image with darks, lights and a few lamps; different for each number.
fn picture((width, height): (usize, usize), number: usize) -> Image {
    let channel = |i: usize| {
        let noise = (i * 7919 + number * 104_729) % 10_007;
        let light = (noise as f32 / 10_007.0).powi(3) * 4.0;
        if noise % 1000 == 7 {
            60.0 * light
        } else {
            light
        }
    };
    Image::from_data(
        width,
        height,
        (0..width * height * 3).map(channel).collect(),
    )
    .unwrap()
}

/// The three blends of a cubic segment, each a pass over memory.
fn three_passes(keys: &[Image], out: &mut [Vec<f32>; 2]) {
    let Blend::Cubic([a, b, c]) = blend(3, MOMENT) else {
        unreachable!("a cubic segment")
    };
    let [first, second] = out;
    pass(first, keys[0].data(), keys[1].data(), a as f32);
    pass(second, keys[2].data(), keys[3].data(), b as f32);
    again(first, second, c as f32);
}

#[multiversion::multiversion(targets = "simd")]
fn pass(out: &mut [f32], a: &[f32], b: &[f32], t: f32) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a + t * (b - a);
    }
}

#[multiversion::multiversion(targets = "simd")]
fn again(out: &mut [f32], b: &[f32], t: f32) {
    for (out, b) in out.iter_mut().zip(b) {
        *out += t * (b - *out);
    }
}

/// Reads one number of each block of 64 bytes, a cache line, without computing anything.
fn read(key: &[f32]) -> u32 {
    let (blocks, _) = key.as_chunks::<16>();
    blocks
        .iter()
        .fold(0, |sum, [first, ..]| sum ^ first.to_bits())
}
