//! Builds the set of Turandot: `cargo run -p footlight-studies --bin turandot_model` writes
//! `turandot.obj`, `turandot.mtl`, the images of its surfaces and the two slides `dusk.png` and
//! `night.png` next to this file.
//!
//! A square before the palace, under an open sky: gatehouses left and right, a stair to a terrace
//! with two pavilions, a pagoda in the middle, the walls of Peking and a sky cloth behind. Metres;
//! X to stage left, Y upstage, Z up here, Y up in the OBJ file. Every face is convex and planar,
//! its vertices counter-clockwise seen from the front. The numbers are equal on every machine; a
//! test compares the files byte for byte, the slides pixel for pixel.

use std::path::Path;

#[path = "../tavern/model/finish.rs"]
#[allow(dead_code, reason = "the paint shop of the tavern can do more")]
mod finish;
#[path = "model/gate.rs"]
mod gate;
#[path = "model/slide.rs"]
mod gobo;
#[path = "model/material.rs"]
mod material;
#[path = "model/pagoda.rs"]
mod pagoda;
#[path = "model/pavilion.rs"]
mod pavilion;
#[path = "model/property.rs"]
mod property;
#[path = "model/roof.rs"]
mod roof;
#[path = "model/ground.rs"]
mod scene_key;
#[path = "../tavern/model/solid.rs"]
#[allow(dead_code, reason = "the carpenter of the tavern can do more")]
mod solid;
#[path = "../tavern/model/wavefront.rs"]
mod wavefront;

pub use finish::{SIDE, paint};
pub use gobo::{HEIGHT, WIDTH, dusk, night};
pub use material::{MATERIALS, PAINTERS};
pub use solid::Set;

/// The whole set, from the ground up.
pub fn turandot() -> Set {
    let mut set = Set::default();
    scene_key::build(&mut set);
    pagoda::build(&mut set);
    pavilion::build(&mut set);
    gate::build(&mut set);
    property::build(&mut set);
    set
}

/// The text of the OBJ file.
pub fn obj(set: &Set) -> String {
    wavefront::obj(set, MATERIALS, "Turandot", "turandot")
}

/// The text of the MTL file.
pub fn mtl() -> String {
    wavefront::mtl(MATERIALS, PAINTERS, "Turandot", "turandot")
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../turandot");
    std::fs::write(folder.join("turandot.obj"), obj(&turandot()))?;
    std::fs::write(folder.join("turandot.mtl"), mtl())?;
    for (name, slide) in [("dusk.png", dusk()), ("night.png", night())] {
        let png = footlight_picture::png::encode(WIDTH, HEIGHT, &slide);
        std::fs::write(folder.join(name), png.map_err(std::io::Error::other)?)?;
    }
    wavefront::write_images(&folder, PAINTERS)
}
