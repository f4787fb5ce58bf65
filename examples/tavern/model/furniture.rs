//! Tables, benches, stools, mugs, barrels, the bar and its bottles.

use super::room::{BACK, right_wall};
use super::solid::{Frame, Set, Side, diamond, octagon};

const TABLE: f64 = 0.77;
const FLAT: [Side; 2] = [Side::Top, Side::Bottom];

/// Places everything.
pub fn build(set: &mut Set) {
    let left = Frame::facing([-2.1, 0.3, 0.0], [1.0, 0.16]);
    let right = Frame::facing([2.5, 0.35, 0.0], [1.0, -0.2]);
    for table in [left, right] {
        set.object("table");
        trestle(set, table);
        set.object("bench");
        bench(set, table.moved([0.0, -0.68, 0.0]));
        bench(set, table.moved([0.05, 0.68, 0.0]));
    }
    set.object("mug");
    for (table, x, y) in [
        (left, -0.5, -0.2),
        (left, 0.15, 0.18),
        (left, 0.62, -0.12),
        (right, -0.4, 0.15),
        (right, 0.45, -0.18),
    ] {
        mug(set, table.moved([x, y, TABLE]));
    }
    let round = Frame::at([0.1, 2.0, 0.0]);
    round_table(set, round);
    set.object("stool");
    for [x, y] in [[-1.0, -0.3], [0.95, -0.45], [0.75, 0.8], [-0.6, 0.85]] {
        stool(set, round.moved([x, y, 0.0]), 0.46);
    }
    bar(set);
    set.object("stool");
    for x in [3.55, 4.5] {
        stool(set, Frame::at([x, 2.25, 0.0]), 0.7);
    }
    set.object("barrel");
    for [x, y] in [[-4.95, -0.1], [-4.45, -0.75], [4.9, 1.3]] {
        barrel(set, Frame::at([x, y, 0.0]));
    }
    picture(set);
}

fn trestle(set: &mut Set, table: Frame) {
    let top = ([-0.95, -0.4, TABLE - 0.05], [0.95, 0.4, TABLE]);
    set.block(table, "oak", top.0, top.1, &[]);
    for x in [-0.72, 0.64] {
        let leg = ([x, -0.28, 0.0], [x + 0.08, 0.28, TABLE - 0.05]);
        set.block(table, "oak", leg.0, leg.1, &FLAT);
    }
    let stretcher = ([-0.64, -0.03, 0.28], [0.64, 0.03, 0.38]);
    let ends = [Side::Left, Side::Right];
    set.block(table, "oak", stretcher.0, stretcher.1, &ends);
}

fn bench(set: &mut Set, at: Frame) {
    let seat = ([-0.85, -0.14, 0.42], [0.85, 0.14, 0.465]);
    set.block(at, "bench", seat.0, seat.1, &[]);
    for x in [-0.66, 0.6] {
        let leg = ([x, -0.11, 0.0], [x + 0.06, 0.11, 0.42]);
        set.block(at, "bench", leg.0, leg.1, &FLAT);
    }
}

fn round_table(set: &mut Set, at: Frame) {
    set.object("table");
    let under = TABLE - 0.045;
    set.mantle(at, "oak", &octagon(), &[[0.66, under], [0.66, TABLE]]);
    set.lid(at, "oak", &octagon(), [0.66, TABLE]);
    set.underside(at, "oak", &octagon(), [0.66, under]);
    set.mantle(at, "oak", &diamond(), &[[0.09, 0.08], [0.09, under]]);
    set.block(
        at,
        "oak",
        [-0.3, -0.3, 0.0],
        [0.3, 0.3, 0.08],
        &[Side::Bottom],
    );
    set.object("mug");
    mug(set, at.moved([-0.3, -0.1, TABLE]));
    let bottle = at.moved([0.2, 0.12, TABLE]);
    let rings = [[0.06, 0.0], [0.06, 0.17], [0.02, 0.24], [0.02, 0.31]];
    set.mantle(bottle, "bottle_green", &diamond(), &rings);
    set.lid(bottle, "bottle_green", &diamond(), [0.02, 0.31]);
}

