//! Banks given as images: the whole loop on them, alone and with lights, and every way in which an
//! image can be unusable.

use std::path::{Path, PathBuf};

use crate::prompt;
use footlight_engine::{Ended, Goal, Host, TEXT_LIMIT};
use footlight_host::files::{Folder, Memory, MemoryStore, Store};
use footlight_picture::exr::{self, Precision};
use footlight_picture::{Image, png};
use footlight_prompt::{Error, Repl};
use footlight_show::diagnostic::Style;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// An image with a ramp over its columns, negative at the left.
fn ramp(width: usize, height: usize, scale: f32) -> Image {
    let value = |i: usize| scale * ((i / 3 % width) as f32 - 1.0) * [1.0, 0.5, 0.25][i % 3];
    Image::from_data(width, height, (0..width * height * 3).map(value).collect()).unwrap()
}

fn coded(image: &Image) -> Vec<u8> {
    exr::encode(image, Precision::Float, &[]).unwrap()
}

fn files() -> Memory {
    Memory::default()
        .with("a.exr", coded(&ramp(8, 4, 1.0)))
        .with("b.exr", coded(&ramp(8, 4, -0.25)))
        .with("wide.exr", coded(&ramp(9, 4, 1.0)))
        .with("p.png", png::encode(8, 4, &[188; 96]).unwrap())
        .with("text.exr", "no picture")
}

fn open(text: &str, files: Memory) -> Result<Repl, Error> {
    let host = Host {
        files: Box::new(files),
        store: Box::new(MemoryStore::default()),
        ..Host::default()
    };
    Ok(prompt("show.lxq", text.as_bytes(), host)?)
}

const CUES: &str = "cue 1 at 0:00 { snap  a 100  b 50 }\ncue 2 at 0:04 { a 25  b full  time 2 }\n";
const PAIR: &str = "bank a image \"a.exr\"\nbank b image \"b.exr\"\n";

#[test]
fn a_show_of_images_needs_neither_stage_nor_view_and_nothing_is_left_to_refine() {
    let mut show = open(&format!("{PAIR}{CUES}"), files()).unwrap();
    let plan = show.execute("plan").unwrap().text;
    assert!(plan.contains("nothing is left to refine"), "{plan}");
    let data = show.engine().estimate().plan(0.02.into()).unwrap();
    assert_eq!((data.used, data.predicted.len()), (0, 1));

    // One sum in full precision: rendered and from the pool the images are equal.
    let summed = show
        .engine_mut()
        .render(&[1.0, 0.5], footlight_transport::Quality(1))
        .unwrap();
    assert_eq!((summed.width(), summed.height()), (8, 4));
    for (x, a) in summed.data().iter().zip(ramp(8, 4, 1.0).data()) {
        assert_eq!(*x, a * 0.875);
    }
    let start = show.engine().document().timeline().start();
    assert_eq!(show.engine_mut().picture(start).unwrap(), summed);
    assert_eq!(
        show.engine_mut().refine(Goal::default()).unwrap().ended,
        Some(Ended::Complete)
    );
    let goal = Goal::until(1e-6);
    assert_eq!(
        show.engine_mut().refine(goal).unwrap().ended,
        Some(Ended::Complete)
    );
    assert_eq!(show.engine().estimate().predicted_error().unwrap(), 0.0);
    assert_eq!(show.engine().estimate().refined(), 0);

    // The whole loop, and a missing quality step.
    let ran = show.execute("run --keys -o out").unwrap().text;
    assert!(ran.contains("nothing left to refine"), "{ran}");
    for verb in ["check", "picture 0:05", "play", "plot", "plan"] {
        show.execute(verb).unwrap();
    }
    let fine = show.execute("picture --quality 2").unwrap_err();
    assert!(fine.to_string().contains("1 to 1"), "{fine}");
}

#[test]
fn an_image_is_kept_while_the_text_means_the_same_and_an_edit_replaces_it() {
    let mut show = open(&format!("{PAIR}{CUES}"), files()).unwrap();
    show.engine_mut().coarse().unwrap();
    let reply = show.execute("cue 2 at 0:04 { a 30  b full }").unwrap();
    assert!(reply.text.contains("replaced"), "{}", reply.text);
    assert!(show.engine().estimate().pool().is_some());
    show.execute("bank b image \"p.png\"  channel 7").unwrap();
    assert!(show.engine().estimate().pool().is_none());
    let all = show
        .engine_mut()
        .render(&[0.0, 2.0], footlight_transport::Quality(1))
        .unwrap();
    // 188/255 is half the light, to 0.3 %.
    assert!((all.data()[0] - 1.0).abs() < 6e-3, "{}", all.data()[0]);
    let told = show.execute("show").unwrap().text;
    assert!(told.contains("image \"p.png\""), "{told}");
}

