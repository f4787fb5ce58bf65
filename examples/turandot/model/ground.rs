//! The square, the stair, the terrace, and the background.

use super::solid::{Frame, Set, Side};

/// The height of the terrace.
pub const TERRACE: f64 = 2.4;
/// Number of steps of 0.24 m by 0.3 m up to it.
const STEPS: u32 = 10;
const STAIR: [f64; 2] = [5.5, 8.5];
const HALF_STAIR: f64 = 4.5;
/// Boundary between the stair's parapets and the terrace's wall.
const PARAPET: f64 = 4.9;
/// Depths of terrace, projections and cloth.
const TERRACE_BACK: f64 = 18.5;
const CLOTH: f64 = 34.0;

const COLUMNS: [f64; 14] = [
    -15.0, -12.5, -10.0, -7.5, -4.9, -3.2, -1.5, 1.5, 3.2, 4.9, 7.5, 10.0, 12.5, 15.0,
];
const ROWS: [f64; 11] = [-7.0, -5.0, -3.4, -1.8, -0.2, 1.4, 2.9, 4.3, 5.5, 7.0, 8.5];

/// Builds the ground.
pub fn build(set: &mut Set) {
    square(set);
    stair(set);
    for side in [-1.0, 1.0] {
        wall(set, side);
        balustrade(set, side);
    }
    behind(set);
}

/// Slabs of three tones, and the emperor's way of lighter stone.
fn square(set: &mut Set) {
    set.object("square");
    let stage = Frame::at([0.0; 3]);
    let spans = |edges: &[f64]| -> Vec<[f64; 2]> {
        let next = edges.iter().skip(1);
        edges.iter().zip(next).map(|(a, b)| [*a, *b]).collect()
    };
    let tones = ["slab_mid", "slab_light", "slab_dark"];
    for (row, [y0, y1]) in spans(&ROWS).into_iter().enumerate() {
        for (column, [x0, x1]) in spans(&COLUMNS).into_iter().enumerate() {
            let [front, _] = STAIR;
            if y0 >= front && x0 >= -PARAPET && x1 <= PARAPET {
                continue; // under the stair
            }
            let tone = match x0 > -2.0 && x1 < 2.0 {
                true => "way",
                false => tones.get((2 * row + column) % 3).copied().unwrap_or("way"),
            };
            let slab = [[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]];
            set.face(stage, tone, &slab);
        }
    }
}

fn stair(set: &mut Set) {
    set.object("stair");
    let stage = Frame::at([0.0; 3]);
    let [front, back] = STAIR;
    let (rise, run) = (
        TERRACE / f64::from(STEPS),
        (back - front) / f64::from(STEPS),
    );
    let h = HALF_STAIR;
    for step in 0..STEPS {
        let (y, z) = (front + run * f64::from(step), rise * f64::from(step));
        // The way continues up the middle.
        for ([x0, x1], stone) in [
            ([-h, -1.5], "terrace"),
            ([-1.5, 1.5], "way"),
            ([1.5, h], "terrace"),
        ] {
            set.upright(stage, stone, y, [x0, x1], [z, z + rise]);
            if step + 1 < STEPS {
                let (y1, z) = (y + run, z + rise);
                set.face(
                    stage,
                    stone,
                    &[[x0, y, z], [x1, y, z], [x1, y1, z], [x0, y1, z]],
                );
            }
        }
    }
    let high = TERRACE + 0.85;
    let thick = [0.0, PARAPET - h];
    for (at, sign) in [
        (Frame::facing([-h, 0.0, 0.0], [0.0, 1.0]), 1.0),
        (Frame::facing([h, 0.0, 0.0], [0.0, -1.0]), -1.0),
    ] {
        let mut outline = vec![
            [sign * (front - 0.5), 0.0],
            [sign * back, 0.0],
            [sign * back, high],
            [sign * (front + 0.1), 0.95],
            [sign * (front - 0.5), 0.95],
        ];
        if sign < 0.0 {
            outline.reverse();
        }
        // Concave at the newel: two convex parts with a hidden common side.
        let cut = sign * (front + 0.1);
        for side in [sign, -sign] {
            let part = part(&outline, cut, side);
            let next = part.iter().cycle().skip(1);
            let shared = |([p, _], [q, _]): (&[f64; 2], &[f64; 2])| p == &cut && q == &cut;
            let open: Vec<usize> = part.iter().zip(next).position(shared).into_iter().collect();
            set.extrude(at, "marble", &part, thick, &open);
        }
    }
}

