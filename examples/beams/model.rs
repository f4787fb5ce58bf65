//! Builds the set of Beams: `cargo run -p footlight-studies --bin beams_model` writes `beams.obj`,
//! `beams.mtl` and the two gobos `dots.png` and `spokes.png` next to this file.
//!
//! A concert stage in a black hall: deck, back wall, three trusses with lamps, risers, a drum kit,
//! amplifiers and monitors. Metres; X to stage left, Y upstage, Z up here, Y up in the OBJ file.
//! Every face is convex and planar, its vertices counter-clockwise seen from the front. The numbers
//! are equal on every machine; a test compares the files byte for byte, the gobos pixel for pixel.

use std::path::Path;

#[path = "../tavern/model/finish.rs"]
#[allow(dead_code, reason = "the paint shop of the tavern can do more")]
mod finish;
#[path = "../tavern/model/solid.rs"]
#[allow(dead_code, reason = "the carpenter of the tavern can do more")]
mod solid;
#[path = "../tavern/model/wavefront.rs"]
#[allow(dead_code, reason = "this set has no images")]
mod wavefront;

pub use solid::Set;
use solid::{Frame, Side, octagon};
use wavefront::{Material, paint};

/// Side of a gobo in pixels.
pub const SIDE: usize = 256;

/// The gobos by file name: transmitted share of light at a position from -1 to 1.
pub const GOBOS: [(&str, Gobo); 2] = [("dots", dots), ("spokes", spokes)];

/// Transmitted share of light at a position.
pub type Gobo = fn(f64, f64) -> f64;

/// Every material of the set.
const MATERIALS: &[Material] = &[
    paint("deck", [0.10, 0.10, 0.11]),
    paint("back_wall", [0.32, 0.32, 0.34]),
    paint("drape", [0.04, 0.04, 0.045]),
    paint("riser", [0.16, 0.15, 0.15]),
    paint("aluminium", [0.45, 0.45, 0.46]),
    paint("case", [0.05, 0.05, 0.055]),
    paint("shell", [0.42, 0.05, 0.04]),
    paint("head", [0.72, 0.70, 0.66]),
    paint("bronze", [0.52, 0.38, 0.16]),
    paint("grille", [0.12, 0.11, 0.10]),
];

/// Hanging lamps, by X, Y and Z of the lens: back truss, front truss, projectors, moving heads.
const HUNG: [[f64; 3]; 14] = [
    [-5.5, 4.4, 5.3],
    [-3.3, 4.4, 5.3],
    [-1.1, 4.4, 5.3],
    [1.1, 4.4, 5.3],
    [3.3, 4.4, 5.3],
    [5.5, 4.4, 5.3],
    [-2.5, -3.5, 5.7],
    [2.5, -3.5, 5.7],
    [-4.0, 1.0, 5.9],
    [4.0, 1.0, 5.9],
    [-5.6, 1.0, 5.7],
    [-1.8, 1.0, 5.7],
    [1.8, 1.0, 5.7],
    [5.6, 1.0, 5.7],
];
/// X of the lamps on the deck.
const STANDING: [f64; 4] = [-6.0, -2.2, 2.2, 6.0];

/// The whole set.
pub fn beams() -> Set {
    let mut set = Set::default();
    hall(&mut set);
    set.object("truss");
    for [y, z] in [[-3.5, 6.1], [1.0, 6.3], [4.4, 5.7]] {
        truss(&mut set, Frame::at([-7.0, y, z]));
    }
    lamps(&mut set);
    risers(&mut set);
    set.object("drums");
    drums(&mut set, Frame::at([0.0, 3.4, 0.5]));
    set.object("backline");
    for x in [-3.9, 3.9] {
        amplifier(&mut set, Frame::at([x, 3.5, 0.3]));
    }
    for x in [-2.4, 0.0, 2.4] {
        monitor(&mut set, Frame::at([x, -1.6, 0.0]));
    }
    set.object("microphone");
    let stand = Frame::at([0.0, -0.4, 0.0]);
    set.block(
        stand,
        "case",
        [-0.15, -0.15, 0.0],
        [0.15, 0.15, 0.03],
        &[Side::Bottom],
    );
    set.block(
        stand,
        "case",
        [-0.012, -0.012, 0.03],
        [0.012, 0.012, 1.5],
        &[Side::Bottom],
    );
    set.block(
        stand,
        "grille",
        [-0.03, -0.09, 1.5],
        [0.03, 0.03, 1.56],
        &[],
    );
    set
}

