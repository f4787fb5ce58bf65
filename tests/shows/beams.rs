//! The haze show: its set and gobos are its program's output.

use std::path::{Path, PathBuf};

use crate::set;
use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_picture::{decode, png};
use footlight_show::lang;
use footlight_show::model::LightKind;

#[allow(dead_code, reason = "the program's `main` is not wanted here")]
#[path = "../../examples/beams/model.rs"]
mod model;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/beams")
}

fn file(name: &str) -> Vec<u8> {
    std::fs::read(folder().join(name)).unwrap()
}

fn show() -> Engine {
    let host = Host {
        files: Box::new(Folder::new(folder(), 1 << 24)),
        ..Host::default()
    };
    Engine::from_text("beams.lxq", &file("beams.lxq"), host).unwrap()
}

#[test]
fn the_files_are_what_the_program_makes() {
    let told = "run the example beams_model";
    let made = model::obj(&model::beams());
    assert!(file("beams.obj") == made.as_bytes(), "{told}");
    assert!(file("beams.mtl") == model::mtl().as_bytes(), "{told}");
    for (name, gobo) in model::GOBOS {
        let made = png::encode(model::SIDE, model::SIDE, &model::drawn(gobo)).unwrap();
        let read = |bytes: &[u8]| decode::light(bytes, 1 << 24).unwrap();
        let found = file(&format!("{name}.png"));
        assert!(read(&found) == read(&made), "{name}: {told}");
        assert!(found.len() < 30_000, "{name} is no small file");
    }
}

#[test]
fn the_set_can_be_drawn_and_shows_its_fronts() {
    let faces = model::beams().faces.into_iter();
    let outlines: Vec<set::VertexBuffer> = faces
        .map(|f| set::outline(f.material, f.object, &f.vertices))
        .collect();
    assert!(outlines.len() < 2500, "{}", outlines.len());
    set::is_worth_drawing(&outlines);
    set::shows_fronts(&outlines, &show().show().views[0].camera);
}

#[test]
fn it_has_haze_twelve_spots_four_heads_and_two_gobos_and_no_warning() {
    let show = show();
    assert!(show.document().diagnostics().list.is_empty());
    let text = String::from_utf8(file("beams.lxq")).unwrap();
    assert_eq!(lang::format(&text).unwrap(), text, "run fmt");
    let setup = show.document().setup().unwrap();
    assert!(setup.scene.haze.is_some() && !setup.scene.is_cut());
    assert_eq!(setup.scene.haze, show.show().haze);
    let lights = show.show().lights.iter();
    let [mut spots, mut heads, mut projections] = [0; 3];
    for light in lights {
        match &light.kind {
            LightKind::Spot(_) if light.head.is_some() => heads += 1,
            LightKind::Spot(_) => spots += 1,
            LightKind::Projection { .. } => projections += 1,
            other => unreachable!("{other:?}"),
        }
    }
    assert_eq!((spots, heads, projections), (12, 4, 2));
    let hung = show.show().banks.iter().flat_map(|b| &b.lights).count();
    assert_eq!(hung, show.show().lights.len());
}