/// The part of an outline on one side of a vertical cut through one of its corners.
fn part(outline: &[[f64; 2]], cut: f64, side: f64) -> Vec<[f64; 2]> {
    let mut out: Vec<[f64; 2]> = Vec::new();
    let next = outline.iter().cycle().skip(1);
    for ([px, pz], [qx, qz]) in outline.iter().zip(next) {
        let (p, q) = ((cut - px) * side, (cut - qx) * side);
        if p >= 0.0 {
            out.push([*px, *pz]);
        }
        if (p > 1e-9 && q < -1e-9) || (p < -1e-9 && q > 1e-9) {
            let t = p / (p - q);
            out.push([cut, pz + t * (qz - pz)]);
        }
    }
    out
}

/// The terrace's front on one side: plinth, reliefs between pilasters, a cornice.
fn wall(set: &mut Set, side: f64) {
    set.object("terrace");
    let [_, y] = STAIR;
    let stage = Frame::at([0.0; 3]);
    let mut upright = |stone, a: f64, b: f64, z: [f64; 2]| {
        let (a, b) = (side * a, side * b);
        set.upright(stage, stone, y, [a.min(b), a.max(b)], z);
    };
    let end = 16.0;
    upright("terrace", PARAPET, end, [0.0, 0.4]);
    upright("marble", PARAPET, end, [1.95, TERRACE]);
    for i in 0..6_u32 {
        let x = PARAPET + 1.85 * f64::from(i);
        upright("marble", x, x + 0.3, [0.4, 1.95]);
        upright("relief", x + 0.3, (x + 1.85).min(end), [0.4, 1.95]);
    }
}

/// Posts and panels along the terrace's edge.
fn balustrade(set: &mut Set, side: f64) {
    set.object("balustrade");
    let [_, y] = STAIR;
    let stage = Frame::at([0.0, 0.0, TERRACE]);
    for i in 0..6_u32 {
        let x = side * (PARAPET + 0.15 + 1.2 * f64::from(i));
        let (low, high) = ([x - 0.09, y + 0.05, 0.0], [x + 0.09, y + 0.23, 0.86]);
        set.block(
            stage,
            "marble",
            low,
            high,
            &[Side::Bottom, Side::Top, Side::Back],
        );
        let (foot, head) = (0.86, 1.04);
        let ring = |r: f64, z: f64| {
            let (cx, cy) = (x, y + 0.14);
            [
                [cx - r, cy - r, z],
                [cx + r, cy - r, z],
                [cx + r, cy + r, z],
                [cx - r, cy + r, z],
            ]
        };
        let out_of_sight = [Side::Bottom, Side::Back, Side::Top];
        set.hexahedron(
            stage,
            "marble",
            ring(0.13, foot),
            ring(0.04, head),
            &out_of_sight,
        );
        if i < 5 {
            let to = x + side * 1.2;
            let (a, b) = (x.min(to) + 0.09, x.max(to) - 0.09);
            let ends = [Side::Left, Side::Right, Side::Bottom, Side::Back];
            set.block(
                stage,
                "relief",
                [a, y + 0.1, 0.1],
                [b, y + 0.18, 0.52],
                &ends,
            );
            set.block(
                stage,
                "marble",
                [a, y + 0.08, 0.62],
                [b, y + 0.2, 0.74],
                &ends,
            );
        }
    }
}

/// The top of the terrace, the floor behind it, the row of lamps at the foot of the cloth.
fn behind(set: &mut Set) {
    set.object("terrace");
    let stage = Frame::at([0.0; 3]);
    let flat = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64| {
        [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
    };
    let [_, front] = STAIR;
    for [x0, x1] in [[-16.0, -5.2], [-5.2, -1.5], [1.5, 5.2], [5.2, 16.0]] {
        set.face(
            stage,
            "terrace",
            &flat([x0, x1], [front, TERRACE_BACK], TERRACE),
        );
    }
    set.face(stage, "way", &flat([-1.5, 1.5], [front, 10.2], TERRACE));
    set.object("backstage");
    set.face(
        stage,
        "dark_floor",
        &flat([-28.0, 28.0], [TERRACE_BACK, CLOTH], 0.0),
    );
    set.object("cloth");
    set.upright(stage, "cloth", CLOTH, [-28.0, 28.0], [0.0, 25.0]);
    set.object("ground_row");
    let (x, y) = (25.0, CLOTH - 1.2);
    let row = [
        [x, y, 0.5],
        [-x, y, 0.5],
        [-x, y - 0.3, 0.75],
        [x, y - 0.3, 0.75],
    ];
    set.face(stage, "ground_row", &row);
}