#[test]
fn fixed_lights_and_rgb_banks_may_be_images() {
    let text =
        "bank a image \"a.exr\" rgb\nfixed b image \"b.exr\" level 50\ncue 1 { a #ff0000 }\n";
    let mut show = open(text, files()).unwrap();
    let setting = show.engine().document().timeline().last().to_vec();
    let found = show
        .engine_mut()
        .render(&setting, footlight_transport::Quality(1))
        .unwrap();
    for (i, (x, a)) in found.data().iter().zip(ramp(8, 4, 1.0).data()).enumerate() {
        let wanted = if i % 3 == 0 {
            a - 0.125 * a
        } else {
            -0.125 * a
        };
        assert!((x - wanted).abs() < 1e-6);
    }
}

#[test]
fn images_add_to_lights_on_a_stage() {
    let stage = "mtllib floor.mtl\nusemtl wood\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nv 2 3 -2\nv -2 3 -2\n\
                 f 1 2 3 4\nf 4 3 5 6\n";
    let lamp = "stage \"floor.obj\"\nview house from 0, -4, 2 to 0, 0, 0 fov 40 size 8x4\n\
                light lamp spot at 0, 0, 3 aim 0, 0, 0 beam 40 field 60 100 cd\n";
    let cues = "cue 1 { snap lamps 60 a 40 }\ncue 2 { lamps full time 1 }\n";
    let wood = "newmtl wood\nKd 0.5 0.4 0.3\n";
    let files = || files().with("floor.obj", stage).with("floor.mtl", wood);
    let mixed = format!("{lamp}bank lamps = lamp\nbank a image \"a.exr\"\n{cues}");
    let mut both = open(&mixed, files()).unwrap();
    let alone = format!("{lamp}bank lamps = lamp\ncue 1 {{ lamps full }}\n");
    let mut alone = open(&alone, files()).unwrap();
    for step in [1, 2] {
        let quality = footlight_transport::Quality(step);
        let found = both.engine_mut().render(&[1.5, -2.0], quality).unwrap();
        let lamp = alone.engine_mut().render(&[1.5], quality).unwrap();
        assert!(lamp.data().iter().any(|v| *v > 0.1));
        let image = ramp(8, 4, -2.0);
        for ((x, l), i) in found.data().iter().zip(lamp.data()).zip(image.data()) {
            assert!((x - (l + i)).abs() <= 1e-5 * x.abs().max(1.0));
        }
    }
    // Only the lamp has an error, so that the plan finds one refined image.
    assert!(!both.engine().estimate().is_final());
    both.engine_mut().refine(Goal::default()).unwrap();
    let forecasts: Vec<f64> = both
        .engine()
        .estimate()
        .steps()
        .iter()
        .map(|s| s.forecast)
        .collect();
    assert!(
        forecasts[0] > 0.0 && forecasts[1] < 1e-5 * forecasts[0],
        "{forecasts:?}"
    );
    both.execute("run --keys -o out").unwrap();
}

/// The message about an unusable show.
fn error(text: &str, files: Memory) -> String {
    match open(text, files) {
        Ok(_) => panic!("no error in {text}"),
        Err(error) => error.report(Style::Plain).into(),
    }
}

fn says(message: &str, words: &[&str]) {
    for word in words {
        assert!(message.contains(word), "`{word}` is missing:\n{message}");
    }
}

