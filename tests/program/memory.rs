//! `--memory` bounds scene, operators and images: the peak of resident memory stays within it plus
//! the program's own needs, also for shows that are too large for it.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use footlight::Image;
use footlight_picture::exr::{self, Precision};
use footlight_picture::png;

/// The program's own needs, MB.
const BESIDE: u64 = 64;

/// Photometric files of half a million intensities each: more than 64 MB.
const LUMINAIRES: usize = 18;

const LIGHT: &str = "light x spot at 0,0,3 aim 0,0,0 beam 20 field 30 900 cd\n";

const ROOM: &str = "surface floor reflectance 0.6 quad 0,0,0 10,0,0 10,10,0 0,10,0\n\
                    surface back reflectance 0.5 quad 0,10,0 10,10,0 10,10,5 0,10,5\n";

/// A stage whose images are small files that decode to large ones.
const TEXTURES: &str = "stage \"set.obj\" z up\nview v from 6,-3,6 to 6,0,0 fov 50 size 640x360\n\
                        light x spot at 6,0,4 aim 6,0,0 beam 60 field 90 900 cd\nbank a = x\n\
                        cue 1 at 0:00 { snap a 50 }\n";

/// The stage: squares with an image each, six of 1000 x 1000 texels; with `huge` another of 3000.
fn write_textures(folder: &Path, huge: bool) {
    let mut list = vec![1000; 6];
    if huge {
        list.push(3000);
    }
    let mut materials = String::new();
    let mut stage = "mtllib set.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n".to_owned();
    for (i, side) in list.into_iter().enumerate() {
        let shade = vec![100 + i as u8; side * side * 3];
        let image = png::encode(side, side, &shade).unwrap();
        std::fs::write(folder.join(format!("t{i}.png")), image).unwrap();
        write!(materials, "newmtl m{i}\nKd 1 1 1\nmap_Kd t{i}.png\n").unwrap();
        let (x, right) = (2 * i, 2 * i + 1);
        write!(
            stage,
            "v {x} 0 0\nv {right} 0 0\nv {right} 1 0\nv {x} 1 0\nusemtl m{i}\nf -4/1 -3/2 -2/3 -1/4\n"
        )
        .unwrap();
    }
    std::fs::write(folder.join("set.mtl"), materials).unwrap();
    std::fs::write(folder.join("set.obj"), stage).unwrap();
}

/// Many projected images in small files.
fn thrown() -> String {
    let light = |i: usize| {
        format!(
            "light l{i} project \"g{i}.png\" from 0,0,3 aim 0,0,0 field 20 900 cd\nbank b{i} = l{i}\n"
        )
    };
    (0..6).map(light).collect::<String>() + "cue 1 at 0:00 { snap b0 50 }\n"
}

/// Many measured luminaires.
fn photometric() -> String {
    let light = |i: usize| {
        format!("light l{i} photometric \"m{i}.ies\" at 0,0,3 aim 0,0,0\nbank b{i} = l{i}\n")
    };
    (0..LUMINAIRES).map(light).collect::<String>() + "cue 1 at 0:00 { snap b0 50 }\n"
}

fn write_luminaires(folder: &Path) {
    let image = png::encode(1200, 1200, &vec![200; 1200 * 1200 * 3]).unwrap();
    for i in 0..6 {
        std::fs::write(folder.join(format!("g{i}.png")), &image).unwrap();
    }
    let row = |count: usize, most: f64| -> String {
        let angle = |i: usize| format!("{:.4} ", most * i as f64 / (count - 1) as f64);
        (0..count).map(angle).collect()
    };
    let mut ies = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 700 700 1 2 0 0 0\n1 1 50\n".to_owned();
    ies += &format!("{}\n{}\n", row(700, 180.0), row(700, 360.0));
    ies += &"5 ".repeat(490_000);
    for i in 0..LUMINAIRES {
        std::fs::write(folder.join(format!("m{i}.ies")), &ies).unwrap();
    }
}

/// The advice about a texture too large for `--memory` makes it fit when typed.
#[test]
#[ignore = "slow"]
fn a_texture_that_is_left_out_is_told_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    write_textures(folder.path(), true);
    let stage = |megabytes: &str| {
        let output = Command::new(env!("CARGO_BIN_EXE_footlight"))
            .current_dir(&folder)
            .args(["stage", "set.obj", "--memory", megabytes])
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let said = stage("64");
    let notes: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("not as it stands"))
        .collect();
    let [sixth, huge] = notes[..] else {
        panic!("{said}")
    };
    assert!(sixth.contains("`m5`") && huge.contains("`m6`"), "{said}");
    let (_, more) = huge.split_once("allow more with `--memory ").unwrap();
    let (megabytes, _) = more.split_once('`').unwrap();
    let said = stage(megabytes);
    assert!(!said.contains("not as it stands"), "{megabytes}: {said}");
}

/// A large show, commands on it, and the expected result.
struct Case {
    name: &'static str,
    show: String,
    /// MB.
    budget: u64,
    verb: &'static [&'static str],
    /// A word of the refusal; `None` when it must succeed.
    refused: Option<&'static str>,
}

