//! Cases of CIE 171:2006, "Test Cases to Assess the Accuracy of Lighting Computer Programs",
//! with the analytical values recomputed: the room is 4 x 4 x 3 m with a corner at the origin.

use crate::meter::{
    GREY, INWARD, Meter, Room, assert_better, both_ends, contour, cuboid, level, mean, qualities,
    upright, worst,
};
use footlight_show::geometry::{Vec3, vec3};
use std::f64::consts::PI;

const SIDE: [f64; 2] = [0.0, 4.0];
const UP: Vec3 = vec3(0.0, 0.0, 1.0);
const ALONG_Y: Vec3 = vec3(0.0, 1.0, 0.0);

/// Tolerance of every case at the finest step.
const LIMIT: f64 = 0.005;

/// Squares between points half a metre apart; their middles are the points.
const FINE: usize = 25;

/// Illuminances at each quality at points half a metre apart on a line, all in one narrow image.
fn readings(room: &Room, points: &[Vec3], normal: Vec3) -> Vec<Vec<f64>> {
    let (first, last) = (points[0], points[points.len() - 1]);
    let count = (points.len() - 1) * FINE + 1;
    let meter = Meter::new(
        (first + last) * 0.5,
        normal,
        0.5 / FINE as f64,
        [1, count],
        0.2,
    );
    let one = |quality| {
        let all = room.illuminances(&meter, GREY, quality);
        let near = |p: &Vec3| (0..count).find(|y| (meter.at(0, *y) - *p).length() < 1e-9);
        points.iter().map(|p| all[near(p).unwrap()]).collect()
    };
    qualities().map(one).collect()
}

/// Worst deviation at each quality.
fn deviations(room: &Room, points: &[Vec3], normal: Vec3, expected: &[f64]) -> Vec<f64> {
    let all = readings(room, points, normal);
    all.iter().map(|got| worst(got, expected)).collect()
}

fn assert_falls(case: &str, deviations: &[f64]) {
    assert_better(case, deviations, LIMIT);
}

fn on_wall(heights: &[f64]) -> Vec<Vec3> {
    heights.iter().map(|z| vec3(2.0, 0.0, *z)).collect()
}

fn on_floor(depths: &[f64]) -> Vec<Vec3> {
    depths.iter().map(|y| vec3(2.0, *y, 0.0)).collect()
}

/// 5.2: a Lambertian point of 1000 cd at 3 m, here a square of 4 mm.
#[test]
fn point_source() {
    const R: f64 = 0.002;
    let mut room = Room::default();
    room.wall(&level([-2.0, 2.0], [-2.0, 2.0], 0.0, true), GREY);
    let lamp = level([-R, R], [-R, R], 3.0, false);
    room.panel(&[lamp], 1000.0 / (4.0 * R * R));
    let expected = [
        (0, 0, 111.11),
        (10, 0, 105.19),
        (20, 0, 90.00),
        (30, 0, 71.11),
        (20, 20, 74.38),
        (30, 30, 49.38),
    ];
    // The middle of its lower left square is under the lamp, the next ones follow by 5 cm.
    let meter = Meter::new(vec3(0.75, 0.75, 0.0), UP, 0.05, [31, 31], 2.0);
    let off = |quality| {
        let all = room.illuminances(&meter, GREY, quality);
        let got = expected.map(|(x, y, _)| all[(30 - y) * 31 + x]);
        worst(&got, &expected.map(|e| e.2))
    };
    assert_falls("5.2", &qualities().map(off).collect::<Vec<_>>());
}

/// 5.3: a square metre of the ceiling with 1000 cd in a black room.
#[test]
fn area_source() {
    let lamp = vec![level([1.5, 2.5], [1.5, 2.5], 3.0, false)];
    let faces = cuboid(Vec3::ZERO, vec3(4.0, 4.0, 3.0), true);
    let room = |grey: usize| {
        let mut room = Room::default();
        for (i, face) in faces.iter().enumerate() {
            room.wall(face, if i == grey { GREY } else { 0.0 });
        }
        room.panel(&lamp, 1000.0);
        room
    };
    let points = on_wall(&[2.75, 2.25, 1.75, 1.25, 0.75, 0.25]);
    let expected = [32.68, 75.19, 81.32, 69.06, 53.40, 40.00];
    let wall = deviations(&room(2), &points, ALONG_Y, &expected);
    assert_falls("5.3 wall", &wall);
    let points = on_floor(&[0.25, 0.75, 1.25, 1.75]);
    let expected = [61.42, 79.26, 95.67, 105.78];
    assert_falls("5.3 floor", &deviations(&room(4), &points, UP, &expected));
}

