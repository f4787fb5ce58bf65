//! Everything that glows, with the bodies that hold it.

use super::room::{
    BACK, GALLERY, UNDER_GALLERY, along_left, along_right, hearth, left_wall, right_wall,
};
use super::solid::{Frame, Set, Side, diamond, hexagon};

/// Positions of the three hanging lamps' flames; their spots hang 0.1 m lower.
pub const LAMPS: [([f64; 3], &str); 3] = [
    ([-2.1, 0.35, 2.2], "lamp1_glass"),
    ([0.1, 2.0, 2.3], "lamp2_glass"),
    ([2.5, 0.35, 2.2], "lamp3_glass"),
];

/// Hangs everything.
pub fn build(set: &mut Set) {
    set.object("lamp");
    for ([x, y, z], glass) in LAMPS {
        hanging_lamp(set, Frame::at([x, y, z]), glass);
    }
    bar_lights(set);
    sconces(set);
    fire(set);
    overhead(set);
    footlights(set);
    exit_sign(set);
}

/// A lamp with its glass's middle at the frame's origin: a chimney of four panes under a shade.
fn hanging_lamp(set: &mut Set, at: Frame, glass: &'static str) {
    let (low, high) = (-0.07, 0.07);
    set.mantle(at, glass, &diamond(), &[[0.06, low], [0.06, high]]);
    set.underside(at, "iron", &diamond(), [0.06, low]);
    set.underside(at, "enamel", &hexagon(), [0.3, high]);
    set.mantle(at, "iron", &hexagon(), &[[0.3, high], [0.06, 0.26]]);
    set.lid(at, "iron", &hexagon(), [0.06, 0.26]);
    // The middle lamp's rod continues into the dark above the beams.
    set.mantle(at, "iron", &diamond(), &[[0.018, 0.26], [0.018, 2.15]]);
}

fn bar_lights(set: &mut Set) {
    set.object("bar_light");
    for x in [3.6, 4.55] {
        let at = Frame::at([x, 3.12, 2.08]);
        set.underside(at, "bar_glass", &hexagon(), [0.11, 0.0]);
        set.mantle(at, "iron", &hexagon(), &[[0.13, 0.0], [0.03, 0.14]]);
        let rod = ([-0.01, -0.01, 0.14], [0.01, 0.01, UNDER_GALLERY - 2.08]);
        let ends = [Side::Top, Side::Bottom, Side::Back];
        set.block(at, "iron", rod.0, rod.1, &ends);
    }
    // A strip under the gallery, behind a board, facing down and back at the bottles.
    let stage = Frame::at([0.0; 3]);
    let (x0, x1) = (3.0, 4.9);
    let (front, back) = ((4.24, 2.44), (4.3, 2.5));
    set.face(
        stage,
        "shelf_strip",
        &[
            [x0, front.0, front.1],
            [x0, back.0, back.1],
            [x1, back.0, back.1],
            [x1, front.0, front.1],
        ],
    );
    let board = ([x0, 4.18, 2.38], [x1, 4.22, UNDER_GALLERY]);
    set.block(stage, "timber", board.0, board.1, &[Side::Top]);
}

/// Cups on the walls that throw their light up: the audience sees the glow, not the flame.
fn sconces(set: &mut Set) {
    set.object("sconce");
    let back = Frame::at([0.0, BACK, 0.0]);
    for at in [
        back.moved([-1.45, 0.0, 2.15]),
        back.moved([0.35, 0.0, 2.35]),
        left_wall().moved([along_left(2.4), 0.0, 2.15]),
        right_wall().moved([along_right(0.1), 0.0, 2.15]),
    ] {
        cup(set, at, "sconce_flame");
    }
    for x in [3.35, 4.45] {
        cup(set, back.moved([x, 0.0, GALLERY + 1.15]), "gallery_flame");
    }
}

fn cup(set: &mut Set, wall: Frame, flame: &'static str) {
    let (foot, head) = (-0.2, 0.0);
    let ring = |half: f64, depth: f64, z: f64| {
        [
            [-half, -depth, z],
            [half, -depth, z],
            [half, 0.0, z],
            [-half, 0.0, z],
        ]
    };
    let (low, high) = (ring(0.04, 0.06, foot), ring(0.09, 0.15, head));
    set.hexahedron(wall, "iron", low, high, &[Side::Back, Side::Top]);
    set.face(wall, flame, &high);
}

/// Four tongues of flame, in two banks that flicker against each other.
fn fire(set: &mut Set) {
    set.object("fire");
    for (x, y, width, height, bank) in [
        (1.08, 0.22, 0.1, 0.46, "fire_left"),
        (1.42, 0.27, 0.11, 0.58, "fire_left"),
        (1.24, 0.28, 0.1, 0.64, "fire_right"),
        (1.58, 0.22, 0.09, 0.4, "fire_right"),
    ] {
        let foot = 0.17;
        let tongue = [
            [x, y, foot],
            [x + width, y, foot + 0.35 * height],
            [x + 0.02, y, foot + height],
            [x - width, y, foot + 0.35 * height],
        ];
        set.face(hearth(), bank, &tongue);
    }
}

/// The washes above the open roof, invisible to the audience.
fn overhead(set: &mut Set) {
    set.object("overhead");
    let stage = Frame::at([0.0, 0.0, 7.2]);
    for (glass, [y0, y1]) in [("top_warm", [-0.9, -0.1]), ("top_blue", [0.9, 1.7])] {
        let (left, right) = (-2.4, 2.4);
        set.face(
            stage,
            glass,
            &[
                [left, y1, 0.0],
                [right, y1, 0.0],
                [right, y0, 0.0],
                [left, y0, 0.0],
            ],
        );
    }
}

fn footlights(set: &mut Set) {
    set.object("footlight");
    for x in [-3.45, -1.15, 1.15, 3.45] {
        let at = Frame::at([x, -4.4, 0.0]);
        let (low, high) = ([-0.16, 0.0, 0.0], [0.16, 0.14, 0.15]);
        set.block(at, "iron", low, high, &[Side::Bottom, Side::Back]);
        let [x0, _, z0] = low;
        let [x1, y, z1] = high;
        set.face(
            at,
            "foot_glass",
            &[[x1, y, z0], [x0, y, z0], [x0, y, z1], [x1, y, z1]],
        );
    }
}

/// The legally required exit sign: on the proscenium, to the left.
fn exit_sign(set: &mut Set) {
    set.object("exit_sign");
    let at = Frame::at([-5.03, -2.5, 3.3]);
    let (low, high) = ([-0.11, 0.0, -0.06], [0.11, 0.06, 0.06]);
    set.block(at, "iron", low, high, &[Side::Front]);
    let [x0, y, z0] = low;
    let [x1, _, z1] = high;
    set.upright(at, "exit_sign", y, [x0, x1], [z0, z1]);
}
