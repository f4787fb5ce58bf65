//! Builds Luther's Tavern: `cargo run -p footlight-studies --bin tavern_model` writes `tavern.obj`,
//! `tavern.mtl` and the images of its surfaces next to this file.
//!
//! The set is an open box: the house is the fourth wall, and the roof stays open downstage for the
//! overhead lights. Metres; X to stage left, Y upstage, Z up here, Y up in the OBJ file. Every face
//! is convex and planar, its vertices counter-clockwise seen from the front; solids are closed
//! except for sides on the floor or against a wall. The numbers are equal on every machine; a test
//! compares the files byte for byte, the images pixel for pixel.

use std::path::Path;

#[path = "model/finish.rs"]
#[allow(dead_code, reason = "the paint shop works for Turandot too")]
mod finish;
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
#[path = "model/wavefront.rs"]
mod wavefront;

pub use finish::{SIDE, paint};
pub use material::{MATERIALS, PAINTERS};
pub use solid::{Frame, Point, Set, octagon};

/// The whole set, in the order of building it.
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
    wavefront::obj(set, MATERIALS, "Luther's Tavern", "tavern")
}

/// The text of the MTL file.
pub fn mtl() -> String {
    wavefront::mtl(MATERIALS, PAINTERS, "Luther's Tavern", "tavern")
}

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tavern");
    std::fs::write(folder.join("tavern.obj"), obj(&tavern()))?;
    std::fs::write(folder.join("tavern.mtl"), mtl())?;
    wavefront::write_images(&folder, PAINTERS)
}
