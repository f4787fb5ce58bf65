//! Levels for a target image: recovered from images of known levels, in files of every kind, and
//! refused when nothing can be found.

use std::path::{Path, PathBuf};

use crate::prompt;
use footlight_engine::Host;
use footlight_host::files::{Memory, MemoryStore, Store};
use footlight_picture::exr::{self, Precision};
use footlight_picture::{Image, png};
use footlight_prompt::Repl;
use footlight_show::diagnostic::Style;
use footlight_show::units::Time;

/// Banks with every law and an rgb one, indistinguishable banks, an invisible one, a fixed light.
const SHOW: &str = r#"show "Known"
preview { exposure -4.6 }
surface floor  reflectance 0.5 quad -4,-4,0 4,-4,0 4,4,0 -4,4,0
surface wall   reflectance 0.7 quad -4,4,0 4,4,0 4,4,4 -4,4,4
surface block1 reflectance 0.6 0.3 0.2 box from -1,0,0 to 0,1,1
view house from 0,-9,3 to 0,0,1 fov 40 size 160x90
view side  from 8,-4,3 to 0,0,1 fov 40 size 160x90
light a  spot at -3,-3,4 aim -1,1,0 beam 20 field 40 9000 cd
light b  spot at 3,-3,4  aim 1,1,0  beam 20 field 40 9000 cd
light b2 spot at 3,-3,4  aim 1,1,0  beam 20 field 40 4500 cd
light c  spot at 0,-3,4  aim 0,4,2  beam 30 field 60 9000 cd
light d  spot at 0,2,4   aim 0,1,0  beam 30 field 60 900 cd
light e  spot at 0,-3,-5 aim 0,0,-9 beam 30 field 60 4500 cd
light f  spot at 0,2,3.9 aim 0,1,0  beam 40 field 70 300 cd
curve law = monotone 0 5, 0.4 20, 1 90
bank left  = a  dimmer square
bank right = b
bank twin  = b2
bank cyc   = c  rgb
bank back  = d  dimmer law
bank under = e
fixed on = f
group front = left right
cue 1 at 0:00 { snap  left 50  right 30  twin 0  cyc 80 #4060ff  back 0  under 20 }
cue 2 at 0:05 { time 2  right 90  under 60 }
"#;

/// Levels of the target image, in the form for `set`.
const KNOWN: &str = "left 73.21 right 12.3 cyc 62 #ff8040 back 44.4";

fn open(text: &str) -> (Repl, MemoryStore) {
    let store = MemoryStore::default();
    let host = Host {
        files: Box::new(Memory::default()),
        store: Box::new(store.clone()),
        ..Host::default()
    };
    (prompt("show.lxq", text.as_bytes(), host).unwrap(), store)
}

fn told(show: &mut Repl, line: &str) -> String {
    match show.execute(line) {
        Ok(reply) => reply.text.to_string(),
        Err(error) => error.report(Style::Plain).to_string(),
    }
}

/// Levels of the parameters at the moment, with trial levels.
fn levels(show: &Repl) -> Vec<f64> {
    show.live().levels(show.engine().document())
}

/// Largest difference of visible light from that of other levels. The twins count together.
fn off(show: &Repl, wanted: &[f64]) -> f64 {
    let light = |levels: &[f64]| {
        let mut all = footlight_show::timeline::lights(show.engine().show(), levels);
        let twin = all.remove(2);
        all[1] += 0.5 * twin;
        all.truncate(6);
        all
    };
    let pairs = light(&levels(show)).into_iter().zip(light(wanted));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A show with images of the known levels in its store, and its current levels.
fn with_pictures() -> (Repl, MemoryStore, Vec<f64>) {
    let (mut show, store) = open(SHOW);
    for line in [
        "goto 1",
        &format!("set {KNOWN}"),
        "picture -o known.exr --float",
    ] {
        show.execute(line).unwrap();
    }
    for line in [
        "picture -o half.exr",
        "picture -o known.png",
        "picture --exposure -2 -o bright.png",
    ] {
        show.execute(line).unwrap();
    }
    show.execute("picture --view side -o side.exr").unwrap();
    let known = levels(&show);
    show.execute("release").unwrap();
    (show, store, known)
}

/// Recovered within 1e-4 from light and within 1e-2 from 8 bits, even when a fifth of the image is
/// white.
#[test]
fn known_levels_are_found_again() {
    let (mut show, _, known) = with_pictures();
    let files = [
        ("known.exr", 1e-4),
        ("half.exr", 1e-3),
        ("known.png", 1e-2),
        ("bright.png --any-exposure", 1e-2),
        ("known.exr --any-exposure", 1e-4),
    ];
    for (file, tolerance) in files {
        let said = told(&mut show, &format!("solve {file}"));
        assert!(said.contains("trying left 73."), "{said}");
        assert!(said.contains("left as they stand: under"), "{said}");
        assert!(
            said.contains("only sums of these count here, and change least: right, twin"),
            "{said}"
        );
        assert!(
            off(&show, &known) < tolerance,
            "{file}: {}\n{said}",
            off(&show, &known)
        );
        show.execute("release").unwrap();
    }
    // The twins share the missing 30 in proportion to their light, one having twice the other's.
    let (mut show, ..) = with_pictures();
    show.execute("set twin 20").unwrap();
    let before = levels(&show);
    show.execute("solve known.exr").unwrap();
    let after = levels(&show);
    let [right, twin] = [1, 2].map(|bank| after[bank] - before[bank]);
    assert!(
        (right - 2.0 * twin).abs() < 2e-4 && right < -0.1,
        "{right} {twin}"
    );
}

/// A lamp in view is white in a PNG, however bright it is: the picture is still of this view.
#[test]
fn a_lamp_in_view_may_be_far_brighter_than_white() {
    // It shines at the eye alone, and lights nothing in view.
    let (mut show, store) = open(&SHOW.replace(
        "fixed on = f",
        "surface globe reflectance 0 quad 0.3,-5,2 0.8,-5,2 0.8,-5,2.5 0.3,-5,2.5\n\
         light g panel globe 900000 lm\nbank lamp = g\nfixed on = f",
    ));
    show.execute(&format!("set {KNOWN} lamp full")).unwrap();
    let known = levels(&show);
    show.execute("picture -o known.png").unwrap();
    show.execute("release").unwrap();
    let file = store.read(Path::new("known.png"), 1 << 20).unwrap();
    let light = footlight_picture::decode::light(&file, 1 << 24).unwrap();
    let white = light.data().iter().filter(|value| **value >= 1.0).count();
    assert!(white > 100, "{white}");
    let said = told(&mut show, "solve known.png");
    let found = levels(&show);
    // Of the lamp the file says only that it is at least white.
    let lit = known.len() - 1;
    assert!(found[lit] > 0.0, "{said}");
    for (found, known) in found[..lit].iter().zip(&known[..lit]) {
        assert!((found - known).abs() < 1e-2, "{found} for {known}\n{said}");
    }
}

/// Other banks stay, and the solution becomes a cue.
#[test]
fn some_banks_at_a_cue_and_what_follows() {
    let (mut show, _, known) = with_pictures();
    let said = told(&mut show, "solve known.exr front --cue 2");
    assert!(
        said.contains("  left") && !said.contains("  cyc") && !said.contains("  twin"),
        "{said}"
    );
    assert_eq!(show.live().time(), Time::from_micros(7_000_000));
    assert!((levels(&show)[3] - 0.8).abs() < 1e-9);
    let said = told(&mut show, "solve known.exr");
    assert!(said.starts_with("known.exr: 0.00"), "{said}");
    assert!(off(&show, &known) < 1e-4, "{}", off(&show, &known));
    show.execute("update").unwrap();
    assert!(off(&show, &known) < 1e-4, "{}", off(&show, &known));
    assert!(told(&mut show, "solve known.exr").contains("nothing changes"));
    show.execute("undo").unwrap();
    assert!(off(&show, &known) > 0.1);
    show.execute("solve known.exr").unwrap();
    show.execute("record 3 \"As painted\"").unwrap();
    assert!(off(&show, &known) < 1e-4, "{}", off(&show, &known));
}

/// `solve` uses a moving head in its current pose, and does not move it.
#[test]
fn a_head_is_found_where_it_points() {
    let spot = "light d  spot at 0,2,4   aim 0,1,0  beam 30 field 60 900 cd";
    let head = "light d  spot at 0,-1,4  aim 0,1,0  beam 20 field 30 9000 cd  moves";
    let (mut show, _) = open(&SHOW.replace(spot, head));
    for line in [
        "goto 1",
        "set d to 2, 2, 0",
        &format!("set {KNOWN}"),
        "picture -o known.exr --float",
    ] {
        show.execute(line).unwrap();
    }
    let known = levels(&show);
    show.execute("release").unwrap();
    show.execute("set d to 2, 2, 0").unwrap();
    let said = told(&mut show, "solve known.exr");
    assert!(off(&show, &known) < 1e-4, "{}\n{said}", off(&show, &known));
    // In another pose its light differs.
    show.execute("release").unwrap();
    let said = told(&mut show, "solve known.exr");
    assert!(
        off(&show, &known) > 1e-2 && !said.starts_with("known.exr: 0.00"),
        "{said}"
    );
}

/// Light of another brightness moves an rgb bank's level, light of another hue its colour.
#[test]
fn level_and_colour_stay_where_the_other_follows() {
    let (mut show, _) = open(SHOW);
    let stands = "set cyc 40 #c04020";
    for (light, level, colour) in [("cyc 30", 0.3, None), ("cyc #c05020", 0.4, Some(0.0802))] {
        show.execute(stands).unwrap();
        let red = levels(&show)[4];
        for line in [
            &format!("set {light}"),
            "picture -o known.exr --float",
            "release",
            stands,
        ] {
            show.execute(line).unwrap();
        }
        let said = told(&mut show, "solve known.exr cyc");
        let found = levels(&show);
        let green = colour.unwrap_or(0.0513);
        for (found, wanted) in [(found[3], level), (found[4], red), (found[5], green)] {
            assert!((found - wanted).abs() < 2e-3, "{found} {wanted}: {said}");
        }
        show.execute("release").unwrap();
    }
}

/// Alpha is the weight: the white right half of the sketch is transparent.
#[test]
fn what_is_transparent_does_not_count() {
    let (mut show, store, known) = with_pictures();
    let bytes = store.read(Path::new("known.exr"), 1 << 30).unwrap();
    let light = exr::decode(&bytes, 1 << 30).unwrap();
    let tone = show.engine().document().tone_at(-4.6);
    let codes = tone.encode(&light);
    let pixel = |i: usize| match i % 160 {
        0..80 => [codes[3 * i], codes[3 * i + 1], codes[3 * i + 2], 255],
        _ => [255, 0, 255, 0],
    };
    let rgba: Vec<u8> = (0..160 * 90).flat_map(pixel).collect();
    let mut masked = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut masked, 160, 90);
    encoder.set_color(::png::ColorType::Rgba);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&rgba)
        .unwrap();
    store.write(Path::new("masked.png"), &masked).unwrap();
    let said = told(&mut show, "solve masked.png");
    assert!(off(&show, &known) < 1e-2, "{}\n{said}", off(&show, &known));
}

