//! What the scene shop paints and what the electricians hang: names, reflectance, radiance.

use super::wavefront::{Material, glow, paint};

/// Every material of the set.
pub const MATERIALS: &[Material] = &[
    // --- stone ---
    paint("slab_light", [0.34, 0.32, 0.29]),
    paint("slab_mid", [0.29, 0.27, 0.245]),
    paint("slab_dark", [0.24, 0.22, 0.20]),
    paint("way", [0.47, 0.44, 0.40]),
    paint("marble", [0.62, 0.60, 0.56]),
    paint("terrace", [0.36, 0.31, 0.27]),
    paint("relief", [0.45, 0.39, 0.33]),
    // --- wood and tile ---
    paint("lacquer", [0.42, 0.055, 0.035]),
    paint("beam", [0.09, 0.20, 0.19]),
    paint("soffit", [0.44, 0.20, 0.09]),
    paint("gilt", [0.60, 0.41, 0.13]),
    paint("tile", [0.075, 0.155, 0.14]),
    paint("yellow_tile", [0.40, 0.25, 0.065]),
    paint("wall", [0.36, 0.14, 0.09]),
    paint("door", [0.28, 0.03, 0.025]),
    paint("lattice", [0.10, 0.045, 0.03]),
    paint("interior", [0.62, 0.47, 0.29]),
    // --- what stands about ---
    paint("bronze", [0.40, 0.27, 0.11]),
    paint("iron", [0.06, 0.06, 0.065]),
    paint("robe", [0.62, 0.64, 0.60]),
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
