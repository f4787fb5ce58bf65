//! The second show: its set and slides are their program's output, and its effects are visible.

use std::path::{Path, PathBuf};

use crate::set;
use footlight_engine::plan::{Plan, Weighting};
use footlight_engine::{Engine, Host};
use footlight_host::files::Folder;
use footlight_picture::{Image, decode, png};
use footlight_show::lang;
use footlight_show::model::LightKind;
use footlight_show::units::Time;
use footlight_transport::Quality;

#[allow(dead_code, reason = "the program's `main` is not wanted here")]
#[path = "../../examples/turandot/model.rs"]
mod model;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/turandot")
}

fn beside_the_show(name: &str) -> Vec<u8> {
    std::fs::read(folder().join(name)).unwrap()
}

/// The show with images of this size.
fn show(size: &str) -> Engine {
    let text = String::from_utf8(beside_the_show("turandot.lxq")).unwrap();
    assert!(text.contains("size 640x360"));
    let text = text.replace("640x360", size);
    let host = Host {
        files: Box::new(Folder::new(folder(), 1 << 24)),
        threads: 2,
        ..Host::default()
    };
    Engine::from_text("turandot.lxq", text.as_bytes(), host).unwrap()
}

fn outlines() -> Vec<set::VertexBuffer> {
    let faces = model::turandot().faces.into_iter();
    faces
        .map(|f| set::outline(f.material, f.object, &f.vertices))
        .collect()
}

#[test]
fn the_files_are_what_the_program_makes() {
    let told = "run the example turandot_model";
    let made = model::obj(&model::turandot());
    assert!(beside_the_show("turandot.obj") == made.as_bytes(), "{told}");
    assert!(
        beside_the_show("turandot.mtl") == model::mtl().as_bytes(),
        "{told}"
    );
    let painted = model::PAINTERS.iter().map(|(n, p)| (*n, model::paint(*p)));
    set::has_its_images(&folder(), model::SIDE, painted);
    for (name, slide) in [("dusk.png", model::dusk()), ("night.png", model::night())] {
        // Compare pixels, because compression depends on the encoder.
        let made = png::encode(model::WIDTH, model::HEIGHT, &slide).unwrap();
        let read = |bytes: &[u8]| decode::light(bytes, 1 << 24).unwrap();
        assert!(
            read(&beside_the_show(name)) == read(&made),
            "{name}: {told}"
        );
        assert!(
            beside_the_show(name).len() < 200_000,
            "{name} is no small file"
        );
    }
}

#[test]
#[ignore = "slow"]
fn the_set_can_be_drawn_and_shows_its_fronts() {
    let outlines = outlines();
    assert_eq!(outlines.len(), 1818);
    set::is_worth_drawing(&outlines);
    set::shows_fronts(&outlines, &show("640x360").show().views[0].camera);
}

#[test]
fn the_text_is_canonical_and_every_light_has_its_bank() {
    let show = show("640x360");
    assert!(show.document().diagnostics().list.is_empty());
    let text = String::from_utf8(beside_the_show("turandot.lxq")).unwrap();
    assert_eq!(lang::format(&text).unwrap(), text, "run fmt");
    let names: Vec<&str> = model::MATERIALS.iter().map(|m| m.name).collect();
    for light in &show.show().lights {
        if let LightKind::Panel { material, .. } = &light.kind {
            assert!(names.contains(&material.as_str()), "{material}");
        }
    }
    let hung = show.show().banks.iter().flat_map(|b| &b.lights).count();
    let fixed = show.show().fixed.iter().flat_map(|f| &f.lights).count();
    assert_eq!(hung + fixed, show.show().lights.len());
}

