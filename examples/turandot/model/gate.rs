//! The gatehouses left and right: rooms whose light falls through lattices, with papered windows
//! above.

use super::pagoda::window;
use super::pavilion::lantern;
use super::roof::{Roof, column, roof};
use super::solid::{Frame, Set, Side};

const HALF: f64 = 2.6;
const DEPTH: f64 = 4.0;
const HEAD: f64 = 3.5;
/// Openings from (x0, z0) to (x1, z1): window, door, window.
const OPENINGS: [[f64; 4]; 3] = [
    [-2.25, 0.75, -1.1, 2.6],
    [-0.75, 0.0, 0.75, 2.6],
    [1.1, 0.75, 2.25, 2.6],
];

/// Position of a gatehouse, from the middle of its front: local Y leads inside.
pub fn place(side: f64) -> Frame {
    Frame::facing([side * 9.7, 1.3, 0.0], [1.0, -0.36 * side])
}

/// Builds both.
pub fn build(set: &mut Set) {
    for (side, paper, red) in [
        (-1.0, "paper_left", "red_left"),
        (1.0, "paper_right", "red_right"),
    ] {
        let at = place(side);
        set.object("gatehouse");
        front(set, at);
        room(set, at);
        upper(set, at, paper);
        roofs(set, at);
        set.object("lantern");
        lantern(set, at.moved([-0.95 * side, -0.75, 2.55]), red, 1.3);
    }
}

fn front(set: &mut Set, at: Frame) {
    let mut upright = |x: [f64; 2], z: [f64; 2]| set.upright(at, "wall", 0.0, x, z);
    upright([-HALF, -0.75], [0.0, 0.75]);
    upright([0.75, HALF], [0.0, 0.75]);
    for x in [[-HALF, -2.25], [-1.1, -0.75], [0.75, 1.1], [2.25, HALF]] {
        upright(x, [0.75, 2.6]);
    }
    upright([-HALF, HALF], [2.6, HEAD + 0.12]);
    for [x0, z0, x1, z1] in OPENINGS {
        let outline = [[x0, z0], [x1, z0], [x1, z1], [x0, z1]];
        let open: &[usize] = if z0 > 0.0 { &[] } else { &[0] };
        set.reveal(at, "door", &outline, [0.0, 0.2], open);
        if z0 > 0.0 {
            lattice(set, at, [x0, x1], [z0, z1]);
        }
    }
    for x in [-HALF, -0.92, 0.92, HALF] {
        let foot = at.moved([x, -0.2, 0.0]);
        column(set, foot, "marble", &[[0.25, 0.0], [0.19, 0.24]]);
        column(set, foot, "lacquer", &[[0.15, 0.24], [0.13, HEAD - 0.4]]);
    }
    let ends = [Side::Back];
    set.block(
        at,
        "beam",
        [-HALF - 0.2, -0.34, HEAD - 0.4],
        [HALF + 0.2, -0.02, HEAD],
        &ends,
    );
}

fn lattice(set: &mut Set, at: Frame, [x0, x1]: [f64; 2], [z0, z1]: [f64; 2]) {
    let bar = 0.028;
    for i in 1..6_u32 {
        let x = x0 + (x1 - x0) * f64::from(i) / 6.0;
        set.upright(at, "lattice", 0.1, [x - bar, x + bar], [z0, z1]);
    }
    for i in 1..5_u32 {
        let z = z0 + (z1 - z0) * f64::from(i) / 5.0;
        set.upright(at, "lattice", 0.08, [x0, x1], [z - bar, z + bar]);
    }
}

/// The inside of the room: three walls, ceiling and floor, facing inwards.
fn room(set: &mut Set, at: Frame) {
    let (x, y0, y1, z0, z1) = (HALF - 0.1, 0.2, DEPTH - 0.2, 0.04, HEAD - 0.1);
    let mut face = |corners: [[f64; 3]; 4]| set.face(at, "interior", &corners);
    face([[-x, y1, z0], [x, y1, z0], [x, y1, z1], [-x, y1, z1]]);
    face([[-x, y0, z0], [-x, y1, z0], [-x, y1, z1], [-x, y0, z1]]);
    face([[x, y1, z0], [x, y0, z0], [x, y0, z1], [x, y1, z1]]);
    face([[-x, y1, z1], [x, y1, z1], [x, y0, z1], [-x, y0, z1]]);
    face([[-x, y0, z0], [x, y0, z0], [x, y1, z0], [-x, y1, z0]]);
    let open = [Side::Front, Side::Top, Side::Bottom];
    set.block(
        at,
        "wall",
        [-HALF, 0.0, 0.0],
        [HALF, DEPTH, HEAD + 0.12],
        &open,
    );
    // A table and a tall jar, visible against the back wall.
    let table = ([-1.9, 2.2, 0.8], [-0.6, 2.9, 0.88]);
    set.block(at, "door", table.0, table.1, &[Side::Back]);
    let jar = at.moved([1.5, 2.6, 0.04]);
    let rings = [[0.16, 0.0], [0.32, 0.55], [0.12, 1.0], [0.18, 1.15]];
    column(set, jar, "beam", &rings);
}

fn upper(set: &mut Set, at: Frame, paper: &'static str) {
    let centre = at.moved([0.0, DEPTH / 2.0, 0.0]);
    let (x, y) = (2.1, 1.5);
    let open = [Side::Top, Side::Bottom, Side::Back];
    set.block(centre, "wall", [-x, -y, 4.3], [x, y, 6.62], &open);
    set.block(
        centre,
        "beam",
        [-x - 0.1, -y - 0.12, 6.2],
        [x + 0.1, -y, 6.5],
        &[Side::Back],
    );
    for place in [-1.35, 0.0, 1.35] {
        window(
            set,
            centre.moved([place, -y, 0.0]),
            paper,
            0.45,
            [5.0, 6.05],
        );
    }
    for place in [-2.0, -0.68, 0.68, 2.0] {
        let foot = centre.moved([place, -y - 0.14, 4.6]);
        column(set, foot, "lacquer", &[[0.11, 0.0], [0.1, 1.6]]);
    }
}

fn roofs(set: &mut Set, at: Frame) {
    let centre = at.moved([0.0, DEPTH / 2.0, 0.0]);
    let lower = Roof {
        tile: "tile",
        eave: [3.6, 3.0, HEAD],
        top: [2.1, 1.5, 5.0],
        wall: [HALF, DEPTH / 2.0],
        lift: 0.46,
    };
    roof(set, centre, lower);
    let over = Roof {
        tile: "tile",
        eave: [3.2, 2.6, 6.5],
        top: [1.7, 0.08, 8.6],
        wall: [2.1, 1.5],
        lift: 0.6,
    };
    roof(set, centre, over);
    let ridge = ([-1.8, -0.12, 8.5], [1.8, 0.12, 8.85]);
    set.block(
        centre,
        "gilt",
        ridge.0,
        ridge.1,
        &[Side::Bottom, Side::Back],
    );
}
