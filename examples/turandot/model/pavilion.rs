//! The two pavilions on the terrace, open between their columns, with their lanterns.

use super::roof::{Roof, bar, column, finial, roof};
use super::scene_key::TERRACE;
use super::solid::{Frame, Set, Side, hexagon};

/// Positions of the pavilions, and the materials of their lanterns: red, yellow.
const PLACES: [(f64, [&str; 2]); 2] = [
    (-7.4, ["red_left", "yellow_left"]),
    (7.4, ["red_right", "yellow_right"]),
];

/// Builds both.
pub fn build(set: &mut Set) {
    for (x, [red, yellow]) in PLACES {
        let at = Frame::at([x, 12.2, TERRACE]);
        set.object("pavilion");
        house(set, at);
        set.object("lantern");
        for x in [-1.25, 1.25] {
            lantern(set, at.moved([x, -1.95, 2.0]), red, 1.0);
        }
        lantern(set, at.moved([0.0, -1.2, 1.85]), yellow, 1.35);
    }
}

fn house(set: &mut Set, at: Frame) {
    let base = ([-2.2, -2.2, 0.0], [2.2, 2.2, 0.25]);
    set.block(at, "marble", base.0, base.1, &[Side::Bottom]);
    for [x, y] in [
        [-1.8, -1.8],
        [-0.62, -1.8],
        [0.62, -1.8],
        [1.8, -1.8],
        [1.8, 1.8],
        [-1.8, 1.8],
    ] {
        let foot = at.moved([x, y, 0.25]);
        match y < 0.0 {
            true => set.mantle(foot, "lacquer", &hexagon(), &[[0.15, 0.0], [0.13, 2.5]]),
            false => column(set, foot, "lacquer", &[[0.15, 0.0], [0.13, 2.5]]),
        }
    }
    let beam = ([-1.95, -1.95, 2.75], [1.95, 1.95, 3.02 + 0.12]);
    set.block(at, "beam", beam.0, beam.1, &[Side::Top]);
    // A wall behind, lit by the lanterns.
    set.block(
        at,
        "wall",
        [-1.8, 1.7, 0.25],
        [1.8, 1.8, 2.75],
        &[Side::Top, Side::Bottom, Side::Left, Side::Right],
    );
    railing(set, at);
    let lower = Roof {
        tile: "tile",
        eave: [3.05, 3.05, 3.02],
        top: [1.05, 1.05, 4.35],
        wall: [1.95, 1.95],
        lift: 0.6,
    };
    roof(set, at, lower);
    let shell = [Side::Top, Side::Bottom, Side::Back];
    set.block(at, "wall", [-1.05, -1.05, 4.1], [1.05, 1.05, 4.9], &shell);
    let upper = Roof {
        tile: "tile",
        eave: [1.8, 1.8, 4.78],
        top: [0.08, 0.08, 6.5],
        wall: [1.05, 1.05],
        lift: 0.45,
    };
    roof(set, at, upper);
    finial(set, at.moved([0.0, 0.0, 6.5]), 0.7);
}

fn railing(set: &mut Set, at: Frame) {
    for [x0, x1] in [[-1.66, -0.76], [0.76, 1.66]] {
        let ends = [Side::Left, Side::Right, Side::Back];
        set.block(at, "lacquer", [x0, -1.84, 0.85], [x1, -1.76, 0.93], &ends);
        set.block(at, "lacquer", [x0, -1.84, 0.42], [x1, -1.76, 0.48], &ends);
    }
}

/// A lantern with its middle at the frame's origin: a paper barrel between two lids, on a cord.
pub fn lantern(set: &mut Set, at: Frame, paper: &'static str, size: f64) {
    let (r, h) = (0.24 * size, 0.27 * size);
    set.mantle(at, paper, &hexagon(), &[[r, -h], [r, h]]);
    set.underside(at, "gilt", &hexagon(), [r, -h]);
    let cap = [[r * 1.1, h], [0.3 * r, h + 0.1 * size]];
    set.underside(at, "gilt", &hexagon(), [r * 1.1, h]);
    column(set, at, "gilt", &cap);
    bar(
        set,
        at,
        "lacquer",
        [-0.04 * size, 0.04 * size],
        [-h - 0.4 * size, -h],
    );
    bar(set, at, "iron", [-0.012, 0.012], [h + 0.1 * size, h + 0.45]);
}
