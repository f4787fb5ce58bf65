//! Files in practice: no file is lost that a run has not written, anything but a regular file is
//! refused at once, names need not be UTF-8, and failed writes are reported.
#![cfg(target_os = "linux")]

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::Write;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use footlight_picture::exr::{self, Precision};
use footlight_picture::{Image, png};
use tempfile::TempDir;

/// Longer than any of these commands takes; a hang fails the test.
const PATIENCE: Duration = Duration::from_secs(60);

/// A show without anything to render.
const SHOW: &str = "show \"Files\"\nbank a image \"keys/a.exr\"\nbank b image \"keys/b.png\"\n\
    cue 1 at 0:00 { snap  a 100  b 50 }\ncue 2 at 0:02 { a 25  b full  time 1 }\n";

/// The show with two key settings instead of three.
const SHORTER: &str = "show \"Files\"\nbank a image \"keys/a.exr\"\nbank b image \"keys/b.png\"\n\
    cue 1 at 0:00 { snap  a 100  b 50 }\ncue 2 at 0:02 { a 25  time 1 }\n";

/// A show with something to render.
const LIT: &str = "show \"Lit\"\npreview { coarse 1  refined 2 }\n\
    view house  from 0, -5, 1.6  to 0, 0, 1.2  fov 45  size 16x9\n\
    surface floor  reflectance 0.5  quad -3, -3, 0  3, -3, 0  3, 3, 0  -3, 3, 0\n\
    light left  spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd\n\
    bank lamp = left\ncue 1 at 0:00 { snap  lamp 20 }\ncue 2 at 0:02 { lamp 80  time 1 }\n";

/// A folder with a show of images, `s.lxq`.
fn place() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    furnish(folder.path());
    folder
}

fn furnish(folder: &Path) {
    fs::create_dir_all(folder.join("keys")).unwrap();
    let image = Image::from_data(8, 4, vec![0.25; 96]).unwrap();
    let image = exr::encode(&image, Precision::Float, &[]).unwrap();
    fs::write(folder.join("s.lxq"), SHOW).unwrap();
    fs::write(folder.join("keys/a.exr"), image).unwrap();
    let image = png::encode(8, 4, &[188; 96]).unwrap();
    fs::write(folder.join("keys/b.png"), image).unwrap();
}

fn footlight(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_footlight"));
    command.current_dir(folder).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// The exit code and output of a process; a hang fails the test.
fn ended(mut child: Child) -> (i32, String) {
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("it hangs");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let output = child.wait_with_output().unwrap();
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    (output.status.code().unwrap_or(-1), said)
}

fn told<W: AsRef<OsStr>>(folder: &Path, words: &[W]) -> (i32, String) {
    ended(footlight(folder).args(words).spawn().unwrap())
}

fn split(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Every file of a folder with its content.
fn content(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(content(&path));
        } else {
            let bytes = fs::read(&path).unwrap();
            all.push((path, bytes));
        }
    }
    all.sort();
    all
}

