//! Gloss: images of glossy surfaces, against the mirrored scene, Fresnel's formulas and integrals.

use crate::meter::{Room, mean, work, worst};
use footlight_show::geometry::{Vec3, View, vec3};
use footlight_show::units::Rgb;
use footlight_stage::Gloss;
use footlight_transport::radiosity::Radiosity;
use footlight_transport::{Setup, Transport};
use std::f64::consts::{PI, TAU};

const MIRROR: Gloss = Gloss {
    roughness: 0.0,
    normal: Rgb([1.0; 3]),
    is_metal: true,
};

/// A square plate on the ground at the origin, of this reflectance and gloss.
fn plate(side: f64, reflectance: f64, gloss: Gloss) -> Room {
    let mut room = Room::default();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| vec3(0.5 * side * x, 0.5 * side * y, 0.0));
    room.wall(&corners, reflectance);
    room.scene.materials[0].gloss = Some(gloss);
    room
}

/// An upright rectangle at y = 5 that faces the plate.
fn upright(x: [f64; 2]) -> Vec<Vec3> {
    let corners = [(x[0], 0.0), (x[1], 0.0), (x[1], 30.0), (x[0], 30.0)];
    corners.map(|(x, z)| vec3(x, 5.0, z)).to_vec()
}

const SIZE: [usize; 2] = [24, 16];

/// A view of the plate's middle from this height and an equal distance in front.
fn view(height: f64) -> View {
    View {
        from: vec3(0.0, -1.0, height),
        to: Vec3::ZERO,
        fov: 6.0,
        roll: 0.0,
        width: SIZE[0],
        height: SIZE[1],
    }
}

/// The direction through the middle of a pixel.
fn way(view: &View, pixel: usize) -> Vec3 {
    let [right, up, forward] = view.axes();
    let step = 2.0 * (0.5 * view.fov.to_radians()).tan() / SIZE[1] as f64;
    let [x, y] = [pixel % SIZE[0], pixel / SIZE[0]].map(|at| at as f64 + 0.5);
    let across = right * (step * (x - 12.0)) - up * (step * (y - 8.0));
    (forward + across).normalized()
}

/// A perfect mirror shows what the mirrored camera would see of a panel, and of a wall lit by a
/// lamp.
#[test]
fn a_mirror_shows_the_mirrored_scene() {
    let view = view(0.8);
    let mut room = plate(1.0, 0.0, MIRROR);
    room.panel(&[upright([-20.0, 20.0])], 3.0);
    let found = room.radiances(&view, 1);
    assert!(worst(&found, &vec![3.0; found.len()]) < 1e-6, "{found:?}");

    // A small plate reflects almost no light back.
    let mut room = plate(0.25, 0.0, MIRROR);
    room.wall(&upright([-20.0, 20.0]), 0.5);
    let lamp = vec3(1.5, 1.0, 3.0);
    room.bulb(lamp, 700.0);
    let exact = |pixel: usize| {
        let way = way(&view, pixel);
        let (eye, way) = (vec3(0.0, -1.0, -0.8), vec3(way.x, way.y, -way.z));
        let from = eye + way * (6.0 / way.y) - lamp;
        0.5 / PI * 700.0 * from.y / from.length().powi(3)
    };
    let exact: Vec<f64> = (0..SIZE[0] * SIZE[1]).map(exact).collect();
    for (quality, allowed) in [(1, 5e-3), (2, 2e-3)] {
        let found = room.radiances(&view, quality);
        let square = |(a, b): (&f64, &f64)| (a / b - 1.0).powi(2);
        let squares: Vec<f64> = found.iter().zip(&exact).map(square).collect();
        let error = mean(&squares).sqrt();
        println!("a lit wall in a mirror, quality {quality}: {error:.5}");
        assert!(error < allowed, "quality {quality}: {error}");
    }
}

/// Reflectance of glass of index 1.5, from the angles on both sides (Fresnel).
fn glass(cosine: f64) -> f64 {
    let angle = cosine.acos();
    let inside = (angle.sin() / 1.5).asin();
    let across = ((angle - inside).sin() / (angle + inside).sin()).powi(2);
    let along = ((angle - inside).tan() / (angle + inside).tan()).powi(2);
    0.5 * (across + along)
}

