//! Rooms of any number of polygons, lamps and pixels, and the smallest show, for measurements.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "support of programs that measure"
)]

use crate::reference::Case;
use footlight_host::files::Folder;
use footlight_show::diagnostic::Sources;
use footlight_show::geometry::View;
use footlight_show::geometry::vec3;
use footlight_show::lang;
use footlight_show::units::Rgb;
use footlight_stage::{Emitter, Light, Material, Polygon, Rig, Scene, Source};

/// The smallest show.
pub fn first() -> Case {
    let folder = crate::reference::examples();
    let text = std::fs::read_to_string(folder.join("first.lxq")).unwrap();
    let parsed = lang::parse(&mut Sources::default(), "first.lxq", &text);
    let show = parsed.show.unwrap();
    let scene = crate::reference::scene_of(&Folder::new(folder, 1 << 24), "first.obj");
    let rig = footlight_stage::rig::rig(&show, &scene).unwrap();
    Case {
        name: "first",
        view: show.views[0].camera.clone(),
        mix: vec![0.5; rig.sources.len()],
        rig,
        scene,
    }
}

/// A closed room of about `polygons` faces: boxes of pseudo-random heights on a grid of the floor,
/// under `banks` square lamps, with this image size.
pub fn room(polygons: usize, banks: usize, (width, height): (usize, usize)) -> Case {
    let boxes = polygons.saturating_sub(6 + banks) / 5;
    let side = (boxes as f64).sqrt().ceil().max(1.0);
    let (span, tall) = (side * 1.5, 4.0);
    let walls = [vec3(0.0, 0.0, 0.0), vec3(span, span, tall)];
    let mut faces: Vec<Polygon> = Polygon::block(walls, true, 0).collect();
    let mut seed = 1_u64;
    for i in 0..boxes {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (seed >> 40) as f64 / (1_u64 << 24) as f64;
        let at = vec3(i as f64 % side, (i as f64 / side).floor(), 0.0) * 1.5 + vec3(0.3, 0.3, 0.0);
        let top = at + vec3(0.8, 0.8, 0.3 + 1.5 * share);
        faces.extend(Polygon::block([at, top], false, 0));
    }
    let row = (banks as f64).sqrt().ceil().max(1.0);
    let half = 0.15 * span / row;
    let mut materials = vec![material("wall", 0.5, 0.0)];
    for bank in 0..banks {
        let (i, j) = (bank as f64 % row, (bank as f64 / row).floor());
        let (x, y) = ((i + 0.5) * span / row, (j + 0.5) * span / row);
        let corners = [(-half, half), (half, half), (half, -half), (-half, -half)];
        faces.push(Polygon::new(
            corners
                .map(|(dx, dy)| vec3(x + dx, y + dy, tall - 0.05))
                .to_vec(),
            1 + bank,
        ));
        materials.push(material(&format!("lamp{bank}"), 0.0, 10.0));
    }
    let lights = (1..=banks).map(|material| Light::Panel {
        material,
        radiance: Rgb([10.0; 3]),
    });
    let sources = (0..banks).map(|light| Source {
        name: format!("bank{light}"),
        emitters: vec![Emitter {
            light,
            filter: Rgb::WHITE,
        }],
    });
    Case {
        name: "room",
        rig: Rig {
            lights: lights.collect(),
            sources: sources.collect(),
        },
        view: View {
            from: vec3(0.05 * span, 0.04 * span, 0.8 * tall),
            to: vec3(0.6 * span, 0.7 * span, 0.2 * tall),
            fov: 55.0,
            roll: 0.0,
            width,
            height,
        },
        mix: vec![1.0 / banks.max(1) as f64; banks],
        scene: Scene {
            materials,
            polygons: faces,
            ..Scene::default()
        },
    }
}

/// A closed room of about `polygons` faces with one more bank, the last: a hidden lamp that lights
/// the ceiling, so that the image shows only its light after two reflections.
pub fn uplit(polygons: usize, size: (usize, usize)) -> Case {
    let mut case = room(polygons, 4, size);
    let half = 1.0;
    let middle = case.view.to + vec3(0.0, 0.0, 3.0 - case.view.to.z);
    let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
    let material_at = case.scene.materials.len();
    case.scene.materials.push(material("uplight", 0.0, 10.0));
    case.scene.polygons.push(Polygon::new(
        corners.map(|(dx, dy)| middle + vec3(dx, dy, 0.0)).to_vec(),
        material_at,
    ));
    let light = case.rig.lights.len();
    case.rig.lights.push(Light::Panel {
        material: material_at,
        radiance: Rgb([10.0; 3]),
    });
    case.rig.sources.push(Source {
        name: "uplight".to_owned(),
        emitters: vec![Emitter {
            light,
            filter: Rgb::WHITE,
        }],
    });
    case.mix.push(0.2);
    case.name = "uplit";
    case
}

fn material(name: &str, reflectance: f64, emission: f64) -> Material {
    Material {
        name: name.to_owned(),
        reflectance: Rgb([reflectance; 3]),
        emission: Rgb([emission; 3]),
        texture: None,
        gloss: None,
    }
}