/// A black box with a grey back wall.
fn hall(set: &mut Set) {
    let room = Frame::at([0.0; 3]);
    let ([w, e], [s, n], top) = ([-8.5, 8.5], [-13.0, 6.0], 8.5);
    set.object("hall");
    set.face(
        room,
        "deck",
        &[[w, s, 0.0], [e, s, 0.0], [e, n, 0.0], [w, n, 0.0]],
    );
    set.face(
        room,
        "drape",
        &[[w, s, top], [w, n, top], [e, n, top], [e, s, top]],
    );
    set.upright(room, "back_wall", n, [w, e], [0.0, top]);
    set.face(
        room,
        "drape",
        &[[e, s, 0.0], [w, s, 0.0], [w, s, top], [e, s, top]],
    );
    set.face(
        room,
        "drape",
        &[[w, s, 0.0], [w, n, 0.0], [w, n, top], [w, s, top]],
    );
    set.face(
        room,
        "drape",
        &[[e, n, 0.0], [e, s, 0.0], [e, s, top], [e, n, top]],
    );
}

/// A box truss of 14 m, 0.3 m square: four chords, rungs, and diagonals in front and behind.
fn truss(set: &mut Set, at: Frame) {
    const LENGTH: f64 = 14.0;
    const BAYS: u32 = 14;
    let (chord, brace) = (0.025, 0.012);
    for (y, z) in [(-0.15, 0.0), (0.15, 0.0), (0.15, 0.3), (-0.15, 0.3)] {
        let low = [0.0, y - chord, z - chord];
        set.block(at, "aluminium", low, [LENGTH, y + chord, z + chord], &[]);
    }
    for bay in 0..BAYS {
        let [x0, x1] = [bay, bay + 1].map(|i| LENGTH * f64::from(i) / f64::from(BAYS));
        for z in [0.0, 0.3] {
            let (low, high) = (
                [x1 - brace, -0.125, z - brace],
                [x1 + brace, 0.125, z + brace],
            );
            set.block(at, "aluminium", low, high, &[Side::Front, Side::Back]);
        }
        // Up in one bay, down in the next.
        let [foot, head] = if bay % 2 == 0 { [x0, x1] } else { [x1, x0] };
        for y in [-0.15, 0.15] {
            let end = |x: f64, z: f64| {
                let ([l, r], [f, b]) = ([x - brace, x + brace], [y - brace, y + brace]);
                [[l, f, z], [r, f, z], [r, b, z], [l, b, z]]
            };
            let ends = (end(foot, chord), end(head, 0.3 - chord));
            set.hexahedron(at, "aluminium", ends.0, ends.1, &[Side::Top, Side::Bottom]);
        }
    }
}

/// The housings: behind the lens, above it for hanging lamps and below it for standing ones.
fn lamps(set: &mut Set) {
    set.object("lamps");
    for lens in HUNG {
        let at = Frame::at(lens);
        set.block(at, "case", [-0.14, -0.14, 0.06], [0.14, 0.14, 0.34], &[]);
        set.block(
            at,
            "case",
            [-0.02, -0.02, 0.34],
            [0.02, 0.02, 0.4],
            &[Side::Top, Side::Bottom],
        );
    }
    for x in STANDING {
        let at = Frame::at([x, 5.2, 0.0]);
        set.block(
            at,
            "case",
            [-0.2, -0.16, 0.0],
            [0.2, 0.16, 0.24],
            &[Side::Bottom],
        );
    }
}

fn risers(set: &mut Set) {
    set.object("risers");
    let stage = Frame::at([0.0; 3]);
    for (x0, x1, y0, y1, z) in [
        (-1.7, 1.7, 2.3, 4.7, 0.5),
        (-5.2, -2.6, 2.7, 4.3, 0.3),
        (2.6, 5.2, 2.7, 4.3, 0.3),
    ] {
        set.block(stage, "riser", [x0, y0, 0.0], [x1, y1, z], &[Side::Bottom]);
    }
}

fn drums(set: &mut Set, at: Frame) {
    // The bass drum lies; its head looks at the house.
    let round = |radius: f64, z: f64| octagon().map(|[x, y]| [x * radius, z + y * radius]);
    set.extrude(at, "shell", &round(0.29, 0.3), [-0.5, -0.1], &[]);
    let head = round(0.26, 0.3).map(|[x, z]| [x, -0.501, z]);
    set.face(at, "head", &head);
    for ([x, y, z], [radius, height]) in [
        ([-0.22, -0.25, 0.62], [0.16, 0.2]),
        ([0.22, -0.25, 0.62], [0.17, 0.22]),
        ([0.62, 0.1, 0.15], [0.22, 0.42]),
        ([-0.5, 0.15, 0.5], [0.18, 0.15]),
    ] {
        let drum = at.moved([x, y, z]);
        set.mantle(
            drum,
            "shell",
            &octagon(),
            &[[radius, 0.0], [radius, height]],
        );
        set.lid(drum, "head", &octagon(), [radius, height]);
        set.underside(drum, "head", &octagon(), [radius, 0.0]);
    }
    for ([x, y, z], radius) in [
        ([-0.85, 0.1, 0.75], 0.18),
        ([-0.6, -0.3, 1.15], 0.22),
        ([0.7, -0.25, 1.1], 0.25),
    ] {
        let cymbal = at.moved([x, y, z]);
        set.mantle(
            cymbal,
            "bronze",
            &octagon(),
            &[[radius, 0.0], [radius, 0.012]],
        );
        set.lid(cymbal, "bronze", &octagon(), [radius, 0.012]);
        set.underside(cymbal, "bronze", &octagon(), [radius, 0.0]);
        let open = [Side::Top, Side::Bottom];
        set.block(
            cymbal,
            "aluminium",
            [-0.012, -0.012, -z],
            [0.012, 0.012, 0.0],
            &open,
        );
    }
    // The stool.
    let stool = at.moved([0.0, 0.55, 0.0]);
    set.block(stool, "case", [-0.15, -0.15, 0.45], [0.15, 0.15, 0.53], &[]);
    set.block(
        stool,
        "case",
        [-0.03, -0.03, 0.0],
        [0.03, 0.03, 0.45],
        &[Side::Top, Side::Bottom],
    );
}

