//! Regularity and accuracy of live frames: `cargo bench --bench live`.
//!
//! The program sends a straight fade of ten seconds as Art-Net on this machine, and the benchmark
//! receives it. A frame is due every 1/44 s; the jitter of a frame is the deviation of its
//! interval. Figures are meaningful only on an idle machine, so nothing is asserted.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a bench that reports to its reader"
)]

use std::net::UdpSocket;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const SECONDS: f64 = 10.0;

fn main() {
    let folder = tempfile::tempdir().unwrap();
    let show = folder.path().join("fade.lxq");
    let text = format!("show \"Fade\"\nbank a channel 1\ncue 1 {{ time {SECONDS}  a full }}\n");
    std::fs::write(&show, text).unwrap();
    let receiver = UdpSocket::bind("127.0.0.1:6454").unwrap();
    receiver
        .set_read_timeout(Some(Duration::from_secs(2)))
        .unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .args(["send", show.to_str().unwrap(), "--artnet", "127.0.0.1"])
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let (mut packet, mut frames) = ([0; 700], Vec::new());
    while receiver.recv(&mut packet).is_ok() {
        frames.push((Instant::now(), packet[18]));
    }
    program.wait().unwrap();
    let first = frames[0].0;
    let mut jitter: Vec<f64> = frames
        .windows(2)
        .map(|pair| ((pair[1].0 - pair[0].0).as_secs_f64() - 1.0 / 44.0).abs() * 1000.0)
        .collect();
    jitter.sort_by(f64::total_cmp);
    let at = |share: f64| jitter[((jitter.len() - 1) as f64 * share) as usize];
    let off = frames.iter().map(|(time, value)| {
        let due = 255.0 * ((*time - first).as_secs_f64() / SECONDS).min(1.0);
        (f64::from(*value) - due).abs()
    });
    println!(
        "{} frames in {:.2} s",
        frames.len(),
        (frames[frames.len() - 1].0 - first).as_secs_f64()
    );
    println!(
        "jitter: median {:.2} ms, p99 {:.2} ms, worst {:.2} ms",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    println!(
        "value: {:.2} of 255 from the curve at most, when it arrives",
        off.fold(0.0, f64::max)
    );
}