fn cases() -> Vec<Case> {
    let case = |name, show, budget, verb, refused| Case {
        name,
        show,
        budget,
        verb,
        refused,
    };
    vec![
        case("comments", comments(200_000), 64, &["check"], None),
        case("cues", cues(1_000, 300), 96, &["tracksheet"], None),
        case(
            "pixels",
            pixels(8_192),
            64,
            &["picture", "-o", "a.png"],
            Some("pictures"),
        ),
        case(
            "spheres",
            spheres(1_000),
            64,
            &["picture", "-o", "a.png"],
            Some("stage"),
        ),
        case("warnings", warnings(30_000), 150, &["check"], None),
        // Beyond 2,500 polygons another operator is used.
        case("boxes", boxes(2_000), 96, &["picture", "-o", "a.png"], None),
        // The patches of its narrow beams take 2 MB.
        case("boxes", boxes(2_000), 72, &["run"], None),
        case("boxes", boxes(6_000), 64, &["run"], Some("MB")),
        case("rig", rig(12, 40), 128, &["run"], None),
        case("rig", rig(12, 40), 128, &["play", "-o", "a.html"], None),
        case("rig", rig(6, 20), 192, &["run", "--count", "1"], None),
        case("rig", rig(6, 20), 192, &["play", "-o", "a.html"], None),
        case("thrown", thrown(), 64, &["check"], Some("thrown")),
        case(
            "photometric",
            photometric(),
            64,
            &["check"],
            Some("photometric"),
        ),
        case("textures", TEXTURES.to_owned(), 64, &["check"], None),
        case(
            "textures",
            TEXTURES.to_owned(),
            64,
            &["picture", "-o", "a.png"],
            Some("the picture"),
        ),
        case(
            "textures",
            TEXTURES.to_owned(),
            160,
            &["picture", "-o", "a.png"],
            None,
        ),
        case("images", images(12), 64, &["check"], Some("--memory")),
        case("images", images(8), 256, &["play", "-o", "a.html"], None),
    ]
}

fn comments(lines: usize) -> String {
    format!(
        "show \"S\"\n{}cue 1 at 0:00 {{ }}\n",
        "// a line that says nothing\n".repeat(lines)
    )
}

/// Cues without effect.
fn warnings(count: usize) -> String {
    show(1, count, |_| "b0 50".to_owned())
}

/// Boxes on a floor, under a lamp.
fn boxes(count: usize) -> String {
    let mut text = format!(
        "{ROOM}view v from 5,-9,2 to 5,5,1 fov 40 size 64x36\n{LIGHT}bank a = x\n\
         cue 1 at 0:00 {{ snap a 50 }}\nsurface box reflectance 0.5"
    );
    for i in 0..count {
        let (x, y, z) = (
            0.2 * (i % 50) as f64,
            0.2 * (i / 50) as f64,
            0.05 + 0.001 * i as f64,
        );
        write!(
            text,
            " box from {x:.1},{y:.1},0 to {:.2},{:.2},{z:.3}",
            x + 0.1,
            y + 0.1
        )
        .unwrap();
    }
    text.push('\n');
    text
}

/// Lights over a floor, one bank each, and cues that mix them.
fn rig(banks: usize, count: usize) -> String {
    let lit = |cue: usize| {
        format!(
            "time 1  b{} {}  b{} 20",
            cue % banks,
            5 + cue,
            (cue + 1) % banks
        )
    };
    format!(
        "{ROOM}view v from 5,-9,2 to 5,5,1 fov 40 size 640x360\n{}",
        show(banks, count, lit)
    )
}

/// Banks given as images like [`image`].
fn images(count: usize) -> String {
    let bank = |i| format!("bank b{i} image \"b{i}.exr\"\n");
    let banks: String = (0..count).map(bank).collect();
    let cue = |i| format!("cue {} at {}s {{ time 1  b{i} 50 }}\n", i + 1, 2 * i);
    let cues: String = (0..count).map(cue).collect();
    format!("show \"I\"\n{banks}{cues}")
}

fn image() -> Vec<u8> {
    let mut image = Image::new(800, 600);
    image.data_mut().fill(0.5);
    exr::encode(&image, Precision::Half, &[]).unwrap()
}

fn lights(count: usize) -> String {
    (0..count).fold(String::new(), |mut text, i| {
        text.push_str(&LIGHT.replace("light x", &format!("light x{i}")));
        text
    })
}

/// Banks of a light each.
fn banks(count: usize) -> String {
    (0..count).fold(lights(count), |mut text, bank| {
        writeln!(text, "bank b{bank} = x{bank}").unwrap();
        text
    })
}

/// Cues of one kind; `does` writes the content of a cue by its number.
fn show(banks_: usize, count: usize, does: impl Fn(usize) -> String) -> String {
    (0..count).fold(banks(banks_), |mut text, cue| {
        let number = (cue + 1) as f64 / 10.0;
        writeln!(text, "cue {number:.1} at {}s {{ {} }}", 2 * cue, does(cue)).unwrap();
        text
    })
}

