//! Advice for words in the wrong order, and for files in the wrong place.

use std::fs;
use std::process::Command;

const SHOW: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/first.lxq");

/// Exit code, and standard error.
fn said(words: &[&str]) -> (Option<i32>, String) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_footlight"));
    let done = program.args(words).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    (done.status.code(), said)
}

#[test]
fn the_verb_comes_first_then_the_show() {
    let (code, told) = said(&["plot", "rig", SHOW]);
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains(&format!("plot {SHOW} rig")), "{told}");
    let (code, told) = said(&[SHOW]);
    assert_eq!(code, Some(2), "{told}");
    assert!(told.contains(&format!("footlight check {SHOW}")), "{told}");
}

#[test]
fn a_missing_mtl_is_a_warning_that_says_where_it_was_sought() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("set")).unwrap();
    let obj = "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl wall\nf 1 2 3\n";
    fs::write(folder.path().join("set/x.obj"), obj).unwrap();
    let show = folder.path().join("show.lxq");
    let text = "stage \"set/x.obj\"\n\ncue 1 at 0:00 { snap }\n";
    fs::write(&show, text).unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_footlight"));
    let done = program.arg("check").arg(&show).output().unwrap();
    let told = [done.stdout, done.stderr].concat();
    let told = String::from_utf8_lossy(&told);
    assert_eq!(done.status.code(), Some(0), "{told}");
    assert!(told.contains("`set/none.mtl` does not exist"), "{told}");
    assert!(told.contains("W017"), "{told}");
}
