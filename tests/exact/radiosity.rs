//! G against closed forms and reference images.

use crate::reference::{Case, cornell, counted, errors, furnace, picture, render, stage};
use crate::superposition::stage_with_spot;
use footlight_host::files::Memory;
use footlight_picture::png;
use footlight_show::geometry::View;
use footlight_show::geometry::profile::Profile;
use footlight_show::geometry::vec3;
use footlight_show::model::Spot;
use footlight_show::units::Rgb;
use footlight_stage::import;
use footlight_stage::stage_file::Options;
use footlight_stage::texture::{Alpha, Texture};
use footlight_stage::{Emitter, Light, Material, Polygon, Scene};
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Quality, Transport};

/// Where every wall emits and reflects equally, radiosity is uniform. The remaining error is
/// interpolation of direct light. Each reflectance uses one step: direct light matters most at low
/// reflectance, the solver at high. `cheap_steps_are_off_by_what_they_interpolate` tests the finest
/// step.
#[test]
#[ignore = "slow"]
fn the_furnace_is_even_at_every_step_and_reflectance() {
    for (rho, quality) in [(0.5, 1), (0.9, 1), (0.99, 2), (0.999, 1)] {
        let mut case = furnace();
        (case.view.width, case.view.height) = (64, 64);
        for material in &mut case.scene.materials {
            material.reflectance = Rgb([rho; 3]);
        }
        let exact = 1.0 / (1.0 - rho);
        let image = &render(&case, quality, &[vec![1.0; 6]], 2)[0];
        let off = |v: &f32| (f64::from(*v) / exact - 1.0).abs();
        let worst = image.data().iter().map(off).fold(0.0, f64::max);
        let square: f64 = image.data().iter().map(|v| off(v).powi(2)).sum();
        let mean = (square / image.data().len() as f64).sqrt();
        let told = format!("{rho} at quality {quality}: {mean} worst {worst}");
        assert!(mean < 1e-3 && worst < 5e-3, "{told}");
    }
}

/// An unused cut-out material changes neither the method nor a bit of the image; a used one selects
/// ray tracing.
#[test]
fn a_cut_out_material_counts_where_it_is_used() {
    let case = stage_with_spot([40, 24]);
    let with_gauze = || {
        let mut case = stage_with_spot([40, 24]);
        let gauze = Texture::plain([0.5, 0.5, 0.5, 0.3], Alpha::Blend);
        case.scene.materials.push(Material {
            texture: Some(gauze),
            ..Material::diffuse("gauze", Rgb([0.5; 3]))
        });
        case
    };
    let (unused, mut used) = (with_gauze(), with_gauze());
    used.scene.polygons[0].material = used.scene.materials.len() - 1;
    assert!(!unused.scene.is_cut() && used.scene.is_cut());
    let picture = |case: &Case| {
        let levels = vec![1.0; case.rig.sources.len()];
        render(case, 1, &[levels], 2).remove(0).data().to_vec()
    };
    assert_eq!(picture(&case), picture(&unused));
    let cost = |case: &Case| Radiosity.cost(&case.setup(), Quality(1));
    assert_eq!(cost(&case), cost(&unused));
    assert_ne!(cost(&case), cost(&used));
}

/// Two lights on one material are one light at two strengths.
#[test]
fn panels_of_one_material_shine_alike() {
    let mut case = stage_with_spot([40, 24]);
    let Light::Panel { material, radiance } = case.rig.lights[0] else {
        unreachable!("the stage is lit by panels")
    };
    case.rig.lights.push(Light::Panel {
        material,
        radiance: Rgb(radiance.0.map(|c| c * 0.5)),
    });
    let light = case.rig.lights.len() - 1;
    let filter = Rgb::WHITE;
    case.rig.sources[2].emitters = vec![Emitter { light, filter }];
    let n = case.rig.sources.len();
    let setting = |on: &[usize]| -> Vec<f64> {
        let level = |i| f64::from(u8::from(on.contains(&i)));
        (0..n).map(level).collect()
    };
    let settings = [setting(&[0]), setting(&[2]), setting(&[0, 2])];
    let [one, half, both] = &render(&case, 1, &settings, 2)[..] else {
        unreachable!("three settings are three pictures")
    };
    assert!(one.data().iter().any(|v| *v > 0.0));
    for ((one, half), both) in one.data().iter().zip(half.data()).zip(both.data()) {
        assert_eq!(*half, one * 0.5);
        assert!(
            (both - one * 1.5).abs() <= 1e-6 * one,
            "{both} for 1.5 times {one}"
        );
    }
}