fn cues(count: usize, banks: usize) -> String {
    show(banks, count, |cue| {
        let level = |i: usize| format!("b{} {}", (7 * cue + i) % banks, (cue + 31 * i) % 100 + 1);
        format!(
            "time 1  {}",
            (0..5).map(level).collect::<Vec<_>>().join(" ")
        )
    })
}

fn pixels(width: usize) -> String {
    format!(
        "{ROOM}view v from 5,-9,2 to 5,5,1 fov 40 size {width}x{width}\n{LIGHT}bank a = x\n\
         cue 1 at 0:00 {{ snap a 50 }}\n"
    )
}

fn spheres(count: usize) -> String {
    let mut text = format!("{ROOM}view v from 5,-9,2 to 5,5,1 fov 40 size 32x24\n");
    for i in 0..count {
        let (x, y) = (0.1 * (i % 100) as f64, 0.5 * (i / 100) as f64);
        writeln!(text, "light l{i} sphere at {x},{y},3 radius 3cm 80 lm").unwrap();
    }
    let all: Vec<String> = (0..count).map(|i| format!("l{i}")).collect();
    writeln!(text, "bank a = {}", all.join(" ")).unwrap();
    text.push_str("cue 1 at 0:00 { snap a 50 }\n");
    text
}

/// Peak of a child's resident memory in MB, and true if it succeeded.
fn peak(mut child: Child) -> (u64, bool) {
    let status = PathBuf::from(format!("/proc/{}/status", child.id()));
    let mut peak = 0;
    loop {
        peak = peak.max(high_water(&status).unwrap_or(0));
        if let Some(ended) = child.try_wait().unwrap() {
            return (peak, ended.success());
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
}

/// The kernel's high-water mark, which misses nothing between two polls except the very end.
fn high_water(status: &Path) -> Option<u64> {
    let text = std::fs::read_to_string(status).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? / 1024)
}

#[test]
#[ignore = "slow"]
fn shows_are_read_within_the_budget_or_refused() {
    the_peak_stays_within_the_budget(|case| !renders(case));
}

#[test]
#[ignore = "slow"]
fn shows_are_rendered_within_the_budget() {
    the_peak_stays_within_the_budget(renders);
}

/// True when it renders to the end.
fn renders(case: &Case) -> bool {
    matches!(case.verb, ["run" | "picture", ..]) && case.refused.is_none()
}

fn the_peak_stays_within_the_budget(which: impl Fn(&Case) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    let said = folder.path().join("said");
    let image = image();
    for i in 0..12 {
        std::fs::write(folder.path().join(format!("b{i}.exr")), &image).unwrap();
    }
    write_textures(folder.path(), false);
    write_luminaires(folder.path());
    for case in cases().into_iter().filter(which) {
        let name = format!("{} {:?} at {} MB", case.name, case.verb, case.budget);
        std::fs::write(folder.path().join("a.lxq"), &case.show).unwrap();
        let (verb, options) = case.verb.split_first().unwrap();
        let child = Command::new(env!("CARGO_BIN_EXE_footlight"))
            .current_dir(&folder)
            .args(["--quiet", "--pool", "off", "--threads", "2"])
            .args(["--memory", &case.budget.to_string(), verb])
            .arg("a.lxq")
            .args(options)
            .stdout(Stdio::null())
            .stderr(File::create(&said).unwrap())
            .spawn()
            .unwrap();
        let (peak, well) = peak(child);
        let said = std::fs::read_to_string(&said).unwrap();
        // A show refused at once may end between two polls.
        assert!(
            peak > 0 || case.refused.is_some(),
            "{name}: its memory was not seen"
        );
        assert!(
            peak <= case.budget + BESIDE,
            "{name}: {peak} MB\n{said:.500}"
        );
        match case.refused {
            None => assert!(well, "{name}: {said:.500}"),
            Some(word) => {
                let told = said.contains(word) && said.contains("--memory");
                assert!(!well && told, "{name}: {said:.500}");
            }
        }
    }
}

/// Under a limit on address space, as batch systems set it, the program succeeds or refuses, and
/// never aborts.
#[test]
#[ignore = "slow"]
fn a_limit_of_addresses_ends_in_an_error_at_worst() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("boxes.lxq"), boxes(2_000)).unwrap();
    std::fs::write(folder.path().join("rig.lxq"), rig(6, 8)).unwrap();
    for (megabytes, show) in [
        (100, "rig.lxq"),
        (100, "boxes.lxq"),
        (150, "boxes.lxq"),
        (200, "rig.lxq"),
        (250, "boxes.lxq"),
        (300, "rig.lxq"),
    ] {
        let line = format!("ulimit -v {}; exec \"$0\" \"$@\"", megabytes * 1000);
        let output = Command::new("sh")
            .current_dir(&folder)
            .args(["-c", &line, env!("CARGO_BIN_EXE_footlight")])
            .args(["run", show, "--count", "1", "--quiet", "--pool", "off"])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let refused = output.status.code() == Some(1) && said.contains("--memory");
        let well = output.status.success() || refused;
        assert!(well, "{show} at {megabytes} MB: {} {said}", output.status);
    }
}
