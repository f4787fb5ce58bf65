//! A show on a glTF stage, from the file to the image.

use std::path::Path;

use footlight_engine::{Engine, Error, Host};
use footlight_host::files::{Folder, Memory};
use footlight_prompt::{Console, Repl};
use footlight_show::diagnostic::Style;
use footlight_stage::import::read;
use footlight_stage::stage_file::Options;

#[path = "../../examples/hall/model.rs"]
mod model;

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/hall")
}

fn show() -> String {
    std::fs::read_to_string(folder().join("hall.lxq")).unwrap()
}

fn open(text: &str) -> Result<Repl, Error> {
    let files = Memory::default().with("hall.gltf", model::gltf());
    let host = Host {
        files: Box::new(files),
        ..Host::default()
    };
    let engine = Engine::from_text("hall.lxq", text.as_bytes(), host)?;
    Ok(Repl::new(engine, Console::default()))
}

#[test]
fn the_file_is_what_its_program_writes() {
    let file = std::fs::read_to_string(folder().join("hall.gltf")).unwrap();
    assert!(
        file == model::gltf(),
        "run `cargo run -p footlight-studies --bin hall_model`"
    );
}

/// 126 triangles are 16 quads and a back.
#[test]
fn cut_surfaces_are_whole_again() {
    let files = Folder::new(folder(), 1 << 20);
    let import = read(&files, "hall.gltf", &Options::default(), usize::MAX).unwrap();
    let summary = &import.summary;
    let quads = import
        .scene
        .polygons
        .iter()
        .filter(|p| p.vertices.len() == 4)
        .count();
    assert_eq!(quads, import.scene.polygons.len());
    // Floor, three walls, the pane, twice five sides of a table, the cloth and its back.
    assert_eq!(
        (
            import.scene.polygons.len(),
            summary.merged_to,
            summary.backs
        ),
        (17, 16, 1)
    );
    assert_eq!(summary.merged, summary.faces);
}

/// Every light of the file lights the hall. (The window lights everything in front of its wall:
/// a third to a half of the image.)
#[test]
fn every_light_lights_the_hall() {
    let mut repl = open(&show()).unwrap();
    for bank in ["front", "bulbs", "window"] {
        let line = format!("picture --bank {bank} --quality 1");
        let picture = repl.execute(&line).unwrap().picture.unwrap();
        let bright = |p: &&[u8]| p.iter().any(|c| *c > 8);
        let lit = picture.rgb.chunks(3).filter(bright).count();
        assert!(lit * 4 > picture.rgb.len() / 3, "{bank}: {lit}");
    }
}

/// From upstage the cloth's back is visible: red in the window's light, black if the show reads
/// fronts only.
#[test]
fn the_back_of_the_cloth_is_seen() {
    let upstage = show().replace(
        "view stalls  from 0, -1, 1.7  to 0, 4, 1.5",
        "view upstage  from 0, 5.5, 1.2  to 0, 4, 1",
    );
    let centre = |text: &str| {
        let mut repl = open(text).unwrap();
        let shown = repl
            .execute("picture --bank window --quality 1 --exposure -2")
            .unwrap()
            .picture
            .unwrap();
        let (width, height) = shown.size;
        let at = 3 * (height / 2 * width + width / 2);
        [shown.rgb[at], shown.rgb[at + 1], shown.rgb[at + 2]]
    };
    let [red, green, _] = centre(&upstage);
    // The file's cloth reflects 7.5 times as much red as green, its window has 0.7 of the red.
    let light = |coded: u8| (f64::from(coded) / 255.0).powf(2.2);
    assert!(light(red) > 3.0 * light(green), "{red} {green}");
    assert_eq!(
        centre(&upstage.replace("\"hall.gltf\"", "\"hall.gltf\" one-sided")),
        [0; 3]
    );
}

fn refused(text: &str) -> String {
    match open(text).unwrap_err() {
        Error::Show(diagnostics) => diagnostics.render(Style::Plain).into(),
        other => other.to_string(),
    }
}

#[test]
fn lights_that_are_not_there_are_told() {
    let wrong = show().replace("from \"Key\"", "from \"Kay\"");
    let said = refused(&wrong);
    assert!(
        said.contains("E311") && said.contains("did you mean `Key`?"),
        "{said}"
    );
    let narrow = show().replace("from \"Key\"", "from \"Key\"  field 5");
    let said = refused(&narrow);
    assert!(
        said.contains("E312") && said.contains("not wider than its beam"),
        "{said}"
    );
}
