//! Wavefront OBJ with MTL to a [`Scene`].
//!
//! Invariants: what comes out keeps the promises of [`crate::scene`] as far as they can be told
//! polygon by polygon: finite, planar, of positive area, with a material whose reflectance lies in
//! 0..1. A file that breaks them is refused with its name and line, except that polygons without
//! area are dropped and bent ones cut into triangles, as every exporter writes some of those.
//!
//! tobj reads, but panics on some malformed lines (`Kd 1`; a texture index of minus two) and gives
//! no line numbers. So a gate (in `gate`) reads every line first, refuses what is wrong with its
//! line, and hands tobj only plain lines of the kinds used here.
//!
//! Not read: textures (`map_Kd`), normals, texture coordinates, lines, points, curves. Kd is the
//! diffuse reflectance, Ke the emitted radiance; either is black where the MTL does not give it.

mod gate;

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;

use self::gate::Face;
use super::import::{SceneError, Summary};
use super::polygon::{self, ShapeError};
use super::{Material, Polygon, Scene};
use crate::files::Files;
use crate::geometry::{Vec3, vec3};
use crate::units::Rgb;

pub use super::import::{POLYGON_LIMIT, VERTEX_LIMIT};

/// The most corners of one face.
pub const CORNER_LIMIT: usize = 256;

/// What is wrong with a line of an OBJ or MTL file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LineError {
    /// Not UTF-8.
    #[error("not text; is this an OBJ or MTL file?")]
    NotText,
    /// Too few or too many numbers.
    #[error("`{keyword}` needs {expected} numbers and has {found}")]
    Count {
        /// The line's first word.
        keyword: &'static str,
        /// How many are needed.
        expected: usize,
        /// How many are there.
        found: usize,
    },
    /// Not a finite number.
    #[error("`{0}` is not a finite number")]
    Number(String),
    /// A coordinate beyond a million kilometres.
    #[error("coordinate {0} is beyond 1e9 metres")]
    Far(f64),
    /// A reflectance outside 0..1.
    #[error("reflectance {0} is outside 0 to 1")]
    Reflectance(f64),
    /// A negative emission.
    #[error("emitted radiance {0} is negative")]
    Emission(f64),
    /// A face of fewer than three corners.
    #[error("a face needs at least 3 corners and has {0}")]
    Corners(usize),
    /// A face corner that is no index.
    #[error("`{0}` is not a corner of a face")]
    Corner(String),
    /// An index without its vertex.
    #[error("vertex {index} does not exist; {defined} are defined up to here")]
    Index {
        /// As the file has it: from 1, or negative from the last.
        index: i64,
        /// Vertices defined so far.
        defined: usize,
    },
    /// A face that is no polygon.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A face before any `usemtl`.
    #[error("the face has no material (`usemtl`)")]
    NoMaterial,
    /// A material that no MTL file defines.
    #[error("material `{0}` is not defined")]
    UnknownMaterial(String),
    /// A material defined twice.
    #[error("material `{0}` is defined twice")]
    TwiceMaterial(String),
    /// `newmtl`, `usemtl` or `mtllib` without a name, or a value before the first `newmtl`.
    #[error("`{0}` needs a name")]
    Name(&'static str),
    /// More than is read.
    #[error("more than {limit} {what}")]
    Limit {
        /// Of what.
        what: &'static str,
        /// The most that is read.
        limit: usize,
    },
}

/// Reads the OBJ file `path` and the MTL files it names (relative to its own folder), through
/// `files`. OBJ is Y up by custom and is turned; `z_up` takes coordinates as they are.
///
/// Materials keep the order of the MTL files, used or not, because a show may name them; polygons
/// keep the order of the file.
///
/// # Errors
/// [`SceneError`] for files that cannot be read, malformed or truncated lines, numbers that are
/// not finite, reflectances outside 0..1, unknown materials, missing vertices, and too much of
/// anything.
pub fn import(files: &dyn Files, path: &str, z_up: bool) -> Result<Scene, SceneError> {
    let (scene, _) = parse(files, path, &files.read(path)?, z_up)?;
    if scene.polygons.is_empty() {
        return Err(SceneError::Empty {
            path: path.to_owned(),
        });
    }
    Ok(scene)
}