/// Another size is averaged down to the smaller of the two.
#[test]
fn other_sizes_are_scaled() {
    let (mut show, store, known) = with_pictures();
    let bytes = store.read(Path::new("known.exr"), 1 << 30).unwrap();
    let light = exr::decode(&bytes, 1 << 30).unwrap();
    let twice = (0..320 * 180).map(|i| light.pixel(i % 320 / 2, i / 320 / 2).unwrap());
    let twice = Image::from_data(320, 180, twice.flatten().collect()).unwrap();
    let small = footlight_picture::shrink::shrink(&light, 80, 45);
    for (name, image) in [("twice.exr", twice), ("small.exr", small)] {
        let bytes = exr::encode(&image, Precision::Float, &[]).unwrap();
        store.write(Path::new(name), &bytes).unwrap();
        let said = told(&mut show, &format!("solve {name}"));
        assert!(
            off(&show, &known) < 1e-4,
            "{name} {}\n{said}",
            off(&show, &known)
        );
        show.execute("release").unwrap();
    }
}

/// Files without a sketch of the view change nothing.
#[test]
fn what_is_no_sketch_is_refused() {
    let (mut show, store, _) = with_pictures();
    let exr_of = |data: Vec<f32>, w: usize, h: usize| {
        exr::encode(
            &Image::from_data(w, h, data).unwrap(),
            Precision::Float,
            &[],
        )
        .unwrap()
    };
    let mut not_finite = exr_of(vec![1.25; 160 * 90 * 3], 160, 90);
    let at = not_finite
        .windows(4)
        .position(|w| w == 1.25_f32.to_le_bytes())
        .unwrap();
    not_finite[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut large = png::encode(4, 4, &[9; 48]).unwrap();
    // The width and height of the header, 30,000 pixels each, and its checksum.
    large[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    let sum = crc(&large[12..29]);
    large[29..33].copy_from_slice(&sum.to_be_bytes());
    let noise = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
    let files = [
        ("empty.png", Vec::new(), "begins like none of them"),
        (
            "text.png",
            b"no picture".to_vec(),
            "begins like none of them",
        ),
        (
            "one.png",
            png::encode(1, 1, &[90; 3]).unwrap(),
            "the sketch is 1x1 and the view 160x90",
        ),
        (
            "square.png",
            png::encode(90, 90, &[90; 24300]).unwrap(),
            "90x90",
        ),
        (
            "black.exr",
            exr_of(vec![0.0; 160 * 90 * 3], 160, 90),
            "black, or transparent",
        ),
        (
            "dark.exr",
            exr_of(vec![-1.0; 160 * 90 * 3], 160, 90),
            "black, or transparent",
        ),
        ("nan.exr", not_finite, "NaN or infinite"),
        ("large.png", large, "30000 x 30000"),
        (
            "noise.png",
            png::encode(160, 90, &(0..43200).map(noise).collect::<Vec<u8>>()).unwrap(),
            "not of this view",
        ),
    ];
    let before = levels(&show);
    for (name, bytes, reason) in files {
        store.write(Path::new(name), &bytes).unwrap();
        let said = told(&mut show, &format!("solve {name} --cue 2"));
        assert!(
            said.starts_with("error") && said.contains(reason),
            "{name}: {said}"
        );
    }
    let lines = [
        ("solve side.exr", "not of this view"),
        ("solve none.png", "does not exist"),
        ("solve known.exr lef", "did you mean `left`?"),
        ("solve known.exr fixed", "there is no bank `fixed`"),
        ("solve known.exr -o known.exr", "ending"),
        ("solve", "solve lux 500 at 2,1,0"),
        ("solve lux 500", "solve lux 500 at 2,1,0"),
        ("solve lux none at 1,1,0", "solve lux 500 at 2,1,0"),
        ("solve lux 500 at 9,9,9", "9,9,9 lies outside the view"),
        (
            "solve lux 500 at 0,0,0.5 -o a.png",
            "solve lux 500 at 2,1,0",
        ),
        ("solve lux 500 at 1,2,1", "1,2,1 lies on no surface"),
        ("solve lux 500 at -4,-4,0", "lies"),
    ];
    for (line, reason) in lines {
        let said = told(&mut show, line);
        assert!(
            said.starts_with("error") && said.contains(reason),
            "{line}: {said}"
        );
    }
    assert_eq!(levels(&show), before);
    // A black display is an image of no light: everything that can goes out.
    store
        .write(
            Path::new("black.png"),
            &png::encode(160, 90, &[0; 43200]).unwrap(),
        )
        .unwrap();
    told(&mut show, "solve black.png");
    let lights = footlight_show::timeline::lights(show.engine().show(), &levels(&show));
    assert!(lights[..6].iter().all(|light| *light < 1e-3), "{lights:?}");
}

/// The checksum of a PNG's chunk.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| {
        if crc & 1 == 1 {
            0xedb8_8320 ^ (crc >> 1)
        } else {
            crc >> 1
        }
    };
    let byte = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte), step);
    !bytes.iter().fold(u32::MAX, byte)
}

