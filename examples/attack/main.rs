//! Attacks the program and prints the worst result: `cargo run --release -p footlight-studies --bin
//! attack`.
//!
//! `stop` sends every verb a signal at random moments on large shows, and prints the longest time
//! to the end; `fuzz` gives every reader damaged files; `kill` kills runs and compares the keys of
//! the next run with those of an undisturbed one. One of these words runs only that part. `--trials
//! N` is the number of signals for each verb and show in `stop` (default 30) and of kills in `kill`
//! (default 40), `--seconds N` (default 60) the duration of `fuzz`, `--seed S` (default 1) the seed
//! of all. The whole takes about twenty minutes on two cores. Exits with 1 after a failure.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::print_stdout,
    reason = "a program that reports to its reader"
)]

mod dice;
mod fuzz;
#[cfg(unix)]
mod kill;
#[path = "../../tests/program/moments.rs"]
mod moments;
#[cfg(unix)]
mod stop;

use std::process::{Command, ExitCode};

/// Set when this process is the attacked program.
const AS_PROGRAM: &str = "FOOTLIGHT_ATTACKED";

fn main() -> ExitCode {
    if std::env::var_os(AS_PROGRAM).is_some() {
        return footlight::main();
    }
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |name: &str, usual: u64| {
        let at = words.iter().position(|w| w == name);
        let said = at.and_then(|at| words.get(at + 1));
        said.and_then(|n| n.parse().ok()).unwrap_or(usual)
    };
    let trials = |usual| number("--trials", usual) as usize;
    let (seconds, seed) = (number("--seconds", 60), number("--seed", 1));
    let parts = ["stop", "fuzz", "kill"];
    let all = !words.iter().any(|w| parts.contains(&w.as_str()));
    let is_wanted = |part: &str| all || words.iter().any(|w| w == part);
    let mut well = true;
    #[cfg(unix)]
    if is_wanted("stop") {
        well &= stop::all(seed, trials(30));
    }
    #[cfg(unix)]
    if is_wanted("kill") {
        well &= kill::all(seed, trials(40));
    }
    if is_wanted("fuzz") {
        well &= fuzz::all(seed, seconds);
    }
    ExitCode::from(u8::from(!well))
}

/// The program, with these words.
fn program(words: &[&str]) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(words).env(AS_PROGRAM, "1");
    command
}