/// The same of a file that is read already, perhaps without polygons, and what became of its faces.
pub(super) fn parse(
    files: &dyn Files,
    path: &str,
    bytes: &[u8],
    z_up: bool,
) -> Result<(Scene, Summary), SceneError> {
    let text = gate::obj(path, bytes)?;
    let failure = RefCell::new(None);
    let known = RefCell::new(gate::Names::default());
    let load = |library: &Path| {
        materials(files, path, library, &known).map_err(|e| {
            failure.replace(Some(e));
            tobj::LoadError::ReadError
        })
    };
    let loaded = tobj::load_obj_buf(&mut text.plain.as_bytes(), &options(), load);
    if let Some(error) = failure.take() {
        return Err(error);
    }
    text.require_materials(path, &known.borrow())?;
    let (models, materials) = loaded
        .and_then(|(models, materials)| Ok((models, materials?)))
        .map_err(|source| SceneError::Reader {
            path: path.to_owned(),
            source,
        })?;
    let mut scene = Scene {
        materials: materials.iter().map(material).collect(),
        polygons: Vec::new(),
    };
    let mut summary = Summary::default();
    let mut faces = text.faces.iter();
    for model in &models {
        add(
            &mut scene,
            &model.mesh,
            &mut faces,
            &mut summary,
            (path, z_up),
        )?;
    }
    Ok((scene, summary))
}

fn options() -> tobj::LoadOptions {
    tobj::LoadOptions {
        triangulate: false,
        ..tobj::LoadOptions::default()
    }
}

/// Reads one MTL file for tobj, by way of the gate.
fn materials(
    files: &dyn Files,
    obj: &str,
    library: &Path,
    known: &RefCell<gate::Names>,
) -> Result<(Vec<tobj::Material>, HashMap<String, usize>), SceneError> {
    let folder = Path::new(obj).parent().unwrap_or(Path::new(""));
    let path = folder.join(library).to_string_lossy().into_owned();
    let plain = gate::mtl(&path, &files.read(&path)?, &mut known.borrow_mut())?;
    tobj::load_mtl_buf(&mut plain.as_bytes()).map_err(|source| SceneError::Reader { path, source })
}

fn material(from: &tobj::Material) -> Material {
    let colour = |c: Option<[f64; 3]>| Rgb(c.unwrap_or_default());
    Material {
        name: from.name.clone(),
        reflectance: colour(from.diffuse),
        emission: colour(from.emissive),
    }
}

/// Adds the faces of `mesh`, which are the next ones of `lines`.
fn add<'f>(
    scene: &mut Scene,
    mesh: &tobj::Mesh,
    faces: &mut impl Iterator<Item = &'f Face>,
    summary: &mut Summary,
    (path, z_up): (&str, bool),
) -> Result<(), SceneError> {
    let Some(material) = mesh.material_id else {
        return Ok(());
    };
    let (points, _) = mesh.positions.as_chunks::<3>();
    let mut rest = mesh.indices.as_slice();
    // tobj leaves the arities out where every face of the mesh is a triangle.
    let triangles = [3].iter().cycle().take(rest.len() / 3);
    let all_triangles = mesh.face_arities.is_empty();
    let arities = mesh.face_arities.iter();
    for arity in triangles.take_while(|_| all_triangles).chain(arities) {
        let Some((indices, later)) = rest.split_at_checked(*arity as usize) else {
            break;
        };
        rest = later;
        let corners = indices.iter().filter_map(|i| points.get(*i as usize));
        let vertices = corners.map(|[x, y, z]| turned(vec3(*x, *y, *z), z_up));
        let line = faces.next().map_or(0, |f| f.line);
        let refuse = |reason| SceneError::Line {
            path: path.to_owned(),
            line,
            reason,
        };
        let parts = polygon::planar(vertices.collect()).map_err(|e| refuse(e.into()))?;
        match parts.len() {
            0 => summary.dropped += 1,
            1 => summary.faces += 1,
            _ => {
                summary.faces += 1;
                summary.bent += 1;
            }
        }
        for vertices in parts {
            if scene.polygons.len() == POLYGON_LIMIT {
                return Err(refuse(gate::limit("polygons", POLYGON_LIMIT)));
            }
            scene.polygons.push(Polygon { vertices, material });
        }
    }
    Ok(())
}

fn turned(vertex: Vec3, z_up: bool) -> Vec3 {
    if z_up { vertex } else { vertex.y_up_to_z_up() }
}

#[cfg(test)]
mod tests;
