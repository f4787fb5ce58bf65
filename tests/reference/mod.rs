//! The reference scenes of `examples/reference`, and the common measure of error.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "test support, used by several test programs"
)]

pub mod difference;

use difference::{Reference, difference};
use footlight_engine::measure::meter::away_from;
use footlight_host::files::Folder;
use footlight_host::work::{Silent, Work};
use footlight_picture::{Image, exr};
use footlight_show::diagnostic::Sources;
use footlight_show::geometry::View;
use footlight_show::geometry::vec3;
use footlight_show::lang;
use footlight_show::units::Rgb;
use footlight_stage::stage_file::Options;
use footlight_stage::{Emitter, Light, Rig, Scene, Source, import};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::surfaces::emitter_mask;
use footlight_transport::{Quality, Setup, Transport};
use std::path::{Path, PathBuf};

/// A scene with one source for each of its banks.
pub struct Case {
    pub name: &'static str,
    pub scene: Scene,
    pub rig: Rig,
    pub view: View,
    /// Settings of the mixed image.
    pub mix: Vec<f64>,
}

impl Case {
    /// Its setup for a renderer.
    pub fn setup(&self) -> Setup {
        Setup::new(self.scene.clone(), self.rig.clone(), self.view.clone())
    }
}

/// A stage as a show takes it in.
pub fn scene_of(files: &Folder, name: &str) -> Scene {
    let import = import::read(files, name, &Options::default(), usize::MAX);
    import.unwrap().scene
}

/// The folder of the examples, found from the package of the studies in it.
pub fn examples() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut places = package.ancestors().map(|root| root.join("examples"));
    places.find(|place| place.is_dir()).unwrap()
}

fn folder(name: &str) -> PathBuf {
    examples().join("reference").join(name)
}

/// Reads an image of a scene.
pub fn picture(scene: &str, file: &str) -> Image {
    exr::decode(&std::fs::read(folder(scene).join(file)).unwrap(), 1 << 28).unwrap()
}

fn case(
    name: &'static str,
    banks: &[&str],
    mix: &[f64],
    eye: [[f64; 3]; 2],
    lens: (f64, usize, usize),
) -> Case {
    let scene = scene_of(&Folder::new(folder(name), 1 << 20), "scene.obj");
    let lights = banks.iter().map(|b| {
        let material = scene.materials.iter().position(|m| m.name == *b).unwrap();
        Light::Panel {
            material,
            radiance: scene.materials[material].emission,
        }
    });
    let sources = banks.iter().enumerate().map(|(light, name)| Source {
        name: (*name).to_owned(),
        emitters: vec![Emitter {
            light,
            filter: Rgb::WHITE,
        }],
    });
    let [from, to] = eye.map(|[x, y, z]| vec3(x, y, z).y_up_to_z_up());
    let (fov, width, height) = lens;
    Case {
        name,
        rig: Rig {
            lights: lights.collect(),
            sources: sources.collect(),
        },
        scene,
        view: View {
            from,
            to,
            fov,
            roll: 0.0,
            width,
            height,
        },
        mix: mix.to_vec(),
    }
}

pub fn furnace() -> Case {
    let walls = [
        "wall_xneg",
        "wall_xpos",
        "wall_yneg",
        "wall_ypos",
        "wall_zneg",
        "wall_zpos",
    ];
    let eye = [[0.3, 0.1, 0.85], [-0.1, -0.05, -1.0]];
    case("furnace", &walls, &[1.0; 6], eye, (75.0, 128, 128))
}

pub fn cornell() -> Case {
    let banks = ["bank_ceiling", "bank_wall", "bank_floor"];
    let eye = [[2.78, 2.73, -8.0], [2.78, 2.73, 0.0]];
    case(
        "cornell",
        &banks,
        &[0.35, 1.25, 0.6],
        eye,
        (39.3077, 256, 256),
    )
}

pub fn stage() -> Case {
    let banks = [
        "bank_ds_l_warm",
        "bank_ds_r_warm",
        "bank_us_l_warm",
        "bank_us_r_warm",
        "bank_ds_l_cool",
        "bank_ds_r_cool",
        "bank_us_l_cool",
        "bank_us_r_cool",
    ];
    let mix = [0.8, 0.15, 0.35, 1.2, 0.05, 0.6, 0.25, 0.95];
    let eye = [[0.0, 1.9, 13.5], [0.0, 2.15, 0.0]];
    case("stage", &banks, &mix, eye, (25.0, 320, 180))
}

/// The example show, with a source for each coordinate of its settings; there is no reference
/// image.
pub fn tavern() -> Case {
    let folder = examples().join("tavern");
    let text = std::fs::read_to_string(folder.join("tavern.lxq")).unwrap();
    let show = lang::parse(&mut Sources::default(), "tavern.lxq", &text)
        .show
        .unwrap();
    let files = Folder::new(folder, 1 << 24);
    let scene = scene_of(&files, "tavern.obj");
    let rig = footlight_stage::rig::rig(&show, &scene).unwrap();
    Case {
        name: "tavern",
        view: show.views[0].camera.clone(),
        mix: vec![0.3; rig.sources.len()],
        rig,
        scene,
    }
}

/// Renders images of a case.
pub fn render(case: &Case, quality: u8, settings: &[Vec<f64>], threads: usize) -> Vec<Image> {
    let work = Work {
        progress: &Silent,
        threads,
        memory: 4 << 30,
    };
    let mut g = Radiosity
        .prepare(&case.setup(), Quality(quality), work)
        .unwrap();
    g.render(settings, work).unwrap()
}

/// Pixels that the measure counts: on cornell those without an emitter in their 3 x 3
/// neighbourhood, because emitters are far brighter than anything lit.
pub fn counted(case: &Case, reference: &Image) -> Vec<bool> {
    if case.name != "cornell" {
        return vec![true; reference.width() * reference.height()];
    }
    let seen = emitter_mask::emitters(&case.setup(), Work::silent()).unwrap();
    away_from(&seen, case.view.width, 1)
}

/// Relative root mean square error against the mean of two halves, and its estimate free of their
/// noise (negative when below the resolution of the halves).
pub fn errors(x: &Image, halves: [&Image; 2], counted: &[bool]) -> (f64, f64) {
    let [a, b] = halves.map(Image::clone);
    let reference = Reference::of_halves(a, b).unwrap();
    let found = difference(x, &reference, Some(counted)).unwrap();
    let fair = found.noise_free_square.unwrap();
    (found.rmse, fair.abs().sqrt().copysign(fair))
}