/// The paper has 17 keys and 8 basis images for 1 %. This plot moves more at once.
#[test]
fn keys_and_rank_are_those_that_are_told() {
    let show = show("640x360");
    let keys = show.document().keys();
    assert_eq!((keys.keys().len(), keys.segments().len()), (143, 71));
    let plan = Plan::new(keys, &Weighting::settings(keys.coordinates()), 0.0).unwrap();
    // 22 coordinates of banks and one of the fixed light: groups move together.
    assert_eq!((keys.coordinates(), plan.rank()), (23, 18));
    // A straight fade is linear, one through a square dimmer quadratic, one on a curve cubic.
    let degree = |seconds: f64| {
        let (segment, _) = keys.segment_at(Time::nearest(seconds));
        keys.segments()[segment].degree
    };
    let degrees = [1.0, 5.0, 39.5, 20.0].map(degree);
    assert_eq!(degrees, [0, 1, 2, 3]);
}

fn mean(image: &Image, rows: std::ops::Range<usize>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pixel in rows
        .clone()
        .flat_map(|y| (0..image.width()).map(move |x| (x, y)))
    {
        let at = (pixel.1 * image.width() + pixel.0) * 3;
        for (sum, value) in sum.iter_mut().zip(&image.data()[at..at + 3]) {
            *sum += f64::from(*value);
        }
    }
    sum
}

/// The purpose of the two projections and the green special, as light in the image.
#[test]
#[ignore = "slow"]
fn the_sky_turns_from_orange_to_blue_and_the_figure_is_green() {
    let mut show = show("96x54");
    let sky = |image: &Image| mean(image, 0..9);
    let at = |show: &mut Engine, seconds: f64| {
        show.picture(Time::from_seconds(seconds).unwrap()).unwrap()
    };
    let [red, _, blue] = sky(&at(&mut show, 10.0));
    assert!(red > 1.3 * blue, "at sunset {red} red, {blue} blue");
    let [red, _, blue] = sky(&at(&mut show, 78.0));
    assert!(blue > 4.0 * red, "at night {blue} blue, {red} red");

    let (before, after) = (at(&mut show, 82.9), at(&mut show, 90.0));
    // The green light changes the image most at the figure, in its middle.
    let gain = |i: usize| after.data()[3 * i + 1] - before.data()[3 * i + 1];
    let most = (0..96 * 54)
        .max_by(|a, b| gain(*a).total_cmp(&gain(*b)))
        .unwrap();
    assert!(
        (46..50).contains(&(most % 96)) && (30..40).contains(&(most / 96)),
        "{most}"
    );
    let [red, green, blue] = [0, 1, 2].map(|c| after.data()[3 * most + c]);
    assert!(green > 2.0 * red && green > blue, "{red} {green} {blue}");
}

/// A projected slide, a panel, lights of both signs: the sum of the images is the image of the sum.
#[test]
#[ignore = "slow"]
fn pictures_of_this_show_add_up() {
    let mut show = show("48x27");
    let n = show.document().keys().coordinates();
    let name = |name: &str| {
        let coordinates = show.show().coordinates();
        coordinates.iter().position(|c| c.name == name).unwrap()
    };
    let terms: [(usize, f64); 5] = [
        (name("dusk"), 0.7),
        (name("night"), -0.4),
        (name("red_l"), 1.0),
        (name("jade"), -0.8),
        (name("moon"), 0.5),
    ];
    let mut mix = vec![0.0; n];
    let mut sum = vec![0.0; 48 * 27 * 3];
    let mut most = 0.0;
    for (source, level) in terms {
        mix[source] = level;
        let mut unit = vec![0.0; n];
        unit[source] = 1.0;
        let alone = show.render(&unit, Quality(1)).unwrap();
        let peak = alone.data().iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        most += level.abs() * f64::from(peak);
        for (sum, value) in sum.iter_mut().zip(alone.data()) {
            *sum += level * f64::from(*value);
        }
    }
    let together = show.render(&mix, Quality(1)).unwrap();
    let off = together.data().iter().zip(&sum);
    let off = off
        .map(|(a, b)| (f64::from(*a) - b).abs())
        .fold(0.0, f64::max);
    assert!(off <= 1e-6 * most, "{} of the largest", off / most);
}