#[test]
fn an_image_that_cannot_be_used_is_named_with_its_place_and_a_way_out() {
    let one = |file: &str| {
        format!("view v from 0, -1, 0 to 0, 0, 0 fov 40 size 8x4\nbank x image {file}\n")
    };
    let found = error(&one("\"none.exr\""), files());
    says(&found, &["E305", "show.lxq:2", "`none.exr` does not exist"]);
    let found = error(&one("\"../a.exr\""), files());
    says(&found, &["E305", "outside", "copy the file"]);
    let found = error(&one("\"text.exr\""), files());
    says(&found, &["E305", "`text.exr`", "OpenEXR"]);
    let found = error(&one("\"a.exr\" layer \"Key\""), files());
    says(&found, &["E306", "no layer `Key`", "leave `layer` out"]);
    let found = error(&one("\"p.png\" layer \"Key\""), files());
    says(&found, &["E306", "leave `layer` out"]);
    let found = error(&one("\"wide.exr\""), files());
    says(
        &found,
        &["E307", "9x4", "the view `v` has 8x4", "show.lxq:2"],
    );
    let found = error(
        "bank x image \"a.exr\"\nbank y image \"wide.exr\"\n",
        files(),
    );
    says(
        &found,
        &[
            "E307",
            "`wide.exr` has 9x4",
            "`a.exr` has 8x4",
            "show.lxq:2",
        ],
    );

    let mut bytes = coded(&ramp(8, 4, 1.0));
    let end = bytes.len();
    bytes[end - 4..].copy_from_slice(&f32::NAN.to_le_bytes());
    let found = error(&one("\"nan.exr\""), files().with("nan.exr", bytes.clone()));
    says(&found, &["E305", "`nan.exr`", "NaN", "column 7, row 3"]);
    bytes.truncate(end - 5);
    let found = error(&one("\"cut.exr\""), files().with("cut.exr", bytes));
    says(&found, &["E305", "`cut.exr`"]);
}

#[test]
fn images_beyond_the_memory_are_refused() {
    let host = Host {
        files: Box::new(files()),
        memory: 8 * 4 * 12 * 3 - 1,
        ..Host::default()
    };
    let text = format!("{PAIR}{CUES}");
    let refused = prompt("show.lxq", text.as_bytes(), host);
    let message = Error::from(refused.unwrap_err()).report(Style::Plain);
    says(&message, &["E305", "`b.exr`", "--memory"]);
}

/// The example show with the repository's own images.
#[test]
fn the_example_runs() {
    let folder = root().join("examples/images");
    let host = Host {
        files: Box::new(Folder::new(&folder, TEXT_LIMIT)),
        store: Box::new(MemoryStore::default()),
        ..Host::default()
    };
    let text = std::fs::read(folder.join("images.lxq")).unwrap();
    let mut show = prompt("images.lxq", &text, host).unwrap();
    assert!(
        show.engine().estimate().is_final()
            && show.engine().document().diagnostics().list.is_empty()
    );
    show.execute("run --keys -o out").unwrap();
}

/// A multi-layer file from a renderer: eight light groups of the reference stage by Blender's
/// Cycles. Its groups add up to its image of all lights.
#[test]
fn light_groups_of_a_renderer_add_up_to_its_picture() {
    let path = root().join("../shared/refs/blender_lightgroups.exr");
    if !path.exists() {
        eprintln!("skipped: there is no blender_lightgroups.exr beside the repository");
        return;
    }
    let folder = path.parent().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let layers = exr::layer::names(&bytes).unwrap();
    let groups: Vec<&String> = layers.iter().filter(|l| l.contains("Combined_")).collect();
    assert_eq!(groups.len(), 8, "{layers:?}");
    let mut text = String::new();
    for (i, group) in groups.iter().enumerate() {
        text += &format!("bank b{i} image \"blender_lightgroups.exr\" layer \"{group}\"\n");
    }
    text += "cue 1 { snap b0 full }\n";
    let host = |folder: &Path| Host {
        files: Box::new(Folder::new(folder, TEXT_LIMIT)),
        store: Box::new(MemoryStore::default()) as Box<dyn Store>,
        ..Host::default()
    };
    let wrong = text.replacen("Combined_ds_l_cool", "Combined_ds_l_cold", 1);
    let error = prompt("s.lxq", wrong.as_bytes(), host(folder)).unwrap_err();
    let said = Error::from(error).report(Style::Plain);
    says(
        &said,
        &[
            "E306",
            "did you mean `layer \"ViewLayer.Combined_ds_l_cool\"`?",
        ],
    );

    let mut show = prompt("s.lxq", text.as_bytes(), host(folder)).unwrap();
    let sum = show
        .engine_mut()
        .render(&[1.0; 8], footlight_transport::Quality(1))
        .unwrap();
    let all = exr::layer::decode(&bytes, &[Some("ViewLayer.Combined")], 1 << 30).unwrap();
    let all = all[0].as_ref().unwrap();
    let square = |v: f64| v * v;
    let pairs = || sum.data().iter().zip(all.data());
    let off: f64 = pairs().map(|(a, b)| square(f64::from(a - b))).sum();
    let whole: f64 = all.data().iter().map(|b| square(f64::from(*b))).sum();
    let relative = (off / whole).sqrt();
    println!("eight groups against the picture of all: {relative:.2e}");
    assert!(relative < 1e-6, "{relative}");
}
