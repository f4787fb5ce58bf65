//! Haze: attenuated surfaces and the haze's own light, by both methods.

use crate::meter::{Room, work};
use footlight_show::geometry::{Vec3, View, vec3};
use footlight_show::model::Haze;
use footlight_transport::radiosity::{MANY_POLYGONS, Radiosity};
use footlight_transport::{Setup, Transport};
use std::f64::consts::PI;

const HAZE: Haze = Haze {
    extinction: 0.06,
    forward: 0.5,
    albedo: 0.8,
};
const BULB: Vec3 = Vec3 {
    x: 0.7,
    y: 2.2,
    z: 1.1,
};
const INTENSITY: f64 = 500.0;
const WALL: f64 = 5.0;
const REFLECTANCE: f64 = 0.5;

/// A wall 5 m away, of `side` squares per side, a bulb in front and one to the side, in haze.
fn room(side: usize) -> Room {
    let mut room = Room::default();
    room.scene.haze = Some(HAZE);
    let size = 24.0 / side as f64;
    for k in 0..side * side {
        let (x, z) = (
            (k % side) as f64 * size - 12.0,
            (k / side) as f64 * size - 12.0,
        );
        let corner = |i: f64, j: f64| vec3(x + i * size, WALL, z + j * size);
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(i, j)| corner(i, j));
        room.wall(&square, REFLECTANCE);
    }
    room.bulb(BULB, INTENSITY);
    room.bulb(vec3(-3.0, 1.0, -0.5), 200.0);
    room
}

fn view() -> View {
    View {
        from: Vec3::ZERO,
        to: vec3(0.2, WALL, 0.1),
        fov: 60.0,
        roll: 0.0,
        width: 24,
        height: 16,
    }
}

/// The direction through a point of the image, in pixels.
fn way(x: f64, y: f64) -> Vec3 {
    let View { to, fov, .. } = view();
    let forward = to.normalized();
    let right = forward.cross(vec3(0.0, 0.0, 1.0)).normalized();
    let up = right.cross(forward);
    let step = 2.0 * (0.5 * fov.to_radians()).tan() / 16.0;
    let across = right * ((x - 12.0) * step) - up * ((y - 8.0) * step);
    (forward + across).normalized()
}

/// The first bulb's light from a pixel, from the wall and from the haze: the mean of 36 rays.
fn exact(x: usize, y: usize) -> f64 {
    let at = |x: usize, k: usize| x as f64 + (k as f64 + 0.5) / 6.0;
    let rays = (0..36).map(|k| along(way(at(x, k % 6), at(y, k / 6))));
    rays.sum::<f64>() / 36.0
}

/// The first bulb's light along a ray, by Simpson's rule.
fn along(way: Vec3) -> f64 {
    let length = WALL / way.y;
    let clear = |distance: f64| (-HAZE.extinction * distance).exp();
    let wall = way * length - BULB;
    let irradiance = INTENSITY * wall.y / wall.length().powi(3) * clear(wall.length());
    let scattered = |t: f64| {
        let from = way * t - BULB;
        let distance = from.length();
        let cosine = -from.dot(way) / distance;
        let g = HAZE.forward;
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
        HAZE.albedo * HAZE.extinction * phase * INTENSITY * clear(distance + t)
            / (distance * distance)
    };
    let n = 500;
    let at = |k: i32| length * f64::from(k) / f64::from(n);
    let weight = |k: i32| match k {
        0 => 1.0,
        k if k == n => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    let sum: f64 = (0..=n).map(|k| weight(k) * scattered(at(k))).sum();
    REFLECTANCE / PI * irradiance * clear(length) + sum * length / f64::from(n) / 3.0
}

#[test]
fn a_wall_and_the_haze_before_it_meet_the_integral() {
    for side in [2, 51] {
        let mut room = room(side);
        assert_eq!(room.scene.polygons.len() > MANY_POLYGONS, side > 2);
        room.lights.truncate(1);
        for (quality, allowed) in [(1, 0.01), (2, 0.004)] {
            let found = room.radiances(&view(), quality);
            let (mut error, mut square) = (0.0, 0.0);
            for (pixel, found) in found.iter().enumerate() {
                let (x, y) = (pixel % 24, pixel / 24);
                // Near the bulb, light varies within a pixel.
                if way(x as f64 + 0.5, y as f64 + 0.5).cross(BULB).length() < 0.4 {
                    continue;
                }
                let exact = exact(x, y);
                error += (found - exact).powi(2);
                square += exact * exact;
            }
            let error = f64::sqrt(error / square);
            println!("{side} squares a side, quality {quality}: {error:.5}");
            assert!(error < allowed, "{side}, quality {quality}: {error}");
        }
    }
}

#[test]
fn haze_is_linear_in_the_lights() {
    for side in [2, 51] {
        room(side).assert_linear(&view());
    }
}

/// Measurement includes the haze: the estimator's mean is the exact light.
#[test]
fn the_estimator_of_errors_sees_the_haze() {
    let mut room = room(2);
    room.lights.truncate(1);
    let setup = Setup::new(room.scene.clone(), room.rig(), view());
    let estimator = Radiosity.estimator(&setup, work()).unwrap().unwrap();
    let pixels: Vec<usize> = (0..24 * 16).collect();
    let halves = estimator.estimate(&[1.0], &pixels, 0..256, work()).unwrap();
    let (mut found, mut all) = (0.0, 0.0);
    for (pixel, [a, b]) in pixels.iter().zip(halves) {
        found += 0.5 * (a[0] + b[0]);
        all += exact(pixel % 24, pixel / 24);
    }
    assert!((found / all - 1.0_f64).abs() < 0.01, "{}", found / all);
}
