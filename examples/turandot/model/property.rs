//! Properties: the gong, the braziers, and the figure on the stair for scale.

use super::roof::tetrahedron;
use super::scene_key::TERRACE;
use super::solid::{Frame, Point, Set, Side, diamond, hexagon, octagon};

/// Places everything.
pub fn build(set: &mut Set) {
    set.object("gong");
    gong(set, Frame::facing([-3.5, 1.2, 0.0], [1.0, 0.2]));
    set.object("brazier");
    for (x, flame) in [(-5.75, "flame_left"), (5.75, "flame_right")] {
        brazier(set, Frame::at([x, 4.4, 0.0]), flame);
    }
    set.object("figure");
    figure(set, Frame::at([0.0, 9.3, TERRACE]));
}

/// Sixteen corners of a circle of radius 1 as (x, z), counter-clockwise seen from -Y.
fn circle() -> Vec<[f64; 2]> {
    let h = 0.5_f64.sqrt();
    let even = [
        [1.0, 0.0],
        [h, h],
        [0.0, 1.0],
        [-h, h],
        [-1.0, 0.0],
        [-h, -h],
        [0.0, -1.0],
        [h, -h],
    ];
    // The octagon's second corner is the first above the axis.
    let odd = octagon();
    let odd = odd.iter().cycle().skip(1);
    even.iter().zip(odd).flat_map(|(a, b)| [*a, *b]).collect()
}

/// The gong that Calaf strikes three times.
fn gong(set: &mut Set, at: Frame) {
    let disc = |radius: f64| -> Vec<[f64; 2]> {
        let around = circle().into_iter();
        around
            .map(|[x, z]| [x * radius, 1.75 + z * radius])
            .collect()
    };
    set.extrude(at, "bronze", &disc(1.0), [-0.08, 0.08], &[]);
    set.extrude(at, "gilt", &disc(0.3), [-0.16, -0.08], &[]);
    for x in [-1.3, 1.3] {
        set.block(
            at,
            "lacquer",
            [x - 0.1, -0.1, 0.0],
            [x + 0.1, 0.1, 3.1],
            &[Side::Bottom],
        );
        set.block(
            at,
            "lacquer",
            [x - 0.14, -0.6, 0.0],
            [x + 0.14, 0.6, 0.22],
            &[Side::Bottom],
        );
    }
    set.block(at, "lacquer", [-1.7, -0.12, 3.1], [1.7, 0.12, 3.34], &[]);
    for side in [-1.0, 1.0] {
        let (x, tip) = (side * 1.7, side * 2.2);
        let corners = [
            [x, -0.12, 3.34],
            [x, 0.12, 3.34],
            [x - side * 0.3, 0.0, 3.34],
            [tip, 0.0, 3.75],
        ];
        tetrahedron(set, at, "gilt", corners);
        let cord = (
            [side * 0.5 - 0.02, -0.02, 2.55],
            [side * 0.5 + 0.02, 0.02, 3.1],
        );
        set.block(at, "gilt", cord.0, cord.1, &[Side::Top, Side::Bottom]);
    }
}

fn brazier(set: &mut Set, at: Frame, flame: &'static str) {
    let rings = [
        [0.3, 0.0],
        [0.1, 0.25],
        [0.09, 0.85],
        [0.4, 1.1],
        [0.46, 1.3],
    ];
    set.mantle(at, "bronze", &octagon(), &rings);
    set.lid(at, "iron", &octagon(), [0.46, 1.3]);
    for (x, y, width, height) in [(-0.13, 0.0, 0.17, 0.75), (0.12, -0.08, 0.15, 0.6)] {
        let foot = 1.32;
        let tongue = [
            [x, y, foot],
            [x + width, y, foot + 0.35 * height],
            [x + 0.03, y, foot + height],
            [x - width, y, foot + 0.35 * height],
        ];
        set.face(at, flame, &tongue);
    }
}

/// A princess, 1.8 m with her crown, which gives the scale of the palace.
fn figure(set: &mut Set, at: Frame) {
    let robe = [
        [0.62, 0.0],
        [0.4, 0.55],
        [0.24, 1.05],
        [0.29, 1.36],
        [0.09, 1.47],
    ];
    set.mantle(at, "robe", &octagon(), &robe);
    let head = [[0.07, 1.47], [0.13, 1.6], [0.12, 1.72]];
    set.mantle(at, "face", &hexagon(), &head);
    set.lid(at, "iron", &hexagon(), [0.12, 1.72]);
    for side in [-1.0, 1.0] {
        sleeve(set, at, side);
    }
    // A crown like a fan.
    for (x, z) in [
        (-0.3, 1.86),
        (-0.16, 1.98),
        (0.0, 2.04),
        (0.16, 1.98),
        (0.3, 1.86),
    ] {
        let ray = [
            [x * 0.35 - 0.035, -0.1, 1.7],
            [x * 0.35 + 0.035, -0.1, 1.7],
            [x, -0.1, z],
        ];
        set.face(at, "gilt", &ray);
    }
    set.mantle(at, "gilt", &diamond(), &[[0.135, 1.66], [0.135, 1.74]]);
}

/// A wide sleeve, held out.
fn sleeve(set: &mut Set, at: Frame, side: f64) {
    let p = |x: f64, y: f64, z: f64| -> Point { [side * x, y, z] };
    let shoulder = [p(0.16, -0.05, 1.36), p(0.16, 0.09, 1.36), p(0.2, 0.0, 1.12)];
    let hand = [p(0.62, -0.32, 1.02), p(0.7, -0.2, 1.0), p(0.6, -0.24, 0.42)];
    let ([a, b, c], [d, e, f]) = (shoulder, hand);
    let mut side_face = |corners: [Point; 3]| {
        let mut corners = corners;
        if side < 0.0 {
            corners.reverse();
        }
        set.face(at, "robe", &corners);
    };
    side_face([a, c, f]);
    side_face([a, f, d]);
    side_face([a, d, e]);
    side_face([a, e, b]);
    side_face([b, e, f]);
    side_face([b, f, c]);
    side_face([d, f, e]);
}