fn mug(set: &mut Set, at: Frame) {
    set.mantle(at, "pewter", &diamond(), &[[0.06, 0.0], [0.05, 0.13]]);
    set.lid(at, "pewter", &diamond(), [0.05, 0.13]);
}

fn stool(set: &mut Set, at: Frame, height: f64) {
    let under = height - 0.04;
    let seat = ([-0.16, -0.16, under], [0.16, 0.16, height]);
    set.block(at, "bench", seat.0, seat.1, &[Side::Bottom]);
    set.mantle(at, "bench", &diamond(), &[[0.15, 0.0], [0.07, under]]);
}

fn barrel(set: &mut Set, at: Frame) {
    let rings = [[0.27, 0.0], [0.345, 0.45], [0.27, 0.9]];
    set.mantle(at, "barrel", &octagon(), &rings);
    set.lid(at, "barrel", &octagon(), [0.27, 0.9]);
}

fn bar(set: &mut Set) {
    let stage = Frame::at([0.0; 3]);
    set.object("bar");
    let counter = ([3.1, 2.9, 0.0], [5.2, 3.4, 1.02]);
    set.block(stage, "counter", counter.0, counter.1, &FLAT);
    let slab = ([3.02, 2.82, 1.02], [5.25, 3.46, 1.08]);
    set.block(stage, "oak", slab.0, slab.1, &[]);
    for i in 0..3_u32 {
        let x = 3.18 + 0.68 * f64::from(i);
        let panel = ([x, 2.87, 0.16], [x + 0.58, 2.9, 0.88]);
        set.block(stage, "counter", panel.0, panel.1, &[Side::Back]);
    }
    set.object("shelf");
    for x in [2.98, 4.87] {
        let cheek = ([x, 4.7, 0.0], [x + 0.06, BACK, 2.36]);
        set.block(stage, "oak", cheek.0, cheek.1, &[Side::Back, Side::Bottom]);
    }
    let shelves = [1.22, 1.6, 1.98];
    for z in shelves {
        let board = ([3.04, 4.72, z - 0.04], [4.87, BACK, z]);
        let ends = [Side::Back, Side::Left, Side::Right];
        set.block(stage, "oak", board.0, board.1, &ends);
    }
    set.object("bottle");
    let [low, middle, high] = shelves;
    for (x, z, height, glass) in [
        (3.2, low, 0.25, "bottle_amber"),
        (3.8, low, 0.27, "bottle_green"),
        (4.35, low, 0.25, "bottle_amber"),
        (3.3, middle, 0.27, "bottle_green"),
        (3.95, middle, 0.24, "bottle_amber"),
        (4.6, middle, 0.27, "bottle_green"),
        (3.45, high, 0.24, "pewter"),
        (4.05, high, 0.26, "bottle_amber"),
    ] {
        let (a, b) = ([x, 4.8, z], [x + 0.09, 4.89, z + height]);
        set.block(stage, glass, a, b, &[Side::Bottom]);
    }
}

fn picture(set: &mut Set) {
    set.object("picture");
    let depth = -0.05;
    let [x0, x1, z0, z1] = [-0.55, 0.55, -0.4, 0.4];
    let at = right_wall().moved([3.9, 0.0, 2.4]);
    set.block(
        at,
        "gilt",
        [x0, depth, z0],
        [x1, 0.0, z1],
        &[Side::Back, Side::Front],
    );
    let inner = [x0 + 0.08, x1 - 0.08, z0 + 0.08, z1 - 0.08];
    rim(set, at, depth, [x0, x1, z0, z1], inner);
    let [x0, x1, z0, z1] = inner;
    set.upright(at, "canvas", depth, [x0, x1], [z0, z1]);
}

/// The front of a picture's frame: four strips around the canvas.
fn rim(set: &mut Set, at: Frame, y: f64, outer: [f64; 4], inner: [f64; 4]) {
    let ([x0, x1, z0, z1], [a, b, c, d]) = (outer, inner);
    set.upright(at, "gilt", y, [x0, x1], [z0, c]);
    set.upright(at, "gilt", y, [x0, x1], [d, z1]);
    set.upright(at, "gilt", y, [x0, a], [c, d]);
    set.upright(at, "gilt", y, [b, x1], [c, d]);
}