/// 5.4: the flux on the walls of a closed black room is the lamp's.
#[test]
#[ignore = "slow"]
fn flux_is_conserved() {
    let high = vec3(4.0, 4.0, 3.0);
    let faces = cuboid(Vec3::ZERO, high, true);
    let mut panel = Room::default();
    let mut bulb = Room::default();
    for face in &faces {
        panel.wall(face, GREY);
        bulb.wall(face, GREY);
    }
    panel.panel(&[level([0.7, 1.7], [1.5, 2.5], 2.9, false)], 1000.0);
    bulb.bulb(vec3(1.1, 2.3, 1.7), 1000.0);
    for (case, room, flux) in [
        ("5.4 panel", panel, PI * 1000.0),
        ("5.4 bulb", bulb, 4e3 * PI),
    ] {
        let measured = if case == "5.4 panel" { 5 } else { 6 };
        let total = |quality: u8| -> f64 {
            // The ceiling gets nothing from a panel below it, and a camera facing it would see the
            // panel.
            let faces = INWARD[..measured].iter().map(|&normal| {
                let middle = high * 0.5;
                let face = vec3(
                    middle.x * normal.x,
                    middle.y * normal.y,
                    middle.z * normal.z,
                );
                // Squares of 12.5 cm tile every face; the widest direction is seen across.
                let side = |n: f64| (n / 0.125) as usize;
                let counts = if normal.z != 0.0 {
                    [side(4.0), side(4.0)]
                } else {
                    [side(4.0), side(3.0)]
                };
                let meter = Meter::new(middle - face, normal, 0.125, counts, 1.4);
                let all = room.illuminances(&meter, GREY, quality);
                all.iter().sum::<f64>() * 0.125 * 0.125
            });
            faces.sum()
        };
        // There is only direct light, so a cheap and a fine step are enough.
        assert_falls(case, &[1, 2].map(|q| (total(q) / flux - 1.0).abs()));
    }
}

/// 5.6: a wall lit only by a uniformly lit floor of reflectance 0.3; once with the floor as a lamp
/// (direct light), once by light that the floor reflects (form factors).
#[test]
fn light_from_a_diffuse_floor() {
    let floor = level(SIDE, SIDE, 0.0, true);
    let wall = upright(SIDE, 0.0, [0.0, 3.0], true);
    let points = on_wall(&[0.75, 1.25, 1.75, 2.25, 2.75]);
    let expected = [35.901, 27.992, 21.639, 16.716, 12.967];
    let mut glowing = Room::default();
    glowing.wall(&wall, GREY);
    glowing.panel(std::slice::from_ref(&floor), 100.0 / PI);
    let direct = deviations(&glowing, &points, ALONG_Y, &expected);
    assert_falls("5.6 direct", &direct);
    let mut lit = Room::default();
    lit.wall(&wall, GREY);
    lit.wall(&floor, 0.3);
    lit.sun(vec3(2.0, 2.0, 0.0), -UP, 100.0 / 0.3);
    let meter = over_wall();
    let exact: Vec<f64> = (0..16 * 12)
        .map(|i| {
            let here = meter.at(i % 16, i / 16);
            // Seen with the wall's normal up.
            let turned = floor
                .iter()
                .map(|v| *v - here)
                .map(|d| vec3(d.x, -d.z, d.y));
            let above: Vec<Vec3> = turned.collect();
            100.0 * contour(&above)
        })
        .collect();
    assert_falls("5.6 reflected", &spreads(&lit, &meter, &exact));
}

/// The wall y = 0 in squares of 25 cm.
fn over_wall() -> Meter {
    Meter::new(vec3(2.0, 0.0, 1.5), ALONG_Y, 0.25, [16, 12], 1.0)
}

/// Root mean square deviation from `exact` over the meter's squares at each quality. Single points
/// of reflected light have the noise of one hemicube, so they are judged together.
fn spreads(room: &Room, meter: &Meter, exact: &[f64]) -> Vec<f64> {
    let power: f64 = exact.iter().map(|e| e * e).sum();
    let one = |quality| {
        let got = room.illuminances(meter, GREY, quality);
        let off: f64 = got.iter().zip(exact).map(|(g, e)| (g - e).powi(2)).sum();
        (off / power).sqrt()
    };
    qualities().map(one).collect()
}

