//! Materials of set and lights: names, reflectance, radiance.

use super::finish::{self, Finish, Painter, grain, upright};
use super::wavefront::{Material, finished, glow, paint};

/// Painters of the images, by file name.
pub const PAINTERS: &[(&str, Painter)] = &[
    ("paving", finish::paving),
    ("masonry", finish::masonry),
    ("tiles", finish::tiles),
    ("brocade", finish::brocade),
    ("plaster", finish::plaster),
    ("timber", finish::timber),
    ("studs", finish::studs),
];

const PAVING: Option<Finish> = upright("paving", [2.0, 2.0]);
const MASONRY: Option<Finish> = upright("masonry", [1.4, 1.2]);
const TILES: Option<Finish> = upright("tiles", [1.6, 1.5]);
const PLASTER: Option<Finish> = upright("plaster", [3.0, 3.0]);
const TIMBER: Option<Finish> = grain("timber", [0.6, 2.4]);

/// Every material of the set.
pub const MATERIALS: &[Material] = &[
    // --- stone ---
    finished("slab_light", [0.34, 0.32, 0.29], PAVING),
    finished("slab_mid", [0.29, 0.27, 0.245], PAVING),
    finished("slab_dark", [0.24, 0.22, 0.20], PAVING),
    finished("way", [0.47, 0.44, 0.40], PAVING),
    finished("marble", [0.62, 0.60, 0.56], MASONRY),
    finished("terrace", [0.36, 0.31, 0.27], MASONRY),
    finished("relief", [0.45, 0.39, 0.33], MASONRY),
    // --- wood and tile ---
    finished("lacquer", [0.42, 0.055, 0.035], TIMBER),
    finished("beam", [0.09, 0.20, 0.19], TIMBER),
    finished("soffit", [0.44, 0.20, 0.09], TIMBER),
    paint("gilt", [0.60, 0.41, 0.13]),
    finished("tile", [0.075, 0.155, 0.14], TILES),
    finished("yellow_tile", [0.40, 0.25, 0.065], TILES),
    finished("wall", [0.36, 0.14, 0.09], PLASTER),
    finished("door", [0.28, 0.03, 0.025], upright("studs", [0.8, 0.8])),
    paint("lattice", [0.10, 0.045, 0.03]),
    finished("interior", [0.62, 0.47, 0.29], PLASTER),
    // --- what stands about ---
    paint("bronze", [0.40, 0.27, 0.11]),
    paint("iron", [0.06, 0.06, 0.065]),
    finished("robe", [0.62, 0.64, 0.60], upright("brocade", [0.5, 0.5])),
    paint("face", [0.62, 0.47, 0.37]),
    paint("bark", [0.07, 0.05, 0.04]),
    paint("needle", [0.045, 0.085, 0.05]),
    // --- behind ---
    paint("dark_floor", [0.08, 0.08, 0.08]),
    paint("cloth", [0.78, 0.78, 0.78]),
    // --- what glows: one material for each group of panels ---
    glow("red_left", [85.0, 2.4, 1.2]),
    glow("red_right", [85.0, 2.4, 1.2]),
    glow("yellow_left", [120.0, 50.0, 6.0]),
    glow("yellow_right", [120.0, 50.0, 6.0]),
    glow("paper_left", [80.0, 38.0, 9.0]),
    glow("paper_right", [80.0, 38.0, 9.0]),
    glow("pagoda_paper", [85.0, 38.0, 8.0]),
    glow("flame_left", [220.0, 50.0, 4.0]),
    glow("flame_right", [220.0, 50.0, 4.0]),
    glow("ground_row", [300.0, 300.0, 300.0]),
];
