//! Materials of set and lights: names, reflectance, radiance.

use super::finish::{self, Finish, Painter, grain, upright};
use super::wavefront::{Material, finished, glow, paint};

/// Painters of the images, by file name.
pub const PAINTERS: &[(&str, Painter)] = &[
    ("boards", finish::boards),
    ("timber", finish::timber),
    ("plaster", finish::plaster),
    ("brick", finish::brick),
];

/// Boards in the width of the floor's: five in 0.775 m.
const BOARDS: Option<Finish> = upright("boards", [0.775, 3.1]);
const TIMBER: Option<Finish> = grain("timber", [0.6, 2.4]);
const PLASTER: Option<Finish> = upright("plaster", [2.4, 2.4]);

/// Every material of the set.
pub const MATERIALS: &[Material] = &[
    // --- the room ---
    finished("boards_light", [0.27, 0.17, 0.095], BOARDS),
    finished("boards_mid", [0.22, 0.132, 0.072], BOARDS),
    finished("boards_dark", [0.165, 0.096, 0.052], BOARDS),
    finished("plaster", [0.56, 0.47, 0.35], PLASTER),
    finished("ceiling", [0.30, 0.22, 0.15], BOARDS),
    paint("flies", [0.07, 0.06, 0.05]),
    finished("wainscot", [0.19, 0.105, 0.056], BOARDS),
    finished("timber", [0.13, 0.078, 0.046], TIMBER),
    finished("brick", [0.34, 0.17, 0.115], upright("brick", [0.9, 0.56])),
    paint("soot", [0.07, 0.06, 0.055]),
    paint("stone", [0.42, 0.39, 0.35]),
    paint("lead", [0.09, 0.09, 0.095]),
    // --- what stands in it ---
    finished("oak", [0.31, 0.18, 0.09], TIMBER),
    finished("bench", [0.25, 0.14, 0.07], TIMBER),
    finished("counter", [0.34, 0.165, 0.075], TIMBER),
    finished("rail", [0.24, 0.125, 0.06], TIMBER),
    finished("barrel", [0.29, 0.18, 0.095], TIMBER),
    paint("iron", [0.07, 0.07, 0.075]),
    paint("enamel", [0.74, 0.70, 0.60]),
    paint("pewter", [0.46, 0.46, 0.48]),
    paint("bottle_green", [0.09, 0.28, 0.14]),
    paint("bottle_amber", [0.46, 0.22, 0.06]),
    paint("canvas", [0.36, 0.30, 0.22]),
    paint("gilt", [0.50, 0.36, 0.14]),
    // --- what is not the tavern ---
    paint("velvet", [0.085, 0.011, 0.013]),
    paint("lip", [0.10, 0.07, 0.05]),
    paint("roofs", [0.05, 0.055, 0.07]),
    paint("street", [0.22, 0.20, 0.18]),
    // --- what glows: one material for each group of panels ---
    glow("lamp1_glass", [4600.0, 2500.0, 800.0]),
    glow("lamp2_glass", [4600.0, 2500.0, 800.0]),
    glow("lamp3_glass", [4600.0, 2500.0, 800.0]),
    glow("bar_glass", [1500.0, 830.0, 280.0]),
    glow("shelf_strip", [900.0, 540.0, 210.0]),
    glow("sconce_flame", [2400.0, 1200.0, 330.0]),
    glow("gallery_flame", [1900.0, 990.0, 290.0]),
    glow("fire_left", [75.0, 17.0, 1.8]),
    glow("fire_right", [75.0, 17.0, 1.8]),
    glow("foot_glass", [5200.0, 3000.0, 1250.0]),
    glow("top_warm", [1400.0, 800.0, 320.0]),
    glow("top_blue", [190.0, 410.0, 1120.0]),
    glow("sky_cloth", [30.0, 30.0, 30.0]),
    glow("moon_disc", [14.0, 15.5, 18.0]),
    glow("exit_sign", [0.8, 9.0, 2.6]),
];