/// 5.7: light from the wall y = 4 past a black box; again both ways. The light reflected by the
/// wall comes over the opposite wall, so that neither this one nor the measured floor is lit
/// directly.
#[test]
#[ignore = "slow"]
fn light_past_an_obstruction() {
    let source = upright(SIDE, 4.0, [0.0, 3.0], false);
    let room = |lit: bool| {
        let mut room = Room::default();
        for face in cuboid(vec3(0.0, 2.5, 0.0), vec3(4.0, 2.7, 1.0), false) {
            room.wall(&face, 0.0);
        }
        room.wall(&upright(SIDE, 0.0, [0.0, 3.0], true), GREY);
        room.wall(&level(SIDE, [0.0, 2.5], 0.0, true), GREY);
        room.wall(&level(SIDE, [2.5, 4.0], 0.0, true), 0.0);
        if lit {
            room.wall(&source, 0.3);
            let down = vec3(0.0, 1.0, -1.0);
            room.sun(vec3(2.0, 4.0, 1.5), down, 2.0_f64.sqrt() * 100.0 / 0.3);
        } else {
            room.panel(std::slice::from_ref(&source), 100.0 / PI);
        }
        room
    };
    let wall = on_wall(&[2.75, 2.25, 1.75, 1.25, 0.75, 0.25]);
    let wall_expected = [16.071, 16.330, 15.399, 13.322, 10.317, 7.079];
    let (glowing, lit) = (room(false), room(true));
    let off = deviations(&glowing, &wall, ALONG_Y, &wall_expected);
    assert_falls("5.7 wall", &off);
    let floor = on_floor(&[0.25, 0.75, 1.25]);
    let off = deviations(&glowing, &floor, UP, &[3.382, 3.629, 3.013]);
    assert_falls("5.7 floor", &off);
    // The shadow begins at 1.75 exactly, in the middle of a square; beyond it is dark, except for
    // reflections of nearly black walls. Reflected light is interpolated and smoothed: elements are
    // too large to resolve its edge, gather points make it about 10 cm wide at quality 1, 5 at
    // quality 2 (2 cm beyond the edge, 0.05 of 100 lx remain).
    let dark = |room: &Room, behind: f64, sharp_from: u8| {
        let shadow = on_floor(&[1.75 + behind, 2.25 + behind]);
        for (got, quality) in readings(room, &shadow, UP).iter().zip(qualities()) {
            println!("5.7 shadow, quality {quality}: {got:.5?} of 100");
            let allowed = if quality < sharp_from { 1.0 } else { 1e-3 };
            assert!(
                got[0].abs() < allowed && got[1].abs() < 1e-3,
                "quality {quality}: {got:?}"
            );
        }
    };
    dark(&glowing, 0.02, 1);
    // Through form factors: as good as the direct light verified above.
    let exact = glowing.illuminances(&over_wall(), GREY, *qualities().end());
    assert_falls("5.7 reflected", &spreads(&lit, &over_wall(), &exact));
    dark(&lit, 0.05, 2);
    dark(&lit, 0.12, 1);
}

/// 5.8: a cube of 4 m with 10,000 lm in its middle: the mean of the reflected illuminance.
#[test]
#[ignore = "slow"]
fn diffuse_reflections_in_a_cube() {
    let middle = vec3(2.0, 2.0, 2.0);
    let flux = 10_000.0;
    // Bright walls reflect most often and so distinguish the steps best.
    for (rho, steps) in [(0.5, [1, 2]), (0.9, both_ends())] {
        let mut room = Room::default();
        for face in cuboid(Vec3::ZERO, middle * 2.0, true) {
            room.wall(&face, rho);
        }
        room.bulb(middle, flux / (4.0 * PI));
        let off = |quality: u8| {
            // The faces are equivalent; test one of each kind.
            let faces = [INWARD[1], INWARD[4]].iter().map(|&normal| {
                let meter = Meter::new(middle - normal * 2.0, normal, 0.125, [32, 32], 2.0);
                let lit = room.illuminances(&meter, rho, quality);
                let direct = (0..32 * 32).map(|i| {
                    let d = meter.at(i % 32, i / 32) - middle;
                    flux / (4.0 * PI) * 2.0 / d.dot(d).powf(1.5)
                });
                mean(&lit) - mean(&direct.collect::<Vec<_>>())
            });
            let reflected = mean(&faces.collect::<Vec<_>>());
            (reflected / (flux / 96.0 * rho / (1.0 - rho)) - 1.0).abs()
        };
        assert_falls(&format!("5.8, {rho}"), &steps.map(off));
    }
}