#[test]
fn a_spot_on_a_plain_floor_follows_square_and_cosine() {
    let floor = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    let spot = Spot {
        position: vec3(0.0, 0.0, 3.0),
        aim: vec3(0.0, 0.0, 0.0),
        beam: 170.0,
        field: 179.0,
        intensity: Rgb([1000.0; 3]),
    };
    let mut case = stage();
    case.scene = Scene {
        materials: vec![Material::diffuse("floor", Rgb([0.5; 3]))],
        polygons: vec![Polygon::new(
            floor.iter().map(|&(x, y)| vec3(x, y, 0.0)).collect(),
            0,
        )],
        ..Scene::default()
    };
    case.rig.lights = vec![Light::Spot(spot.clone())];
    case.rig.sources.truncate(1);
    // Straight down on the floor: pixel (x, y) shows the floor there.
    case.view = View {
        from: vec3(0.0, 0.0, 2.0),
        to: vec3(0.0, 0.0, 0.0),
        fov: 90.0,
        roll: 0.0,
        width: 4,
        height: 4,
    };
    let image = &render(&case, 1, &[vec![1.0]], 1)[0];
    let beam = Profile::new(spot.beam, spot.field).unwrap();
    for y in 0..4 {
        for x in 0..4 {
            let lux = |px: f64, py: f64| {
                let square = px * px + py * py + 9.0;
                let angle = px.hypot(py).atan2(3.0);
                1000.0 * beam.share(angle) * (3.0 / square.sqrt()) / square
            };
            // A pixel is a square metre: it shows the mean of many points.
            let n = 200;
            let place = |at: i32, k: i32| f64::from(at) - 2.0 + (f64::from(k) + 0.5) / f64::from(n);
            let points = (0..n * n).map(|k| lux(place(x, k % n), place(y, k / n)));
            let mean = points.sum::<f64>() / f64::from(n * n);
            let expected = mean * 0.5 / std::f64::consts::PI;
            let got = f64::from(image.pixel(x as usize, y as usize).unwrap()[0]);
            assert!(
                (got / expected - 1.0).abs() < 1e-5,
                "{x} {y}: {got} {expected}"
            );
        }
    }
}

#[test]
#[ignore = "slow"]
fn cornell_and_stage_meet_their_references_better_with_quality() {
    for (case, most) in [
        (cornell(), [0.016, 0.014, 0.012]),
        (stage(), [0.015, 0.012, 0.008]),
    ] {
        let halves = ["mix_A.exr", "mix_B.exr"].map(|f| picture(case.name, f));
        let counted = counted(&case, &halves[0]);
        let mut last = f64::INFINITY;
        for (quality, most) in (1..).zip(most) {
            let image = &render(&case, quality, std::slice::from_ref(&case.mix), 2)[0];
            let (plain, fair) = errors(image, [&halves[0], &halves[1]], &counted);
            assert!(
                plain < most,
                "{} at quality {quality}: {plain} ({fair})",
                case.name
            );
            assert!(
                fair < last,
                "{} at quality {quality}: {fair} after {last}",
                case.name
            );
            last = fair;
        }
    }
}

/// A floor with a half-black texture lights its walls like a floor of two materials.
#[test]
fn a_texture_reflects_by_its_mean_over_each_element() {
    let points = [
        [-3, -3, 0],
        [3, -3, 0],
        [3, 3, 0],
        [-3, 3, 0],
        [-3, 3, 3],
        [3, 3, 3],
        [-3, -3, 3],
        [3, -3, 3],
        [0, -3, 0],
        [0, 3, 0],
    ];
    let points = points.map(|[x, y, z]| format!("v {x} {z} {}\n", -y));
    let walls = "usemtl wall\nf 4 3 6 5\nf 3 2 8 6\nf 1 4 5 7\n";
    let painted = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl painted\nf 1/1 2/2 3/3 4/4\n";
    let plain = "usemtl black\nf 1 9 10 4\nusemtl white\nf 9 2 3 10\n";
    let materials = "newmtl painted\nKd 0.8 0.8 0.8\nmap_Kd floor.png\nnewmtl black\nKd 0 0 0\n\
                     newmtl white\nKd 0.8 0.8 0.8\nnewmtl wall\nKd 0.5 0.5 0.5\n";
    let texels: Vec<u8> = (0..64 * 64 * 3)
        .map(|i| if i / 3 % 64 < 32 { 0 } else { 255 })
        .collect();
    let lit = |floor: &str| {
        let text = format!("mtllib m.mtl\n{}{walls}{floor}", points.concat());
        let files = Memory::default()
            .with("a.obj", text)
            .with("m.mtl", materials)
            .with("floor.png", png::encode(64, 64, &texels).unwrap());
        let import = import::read(&files, "a.obj", &Options::default(), usize::MAX).unwrap();
        let mut case = stage_with_spot([96, 54]);
        case.scene = import.scene;
        (case.view.from, case.view.to) = (vec3(0.0, -9.0, 1.5), vec3(0.0, 3.0, 1.5));
        case.view.fov = 25.0;
        case.rig.lights = vec![Light::Spot(Spot {
            position: vec3(0.0, 0.0, 3.0),
            aim: vec3(0.0, 0.0, 0.0),
            beam: 90.0,
            field: 120.0,
            intensity: Rgb([2000.0; 3]),
        })];
        let filter = Rgb::WHITE;
        case.rig.sources.truncate(1);
        case.rig.sources[0].emitters = vec![Emitter { light: 0, filter }];
        let image = &render(&case, 2, &[vec![1.0]], 2)[0];
        // The left and the right of the walls above the beam.
        let mean = |columns: std::ops::Range<usize>| {
            let rows = (8..20).flat_map(|y| columns.clone().map(move |x| 3 * (96 * y + x)));
            rows.map(|at| f64::from(image.data()[at])).sum::<f64>()
        };
        [mean(4..36), mean(60..92)]
    };
    let (painted, plain) = (lit(painted), lit(plain));
    assert!(plain[1] > 1.2 * plain[0], "{plain:?}");
    for (painted, plain) in painted.iter().zip(&plain) {
        assert!((painted / plain - 1.0).abs() < 0.05, "{painted} {plain}");
    }
}
