//! Reads glTF 2.0 (`.gltf` with external or embedded buffers, `.glb`) to a scene and its lights.
//!
//! Invariants: memory for a claimed count is allocated only once the bytes for it exist (or a limit
//! holds, for sparse accessors without a base); every index is checked; each node is visited once,
//! so that cycles and shared branches are refused instead of followed. The result consists of the
//! file's triangles, turned to Z up, wound so that the front is the side that the file means, also
//! under mirroring transforms.
//!
//! Only the crate's description of the JSON is used: its validation panics on an out-of-range index
//! of a position accessor, and its GLB reader on a length below 12.
//!
//! Not read: textures that are not colours, vertex colours, clear coats, skins, morph targets
//! (meshes stay as modelled), animations.

mod accessor;
mod buffers;
mod camera;
mod container;
mod description;
mod draco;
mod lamp;
mod material;
mod node;
mod primitive;
mod vertices;

#[cfg(test)]
mod gloss_test;
#[cfg(test)]
mod hostile_test;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use self::container::Document;
pub use self::container::named_files;
use self::description::Root;
use super::Scene;
use super::stage_file::{Imported, Options, SceneError};
use super::texture::reader::TextureReader;
use footlight_host::files::Files;

/// Most triangles of a file, counting all instances.
pub const TRIANGLE_LIMIT: usize = 2_000_000;

/// A faulty part of a file, and the fault.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{place}: {reason}")]
struct Fault {
    place: String,
    reason: String,
}

impl Fault {
    fn new(place: impl Into<String>, reason: impl Into<String>) -> Fault {
        Fault {
            place: place.into(),
            reason: reason.into(),
        }
    }

    fn of_file(self, path: &str) -> SceneError {
        SceneError::Part {
            path: path.to_owned(),
            place: self.place,
            reason: self.reason,
        }
    }
}

// Reasons shared by several parts.

fn missing(what: &str, index: usize, count: usize) -> String {
    format!("{what} {index} does not exist; there are {count}")
}

fn lacks(what: &str) -> String {
    format!("it has no {what}")
}

fn short(needed: u64, found: u64) -> String {
    format!("{needed} bytes are needed and {found} are there")
}

fn outside(what: &str, value: f64, range: &str) -> String {
    format!("{what} {value} is outside {range}")
}

fn not_gltf(error: impl std::fmt::Display) -> String {
    format!("not glTF: {error}")
}

/// Reads a glTF file with the content `bytes`; its buffers and images come through `files`,
/// relative to the file's own folder, images within `memory` bytes.
pub(super) fn import(
    files: &dyn Files,
    path: &str,
    bytes: &[u8],
    options: &Options,
    memory: usize,
) -> Result<Imported, SceneError> {
    let document = Document::read(files, path, bytes)?;
    let mut textures = TextureReader::new(memory);
    let materials = material::all(files, &document, &mut textures, options.matt);
    assemble(&document, materials, &options.parts).map_err(|fault| fault.of_file(path))
}

fn assemble(
    document: &Document<'_>,
    materials: material::Materials,
    parts: &[String],
) -> Result<Imported, Fault> {
    let root = &document.root;
    let mut out = Imported {
        scene: Scene {
            materials: materials.materials,
            ..Scene::default()
        },
        double_sided: materials.double_sided,
        ..Imported::default()
    };
    let mut left_out = materials.left_out;
    let mut meshes = primitive::Meshes::new(document, &materials.places, &materials.faults);
    for placed in node::walk(root, &mut left_out)? {
        let mesh = placed.node.mesh.map(|mesh| mesh.value());
        if let Some(name) = light_volume(root, &placed, mesh) {
            left_out.insert(format!(
                "`{name}`, a volume of light by its name: it is no wall"
            ));
        } else if let Some(mesh) = mesh {
            for transform in node::instances(document, &placed)? {
                meshes.place(mesh, (&placed, &transform), parts, &mut out, &mut left_out)?;
            }
        }
        // The stage is usable without its lamps and cameras; a show that names one is refused
        // there.
        let lamp = lamp::add(root, &placed, &mut out.lamps);
        let camera = camera::add(root, &placed, &mut out.cameras);
        let faults = [lamp.err(), camera.err()].into_iter().flatten();
        left_out.extend(faults.map(|fault| fault.to_string()));
    }
    out.summary.left_out = left_out.into_iter().collect();
    Ok(out)
}

/// The name of a node or its mesh, when it marks a beam in the haze instead of a solid.
fn light_volume<'r>(
    root: &'r Root,
    placed: &node::Placed<'r>,
    mesh: Option<usize>,
) -> Option<&'r String> {
    let mesh = mesh.and_then(|i| root.meshes.get(i));
    let names = [
        placed.node.name.as_ref(),
        mesh.and_then(|m| m.name.as_ref()),
    ];
    let says = |name: &&String| {
        let letters = name.chars().filter(|c| c.is_alphanumeric());
        let name = letters.collect::<String>().to_lowercase();
        name.contains("lightvolume")
            || name.contains("volumelight")
            || name.contains("volumetriclight")
    };
    names.into_iter().flatten().find(says)
}

/// Contents of the file that are not read, each listed once.
pub(super) type LeftOut = BTreeSet<String>;

/// The entry of a list, or a fault when it is missing.
fn entry<'r, T>(
    list: &'r [T],
    index: usize,
    what: &'static str,
    place: impl FnOnce() -> String,
) -> Result<&'r T, Fault> {
    let count = list.len();
    list.get(index)
        .ok_or_else(|| Fault::new(place(), missing(what, index, count)))
}

/// `mesh 3 "Chair"`, or without the name if there is none.
fn place(what: &str, index: usize, name: Option<&String>) -> String {
    match name {
        // Enough of a name for a message.
        Some(name) => format!(
            "{what} {index} \"{}\"",
            name.chars().take(40).collect::<String>()
        ),
        None => format!("{what} {index}"),
    }
}
