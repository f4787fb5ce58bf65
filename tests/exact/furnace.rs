//! Closed rooms with exact answers: equal walls that emit and reflect, a single furnace wall, the
//! integrating sphere.

use crate::form_factor::sphere;
use crate::meter::{GREY, INWARD, Meter, Room, aside, cuboid, level, qualities};
use crate::reference::{errors, furnace, picture, render};
use footlight_picture::Image;
use footlight_show::geometry::View;
use footlight_show::geometry::{Vec3, vec3};
use std::f64::consts::PI;

/// Largest deviation of a pixel from E / (1 - rho) in a closed room of equal walls.
fn off_in_a_furnace(rho: f64, quality: u8) -> f64 {
    let mut room = Room::default();
    for face in cuboid(Vec3::ZERO, vec3(3.0, 4.0, 2.5), true) {
        room.emitter(&[face], 1.0, rho);
    }
    let view = View {
        from: vec3(0.4, 0.5, 1.1),
        to: vec3(2.0, 3.0, 1.0),
        fov: 80.0,
        roll: 0.0,
        width: 20,
        height: 15,
    };
    let all = room.radiances(&view, quality);
    let off = all.iter().map(|l| (l * (1.0 - rho) - 1.0).abs());
    let off = off.fold(0.0, f64::max);
    println!("furnace {rho}, quality {quality}: {off:.6}");
    off
}

/// Radiance everywhere is E / (1 - rho). The test cannot see errors of form factors whose sums are
/// right; it tests the solver and losses at edges, here of walls with different sides.
#[test]
#[ignore = "slow"]
fn every_wall_emits_and_reflects() {
    for quality in [1, 2] {
        let off = off_in_a_furnace(0.999, quality);
        assert!(off < 1e-3, "quality {quality}: {off}");
    }
}

/// Steps that interpolate direct light, in a room dominated by it, where every wall lights its
/// neighbours from their common edge: the worst pixel errs by 1.2 and 0.2 % at a reflectance of
/// 0.5.
#[test]
#[ignore = "slow"]
fn cheap_steps_are_off_by_what_they_interpolate() {
    let off: Vec<f64> = qualities().map(|q| off_in_a_furnace(0.5, q)).collect();
    let bounds = [1.5e-2, 5e-3, 1e-3];
    let within = off.iter().zip(bounds).all(|(off, bound)| *off < bound);
    assert!(within && off.len() == bounds.len(), "{off:?}");
}

/// Pixels without an edge between walls within or next to them: references are values at pixel
/// middles, ours are means.
fn smooth(image: &Image) -> Vec<bool> {
    let (w, h) = (image.width(), image.height());
    let level = |x: usize, y: usize| image.pixel(x.min(w - 1), y.min(h - 1)).unwrap()[0];
    let even = |at: usize| {
        let (x, y) = (at % w, at / w);
        let near =
            (0..9).map(|i| level((x + i % 3).saturating_sub(1), (y + i / 3).saturating_sub(1)));
        let (low, high) = near.fold((f32::MAX, 0.0_f32), |(l, h), v| (l.min(v), h.max(v)));
        high < 1.05 * low
    };
    (0..w * h).map(even).collect()
}

#[test]
#[ignore = "slow"]
fn single_walls() {
    let case = furnace();
    let mut setting = [vec![0.0; 6], vec![0.0; 6]];
    setting[0][0] = 1.0;
    setting[1][4] = 1.0;
    let files = ["det_xneg.exr", "det_zneg.exr"];
    let mut last = [f64::INFINITY; 2];
    for quality in qualities() {
        let images = render(&case, quality, &setting, 2);
        for ((image, file), last) in images.iter().zip(files).zip(&mut last) {
            let exact = picture("furnace", file);
            let (error, _) = errors(image, [&exact, &exact], &smooth(&exact));
            println!("{file}, quality {quality}: {error:.5}");
            assert!(
                error < last.max(1e-3),
                "{file}, quality {quality}: {error} after {last}"
            );
            *last = error;
        }
    }
    assert!(last.iter().all(|e| *e < 0.005), "{last:?}");
}

/// A lamp anywhere in a diffuse sphere: reflected light is uniform, flux / area * rho / (1 - rho).
/// The sphere consists of triangles, whose error limits the test.
#[test]
#[ignore = "slow"]
fn integrating_sphere() {
    let (rho, flux) = (0.8, 1000.0);
    let triangles = sphere(Vec3::ZERO, 1.0, 4);
    let room = |reflectance: f64| {
        let mut room = Room::default();
        for t in &triangles {
            room.wall(&[t[0], t[2], t[1]], reflectance);
        }
        room.bulb(vec3(0.3, -0.2, 0.4), flux / (4.0 * PI));
        room
    };
    let view = View {
        from: vec3(-0.6, 0.1, -0.3),
        to: Vec3::ZERO,
        fov: 100.0,
        roll: 0.0,
        width: 16,
        height: 16,
    };
    let area: f64 = triangles
        .iter()
        .map(|t| (t[1] - t[0]).cross(t[2] - t[0]).length() * 0.5)
        .sum();
    let exact = flux / area * rho / (1.0 - rho);
    // Finer steps are no better: the triangles are the limit.
    for quality in [1, 2] {
        let lit = room(rho).radiances(&view, quality);
        let direct = room(GREY).radiances(&view, quality);
        let all = lit
            .iter()
            .zip(&direct)
            .map(|(l, d)| (l / rho - d / GREY) * PI / exact - 1.0);
        let all: Vec<f64> = all.collect();
        let square = all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64;
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        println!(
            "sphere, quality {quality}: mean {mean:.5}, rms {:.5}",
            square.sqrt()
        );
        assert!(
            mean.abs() < 0.01 && square.sqrt() < 0.03,
            "quality {quality}: {mean} {square}"
        );
    }
}

/// A white surface loses no light: two plates that each see the other's light once, and nothing
/// else.
#[test]
fn a_white_surface_reflects_all() {
    let mut lit = [0.5, 1.0].map(|rho| {
        let mut room = Room::default();
        room.wall(&level([0.0, 1.0], [0.0, 1.0], 0.0, true), GREY);
        room.wall(&aside(0.0, [0.0, 1.0], [0.0, 1.0], true), rho);
        room.sun(vec3(0.0, 0.5, 0.5), vec3(-1.0, 0.0, 0.01), 1.0);
        let meter = Meter::new(vec3(0.5, 0.5, 0.0), INWARD[4], 0.125, [8, 8], 0.5);
        room.mean(&meter, GREY, 1) / rho
    });
    lit.sort_by(f64::total_cmp);
    assert!(lit[1] / lit[0] - 1.0 < 1e-3, "{lit:?}");
}