#[test]
fn varnish_reflects_as_glass_does() {
    for height in [0.2, 0.6, 3.0] {
        let view = view(height);
        let mut room = plate(3.0, 0.0, Gloss::varnish(0.0));
        room.panel(&[upright([-60.0, 60.0])], 2.0);
        let exact = |pixel| 2.0 * glass(-way(&view, pixel).z);
        let exact: Vec<f64> = (0..SIZE[0] * SIZE[1]).map(exact).collect();
        let found = room.radiances(&view, 2);
        let worst = worst(&found, &exact);
        println!("glass from {height} m: {worst:.5}");
        assert!(worst < 3e-3, "{height}: {worst}");
    }
}

/// Radiance that a rough lobe on a horizontal plate reflects to the eye, by the illuminance across
/// the rays from `light`.
fn lobe(roughness: f64, eye: Vec3, light: Vec3) -> f64 {
    let square = roughness.powi(4);
    let passed = |c: f64| 2.0 / (1.0 + (1.0 + square * (1.0 / (c * c) - 1.0)).sqrt());
    let half = (eye + light).normalized();
    let spread = half.z * half.z * (square - 1.0) + 1.0;
    let density = square / (PI * spread * spread);
    density * passed(eye.z) * passed(light.z) * glass(half.dot(eye)) / (4.0 * eye.z)
}

/// Radiance that it reflects of radiance from all directions, by the midpoint rule over the
/// half-space.
fn reflected(roughness: f64, eye: Vec3, radiance: impl Fn(Vec3) -> f64) -> f64 {
    let n = 1200;
    let of = |i: usize, j: usize| {
        let (tilt, turn) = (
            (i as f64 + 0.5) / n as f64 * 0.5 * PI,
            (j as f64 + 0.5) / n as f64 * TAU,
        );
        let light = vec3(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos());
        lobe(roughness, eye, light) * tilt.sin() * radiance(light)
    };
    let sum: f64 = (0..n * n).map(|k| of(k / n, k % n)).sum();
    sum * 0.5 * PI * TAU / (n * n) as f64
}

