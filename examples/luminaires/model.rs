//! Writes the files of `luminaires.lxq`: a room with a table, a luminaire's distribution, a slide.
//!
//! `cargo run -p footlight-studies --bin luminaires_model` in the package's folder. All data are
//! invented.

use std::fmt::Write as _;
use std::fs;
use std::io::Result;
use std::path::Path;

fn main() -> Result<()> {
    let folder = Path::new("examples/luminaires");
    let (obj, mtl) = room();
    fs::write(folder.join("room.obj"), obj)?;
    fs::write(folder.join("room.mtl"), mtl)?;
    fs::write(folder.join("batwing.ies"), batwing())?;
    let slide = window(240, 192);
    let png = footlight_picture::png::encode(240, 192, &slide);
    fs::write(
        folder.join("window.png"),
        png.map_err(std::io::Error::other)?,
    )
}

/// A room of 6 x 6 x 2.8 m without the wall behind the seat, a table and a pillar.
fn room() -> (String, String) {
    let mut obj = String::from("# Made by examples/luminaires/model.rs; Z up\nmtllib room.mtl\n");
    let mut count = 0;
    let mut quad = |material: &str, corners: [[f64; 3]; 4]| {
        for [x, y, z] in corners {
            let _ = writeln!(obj, "v {x} {y} {z}");
        }
        let _ = writeln!(obj, "usemtl {material}");
        let _ = writeln!(
            obj,
            "f {} {} {} {}",
            count + 1,
            count + 2,
            count + 3,
            count + 4
        );
        count += 4;
    };
    let (w, h, near, far) = (3.0, 2.8, -4.0, 2.0);
    quad(
        "floor",
        [
            [-w, near, 0.0],
            [w, near, 0.0],
            [w, far, 0.0],
            [-w, far, 0.0],
        ],
    );
    quad(
        "ceiling",
        [[-w, near, h], [-w, far, h], [w, far, h], [w, near, h]],
    );
    quad(
        "wall",
        [[-w, far, 0.0], [w, far, 0.0], [w, far, h], [-w, far, h]],
    );
    quad(
        "left",
        [[-w, near, 0.0], [-w, far, 0.0], [-w, far, h], [-w, near, h]],
    );
    quad(
        "right",
        [[w, near, 0.0], [w, near, h], [w, far, h], [w, far, 0.0]],
    );
    quad(
        "wall",
        [[-w, near, 0.0], [-w, near, h], [w, near, h], [w, near, 0.0]],
    );
    let boxes = [
        ("wood", [-2.0, 0.0, 0.55], [-0.6, 1.2, 0.6]),
        ("wood", [-1.9, 0.1, 0.0], [-1.8, 0.2, 0.55]),
        ("wood", [-0.8, 0.1, 0.0], [-0.7, 0.2, 0.55]),
        ("wood", [-1.9, 1.0, 0.0], [-1.8, 1.1, 0.55]),
        ("wood", [-0.8, 1.0, 0.0], [-0.7, 1.1, 0.55]),
        ("plaster", [1.1, 1.0, 0.0], [1.4, 1.3, 2.0]),
    ];
    for (material, [x, y, z], [a, b, c]) in boxes {
        quad(material, [[x, y, c], [a, y, c], [a, b, c], [x, b, c]]);
        quad(material, [[x, y, z], [x, b, z], [a, b, z], [a, y, z]]);
        quad(material, [[x, y, z], [a, y, z], [a, y, c], [x, y, c]]);
        quad(material, [[a, y, z], [a, b, z], [a, b, c], [a, y, c]]);
        quad(material, [[a, b, z], [x, b, z], [x, b, c], [a, b, c]]);
        quad(material, [[x, b, z], [x, y, z], [x, y, c], [x, b, c]]);
    }
    let mut mtl = String::from("# Made by examples/luminaires/model.rs\n");
    for (name, [r, g, b]) in [
        ("floor", [0.35, 0.27, 0.2]),
        ("ceiling", [0.8, 0.8, 0.8]),
        ("wall", [0.72, 0.7, 0.66]),
        ("left", [0.6, 0.3, 0.26]),
        ("right", [0.3, 0.42, 0.55]),
        ("wood", [0.45, 0.3, 0.18]),
        ("plaster", [0.75, 0.75, 0.72]),
    ] {
        let _ = writeln!(mtl, "newmtl {name}\nKd {r} {g} {b}");
    }
    (obj, mtl)
}

/// Two lobes at 30 degrees to the sides of the plane of 0, weak along the plane of 90.
fn batwing() -> String {
    let vertical: Vec<f64> = (0..=18).map(|i| 5.0 * f64::from(i)).collect();
    let horizontal: Vec<f64> = (0..=6).map(|i| 15.0 * f64::from(i)).collect();
    let row = |n: &[f64]| {
        let words: Vec<String> = n.iter().map(|x| format!("{x:.1}")).collect();
        words.join(" ")
    };
    let mut out =
        String::from("IESNA:LM-63-2002\n[TEST] made up by examples/luminaires/model.rs\n");
    out += "[MANUFAC] none\n[LUMINAIRE] an invented luminaire with two lobes\nTILT=NONE\n";
    let _ = writeln!(
        out,
        "1 -1 1 {} {} 1 2 0 0 0",
        vertical.len(),
        horizontal.len()
    );
    let _ = writeln!(out, "1 1 20\n{}\n{}", row(&vertical), row(&horizontal));
    for h in &horizontal {
        let aside = h.to_radians().cos().powi(2);
        let candela: Vec<f64> = vertical
            .iter()
            .map(|v| {
                let lobe = (-((v - 35.0) / 14.0).powi(2)).exp();
                let middle = v.to_radians().cos().powi(3);
                250.0 * (aside * lobe * 1.6 + 0.35 * middle) * v.to_radians().cos().max(0.0).sqrt()
            })
            .collect();
        let _ = writeln!(out, "{}", row(&candela));
    }
    out
}

/// A window of four panes at night's end: sky that changes from blue to gold, a dark cross.
fn window(width: usize, height: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as f64 / width as f64, y as f64 / height as f64);
            let frame = |t: f64| !(0.06..=0.94).contains(&t) || (t - 0.5).abs() < 0.03;
            let glow = |a: f64, b: f64| (255.0 * (a + (b - a) * v)).round() as u8;
            let colour = match frame(u) || frame(v) {
                true => [0, 0, 0],
                false => [glow(0.55, 1.0), glow(0.7, 0.8), glow(1.0, 0.45)],
            };
            out.extend(colour);
        }
    }
    out
}
