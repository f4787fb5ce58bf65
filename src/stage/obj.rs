//! Reads Wavefront OBJ with MTL to a [`Scene`].
//!
//! Invariants: the result keeps the invariants of [`crate`] that concern single polygons: finite,
//! planar, of positive area, with a material whose reflectance lies in 0..1. A file that breaks
//! them is refused with its name and line, except that polygons without area are dropped and bent
//! ones cut into triangles, because every exporter writes some.
//!
//! Not read: lines, points, curves, faces of two corners and vertex colours, which are reported;
//! textures that are not colours. Kd is the diffuse reflectance, Ke the emitted luminance; each
//! defaults to black. Ns, Ks and illum give gloss by Blender's convention.

mod material;
mod read;

use std::collections::BTreeSet;
use std::path::Path;

use self::material::{Materials, Moved};
use self::read::{Group, Obj};
use super::shading::{Corner, Shading};
use super::stage_file::{
    Imported, Options, POLYGON_LIMIT, SceneError, UNSTATED, VERTEX_LIMIT, limit,
};
use super::texture::reader::TextureReader;
use super::{Material, Polygon, Scene};
use footlight_host::files::{FileError, Files};
use footlight_show::geometry::Vec3;
use footlight_show::geometry::polygon::{self, ShapeError};
use footlight_show::units::Rgb;

/// Most corners of one face.
pub const CORNER_LIMIT: usize = 256;

/// Reads the OBJ file `path` with these bytes, and the MTL files and images that it names (relative
/// to their own folders), through `files`. OBJ is Y up by custom and is turned, unless the options
/// say otherwise.
///
/// Materials keep the order of the MTL files, used or not, because a show may name them; polygons
/// keep the order of the file. The scene may have no polygons. Also returns statistics of its faces.
///
/// # Errors
/// [`SceneError`] for files that cannot be read, malformed or truncated lines, numbers that are not
/// finite, reflectances outside 0..1, missing vertices, and too much of anything.
pub(super) fn parse(
    files: &dyn Files,
    path: &str,
    bytes: &[u8],
    options: &Options,
    memory: usize,
) -> Result<Imported, SceneError> {
    let refuse = |line, reason| SceneError::Line {
        path: path.to_owned(),
        line,
        reason,
    };
    let mut obj = Obj::new(path, bytes)?;
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let unread = obj.unread.iter();
    let mut left_out: BTreeSet<String> = unread
        .map(|(what, line)| format!("{what} (line {line})"))
        .collect();
    let mut materials = Materials::default();
    for libraries in &obj.libraries {
        let beside = |name: &str| {
            let path = folder.join(name.replace('\\', "/"));
            path.to_string_lossy().into_owned()
        };
        // One name with blanks, or several names.
        let several = match files.read(&beside(libraries)) {
            Err(FileError::Missing(_)) => read::names_of_libraries(libraries),
            _ => vec![libraries.as_str()],
        };
        for library in several {
            let path = beside(library);
            match files.read(&path) {
                Ok(bytes) => materials.read(&path, &bytes)?,
                Err(error @ FileError::Missing(_)) => {
                    left_out.insert(format!("the materials of `{library}`: {error}"));
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
    let mut by_name = std::mem::take(&mut materials.by_name);
    let mut textures = TextureReader::new(memory);
    let mut checked = materials.checked();
    let (list, mut moved) = materials.finish(files, &mut textures, options.matt, &mut left_out);
    let mut out = Imported {
        scene: Scene {
            materials: list,
            ..Scene::default()
        },
        ..Imported::default()
    };
    let groups = std::mem::take(&mut obj.groups);
    for Group {
        material,
        part,
        faces,
    } in groups
    {
        if faces.is_empty() {
            continue;
        }
        let name = material.as_ref().map_or("default", |(name, _)| name);
        let material = *by_name.entry(name.to_owned()).or_insert_with(|| {
            left_out.insert(match &material {
                None => format!(
                    "faces without a material (`usemtl`): they are of `default`, which reflects {UNSTATED}"
                ),
                Some((_, line)) => format!(
                    "material `{name}` (line {line}) is not defined: it reflects {UNSTATED}"
                ),
            });
            let unstated = Material::diffuse(name, Rgb([UNSTATED; 3]));
            out.scene.materials.push(unstated);
            out.scene.materials.len() - 1
        });
        if let Some((fault, is_unstated)) = checked.get_mut(material) {
            if let Some(fault) = fault.take() {
                return Err(fault);
            }
            if *is_unstated {
                left_out.insert(format!(
                    "material `{name}` has no `Kd` in red, green and blue: it reflects {UNSTATED}"
                ));
            }
        }
        let moved_by = moved.get(material).cloned().flatten();
        let material = out.part(part.as_deref(), material, &options.parts);
        moved.resize(out.scene.materials.len(), None);
        for face in faces {
            let corner =
                |own: &read::Indices| obj.corner(*own).turned(options.z_up, moved_by.as_ref());
            let corners: Vec<Corner> = face.corners.iter().map(corner).collect();
            let line = face.line;
            out.face(&corners, material)
                .map_err(|e| refuse(line, e.to_string()))?;
            if out.scene.polygons.len() > POLYGON_LIMIT {
                return Err(refuse(line, limit("polygons", POLYGON_LIMIT)));
            }
        }
    }
    out.summary.left_out = left_out.into_iter().collect();
    Ok(out)
}

impl Imported {
    /// Adds a face: one polygon, or triangles when it is bent or its values are not linear.
    fn face(&mut self, corners: &[Corner], material: usize) -> Result<(), ShapeError> {
        let points: Vec<Vec3> = corners.iter().map(|c| c.point).collect();
        let mut parts = polygon::planar(points)?;
        let mut bent = parts.len() > 1;
        if let [whole] = parts.as_slice()
            && Shading::of_corners(&standing(whole, corners)).is_err()
            && whole.len() <= polygon::BENT_LIMIT
            && let Some(triangles) = polygon::triangles(whole)
        {
            parts = triangles;
            bent = true;
        }
        match parts.len() {
            0 => self.summary.dropped += 1,
            _ => self.summary.faces += 1,
        }
        self.summary.bent += usize::from(bent);
        for vertices in parts {
            let shading = Shading::of_corners(&standing(&vertices, corners));
            self.scene.polygons.push(Polygon {
                shading: shading.ok().flatten().map(Box::new),
                ..Polygon::new(vertices, material)
            });
        }
        Ok(())
    }
}

/// The corners at these vertices of a face.
fn standing(vertices: &[Vec3], corners: &[Corner]) -> Vec<Corner> {
    let at = |v: &Vec3| {
        let own = corners.iter().find(|c| c.point == *v).copied();
        own.unwrap_or(Corner {
            point: *v,
            ..Corner::default()
        })
    };
    vertices.iter().map(at).collect()
}

impl Corner {
    /// The corner turned to Z up, with its position in the material's image.
    fn turned(self, z_up: bool, moved: Option<&Moved>) -> Corner {
        let up = |v: Vec3| if z_up { v } else { v.y_up_to_z_up() };
        Corner {
            point: up(self.point),
            normal: self.normal.map(up),
            place: moved.and_then(|m| Some(m.place(self.place?))),
        }
    }
}

#[cfg(test)]
mod tests;