fn keys_of(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder.join("keys")).unwrap();
    let names = names.map(|e| e.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn a_run_removes_and_replaces_only_what_a_run_has_written() {
    let folder = place();
    let at = |name: &str| folder.path().join(name);
    let run = split("run s.lxq --keys -o .");
    fs::write(at("keys/mine.exr"), "mine").unwrap();
    let before = content(folder.path());
    let (code, said) = told(folder.path(), &run);
    assert_eq!(code, 0, "{said}");
    let after = content(folder.path());
    assert!(before.iter().all(|file| after.contains(file)), "{said}");
    let (code, said) = told(folder.path(), &run);
    assert_eq!(code, 0, "again: {said}");
    let all = [
        "a.exr",
        "b.png",
        "key001.exr",
        "key002.exr",
        "key003.exr",
        "mine.exr",
    ];
    assert_eq!(keys_of(folder.path()), all);
    fs::write(at("s.lxq"), SHORTER).unwrap();
    let (code, said) = told(folder.path(), &run);
    assert_eq!(code, 0, "{said}");
    let fewer = ["a.exr", "b.png", "key001.exr", "key002.exr", "mine.exr"];
    assert_eq!(keys_of(folder.path()), fewer);
    // Somebody edits the key image that the next run would remove.
    fs::write(at("s.lxq"), SHOW).unwrap();
    assert_eq!(told(folder.path(), &run).0, 0);
    fs::write(at("keys/key003.exr"), "retouched").unwrap();
    fs::write(at("s.lxq"), SHORTER).unwrap();
    let (code, said) = told(folder.path(), &run);
    assert_eq!(code, 0, "{said}");
    assert_eq!(fs::read(at("keys/key003.exr")).unwrap(), b"retouched");
    assert_eq!(keys_of(folder.path()), all);
    let check = Command::new("sha256sum")
        .args(["--check", "--strict", "files.sha256"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(check.status.success(), "{check:?}");
}

/// The run is refused before any work, with the file named and nothing changed.
#[test]
fn a_run_is_refused_where_something_else_stands_in_its_way() {
    let foreign = "is not what an earlier run wrote and listed in `files.sha256`; nothing was written: \
                   move it away, or choose another folder with -o";
    for (name, reason) in [
        ("plan.json", foreign),
        ("show.html", foreign),
        ("keys/key002.exr", foreign),
        ("unfinished.txt", foreign),
        ("files.sha256", foreign),
        ("keys/key001.exr", "belongs to the show"),
    ] {
        let folder = place();
        let at = folder.path().join(name);
        if reason == foreign {
            fs::write(&at, "mine").unwrap();
        } else {
            fs::rename(folder.path().join("keys/a.exr"), &at).unwrap();
            let show = SHOW.replace("keys/a.exr", name);
            fs::write(folder.path().join("s.lxq"), show).unwrap();
        }
        let before = content(folder.path());
        let (code, said) = told(folder.path(), &split("run s.lxq --keys -o ."));
        assert_eq!(code, 2, "{name}: {said}");
        assert!(said.contains(name) && said.contains(reason), "{said}");
        assert!(content(folder.path()) == before, "{name}");
    }
    // A folder that is a link elsewhere, and a list with names that runs do not use.
    let folder = place();
    fs::create_dir(folder.path().join("out")).unwrap();
    symlink("../keys", folder.path().join("out/keys")).unwrap();
    let (code, said) = told(folder.path(), &split("run s.lxq --keys -o out"));
    assert!(code == 2 && said.contains(foreign), "{code} {said}");
    fs::remove_file(folder.path().join("out/keys")).unwrap();
    let digest = "0".repeat(64);
    let list = format!("{digest}  ../s.lxq\n");
    fs::write(folder.path().join("out/files.sha256"), list).unwrap();
    let (code, said) = told(folder.path(), &split("run s.lxq --keys -o out"));
    assert!(code == 2 && said.contains(foreign), "{code} {said}");
}

#[test]
fn no_result_replaces_what_the_command_reads() {
    let folder = place();
    let at = |name: &str| folder.path().join(name);
    fs::copy(at("keys/a.exr"), at("0002.exr")).unwrap();
    symlink("keys/b.png", at("link.png")).unwrap();
    let show = SHOW.replace("keys/a.exr", "0002.exr");
    fs::write(at("s.lxq"), &show).unwrap();
    fs::write(at("old.lxq"), show.replace("a 25", "a 30")).unwrap();
    fs::write(at("commands.csv"), "refine 1\n").unwrap();
    let before = content(folder.path());
    for line in [
        "picture s.lxq -o keys/b.png",
        "picture s.lxq -o link.png",
        "picture s.lxq -o keys/../0002.exr",
        "frames s.lxq -o 0002.exr",
        "frames s.lxq -o ####.exr",
        "plot s.lxq -o keys/b.png",
        "diff old.lxq s.lxq -o keys/b.png",
    ] {
        let (code, said) = told(folder.path(), &split(line));
        assert_eq!(code, 2, "{line}: {said}");
        assert!(said.contains("belongs to the show"), "{line}: {said}");
        assert!(content(folder.path()) == before, "{line}");
    }
}

#[test]
fn an_edited_file_keeps_its_mode_its_link_and_its_names() {
    let folder = place();
    let at = |name: &str| folder.path().join(name);
    let untidy = SHOW.replace("bank a", "bank   a");
    let repl: Vec<OsString> = ["repl", "link.lxq", "-c", "cue 9 { a 5 }", "-c", "save"]
        .map(OsString::from)
        .into();
    let fmt: Vec<OsString> = ["fmt", "link.lxq"].map(OsString::from).into();
    symlink("s.lxq", at("link.lxq")).unwrap();
    for words in [fmt, repl] {
        fs::write(at("s.lxq"), &untidy).unwrap();
        fs::set_permissions(at("s.lxq"), fs::Permissions::from_mode(0o640)).unwrap();
        let (code, said) = told(folder.path(), &words);
        assert_eq!(code, 0, "{words:?}: {said}");
        assert!(fs::symlink_metadata(at("link.lxq")).unwrap().is_symlink());
        assert_ne!(fs::read_to_string(at("s.lxq")).unwrap(), untidy);
        let about = fs::symlink_metadata(at("s.lxq")).unwrap();
        assert!(about.is_file(), "{words:?}");
        assert_eq!(about.mode() & 0o7777, 0o640, "{words:?}");

        fs::write(at("s.lxq"), &untidy).unwrap();
        fs::hard_link(at("s.lxq"), at("other.lxq")).unwrap();
        let (code, said) = told(folder.path(), &words);
        assert_eq!(code, 3, "{words:?}: {said}");
        assert!(
            said.contains("2 names (hard links)") && said.contains("mv"),
            "{said}"
        );
        assert_eq!(fs::read_to_string(at("other.lxq")).unwrap(), untidy);
        fs::remove_file(at("other.lxq")).unwrap();
    }
}

#[test]
fn a_pipe_and_a_device_are_written_into() {
    let folder = place();
    let at = |name: &str| folder.path().join(name);
    pipe(&at("p.png"));
    symlink("/dev/null", at("null.png")).unwrap();
    let device = fs::metadata("/dev/null").unwrap().ino();
    for (verb, name) in [("picture", "p.png"), ("picture", "null.png")] {
        let child = footlight(folder.path())
            .args([verb, "s.lxq", "-o", name])
            .spawn()
            .unwrap();
        if name == "p.png" {
            let read = fs::read(at(name)).unwrap();
            assert_eq!(&read[1..4], b"PNG", "{verb}");
        }
        let (code, said) = ended(child);
        assert!(code == 0 && said.contains("wrote"), "{verb} {name}: {said}");
    }
    assert!(fs::metadata(at("p.png")).unwrap().file_type().is_fifo());
    assert!(fs::symlink_metadata(at("null.png")).unwrap().is_symlink());
    assert_eq!(fs::metadata("/dev/null").unwrap().ino(), device);
    // A link to a file is followed, and a link to a missing file creates it.
    symlink("keys/new.png", at("new.png")).unwrap();
    for _ in 0..2 {
        let (code, said) = told(folder.path(), &split("picture s.lxq -o new.png"));
        assert_eq!(code, 0, "{said}");
        assert!(fs::symlink_metadata(at("new.png")).unwrap().is_symlink());
        assert!(at("keys/new.png").is_file());
    }
}

#[test]
fn what_a_killed_run_left_half_written_is_removed_by_the_next() {
    let folder = place();
    let mut gone = Command::new("true").spawn().unwrap();
    gone.wait().unwrap();
    let part = |name: &str, id: u32| {
        let path = folder
            .path()
            .join(format!("{name}.{id}-0123456789abcdef.part"));
        fs::write(&path, "half").unwrap();
        path
    };
    for (line, name) in [
        ("run s.lxq --keys -o .", "keys/key001.exr"),
        ("run s.lxq --keys -o .", "show.html"),
        ("picture s.lxq -o a.png", "film.y4m"),
        ("fmt s.lxq", "s.lxq"),
    ] {
        fs::write(
            folder.path().join("s.lxq"),
            SHOW.replace("bank a", "bank   a"),
        )
        .unwrap();
        let litter = part(name, gone.id());
        let living = part(name, std::process::id());
        let own = folder.path().join("keys/mine.part");
        fs::write(&own, "mine").unwrap();
        let (code, said) = told(folder.path(), &split(line));
        assert_eq!(code, 0, "{line}: {said}");
        assert!(!litter.exists(), "{line}");
        assert!(living.exists() && own.exists(), "{line}");
    }
}

fn pipe(path: &Path) {
    nix::unistd::mkfifo(path, nix::sys::stat::Mode::S_IRWXU).unwrap();
}

/// Every place where a file is read, with every kind of non-file.
#[test]
fn what_is_no_file_is_refused_at_once() {
    let lit =
        |line: &str| LIT.replace("bank lamp = left\n", &format!("bank lamp = left\n{line}\n"));
    let stage = LIT.replace("surface floor", "stage \"set.obj\"\nsurface floor2");
    let spot = "spot  at -2, -2, 3.5  aim -0.8, 0.5, 0.5  beam 30  field 50  900 cd";
    let ies = LIT.replace(spot, "photometric \"x\" at 0, 0, 3  aim 0, 0, 0");
    let slide = LIT.replace(
        spot,
        "project \"x\" from 0, 0, 3  aim 0, 0, 0  field 40  900 cd",
    );
    for (show, line) in [
        (LIT.to_owned(), "check x"),
        (LIT.to_owned(), "fmt x"),
        (LIT.to_owned(), "diff x s.lxq"),
        (LIT.to_owned(), "diff s.lxq x"),
        (lit("include \"x\""), "check s.lxq"),
        (lit("bank i image \"x\""), "check s.lxq"),
        (stage.replace("set.obj", "x"), "check s.lxq"),
        (stage, "check s.lxq"),
        (ies, "check s.lxq"),
        (slide, "check s.lxq"),
    ] {
        for kind in ["pipe", "socket", "folder"] {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            fs::write(at("s.lxq"), &show).unwrap();
            fs::write(
                at("set.obj"),
                "mtllib x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n",
            )
            .unwrap();
            let _socket = match kind {
                "pipe" => {
                    pipe(&at("x"));
                    None
                }
                "socket" => Some(std::os::unix::net::UnixListener::bind(at("x")).unwrap()),
                _ => {
                    fs::create_dir(at("x")).unwrap();
                    None
                }
            };
            let (code, said) = told(folder.path(), &split(line));
            assert!(
                code != 0 && code != 70,
                "{line} {kind}: {code} {said}\n{show}"
            );
            let reason = format!("is a {kind}, not a file");
            assert!(said.contains(&reason), "{line} {kind}: {said}\n{show}");
        }
    }
    let folder = place();
    for device in ["/dev/zero", "/dev/null"] {
        let (code, said) = told(folder.path(), &["check", device]);
        assert!(
            code == 3 && said.contains("is a device, not a file"),
            "{said}"
        );
    }
}

/// `-` reads a show from a pipe; the name of a pipe gets that advice.
#[test]
fn a_show_comes_from_a_pipe_as_a_dash() {
    let folder = place();
    for (name, expected) in [("-", 0), ("/dev/stdin", 3)] {
        let mut command = footlight(folder.path());
        command.args(["check", name]).stdin(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // Its reader may have ended already.
        let _ = child.stdin.take().unwrap().write_all(SHOW.as_bytes());
        let (code, said) = ended(child);
        assert_eq!(code, expected, "{said}");
        assert_eq!(said.contains("footlight check -"), expected == 3, "{said}");
    }
}

#[test]
fn names_of_files_need_not_be_text() {
    let top = tempfile::tempdir().unwrap();
    let name = |start: &str, end: &str| {
        let bytes = [start.as_bytes(), b"\xff\xfe", end.as_bytes()].concat();
        OsString::from_vec(bytes)
    };
    let folder = top.path().join(name("folder", ""));
    fs::create_dir(&folder).unwrap();
    furnish(&folder);
    let show = name("s", ".lxq");
    let text = SHOW.replace("bank b", "include \"more.lxq\"\nbank   b");
    fs::write(folder.join(&show), text).unwrap();
    fs::write(folder.join("more.lxq"), "default time 1\n").unwrap();
    fs::write(folder.join(name("commands", "")), "refine 1\n").unwrap();
    let words = |line: &str| -> Vec<OsString> {
        let odd = |word: &str| match word.split_once('*') {
            Some((start, end)) => name(start, end),
            None => OsString::from(word),
        };
        line.split_whitespace().map(odd).collect()
    };
    for (line, result) in [
        ("check s*.lxq", None),
        ("fmt s*.lxq", None),
        ("diff s.lxq s*.lxq", None),
        ("picture s*.lxq -o p*.png", Some("p*.png")),
        ("film s*.lxq -o film*.y4m", Some("film*.y4m")),
        ("frames s*.lxq -o f*####.png", Some("f*0001.png")),
        ("plot s*.lxq -o c*.svg", Some("c*.svg")),
        ("run s*.lxq -o o*", Some("o*/show.html")),
        ("run s*.lxq", Some("out/s*/show.html")),
        ("repl s*.lxq -c save", None),
    ] {
        let (code, said) = told(&folder, &words(line));
        let differs = i32::from(line.starts_with("diff"));
        assert_eq!(code, differs, "{line}: {said}");
        let result = result.map(|result| words(result).remove(0));
        assert!(
            result.is_none_or(|r| folder.join(r).exists()),
            "{line}: {said}"
        );
    }
    // A word that is not a file name must be text.
    let mut at = words("picture s.lxq --at");
    at.push(OsStr::from_bytes(b"\xff").to_owned());
    assert_eq!(told(&folder, &at).0, 2);
}

#[test]
fn what_standard_output_does_not_take_is_told() {
    let folder = place();
    let shell = |line: &str| {
        let program = env!("CARGO_BIN_EXE_footlight");
        let line = line.replace("footlight", &format!("'{program}'"));
        let mut command = Command::new("sh");
        command.args(["-c", &line]).current_dir(folder.path());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        ended(command.spawn().unwrap())
    };
    let (code, said) = shell("footlight film s.lxq -o - >/dev/null");
    assert!(code == 0 && said.contains("wrote"), "{code} {said}");
    for line in ["--help", "--version", "help run", "run --help"] {
        let (code, said) = shell(&format!("footlight {line} >/dev/full"));
        assert!(
            code == 3 && said.contains("standard output"),
            "{line}: {said}"
        );
        let (code, said) = shell(&format!("footlight {line} | true"));
        assert_eq!(code, 0, "{line}: {said}");
    }
}

/// An unusable folder of stored images is reported once, and nothing is reported as lost.
#[test]
fn a_pool_that_cannot_be_written_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("s.lxq"), LIT).unwrap();
    let spoil: [(&str, &dyn Fn()); 4] = [
        ("Not a directory", &|| {
            fs::write(at(".footlight"), "").unwrap()
        }),
        ("is a link", &|| {
            symlink(at("elsewhere"), at(".footlight")).unwrap()
        }),
        ("is a link", &|| {
            fs::create_dir(at(".footlight")).unwrap();
            symlink(at("elsewhere"), at(".footlight/pictures")).unwrap();
        }),
        ("Not a directory", &|| {
            fs::create_dir(at(".footlight")).unwrap();
            fs::write(at(".footlight/pictures"), "").unwrap();
        }),
    ];
    fs::create_dir(at("elsewhere")).unwrap();
    for (reason, spoil) in spoil {
        spoil();
        let (code, said) = told(folder.path(), &split("picture s.lxq -o p.png"));
        assert_eq!(code, 0, "{said}");
        assert!(said.contains(reason) && !said.contains("dropped"), "{said}");
        assert_eq!(said.matches("note:").count(), 1, "{said}");
        assert_eq!(fs::read_dir(at("elsewhere")).unwrap().count(), 0);
        let path = at(".footlight");
        match fs::symlink_metadata(&path).unwrap().is_dir() {
            true => fs::remove_dir_all(path).unwrap(),
            false => fs::remove_file(path).unwrap(),
        }
    }
}
