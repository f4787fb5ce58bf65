//! Addresses distinguish images by their whole content, and by nothing else.

#![allow(clippy::indexing_slicing, reason = "a test's own data")]

use super::*;
use footlight_show::geometry::vec3;
use footlight_show::model::Haze;

fn spot(x: f64) -> Light {
    Light::Spot(Spot {
        position: vec3(x, 0.0, 4.0),
        aim: Vec3::ZERO,
        beam: 20.0,
        field: 40.0,
        intensity: Rgb([900.0, 600.0, 300.0]),
    })
}

fn rig(lights: Vec<Light>, banks: &[&[usize]]) -> Rig {
    let emitter = |light: &usize| Emitter {
        light: *light,
        filter: Rgb::WHITE,
    };
    let source = |lights: &&[usize]| Source {
        name: format!("{lights:?}"),
        emitters: lights.iter().map(emitter).collect(),
    };
    let sources = banks.iter().map(source).collect();
    Rig { lights, sources }
}

fn view() -> View {
    View {
        from: vec3(0.0, -9.0, 1.7),
        to: Vec3::ZERO,
        fov: 40.0,
        roll: 0.0,
        width: 64,
        height: 36,
    }
}

#[test]
fn only_what_is_lit_matters() {
    let scene_key = SceneKey::new("g 1", &Scene::default(), &view());
    let at = |rig: &Rig, setting: &[f64]| {
        let lights = Lights::new(rig);
        lights.address(scene_key, Quality(2), setting).key
    };
    let before = rig(vec![spot(0.0), spot(1.0)], &[&[0], &[1]]);
    let moved = rig(vec![spot(0.0), spot(1.5)], &[&[0], &[1]]);
    assert_eq!(at(&before, &[1.0, 0.0]), at(&moved, &[1.0, 0.0]));
    assert_ne!(at(&before, &[0.0, 1.0]), at(&moved, &[0.0, 1.0]));
    assert_ne!(at(&before, &[1.0, 0.0]), at(&before, &[0.5, 0.0]));
    // Other banks with equal light; other names with a dark light in between.
    let grouped = rig(vec![spot(0.0), spot(9.0), spot(1.0)], &[&[0, 2], &[1]]);
    assert_eq!(at(&before, &[0.5, 0.5]), at(&grouped, &[0.5, 0.0]));
}

#[test]
fn operator_scene_view_and_quality_are_part_of_it() {
    let scene = Scene::default();
    let one = SceneKey::new("g 1", &scene, &view());
    assert_eq!(one, SceneKey::new("g 1", &scene, &view()));
    assert_ne!(one, SceneKey::new("g 2", &scene, &view()));
    let wider = View {
        width: 65,
        ..view()
    };
    assert_ne!(one, SceneKey::new("g 1", &scene, &wider));
    let mut red = Scene::default();
    red.materials.push(Material {
        name: "red".to_owned(),
        reflectance: Rgb([0.5, 0.0, 0.0]),
        emission: Rgb::default(),
        texture: None,
        gloss: None,
    });
    let other = SceneKey::new("g 1", &red, &view());
    red.materials[0].reflectance = Rgb([0.6, 0.0, 0.0]);
    assert_ne!(other, SceneKey::new("g 1", &red, &view()));
    let hazy = |extinction, forward, albedo| {
        let haze = Some(Haze {
            extinction,
            forward,
            albedo,
        });
        let scene = Scene {
            haze,
            ..Scene::default()
        };
        SceneKey::new("g 1", &scene, &view())
    };
    let haze = hazy(0.05, 0.5, 0.9);
    let others = [
        hazy(0.06, 0.5, 0.9),
        hazy(0.05, 0.6, 0.9),
        hazy(0.05, 0.5, 1.0),
        one,
    ];
    assert!(!others.contains(&haze) && haze == hazy(0.05, 0.5, 0.9));
    let lights = Lights::new(&rig(vec![spot(0.0)], &[&[0]]));
    let at = |quality| lights.address(one, Quality(quality), &[1.0]).key;
    assert_ne!(at(1), at(2));
}

/// Address of a luminaire measured in one plane from straight down to this angle.
fn measured(degrees: &str, candela: &str, lumens: &str) -> Digest {
    let file = format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 {lumens} 1 2 1 1 2 0 0 0\n1 1 10\n0 {degrees}\n0\n\
         {candela}\n"
    );
    let light = Light::Measured(MeasuredLight {
        mount: Mount {
            position: vec3(0.0, 0.0, 4.0),
            aim: Vec3::ZERO,
            turn: 0.0,
        },
        distribution: Distribution::parse(file.as_bytes()).unwrap().into(),
        factor: Rgb::WHITE,
    });
    apart(&light).0
}

#[test]
fn every_number_of_a_measured_light_is_part_of_it() {
    let one = measured("90", "1000 0", "1200");
    assert_eq!(one, measured("90", "1000 0", "1200"));
    for other in [
        measured("80", "1000 0", "1200"),
        measured("90", "1000 0.5", "1200"),
        measured("90", "1000 0", "1300"),
        measured("90", "1000 0", "-1"),
    ] {
        assert_ne!(one, other);
    }
}

/// Addresses must not change by accident, because stores would silently become useless. The
/// expected digests were computed from the documented bytes by another program.
#[test]
fn addresses_are_stable() {
    let mut hasher = Hasher::new("test");
    hasher.text("a");
    hasher.number(0.1);
    hasher.count(3);
    let digest = hasher.finish();
    assert_eq!(Digest::parse(&digest.to_string()), Some(digest));
    assert_eq!(digest.to_string(), "43473119d1d0af171dfdfe77ff3fc031");
    let light = measured("90", "1000 0", "1200");
    assert_eq!(light.to_string(), "4c854d687d60c21ea92438d237e9f1c3");
    // A real scene key includes the package's version, which may change.
    let scene_key = SceneKey(digest);
    let lights = Lights::new(&rig(vec![spot(0.0), spot(1.0)], &[&[0], &[1]]));
    let address = lights.address(scene_key, Quality(2), &[1.0, 0.5]);
    assert_eq!(address.key.to_string(), "9cf409d044ea68cf163567aa0008beba");
}
