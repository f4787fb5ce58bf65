//! Failed writes to standard output are reported as errors.
#![cfg(target_os = "linux")]

use std::fs::OpenOptions;
use std::process::{Command, Stdio};

#[test]
fn a_full_device_is_no_success() {
    let show = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/first.lxq");
    for words in [
        ["cuesheet", show].as_slice(),
        &["plan", show, "--json", "--pool", "off"],
        &["completions", "bash"],
        &["explain", "E010"],
    ] {
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_footlight"))
            .args(words)
            .stdout(Stdio::from(full))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(3), "{words:?}: {said}");
        assert!(said.contains("standard output"), "{words:?}: {said}");
    }
}
