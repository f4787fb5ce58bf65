//! A show's text: what is accepted, the wording of errors, and the printed reports; and the prose
//! of the sources' comments.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    reason = "a test stops at its first surprise"
)]

mod bad_input;
mod colours;
mod comments;
mod editors;
mod errors;
mod figure4;
mod hostile;
mod live;
mod manual;
mod paper;
mod typed;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::Duration;

use assert_cmd::Command;

fn footlight(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::cargo_bin("footlight").unwrap();
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    // Far more than the two seconds that a person waits, so that a busy machine does not fail it.
    command.timeout(Duration::from_secs(20));
    command.output().unwrap()
}

/// The cue sheets in a folder and below it.
fn sheets(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sheets(&path));
        } else if path.extension().is_some_and(|e| e == "lxq") {
            found.push(path);
        }
    }
    found
}
