//! A set as Wavefront files: OBJ for its faces, MTL for its materials.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::solid::{Point, Set};

/// A material of the set.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// As the show's text refers to it.
    pub name: &'static str,
    /// Diffuse reflectance, linear RGB.
    pub reflectance: [f64; 3],
    /// Emitted radiance at level 100, cd/m2 in linear RGB; zero for all that does not glow.
    pub emission: [f64; 3],
}

/// What only reflects.
pub const fn paint(name: &'static str, reflectance: [f64; 3]) -> Material {
    Material {
        name,
        reflectance,
        emission: [0.0; 3],
    }
}

/// What glows too.
pub const fn glow(name: &'static str, emission: [f64; 3]) -> Material {
    Material {
        name,
        reflectance: [0.1, 0.1, 0.1],
        emission,
    }
}

/// The text of the OBJ file of the set of this title, whose files are called `name`.
pub fn obj(set: &Set, title: &str, name: &str) -> String {
    let mut vertices = String::new();
    let mut faces = String::new();
    let mut index: BTreeMap<String, usize> = BTreeMap::new();
    let (mut object, mut used) = ("", "");
    for face in &set.faces {
        if face.object != object {
            object = face.object;
            let _ = writeln!(faces, "o {object}");
        }
        if face.material != used {
            used = face.material;
            let _ = writeln!(faces, "usemtl {used}");
        }
        faces.push('f');
        for point in &face.vertices {
            let text = vertex(*point);
            let next = index.len() + 1;
            let number = *index.entry(text).or_insert_with_key(|text| {
                let _ = writeln!(vertices, "v {text}");
                next
            });
            let _ = write!(faces, " {number}");
        }
        faces.push('\n');
    }
    format!(
        "# {title}: made by examples/{name}/model.rs, do not edit\n\
         # metres, Y up; faces run counter-clockwise seen from the front\n\
         mtllib {name}.mtl\n{vertices}{faces}"
    )
}

/// A point as the file has it: Y up, to the micrometre, no negative zero.
fn vertex([x, y, z]: Point) -> String {
    [x, z, -y]
        .map(|c| {
            let text = format!("{c:.6}");
            let text = text.trim_end_matches('0').trim_end_matches('.');
            if text == "-0" { "0" } else { text }.to_owned()
        })
        .join(" ")
}

/// The text of the MTL file.
pub fn mtl(materials: &[Material], title: &str, name: &str) -> String {
    let mut text = format!(
        "# {title}: made by examples/{name}/model.rs, do not edit\n\
         # Kd: diffuse reflectance, linear. Ke: radiance at level 100, cd/m2.\n"
    );
    for material in materials {
        let [r, g, b] = material.reflectance;
        let _ = writeln!(text, "\nnewmtl {}\nKd {r} {g} {b}", material.name);
        let [r, g, b] = material.emission;
        let _ = writeln!(text, "Ke {r} {g} {b}\nillum 1");
    }
    text
}
