//! `watch`: every save is told, an error leaves the last good show, the picture is rewritten.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples")
}

#[test]
fn every_save_is_told_and_an_error_leaves_the_last_good_show() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["first.lxq", "first.obj", "first.mtl"] {
        fs::copy(examples().join(name), folder.path().join(name)).unwrap();
    }
    let show = folder.path().join("first.lxq");
    let picture = folder.path().join("now.png");
    let mut child = Command::new(env!("CARGO_BIN_EXE_footlight"))
        .args(["--quiet", "watch", "--count", "4", "-o"])
        .arg(&picture)
        .arg(&show)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut until = |text: &str| {
        let mut before = String::new();
        loop {
            match lines.next() {
                Some(line) => before += &(line.unwrap() + "\n"),
                None => panic!("waited for `{text}`, and it said:\n{before}"),
            }
            if before.contains(text) {
                return before;
            }
        }
    };
    until("watching");
    let first = fs::read(&picture).unwrap();
    assert_eq!(&first[1..4], b"PNG");

    let text = fs::read_to_string(&show).unwrap();
    fs::write(&show, text.replace("lamp 80", "lamp 40")).unwrap();
    let told = until("wrote");
    assert!(told.contains("cue 2: lamp 80 -> 40 at 0:02"), "{told}");
    // Where the light changed most; it stays through what moves no cue.
    let moment = |told: &str| {
        told.lines()
            .find_map(|l| Some(l.split_once(": coarse")?.0.to_owned()))
    };
    assert_eq!(moment(&told).as_deref(), Some("3.5s"), "{told}");
    let second = fs::read(&picture).unwrap();
    assert_ne!(first, second);

    // A wall is painted in the modeller.
    let paint = folder.path().join("first.mtl");
    let materials = fs::read_to_string(&paint).unwrap();
    fs::write(
        &paint,
        materials.replace("Kd 0.62 0.60 0.56", "Kd 0.3 0.3 0.5"),
    )
    .unwrap();
    let told = until("wrote");
    assert!(told.contains("read again"), "{told}");
    assert_eq!(moment(&told).as_deref(), Some("3.5s"), "{told}");
    let third = fs::read(&picture).unwrap();
    assert_ne!(second, third);

    fs::write(&show, text.replace("lamp 80", "lmap 80")).unwrap();
    std::thread::sleep(std::time::Duration::from_millis(400));
    assert_eq!(fs::read(&picture).unwrap(), third);
    // The mistake is mended and a light is changed.
    let mended = text.replace("lamp 80", "lamp 40");
    fs::write(&show, mended.replace("900 cd/m2", "400 cd/m2")).unwrap();
    let told = until("wrote");
    assert_eq!(moment(&told).as_deref(), Some("3.5s"), "{told}");
    assert_ne!(fs::read(&picture).unwrap(), third);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let mut said = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut said)
        .unwrap();
    assert!(
        said.contains("E010") && said.contains("the last good show is kept"),
        "{said}"
    );
}