/// A spot on bare ground, of 1,000 cd from 4 m above: 62.5 lux below it at full, in closed form.
/// Other light counts; a point to the left begins with a minus.
#[test]
fn an_illuminance_is_the_closed_form() {
    let text = r#"show "Ground"
surface ground reflectance 0.5 0.4 0.2 quad -9,-9,0 9,-9,0 9,9,0 -9,9,0
view house from 0,-6,5 to 0,0,0 fov 50 size 160x90
light a spot at -1,0,4 aim -1,0,0 beam 60 field 90 1000 cd
light b spot at 2,0,4 aim 2,0,0 beam 10 field 20 4000 cd
light c spot at 2,0,4 aim 2,0,0 beam 10 field 20 4000 cd #ff8000
bank left = a dimmer square
bank right = b
bank tint = c rgb
cue 1 at 0:00 { snap left 50 right 10 tint 0 }
"#;
    let (mut show, _) = open(text);
    let said = told(&mut show, "solve lux 40 at -1,0,0 left");
    assert!(
        said.contains("-1,0,0: 40.0 lux, 15.6 as it stood"),
        "{said}"
    );
    let wanted = (40.0_f64 / 62.5).sqrt();
    assert!((levels(&show)[0] - wanted).abs() < 2e-3, "{said}");
    // A picture reads it too.
    let said = told(&mut show, "picture --bank left --lux -1,0,0 --lux");
    assert!(said.contains("\n-1,0,0: 62.5 lux"), "{said}");
    let least = said.split("illuminance ").nth(1).unwrap();
    assert!(least.starts_with("0.0 to 62."), "{said}");
    for (line, reason) in [
        ("picture --lux 9,9,9", "9,9,9 lies outside the view"),
        ("picture --lux 0:01", "`0:01` is not a point"),
    ] {
        let said = told(&mut show, line);
        assert!(said.starts_with("error") && said.contains(reason), "{said}");
    }
    // More than possible: as near as it comes, from the current levels.
    show.execute("release").unwrap();
    let said = told(&mut show, "solve lux 900 at -1,0,0 left --cue 1");
    assert!(
        said.contains("62.5 lux, 15.6 as it stood; 900 is not reached: these banks are at full")
            && said.contains("trying left 100"),
        "{said}"
    );
    // Two points, and a bank that keeps its colour.
    show.execute("release").unwrap();
    show.execute("set tint 5 #4060ff").unwrap();
    let colour = levels(&show)[3..].to_vec();
    let said = told(&mut show, "solve lux 50 at -1,0,0 2,0,0");
    assert!(
        said.contains("-1,0,0: 50.0 lux") && said.contains("2,0,0: 50.0 lux"),
        "{said}"
    );
    let after = levels(&show);
    assert!(
        after[3..]
            .iter()
            .zip(&colour)
            .all(|(a, b)| (a - b).abs() < 1e-4),
        "{said}"
    );
    show.execute("haze 60m").unwrap();
    assert!(told(&mut show, "solve lux 50 at 2,0,0").contains("in haze"));
}

/// The manual's sketch is its program's output, and the page shows the program's messages.
#[test]
fn the_painted_sketch_goes_as_the_manual_says() {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join("examples/painted");
    let sketch = std::fs::read(folder.join("sketch.png")).unwrap();
    let ([width, height], codes) = footlight_picture::decode::codes(&sketch, 1 << 24).unwrap();
    assert_eq!((width, height), paint::SIZE);
    let rgb: Vec<u8> = codes.iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
    assert!(rgb == paint::paint());
    let (mut show, store) = open(&std::fs::read_to_string(folder.join("painted.lxq")).unwrap());
    store.write(Path::new("sketch.png"), &sketch).unwrap();
    let page = std::fs::read_to_string(root.join("src/manual/solve.md")).unwrap();
    let said = told(&mut show, "solve sketch.png --cue 2");
    assert!(
        page.contains(&said),
        "the manual's page `solve` has another answer than\n{said}"
    );
}

#[path = "../../examples/painted/paint.rs"]
mod paint;