/// A cabinet with a top on it.
fn amplifier(set: &mut Set, at: Frame) {
    set.block(
        at,
        "case",
        [-0.4, -0.18, 0.0],
        [0.4, 0.18, 0.75],
        &[Side::Bottom],
    );
    set.upright(at, "grille", -0.181, [-0.37, 0.37], [0.05, 0.7]);
    set.block(
        at,
        "case",
        [-0.37, -0.14, 0.75],
        [0.37, 0.14, 1.0],
        &[Side::Bottom],
    );
    set.upright(at, "head", -0.141, [-0.33, 0.33], [0.8, 0.86]);
}

/// A wedge that faces the band.
fn monitor(set: &mut Set, at: Frame) {
    let foot = [
        [-0.3, -0.2, 0.0],
        [0.3, -0.2, 0.0],
        [0.3, 0.25, 0.0],
        [-0.3, 0.25, 0.0],
    ];
    let head = [
        [-0.3, -0.2, 0.36],
        [0.3, -0.2, 0.36],
        [0.3, 0.0, 0.36],
        [-0.3, 0.0, 0.36],
    ];
    set.hexahedron(at, "case", foot, head, &[Side::Bottom]);
}

/// 1 at a positive distance inside an edge, 0 outside, linear over two pixels.
fn inside(distance: f64) -> f64 {
    (0.5 + distance * SIDE as f64 / 4.0).clamp(0.0, 1.0)
}

/// Round holes of two sizes in rows.
fn dots(x: f64, y: f64) -> f64 {
    let mut light: f64 = 0.0;
    for row in -2..=2 {
        for column in -2..=2 {
            let [cx, cy] = [column, row].map(|i| 0.38 * f64::from(i));
            let radius = if (row + column) % 2 == 0 { 0.13 } else { 0.07 };
            let distance = ((x - cx) * (x - cx) + (y - cy) * (y - cy)).sqrt();
            if cx * cx + cy * cy < 0.8 {
                light = light.max(inside(radius - distance));
            }
        }
    }
    light
}

/// Eight slots around a hole.
fn spokes(x: f64, y: f64) -> f64 {
    let distance = (x * x + y * y).sqrt();
    let half = 0.5_f64.sqrt();
    let across = [x, y, half * (x + y), half * (x - y)].map(f64::abs);
    let nearest = across.into_iter().fold(f64::INFINITY, f64::min);
    let slot = inside(0.05 - nearest)
        .min(inside(distance - 0.28))
        .min(inside(0.92 - distance));
    slot.max(inside(0.14 - distance))
}

/// RGB of a gobo, 8 bits per channel, row by row from the top.
pub fn drawn(gobo: Gobo) -> Vec<u8> {
    let place = |i: usize| (i as f64 + 0.5) / SIDE as f64 * 2.0 - 1.0;
    let rows = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (place(column), -place(row))));
    let grey = rows.map(|(x, y)| (255.0 * gobo(x, y)).round() as u8);
    grey.flat_map(|grey| [grey; 3]).collect()
}

/// The text of the OBJ file.
pub fn obj(set: &Set) -> String {
    wavefront::obj(set, MATERIALS, "Beams", "beams")
}

/// The text of the MTL file.
pub fn mtl() -> String {
    wavefront::mtl(MATERIALS, &[], "Beams", "beams")
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../beams");
    std::fs::write(folder.join("beams.obj"), obj(&beams()))?;
    std::fs::write(folder.join("beams.mtl"), mtl())?;
    for (name, gobo) in GOBOS {
        let png = footlight_picture::png::encode(SIDE, SIDE, &drawn(gobo));
        let png = png.map_err(std::io::Error::other)?;
        std::fs::write(folder.join(format!("{name}.png")), png)?;
    }
    Ok(())
}