/// Share of even light that a rough lobe reflects to an eye at this cosine.
fn share(roughness: f64, cosine: f64) -> f64 {
    let eye = vec3((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    reflected(roughness, eye, |_| 1.0)
}

/// A wall that a lamp lights and a small panel before it, each in a wide lobe, against the integral.
/// Pixels are as fine as those of a stage's view, because light is evened out between them.
#[test]
fn wide_gloss_blurs_what_it_shows() {
    const FINE: usize = 4;
    let [width, height] = SIZE.map(|side| FINE * side);
    let view = View {
        width,
        height,
        ..view(0.8)
    };
    let lamp = vec3(1.5, 1.0, 3.0);
    let mut wall = plate(0.1, 0.0, Gloss::varnish(0.3));
    wall.wall(&upright([-20.0, 20.0]), 0.5);
    wall.bulb(lamp, 700.0);
    let lit = |way: Vec3| {
        let at = way * (5.0 / way.y.max(1e-9));
        let from = at - lamp;
        let is_wall = way.y > 0.0 && at.z < 30.0 && at.x.abs() < 20.0;
        f64::from(u8::from(is_wall)) * 0.5 / PI * 700.0 * from.y / from.length().powi(3)
    };
    let mut panel = plate(0.1, 0.0, Gloss::varnish(0.3));
    let corners = [(-0.2, 3.7), (0.2, 3.7), (0.2, 4.3), (-0.2, 4.3)];
    panel.panel(&[corners.map(|(x, z)| vec3(x, 5.0, z)).to_vec()], 9.0);
    let eye = view.from.normalized();
    let shining = |k: usize| {
        let [u, v] = [k % 100, k / 100].map(|at| (at as f64 + 0.5) / 100.0 - 0.5);
        let at = vec3(0.4 * u, 5.0, 4.0 + 0.6 * v);
        let across = 9.0 * 0.24e-4 * at.y / at.length().powi(3);
        across * lobe(0.3, eye, at.normalized())
    };
    // The plate shows the wall and the lamp's highlight.
    let highlight = 700.0 / lamp.dot(lamp) * lobe(0.3, eye, lamp.normalized());
    let exact = [
        reflected(0.3, eye, lit) + highlight,
        (0..10_000).map(shining).sum(),
    ];
    for ((name, room), exact) in [("wall", &wall), ("panel", &panel)].into_iter().zip(exact) {
        for quality in [1, 2, 3] {
            let found = room.radiances(&view, quality);
            let middle = |i: usize| (7 * FINE..9 * FINE).map(move |j| j * width + i);
            let around = (11 * FINE..13 * FINE).flat_map(middle);
            let around: Vec<f64> = around.map(|at| found[at]).collect();
            let ratio = mean(&around) / exact;
            println!("{name} in wide gloss, quality {quality}: {ratio:.4}");
            assert!((ratio - 1.0).abs() < 0.02, "{name} {quality}: {ratio}");
        }
    }
}

/// In a uniformly emitting box, a white plate returns its diffuse part and the lobe's, together no
/// more than it receives.
#[test]
fn a_glossy_plate_in_even_light_returns_what_its_parts_say() {
    for (roughness, height) in [(0.4, 0.3), (0.6, 0.3), (0.6, 1.0)] {
        let mut room = plate(1.0, 0.9, Gloss::varnish(roughness));
        let at = |x: f64, y: f64, z: f64| vec3(4.0 * x, 4.0 * y, 4.0 * z);
        let quad = |corners: [(f64, f64, f64); 4]| corners.map(|(x, y, z)| at(x, y, z)).to_vec();
        room.panel(
            &[
                quad([(-1., -1., 1.), (-1., 1., 1.), (1., 1., 1.), (1., -1., 1.)]),
                quad([(-1., 1., 0.), (1., 1., 0.), (1., 1., 1.), (-1., 1., 1.)]),
                quad([(-1., -1., 0.), (-1., -1., 1.), (1., -1., 1.), (1., -1., 0.)]),
                quad([(-1., -1., 0.), (-1., 1., 0.), (-1., 1., 1.), (-1., -1., 1.)]),
                quad([(1., -1., 0.), (1., -1., 1.), (1., 1., 1.), (1., 1., 0.)]),
            ],
            1.0,
        );
        let view = view(height);
        let cosine = height / 1.0_f64.hypot(height);
        let share = share(roughness, cosine);
        let exact = 0.9 * (1.0 - share) + share;
        let found = mean(&room.radiances(&view, 2));
        println!("roughness {roughness} from {height} m: {found:.4}, exact {exact:.4}");
        assert!(
            (found / exact - 1.0).abs() < 0.01 && found < 1.0,
            "{roughness}: {found} for {exact}"
        );
    }
}

/// A plate in front of two walls, with a lamp on one side and a panel on the other.
fn stage() -> Room {
    let mut room = plate(6.0, 0.1, Gloss::varnish(0.35));
    room.wall(&upright([-8.0, 1.0]), 0.6);
    room.wall(&upright([1.0, 8.0]), 0.3);
    room.bulb(vec3(1.0, 2.0, 2.5), 300.0);
    let panel = [(-3.0, 2.0), (-3.0, 3.0), (-2.0, 3.0), (-2.0, 2.0)];
    room.panel(&[panel.map(|(x, y)| vec3(x, y, 2.5)).to_vec()], 40.0);
    room
}

fn wide() -> View {
    View {
        from: vec3(0.0, -6.0, 1.6),
        to: vec3(0.0, 1.0, 0.0),
        fov: 30.0,
        ..view(1.0)
    }
}

#[test]
fn gloss_is_linear_in_the_lights() {
    stage().assert_linear(&wide());
}

/// Measurement includes the gloss: the estimator's mean equals the image's.
#[test]
fn the_estimator_of_errors_sees_the_gloss() {
    let room = stage();
    let setup = Setup::new(room.scene.clone(), room.rig(), wide());
    let estimator = Radiosity.estimator(&setup, work()).unwrap().unwrap();
    let picture = room.radiances(&wide(), 3);
    let pixels: Vec<usize> = (0..SIZE[0] * SIZE[1]).collect();
    let halves = estimator.estimate(&[1.0, 1.0], &pixels, 0..512, work());
    let halves = halves.unwrap();
    let (mut found, mut all) = (0.0, 0.0);
    for (pixel, [a, b]) in halves.iter().enumerate() {
        // Pixels that show the lamps have no estimate.
        if a[0].is_finite() {
            found += 0.5 * (a[0] + b[0]);
            all += picture[pixel];
        }
    }
    println!("estimate / picture: {:.4}", found / all);
    assert!((found / all - 1.0).abs() < 0.015, "{}", found / all);
}
