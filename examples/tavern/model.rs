//! Builds Luther's Tavern: `cargo run --example tavern_model` writes `tavern.obj` and `tavern.mtl`
//! beside this file.
//!
//! The set is an open box: the house is the fourth wall, and the roof stays open downstage for the
//! overhead lights. Metres; X to stage left, Y upstage, Z up here, Y up in the file as OBJ has it.
//! Every face is convex and planar, its front where the vertices run counter-clockwise; solids are
//! closed but for sides on the floor or against a wall. The numbers come out the same on every
//! machine, and a test compares the files byte for byte.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

#[path = "model/furniture.rs"]
mod furniture;
#[path = "model/luminaire.rs"]
mod luminaire;
#[path = "model/material.rs"]
mod material;
#[path = "model/room.rs"]
mod room;
#[path = "model/solid.rs"]
mod solid;
#[path = "model/stair.rs"]
mod stair;

pub use material::MATERIALS;
pub use solid::{Frame, Point, Set, octagon};

/// The whole set, in the order in which a crew would put it up.
pub fn tavern() -> Set {
    let mut set = Set::default();
    room::build(&mut set);
    stair::build(&mut set);
    furniture::build(&mut set);
    luminaire::build(&mut set);
    set
}

/// The text of the OBJ file.
pub fn obj(set: &Set) -> String {
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
        "# Luther's Tavern: made by examples/tavern/model.rs, do not edit\n\
         # metres, Y up; faces run counter-clockwise seen from the front\n\
         mtllib tavern.mtl\n{vertices}{faces}"
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
pub fn mtl() -> String {
    let mut text = String::from(
        "# Luther's Tavern: made by examples/tavern/model.rs, do not edit\n\
         # Kd: diffuse reflectance, linear. Ke: radiance at level 100, cd/m2.\n",
    );
    for material in MATERIALS {
        let [r, g, b] = material.reflectance;
        let _ = writeln!(text, "\nnewmtl {}\nKd {r} {g} {b}", material.name);
        let [r, g, b] = material.emission;
        let _ = writeln!(text, "Ke {r} {g} {b}\nillum 1");
    }
    text
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tavern");
    std::fs::write(folder.join("tavern.obj"), obj(&tavern()))?;
    std::fs::write(folder.join("tavern.mtl"), mtl())
}
