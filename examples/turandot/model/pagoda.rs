//! The pagoda in the middle: three storeys of red walls, papered windows and yellow tiles.

use super::roof::{Roof, column, finial, roof};
use super::scene_key::TERRACE;
use super::solid::{Frame, Set, Side};

const SHELL: [Side; 3] = [Side::Top, Side::Bottom, Side::Back];

/// A storey: half width and heights of its walls, half width of its eaves, top of its roof.
struct Storey {
    half: f64,
    foot: f64,
    head: f64,
    eave: f64,
    top: [f64; 2],
    windows: &'static [f64],
}

const STOREYS: [Storey; 3] = [
    Storey {
        half: 3.1,
        foot: 0.45,
        head: 3.25,
        eave: 4.7,
        top: [2.2, 5.0],
        windows: &[-2.05, 2.05],
    },
    Storey {
        half: 2.2,
        foot: 4.7,
        head: 6.5,
        eave: 3.5,
        top: [1.45, 8.0],
        windows: &[-1.3, 0.0, 1.3],
    },
    Storey {
        half: 1.45,
        foot: 7.75,
        head: 9.2,
        eave: 2.55,
        top: [0.1, 11.3],
        windows: &[-0.6, 0.6],
    },
];

/// Builds it on the terrace.
pub fn build(set: &mut Set) {
    let at = Frame::at([0.0, 14.2, TERRACE]);
    set.object("pagoda");
    set.block(
        at,
        "marble",
        [-4.0, -4.0, 0.0],
        [4.0, 4.0, 0.45],
        &[Side::Bottom],
    );
    for storey in &STOREYS {
        body(set, at, storey);
        let [top, z] = storey.top;
        roof(
            set,
            at,
            Roof {
                tile: "yellow_tile",
                eave: [storey.eave, storey.eave, storey.head],
                top: [top, top, z],
                wall: [storey.half; 2],
                lift: 0.55,
            },
        );
    }
    finial(set, at.moved([0.0, 0.0, 11.3]), 1.1);
    portal(set, at);
}

fn body(set: &mut Set, at: Frame, storey: &Storey) {
    let (h, z0, z1) = (storey.half, storey.foot, storey.head);
    // The eave's soffit ends 0.12 m above the wall's head.
    set.block(at, "wall", [-h, -h, z0], [h, h, z1 + 0.12], &SHELL);
    let beam = z1 - 0.3;
    set.block(
        at,
        "beam",
        [-h - 0.06, -h - 0.06, beam],
        [h + 0.06, -h, z1],
        &[Side::Back],
    );
    let (sill, head) = (z0 + 0.5, z1 - 0.45);
    for x in storey.windows {
        window(
            set,
            at.moved([*x, -h, 0.0]),
            "pagoda_paper",
            0.42,
            [sill, head],
        );
    }
    for x in [-1.0_f64, -0.34, 0.34, 1.0] {
        if storey.windows.len() == 2 || x.abs() > 0.9 {
            let foot = at.moved([x * h, -h - 0.16, z0]);
            column(set, foot, "lacquer", &[[0.13, 0.0], [0.12, beam - z0]]);
        }
    }
}

/// A papered window with its lattice, in front of the wall.
pub fn window(set: &mut Set, at: Frame, paper: &'static str, half: f64, [z0, z1]: [f64; 2]) {
    set.upright(at, paper, -0.02, [-half, half], [z0, z1]);
    let bar = 0.025;
    for x in [-half, -half / 3.0, half / 3.0, half] {
        set.upright(at, "lattice", -0.05, [x - bar, x + bar], [z0, z1]);
    }
    for i in 0..4_u32 {
        let z = z0 + (z1 - z0) * f64::from(i) / 3.0;
        set.upright(
            at,
            "lattice",
            -0.06,
            [-half - bar, half + bar],
            [z - bar, z + bar],
        );
    }
}

/// The door, and three steps up to it.
fn portal(set: &mut Set, at: Frame) {
    set.object("portal");
    let wall = at.moved([0.0, -3.1, 0.45]);
    set.upright(wall, "door", -0.02, [-0.85, 0.0], [0.0, 2.1]);
    set.upright(wall, "door", -0.02, [0.0, 0.85], [0.0, 2.1]);
    for [x0, x1] in [[-0.98, -0.85], [0.85, 0.98]] {
        set.block(
            wall,
            "gilt",
            [x0, -0.08, 0.0],
            [x1, 0.0, 2.1],
            &[Side::Back, Side::Bottom],
        );
    }
    set.block(
        wall,
        "gilt",
        [-0.98, -0.1, 2.1],
        [0.98, 0.0, 2.28],
        &[Side::Back],
    );
    for i in 0..3_u32 {
        let (depth, z) = (0.3 * f64::from(3 - i), 0.15 * f64::from(i));
        let (low, high) = ([-1.6, -4.0 - depth, z], [1.6, -4.0, z + 0.15]);
        set.block(at, "marble", low, high, &[Side::Back, Side::Bottom]);
    }
}
