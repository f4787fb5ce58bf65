//! The pages on desks, plans and the network: each of their commands runs, in the order of the
//! pages.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use footlight_desk::osc::{self, Argument};
use std::net::UdpSocket;
use std::process::Stdio;
use std::time::{Duration, Instant};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// A folder with the examples of the pages.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["house.asc", "plan.mvr", "house.patch"] {
        let from = root().join("examples/desk").join(name);
        fs::copy(from, folder.path().join(name)).unwrap();
    }
    folder
}

fn footlight(folder: &Path, line: &str) -> (bool, String) {
    let mut command = Command::cargo_bin("footlight").unwrap();
    let output = command
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let mut said = String::from_utf8_lossy(&output.stdout).into_owned();
    said.push_str(&String::from_utf8_lossy(&output.stderr));
    (output.status.success(), said)
}

/// A short show of the same banks.
const SHORT: &str = "show \"Short\"\nbank front_left channel 1\nbank front_right channel 2\n\
    bank lamp channel 3\nbank cyc channel 11 rgb\ncue 1 { time 0.1  lamp full  cyc 50 #ff0000 }\n";

#[test]
fn every_command_of_the_pages_runs() {
    let folder = folder();
    let mut ran = 0;
    for page in ["desk", "plan", "qlc", "live"] {
        if page == "live" {
            fs::write(folder.path().join("house.lxq"), SHORT).unwrap();
        }
        let text = fs::read_to_string(root().join(format!("src/manual/{page}.md"))).unwrap();
        for block in text.split("```sh\n").skip(1) {
            for line in block.split("```").next().unwrap().lines() {
                let (well, said) =
                    footlight(folder.path(), line.strip_prefix("footlight ").unwrap());
                assert!(well, "{line}: {said}");
                ran += 1;
            }
        }
    }
    assert_eq!(ran, 11);
    // The text block of the page on plans, with a view of the set.
    let show = "show \"P\"\ninclude \"rig.lxq\"\nview v from 0, -12, 1.7  to 0, 0, 1  fov 40\n\
        cue 1 { ch1 80  ch2 60 }\n";
    fs::write(folder.path().join("show.lxq"), show).unwrap();
    let (well, said) = footlight(folder.path(), "check show.lxq");
    assert!(well && said.contains("no errors\n"), "{said}");
    assert_eq!(
        fs::read_to_string(folder.path().join("rig.patch")).unwrap(),
        "ch1 1/1\nch2 1/2\n"
    );
}

#[test]
fn what_is_imported_is_laid_out_and_has_no_complaint() {
    let folder = folder();
    footlight(folder.path(), "import house.asc -o house.lxq");
    let (well, said) = footlight(folder.path(), "fmt --check house.lxq");
    assert!(well, "{said}");
    let (_, said) = footlight(folder.path(), "check house.lxq");
    assert!(said.ends_with("no errors\n"), "{said}");
    // The wrong file of the page, and its message.
    let page = fs::read_to_string(root().join("src/manual/desk.md")).unwrap();
    let message = page
        .rsplit("```text\n")
        .next()
        .unwrap()
        .trim_end_matches("```\n");
    let house = fs::read_to_string(folder.path().join("house.asc")).unwrap();
    let wrong = house.replacen("Chan  1@H4d", "Chan  1@101", 1);
    fs::write(folder.path().join("house.asc"), wrong).unwrap();
    let (well, said) = footlight(folder.path(), "import house.asc -o bad.lxq");
    assert!(!well);
    assert_eq!(said, message);
    assert!(!folder.path().join("bad.lxq").exists());
}

#[test]
fn what_an_export_loses_is_said_by_line_and_cue() {
    let folder = folder();
    let show = "show \"S\"\nbank a channel 1\n\ncue 1 { snap a 10 }\n\
                cue 2.5 {\n  time 4  curve square  a full\n}\n";
    fs::write(folder.path().join("s.lxq"), show).unwrap();
    let (_, said) = footlight(folder.path(), "export s.lxq -o s.asc");
    let loss = "line 5, cue 2.5: `a`: its curve is a straight fade to its last level\n";
    assert!(said.contains(loss), "{said}");
    let (_, said) = footlight(folder.path(), "export s.lxq -o s.asc --json");
    assert!(said.contains("\"line\": 5,"), "{said}");
}

#[test]
fn nothing_leaves_the_machine_unasked() {
    let folder = folder();
    fs::write(folder.path().join("s.lxq"), SHORT).unwrap();
    for (line, said) in [
        ("--sacn 1", "--bind 192.168.1.20"),
        ("--sacn 1 --to 192.0.2.7", "--bind 192.168.1.20"),
        ("--artnet 192.0.2.7", "--bind 192.168.1.20"),
        ("--sacn 0 --to 127.0.0.1", "1..=63999"),
        ("--sacn 1 --to 127.0.0.1 --priority 201", "0..=200"),
        ("--artnet 127.0.0.1 --osc 0", "1..=65535"),
        ("--artnet 127.0.0.1 --osc-to 127.0.0.1:9", "--osc <PORT>"),
        (
            "--artnet 127.0.0.1 --osc 47123 --osc-to 192.0.2.7:9",
            "say an interface with `--bind`",
        ),
        (
            "--artnet 127.0.0.1 --bind 192.0.2.1",
            "no interface of this machine",
        ),
        ("--osc 8000", "--sacn <N>"),
    ] {
        let (well, found) = footlight(folder.path(), &format!("send s.lxq {line}"));
        assert!(!well && found.contains(said), "{line}: {found}");
    }
}

/// A show that waits for OSC: its packets on loopback, from GO to the end of the stream.
#[test]
fn a_go_by_osc_is_seen_on_the_network() {
    let folder = folder();
    fs::write(folder.path().join("s.lxq"), SHORT).unwrap();
    // If another program has the port, the test is skipped.
    let Ok(receiver) = UdpSocket::bind("127.0.0.1:5568") else {
        return;
    };
    receiver
        .set_read_timeout(Some(Duration::from_millis(200)))
        .unwrap();
    let mut program = std::process::Command::new(assert_cmd::cargo::cargo_bin("footlight"))
        .current_dir(folder.path())
        .args("send s.lxq --sacn 7 --to 127.0.0.1 --osc 47124".split(' '))
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let (mut packet, mut lamp, mut asked) = ([0; 700], 0, false);
    let begin = Instant::now();
    while lamp < 255 && begin.elapsed() < Duration::from_secs(20) {
        let Ok(length) = receiver.recv(&mut packet) else {
            continue;
        };
        assert_eq!((length, &packet[113..115]), (638, &[0, 7][..]));
        lamp = packet[128];
        if !asked {
            assert_eq!(lamp, 0, "nothing runs before GO");
            let go = osc::write("/eos/key/go_0", &[Argument::Float(1.0)]);
            sender.send_to(&go, "127.0.0.1:47124").unwrap();
            asked = true;
        }
    }
    assert_eq!((lamp, packet[136], packet[137]), (255, 128, 0));
    program.kill().unwrap();
    program.wait().unwrap();
}
