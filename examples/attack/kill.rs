//! Kills runs at random moments and checks the next run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crate::dice::Dice;
use crate::moments::start;
use crate::program;

/// False when the keys of the run after all kills differ from those of an undisturbed run.
pub fn all(seed: u64, kills: usize) -> bool {
    let mut dice = Dice(seed);
    let folder = tempfile::tempdir().unwrap();
    for name in ["first.lxq", "first.obj", "first.mtl"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name);
        fs::copy(from, folder.path().join(name)).unwrap();
    }
    let run = |out: &str, pool: &str| {
        let mut program = program(&["run", "first.lxq", "--count", "2"]);
        let where_to = ["-o", out, "--pool", pool, "--quiet"];
        program.current_dir(folder.path()).args(where_to);
        start(&mut program).unwrap()
    };
    let begin = std::time::Instant::now();
    let alone = run("alone", "off").wait().unwrap().success();
    let whole = begin.elapsed().as_millis() as usize;
    for _ in 0..kills {
        let mut child = run("killed", ".footlight");
        sleep(Duration::from_millis(dice.below(whole.max(1)) as u64));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let ended = run("killed", ".footlight").wait().unwrap().success();
    let keys = |out: &str| {
        let all = fs::read_dir(folder.path().join(out).join("keys")).unwrap();
        let all = all.map(|file| file.unwrap());
        let content = |f: fs::DirEntry| (f.file_name(), fs::read(f.path()).unwrap());
        all.map(content).collect::<BTreeMap<_, _>>()
    };
    let well = alone && ended && keys("alone") == keys("killed");
    let said = if well { "the same" } else { "NOT the same" };
    println!("kill: after {kills} kills the keys are {said}");
    well
}
