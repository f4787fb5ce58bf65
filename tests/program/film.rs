//! Films, by a fake encoder, and by the real one if installed.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

const SHOW: &str = "show \"S\"\nsurface floor reflectance 0.5 box from -2,-2,-1 to 2,2,0\n\
    view house from 0,-5,2 to 0,0,0 fov 40 size 33x18\npreview { rate 10 }\n\
    light key spot at 0,-2,3 aim 0,0,0 beam 30 field 60 900 cd\nbank front = key\n\
    cue 1 at 0:00 { snap  front 100 }\ncue 2 at 0:01 { time 1  front out }\n";

/// Copies its input to the file that its last word names.
const COPIES: &str = "#!/bin/sh\nfor last; do :; done\ncat > \"$last\"\n";
const FAILS: &str = "#!/bin/sh\nread line\necho 'no such codec' >&2\nexit 1\n";

/// Exit code and output of `film -o NAME` with this `ffmpeg`, or none, on the path.
fn played(folder: &Path, program: Option<&str>, name: &str) -> (i32, String) {
    let tools = folder.join("tools");
    fs::create_dir_all(&tools).unwrap();
    let place = tools.join("ffmpeg");
    let _ = fs::remove_file(&place);
    if let Some(program) = program {
        fs::write(&place, program).unwrap();
        fs::set_permissions(&place, fs::Permissions::from_mode(0o755)).unwrap();
    }
    fs::write(folder.join("s.lxq"), SHOW).unwrap();
    let path = match program {
        Some(_) => format!("{}:/usr/bin:/bin", tools.display()),
        None => tools.display().to_string(),
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command.current_dir(folder).env("PATH", path);
    command.env("TMPDIR", &tools);
    let out = command.args(["film", "s.lxq", "--pool", "off", "--quiet", "-o", name]);
    let out = out.output().unwrap();
    let text = [&out.stdout[..], &out.stderr[..]].concat();
    (out.status.code().unwrap(), String::from_utf8(text).unwrap())
}

#[test]
fn a_film_is_whole_or_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let film = folder.path().join("a.mp4");
    fs::write(&film, "earlier").unwrap();
    let (code, said) = played(folder.path(), None, "a.mp4");
    assert!(
        code == 2 && said.contains("`apt install ffmpeg`"),
        "{code} {said}"
    );
    let (code, said) = played(folder.path(), Some(FAILS), "a.mp4");
    assert!(
        code == 3 && said.contains("ffmpeg failed: no such codec"),
        "{code} {said}"
    );
    assert_eq!(fs::read(&film).unwrap(), b"earlier");
    let (code, said) = played(folder.path(), Some(COPIES), "a.mp4");
    assert!(
        code == 0 && said.contains("21 frames of 33x18"),
        "{code} {said}"
    );
    assert!(fs::read(&film).unwrap().starts_with(b"YUV4MPEG2 W33 H18"));
    // No draft is left.
    let tools = fs::read_dir(folder.path().join("tools")).unwrap();
    assert_eq!(tools.count(), 1);
}

#[test]
fn the_real_encoder_takes_every_frame() {
    let there = |program: &str| Command::new(program).arg("-version").output().is_ok();
    if !there("ffmpeg") || !there("ffprobe") {
        eprintln!("not tried: no ffmpeg is installed");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let real =
        "#!/bin/sh\nPATH=/usr/local/bin:/opt/homebrew/bin:/usr/bin:/bin exec ffmpeg \"$@\"\n";
    for name in ["a.mp4", "a.webm"] {
        let (code, said) = played(folder.path(), Some(real), name);
        assert!(code == 0, "{said}");
        let mut probe = Command::new("ffprobe");
        let wanted = "stream=width,height,color_space,nb_read_frames";
        probe.args(["-v", "error", "-count_frames", "-show_entries", wanted]);
        let found = probe.args(["-of", "csv=p=0", name]);
        let found = found.current_dir(folder.path()).output().unwrap();
        // Sides are even.
        assert_eq!(
            String::from_utf8(found.stdout).unwrap().trim(),
            "34,18,bt709,21"
        );
    }
}
