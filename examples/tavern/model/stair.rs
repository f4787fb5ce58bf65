//! The stair, its balustrade, and the gallery that it climbs to.

use super::room::{
    BACK, CEILING_FROM, GALLERY, GALLERY_LEFT, UNDER_GALLERY, along_right, half_width, right_wall,
};
use super::solid::{Frame, Set, Side};

/// Twelve steps of 0.225 m by 0.225 m: exactly to the gallery.
const STEPS: u32 = 12;
const STEP: f64 = 0.225;
const STAIR_FRONT: f64 = 4.0;
const RAIL: [f64; 2] = [0.84, 0.91]; // over the treads' inner corners, and over the deck

/// Builds stair and gallery.
pub fn build(set: &mut Set) {
    let stage = Frame::at([0.0; 3]);
    set.object("stair");
    for step in 0..STEPS {
        let (x, z) = (STEP * f64::from(step), STEP * f64::from(step));
        let front = [x, x + STEP];
        set.upright(stage, "wainscot", STAIR_FRONT, front, [0.0, z + STEP]);
        let [x0, x1, z0, z1] = [x, x + STEP, z, z + STEP];
        set.face(
            stage,
            "bench",
            &[
                [x0, BACK, z0],
                [x0, STAIR_FRONT, z0],
                [x0, STAIR_FRONT, z1],
                [x0, BACK, z1],
            ],
        );
        set.face(
            stage,
            "oak",
            &[
                [x0, STAIR_FRONT, z1],
                [x1, STAIR_FRONT, z1],
                [x1, BACK, z1],
                [x0, BACK, z1],
            ],
        );
    }
    let (x, y, z) = (GALLERY_LEFT, STAIR_FRONT, UNDER_GALLERY);
    set.face(
        stage,
        "wainscot",
        &[[x, y, 0.0], [x, BACK, 0.0], [x, BACK, z], [x, y, z]],
    );
    stair_rail(set);
    gallery(set);
    gallery_rail(set);
}

fn stair_rail(set: &mut Set) {
    set.object("balustrade");
    let stage = Frame::at([0.0; 3]);
    let depth = [STAIR_FRONT + 0.02, STAIR_FRONT + 0.06];
    // Two balusters for every three steps, each on the tread below it.
    for i in 0..STEPS * 2 / 3 {
        let x = 1.5 * STEP * (f64::from(i) + 0.42);
        let tread = STEP * ((x / STEP).floor() + 1.0);
        let (x0, x1) = (x - 0.02, x + 0.02);
        let under = |x: f64| x + 0.1 + RAIL[0];
        let outline = [[x0, tread], [x1, tread], [x1, under(x1)], [x0, under(x0)]];
        set.extrude(stage, "rail", &outline, depth, &[0, 2]);
    }
    let [low, high] = RAIL.map(|z| z + 0.1);
    let (foot, head) = (0.0, GALLERY_LEFT);
    let outline = [
        [foot, low],
        [head, head + low],
        [head, head + high],
        [foot, high],
    ];
    let depth = [STAIR_FRONT, STAIR_FRONT + 0.08];
    set.extrude(stage, "rail", &outline, depth, &[1, 3]);
    let (y0, y1) = (STAIR_FRONT - 0.01, STAIR_FRONT + 0.09);
    let newel = ([-0.1, y0, 0.0], [0.0, y1, 1.2]);
    set.block(stage, "rail", newel.0, newel.1, &[Side::Bottom]);
    let newel = ([head, y0, GALLERY], [head + 0.1, y1, GALLERY + 1.2]);
    set.block(stage, "rail", newel.0, newel.1, &[Side::Bottom]);
}

fn gallery(set: &mut Set) {
    set.object("gallery");
    let stage = Frame::at([0.0; 3]);
    let (left, front, near) = (GALLERY_LEFT, CEILING_FROM, half_width(CEILING_FROM));
    let ring = |z: f64| {
        let far = half_width(BACK);
        [
            [left, front, z],
            [near, front, z],
            [far, BACK, z],
            [left, BACK, z],
        ]
    };
    let mut under = ring(UNDER_GALLERY);
    under.reverse();
    set.face(stage, "oak", &ring(GALLERY));
    set.face(stage, "timber", &under);
    let edge = [UNDER_GALLERY, GALLERY];
    set.upright(stage, "rail", front, [left, near], edge);
    // Only up to the stair; behind it is the top step.
    let (x, y) = (left, STAIR_FRONT);
    let [z0, z1] = edge;
    set.face(
        stage,
        "rail",
        &[[x, y, z0], [x, front, z0], [x, front, z1], [x, y, z1]],
    );
    for x in [3.15, 4.08] {
        let (low, high) = ([x - 0.05, 2.5, 2.42], [x + 0.05, 4.0, UNDER_GALLERY]);
        set.block(stage, "timber", low, high, &[Side::Top]);
    }
    // A chest left up there.
    let chest = right_wall().moved([along_right(4.4), -0.62, GALLERY]);
    set.block(
        chest,
        "bench",
        [0.0, 0.0, 0.0],
        [0.9, 0.5, 0.5],
        &[Side::Bottom],
    );
}

fn gallery_rail(set: &mut Set) {
    set.object("balustrade");
    let stage = Frame::at([0.0; 3]);
    let [low, high] = RAIL.map(|z| GALLERY + z);
    let near = CEILING_FROM + 0.02;
    let ends = [Side::Top, Side::Bottom, Side::Back];
    for i in 0..7_u32 {
        let x = 3.02 + 0.34 * f64::from(i);
        let corner = (
            [x - 0.02, near + 0.02, GALLERY],
            [x + 0.02, near + 0.06, low],
        );
        set.block(stage, "rail", corner.0, corner.1, &ends);
    }
    let right = half_width(near + 0.08) - 0.01;
    let rail = ([GALLERY_LEFT, near, low], [right, near + 0.08, high]);
    set.block(stage, "rail", rail.0, rail.1, &[Side::Right]);
    let ends = [Side::Top, Side::Bottom];
    for i in 0..3_u32 {
        let y = 2.86 + 0.36 * f64::from(i);
        let x = GALLERY_LEFT + 0.02;
        let corner = ([x, y - 0.02, GALLERY], [x + 0.04, y + 0.02, low]);
        set.block(stage, "rail", corner.0, corner.1, &ends);
    }
    let rail = (
        [GALLERY_LEFT, near + 0.08, low],
        [GALLERY_LEFT + 0.08, STAIR_FRONT - 0.01, high],
    );
    set.block(stage, "rail", rail.0, rail.1, &[Side::Front, Side::Back]);
}
