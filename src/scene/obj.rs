//! Wavefront OBJ with MTL to a [`Scene`].
//!
//! Invariants: what comes out keeps the promises of [`crate::scene`] as far as they can be told
//! polygon by polygon: finite, planar, of positive area, with a material whose reflectance lies in
//! 0..1. A file that breaks them is refused with its name and line, except that polygons without
//! area are dropped and bent ones cut into triangles, as every exporter writes some of those.
//!
//! Not read: textures (`map_Kd`), normals, texture coordinates, lines, points, curves. Kd is the
//! diffuse reflectance, Ke the emitted luminance; either is black where the MTL does not give it.

mod read;

use std::path::Path;

use self::read::{Face, Materials, Obj};
use super::import::{SceneError, Summary};
use super::polygon::{self, ShapeError};
use super::{Polygon, Scene};
use crate::files::Files;
use crate::geometry::Vec3;

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
    #[error("emitted luminance {0} is negative")]
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
    let refuse = |line, reason| SceneError::Line {
        path: path.to_owned(),
        line,
        reason,
    };
    let obj = Obj::new(path, bytes)?;
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let mut materials = Materials::default();
    for library in &obj.libraries {
        let path = folder.join(library).to_string_lossy().into_owned();
        materials.read(&path, &files.read(&path)?)?;
    }
    let mut groups = Vec::with_capacity(obj.groups.len());
    for group in obj.groups {
        let known = materials.by_name.get(&group.material);
        let unknown = || {
            refuse(
                group.line,
                LineError::UnknownMaterial(group.material.clone()),
            )
        };
        groups.push((*known.ok_or_else(unknown)?, group.faces));
    }
    let mut scene = Scene {
        materials: materials.list,
        polygons: Vec::new(),
    };
    let mut summary = Summary::default();
    let numbered =
        |(material, faces): (usize, Vec<Face>)| faces.into_iter().map(move |face| (material, face));
    for (material, Face { line, corners }) in groups.into_iter().flat_map(numbered) {
        let corners = corners.into_iter().map(|corner| turned(corner, z_up));
        let parts = polygon::planar(corners.collect()).map_err(|e| refuse(line, e.into()))?;
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
                return Err(refuse(line, read::limit("polygons", POLYGON_LIMIT)));
            }
            scene.polygons.push(Polygon { vertices, material });
        }
    }
    Ok((scene, summary))
}

fn turned(vertex: Vec3, z_up: bool) -> Vec3 {
    if z_up { vertex } else { vertex.y_up_to_z_up() }
}

#[cfg(test)]
mod tests;
